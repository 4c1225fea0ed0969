"""TDMS, the format of LabVIEW: groups of channels, each with its properties."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers.columns import BYTES_OF_A_NUMBER, Columns, listed
from ccmodel.rig.readers.content import Unpacked
from ccmodel.rig.readers.contract import Format, Signal, SignalFile
from ccmodel.rig.readers.stamps import earliest, moment, seconds_since

_UNIT_KEYS = ("unit_string", "NI_UnitDescription", "Unit", "unit", "Units", "units")
# LabVIEW counts from 1904 and leaves this zero where a start is not set.
_NO_START = np.datetime64("1904-01-02")


def read(path: Path) -> SignalFile:
    """Read a TDMS file; a channel with a waveform's start and step has its own time axis."""
    from nptdms import TdmsFile

    columns = Columns()
    # Of waveforms and of channels of absolute times, by the names of their signals.
    starts: dict[str, np.datetime64] = {}
    with TdmsFile.open(path) as file:
        if file.file_status.incomplete_final_segment:
            text = "the TDMS file is cut short: its last segment is incomplete; copy it again from the recorder"
            raise LogError(None, None, text)
        channels = [channel for group in file.groups() for channel in group.channels()]
        Unpacked().add(sum(map(_size, channels)))
        for channel in channels:
            _add(columns, channel, starts)
    zero = earliest([np.array(list(starts.values()), "datetime64[ns]")])
    signals = tuple(_from(zero, signal, starts) for signal in columns.signals)
    return SignalFile(signals, moment(zero), (*columns.remarks(), *_without_start(signals, starts)))


FORMAT = Format("TDMS file", (".tdms",), read, extra="tdms")


def _size(channel: Any) -> int:
    """Bytes of a channel and its times in memory; several channels may share their bytes in a file."""
    arrays = 0 if _is_text(channel) else 1 if _step(channel) is None else 2
    return arrays * len(channel) * BYTES_OF_A_NUMBER


def _is_text(channel: Any) -> bool:
    from nptdms.types import String

    return channel.data_type is String


def _step(channel: Any) -> float | None:
    """Time between the samples of a waveform, s; None if the channel is none."""
    step = channel.properties.get("wf_increment", 0)
    return float(step) if isinstance(step, int | float) and np.isfinite(step) and step > 0 else None


def _add(columns: Columns, channel: Any, starts: dict[str, np.datetime64]) -> None:
    name, properties = f"{channel.group_name}/{channel.name}", channel.properties
    unit = next((str(properties[k]) for k in _UNIT_KEYS if properties.get(k)), "")
    if _is_text(channel):
        columns.add(name, unit, None)
        return
    values = channel[:]
    if values.dtype.kind == "M":
        times = values.astype("datetime64[ns]")
        start = earliest([times])
        _note_start(starts, name, start)
        columns.add(name, "s", seconds_since(start, times))
        return
    time = None
    if (step := _step(channel)) is not None:
        time = float(properties.get("wf_start_offset", 0.0)) + step * np.arange(len(values))
        _note_start(starts, name, properties.get("wf_start_time"))
    columns.add(name, unit, values, time)


def _note_start(starts: dict[str, np.datetime64], name: str, start: Any) -> None:
    """Keep the start of a signal, if it is an absolute time."""
    if isinstance(start, np.datetime64) and start > _NO_START:
        starts[name] = start


def _from(zero: np.datetime64, signal: Signal, starts: Mapping[str, np.datetime64]) -> Signal:
    """A signal with its times, which count from their own start, counted from the zero of the file."""
    if signal.name not in starts:
        return signal
    late = (starts[signal.name] - zero) / np.timedelta64(1, "s")
    if signal.time_s is None:
        return replace(signal, values=signal.values + late, since_start=True)
    return replace(signal, time_s=signal.time_s + late)


def _without_start(signals: Sequence[Signal], starts: Mapping[str, np.datetime64]) -> tuple[str, ...]:
    """A remark on waveforms that state no start in a file where other channels do."""
    names = [s.name for s in signals if starts and s.time_s is not None and s.name not in starts]
    if not names:
        return ()
    return (f"waveforms without a start are taken to begin at the file's earliest time: {listed(names)}",)
