"""Numbers as the page prints them."""

import numpy as np

from ccmodel.channels import symbol_of


def two_decimals(value: float) -> str:
    """A number with two decimals; a dash for NaN."""
    return "–" if np.isnan(value) else f"{value:.2f}"


def number(value: float | None) -> str:
    """A number with three digits; a dash for None."""
    return "–" if value is None else f"{value:.3g}"


def interval(of: dict) -> str:
    """Ends of an interval, rounded to a tenth of its standard deviation."""
    if None in of.values():
        return "not determined"
    return f"{_rounded(of['low'], of['sd'])} to {_rounded(of['high'], of['sd'])}"


def about(of: dict) -> str:
    """Middle of an interval and half its width, rounded to a tenth of its standard deviation."""
    if None in of.values():
        return "not determined"
    reach = (of["high"] - of["low"]) / 2
    return f"{_rounded((of['high'] + of['low']) / 2, of['sd'])} ± {_rounded(reach, of['sd'])}"


def _rounded(value: float, sd: float) -> str:
    """A value to a tenth of its standard deviation."""
    return f"{value:.{max(1 - int(np.floor(np.log10(sd))), 0)}f}" if sd > 0 else f"{value:.5g}"


FILTERS = {shown.__name__: shown for shown in (interval, about, number, two_decimals, symbol_of)}
