"""The virtual rig's configuration, typed: every number of a campaign with its unit in its name.

What a recording was made with stands in one file: nothing has a default here but effects and slow noise, which are not
there unless they are given, and a key that is missing, misspelt or of no use is refused.
"""

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, PositiveFloat, PositiveInt, model_validator
from ruamel.yaml import YAML

from virtualrig.effects import Effects
from virtualrig.motion import Excitation
from virtualrig.strict import NonNegative, Share, Strict


class Cable(Strict):
    """What the two cables truly are; stiffness is that of `length_m` of cable, so EA is their product."""

    stiffness_N_per_m: PositiveFloat
    length_m: PositiveFloat
    friction_coefficient: PositiveFloat
    density_kg_per_m: PositiveFloat

    @property
    def EA_N(self) -> float:
        """Tension per unit strain, N."""
        return self.stiffness_N_per_m * self.length_m


class Estimates(Strict):
    """What the experimenter measured beforehand and wrote into the batch: not what the cables truly are."""

    stiffness_N_per_m: PositiveFloat
    length_m: PositiveFloat
    friction_coefficient: PositiveFloat


class Load(Strict):
    """The torsional spring at the load pulley, and the little inertia and damping of what turns there."""

    spring_stiffness_Nm_per_rad: PositiveFloat
    inertia_kg_m2: PositiveFloat
    damping_Nms_per_rad: NonNegative


class Rig(Strict):
    """Both pulleys, both cables, the load, and what else the rig has: nothing, if `effects` is left out."""

    pulley_radius_m: PositiveFloat
    cable: Cable
    estimates: Estimates
    load: Load
    effects: Effects = Effects()


class Encoder(Strict):
    """An incremental encoder."""

    counts_per_rev: PositiveInt
    accuracy_rad: PositiveFloat


class SlowNoise(Strict):
    """Noise that wanders, besides the white: its standard deviation over that of the white, and how long it lasts.

    Its correlation falls to 1/e over `lasts_samples`.
    """

    ratio: NonNegative
    lasts_samples: PositiveFloat


class TorqueSensor(Strict):
    """A motor current that stands for the pulley's torque."""

    constant_Nm_per_A: PositiveFloat
    accuracy_Nm: PositiveFloat
    noise_Nm: NonNegative
    range_Nm: PositiveFloat
    slow_noise: SlowNoise | None = None


class LoadCell(Strict):
    """A load cell between slide and conduit plate."""

    sensitivity_V_per_N: PositiveFloat
    zero_V: float
    accuracy_N: PositiveFloat
    noise_N: NonNegative
    range_N: PositiveFloat
    slow_noise: SlowNoise | None = None


class Sensors(Strict):
    """One set at each end; `noise` is a standard deviation, white at the sampling rate; `slow_noise` comes on top."""

    sample_rate_Hz: PositiveFloat
    encoder: Encoder
    torque: TorqueSensor
    load_cell: LoadCell


class Repeatability(Strict):
    """How recordings of one condition differ from each other.

    `friction` and `pretension` are relative standard deviations from run to run. `profile_share` bounds the share of
    mu phi by which ln T falls from the drive end to the load end, drawn for each cable.
    """

    friction: Share
    pretension: Share
    profile_share: tuple[Share, Share]


class Numerics(Strict):
    """Grid, time step and what stands in for rigid Coulomb friction."""

    cell_length_m: PositiveFloat
    cell_bend_rad: PositiveFloat
    bristle_length_m: PositiveFloat
    wave_damping: NonNegative
    drag_rate_per_s: NonNegative
    courant: Annotated[float, Field(gt=0, lt=1)]
    tension_limit_N: PositiveFloat


class Piece(Strict):
    """A piece of conduit of constant curvature; a straight one has no bend."""

    length_m: PositiveFloat
    bend_rad: NonNegative


class RecordingPlan(Strict):
    """One recording to make."""

    id: str
    pretension_N: PositiveFloat
    conduit: tuple[Piece, ...] = Field(min_length=1)
    excitation: Excitation


class Condition(Strict):
    """One condition of a study, recorded `repeats` times as `id`-a, `id`-b and so on."""

    id: str
    pretension_N: PositiveFloat
    conduit: tuple[Piece, ...] = Field(min_length=1)


class BatchPlan(Strict):
    """A study: one excitation, the conditions it is applied under."""

    note: str
    excitation: Excitation
    conditions: tuple[Condition, ...] = Field(min_length=1)
    repeats: Annotated[int, Field(ge=1, le=26)]

    @property
    def recordings(self) -> list[RecordingPlan]:
        """Every recording of the batch, repeats of one condition side by side."""
        return [
            RecordingPlan(
                id=f"{condition.id}-{letter}",
                pretension_N=condition.pretension_N,
                conduit=condition.conduit,
                excitation=self.excitation,
            )
            for condition in self.conditions
            for letter in "abcdefghijklmnopqrstuvwxyz"[: self.repeats]
        ]


class Campaign(Strict):
    """A rig and all that is recorded on it, by batch name."""

    seed: Annotated[int, Field(ge=0)]
    rig: Rig
    sensors: Sensors
    repeatability: Repeatability
    numerics: Numerics
    batches: dict[str, BatchPlan]

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        for name, batch in self.batches.items():
            ids = [condition.id for condition in batch.conditions]
            if len(set(ids)) < len(ids):
                raise ValueError(f"batch {name} has two conditions of one id: {', '.join(ids)}")
        return self


def read_campaign(path: Path) -> Campaign:
    """Read and check a campaign's YAML file."""
    return Campaign.model_validate(YAML(typ="safe").load(Path(path)))
