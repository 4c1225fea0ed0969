"""Backlash between the load pulley and the load.

Equation: the load takes part only beyond a dead zone of +-b about its neutral position, so a spring load gives
tau_out = K_e (theta -+ b) outside it and nothing inside. At rest it lies against the side that the cables' torque
holds it to.

Signature: the load's torque is flat around zero while the pulley turns.

Mistaken for strands that settle. Torque near zero tells: backlash is there at any pretension.
"""

from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter


@kernel(inline="always")
def dead_zone(theta, half_gap):
    """Angle beyond the gap (rad) and its derivative by `theta`."""
    if theta > half_gap:
        return theta - half_gap, 1.0
    if theta < -half_gap:
        return theta + half_gap, 1.0
    return 0.0, 0.0


def _modifies_physics(settings, place, values):
    settings.half_gap = values["half_gap"]


MECHANISM = Mechanism(
    name="backlash",
    places=("load-pulley",),
    parameters=(Parameter("half_gap", "rad", 3.5e-3, 70e-3, 15e-3),),
    summary="a dead zone between load pulley and load",
    mistaken_for="strand-settling",
    separated_by="torque near zero at two pretensions",
    modifies_physics=_modifies_physics,
)
