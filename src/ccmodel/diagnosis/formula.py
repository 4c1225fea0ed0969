"""The shortest formula that stays in the band of a learned curve, with its constants."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import norm as normal

from ccmodel.inference.intervals import COVERAGE
from ccmodel.mechanisms.learned import Law

# Starting values of a length or a period, as shares of the range of the argument.
STARTS = (0.05, 0.1, 0.2, 0.4, 0.8)
# Share of the knots at which a formula must lie in the band.
IN_BAND = 0.9


@dataclass(frozen=True)
class Form:
    """A formula with unknown constants.

    Attributes
    ----------
    text : str
    value : callable
        ``value(x, *constants)``.
    names, units : tuple of str
        Of the constants; "y" is the unit of the curve, "x" that of its argument.
    has_length : bool
        Whether the last constant is a length or a period.
    """

    text: str
    value: Callable[..., NDArray]
    names: tuple[str, ...]
    units: tuple[str, ...]
    has_length: bool = False


def _forms(law: Law) -> Iterator[Form]:
    """Formulas from short to long."""
    if law.argument.has_two_values:
        yield Form("1 + a sign(v)" if law.channel is None else "a sign(v)", lambda x, a: a * x, ("a",), ("y",))
        return
    yield Form("a + b x", lambda x, a, b: a + b * x, ("a", "b"), ("y", "y/x"))
    yield Form("a + b x^2", lambda x, a, b: a + b * x**2, ("a", "b"), ("y", "y/x^2"))
    yield Form("a x + b x^3", lambda x, a, b: a * x + b * x**3, ("a", "b"), ("y/x", "y/x^3"))
    yield Form(
        "a + b exp(-x/c)", lambda x, a, b, c: a + b * np.exp(-x / c), ("a", "b", "c"), ("y", "y", "x"), has_length=True
    )
    yield Form("a + b tanh(x/c)", lambda x, a, b, c: a + b * np.tanh(x / c), ("a", "b", "c"), ("y", "y", "x"), True)
    yield Form("a + b x + c x^2", lambda x, a, b, c: a + b * x + c * x**2, ("a", "b", "c"), ("y", "y/x", "y/x^2"))
    yield Form(
        "a + b cos(2 pi x/p) + c sin(2 pi x/p)",
        lambda x, a, b, c, p: a + b * np.cos(2 * np.pi * x / p) + c * np.sin(2 * np.pi * x / p),
        ("a", "b", "c", "p"),
        ("y", "y", "y", "x"),
        True,
    )


def shortest(
    x: NDArray, y: NDArray, band: tuple[NDArray, NDArray], law: Law
) -> tuple[str | None, list[dict[str, float | str]]]:
    """The first formula that lies in the band, and its constants with their intervals; None and none if there is none.

    Parameters
    ----------
    x, y : ndarray, shape (knots,)
        The curve.
    band : (ndarray, ndarray)
        Lower and upper end of its 90 % band.
    law : Law
    """
    quantile = normal.ppf(0.5 + COVERAGE / 2)
    neutral = 1.0 if law.argument.has_two_values and law.channel is None else 0.0
    sd = np.maximum((band[1] - band[0]) / (2 * quantile), 1e-3 * max(float(np.ptp(y)), 1e-12))
    for form in _forms(law):
        if len(form.names) >= len(x) and len(x) > 2:
            continue
        found = min(_fits(form, x, y - neutral, sd), key=lambda solution: solution.cost)
        if np.mean(np.abs(found.fun) <= quantile) < IN_BAND:
            continue
        covariance = np.linalg.pinv(found.jac.T @ found.jac)
        reach = quantile * np.sqrt(np.diag(covariance).clip(0.0))
        units = [_unit(unit, law) for unit in form.units]
        return form.text, [
            {"name": name, "value": float(v), "low": float(v - r), "high": float(v + r), "unit": unit}
            for name, v, r, unit in zip(form.names, found.x, reach, units, strict=True)
        ]
    return None, []


def _fits(form: Form, x: NDArray, y: NDArray, sd: NDArray) -> Iterator:
    """Least squares fits from every starting value."""
    span = float(np.ptp(x)) or 1.0
    for share in STARTS if form.has_length else (None,):
        start = np.full(len(form.names), 0.1 * float(np.ptp(y)) or 1e-6)
        if share is not None:
            start[-1] = share * span
        scale = np.maximum(np.abs(start), 1e-12)

        def errors(constants: NDArray) -> NDArray:
            return np.nan_to_num((form.value(x, *constants) - y) / sd, posinf=1e9, neginf=-1e9)

        with np.errstate(all="ignore"):
            yield least_squares(errors, start, x_scale=scale)


def _unit(unit: str, law: Law) -> str:
    of_argument = law.argument.unit.replace(" ", "*")
    by_x = {"x": of_argument, "y": law.unit, "y/x": f"{law.unit}/({of_argument})"}
    found = by_x.get(unit, unit.replace("y/x", f"{law.unit}/({of_argument})"))
    return found.replace(" ", "*")
