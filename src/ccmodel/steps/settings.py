"""Settings of the steps before the studies: how parameters are fitted."""

from math import inf
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ccmodel.channels import MEASURED
from ccmodel.model.parameters import FREE, OWN
from ccmodel.typed import OneOf, TypedModel

Share = Annotated[float, Field(ge=0, lt=0.5)]
Measured = Annotated[str, OneOf(MEASURED)]
Freed = Annotated[str, OneOf(FREE)]
Tolerance = Share | dict[Measured, Share]


class FreeParameter(TypedModel):
    """A parameter that a fit may change."""

    start: float | None = Field(None, description="start value in SI units; absent: the batch's own estimate")
    bounds: tuple[float, float] = Field(description="lowest and highest value, SI units")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        low, high = self.bounds
        if not low < high:
            raise ValueError(f"bounds must be lowest then highest; got {low} and {high}")
        if self.start is not None and not low <= self.start <= high:
            raise ValueError(f"start {self.start} is not within the bounds {low} to {high}")
        return self


class OwnParameter(TypedModel):
    """A parameter of each recording by itself."""

    spread: float = Field(gt=0, description="standard deviation from recording to recording, SI units")
    start: float | None = Field(None, description="where it is expected, SI units; absent: the batch's own estimate")
    bounds: tuple[float, float] | None = Field(None, description="lowest and highest value, SI units; absent: any")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        low, high = self.bounds or (-inf, inf)
        if not low < high:
            raise ValueError(f"bounds must be lowest then highest; got {low} and {high}")
        return self


class Fit(TypedModel):
    """A set of parameters fitted to recordings; its name is the name of the set."""

    batches: list[str] | Literal["each"] = Field(
        description="batches fitted together and then carried over to all others; or 'each': every batch by itself"
    )
    free: dict[Freed, FreeParameter] = Field(min_length=1, description="what is fitted")
    per_recording: dict[Annotated[str, OneOf(OWN)], OwnParameter] = Field(
        default_factory=dict, description="what each recording has a value of its own of"
    )
    channels: list[Measured] = Field(
        list(MEASURED), min_length=1, description="what is compared; those recorded are used"
    )
    tolerance: Tolerance = Field(
        0.0,
        description="share of a channel's peak to peak that the model may leave, besides the noise; or by channel",
    )
    starts: int = Field(1, ge=1, description="starts of the search, the configured one and others about it")
    step_s: float | None = Field(None, gt=0, description="take a sample every so often, s; absent: every sample")
    profile: list[Freed] = Field(
        default_factory=list, description="what the interval of is also taken from its profile likelihood"
    )

    @model_validator(mode="after")
    def _each_has_one_part(self) -> Self:
        if both := self.free.keys() & self.per_recording.keys():
            raise ValueError(f"{', '.join(sorted(both))}: either shared (free) or each recording's own (per_recording)")
        if unknown := set(self.profile) - self.free.keys():
            raise ValueError(f"profile: {', '.join(sorted(unknown))} is not free")
        return self
