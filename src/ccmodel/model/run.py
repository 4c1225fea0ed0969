"""Run the model on a recording's drive motion, load and initial tension, and return the sensors' readings."""

from collections.abc import Mapping
from dataclasses import replace
from math import log
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import (
    CABLES,
    F_DRIVE,
    F_LOAD,
    SUM_AT,
    T2,
    TAU_IN,
    TAU_OUT,
    TENSIONS,
    THETA_IN,
    THETA_OUT,
    TORQUE_AT,
    ZERO_OF,
)
from ccmodel.effort import count_run
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.mechanisms.contract import Settings
from ccmodel.mechanisms.relaxation import branch_times, kept_at_rest
from ccmodel.mechanisms.winding import winding
from ccmodel.model.active import modify_physics
from ccmodel.model.exact import pair as exact
from ccmodel.model.general import run as general
from ccmodel.model.general.rest import has_drag, held_at_rest
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, FixedLoad, Load, SpringLoad, TorqueLoad
from ccmodel.model.model_input import PRESCRIBED, ModelInput
from ccmodel.model.parameters import Parameters
from ccmodel.model.sensors import driven, read_by_sensors, true_at
from ccmodel.model.session import of_recording
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording

__all__ = [
    "PRESCRIBED",
    "LoadFrom",
    "ModelInput",
    "initial_tension",
    "simulate",
    "simulate_recording",
    "transmission_of",
]

# A torque at rest is resolved beyond so many times its sensor's accuracy.
KNOWN_TO = 2.0

LoadFrom = Literal["law", "torque"]


def simulate_recording(recording: Recording, parameters: Parameters) -> Recording:
    """Response of the model with `parameters` to a recording: `simulate` with every input from the recording."""
    return simulate(ModelInput.of(recording), parameters)


def simulate(given: ModelInput, parameters: Parameters, load_from: LoadFrom = "law") -> Recording:
    """Run the model on its input from a recording.

    The paper's physics against a spring or a fixed end runs on the exact solver, with or without mechanisms that modify
    the observation. Anything else runs on the general one.

    Parameters
    ----------
    given : ModelInput
        Gives the drive's motion, the conduits' path, the readings at rest, the far end of a single cable and, where
        the load is a measurement, that measurement.
    parameters : Parameters
    load_from : {"law", "torque"}
        Whether the load follows its law or the torque that was measured there. A load without a stated spring follows
        the measured torque, and a single cable's far end its stated measurement, in either case.

    Returns
    -------
    Recording
        Of origin "model", with the recording's times and all channels as the sensors would read them: ten for a pair,
        eight for a single cable. As in a recording, the tensions follow from torques and sums. theta_out has the
        recording's zero: at rest or, where there is none or only one before a start-up transient, the same mean over
        the judged samples.

    Raises
    ------
    ModelError
        If the model cannot be run on this recording.
    """
    recording = given.recording
    count_run()
    parameters = of_recording(parameters, recording)
    transmission = transmission_of(recording, parameters)
    initial = initial_tension(given, parameters, load_from)
    theta_in = given.theta_in
    if parameters.drive_encoder_offset:
        theta_in = theta_in + parameters.drive_encoder_offset * given.drive_encoder_offset
    theta_in = driven(parameters.mechanisms, recording.time_s, theta_in)
    if theta_in is not given.theta_in:
        given = replace(given, theta_in=theta_in)
    given, samples = given.with_turning_points
    load, measured = _load(given, parameters, load_from)
    read = _readings(transmission, load, given, samples, initial, parameters)
    at_samples = {c: values[samples] for c, values in read.items()}
    channels = _channels(at_samples, float(read[THETA_OUT][0]), recording, parameters)
    sources = dict.fromkeys(channels, "model") | dict.fromkeys((THETA_IN, *measured), PRESCRIBED)
    return recording.with_channels(channels, sources, origin="model")


def transmission_of(recording: Recording, parameters: Parameters) -> Transmission:
    """The transmission of a recording: its conduits, and cables and pulleys of the parameters."""
    return Transmission(
        path=recording.path.with_extra_bend(parameters.extra_bend_rad),
        axial_rigidity_N=parameters.stiffness_N_per_m * parameters.reference_length_m,
        friction_coefficient=parameters.friction,
        drive_radius_m=parameters.drive_radius_m,
        load_radius_m=parameters.load_radius_m,
        is_single_cable=recording.far_end is not None,
    )


def _readings(
    transmission: Transmission,
    load: Load,
    given: ModelInput,
    samples: NDArray,
    initial: InitialTension,
    parameters: Parameters,
) -> Mapping[str, NDArray]:
    """Readings of sensors without zeros, at samples and turning points: angles, torques and sums of tensions."""
    mechanisms, time_s = parameters.mechanisms, given.recording.time_s
    if modify_physics(mechanisms) or not isinstance(load, SpringLoad | FixedLoad):
        finer = parameters.refinement
        solver = finer * general.ELEMENTS, finer, _motor(given)
        by_general = general.simulate(transmission, load, time_s, given.theta_in, initial, mechanisms, *solver)
        return by_general.complete(samples).read
    response = exact.simulate_pair(transmission, load, given.theta_in, initial).complete(samples)
    radii = transmission.drive_radius_m, transmission.load_radius_m
    return read_by_sensors(mechanisms, time_s, response.channels(given.theta_in), radii)


def _motor(given: ModelInput) -> general.Motor:
    """The motor that moves the drive pulley, where it was recorded; the pulley's encoder leaves half a step open."""
    if given.theta_motor is None:
        return general.NO_MOTOR
    recording = given.recording
    within = recording.encoder_step_rad.get(THETA_IN, 0.0) / 2
    judged = slice(int(np.searchsorted(recording.time_s, recording.settled_s)), None)
    return general.Motor(given.theta_motor, within, judged)


def _channels(
    read: Mapping[str, NDArray], at_rest: float, recording: Recording, parameters: Parameters
) -> dict[str, NDArray]:
    """Channels of a recording from readings: zeros added, tensions derived as in a recording.

    `at_rest` is the load's angle before the drive moves, rad.
    """
    theta_out = _zeroed(read[THETA_OUT], at_rest, recording) + parameters.theta_out_zero_rad
    sensed = {c: read[c] + getattr(parameters, zero) for c, zero in ZERO_OF.items()}
    return {THETA_IN: read[THETA_IN], THETA_OUT: theta_out, **sensed, **_tensions(sensed, recording, parameters)}


def _tensions(
    sensed: Mapping, recording: Recording, parameters: Parameters, drive_ratio: float = 1.0
) -> dict[str, NDArray | float]:
    """Tensions at the cables' ends from torques and sums; a single cable's from one sensor at each end.

    `drive_ratio` is the radius at which the cables pull at the drive over the pulley's stated one.
    """
    radii = {"drive": drive_ratio * parameters.drive_radius_m, "load": parameters.load_radius_m}
    total = {end: sensed[SUM_AT[end]] for end in radii}
    difference = {end: sensed[TORQUE_AT[end]] / radius for end, radius in radii.items()}
    if recording.far_end:
        near_and_far = (difference[end] if _by_torque_alone(end, recording) else total[end] for end in radii)
        return dict(zip(CABLES["A"], near_and_far, strict=True))
    of_A = [(total[end] + difference[end]) / 2 for end in radii]
    of_B = [(total[end] - difference[end]) / 2 for end in radii]
    return dict(zip(TENSIONS, of_A + of_B, strict=True))


def _by_torque_alone(end: str, recording: Recording) -> bool:
    """Whether a single cable's tension at the "drive" or "load" end was measured by a torque sensor only."""
    return SUM_AT[end] not in recording and TORQUE_AT[end] in recording


def initial_tension(given: ModelInput, parameters: Parameters, load_from: LoadFrom = "law") -> InitialTension:
    """Tension before the drive moves: the fitted one, else the one observed at rest, else the nominal one."""
    path = given.recording.path.with_extra_bend(parameters.extra_bend_rad)
    scale = parameters.pretension_scale
    if parameters.pretension_N is not None:
        return InitialTension.uniform(path, scale * parameters.pretension_N)
    if not given.initial_tension_observed:
        return InitialTension.uniform(path, scale * parameters.pretension_share * given.recording.pretension_N)
    settings = general.settings_of(parameters.mechanisms)
    # The drive rests at its zero. At which angle the load rests is not known here: its pulley counts as stated.
    drive_ratio = winding(0.0, general.pulley_at(settings, "drive", parameters.drive_radius_m))[1]
    tensions = _tensions(_true_at_rest(given, parameters, load_from), given.recording, parameters, drive_ratio)
    seconds = given.resting_mean["time_s"] - float(given.recording.time_s[0])
    # The rest's mean is what the cables have after half of the rest.
    times = branch_times(settings.relaxing_time_s, settings.relaxing_spread)
    scale /= kept_at_rest(seconds, settings.relaxing_share, times, settings.relaxed_share)
    A = _both_ends("A", tensions, scale)
    B = A if given.recording.far_end else _both_ends("B", tensions, scale)
    ends = A, (0.0, 0.0) if given.recording.far_end else B
    curvatures = parameters.tension_curvature_A, parameters.tension_curvature_B
    kinks_rad = _kinks_rad(settings, path)
    coulomb = parameters.friction * (path.bend_rad + sum(kinks_rad))
    held = None
    may_slip = any(curvatures) or any(_beyond(coulomb, *pair) for pair in ends)
    if (may_slip or has_drag(settings)) and modify_physics(parameters.mechanisms):
        motion = given.recording.time_s, given.theta_in
        factor = general.friction_factors(transmission_of(given.recording, parameters), settings, *motion)[0]
        held = held_at_rest(settings, coulomb, path.length_m, factor, ends)
    return InitialTension.between_ends(path, parameters.friction, A, B, curvatures, kinks_rad, held)


def _kinks_rad(settings: Settings, path: ConduitPath) -> tuple[float, float]:
    """Bend beside that of the path, as far as it holds tension at rest, before and beyond the middle of the latter."""
    before = sum(kink.hold * kink.bend_rad for kink in settings.kinks if kink.share * path.length_m <= path.halfway_m)
    every = sum(kink.hold * kink.bend_rad for kink in settings.kinks)
    if (added := settings.added_bend) is not None:
        middle = path.halfway_m / path.length_m
        knots = np.union1d(added.knots, middle)
        bend, from_drive = added.at(knots), knots <= middle
        before += float(np.trapezoid(bend[from_drive], knots[from_drive]))
        every += float(np.trapezoid(bend, knots))
    return before, every - before


def _beyond(coulomb: float, near: float, far: float) -> bool:
    """Whether two ends of a cable are further apart than Coulomb friction of mu phi holds."""
    return min(near, far) > 0.0 and abs(log(far / near)) > coulomb


def _true_at_rest(given: ModelInput, parameters: Parameters, load_from: LoadFrom = "law") -> dict[str, float]:
    """Torques and sums at rest, from their sensors' readings without zeros and faults.

    A torque that is the load of a run keeps its reading, at rest as later. A single cable's sensors measure one tension
    at each end, so what one of them reads stands for the other that the rig lacks.
    """
    read, recording = given.resting_mean, given.recording
    sensed = {c: read[c] - getattr(parameters, zero) for c, zero in ZERO_OF.items() if c in read}
    radii = parameters.drive_radius_m, parameters.load_radius_m
    for torque, total, radius in ((TAU_IN, F_DRIVE, radii[0]), (TAU_OUT, F_LOAD, radii[1])):
        if torque not in sensed:
            sensed[torque] = radius * sensed[total]
        if total not in sensed:
            sensed[total] = sensed[torque] / radius
    seconds = read["time_s"] - float(recording.time_s[0])
    true = true_at(parameters.mechanisms, seconds, sensed | {THETA_IN: 0.0, THETA_OUT: 0.0}, radii)
    if recording.far_end == "measured-tension":
        true |= {channel: sensed[channel] for channel in (TAU_OUT, F_LOAD)}
    elif recording.far_end is None and (load_from == "torque" or parameters.load_stiffness_Nm_per_rad is None):
        true[TAU_OUT] = sensed[TAU_OUT]
    return true


def _load(given: ModelInput, parameters: Parameters, load_from: LoadFrom) -> tuple[Load, tuple[str, ...]]:
    """The load, and the channels whose measurement it is."""
    far_end = given.recording.far_end
    if far_end == "fixed":
        return FixedLoad(), (THETA_OUT,)
    if far_end == "measured-motion":
        return AngleLoad(_measured(given, given.theta_out, "angle")), (THETA_OUT,)
    if far_end == "measured-tension" and given.F_load is not None:
        torque = (given.F_load - parameters.F_load_zero_N) * parameters.load_radius_m
        return TorqueLoad(torque, parameters.spring_beside_load_Nm_per_rad), (F_LOAD, T2)
    if far_end != "measured-tension" and load_from == "law" and parameters.load_stiffness_Nm_per_rad is not None:
        return spring_load(parameters.load_stiffness_Nm_per_rad, parameters, given.recording.accuracy), ()
    torque = _measured(given, given.tau_out, "torque") - parameters.tau_out_zero_Nm
    # A single cable's tension at the load is the torque over the radius where no load cell was there.
    same = (TAU_OUT, T2) if far_end and _by_torque_alone("load", given.recording) else (TAU_OUT,)
    return TorqueLoad(torque, parameters.spring_beside_load_Nm_per_rad), same


def spring_load(stiffness: float, parameters: Parameters, accuracy: Mapping[str, float]) -> SpringLoad:
    """The load of a law. Its torque at rest is as accurate as the torque sensor at the load, or else at the drive."""
    known_to = KNOWN_TO * accuracy.get(TAU_OUT, accuracy.get(TAU_IN, 0.0))
    return SpringLoad(stiffness, known_to, parameters.load_gap_position)


def _measured(given: ModelInput, values: NDArray | None, what: str) -> NDArray:
    if values is None:
        raise ModelError(
            f"{given.recording.batch}/{given.recording.id}: no load spring is stated and no {what} was measured"
            " at the load pulley; one of the two is needed to know the load"
        )
    return values


def _zeroed(theta_out: NDArray, at_rest: float, recording: Recording) -> NDArray:
    """The load's angle with the recording's zero, rad."""
    from_rest = recording.rest_s > 0 and recording.settled_s <= recording.rest_s
    if from_rest or THETA_OUT not in recording:
        return theta_out - at_rest
    judged = recording.time_s >= recording.settled_s
    return theta_out - theta_out[judged].mean() + recording[THETA_OUT][judged].mean()


def _both_ends(cable: str, tensions: Mapping[str, NDArray | float], scale: float) -> tuple[float, float]:
    near, far = CABLES[cable]
    return float(scale * tensions[near]), float(scale * tensions[far])
