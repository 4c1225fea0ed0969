"""The paper's model fitted to a simulated rig as in the paper: stiffness and friction, all else as stated."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ccmodel.inference.jacobian import STEP, jacobian
from ccmodel.inference.least_squares import Search, minimise
from ccmodel.inference.problem import Block, Free, Problem
from ccmodel.studies.table_one.rigs import Condition, plain
from ccmodel.studies.table_one.settings import Rig

# Norms of a recording, shape (channels,), by which errors can be divided; the paper does not state its own.
NORMS = {
    "peak-to-peak": lambda values: np.ptp(values, axis=1),
    "maximum": lambda values: np.abs(values).max(axis=1),
    "rms": lambda values: np.sqrt((values**2).mean(axis=1)),
}
# Bounds of a fit, as a factor of the rig's own values.
REACH = 30.0
TOLERANCE = 1e-5
MOST_EVALUATIONS = 30
# Derivatives are computed at multiples of this step in ln k and ln mu, so that thousands of fits share them.
LATTICE = 0.02


@dataclass(frozen=True)
class Refit:
    """Result of a fit.

    Attributes
    ----------
    stiffness_ratio, friction_ratio : float
        Fitted value over the rig's own.
    rmse : ndarray, shape (channels,)
        Root mean square errors, in the channels' units.
    """

    stiffness_ratio: float
    friction_ratio: float
    rmse: NDArray


def refit(rig: Rig, condition: Condition, recorded: NDArray) -> Refit:
    """Least squares over all channels of Table I, each divided by the condition's norm.

    Raises
    ------
    ModelError
        If the model cannot be run at a step of the fit.
    """
    span = NORMS[condition.fit_over](recorded)[:, None]
    reach = np.log(REACH)
    unknowns = dict.fromkeys(("log_k", "log_mu"), Free(0.0, -reach, reach))
    problem = _LatticeProblem([_Recorded(rig, condition, recorded, span)], unknowns, weight=lambda recorded: 1.0)
    search = Search(tolerance=TOLERANCE, shortest=TOLERANCE, most_evaluations=MOST_EVALUATIONS, retreats=False)
    found = minimise(problem, problem.start, search)
    k_ratio, mu_ratio = np.exp(found.x).tolist()
    residuals = found.blocks[0].errors * span
    return Refit(k_ratio, mu_ratio, np.sqrt((residuals**2).mean(axis=1)))


@dataclass(frozen=True)
class _Recorded:
    """Channels of a simulated rig, and the norms by which their errors are divided, shape (channels, 1)."""

    rig: Rig
    condition: Condition
    measured: NDArray
    span: NDArray
    name: str = "half loop"
    session: str = ""

    def errors(self, values: Mapping[str, float]) -> NDArray:
        """Errors of the paper's model over the norms, shape (channels, samples)."""
        return (_plain_at(self.rig, self.condition, **values) - self.measured) / self.span


class _LatticeProblem(Problem[_Recorded]):
    """A fit whose derivatives are taken at the nearest point of the lattice."""

    def blocks(self, x: NDArray, step: float = STEP, errors: Sequence[NDArray] | None = None) -> list[Block]:
        """Errors at `x`, derivatives at the lattice."""
        (recorded,) = self.observations
        at = np.round(x / LATTICE).astype(int).tolist()
        derivatives = _derivatives(recorded.rig, recorded.condition.without_fit, *at) / recorded.span[..., None]
        return [Block(np.arange(2), (errors or self.errors(x))[0], derivatives)]


def _plain_at(rig: Rig, condition: Condition, log_k: float, log_mu: float) -> NDArray:
    """The paper's model; the arguments are logarithms of the parameters over the rig's own."""
    cable = condition.cable(rig)
    k, mu = cable.stiffness_N_per_m * np.exp(log_k), cable.friction_coefficient * np.exp(log_mu)
    return plain(rig, condition, k, mu)


@lru_cache(maxsize=2048)
def _derivatives(rig: Rig, condition: Condition, i: int, j: int) -> NDArray:
    """Derivatives by both logarithms at a point of the lattice, shape (channels, samples, 2)."""
    return jacobian(lambda x: _plain_at(rig, condition, *x), np.array([i, j]) * LATTICE, np.full(2, LATTICE / 2))
