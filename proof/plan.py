"""Typed settings of the draws (`proof/proof.yaml`)."""

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
    """Ranges of the rig's parameters."""

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
    """Relative errors of the stiffness and friction that a batch states; a share `far_share` of them is from `far`."""

    near: Range
    far: Range
    far_share: Share


class SensorsPlan(Strict):
    """The sensors, and the ranges of their noise."""

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


class RepeatsPlan(Strict):
    """Ranges of what differs from run to run, drawn for a case."""

    friction: Range
    pretension: Range


class PastPlan(Strict):
    """What comes before a recording: ranges of times over the time constants, and of the profile that motions leave."""

    relaxed_for: Range = (0.0, 0.0)
    ran_in_for: Range = (0.0, 0.0)
    profile_curvature: Range = (0.0, 0.0)


class NumericsPlan(Strict):
    """The rig's numerics. `first_tension_limit_N` is raised for a run that exceeds it."""

    cell_length_m: PositiveFloat
    cell_bend_rad: PositiveFloat
    bristle_length_m: PositiveFloat
    wave_damping: NonNegative
    drag_rate_per_s: NonNegative
    courant: PositiveFloat
    first_tension_limit_N: PositiveFloat


class MotionPlan(Strict):
    """Ranges of the motion within a protocol, drawn for each recording."""

    rest_s: Range
    start_up_cycles: Range
    amplitude_factor: Range
    frequency_factor: Range


class PlannedRecording(Strict):
    """A recording of a protocol.

    `pretension` and `bend` are factors of the case's own. `again` names the recording whose motion is repeated.
    """

    id: str
    pretension: PositiveFloat
    bend: PositiveFloat
    motion: Excitation
    again: str | None = None


class Conditions(Strict):
    """Ranges of the factors of pretension and bend for held-out recordings."""

    pretension: Range
    bend: Range


class Protocol(Strict):
    """The recordings of a case. A poor protocol cannot distinguish all effects."""

    recordings: tuple[PlannedRecording, ...] = Field(min_length=1)
    kept_back: Conditions
    bend_rad: Range | None = None
    poor: bool = False


class KeptBackPlan(Strict):
    """Motions of the held-out recordings, which only the scorer reads."""

    recordings: PositiveInt
    amplitude_rad: Range
    frequency_Hz: Range
    spread: Range
    wandering_share: Share
    cycles: PositiveFloat
    turn_share: Share


class FixedCase(Strict):
    """A case whose seed is fixed, and the verdict that its diagnosis must have, if one is stated."""

    seed: PositiveInt
    kind: str
    effect: str | None = None
    strength: Share | None = None
    verdict: str | None = None


class FamilyPlan(Strict):
    """A family: the kind and the number of its cases, and the strengths at which each effect comes."""

    kind: str
    cases: PositiveInt
    strengths: tuple[Share, ...] = Field(min_length=1)


class Full(Strict):
    """The full validation: its number of cases, and how many of them a run without further options takes."""

    cases: PositiveInt
    sample: PositiveInt


class Plan(Strict):
    """All settings of the draws."""

    rig: RigPlan
    estimates: EstimatesPlan
    sensors: SensorsPlan
    repeatability: Repeatability
    repeats: RepeatsPlan
    past: PastPlan = PastPlan()
    numerics: NumericsPlan
    motion: MotionPlan
    other_law_share: Share
    kinds: dict[str, Share]
    protocol_shares: dict[str, Share]
    strength_power: PositiveFloat
    pair_strength: Range
    protocols: dict[str, Protocol]
    kept_back: KeptBackPlan
    order: tuple[str, ...]
    quick: tuple[FixedCase, ...]
    full: Full
    families: dict[str, FamilyPlan]

    @property
    def effects(self) -> dict[str, Twin]:
        """Effects that a mechanism models, in the order in which they are drawn."""
        return {name: twin for name, twin in self._drawn() if not name.startswith(UNLISTED)}

    @property
    def unlisted(self) -> dict[str, Twin]:
        """Effects that no mechanism models, in the order in which they are drawn."""
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
