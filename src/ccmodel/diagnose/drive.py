"""What the drive is doing: how fast it moves and what it has done since it last turned round."""

import numpy as np
from numpy.typing import NDArray

from ccmodel.model.run import ModelInput

# Below this share of a recording's highest speed the drive counts as still.
STILL_SHARE = 0.02


def speed(given: ModelInput) -> NDArray:
    """Speed of the drive, rad/s, shape (n,)."""
    return np.gradient(given.theta_in, given.recording.time_s)


def is_moving(given: ModelInput) -> NDArray:
    """Whether the drive moves, shape (n,)."""
    omega = np.abs(speed(given))
    return omega > STILL_SHARE * omega.max()


def since_reversal(given: ModelInput) -> tuple[NDArray, NDArray]:
    """How far (rad, signed) and how long (s) the drive has gone since it last turned round, shapes (n,) each."""
    theta, time_s = given.theta_in, given.recording.time_s
    way = np.where(is_moving(given), np.sign(speed(given)), 0.0)
    # While it is still, it goes on in the way that it went last.
    last = np.maximum.accumulate(np.where(way != 0, np.arange(way.size), 0))
    turned = np.r_[True, np.diff(way[last]) != 0]
    at = np.maximum.accumulate(np.where(turned, np.arange(way.size), 0))
    return theta - theta[at], time_s - time_s[at]
