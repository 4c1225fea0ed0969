"""A trial: one text file of the data set.

The headers were edited by hand, so the columns are identified by their position and the header is kept as a note.
"""

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.rig.findings import LogError

# Columns by their position; the others (motor current, back-end command, target) are not used.
COLUMNS = {
    0: "time_s",
    1: "drive_encoder_counts",
    2: "drive_torque_counts",
    4: "load_encoder_counts",
    5: "load_torque_counts",
    6: "load_command",
    8: "motor_encoder_counts",
}
FEWEST_COLUMNS = 6  # all but the load command and what follows it
# Rows of a trial: half a second at 1 kHz.
FEWEST_ROWS = 500
# Duration of the start-up transient, s, from the page of the data set.
SETTLED_S = 4.0

_ROW_OF_NUMBERS = re.compile(r"\s*[-+.\d][-+.\deE]*[,;\s]+[-+.\deE]+[-+.\deE,;\s]*")


@dataclass(frozen=True)
class Trial:
    """A trial.

    Attributes
    ----------
    file : Path
        Its file.
    header : list of str
        Lines that do not begin with a number.
    samples : DataFrame, shape (n, columns)
        Those of `COLUMNS` that the file has.
    remark : str or None
        Rows that were dropped.
    """

    file: Path
    header: list[str]
    samples: pd.DataFrame
    remark: str | None

    @property
    def settled(self) -> pd.DataFrame:
        """Samples after the start-up transient; all samples if too few remain."""
        settled = self.samples[self.samples["time_s"] >= SETTLED_S]
        return settled if len(settled) >= FEWEST_ROWS else self.samples


def read_trial(file: Path) -> Trial | None:
    """Read a trial; None if the file is a text for people.

    Raises
    ------
    LogError
        If it has too few rows or columns.
    """
    lines = file.read_bytes().decode("utf-8", errors="replace").splitlines()
    header = [line.strip() for line in lines if _is_header(line)]
    rows = {row: line for row, line in enumerate(lines, start=1) if line.strip() and not _is_header(line)}
    if len(rows) < FEWEST_ROWS:
        if _is_prose(lines):
            return None
        raise LogError(None, None, f"no trial: {len(rows)} rows that begin with a number; not imported")
    samples, complete = _samples(list(rows.values()))
    if samples.shape[1] < FEWEST_COLUMNS or len(samples) < FEWEST_ROWS:
        raise LogError(None, None, f"no trial: {len(samples)} rows of {samples.shape[1]} numbers; not imported")
    remark = None
    if dropped := [row for row, whole in zip(rows, complete, strict=True) if not whole]:
        cut = " (the last line is cut)" if dropped[0] == len(lines) else ""
        remark = f"{len(dropped)} rows that are no samples dropped, the first is row {dropped[0]}{cut}"
    # The header states ms, but most files have s. The trials were sampled at 1 kHz.
    if samples[0].diff().median() > 0.1:
        samples[0] /= 1000.0
    return Trial(file, header, samples.filter(COLUMNS).rename(columns=COLUMNS), remark)


def _is_header(line: str) -> bool:
    """Whether a line does not begin like a number: the leading % of a header is missing in some files."""
    return line.lstrip()[:1] not in set("+-.0123456789")


def _is_prose(lines: list[str]) -> bool:
    """Whether a file is a text for people, such as a README: no row of numbers and no header of a trial."""
    written = [line.strip() for line in lines if line.strip()]
    return bool(written) and not any(line.startswith("%") or _ROW_OF_NUMBERS.fullmatch(line) for line in written)


def _samples(rows: list[str]) -> tuple[pd.DataFrame, NDArray]:
    """Samples of the complete rows, shape (n, width), and which rows are complete: as wide as most, numbers only."""
    separator = next((s for s in ",;\t" if s in rows[0]), None)
    widest = max(row.count(separator) + 1 if separator else len(row.split()) for row in rows)
    cells = pd.read_csv(
        io.StringIO("\n".join(map(str.strip, rows))),
        sep=separator or r"\s+",
        quoting=csv.QUOTE_NONE,
        names=range(widest),
        index_col=False,
        low_memory=False,
    )
    widths = widest - cells.notna().to_numpy()[:, ::-1].argmax(axis=1)  # without empty cells at the end of a row
    width = int(np.bincount(widths).argmax())
    numbers = cells.iloc[:, :width].apply(pd.to_numeric, errors="coerce").astype(float)
    complete = (widths == width) & np.isfinite(numbers).all(axis=1)
    return numbers[complete], complete
