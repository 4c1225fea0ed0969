"""A late side: its channels read at t what they would have read at t - delay, or through a low-pass filter.

The filter is of first order, or of second order with a maximally flat gain (Butterworth, Wireless Engineer 7, 536-541,
1930). Both delay slow motions by their `filter_s`.
"""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from virtualrig.effects.contract import Seeded, Side, Twin, group_of
from virtualrig.strict import NonNegative


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    late = Side(*(np.interp(time_s - faults.delay_s, time_s, values) for values in reading))
    if not faults.filter_s:
        return late
    delay = faults.filter_s
    powers = [delay, 1.0] if faults.filter_order == 1 else [delay**2 / 2, delay, 1.0]
    # Exact for readings that are linear between samples.
    (above,), below, _ = cont2discrete(([1.0], powers), time_s[1] - time_s[0], "foh")
    return Side(*(values[0] + lfilter(above, below, values - values[0]) for values in late))


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    # A filter makes a share of the delay in half of the rigs, and in the others none.
    share = also["filtered"] if also["filtered"] < 1 else 0.0
    settings = {"delay_s": (1 - share) * size, "filter_s": share * size}
    return {group_of(place): settings}, {"delay": size, "filtered": share}


def _butterworth(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {group_of(place): {"filter_s": size, "filter_order": 2}}, {"delay": size}


TWIN = Twin(
    name="time-skew",
    fields={
        "sensors": {"delay_s": (float, 0.0), "filter_s": (NonNegative, 0.0), "filter_order": (Literal[1, 2], 1)},
    },
    places=("drive-sensor", "load-sensor"),
    size=(1e-3, 5e-2),  # a late side only: an early one is the other side's delay
    unit="s",
    also={"filtered": (0.1, 10.0)},
    seed=_seed,
    other_laws={"butterworth": _butterworth},
    read=_read,
)
