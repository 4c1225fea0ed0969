"""Settings of the model's accuracy: bias, scatter and comparison errors."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

from pydantic import Field

from ccmodel.studies.settings import StudySettings


class Accuracy(StudySettings):
    """How near the model is to the recordings, by the measures that other fields report."""

    kind: ClassVar = "accuracy"
    heading: ClassVar = "Accuracy"
    tables: ClassVar = ("{name}", "{name}-by-recording")
    figures: ClassVar = ("{name}", "{name}-ratio")

    parameters: str | None = Field(None, description="parameter set of the model; absent: the first fit's")
    coverage: float = Field(0.9, gt=0, lt=1, description="probability that an interval holds")
    coverage_factor: float = Field(2.0, gt=0, description="standard uncertainties that an error may have")

    def needs(self, config, studies: Mapping, batches: Sequence[str]) -> list[tuple[str, str, str]]:
        """Label, parameter set and batch of every run: all batches."""
        return [("", config.parameters_of(self), batch) for batch in batches]
