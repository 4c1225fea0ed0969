"""Two loggers whose clocks do not agree.

Equation: the channels of one side are stamped late by ``delay``: at time t they show what was at t - delay. A model
runs in the drive's clock, whose angle it is given; a drive side that is late by a delay is then a load side that is
early by it.

Signature: loops open or close with frequency, in every pair of channels of which one is on either side.

Mistaken for viscous friction and for inertia of the load. A chirp tells: a delay's error grows with the frequency
to the first power and is alike in all channels of a side.
"""

import numpy as np

from ccmodel.channels import F_LOAD, TAU_OUT, THETA_OUT
from ccmodel.mechanisms.contract import Mechanism, Parameter, side

_LOAD_CHANNELS = (THETA_OUT, TAU_OUT, F_LOAD)


def _modifies_observation(sensing, place, values):
    late = values["delay"] if side(place) == "load" else -values["delay"]
    t = sensing.time_s
    return {name: np.interp(t - late, t, sensing.channels[name]) for name in _LOAD_CHANNELS}


MECHANISM = Mechanism(
    name="time-skew",
    places=("drive-sensor", "load-sensor"),
    parameters=(Parameter("delay", "s", 2e-3, 50e-3, 10e-3),),
    summary="one side's clock is late",
    mistaken_for="viscous-friction, load-inertia",
    separated_by="a chirp",
    modifies_observation=_modifies_observation,
)
