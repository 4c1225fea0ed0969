"""Leave-one-out cross-validation of a fit, each recording left out in turn, without a refit for each.

One Newton step from the joint optimum stands for the fit to all other recordings. The scatter of these leave-one-out
values gives the covariance of the fit (the jackknife).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.failure import ModelError
from ccmodel.inference.least_squares import Solution
from ccmodel.inference.pool import each
from ccmodel.inference.problem import Problem

# The Newton step is checked where the left-out recording's mean square exceeds that of the joint fit by this factor;
# then these shares of the step are tried, the whole of it first.
CHECKED_FROM, SHARES = 2.0, (1.0, 0.5, 0.25, 0.125)


@dataclass(frozen=True)
class LeaveOneOut:
    """What each recording's absence does to a fit of shared unknowns.

    Attributes
    ----------
    values : list of ndarray, each of shape (unknowns,)
        By recording, the optimum of all others.
    residuals : list of ndarray
        By recording, its errors at that optimum.
    covariance : ndarray, shape (unknowns, unknowns)
        Jackknife covariance of the joint optimum; of a single recording, the inverse of its information.
    degrees_of_freedom : ndarray, shape (unknowns,)
        Of each variance: few where few recordings decide.
    """

    values: list[NDArray]
    residuals: list[NDArray]
    covariance: NDArray
    degrees_of_freedom: NDArray


def leave_one_out(problem: Problem, solution: Solution) -> LeaveOneOut:
    """Cross-validate a fit that has shared unknowns only; their priors hold for every part of the recordings.

    Where the model cannot be run at a recording's left-out optimum, the joint optimum stands for it.
    """
    information = [block.information for block in solution.blocks]
    total = sum(information, np.diag(problem.prior_precision**2))
    inverse, without = inverse_of(total, problem.sizes), [inverse_of(total - H, problem.sizes) for H in information]
    blocks_of = zip(solution.blocks, problem.observations, strict=True)
    joint = [block.errors / np.sqrt(problem.weight(o)) for block, o in blocks_of]
    if len(information) == 1:
        # No other recording is left that could tell anything.
        return LeaveOneOut([solution.x], joint, inverse, np.full(solution.x.size, np.inf))
    low, high = problem.bounds
    scores = [block.score for block in solution.blocks]
    # What scatters about a bound: values that are held there would be known exactly.
    free = [np.clip(solution.x + V @ score, low, high) for V, score in zip(without, scores, strict=True)]
    values = list(free)
    if solution.active.any():
        of_all = sum(scores, problem.prior_precision**2 * (solution.x - problem.prior_mean))
        values = [
            _stepped(problem, solution, total - H, score, of_all) for H, score in zip(information, scores, strict=True)
        ]
    residuals = each(problem.observations, lambda i, _: _errors_if_any(problem, values[i], i))
    for i, (out, own) in enumerate(zip(residuals, joint, strict=True)):
        if out is None or np.mean(out**2) > CHECKED_FROM * np.mean(own**2):
            values[i] = free[i] = shortened(problem, solution.x, values[i], joint, i)
            residuals[i] = _errors_if_any(problem, values[i], i)
            if residuals[i] is None:
                values[i], residuals[i] = solution.x, own
                free[i] = solution.x
    covariance, degrees = jackknife(np.array(free) - solution.x, information, inverse, without)
    return LeaveOneOut(values, residuals, covariance, degrees)


def _stepped(problem: Problem, solution: Solution, information: NDArray, score: NDArray, of_all: NDArray) -> NDArray:
    """The joint optimum after a Newton step to that of all recordings but one, with unknowns on bounds; (unknowns,).

    At the joint optimum the gradient of all recordings, `of_all`, is zero, so that the step depends on that of the
    recording that is left out, `score`, alone. An unknown on a bound, where it is not zero, stays there unless the
    others pull it off. `information` is that of the others.
    """
    low, high = problem.bounds
    on_bound = np.flatnonzero(solution.active)
    down = score - np.where(solution.active != 0, of_all, 0.0)
    held = [k for k in on_bound if down[k] * solution.active[k] >= 0]
    kept = np.setdiff1d(np.arange(solution.x.size), held)
    step = np.zeros(solution.x.size)
    step[kept] = inverse_of(information[np.ix_(kept, kept)], problem.sizes[kept]) @ down[kept]
    return np.clip(solution.x + step, low, high)


def _errors_if_any(problem: Problem, x: NDArray, i: int) -> NDArray | None:
    """Errors of a recording; None where the model cannot be run."""
    try:
        return problem.observations[i].errors(problem.values_of(x, i))
    except ModelError:
        return None


def shortened(problem: Problem, x: NDArray, aside: NDArray, joint: Sequence[NDArray], left_out: int) -> NDArray:
    """The longest share of a Newton step that does not raise the mean square of the recordings it was taken for.

    Parameters
    ----------
    problem : Problem
    x, aside : ndarray, shape (unknowns,)
        The joint optimum, and the end of the whole step.
    joint : sequence of ndarray
        By recording, the errors at the joint optimum.
    left_out : int
        The recording that the step leaves out.
    """
    others = [i for i in range(len(joint)) if i != left_out]
    before = sum(np.mean(joint[i] ** 2) for i in others)

    def mean_square(i: int, at: NDArray) -> float:
        return np.mean(problem.observations[i].errors(problem.values_of(at, i)) ** 2)

    for share in SHARES:
        at = x + share * (aside - x)
        try:
            if sum(each(others, lambda _, i, at=at: mean_square(i, at))) <= before:
                return at
        except ModelError:
            continue
    return x


def jackknife(
    moved: NDArray,
    information: Sequence[NDArray],
    inverse: NDArray,
    without: Sequence[NDArray],
    functions: NDArray | None = None,
) -> tuple[NDArray, NDArray]:
    """Covariance of a fit's unknowns, or of linear functions of them, from how far it moves as each recording is left
    out.

    Recordings differ in how much information they give: left out, the informative ones move a fit further than their
    share of the variance, and few of them are few degrees of freedom. Variances are scaled to be right in the mean if
    errors are independent with the stated noise, and have the degrees of freedom of the chi-square distribution with
    the same mean and variance (Bell and McCaffrey, Survey Methodology 28, 2002, for each recording left out in turn).

    Parameters
    ----------
    moved : ndarray, shape (recordings, unknowns)
        Left-out optimum minus joint optimum.
    information : sequence of ndarray, each of shape (unknowns, unknowns)
        By recording.
    inverse : ndarray, shape (unknowns, unknowns)
        Inverse of the information of all recordings.
    without : sequence of ndarray, each of shape (unknowns, unknowns)
        By recording, inverse of the information of all others.
    functions : ndarray, shape (functions, unknowns), optional
        Coefficients of the linear functions; each unknown itself if not given.

    Returns
    -------
    covariance : ndarray, shape (functions, functions)
    degrees_of_freedom : ndarray, shape (functions,)
        Of each variance, 1 at least.
    """
    of = np.eye(moved.shape[1]) if functions is None else functions
    n, aside = len(moved), np.stack(without) @ of.T
    effect = np.einsum("iab,ibk->kia", np.stack(information), aside)
    # By function, the expected products of the moves that two recordings cause.
    expected = -effect @ inverse @ effect.transpose(0, 2, 1)
    expected[:, range(n), range(n)] += np.einsum("iak,kia->ki", aside, effect)
    mean, square = np.trace(expected, axis1=1, axis2=2), (expected**2).sum(axis=(1, 2))
    variance = np.diag(of @ inverse @ of.T)
    known = (square > 0) & (variance > 0)
    degrees = np.divide(mean**2, square, out=np.ones_like(mean), where=known).clip(1.0)
    excess = np.sqrt(np.divide(mean, variance, out=np.ones_like(mean), where=known))
    functions_moved = moved @ of.T
    return functions_moved.T @ functions_moved / np.outer(excess, excess), degrees


def inverse_of(information: NDArray, sizes: NDArray) -> NDArray:
    """Pseudoinverse, with unknowns measured in their sizes."""
    scaled = information * np.outer(sizes, sizes)
    return np.linalg.pinv(scaled, rcond=1e-10, hermitian=True) * np.outer(sizes, sizes)
