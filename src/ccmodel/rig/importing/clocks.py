"""Samples with clocks of their own on the time base of the drive angle, and what that costs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import comb

import numpy as np
from numpy.typing import NDArray

from ccmodel.rig import limits
from ccmodel.rig.findings import FileError

# Order of the differences that leave only noise of a signal that is smooth over a few samples.
_NOISE_ORDER = 4
# Fewest samples for an estimate of noise and curvature.
_FEWEST_FOR_COST = 20
# Times that are equal but for rounding, as a share of a step.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Clock:
    """Clock of a file against that of the recording's first: t_first = offset_s + (1 + drift) * t.

    Attributes
    ----------
    offset_s, drift : float
        See above.
    offset_uncertainty_s, drift_uncertainty : float or None
        Half-widths of the 95 % intervals of these two, the offset being that at t = 0. None if not known.
    how : str
        Where offset and drift are from.
    """

    offset_s: float = 0.0
    drift: float = 0.0
    offset_uncertainty_s: float | None = 0.0
    drift_uncertainty: float | None = 0.0
    how: str = "clock of the log"

    def on_first(self, time_s: NDArray) -> NDArray:
        """Times of this clock, shape (n,), s, as times of the first file's clock."""
        return self.offset_s + (1.0 + self.drift) * time_s


@dataclass(frozen=True)
class Samples:
    """Samples of one column of the log, before they are joined.

    Attributes
    ----------
    column, signal, file : str
        Column of the log; signal, and name of the file that has it.
    time_s : ndarray, shape (n,)
        On the clock of the recording's first file, s.
    values : ndarray, shape (n,)
        In the column's unit; nan where there is no number.
    whole : bool
        Whether they are whole numbers that must stay so.
    clock : Clock
        That of their file.
    delay_s : float
        Delay of the signal, which `time_s` is corrected for, s.
    """

    column: str
    signal: str
    file: str
    time_s: NDArray
    values: NDArray
    whole: bool
    clock: Clock
    delay_s: float = 0.0


@dataclass(frozen=True)
class Cost:
    """What joining one column to the drive angle's samples cost.

    Attributes
    ----------
    column, signal, file : str
        See `Samples`.
    rate_Hz : float
        Median sampling rate of the signal.
    by : str
        "linear interpolation", of counts "linear interpolation, to whole counts".
    interpolation_error : float or None
        Root mean square error midway between two samples, in the column's unit, where it is largest: the error of
        predicting every second sample from its neighbours, less noise, over 4. None of fewer than 20 samples.
    noise : float or None
        Standard deviation of the signal's noise, in the column's unit; of counts, that of their rounding is part of it.
    offset_s, drift, offset_uncertainty_s, drift_uncertainty, how
        See `Clock`.
    delay_s : float
        See `Samples`.
    unbridged : int
        Samples that are left empty because the signal has a gap there.
    """

    column: str
    signal: str
    file: str
    rate_Hz: float
    by: str
    interpolation_error: float | None
    noise: float | None
    offset_s: float
    drift: float
    offset_uncertainty_s: float | None
    drift_uncertainty: float | None
    how: str
    delay_s: float
    unbridged: int


@dataclass(frozen=True)
class Joined:
    """Columns on one time base.

    Attributes
    ----------
    time_s : ndarray, shape (n,)
        From the first sample that all columns cover, s.
    columns : dict of str to ndarray, each of shape (n,)
        In the units of their names.
    costs : list of Cost
        Of the columns that did not have these times themselves.
    cut_s : tuple of two floats
        Time at the start and at the end that not all columns cover, s.
    remarks : list of str
        What was cut, dropped or left empty, a sentence each.
    """

    time_s: NDArray
    columns: dict[str, NDArray]
    costs: list[Cost]
    cut_s: tuple[float, float]
    remarks: list[str]


def join(samples: Sequence[Samples]) -> Joined:
    """Put columns on the time base of the first of them.

    Parameters
    ----------
    samples : sequence of Samples
        The drive angle first.

    Returns
    -------
    Joined
        The span that all columns cover: nothing is extrapolated.

    Raises
    ------
    FileError
        If times do not increase, a column has hardly any numbers, or the columns have no time in common.
    """
    own = [_own_samples(one) for one in samples]
    for one in own:
        _check_has_numbers(one)
    base, others = own[0], own[1:]
    remarks = [_sparse_text(one, kept) for one, kept in zip(samples, own, strict=True) if kept is not one]
    joined = [one for one in others if not _has_times_of(one, base)]
    for one in (base, *joined) if joined else ():
        _check_increases(one)
    span = _common_span(base, joined)
    time = base.time_s[span]
    columns = {one.column: one.values[span] for one in own if _has_times_of(one, base)}
    columns |= {one.column: _at(one, time) for one in joined}
    costs = [_cost(one, int(np.isnan(columns[one.column]).sum())) for one in joined]
    remarks += [_gap_text(cost) for cost in costs if cost.unbridged]
    if not joined:
        return Joined(_from_zero(time), columns, [], (0.0, 0.0), remarks)
    cut = (float(time[0] - base.time_s[0]), float(base.time_s[-1] - time[-1]))
    remarks += _cut_text(base, joined, cut)
    return Joined(_from_zero(time), columns, costs, cut, remarks)


def _check_has_numbers(one: Samples) -> None:
    count = int(np.isfinite(one.values).sum())
    if count < limits.FEWEST_SAMPLES:
        text = f"'{one.signal}' has {count} numbers only: take {one.column} out of the map, or record it again"
        raise FileError(one.file, None, None, text)


def _from_zero(time: NDArray) -> NDArray:
    return np.round(time - time[0], 9)


def _own_samples(one: Samples) -> Samples:
    """Samples at the rows that have a number, if only every few rows have one: it was sampled slower than others."""
    rows = np.flatnonzero(np.isfinite(one.values))
    if rows.size < 2 or np.median(np.diff(rows)) == 1:
        return one
    return replace(one, time_s=one.time_s[rows], values=one.values[rows])


def _has_times_of(one: Samples, base: Samples) -> bool:
    return np.array_equal(one.time_s, base.time_s)


def _check_increases(one: Samples) -> None:
    steps = np.diff(one.time_s)
    if not (steps > 0).all():
        at = int(np.argmin(steps > 0))
        before, now = one.time_s[at], one.time_s[at + 1]
        text = f"the times of '{one.signal}' must increase, found {now:.9g} s after {before:.9g} s (sample {at + 2})"
        raise FileError(one.file, None, None, f"{text}: they cannot be joined to those of other signals")


def _common_span(base: Samples, others: Sequence[Samples]) -> NDArray:
    """Which samples of the base all others cover."""
    if not others:
        return np.full(base.time_s.size, True)
    slack = _ROUNDING * np.median(np.diff(base.time_s))
    low = max(one.time_s[0] for one in others)
    high = min(one.time_s[-1] for one in others)
    inside = (base.time_s >= low - slack) & (base.time_s <= high + slack)
    if inside.sum() < limits.FEWEST_SAMPLES:
        spans = ", ".join(f"{o.column} {o.time_s[0]:.6g} to {o.time_s[-1]:.6g} s" for o in (base, *others))
        text = f"the columns have no time in common ({spans}): check units of time and 'clock'"
        raise FileError(base.file, None, None, text)
    return inside


def _at(one: Samples, time: NDArray) -> NDArray:
    """Values at other times within the span; nan in gaps that are too long to be bridged."""
    has = np.isfinite(one.values)
    own, values = one.time_s[has], one.values[has]
    step = float(np.median(np.diff(own)))
    following = np.clip(np.searchsorted(own, time + _ROUNDING * step, side="right"), 1, own.size - 1)
    too_long = own[following] - own[following - 1] > max(limits.GAP_S, limits.GAP_STEPS * step)
    on_sample = np.abs(own[following - 1] - time) <= _ROUNDING * step
    # The previous count instead would be late by half a step of its encoder on average.
    result = np.interp(time, own, values)
    if one.whole:
        result = np.round(result)
    outside = (time < own[0] - _ROUNDING * step) | (time > own[-1] + _ROUNDING * step)
    return np.where((too_long & ~on_sample) | outside, np.nan, result)


def _cost(one: Samples, unbridged: int) -> Cost:
    has = np.isfinite(one.values)
    error, noise = interpolation_cost(one.values[has])
    return Cost(
        column=one.column,
        signal=one.signal,
        file=one.file,
        rate_Hz=float(1.0 / np.median(np.diff(one.time_s[has]))),
        by=f"linear interpolation{', to whole counts' if one.whole else ''}",
        interpolation_error=error,
        noise=noise,
        offset_s=one.clock.offset_s,
        drift=one.clock.drift,
        offset_uncertainty_s=one.clock.offset_uncertainty_s,
        drift_uncertainty=one.clock.drift_uncertainty,
        how=one.clock.how,
        delay_s=one.delay_s,
        unbridged=unbridged,
    )


def interpolation_cost(values: NDArray) -> tuple[float | None, float | None]:
    """Interpolation error and noise of a signal, from its own samples (`Cost`).

    A curve that bends by x'' has the error x'' h² / 2 where a sample is predicted from its neighbours at a distance h,
    and x'' h² / 8 midway between two samples. Noise adds 3/2 of its variance to the square of the first.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Samples at even steps.

    Returns
    -------
    error, noise : float or None
        In the unit of `values`.
    """
    if values.size < _FEWEST_FOR_COST:
        return None, None
    noise_power = np.mean(np.diff(values, _NOISE_ORDER) ** 2) / comb(2 * _NOISE_ORDER, _NOISE_ORDER)
    predicted = np.mean((values[1:-1] - (values[:-2] + values[2:]) / 2) ** 2)
    return float(np.sqrt(max(predicted - 1.5 * noise_power, 0.0)) / 4), float(np.sqrt(noise_power))


def _sparse_text(one: Samples, own: Samples) -> str:
    share = one.values.size / own.values.size
    return f"'{one.signal}' has a number in one of {share:.3g} rows: it is taken to be sampled at these only"


def _gap_text(cost: Cost) -> str:
    return f"'{cost.signal}' has gaps: {cost.unbridged} cells of {cost.column} are left empty"


def _cut_text(base: Samples, others: Sequence[Samples], cut: tuple[float, float]) -> list[str]:
    latest = max(others, key=lambda one: one.time_s[0])
    earliest = min(others, key=lambda one: one.time_s[-1])
    texts = []
    if cut[0] > 0:
        texts.append(f"{cut[0]:.4g} s cut at the start, before the first sample of '{latest.signal}'")
    if cut[1] > 0:
        texts.append(f"{cut[1]:.4g} s cut at the end, after the last sample of '{earliest.signal}'")
    kept = 1 - sum(cut) / (base.time_s[-1] - base.time_s[0])
    if kept < 0.5:
        texts.append(f"only {kept:.0%} of the drive angle's time is left: check units of time and 'clock'")
    return texts
