"""Presliding: friction builds up over a length of one bristle, or of many that yield one after the other.

One bristle's law is Dahl's or that of Bouc and Wen, whose knee is rounder or sharper (Wen, Journal of the Engineering
Mechanics Division 102(2), 249-263, 1976).
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from virtualrig.effects.contract import Seeded, TrueLaw, Twin
from virtualrig.strict import Strict


class DahlPresliding(Strict):
    """One bristle of Dahl's law at every place: friction builds up over `length_m`."""

    law: Literal["dahl"] = "dahl"
    length_m: PositiveFloat


class BoucWenPresliding(Strict):
    """One bristle z of the law of Bouc and Wen: dz/ds = (1 - |z|^exponent sgn(z ds)) / length; Dahl's at 1."""

    law: Literal["bouc-wen"] = "bouc-wen"
    length_m: PositiveFloat
    exponent: PositiveFloat


class IwanPresliding(Strict):
    """Equal elements in parallel that stretch and then slip, with lengths evenly spaced in the logarithm.

    A contact of many asperities: the build-up has no single length, and nested loops close exactly (Iwan, Journal of
    Applied Mechanics 33(4), 893-900, 1966).
    """

    law: Literal["iwan"] = "iwan"
    shortest_m: PositiveFloat
    longest_m: PositiveFloat
    elements: Annotated[PositiveInt, Field(le=64)] = 8

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.longest_m < self.shortest_m:
            raise ValueError(f"longest_m {self.longest_m} is below shortest_m {self.shortest_m}")
        return self


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    root = also["spread"] ** 0.5
    return {"presliding": {"law": "iwan", "shortest_m": size / root, "longest_m": size * root}}, {}


def _bouc_wen(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"presliding": {"law": "bouc-wen", "length_m": size, "exponent": also["exponent"]}}, {}


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.presliding
    return {"bristle_exponent": given.exponent if isinstance(given, BoucWenPresliding) else 1.0}


TWIN = Twin(
    name="presliding",
    fields={
        "rig": {
            "presliding": (
                Annotated[DahlPresliding | IwanPresliding | BoucWenPresliding, Field(discriminator="law")] | None,
                None,
            )
        }
    },
    places=("conduit",),
    size=(5e-6, 2e-4),
    unit="m",
    also={"spread": (3.0, 15.0), "exponent": (0.4, 3.0)},  # longest over shortest element; of Bouc and Wen
    seed=_seed,
    other_laws={"bouc-wen": _bouc_wen},
    law=lambda rig, place: TrueLaw("sliding-friction", "distance-since-reversal"),
    numbers=_numbers,
)
