"""A wanted motion of the load and a model -> the motion of the drive, within limits of its speed and acceleration."""

from dataclasses import dataclass, replace
from math import inf

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.channels import THETA_IN, THETA_OUT
from ccmodel.failure import ModelError
from ccmodel.inverse import follow
from ccmodel.kernel import kernel
from ccmodel.model.active import modify_physics, without_faults
from ccmodel.model.general.run import settings_of
from ccmodel.model.model_input import ModelInput
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import initial_tension, simulate, transmission_of
from ccmodel.model.session import of_recording
from ccmodel.recording import Recording

WANTED = "theta_wanted_rad"
# A limit that is exceeded by this share is kept but for rounding.
ROUNDING = 1e-6


@dataclass(frozen=True)
class Limits:
    """What a drive can do.

    Attributes
    ----------
    speed_rad_per_s, acceleration_rad_per_s2 : float
        Positive; infinite without a limit. A limit of the acceleration needs one of the speed.
    """

    speed_rad_per_s: float = inf
    acceleration_rad_per_s2: float = inf

    def __post_init__(self) -> None:
        if self.acceleration_rad_per_s2 < inf and self.speed_rad_per_s == inf:
            raise ValueError("a limit of the acceleration needs one of the speed")


@dataclass(frozen=True)
class Compensated:
    """The drive's motion, and what the load does, by the model.

    Attributes
    ----------
    table : DataFrame
        Columns time_s, theta_in_rad, theta_out_rad (the load, by the model) and theta_wanted_rad.
    straight_rad : ndarray, shape (n,)
        Angle of the load, by the model, if the wanted motion is passed to the drive as it is.
    notes : tuple of str
        Where the motion exceeds the limits.
    """

    table: pd.DataFrame
    straight_rad: NDArray
    notes: tuple[str, ...]


def compensated(
    wanted: pd.DataFrame, parameters: Parameters, like: Recording, limits: Limits, pretension_N: float | None = None
) -> Compensated:
    """The drive's motion that makes the load follow a wanted one, on a rig at rest with even initial tension.

    Parameters
    ----------
    wanted : DataFrame
        Columns time_s (s, increasing) and theta_out_rad (rad, from the load's angle at rest).
    parameters : Parameters
    like : Recording
        Gives the conduits' path, the far end and the pretension; its samples are not used.
    limits : Limits
    pretension_N : float, optional
        Instead of the nominal pretension of `like` and of one that was fitted.

    Raises
    ------
    ModelError
        If the model has no law of the load, or the drive cannot bring the load to the wanted angle.
    """
    if parameters.load_stiffness_Nm_per_rad is None or like.load_motion_is_given:
        raise ModelError("the model has no law of its load: without one, no motion of the load has a torque")
    if pretension_N is None:
        pretension_N = like.pretension_N
    else:
        parameters = replace(parameters, pretension_N=None)
    # A fault of the encoder at the load moves nothing: what is compared is the load itself.
    itself = replace(parameters, mechanisms=without_faults(parameters.mechanisms), theta_out_zero_rad=0.0)
    time_s, load = wanted["time_s"].to_numpy(float), wanted[THETA_OUT].to_numpy(float)

    def response(theta_in: NDArray) -> NDArray:
        return simulate(ModelInput.prescribed(like, time_s, theta_in, pretension_N), itself)[THETA_OUT]

    straight = load * parameters.load_radius_m / parameters.drive_radius_m
    given = ModelInput.prescribed(like, time_s, straight, pretension_N)
    theta_in = within_limits(time_s, _drive(given, of_recording(parameters, given.recording), load), limits)
    columns = {"time_s": time_s, THETA_IN: theta_in, THETA_OUT: response(theta_in), WANTED: load}
    return Compensated(pd.DataFrame(columns), response(straight), _on_start(time_s, theta_in, limits))


def _drive(given: ModelInput, parameters: Parameters, wanted: NDArray) -> NDArray:
    """Drive angles without limits, shape (n,), rad."""
    if not np.ptp(wanted) > 0:
        raise ModelError("the wanted motion does not move")
    transmission = transmission_of(given.recording, parameters)
    initial, time_s = initial_tension(given, parameters), given.recording.time_s
    stiffness = parameters.load_stiffness_Nm_per_rad or 0.0
    if modify_physics(parameters.mechanisms):
        settings = settings_of(parameters.mechanisms)
        theta_in, solved = follow.general(transmission, stiffness, settings, initial, time_s, wanted)
    else:
        theta_in, solved = follow.exact(transmission, stiffness, initial, wanted)
    if solved < wanted.size:
        raise ModelError(f"no motion of the drive was found that turns the load to its wanted angle at sample {solved}")
    return theta_in


def within_limits(time_s: NDArray, theta: NDArray, limits: Limits) -> NDArray:
    """The motion within limits, centred on where the motion without them jumps; shape (n,), rad.

    The mean of a motion that follows at no more than a speed and of one that anticipates at no more than it keeps to
    that speed, and crosses a jump at half of it. So twice the limit v comes first, which makes jumps ramps of speed v,
    and then v, which slows what else is too fast. A moving mean over 2 v / a then keeps to the acceleration a.
    """
    if limits.speed_rad_per_s == inf:
        return theta
    slowed = theta
    for speed in (2 * limits.speed_rad_per_s, limits.speed_rad_per_s):
        most = speed * np.diff(time_s)
        slowed = 0.5 * (_slowed(slowed, most) + _slowed(slowed[::-1], most[::-1])[::-1])
    width = 2 * limits.speed_rad_per_s / limits.acceleration_rad_per_s2
    if width == 0.0:
        return slowed
    # Before its first and after its last sample the drive rests.
    time = np.concatenate([[time_s[0] - width], time_s, [time_s[-1] + width]])
    padded = np.concatenate([slowed[:1], slowed, slowed[-1:]])
    steps = np.diff(time)
    integral = np.concatenate([[0.0], np.cumsum(steps * (padded[1:] + padded[:-1]) / 2)])
    return (_at(time_s + width / 2, time, padded, integral) - _at(time_s - width / 2, time, padded, integral)) / width


def _on_start(time_s: NDArray, theta: NDArray, limits: Limits) -> tuple[str, ...]:
    """A note if a drive that rests at zero before the motion cannot reach its first angles within the limits."""
    if limits.speed_rad_per_s == inf:
        return ()
    step = time_s[1] - time_s[0]
    speed = np.diff(theta, prepend=0.0)[:2] / np.diff(time_s, prepend=time_s[0] - step)[:2]
    acceleration = np.diff(speed, prepend=0.0) / step
    most_speed, most_acceleration = limits.speed_rad_per_s, limits.acceleration_rad_per_s2
    over = max(np.abs(speed).max() / most_speed, np.abs(acceleration).max() / most_acceleration)
    if over <= 1 + ROUNDING:
        return ()
    rest_s = np.ptp(theta) / most_speed + most_speed / most_acceleration
    text = f"the motion begins with a step from rest that is {over:.2g} times what the drive's limits allow"
    return (f"{text}: let the wanted motion begin with a rest, of which {rest_s:.2g} s are enough",)


def _at(when: NDArray, time: NDArray, values: NDArray, integral: NDArray) -> NDArray:
    """Integral of a polygon up to times between its corners."""
    k = np.clip(np.searchsorted(time, when, side="right") - 1, 0, time.size - 2)
    since = when - time[k]
    slope = (values[k + 1] - values[k]) / (time[k + 1] - time[k])
    return integral[k] + since * (values[k] + since * slope / 2)


@kernel(allocates=True)
def _slowed(theta: NDArray, most: NDArray) -> NDArray:
    """The motion that follows `theta` by at most `most` (shape (n - 1,)) from sample to sample."""
    slowed = np.empty_like(theta)
    slowed[0] = theta[0]
    for i in range(1, theta.size):
        slowed[i] = slowed[i - 1] + min(max(theta[i] - slowed[i - 1], -most[i - 1]), most[i - 1])
    return slowed
