"""What a reader returns: the signals of a file, and what a module of a format states."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Literal

from numpy.typing import NDArray
from pydantic import Field

from ccmodel.typed import TypedModel


@dataclass(frozen=True)
class Signal:
    """One signal of a file.

    Attributes
    ----------
    name : str
        Unique within the file. Group and channel are joined by "/"; a unit in the name ("angle [deg]") is taken out.
    unit : str
        As the file states it; "" if it states none.
    values : ndarray, shape (n,)
        Numbers as floats, in `unit`; nan where the file has no number.
    time_s : ndarray, shape (n,), or None
        Time axis that the format stores with the signal, in s from the file's time zero. None if it stores none: time
        may then be another signal of the file.
    since_start : bool
        Whether its values are the time since the file's `started`, in s.
    """

    name: str
    unit: str
    values: NDArray
    time_s: NDArray | None = None
    since_start: bool = False


@dataclass(frozen=True)
class SignalFile:
    """The signals of a file.

    Attributes
    ----------
    signals : tuple of Signal
        In the order of the file.
    started : datetime or None
        Absolute time (UTC) of time zero, if the file states it.
    remarks : tuple of str
        What reading assumed or left out, a sentence each.
    rows : ndarray of int, shape (n,), or None
        Line of each sample in a text file, counted from 1; None for other formats.
    """

    signals: tuple[Signal, ...]
    started: datetime | None = None
    remarks: tuple[str, ...] = ()
    rows: NDArray | None = None


class TextLayout(TypedModel):
    """Layout of a text file; what is None is found from the file. Lines are counted from 1, as an editor does.

    Attributes
    ----------
    separator : str or None
        Between the cells: one character, or "whitespace" for any number of blanks and tabs.
    decimal : "." or ","
        Decimal sign.
    encoding : str or None
        Such as utf-8, utf-16 or cp1252.
    header_line : int or None
        Line of the names; 0 if there are none.
    unit_line : int or None
        Line of the units; 0 if there is none.
    first_line : int or None
        Line of the first sample.
    """

    separator: str | None = None
    decimal: Literal[".", ","] | None = None
    encoding: str | None = None
    header_line: Annotated[int, Field(ge=0)] | None = None
    unit_line: Annotated[int, Field(ge=0)] | None = None
    first_line: Annotated[int, Field(ge=1)] | None = None


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes
    ----------
    name : str
        In messages: "the {name} is damaged".
    suffixes : tuple of str
        Endings of its file names, the usual one first.
    read : callable
        Reads the file at a path (the text reader also takes a `TextLayout`) into a `SignalFile`. It may raise any
        exception for a damaged file; `LogError` if it can say more than that the file is damaged.
    extra : str or None
        Optional dependencies of the package that it needs.
    apart : tuple of str
        Its libraries, if they end the process on some damaged files: such a format is read in a process of its own.
    repair : str
        How a damaged file may be repaired, after "or".
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[..., SignalFile]
    extra: str | None = None
    apart: tuple[str, ...] = ()
    repair: str = ""
