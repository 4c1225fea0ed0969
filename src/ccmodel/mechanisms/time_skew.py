"""One side's clock is late.

Equation: The channels of one side read at time t what they would have read at t - delay. The model runs on the
drive's clock, whose angle is its input, so a late drive side is simulated as an early load side. Over the last delay
of a recording, of which the drive's motion is not known, the load goes on at its last rate.

Signature: Loops of a drive channel over a load channel widen or narrow with frequency, whichever channels are
taken.

Separated by: a chirp: a delay's error grows with the first power of frequency and is the same in all channels of a
side.

Source: Mills, Internet time synchronization: the network time protocol, IEEE Transactions on Communications 39(10),
1482-1493, 1991, doi:10.1109/26.103043, on clock offset.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.mechanisms.contract import SENSOR_MAP, Curve, Mechanism, Parameter, Sensing
from ccmodel.mechanisms.delayed import late


def _modifies_observation(sensing: Sensing, place: str, values: Mapping[str, float]) -> dict[str, NDArray]:
    return late(sensing, place, values["delay"])


_DELAY = Parameter("delay", "s", 2e-3, 50e-3, 10e-3, "delay of one side's channels")

MECHANISM = Mechanism(
    name="time-skew",
    text=__doc__,
    tex=r"y_\mathrm{read}(t) = y(t - \mathrm{delay})",
    sentence="the {side}'s channels are late by {delay}",
    places=("drive-sensor", "load-sensor"),
    parameters=(_DELAY,),
    mistaken_for=("viscous-friction", "load-inertia"),
    depends_on_time=True,
    looks_ahead=True,
    modifies_observation=_modifies_observation,
    curves=(Curve(SENSOR_MAP, "time", lambda t, values: np.full(t.shape, values["delay"]), (_DELAY,), form="delay"),),
)
