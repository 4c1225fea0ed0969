"""The map of an import: what each column of a log is made of (`map.yaml`, `docs/how-to/import-logs.md`)."""

from collections.abc import Callable
from pathlib import Path, PurePath
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, field_validator, model_validator

from ccmodel.rig import units
from ccmodel.rig.batch import DRIVE_ANGLE_COLUMNS, RAW_COLUMNS, Format, Name, Sign
from ccmodel.rig.columns import CHANNELS, UNIT_OF
from ccmodel.rig.readers.contract import TextLayout
from ccmodel.typed import InputError, OneOf, Positive, Problem, TypedModel, load_yaml_model

# A drift of more than this is no drift of a clock but another unit.
LARGEST_DRIFT = 0.01
# The first file of a recording, where a map does not call it otherwise.
MAIN = "main"
Text = Annotated[str, Field(min_length=1)]


class TimeSource(TypedModel):
    """Where the times of a file's samples are: in a signal, or in a fixed rate.

    Attributes
    ----------
    signal : str or None
        Name of the signal.
    unit : str or None
        Its unit; None if the file states it.
    rate_Hz : float or None
        Samples per second of a file that holds no times.
    """

    signal: Text | None = None
    unit: Text | None = None
    rate_Hz: Positive | None = None

    @model_validator(mode="after")
    def _signal_or_rate(self) -> Self:
        if (self.signal is None) == (self.rate_Hz is None):
            raise ValueError("time is either a signal or a rate_Hz: state one of the two")
        if self.rate_Hz is not None and self.unit is not None:
            raise ValueError("unit is that of a time signal; a rate_Hz has none")
        if self.unit is not None:
            units.factor(self.unit, "s")
        return self


class Channel(TypedModel):
    """One column of the log: column = sign * gain * (signal - zero), converted from `unit` to the column's unit.

    Attributes
    ----------
    signal : str
        Name of the signal in the file.
    unit : str or None
        Unit of the signal; None if the file states it.
    sign : 1 or -1
        -1 if the signal counts against the signs of the format.
    gain : float, str or None
        A bare factor, or a factor with its unit such as "0.0234 N*m/A", which leads from another dimension to that of
        the column.
    zero : float
        Reading of the signal, in its unit, where the quantity is zero.
    delay_s : float
        Time by which the signal is late, s: its sample of time t shows what was at t - delay_s.
    file : str or None
        Which of a recording's files (a key of `files`, or "main"); None if only one has the signal.
    time : TimeSource or None
        Times of this signal, if they are not those of its file.
    """

    signal: Text
    unit: Text | None = None
    sign: Sign = 1
    gain: float | Text | None = None
    zero: float = 0.0
    delay_s: float = 0.0
    file: str | None = None
    time: TimeSource | None = None

    @field_validator("gain", mode="wrap")
    @classmethod
    def _a_number_with_or_without_a_unit(cls, stated: Any, read: Callable[[Any], Any]) -> float | str | None:
        try:
            gain = read(stated)
        # Otherwise a line for each of the two.
        except ValidationError:
            raise ValueError("must be a finite number, or one with its unit as '0.0234 N*m/A'") from None
        if gain == 0:
            raise ValueError("must not be zero")
        return gain

    def factor(self, column: str, stated_unit: str) -> float:
        """Factor from the signal's unit to that of `column`, with gain and sign.

        Parameters
        ----------
        column : str
            Column of the log.
        stated_unit : str
            Unit that the file states, "" if none; `unit` overrides it.

        Raises
        ------
        UnitError
            If there is no unit, or it does not lead to the column's.
        """
        unit, needed = self.unit or stated_unit, UNIT_OF[column]
        if not units.states_unit(unit) and not isinstance(self.gain, str):
            raise units.UnitError(f"the file states no unit of '{self.signal}': add unit, such as '{needed}'")
        if isinstance(self.gain, str):
            return self.sign * units.gain_factor(self.gain, unit, needed)
        try:
            return self.sign * (self.gain or 1.0) * units.factor(unit, needed)
        except units.UnitError as error:
            gain = f"{self.gain or 0.5:g} {needed}/{unit}"
            raise units.UnitError(f"{error}; to convert, state the gain with its unit, as '{gain}'") from None


class Clock(TypedModel):
    """Clock of a further file, against that of the recording's first: t_first = offset_s + (1 + drift) * t.

    Attributes
    ----------
    offset_s : float or None
        Time on the first file's clock at this file's time zero, s.
    drift : float
        Excess rate of the first file's clock; 1e-5 is 10 microseconds a second.
    match : tuple of str, or None
        The same quantity in both files, (signal here, signal of the first file): offset and drift are estimated.
    """

    offset_s: float | None = None
    drift: Annotated[float, Field(ge=-LARGEST_DRIFT, le=LARGEST_DRIFT)] = 0.0
    match: Annotated[tuple[Text, ...], Field(min_length=2, max_length=2)] | None = None

    @model_validator(mode="after")
    def _stated_or_estimated(self) -> Self:
        if (self.offset_s is None) == (self.match is None):
            raise ValueError("a clock has either an offset_s or a match of two signals: state one of the two")
        if self.match is not None and self.drift:
            raise ValueError("the drift of a matched clock is estimated: take it out")
        return self


class FileRule(TypedModel):
    """One of several files that make up a recording.

    Attributes
    ----------
    pattern : str
        Its name, with one `*` for the part that names the recording, such as "*_load.csv"; with its folder if the
        folder names the recording, such as "*/load.csv".
    time, text, clock
        As for the whole map, for this file.
    """

    pattern: Text
    time: TimeSource | None = None
    text: TextLayout | None = None
    clock: Clock | None = None

    @field_validator("pattern")
    @classmethod
    def _one_star(cls, pattern: str) -> str:
        if pattern.count("*") != 1:
            raise ValueError("needs one * for the part that names the recording, as '*_load.csv'")
        return pattern

    @property
    def depth(self) -> int:
        """Number of names in the pattern: 1 for that of the file, 2 with its folder."""
        return self.pattern.count("/") + 1

    def recording_of(self, path: PurePath) -> str | None:
        """Part of a file's path that the star stands for; None if the path does not fit."""
        name = "/".join(path.parts[-self.depth :])
        before, after = self.pattern.split("*")
        fits = name.startswith(before) and name.endswith(after) and len(name) > len(before) + len(after)
        return name[len(before) : len(name) - len(after)] if fits else None


class RecordingFiles(TypedModel):
    """A recording and the names of its files, the first of which has the clock of the log."""

    id: Name
    files: Annotated[tuple[Text, ...], Field(min_length=1)]


class ImportMap(TypedModel):
    """A whole `map.yaml`.

    Attributes
    ----------
    text : TextLayout or None
        Layout of text files; omitted keys are found from the file.
    time : TimeSource or None
        None if the files store the time of each sample.
    channels : dict
        Columns of the log.
    files : dict
        Only if one recording has several files: the further ones, by a name of one's choice. A file that fits no
        pattern is "main".
    recordings : tuple of RecordingFiles
        Empty if each main file is a recording of its own.
    """

    format: Format
    note: str | None = None
    text: TextLayout | None = None
    time: TimeSource | None = None
    channels: dict[Annotated[str, OneOf(CHANNELS)], Channel]
    files: dict[str, FileRule] = Field(default_factory=dict)
    recordings: tuple[RecordingFiles, ...] = ()

    @field_validator("channels", mode="before")
    @classmethod
    def _lines_left_to_be_confirmed(cls, channels: Any) -> Any:
        return {} if channels is None else channels

    @field_validator("recordings")
    @classmethod
    def _each_once(cls, recordings: tuple[RecordingFiles, ...]) -> tuple[RecordingFiles, ...]:
        ids = [r.id for r in recordings]
        files = [file for r in recordings for file in r.files]
        for what, names in (("id", ids), ("file", files)):
            if twice := sorted({name for name in names if names.count(name) > 1}):
                raise ValueError(f"{what} '{twice[0]}' is given twice")
        return recordings

    @model_validator(mode="after")
    def _each_quantity_once(self) -> Self:
        if not self.channels.keys() & set(DRIVE_ANGLE_COLUMNS):
            advice = "in a guessed map, take '# ' away from its line"
            columns = " or ".join(DRIVE_ANGLE_COLUMNS)
            raise ValueError(f"channels: the drive angle is missing: state {columns} ({advice})")
        for channel, raw in RAW_COLUMNS.items():
            both = [column for column in raw if column in self.channels]
            if channel in self.channels and both:
                raise ValueError(f"channels: {channel} and {both[0]} are the same quantity: keep one")
        return self

    @model_validator(mode="after")
    def _files_exist(self) -> Self:
        known = [MAIN, *self.files]
        for column, channel in self.channels.items():
            if channel.file is not None and channel.file not in known:
                raise ValueError(f"channels.{column}.file: '{channel.file}' is none of {', '.join(known)}")
        if MAIN in self.files:
            raise ValueError("files: 'main' is the file that fits no pattern: choose another name")
        return self

    def rule(self, role: str) -> FileRule | None:
        """Rule of one of a recording's files; None for the main one."""
        return self.files.get(role)


def load_map(path: Path) -> ImportMap:
    """Read a map.

    Raises
    ------
    InputError
        If it does not follow the format, a unit does not fit its column, or one signal is given to two columns; one
        line a problem.
    """
    loaded = load_yaml_model(path, ImportMap)
    if texts := [*_wrong_units(loaded), *_taken_twice(loaded)]:
        raise InputError.of(*(Problem(str(path), None, text) for text in texts))
    return loaded


def _wrong_units(stated: ImportMap) -> list[str]:
    texts = []
    for column, channel in stated.channels.items():
        try:
            if channel.unit is not None:
                channel.factor(column, channel.unit)
        except units.UnitError as error:
            texts.append(f"channels.{column}: {error}")
    return texts


def _taken_twice(stated: ImportMap) -> list[str]:
    by_signal: dict[tuple, list[str]] = {}
    for column, channel in stated.channels.items():
        by_signal.setdefault((channel.file or MAIN, channel.signal), []).append(column)
    return [
        f"signal '{signal}' is given to {' and '.join(columns)}: a sensor is one column"
        for (_, signal), columns in by_signal.items()
        if len(columns) > 1
    ]
