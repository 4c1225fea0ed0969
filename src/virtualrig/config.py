"""Typed configuration of the virtual rig, with the unit of every number in its name.

One file states everything that a recording was made with. Only effects and slow noise have a default, which is none. A
missing or unknown key is refused.
"""

from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, PositiveFloat, PositiveInt, model_validator
from ruamel.yaml import YAML

from virtualrig.effects import Effects
from virtualrig.motion import Excitation
from virtualrig.strict import NonNegative, Share, Strict


class Cable(Strict):
    """True parameters of both cables. The stiffness is that of a cable of `length_m`, so that EA is their product."""

    stiffness_N_per_m: PositiveFloat
    length_m: PositiveFloat
    friction_coefficient: PositiveFloat
    density_kg_per_m: PositiveFloat

    @property
    def EA_N(self) -> float:
        """Axial rigidity, N."""
        return self.stiffness_N_per_m * self.length_m


class Estimates(Strict):
    """The experimenter's estimates of the cables' parameters, which are stated in the batch and have errors."""

    stiffness_N_per_m: PositiveFloat
    length_m: PositiveFloat
    friction_coefficient: PositiveFloat


class Load(Strict):
    """The torsional spring at the load pulley, and the small inertia and damping of the rotating parts."""

    spring_stiffness_Nm_per_rad: PositiveFloat
    inertia_kg_m2: PositiveFloat
    damping_Nms_per_rad: NonNegative


class Rig(Strict):
    """Both pulleys, both cables, the load, and further effects; none by default."""

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
    """First-order autoregressive noise in addition to the white noise.

    `ratio` is its standard deviation over that of the white noise. Its autocorrelation falls to 1/e over
    `lasts_samples`.
    """

    ratio: NonNegative
    lasts_samples: PositiveFloat


class TorqueSensor(Strict):
    """A motor current, from which the pulley's torque is inferred."""

    constant_Nm_per_A: PositiveFloat
    accuracy_Nm: PositiveFloat
    noise_Nm: NonNegative
    range_Nm: PositiveFloat
    slow_noise: SlowNoise | None = None


class LoadCell(Strict):
    """A load cell between the slide and the conduit plate."""

    sensitivity_V_per_N: PositiveFloat
    zero_V: float
    accuracy_N: PositiveFloat
    noise_N: NonNegative
    range_N: PositiveFloat
    slow_noise: SlowNoise | None = None


class Sensors(Strict):
    """One set of sensors at each end. A `noise` is the standard deviation of white noise at the sampling rate."""

    sample_rate_Hz: PositiveFloat
    encoder: Encoder
    torque: TorqueSensor
    load_cell: LoadCell


class Repeatability(Strict):
    """Run-to-run variation between recordings of one condition.

    `friction` and `pretension` are relative standard deviations. `profile_share` holds the bounds of the initial
    profile, drawn for each cable: ln T falls from the drive end to the load end by this share of mu phi.
    `tensioned_before_s` holds the bounds of the time between tensioning and recording, in which the cables relax, and
    `ran_in_before` those of the time or travel before the recording over the scale of the running-in.
    `profile_curvature` holds the bounds of the initial profile's curvature, drawn for each cable: along the conduit the
    slope of ln T changes by twice this share of mu.
    """

    friction: Share
    pretension: Share
    profile_share: tuple[Share, Share]
    tensioned_before_s: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    ran_in_before: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    profile_curvature: tuple[float, float] = (0.0, 0.0)


class Numerics(Strict):
    """Grid, time step, and the bristles and damping that regularise rigid Coulomb friction."""

    cell_length_m: PositiveFloat
    cell_bend_rad: PositiveFloat
    bristle_length_m: PositiveFloat
    wave_damping: NonNegative
    drag_rate_per_s: NonNegative
    courant: Annotated[float, Field(gt=0, lt=1)]
    tension_limit_N: PositiveFloat


class Piece(Strict):
    """A piece of conduit of constant curvature. The bend of a straight piece is 0."""

    length_m: PositiveFloat
    bend_rad: NonNegative


class RecordingPlan(Strict):
    """Plan of one recording; `position` is its place in the session, -1/2 to 1/2, for what drifts."""

    id: str
    pretension_N: PositiveFloat
    conduit: tuple[Piece, ...] = Field(min_length=1)
    excitation: Excitation
    position: float = 0.0


Repeats = Annotated[int, Field(ge=1, le=26)]


class Condition(Strict):
    """One condition of a batch, recorded `repeats` times as `id`-a, `id`-b and so on.

    A condition may state an excitation and a number of repeats of its own, in place of the batch's.
    """

    id: str
    pretension_N: PositiveFloat
    conduit: tuple[Piece, ...] = Field(min_length=1)
    excitation: Excitation | None = None
    repeats: Repeats | None = None


class BatchPlan(Strict):
    """Plan of a batch: conditions, and the excitation and number of repeats of those that state none."""

    note: str
    excitation: Excitation
    conditions: tuple[Condition, ...] = Field(min_length=1)
    repeats: Repeats

    @property
    def recordings(self) -> list[RecordingPlan]:
        """Every recording of the batch, with the repeats of a condition in sequence."""
        return [
            RecordingPlan(
                id=f"{condition.id}-{letter}",
                pretension_N=condition.pretension_N,
                conduit=condition.conduit,
                excitation=condition.excitation or self.excitation,
            )
            for condition in self.conditions
            for letter in "abcdefghijklmnopqrstuvwxyz"[: condition.repeats or self.repeats]
        ]


class Concealed(Strict):
    """An effect of the rig that a diagnosis is not told.

    Attributes
    ----------
    name, place : str
        The mechanism that describes it, if any, and where it acts.
    sizes : mapping of str to (str, float, str)
        By quantity, the key of the campaign with its value ("rig.effects.drag_N"), and the factor to the printed unit.
    source : str
        Where the size comes from.
    """

    name: str | None
    place: str
    sizes: dict[str, tuple[str, PositiveFloat, str]] = Field(min_length=1)
    source: str


class Campaign(Strict):
    """A rig, its sensors and the batches that are recorded on it, by name."""

    seed: Annotated[int, Field(ge=0)]
    rig: Rig
    sensors: Sensors
    repeatability: Repeatability
    numerics: Numerics
    concealed: tuple[Concealed, ...] = ()
    batches: dict[str, BatchPlan]

    def value_of(self, key: str) -> float:
        """Value of a key with dots, as "repeatability.friction"; an index counts from 0.

        Raises
        ------
        ValueError
            If there is no such key, or no number.
        """
        value: Any = self
        for part in key.split("."):
            try:
                value = value[int(part)] if part.isdigit() else getattr(value, part)
            except (AttributeError, IndexError, TypeError):
                raise ValueError(f"concealed: the campaign has no '{key}'") from None
        if not isinstance(value, float | int):
            raise ValueError(f"concealed: '{key}' is no number")
        return value

    @model_validator(mode="after")
    def _sizes_are_stated(self) -> Self:
        for key, *_ in (size for effect in self.concealed for size in effect.sizes.values()):
            self.value_of(key)
        return self

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
