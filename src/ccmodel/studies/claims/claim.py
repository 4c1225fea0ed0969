"""A statement of the paper with its numbers: the rows, the verdict and the sentence."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

MODEL_ALONE = "model study (simulated)"


class Verdict(StrEnum):
    """Whether a claim is borne out."""

    YES = "yes"
    PART = "in part"
    NO = "no"
    OPEN = "not determined"


@dataclass(frozen=True)
class Row:
    """One number of a claim: a quantity in a condition.

    Attributes
    ----------
    quantity, unit, condition : str
        Name in `QUANTITIES` (or the claim's own), its unit, and the label of the condition.
    at : float
        Value of the study's variable, in SI units.
    source : str
        Origin of `value`: that of the recordings, or the model.
    recordings : int
        Number of recordings behind `value`.
    value, low, high : float or None
        Mean over the recordings and its interval.
    model : float or None
        Mean over the simulations of the same recordings.
    gap : str
        Reason for a missing number.
    """

    quantity: str
    unit: str
    condition: str
    at: float
    source: str
    recordings: int = 0
    value: float | None = None
    low: float | None = None
    high: float | None = None
    model: float | None = None
    gap: str = ""


@dataclass(frozen=True)
class Claim:
    """A statement of the paper with its numbers.

    Attributes
    ----------
    name, section, says : str
        Our name for it, the paper's section, and the statement in our words.
    borne_out : Verdict
        By the recordings, or for a claim on the model alone by the model.
    sentence : str
        The numbers in a sentence.
    rows : list of Row
    by_model : Verdict or None
        For a claim on recordings: whether the model of the same recordings bears it out. Where only the model does, the
        difference is due to physics that the model leaves out, or to the scatter of the repeats.
    """

    name: str
    section: str
    says: str
    borne_out: Verdict
    sentence: str
    rows: list[Row] = field(default_factory=list)
    by_model: Verdict | None = None


def spread_percent(values: Sequence[float]) -> float | None:
    """Largest less smallest of some values, % of their mean; None for fewer than two."""
    return float(100 * np.ptp(values) / abs(np.mean(values))) if len(values) > 1 else None


def percent(value: float | None) -> str:
    """A percentage in a sentence."""
    return "–" if value is None else "less than 0.01" if value < 0.01 else f"{value:.2g}"


def three_digits(value: float | None) -> str:
    """A number with three significant digits, including trailing zeros."""
    if value is None:
        return "–"
    before = int(np.floor(np.log10(abs(value)))) if abs(value) >= 1e-3 else 0
    return f"{value:.{max(0, 2 - before)}f}"
