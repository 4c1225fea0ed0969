"""Cables that differ: friction and stiffness of cable B over those of cable A."""

from collections.abc import Mapping

from pydantic import PositiveFloat

from virtualrig.effects.contract import Seeded, Twin
from virtualrig.strict import Strict


class CableAsymmetry(Strict):
    """Cable B over cable A."""

    friction_ratio: PositiveFloat = 1.0
    stiffness_ratio: PositiveFloat = 1.0


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"cable_asymmetry": {"friction_ratio": 1 + size}}, {"ratio": 1 + size, "K_ratio": 1.0}


TWIN = Twin(
    name="cable-asymmetry",
    fields={"rig": {"cable_asymmetry": (CableAsymmetry, CableAsymmetry())}},
    places=("cable",),
    size=(0.02, 0.4),
    unit="1",
    signed=True,
    seed=_seed,
)
