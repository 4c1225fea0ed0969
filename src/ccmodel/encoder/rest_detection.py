"""Detection of rests in encoder counts, and the angle within the count at which the drive rests.

The first counts on either side of a rest carry the information: a power series from rest is fitted to them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.encoder.expectation_propagation import fit_basis

# Longest dwell in the first count of a motion s^p from rest, in dwells of the next count: 1 / (2^(1/p) - 1), which is
# 2.4 at constant acceleration and 5.3 for p = 4. A reversal reaches 4.8. A longer dwell contains a rest.
DWELL_RATIO = 5.3
# Leading orders p of the power series: a step of acceleration (2) or of jerk (3). The following terms describe smoother
# starts. With order 4 as a candidate, other starts were taken for it too often.
LEADING_ORDERS = (2, 3)
TERMS = 4  # Terms of a power series.
MAX_COUNTS = 15  # Counts to which a series is fitted; so short a series describes no more.
MIN_SAMPLES = 4  # Samples of a rest.
START_TIMES = 7  # Candidate times of the start.
SWEEPS = 15  # Sweeps of expectation propagation for each candidate.
DITHER_SD = 0.1  # Standard deviation of the noise that makes an encoder at rest dither, counts.
TERM_SD = 3.0  # Prior standard deviation of each term at the last fitted sample, in counts moved by then.
UNIFORM = (0.0, 1 / 12)  # Mean and variance of an unknown offset within a count, counts.
MAX_OFFSET = 0.6  # A candidate whose start lies further from the middle of its count, in counts, is discarded.


@dataclass(frozen=True)
class Rest:
    """An interval over which the drive stands still.

    Attributes
    ----------
    first, last : int
        Its first and last sample.
    level, variance : float
        Estimate of the angle, counts, and its variance.
    """

    first: int
    last: int
    level: float
    variance: float


def find_rests(counts: NDArray, resting: int) -> list[Rest]:
    """Find the counts whose dwell is longer than a motion through the neighbouring counts allows.

    Parameters
    ----------
    counts : ndarray, shape (n,)
        Middle of each sample's count, counts.
    resting : int
        Number of samples at the start that are known to be at rest; the count may dither by one there.

    Returns
    -------
    list of Rest
        In the order of time.
    """
    edges = np.concatenate([[0], np.flatnonzero(np.diff(counts)) + 1, [counts.size]])
    spread = np.maximum.accumulate(counts) - np.minimum.accumulate(counts)
    resting = min(resting, int(np.searchsorted(spread, 1, "right")))
    if resting:
        edges = np.concatenate([[0], edges[edges >= resting]])
    dwell = np.diff(edges)
    neighbours = np.r_[0, dwell[:-1]], np.r_[dwell[1:], 0]
    arriving, leaving = (np.ceil(DWELL_RATIO * neighbour).astype(int) for neighbour in neighbours)
    # The first and the last count have one neighbour, which stands for both.
    at_end = (arriving == 0) | (leaving == 0)
    rests = []
    for i in np.flatnonzero(dwell >= (arriving + leaving) * np.where(at_end, 2, 1) + MIN_SAMPLES):
        if i > 0 or not resting:
            rests.append(_rest(counts, edges[i], edges[i + 1], arriving[i], leaving[i]))
    if resting:
        rests.insert(0, _rest(counts, 0, edges[1], 0, min(leaving[0], dwell[0] // 2)))
    return rests


def _rest(counts: NDArray, begin: int, end: int, arriving: int, leaving: int) -> Rest:
    """The rest within samples `begin` to `end`, the first `arriving` and last `leaving` of which may be motion."""
    still = counts[begin + arriving : end - leaving]
    if still.min() < still.max():  # The count dithers, so the drive rests on the edge between two counts.
        return Rest(begin + arriving, end - leaving - 1, np.unique(still).mean(), DITHER_SD**2)
    middle = (begin + arriving + end - leaving) // 2
    first, last, offsets = 0, counts.size - 1, []
    if begin > 0:
        start, *estimate = _start_of_motion(counts[middle::-1] - still[0], middle - begin - arriving)
        first = middle - start
        offsets.append(estimate)
    if end < counts.size:
        start, *estimate = _start_of_motion(counts[middle:] - still[0], end - leaving - 1 - middle)
        last = middle + start
        offsets.append(estimate)
    offset, variance = np.array(offsets if offsets else [UNIFORM]).T
    mean = (offset / variance).sum() / (1 / variance).sum()
    return Rest(first, last, still[0] + mean, 1 / (1 / variance).sum())


def _start_of_motion(moved: NDArray, earliest: int) -> tuple[int, float, float]:
    """Time and angle at which a motion starts, from the first counts it passes.

    Bayesian model averaging over power series from rest of several leading orders and start times.

    Parameters
    ----------
    moved : ndarray, shape (n,)
        Counts passed, from a sample within the rest on.
    earliest : int
        Earliest sample of the start.

    Returns
    -------
    start : int
        Sample of the start.
    offset, variance : float
        Angle at the start, counts from the middle of the count at rest, and its variance.
    """
    last_still = int(np.flatnonzero(moved)[0]) - 1
    side = np.sign(moved[last_still + 1])
    moved = side * moved
    reversals = np.flatnonzero(moved < np.maximum.accumulate(moved))
    moved = moved[: reversals[0]] if reversals.size else moved
    fitted_counts = min(MAX_COUNTS, moved[-1] / 2)
    if fitted_counts < 1:
        return earliest, *UNIFORM
    moved = moved[: int(np.flatnonzero(moved > fitted_counts)[0])]
    # On a rising curve the intervals of a count's first and last sample imply those between. The long first count gets
    # a few more, since a series need not rise there.
    changes = np.flatnonzero(np.diff(moved))
    used = np.unique(np.r_[np.linspace(0, last_still, 6).astype(int), changes, changes + 1, moved.size - 1])
    times = np.linspace(earliest, last_still, START_TIMES)
    fits = np.array([(time, *_fit_series(time, order, used, moved)) for time in times for order in LEADING_ORDERS])
    time, log_evidence, offset, variance = fits[np.isfinite(fits).all(axis=1) & (abs(fits[:, 2]) < MAX_OFFSET)].T
    if not time.size:
        return earliest, *UNIFORM
    weight = np.exp(log_evidence - log_evidence.max())
    weight /= weight.sum()
    mean, start = weight @ offset, weight @ time
    variance = weight @ (variance + offset**2) - mean**2
    # One standard deviation early: too late a start would hold samples still that move, too early a one does no harm.
    start -= np.sqrt(weight @ (time - start) ** 2)
    return max(int(start), earliest), side * float(np.clip(mean, -0.5, 0.5)), min(variance, UNIFORM[1])


def _fit_series(start: float, order: int, used: NDArray, moved: NDArray) -> tuple[float, float, float]:
    """Log evidence of a power series from `start` on, and mean and variance of the angle at rest."""
    progress = np.maximum(used - start, 0.0) / (moved.size - start)
    basis = np.column_stack([np.ones(used.size)] + [progress ** (order + i) for i in range(TERMS)])
    prior = np.array([1.0] + [1 / (TERM_SD * (moved[-1] + 1)) ** 2] * TERMS)
    return fit_basis(basis, prior, moved[used] - 0.5, moved[used] + 0.5, SWEEPS)
