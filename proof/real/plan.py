"""Typed settings of the seeded faults and of their diagnosis (`plan.yaml`)."""

from functools import cache
from pathlib import Path
from typing import Self

import yaml
from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from proof.real.faults import FAULTS
from virtualrig.strict import Share, Strict

PLAN = Path(__file__).with_name("plan.yaml")
Range = tuple[PositiveFloat, PositiveFloat]


class FaultPlan(Strict):
    """Range of sizes of a seeded fault, and the right diagnosis of it (see the comments of `plan.yaml`)."""

    size: Range
    unit: str
    signed: bool = False
    mechanism: str | None = None
    parameter: str | None = None
    equivalent: tuple[str, ...] = ()
    place: str | None = None


class RealPlan(Strict):
    """All settings."""

    seed: PositiveInt
    batch: str
    training: tuple[str, ...] = Field(min_length=2)
    test: tuple[str, ...] = Field(min_length=2)
    step_s: PositiveFloat
    cycles: PositiveInt
    tolerance: dict[str, Share]
    run_limit: PositiveInt
    tolerance_factors: tuple[PositiveFloat, ...] = Field(min_length=1)
    controls: tuple[tuple[str, ...], ...] = ()
    repeats: PositiveInt
    faults: dict[str, FaultPlan]

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        if unknown := set(self.faults) - set(FAULTS):
            raise ValueError(f"faults: there is no {', '.join(sorted(unknown))}; there are {', '.join(FAULTS)}")
        if both := set(self.training) & set(self.test):
            raise ValueError(f"training and test share {', '.join(sorted(both))}")
        if strays := {name for control in self.controls for name in control} - set(self.test):
            raise ValueError(f"controls: {', '.join(sorted(strays))} is no test recording")
        return self


@cache
def read_real_plan(path: Path = PLAN) -> RealPlan:
    """Read and check the plan."""
    return RealPlan.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))
