"""Comma-separated values, UTF-8, plain or gzipped: a header, then a row a sample."""

import csv
import io
import re
from pathlib import Path

import numpy as np
import pandas as pd

from ccmodel import inputs
from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import signatures
from ccmodel.rig.readers.content import content_of

SUFFIXES = (".csv", ".csv.gz")
_QUOTED_CELL = re.compile(r'(?<![^,])"([^",]*)"(?![^,])')


def read(path: Path) -> pd.DataFrame:
    """Read a CSV log; see `ccmodel.rig.readers`."""
    lines = _lines(_text(path))
    header = [name.strip().strip('"') for name in lines[0].split(",")]
    if len(header) == 1 and any(c in header[0] for c in ";\t "):
        raise LogError(1, None, "columns must be separated by commas and numbers written with a point")
    if len(lines) == 1:
        raise LogError(None, None, "has a header but no samples: record it again or take it out of batch.yaml")
    for row, line in enumerate(lines, start=1):
        if (cells := line.count(",") + 1) != len(header):
            raise LogError(row, None, f"has {cells} cells, the header has {len(header)}: the log is damaged")
    # A cell has no comma, so quotation marks can only enclose one whole cell.
    rows = [_QUOTED_CELL.sub(r"\1", line) if '"' in line else line for line in lines[1:]]
    table = pd.read_csv(
        io.StringIO("\n".join(rows)),
        quoting=csv.QUOTE_NONE,
        header=None,
        names=range(len(header)),
        skip_blank_lines=False,
        skipinitialspace=True,
        low_memory=False,
    )
    return table.set_axis(header, axis=1).set_axis(np.arange(2, len(table) + 2))


def _text(path: Path) -> str:
    inputs.check_regular(path)
    kind = signatures.kind_of(path)
    if kind.module != "text" and kind not in (signatures.UNKNOWN, signatures.EMPTY):
        raise LogError(None, None, signatures.not_text(kind))
    if path.suffix == ".gz" and kind != signatures.EMPTY and not signatures.is_gzipped(path):
        raise LogError(None, None, "is called .gz but is not gzipped: rename it or copy it again")
    raw = content_of(path)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = raw[: error.start].count(b"\n") + 1
        raise LogError(row, None, "is not text: the file is damaged, copy it again from the rig") from None


def _lines(text: str) -> list[str]:
    """Lines of the file without empty ones at its end."""
    if not text.strip(", \t\r\n"):
        raise LogError(None, None, "is empty: record it again or take it out of batch.yaml")
    lines = text.splitlines()
    if not text.rstrip(" \t").endswith(("\n", "\r")):
        # Refused even if the last number seems whole: further digits and rows may be missing.
        text = "the last line is cut (it has no line end), more may be lost: copy it again from the rig"
        raise LogError(len(lines), None, text)
    while not lines[-1].strip(", \t"):
        lines.pop()
    return lines
