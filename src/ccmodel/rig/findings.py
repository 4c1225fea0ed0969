"""Findings: the faults of a batch and what became of the data."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple


class Defect(NamedTuple):
    """A fault of a log.

    Attributes
    ----------
    row : int or None
        Line of the file as an editor counts it, the header being row 1; None if it concerns no row in particular.
    column : str or None
        The column, None if it concerns no column in particular.
    text : str
        The fault and what became of the data.
    contradicts : bool
        Whether the log contradicts itself or `batch.yaml`, as a dead sensor does. A damaged file does not: what it
        lost says nothing about the rig.
    """

    row: int | None
    column: str | None
    text: str
    contradicts: bool = False


class LogError(Exception):
    """A log cannot be used; the arguments are those of `Defect`."""

    @property
    def defect(self) -> Defect:
        """What is wrong with the log."""
        return Defect(*self.args)


class FileError(LogError):
    """A file cannot be used; the arguments are those of `LogError`, and `file` is its name."""

    def __init__(self, file: str, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.file = file


Severity = Literal["warning", "refused", "inconsistent"]
# Word before a line on a finding.
WORD: dict[Severity, str] = {"warning": "warning", "refused": "refused", "inconsistent": "inconsistent"}


@dataclass(frozen=True)
class Finding:
    """A fault of a batch or log, for the user.

    Attributes
    ----------
    batch : str
        The batch.
    file : str
        The file with the fault.
    row, column, text
        See `Defect`.
    severity : str
        "warning" if the data are used, "refused" if they are not, "inconsistent" if they are read and contradict one
        another or `batch.yaml`.
    confidence : float
        Probability that a contradiction is one, from 0 to 1.
    contradicts : bool
        Of a refusal: whether the file is left out for what it says (`Defect`) and not because it is damaged.
    """

    batch: str
    file: str
    row: int | None
    column: str | None
    severity: Severity
    text: str
    confidence: float = 1.0
    contradicts: bool = False

    def __str__(self) -> str:
        return f"{self._place(self.file)}: {self.text}"

    @property
    def place(self) -> str:
        """File, row and column without the folder, as ``one.csv, row 3, drive_current_A``."""
        return self._place(Path(self.file).name)

    def place_in(self, several: bool) -> str:
        """The place, with the batch where `several` are taken together: ``loops/one.csv, row 3``."""
        return f"{self.batch}/{self.place}" if several else self.place

    @property
    def is_refused(self) -> bool:
        """Whether the data are not used."""
        return self.severity == "refused"

    @property
    def is_inconsistent(self) -> bool:
        """Whether no verdict on the physics can be drawn from the batch: its inputs contradict one another."""
        return self.severity == "inconsistent" or self.contradicts

    def _place(self, file: str) -> str:
        place = [file, f"row {self.row}" if self.row is not None else None, self.column]
        return ", ".join(p for p in place if p)
