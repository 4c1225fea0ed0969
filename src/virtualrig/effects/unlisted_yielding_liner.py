"""A liner that yields under a loaded cable: friction is rise higher above a tension, within a width about it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numba import njit
from pydantic import PositiveFloat

from virtualrig.effects.contract import TENSIONS_N, Law, Seeded, TrueLaw, Twin, along, slow_factor
from virtualrig.strict import Strict


class YieldingLiner(Strict):
    """Its numbers."""

    rise: PositiveFloat
    tension_N: PositiveFloat
    width_N: PositiveFloat


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.yielding_liner
    return {
        "liner_rise": given.rise if given else 0.0,
        "liner_tension": given.tension_N if given else 1.0,
        "liner_width": given.width_N if given else 1.0,
    }


@njit
def _value(p: Any, y: float, tension: float, time: float, travel: float, position: float) -> float:
    if p.liner_rise == 0.0:
        return y
    return y * (1.0 + p.liner_rise / (1.0 + np.exp(-(tension - p.liner_tension) / p.liner_width)))


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"yielding_liner": {"rise": size, "tension_N": also["tension_N"], "width_N": also["width_N"]}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    tension = along(TENSIONS_N)
    return TrueLaw(
        "sliding-friction", "tension", tension, slow_factor(_value, _numbers(rig.effects), "tension", tension)
    )


TWIN = Twin(
    name="unlisted-yielding-liner",
    fields={"rig": {"yielding_liner": (YieldingLiner | None, None)}},
    places=("conduit",),
    size=(0.03, 0.6),
    unit="1",
    also={"tension_N": (4.0, 8.0), "width_N": (0.5, 2.0)},
    seed=_seed,
    numbers=_numbers,
    slow_friction=Law(_value, lambda p, tension_N: 1 + p.liner_rise),
    law=_law,
)
