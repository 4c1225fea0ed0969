"""MDF, the measurement data format of ASAM (versions 3 and 4): channel groups, each with its own time."""

import mmap
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from ccmodel.rig.readers.columns import BYTES_OF_A_NUMBER, Columns
from ccmodel.rig.readers.content import Unpacked
from ccmodel.rig.readers.contract import Format, SignalFile

# First bytes of a compressed block of data of version 4, and its header: kind of the data in it, way of compression, a
# parameter, and the sizes of what is inside and of what is in the file. Ways of zlib.
_PACKED, _HEADER, _HEADER_AT, _ZLIB = b"##DZ", "<2sBBIQQ", 24, (0, 1)
# Bytes that are unpacked at a time.
_PIECE = 1 << 20
# Type of a channel of version 4 whose values have any length, as texts have.
_ANY_LENGTH = 1
# What a master of version 4 is: its time, and not an angle, a distance or an index.
_TIME = 1


def read(path: Path) -> SignalFile:
    """Read an MDF file; a sample that the file marks as invalid is nan."""
    from asammdf import MDF

    _count_packed(path)
    columns = Columns()
    with MDF(str(path)) as file:
        Unpacked().add(sum(map(_size, file.groups)))
        for index, group in enumerate(file.groups):
            _add_group(columns, file, index, group)
        started = file.header.start_time
    return SignalFile(tuple(columns.signals), _utc(started), columns.remarks())


FORMAT = Format("MDF file", (".mf4", ".mdf", ".dat", ".mf3"), read, extra="mdf", apart=("asammdf",))


def _count_packed(path: Path) -> None:
    """Raise `LogError` if the compressed blocks of a file unpack to more than the limit; some are read on opening it.

    Nothing of it is kept. A damaged block is left to the library.
    """
    unpacked = Unpacked()
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        for at in _found(content, _PACKED):
            with suppress(struct.error, zlib.error):
                _, way, _, _, inside, size = struct.unpack_from(_HEADER, content, at + _HEADER_AT)
                start = at + _HEADER_AT + struct.calcsize(_HEADER)
                if way in _ZLIB:
                    _count_zlib(content[start : start + size], unpacked)
                else:
                    unpacked.add(inside)


def _found(content: mmap.mmap, word: bytes) -> Iterator[int]:
    at = content.find(word)
    while at >= 0:
        yield at
        at = content.find(word, at + 1)


def _count_zlib(packed: bytes, unpacked: Unpacked) -> None:
    stream = zlib.decompressobj()
    while packed:
        unpacked.add(len(stream.decompress(packed, _PIECE)))
        packed = stream.unconsumed_tail


def _size(group: Any) -> int:
    """Bytes of a group in memory: its records, or its channels as numbers, which may share their bytes in a record."""
    block = group.channel_group
    record = block.samples_byte_nr + getattr(block, "invalidation_bytes_nr", 0)
    return int(block.cycles_nr) * max(int(record), len(group.channels) * BYTES_OF_A_NUMBER)


def _add_group(columns: Columns, file: Any, index: int, group: Any) -> None:
    time_at = _time_channel(file, index, group)
    prefix = _group_name(group)
    wanted = []
    for i, channel in enumerate(group.channels):
        if file.version >= "4" and channel.channel_type == _ANY_LENGTH:
            # An array of texts is as wide as the longest of them.
            columns.add(prefix + channel.name, "", None)
        elif i != time_at:
            wanted.append((None, index, i))
    # Names of states ("on", "off") stay the numbers that they stand for.
    for signal in file.select(wanted, copy_master=False, ignore_value2text_conversions=True):
        values = signal.samples
        time = signal.timestamps if time_at is not None else None
        name = prefix + signal.name
        if values.dtype.names:
            for field in values.dtype.names:
                columns.add(name if field == signal.name else f"{name}/{field}", signal.unit, values[field], time)
            continue
        if signal.invalidation_bits is not None and values.dtype.kind in "iufb":
            values = np.where(np.asarray(signal.invalidation_bits, bool), np.nan, values)
        columns.add(name, signal.unit, values, time)


def _time_channel(file: Any, index: int, group: Any) -> int | None:
    """Index of the channel that is the time of a group; the master of one of version 4 may be something else."""
    master = file.masters_db.get(index)
    if master is None or file.version < "4" or group.channels[master].sync_type == _TIME:
        return master
    return None


def _group_name(group: Any) -> str:
    """Name of a channel group with a "/"; "" if the file names none."""
    name = str(getattr(group.channel_group, "acq_name", "") or "").strip()
    return f"{name}/" if name else ""


def _utc(started: datetime | None) -> datetime | None:
    """Absolute start; the year of a file without one is that of the epoch."""
    if started is None or started.year <= 1970:
        return None
    return started.astimezone(UTC) if started.tzinfo else started.replace(tzinfo=UTC)
