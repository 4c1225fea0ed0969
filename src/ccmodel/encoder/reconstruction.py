"""Reconstruction of the drive motion from its encoder counts, for use as the input of a model.

A Gaussian process under interval-censored observations. The prior has small fourth differences (motions without
corners) or third differences with heavy tails (triangles, steps of acceleration), whichever gives the counts the
higher leave-one-out predictive density. The variance of the differences is estimated from the recording, over windows
of a tenth of a second. At rest the angle is constant; its offset within the count is estimated from the first counts on
either side of the rest (`ccmodel.encoder.rest_detection`).

Accuracy
--------
Motions that start from rest, 0.18 deg a count at 250 Hz, mean over eight offsets within a count. Columns, as rms error
in counts unless stated otherwise:

- moving, turns (slower than 15 % of the peak speed), holds: without the error of the first rest's offset
- from rest: with that error; in brackets the error of the counts themselves
- within: share of samples within 1.645 stated standard deviations, nominally 0.90
- torque: rms error of the drive torque of the exact model (7 N, 3.1 rad of bend, friction 0.156), mN m, mean over three
  offsets; in brackets with the counts as input

============================  ======  =====  =====  ===========  ======  ===========
motion                        moving  turns  holds  from rest    within  torque
============================  ======  =====  =====  ===========  ======  ===========
sine 0.6 rad, 0.5 Hz          0.02    0.03          0.09 (0.38)  1.00    0.05 (0.50)
sine 0.3 rad, 0.25 Hz         0.02    0.02          0.06 (0.38)  1.00    0.06 (0.81)
sine 0.05 rad, 0.5 Hz         0.03    0.04          0.21 (0.38)  0.88    0.20 (0.96)
growing sine 0.8 rad, 0.5 Hz  0.02    0.02          0.23 (0.39)  0.63    0.16 (0.70)
chirp 0.4 rad, 0.15 to 1 Hz   0.04    0.06          0.13 (0.38)  0.96    0.19 (0.75)
free form up to 1.5 Hz        0.03    0.03          0.13 (0.39)  0.99    0.07 (0.77)
triangle, reversals of 80 ms  0.04    0.06          0.22 (0.39)  0.85    0.11 (0.45)
triangle, reversals of 30 ms  0.04    0.17          0.19 (0.39)  1.00    0.14 (0.43)
minimum-jerk steps            0.06    0.10   0.15   0.22 (0.33)  0.88    0.09 (0.28)
slow small steps, 0.05 rad    0.05    0.09   0.16   0.14 (0.41)  0.95    0.33 (0.85)
steps of constant ramps       0.06    0.10   0.22   0.27 (0.33)  0.87    0.15 (0.26)
============================  ======  =====  =====  ===========  ======  ===========

The offsets of rests dominate the error: a fast start passes too few samples a count to determine them. Over 24 offsets,
the error of the first rest is 0.15 counts (minimum-jerk steps) and 0.23 counts (constant ramps), with a stated standard
deviation of 0.19. With the true offset the errors would be 0.06 and 0.05 in motion, 0.14 and 0.21 in holds. Counts do
not determine the law of the start. If it is known to be constant acceleration, 30 counts of a ramp determine the
offset to 0.05 counts; a prior for this law reduces the error of ramps to 0.13 counts, but increases that of steps,
sines and triangles to 0.2 to 0.3. A common order for all rests of a recording gained almost nothing. The cables
determine the offset: a fit of torques and force sums (`Parameters.drive_encoder_offset`) reduces its standard deviation
to an eighth, 0.02 to 0.03 counts, on the sines of `data/raw/loops`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ccmodel.encoder.rest_detection import Rest, find_rests
from ccmodel.encoder.smoothing import REST_SAMPLES, smooth

# Time over which the variance of the difference is nearly constant.
WINDOW_S = 0.08
# Step of time of the reconstruction; motions are much slower.
STEP_S = 0.004
# Samples over which the even step of a recording is estimated, the usual one first; largest distance of a sample from
# its multiple, in steps; and by how much finer the grid is where samples are further away.
SPANS, OFF_GRID, FINER = (1, 4, 16, 64, 256, 1024), 0.26, (1, 2, 3, 4)


@dataclass(frozen=True)
class DriveMotion:
    """Posterior of the drive motion.

    Attributes
    ----------
    theta_rad : ndarray, shape (n,)
        Drive angle, rad; 0 at the initial rest if there is one.
    sigma_rad : ndarray, shape (n,)
        Its standard deviation, rad.
    deviations_rad : ndarray, shape (draws, n)
        Draws from the posterior less `theta_rad`, rad; a model propagates them to its channels.
    encoder_offset_rad : ndarray, shape (n,)
        Deviation of the motion for one standard deviation of the first rest's offset within its count, rad. It is 0 at
        that rest and constant afterwards except at other rests. Each draw contains it `smoothing.OFFSET_SCORES` times.
    zero_rad : float
        Encoder angle at which `theta_rad` is 0, rad: `theta_rad + zero_rad` is within half a count of the counts.
    """

    theta_rad: NDArray
    sigma_rad: NDArray
    deviations_rad: NDArray
    encoder_offset_rad: NDArray
    zero_rad: float


def reconstruct_motion(time_s: NDArray, theta_counts_rad: NDArray, step_rad: float, rest_s: float) -> DriveMotion:
    """Estimate the drive angle of which each count gives an interval.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Sample times, s, increasing, evenly spaced except for gaps.
    theta_counts_rad : ndarray, shape (n,)
        Drive angle as counted, rad, from any zero.
    step_rad : float
        Angle of one count, rad.
    rest_s : float
        End of the initial rest, s; 0 if the recording begins in motion.

    Returns
    -------
    DriveMotion
        The motion and its uncertainty.

    Raises
    ------
    ValueError
        If the arrays differ in shape or are too short, or the step is not positive.
    """
    time = np.asarray(time_s, dtype=float)
    counted = np.asarray(theta_counts_rad, dtype=float)
    if time.shape != counted.shape or time.ndim != 1 or time.size < REST_SAMPLES:
        raise ValueError(
            f"time and angle must be of the same shape with {REST_SAMPLES} samples or more; got {counted.shape}"
        )
    if not step_rad > 0:
        raise ValueError(f"the angle of one count must be positive; got {step_rad}")
    from_rest, zero = rest_s > 0, counted[0]
    thinned = slice(None, None, _stride(time, counted / step_rad))
    step_s, counts, observed = _on_even_steps(time[thinned], (counted[thinned] - zero) / step_rad)
    resting = int(np.searchsorted(time[thinned], rest_s, "right")) if from_rest else 0
    rests = find_rests(counts, resting)
    posterior = smooth(counts, observed, rests, WINDOW_S / step_s, from_rest)
    grid = time[0] + step_s * np.arange(counts.size)
    angle, *others = (
        step_rad * _smoothly(time, grid, _without_overshoot(posterior.mean + deviation, counts, rests))
        for deviation in (0.0, *posterior.draws, posterior.offset)
    )
    *draws, offset = (other - angle for other in others)
    sigma = step_rad * np.interp(time, grid, posterior.sd)
    if from_rest:
        return DriveMotion(angle - angle[0], sigma, np.array(draws), offset, angle[0] + zero)
    return DriveMotion(angle + zero, sigma, np.array(draws), offset, 0.0)


def _stride(time: NDArray, counts: NDArray) -> int:
    """Number of samples per step of the reconstruction: at smaller steps only rounding errors grow."""
    step_s = np.median(np.diff(time))
    fastest = uniform_filter1d(abs(np.diff(counts)), max(1, round(WINDOW_S / step_s)), mode="nearest").max()
    most = min(int(STEP_S / step_s * 1.01), time.size // REST_SAMPLES)
    return max(1, most if fastest * most < 1 else int(1 / fastest))


def _on_even_steps(time: NDArray, counts: NDArray) -> tuple[float, NDArray, NDArray]:
    """Even time step, s, whole counts at these steps, and which were observed: a gap repeats the count before it."""
    step_s, index = _even_step(time)
    observed = np.zeros(index[-1] + 1, bool)
    observed[index] = True
    latest = np.searchsorted(index, np.arange(observed.size), "right") - 1
    return step_s, np.round(counts[latest]), observed


def _even_step(time: NDArray) -> tuple[float, NDArray]:
    """Time step, s, at whole multiples of which all samples lie, as nearly as can be, and their numbers.

    The median step is one sample's: of a clock of whole ms that runs at 240 Hz it is 4 ms, and multiples of it drift
    away from the samples. A gap of ten and a half steps, or a jitter, needs a finer grid.
    """
    passed = time - time[0]
    medians = [float(np.median((time[m:] - time[:-m]) / m)) for m in SPANS if m < time.size]
    steps = [step for median in medians for step in (median, _fitted_step(passed, median))]
    for factor in FINER:
        for step_s in steps:
            index = np.round(passed * factor / step_s)
            if float(np.abs(index * step_s / factor - passed).max()) <= OFF_GRID * step_s:
                return step_s / factor, index.astype(int)
    return step_s / factor, index.astype(int)


def _fitted_step(passed: NDArray, step_s: float) -> float:
    """Step of the straight line through samples over their numbers, which follow from a first guess, s."""
    for _ in range(2):
        index = np.round(passed / step_s)
        step_s = float(index @ passed / (index @ index))
    return step_s


def _smoothly(time: NDArray, grid: NDArray, curve: NDArray) -> NDArray:
    """A curve between the points of a grid: it turns there as round as at them, and rests where they do."""
    # It takes a fifth of a second to import, and many commands reconstruct nothing.
    from scipy.interpolate import Akima1DInterpolator

    return Akima1DInterpolator(grid, curve)(np.clip(time, grid[0], grid[-1]))


def _without_overshoot(angle: NDArray, counts: NDArray, rests: list[Rest]) -> NDArray:
    """The same curve, monotonic within the count of each rest.

    The counts permit an overshoot of a tenth of a count, but the cables would take it as a reversal: a false loss of
    tension that lasts as long as the rest.
    """
    angle = angle.copy()
    changes = np.flatnonzero(np.diff(counts)) + 1
    for rest in rests:
        level = angle[rest.first]
        before, after = changes[changes <= rest.first], changes[changes > rest.last]
        if before.size:
            arrival = slice(before[-1], rest.first)
            side = np.sign(counts[before[-1]] - counts[before[-1] - 1])
            angle[arrival] = side * np.maximum.accumulate(np.minimum(side * angle[arrival], side * level))
        if after.size:
            departure = slice(rest.last, after[0])
            side = np.sign(counts[after[0]] - counts[after[0] - 1])
            angle[departure] = side * np.maximum.accumulate(np.maximum(side * angle[departure], side * level))
    return angle
