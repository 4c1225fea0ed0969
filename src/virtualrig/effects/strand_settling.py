"""Strand settling: a cable that is soft near slack, until its strands bed in over a tension scale."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import PositiveFloat

from virtualrig.effects.contract import TENSIONS_N, Seed, Seeded, TrueLaw, Twin, along
from virtualrig.strict import Strict

# Laws, and their numbers in the time loop.
LAWS = ("hyperbolic", "exponential", "toe")
HYPERBOLIC, EXPONENTIAL, TOE = range(len(LAWS))


class StrandSettling(Strict):
    """Its law and tension scale.

    With the elongation e, and s the elongation of an ideal cable at the tension scale, the tension is that of an
    elongation e - s (1 - exp(-e / s)) ("exponential"), sqrt(e^2 + s^2) - s ("hyperbolic"), or e^2 / (4 s) up to 2 s and
    e - s beyond ("toe", a fibre bundle's).
    """

    law: Literal["hyperbolic", "exponential", "toe"] = "hyperbolic"
    tension_scale_N: PositiveFloat


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.strand_settling
    return {
        "settling_law": LAWS.index(given.law) if given else 0,
    }


def _seeding(law: str) -> Seed:
    def seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
        values = {"T_scale": size} if law == "exponential" else {}
        return {"strand_settling": {"law": law, "tension_scale_N": size}}, values

    return seed


def _law(rig: Any, place: str) -> TrueLaw:
    """The compliance over that of a settled cable: the derivative of the elongation by the tension."""
    given, tension = rig.effects.strand_settling, along(TENSIONS_N)
    ratio = tension / given.tension_scale_N
    if given.law == "hyperbolic":
        compliance = (ratio + 1) / np.sqrt((ratio + 1) ** 2 - 1)
    elif given.law == "toe":
        compliance = np.maximum(1 / np.sqrt(ratio), 1.0)
    else:
        elongation = np.geomspace(1e-3, 1e3, 20001)
        over = np.interp(ratio, elongation + np.expm1(-elongation), elongation)
        compliance = -1 / np.expm1(-over)
    return TrueLaw("cable-stretch", "tension", tension, compliance)


TWIN = Twin(
    name="strand-settling",
    fields={"rig": {"strand_settling": (StrandSettling | None, None)}},
    places=("cable",),
    size=(0.2, 8.0),
    unit="N",
    seed=_seeding("exponential"),
    other_laws={law: _seeding(law) for law in ("hyperbolic", "toe")},
    numbers=_numbers,
    law=_law,
)
