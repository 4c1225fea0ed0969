"""Stribeck: friction that is higher at rest than in motion.

Equation: mu (1 + a exp(-(v / vs)^2)), v the sliding speed. Friction that falls with speed has no unique step without
inertia. The speed in it therefore lags: dv_s/dt = (v - v_s) / LAG_S, the time that a contact needs to renew itself.

Signature: a peak at break-away, and a loss that falls with speed.

Mistaken for presliding and for viscous friction. A sweep of speeds tells.
"""

import numpy as np

from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter

LAG_S = 2e-3


@kernel(inline="always")
def breakaway(speed, rise, vs):
    """Factor of mu at a sliding speed (m/s)."""
    return 1.0 + rise * np.exp(-((speed / vs) ** 2))


def _enters(settings, place, values):
    settings.stribeck_rise = values["a"]
    settings.stribeck_speed = values["vs"]


MECHANISM = Mechanism(
    name="stribeck",
    places=("conduit",),
    parameters=(Parameter("a", "1", 0.05, 0.6, 0.2), Parameter("vs", "m/s", 1e-4, 1e-2, 2e-3, neutral=1e-3)),
    summary="friction is higher at rest than in motion",
    mistaken_for="presliding, viscous-friction",
    separated_by="a sweep of speeds",
    enters=_enters,
)
