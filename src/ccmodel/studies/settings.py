"""What the settings of every study state: what it needs and which files it makes."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Protocol

from ccmodel.typed import TypedModel

EACH = "each"


class FigureSettings(Protocol):
    """What studies read of one that is drawn as a figure (`ccmodel.studies.loops.settings.Study`)."""

    @property
    def batches(self) -> list[str] | str:
        """Batches in the figure, or `EACH`."""

    @property
    def variable(self) -> str:
        """What varies among the recordings."""


class Configuration(Protocol):
    """What studies read of the rest of the configuration (`ccmodel.config.Config`)."""

    @property
    def parameter_sets(self) -> list[str]:
        """All parameter sets."""

    @property
    def rigs(self) -> Mapping[str, Sequence[str]]:
        """Batches of one rig, by its name."""

    @property
    def studies(self) -> Mapping[str, FigureSettings]:
        """The studies that are drawn as figures, by name."""

    def sets_of(self, batch: str) -> list[str]:
        """Parameter sets of a batch."""

    def parameters_of(self, wanted: str | None, batch: str) -> str:
        """Name of the parameter set that a study takes for a batch, if it wants this one, or any."""


class StudySettings(TypedModel):
    """Base of a study's settings; in names of files, ``{name}`` stands for the study's name."""

    # Folder of the study in ccmodel.studies, and its heading in the page's navigation.
    kind: ClassVar[str]
    heading: ClassVar[str]
    # CSV files in results/tables; a study with tables also has a JSON file there, which its part of the page shows.
    tables: ClassVar[tuple[str, ...]] = ()
    # Figures in results/figures, each in every format (`ccmodel.figures.FORMATS`), and what they show: a plain
    # sentence or two for their caption.
    figures: ClassVar[tuple[str, ...]] = ("{name}",)
    shows: ClassVar[str] = ""

    @property
    def files(self) -> list[str]:
        """Files that the study reads, apart from those of its runs."""
        return []

    @property
    def state(self) -> str:
        """State of the project that the study reads and no file holds; another one makes the study again."""
        return ""

    def check(self, where: str, config: Configuration) -> None:
        """Refuse settings that do not fit the rest of the configuration.

        Parameters
        ----------
        where : str
            What the configuration calls the study, for the message.
        config : Configuration

        Raises
        ------
        ValueError
        """
        wanted = getattr(self, "parameters", None)
        if wanted is not None and wanted not in config.parameter_sets:
            raise ValueError(f"{where} asks for parameters '{wanted}'; there are {', '.join(config.parameter_sets)}")

    def caption(self) -> str:
        """What the study is, and what its figures show."""
        return f"{self.heading}. {self.shows}".strip()

    def needs(
        self, config: Configuration, studies: Mapping[str, "StudySettings"], batches: Sequence[str]
    ) -> list[tuple[str, str, str]]:
        """Label, parameter set and batch of every run that the study looks at.

        Parameters
        ----------
        config : Configuration
        studies : mapping of str to Study
            The figures of the configuration, by name.
        batches : sequence of str
            All batches.
        """
        return []
