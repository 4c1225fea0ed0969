"""Load-dependent friction: the friction coefficient times (T / reference)^exponent, or 1 + exponent ln(T / reference).

The power is that of a contact of one asperity (Archard 1957), the logarithm an empirical law; both are constant below
`floor_N`.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from numba import njit
from pydantic import Field, PositiveFloat

from virtualrig.effects.contract import TENSIONS_N, Law, Seed, Seeded, TrueLaw, Twin, along, slow_factor
from virtualrig.strict import Strict

# The logarithm leaves this share of the friction coefficient at least.
LEAST = 0.1


class LoadDependentFriction(Strict):
    """Its numbers."""

    law: Literal["power", "logarithmic"] = "power"
    exponent: Annotated[float, Field(gt=-1, lt=1)]
    reference_N: PositiveFloat = 5.0
    floor_N: PositiveFloat = 0.1


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.load_dependent_friction
    return {
        "tension_exponent": given.exponent if given else 0.0,
        "tension_is_logarithmic": given is not None and given.law == "logarithmic",
        "tension_reference": given.reference_N if given else 1.0,
        "tension_floor": given.floor_N if given else 0.0,
    }


@njit
def _value(p: Any, y: float, tension: float, time: float, travel: float, position: float) -> float:
    if p.tension_exponent == 0.0:
        return y
    ratio = max(tension, p.tension_floor) / p.tension_reference
    if p.tension_is_logarithmic:
        return y * max(1.0 + p.tension_exponent * np.log(ratio), LEAST)
    return y * ratio**p.tension_exponent


def _bound(p: Any, tension_N: float) -> float:
    ratio = tension_N / p.tension_reference
    if p.tension_is_logarithmic:
        return max(1.0 + p.tension_exponent * float(np.log(ratio)), LEAST)
    return ratio**p.tension_exponent


def _law(rig: Any, place: str) -> TrueLaw:
    tension = along(TENSIONS_N)
    factor = slow_factor(_value, _numbers(rig.effects), "tension", tension)
    return TrueLaw("sliding-friction", "tension", tension, factor)


def _seeding(law: str) -> Seed:
    def seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
        settings = {"law": law, "exponent": -size, "reference_N": also["reference_N"], "floor_N": also["floor_N"]}
        return {"load_dependent_friction": settings}, {"n": -size} if law == "power" else {}

    return seed


TWIN = Twin(
    name="load-dependent-friction",
    fields={"rig": {"load_dependent_friction": (LoadDependentFriction | None, None)}},
    places=("conduit",),
    size=(0.02, 0.35),
    unit="1",
    also={"reference_N": (3.0, 10.0), "floor_N": (0.05, 0.4)},
    seed=_seeding("power"),
    other_laws={"logarithmic": _seeding("logarithmic")},
    numbers=_numbers,
    law=_law,
    slow_friction=Law(_value, _bound),
)
