"""Solving a fit, and saying how it went."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ccmodel.identify.intervals import Interval, Undetermined, intervals, undetermined
from ccmodel.identify.problem import Problem
from ccmodel.model.failure import ModelError

# Relative. Far below what repeated recordings differ by, far above what the solvers round at.
TOLERANCE = 1e-9
MOST_EVALUATIONS = 100
# Optima of several starts are one if no unknown differs by more than this share of its size.
SAME = 1e-3
START_SPREAD = 0.3
SEED = 1
# Why scipy's least_squares stops, by its status.
STOPPED = {
    -1: "the optimiser was given improper input",
    0: "stopped at the largest number of evaluations without converging",
    1: "converged: no direction leads downhill",
    2: "converged: the error no longer falls",
    3: "converged: the parameters no longer change",
    4: "converged: neither the error falls nor the parameters change",
}


@dataclass(frozen=True)
class Solution:
    """Where a search for the least cost ended.

    Attributes
    ----------
    x : ndarray, shape (unknowns,)
    residuals : ndarray, shape (rows,)
    jacobian : ndarray, shape (rows, unknowns)
    active : ndarray of int, shape (unknowns,)
        -1 or 1 where an unknown is on its lower or upper bound.
    converged : bool
    message : str
    evaluations : int
    """

    x: NDArray
    residuals: NDArray
    jacobian: NDArray
    active: NDArray
    converged: bool
    message: str
    evaluations: int

    @property
    def cost(self) -> float:
        """Sum of squares."""
        return float(self.residuals @ self.residuals)


@dataclass(frozen=True)
class FitResult:
    """What a fit found, or why there is none.

    Attributes
    ----------
    succeeded : bool
    message : str
        Why the optimiser stopped, or what went wrong.
    values : dict
        Shared values by parameter name, SI units; empty where the fit failed.
    intervals : dict
        The 90 % interval of each shared value.
    own : dict
        By recording, its own values.
    at_bound : list of str
        Unknowns that ended on one of their bounds: the data, or the bounds, are not enough.
    undetermined : list of Undetermined
        Unknowns that the recordings do not tell apart, with what they do tell.
    warnings : list of str
    cost : float or None
        Mean square of the errors over their noise.
    evaluations : int
    recordings : list of str
        What was fitted.
    """

    succeeded: bool
    message: str
    values: dict[str, float] = field(default_factory=dict)
    intervals: dict[str, Interval] = field(default_factory=dict)
    own: dict[str, dict[str, float]] = field(default_factory=dict)
    at_bound: list[str] = field(default_factory=list)
    undetermined: list[Undetermined] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    cost: float | None = None
    evaluations: int = 0
    recordings: list[str] = field(default_factory=list)

    def as_dict(self) -> dict:
        """Plain data for a JSON file."""
        return asdict(self)


def fit(problem: Problem, starts: int = 1) -> FitResult:
    """Fit a problem, from several starts, and say how sure the values are.

    Parameters
    ----------
    problem : Problem
    starts : int
        The configured one, and others drawn about it within 30 % of each unknown's size, from a fixed seed.

    Returns
    -------
    FitResult
        A failed fit is a result that says so, not an exception.
    """
    names = [e.name for e in problem.evidence]
    if not names:
        return FitResult(False, "no usable recording to fit")
    low, high = problem.bounds
    if (outside := (problem.start < low) | (problem.start > high)).any():
        k = int(np.argmax(outside))
        text = f"{problem.names[k]} starts at {problem.start[k]:.4g}, outside its bounds {low[k]:.4g} to {high[k]:.4g}"
        return FitResult(False, text, recordings=names)
    solutions, failures = [], []
    for x in _starts(problem, starts):
        try:
            solutions.append(solve(problem, x))
        except (ModelError, ValueError) as error:
            failures.append(str(error))
    if not solutions:
        return FitResult(False, failures[0], recordings=names)
    best = min(solutions, key=lambda s: s.cost)
    if not np.isfinite(best.cost):
        return FitResult(False, "the errors are not finite at the best values found", recordings=names)
    return _result(problem, best, _warnings(problem, best, solutions, failures))


def solve(problem: Problem, start: NDArray, most_evaluations: int = MOST_EVALUATIONS) -> Solution:
    """The nearest least cost, by scipy's trust region within bounds.

    Raises
    ------
    ModelError, ValueError
        If the model cannot be run on the way.
    """
    found = least_squares(
        problem.residuals,
        start,
        jac=problem.jacobian,
        bounds=problem.bounds,
        x_scale=problem.sizes,
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE,
        max_nfev=most_evaluations,
    )
    message = STOPPED[found.status]
    return Solution(found.x, found.fun, found.jac, found.active_mask, bool(found.success), message, int(found.nfev))


def _starts(problem: Problem, count: int) -> Sequence[NDArray]:
    low, high = problem.bounds
    inside = 1e-6 * np.where(np.isfinite(high - low), high - low, problem.sizes)
    drawn = np.random.default_rng(SEED).uniform(-START_SPREAD, START_SPREAD, (count - 1, problem.start.size))
    shared = np.arange(problem.start.size) < len(problem.shared)
    others = problem.start + np.where(shared, drawn * problem.sizes, 0.0)
    return [np.clip(x, low + inside, high - inside) for x in (problem.start, *others)]


def _warnings(problem: Problem, best: Solution, solutions: list[Solution], failures: list[str]) -> list[str]:
    said = [f"one of the starts failed: {text}" for text in failures]
    shared = slice(0, len(problem.shared))
    apart = [s for s in solutions if (np.abs(s.x - best.x)[shared] > SAME * problem.sizes[shared]).any()]
    if apart:
        said.append(f"{len(apart)} of {len(solutions)} starts ended elsewhere, at a higher or equal error")
    return said


def _result(problem: Problem, found: Solution, warnings: list[str]) -> FitResult:
    shared = len(problem.shared)
    values = dict(zip(problem.shared, found.x[:shared].tolist(), strict=True))
    own = {
        e.name: {n: problem.values_of(found.x, i)[n].item() for n in problem.own}
        for i, e in enumerate(problem.evidence)
    }
    return FitResult(
        succeeded=found.converged,
        message=found.message,
        values=values,
        intervals=intervals(problem, found.x, found.residuals, found.jacobian),
        own=own if problem.own else {},
        at_bound=[n for n, active in zip(problem.names, found.active, strict=True) if active],
        undetermined=undetermined(problem, found.residuals, found.jacobian),
        warnings=warnings,
        cost=problem.mean_square(found.residuals),
        evaluations=found.evaluations,
        recordings=[e.name for e in problem.evidence],
    )
