"""What cases are drawn from (`proof/proof.yaml`), typed."""

from functools import cache
from pathlib import Path
from typing import Self

import yaml
from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from virtualrig.config import Repeatability
from virtualrig.effects import TWINS
from virtualrig.effects.contract import Range, Twin
from virtualrig.motion import Excitation
from virtualrig.strict import NonNegative, Share, Strict

PLAN = Path(__file__).with_name("proof.yaml")
UNLISTED = "unlisted-"


class RigPlan(Strict):
    """Ranges of the rig's values."""

    length_m: Range
    stiffness_N_per_m: Range
    friction_coefficient: Range
    load_stiffness_Nm_per_rad: Range
    pretension_N: Range
    bend_rad: Range
    pulley_radius_m: PositiveFloat
    density_kg_per_m: PositiveFloat
    load_inertia_kg_m2: PositiveFloat
    load_damping_Nms_per_rad: NonNegative


class EstimatesPlan(Strict):
    """By which share the stated stiffness and friction are off."""

    near: Range
    far: Range
    far_share: Share


class SensorsPlan(Strict):
    """The sensors, and ranges of their noise."""

    sample_rate_Hz: PositiveFloat
    counts_per_rev: PositiveInt
    constant_Nm_per_A: PositiveFloat
    torque_accuracy_Nm: PositiveFloat
    torque_noise_Nm: PositiveFloat
    sensitivity_V_per_N: PositiveFloat
    zero_V: float
    load_cell_accuracy_N: PositiveFloat
    load_cell_noise_N: PositiveFloat
    torque_range_Nm: PositiveFloat
    load_cell_range_N: PositiveFloat
    noise_factor: Range
    slow_ratio: Range
    slow_s: Range


class NumericsPlan(Strict):
    """The rig's numerics; the tension limit is a first one, raised where a run needs it."""

    cell_length_m: PositiveFloat
    cell_bend_rad: PositiveFloat
    bristle_length_m: PositiveFloat
    wave_damping: NonNegative
    drag_rate_per_s: NonNegative
    courant: PositiveFloat
    first_tension_limit_N: PositiveFloat


class MotionPlan(Strict):
    """What differs from recording to recording besides the protocol."""

    rest_s: Range
    start_up_cycles: Range
    amplitude_factor: Range
    frequency_factor: Range


class PlannedRecording(Strict):
    """A recording of a protocol; `pretension` and `bend` are factors of the case's own. `again` repeats another's."""

    id: str
    pretension: PositiveFloat
    bend: PositiveFloat
    motion: Excitation
    again: str | None = None


class Conditions(Strict):
    """Ranges of the factors of pretension and bend in which recordings are kept back."""

    pretension: Range
    bend: Range


class Protocol(Strict):
    """What is recorded of a case; a poor one cannot tell all effects apart."""

    recordings: tuple[PlannedRecording, ...] = Field(min_length=1)
    kept_back: Conditions
    bend_rad: Range | None = None
    poor: bool = False


class KeptBackPlan(Strict):
    """The motions that only the scorer sees."""

    recordings: PositiveInt
    amplitude_rad: Range
    frequency_Hz: Range
    spread: Range
    wandering_share: Share
    cycles: PositiveFloat
    turn_share: Share


class Asked(Strict):
    """A case with a seed of its own."""

    seed: PositiveInt
    kind: str
    effect: str | None = None


class Full(Strict):
    """The full proof: how many cases, and of these how many the page is of where nothing else is said."""

    cases: PositiveInt
    part: PositiveInt


class Plan(Strict):
    """All of it."""

    rig: RigPlan
    estimates: EstimatesPlan
    sensors: SensorsPlan
    repeatability: Repeatability
    numerics: NumericsPlan
    motion: MotionPlan
    kinds: dict[str, Share]
    protocol_shares: dict[str, Share]
    pair_strength: Range
    protocols: dict[str, Protocol]
    kept_back: KeptBackPlan
    order: tuple[str, ...]
    quick: tuple[Asked, ...]
    full: Full

    @property
    def effects(self) -> dict[str, Twin]:
        """Effects of the rig that a diagnosis may name, in the order in which they are drawn."""
        return {name: twin for name, twin in self._drawn() if not name.startswith(UNLISTED)}

    @property
    def unlisted(self) -> dict[str, Twin]:
        """Effects of the rig that no diagnosis knows."""
        return {name: twin for name, twin in self._drawn() if name.startswith(UNLISTED)}

    def _drawn(self) -> list[tuple[str, Twin]]:
        return [(name, TWINS[name]) for name in (*self.order, *sorted(TWINS.keys() - set(self.order)))]

    @model_validator(mode="after")
    def _order_is_of_effects(self) -> Self:
        if unknown := set(self.order) - TWINS.keys():
            raise ValueError(f"the virtual rig has no effect {', '.join(sorted(unknown))}")
        return self

    @model_validator(mode="after")
    def _shares_are_whole(self) -> Self:
        for what, shares in (("kinds", self.kinds), ("protocol_shares", self.protocol_shares)):
            if abs(sum(shares.values()) - 1) > 1e-9:
                raise ValueError(f"the shares of {what} add up to {sum(shares.values()):g}, not to 1")
        return self


@cache
def read_plan(path: Path = PLAN) -> Plan:
    """Read and check the plan."""
    return Plan.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))
