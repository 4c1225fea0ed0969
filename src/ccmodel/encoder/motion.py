"""The drive's true motion behind the staircase of its encoder, for use as the model's input."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ccmodel.encoder import bounded
from ccmodel.encoder.rests import Rest, find_rests


@dataclass(frozen=True)
class Prior:
    """What kind of motion is expected: a difference that is small, normally distributed or with heavy tails.

    Attributes
    ----------
    difference : tuple of float
        Third or fourth difference: jerk or its rate.
    start : float
        Variance of it to begin with, in counts.
    least : float
        Variance below which the estimate would be lost in rounding.
    tails : float
        Degrees of freedom of Student's t; infinite for a normal distribution.
    """

    difference: tuple[float, ...]
    start: float
    least: float
    tails: float


SMOOTH = Prior((1.0, -4.0, 6.0, -4.0, 1.0), 1e-6, 1e-13, np.inf)
CORNERED = Prior((-1.0, 3.0, -3.0, 1.0), 1e-4, 1e-10, 1.0)
PRIORS = (SMOOTH, CORNERED)
# Time over which the variance of the difference is taken to be the same.
ALIKE_S = 0.08
FIRST_ROUNDS, MORE_ROUNDS, LAST_ROUNDS = 10, 10, 5
NODE_S = 0.004  # Motions are much slower than this.
DRAWS = 8
SIDES = (-1.0) ** np.arange(DRAWS)  # Where the first rest is taken to be, in standard deviations, draw by draw.
PIN = 1e6  # Precision with which a rest is held where it was found to be; its variance is added afterwards.
NODES = 5  # What a rest is reduced to: more than any difference spans.


@dataclass(frozen=True)
class DriveMotion:
    """The drive's motion and what is left of its uncertainty.

    Attributes
    ----------
    theta_rad : ndarray, shape (n,)
        Drive angle, rad; 0 at the rest at the start where there is one.
    sigma_rad : ndarray, shape (n,)
        Standard deviation of what is left, rad.
    deviations_rad : ndarray, shape (draws, n)
        Equally likely deviations from `theta_rad`, rad: run through a model, they show what is left does to it.
    place_rad : ndarray, shape (n,)
        One standard deviation of where in its count the first rest is, as it shows in the motion, rad: nothing at that
        rest, the same ever after but for other rests. `deviations_rad` has it in it, `SIDES` times.
    offset_rad : float
        `theta_rad + offset_rad` lies within half a count of the angle as counted: where in its count the drive rests.
    """

    theta_rad: NDArray
    sigma_rad: NDArray
    deviations_rad: NDArray
    place_rad: NDArray
    offset_rad: float

    def __getitem__(self, wanted: slice) -> "DriveMotion":
        """Some of the samples."""
        curves = self.theta_rad, self.sigma_rad, self.deviations_rad, self.place_rad
        return DriveMotion(*(curve[..., wanted] for curve in curves), self.offset_rad)


def drive_motion(time_s: NDArray, theta_counts_rad: NDArray, step_rad: float, rest_s: float) -> DriveMotion:
    """Estimate the drive angle that an encoder's counts only bound.

    A Gaussian process, of which every count says that the angle lies within one count's width: its fourth difference is
    small (motions without corners) or its third has heavy tails (triangles, jumps of acceleration), whichever predicts
    each count better from all the others. How small follows the recording, a tenth of a second at a time. Where the
    drive rests the angle is constant; where in its count it rests is told by the first counts on either side
    (`ccmodel.encoder.rests`), no better than that.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Sample times, s, increasing, evenly spaced but for gaps.
    theta_counts_rad : ndarray, shape (n,)
        Drive angle as counted, rad, from any zero.
    step_rad : float
        Angle of one count, rad.
    rest_s : float
        Time up to which the drive rests, s; 0 where there is no rest.

    Returns
    -------
    DriveMotion
        The motion and what is left of its uncertainty.

    Raises
    ------
    ValueError
        If the arrays differ in shape, are too short or the step is not positive.

    Notes
    -----
    Rms error in counts on motions that start from rest, 0.18 deg a count at 250 Hz, eight places within a count each.
    "moving" and "turns" (slower than 15 % of the peak) are without, "from rest" is with the error of the first rest's
    place in its count. In brackets the counts as they stand. "within" is the share of samples within 1.645 standard
    deviations, which should be 0.90. The last column is what that does to the drive torque of the exact model (7 N,
    3.1 rad of bend, friction 0.156; three places within a count), rms in mN m.

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
    steps of least jerk           0.06    0.10   0.15   0.22 (0.33)  0.88    0.09 (0.28)
    slow small steps, 0.05 rad    0.05    0.09   0.16   0.14 (0.41)  0.95    0.33 (0.85)
    steps of constant ramps       0.06    0.10   0.22   0.27 (0.33)  0.87    0.15 (0.26)
    ============================  ======  =====  =====  ===========  ======  ===========

    What is left is mostly the place of rests: fast starts pass too few samples a count to tell it. A common order of
    start for all rests of a recording was tried and told next to nothing more.

    Over 24 places within a count, the first rest's is wrong by 0.15 (steps of least jerk) and 0.23 (constant ramps)
    where 0.19 is stated. Were it known, what moves would be right to 0.06 and 0.05, holds to 0.14 and 0.21, for the
    same reason. It is the law of the start that counts do not tell: where it is known to be constant acceleration, 30
    counts of a ramp tell its rest to 0.05; to expect starts as simple as that whenever counts allow them makes ramps
    right to 0.13, and steps, sines and triangles wrong by 0.2 to 0.3. What does tell it is what the cables do: a fit of
    torques and sums finds the first rest's place (`Parameters.drive_encoder_offset`) to an eighth of its stated
    deviation on the sines of `data/raw/loops`, which is 0.02 to 0.03 counts.
    """
    time = np.asarray(time_s, dtype=float)
    counted = np.asarray(theta_counts_rad, dtype=float)
    if time.shape != counted.shape or time.ndim != 1 or time.size < NODES:
        raise ValueError(f"time and angle must be alike and have {NODES} samples or more; got {counted.shape}")
    if not step_rad > 0:
        raise ValueError(f"the angle of one count must be positive; got {step_rad}")
    thinned = slice(None, None, _samples_a_node(time, counted / step_rad))
    step_s = float(np.median(np.diff(time[thinned])))
    # Differences are those of even steps; what falls into a gap is bounded by nothing.
    place = np.round((time[thinned] - time[0]) / step_s).astype(int)
    seen = np.zeros(place[-1] + 1, bool)
    seen[place] = True
    zero = counted[0]
    latest = np.searchsorted(place, np.arange(seen.size), "right") - 1
    counts = np.round((counted[thinned][latest] - zero) / step_rad)
    rests = find_rests(counts, int(np.searchsorted(time[thinned], rest_s, "right")) if rest_s > 0 else 0)
    angle, sigma, draws, place = _curves(_Data.of(counts, seen, rests), ALIKE_S / step_s, from_rest=rest_s > 0)
    draws = [_straight_to_rest(angle + draw, counts, rests) for draw in (*draws, place)]
    angle = _straight_to_rest(angle, counts, rests)
    grid = time[0] + step_s * np.arange(seen.size)
    draws = np.array([np.interp(time, grid, draw - angle) for draw in draws]) * step_rad
    angle, sigma = (np.interp(time, grid, curve) * step_rad for curve in (angle, sigma))
    draws, place = draws[:-1], draws[-1]
    if rest_s > 0:
        return DriveMotion(angle - angle[0], sigma, draws, place, angle[0] + zero)
    return DriveMotion(angle + zero, sigma, draws, place, 0.0)


def _samples_a_node(time: NDArray, counts: NDArray) -> int:
    """Samples to step over for one that tells something: more of them would only make rounding errors grow."""
    step_s = np.median(np.diff(time))
    fastest = uniform_filter1d(abs(np.diff(counts)), max(1, round(ALIKE_S / step_s)), mode="nearest").max()
    most = min(int(NODE_S / step_s * 1.01), time.size // NODES)
    return max(1, most if fastest * most < 1 else int(1 / fastest))


def _curves(data: "_Data", alike: float, from_rest: bool) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Angle and its standard deviation, likely deviations, (DRAWS, samples), and the first rest's place, in counts."""
    tries = [_Estimate(data, prior, alike) for prior in PRIORS]
    for each in tries:
        each.rounds(FIRST_ROUNDS)
    best = max(tries, key=lambda each: each.likelihood)
    best.rounds(MORE_ROUNDS)
    best.rounds(LAST_ROUNDS, adapt=False)
    follow = np.zeros((data.rest.size, best.mean.size))
    follow[np.arange(data.rest.size), data.rest] = PIN
    noise = np.random.default_rng(0)
    draws = noise.standard_normal((DRAWS, best.mean.size))
    for curve in follow:
        bounded.solved(best.L, curve)
    for curve in draws:
        bounded.solved_upper(best.L, curve)
    if from_rest and data.rest.size:
        follow -= follow[:, :1]
    follow *= np.sqrt(data.variance)[:, None]
    place = follow[0] if from_rest and data.rest.size and data.rest[0] == 0 else np.zeros(best.mean.size)
    scores = noise.standard_normal((DRAWS, data.rest.size))
    scores[:, data.rest == 0] = SIDES[:, None]
    draws += scores @ follow
    sigma = np.sqrt(best.spread + (follow**2).sum(axis=0))
    return best.mean[data.node], sigma[data.node], draws[:, data.node], place[data.node]


def _straight_to_rest(angle: NDArray, counts: NDArray, rests: list[Rest]) -> NDArray:
    """The same curve without turning within the count in which it rests.

    A tenth of a count of overshoot, which the counts allow, would be a reversal to the cables: a false loss of tension
    that lasts as long as the rest.
    """
    angle = angle.copy()
    changes = np.flatnonzero(np.diff(counts)) + 1
    for rest in rests:
        level = angle[rest.first]
        before, after = changes[changes <= rest.first], changes[changes > rest.last]
        if before.size:
            come = slice(before[-1], rest.first)
            side = np.sign(counts[before[-1]] - counts[before[-1] - 1])
            angle[come] = side * np.maximum.accumulate(np.minimum(side * angle[come], side * level))
        if after.size:
            go = slice(rest.last, after[0])
            side = np.sign(counts[after[0]] - counts[after[0] - 1])
            angle[go] = side * np.maximum.accumulate(np.maximum(side * angle[go], side * level))
    return angle


@dataclass(frozen=True)
class _Data:
    """Samples of a motion, each rest reduced to a few that are tied together.

    Attributes
    ----------
    node : ndarray of int, shape (n,)
        Which of them stands for each of the recording's samples.
    low, high : ndarray, shape (nodes,)
        Bounds, in counts.
    bounded : ndarray of bool, shape (nodes,)
        Where these count: not in gaps, and not in a rest, of whose place more is known.
    tie : ndarray, shape (nodes,)
        Weight that holds a node and the next together.
    rest, level, variance : ndarray, shape (rests,)
        First node of each rest, where it stands and the variance of that.
    """

    node: NDArray
    low: NDArray
    high: NDArray
    bounded: NDArray
    tie: NDArray
    rest: NDArray
    level: NDArray
    variance: NDArray

    @classmethod
    def of(cls, counts: NDArray, seen: NDArray, rests: list[Rest]) -> "_Data":
        rests = [rest for rest in rests if rest.last - rest.first > NODES]
        keep, tied, bounded_at = np.ones(counts.size, bool), np.zeros(counts.size, bool), seen.copy()
        for rest in rests:
            keep[rest.first + NODES : rest.last + 1] = False
            tied[rest.first : rest.first + NODES - 1] = True
            bounded_at[rest.first : rest.first + NODES] = False
        node = np.cumsum(keep) - 1
        for rest in rests:
            node[rest.first : rest.last + 1] = node[rest.first]
        return cls(
            node,
            counts[keep] - 0.5,
            counts[keep] + 0.5,
            bounded_at[keep],
            bounded.TIE * tied[keep],
            node[np.array([rest.first for rest in rests], int)],
            np.array([rest.level for rest in rests]),
            np.array([rest.variance for rest in rests]),
        )


class _Estimate:
    """A motion under one prior, made better round by round."""

    def __init__(self, data: _Data, prior: Prior, alike: float):
        self.data, self.prior, self.alike = data, prior, alike
        self.precision, self.pull = bounded.start(data.low, data.high, data.bounded)
        self.precision[data.rest], self.pull[data.rest] = PIN, PIN * data.level
        order = len(prior.difference) - 1
        tied = np.convolve(data.tie > 0, np.ones(order), "valid")[: data.low.size - order]
        self.free = tied < order
        self.variance = np.full(data.low.size - order, prior.start)
        self.calm = np.ones(self.variance.size)

    def rounds(self, n: int, adapt: bool = True) -> None:
        data, prior = self.data, self.prior
        for _ in range(n):
            self.mean, self.spread, self.L, kick, blur, self.likelihood = bounded.one_round(
                prior.difference,
                1 / self.variance,
                data.tie,
                data.low,
                data.high,
                data.bounded,
                self.precision,
                self.pull,
            )
            if adapt:
                self._adapt(kick, blur)

    def _adapt(self, kick: NDArray, blur: NDArray) -> None:
        """Variance of the difference that makes its estimates likeliest, alike over a while (MacKay's update)."""
        tails = self.prior.tails
        known = np.where(self.free, np.clip(1 - blur / self.variance, 1e-9, 1), 0.0)
        power = np.where(self.free, kick**2 * self.calm, 0.0)
        common = power.sum() / max(known.sum(), 1e-9)
        local = (common + _around(power, self.alike)) / (1 + _around(known, self.alike))
        local = np.maximum(local, self.prior.least)
        if np.isfinite(tails):
            self.calm = (tails + 1) / (tails + (kick**2 + blur) / local)
        self.variance = np.maximum(local / self.calm, self.prior.least)


def _around(values: NDArray, width: float) -> NDArray:
    """Sum over what lies within about `width` samples, weighed by a bell curve."""
    box = max(3, round(2 * width) | 1)
    twice = uniform_filter1d(uniform_filter1d(values, box, mode="constant"), box, mode="constant")
    return np.maximum(twice, 0.0) * width * np.sqrt(2 * np.pi)
