"""Turning points of a sampled motion, which lie between its samples.

Friction remembers where the drive turned, and after a turn the drive's tension changes with the square root of the
travel. A motion that is linear between its samples turns at one of them, up to a T^2 / 8 too early (acceleration a,
sampling interval T): at 1 Hz and 125 Hz by 0.03 % of the amplitude, but in the sample after the turn the torque is then
off by many times its noise.
"""

from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

# Distance from a sample, over the sampling interval, within which a turning point is at the sample.
AT_SAMPLE = 0.02


@dataclass(frozen=True)
class TurningPoints:
    """Points at which a motion turns between its samples.

    Attributes
    ----------
    interval : ndarray of int, shape (turns,)
        Index of the sample before each.
    share : ndarray, shape (turns,)
        Time from that sample, over the interval between samples.
    theta : ndarray, shape (turns,)
        Angle there, in the unit of the motion.
    """

    interval: NDArray
    share: NDArray
    theta: NDArray

    @classmethod
    def of(cls, time_s: NDArray, theta: NDArray) -> "TurningPoints":
        """Turning points of a motion without noise, shape (n,).

        Between two samples the motion is a parabola. Its acceleration is the smaller one of those about either sample,
        so that a motion that comes to rest from one sample to the next does not turn there.
        """
        h = np.diff(time_s)
        speed = np.diff(theta) / h
        a = np.diff(speed) / ((h[:-1] + h[1:]) / 2)
        before, after = a[:-1], a[1:]
        both = np.where(before * after > 0, np.sign(before) * np.minimum(np.abs(before), np.abs(after)), 0.0)
        h, speed = h[1:-1], speed[1:-1]
        turns = np.abs(speed) < (0.5 - AT_SAMPLE) * h * np.abs(both)
        h, speed, both = h[turns], speed[turns], both[turns]
        interval, share = np.flatnonzero(turns) + 1, 0.5 - speed / (both * h)
        return cls(interval, share, theta[interval] + h * share * (speed + both * h * (share - 1) / 2))

    @overload
    def inserted(self, values: NDArray) -> NDArray: ...

    @overload
    def inserted(self, values: None) -> None: ...

    def inserted(self, values: NDArray | None) -> NDArray | None:
        """Values at the samples and at the turning points, linear in between; shapes (n,) and (n + turns,).

        None where there are no values.
        """
        if values is None:
            return None
        before, after = values[self.interval], values[self.interval + 1]
        return np.insert(values, self.interval + 1, before + self.share * (after - before))

    def inserted_in_motion(self, theta: NDArray) -> NDArray:
        """The motion itself with its turning points, shape (n + turns,)."""
        return np.insert(theta, self.interval + 1, self.theta)

    def samples(self, n: int) -> NDArray:
        """Indices of the n samples among the values that `inserted` returns."""
        return np.arange(n) + np.searchsorted(self.interval, np.arange(n), side="left")
