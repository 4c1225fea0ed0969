"""Run the model beside a recording: the same drive motion, load and initial state; what would the sensors read?"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from ccmodel.channels import F_DRIVE, F_LOAD, TAU_IN, TAU_OUT, TENSIONS, THETA_IN, THETA_OUT, ZERO_OF
from ccmodel.encoder.reconstruction import reconstruct_motion
from ccmodel.encoder.smoothing import OFFSET_SCORES
from ccmodel.failure import ModelError
from ccmodel.model.exact import pair as exact
from ccmodel.model.general import run as general
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, SpringLoad, TorqueLoad
from ccmodel.model.parameters import Parameters
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording, stride

# A load torque that was measured is the load's course and the sensor's noise. The noise would rock the load end; a
# hand, a spring or a brake does nothing above this frequency at the rates that rigs run at (0.1 to 1 Hz).
LOAD_TORQUE_CUTOFF_HZ = 10.0

# A torque at rest beyond so many times its sensor's accuracy is there.
KNOWN_TO = 2.0

# Before the first count comes, a drive has moved by up to a count, and the torque with it.
STILL_RAD = 1e-5

LoadFrom = Literal["law", "torque", "angle"]
PRESCRIBED = "prescribed"  # `derived_from` of a channel that the model was given, not asked


@dataclass(frozen=True)
class ModelInput:
    """What the model takes from a recording, worked out once however often the model runs.

    Attributes
    ----------
    recording : Recording
    theta_in : ndarray, shape (n,)
        The drive's motion behind its encoder's counts, rad; 0 at the rest at the start where there is one.
    drive_deviations : ndarray, shape (draws, n)
        Likely deviations of that motion from the true one, rad; no draws where the drive's angle was not counted.
    drive_encoder_offset : ndarray, shape (n,)
        One standard deviation of where in its count the drive first rests, as it shows in its motion, rad.
    theta_out : ndarray, shape (n,), or None
        The load's motion behind its encoder's counts, rad; None where it was not recorded.
    tau_out : ndarray, shape (n,), or None
        Torque measured at the load pulley without the sensor's noise, N m; None where it was not recorded.
    resting : mapping of str to ndarray
        What each channel read while the drive did not move, and time_s, each of shape (resting samples,); empty
        without a rest.
    """

    recording: Recording
    theta_in: NDArray
    drive_deviations: NDArray
    drive_encoder_offset: NDArray
    theta_out: NDArray | None
    tau_out: NDArray | None
    resting: Mapping[str, NDArray]

    @classmethod
    def of(cls, recording: Recording, step_s: float | None = None) -> "ModelInput":
        """Input from a recording; from a sample every `step_s` of it, once every sample has served its part."""
        theta_in, deviations, place = _motion(recording, THETA_IN)
        theta_out = _motion(recording, THETA_OUT)[0] if THETA_OUT in recording else None
        tau_out = _without_noise(recording[TAU_OUT], recording.time_s) if TAU_OUT in recording else None
        rest = _rest(recording, theta_in)
        every = stride(recording, step_s)
        series = (theta_in, deviations, place, theta_out, tau_out)
        thinned = (None if values is None else values[..., ::every] for values in series)
        resting = {c: values[rest] for c, values in (recording.channels | {"time_s": recording.time_s}).items()}
        return cls(recording[::every], *thinned, resting)

    @classmethod
    def prescribed(cls, like: Recording, time_s: NDArray, theta_in: NDArray, pretension_N: float) -> "ModelInput":
        """Input of a motion that nobody recorded, known exactly, of a recording's rig: its cables evenly tensioned.

        Parameters
        ----------
        like : Recording
            Gives the conduits' path.
        time_s, theta_in : ndarray, shape (n,)
            s; rad.
        pretension_N : float
        """
        recording = replace(
            like,
            time_s=time_s,
            channels={THETA_IN: theta_in},
            derived_from={THETA_IN: PRESCRIBED},
            pretension_N=pretension_N,
            encoder_step_rad={},
            excitation={},
            rest_s=0.0,
            settled_s=0.0,
        )
        return cls(recording, theta_in, np.zeros((0, theta_in.size)), np.zeros(theta_in.size), None, None, {})

    @cached_property
    def resting_mean(self) -> dict[str, float]:
        """What each channel read on average while the drive did not move, and when; empty without a rest."""
        return {c: float(values.mean()) for c, values in self.resting.items() if values.size}

    @property
    def initial_tension_observed(self) -> bool:
        """Whether a rest shows the tension at all four ends of the cables."""
        return all(tension in self.resting_mean for tension in TENSIONS)

    @property
    def deviations_given_offset(self) -> NDArray:
        """`drive_deviations` where it is known where in its count the drive first rests."""
        return self.drive_deviations - OFFSET_SCORES[: len(self.drive_deviations), None] * self.drive_encoder_offset


def simulate_recording(recording: Recording, parameters: Parameters) -> Recording:
    """What the model with `parameters` says of a recording: `simulate` with everything taken from the recording."""
    return simulate(ModelInput.of(recording), parameters)


def simulate(given: ModelInput, parameters: Parameters, load_from: LoadFrom = "law") -> Recording:
    """Run the model on what it takes from a recording.

    The paper's physics runs on the exact solver, anything beyond it on the general one.

    Parameters
    ----------
    given : ModelInput
        Gives the drive's motion, the conduit's path, the tensions at rest and, where it is asked for or `parameters`
        has no load stiffness, what was measured at the load pulley.
    parameters : Parameters
    load_from : {"law", "torque", "angle"}
        What stands at the load: its law, or the torque or the angle that was measured there in its stead.

    Returns
    -------
    Recording
        Of origin "model", with the recording's own times and all ten channels, as the sensors would show them: the
        tensions, as in a recording, from torques and sums. theta_out is zeroed as the recording's is: at rest, or,
        where there is none or only one before a start-up transient, to the same mean over what is judged.

    Raises
    ------
    ModelError
        If the model cannot be run on this recording.
    """
    recording = given.recording
    transmission = Transmission(
        path=recording.path.with_extra_bend(parameters.extra_bend_rad),
        axial_rigidity_N=parameters.stiffness_N_per_m * parameters.reference_length_m,
        friction_coefficient=parameters.friction,
        drive_radius_m=parameters.drive_radius_m,
        load_radius_m=parameters.load_radius_m,
    )
    load = _load(given, parameters, load_from)
    initial = initial_tension(given, parameters)
    if parameters.drive_encoder_offset:
        given = replace(given, theta_in=given.theta_in + parameters.drive_encoder_offset * given.drive_encoder_offset)
    read = _run(transmission, load, given, initial, parameters)
    tau_in, tau_out, F_drive, F_load = (read[c] + getattr(parameters, zero) for c, zero in ZERO_OF.items())
    drive, load_side = tau_in / parameters.drive_radius_m, tau_out / parameters.load_radius_m
    channels = {
        THETA_IN: read[THETA_IN],
        THETA_OUT: _zeroed(read[THETA_OUT], recording) + parameters.theta_out_zero_rad,
        TAU_IN: tau_in,
        TAU_OUT: tau_out,
        F_DRIVE: F_drive,
        F_LOAD: F_load,
    }
    tensions = (F_drive + drive, F_load + load_side, F_drive - drive, F_load - load_side)
    channels |= {name: twice / 2 for name, twice in zip(TENSIONS, tensions, strict=True)}
    sources = dict.fromkeys(channels, "model") | {THETA_IN: PRESCRIBED}
    if isinstance(load, TorqueLoad):
        sources[TAU_OUT] = PRESCRIBED
    elif isinstance(load, AngleLoad):
        sources[THETA_OUT] = PRESCRIBED
    return recording.with_channels(channels, sources, origin="model")


def _run(transmission, load, given: ModelInput, initial: InitialTension, parameters: Parameters) -> dict[str, NDArray]:
    """What the sensors would read of a run, by channel.

    A torque that was measured rocks the load at almost every sample, and with it the point of a cable that stays
    still, whose path the exact solver integrates: the general one is ten times as fast there and right to 0.02 %.
    """
    if parameters.mechanisms or isinstance(load, TorqueLoad):
        time_s = given.recording.time_s
        finer = parameters.refinement
        response = general.simulate(
            transmission, load, time_s, given.theta_in, initial, parameters.mechanisms, finer * general.ELEMENTS, finer
        )
        return dict(response.complete().read)
    response = exact.simulate_pair(transmission, load, given.theta_in, initial).complete()
    return {
        THETA_IN: given.theta_in,
        THETA_OUT: response.theta_out_rad,
        TAU_IN: response.tau_in_Nm,
        TAU_OUT: response.tau_out_Nm,
        F_DRIVE: response.T1_N + response.T3_N,
        F_LOAD: response.T2_N + response.T4_N,
    }


def initial_tension(given: ModelInput, parameters: Parameters) -> InitialTension:
    """Tension before the drive moves: fitted, or what the rest shows at the four cable ends, or what was aimed at."""
    path = given.recording.path.with_extra_bend(parameters.extra_bend_rad)
    scale = parameters.pretension_scale
    if parameters.pretension_N is not None:
        return InitialTension.uniform(path, scale * parameters.pretension_N)
    if not given.initial_tension_observed:
        return InitialTension.uniform(path, scale * parameters.pretension_share * given.recording.pretension_N)
    true = _true_at_rest(given.resting_mean, given, parameters)
    F_drive, F_load = true[F_DRIVE], true[F_LOAD]
    drive, load = true[TAU_IN] / parameters.drive_radius_m, true[TAU_OUT] / parameters.load_radius_m
    T1, T3 = scale * (F_drive + drive) / 2, scale * (F_drive - drive) / 2
    T2, T4 = scale * (F_load + load) / 2, scale * (F_load - load) / 2
    curvatures = parameters.tension_curvature_A, parameters.tension_curvature_B
    kinks_rad = sum(kink.hold * kink.bend_rad for kink in general.settings_of(parameters.mechanisms).kinks)
    return InitialTension.between_ends(path, parameters.friction, (T1, T2), (T3, T4), curvatures, kinks_rad)


def _true_at_rest(read: Mapping[str, float], given: ModelInput, parameters: Parameters) -> dict[str, float]:
    """Torques and sums at rest, from what their sensors read there, their zeros and faults taken out.

    A torque that stands for the load in a run stays as it was read, at rest as ever after.
    """
    sensed = {c: read[c] - getattr(parameters, zero) for c, zero in ZERO_OF.items()}
    still = {THETA_IN: 0.0, THETA_OUT: 0.0}
    radii = parameters.drive_radius_m, parameters.load_radius_m
    seconds = read["time_s"] - float(given.recording.time_s[0])
    true = general.true_at(parameters.mechanisms, seconds, sensed | still, radii)
    if parameters.load_stiffness_Nm_per_rad is None:
        true[TAU_OUT] = sensed[TAU_OUT]
    return true


def _load(given: ModelInput, parameters: Parameters, load_from: LoadFrom) -> SpringLoad | TorqueLoad | AngleLoad:
    name = f"{given.recording.batch}/{given.recording.id}"
    if load_from == "angle":
        if given.theta_out is None:
            raise ModelError(f"{name}: no angle was measured at the load pulley")
        return AngleLoad(given.theta_out)
    if load_from == "law" and parameters.load_stiffness_Nm_per_rad is not None:
        return spring_load(given, parameters)
    if given.tau_out is None:
        raise ModelError(
            f"{name}: the batch states no load spring and no torque was measured at the load pulley; one of the two "
            "is needed to know the load"
        )
    return TorqueLoad(given.tau_out - parameters.tau_out_zero_Nm, parameters.spring_beside_load_Nm_per_rad)


def spring_load(given: ModelInput, parameters: Parameters) -> SpringLoad:
    """The load's spring, and what is known of how it rests at the start of a recording."""
    known_to = KNOWN_TO * given.recording.accuracy.get(TAU_OUT, 0.0)
    return SpringLoad(parameters.load_stiffness_Nm_per_rad, known_to, parameters.load_gap_position)


def _motion(recording: Recording, channel: str) -> tuple[NDArray, NDArray, NDArray]:
    """The motion behind an encoder's counts, likely deviations from it, and what the place of its first rest does."""
    if channel not in recording.encoder_step_rad:
        return recording[channel], np.zeros((0, recording.time_s.size)), np.zeros(recording.time_s.size)
    step_rad = recording.encoder_step_rad[channel]
    found = reconstruct_motion(recording.time_s, recording[channel], step_rad, recording.rest_s)
    return found.theta_rad, found.deviations_rad, found.encoder_offset_rad


def _rest(recording: Recording, theta_in: NDArray) -> slice:
    """The samples at the start at which the drive does not move: fewer than those at which its count does not."""
    moved = (recording.time_s >= recording.rest_s) | (np.abs(theta_in - theta_in[0]) > STILL_RAD)
    return slice(0, int(np.argmax(moved)) if moved.any() else recording.time_s.size)


def _without_noise(torque: NDArray, time_s: NDArray) -> NDArray:
    rate = 1 / np.median(np.diff(time_s))
    if rate <= 2.5 * LOAD_TORQUE_CUTOFF_HZ:
        return torque
    return sosfiltfilt(butter(2, LOAD_TORQUE_CUTOFF_HZ, fs=rate, output="sos"), torque)


def _zeroed(theta_out: NDArray, recording: Recording) -> NDArray:
    from_rest = recording.rest_s > 0 and recording.settled_s <= recording.rest_s
    if from_rest or THETA_OUT not in recording:
        return theta_out - theta_out[0]
    judged = recording.time_s >= recording.settled_s
    return theta_out - theta_out[judged].mean() + recording[THETA_OUT][judged].mean()
