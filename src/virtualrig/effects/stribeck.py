"""Stribeck friction: the friction coefficient times 1 + rise exp(-(|v| / speed)^exponent), v the sliding speed."""

from collections.abc import Mapping
from typing import Any

from pydantic import PositiveFloat

from virtualrig.effects.contract import Seeded, Twin
from virtualrig.strict import NonNegative, Strict


class Stribeck(Strict):
    """Its numbers; a contact adapts to a new speed over `renewal_m` of sliding.

    Without such a length a cable chatters ever faster on ever shorter pieces of itself.
    """

    rise: NonNegative
    speed_m_per_s: PositiveFloat
    exponent: PositiveFloat = 1.0
    renewal_m: PositiveFloat = 20e-6


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.stribeck or Stribeck(rise=0.0, speed_m_per_s=1.0, renewal_m=1.0)
    return {
        "stribeck_rise": given.rise,
        "stribeck_speed": given.speed_m_per_s,
        "stribeck_exponent": given.exponent,
        "stribeck_renewal": given.renewal_m,
    }


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    # Another curve over speed than the mechanism's, so that only the height of its peak can be compared.
    return {"stribeck": {"rise": size, "speed_m_per_s": also["vs"], "exponent": 1.0}}, {"a": size}


TWIN = Twin(
    name="stribeck",
    fields={"rig": {"stribeck": (Stribeck | None, None)}},
    places=("conduit",),
    size=(0.03, 0.4),  # above 40 % cables chatter
    unit="1",
    also={"vs": (5e-4, 5e-3)},
    seed=_seed,
    numbers=_numbers,
)
