"""Minimising the cost of a fit by scipy's trust region within bounds.

Of a fit's tens of thousands of rows only their products with one another matter, and a recording's own unknowns affect
no other recording. Scipy is therefore given a square root of the matrix of these products, with one row more than
there are unknowns: it has the same cost, gradient and Gauss-Newton Hessian. Unknowns are measured from their start in
their sizes, so that no unit of measurement affects the search.

A cost that is too rough for derivatives, as with measured load torques, is searched without them in the end, if few
values are unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from ccmodel.failure import ModelError
from ccmodel.inference.jacobian import STEP
from ccmodel.inference.problem import Block, Problem

# The model has corners (`ccmodel.inference.jacobian`), and so has the cost: its minimum may lie on one, where the
# gradient means little. When no step helps, the predicted reduction of the cost decides, in squares of a standard
# deviation: below a tenth the corner is the optimum, within a third of a standard deviation. Above, or after too many
# evaluations, differences are taken once more over a larger step.
BROAD = 1e-3
EXCUSED = 0.1
# Relative excess of the curvature along each unknown: unknowns that recordings do not determine stay where they are,
# since their gradient is rounding.
DAMPING = 1e-9
# Search without derivatives: distance of its first points and its final tolerance, in sizes.
AROUND, DOWN_TO = 1e-2, 1e-4
MOST_DIRECT, UNKNOWNS_DIRECT = 1000, 8
# The search stays inside its bounds. So near one, in sizes, the bound is meant.
ON_BOUND = 1e-6
STUCK = 3  # scipy's status where no step longer than the shortest reduces the cost
CONVERGED = "converged: the error no longer falls"
ON_CORNER = "converged: the least error lies on a corner of it, within a third of a standard deviation"
DIRECT = "converged: by direct search, the error being too rough for its slopes"
STOPPED = "stopped at the largest number of evaluations without converging"
STALLED = "stalled: no step lessens the error although its slope says that one should"


@dataclass(frozen=True)
class Search:
    """How a minimum is searched.

    Attributes
    ----------
    tolerance : float
        The search has converged when a step reduces the cost by less than this share. With the default the optimum is
        known to a thousandth of a standard deviation.
    shortest : float
        Steps shorter than this, relative to the distance from the start in sizes, end the search.
    difference : float
        Step of the derivatives, as a share of the unknowns' sizes.
    most_evaluations : int
    retreats : bool
        Whether a point at which the model cannot be run shortens the step. Otherwise the search fails there.
    """

    tolerance: float = 1e-10
    shortest: float = 1e-7
    difference: float = STEP
    most_evaluations: int = 100
    retreats: bool = True


@dataclass(frozen=True)
class Solution:
    """Where a search ended.

    Attributes
    ----------
    x : ndarray, shape (unknowns,)
    cost : float
    blocks : list of Block
        Every recording about `x`.
    active : ndarray of int, shape (unknowns,)
        -1 or 1 where an unknown is on its lower or upper bound.
    message : str
    evaluations : int
    """

    x: NDArray
    cost: float
    blocks: list[Block]
    active: NDArray
    message: str
    evaluations: int

    @property
    def converged(self) -> bool:
        """Whether the search came to a minimum."""
        return self.message in (CONVERGED, ON_CORNER, DIRECT)


def solve(problem: Problem, start: NDArray, how: Search = Search(), fixed: Sequence[int] = ()) -> Solution:
    """The nearest minimum within the bounds, with a larger difference step or none where derivatives mislead.

    Parameters
    ----------
    problem : Problem
    start : ndarray, shape (unknowns,)
    how : Search
    fixed : sequence of int
        Unknowns that stay at their start.

    Raises
    ------
    ModelError, ValueError
        If the model cannot be run at the start, or its errors are not finite there.
    """
    solution = minimise(problem, start, how, fixed)
    if solution.converged:
        return solution
    broad = replace(how, difference=BROAD)
    again = minimise(problem, solution.x, broad, fixed, origin=start)
    again = replace(again, evaluations=solution.evaluations + again.evaluations)
    if again.message == STALLED and problem.start.size - len(fixed) <= UNKNOWNS_DIRECT:
        return _searched_directly(problem, again, _Reduced(problem, start, broad, fixed))
    return again


def minimise(
    problem: Problem, start: NDArray, how: Search, fixed: Sequence[int] = (), origin: NDArray | None = None
) -> Solution:
    """One search by the trust region; parameters and errors as for `solve`.

    `origin` is the point from which unknowns are measured, if not the start.
    """
    reduced = _Reduced(problem, start if origin is None else origin, how, fixed)
    y = (start - reduced.origin)[reduced.movable] / reduced.sizes
    if not y.size:
        return _solution(problem, reduced, y, CONVERGED, 1)
    found = optimize.least_squares(
        reduced.residuals, y, reduced.jacobian, reduced.bounds, ftol=how.tolerance, xtol=how.shortest, gtol=None,
        max_nfev=how.most_evaluations,
    )  # fmt: skip
    return _solution(problem, reduced, found.x, _message(found, reduced), found.nfev)


def _searched_directly(problem: Problem, stalled: Solution, reduced: "_Reduced") -> Solution:
    """Nelder and Mead's simplex from where the derivatives have led."""
    y = (stalled.x - reduced.origin)[reduced.movable] / reduced.sizes
    low, high = reduced.bounds
    step = np.where(y + AROUND <= high, AROUND, -AROUND)
    simplex = np.clip(np.vstack([y, y + np.diag(step)]), low, high)
    options = {"initial_simplex": simplex, "xatol": DOWN_TO, "fatol": np.inf, "maxfev": MOST_DIRECT}
    found = optimize.minimize(
        reduced.cost, y, method="Nelder-Mead", bounds=list(zip(low, high, strict=True)), options=options
    )
    message = DIRECT if found.success else STOPPED
    return _solution(problem, reduced, found.x, message, stalled.evaluations + found.nfev)


def _message(found: optimize.OptimizeResult, reduced: "_Reduced") -> str:
    if found.status != STUCK:
        return CONVERGED if found.success else STOPPED
    linear = optimize.lsq_linear(found.jac, found.jac @ found.x - found.fun, reduced.bounds)
    predicted = 2 * (found.cost - linear.cost)
    if predicted <= reduced.how.tolerance * 2 * found.cost:
        return CONVERGED
    limit = EXCUSED * 2 * found.cost / reduced.problem.effective_sample_size
    return ON_CORNER if predicted <= limit else STALLED


def _solution(problem: Problem, reduced: "_Reduced", y: NDArray, message: str, evaluations: int) -> Solution:
    """The search ends short of a bound: unknowns near one are put on it."""
    x = reduced.place(y)
    low, high = problem.bounds
    near = ON_BOUND * problem.sizes
    active = np.where(x <= low + near, -1, np.where(x >= high - near, 1, 0))
    x = np.where(active < 0, low, np.where(active > 0, high, x))
    blocks = reduced.blocks_at(x)
    cost = problem.cost(x, [b.errors for b in blocks])
    return Solution(x, cost, blocks, active, message, evaluations)


def information_and_gradient(problem: Problem, x: NDArray, blocks: Sequence[Block]) -> tuple[NDArray, NDArray]:
    """Normal matrix of all unknowns, and the gradient of half the cost."""
    information = np.diag(problem.prior_precision**2)
    gradient = problem.prior_errors(x) * problem.prior_precision
    for block in blocks:
        information[np.ix_(block.columns, block.columns)] += block.information
        gradient[block.columns] += block.score
    return information, gradient


class _Reduced:
    """The cost in few rows, as a function of the movable unknowns' distances from an origin, in their sizes."""

    def __init__(self, problem: Problem, origin: NDArray, how: Search, fixed: Sequence[int]):
        self.problem, self.origin, self.how = problem, np.array(origin, float), how
        self.movable = np.setdiff1d(np.arange(problem.start.size), fixed)
        self.sizes = problem.sizes[self.movable]
        self.bounds = tuple((b - self.origin)[self.movable] / self.sizes for b in problem.bounds)
        self.least = np.inf  # the lowest cost so far
        self.at, self.blocks, self.rows = None, [], np.empty((0, 0))

    def place(self, y: NDArray) -> NDArray:
        """All unknowns in their units."""
        x = self.origin.copy()
        x[self.movable] += y * self.sizes
        return x

    def cost(self, y: NDArray) -> float:
        """Infinite where the model cannot be run."""
        try:
            return self.problem.cost(self.place(y))
        except (ModelError, ValueError):
            return np.inf

    def residuals(self, y: NDArray) -> NDArray:
        """Rows whose sum of squares is the cost; infinite where the model cannot be run and the search retreats.

        A point that does not reduce the cost is not accepted and needs no derivatives: only its norm matters.
        """
        try:
            x = self.place(y)
            errors = self.problem.errors(x)
            norm = np.sqrt(self.problem.cost(x, errors))
            if norm * norm >= self.least:
                return np.r_[norm, np.zeros(len(self.rows) - 1)]
            self._move_to(x, errors)
        except (ModelError, ValueError):
            if not (self.how.retreats and len(self.rows)):
                raise
            return np.full(len(self.rows), np.inf)
        rows = np.ascontiguousarray(self.rows[:, -1])
        self.least = float(rows @ rows)
        return rows

    def jacobian(self, y: NDArray) -> NDArray:
        """Derivatives of `residuals`, up to a rotation that both share."""
        return self.rows[:, self.movable] * self.sizes

    def blocks_at(self, x: NDArray) -> list[Block]:
        """Every recording about a point."""
        if not np.array_equal(x, self.at):
            self.blocks = self.problem.blocks(x, self.how.difference)
        return self.blocks

    def _move_to(self, x: NDArray, errors: Sequence[NDArray]) -> None:
        """Work out derivatives by all unknowns, and the errors: a square root of all their products."""
        blocks = self.problem.blocks(x, self.how.difference, errors)
        information, gradient = information_and_gradient(self.problem, x, blocks)
        cost = self.problem.cost(x, errors)
        information[np.diag_indices_from(information)] *= 1 + DAMPING
        products = np.block([[information, gradient[:, None]], [gradient, cost]])
        if not np.isfinite(products).all():
            raise ModelError("the errors are not finite")
        # Scaled to a unit diagonal, so that rounding takes the same share of small and large ones.
        scale = np.sqrt(np.diag(products))
        scale = np.where(scale > 0, scale, 1.0)
        value, vector = np.linalg.eigh(products / np.outer(scale, scale))
        self.at, self.blocks = x, blocks
        self.rows = np.sqrt(np.maximum(value, 0.0))[:, None] * vector.T * scale
