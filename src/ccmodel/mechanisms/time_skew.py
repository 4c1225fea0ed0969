"""One side's channels are late.

Equation: The channels of one side read at time t what they would have read at t - (1 - filtered) delay, after a
low-pass filter of first order with the time constant filtered delay: slow motions are late by delay. The model runs on
the drive's clock, whose angle is its input, so a late drive side is simulated as an early load side. Over the last
delay of a recording, of which the drive's motion is not known, the load goes on at its last rate. The drive's angle
before a filter follows from that after it and its rate.

Signature: Loops of a drive channel over a load channel widen or narrow with frequency, whichever channels are
taken.

Separated by: a chirp: a delay's error grows with the first power of frequency and is the same in all channels of a
side; a filter also takes off amplitude.

Source: Mills, Internet time synchronization: the network time protocol, IEEE Transactions on Communications 39(10),
1482-1493, 1991, doi:10.1109/26.103043, on clock offset; Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic
Systems, 8th edition, Pearson, 2019, on the filter of first order.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ccmodel.mechanisms.contract import SENSOR_MAP, Curve, Mechanism, Parameter, Sensing, optional_share, side
from ccmodel.mechanisms.delayed import before_filter, late, through_filter


def _modifies_input(time_s: NDArray, theta_in: NDArray, place: str, values: Mapping[str, float]) -> NDArray:
    if side(place) == "load":
        return theta_in
    return before_filter(theta_in, time_s, values["filtered"] * values["delay"])


def _modifies_observation(sensing: Sensing, place: str, values: Mapping[str, float]) -> dict[str, NDArray]:
    filtered = through_filter(sensing, place, values["filtered"] * values["delay"])
    sensing = replace(sensing, channels=dict(sensing.channels) | filtered)
    return filtered | late(sensing, place, (1 - values["filtered"]) * values["delay"])


_DELAY = Parameter("delay", "s", 2e-3, 50e-3, 10e-3, "delay of one side's channels")

MECHANISM = Mechanism(
    name="time-skew",
    text=__doc__,
    tex=r"y_\mathrm{read}(s) = \frac{e^{-(1 - \mathrm{filtered})\,\mathrm{delay}\;s}}"
    r"{1 + \mathrm{filtered}\cdot\mathrm{delay}\;s}\;y(s)",
    sentence="the {side}'s channels are late by {delay}[filtered: of which a low-pass filter makes {filtered:%}]",
    places=("drive-sensor", "load-sensor"),
    parameters=(
        _DELAY,
        optional_share("filtered", "share of the delay that a low-pass filter of first order makes"),
    ),
    mistaken_for=("viscous-friction", "load-inertia"),
    depends_on_time=True,
    looks_ahead=True,
    modifies_input=_modifies_input,
    modifies_observation=_modifies_observation,
    curves=(Curve(SENSOR_MAP, "time", lambda t, values: np.full(t.shape, values["delay"]), (_DELAY,), form="delay"),),
)
