"""Which listed mechanism a learned law resembles: the distance of the two curves, measured by what is known of one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from ccmodel import mechanisms as registry
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.laws import unknowns_of, values_of
from ccmodel.diagnosis.linear_functions import covariance_by_information
from ccmodel.distributions import chi2_quantile
from ccmodel.mechanisms.contract import Curve, Parameter
from ccmodel.mechanisms.learned import Law


@dataclass(frozen=True)
class Learned:
    """A law as it was learned.

    Attributes
    ----------
    law : Law
    values : mapping of str to float
        Its range, its scale and its coefficients.
    covariance : ndarray, shape (coefficients, coefficients)
        Of the coefficients, not singular.
    """

    law: Law
    values: Mapping[str, float]
    covariance: NDArray


def nearest_listed(learned: Learned) -> dict[str, str | float | None] | None:
    """The listed mechanism whose law at this slot, of this argument, is nearest; None if no mechanism has one.

    ``distance`` is the root mean square distance of the coefficients in their posterior standard deviations, with the
    listed law's own constants fitted to the curve. ``limit`` is what a law that is the listed one exceeds in one of
    twenty cases; None if that law has as many constants as the curve has coefficients, and meets every curve.
    """
    every = [(name, curve) for name in registry.names() for curve in registry.get(name).curves]
    comparable = [(name, curve) for name, curve in every if learned.law.has_the_form_of(curve)]
    distances = [distance(learned, curve) for _, curve in comparable]
    if not distances:
        return None
    name, curve = comparable[int(np.argmin(distances))]
    return {"name": name, "distance": min(distances), "limit": _limit(learned, curve)}


def _limit(learned: Learned, curve: Curve) -> float | None:
    """The 95 % quantile of the distance of a law that is the listed one: of chi-square, by coefficient."""
    coefficients = len(learned.covariance)
    freedom = coefficients - len(curve.constants)
    return (chi2_quantile(settings.RECOGNISED, freedom) / coefficients) ** 0.5 if freedom > 0 else None


def distance(learned: Learned, curve: Curve) -> float:
    """Distance of a learned law from a listed one with the constants that suit it best."""
    from_learned = _Distance.of(learned, curve)
    starts = sorted(from_learned.starts(), key=lambda one: from_learned.cost(*one))
    best = min(from_learned.fitted(*one) for one in starts[: settings.LISTED_STARTS])
    return float(np.sqrt(2 * best / len(learned.covariance)))


@dataclass(frozen=True)
class _Distance:
    """Errors of a listed law over what is known of a learned one, by the constants of the former."""

    learned: Learned
    curve: Curve
    x: NDArray
    z: NDArray
    root: NDArray

    @classmethod
    def of(cls, learned: Learned, curve: Curve) -> "_Distance":
        x, y = learned.law.at_knots(learned.values)
        # Coefficients of elements count as far as the values that act show them.
        z = np.linalg.lstsq(learned.values["scale"] * learned.law.basis, learned.law.form.acting(y), rcond=None)[0]
        return cls(learned, curve, x, z, np.linalg.cholesky(learned.covariance))

    def errors(self, u: NDArray, signs: Sequence[float]) -> NDArray:
        """Of the coefficients that follow the listed law as well as they can, shape (coefficients,)."""
        law, scale = self.learned.law, self.learned.values["scale"]
        constants = zip(self.curve.constants, u, signs, strict=True)
        at = law.determined_at(self.x)
        y = self.curve.of(at, {p.name: _value(p, one, sign) for p, one, sign in constants})
        wanted = _without_average(y, law) if law.form.is_centred else law.behind(self.x, y)
        z = np.linalg.lstsq(scale * law.basis, wanted, rcond=None)[0]
        return solve_triangular(self.root, z - self.z, lower=True)

    def cost(self, u: NDArray, signs: Sequence[float]) -> float:
        return 0.5 * float(np.sum(self.errors(u, signs) ** 2))

    def starts(self) -> list[tuple[NDArray, tuple[float, ...]]]:
        """Constants within their ranges, and their signs."""
        constants = self.curve.constants
        grids = [[_scaled(p, p.at(share)) for share in p.screening_grid or settings.SCREENED_SHAPES] for p in constants]
        signs = [(1.0, -1.0) if p.signed else (1.0,) for p in constants]
        return [(np.array(u), s) for u in product(*grids) for s in product(*signs)]

    def fitted(self, u: NDArray, signs: Sequence[float]) -> float:
        """The least cost from a start."""
        low, high = np.array([_bounds(p) for p in self.curve.constants]).T
        return float(least_squares(lambda v: self.errors(v, signs), u, bounds=(low, high)).cost)


def _without_average(y: NDArray, law: Law) -> NDArray:
    """Values of a law at its knots without what belongs to the calibration: added to 1 for a factor, or to 0."""
    return y / y.mean() - 1.0 if law.form.is_factor else y - y.mean()


def _scaled(p: Parameter, value: float) -> float:
    return float(np.log(value)) if p.scale == "log" else value


def _value(p: Parameter, u: float, sign: float) -> float:
    return sign * float(np.exp(u)) if p.scale == "log" else u


def _bounds(p: Parameter) -> tuple[float, float]:
    """As far as a fit of the mechanism itself may go, on the parameter's scale; an angle may exceed a revolution."""
    if p.scale == "log":
        return float(np.log(p.low / settings.BEYOND_RANGE)), float(np.log(p.high * settings.BEYOND_RANGE))
    return (2 * p.low, 2 * p.high) if p.unit == "rad" else (p.low, p.high)


def learned_of(candidate: CandidateFit, law: Law) -> Learned:
    """A law of a fitted candidate.

    The standard deviations of the coefficients are those of the fit. Their correlation is that of the information of
    all recordings: a jackknife over few recordings is singular.
    """
    some = unknowns_of(candidate, law)
    by_information = covariance_by_information(candidate)[np.ix_(some, some)]
    ratio = np.sqrt(np.diag(candidate.covariance)[some] / np.diag(by_information))
    return Learned(law, values_of(candidate, law), by_information * np.outer(ratio, ratio))
