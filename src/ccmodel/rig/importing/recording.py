"""One recording: the signals of its files become the columns of its log."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.rig import readers, units
from ccmodel.rig.batch import DRIVE_ANGLE_COLUMNS
from ccmodel.rig.columns import TIME, UNIT_OF, is_encoder
from ccmodel.rig.findings import FileError, LogError
from ccmodel.rig.importing.clocks import Clock, Cost, Samples, join
from ccmodel.rig.importing.map import MAIN, Channel, ImportMap, TimeSource
from ccmodel.rig.importing.matching import match_clocks
from ccmodel.rig.importing.sources import Source
from ccmodel.rig.readers.contract import Signal, SignalFile
from ccmodel.typed import nearest

# Times above this count from a calendar date; two files of the same zero then share a clock.
_CALENDAR_S = 1e8
# Counts may differ from whole numbers as far as the angle they are made from was rounded.
_WHOLE = 0.1


@dataclass(frozen=True)
class Built:
    """A recording as an import writes it.

    Attributes
    ----------
    table : DataFrame, shape (n, columns)
        The log: `time_s` first, then the columns in the order of the map.
    started_s : float
        Time of the first sample on the clock of the first file, s.
    formulas : dict of str to str
        What each column is made of.
    costs : list of Cost
        Of the columns that were joined.
    cut_s : tuple of two floats
        Time cut at the start and at the end, s.
    remarks : list of str
        What reading and joining assumed, a sentence each.
    """

    table: pd.DataFrame
    started_s: float
    formulas: dict[str, str]
    costs: list[Cost]
    cut_s: tuple[float, float]
    remarks: list[str]


@dataclass(frozen=True)
class ReadFile:
    """A file of a recording, as it was read.

    Attributes
    ----------
    role, name : str
        Role in the recording; name for messages.
    read : SignalFile
        Its signals.
    time : TimeSource or None
        The times that the map states for it.
    """

    role: str
    name: str
    read: SignalFile
    time: TimeSource | None

    @property
    def signals(self) -> dict[str, Signal]:
        """Its signals by name."""
        return {signal.name: signal for signal in self.read.signals}

    @property
    def started(self) -> datetime | None:
        """Absolute time at which this file's clock is zero; None if it is not known."""
        time = self.time and self.signals.get(self.time.signal or "")
        return self.read.started if self.time is None or (time and time.since_start) else None

    def signal(self, name: str) -> Signal:
        """A signal by its name; `FileError` with the nearest names if it is not there."""
        if name in self.signals:
            return self.signals[name]
        close = nearest(name, self.signals, 0.6)
        hint = f"did you mean '{close}'?" if close else f"it has {_few(list(self.signals))}"
        raise FileError(self.name, None, None, f"has no signal '{name}'; {hint}")

    def check_times(self, signal: Signal, stated: TimeSource | None) -> None:
        """Check that the times of a signal increase.

        A row that repeats the one before does no harm: reading a log drops it.

        Raises
        ------
        FileError
            With the row, or the sample in a file without rows, and both times in the unit of the file.
        """
        source = stated or self.time
        if source is not None and source.signal is None:
            return
        clock = self.signal(source.signal or "") if source else signal
        unit = (source.unit or clock.unit) if source else "s"
        times = clock.values if source or signal.time_s is None else signal.time_s
        has = np.flatnonzero(np.isfinite(times) & np.isfinite(signal.values))
        step, change = np.diff(times[has]), np.diff(signal.values[has])
        wrong = np.flatnonzero((step < 0) | ((step == 0) & (change != 0)))
        if not wrong.size:
            return
        before, at = has[wrong[0]], has[wrong[0] + 1]
        row = None if self.read.rows is None else int(self.read.rows[at])
        place = f" (sample {at + 1})" if row is None else ""
        text = f"the times of '{clock.name}' must increase: {times[at]:.9g} {unit} after {times[before]:.9g} {unit}"
        raise FileError(self.name, row, None, text + place)

    def times(self, signal: Signal, stated: TimeSource | None) -> NDArray:
        """Times of a signal on this file's clock, s: those stated for it, those of the file, or its own axis."""
        source = stated or self.time
        if source is None:
            if signal.time_s is None:
                text = "stores no times: state 'time' in the map, a signal with its unit or a rate_Hz"
                raise FileError(self.name, None, None, text)
            return signal.time_s
        if source.rate_Hz is not None:
            return np.arange(signal.values.size) / source.rate_Hz
        clock = self.signal(source.signal or "")  # a time has a signal or a rate
        if clock.values.size != signal.values.size:
            text = f"'{signal.name}' has {signal.values.size} samples and its time '{clock.name}' {clock.values.size}"
            raise FileError(self.name, None, None, f"{text}: state the channel's own 'time' in the map")
        unit = source.unit or clock.unit
        if not units.states_unit(unit):
            raise FileError(self.name, None, None, f"states no unit of the time '{clock.name}': add it to the map")
        try:
            return clock.values * units.factor(unit, "s")
        except units.UnitError as error:
            raise FileError(self.name, None, None, f"the time '{clock.name}': {error}") from None


def build(source: Source, stated: ImportMap, names: Mapping[Path, str]) -> Built:
    """Read the files of a recording and make the columns of its log.

    Parameters
    ----------
    source : Source
        The recording and its files.
    stated : ImportMap
        The map.
    names : mapping of Path to str
        Names of the files, for messages.

    Returns
    -------
    Built
        The log and what it is made of.

    Raises
    ------
    FileError
        If a file cannot be read, lacks a signal, or its clock cannot be joined to that of the others.
    """
    files = {role: _read(role, path, stated, names[path]) for role, path in source.files.items()}
    remarks = [f"{file.name}: {remark}" for file in files.values() for remark in file.read.remarks]
    first = next(iter(files.values()))
    clocks = {role: _clock(file, first, stated, remarks) for role, file in files.items()}
    drive = next(column for column in DRIVE_ANGLE_COLUMNS if column in stated.channels)
    order = [drive, *(column for column in stated.channels if column != drive)]
    samples, formulas = [], {}
    for column in order:
        one, formulas[column] = _samples(column, stated.channels[column], files, clocks, remarks)
        samples.append(one)
    joined = join(samples)
    table = pd.DataFrame({TIME: joined.time_s} | {c: joined.columns[c] for c in stated.channels})
    started = float(samples[0].time_s[0] + joined.cut_s[0])
    return Built(table, started, formulas, joined.costs, joined.cut_s, remarks + joined.remarks)


def _read(role: str, path: Path, stated: ImportMap, name: str) -> ReadFile:
    rule = stated.rule(role)
    try:
        read = readers.read_signals(path, (rule and rule.text) or stated.text)
    except LogError as error:
        raise FileError(name, *error.args) from None
    time = rule.time if rule else None
    if time is None and stated.time is not None:
        here = {signal.name for signal in read.signals}
        # A time for all files of a recording is that of the files that have it; others store their own.
        if role == MAIN or stated.time.signal in here or all(s.time_s is None for s in read.signals):
            time = stated.time
    return ReadFile(role, name, read, time)


def _samples(
    column: str, channel: Channel, files: Mapping[str, ReadFile], clocks: Mapping[str, Clock], remarks: list[str]
) -> tuple[Samples, str]:
    """One column before it is joined, and its formula."""
    file = _file_of(channel, files)
    signal = file.signal(channel.signal)
    try:
        factor = channel.factor(column, signal.unit)
    except units.UnitError as error:
        raise FileError(file.name, None, column, str(error)) from None
    unit = channel.unit or signal.unit
    if channel.unit and units.is_unit(signal.unit) and signal.unit != channel.unit and _differ(unit, signal.unit):
        remarks.append(f"{file.name}: '{signal.name}' is taken in {unit} as the map says; the file says {signal.unit}")
    times = clocks[file.role].on_first(file.times(signal, channel.time)) - channel.delay_s
    file.check_times(signal, channel.time)
    known = np.isfinite(times)
    if (timeless := np.flatnonzero(~known & np.isfinite(signal.values))).size:
        more = f" (and {timeless.size - 1} more)" if timeless.size > 1 else ""
        text = f"'{signal.name}': sample {timeless[0] + 1} of {known.size} has no time{more}: the file is damaged"
        raise FileError(file.name, None, None, text)
    values = (signal.values[known] - channel.zero) * factor
    if is_encoder(column):
        values = _whole(values, file.name, column)
    times = times if known.all() else times[known]
    samples = Samples(
        column, signal.name, file.name, times, values, is_encoder(column), clocks[file.role], channel.delay_s
    )
    return samples, _formula(channel, unit, factor, column)


def _file_of(channel: Channel, files: Mapping[str, ReadFile]) -> ReadFile:
    if channel.file is not None:
        return files[channel.file]
    having = [file for file in files.values() if channel.signal in file.signals]
    if len(having) > 1:
        text = f"'{channel.signal}' is also in {having[1].name}: state the channel's 'file', {_few(list(files))}"
        raise FileError(having[0].name, None, None, text)
    return having[0] if having else next(iter(files.values()))


def _differ(one: str, other: str) -> bool:
    try:
        return units.factor(one, other) != 1.0
    except units.UnitError:
        return True


def _whole(values: NDArray, file: str, column: str) -> NDArray:
    whole = np.round(values)
    off = np.abs(values - whole) > _WHOLE
    if off.any():
        at = int(np.argmax(off))
        text = f"must be whole counts, found {values[at]:.6g} at sample {at + 1}: give an angle as theta_in_rad"
        raise FileError(
            file, None, column, text if column in DRIVE_ANGLE_COLUMNS else text.replace("theta_in", "theta_out")
        )
    return whole


def _formula(channel: Channel, unit: str, factor: float, column: str) -> str:
    zero = "" if channel.zero == 0 else f" - {channel.zero:g}"
    reading = f"({channel.signal}{zero})" if zero else channel.signal
    return f"{factor:.12g} {UNIT_OF[column]}/{unit or '1'} * {reading}"


def _clock(file: ReadFile, first: ReadFile, stated: ImportMap, remarks: list[str]) -> Clock:
    """Clock of a file: stated, matched, from absolute times, or taken to start with the first file."""
    if file is first:
        return Clock()
    rule = stated.rule(file.role)
    if rule and rule.clock and rule.clock.match:
        return match_files(file, first, rule.clock.match)
    if rule and rule.clock and rule.clock.offset_s is not None:
        return Clock(rule.clock.offset_s, rule.clock.drift, None, None, "stated in the map")
    if file.started and first.started:
        started = file.started, first.started
        offset = (started[0] - started[1]).total_seconds()
        return Clock(offset, 0.0, max(map(_resolution_s, started)), None, "absolute start times of both files")
    begins = [_first_time(f) for f in (file, first)]
    if min(begins) > _CALENDAR_S:
        return Clock(0.0, 0.0, None, None, "both count from the same date")
    text = f"taken to start together with {first.name}; state 'clock' in the map if not"
    remarks.append(f"{file.name}: {text}")
    return Clock(begins[1] - begins[0], 0.0, None, None, "taken to start together")


def match_files(file: ReadFile, first: ReadFile, match: Sequence[str]) -> Clock:
    """Clock of a file from a quantity that both have.

    Parameters
    ----------
    file, first : ReadFile
        A further file of a recording, and its first.
    match : sequence of two str
        Names of the signals, that of the further file first.

    Raises
    ------
    FileError
        If the two do not show one clock.
    """
    here, there = file.signal(match[0]), first.signal(match[1])
    try:
        return match_clocks(file.times(here, None), here.values, first.times(there, None), there.values)
    except FileError:
        raise
    except LogError as error:
        raise FileError(file.name, *error.args) from None


def _first_time(file: ReadFile) -> float:
    """Time of a file's first sample on its own clock, s."""
    if file.time is not None and file.time.signal is not None:
        clock = file.signal(file.time.signal)
        return float(np.nanmin(file.times(clock, None)))
    if file.time is not None:
        return 0.0
    starts = [float(np.nanmin(s.time_s)) for s in file.read.signals if s.time_s is not None and s.time_s.size]
    if not starts:
        raise FileError(file.name, None, None, "stores no times: state 'time' for it in section 'files' of the map")
    return min(starts)


def _resolution_s(moment: datetime) -> float:
    """Resolution with which a start time is stated, s."""
    if moment.microsecond == 0:
        return 1.0
    return 1e-3 if moment.microsecond % 1000 == 0 else 1e-6


def _few(names: list[str]) -> str:
    return ", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")
