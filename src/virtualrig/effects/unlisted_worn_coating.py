"""A coating that wears through: friction rises by rise about a travel of the drive, within a width."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numba import njit
from pydantic import PositiveFloat

from virtualrig.effects.contract import TRAVELS_M, Law, Seeded, TrueLaw, Twin, along, slow_factor
from virtualrig.strict import Strict


class WornCoating(Strict):
    """Its numbers."""

    rise: PositiveFloat
    travel_m: PositiveFloat
    width_m: PositiveFloat


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.worn_coating
    return {
        "coating_rise": given.rise if given else 0.0,
        "coating_travel": given.travel_m if given else 1.0,
        "coating_width": given.width_m if given else 1.0,
    }


@njit
def _value(p: Any, y: float, tension: float, time: float, travel: float, position: float) -> float:
    if p.coating_rise == 0.0:
        return y
    return y * (1.0 + p.coating_rise / (1.0 + np.exp(-(travel - p.coating_travel) / p.coating_width)))


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"worn_coating": {"rise": size, "travel_m": also["travel_m"], "width_m": also["width_m"]}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    travel = along(TRAVELS_M)
    return TrueLaw("sliding-friction", "travel", travel, slow_factor(_value, _numbers(rig.effects), "travel", travel))


TWIN = Twin(
    name="unlisted-worn-coating",
    fields={"rig": {"worn_coating": (WornCoating | None, None)}},
    places=("conduit",),
    size=(0.03, 0.6),
    unit="1",
    also={"travel_m": (8e-3, 2.5e-2), "width_m": (5e-4, 4e-3)},
    seed=_seed,
    numbers=_numbers,
    slow_friction=Law(_value, lambda p, tension_N: 1 + p.coating_rise),
    law=_law,
)
