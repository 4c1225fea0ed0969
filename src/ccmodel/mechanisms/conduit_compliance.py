"""A conduit shortens under its cable's mean tension.

Equation: The path of a cable shortens by compliance times the change of that cable's mean tension, evenly along its
length.

Signature: The apparent stiffness is low, independent of how far the friction front has advanced.

Separated by: partial motion compared with full slip: the compliance of a cable acts up to the friction front, that
of a termination with the tension at its end, that of a conduit with the mean tension.

Source: Agrawal, Peine and Yao 2010, Section VI: changes in the path of the conduit due to lateral forces.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter

MECHANISM = Mechanism(
    name="conduit-compliance",
    text=__doc__,
    tex=r"\Delta L = -\,\mathrm{compliance}\cdot\Delta\bar T, \qquad \bar T = \frac{1}{L} \int_0^L T\,dx",
    sentence="the conduits shorten under tension, by {compliance}",
    places=("conduit",),
    parameters=(Parameter("compliance", "m/N", 3e-6, 80e-6, 20e-6, "shortening of the path per mean tension"),),
    mistaken_for=("K", "termination-compliance"),
    depends_on_time=False,
    settings={"conduit_compliance": "compliance"},
)
