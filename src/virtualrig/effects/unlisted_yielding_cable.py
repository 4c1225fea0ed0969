"""A cable that is softer above a tension: beyond it the stiffness is 1 - share of that below."""

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field, PositiveFloat

from virtualrig.effects.contract import TENSIONS_N, Seeded, TrueLaw, Twin, along
from virtualrig.strict import Strict


class YieldingCable(Strict):
    """Its numbers."""

    share: Annotated[float, Field(ge=0, lt=1)]
    tension_N: PositiveFloat


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.yielding_cable
    return {"yield_share": given.share if given else 0.0, "yield_tension": given.tension_N if given else 1.0}


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"yielding_cable": {"share": size, "tension_N": also["tension_N"]}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    given, tension = rig.effects.yielding_cable, along(TENSIONS_N)
    return TrueLaw("cable-stretch", "tension", tension, np.where(tension > given.tension_N, 1 / (1 - given.share), 1.0))


TWIN = Twin(
    name="unlisted-yielding-cable",
    fields={"rig": {"yielding_cable": (YieldingCable | None, None)}},
    places=("cable",),
    size=(0.03, 0.6),
    unit="1",
    also={"tension_N": (4.0, 9.0)},
    seed=_seed,
    numbers=_numbers,
    law=_law,
)
