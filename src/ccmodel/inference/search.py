"""Searching for the least cost of a fit: scipy's trust region within bounds, on a cost of few rows.

A cost too rough for that, as of measured loads, is searched without slopes in the end, where few values are unknown.

Scipy asks for all errors and all derivatives and decomposes them whole, although of a fit's tens of thousands of rows
only their products with one another count, and a recording's own unknowns touch no other recording. Here it is given
a root of these products, with as many rows as there are unknowns and one more: the same cost, slope and curvature.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares, lsq_linear, minimize

from ccmodel.failure import ModelError
from ccmodel.inference.problem import Block, Problem
from ccmodel.model.sensitivity import STEP

# A search has converged when a step lessens the cost by less than this share of it: its place is then known to a
# thousandth of a standard deviation, and mostly far better, since the last step is the least.
TOLERANCE = 1e-10
# The model has corners (`ccmodel.model.sensitivity`), and so has the cost: its least may lie on one, where a slope says
# little. When not even so short a step helps, in sizes, what a step promises, in squares of a standard deviation,
# decides whether the corner is the optimum: a tenth of one is a third of a deviation aside. Where it promises more, or
# the search goes on and on, differences are once taken more broadly.
SHORTEST = 1e-7
BROAD = 1e-3
EXCUSED = 0.1
# Share by which the curvature along each unknown is taken for more than it is: what recordings do not tell apart stays
# where it is, since its slope is that of rounding.
DAMPING = 1e-9
# Where slopes lead nowhere although they promise something, the cost is too rough for them (a load that rocks, cables
# that go slack), and it is searched without: from points so far around, in sizes, down to a hundredth of that.
AROUND, DOWN_TO = 1e-2, 1e-4
MOST_DIRECT, UNKNOWNS_DIRECT = 1000, 8
ON_BOUND = 1e-6  # The search stays inside its bounds; so near one, in sizes, it means the bound.
MOST_EVALUATIONS = 100
STUCK = 3  # scipy's status where no step longer than the shortest helps
CONVERGED = "converged: the error no longer falls"
ON_CORNER = "converged: the least error lies on a corner of it, within a third of a standard deviation"
DIRECT = "converged: by direct search, the error being too rough for its slopes"
STOPPED = "stopped at the largest number of evaluations without converging"
STALLED = "stalled: no step lessens the error although its slope says that one should"


@dataclass(frozen=True)
class Solution:
    """Where a search for the least cost ended.

    Attributes
    ----------
    x : ndarray, shape (unknowns,)
    cost : float
    blocks : list of Block
        Every recording about `x`.
    active : ndarray of int, shape (unknowns,)
        -1 or 1 where an unknown is on its lower or upper bound.
    converged : bool
    message : str
    evaluations : int
    """

    x: NDArray
    cost: float
    blocks: list[Block]
    active: NDArray
    converged: bool
    message: str
    evaluations: int


def solve(
    problem: Problem,
    start: NDArray,
    most_evaluations: int = MOST_EVALUATIONS,
    tolerance: float = TOLERANCE,
    fixed: Sequence[int] = (),
) -> Solution:
    """The nearest least cost within the bounds.

    Parameters
    ----------
    problem : Problem
    start : ndarray, shape (unknowns,)
    most_evaluations : int
    tolerance : float
        Share of the cost that a step must take off to be worth another.
    fixed : sequence of int
        Unknowns that stay at their start.

    Raises
    ------
    ModelError, ValueError
        If the model cannot be run at the start, or its errors are not finite there.
    """
    movable = np.setdiff1d(np.arange(problem.start.size), fixed)
    y, evaluations = np.zeros(movable.size), 0
    for difference in (STEP, BROAD):
        reduced = _Reduced(problem, start, movable, difference)
        found = least_squares(
            reduced.residuals, y, reduced.jacobian, reduced.bounds, ftol=tolerance, xtol=SHORTEST, gtol=None,
            max_nfev=most_evaluations,
        )  # fmt: skip
        y, evaluations, message = found.x, evaluations + found.nfev, _message(found, reduced, tolerance)
        if message in (CONVERGED, ON_CORNER):
            break
    if message == STALLED and movable.size <= UNKNOWNS_DIRECT:
        found = _searched_directly(reduced, y)
        y, evaluations, message = found.x, evaluations + found.nfev, DIRECT if found.success else STOPPED
    x, active = _on_bounds(problem, reduced.place(y))
    converged = message in (CONVERGED, ON_CORNER, DIRECT)
    return Solution(x, problem.cost(x), problem.blocks(x, difference), active, converged, message, evaluations)


def _searched_directly(reduced: "_Reduced", y: NDArray) -> OptimizeResult:
    """From where slopes have led, by Nelder and Mead's simplex."""
    low, high = reduced.bounds
    step = np.where(y + AROUND <= high, AROUND, -AROUND)
    simplex = np.clip(np.vstack([y, y + np.diag(step)]), low, high)
    options = {"initial_simplex": simplex, "xatol": DOWN_TO, "fatol": np.inf, "maxfev": MOST_DIRECT}
    return minimize(reduced.cost, y, method="Nelder-Mead", bounds=list(zip(low, high, strict=True)), options=options)


def _message(found: OptimizeResult, reduced: "_Reduced", tolerance: float) -> str:
    if found.status != STUCK:
        return CONVERGED if found.success else STOPPED
    promised = 2 * (found.cost - lsq_linear(found.jac, found.jac @ found.x - found.fun, reduced.bounds).cost)
    if promised <= tolerance * 2 * found.cost:
        return CONVERGED
    return ON_CORNER if promised <= EXCUSED * 2 * found.cost / reduced.problem.independent_looks else STALLED


def _on_bounds(problem: Problem, x: NDArray) -> tuple[NDArray, NDArray]:
    """The search ends short of a bound: unknowns put on it, and which are."""
    low, high = problem.bounds
    near = ON_BOUND * problem.sizes
    active = np.where(x <= low + near, -1, np.where(x >= high - near, 1, 0))
    return np.where(active < 0, low, np.where(active > 0, high, x)), active


def information_and_slope(problem: Problem, x: NDArray, blocks: Sequence[Block]) -> tuple[NDArray, NDArray]:
    """Normal matrix of all unknowns, and the gradient of half the cost."""
    information, slope = np.diag(problem.expected**2), problem.unexpected(x) * problem.expected
    for block in blocks:
        information[np.ix_(block.columns, block.columns)] += block.information
        slope[block.columns] += block.score
    return information, slope


class _Reduced:
    """The cost in few rows, over how far those unknowns that may move lie from their start, in their sizes."""

    def __init__(self, problem: Problem, start: NDArray, movable: NDArray, difference: float):
        self.problem, self.start, self.movable, self.difference = problem, start, movable, difference
        self.sizes = problem.sizes[movable]
        self.bounds = tuple((b - start)[movable] / self.sizes for b in problem.bounds)
        self.of, self.rows = np.zeros(movable.size), self._rows(start)

    def place(self, y: NDArray) -> NDArray:
        """All unknowns in their units."""
        x = np.array(self.start, float)
        x[self.movable] += y * self.sizes
        return x

    def cost(self, y: NDArray) -> float:
        """Infinite where the model cannot be run."""
        try:
            return self.problem.cost(self.place(y))
        except (ModelError, ValueError):
            return np.inf

    def residuals(self, y: NDArray) -> NDArray:
        """Infinite where the model cannot be run, so that the search turns back."""
        try:
            return self._at(y)[:, -1]
        except (ModelError, ValueError):
            return np.full(self.rows.shape[0], np.inf)

    def jacobian(self, y: NDArray) -> NDArray:
        """Of `residuals`, up to a rotation that both share."""
        return self._at(y)[:, self.movable] * self.sizes

    def _at(self, y: NDArray) -> NDArray:
        if not np.array_equal(y, self.of):
            self.rows, self.of = self._rows(self.place(y)), y.copy()
        return self.rows

    def _rows(self, x: NDArray) -> NDArray:
        """Derivatives by all unknowns, and the errors: a root of all their products; shape (rows, unknowns + 1)."""
        blocks = self.problem.blocks(x, self.difference)
        information, slope = information_and_slope(self.problem, x, blocks)
        cost = sum(float((b.errors**2).sum()) for b in blocks) + float((self.problem.unexpected(x) ** 2).sum())
        information[np.diag_indices_from(information)] *= 1 + DAMPING
        products = np.block([[information, slope[:, None]], [slope, cost]])
        if not np.isfinite(products).all():
            raise ModelError("the errors are not finite")
        # Each measured by itself, so that rounding takes the same share of small ones and large ones.
        alone = np.sqrt(np.diag(products))
        alone = np.where(alone > 0, alone, 1.0)
        value, vector = np.linalg.eigh(products / np.outer(alone, alone))
        return np.sqrt(np.maximum(value, 0.0))[:, None] * vector.T * alone
