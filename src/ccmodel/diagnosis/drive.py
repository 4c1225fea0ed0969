"""The drive's motion: its speed, and the travel and time since its last reversal."""

import numpy as np
from numpy.typing import NDArray

from ccmodel.diagnosis import settings
from ccmodel.model.run import ModelInput


def speed(given: ModelInput) -> NDArray:
    """Speed of the drive, rad/s, shape (n,)."""
    return np.gradient(given.theta_in, given.recording.time_s)


def is_moving(given: ModelInput) -> NDArray:
    """Whether the drive moves, shape (n,)."""
    omega = np.abs(speed(given))
    return omega > settings.REST_SPEED * omega.max()


def since_reversal(given: ModelInput) -> tuple[NDArray, NDArray]:
    """Travel (rad, signed) and time (s) since the drive's last reversal, shapes (n,) each."""
    theta, time_s = given.theta_in, given.recording.time_s
    direction = np.where(is_moving(given), np.sign(speed(given)), 0.0)
    # At rest the drive keeps its last direction.
    last = np.maximum.accumulate(np.where(direction != 0, np.arange(direction.size), 0))
    reversed_here = np.r_[True, np.diff(direction[last]) != 0]
    at = np.maximum.accumulate(np.where(reversed_here, np.arange(direction.size), 0))
    return theta - theta[at], time_s - time_s[at]
