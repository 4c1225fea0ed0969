"""Noise from consecutive cycles: how well a channel repeats within a recording of a periodic motion.

The difference of consecutive cycles at equal phase has twice the variance of the noise. What drifts over the cycles
(relaxation, running-in) differs as well, but smoothly over a cycle, or in proportion to the channel, its rate or the
direction of motion: such differences are removed by least squares and do not count as noise. Slow noise is removed with
them, so that the estimate is rather too low than too high.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import THETA_IN
from ccmodel.recording import Recording

# Samples over which a period is searched, and the shortest period in samples of the recording.
SEARCHED, SHORTEST_PERIOD = 500, 40
# Largest rms difference of the drive angle between two cycles, over its stroke, for the same motion.
SAME_CYCLE = 0.01
# Least part of a cycle that is compared with the next one.
LEAST_PART = 0.4
# Harmonics of the cycle up to which a difference is smooth.
HARMONICS = 4
# Window over which a channel is averaged before it serves as a regressor, as a share of the cycle.
AVERAGED = 0.01


@dataclass(frozen=True)
class CycleNoise:
    """Noise of the channels from consecutive cycles.

    Attributes
    ----------
    variance : dict of str to float
        By channel, in its unit squared.
    cycles : float
        Number of cycles that were compared with the next one.
    """

    variance: dict[str, float]
    cycles: float


NONE = CycleNoise({}, 0.0)


def cycle_noise(recording: Recording) -> CycleNoise:
    """Noise of every channel but the drive angle; no channel without at least two comparable cycles."""
    judged = recording.time_s >= max(recording.rest_s, recording.settled_s, _memory_ends(recording))
    t, drive = recording.time_s[judged], recording[THETA_IN][judged]
    period = _period(t, drive) if t.size > 2 * SHORTEST_PERIOD and np.ptp(drive) else None
    if period is None:
        return NONE
    squares: dict[str, list[tuple[float, int]]] = {}
    compared, end = 0.0, t[-1] - period
    rate = np.gradient(_averaged(drive, t, period), t)
    while end - t[0] >= LEAST_PART * period:
        first = np.flatnonzero((t >= end - period) & (t < end))
        apart = _later(t, drive, t[first] + period)[0] - drive[first]
        if np.sqrt(np.mean(apart**2)) <= SAME_CYCLE * np.ptp(drive):
            compared += float(np.ptp(t[first])) / period
            for channel, values in recording.channels.items():
                if channel != THETA_IN:
                    row = _difference(t, values[judged], first, period, apart, rate[first])
                    squares.setdefault(channel, []).append(row)
        end -= period
    variance = {c: float(sum(s for s, _ in rows) / sum(n for _, n in rows)) for c, rows in squares.items()}
    return CycleNoise(variance, compared)


def _memory_ends(recording: Recording) -> float:
    """Time from which on the drive has been near both ends of its stroke, s: friction has forgotten the start."""
    drive = recording[THETA_IN]
    near = SAME_CYCLE * np.ptp(drive)
    return float(
        max(recording.time_s[np.argmax(e)] for e in (drive >= drive.max() - near, drive <= drive.min() + near))
    )


def _difference(
    t: NDArray, values: NDArray, first: NDArray, period: float, apart: NDArray, rate: NDArray
) -> tuple[float, int]:
    """Sum of squares of the noise of a channel over a cycle, and its degrees of freedom."""
    later, gain = _later(t, values, t[first] + period)
    smooth, phase = _averaged(values, t, period), (t[first] - t[first[0]]) / period
    at = 2 * np.pi * np.arange(1, HARMONICS + 1) * phase[:, None]
    of_channel = [smooth[first], np.gradient(smooth, t)[first], apart, np.tanh(10 * rate / (np.abs(rate).max() or 1.0))]
    basis = np.column_stack([np.ones(phase.size), phase, np.cos(at), np.sin(at), *of_channel])
    basis /= np.sqrt(np.mean(basis**2, axis=0)) + 1e-300
    difference = later - values[first]
    left = difference - basis @ np.linalg.lstsq(basis, difference, rcond=1e-10)[0]
    return float(np.sum(left**2 / (1 + gain))), max(first.size - basis.shape[1], 1)


def _later(t: NDArray, values: NDArray, at: NDArray) -> tuple[NDArray, NDArray]:
    """Values at other times by linear interpolation, and the share of a white noise's variance that they keep."""
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, t.size - 2)
    share = np.clip((at - t[k]) / (t[k + 1] - t[k]), 0.0, 1.0)
    return (1 - share) * values[k] + share * values[k + 1], (1 - share) ** 2 + share**2


def _averaged(values: NDArray, t: NDArray, period: float) -> NDArray:
    """Running mean over a small share of the period, shape (n,)."""
    half = max(1, round(AVERAGED * period / float(np.median(np.diff(t))) / 2))
    padded = np.pad(values, half, mode="edge")
    return np.convolve(padded, np.full(2 * half + 1, 1 / (2 * half + 1)), mode="valid")


def _period(t: NDArray, drive: NDArray) -> float | None:
    """Period of the drive's motion, s: the shortest lag after which it repeats; None if it does not."""
    grid = np.linspace(t[0], t[-1], SEARCHED)
    coarse = np.interp(grid, t, drive)
    step, stroke = grid[1] - grid[0], float(np.ptp(drive))
    least = max(2, int(np.ceil(SHORTEST_PERIOD * float(np.median(np.diff(t))) / step)))
    lags = np.arange(least, int(SEARCHED / (1 + LEAST_PART)))
    apart = np.array([np.sqrt(np.mean((coarse[k:] - coarse[:-k]) ** 2)) for k in lags]) / stroke
    # A motion that begins slowly repeats itself nearby: the lag must come after one at which it does not.
    is_far = np.maximum.accumulate(apart) > 0.2
    inner = np.flatnonzero(is_far[1:-1] & (apart[1:-1] <= apart[:-2]) & (apart[1:-1] <= apart[2:])) + 1
    for k in inner:
        around = np.linspace(lags[k] - 1, lags[k] + 1, 81) * step
        fine = [_apart(t, drive, lag) / stroke for lag in around]
        if min(fine) <= SAME_CYCLE:
            return float(around[int(np.argmin(fine))])
    return None


def _apart(t: NDArray, drive: NDArray, lag: float) -> float:
    kept = t[t <= t[-1] - lag]
    return float(np.sqrt(np.mean((np.interp(kept + lag, t, drive) - np.interp(kept, t, drive)) ** 2)))
