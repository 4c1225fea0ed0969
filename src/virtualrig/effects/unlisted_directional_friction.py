"""Friction that is 1 + bias times as large where the cable slides towards the drive, 1 - bias where it slides back."""

from typing import Annotated, Any

import numpy as np
from numba import njit
from pydantic import Field

from virtualrig.effects.contract import Law, TrueLaw, Twin
from virtualrig.strict import Strict


class DirectionalFriction(Strict):
    """Its bias."""

    bias: Annotated[float, Field(gt=-1, lt=1)]


@njit
def _value(p: Any, force: float, bristle: float, speed: float) -> float:
    return force * (1.0 + p.bias * bristle)


def _law(rig: Any, place: str) -> TrueLaw:
    b = rig.effects.directional_friction.bias
    return TrueLaw("sliding-friction", "direction", np.array([-1.0, 1.0]), np.array([1 - b, 1 + b]))


TWIN = Twin(
    name="unlisted-directional-friction",
    fields={"rig": {"directional_friction": (DirectionalFriction | None, None)}},
    places=("conduit",),
    size=(0.02, 0.4),
    unit="1",
    signed=True,
    seed=lambda size, also, place, spring: ({"directional_friction": {"bias": size}}, {}),
    numbers=lambda effects: {"bias": effects.directional_friction.bias if effects.directional_friction else 0.0},
    law=_law,
    friction=Law(_value, lambda p, tension_N: 1 + abs(p.bias)),
)
