"""A late side: its channels read at t what they would have read at t - delay, or through a filter of first order."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from virtualrig.effects.contract import Seeded, Side, Twin, group_of
from virtualrig.strict import NonNegative


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    late = Side(*(np.interp(time_s - faults.delay_s, time_s, values) for values in reading))
    if not faults.filter_s:
        return late
    # Exact for readings that are linear between samples, so that a ramp is late by the time constant.
    step_s = time_s[1] - time_s[0]
    keep = np.exp(-step_s / faults.filter_s)
    lost = (1 - keep) * faults.filter_s / step_s
    return Side(*(values[0] + lfilter([1 - lost, lost - keep], [1, -keep], values - values[0]) for values in late))


def _filtered(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    # To first order in the frequency a filter delays by its time constant.
    return {group_of(place): {"filter_s": size}}, {"delay": size}


TWIN = Twin(
    name="time-skew",
    fields={"sensors": {"delay_s": (float, 0.0), "filter_s": (NonNegative, 0.0)}},
    places=("drive-sensor", "load-sensor"),
    size=(1e-3, 5e-2),  # a late side only: an early one is the other side's delay
    unit="s",
    seed=lambda size, also, place, spring: ({group_of(place): {"delay_s": size}}, {"delay": size}),
    other_laws={"filter": _filtered},
    read=_read,
)
