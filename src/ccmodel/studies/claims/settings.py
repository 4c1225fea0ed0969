"""Settings of the paper's statements: the studies that they are judged by, limits, and the runs of the model alone."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

from pydantic import Field

from ccmodel.studies.settings import EACH, Configuration, StudySettings
from ccmodel.typed import TypedModel


class ModelStudies(TypedModel):
    """Runs of the model alone, for what no recording varies; a drive that moves as a sine."""

    pretension_N: float = Field(gt=0, description="tension before the drive moves, N")
    amplitude_rad: float = Field(gt=0, description="amplitude of the drive, rad")
    cycles: int = Field(3, ge=2, description="cycles of the drive; the last one counts")
    samples_a_cycle: int = Field(1000, ge=100, description="samples a cycle")
    conduit_length_m: float = Field(gt=0, description="length of the conduit, m")
    bend_rad: float = Field(gt=0, description="bend of the one loop, rad")
    loop_radius_m: float = Field(gt=0, description="radius of the one loop where it is placed along the conduit, m")
    load_stiffness_Nm_per_rad: list[float] = Field(min_length=2, description="springs at the load, N m/rad")
    sections: list[int] = Field(min_length=2, description="sections of a cable in the paper's discretisation")
    sections_bend_rad: list[float] = Field(min_length=1, description="bends that the sections are counted for, rad")
    sections_error_percent: float = Field(gt=0, description="error that is small enough, % of peak to peak")


class Claims(StudySettings):
    """What the paper says in words, to be put in numbers."""

    kind: ClassVar = "claims"
    heading: ClassVar = "The paper in numbers"
    tables: ClassVar = ("{name}",)
    figures: ClassVar = ("{name}", "{name}-model")
    shows: ClassVar = (
        "Quantities of the paper's statements over bend, pretension and radius: means over the recordings with their"
        " intervals, and the model of the same recordings. The second figure shows the model alone (simulated)."
    )

    bend: str = Field(description="study in which the number of loops varies")
    pretension: str = Field(description="study in which the pretension varies")
    radius: str = Field(description="study in which the loop radius varies")
    coverage: float = Field(0.9, gt=0, lt=1, description="probability that an interval holds")
    small_percent: float = Field(gt=0, description="a change below this is none to speak of, % of the mean")
    seen_percent: float = Field(1.0, gt=0, description="a phase that takes less of the cycle is not seen, %")
    model: ModelStudies = Field(description="runs of the model alone")

    @property
    def studies(self) -> dict[str, str]:
        """Name of the study that each variable varies in."""
        return {"bend": self.bend, "pretension": self.pretension, "radius": self.radius}

    def check(self, where: str, config: Configuration) -> None:
        """Refuse studies that do not exist, draw each batch by itself or vary something else."""
        for variable, name in self.studies.items():
            study = config.studies.get(name)
            if study is None or study.batches == EACH:
                raise ValueError(f"{where}.{variable}: '{name}' is no study of named batches")
            if study.variable != variable:
                raise ValueError(f"{where}.{variable}: study '{name}' varies {study.variable}")

    def needs(
        self, config: Configuration, studies: Mapping[str, StudySettings], batches: Sequence[str]
    ) -> list[tuple[str, str, str]]:
        """Variable, parameter set and batch of every run of the three studies."""
        return [
            (variable, parameters, batch)
            for variable, study in self.studies.items()
            for _, parameters, batch in studies[study].needs(config, studies, batches)
        ]
