"""The plain model fitted to a made-up rig as the paper fitted it: stiffness and friction, all else as stated."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ccmodel.compare.table_one.rigs import Condition, plain
from ccmodel.compare.table_one.settings import Rig

# What an error can be given over, shape (channels,); the paper does not say which it took.
NORMS = {
    "peak-to-peak": lambda values: np.ptp(values, axis=1),
    "maximum": lambda values: np.abs(values).max(axis=1),
    "rms": lambda values: np.sqrt((values**2).mean(axis=1)),
}
# A fit may go this far from the rig's own values, as a factor.
REACH = 30.0
TOLERANCE = 1e-5
MOST_EVALUATIONS = 30
# Derivatives are taken where the logarithms of k and mu are whole multiples of this: thousands of fits share them.
LATTICE = 0.02


@dataclass(frozen=True)
class Refit:
    """Where a fit ended.

    Attributes
    ----------
    stiffness_ratio, friction_ratio : float
        Fitted over the rig's own.
    rmse : ndarray, shape (channels,)
        What is left, in the channels' units.
    """

    stiffness_ratio: float
    friction_ratio: float
    rmse: NDArray


def refit(rig: Rig, condition: Condition, recorded: NDArray) -> Refit:
    """Least squares over all channels of Table I, each over what the condition says.

    Raises
    ------
    ModelError
        If the model cannot be run on the way.
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
    left = found.fun.reshape(recorded.shape) * span
    return Refit(k_ratio, mu_ratio, np.sqrt((left**2).mean(axis=1)))


def _plain_at(rig: Rig, condition: Condition, log_k: float, log_mu: float) -> NDArray:
    """The plain model at logarithms of the parameters over the rig's own."""
    cable = condition.cable(rig)
    k, mu = cable.stiffness_N_per_m * np.exp(log_k), cable.friction_coefficient * np.exp(log_mu)
    return plain(rig, condition, k, mu)


@lru_cache(maxsize=2048)
def _derivatives(rig: Rig, condition: Condition, i: int, j: int) -> NDArray:
    """By the two logarithms at a point of the lattice, shape (2, channels, samples)."""
    x, steps = np.array([i, j]) * LATTICE, LATTICE / 2 * np.eye(2)
    differences = [_plain_at(rig, condition, *(x + d)) - _plain_at(rig, condition, *(x - d)) for d in steps]
    return np.stack(differences) / LATTICE
