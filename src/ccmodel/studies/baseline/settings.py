"""Settings of the study of accuracy against the accepted baseline."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

from pydantic import Field

from ccmodel.accuracy.comparison import Limits
from ccmodel.accuracy.history import head
from ccmodel.accuracy.measure import NOT_ACCEPTED
from ccmodel.studies.settings import Configuration, StudySettings


class AgainstBaseline(StudySettings, Limits):
    """Accuracy of every batch, channel and parameter set against the accepted one, and over past commits."""

    kind: ClassVar = "baseline"
    heading: ClassVar = "Against the baseline"
    tables: ClassVar = ("{name}",)
    figures: ClassVar = ("accuracy-history",)
    shows: ClassVar = "Error of the model on each batch, over the project's commits; at the right, this run."

    file: str = Field("config/accuracy-baseline.json", description="accepted accuracy, written by 'accuracy accept'")
    history: str = Field("config/accuracy-history.csv", description="accuracy of past commits")

    @property
    def limits(self) -> Limits:
        """How sure a loss must be."""
        return Limits(coverage=self.coverage, reproducibility=self.reproducibility)

    @property
    def files(self) -> list[str]:
        """Files that the study reads, as far as they exist."""
        return [name for name in (self.file, self.history) if Path(name).exists()]

    @property
    def state(self) -> str:
        """Commit of the sources, which a baseline and a history state."""
        return head()[0]

    def needs(
        self, config: Configuration, studies: Mapping[str, StudySettings], batches: Sequence[str]
    ) -> list[tuple[str, str, str]]:
        """Rig, parameter set and batch of every run."""
        return [
            (_rig_of(config, batch), parameters, batch)
            for batch in batches
            for parameters in config.sets_of(batch)
            if parameters not in NOT_ACCEPTED
        ]


def _rig_of(config: Configuration, batch: str) -> str:
    """Name of a batch's rig: the one that lists it, or its own; without rigs, all batches are one."""
    return next((name for name, of in config.rigs.items() if batch in of), batch if config.rigs else "all")
