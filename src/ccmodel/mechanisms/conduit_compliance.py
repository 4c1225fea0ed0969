"""A conduit that shortens under its cable's tension: it is compressed, and its bends are drawn in."""

from ccmodel.mechanisms.contract import PAPER, Mechanism, Parameter


def _modifies_physics(settings, place, values):
    settings.conduit_compliance = values["compliance"]


MECHANISM = Mechanism(
    name="conduit-compliance",
    places=("conduit",),
    parameters=(Parameter("compliance", "m/N", 3e-6, 80e-6, 20e-6, "shortening of the path per mean tension"),),
    summary="a conduit shortens under its cable's mean tension",
    equation=(
        "The path of a cable shortens by compliance times the change of that cable's mean tension, evenly along its "
        "length."
    ),
    signature="The apparent stiffness is low, independent of how far the friction front has advanced.",
    mistaken_for=("K", "termination-compliance"),
    separated_by=(
        "partial motion against full slip: the cable's compliance acts up to the friction front, a termination's at "
        "its end, a conduit's with the mean tension"
    ),
    source=(f"{PAPER}, Section VI: changes in the path of the conduit due to lateral forces"),
    depends_on_time=False,
    settings={"conduit_compliance": 0.0},
    modifies_physics=_modifies_physics,
)
