"""Units of signals: what people write is read, compared and converted (pint).

Angles and counts are dimensions of their own (`units.txt`), so that neither is taken for the other.
"""

import re
from functools import cache
from math import isfinite
from pathlib import Path

import pint

DEFINITIONS = Path(__file__).with_name("units.txt")
# Spellings of operators and signs; the keys are patterns.
_SPELT = {
    r"[·⋅∙•×]": "*",
    r"(?<=[A-Za-z])[.-](?=[A-Za-z])": "*",  # N.m, ozf-in
    "[μµ]": "µ",
    "²": "**2",
    "³": "**3",
    r"\^": "**",
    "[°º]": " degree ",  # some keyboards give the ordinal for the degree sign
    "%": " percent ",
}
LONGEST_UNIT = 60
# A power of a unit: a small number that has no further power.
_POWER = re.compile(r"(?<!\))\*\*\s*[-+]?\d(\.\d)?(?![\d.])(?!\s*\*\*)")
_AMBIGUOUS = {"grad": "'deg' for degrees or 'gon'", "nm": "'Nm' for newton metres", "NM": "'Nm' for newton metres"}
# What a dimension is called, by a unit that has it.
_CALLED = {
    "s": "a time",
    "m": "a length",
    "g": "a mass",
    "A": "a current",
    "V": "a voltage",
    "N": "a force",
    "Nm": "a torque",
    "rad": "an angle",
    "count": "counts",
    "rad/s": "an angular speed",
    "count/s": "a speed in counts",
    "m/s": "a speed",
    "Hz": "a frequency",
    "percent": "a bare number",
}


class UnitError(ValueError):
    """A unit cannot be read or has the wrong dimension; the text says what to write."""


@cache
def _registry() -> pint.UnitRegistry:
    return pint.UnitRegistry(str(DEFINITIONS), on_redefinition="raise")


def is_unit(text: str) -> bool:
    """Whether a text can be read as a unit; "" cannot."""
    try:
        return states_unit(text) and bool(_unit(text))
    except UnitError:
        return False


def states_unit(text: str) -> bool:
    """Whether a text states a unit at all; a bare number has "", "-" or "1"."""
    return _stripped(text) not in ("", "-", "1")


def quantity_of(text: str) -> str:
    """What a unit measures, in words such as "an angle"; "" for a text that is no unit or has another dimension."""
    if not is_unit(text):
        return ""
    return next((called for unit, called in _CALLED.items() if _same_dimension(text, unit)), "")


def factor(found: str, needed: str) -> float:
    """Number of units `needed` in one unit `found`.

    Raises
    ------
    UnitError
        If one cannot be read or their dimensions differ.
    """
    if not _same_dimension(found, needed):
        raise UnitError(f"found '{found}', {_described(found)}; needed is {_described(needed)} such as '{needed}'")
    return float(_registry().Quantity(1.0, _unit(found)).to(_unit(needed)).magnitude)


def gain_factor(gain: str, found: str, needed: str) -> float:
    """Number of units `needed` for one unit `found`, by a gain with its unit such as "0.0234 N*m/A".

    Raises
    ------
    UnitError
        If the gain cannot be read, or does not lead from one dimension to the other.
    """
    match = re.fullmatch(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*)", gain)
    if match is None:
        raise UnitError(f"found {gain!r}; needed is a number and its unit, as '0.0234 N*m/A'")
    number, unit = float(match[1]), _unit(match[2])
    if not isfinite(number) or number == 0:
        raise UnitError(f"found {gain!r}; a gain is a number other than 0")
    result = _registry().Quantity(number, unit) * _registry().Quantity(1.0, _unit(found))
    try:
        return float(result.to(_unit(needed)).magnitude)
    except pint.DimensionalityError:
        text = f"'{gain}' times '{found}' gives no {needed}; the gain's unit must be that of {needed} per {found}"
        raise UnitError(text) from None


def _unit(text: str) -> pint.Unit:
    """A unit as people write it, brackets or not."""
    stripped = _stripped(text)
    if stripped in _AMBIGUOUS:
        raise UnitError(f"unit '{stripped}' has two readings: write {_AMBIGUOUS[stripped]}")
    spelt = stripped
    for pattern, meant in _SPELT.items():
        spelt = re.sub(pattern, meant, spelt)
    try:
        # The parser computes powers: those of a number to a power to a power have no end.
        if len(spelt) > LONGEST_UNIT or "**" in _POWER.sub("", spelt):
            raise ValueError
        return _registry().parse_units(spelt.strip())
    # A text that is no unit makes the parser of expressions raise errors of many kinds.
    except Exception:
        text = f"unit '{stripped[:LONGEST_UNIT]}' is not known: write it as 'N*m', 'mN', 'deg', 'count', 'ms'"
        raise UnitError(text) from None


def _stripped(text: str) -> str:
    return text.strip().strip("[](){}").strip()


def _same_dimension(one: str, other: str) -> bool:
    return _unit(one).dimensionality == _unit(other).dimensionality


def _described(unit: str) -> str:
    return quantity_of(unit) or f"of dimension {_unit(unit).dimensionality}"
