"""Settings of the figures of loops, and of how loops are measured."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from ccmodel.studies.settings import Configuration, StudySettings
from ccmodel.typed import TypedModel

Variable = Literal["bend", "pretension", "radius", "frequency", "load_level", "recording"]
Figure = Literal["transmission", "torque-loops", "torque-loops-apart", "drive-loops"]


class Study(StudySettings):
    """One figure: which batches, what varies among their recordings, how it is drawn."""

    kind: ClassVar = "loops"
    heading: ClassVar = "Figures"
    shows: ClassVar = (
        "Loops of the last whole cycle of each recording (wide, pale) and of the model of it (thin), and the residuals,"
        " model minus recording, over the time of the loop. Without a cycle, the whole motion is drawn."
    )

    batches: list[str] | Literal["each"] = Field(description="batches in the figure; 'each': one figure a batch")
    variable: Variable = Field("recording", description="what varies, and names the recordings in the legend")
    figure: Figure = Field("torque-loops", description="how it is drawn")
    parameters: str | None = Field(None, description="parameter set of the model; absent: each batch's default")
    rows: Variable | None = Field(None, description="a panel for each value of this")
    title: str = Field("", description="what the figure shows, in a few words")

    @model_validator(mode="after")
    def _rows_are_drawn(self) -> Self:
        if self.rows is not None and self.figure not in ("torque-loops", "drive-loops"):
            raise ValueError(f"figure '{self.figure}' has no rows; leave 'rows' out")
        return self

    def caption(self) -> str:
        """Title of the study, its batches, and what its figure shows."""
        return f"{self.title}: {', '.join(self.batches)}. {self.shows}"

    def needs(
        self, config: Configuration, studies: Mapping[str, StudySettings], batches: Sequence[str]
    ) -> list[tuple[str, str, str]]:
        """Label, parameter set and batch of every run in the figure."""
        return [("", config.parameters_of(self.parameters, batch), batch) for batch in self.batches]


class Measuring(TypedModel):
    """How loops are measured; the same for recordings and models."""

    smoothing_share: float = Field(
        0.02, ge=0, lt=0.2, description="share of a cycle that the moving mean over every channel takes"
    )
    middle_share: float = Field(
        0.1, gt=0, lt=0.5, description="width and slope: half the band about the middle, as a share of peak to peak"
    )
    moved_share: float = Field(
        0.1,
        gt=0,
        lt=0.33,
        description="the load follows once it has moved by this share of its peak to peak since a reversal",
    )
    closed_share: float = Field(
        0.05, gt=0, lt=1, description="a cycle ends where it began, to this share of the drive's peak to peak"
    )
    slack_below_N: float = Field(0.1, gt=0, description="a cable with less tension than this at the load is slack, N")
    fewest_samples: int = Field(10, ge=3, description="samples that a line needs at least")
