"""Run the model beside a recording: the same drive motion, load and initial state; what would the sensors read?"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad, TorqueLoad
from ccmodel.model.paper import SECTIONS, ModelError, simulate_pair
from ccmodel.model.parameters import Parameters
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording, stride
from ccmodel.rig.motion import DriveMotion, drive_motion

# A load torque that was measured is the load's course and the sensor's noise. The noise would rock the load end; a
# hand, a spring or a brake does nothing above this frequency at the rates that rigs run at (0.1 to 1 Hz).
LOAD_TORQUE_CUTOFF_HZ = 10.0

PRESCRIBED = "prescribed"  # `derived_from` of a channel that the model was given, not asked


@dataclass(frozen=True)
class ModelInput:
    """What the model takes from a recording, worked out once however often the model runs.

    Attributes
    ----------
    recording : Recording
    theta_in : ndarray, shape (n,)
        The drive's motion behind its encoder's counts, rad; 0 at the rest at the start where there is one.
    drive : DriveMotion or None
        The same motion with what is left of its uncertainty; None where the drive's angle was not counted.
    tau_out : ndarray, shape (n,), or None
        Torque measured at the load pulley without the sensor's noise, N m; None where it was not recorded.
    """

    recording: Recording
    theta_in: NDArray
    tau_out: NDArray | None
    drive: DriveMotion | None = None

    @classmethod
    def of(cls, recording: Recording, step_s: float | None = None) -> "ModelInput":
        """Input from a recording; from a sample every `step_s` of it, once every sample has served its part."""
        drive, theta_in = None, recording["theta_in_rad"]
        if recording.encoder_step_rad is not None:
            drive = drive_motion(recording.time_s, theta_in, recording.encoder_step_rad, recording.rest_s)
            theta_in = drive.theta_rad
        tau_out = _without_noise(recording["tau_out_Nm"], recording.time_s) if "tau_out_Nm" in recording else None
        every = slice(None, None, stride(recording, step_s))
        return cls(
            recording[every],
            theta_in[every],
            None if tau_out is None else tau_out[every],
            None if drive is None else drive[every],
        )


def simulate_recording(recording: Recording, parameters: Parameters, sections: int = SECTIONS) -> Recording:
    """What the model with `parameters` says of a recording: `simulate` with everything taken from the recording."""
    return simulate(ModelInput.of(recording), parameters, sections)


def simulate(given: ModelInput, parameters: Parameters, sections: int = SECTIONS) -> Recording:
    """Run the model on what it takes from a recording.

    Parameters
    ----------
    given : ModelInput
        Gives the drive's motion, the conduit's path, the tensions at rest and, where `parameters` has no load
        stiffness, the torque at the load pulley.
    parameters : Parameters
    sections : int
        Segments a cable (`ccmodel.model.paper`).

    Returns
    -------
    Recording
        Of origin "model", with the recording's own times and all ten channels. theta_out is zeroed as the
        recording's is: at rest, or, where there is none, to the same mean over what is judged.

    Raises
    ------
    ModelError
        If the model cannot be run on this recording.
    """
    recording = given.recording
    transmission = Transmission(
        path=recording.path,
        axial_rigidity_N=parameters.stiffness_N_per_m * parameters.reference_length_m,
        friction_coefficient=parameters.friction_coefficient,
        drive_radius_m=parameters.drive_radius_m,
        load_radius_m=parameters.load_radius_m,
    )
    load, load_source = _load(given, parameters)
    response = simulate_pair(transmission, load, given.theta_in, initial_tension(recording, parameters), sections)
    channels = {
        "theta_in_rad": recording["theta_in_rad"],
        "theta_out_rad": _zeroed(response.theta_out_rad, recording),
        "tau_in_Nm": response.tau_in_Nm + parameters.tau_in_zero_Nm,
        "tau_out_Nm": response.tau_out_Nm + parameters.tau_out_zero_Nm,
        "F_drive_N": response.T1_N + response.T3_N,
        "F_load_N": response.T2_N + response.T4_N,
        "T1_N": response.T1_N,
        "T2_N": response.T2_N,
        "T3_N": response.T3_N,
        "T4_N": response.T4_N,
    }
    sources = dict.fromkeys(channels, "model") | {"theta_in_rad": PRESCRIBED, "tau_out_Nm": load_source}
    return recording.with_channels(channels, sources, origin="model")


def initial_tension(recording: Recording, parameters: Parameters) -> InitialTension:
    """Tension before the drive moves: fitted, or what the rest shows at the four cable ends, or what was aimed at."""
    path = recording.path
    if parameters.pretension_N is not None:
        return InitialTension.uniform(path, parameters.pretension_N)
    at_rest = recording.time_s < recording.rest_s
    if not at_rest.any() or not all(f"T{i}_N" in recording for i in (1, 2, 3, 4)):
        return InitialTension.uniform(path, recording.pretension_N)
    T1, T2, T3, T4 = (recording[f"T{i}_N"][at_rest].mean() for i in (1, 2, 3, 4))
    return InitialTension.between_ends(path, parameters.friction_coefficient, (T1, T2), (T3, T4))


def _load(given: ModelInput, parameters: Parameters) -> tuple[SpringLoad | TorqueLoad, str]:
    if parameters.load_stiffness_Nm_per_rad is not None:
        return SpringLoad(parameters.load_stiffness_Nm_per_rad), "model"
    if given.tau_out is None:
        raise ModelError(
            f"{given.recording.batch}/{given.recording.id}: the batch states no load spring and no torque was "
            "measured at the load pulley; one of the two is needed to know the load"
        )
    return TorqueLoad(given.tau_out - parameters.tau_out_zero_Nm), PRESCRIBED


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
