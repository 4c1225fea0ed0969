"""Set up the march over the samples, run it, and pass its outputs through the sensors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.channels import TAU_IN, TAU_OUT, TENSIONS, THETA_IN, THETA_OUT
from ccmodel.failure import ModelError
from ccmodel.mechanisms.constant_drag import drag_shares
from ccmodel.mechanisms.contract import Sensing, Settings
from ccmodel.mechanisms.learned import end_spring
from ccmodel.mechanisms.load_inertia import load_damping
from ccmodel.mechanisms.presliding import Contacts
from ccmodel.mechanisms.pulley_friction import bearing, torque_under
from ccmodel.mechanisms.relaxation import branch_times
from ccmodel.mechanisms.tables import Table
from ccmodel.mechanisms.winding import Pulley, pulley_of
from ccmodel.model.active import Active, active_of
from ccmodel.model.general import layout as rows
from ccmodel.model.general.grid import Grid, make_grid
from ccmodel.model.general.march import COULOMB_BRISTLE_M, SOFT_CONDUIT_BRISTLE_M, march
from ccmodel.model.general.rest import (
    friction_ratios,
    has_drag,
    has_friction_by_tension,
    initial_state,
    load_angle,
    remove_cable_B,
)
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, FixedLoad, Load, SpringLoad, TorqueLoad, one_row
from ccmodel.model.response import PairResponse, Status
from ccmodel.model.sensors import read_by_sensors
from ccmodel.model.transmission import Transmission

ELEMENTS = 32
# The run that only gives the mean torsion of a drive train has cells of so many times the length.
COARSER = 4
# Outputs of the march, row by row.
OUTPUTS = (*TENSIONS, THETA_OUT, TAU_OUT, TAU_IN, THETA_IN)
# A step covers no more than this phase of a load that rings, up to so many steps a sample. A load that rings faster,
# near half the sampling rate and above, shows its inertia in the samples but not its ringing, and needs only a few.
RINGING_STEP_RAD, MOST_STEPS, UNRESOLVED_STEPS = 0.15, 16, 2
# A ring is followed without added damping (`speed_and_acceleration` in ccmodel.model.general.equations) where friction
# builds up over more than this length, and a step covers no more than this phase of the faster ring on a bearing that
# sticks. On contacts that stick at once, a mass would jump to and fro.
SMOOTH_BRISTLE_M, STUCK_STEP_RAD = 2e-6, 0.8


class Motor(NamedTuple):
    """The motor behind the drive train, and what the drive pulley's own encoder leaves open.

    Attributes
    ----------
    angle_rad : ndarray, shape (n,) or (1,)
        The motor's angle at the drive pulley (over the gear's ratio), from any zero; a single value where it was not
        measured.
    within_rad : float
        The drive pulley's motion is known within this.
    judged : slice
        Samples over which the train's mean torsion is that of the torque in the mean: the angles have no common zero.
    """

    angle_rad: NDArray
    within_rad: float = 0.0
    judged: slice = slice(None)


NO_MOTOR = Motor(np.zeros(1))


@dataclass(frozen=True, kw_only=True)
class GeneralResponse(PairResponse):
    """Response of the general solver; tau_out is the torque on the load's side of the pulley's bearing.

    Attributes
    ----------
    time_s : ndarray, shape (n,)
    read : mapping of str to ndarray
        Readings of the sensors: theta_in_rad, theta_out_rad, tau_in_Nm, tau_out_Nm, F_drive_N, F_load_N.
    drive_angle_rad : ndarray, shape (n,)
        The drive pulley's angle; behind a drive train it differs from theta_in by what the encoder leaves open.
    """

    time_s: NDArray
    read: Mapping[str, NDArray]
    drive_angle_rad: NDArray


def simulate(
    transmission: Transmission,
    load: Load,
    time_s: NDArray,
    theta_in: NDArray,
    initial: InitialTension,
    mechanisms: Sequence[Active] = (),
    elements: int = ELEMENTS,
    steps: int = 1,
    motor: Motor = NO_MOTOR,
) -> GeneralResponse:
    """Run the pair through a motion of the drive pulley.

    Parameters
    ----------
    transmission : Transmission
    load : SpringLoad, TorqueLoad, AngleLoad or FixedLoad
    time_s : ndarray, shape (n,)
        Sample times, s, increasing.
    theta_in : ndarray, shape (n,)
        Drive angle at each sample, rad; the first is the angle at which `initial` holds. Linear in between.
    initial : InitialTension
    mechanisms : sequence of Active
        Effects beyond the paper's physics.
    elements : int
        Cells of each cable.
    steps : int
        Steps from one sample to the next, multiplied by what a ringing load needs.
    motor : Motor
        Moves the drive pulley through a drive train, if `mechanisms` has one.

    Returns
    -------
    GeneralResponse
        A step without a solution ends the run; the samples before it are returned, with a status.

    Raises
    ------
    ModelError
        If an input is not finite or of the wrong shape.
    ccmodel.mechanisms.UnknownMechanismError
        If a mechanism's name is not known.
    """
    time_s, theta_in = one_row(time_s, "time_s"), one_row(theta_in, "theta_in")
    active = active_of(mechanisms)
    settings = settings_of(active)
    series = _series(load)
    _check(time_s, theta_in, series, elements)
    series = np.zeros(1) if series is None else series
    pair = transmission, load, settings, time_s, theta_in, initial
    if settings.train_compliance > 0.0 and motor.angle_rad.size > 1:
        coarse = max(elements // COARSER, 1)
        motor = _zeroed(motor, settings, *_marched(*pair, coarse, steps, series))
    else:
        motor = NO_MOTOR
    solved, out = _marched(*pair, elements, steps, series, motor)
    return _response(transmission, active, time_s[:solved], theta_in[:solved], out)


def _zeroed(motor: Motor, settings: Settings, solved: int, out: NDArray) -> Motor:
    """The motor's angle, whose mean difference from the drive pulley's is the mean torsion of a run without train.

    `solved` and `out` are that run's; without a sample that counts, the motor begins where the pulley does.
    """
    judged = slice(*motor.judged.indices(solved))
    tau_in, theta_in = (out[OUTPUTS.index(channel), judged] for channel in (TAU_IN, THETA_IN))
    torsion = settings.train_compliance * tau_in + settings.train_half_gap * np.sign(tau_in)
    excess = motor.angle_rad[judged] - theta_in - torsion
    zero = excess.mean() if excess.size else motor.angle_rad[0] - out[OUTPUTS.index(THETA_IN), 0]
    return motor._replace(angle_rad=motor.angle_rad - zero)


class Prepared(NamedTuple):
    """A pair at rest, ready to march: the arguments of `ccmodel.model.general.march.march` of the same names."""

    physics: rows.Physics
    piece: NDArray
    node: NDArray
    slide: NDArray
    mean: NDArray
    load: NDArray
    drive: Pulley
    friction_factor: NDArray
    steps: int


def prepared(
    transmission: Transmission,
    load: Load,
    settings: Settings,
    time_s: NDArray,
    theta_in: NDArray,
    initial: InitialTension,
    elements: int,
    steps: int,
    series: NDArray,
    may_ring: bool = False,
) -> Prepared:
    """The pair before the first sample.

    `series` is the load's prescribed torque or angle, shape (n,) or (1,). A load with mass `may_ring` where its
    motion follows from the drive's, and not the other way round.
    """
    grid = make_grid(transmission.path, elements, settings.kinks)
    load_laws = _load_laws(settings, load)
    physics = _physics(transmission, load, settings, load_laws)
    added_rad = _added_bend(settings, grid, transmission.path.length_m)
    piece, node = _constants(transmission, settings, grid, added_rad)
    friction_factor = friction_factors(transmission, settings, time_s, theta_in)
    mean = np.zeros((rows.MEAN_ROWS, 2))
    state = np.concatenate([np.zeros(rows.LOAD_ROWS), *load_laws.values()])
    held_rad = grid.held_rad + np.concatenate([[0.0], np.cumsum(added_rad)])
    tension_A, tension_B = initial.at(grid.boundary_m, held_rad)
    if transmission.is_single_cable:
        tension_B = np.zeros_like(tension_B)
    T = initial_state(physics, piece, node, settings, (tension_A, tension_B), friction_factor[0])
    if transmission.is_single_cable:
        remove_cable_B(piece)
    mean[rows.MEAN] = (piece[rows.SHARE] * T).sum(axis=1)
    state[rows.ANGLE] = load_angle(physics, T, load, series, settings.load_by_angle)
    slide = np.zeros((rows.SLIDE_ROWS, 2, node.shape[2] + 2))
    drive = pulley_at(settings, "drive", transmission.drive_radius_m)
    of_ring, is_followed = _steps(physics, transmission, time_s)
    physics, steps = physics._replace(rings=may_ring and is_followed), steps * of_ring
    return Prepared(physics, piece, node, slide, mean, state, drive, friction_factor, steps)


def _marched(
    transmission: Transmission,
    load: Load,
    settings: Settings,
    time_s: NDArray,
    theta_in: NDArray,
    initial: InitialTension,
    elements: int,
    steps: int,
    series: NDArray,
    motor: Motor = NO_MOTOR,
) -> tuple[int, NDArray]:
    """Number of samples that were solved, and the outputs at all of them, shape (outputs, n).

    Parameters as of `prepared`.
    """
    at = prepared(transmission, load, settings, time_s, theta_in, initial, elements, steps, series, may_ring=True)
    state = at.physics, at.piece, at.node, at.slide, at.mean, at.load
    out = np.empty((len(OUTPUTS), time_s.size))
    drive = motor.angle_rad, motor.within_rad, at.drive
    solved = march(*state, time_s, theta_in, *drive, at.friction_factor, series, at.steps, out)
    if isinstance(load, TorqueLoad):
        # The sensor does not feel what acts beside the measured torque: a spring, a mass, friction of the load.
        out[5, :solved] = np.broadcast_to(series, time_s.shape)[:solved]
    if settings.drive_friction_Nm != 0.0:
        pull = out[0, :solved] + out[2, :solved]
        friction = torque_under(pull, settings.drive_friction_Nm, settings.drive_friction_by_pull)
        out[6, :solved] += friction * bearing(out[7, :solved], settings.drive_presliding_rad)
    return solved, out


def friction_factors(transmission: Transmission, settings: Settings, time_s: NDArray, theta_in: NDArray) -> NDArray:
    """Factor of mu at each sample or throughout, by cable, shape (n, 2) or (1, 2); the same for both cables."""
    factor = np.ones((1, 2))
    radii = transmission.drive_radius_m, transmission.load_radius_m
    motion = Sensing(time_s, {THETA_IN: theta_in}, *radii)
    if settings.friction_history is not None:
        factor = np.repeat(settings.friction_history(time_s, motion.drive_travel_m)[:, None], 2, axis=1)
    if settings.friction_laws:
        added = sum(law(motion) for law in settings.friction_laws)
        factor = factor * (1.0 + added).clip(0.0)[:, None]
    return factor


def _response(
    transmission: Transmission, active: Sequence[Active], time_s: NDArray, theta_in: NDArray, out: NDArray
) -> GeneralResponse:
    """Outputs of the march up to the last sample of `time_s`, and what the sensors read of them."""
    response = PairResponse(
        **{name: row for name, row in zip(OUTPUTS, out[:, : time_s.size], strict=True) if name != THETA_IN},
        status=Status.OK if time_s.size == out.shape[1] else Status.NO_CONVERGENCE,
        reached=time_s.size,
    )
    radii = transmission.drive_radius_m, transmission.load_radius_m
    read = read_by_sensors(active, time_s, response.channels(theta_in), radii)
    return GeneralResponse(**vars(response), time_s=time_s, read=read, drive_angle_rad=out[7, : time_s.size])


def settings_of(mechanisms: Sequence[Active]) -> Settings:
    """What mechanisms tell the solver."""
    settings = registry.neutral_settings()
    for a in active_of(mechanisms):
        try:
            registry.get(a.name).write(settings, a.place, a.values)
        except ValueError as e:
            raise ModelError(str(e)) from None
    return settings


def _series(load: Load) -> NDArray | None:
    if isinstance(load, TorqueLoad):
        return load.torque_Nm
    if isinstance(load, AngleLoad):
        return load.angle_rad
    return None


def _check(time_s: NDArray, theta_in: NDArray, series: NDArray | None, elements: int) -> None:
    if elements < 1:
        raise ModelError(f"each cable needs at least one element; got {elements}")
    for name, values in {"time_s": time_s, "the load's series": series}.items():
        if values is not None and values.size != theta_in.size:
            raise ModelError(f"{name} has {values.size} samples, the drive angle {theta_in.size}")
    late = np.flatnonzero(np.diff(time_s) <= 0)
    if late.size:
        raise ModelError(f"time_s must increase; it does not at sample {late[0] + 1}")


def _constants(
    transmission: Transmission, settings: Settings, grid: Grid, added_rad: NDArray
) -> tuple[NDArray, NDArray]:
    """Constants of pieces and nodes; a compliant end is a piece of its own, next to a node without friction."""
    of_cable = np.array([[-1.0], [1.0]])
    ratio_mu = friction_ratios(settings)[:, None]
    ratio_K = np.array([[1.0], [settings.stiffness_ratio_B]]) / (1.0 + settings.compliance_by_cable * of_cable)
    EA = transmission.axial_rigidity_N * ratio_K
    segment, cell, length = grid.segment_m, grid.cell_m, transmission.path.length_m
    drive, load = end_spring(settings, "drive"), end_spring(settings, "load")
    extra = int(drive is not None)
    cells = slice(extra, extra + cell.size)
    segments = slice(extra, extra + segment.size)
    nodes = cell.size + extra + int(load is not None)
    piece, node = np.zeros((rows.PIECE_ROWS, 2, nodes + 1)), np.zeros((rows.NODE_ROWS, 2, nodes))
    friction = transmission.friction_coefficient
    if settings.friction_by_position is not None:
        friction = friction * settings.friction_by_position.at(grid.middle_m / length)
    piece[rows.STIFFNESS][:, segments] = EA / segment
    piece[rows.LOST][:, segments] = segment * settings.settling_N / EA
    piece[rows.RELAXING][:, segments] = settings.relaxing_share
    piece[rows.SHARE][:, segments] = segment / length
    node[rows.HALF_BEND][:, cells] = friction * ratio_mu * (grid.cell_rad + added_rad) / 2
    if settings.drag_N:
        node[rows.DRAG][:, cells] = settings.drag_N * drag_shares(settings, cell)
    if settings.added_drag is not None:
        node[rows.DRAG][:, cells] += settings.added_drag.at(grid.middle_m / length) * cell
    drag = settings.conduit_drag
    for film in (rows.VISCOUS, rows.FILM, rows.FILM_SLOPE):
        node[film][:, cells] = settings.viscous * cell
    if drive is not None:
        piece[rows.STIFFNESS][:, 0] = 1 / drive[0]
    if load is not None:
        piece[rows.STIFFNESS][:, -1] = 1 / load[0]
    ends = [[end[1]] if end is not None else [] for end in (drive, load)]
    springs = [*ends[0], *[settings.cable_compliance] * segment.size, *ends[1]]
    node = _with_tables(node, [_rows(settings.friction_by_tension)] * nodes)
    if drag is not None:
        lengths = np.zeros(nodes)
        lengths[cells] = cell
        slack = Table(drag.knots, np.maximum.accumulate(drag.values.clip(0.0)))
        for law in (drag, slack):
            node = _with_tables(node, [Table(law.knots, law.values * m).rows for m in lengths])
    return _with_tables(piece, [None if law is None else law.rows_of_spring for law in springs]), node


def _added_bend(settings: Settings, grid: Grid, length_m: float) -> NDArray:
    """Bend that a law of the position adds to each cell, rad, shape (cells,); no cell has less than none."""
    law = settings.added_bend
    if law is None:
        return np.zeros(grid.cell_rad.size)
    return np.maximum(law.at(grid.middle_m / length_m) * grid.cell_m / length_m, -grid.cell_rad)


def _load_laws(settings: Settings, load: Load) -> dict[str, NDArray]:
    """Rows of each law of the load and its pulley's bearing that a run has.

    A torque or a motion that was measured at the load is all that the load does; it has no law beside it.
    """
    names = rows.LOAD_LAWS if isinstance(load, SpringLoad) else rows.BEARING_LAWS
    laws = {name: getattr(settings, name) for name in names}
    return {
        name: law.rows_of_elements if name.endswith("elements") else law.rows
        for name, law in laws.items()
        if law is not None
    }


def _rows(law: Table | None) -> NDArray | None:
    return None if law is None else law.rows


def _size(law: Table | None) -> int:
    return 0 if law is None else law.rows.size


def _with_tables(array: NDArray, tables: Sequence[NDArray | None]) -> NDArray:
    """An array with further rows for the table of each of its columns, if any has one."""
    most = max((table.size for table in tables if table is not None), default=0)
    added = np.zeros((most, *array.shape[1:]))
    for column, table in enumerate(tables):
        if table is not None:
            added[: table.size, :, column] = table[:, None]
    return np.concatenate([array, added])


def _physics(
    transmission: Transmission, load: Load, settings: Settings, load_laws: Mapping[str, NDArray]
) -> rows.Physics:
    K_e = load.stiffness_Nm_per_rad if isinstance(load, SpringLoad) else 0.0
    K_e = load.parallel_Nm_per_rad if isinstance(load, TorqueLoad) else K_e
    values: dict[str, Any] = {name: float(getattr(settings, name)) for name in registry.march_settings()}
    values["inertia"] += sum(settings.load_masses)
    has_friction_table, has_drag_table = settings.friction_by_tension is not None, settings.conduit_drag is not None
    contacts, has_presliding = _contacts(settings)
    springs = settings.cable_compliance, settings.drive_end_stretch, settings.load_end_stretch
    first_rows, end = dict.fromkeys(rows.LOAD_LAWS, 0), rows.LOAD_ROWS
    for name, law in load_laws.items():
        first_rows[name], end = end, end + law.size
    return rows.Physics(
        has_settling=settings.settling_N > 0,
        has_relaxation=settings.relaxing_share != 0,
        relaxing_times_s=branch_times(settings.relaxing_time_s, settings.relaxing_spread),
        bristle=contacts.bristle_m if has_presliding else _coulomb_bristle(transmission, settings),
        presliding=has_presliding,
        creep=contacts.creep,
        element_m=contacts.element_m,
        element_share=contacts.element_share,
        elements=contacts.elements,
        load_pulley=pulley_at(settings, "load", transmission.load_radius_m),
        stiffness_load=float(K_e),
        load_damping=float(load_damping(settings, K_e)),
        rings=False,
        kind=rows.PRESCRIBED_ANGLE if isinstance(load, AngleLoad | FixedLoad) else rows.IMPEDANCE,
        general_friction=has_friction_by_tension(settings) or has_drag(settings) or settings.viscous != 0,
        has_spring_table=any(law is not None for law in springs),
        has_friction_table=has_friction_table,
        drag_table=rows.NODE_ROWS + _size(settings.friction_by_tension) if has_drag_table else 0,
        has_load_laws=bool(load_laws),
        **first_rows,
        **values,
    )


def pulley_at(settings: Settings, end: str, radius_m: float) -> Pulley:
    """The pulley of an end, "drive" or "load", whose radius may change with its angle; the drive's angle is read."""
    by_bore = getattr(settings, f"{end}_eccentricity"), getattr(settings, f"{end}_eccentricity_rad")
    error = settings.drive_angle_error if end == "drive" else None
    return pulley_of(radius_m, *by_bore, getattr(settings, f"{end}_radius_factor"), error)


def _contacts(settings: Settings) -> tuple[Contacts, bool]:
    """How friction builds up at the contacts, and whether it does."""
    law = settings.contact_elements
    if law is None:
        by_mechanism = settings.bristle_m, settings.bristle_spread, settings.bristle_creep
        return Contacts.of_mechanism(*by_mechanism), settings.bristle_m > 0
    if settings.bristle_m > 0:
        raise ModelError("friction builds up by presliding and by a law of the sliding distance: keep one of them")
    return Contacts.of_law(law.knots, law.values), True


def _steps(physics: rows.Physics, transmission: Transmission, time_s: NDArray) -> tuple[int, bool]:
    """Steps from one sample to the next, a power of two, and whether a load that rings can be followed undamped.

    The number must not change where a fit takes a difference over the mass, and powers of two are far apart.
    """
    if physics.inertia == 0 or physics.kind == rows.PRESCRIBED_ANGLE or time_s.size < 2:
        return 1, False
    cables = 2 * transmission.axial_rigidity_N / transmission.path.length_m * physics.load_pulley.radius_m**2
    stiffness = cables + physics.stiffness_load
    bearing = physics.load_friction_Nm / physics.load_presliding_rad if physics.load_friction_Nm else 0.0
    sample_s = float(np.median(np.diff(time_s)))
    # Phases from one sample to the next, of the ring on the cables, and on a bearing that sticks too.
    rings, sticks = (sample_s * np.sqrt(K / physics.inertia) for K in (stiffness, stiffness + bearing))
    steps = int(max(2 ** np.ceil(np.log2(rings / RINGING_STEP_RAD)), 1))
    if steps > MOST_STEPS:
        return UNRESOLVED_STEPS, False
    is_smooth = physics.presliding and physics.bristle > SMOOTH_BRISTLE_M
    return steps, bool(is_smooth and sticks / steps < STUCK_STEP_RAD)


def _coulomb_bristle(transmission: Transmission, settings: Settings) -> float:
    over_cable = settings.conduit_compliance * transmission.axial_rigidity_N / transmission.path.length_m
    return max(COULOMB_BRISTLE_M, min(1.0, 10 * over_cable) * SOFT_CONDUIT_BRISTLE_M)
