"""Checks of the intervals without linear theory: a bootstrap over recordings, and profile likelihoods."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root_scalar

from ccmodel.inference.intervals import REACH, ROUNDING, Interval, scaled_eigen, shared_parts
from ccmodel.inference.least_squares import Solution, information_and_gradient, solve
from ccmodel.inference.problem import Problem

# A profile is followed so many standard deviations of linear theory, and its end is found to so many of them.
PROFILE_REACH, PROFILE_TOLERANCE = 5.0, 1e-3


def bootstrap(problem: Problem, solution: Solution, draws: int = 500, seed: int = 1) -> dict[str, float]:
    """Standard deviation of each shared unknown over bootstrap samples of the recordings.

    One Newton step from the optimum stands for each refit. A check of `intervals` that uses no prior scatter; it needs
    at least half a dozen recordings.
    """
    parts = shared_parts(problem, solution)
    random = np.random.default_rng(seed)
    steps = []
    for _ in range(draws):
        drawn = [parts[i] for i in random.integers(len(parts), size=len(parts))]
        information, score = (sum(each) for each in zip(*drawn, strict=True))
        alone, values, vectors = scaled_eigen(information)
        known = values > ROUNDING
        steps.append(-(vectors[:, known] / values[known]) @ (vectors[:, known].T @ (score / alone)) / alone)
    return dict(zip(problem.shared, np.std(steps, axis=0, ddof=1).tolist(), strict=True))


def profile(problem: Problem, solution: Solution, name: str, variance: NDArray) -> Interval:
    """The interval of a shared unknown from its profile likelihood: all others are refitted at each of its values.

    The cost itself neglects the autocorrelation of residuals. Its rise is therefore measured in units of the rise that
    linear theory predicts for one standard deviation from `covariance`: the profile adds the cost's curvature.

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
    information, _ = information_and_gradient(problem, solution.x, solution.blocks)
    plain = float(np.linalg.pinv(information, rcond=1e-14, hermitian=True)[k, k])
    unit = sd**2 / plain
    low, high = (_profile_end(problem, solution, k, side * sd, unit) for side in (-1, 1))
    return Interval(low, high, sd)


def _profile_end(problem: Problem, solution: Solution, k: int, sd: float, unit: float) -> float:
    """Value at which the root of the cost's rise reaches the interval's; the bound, if it is lower there.

    `sd` has the sign of the side.
    """
    bound = problem.bounds[int(sd > 0)][k]
    most = min(PROFILE_REACH, (bound - solution.x[k]) / sd)

    def excess(reach: float) -> float:
        start = solution.x.copy()
        start[k] += reach * sd
        cost = solve(problem, start, fixed=[k]).cost if reach else solution.cost
        return float(np.sqrt(max(cost - solution.cost, 0.0) / unit)) - REACH

    if most <= 0 or excess(most) < 0:
        return float(solution.x[k] + max(most, 0.0) * sd)
    return float(solution.x[k] + sd * root_scalar(excess, bracket=(0.0, most), xtol=PROFILE_TOLERANCE).root)
