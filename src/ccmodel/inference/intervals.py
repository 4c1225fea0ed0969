"""Uncertainty of fitted values by linear theory: intervals, and combinations that recordings do not determine.

Own unknowns of a recording (its friction, its zeros) have a prior about the population's value. Their scatter from
recording to recording governs the intervals: thirty thousand samples of one run are not thirty thousand experiments.
Three sources of error add up. The uncertain drive motion and the rounding of counted angles are drawn and run through
the model. Sensor noise and everything else is estimated from the residuals, with their autocorrelation, minus the
contribution of the drawn errors to these residuals.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from ccmodel.distributions import chi2_tail, normal_quantile, student_quantile
from ccmodel.inference.least_squares import Solution, information_and_gradient
from ccmodel.inference.problem import Block, Problem
from ccmodel.repeats import condition_of, pooled_scatter

COVERAGE = 0.90
REACH = normal_quantile(0.5 + COVERAGE / 2)  # Standard deviations from the middle to the end of an interval.
# Residuals further apart in time than this share of a recording count as uncorrelated.
CORRELATED_SHARE = 0.05
# Residuals of a fit are smaller than errors, and their autocovariance is itself an estimate: the factor by which
# intervals must be wider (Kiefer and Vogelsang, Econometric Theory 21, 2005, table 1: Bartlett's window, 95 %).
WIDER = 1 + (2.1859 * CORRELATED_SHARE + 0.3142 * CORRELATED_SHARE**2 - 0.3427 * CORRELATED_SHARE**3) / 1.6449
# Intervals are widened if scatter from recording to recording has a smaller probability than this under its prior.
UNLIKELY_SCATTER = 0.01
# Eigenvalues of the scaled information below this are rounding.
ROUNDING = 1e-12
# Component of an unknown in an undetermined direction from which it is named with it.
INVOLVED = 0.1


@dataclass(frozen=True)
class Interval:
    """A 90 % interval and the standard deviation behind it, in the unknown's unit; infinite without information."""

    low: float
    high: float
    sd: float

    @classmethod
    def about(cls, value: float, sd: float) -> "Interval":
        """The interval of a normally distributed estimate."""
        return cls(float(value - REACH * sd), float(value + REACH * sd), float(sd))


@dataclass(frozen=True)
class Undetermined:
    """Shared unknowns of which the recordings determine a combination only.

    Attributes
    ----------
    parameters : list of str
    text : str
        For people: the unknowns, and the combination that is known.
    """

    parameters: list[str]
    text: str


@dataclass(frozen=True)
class Scatter:
    """Scatter of an unknown from recording to recording: of its prior, and as found.

    Attributes
    ----------
    expected, found : float
        Standard deviations; `found` is about the expected value.
    likelihood : float
        p-value of the scatter found under the prior.
    of_repeats : float or None
        Standard deviation among repeats of a condition, pooled over conditions; None without repeats. It does not
        contain differences between conditions, which may be errors of the model.
    freedom : int
        Degrees of freedom behind `of_repeats`.
    """

    expected: float
    found: float
    likelihood: float
    of_repeats: float | None = None
    freedom: int = 0

    @property
    def widens(self) -> bool:
        """Whether the scatter is significantly larger than its prior."""
        return self.likelihood < UNLIKELY_SCATTER


def covariance(problem: Problem, solution: Solution) -> NDArray:
    """Covariance of all unknowns about the truth, shape (unknowns, unknowns); infinite without information.

    The sandwich estimator: inverse information on either side of the covariance of the score. The latter contains the
    priors' scatter, the uncertain drive motion, rounding, and the autocorrelated rest of the residuals.
    """
    information, _ = information_and_gradient(problem, solution.x, solution.blocks)
    alone, values, vectors = scaled_eigen(information)
    known = values > ROUNDING
    inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T / np.outer(alone, alone)
    noise = np.diag((problem.prior_precision * scatter_scale(problem, solution)) ** 2)
    drives, rounded = problem.drive_errors(solution.x), problem.rounding_errors(solution.x)
    # A variance from few draws is itself uncertain: Student's quantile over that of the normal distribution.
    few = (student_quantile(0.5 + COVERAGE / 2, max(sum(map(len, drives)), 1)) / REACH) ** 2
    for block, drive, rounding in zip(solution.blocks, drives, rounded, strict=True):
        at = np.ix_(block.columns, block.columns)
        in_residuals = [residual_part(block, inverse[at], errors) for errors in (drive, rounding)]
        noise[at] += few * _score_covariance(block, drive) + _score_covariance(block, rounding)
        noise[at] += noise_of(block, in_residuals)
    found = inverse @ noise @ inverse
    unknown = (np.abs(vectors[:, ~known]) > INVOLVED).any(axis=1)
    found[unknown, unknown] = np.inf
    return found


def intervals(problem: Problem, solution: Solution, variance: NDArray) -> dict[str, Interval]:
    """The 90 % interval of each shared unknown, from the variance of all."""
    sd = np.sqrt(variance)
    return {name: Interval.about(solution.x[k], sd[k]) for k, name in enumerate(problem.shared)}


def own_intervals(problem: Problem, solution: Solution, spread: NDArray) -> dict[str, dict[str, Interval]]:
    """The same of each recording's own unknowns, and of its friction where it has one; from the covariance of all."""
    found = {}
    shared = list(problem.shared)
    for i, e in enumerate(problem.observations):
        at = np.arange(len(problem.names))[problem.own_columns(i)]
        own = dict(zip(problem.own, at, strict=True))
        found[e.name] = {name: Interval.about(solution.x[k], np.sqrt(spread[k, k])) for name, k in own.items()}
        if "friction_scale" in own and "friction_coefficient" in shared:
            pair = [shared.index("friction_coefficient"), own["friction_scale"]]
            mu, scale = solution.x[pair]
            weights = np.array([scale, mu])
            variance = weights @ spread[np.ix_(pair, pair)] @ weights
            found[e.name]["friction"] = Interval.about(mu * scale, np.sqrt(variance))
    return found


def noise_of(block: Block, accounted: Sequence[NDArray] = ()) -> NDArray:
    """Covariance of a recording's score due to the noise that its residuals show; shape (k, k).

    Parameters
    ----------
    block : Block
    accounted : sequence of ndarray, each of shape (draws, channels, samples)
        Draws of the residuals of error sources that are counted elsewhere; their autocovariance is subtracted.
    """
    noise = np.zeros((block.columns.size, block.columns.size))
    for channel, (sensitivity, residual) in enumerate(zip(block.derivatives, block.errors, strict=True)):
        noise += _correlated(sensitivity, residual, [errors[:, channel] for errors in accounted])
    return WIDER**2 * noise


def residual_part(block: Block, inverse: NDArray, errors: NDArray) -> NDArray:
    """Part of a recording's errors that remains in its residuals, shape (draws, channels, samples).

    Errors e move the unknowns by -inv(H) J^T e, so that (I - J inv(H) J^T) e remains in the residuals. `inverse` is
    inv(H) among the block's unknowns, H the information of all recordings. Errors of other recordings, which act
    through the shared unknowns, are neglected.
    """
    taken = np.einsum("csk,dcs->dk", block.derivatives, errors) @ inverse
    return errors - np.einsum("csk,dk->dcs", block.derivatives, taken)


def _score_covariance(block: Block, errors: NDArray) -> NDArray:
    """Covariance of a recording's score due to a source of which draws of the error are known; shape (k, k).

    Errors of the drive's motion and of rounding last as long as an angle reverses or rests. The fit absorbs much of
    them, so that residuals do not show them: the covariance is taken from the errors before the fit.
    """
    scores = np.einsum("csk,dcs->dk", block.derivatives, errors)
    return scores.T @ scores / max(len(errors), 1)


def _correlated(sensitivity: NDArray, residual: NDArray, accounted: Sequence[NDArray]) -> NDArray:
    """Sum over pairs of samples of sensitivity x covariance of the residuals x sensitivity.

    Sources of noise are independent, so their autocovariances in the residual add, and those of the sources
    `accounted` for are subtracted. The difference of two estimates may have negative power at some frequencies, which
    is set to zero.
    """
    n = residual.size
    lags = max(1, int(CORRELATED_SHARE * n))
    own = _autocovariance(residual[None], lags) - sum(_autocovariance(errors, lags) for errors in accounted)
    taper = own * (1 - np.arange(lags + 1) / (lags + 1))
    # Padded to twice the recording's length against circular convolution.
    size = next_fast_len(2 * n, real=True)
    around = np.zeros(size)
    around[: lags + 1] = taper
    around[-lags:] = taper[:0:-1]
    power = np.maximum(np.fft.rfft(around).real, 0.0)
    # One-sided spectrum: all frequencies but the first (and the last of an even number) count twice.
    power[1 : (size + 1) // 2] *= 2
    waves = np.fft.rfft(sensitivity, size, axis=0)
    return (waves.conj().T @ (power[:, None] * waves)).real / size


def _autocovariance(errors: NDArray, lags: int) -> NDArray:
    """Autocovariance at lags 0 to `lags`, averaged over draws; errors of shape (draws, n), zero without draws."""
    draws, n = errors.shape
    size = next_fast_len(n + lags, real=True)
    power = (np.abs(np.fft.rfft(errors, size)) ** 2).sum(axis=0)
    return np.fft.irfft(power, size)[: lags + 1] / (n * max(draws, 1))


def scatter(problem: Problem, solution: Solution) -> dict[str, Scatter]:
    """Scatter of the recordings' own values that have a prior; by parameter."""
    n, found = len(problem.observations), {}
    for place, (name, free) in enumerate(problem.own.items()):
        if free.spread is None:
            continue
        at = len(problem.shared) + place + len(problem.own) * np.arange(n)
        square = float((problem.prior_errors(solution.x)[at] ** 2).sum())
        alike = defaultdict(list)
        for e, value in zip(problem.observations, solution.x[at].tolist(), strict=True):
            alike[condition_of(e.given.recording)].append(value)
        of_repeats, freedom = pooled_scatter(list(alike.values()), relative=False)
        about = float(np.sqrt(square / n)), chi2_tail(square, n)
        found[name] = Scatter(free.spread, free.spread * about[0], about[1], of_repeats if freedom else None, freedom)
    return found


def scatter_scale(problem: Problem, solution: Solution) -> NDArray:
    """Ratio of found to prior scatter of each unknown; 1 unless it is significantly larger."""
    scale = np.ones(len(problem.names))
    for name, one in scatter(problem, solution).items():
        if one.widens:
            place = len(problem.shared) + list(problem.own).index(name)
            scale[place :: len(problem.own)] = one.found / one.expected
    return scale


def undetermined(problem: Problem, solution: Solution) -> list[Undetermined]:
    """Shared unknowns that the recordings do not determine.

    An unknown is undetermined if its interval is wider than its bounds, or, without bounds, than twice its size.
    """
    names, n = list(problem.shared), len(problem.shared)
    information = sum((i for i, _ in shared_parts(problem, solution)), np.diag(problem.prior_precision[:n] ** 2))
    alone, values, vectors = scaled_eigen(information)
    low, high = (b[:n] for b in problem.bounds)
    extent = np.where(np.isfinite(high - low), high - low, 2 * problem.sizes[:n])
    sd = np.abs(vectors) / alone[:, None] / np.sqrt(np.maximum(values, np.finfo(float).tiny))
    undetermined_directions = (2 * REACH * sd > extent[:, None]).any(axis=0)
    found = []
    for k in np.flatnonzero(undetermined_directions):
        involved = np.flatnonzero(np.abs(vectors[:, k]) > INVOLVED)
        text = _known_instead(
            [names[j] for j in involved], vectors[involved, k] / alone[involved], solution.x[involved]
        )
        found.append(Undetermined([names[j] for j in involved], text))
    return found


def _known_instead(names: list[str], direction: NDArray, values: NDArray) -> str:
    """A sentence on unknowns that can change together along `direction` without a change of the cost."""
    if len(names) == 1:
        return f"{names[0]} is not determined by these recordings"
    together = f"{', '.join(names[:-1])} and {names[-1]} are not determined apart"
    if len(names) > 2:
        return f"{together}; each can make up for the others"
    weight = -direction[0] / direction[1]
    known = values[0] + weight * values[1]
    sign = "+" if weight > 0 else "-"
    return f"{together}; known is {names[0]} {sign} {abs(weight):.4g} x {names[1]} = {known:.5g}"


def scaled_eigen(information: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Square root of the information's diagonal, and eigenvalues and eigenvectors of the information scaled by it."""
    alone = np.sqrt(np.diag(information))
    # An unknown on which no recording depends is a direction of its own, with an eigenvalue of zero.
    alone = np.where(alone > 0, alone, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(alone, alone))
    return alone, values, vectors


def shared_parts(problem: Problem, solution: Solution) -> list[tuple[NDArray, NDArray]]:
    """Information and score of each recording about the shared unknowns, its own unknowns eliminated."""
    n, found = len(problem.shared), []
    for block in solution.blocks:
        own = block.columns[n:]
        H, g = block.information, block.score
        H[n:, n:] += np.diag(problem.prior_precision[own] ** 2)
        g[n:] += (problem.prior_errors(solution.x) * problem.prior_precision)[own]
        out = H[:n, n:] @ np.linalg.pinv(H[n:, n:], rcond=1e-14, hermitian=True)
        found.append((H[:n, :n] - out @ H[n:, :n], g[:n] - out @ g[n:]))
    return found
