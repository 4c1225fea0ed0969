"""A conduit that gives way to its cable: it is pressed together, and its bends are drawn in.

Equation: the path of a cable shortens by ``compliance`` times the change of that cable's mean tension, evenly along
its length.

Signature: the apparent stiffness is low however far the friction front has run in.

Mistaken for a softer cable and for a compliant termination. Partial motion against full slip tells: the cable's own
softness acts as far as the front has come, a termination's at its end, a conduit's with the mean tension.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _modifies_physics(settings, place, values):
    settings.conduit_compliance = values["compliance"]


MECHANISM = Mechanism(
    name="conduit-compliance",
    places=("conduit",),
    parameters=(Parameter("compliance", "m/N", 3e-6, 80e-6, 20e-6),),
    summary="a conduit shortens under its cable's mean tension",
    mistaken_for="K, termination-compliance",
    separated_by="partial motion against full slip",
    modifies_physics=_modifies_physics,
)
