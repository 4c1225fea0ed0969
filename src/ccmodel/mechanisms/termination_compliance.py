"""A termination that gives: free cable, crimps and anchors between pulley and conduit.

Equation: F / k_c of stretch in series at one end of each cable, without friction, by ``compliance`` = 1 / k_c.

Signature: the apparent stiffness lies below the one measured on the cable. The paper measured 13.88 kN/m and fitted
7.5 to 7.75 kN/m, with 0.4 m of free cable and two terminations in none of its equations.

Mistaken for a softer cable. Two lengths of conduit tell, and small motions: a termination gives before the friction
front has run in, the cable behind it not yet.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter, side


def _modifies_physics(settings, place, values):
    if side(place) == "drive":
        settings.drive_end_compliance = values["compliance"]
    else:
        settings.load_end_compliance = values["compliance"]


# 4 to 200 % of a cable's own: 1 / 13.88 kN/m is 72 um/N.
MECHANISM = Mechanism(
    name="termination-compliance",
    places=("drive-end", "load-end"),
    parameters=(Parameter("compliance", "m/N", 3e-6, 150e-6, 20e-6),),
    summary="a compliance in series at a cable's end",
    mistaken_for="K",
    separated_by="two conduit lengths, partial motion",
    modifies_physics=_modifies_physics,
)
