"""Dates and times of day, in text or as absolute times, in seconds."""

import re
from collections.abc import Iterable
from datetime import UTC, datetime

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.rig.findings import LogError

_DATE = r"\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{4}"
_CLOCK = r"\d{1,2}:\d{2}(:\d{2}([.,:]\d+)?)?( ?[AaPp][Mm])?"
_ZONE = r" ?(Z|UTC|[+-]\d{2}:?\d{2})"
_STAMP = re.compile(rf"(?P<date>{_DATE})?(?(date)([T ]+(?P<clock>{_CLOCK})({_ZONE})?)?|(?P<only>{_CLOCK}))")
_DAY_S = 86400.0


def is_stamp(cell: str) -> bool:
    """Whether a cell holds a date, a time of day or both."""
    return (":" in cell[:30] and _STAMP.fullmatch(cell) is not None) or (
        cell[:1].isdigit() and not cell.isdigit() and re.fullmatch(_DATE, cell) is not None
    )


def seconds_of_stamps(columns: list[pd.Series]) -> tuple[NDArray, datetime | None, int, list[str]]:
    """Seconds from the first time stamp.

    Parameters
    ----------
    columns : list of Series of str
        A column of stamps; or the date and the time of day in two columns.

    Returns
    -------
    seconds : ndarray, shape (n,)
        From the first stamp, in s; nan where a cell is empty.
    started : datetime or None
        The first stamp (UTC); None if there is no date.
    used : int
        Columns used.
    remarks : list of str
        What was assumed.
    """
    texts = [c.astype("string").str.strip() for c in columns]
    dates = [":" not in (t.dropna().iloc[0] if t.notna().any() else "") for t in texts]
    clocks = [re.fullmatch(_CLOCK, t.dropna().iloc[0]) is not None if t.notna().any() else False for t in texts]
    if len(texts) == 2 and (dates[0], clocks[1]) == (True, True):
        text, used = texts[0] + " " + texts[1], 2
    elif len(texts) == 2 and (clocks[0], dates[1]) == (True, True):
        text, used = texts[1] + " " + texts[0], 2
    else:
        text, used = texts[0], 1
    # Decimal commas and "12:00:00:001" as decimal points.
    text = text.str.replace(r"(:\d{2}:\d{2})[,:](\d+)", r"\1.\2", regex=True)
    if used == 1 and clocks[0]:
        return _seconds_of_day(text), None, 1, []
    try:
        times, assumed = _times(text)
    except (ValueError, OverflowError):
        bad = text.dropna().iloc[0]
        raise LogError(
            None, None, f"times such as '{bad}' cannot be read: write seconds, or dates as 2024-05-31 12:00:00.001"
        ) from None
    first = times.dropna().iloc[0]
    seconds = (times - first).dt.total_seconds().to_numpy(float, na_value=np.nan)
    return seconds, first.to_pydatetime(warn=False).astimezone(UTC), used, assumed


def _times(text: pd.Series) -> tuple[pd.Series, list[str]]:
    first = text.dropna().iloc[0]
    if re.match(r"\d{4}", first):
        times = pd.to_datetime(
            text.str.replace(r"[/.](?=\d{1,2}[/.])|(?<=[-/.]\d)[/.](?=\d)|(?<=[-/.]\d\d)[/.](?=\d)", "-", regex=True),
            format="ISO8601",
            utc=True,
        )
        return times, [] if _has_zone(first) else ["time stamps have no zone: taken as UTC"]
    day_first = "." in first[:3] or _day_first(text)
    times = pd.to_datetime(text, format="mixed", dayfirst=day_first, utc=True)
    order = "day before month" if day_first else "month before day"
    return times, [f"dates such as '{first}' are read with the {order}, time zone UTC"]


def _day_first(text: pd.Series) -> bool:
    return bool((text.str.extract(r"^(\d{1,2})", expand=False).dropna().astype(int) > 12).any())


def _has_zone(text: str) -> bool:
    return re.search(_ZONE + "$", text) is not None


def _seconds_of_day(text: pd.Series) -> NDArray:
    """Seconds from the first time of day, over midnight too."""
    clock = text.where(text.str.count(":") != 1, text + ":00")
    if clock.str.contains("[AaPp][Mm]", na=False).any():
        clock = pd.to_datetime(clock, format="mixed").dt.strftime("%H:%M:%S.%f")
    seconds = np.array(pd.to_timedelta(clock).dt.total_seconds(), float)
    known = np.isfinite(seconds)
    days = np.cumsum(np.diff(seconds[known], prepend=seconds[known][:1]) < -_DAY_S / 2)
    seconds[known] += _DAY_S * days
    return seconds - seconds[known][0]


def earliest(times: Iterable[NDArray]) -> np.datetime64:
    """The earliest of several arrays of absolute times; NaT if there is none."""
    known = [array[~np.isnat(array)] for array in times]
    return min((array.min() for array in known if array.size), default=np.datetime64("NaT"))


def seconds_since(zero: np.datetime64, times: NDArray) -> NDArray:
    """Absolute times (datetime64) in s from another; nan where there is no time."""
    return (times - zero) / np.timedelta64(1, "s")


def moment(time: np.datetime64) -> datetime | None:
    """An absolute time (UTC); None for NaT."""
    if np.isnat(time):
        return None
    return datetime.fromtimestamp(float(time.astype("datetime64[us]").astype(np.int64)) / 1e6, UTC)
