"""The paper's model fitted to a simulated rig as in the paper: stiffness and friction, all else as stated."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

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

    def errors(x: NDArray) -> NDArray:
        return _plain_at(rig, condition, *x) - recorded

    def jacobian(x: NDArray) -> NDArray:
        derivatives = _derivatives(rig, condition.without_fit, *np.round(x / LATTICE).astype(int).tolist())
        return (derivatives / span).reshape(2, -1).T

    found = least_squares(
        lambda x: (errors(x) / span).ravel(),
        np.zeros(2),
        jac=jacobian,
        bounds=([-reach] * 2, [reach] * 2),
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE,
        max_nfev=MOST_EVALUATIONS,
    )
    k_ratio, mu_ratio = np.exp(found.x).tolist()
    residuals = found.fun.reshape(recorded.shape) * span
    return Refit(k_ratio, mu_ratio, np.sqrt((residuals**2).mean(axis=1)))


def _plain_at(rig: Rig, condition: Condition, log_k: float, log_mu: float) -> NDArray:
    """The paper's model; the arguments are logarithms of the parameters over the rig's own."""
    cable = condition.cable(rig)
    k, mu = cable.stiffness_N_per_m * np.exp(log_k), cable.friction_coefficient * np.exp(log_mu)
    return plain(rig, condition, k, mu)


@lru_cache(maxsize=2048)
def _derivatives(rig: Rig, condition: Condition, i: int, j: int) -> NDArray:
    """Derivatives by both logarithms at a point of the lattice, shape (2, channels, samples)."""
    x, steps = np.array([i, j]) * LATTICE, LATTICE / 2 * np.eye(2)
    differences = [_plain_at(rig, condition, *(x + d)) - _plain_at(rig, condition, *(x - d)) for d in steps]
    return np.stack(differences) / LATTICE
