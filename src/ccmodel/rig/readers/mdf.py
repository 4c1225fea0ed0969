"""MDF, the measurement data format of ASAM (versions 3 and 4): channel groups, each with its own time."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from ccmodel.rig.readers.columns import Columns
from ccmodel.rig.readers.contract import Format, SignalFile


def read(path: Path) -> SignalFile:
    """Read an MDF file; a sample that the file marks as invalid is nan."""
    from asammdf import MDF

    columns = Columns()
    with MDF(str(path)) as file:
        for index, group in enumerate(file.groups):
            _add_group(columns, file, index, group)
        started = file.header.start_time
    return SignalFile(tuple(columns.signals), _utc(started), columns.remarks())


FORMAT = Format("MDF file", (".mf4", ".mdf", ".dat", ".mf3"), read, extra="mdf", apart=True)


def _add_group(columns: Columns, file: Any, index: int, group: Any) -> None:
    master = file.masters_db.get(index)
    prefix = _group_name(group)
    wanted = [(None, index, i) for i in range(len(group.channels)) if i != master]
    # Names of states ("on", "off") stay the numbers that they stand for.
    for signal in file.select(wanted, copy_master=False, ignore_value2text_conversions=True):
        values = signal.samples
        time = signal.timestamps if master is not None else None
        name = prefix + signal.name
        if values.dtype.names:
            for field in values.dtype.names:
                columns.add(name if field == signal.name else f"{name}/{field}", signal.unit, values[field], time)
            continue
        if signal.invalidation_bits is not None and values.dtype.kind in "iufb":
            values = np.where(np.asarray(signal.invalidation_bits, bool), np.nan, values)
        columns.add(name, signal.unit, values, time)


def _group_name(group: Any) -> str:
    """Name of a channel group with a "/"; "" if the file names none."""
    name = str(getattr(group.channel_group, "acq_name", "") or "").strip()
    return f"{name}/" if name else ""


def _utc(started: datetime | None) -> datetime | None:
    """Absolute start; the year of a file without one is that of the epoch."""
    if started is None or started.year <= 1970:
        return None
    return started.astimezone(UTC) if started.tzinfo else started.replace(tzinfo=UTC)
