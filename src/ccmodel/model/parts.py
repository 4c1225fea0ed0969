"""Parts of the transmission by themselves, with what was measured at their boundaries: what fails is the place.

The cables and the load pulley between measured angles are `ccmodel.model.run.simulate` with `load_from="angle"`: a
cable whose both ends are moved knows nothing of the other one. The load pulley against its measured torque is the
same with `load_from="torque"`.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import CABLES
from ccmodel.failure import ModelError
from ccmodel.mechanisms.pulley_eccentricity import winding
from ccmodel.mechanisms.pulley_friction import bearing
from ccmodel.model.exact.pair import CableResponse, ForceEnd, MotionEnd, simulate_cable
from ccmodel.model.general.run import load_law, settings_of
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, initial_tension, spring_load


def drive_pulley(theta_in: NDArray, T1_N: NDArray, T3_N: NDArray, parameters: Parameters) -> NDArray:
    """Torque of the drive from the tensions at its pulley.

    Parameters
    ----------
    theta_in : ndarray, shape (n,)
        Angle of the pulley, rad; its bearing starts unloaded.
    T1_N, T3_N : ndarray, shape (n,)
        Tensions of cables A and B there, N.
    parameters : Parameters
        Radius, and eccentricity and bearing friction where these act.

    Returns
    -------
    ndarray, shape (n,)
        tau_in, N m.
    """
    settings = settings_of(parameters.mechanisms)
    _, round_, _ = winding(theta_in, *settings.drive_eccentricity)
    rubs = settings.drive_friction_Nm * bearing(theta_in, settings.drive_presliding_rad)
    return (T1_N - T3_N) * parameters.drive_radius_m * round_ + rubs


def cable(
    given: ModelInput, parameters: Parameters, name: Literal["A", "B"], far: Literal["angle", "tension"] = "angle"
) -> CableResponse:
    """One cable, moved at the drive as recorded, its far end moved or held as recorded; by the paper's physics.

    Parameters
    ----------
    given : ModelInput
    parameters : Parameters
        Without mechanisms: between measured angles these run with ``simulate(..., load_from="angle")``.
    name : {"A", "B"}
    far : {"angle", "tension"}
        Whether the angle of the load pulley or the tension there (T2 or T4) is what is given.

    Returns
    -------
    CableResponse

    Raises
    ------
    ModelError
        If what is to be given was not recorded, or mechanisms act.
    """
    recording = given.recording
    if parameters.mechanisms:
        raise ModelError(
            "a single cable knows the paper's physics only; with mechanisms simulate from the load's angle"
        )
    side, tension = {"A": 1, "B": -1}[name], CABLES[name][1]
    if (far == "tension" and tension not in recording) or (far == "angle" and given.theta_out is None):
        raise ModelError(f"{recording.batch}/{recording.id}: {far} at the far end of cable {name} was not recorded")
    if far == "tension":
        end = ForceEnd(np.maximum(recording[tension], 0.0))
    else:
        end = MotionEnd(side * parameters.load_radius_m * given.theta_out)
    near = side * parameters.drive_radius_m * given.theta_in
    rigidity = parameters.stiffness_N_per_m * parameters.reference_length_m
    initial = initial_tension(given, parameters).of_cable(name)
    path = recording.path.with_extra_bend(parameters.extra_bend_rad)
    return simulate_cable(path, rigidity, parameters.friction, end, near, initial)


def load(given: ModelInput, parameters: Parameters) -> NDArray:
    """Torque that the load's law asks for at the angle that was measured, N m, shape (n,).

    Raises
    ------
    ModelError
        If the load has no law, or its angle was not recorded.
    """
    recording = given.recording
    if given.theta_out is None or parameters.load_stiffness_Nm_per_rad is None:
        raise ModelError(f"{recording.batch}/{recording.id}: no angle or no law of the load to work it from")
    start = initial_tension(given, parameters)
    torque = (start.tension_A_N[-1] - start.tension_B_N[-1]) * parameters.load_radius_m
    settings = settings_of(parameters.mechanisms)
    return load_law(settings, spring_load(given, parameters), recording.time_s, given.theta_out, torque)
