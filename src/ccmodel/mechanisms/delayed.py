"""Channels of one end that come late: by a constant time, by one for each sample, or through a filter."""

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import ANGLE_AT, SUM_AT, TORQUE_AT
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Sensing, side
from ccmodel.mechanisms.relaxation import lag_weights


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

    return {name: read(sensing.channels[name]) for name in _channels_of("load")}


def through_filter(sensing: Sensing, place: str, time_constant_s: float) -> dict[str, NDArray]:
    """An end's channels as a low-pass filter of first order passes them on, which has settled at the first sample."""
    if time_constant_s == 0.0:
        return {}
    channels = sensing.channels
    return {name: _filtered(channels[name], sensing.time_s, time_constant_s) for name in _channels_of(side(place))}


def before_filter(values: NDArray, time_s: NDArray, time_constant_s: float) -> NDArray:
    """What a filter of first order was given, from what it passed on (n samples): x = y + T dy/dt."""
    if time_constant_s == 0.0 or values.size < 2:
        return values
    return values + time_constant_s * np.gradient(values, time_s)


def _channels_of(end: str) -> tuple[str, ...]:
    """What the sensors of the drive's or the load's end read."""
    return ANGLE_AT[end], TORQUE_AT[end], SUM_AT[end]


@kernel(allocates=True)
def _filtered(values: NDArray, time_s: NDArray, time_constant_s: float) -> NDArray:
    """Response of T dy/dt = x - y to x, which is linear between samples, from y = x at the first; shape (n,)."""
    y = values.copy()
    for i in range(1, values.size):
        keep, before, after = lag_weights((time_s[i] - time_s[i - 1]) / time_constant_s)
        y[i] = keep * y[i - 1] + before * values[i - 1] + after * values[i]
    return y
