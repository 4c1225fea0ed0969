"""Simulating a pair of cables, or one, with the exact solver: plain arrays in, plain arrays out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model.exact import run as kernels
from ccmodel.model.exact.cable import (
    C_M,
    C_SLOPE,
    C_T,
    E0,
    FIRST,
    FRONTS,
    GIVEN,
    HI,
    LAST,
    LINE,
    LO,
    M_STILL,
    MODE,
    PAIR,
    SIGMA,
    SLOPE,
    STIFFNESS,
    T_DRIVE,
    T_LOAD,
    TE,
    WHOLE,
    R,
    State,
    blank_state,
    position,
)
from ccmodel.model.exact.path import LUMP, NODE, PASSED, PER_M, X_PER_M, X_START, PathTables, tabulate
from ccmodel.model.exact.still_point import MAX_STEPS, REACHED, step_apart
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, SpringLoad, TorqueLoad, series
from ccmodel.model.response import PairResponse, Status
from ccmodel.model.transmission import Transmission, check_friction

PHASES = ("I", "II", "III", "IVa", "IVb")
# A load that balances to less than this part of the largest tension is balanced.
BALANCE_TOLERANCE = 1e-9


@dataclass(frozen=True)
class CableProfile:
    """Tension along one cable at one sample, at every corner of ln T over arc length and at every piece's end.

    Attributes
    ----------
    x_m : ndarray, shape (k,)
        Arc length from the drive end.
    bend_rad : ndarray, shape (k,)
        Bend angle run through up to there.
    tension_N : ndarray, shape (k,)
    """

    x_m: NDArray
    bend_rad: NDArray
    tension_N: NDArray


@dataclass(frozen=True, kw_only=True)
class ExactResponse(PairResponse):
    """What the exact solver says beyond every solver's response; a start out of balance begins where it settled.

    Attributes
    ----------
    phase : ndarray of int8, shape (n,)
        Index into `PHASES`: I neither cable's drive-end front has reached the load, II one has, III both have, IVa a
        cable is slack while the drive goes on, IVb a cable stays slack through a reversal of the drive.
    moving_A_m, moving_B_m : ndarray, shape (n, 2)
        Arc length up to which the cable has moved from its drive end, and from which on it has moved towards its
        load end, since that end last turned; stuck in between. (L, 0) where it slides as a whole; equal at a still
        point.
    profiles : dict of int to (CableProfile, CableProfile)
        Profiles of A and B at the samples asked for.
    """

    phase: NDArray
    moving_A_m: NDArray
    moving_B_m: NDArray
    profiles: dict


@dataclass(frozen=True)
class FixedEnd:
    """The far end of a single cable does not move."""


@dataclass(frozen=True)
class SpringEnd:
    """The far end holds on to a spring that carries the initial tension there.

    Parameters
    ----------
    stiffness_N_per_m : float
        Rise of the far tension per metre that the far end is drawn in, >= 0.
    """

    stiffness_N_per_m: float

    def __post_init__(self):
        if not (np.isfinite(self.stiffness_N_per_m) and self.stiffness_N_per_m >= 0):
            raise ModelError(f"a far spring's stiffness is finite and not negative; got {self.stiffness_N_per_m}")


@dataclass(frozen=True)
class ForceEnd:
    """The far tension is known at every sample, N; linear in between."""

    tension_N: NDArray


@dataclass(frozen=True)
class MotionEnd:
    """The displacement of the far end is known at every sample, m, positive into the conduit; linear in between."""

    displacement_m: NDArray


@dataclass(frozen=True)
class CableResponse:
    """What a single cable did, sample by sample.

    Attributes
    ----------
    T_near_N, T_far_N : ndarray, shape (n,)
        Tensions at the driven and at the far end.
    far_displacement_m : ndarray, shape (n,)
        Displacement of the far end, positive into the conduit.
    moving_m : ndarray, shape (n, 2)
        As `ExactResponse.moving_A_m`.
    status : Status
    reached : int
    profiles : dict of int to CableProfile
    """

    T_near_N: NDArray
    T_far_N: NDArray
    far_displacement_m: NDArray
    moving_m: NDArray
    status: Status
    reached: int
    profiles: dict


def simulate_pair(
    transmission: Transmission,
    load: SpringLoad | TorqueLoad | AngleLoad,
    theta_in_rad: NDArray,
    initial: InitialTension,
    record_profiles_at: Sequence[int] = (),
) -> ExactResponse:
    """Response of a pull-pull pair to a motion of its drive pulley, exactly, by Coulomb friction alone.

    The result does not depend on time, only on the order of the samples; between samples drive and load law are
    linear. A spring starts where it holds the initial tensions; a given torque, or a load that turns freely, that does
    not hold them settles first with the drive at rest.

    Parameters
    ----------
    transmission : Transmission
        Path, cables and pulleys.
    load : SpringLoad, TorqueLoad or AngleLoad
        What the load pulley drives; series have one value a sample of the drive.
    theta_in_rad : ndarray, shape (n,)
        Angle of the drive pulley, zero where the initial tension stands; the first sample may be elsewhere.
    initial : InitialTension
        Tension with both pulleys at angle zero.
    record_profiles_at : sequence of int
        Samples at which the tension along both cables is kept.

    Returns
    -------
    ExactResponse

    Raises
    ------
    ModelError
        If an input is not finite, a load series does not match the drive's samples, or friction cannot hold the
        initial tension.
    """
    theta_in = series(theta_in_rad, "theta_in_rad")
    R_i, R_o = transmission.drive_radius_m, transmission.load_radius_m
    given, stiffness, start = (np.zeros(1), 1.0), 0.0, 0.0
    if isinstance(load, SpringLoad):
        stiffness = load.stiffness_Nm_per_rad / R_o**2
        if stiffness > 0:
            held = initial.tension_A_N[-1] - initial.tension_B_N[-1]
            given, start = (np.array([held]), 1.0), held / stiffness
    elif isinstance(load, TorqueLoad):
        load.check_alone()
        given = _matching(load.torque_Nm, theta_in, "torque_Nm"), 1 / R_o
    elif isinstance(load, AngleLoad):
        given = _matching(load.angle_rad, theta_in, "angle_rad"), R_o
    else:
        raise TypeError(f"a load is a SpringLoad, a TorqueLoad or an AngleLoad; got {type(load).__name__}")
    run = _Run(transmission.path, transmission.friction_coefficient, transmission.axial_rigidity_N, initial)
    run.simulate((theta_in, R_i), given, stiffness, isinstance(load, AngleLoad), record_profiles_at)
    T1, T2, T3, T4, theta_out = run.out[:5]
    theta_out += start
    theta_out /= R_o
    return ExactResponse(
        T1_N=T1,
        T2_N=T2,
        T3_N=T3,
        T4_N=T4,
        theta_out_rad=theta_out,
        tau_in_Nm=_torque(T1, T3, R_i),
        tau_out_Nm=_torque(T2, T4, R_o),
        phase=run.phase,
        moving_A_m=run.out[5:7].T,
        moving_B_m=run.out[7:9].T,
        status=run.status(),
        reached=run.reached,
        profiles=run.profiles,
    )


def _torque(pulled: NDArray, released: NDArray, radius: float) -> NDArray:
    torque = pulled - released
    torque *= radius
    return torque


def simulate_cable(
    path: ConduitPath,
    axial_rigidity_N: float,
    friction_coefficient: float,
    far_end: FixedEnd | SpringEnd | ForceEnd | MotionEnd,
    displacement_m: NDArray,
    initial: InitialTension,
    record_profiles_at: Sequence[int] = (),
) -> CableResponse:
    """Response of one cable, cable A of `initial`, to a motion of its near end; the same solver as for a pair.

    Parameters
    ----------
    path : ConduitPath
        From the near, driven end to the far end.
    axial_rigidity_N : float
        EA, N.
    friction_coefficient : float
        mu between cable and conduit.
    far_end : FixedEnd, SpringEnd, ForceEnd or MotionEnd
        What holds the far end.
    displacement_m : ndarray, shape (n,)
        Displacement of the near end, positive out of the conduit (a pull), zero where the initial tension stands.
    initial : InitialTension
        Its cable B plays no part.
    record_profiles_at : sequence of int
        Samples at which the tension along the cable is kept.

    Returns
    -------
    CableResponse
    """
    if not 0 < axial_rigidity_N < np.inf:
        raise ModelError(f"axial_rigidity_N must be positive and finite; got {axial_rigidity_N}")
    check_friction(friction_coefficient, path)
    drive = series(displacement_m, "displacement_m")
    given, stiffness, moves = np.zeros(1), 0.0, isinstance(far_end, FixedEnd | MotionEnd)
    if isinstance(far_end, SpringEnd):
        given, stiffness = initial.tension_A_N[-1:].copy(), far_end.stiffness_N_per_m
    elif isinstance(far_end, ForceEnd):
        given = _matching(far_end.tension_N, drive, "tension_N")
    elif isinstance(far_end, MotionEnd):
        given = _matching(far_end.displacement_m, drive, "displacement_m of the far end")
    elif not isinstance(far_end, FixedEnd):
        raise TypeError(f"a far end is a FixedEnd, SpringEnd, ForceEnd or MotionEnd; got {type(far_end).__name__}")
    run = _Run(path, friction_coefficient, axial_rigidity_N, initial, single=True)
    run.simulate((drive, 1.0), (given, 1.0), stiffness, moves, record_profiles_at)
    return CableResponse(
        T_near_N=run.out[0],
        T_far_N=run.out[1],
        far_displacement_m=run.out[4],
        moving_m=run.out[5:7].T,
        status=run.status(),
        reached=run.reached,
        profiles={i: profiles[0] for i, profiles in run.profiles.items()},
    )


class _Run:
    """State and outputs of one simulation, between the kernels' calls."""

    def __init__(self, path, friction_coefficient, axial_rigidity_N, initial, single=False):
        self.path = path
        self.friction = friction_coefficient
        self.tables: PathTables = tabulate(path, friction_coefficient, axial_rigidity_N)
        self.present = np.array([True, not single])
        m, slope_A, slope_B = initial.log_slopes(path, friction_coefficient)
        self.state: State = blank_state(4 * kernels.MARGIN + 2 * m.size)
        for c, (tension, slope) in enumerate(((initial.tension_A_N, slope_A), (initial.tension_B_N, slope_B))):
            if self.present[c]:
                _set_initial(self.state, self.tables, c, m, tension, slope)
            else:
                # A cable that is not there is one without stiffness that hangs slack for ever.
                self.state.value[c, E0] = -1e30
                self.state.kind[c, MODE] = WHOLE
                self.state.kind[c, LINE] = -1
        self.state.value[PAIR, GIVEN] = self.state.value[0, T_LOAD] - self.state.value[1, T_LOAD]

    def simulate(self, drive, given, stiffness, angle_given, record_at):
        n = drive[0].size
        out, phase = np.empty((9, n)), np.empty(n, dtype=np.int8)
        progress = np.array([0, 0, 0])
        self.profiles, self.balance = {}, np.zeros(2)
        if not angle_given:
            self._settle(kernels.at_sample(given, 0), stiffness)
        stops = [*sorted({int(i) for i in record_at}), n - 1]
        if stops[0] < 0 or stops[-1] >= n or max(stops) > n - 1:
            raise ModelError(f"record_profiles_at names samples from 0 to {n - 1}")
        code = kernels.DONE
        for stop in stops:
            up_to_stop = drive[0][: stop + 1], drive[1]
            code = self._advance(progress, up_to_stop, given, stiffness, angle_given, out, phase)
            if code != kernels.DONE:
                break
            if stop in record_at:
                self.profiles[stop] = tuple(self._profile(c) for c in range(1 + self.present[1]))
        self.code, self.reached = code, int(progress[0])
        self.out, self.phase = out[:, : self.reached], phase[: self.reached]

    def _settle(self, given, stiffness):
        """Let the load find its balance before the drive moves."""
        out, phase = np.empty((9, 1)), np.empty(1, dtype=np.int8)
        at_rest, given = (np.zeros(1), 1.0), (np.array([given]), 1.0)
        self._advance(np.array([0, 0, 0]), at_rest, given, stiffness, False, out, phase)
        self.balance[:] = 0.0

    def _advance(self, progress, drive, given, stiffness, angle_given, out, phase):
        trials = (_trial(self.state), _trial(self.state))
        apart_at, times, steps = -1, 0, 0
        while True:
            code = kernels.run(
                self.tables,
                self.state,
                trials,
                progress,
                drive,
                angle_given,
                given,
                stiffness,
                self.present,
                out,
                phase,
                self.balance,
            )
            if code == kernels.APART:
                i = progress[0]
                if i != apart_at:
                    apart_at, times, steps = i, 0, 0
                times += 1
                ends = kernels.at_sample(drive, i), kernels.at_sample(given, i)
                code, taken = step_apart(
                    self.tables, self.state, trials, ends, stiffness, angle_given, MAX_STEPS - steps
                )
                steps += taken
                if code != REACHED or times > kernels.MAX_EVENTS or steps >= MAX_STEPS:
                    return kernels.STUCK
            elif code == kernels.CORNERS_FULL:
                self.state = _with_room(self.state)
                trials = (_trial(self.state), _trial(self.state))
            else:
                return code

    def status(self):
        """Whether every sample was reached, and the load balanced at each."""
        if self.code != kernels.DONE:
            return Status.STUCK
        out_of_balance, highest = self.balance
        return Status.UNBALANCED if out_of_balance > BALANCE_TOLERANCE * max(highest, 1e-9) else Status.OK

    def _profile(self, c) -> CableProfile:
        m, tension = _corners(self.state, self.tables, c)
        x_piece = np.concatenate([[0.0], np.cumsum(self.path.piece_length_m)])
        m_piece = self.friction * np.concatenate([[0.0], np.cumsum(self.path.piece_bend_rad)])
        table = self.tables.table[0]
        within = m[(m > 0) & (m < self.tables.total)]
        piece = np.clip(np.searchsorted(table[NODE], within, side="right") - 1, 0, None)
        x = np.concatenate([x_piece, table[X_START, piece] + table[X_PER_M, piece] * (within - table[NODE, piece])])
        m_all = np.concatenate([m_piece, within])
        order = np.lexsort((m_all, x))
        log_tension = np.log(tension) if tension.min() > 0 else np.full(tension.size, -np.inf)
        values = np.exp(np.interp(m_all[order], m, log_tension)) if tension.min() > 0 else np.zeros(x.size)
        return CableProfile(x[order], self.path.bend_at(x[order]), values)


def _set_initial(state: State, tables: PathTables, c: int, m, tension, slope):
    """Write an initial profile into the list of corners."""
    low = (state.corner.shape[2] - m.size) // 2
    place = slice(low, low + m.size)
    state.corner[C_M, c, place], state.corner[C_T, c, place] = m, tension
    state.corner[C_M, c, low + m.size - 1] = tables.total
    state.corner[C_SLOPE, c, low : low + m.size - 1] = slope
    state.kind[c, [LO, FIRST]], state.kind[c, [HI, LAST]] = low, low + m.size - 1
    state.value[c, T_DRIVE], state.value[c, T_LOAD] = tension[0], tension[-1]
    state.value[c, E0] = _elongation(tables, m, tension, slope)
    # On a line of slope +1 compliance per drive-end tension is that of sigma = -1.
    state.value[c, STIFFNESS : STIFFNESS + 2] = 1.0 / tables.table[0, [PASSED + 1, PASSED], -1]
    if tables.total == 0.0 or tension[0] == 0.0:
        state.kind[c, MODE] = WHOLE
        state.kind[c, LINE] = -1


def _elongation(tables: PathTables, m, tension, slope) -> float:
    """Stretch of a profile: the integral of T dx / EA, m."""
    at = np.union1d(m, tables.table[0, NODE])
    segment = np.clip(np.searchsorted(m, at[:-1], side="right") - 1, 0, max(m.size - 2, 0))
    start = tension[segment] * np.exp(slope[segment] * (at[:-1] - m[segment]))
    run = np.diff(at)
    rise = slope[segment] * run
    mean = np.divide(np.expm1(rise), rise, out=np.ones_like(rise), where=rise != 0)
    total = 0.0
    if run.size:
        piece = np.clip(np.searchsorted(tables.table[0, NODE], at[:-1], side="right") - 1, 0, tables.table.shape[2] - 2)
        total = float((tables.table[0, PER_M][piece] * start * mean * run).sum())
    at_node = np.clip(np.searchsorted(m, tables.table[0, NODE], side="right") - 1, 0, m.size - 2)
    values = tension[at_node] * np.exp(slope[at_node] * (tables.table[0, NODE] - m[at_node]))
    return total + float((tables.table[0, LUMP] * values).sum())


def _trial(state: State) -> State:
    """Room to keep a state in; what a trial never changes is shared."""
    return state._replace(front=state.front.copy(), value=state.value.copy(), kind=state.kind.copy())


def _with_room(state: State) -> State:
    """The same state with its corners in the middle of arrays at least twice as long as what they hold."""
    used = int((state.kind[:, LAST] - state.kind[:, FIRST]).max()) + 1
    larger = blank_state(2 * used + 8 * kernels.MARGIN)
    for c in range(2):
        first, last = state.kind[c, FIRST], state.kind[c, LAST]
        low = (larger.corner.shape[2] - (last - first + 1)) // 2
        larger.corner[:, c, low : low + last - first + 1] = state.corner[:, c, first : last + 1]
        state.kind[c, [LO, HI, FIRST, LAST]] += low - first
    return state._replace(corner=larger.corner)


def _corners(state: State, tables: PathTables, c: int):
    """The whole profile of cable `c` as corners, m from the drive end and T, fronts' lines included."""
    ends = state.value[c, T_DRIVE], state.value[c, T_LOAD]
    kind = state.kind[c]
    if kind[MODE] == WHOLE:
        return np.array([0.0, max(tables.total, 0.0)]), np.array(ends)
    if kind[MODE] != FRONTS:
        still = state.value[c, M_STILL]
        return np.array([0.0, still, tables.total]), np.array([ends[0], ends[0] * np.exp(-kind[LINE] * still), ends[1]])
    points = []
    for end in range(2):
        if state.kind[c, SIGMA + 3 * end]:
            front = state.front[2 * c + end]
            tension = front[TE] * np.exp(front[SLOPE] * np.log1p(front[R]))
            points.append((abs(end * tables.total - position(state, c, end)), tension))
    limits = [p[0] for p in points]
    low = limits[0] if state.kind[c, SIGMA] else 0.0
    high = limits[-1] if state.kind[c, SIGMA + 3] else tables.total
    for i in range(kind[LO], kind[HI] + 1):
        if low < state.corner[C_M, c, i] < high:
            points.append((state.corner[C_M, c, i], state.corner[C_T, c, i]))
    points = [(0.0, ends[0]), *sorted(points), (tables.total, ends[1])]
    return np.array([p[0] for p in points]), np.array([p[1] for p in points])


def _matching(values, drive: NDArray, name: str) -> NDArray:
    values = series(values, name)
    if values.size != drive.size:
        raise ModelError(f"{name} has {values.size} samples, the drive has {drive.size}")
    return values
