"""Posterior of a smooth curve of which every sample is known to within one count."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ccmodel.encoder import expectation_propagation as ep
from ccmodel.encoder.rest_detection import Rest


@dataclass(frozen=True)
class Prior:
    """Prior of a motion: independent finite differences about 0.

    Attributes
    ----------
    stencil : tuple of float
        The finite difference.
    initial_variance : float
        Variance of a difference before the first sweep, counts^2.
    least_variance : float
        Lower bound of the variance, counts^2. Below it, rounding errors dominate the estimate.
    degrees_of_freedom : float
        Of Student's t; infinite for a Gaussian prior.
    """

    stencil: tuple[float, ...]
    initial_variance: float
    least_variance: float
    degrees_of_freedom: float


# Motions without corners: small fourth differences. Triangles and steps of acceleration: third differences with the
# heavy tails of a Cauchy distribution.
SMOOTH = Prior((1.0, -4.0, 6.0, -4.0, 1.0), 1e-6, 1e-13, np.inf)
CORNERED = Prior((-1.0, 3.0, -3.0, 1.0), 1e-4, 1e-10, 1.0)
PRIORS = (SMOOTH, CORNERED)
# Sweeps with each prior, further sweeps with the better one, and last sweeps at constant variances.
COMPARING, CONVERGING, FINAL = 10, 10, 5
DRAWS = 8
# Offset of the first rest within its count in each draw, in standard deviations.
OFFSET_SCORES = (-1.0) ** np.arange(DRAWS)
# Precision, 1/counts^2, of a site before the first sweep: that of a uniform distribution over one count.
UNIFORM_PRECISION = 12.0
# Precision, 1/counts^2, that holds a rest at its estimated level. Its variance is added to the posterior afterwards.
LEVEL_PRECISION = 1e6
# Precision, 1/counts^2, that makes neighbouring samples of a rest equal; an interval has 12.
COUPLING = 1e9
# Samples that stand for a rest: more than a finite difference spans.
REST_SAMPLES = 5


@dataclass(frozen=True)
class Posterior:
    """Posterior of a curve, counts.

    Attributes
    ----------
    mean, sd : ndarray, shape (n,)
        Mean and standard deviation.
    draws : ndarray, shape (DRAWS, n)
        Draws from the posterior, less its mean; the offset of the first rest is `OFFSET_SCORES` in them.
    offset : ndarray, shape (n,)
        Deviation of the curve if the angle at the first rest is one standard deviation higher; 0 if the curve does not
        begin at rest.
    """

    mean: NDArray
    sd: NDArray
    draws: NDArray
    offset: NDArray


def smooth(counts: NDArray, observed: NDArray, rests: list[Rest], window: float, zero_at_rest: bool) -> Posterior:
    """Compute the posterior of the curve under the prior that predicts the counts better.

    Parameters
    ----------
    counts : ndarray, shape (n,)
        Middle of each sample's count, counts, at even steps of time.
    observed : ndarray of bool, shape (n,)
        False for samples in a gap of the recording.
    rests : list of Rest
        Where the curve is constant.
    window : float
        Samples over which the variance of the difference is nearly constant.
    zero_at_rest : bool
        Whether the curve counts from its first sample: deviations are 0 there.

    Returns
    -------
    Posterior
    """
    data = _Observations.of(counts, observed, rests)
    fits = [_Fit(data, prior, window) for prior in PRIORS]
    for fit in fits:
        fit.sweep(COMPARING)
    best = max(fits, key=lambda fit: fit.log_predictive)
    best.sweep(CONVERGING)
    best.sweep(FINAL, adapt=False)
    # Response of the curve to the level of each rest.
    response = np.zeros((data.rest.size, best.mean.size))
    response[np.arange(data.rest.size), data.rest] = LEVEL_PRECISION
    random = np.random.default_rng(0)
    draws = random.standard_normal((DRAWS, best.mean.size))
    for curve in response:
        ep.solve(best.L, curve)
    for curve in draws:
        ep.solve_transposed(best.L, curve)
    if zero_at_rest and data.rest.size:
        response -= response[:, :1]
    response *= np.sqrt(data.variance)[:, None]
    begins_at_rest = zero_at_rest and data.rest.size and data.rest[0] == 0
    offset = response[0] if begins_at_rest else np.zeros(best.mean.size)
    scores = random.standard_normal((DRAWS, data.rest.size))
    scores[:, data.rest == 0] = OFFSET_SCORES[:, None]
    draws += scores @ response
    sd = np.sqrt(best.variance + (response**2).sum(axis=0))
    return Posterior(*(curve[..., data.node] for curve in (best.mean, sd, draws, offset)))


@dataclass(frozen=True)
class _Observations:
    """Intervals of a curve's nodes: its samples, each rest reduced to `REST_SAMPLES` of them.

    Attributes
    ----------
    node : ndarray of int, shape (n,)
        Node of each sample.
    low, high : ndarray, shape (nodes,)
        Intervals, counts.
    observed : ndarray of bool, shape (nodes,)
        Nodes whose interval is used: not in gaps, and not in a rest, whose level is known better.
    coupling : ndarray, shape (nodes,)
        Precision of the difference between a node and the next.
    rest, level, variance : ndarray, shape (rests,)
        First node of each rest, its level and the variance of the level.
    """

    node: NDArray
    low: NDArray
    high: NDArray
    observed: NDArray
    coupling: NDArray
    rest: NDArray
    level: NDArray
    variance: NDArray

    @classmethod
    def of(cls, counts: NDArray, observed: NDArray, rests: list[Rest]) -> "_Observations":
        rests = [rest for rest in rests if rest.last - rest.first > REST_SAMPLES]
        keep, coupled, observed = np.ones(counts.size, bool), np.zeros(counts.size, bool), observed.copy()
        for rest in rests:
            keep[rest.first + REST_SAMPLES : rest.last + 1] = False
            coupled[rest.first : rest.first + REST_SAMPLES - 1] = True
            observed[rest.first : rest.first + REST_SAMPLES] = False
        node = np.cumsum(keep) - 1
        for rest in rests:
            node[rest.first : rest.last + 1] = node[rest.first]
        return cls(
            node,
            counts[keep] - 0.5,
            counts[keep] + 0.5,
            observed[keep],
            COUPLING * coupled[keep],
            node[np.array([rest.first for rest in rests], int)],
            np.array([rest.level for rest in rests]),
            np.array([rest.variance for rest in rests]),
        )


class _Fit:
    """Posterior under one prior, which sweeps improve: `mean`, `variance`, `L` and `log_predictive` of the last one."""

    def __init__(self, data: _Observations, prior: Prior, window: float):
        self.data, self.prior, self.window = data, prior, window
        # Precision and mean of each site before the first sweep; precision times mean is its shift.
        precision, mean = np.where(data.observed, UNIFORM_PRECISION, 0.0), (data.low + data.high) / 2
        precision[data.rest], mean[data.rest] = LEVEL_PRECISION, data.level
        self.sites = precision, precision * mean
        order = len(prior.stencil) - 1
        coupled = np.convolve(data.coupling > 0, np.ones(order), "valid")[: data.low.size - order]
        self.free = coupled < order
        self.prior_variance = np.full(data.low.size - order, prior.initial_variance)
        self.scale = np.ones(self.prior_variance.size)

    def sweep(self, times: int, adapt: bool = True) -> None:
        """Sweep over all sites; adapt the prior variance after each sweep."""
        data, stencil = self.data, self.prior.stencil
        for _ in range(times):
            self.mean, self.variance, self.L, difference, difference_variance, self.log_predictive = ep.sweep(
                stencil, 1 / self.prior_variance, data.coupling, data.low, data.high, data.observed, *self.sites
            )
            if adapt:
                self._adapt(difference, difference_variance)

    def _adapt(self, difference: NDArray, difference_variance: NDArray) -> None:
        """Re-estimate the prior variance of the differences from their posterior, nearly constant over a window.

        MacKay 1992, "Bayesian interpolation", with the number of well-determined differences; Student's t is a scale
        mixture of Gaussians, `scale` the expected precision of each.
        """
        freedom = self.prior.degrees_of_freedom
        determined = np.where(self.free, np.clip(1 - difference_variance / self.prior_variance, 1e-9, 1), 0.0)
        square = np.where(self.free, difference**2 * self.scale, 0.0)
        common = square.sum() / max(determined.sum(), 1e-9)
        local = (common + _windowed_sum(square, self.window)) / (1 + _windowed_sum(determined, self.window))
        local = np.maximum(local, self.prior.least_variance)
        if np.isfinite(freedom):
            self.scale = (freedom + 1) / (freedom + (difference**2 + difference_variance) / local)
        self.prior_variance = np.maximum(local / self.scale, self.prior.least_variance)


def _windowed_sum(values: NDArray, width: float) -> NDArray:
    """Sum weighted by a bell of about `width` samples: two box filters."""
    box = max(3, round(2 * width) | 1)
    twice = uniform_filter1d(uniform_filter1d(values, box, mode="constant"), box, mode="constant")
    return np.maximum(twice, 0.0) * width * np.sqrt(2 * np.pi)
