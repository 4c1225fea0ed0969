"""A learned law as plain data: its curve with a band, and the shortest formula that stays in the band."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm as normal

from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.formula import shortest
from ccmodel.diagnosis.hypothesis import law_of
from ccmodel.diagnosis.laws import unknowns_of, values_of
from ccmodel.diagnosis.listed_laws import learned_of, nearest_listed
from ccmodel.diagnosis.verdict import Judgement
from ccmodel.inference.intervals import COVERAGE
from ccmodel.mechanisms.learned import Law


def laws_of(judgement: Judgement) -> list[dict]:
    """The law of a judgement as the diagnosis format states it; a list of one, or of none with another verdict."""
    best = judgement.best
    law = law_of(best.hypothesis)
    if judgement.verdict != "learned" or law is None:
        return []
    x, y, band = curve_of(best, law)
    formula, parameters = shortest(x, y, band, law)
    unit = law.argument.unit
    others = indistinguishable(judgement, law)
    return [
        {
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
    ]


def curve_of(candidate: CandidateFit, law: Law) -> tuple[NDArray, NDArray, tuple[NDArray, NDArray]]:
    """A fitted law's arguments at its knots, its values there, and the ends of their 90 % band; shapes (knots,)."""
    values, some = values_of(candidate, law), unknowns_of(candidate, law)
    x, y = law.at_knots(values)
    shown = law.shown(x)
    y, by_coefficients = shown @ y, values["scale"] * (shown @ law.basis)
    covariance = by_coefficients @ candidate.covariance[np.ix_(some, some)] @ by_coefficients.T
    reach = normal.ppf(0.5 + COVERAGE / 2) * np.sqrt(np.diag(covariance).clip(0.0))
    neutral = 1.0 if law.is_factor else 0.0
    low, high = (law.possible(y + neutral + sign * reach) for sign in (-1, 1))
    return x, law.possible(y + neutral), (low, high)


def indistinguishable(judgement: Judgement, law: Law) -> list[str]:
    """Other arguments of the same slot that the recordings do not exclude, the most probable first."""
    by_argument: dict[str, float] = {}
    for hypothesis, p in judgement.confidence.items():
        other = law_of(hypothesis)
        if other is not None and other.is_of_slot(law) and other.argument.name != law.argument.name:
            by_argument[other.argument.name] = by_argument.get(other.argument.name, 0.0) + p
    return sorted((a for a, p in by_argument.items() if p > settings.RIVAL), key=lambda a: -by_argument[a])
