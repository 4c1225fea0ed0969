"""A learned law as plain data: its curve with a band, and the shortest formula that stays in the band."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.formula import shortest
from ccmodel.diagnosis.hypothesis import laws_in
from ccmodel.diagnosis.laws import unknowns_of, values_of
from ccmodel.diagnosis.linear_functions import half_widths_of
from ccmodel.diagnosis.listed_laws import learned_of, nearest_listed
from ccmodel.diagnosis.verdict import Judgement
from ccmodel.distributions import normal_quantile
from ccmodel.inference.intervals import COVERAGE
from ccmodel.mechanisms.learned import Law

# Step of derivatives by a coefficient, in its standard deviation a priori.
STEP = 1e-6


def laws_of(judgement: Judgement) -> list[dict]:
    """The laws of a judgement as the diagnosis format states them, the highest confidence first.

    There are none with another verdict than ``learned``.
    """
    every = laws_in(judgement.best.hypothesis) if judgement.verdict == "learned" else ()
    return [_stated(judgement, law) for law in sorted(every, key=lambda law: -judgement.confidence_in_slot(law))]


def _stated(judgement: Judgement, law: Law) -> dict:
    best = judgement.best
    functions = _LinearFunctions.of(best, law)
    x, y, band = functions.curve
    formula, parameters = shortest(x, y, band, law, functions.half_widths)
    unit = law.argument.unit
    others = indistinguishable(judgement, law)
    return {
        "place": law.place,
        "slot": law.slot,
        "arguments": [law.argument.name],
        "name": law.name,
        "channel": law.channel,
        "argument_unit": unit,
        "argument_is": law.argument.meaning,
        "confidence": round(min(settings.MOST_CONFIDENT, judgement.confidence_in_slot(law)), 4),
        "curve": [[float(v) for v in row] for row in zip(x, y, *band, strict=True)],
        "curve_is": law.curve_is,
        "formula": formula,
        "parameters": parameters,
        "indistinguishable": others,
        "nearest_listed": nearest_listed(learned_of(best, law)),
    }


def curve_of(candidate: CandidateFit, law: Law) -> tuple[NDArray, NDArray, tuple[NDArray, NDArray]]:
    """A fitted law's arguments at its knots, its values there, and the ends of their 90 % band; shapes (knots,)."""
    return _LinearFunctions.of(candidate, law).curve


@dataclass(frozen=True)
class _LinearFunctions:
    """Intervals of linear functions of a curve's values at the knots.

    Attributes
    ----------
    candidate : CandidateFit
    law : Law
    x, y : ndarray, shape (knots,)
        Its arguments and the values, without what is neutral.
    by_unknowns : ndarray, shape (knots, unknowns)
        Derivatives of the values.
    by_pieces : ndarray, shape (knots,)
        Half-widths of what straight pieces miss of a smooth law.
    """

    candidate: CandidateFit
    law: Law
    x: NDArray
    y: NDArray
    by_unknowns: NDArray
    by_pieces: NDArray

    @classmethod
    def of(cls, candidate: CandidateFit, law: Law) -> "_LinearFunctions":
        values = values_of(candidate, law)
        x, at_knots = law.at_knots(values)
        shown = law.shown(x)
        y = shown @ law.form.acting(at_knots)
        by_unknowns = np.zeros((len(x), len(candidate.values)))
        by_unknowns[:, unknowns_of(candidate, law)] = shown @ _derivatives_of(law, values)
        quantile = normal_quantile(0.5 + COVERAGE / 2)
        return cls(candidate, law, x, y, by_unknowns, quantile * of_straight_pieces(x, y))

    @property
    def curve(self) -> tuple[NDArray, NDArray, tuple[NDArray, NDArray]]:
        """What `curve_of` returns."""
        reach = self.half_widths(np.eye(self.x.size))
        middle, possible = self.y + self.law.form.neutral, self.law.form.possible_curve
        low, high = (possible(middle + sign * reach) for sign in (-1, 1))
        return self.x, possible(middle), (low, high)

    def half_widths(self, functions: NDArray) -> NDArray:
        """Half-widths of the 90 % intervals of functions of the values, shape (functions, knots)."""
        of_pieces = np.sqrt(functions**2 @ self.by_pieces**2)
        return np.hypot(half_widths_of(self.candidate, functions @ self.by_unknowns), of_pieces)


def _derivatives_of(law: Law, values: Mapping[str, float]) -> NDArray:
    """Derivatives of a law's values at its knots by its coefficients, shape (knots, coefficients).

    An element that would have a negative value has none, and counts as known: no coefficient changes it.
    """

    def value(coefficient: str, step: float) -> NDArray:
        return law.form.acting(law.at_knots({**values, coefficient: values[coefficient] + step})[1])

    sides = [(value(z, STEP), value(z, -STEP)) for z in law.coefficients]
    return np.column_stack([(above - below) / (2 * STEP) for above, below in sides])


def of_straight_pieces(x: NDArray, y: NDArray) -> NDArray:
    """Size of the error at its knots of a piecewise linear curve that is fitted to a smooth one, shape (knots,).

    The best fit to a parabola f is off by h^2 f''/12 at the knots, a sixth of a knot's distance from the chord of its
    neighbours. An end has the error of its neighbour.
    """
    if x.size < 3:
        return np.zeros(x.size)
    share = (x[1:-1] - x[:-2]) / (x[2:] - x[:-2])
    chord = (1 - share) * y[:-2] + share * y[2:]
    return np.pad(np.abs(y[1:-1] - chord) / 6, 1, mode="edge")


def indistinguishable(judgement: Judgement, law: Law) -> list[str]:
    """Other arguments of the same slot that the recordings do not exclude, the most probable first.

    A law of the same argument in another form, such as a drag in place of a factor of friction, predicts otherwise
    too, and is named by both.
    """
    acting = [one for one in laws_in(judgement.best.hypothesis) if one.is_of_slot(law)]
    arguments, forms = {one.argument.name for one in acting}, {(one.argument.name, one.form.name) for one in acting}
    probability: dict[str, float] = {}
    for hypothesis, p in judgement.confidence.items():
        for other in laws_in(hypothesis):
            argument, form = other.argument.name, other.form.name
            if other.is_of_slot(law) and (argument, form) not in forms:
                name = f"{argument} as a {form or 'factor'}" if argument in arguments else argument
                probability[name] = probability.get(name, 0.0) + p
    return sorted((a for a, p in probability.items() if p > settings.ALTERNATIVE), key=lambda a: -probability[a])
