"""Cables that differ: friction and stiffness of cable B over those of cable A."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import PositiveFloat

from virtualrig.effects.contract import Seeded, TrueLaw, Twin
from virtualrig.strict import Strict


class CableAsymmetry(Strict):
    """Cable B over cable A."""

    friction_ratio: PositiveFloat = 1.0
    stiffness_ratio: PositiveFloat = 1.0


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"cable_asymmetry": {"friction_ratio": 1 + size}}, {"ratio": 1 + size, "K_ratio": 1.0}


def _law(rig: Any, place: str) -> TrueLaw:
    of_B = rig.effects.cable_asymmetry.friction_ratio
    return TrueLaw("sliding-friction", "cable", np.array([-1.0, 1.0]), np.array([1.0, of_B]))


TWIN = Twin(
    name="cable-asymmetry",
    fields={"rig": {"cable_asymmetry": (CableAsymmetry, CableAsymmetry())}},
    places=("cable",),
    size=(0.02, 0.4),
    unit="1",
    signed=True,
    seed=_seed,
    law=_law,
)
