"""Where a drive rests, and where within a count: from how it leaves and how it arrives."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.encoder.bounded import fitted

# A motion s^p from rest stays in the first count at most 1 / (2^(1/p) - 1) times as long as in the next: 2.4 times at
# constant acceleration, 5.3 where acceleration begins smoothly. Longer must have been a rest; a turn comes to 4.8.
LINGER = 5.3
# Orders of a start: a jump of acceleration or of jerk. What begins more smoothly still is in the terms that follow;
# when there was an order 4 too, other starts were taken for it too often.
ORDERS = (2, 3)
TERMS = 4
# A series this short describes the first counts of a motion only.
FIRST_COUNTS = 15
SHORTEST = 4  # Samples that make a rest.
STARTS = 7  # Times of start that are weighed against each other.
ROUNDS = 15
DITHER = 0.1  # Noise that makes a resting encoder dither, in counts.
WIDE = 3.0  # Standard deviation of a term at the end of what is looked at, in counts moved by then.
UNKNOWN = (0.0, 1 / 12)  # Mean and variance of a place within a count of which nothing is known.


@dataclass(frozen=True)
class Rest:
    """A stretch over which the drive stands still.

    Attributes
    ----------
    first, last : int
        Its first and last sample.
    level, variance : float
        Where it stands, in counts, and the variance of that.
    """

    first: int
    last: int
    level: float
    variance: float


def find_rests(counts: NDArray, resting: int) -> list[Rest]:
    """Find where the drive rests: where a count lasts longer than any motion through its neighbours could make it.

    Parameters
    ----------
    counts : ndarray, shape (n,)
        Middle of each sample's count, in counts.
    resting : int
        Number of samples at the start that are known to be at rest, dither of the count included.
    """
    edges = np.concatenate([[0], np.flatnonzero(np.diff(counts)) + 1, [counts.size]])
    spread = np.maximum.accumulate(counts) - np.minimum.accumulate(counts)
    resting = min(resting, int(np.searchsorted(spread, 1, "right")))
    if resting:
        edges = np.concatenate([[0], edges[edges >= resting]])
    stay = np.diff(edges)
    come, go = (np.ceil(LINGER * beside).astype(int) for beside in (np.r_[0, stay[:-1]], np.r_[stay[1:], 0]))
    # Where a recording begins or ends, one neighbour must tell for both.
    ends = (come == 0) | (go == 0)
    found = []
    for i in np.flatnonzero(stay >= (come + go) * np.where(ends, 2, 1) + SHORTEST):
        if i > 0 or not resting:
            found.append(_rest(counts, edges[i], edges[i + 1], come[i], go[i]))
    if resting:
        found.insert(0, _rest(counts, 0, edges[1], 0, min(go[0], stay[0] // 2)))
    return found


def _rest(counts: NDArray, begin: int, end: int, come: int, go: int) -> Rest:
    """The rest in samples `begin` to `end`, of which `come` and `go` at its ends may be motion."""
    still = counts[begin + come : end - go]
    if still.min() < still.max():  # It dithers, so it stands on the edge between two counts.
        return Rest(begin + come, end - go - 1, np.unique(still).mean(), DITHER**2)
    middle = (begin + come + end - go) // 2
    first, last, places = 0, counts.size - 1, []
    if begin > 0:
        since, *place = _place(counts[middle::-1] - still[0], middle - begin - come)
        first = middle - since
        places.append(place)
    if end < counts.size:
        since, *place = _place(counts[middle:] - still[0], end - go - 1 - middle)
        last = middle + since
        places.append(place)
    place, variance = np.array(places or [UNKNOWN]).T
    within = (place / variance).sum() / (1 / variance).sum()
    return Rest(first, last, still[0] + within, 1 / (1 / variance).sum())


def _place(moved: NDArray, earliest: int) -> tuple[int, float, float]:
    """When a motion starts and from where, from the first counts it passes.

    Power series from rest, of several orders and times of start, each weighed by how probable it makes the counts.

    Parameters
    ----------
    moved : ndarray, shape (n,)
        Counts passed, from within the rest on.
    earliest : int
        First sample at which it may start.

    Returns
    -------
    start : int
        Sample of the start.
    place, variance : float
        Where it started, in counts about the middle of the resting count.
    """
    leaves = int(np.flatnonzero(moved)[0])
    side = np.sign(moved[leaves])
    moved = side * moved
    turn = np.flatnonzero(moved < np.maximum.accumulate(moved))
    moved = moved[: turn[0]] if turn.size else moved
    wanted = min(FIRST_COUNTS, moved[-1] / 2)
    if wanted < 1:
        return earliest, *UNKNOWN
    moved = moved[: int(np.flatnonzero(moved > wanted)[0])]
    starts = np.linspace(earliest, leaves - 1, STARTS)
    # Along a rising curve the bounds at a count's first and last sample imply those between; the long first one gets a
    # few more, for a series need not rise.
    change = np.flatnonzero(np.diff(moved))
    telling = np.unique(np.r_[np.linspace(0, leaves - 1, 6).astype(int), change, change + 1, moved.size - 1])
    tries = np.array([(begin, *_from(begin, order, telling, moved)) for begin in starts for order in ORDERS])
    begin, evidence, place, variance = tries[np.isfinite(tries).all(axis=1) & (abs(tries[:, 2]) < 0.6)].T
    if not begin.size:
        return earliest, *UNKNOWN
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    mean, start = weight @ place, weight @ begin
    variance = weight @ (variance + place**2) - mean**2
    # A start taken too late would hold still what moves; one too early does no harm.
    start -= np.sqrt(weight @ (begin - start) ** 2)
    return max(int(start), earliest), side * float(np.clip(mean, -0.5, 0.5)), min(variance, UNKNOWN[1])


def _from(begin: float, order: int, telling: NDArray, moved: NDArray) -> tuple[float, float, float]:
    since = np.maximum(telling - begin, 0.0) / (moved.size - begin)
    basis = np.column_stack([np.ones(telling.size)] + [since ** (order + i) for i in range(TERMS)])
    prior = np.array([1.0] + [1 / (WIDE * (moved[-1] + 1)) ** 2] * TERMS)
    return fitted(basis, prior, moved[telling] - 0.5, moved[telling] + 0.5, ROUNDS)
