"""The general solver: sets up the march, runs it and simulates the sensors' readings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.failure import ModelError
from ccmodel.mechanisms.contract import Sensing, Settings
from ccmodel.mechanisms.load_dependent_friction import FLOOR_N, REFERENCE_N
from ccmodel.mechanisms.load_inertia import load_damping
from ccmodel.mechanisms.pulley_eccentricity import winding
from ccmodel.mechanisms.pulley_friction import bearing
from ccmodel.mechanisms.strand_settling import stretch_at
from ccmodel.model.general import march as rows
from ccmodel.model.general.grid import Grid, make_grid
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, MechanicalLoad, SpringLoad, TorqueLoad
from ccmodel.model.response import PairResponse, Status
from ccmodel.model.transmission import Transmission

ELEMENTS = 32
# A ringing load advances by at most this phase in a step, with at most so many steps a sample.
RINGING_STEP_RAD, MOST_STEPS = 0.15, 16
# Fixed-point iterations; each reduces the error by the ratio of the fault to the reading.
FAULTS_ROUNDS = 8

Load = SpringLoad | MechanicalLoad | TorqueLoad | AngleLoad


@dataclass(frozen=True)
class Active:
    """A mechanism that is in a model.

    Attributes
    ----------
    name : str
        One of `ccmodel.mechanisms.names()`.
    place : str
        One of the mechanism's places.
    values : mapping of str to float
        A value for each of its parameters.
    """

    name: str
    place: str
    values: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class GeneralResponse(PairResponse):
    """Response of the general solver; tau_out is the torque beyond the load's bearing.

    Attributes
    ----------
    time_s : ndarray, shape (n,)
    read : mapping of str to ndarray
        What the sensors would read: theta_in_rad, theta_out_rad, tau_in_Nm, tau_out_Nm, F_drive_N, F_load_N.
    newton_iterations, substeps : int
        Work done.
    loose_steps : int
        Steps that were taken though out of balance by up to 1e-5 of the highest tension.
    """

    time_s: NDArray
    read: Mapping[str, NDArray]
    newton_iterations: int
    substeps: int
    loose_steps: int


def simulate(
    transmission: Transmission,
    load: Load,
    time_s: NDArray,
    theta_in: NDArray,
    initial: InitialTension,
    mechanisms: Mapping[str, Mapping] | Sequence[Active] = (),
    elements: int = ELEMENTS,
    steps: int = 1,
) -> GeneralResponse:
    """Run the pair through a motion of the drive pulley.

    Parameters
    ----------
    transmission : Transmission
    load : SpringLoad, MechanicalLoad, TorqueLoad or AngleLoad
    time_s : ndarray, shape (n,)
        Sample times, s, increasing.
    theta_in : ndarray, shape (n,)
        Drive angle at each sample, rad; the first is the angle at which `initial` holds. Linear in between.
    initial : InitialTension
    mechanisms : sequence of Active, or mapping of name to {"place": ..., "values": {...}}
        Mechanisms on top of the paper's physics. A mapping may omit the place of a mechanism that has only one, and
        the values, which then are the mechanism's starting values.
    elements : int
        Cells of each cable.
    steps : int
        Steps from one sample to the next; as many times what a load that rings needs.

    Returns
    -------
    GeneralResponse
        With a status: a step without a solution breaks the run off, and what was solved until then is returned.

    Raises
    ------
    ModelError
        If an input is not finite or of the wrong shape.
    ccmodel.mechanisms.UnknownMechanismError
        If there is no mechanism of a name.
    """
    time_s, theta_in = (np.ascontiguousarray(a, dtype=float) for a in (time_s, theta_in))
    active = _active(mechanisms)
    settings = settings_of(active)
    series = _series(load)
    _check(time_s, theta_in, series, elements)
    series = np.zeros(1) if series is None else series

    grid = make_grid(transmission.path, elements, settings.kinks)
    physics = _physics(transmission, load, settings, elements)
    piece, node = _constants(transmission, settings, grid)
    course = np.ones(1)
    if settings.friction_history is not None:
        travel_m = transmission.drive_radius_m * np.abs(np.diff(theta_in, prepend=theta_in[0])).cumsum()
        course = settings.friction_history(time_s, travel_m)
    mean, state = np.zeros((rows.MEAN_ROWS, 2)), np.zeros(rows.LOAD_ROWS)
    T = _initial_state(physics, piece, node, settings, initial.at(grid.boundary_m, grid.held_rad), course[0])
    mean[rows.MEAN] = (piece[rows.SHARE] * T).sum(axis=1)
    state[rows.ANGLE] = _load_angle(physics, T, load, series)
    slide = np.zeros((rows.SLIDE_ROWS, 2, node.shape[2] + 2))
    drive = tuple(map(float, (transmission.drive_radius_m, *settings.drive_eccentricity)))
    out, counts = np.empty((7, time_s.size)), np.zeros(3, dtype=np.int64)
    steps *= _steps(physics, transmission, time_s)
    solved = rows.march(
        physics, piece, node, slide, mean, state, time_s, theta_in, drive, course, series, steps, out, counts
    )

    status = Status.OK if solved == time_s.size else Status.NO_CONVERGENCE
    time_s, theta_in, out = time_s[:solved], theta_in[:solved], out[:, :solved]
    T1, T2, T3, T4, theta_out, tau_out, tau_in = out
    if isinstance(load, TorqueLoad) and load.beside_Nm_per_rad:
        tau_out = series[:solved]  # what the sensor feels
    if settings.drive_friction_Nm != 0.0:
        rubs = bearing(theta_in, settings.drive_presliding_rad)
        rubs *= settings.drive_friction_Nm
        tau_in += rubs
    channels = {
        "theta_in_rad": theta_in,
        "theta_out_rad": theta_out,
        "tau_in_Nm": tau_in,
        "tau_out_Nm": tau_out,
        "F_drive_N": T1 + T3,
        "F_load_N": T2 + T4,
    }
    read = _read(active, time_s, channels, (transmission.drive_radius_m, transmission.load_radius_m))
    return GeneralResponse(
        T1_N=T1,
        T2_N=T2,
        T3_N=T3,
        T4_N=T4,
        theta_out_rad=theta_out,
        tau_in_Nm=tau_in,
        tau_out_Nm=tau_out,
        status=status,
        reached=solved,
        time_s=time_s,
        read=read,
        newton_iterations=int(counts[0]),
        substeps=int(counts[1]),
        loose_steps=int(counts[2]),
    )


def settings_of(mechanisms: Mapping[str, Mapping] | Sequence[Active]) -> Settings:
    """The solver's settings with mechanisms, which are given as to `simulate`."""
    settings = registry.neutral_settings()
    for a in _active(mechanisms):
        mechanism = registry.get(a.name)
        if mechanism.modifies_physics is not None:
            try:
                mechanism.modifies_physics(settings, a.place, a.values)
            except ValueError as e:
                raise ModelError(str(e)) from None
    return settings


def load_law(settings: Settings, load: SpringLoad, time_s: NDArray, theta: NDArray, start_Nm: float) -> NDArray:
    """Torque (N m, shape (n,)) of a spring load with what acts on it, along a course of its pulley.

    Parameters
    ----------
    settings : Settings
    load : SpringLoad
    time_s, theta : ndarray, shape (n,)
        The pulley's course; only its changes matter.
    start_Nm : float
        Torque before it.
    """
    stiffness, K3 = load.stiffness_Nm_per_rad, settings.cubic_stiffness
    angle = theta - theta[0] + _rest_angle(stiffness, K3, settings.half_gap, start_Nm, load)
    beyond = np.sign(angle) * np.maximum(np.abs(angle) - settings.half_gap, 0.0)
    speed = np.gradient(theta, time_s)
    inertial = load_damping(settings, stiffness) * speed + settings.inertia * np.gradient(speed, time_s)
    return stiffness * beyond + K3 * beyond**3 + inertial


def _active(mechanisms) -> list[Active]:
    given = []
    if isinstance(mechanisms, Mapping):
        for name, entry in mechanisms.items():
            known = registry.get(name)
            place = entry.get("place", known.places[0] if len(known.places) == 1 else None)
            given.append(Active(name, place, entry.get("values", known.start)))
    else:
        given = list(mechanisms)
    for a in given:
        known = registry.get(a.name)
        if a.place not in known.places:
            raise ModelError(f"{a.name} acts at {' or '.join(known.places)}; got {a.place!r}")
        wanted = {p.name for p in known.parameters}
        if not known.default.keys() | a.values.keys() >= wanted >= a.values.keys():
            raise ModelError(
                f"{a.name} has the parameters {', '.join(sorted(wanted))}; got {', '.join(sorted(a.values)) or 'none'}"
            )
        if not np.isfinite(list(a.values.values())).all():
            raise ModelError(f"{a.name} has a parameter that is not finite: {dict(a.values)}")
        for p in known.parameters:
            if p.low > 0 and not p.signed and a.values.get(p.name, p.default) < 0:
                raise ModelError(
                    f"{a.name} has {p.name} = {a.values[p.name]:g} {p.unit}, which must not be negative; "
                    f"plausible is {p.low:g} to {p.high:g}"
                )
    return [replace(a, values=registry.get(a.name).default | dict(a.values)) for a in given]


def _series(load: Load) -> NDArray | None:
    if isinstance(load, TorqueLoad):
        return np.ascontiguousarray(load.torque_Nm, dtype=float)
    if isinstance(load, AngleLoad):
        return np.ascontiguousarray(load.angle_rad, dtype=float)
    return None


def _check(time_s, theta_in, series, elements):
    if elements < 1:
        raise ModelError(f"each cable needs at least one element; got {elements}")
    if theta_in.ndim != 1 or theta_in.size == 0:
        raise ModelError(f"theta_in is one row of samples, at least one; got an array of shape {theta_in.shape}")
    given = {"time_s": time_s, "theta_in": theta_in}
    if series is not None:
        given["the load's series"] = series
    for name, values in given.items():
        if values.shape != theta_in.shape:
            raise ModelError(f"{name} has {values.size} samples, the drive angle {theta_in.size}")
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise ModelError(f"{name} is not finite at sample {bad[0]}")
    late = np.flatnonzero(np.diff(time_s) <= 0)
    if late.size:
        raise ModelError(f"time_s must increase; it does not at sample {late[0] + 1}")


def _constants(transmission: Transmission, settings: Settings, grid: Grid) -> tuple[NDArray, NDArray]:
    """Rows of pieces and nodes. The ends' compliances are pieces of their own beyond a node without friction."""
    ratio_K, ratio_mu = (np.array([[1.0], [r]]) for r in (settings.stiffness_ratio_B, settings.friction_ratio_B))
    EA = transmission.axial_rigidity_N * ratio_K
    segment, cell, length = grid.segment_m, grid.cell_m, transmission.path.length_m
    drive, extra = settings.drive_end_compliance, int(settings.drive_end_compliance > 0)
    load = settings.load_end_compliance
    cells = slice(extra, extra + cell.size)
    segments = slice(extra, extra + segment.size)
    nodes = cell.size + extra + int(load > 0)
    piece, node = np.zeros((rows.PIECE_ROWS, 2, nodes + 1)), np.zeros((rows.NODE_ROWS, 2, nodes))
    piece[rows.STIFFNESS][:, segments] = EA / segment
    piece[rows.LOST][:, segments] = segment * settings.settling_N / EA
    piece[rows.RELAXING][:, segments] = settings.relaxing_share
    piece[rows.SHARE][:, segments] = segment / length
    node[rows.HALF_BEND][:, cells] = transmission.friction_coefficient * ratio_mu * grid.cell_rad / 2
    node[rows.DRAG][:, cells] = settings.drag_N * cell / length
    node[rows.VISCOUS][:, cells] = settings.viscous * cell
    if drive > 0:
        piece[rows.STIFFNESS][:, 0] = 1 / drive
    if load > 0:
        piece[rows.STIFFNESS][:, -1] = 1 / load
    return piece, node


def _physics(transmission: Transmission, load: Load, settings: Settings, elements: int) -> rows.Physics:
    is_mechanical = isinstance(load, MechanicalLoad)
    K_e = load.stiffness_Nm_per_rad if isinstance(load, SpringLoad | MechanicalLoad) else 0.0
    K_e = load.beside_Nm_per_rad if isinstance(load, TorqueLoad) else K_e
    values = {name: getattr(settings, name) for name in registry.march_settings()}
    values = {n: tuple(map(float, v)) if isinstance(v, tuple) else float(v) for n, v in values.items()}
    values["cubic_stiffness"] += load.cubic_Nm_per_rad3 if is_mechanical else 0.0
    values["inertia"] += load.inertia_kg_m2 if is_mechanical else 0.0
    return rows.Physics(
        has_settling=settings.settling_N > 0,
        has_relaxation=settings.relaxing_share != 0,
        bristle=float(settings.bristle_m)
        if settings.bristle_m > 0
        else _coulomb_bristle(transmission, settings, elements),
        presliding=settings.bristle_m > 0,
        radius=float(transmission.load_radius_m),
        stiffness_load=float(K_e),
        load_damping=float(load_damping(settings, K_e) + (load.damping_Nms_per_rad if is_mechanical else 0.0)),
        kind=rows.PRESCRIBED_ANGLE if isinstance(load, AngleLoad) else rows.IMPEDANCE,
        general_friction=bool(settings.tension_exponent != 0 or settings.drag_N != 0 or settings.viscous != 0),
        **values,
    )


def _steps(physics: rows.Physics, transmission: Transmission, time_s: NDArray) -> int:
    """Steps from one sample to the next that follow a load with mass as it rings on the cables; a power of two.

    More of them where a fit takes a difference over the mass would be a jump, and powers of two have few.
    """
    if physics.inertia == 0 or physics.kind == rows.PRESCRIBED_ANGLE or time_s.size < 2:
        return 1
    cables = 2 * transmission.axial_rigidity_N / transmission.path.length_m * physics.radius**2
    rings_rad_per_s = np.sqrt((cables + physics.stiffness_load) / physics.inertia)
    wanted = rings_rad_per_s * float(np.median(np.diff(time_s))) / RINGING_STEP_RAD
    return int(np.clip(2 ** np.ceil(np.log2(wanted)), 1, MOST_STEPS))


def _coulomb_bristle(transmission: Transmission, settings: Settings, elements: int) -> float:
    over_cable = settings.conduit_compliance * transmission.axial_rigidity_N / transmission.path.length_m
    soft = rows.SOFT_CONDUIT_BRISTLE_M * ELEMENTS / elements
    return max(rows.COULOMB_BRISTLE_M, min(1.0, 10 * over_cable) * soft)


def _initial_state(physics, piece, node, settings, profiles, course) -> NDArray:
    """State in which the cables hold the initial tension, with the bristles that this takes; that tension (N)."""
    T = np.stack(profiles)
    if settings.drive_end_compliance > 0:
        T = np.concatenate([T[:, :1], T], axis=1)
    if settings.load_end_compliance > 0:
        T = np.concatenate([T, T[:, -1:]], axis=1)
    stretch = T / piece[rows.STIFFNESS]
    settles = piece[rows.LOST] > 0
    if settles.any():
        stretch[settles] = stretch_at(T[settles], piece[rows.LOST][settles], piece[rows.STIFFNESS][settles])
    piece[rows.STRETCH], piece[rows.ELASTIC] = stretch, T
    both = T[:, :-1] + T[:, 1:]
    factor = course * (1 + physics.stribeck_rise)
    if physics.tension_exponent != 0:
        factor = factor * (np.hypot(both / 2, FLOOR_N) / REFERENCE_N) ** physics.tension_exponent
    hold = np.tanh(node[rows.HALF_BEND] * factor) * both + node[rows.DRAG]
    xi = np.divide(T[:, :-1] - T[:, 1:], hold, out=np.zeros_like(both), where=hold > 0)
    node[rows.BRISTLE] = np.clip(xi, -1, 1)
    return T


def _load_angle(physics: rows.Physics, T: NDArray, load: Load, series: NDArray) -> float:
    """Angle at which the load holds the initial tensions, rad; 0 for a load without a neutral position."""
    if isinstance(load, AngleLoad):
        return float(series[0])
    K, K3 = physics.stiffness_load, physics.cubic_stiffness
    if isinstance(load, TorqueLoad) or (K == 0 and K3 == 0):
        return 0.0
    theta = 0.0
    for _ in range(50):
        torque = physics.radius * winding(theta, *physics.load_eccentricity)[1] * (T[0, -1] - T[1, -1])
        theta = _rest_angle(K, K3, physics.half_gap, torque, load)
        if physics.load_eccentricity[0] == 0:
            break
    return float(theta)


def _deflection(K: float, K3: float, torque: float) -> float:
    """Angle (rad) at which K z + K3 z^3 is the torque; by Newton's method from the linear spring's."""
    if K == 0:
        return float(np.cbrt(torque / K3))
    z = torque / K
    for _ in range(50 if K3 else 0):
        z -= (K * z + K3 * z**3 - torque) / (K + 3 * K3 * z * z)
    return float(z)


def _rest_angle(K: float, K3: float, half_gap: float, torque: float, load: SpringLoad | MechanicalLoad) -> float:
    """Angle (rad) of a load at rest under the cables' torque (N m).

    A load that the torque holds against its spring lies against a side of its gap. A load without torque may stand
    anywhere in the gap: at `load.rest_gap_position`. The transition lies around the accuracy to which the torque is
    known.
    """
    known_to, place = (load.rest_known_to_Nm, load.rest_gap_position) if isinstance(load, SpringLoad) else (0.0, 0.0)
    held = float(np.clip(2 * abs(torque) / known_to - 1.5, 0.0, 1.0)) if known_to else float(torque != 0)
    side = held * float(np.sign(torque)) + (1 - held) * place
    return _deflection(K, K3, torque) + half_gap * side


def true_at(active: Sequence[Active], seconds: float, read: Mapping[str, float], radii: tuple[float, float]) -> dict:
    """Readings of the sensors without their faults, at a time of a recording in which nothing moves.

    Parameters
    ----------
    active : sequence of Active
    seconds : float
        Since the recording began.
    read : mapping of str to float
        Reading of each channel.
    radii : (float, float)
        Of the drive and the load pulley, m.

    Returns
    -------
    dict of str to float
        The same channels.
    """
    faults = [a for a in active if registry.get(a.name).modifies_observation is not None]
    true = dict(read)
    for _ in range(FAULTS_ROUNDS if faults else 0):
        steady = {c: np.full(2, value) for c, value in true.items()}
        faulty = _read(faults, np.array([0.0, seconds]), steady, radii)
        true = {c: true[c] + read[c] - float(faulty[c][1]) for c in true}
    return true


def _read(active: Sequence[Active], time_s: NDArray, channels: dict[str, NDArray], radii: tuple[float, float]):
    for a in active:
        mechanism = registry.get(a.name)
        if mechanism.modifies_observation is not None:
            sensing = Sensing(time_s, channels, *radii)
            channels = channels | mechanism.modifies_observation(sensing, a.place, a.values)
    return channels
