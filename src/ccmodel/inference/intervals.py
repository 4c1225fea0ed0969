"""How sure fitted values are: intervals, what is not determined, and two checks that ask no linear theory.

An unknown that belongs to each recording (its friction, its zeros) is fitted with an expectation of how far it lies
from the population's; that scatter from recording to recording governs the intervals, since thirty thousand samples
of one run are not thirty thousand experiments. What the drive's unknown part and the rounding of counted angles add
is worked out from likely errors of both, run through the model; what the sensors' noise and all else add, from the
residuals as they are, correlated in time, less what those errors leave in them.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.stats import chi2, norm, t

from ccmodel.inference.problem import Block, Problem
from ccmodel.inference.search import Solution, information_and_slope, solve
from ccmodel.repeats import condition_of, pooled_scatter

COVERAGE = 0.90
REACH = float(norm.ppf(0.5 + COVERAGE / 2))  # Standard deviations from the middle to the end of an interval.
# Residuals further apart in time than this share of a recording are taken to know nothing of each other.
CORRELATED_SHARE = 0.05
# What a fit leaves has lost what the unknowns took up, and its covariance is itself an estimate: by how much intervals
# must be wider at this share (Kiefer and Vogelsang, Econometric Theory 21, 2005, table 1: Bartlett's window, 95 %).
WIDER = 1 + (2.1859 * CORRELATED_SHARE + 0.3142 * CORRELATED_SHARE**2 - 0.3427 * CORRELATED_SHARE**3) / 1.6449
# Scatter from recording to recording that is less likely than this, were it what is expected, widens the intervals.
UNLIKELY_SCATTER = 0.01
# Directions known worse than this, relative to what each unknown would be known by alone, are rounding.
ROUNDING = 1e-12
# Part that an unknown must have in a direction that is not known to be named with it.
INVOLVED = 0.1
PROFILE_STEPS = 8
PROFILE_TOLERANCE = 0.01  # In standard deviations.


@dataclass(frozen=True)
class Interval:
    """A 90 % interval and the standard deviation behind it, in the unknown's unit; infinite where nothing is known."""

    low: float
    high: float
    sd: float

    @classmethod
    def about(cls, value: float, sd: float) -> "Interval":
        """The interval of a normally distributed estimate."""
        return cls(float(value - REACH * sd), float(value + REACH * sd), float(sd))


@dataclass(frozen=True)
class Undetermined:
    """Shared unknowns that the recordings do not tell apart.

    Attributes
    ----------
    parameters : list of str
    text : str
        For people: which, and what is known in their stead.
    """

    parameters: list[str]
    text: str


@dataclass(frozen=True)
class Scatter:
    """How far an unknown differs from recording to recording: as expected, and as found.

    Attributes
    ----------
    expected, found : float
        Standard deviations; `found` is about the expected value.
    likelihood : float
        Of a scatter this large, were the expected one true.
    of_repeats : float or None
        Standard deviation among repeats of a condition alone, pooled over the conditions; None without repeats. What
        differs between conditions, which a model may get wrong, is not in it.
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
        """Whether chance does not explain it."""
        return self.likelihood < UNLIKELY_SCATTER


def covariance(problem: Problem, solution: Solution) -> NDArray:
    """Covariance of all unknowns about the truth, shape (unknowns, unknowns); infinite where nothing is known.

    Inverse information, on either side of which stands the noise: what is expected to differ from recording to
    recording, what the drive's unknown part and rounding make, and what else the residuals show, correlated in time.
    """
    information, _ = information_and_slope(problem, solution.x, solution.blocks)
    alone, values, vectors = _directions(information)
    known = values > ROUNDING
    inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T / np.outer(alone, alone)
    noise = np.diag((problem.expected * scatter_scale(problem, solution)) ** 2)
    drives, rounded = problem.drive_errors(solution.x), problem.rounding_errors(solution.x)
    # A variance from a few draws is itself uncertain: Student's reach over that of the normal distribution.
    few = (t.ppf(0.5 + COVERAGE / 2, max(sum(map(len, drives)), 1)) / REACH) ** 2
    for block, drive, rounding in zip(solution.blocks, drives, rounded, strict=True):
        at = np.ix_(block.columns, block.columns)
        left = [left_by_fit(block, inverse[at], errors) for errors in (drive, rounding)]
        noise[at] += few * _noise_of_likely(block, drive) + _noise_of_likely(block, rounding) + noise_of(block, left)
    found = inverse @ noise @ inverse
    lost = (np.abs(vectors[:, ~known]) > INVOLVED).any(axis=1)
    found[lost, lost] = np.inf
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
    """Covariance of a recording's score by the noise in it, as its residuals show it; shape (k, k).

    Parameters
    ----------
    block : Block
    accounted : sequence of ndarray, each of shape (draws, channels, samples)
        Likely errors of sources whose noise stands elsewhere, as the fit leaves them: none of it counts here.
    """
    noise = np.zeros((block.columns.size, block.columns.size))
    for channel, (sensitivity, residual) in enumerate(zip(block.derivatives, block.errors, strict=True)):
        noise += _correlated(sensitivity, residual, [errors[:, channel] for errors in accounted])
    return WIDER**2 * noise


def left_by_fit(block: Block, inverse: NDArray, errors: NDArray) -> NDArray:
    """What the fit leaves of likely errors of a recording, shape (draws, channels, samples).

    Errors e move the unknowns by -inv(H) J^T e, so that (I - J inv(H) J^T) e stands in the residuals. `inverse` is
    inv(H) among the block's unknowns, H the information of all recordings. What errors of other recordings leave here,
    by way of the shared unknowns, is not in it.
    """
    taken = np.einsum("csk,dcs->dk", block.derivatives, errors) @ inverse
    return errors - np.einsum("csk,dk->dcs", block.derivatives, taken)


def _noise_of_likely(block: Block, errors: NDArray) -> NDArray:
    """Covariance of a recording's score by a source of which likely errors are known; shape (k, k).

    The drive's motion and rounding err slowly, where an angle turns or rests all that while. Much of that the fit takes
    for something else, and what is left does not show it: only the errors before the fit say what they do to it.
    """
    scores = np.einsum("csk,dcs->dk", block.derivatives, errors)
    return scores.T @ scores / max(len(errors), 1)


def _correlated(sensitivity: NDArray, residual: NDArray, accounted: Sequence[NDArray]) -> NDArray:
    """Sum over pairs of samples of sensitivity x covariance of the residuals x sensitivity.

    The residual is the sum of what the fit leaves of each source of noise. These know nothing of each other, so their
    autocovariances add, and that of the sources `accounted` for comes off. The difference of two estimates may have
    frequencies of negative power, which no noise has: there is nothing of it.
    """
    n = residual.size
    lags = max(1, int(CORRELATED_SHARE * n))
    own = _autocovariance(residual[None], lags) - sum(_autocovariance(errors, lags) for errors in accounted)
    taper = own * (1 - np.arange(lags + 1) / (lags + 1))
    # Twice as long as the recording, so that its end does not follow on its beginning.
    size = next_fast_len(2 * n, real=True)
    around = np.zeros(size)
    around[: lags + 1] = taper
    around[-lags:] = taper[:0:-1]
    power = np.maximum(np.fft.rfft(around).real, 0.0)
    # All frequencies but the first (and the last, if they are even) stand for two.
    power[1 : (size + 1) // 2] *= 2
    waves = np.fft.rfft(sensitivity, size, axis=0)
    return (waves.conj().T @ (power[:, None] * waves)).real / size


def _autocovariance(errors: NDArray, lags: int) -> NDArray:
    """Mean over draws of the product of samples 0 to `lags` apart, of errors of shape (draws, n); 0 of no draws."""
    draws, n = errors.shape
    size = next_fast_len(n + lags, real=True)
    power = (np.abs(np.fft.rfft(errors, size)) ** 2).sum(axis=0)
    return np.fft.irfft(power, size)[: lags + 1] / (n * max(draws, 1))


def scatter(problem: Problem, solution: Solution) -> dict[str, Scatter]:
    """How the recordings' own values scatter, for those of which something is expected; by parameter."""
    n, found = len(problem.observations), {}
    for place, (name, free) in enumerate(problem.own.items()):
        if free.spread is None:
            continue
        at = len(problem.shared) + place + len(problem.own) * np.arange(n)
        square = float((problem.unexpected(solution.x)[at] ** 2).sum())
        alike = defaultdict(list)
        for e, value in zip(problem.observations, solution.x[at].tolist(), strict=True):
            alike[condition_of(e.given.recording)].append(value)
        of_repeats, freedom = pooled_scatter(list(alike.values()), relative=False)
        about = float(np.sqrt(square / n)), float(chi2.sf(square, n))
        found[name] = Scatter(free.spread, free.spread * about[0], about[1], of_repeats if freedom else None, freedom)
    return found


def scatter_scale(problem: Problem, solution: Solution) -> NDArray:
    """How many times the expected scatter each unknown scatters; 1 unless chance does not explain it."""
    scale = np.ones(len(problem.names))
    for name, said in scatter(problem, solution).items():
        if said.widens:
            place = len(problem.shared) + list(problem.own).index(name)
            scale[place :: len(problem.own)] = said.found / said.expected
    return scale


def undetermined(problem: Problem, solution: Solution) -> list[Undetermined]:
    """Shared unknowns that the recordings do not tell apart.

    An unknown is not determined if its interval is wider than what its bounds leave anyway, or than itself where it
    has none.
    """
    names, n = list(problem.shared), len(problem.shared)
    information = sum((i for i, _ in shared_parts(problem, solution)), np.diag(problem.expected[:n] ** 2))
    alone, values, vectors = _directions(information)
    low, high = (b[:n] for b in problem.bounds)
    extent = np.where(np.isfinite(high - low), high - low, 2 * problem.sizes[:n])
    sd = np.abs(vectors) / alone[:, None] / np.sqrt(np.maximum(values, np.finfo(float).tiny))
    lost = (2 * REACH * sd > extent[:, None]).any(axis=0)
    found = []
    for k in np.flatnonzero(lost):
        involved = np.flatnonzero(np.abs(vectors[:, k]) > INVOLVED)
        text = _known_instead(
            [names[j] for j in involved], vectors[involved, k] / alone[involved], solution.x[involved]
        )
        found.append(Undetermined([names[j] for j in involved], text))
    return found


def _known_instead(names: list[str], direction: NDArray, values: NDArray) -> str:
    """A sentence on unknowns that can change together along `direction` without being noticed."""
    if len(names) == 1:
        return f"{names[0]} is not determined by these recordings"
    together = f"{', '.join(names[:-1])} and {names[-1]} are not determined apart"
    if len(names) > 2:
        return f"{together}; each can make up for the others"
    weight = -direction[0] / direction[1]
    known = values[0] + weight * values[1]
    sign = "+" if weight > 0 else "-"
    return f"{together}; known is {names[0]} {sign} {abs(weight):.4g} x {names[1]} = {known:.5g}"


def _directions(information: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Information with each unknown measured by what it alone would be known by: that, eigenvalues, eigenvectors."""
    alone = np.sqrt(np.diag(information))
    # What no recording depends on at all is a direction of its own, without information.
    alone = np.where(alone > 0, alone, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(alone, alone))
    return alone, values, vectors


def shared_parts(problem: Problem, solution: Solution) -> list[tuple[NDArray, NDArray]]:
    """Every recording's say on the shared unknowns, its own taken out: information and score."""
    n, found = len(problem.shared), []
    for block in solution.blocks:
        own = block.columns[n:]
        H, g = block.information, block.score
        H[n:, n:] += np.diag(problem.expected[own] ** 2)
        g[n:] += (problem.unexpected(solution.x) * problem.expected)[own]
        out = H[:n, n:] @ np.linalg.pinv(H[n:, n:], rcond=1e-14, hermitian=True)
        found.append((H[:n, :n] - out @ H[n:, :n], g[:n] - out @ g[n:]))
    return found


def bootstrap(problem: Problem, solution: Solution, draws: int = 500, seed: int = 1) -> dict[str, float]:
    """Standard deviation of each shared unknown over resampled sets of recordings.

    One step of Newton's method from the optimum stands for each refit. A check of `intervals`: it knows of no
    expected scatter, only of what the recordings did, and wants half a dozen of them.
    """
    said = shared_parts(problem, solution)
    random = np.random.default_rng(seed)
    steps = []
    for _ in range(draws):
        drawn = [said[i] for i in random.integers(len(said), size=len(said))]
        information, score = (sum(each) for each in zip(*drawn, strict=True))
        alone, values, vectors = _directions(information)
        known = values > ROUNDING
        steps.append(-(vectors[:, known] / values[known]) @ (vectors[:, known].T @ (score / alone)) / alone)
    return dict(zip(problem.shared, np.std(steps, axis=0, ddof=1).tolist(), strict=True))


def profile(problem: Problem, solution: Solution, name: str, variance: NDArray) -> Interval:
    """The interval of a shared unknown from its profile: all others are fitted anew for each of its values.

    The cost may rise as far as it does along one standard deviation of the linear theory (which knows of correlated
    residuals, as the cost does not), times the interval's reach squared. What it adds is how the cost bends on the way.

    Parameters
    ----------
    problem : Problem
    solution : Solution
    name : str
    variance : ndarray, shape (unknowns,)
        From `covariance`.
    """
    k = problem.names.index(name)
    sd = float(np.sqrt(variance[k]))
    information, _ = information_and_slope(problem, solution.x, solution.blocks)
    plain = float(np.linalg.pinv(information, rcond=1e-14, hermitian=True)[k, k])
    unit = sd**2 / plain
    low, high = (_profile_end(problem, solution, k, side * sd, unit) for side in (-1, 1))
    return Interval(low, high, sd)


def _profile_end(problem: Problem, solution: Solution, k: int, sd: float, unit: float) -> float:
    """Where the root of the rise of cost, which is nearly linear, comes to the interval's reach; or the bound."""
    low, high = (b[k] for b in problem.bounds)
    reach, x = REACH, solution.x
    for _ in range(PROFILE_STEPS):
        value = float(np.clip(solution.x[k] + reach * sd, low, high))
        start = x.copy()
        start[k] = value
        found = solve(problem, start, fixed=[k])
        x = found.x
        risen = np.sqrt(max(found.cost - solution.cost, 0.0) / unit)
        if abs(risen - REACH) < PROFILE_TOLERANCE or (value in (low, high) and risen < REACH):
            return value
        reach *= REACH / max(risen, 0.2 * REACH)
    return value
