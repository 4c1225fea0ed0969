"""Searching for the least cost of a fit: Levenberg and Marquardt's steps, kept within bounds.

Made for this cost because its Jacobian is mostly empty: a recording's own unknowns touch no other recording. Only each
recording's small normal matrix is kept, where a general optimiser would decompose all rows by all unknowns.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.identify.problem import Block, Problem
from ccmodel.model.failure import ModelError
from ccmodel.model.sensitivity import STEP

# A search has converged when a full step would lessen the cost by less than this share of it. A cost of thousands is
# then known to 1e-8, its place to a ten-thousandth of a standard deviation.
TOLERANCE = 1e-12
# The model has corners (`ccmodel.model.sensitivity`), and so has the cost: its least may lie on one, where a slope says
# little. When no step helps, differences are taken more broadly; when still none does, what a step promises, in squares
# of a standard deviation, decides whether the corner is the optimum: a tenth of one is a third of a deviation aside.
BROAD = 1e-3
EXCUSED = 0.1
MOST_EVALUATIONS = 100
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e6
CONVERGED = "converged: the error no longer falls"
ON_CORNER = "converged: the least error lies on a corner of it, within a third of a standard deviation"
ON_BOUNDS = "converged: every unknown is on one of its bounds"
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
        Share of the cost that a full step must promise to be worth taking.
    fixed : sequence of int
        Unknowns that stay at their start.

    Raises
    ------
    ModelError, ValueError
        If the model cannot be run at the start, or its errors are not finite there.
    """
    low, high = problem.bounds
    x, cost = np.array(start, float), problem.cost(start)
    if not np.isfinite(cost):
        raise ModelError("the errors are not finite at the start")
    difference, damping, evaluations, said = STEP, FIRST_DAMPING, 1, STOPPED
    blocks = problem.blocks(x)
    while evaluations < most_evaluations:
        information, slope = information_and_slope(problem, x, blocks)
        movable = ~(((x <= low) & (slope > 0)) | ((x >= high) & (slope < 0)))
        movable[list(fixed)] = False
        if not movable.any():
            said = ON_BOUNDS
            break
        promised = _promised(problem, x, information, slope, movable)
        if promised <= tolerance * cost:
            said = CONVERGED
            break
        tried, lower = x, cost
        while lower >= cost and damping < MOST_DAMPING and evaluations < most_evaluations:
            tried = _stepped(problem, x, information, slope, movable, damping)
            lower, evaluations = _cost_or_infinite(problem, tried), evaluations + 1
            damping = damping / 10 if lower < cost else damping * 5
        if lower < cost:
            x, cost = tried, lower
        elif damping >= MOST_DAMPING and difference == BROAD:
            said = ON_CORNER if promised <= EXCUSED * cost / problem.independent_looks else STALLED
            break
        elif damping >= MOST_DAMPING:
            difference, damping = BROAD, FIRST_DAMPING
        blocks = problem.blocks(x, difference)
    active = np.where(x <= low, -1, np.where(x >= high, 1, 0))
    return Solution(x, cost, blocks, active, said in (CONVERGED, ON_CORNER, ON_BOUNDS), said, evaluations)


def information_and_slope(problem: Problem, x: NDArray, blocks: Sequence[Block]) -> tuple[NDArray, NDArray]:
    """Normal matrix of all unknowns, and the gradient of half the cost."""
    information, slope = np.diag(problem.expected**2), problem.unexpected(x) * problem.expected
    for block in blocks:
        information[np.ix_(block.columns, block.columns)] += block.information
        slope[block.columns] += block.score
    return information, slope


def _stepped(problem: Problem, x: NDArray, information, slope, movable, damping: float) -> NDArray:
    """Where a damped step leads, in unknowns measured by their sizes, and clipped to the bounds."""
    at, size = np.ix_(movable, movable), problem.sizes[movable]
    H, g = information[at] * np.outer(size, size), slope[movable] * size
    # What no recording depends on stays where it is.
    H[np.diag_indices_from(H)] += damping * np.diag(H) + 1e-14 * np.diag(H).max() + np.finfo(float).tiny
    stepped = x.copy()
    stepped[movable] -= np.linalg.solve(H, g) * size
    return np.clip(stepped, *problem.bounds)


def _promised(problem: Problem, x: NDArray, information, slope, movable) -> float:
    """By how much a step would lessen the cost at best, were the errors linear.

    A full step that a bound cuts off may lead uphill where a damped one does not.
    """
    steps = [_stepped(problem, x, information, slope, movable, damping) - x for damping in (1e-9, 1e-2, 1e2)]
    return max(float(-2 * slope @ step - step @ information @ step) for step in steps)


def _cost_or_infinite(problem: Problem, x: NDArray) -> float:
    """Cost of a try; infinite where the model cannot be run, so that the search turns back."""
    try:
        cost = problem.cost(x)
    except (ModelError, ValueError):
        return np.inf
    return cost if np.isfinite(cost) else np.inf
