"""Presliding: before it slides, the cable leans on bristles that give way.

Equation (Dahl): with v the sliding speed, the bristle z follows dz/dt = v (1 - sgn(v) z / z0), and friction is
mu N z / z0. It depends on the way that was slid, not on the speed, so a step of any size has a closed form as long
as it keeps its direction.

Signature: corners at every reversal, sharp in the paper's model, are rounded over some z0 of sliding.

Mistaken for termination compliance, which also softens the start of a stroke. Nested reversals of small amplitude
tell: with bristles the tension creeps from one of them to the next, with a termination the small loops close.
"""

from ccmodel.elementary import quick_exp
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter


@kernel(inline="always")
def dahl(xi, slide, z0):
    """Bristle xi = z / z0 after sliding by `slide` (m) in one direction, and its derivative by `slide` (1/m)."""
    direction = 1.0 if slide >= 0.0 else -1.0
    left = quick_exp(-abs(slide) / z0)
    return direction + (xi - direction) * left, (1.0 - direction * xi) * left / z0


def _modifies_physics(settings, place, values):
    settings.bristle_m = values["z0"]


MECHANISM = Mechanism(
    name="presliding",
    places=("conduit",),
    parameters=(Parameter("z0", "m", 5e-6, 200e-6, 50e-6),),
    summary="friction builds up over a bristle length",
    mistaken_for="termination-compliance",
    separated_by="nested reversals of small amplitude",
    # One bristle stands for asperities whose lengths differ many times; elastic-slip elements with lengths from 1 to 12
    # show what that costs.
    model_form_error=0.08,
    modifies_physics=_modifies_physics,
)
