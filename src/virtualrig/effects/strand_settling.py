"""Strand settling: a cable that is soft near slack, until its strands bed in over a tension scale."""

from typing import Any, Literal

from pydantic import PositiveFloat

from virtualrig.effects.contract import Twin
from virtualrig.strict import Strict


class StrandSettling(Strict):
    """Its law and tension scale.

    With the elongation e, and s the elongation of an ideal cable at the tension scale, the tension is that of an
    elongation sqrt(e^2 + s^2) - s ("hyperbolic"), or e - s (1 - exp(-e / s)) ("exponential").
    """

    law: Literal["hyperbolic", "exponential"] = "hyperbolic"
    tension_scale_N: PositiveFloat


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.strand_settling
    return {
        "has_settling": given is not None,
        "settling_is_exponential": given is not None and given.law == "exponential",
    }


TWIN = Twin(
    name="strand-settling",
    fields={"rig": {"strand_settling": (StrandSettling | None, None)}},
    places=("cable",),
    size=(0.2, 8.0),
    unit="N",
    seed=lambda size, also, place, spring: ({"strand_settling": {"tension_scale_N": size}}, {}),
    numbers=_numbers,
)
