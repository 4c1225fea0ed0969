"""Settings of the study of the model's accuracy: bias, scatter and comparison errors."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

from pydantic import Field

from ccmodel.studies.settings import Configuration, StudySettings


class Accuracy(StudySettings):
    """Accuracy of the model against recordings, by the measures of NIST SP 1018-3 and ASME V&V 20."""

    kind: ClassVar = "accuracy"
    heading: ClassVar = "Accuracy"
    tables: ClassVar = ("{name}", "{name}-by-recording")
    figures: ClassVar = ("{name}", "{name}-ratio")
    shows: ClassVar = (
        "Simulated over recorded quantities of the last cycle of each recording, and their ratio, with the model's bias"
        " and scatter and the stated uncertainty of the recordings."
    )

    parameters: str | None = Field(None, description="parameter set of the model; absent: each batch's default")
    coverage: float = Field(0.9, gt=0, lt=1, description="coverage probability of the intervals of the bias factor")
    coverage_factor: float = Field(
        2.0, gt=0, description="a comparison error up to this many validation uncertainties u_val is not resolved"
    )

    def needs(
        self, config: Configuration, studies: Mapping[str, StudySettings], batches: Sequence[str]
    ) -> list[tuple[str, str, str]]:
        """Label, parameter set and batch of every run: one run of each batch with the set, with an empty label."""
        named = [(config.parameters_of(self.parameters, batch), batch) for batch in batches]
        return [("", parameters, batch) for parameters, batch in named if parameters in config.sets_of(batch)]
