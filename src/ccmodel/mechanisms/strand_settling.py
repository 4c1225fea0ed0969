"""Strands of the cable that settle: a cable that is softer at low tension.

Equation: with strain u' the tension is T = EA (u' - u_s (1 - exp(-u' / u_s))), u_s = T_scale / EA: without stiffness
where the cable is slack, its full stiffness a few T_scale above, and the stretch u_s lost on the way.

Signature: soft near slack, stiff elsewhere.

Mistaken for backlash and for slack. A sweep at low pretension tells: settling depends on the tension of the cable
itself, backlash on the torque of the load.
"""

import numpy as np

from ccmodel.elementary import quick_exp
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter


@kernel(inline="always")
def settling_tension(stretch, lost, stiffness):
    """Tension (N) of a piece at a stretch (m) >= 0, and its stiffness (N/m); `lost` is u_s times its length (m)."""
    left = quick_exp(-stretch / lost)
    return stiffness * (stretch - lost * (1.0 - left)), stiffness * (1.0 - left)


def stretch_at(tension, lost, stiffness):
    """Stretch (m) at which `settling_tension` gives `tension` (N); arrays of one shape."""
    stretch = tension / stiffness + lost
    for _ in range(60):
        left = np.exp(-stretch / lost)
        slope = np.maximum(stiffness * (1 - left), 1e-9 * stiffness)
        stretch = np.maximum(stretch - (stiffness * (stretch - lost * (1 - left)) - tension) / slope, 0.0)
    return stretch


def _modifies_physics(settings, place, values):
    settings.settling_N = values["T_scale"]


MECHANISM = Mechanism(
    name="strand-settling",
    places=("cable",),
    parameters=(Parameter("T_scale", "N", 0.5, 10.0, 2.0),),
    summary="cable stiffness falls at low tension",
    mistaken_for="backlash, slack",
    separated_by="a sweep at low pretension",
    modifies_physics=_modifies_physics,
)
