"""The shortest formula that stays in the band of a learned curve, with its constants."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ccmodel.diagnosis import settings
from ccmodel.distributions import normal_quantile
from ccmodel.inference.intervals import COVERAGE
from ccmodel.mechanisms.learned import Law

# A law that does not depend on its argument.
CONSTANT = "a"
# Lengths and periods that are tried first: so many, from twice the distance of the knots to twice the range.
TRIED = 40
# Exponents that are tried first.
EXPONENTS = tuple(0.1 * k for k in (*range(-25, 0), *range(1, 26)))
# Error, over its standard deviation, of a term that cannot be computed: finite, as a search needs it.
NO_FIT = 1e50


@dataclass(frozen=True)
class Form:
    """A formula: a sum of terms with a factor each, and perhaps a length.

    Attributes
    ----------
    text : str
    terms : callable
        ``terms(x, length)``: each term without its factor.
    names, units : tuple of str
        Of the factors, and then of the length; "y" is the unit of the curve, "x" that of its argument.
    has_length : bool
        Whether the last constant is a length; otherwise all are factors, but for an exponent.
    has_exponent : bool
        Whether the last constant is an exponent.
    """

    text: str
    terms: Callable[[NDArray, float], tuple[NDArray, ...]]
    names: tuple[str, ...]
    units: tuple[str, ...]
    has_length: bool = False
    has_exponent: bool = False


def _forms(law: Law) -> Iterator[Form]:
    """Formulas from short to long."""
    if law.argument.has_two_values:
        of = f"a {law.argument.symbol}"
        yield Form(f"1 + {of}" if law.form.is_factor else of, lambda x, _: (x,), ("a",), ("y",))
        return
    if law.form.in_proportion:
        yield Form("a x", lambda x, _: (x,), ("a",), ("y/x",))
        return
    if not law.form.is_centred:
        yield Form(CONSTANT, lambda x, _: (x**0,), ("a",), ("y",))
    if law.is_spaced_by_ratio:
        yield Form("a x^n", lambda x, n: (x**n,), ("a", "n"), ("y/x^n", "1"), has_exponent=True)
        yield Form("a + b/x", lambda x, _: (x**0, 1 / x), ("a", "b"), ("y", "y x"))
    yield Form("a + b x", lambda x, _: (x**0, x), ("a", "b"), ("y", "y/x"))
    yield Form("a + b x^2", lambda x, _: (x**0, x**2), ("a", "b"), ("y", "y/x^2"))
    yield Form("a x + b x^3", lambda x, _: (x, x**3), ("a", "b"), ("y/x", "y/x^3"))
    abc, yyx = ("a", "b", "c"), ("y", "y", "x")
    yield Form("a + b exp(-x/c)", lambda x, c: (x**0, np.exp(-x / c)), abc, yyx, True)
    yield Form("a + b tanh(x/c)", lambda x, c: (x**0, np.tanh(x / c)), abc, yyx, True)
    yield Form("a + b x + c x^2", lambda x, _: (x**0, x, x**2), abc, ("y", "y/x", "y/x^2"))
    yield Form(
        "a + b cos(2 pi x/p) + c sin(2 pi x/p)",
        lambda x, p: (x**0, np.cos(2 * np.pi * x / p), np.sin(2 * np.pi * x / p)),
        ("a", "b", "c", "p"),
        ("y", "y", "y", "x"),
        True,
    )


def shortest(
    x: NDArray, y: NDArray, band: tuple[NDArray, NDArray], law: Law, half_widths: Callable[[NDArray], NDArray]
) -> tuple[str | None, list[dict[str, float | str]]]:
    """The first formula that lies in the band, and its constants with their intervals; None and none if there is none.

    Parameters
    ----------
    x, y : ndarray, shape (knots,)
        The curve.
    band : (ndarray, ndarray)
        Lower and upper end of its 90 % band.
    law : Law
    half_widths : callable
        Half-widths of the 90 % intervals of linear functions of the curve's values: ``half_widths(functions)``, with
        functions of shape (functions, knots). The errors of the values are correlated, as a band does not show.
    """
    quantile = normal_quantile(0.5 + COVERAGE / 2)
    neutral = 1.0 if law.argument.has_two_values and law.form.is_factor else 0.0
    least = 1e-3 * max(float(np.ptp(y)), 1e-12)
    # A band that ends at what is physically possible is narrower than the uncertainty.
    sd = np.maximum(half_widths(np.eye(x.size)) / quantile, least)
    low, high = np.minimum(band[0], y - quantile * least), np.maximum(band[1], y + quantile * least)
    for form in _forms(law):
        constants, errors, derivatives = _fitted(form, x, y - neutral, sd)
        value = y + errors * sd
        if np.mean((value >= low) & (value <= high)) < settings.IN_BAND:
            continue
        size = np.linalg.norm(derivatives, axis=0)
        reach = half_widths(np.linalg.pinv(derivatives / size) / size[:, None] / sd)
        units = [_unit(unit, law) for unit in form.units]
        return form.text, [
            {"name": name, "value": float(v), "low": float(v - r), "high": float(v + r), "unit": unit}
            for name, v, r, unit in zip(form.names, constants, reach, units, strict=True)
        ]
    return None, []


def _fitted(form: Form, x: NDArray, y: NDArray, sd: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Constants of a formula by least squares, its errors over their standard deviation, and their derivatives."""

    def linear(length: float) -> tuple[NDArray, NDArray]:
        with np.errstate(over="ignore"):
            weighted = np.stack(form.terms(x, length), axis=1) / sd[:, None]
            # A term of another size than the rest would be dropped as if it were dependent on them.
            size = np.linalg.norm(weighted, axis=0)
        if not (np.isfinite(size).all() and size.all()):
            # An exponential of many lengths is zero, or infinite.
            return np.zeros(size.size), np.full(x.size, NO_FIT)
        factors = np.linalg.lstsq(weighted / size, y / sd, rcond=None)[0] / size
        return factors, weighted @ factors - y / sd

    if not form.has_length and not form.has_exponent:
        factors, errors = linear(1.0)
        return factors, errors, np.stack(form.terms(x, 1.0), axis=1) / sd[:, None]
    span = float(np.ptp(x)) or 1.0
    lengths = np.geomspace(2 * span / (len(x) - 1), 2 * span, TRIED).tolist()
    tried = EXPONENTS if form.has_exponent else lengths
    start = min(tried, key=lambda length: float(np.sum(linear(length)[1] ** 2)))
    refined = minimize_scalar(
        lambda length: float(np.sum(linear(length)[1] ** 2)),
        bounds=sorted((0.8 * start, 1.25 * start)),
        method="bounded",
    ).x
    factors, errors = linear(refined)
    if errors[0] == NO_FIT:
        return np.append(factors, refined), errors, np.ones((x.size, factors.size + 1))
    step = 1e-4 * abs(refined)
    higher, lower = (np.stack(form.terms(x, refined + s), axis=1) @ factors for s in (step, -step))
    by_length = (higher - lower) / (2 * step) / sd
    terms = np.stack(form.terms(x, refined), axis=1) / sd[:, None]
    return np.append(factors, refined), errors, np.column_stack([terms, by_length])


def _unit(unit: str, law: Law) -> str:
    of_argument = law.argument.unit.replace(" ", "*")
    if of_argument == "1":
        return "1" if unit in ("x", "1") else law.unit.replace(" ", "*")
    alone = {
        "x": of_argument,
        "y": law.unit,
        "1": "1",
        "y x": of_argument if law.form.is_factor else f"{law.unit}*{of_argument}",
    }
    found = alone.get(unit, unit.replace("y/x", f"{law.unit}/({of_argument})"))
    return found.replace(" ", "*")
