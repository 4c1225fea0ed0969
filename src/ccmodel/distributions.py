"""Quantiles and tail probabilities. `scipy.stats` has the same ones, and takes 0.3 s of every command to import."""

from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc, chdtri, fdtrc, ndtri, stdtr, stdtrit


def normal_quantile(p: float) -> float:
    """Value below which a standard normal variable lies with probability `p`."""
    return float(ndtri(p))


def student_quantile(p: float, freedom: ArrayLike) -> NDArray:
    """Value below which a variable of Student's t distribution lies with probability `p`; of the shape of `freedom`."""
    return stdtrit(freedom, p)


def student_tail(value: float, freedom: float) -> float:
    """Probability that a variable of Student's t distribution is above `value`."""
    return float(stdtr(freedom, -value))


def fisher_tail(value: float, numerator_freedom: float, denominator_freedom: float) -> float:
    """Probability that a variable of the F distribution is above `value`."""
    return float(fdtrc(numerator_freedom, denominator_freedom, value))


def chi2_quantile(p: float, freedom: float) -> float:
    """Value below which a chi-squared variable lies with probability `p`."""
    return float(chdtri(freedom, 1 - p))


def chi2_tail(value: float, freedom: float) -> float:
    """Probability that a chi-squared variable is above `value`."""
    return float(chdtrc(freedom, value))
