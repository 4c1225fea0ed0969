"""Constant drag: a liner or a seal that grips the cable whatever its tension.

Equation: friction f0 / L per length besides mu T dphi; f0 is the drag of one whole cable.

Signature: a loss that stays as the tension goes to zero.

Mistaken for friction that depends on tension and for friction in a pulley. The loss against pretension tells: drag is
its intercept at zero tension.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _modifies_physics(settings, place, values):
    settings.drag_N = values["f0"]


MECHANISM = Mechanism(
    name="constant-drag",
    places=("conduit",),
    parameters=(Parameter("f0", "N", 0.1, 5.0, 0.5),),
    summary="friction that does not depend on tension",
    mistaken_for="load-dependent-friction, pulley-friction",
    separated_by="the loss's intercept at low pretension",
    modifies_physics=_modifies_physics,
)
