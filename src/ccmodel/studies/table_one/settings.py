"""The typed content of config/table-one.yaml."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ccmodel.channels import PAPER_TABLE_ONE, TABLE_ONE
from ccmodel.typed import NotNegative, OneOf, Positive, TypedModel

Some = Annotated[list[Positive], Field(min_length=1)]
RigName = Literal["measured", "measured-free", "fitted"]
Norm = Literal["peak-to-peak", "maximum", "rms"]


class Cable(TypedModel):
    """Stiffness and friction of a rig's cables in their conduits."""

    stiffness_N_per_m: Positive
    friction_coefficient: Positive


class Motion(TypedModel):
    """Motion of the drive."""

    cycles: int = Field(ge=2)
    samples_per_cycle: int = Field(ge=20)


class Rig(TypedModel):
    """The paper's rig, as far as the paper states it, and the motion of its drive."""

    pulley_radius_m: Positive
    conduit_length_m: Positive
    cable_length_m: Positive
    bend_rad: Positive
    pretension_N: Positive
    cable_stiffness_N_per_m: Positive
    measured: Cable
    fitted: Cable
    encoder_step_rad: NotNegative
    torque_accuracy_Nm: NotNegative
    load_cell_accuracy_N: NotNegative
    torque_range_Nm: Positive
    load_cell_range_N: Positive
    motion: Motion

    @model_validator(mode="after")
    def _cable_reaches(self) -> Self:
        if self.cable_length_m < self.conduit_length_m:
            raise ValueError("a cable is at least as long as its conduit")
        return self

    @property
    def free_end_compliance(self) -> float:
        """Compliance of the free cable at one end, m/N."""
        free = (self.cable_length_m - self.conduit_length_m) / 2
        return free / (self.cable_stiffness_N_per_m * self.conduit_length_m)


class NotStated(TypedModel):
    """What the paper does not state of its half loop, and the values that are tried."""

    load_stiffness_Nm_per_rad: Some
    amplitude_rad: Some
    frequency_Hz: Some
    rigs: list[RigName] = Field(min_length=1)
    fit_over: list[Norm] = Field(min_length=1)


class Grid(TypedModel):
    """Values at which the effects are tried."""

    strengths: int = Field(ge=2)
    finer: int = Field(ge=0)
    beyond: float = Field(ge=1)
    shapes: list[Annotated[float, Field(ge=0, le=1)]] = Field(min_length=1)
    smallest_difference: float = Field(gt=0, lt=1)
    set_up_differences: list[Annotated[float, Field(gt=-1)]]


class Pairs(TypedModel):
    """Which effects are tried two at a time."""

    singles: int = Field(ge=0)
    shares: Some
    not_stated: NotStated


class TableOne(TypedModel):
    """The whole study; the errors that it looks for are those of the paper's table, if no others are stated."""

    pattern_percent: dict[Annotated[str, OneOf(TABLE_ONE)], Positive] = Field(
        default_factory=lambda: dict(PAPER_TABLE_ONE)
    )
    rounding_percent: Positive
    rig: Rig
    not_stated: NotStated
    grid: Grid
    pairs: Pairs

    @model_validator(mode="after")
    def _pattern_is_whole(self) -> Self:
        if missing := [c for c in TABLE_ONE if c not in self.pattern_percent]:
            raise ValueError(f"pattern_percent has no {', '.join(missing)}")
        return self
