"""A late clock: all channels of one side read at t what they would have read at t - delay."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualrig.effects.contract import Side, Twin, group_of


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    return Side(*(np.interp(time_s - faults.delay_s, time_s, values) for values in reading))


TWIN = Twin(
    name="time-skew",
    fields={"sensors": {"delay_s": (float, 0.0)}},
    places=("drive-sensor", "load-sensor"),
    size=(1e-3, 5e-2),  # a late side only: an early one is the other side's delay
    unit="s",
    seed=lambda size, also, place, spring: ({group_of(place): {"delay_s": size}}, {"delay": size}),
    read=_read,
)
