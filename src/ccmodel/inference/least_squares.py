"""Minimisation of a fit's cost within bounds, by scipy's trust-region method.

A fit has tens of thousands of residuals r with the Jacobian J, but the method depends on them through the products
J'J, J'r and r'r alone. These are summed recording by recording. Scipy receives the square root of the matrix
[J'J, J'r; r'J, r'r]: one row more than there are unknowns, with the same cost, gradient and Gauss-Newton Hessian.

The variables of the search are dimensionless: the distance of each unknown from its start, over its size
(`ccmodel.inference.jacobian.size_of`). Units of measurement therefore do not affect the search.

Where runs are dear, the derivatives at the first point of a search are carried along by secants (Broyden 1965), as long
as the cost falls by what they predict. At the end they are computed again, and the search goes on if they say so.

Some costs are too rough for derivatives, for instance where the model is driven by a measured load torque. A fit of few
unknowns that stalls there is completed by a search without derivatives.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from ccmodel.deadline import UNLIMITED, Deadline
from ccmodel.failure import ModelError
from ccmodel.inference.jacobian import STEP
from ccmodel.inference.problem import Block, Problem

# The model has corners (`ccmodel.inference.jacobian`), and so has the cost. At a minimum on a corner the gradient is
# not zero, and the search ends because no step reduces the cost. The linearised model then predicts a further
# reduction. Up to this value, where 1 stands for one standard deviation of the unknowns, the corner counts as the
# minimum: it is within sqrt(0.1), a third of a standard deviation.
CORNER_REDUCTION = 0.1
# Step of the differences in the second search, after one that stalled or took too many evaluations, as a share of the
# unknowns' sizes: a larger step averages over corners.
LARGE_DIFFERENCE = 1e-3
# Relative increase of the Hessian's diagonal. An unknown that the recordings do not determine has a gradient of
# rounding errors alone; the increase keeps it where it is.
DAMPING = 1e-9
# Search without derivatives: edge of the first simplex and final tolerance, in sizes; most evaluations; most unknowns
# for which it is used.
SIMPLEX_EDGE, SIMPLEX_TOLERANCE = 1e-2, 1e-4
SIMPLEX_EVALUATIONS, SIMPLEX_UNKNOWNS = 1000, 8
# Derivatives are carried on by a secant where the cost fell by a share of the predicted reduction within these bounds.
AS_PREDICTED = (0.5, 2.0)
# Searches that are continued with new derivatives, at most.
MOST_CONTINUATIONS = 5
# An unknown within this distance of a bound, in sizes, is put on the bound: scipy's iterates stay strictly inside.
ON_BOUND = 1e-6
NO_STEP_HELPS = 3  # scipy's status where no step longer than the shortest reduces the cost
CONVERGED = "converged: the cost no longer falls"
ON_CORNER = "converged at a corner of the cost, within a third of a standard deviation of the minimum"
DIRECT = "converged by a search without derivatives: the cost is too rough for them"
STOPPED = "stopped at the largest number of evaluations without converging"
STALLED = "stalled: no step lessens the error although its slope says that one should"


@dataclass(frozen=True)
class Search:
    """Settings of a search.

    Attributes
    ----------
    tolerance : float
        The search has converged when a step reduces the cost by less than this share. The default leaves the unknowns
        within a thousandth of a standard deviation of the minimum.
    shortest : float
        The search ends at a step shorter than this share of the distance from the start; lengths in sizes.
    difference : float
        Step of the finite differences, as a share of the unknowns' sizes.
    most_evaluations : int
    retreats : bool
        At a point where the model cannot be run: True shortens the step, False raises the model's error.
    gradient : float or None
        The search ends where no component of the gradient exceeds this; None: no such limit.
    own_units : bool
        Whether scipy searches in the unknowns' own units, with their sizes as scales, and not in dimensionless
        variables. Near bounds its steps differ between the two. A cost with several minima, as with measured load
        torques, is then searched to another one.
    secants : bool
        Whether derivatives are carried along by secants.
    deadline : Deadline
        When the search is given up: it raises `ccmodel.deadline.OutOfTimeError`.
    """

    tolerance: float = 1e-10
    shortest: float = 1e-7
    difference: float = STEP
    most_evaluations: int = 100
    retreats: bool = True
    gradient: float | None = None
    own_units: bool = False
    secants: bool = False
    deadline: Deadline = UNLIMITED


@dataclass(frozen=True)
class Solution:
    """Where a search ended.

    Attributes
    ----------
    x : ndarray, shape (unknowns,)
    cost : float
    blocks : list of Block
        By recording, errors and derivatives at `x`.
    active : ndarray of int, shape (unknowns,)
        -1 where an unknown is on its lower bound, 1 on its upper bound, else 0.
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
    """Find the local minimum near the start, within the bounds.

    A search that does not converge is continued with larger finite differences, and, if it then stalls and there are
    few unknowns, without derivatives.

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
    how = replace(how, difference=LARGE_DIFFERENCE)
    second = minimise(problem, solution.x, how, fixed, origin=start)
    second = replace(second, evaluations=solution.evaluations + second.evaluations)
    if second.message == STALLED and problem.start.size - len(fixed) <= SIMPLEX_UNKNOWNS:
        return _without_derivatives(second, _Reduced(problem, start, how, fixed))
    return second


def minimise(
    problem: Problem, start: NDArray, how: Search, fixed: Sequence[int] = (), origin: NDArray | None = None
) -> Solution:
    """One search by the trust-region method; parameters and errors as for `solve`.

    `origin` is the zero point of the search's dimensionless variables; the default is the start.
    """
    reduced = _Reduced(problem, start if origin is None else origin, how, fixed)
    y = reduced.variables(start)
    if not y.size:
        return _solution(reduced, y, CONVERGED, 1)
    evaluations = 0
    for _ in range(MOST_CONTINUATIONS + 1):
        found = optimize.least_squares(
            reduced.residuals, y, reduced.jacobian, reduced.bounds, ftol=how.tolerance, xtol=how.shortest,
            gtol=how.gradient, x_scale=reduced.sizes / reduced.units, max_nfev=how.most_evaluations - evaluations,
        )  # fmt: skip
        y, evaluations = found.x, evaluations + found.nfev
        if reduced.is_computed or evaluations >= how.most_evaluations:
            break
        reduced.compute_derivatives()
        if reduced.predicted_reduction(y) <= how.tolerance * reduced.lowest_cost:
            break
        # Rounding errors must not decide whether the point where the search goes on counts as one.
        reduced.lowest_cost = np.inf
    return _solution(reduced, y, _message(found, reduced), evaluations)


def _without_derivatives(stalled: Solution, reduced: "_Reduced") -> Solution:
    """Continue a stalled search by the simplex method of Nelder and Mead."""
    y = reduced.variables(stalled.x)
    low, high = reduced.bounds
    step = np.where(y + SIMPLEX_EDGE <= high, SIMPLEX_EDGE, -SIMPLEX_EDGE)
    simplex = np.clip(np.vstack([y, y + np.diag(step)]), low, high)
    options = {"initial_simplex": simplex, "xatol": SIMPLEX_TOLERANCE, "fatol": np.inf, "maxfev": SIMPLEX_EVALUATIONS}
    found = optimize.minimize(
        reduced.cost, y, method="Nelder-Mead", bounds=list(zip(low, high, strict=True)), options=options
    )
    message = DIRECT if found.success else STOPPED
    return _solution(reduced, found.x, message, stalled.evaluations + found.nfev)


def _message(found: optimize.OptimizeResult, reduced: "_Reduced") -> str:
    """Whether the search has converged, from scipy's result and the reduction of the cost that is still predicted."""
    if found.status != NO_STEP_HELPS:
        return CONVERGED if found.success else STOPPED
    predicted = reduced.predicted_reduction(found.x)
    if predicted <= reduced.how.tolerance * 2 * found.cost:
        return CONVERGED
    # The cost of a correct model is the effective sample size: the limit grows with the cost per sample.
    limit = CORNER_REDUCTION * 2 * found.cost / reduced.problem.effective_sample_size
    return ON_CORNER if predicted <= limit else STALLED


def _solution(reduced: "_Reduced", y: NDArray, message: str, evaluations: int) -> Solution:
    """The solution at a point of the search, with unknowns next to a bound put on the bound."""
    x, problem = reduced.place(y), reduced.problem
    low, high = problem.bounds
    near = ON_BOUND * problem.sizes
    active = np.where(x <= low + near, -1, np.where(x >= high - near, 1, 0))
    x = np.where(active < 0, low, np.where(active > 0, high, x))
    blocks = reduced.blocks_at(x)
    cost = problem.cost(x, [b.errors for b in blocks])
    return Solution(x, cost, blocks, active, message, evaluations)


def information_and_gradient(problem: Problem, x: NDArray, blocks: Sequence[Block]) -> tuple[NDArray, NDArray]:
    """Gauss-Newton Hessian and gradient of half the cost, priors included, by all unknowns."""
    information = np.diag(problem.prior_precision**2)
    gradient = problem.prior_errors(x) * problem.prior_precision
    for block in blocks:
        information[np.ix_(block.columns, block.columns)] += block.information
        gradient[block.columns] += block.score
    return information, gradient


class _Reduced:
    """The cost as the sum of squares of few rows, a function of the search's variables.

    The variables are the distances of the unknowns that are not fixed from `origin`, over their sizes; or, in own
    units, these unknowns themselves. The rows and the derivatives belong to `point`, the last point at which the cost
    fell.
    """

    def __init__(self, problem: Problem, origin: NDArray, how: Search, fixed: Sequence[int]):
        self.problem, self.origin, self.how = problem, np.array(origin, float), how
        self.movable = np.setdiff1d(np.arange(problem.start.size), fixed)
        self.sizes = self.units = problem.sizes[self.movable]
        if how.own_units:
            self.origin[self.movable], self.units = 0.0, np.ones(self.movable.size)
        self.bounds = tuple(map(self.variables, problem.bounds))
        self.lowest_cost = np.inf
        self.point: NDArray | None = None
        self.blocks: list[Block] = []
        self.rows = np.empty((0, 0))
        self.is_computed = True

    def variables(self, x: NDArray) -> NDArray:
        """The search's variables at a point given by all unknowns."""
        return (x - self.origin)[self.movable] / self.units

    def place(self, y: NDArray) -> NDArray:
        """All unknowns, in their own units, at a point of the search."""
        x = self.origin.copy()
        x[self.movable] += y * self.units
        return x

    def cost(self, y: NDArray) -> float:
        """The cost, infinite where the model cannot be run."""
        try:
            return self.problem.cost(self.place(y))
        except (ModelError, ValueError):
            return np.inf

    def residuals(self, y: NDArray) -> NDArray:
        """Rows whose sum of squares is the cost; infinite where the model cannot be run and the search retreats.

        Scipy rejects a point that does not reduce the cost and uses nothing but the norm of its rows. Derivatives are
        therefore not computed there, and the norm stands in the first row.
        """
        self.how.deadline.check()
        x = self.place(y)
        if self.point is not None and np.array_equal(x, self.point):
            return self._taken()
        try:
            errors = self.problem.errors(x)
            cost = self.problem.cost(x, errors)
            norm = np.sqrt(cost)
            if norm * norm >= self.lowest_cost:
                return np.r_[norm, np.zeros(len(self.rows) - 1)]
            self._move_to(x, errors, cost)
        except (ModelError, ValueError):
            if not (self.how.retreats and len(self.rows)):
                raise
            return np.full(len(self.rows), np.inf)
        return self._taken()

    def _taken(self) -> NDArray:
        """Rows of the residuals at `point`, whose cost is now the lowest."""
        rows = np.ascontiguousarray(self.rows[:, -1])
        self.lowest_cost = float(rows @ rows)
        return rows

    def jacobian(self, y: NDArray) -> NDArray:
        """Derivatives of `residuals` by the variables of the search.

        Scipy asks for them only at a point that it has accepted, whose rows are stored.
        """
        return self.rows[:, self.movable] * self.units

    def predicted_reduction(self, y: NDArray) -> float:
        """Reduction of the cost within the bounds that the derivatives at `point`, `y` in variables, predict."""
        jacobian, rows = self.jacobian(y), self.rows[:, -1]
        # Scipy's cost is half the sum of squares.
        linear = optimize.lsq_linear(jacobian, jacobian @ y - rows, self.bounds)
        return float(rows @ rows) - 2 * linear.cost

    def blocks_at(self, x: NDArray) -> list[Block]:
        """By recording, errors and derivatives at a point."""
        if self.point is None or not (self.is_computed and np.array_equal(x, self.point)):
            self.blocks = self.problem.blocks(x, self.how.difference)
        return self.blocks

    def compute_derivatives(self) -> None:
        """Replace derivatives that were carried along by computed ones."""
        assert self.point is not None
        errors = [block.errors for block in self.blocks]
        self._place_at(self.point, self.problem.blocks(self.point, self.how.difference, errors), self.lowest_cost)
        self.is_computed = True

    def _move_to(self, x: NDArray, errors: Sequence[NDArray], cost: float) -> None:
        """Take a point with its errors and derivatives."""
        self.is_computed = not (self.how.secants and self._has_fallen_as_predicted(x, cost))
        if self.is_computed:
            blocks = self.problem.blocks(x, self.how.difference, errors)
        else:
            moved = x - self.point
            pairs = zip(self.blocks, errors, strict=True)
            blocks = [block.by_secant(moved, self.problem.sizes, e) for block, e in pairs]
        self._place_at(x, blocks, cost)

    def _has_fallen_as_predicted(self, x: NDArray, cost: float) -> bool:
        if self.point is None:
            return False
        predicted = self.rows[:, -1] + self.rows[:, :-1] @ (x - self.point)
        share = (self.lowest_cost - cost) / max(self.lowest_cost - float(predicted @ predicted), 1e-300)
        return AS_PREDICTED[0] <= share <= AS_PREDICTED[1]

    def _place_at(self, x: NDArray, blocks: list[Block], cost: float) -> None:
        """Take a point, and compute its rows: a square root of the matrix [J'J, J'r; r'J, r'r]."""
        information, gradient = information_and_gradient(self.problem, x, blocks)
        information[np.diag_indices_from(information)] *= 1 + DAMPING
        products = np.block([[information, gradient[:, None]], [gradient, cost]])
        if not np.isfinite(products).all():
            raise ModelError("the errors are not finite")
        # A unit diagonal keeps the relative rounding error of the eigenvalues alike for large and small entries.
        scale = np.sqrt(np.diag(products))
        scale = np.where(scale > 0, scale, 1.0)
        value, vector = np.linalg.eigh(products / np.outer(scale, scale))
        self.point, self.blocks = x, blocks
        self.rows = np.sqrt(np.maximum(value, 0.0))[:, None] * vector.T * scale
