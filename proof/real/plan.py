"""What is put into measured recordings, how large, and how they are diagnosed (`plan.yaml`)."""

from functools import cache
from pathlib import Path
from typing import Self

import yaml
from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from proof.real.put_in import KINDS
from virtualrig.strict import Share, Strict

PLAN = Path(__file__).with_name("plan.yaml")
Range = tuple[PositiveFloat, PositiveFloat]


class PutInPlan(Strict):
    """How large a thing that is put in can be, and what is right to say of it."""

    size: Range
    unit: str
    signed: bool = False
    called: str | None = None
    parameter: str | None = None
    same: tuple[str, ...] = ()
    place: str | None = None


class RealPlan(Strict):
    """All of `plan.yaml`."""

    seed: PositiveInt
    batch: str
    known: tuple[str, ...] = Field(min_length=2)
    watched: tuple[str, ...] = Field(min_length=2)
    step_s: PositiveFloat
    cycles: PositiveInt
    allowance: Share
    suspects: tuple[tuple[str, ...], ...]
    allowances: tuple[Share, ...] = Field(min_length=1)
    repeats: PositiveInt
    put_in: dict[str, PutInPlan]

    @model_validator(mode="after")
    def _can_be_put_in(self) -> Self:
        if unknown := set(self.put_in) - set(KINDS):
            raise ValueError(f"put_in: there is no {', '.join(sorted(unknown))}; there are {', '.join(KINDS)}")
        if both := set(self.known) & set(self.watched):
            raise ValueError(f"known and watched share {', '.join(sorted(both))}")
        return self


@cache
def read_real_plan(path: Path = PLAN) -> RealPlan:
    """Read and check the plan."""
    return RealPlan.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))
