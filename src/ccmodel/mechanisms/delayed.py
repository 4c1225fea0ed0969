"""Channels of one end that come late, for the clock of `time_skew` and for learned delays."""

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import F_LOAD, TAU_OUT, THETA_OUT
from ccmodel.mechanisms.contract import Sensing, side

_LOAD_CHANNELS = (THETA_OUT, TAU_OUT, F_LOAD)


def late(sensing: Sensing, place: str, delay_s: float | NDArray) -> dict[str, NDArray]:
    """The channels that change where an end's readings are late by `delay_s`, the same for all samples or for each.

    The model runs on the drive's clock, whose angle is its input, so a late drive is simulated as an early load. What
    the load does after the last sample of the drive is not known: its channels go on as they changed last.
    """
    t = sensing.time_s
    read_at = t - delay_s if side(place) == "load" else t + delay_s
    beyond_s = np.maximum(read_at - t[-1], 0.0)

    def read(values: NDArray) -> NDArray:
        rate = (values[-1] - values[-2]) / (t[-1] - t[-2]) if t.size > 1 else 0.0
        return np.interp(read_at, t, values) + rate * beyond_s

    return {name: read(sensing.channels[name]) for name in _LOAD_CHANNELS}
