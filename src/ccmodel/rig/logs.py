"""Readers: a log file -> a table of its raw columns, or the one reason why it cannot be trusted.

A log is refused as a whole when something in it shows that it is not what the rig wrote: nobody knows what else is
wrong with a file that ends in the middle of a line. What is known to be harmless is a warning.
"""

import csv
import gzip
import io
import re
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from ccmodel.rig.batch import COLUMNS, REQUIRED_COLUMNS
from ccmodel.rig.findings import LIMITS, Finding, Limits
from ccmodel.typed import nearest

QUOTED_CELL = re.compile(r'(?<![^,])"([^",]*)"(?![^,])')


@dataclass(frozen=True)
class Log:
    """What was read of a log.

    Attributes
    ----------
    columns : tuple of str
        Known columns of its header; empty if it has none that can be read.
    table : DataFrame or None
        Known columns as floats, shape (n, len(columns)); the index is the row in the file, the header being row 1.
        None if the log is refused.
    findings : list of Finding
        What was found wrong.
    """

    columns: tuple[str, ...]
    table: pd.DataFrame | None
    findings: list[Finding]


class _RefusedError(Exception):
    """The log cannot be used: row, column, text."""


def read_log(path: Path, batch: str, limits: Limits = LIMITS) -> Log:
    """Read a CSV log, gzipped or not; never raises for what is in it.

    Parameters
    ----------
    path : Path
        The log, `.csv` or `.csv.gz`.
    batch : str
        Name of its batch, for the findings.
    limits : Limits
        How much may be wrong with it.

    Returns
    -------
    Log
        Its columns, its table unless it is refused, and the findings.
    """
    warnings: list[tuple] = []
    columns: tuple[str, ...] = ()
    table = None
    findings = []
    try:
        lines = _lines(Path(path))
        header = _header(lines)
        columns = tuple(c for c in header if c in COLUMNS)
        _check_header(header, warnings)
        rows = _rows(lines, header)
        table = _numbers(rows, header)[list(columns)]
        table = _drop_repeated(_drop_bad(table, limits, warnings), warnings)
        if len(table) < limits.fewest_samples:
            raise _RefusedError(None, None, f"has {len(table)} samples only: too few for a recording; record it again")
        _check_time(table["time_s"], limits, warnings)
    except _RefusedError as refused:
        findings.append(Finding(batch, str(path), *refused.args[:2], "refused", refused.args[2]))
        return Log(columns, None, findings)
    findings += [Finding(batch, str(path), row, column, "warning", text) for row, column, text in warnings]
    return Log(columns, table, findings)


def _lines(path: Path) -> list[str]:
    """Lines of the file, without the empty ones at its end."""
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        raise _RefusedError(None, None, "there is no such file: put it there or take it out of batch.yaml") from None
    except OSError as error:
        raise _RefusedError(None, None, f"cannot be read ({error.strerror})") from None
    if raw[:2] == b"\x1f\x8b":
        raw = _unzip(raw)
    elif path.suffix == ".gz" and raw:
        raise _RefusedError(None, None, "is called .gz but is not gzipped: rename it or copy it again")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = raw[: error.start].count(b"\n") + 1
        raise _RefusedError(row, None, "is not text: the file is damaged, copy it again from the rig") from None
    if not text.strip(", \t\r\n"):
        raise _RefusedError(None, None, "is empty: record it again or take it out of batch.yaml")
    lines = text.splitlines()
    if not text.rstrip(" \t").endswith(("\n", "\r")):
        # Even where the last number is whole: nobody knows what the rig had still to write.
        raise _RefusedError(
            len(lines),
            None,
            "the last line is cut (it has no line end), nobody knows what else is lost: copy it again from the rig",
        )
    while not lines[-1].strip(", \t"):
        lines.pop()
    return lines


def _unzip(raw: bytes) -> bytes:
    try:
        return gzip.decompress(raw)
    except EOFError:
        text = "the gzip stream is cut short, nobody knows what is lost: copy it again from the rig"
    except (OSError, zlib.error):
        text = "the gzip stream is damaged: copy it again from the rig"
    raise _RefusedError(None, None, text)


def _header(lines: list[str]) -> list[str]:
    return [name.strip().strip('"') for name in lines[0].split(",")]


def _check_header(header: list[str], warnings: list[tuple]) -> None:
    if len(header) == 1 and any(c in header[0] for c in ";\t "):
        raise _RefusedError(1, None, "columns must be separated by commas and numbers written with a point")
    unknown = [name for name in header if name not in COLUMNS]
    for name in unknown:
        # Near enough for a slip of the pen; a rig may well log more than the format knows.
        guess = nearest(name, [c for c in COLUMNS if c not in header], cutoff=0.85)
        if guess:
            raise _RefusedError(1, name, f"unknown column; did you mean '{guess}'?")
    for name in REQUIRED_COLUMNS:
        if name not in header:
            raise _RefusedError(1, name, f"this column is required and missing; found {', '.join(header)}")
    for name in header:
        if name in COLUMNS and header.count(name) > 1:
            raise _RefusedError(1, name, "this column is there twice: nobody knows which is meant")
    warnings += [(1, name or "(no name)", "unknown column, not used") for name in unknown]


def _rows(lines: list[str], header: list[str]) -> list[str]:
    """Lines of the samples, every one with as many cells as the header."""
    rows = lines[1:]
    if not rows:
        raise _RefusedError(None, None, "has a header but no samples: record it again or take it out of batch.yaml")
    cells = np.array([row.count(",") for row in rows]) + 1
    wrong = np.flatnonzero(cells != len(header))
    if wrong.size:
        row = int(wrong[0])
        raise _RefusedError(row + 2, None, f"has {cells[row]} cells, the header has {len(header)}: the log is damaged")
    return rows


def _numbers(rows: list[str], header: list[str]) -> pd.DataFrame:
    known = [name for name in header if name in COLUMNS]
    # Cells were counted by commas, so a quotation mark may enclose one cell and nothing more.
    rows = [QUOTED_CELL.sub(r"\1", row) if '"' in row else row for row in rows]
    table = pd.read_csv(
        io.StringIO("\n".join(rows)),
        quoting=csv.QUOTE_NONE,
        header=None,
        names=range(len(header)),
        usecols=[header.index(name) for name in known],
        skip_blank_lines=False,
        skipinitialspace=True,
        low_memory=False,
    )
    table.columns = known
    table.index = np.arange(2, len(table) + 2)
    for name in known:
        if table[name].dtype.kind not in "iuf":
            numbers = pd.to_numeric(table[name].astype("string"), errors="coerce")
            bad = table.index[(numbers.isna() & table[name].notna()).to_numpy()]
            if bad.size:
                found = table[name][bad[0]]
                more = f" (and in {bad.size - 1} more rows)" if bad.size > 1 else ""
                raise _RefusedError(int(bad[0]), name, f"must be a number, found '{found}'{more}")
            table[name] = numbers
    return table.astype(float)


def _drop_bad(table: pd.DataFrame, limits: Limits, warnings: list[tuple]) -> pd.DataFrame:
    """Drop the few rows in which a cell is empty or not finite."""
    bad = ~np.isfinite(table.to_numpy())
    for column, is_bad in zip(table.columns, bad.T, strict=True):
        if not is_bad.any():
            continue
        row = int(table.index[is_bad][0])
        if is_bad.all():
            raise _RefusedError(None, column, "has no numbers: leave the column out if the rig has no such sensor")
        run = longest_run(is_bad)[1]
        if run > limits.bad_cells_in_a_row or is_bad.mean() > limits.bad_cells_fraction:
            raise _RefusedError(row, column, f"{is_bad.sum()} cells have no number, {run} of them in a row")
        many = f"{is_bad.sum()} cells have no number: their rows are" if is_bad.sum() > 1 else "no number: row"
        warnings.append((row, column, f"{many} dropped"))
    return table[~bad.any(axis=1)]


def _drop_repeated(table: pd.DataFrame, warnings: list[tuple]) -> pd.DataFrame:
    """Drop samples that were written twice; the same time with other values is no such thing."""
    repeated = (table.diff() == 0).all(axis=1)
    if repeated.any():
        count = repeated.sum()
        text = "the same sample again: dropped" + (f" ({count} such rows in all)" if count > 1 else "")
        warnings.append((int(table.index[repeated][0]), None, text))
    return table[~repeated]


def _check_time(time: pd.Series, limits: Limits, warnings: list[tuple]) -> None:
    step = np.diff(time.to_numpy())
    if (step <= 0).any():
        at = int(np.flatnonzero(step <= 0)[0]) + 1
        now, before = time.iloc[at], time.iloc[at - 1]
        raise _RefusedError(int(time.index[at]), "time_s", f"time must increase, found {now:g} s after {before:g} s")
    usual = _usual_step(time)
    # Where rows were dropped the step is longer for a reason that was told already.
    rows = np.diff(time.index)
    excess = step - usual * rows
    slack = (limits.gap_steps - 1) * usual
    gaps = excess > slack * rows
    if not gaps.any():
        return
    # A sample that only came late is followed by a step as much shorter; one that was lost never comes back.
    caught_up = -excess[(excess < -slack) & (rows == 1)].sum()
    lost = max(excess[gaps].sum() - caught_up, 0.0)
    uneven = lost < limits.uneven_fraction * excess[gaps].sum()
    worst = np.flatnonzero(gaps)[np.argmax(excess[gaps])]
    text = _gap_text(gaps.sum(), step[worst], usual, uneven)
    if step[worst] > limits.gap_s or lost > limits.gap_fraction * (time.iloc[-1] - time.iloc[0]):
        text += f" ({lost:.3g} s lost in all): too long to be bridged, record it again"
        raise _RefusedError(int(time.index[worst + 1]), "time_s", text)
    first = int(time.index[np.flatnonzero(gaps)[0] + 1])
    warnings.append(
        (first, "time_s", f"{text}: {'they came late, few or none are lost' if uneven else 'samples were dropped'}")
    )


def _usual_step(time: pd.Series) -> float:
    """The typical step over a few rows: one by one, a clock of whole ms may never step by the mean of 1 and 2 ms."""
    over = 4
    times, rows = time.to_numpy(), time.index.to_numpy()
    return float(np.median((times[over:] - times[:-over]) / (rows[over:] - rows[:-over])))


def _gap_text(count: int, longest: float, usual: float, uneven: bool) -> str:
    if uneven:
        return (
            f"sampled unevenly: {count} steps are long, up to {longest:.4g} s, and others short where a step is"
            f" {usual:.4g} s"
        )
    what = f"{count} gaps, the longest" if count > 1 else "a gap"
    return f"{what} of {longest:.4g} s where a step is {usual:.4g} s"


def runs(flags: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts and lengths of all runs of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return edges[::2], edges[1::2] - edges[::2]


def longest_run(flags: np.ndarray) -> tuple[int, int]:
    """Start and length of the longest run of true values; (0, 0) if there is none."""
    starts, lengths = runs(flags)
    if starts.size == 0:
        return 0, 0
    longest = np.argmax(lengths)
    return int(starts[longest]), int(lengths[longest])
