"""Parquet: a table of columns, with units in the metadata of the fields."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from ccmodel.rig.readers.columns import BYTES_OF_A_NUMBER
from ccmodel.rig.readers.content import Unpacked
from ccmodel.rig.readers.contract import Format, Signal, SignalFile
from ccmodel.rig.readers.stamps import earliest, moment, seconds_since

_UNIT_KEYS = (b"unit", b"units", b"Unit", b"Units")


def read(path: Path) -> SignalFile:
    """Read a Parquet file; structures are flattened, lists of one length are a signal an element."""
    metadata = pq.read_metadata(path)
    Unpacked().add(_size(metadata))
    # A text that is repeated is kept once.
    table = pq.ParquetFile(path, metadata=metadata, read_dictionary=_texts(metadata)).read()
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    # Columns of absolute times have one zero: each of them may be the time of some signals.
    zero = earliest(_times(column) for column in table.columns if pa.types.is_timestamp(_kind(column)))
    signals, left_out = [], []
    for field, column in zip(table.schema, table.columns, strict=True):
        name = field.name.replace(".", "/") if "." in field.name else field.name
        unit = _unit(field)
        if pa.types.is_dictionary(column.type) and not _has_numbers(_kind(column)):
            left_out.append(name)
            continue
        values = column.combine_chunks()
        if pa.types.is_dictionary(values.type):
            values = values.dictionary_decode()
        if pa.types.is_timestamp(values.type):
            signals.append(Signal(name, "s", seconds_since(zero, _times(values)), since_start=True))
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
    return SignalFile(tuple(signals), moment(zero), tuple(remarks))


FORMAT = Format("Parquet file", (".parquet", ".pq"), read)


def _size(metadata: pq.FileMetaData) -> int:
    """Bytes of the numbers of a file in memory, and of its pages once unpacked, whichever are more.

    A column of one value takes next to nothing in the file, whatever its length. A list counts with its elements.
    """
    numbers = pages = 0
    for group in map(metadata.row_group, range(metadata.num_row_groups)):
        for i in range(group.num_columns):
            column, width = group.column(i), max(BYTES_OF_A_NUMBER, metadata.schema.column(i).length)
            numbers += max(column.num_values, group.num_rows) * width
            pages += column.total_uncompressed_size
    return max(numbers, pages)


def _texts(metadata: pq.FileMetaData) -> list[str]:
    """Paths of the columns of texts and bytes of any length; a decimal number may be stored so too."""
    columns = map(metadata.schema.column, range(metadata.num_columns))
    return [c.path for c in columns if c.physical_type == "BYTE_ARRAY" and c.logical_type.type != "DECIMAL"]


def _kind(column: pa.ChunkedArray) -> pa.DataType:
    """Type of the values of a column, of one that keeps repeated values once too."""
    return column.type.value_type if pa.types.is_dictionary(column.type) else column.type


def _has_numbers(kind: pa.DataType) -> bool:
    return _is_number(kind) or pa.types.is_temporal(kind)


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


def _times(values: pa.Array | pa.ChunkedArray) -> np.ndarray:
    return np.asarray(values.cast(pa.timestamp("ns"), safe=False))


def _seconds(values: pa.Array) -> np.ndarray:
    """Durations, times of day and dates in seconds; dates from the earliest."""
    kind = values.type
    if pa.types.is_date(kind):
        times = _times(values)
        return seconds_since(earliest([times]), times)
    per_second = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[kind.unit]
    counts = values.cast(pa.int32() if kind.bit_width == 32 else pa.int64(), safe=False)
    return _floats(counts) / per_second
