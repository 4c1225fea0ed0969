"""Viscous friction: a film of lubricant that is sheared.

Equation: a drag c v per length of conduit on top of Coulomb friction, whatever the tension.

Signature: loops widen with speed and not with tension; at low speed nothing is left of it.

Mistaken for Stribeck friction (whose loops narrow with speed) and for a clock that is late. Three speeds tell.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _modifies_physics(settings, place, values):
    settings.viscous = values["c"]


# From a film that is all but nothing to one that takes half of what Coulomb friction does: 15 mN to 3 N over a metre of
# conduit at some 3 mm/s.
MECHANISM = Mechanism(
    name="viscous-friction",
    places=("conduit",),
    parameters=(Parameter("c", "N s/m^2", 5.0, 1000.0, 50.0),),
    summary="drag in proportion to sliding speed",
    mistaken_for="stribeck, time-skew",
    separated_by="three speeds",
    modifies_physics=_modifies_physics,
)
