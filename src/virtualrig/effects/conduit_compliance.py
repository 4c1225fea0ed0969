"""A conduit that shortens with its cable's mean tension."""

from virtualrig.effects.contract import Twin
from virtualrig.strict import NonNegative

TWIN = Twin(
    name="conduit-compliance",
    fields={"rig": {"conduit_compliance_m_per_N": (NonNegative, 0.0)}},
    places=("conduit",),
    size=(3e-6, 6e-5),
    unit="m/N",
    seed=lambda size, also, place, spring: ({"conduit_compliance_m_per_N": size}, {"compliance": size}),
    numbers=lambda effects: {"conduit_compliance": effects.conduit_compliance_m_per_N},
)
