"""Run the model beside a recording: the same drive motion, load and initial state; what would the sensors read?"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from ccmodel.model.exact import pair as exact
from ccmodel.model.failure import ModelError
from ccmodel.model.general import run as general
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, SpringLoad, TorqueLoad
from ccmodel.model.parameters import Parameters
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording, stride
from ccmodel.rig.motion import drive_motion

# A load torque that was measured is the load's course and the sensor's noise. The noise would rock the load end; a
# hand, a spring or a brake does nothing above this frequency at the rates that rigs run at (0.1 to 1 Hz).
LOAD_TORQUE_CUTOFF_HZ = 10.0

LoadFrom = Literal["law", "torque", "angle"]
PRESCRIBED = "prescribed"  # `derived_from` of a channel that the model was given, not asked


@dataclass(frozen=True)
class ModelInput:
    """What the model takes from a recording, worked out once however often the model runs.

    Attributes
    ----------
    recording : Recording
    theta_in : ndarray, shape (n,)
        The drive's motion behind its encoder's counts, rad.
    drive_deviations : ndarray, shape (draws, n)
        Likely deviations of that motion from the true one, rad.
    theta_out : ndarray, shape (n,), or None
        The load's motion behind its encoder's counts, rad; None where it was not recorded.
    tau_out : ndarray, shape (n,), or None
        Torque measured at the load pulley without the sensor's noise, N m; None where it was not recorded.
    """

    recording: Recording
    theta_in: NDArray
    drive_deviations: NDArray
    theta_out: NDArray | None
    tau_out: NDArray | None

    @classmethod
    def of(cls, recording: Recording, step_s: float | None = None) -> "ModelInput":
        """Input from a recording; from a sample every `step_s` of it, once every sample has served its part."""
        theta_out = _motion(recording, "theta_out_rad") if "theta_out_rad" in recording else None
        tau_out = _without_noise(recording["tau_out_Nm"], recording.time_s) if "tau_out_Nm" in recording else None
        every = stride(recording, step_s)
        theta_in, deviations = _motion(recording, "theta_in_rad"), np.zeros((0, recording.time_s.size))
        series = (theta_in, deviations, theta_out, tau_out)
        return cls(recording[::every], *(None if values is None else values[..., ::every] for values in series))


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
        where there is none, to the same mean over what is judged.

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
    initial = initial_tension(recording, parameters)
    read = _run(transmission, load, given, initial, parameters)
    tau_in, tau_out = (read[f"tau_{end}_Nm"] + getattr(parameters, f"tau_{end}_zero_Nm") for end in ("in", "out"))
    F_drive, F_load = (read[f"F_{end}_N"] + getattr(parameters, f"F_{end}_zero_N") for end in ("drive", "load"))
    drive, load_side = tau_in / parameters.drive_radius_m, tau_out / parameters.load_radius_m
    channels = {
        "theta_in_rad": read["theta_in_rad"],
        "theta_out_rad": _zeroed(read["theta_out_rad"], recording),
        "tau_in_Nm": tau_in,
        "tau_out_Nm": tau_out,
        "F_drive_N": F_drive,
        "F_load_N": F_load,
        "T1_N": (F_drive + drive) / 2,
        "T2_N": (F_load + load_side) / 2,
        "T3_N": (F_drive - drive) / 2,
        "T4_N": (F_load - load_side) / 2,
    }
    sources = dict.fromkeys(channels, "model") | {"theta_in_rad": PRESCRIBED}
    if isinstance(load, TorqueLoad):
        sources["tau_out_Nm"] = PRESCRIBED
    elif isinstance(load, AngleLoad):
        sources["theta_out_rad"] = PRESCRIBED
    return recording.with_channels(channels, sources, origin="model")


def _run(transmission, load, given: ModelInput, initial: InitialTension, parameters: Parameters) -> dict[str, NDArray]:
    """What the sensors would read of a run, by channel.

    A torque that was measured rocks the load at almost every sample, and with it the point of a cable that stays
    still, whose path the exact solver integrates: the general one is ten times as fast there and right to 0.02 %.
    """
    if parameters.mechanisms or isinstance(load, TorqueLoad):
        time_s = given.recording.time_s
        response = general.simulate(transmission, load, time_s, given.theta_in, initial, parameters.mechanisms)
        return dict(response.complete().read)
    response = exact.simulate_pair(transmission, load, given.theta_in, initial)
    if response.status is not exact.Status.OK:
        raise ModelError(f"{response.status.name} at sample {response.reached}: {response.status.value}")
    return {
        "theta_in_rad": given.theta_in,
        "theta_out_rad": response.theta_out_rad,
        "tau_in_Nm": response.tau_in_Nm,
        "tau_out_Nm": response.tau_out_Nm,
        "F_drive_N": response.T1_N + response.T3_N,
        "F_load_N": response.T2_N + response.T4_N,
    }


def initial_tension(recording: Recording, parameters: Parameters) -> InitialTension:
    """Tension before the drive moves: fitted, or what the rest shows at the four cable ends, or what was aimed at."""
    path = recording.path.with_extra_bend(parameters.extra_bend_rad)
    scale = parameters.pretension_scale
    if parameters.pretension_N is not None:
        return InitialTension.uniform(path, scale * parameters.pretension_N)
    at_rest = recording.time_s < recording.rest_s
    if not at_rest.any() or not all(f"T{i}_N" in recording for i in (1, 2, 3, 4)):
        return InitialTension.uniform(path, scale * recording.pretension_N)
    ends = {}
    for end, names, radius in (
        ("drive", ("T1", "T3"), parameters.drive_radius_m),
        ("load", ("T2", "T4"), parameters.load_radius_m),
    ):
        torque = f"tau_{'in' if end == 'drive' else 'out'}"
        total = recording[f"F_{end}_N"][at_rest].mean() - getattr(parameters, f"F_{end}_zero_N")
        difference = (recording[f"{torque}_Nm"][at_rest].mean() - getattr(parameters, f"{torque}_zero_Nm")) / radius
        ends[names[0]], ends[names[1]] = scale * (total + difference) / 2, scale * (total - difference) / 2
    return InitialTension.between_ends(path, parameters.friction, (ends["T1"], ends["T2"]), (ends["T3"], ends["T4"]))


def _load(given: ModelInput, parameters: Parameters, load_from: LoadFrom) -> SpringLoad | TorqueLoad | AngleLoad:
    name = f"{given.recording.batch}/{given.recording.id}"
    if load_from == "angle":
        if given.theta_out is None:
            raise ModelError(f"{name}: no angle was measured at the load pulley")
        return AngleLoad(given.theta_out)
    if load_from == "law" and parameters.load_stiffness_Nm_per_rad is not None:
        return SpringLoad(parameters.load_stiffness_Nm_per_rad)
    if given.tau_out is None:
        raise ModelError(
            f"{name}: the batch states no load spring and no torque was measured at the load pulley; one of the two "
            "is needed to know the load"
        )
    return TorqueLoad(given.tau_out - parameters.tau_out_zero_Nm)


def _motion(recording: Recording, channel: str) -> NDArray:
    if channel not in recording.encoder_step_rad:
        return recording[channel]
    return drive_motion(recording.time_s, recording[channel], recording.encoder_step_rad[channel], recording.rest_s)


def _without_noise(torque: NDArray, time_s: NDArray) -> NDArray:
    rate = 1 / np.median(np.diff(time_s))
    if rate <= 2.5 * LOAD_TORQUE_CUTOFF_HZ:
        return torque
    return sosfiltfilt(butter(2, LOAD_TORQUE_CUTOFF_HZ, fs=rate, output="sos"), torque)


def _zeroed(theta_out: NDArray, recording: Recording) -> NDArray:
    if recording.rest_s > 0 or "theta_out_rad" not in recording:
        return theta_out - theta_out[0]
    judged = recording.time_s >= recording.settled_s
    return theta_out - theta_out[judged].mean() + recording["theta_out_rad"][judged].mean()
