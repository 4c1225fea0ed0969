"""TDMS, the format of LabVIEW: groups of channels, each with its properties."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers.columns import BYTES_OF_A_NUMBER, Columns
from ccmodel.rig.readers.content import Unpacked
from ccmodel.rig.readers.contract import Format, Signal, SignalFile
from ccmodel.rig.readers.stamps import seconds_of_times

_UNIT_KEYS = ("unit_string", "NI_UnitDescription", "Unit", "unit", "Units", "units")


def read(path: Path) -> SignalFile:
    """Read a TDMS file; a channel with a waveform's start and step has its own time axis."""
    from nptdms import TdmsFile

    columns = Columns()
    starts: dict[str, np.datetime64] = {}
    with TdmsFile.open(path) as file:
        if file.file_status.incomplete_final_segment:
            text = "the TDMS file is cut short: its last segment is incomplete; copy it again from the recorder"
            raise LogError(None, None, text)
        channels = [channel for group in file.groups() for channel in group.channels()]
        Unpacked().add(sum(map(_size, channels)))
        for channel in channels:
            _add(columns, channel, starts)
    if not starts:
        return SignalFile(tuple(columns.signals), None, columns.remarks())
    signals, started = _from_the_first(columns.signals, starts)
    return SignalFile(signals, started, columns.remarks())


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
        seconds, start = seconds_of_times(values.astype("datetime64[ns]"))
        columns.add(name, "s", seconds)
        return
    time = None
    if (step := _step(channel)) is not None:
        time = float(properties.get("wf_start_offset", 0.0)) + step * np.arange(len(values))
        start = properties.get("wf_start_time")
        if isinstance(start, np.datetime64) and not np.isnat(start):
            starts[name] = start
    columns.add(name, unit, values, time)


def _from_the_first(
    signals: Sequence[Signal], starts: Mapping[str, np.datetime64]
) -> tuple[tuple[Signal, ...], datetime | None]:
    """Signals with their times from the earliest start of a waveform, and that start."""
    first = min(starts.values())
    zero = seconds_of_times(np.array([first]).astype("datetime64[ns]"))[1]
    late = {name: (start - first) / np.timedelta64(1, "s") for name, start in starts.items()}
    moved = (
        type(s)(s.name, s.unit, s.values, s.time_s + late[s.name]) if late.get(s.name) and s.time_s is not None else s
        for s in signals
    )
    return tuple(moved), zero
