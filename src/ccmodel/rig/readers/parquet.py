"""Parquet: a table of columns, with units in the metadata of the fields."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from ccmodel.rig.readers.content import check_unpacked
from ccmodel.rig.readers.contract import Format, Signal, SignalFile
from ccmodel.rig.readers.stamps import seconds_of_times

BYTES_OF_A_NUMBER = 8
_UNIT_KEYS = (b"unit", b"units", b"Unit", b"Units")


def read(path: Path) -> SignalFile:
    """Read a Parquet file; structures are flattened, lists of one length are a signal an element."""
    file = pq.ParquetFile(path)
    # A column of one value takes next to nothing in the file, whatever its length.
    check_unpacked(file.metadata.num_rows * file.metadata.num_columns * BYTES_OF_A_NUMBER)
    table = file.read()
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    signals, left_out, started = [], [], None
    for field, column in zip(table.schema, table.columns, strict=True):
        name = field.name.replace(".", "/") if "." in field.name else field.name
        unit = _unit(field)
        values = column.combine_chunks()
        if pa.types.is_dictionary(values.type):
            values = values.dictionary_decode()
        if pa.types.is_timestamp(values.type):
            seconds, start = seconds_of_times(
                values.cast(pa.timestamp("ns"), safe=False).to_numpy(zero_copy_only=False)
            )
            started = started or start
            signals.append(Signal(name, "s", seconds))
        elif pa.types.is_temporal(values.type):
            signals.append(Signal(name, "s", _seconds(values)))
        elif pa.types.is_fixed_size_list(values.type):
            width = values.type.list_size
            signals += [Signal(f"{name}/{i}", unit, _floats(pc.list_element(values, i))) for i in range(width)]
        elif _is_number(values.type):
            signals.append(Signal(name, unit, _floats(values)))
        else:
            left_out.append(name)
    remarks = [f"columns without numbers are left out: {', '.join(left_out)}"] if left_out else []
    return SignalFile(tuple(signals), started, tuple(remarks))


FORMAT = Format("Parquet file", (".parquet", ".pq"), read)


def _unit(field: pa.Field) -> str:
    metadata = field.metadata or {}
    return next((metadata[key].decode(errors="replace") for key in _UNIT_KEYS if key in metadata), "")


def _is_number(kind: pa.DataType) -> bool:
    return any(
        is_kind(kind)
        for is_kind in (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean, pa.types.is_decimal)
    )


def _floats(values: pa.Array) -> np.ndarray:
    return values.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False).astype(float)


def _seconds(values: pa.Array) -> np.ndarray:
    """Durations, times of day and dates in seconds; times of day and dates from the first."""
    kind = values.type
    if pa.types.is_date(kind):
        return seconds_of_times(values.cast(pa.timestamp("ns"), safe=False).to_numpy(zero_copy_only=False))[0]
    per_second = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[kind.unit]
    counts = values.cast(pa.int32() if kind.bit_width == 32 else pa.int64(), safe=False)
    return _floats(counts) / per_second
