"""Clocks of the two ends that drift apart."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import THETA_IN, THETA_OUT
from ccmodel.distributions import student_quantile
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.contradiction import LIKELY, SURE, Contradiction
from ccmodel.rig.consistency.parity import Parity, crossings


def drift_of(parity: Parity) -> tuple[float, float] | None:
    """Rate, s/s, at which the load's lag changes over equal cycles, and the change, s; None without such cycles."""
    x = parity.moving
    if THETA_OUT not in x:
        return None
    marks = [crossings(x[name]) for name in (THETA_IN, THETA_OUT)]
    if min(m.size for m in marks) < limits.FEWEST_CROSSINGS or abs(marks[0].size - marks[1].size) > 1:
        return None
    count = min(m.size for m in marks)
    drive, load = (
        _times(x["time_s"], x[name], m[:count]) for name, m in zip((THETA_IN, THETA_OUT), marks, strict=True)
    )
    if not _equal(np.diff(drive)) or not _equal(_strokes(x[THETA_IN], marks[0])):
        return None
    return trend(load - drive, drive)


def trend(lag_s: NDArray, time_s: NDArray) -> tuple[float, float]:
    """Rate, s/s, and change over the recording, s, of lags at successive crossings; zeros if they may only scatter.

    Both arguments have shape (crossings,), four of them at least.
    """
    # The load's lag differs between the two directions; both change alike.
    direction = np.where(np.arange(lag_s.size) % 2, 0.5, -0.5)
    basis = np.column_stack([np.ones(lag_s.size), direction, time_s - time_s.mean()])
    values, *_ = np.linalg.lstsq(basis, lag_s, rcond=None)
    rate, residual, freedom = float(values[2]), lag_s - basis @ values, lag_s.size - basis.shape[1]
    variance = float(residual @ residual) / freedom * float(np.linalg.inv(basis.T @ basis)[2, 2])
    # The first lags of a load that rings after the start differ from the others.
    is_chance = rate**2 <= float(student_quantile(1 - limits.DRIFT_BY_CHANCE / 2, freedom)) ** 2 * variance
    return (0.0, 0.0) if is_chance else (rate, rate * float(np.ptp(time_s)))


def _times(time_s: NDArray, values: NDArray, marks: NDArray) -> NDArray:
    """Times of the crossings, s, between samples: the line through the samples near each."""
    middle = (values.max() + values.min()) / 2
    found = []
    for mark in marks:
        near = slice(max(mark - 10, 0), mark + 11)
        slope, level = np.polyfit(time_s[near] - time_s[mark], values[near] - middle, 1)
        found.append(time_s[mark] - (level / slope if slope else 0.0))
    return np.array(found)


def _equal(values: NDArray) -> bool:
    return bool(np.ptp(values) <= limits.EQUAL_CYCLES * np.abs(values).mean())


def _strokes(values: NDArray, marks: NDArray) -> NDArray:
    """Greatest distance from the middle between crossings."""
    middle = (values.max() + values.min()) / 2
    return np.array([np.abs(values[a : b + 1] - middle).max() for a, b in pairwise(marks)])


def drifting_clocks(parities: Sequence[Parity]) -> list[Contradiction]:
    """Clocks that drift apart, in a recording of equal cycles or more."""
    rates = {p.recording.id: d for p in parities if (d := drift_of(p))}
    drifting = {id_: d for id_, d in rates.items() if _drifts(*d)}
    if not drifting:
        return []
    rate = float(np.median([r for r, _ in drifting.values()]))
    change = max((c for _, c in drifting.values()), key=abs)
    text = (
        f"the clocks of drive and load drift apart by {1e3 * abs(rate):.2g} ms a second: the load's lag changes by up"
        f" to {1e3 * abs(change):.0f} ms over equal cycles of {', '.join(drifting)}; correct the time of one side"
    )
    single = next(iter(drifting)) if len(drifting) == 1 and len(parities) > 1 else None
    return [Contradiction("clocks of drive and load", text, single, SURE if len(drifting) > 1 else LIKELY)]


def _drifts(rate: float, change: float) -> bool:
    return abs(rate) > limits.DRIFT_RATE and abs(change) > limits.DRIFT_S
