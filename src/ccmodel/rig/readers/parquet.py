"""Parquet: a table of columns, with units in the metadata of the fields."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

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
    leaves = [file.schema.column(i) for i in range(file.metadata.num_columns)]
    check_unpacked(sum(_sizes(file.metadata, leaves)))
    named = _flat(file.schema_arrow.empty_table()).schema.names
    table = _flat(file.read(columns=[leaf.path for leaf in leaves if not _is_text(leaf)]))
    signals, left_out, started = [], [], None
    for field, column in zip(table.schema, table.columns, strict=True):
        name = field.name.replace(".", "/")
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
            left_out.append(field.name)
    texts = set(left_out) | (set(named) - set(table.schema.names))
    left_out = [name for name in dict.fromkeys(named) if name in texts]
    remarks = (
        [f"columns without numbers are left out: {', '.join(name.replace('.', '/') for name in left_out)}"]
        if left_out
        else []
    )
    return SignalFile(tuple(signals), started, tuple(remarks))


FORMAT = Format("Parquet file", (".parquet", ".pq"), read)


def _is_text(leaf: Any) -> bool:
    """Whether a column holds text or bytes: no signal, and nothing in the file bounds their length in memory."""
    return leaf.physical_type == "BYTE_ARRAY" and leaf.logical_type.type != "DECIMAL"


def _sizes(metadata: Any, leaves: Sequence[Any]) -> Iterator[int]:
    """Bytes in memory of each column that is read, by the number of its values.

    A column of one value takes next to nothing in the file, whatever its length; and a list may have many values a row.
    """
    for i, leaf in enumerate(leaves):
        if not _is_text(leaf):
            count = sum(metadata.row_group(group).column(i).num_values for group in range(metadata.num_row_groups))
            yield max(count, metadata.num_rows) * max(BYTES_OF_A_NUMBER, leaf.length)


def _flat(table: pa.Table) -> pa.Table:
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    return table


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
