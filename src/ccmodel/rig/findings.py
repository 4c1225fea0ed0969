"""Findings: the faults of a batch and what became of the data."""

from dataclasses import dataclass
from typing import Literal, NamedTuple


class Defect(NamedTuple):
    """A fault of a log that does not prevent its use.

    Attributes
    ----------
    row : int or None
        Line of the file as an editor counts it, the header being row 1; None if it concerns no row in particular.
    column : str or None
        The column, None if it concerns no column in particular.
    text : str
        The fault and what became of the data.
    """

    row: int | None
    column: str | None
    text: str


class LogError(Exception):
    """A log cannot be used; the arguments are those of `Defect`."""


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
        "warning" if the data are used, "refused" if they are not.
    """

    batch: str
    file: str
    row: int | None
    column: str | None
    severity: Literal["warning", "refused"]
    text: str

    def __str__(self) -> str:
        place = [self.file, f"row {self.row}" if self.row is not None else None, self.column]
        return f"{', '.join(p for p in place if p)}: {self.text}"
