"""Comma-separated values, UTF-8, plain or gzipped: a header, then a row a sample."""

import csv
import io
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from ccmodel import inputs
from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import signatures
from ccmodel.rig.readers.attempt import IMPORTING
from ccmodel.rig.readers.content import blocks_of

SUFFIXES = (".csv", ".csv.gz")
# Of a block; more would not be faster.
BLOCK_BYTES = 8_000_000
_QUOTED_CELL = re.compile(r'(?<![^,])"([^",]*)"(?![^,])')


def read(path: Path) -> pd.DataFrame:
    """Read a CSV log; see `ccmodel.rig.readers`.

    It is read in blocks of lines: text takes many times the memory of its numbers.
    """
    header: list[str] = []
    columns: list[_Column] = []
    row = 2
    for lines in _blocks(path):
        if not header:
            header, lines = _header(lines[0]), lines[1:]
            columns = [_Column() for _ in header]
        _check_cells(lines, len(header), row)
        if lines:
            for column, (_, cells) in zip(columns, _table(lines, len(header)).items(), strict=True):
                column.add(cells)
        row += len(lines)
    if row == 2:
        raise LogError(None, None, "has a header but no samples: record it again or leave it out")
    joined = pd.DataFrame({k: column.whole() for k, column in enumerate(columns)}, copy=False)
    return joined.set_axis(header, axis=1).set_axis(pd.RangeIndex(2, row))


class _Column:
    """Cells of a column, block by block: as long as all are numbers, in one growing buffer.

    Blocks that are kept until the end, between others that are freed, would leave as much memory unused as they take.
    """

    def __init__(self) -> None:
        self.numbers, self.others = bytearray(), list[pd.Series]()

    def add(self, cells: pd.Series) -> None:
        if cells.dtype.kind in "iuf" and not self.others:
            self.numbers += cells.to_numpy(float).tobytes()
        else:
            self.others.append(cells)

    def whole(self) -> pd.Series:
        numbers = pd.Series(np.frombuffer(self.numbers, float), copy=False)
        return pd.concat([numbers, *self.others], ignore_index=True) if self.others else numbers


def _header(line: str) -> list[str]:
    header = [name.strip().strip('"') for name in line.split(",")]
    if len(header) == 1 and any(c in header[0] for c in ";\t "):
        text = "columns must be separated by commas and numbers written with a point"
        raise LogError(1, None, f"{text}; or {IMPORTING}")
    return header


def _check_cells(lines: list[str], wanted: int, first_row: int) -> None:
    for row, line in enumerate(lines, start=first_row):
        if (cells := line.count(",") + 1) != wanted:
            raise LogError(row, None, f"has {cells} cells, the header has {wanted}: the log is damaged")


def _table(lines: list[str], columns: int) -> pd.DataFrame:
    # A cell has no comma, so quotation marks can only enclose one whole cell.
    rows = [_QUOTED_CELL.sub(r"\1", line) if '"' in line else line for line in lines]
    return pd.read_csv(
        io.StringIO("\n".join(rows)),
        quoting=csv.QUOTE_NONE,
        header=None,
        names=range(columns),
        skip_blank_lines=False,
        skipinitialspace=True,
        low_memory=False,
    )


def _blocks(path: Path) -> Iterator[list[str]]:
    """Lines of a log in blocks, without the empty ones at its end."""
    inputs.check_regular(path)
    kind = signatures.kind_of(path)
    if kind.module != "text" and kind not in (signatures.UNKNOWN, signatures.EMPTY):
        raise LogError(None, None, signatures.not_text(kind))
    if path.suffix == ".gz" and kind != signatures.EMPTY and not signatures.is_gzipped(path):
        raise LogError(None, None, "is called .gz but is not gzipped: rename it or copy it again")
    # Empty lines wait for the next block, since they may be the end of the file.
    rows = 0
    waiting: list[str] = []
    for raw in blocks_of(path, BLOCK_BYTES):
        try:
            text = raw.decode("utf-8" if rows else "utf-8-sig")
        except UnicodeDecodeError as error:
            row = rows + raw[: error.start].count(b"\n") + 1
            text = f"is not text in UTF-8: {IMPORTING}, which reads other encodings; if it is damaged,"
            raise LogError(row, None, f"{text} copy it again from the rig") from None
        is_cut = text.rstrip(" \t")[-1:] not in ("", "\n", "\r")
        lines = text.splitlines()
        rows += len(lines)
        lines, waiting = _without_empty_end(waiting + lines)
        if is_cut and len(waiting) < rows:
            # Refused even if the last number seems whole: further digits and rows may be missing.
            text = "the last line is cut (it has no line end), more may be lost: copy it again from the rig"
            raise LogError(rows, None, text)
        if lines:
            yield lines
    if len(waiting) == rows:
        raise LogError(None, None, "is empty: record it again or leave it out")


def _without_empty_end(lines: list[str]) -> tuple[list[str], list[str]]:
    """Lines up to the last one that holds anything, and the empty ones after it."""
    end = len(lines)
    while end and not lines[end - 1].strip(", \t"):
        end -= 1
    return lines[:end], lines[end:]
