"""Checks of a log that are common to all formats: columns, cells and time.

A log is refused as a whole if a fault shows that it is not what the rig wrote, since other parts may be damaged too.
Harmless faults are warnings.
"""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.rig import limits, readers
from ccmodel.rig.batch import COLUMNS, DRIVE_ANGLE_COLUMNS, RAW_COLUMNS
from ccmodel.rig.findings import Defect, LogError
from ccmodel.rig.outliers import drop_outliers, without
from ccmodel.typed import nearest

# Similarity from which an unknown column is a misspelling of a known one. Below it, the rig logs more than the format
# has.
MISSPELT = 0.85


def read_log(path: Path, in_place_of: Mapping[str, str] = MappingProxyType({})) -> tuple[pd.DataFrame, list[Defect]]:
    """Read and check a log.

    Parameters
    ----------
    path : Path
        The log.
    in_place_of : mapping of str to str
        Columns, and those that are not used if the log has the former: `Rig.in_place_of`. What nobody uses has no
        fault.

    Returns
    -------
    table : DataFrame, shape (n, columns)
        Known columns as floats; the index is the row in the file.
    warnings : list of Defect
        Faults within the limits.

    Raises
    ------
    LogError
        If the log cannot be used.
    """
    raw = readers.read(Path(path))
    warnings = _check_header(list(raw.columns))
    not_used = {other for column, other in in_place_of.items() if column in raw.columns}
    table = _numbers(raw[[name for name in raw.columns if name in COLUMNS and name not in not_used]])
    table = _drop_repeated(_drop_bad(table, warnings), warnings)
    table, impossible = drop_outliers(table)
    warnings += impossible
    if len(table) < limits.FEWEST_SAMPLES:
        raise LogError(None, None, f"has {len(table)} samples only: too few for a recording; record it again")
    _check_time(table["time_s"], warnings)
    return table, warnings


def _check_header(header: list[str]) -> list[Defect]:
    unknown = [name for name in header if name not in COLUMNS]
    present = set(header)
    missing = [column for column in COLUMNS if column not in present]
    for name in unknown:
        guess = nearest(name, missing, MISSPELT)
        if guess:
            convert = f" That is in {_unit(guess)}: convert the values." if _unit(guess) != _unit(name) else ""
            raise LogError(1, name, f"unknown column; did you mean '{guess}'?{convert}")
    if "time_s" not in header:
        raise LogError(1, "time_s", f"this column is required and missing; found {', '.join(header)}")
    if not set(DRIVE_ANGLE_COLUMNS) & set(header):
        counts, angle = DRIVE_ANGLE_COLUMNS
        text = f"this column, or {angle}, is required and missing; found {', '.join(header)}"
        raise LogError(1, counts, text)
    for name in header:
        if name in COLUMNS and header.count(name) > 1:
            raise LogError(1, name, "this column is there twice: keep one")
    for channel, columns in RAW_COLUMNS.items():
        raw = [column for column in columns if column in header]
        if raw and channel in header:
            text = f"the log has {' and '.join(raw)} too, which is the same quantity: keep one"
            raise LogError(1, channel, text)
    return [Defect(1, name or "(no name)", f"unknown column, not used{_other_unit(name)}") for name in unknown]


def _unit(column: str) -> str:
    return column.rpartition("_")[2]


def _other_unit(unknown: str) -> str:
    """What to do about a column of a known quantity in another unit, as theta_in_deg."""
    known = [column for column in COLUMNS if column.rpartition("_")[0] == unknown.rpartition("_")[0]]
    return f": convert it to {' or '.join(known)}" if known else ""


def _numbers(raw: pd.DataFrame) -> pd.DataFrame:
    for name in raw:
        if raw[name].dtype.kind not in "iuf":
            numbers = pd.to_numeric(raw[name].astype("string"), errors="coerce")
            bad = raw[name][(numbers.isna() & raw[name].notna()).to_numpy()]
            if bad.size:
                more = f" (and in {bad.size - 1} more rows)" if bad.size > 1 else ""
                raise LogError(int(bad.index[0]), name, f"must be a number, found '{bad.iloc[0]}'{more}")
            raw = raw.assign(**{name: numbers})
    return raw.astype(float)


def _drop_bad(table: pd.DataFrame, warnings: list[Defect]) -> pd.DataFrame:
    """Drop the few rows in which a cell is empty, or what is calculated from it would not be finite."""
    any_bad = np.zeros(len(table), bool)
    # Columns by position: a log of ten million samples takes most of the memory, and is not copied as a whole.
    for k, column in enumerate(table.columns):
        is_bad = ~(np.abs(table.iloc[:, k].to_numpy()) < limits.LARGEST_NUMBER)
        if not is_bad.any():
            continue
        row = int(table.index[is_bad][0])
        if is_bad.all():
            raise LogError(None, column, "has no numbers: leave the column out if the rig has no such sensor")
        run, said = length(longest_run(is_bad)), _said(table.iloc[:, k].to_numpy()[is_bad])
        if run > limits.BAD_CELLS_IN_A_ROW or is_bad.mean() > limits.BAD_CELLS_FRACTION:
            raise LogError(row, column, f"{said}, {run} of them in a row")
        rows = "row" if is_bad.sum() == 1 else "their rows are"
        warnings.append(Defect(row, column, f"{said}: {rows} dropped"))
        any_bad |= is_bad
    if length(hole := longest_run(any_bad)) > limits.BAD_CELLS_IN_A_ROW:
        text = f"cells of several columns have no number, in {length(hole)} rows in a row from here"
        raise LogError(int(table.index[hole.start]), None, f"{text}: too many to be bridged")
    return without(table, any_bad)


def _said(bad: NDArray) -> str:
    """What is wrong with the values of cells: they are empty, or larger than a sensor reads."""
    first = f"{bad[0]:g}"
    if bad.size == 1:
        return "no number" if np.isnan(bad[0]) else f"{first} is no reading"
    return (
        f"{bad.size} cells have no number" if np.isnan(bad[0]) else f"{bad.size} cells have no reading (first {first})"
    )


def _drop_repeated(table: pd.DataFrame, warnings: list[Defect]) -> pd.DataFrame:
    """Drop samples that repeat the one before in all columns, time included."""
    repeated = np.arange(len(table)) > 0
    for _, values in table.items():
        repeated[1:] &= values.to_numpy()[1:] == values.to_numpy()[:-1]
    if count := repeated.sum():
        text = "the same sample again: dropped" + (f" ({count} such rows in all)" if count > 1 else "")
        warnings.append(Defect(int(table.index[repeated][0]), None, text))
    return without(table, repeated)


def _check_time(time: pd.Series, warnings: list[Defect]) -> None:
    step = np.diff(time.to_numpy())
    if (step <= 0).any():
        at = int(np.flatnonzero(step <= 0)[0]) + 1
        now, before = time.iloc[at], time.iloc[at - 1]
        raise LogError(int(time.index[at]), "time_s", f"time must increase, found {now:g} s after {before:g} s")
    _check_unit_of_time(time, float(np.median(step)))
    # Over four rows: a clock of whole ms that alternates 1 and 2 ms has no step of 1.5 ms.
    usual = float((time.diff(4) / time.index.to_series().diff(4)).median())
    # A step over dropped rows is longer without being a gap; these rows have a warning already.
    rows = np.diff(time.index)
    excess = step - usual * rows
    slack = (limits.GAP_STEPS - 1) * usual
    gaps = excess > slack * rows
    if not gaps.any():
        return
    # A late sample is followed by a step that is shorter by the same time; a lost sample is not.
    caught_up = -excess[(excess < -slack) & (rows == 1)].sum()
    lost = max(excess[gaps].sum() - caught_up, 0.0)
    uneven = lost < limits.UNEVEN_FRACTION * excess[gaps].sum()
    worst = np.flatnonzero(gaps)[np.argmax(excess[gaps])]
    text = _gap_text(gaps.sum(), step[worst], usual, uneven)
    if step[worst] > limits.GAP_S or lost > limits.GAP_FRACTION * (time.iloc[-1] - time.iloc[0]):
        text += f" ({lost:.3g} s lost in all): too long to be bridged, record it again"
        raise LogError(int(time.index[worst + 1]), "time_s", text, True)
    first = int(time.index[np.flatnonzero(gaps)[0] + 1])
    text += ": they came late, few or none are lost" if uneven else ": samples were dropped"
    warnings.append(Defect(first, "time_s", text))


def _check_unit_of_time(time: pd.Series, step: float) -> None:
    if limits.SHORTEST_STEP_S <= step <= limits.LONGEST_STEP_S:
        return
    units = {"ms": 1e-3, "µs": 1e-6, "ns": 1e-9}
    likely = next((u for u, s in units.items() if limits.SHORTEST_STEP_S * 10 <= step * s <= 0.05), None)
    hint = f"are the times in {likely}? Convert them to s" if likely else "give the times in s"
    text = f"samples are {step:.4g} s apart and the log lasts {time.iloc[-1] - time.iloc[0]:.4g} s: {hint}"
    raise LogError(int(time.index[0]), "time_s", text, True)


def _gap_text(count: int, longest: float, usual: float, uneven: bool) -> str:
    if uneven:
        return (
            f"sampled unevenly: {count} steps are long, up to {longest:.4g} s, and others short where a step is"
            f" {usual:.4g} s"
        )
    what = f"{count} gaps, the longest" if count > 1 else "a gap"
    return f"{what} of {longest:.4g} s where a step is {usual:.4g} s"


def runs(flags: NDArray, shortest: int = 1) -> list[slice]:
    """All runs of true values with so many samples or more."""
    starts, stops = _ends_of_runs(flags)
    is_long = stops - starts >= shortest
    return [slice(a, b) for a, b in zip(starts[is_long].tolist(), stops[is_long].tolist(), strict=True)]


def _ends_of_runs(flags: NDArray) -> tuple[NDArray, NDArray]:
    """First sample of each run of true values, and the first one after it."""
    changes = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    return changes[::2], changes[1::2]


def longest_run(flags: NDArray) -> slice:
    """The longest run of true values, the first of several; empty if there is none."""
    starts, stops = _ends_of_runs(flags)
    if not starts.size:
        return slice(0, 0)
    longest = int(np.argmax(stops - starts))
    return slice(int(starts[longest]), int(stops[longest]))


def length(run: slice) -> int:
    """Number of samples of a run."""
    return run.stop - run.start
