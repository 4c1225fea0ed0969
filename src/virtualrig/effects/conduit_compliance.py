"""A conduit that shortens with its cable's mean tension, in proportion, or ever less as the turns of its wire close."""

from collections.abc import Mapping

from virtualrig.effects.contract import Seeded, Twin
from virtualrig.strict import NonNegative


def _closing(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"conduit_compliance_m_per_N": size, "conduit_closes_N": also["closes_N"]}, {}


TWIN = Twin(
    name="conduit-compliance",
    fields={"rig": {"conduit_compliance_m_per_N": (NonNegative, 0.0), "conduit_closes_N": (NonNegative, 0.0)}},
    places=("conduit",),
    size=(3e-6, 6e-5),
    unit="m/N",
    also={"closes_N": (2.0, 8.0)},
    seed=lambda size, also, place, spring: ({"conduit_compliance_m_per_N": size}, {"compliance": size}),
    other_laws={"closing": _closing},
    numbers=lambda effects: {
        "conduit_compliance": effects.conduit_compliance_m_per_N,
        "conduit_closes": effects.conduit_closes_N,
    },
)
