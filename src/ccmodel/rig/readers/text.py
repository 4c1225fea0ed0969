"""Text with a row a sample: any separator, decimal sign and encoding, with or without header lines.

The layout is found from the file. What the rows have in common, number of cells and which of them are numbers, shows
separator, decimal sign and the first sample. Names and units are looked for in the lines above it.
"""

import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from charset_normalizer import from_bytes
from numpy.typing import NDArray

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import signatures
from ccmodel.rig.readers.content import content_of
from ccmodel.rig.readers.contract import Format, Signal, SignalFile, TextLayout
from ccmodel.rig.readers.names import bare_unit, is_unit, split_unit
from ccmodel.rig.readers.stamps import is_stamp, seconds_of_stamps

WHITESPACE = "whitespace"
# In the order in which they are preferred: a table with tabs is also one with whitespace.
SEPARATORS = ("\t", ";", "|", ",", WHITESPACE)
_NAMES_OF_SEPARATORS = {"\t": "tab", WHITESPACE: "whitespace"}
# Rows that show the layout, and header lines above the samples that may hold names and units.
_FEWEST_SAMPLE_LINES, _SAMPLE_LINES = 20, 1000
_HEADER_LINES = 5
# Rows of numbers that the notes above the samples may have.
_OTHER_ROWS = 5
# Lines without numbers that may follow the samples.
_FOOTER_LINES = 3
_COMMENT_SIGNS = ("#", "%", "//", "!", "*")
_NO_NUMBER = (
    *("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "---", "nil"),
    *("1.#qnan", "1.#ind", "-1.#ind", "1,#qnan", "1,#ind", "-1,#ind"),
)
_NUMBER = {
    ".": re.compile(r"[+-]?((\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|inf(inity)?|1\.#inf)", re.IGNORECASE),
    ",": re.compile(r"[+-]?((\d+(,\d+)?|,\d+)([eEdD][+-]?\d+)?|inf(inity)?|1,#inf)", re.IGNORECASE),
}
_HIGH_BYTES = re.compile(rb"[\x80-\xff]+")
_CONTROLS = re.compile(r"[\x00-\x08\x0e-\x19\x1b-\x1f]")


@dataclass(frozen=True)
class _Grid:
    """How the rows are written.

    Attributes
    ----------
    separator : str
        One character, or "whitespace".
    decimal : str
        Decimal sign.
    numbers, stamps : tuple of bool
        Whether a cell holds numbers, or dates and times.
    open_end : bool
        Whether rows end with a separator: the last cell is empty, and names may leave it out.
    """

    separator: str
    decimal: str
    numbers: tuple[bool, ...]
    stamps: tuple[bool, ...]
    open_end: bool = False

    @property
    def width(self) -> int:
        return len(self.numbers)

    def is_row(self, line: str) -> bool:
        """Whether a line holds a sample: numbers where the others have numbers, one at least."""
        cells = _cells(line, self.separator)
        kinds = list(zip(cells, self.numbers, self.stamps, strict=False))
        return (
            len(cells) == self.width
            and all(_is_number(c, self.decimal) or _is_missing(c) for c, number, _ in kinds if number)
            and all(is_stamp(c) or _is_missing(c) for c, _, stamp in kinds if stamp)
            and any(not _is_missing(c) for c, number, stamp in kinds if number or stamp)
        )


def read(path: Path, layout: TextLayout | None = None) -> SignalFile:
    """Read a text file; see `ccmodel.rig.readers`."""
    layout = layout or TextLayout()
    text, encoding = _decoded(content_of(path), layout.encoding)
    lines, remarks = _lines(text)
    grid = _grid(lines, layout)
    first = _first_row(lines, grid, layout)
    if not layout.first_line:
        _check_single_table(lines[:first], grid)
    names, units, header = _names_and_units(lines[:first], grid, layout)
    table, dropped = _table(lines, first, grid)
    signals, started, more = _signals(table, names, units, grid)
    separator = _NAMES_OF_SEPARATORS.get(grid.separator, f"'{grid.separator}'")
    decimal = "comma" if grid.decimal == "," else "point"
    read_as = f"read as text: separator {separator}, decimal {decimal}, encoding {encoding}, {header}"
    return SignalFile(signals, started, (read_as, *remarks, *dropped, *more), table.index.to_numpy())


FORMAT = Format("text file", (".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".lvm", ".tab", ".prn"), read)


def _decoded(raw: bytes, encoding: str | None) -> tuple[str, str]:
    """Text of the file, and its encoding."""
    encoding = encoding or _encoding(raw)
    try:
        text = raw.decode(encoding)
    except LookupError:
        raise LogError(None, None, f"text.encoding: '{encoding}' is no known encoding") from None
    except UnicodeError as error:
        row = raw[: getattr(error, "start", 0)].count(b"\n") + 1
        text = (
            f"is not text in {encoding}: the file is damaged there, or has another encoding (text.encoding in the map)"
        )
        raise LogError(row, None, text) from None
    text = text.lstrip("\ufeff").replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a")
    if found := _CONTROLS.search(text):
        row = text[: found.start()].count("\n") + 1
        text = "holds bytes that are not text: the file is damaged there, copy it again from the recorder"
        raise LogError(row, None, text)
    return text, encoding


def _encoding(raw: bytes) -> str:
    """Encoding of a text.

    The odd degree or micro sign of a header says little about an encoding and misleads a guess by statistics, so it is
    taken as cp1252, the code page of Western instruments. Runs of other bytes are words in another script.
    """
    if raw.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        return "utf-32"
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if encoding := signatures.wide(raw[: signatures.HEAD]):
        return encoding
    try:
        raw.decode("utf-8")
        return "utf-8"
    except UnicodeDecodeError:
        pass
    runs = [len(run) for run in _HIGH_BYTES.findall(raw)]
    guess = from_bytes(b"\n".join(line for line in raw[: signatures.HEAD].splitlines() if not line.isascii())).best()
    if guess is not None and np.mean(runs) > 2:
        return guess.encoding
    # Five bytes of cp1252 are no characters; Latin 1 has characters for all.
    return "latin-1" if re.search(rb"[\x81\x8d\x8f\x90\x9d]", raw) else "cp1252"


def _lines(text: str) -> tuple[list[str], list[str]]:
    """Lines without the empty ones at the end, and remarks."""
    if not text.strip("\x00, ;\t\n"):
        raise LogError(None, None, "is empty: record it again or leave it out")
    lines, remarks = text.split("\n"), []
    if lines[-1].strip():
        # Its last number may be cut even if it seems whole.
        lines.pop()
        remarks.append("the last line has no line end: it may be cut and is left out")
    while lines and not lines[-1].strip(", ;\t"):
        lines.pop()
    if not lines:
        raise LogError(1, None, "is a single line without an end: the file is cut, copy it again from the recorder")
    return lines, remarks


def _cells(line: str, separator: str) -> list[str]:
    """Cells of a line, without blanks and quotation marks around them."""
    if separator == WHITESPACE:
        cells = line.split() if '"' not in line else next(csv.reader([" ".join(line.split())], delimiter=" "), [])
    elif '"' not in line:
        cells = line.split(separator)
    else:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip().strip("\"'").strip() for cell in cells]


def _is_number(cell: str, decimal: str) -> bool:
    return _NUMBER[decimal].fullmatch(cell) is not None


def _is_missing(cell: str) -> bool:
    return cell.lower() in _NO_NUMBER


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(_COMMENT_SIGNS)


def _grid(lines: list[str], layout: TextLayout) -> _Grid:
    """Separator and decimal sign under which most cells of the rows are numbers."""
    if layout.first_line and layout.first_line > len(lines):
        text = f"text.first_line: the file has {len(lines)} lines only, found {layout.first_line}"
        raise LogError(None, None, text)
    # The end of a file holds samples, however many lines of notes it begins with.
    count = min(max(len(lines) // 4, _FEWEST_SAMPLE_LINES), _SAMPLE_LINES)
    rows = lines[(layout.first_line or 1) - 1 :][-count:]
    rows = [line for line in rows if line.strip() and not _is_comment(line)]
    separators = (layout.separator,) if layout.separator else SEPARATORS
    decimals = (layout.decimal,) if layout.decimal else (".", ",")
    candidates = [c for s in separators for d in decimals if (c := _candidate(rows, _separator(s), d))]
    if not candidates:
        raise LogError(None, None, _no_numbers(rows, lines))
    return max(candidates, key=lambda c: c[0])[1]


def _separator(stated: str) -> str:
    separator = {"tab": "\t", "\\t": "\t", " ": WHITESPACE, "space": WHITESPACE, "comma": ","}.get(stated, stated)
    if len(separator) != 1 and separator != WHITESPACE:
        raise LogError(None, None, f"text.separator: must be one character or 'whitespace', found '{stated}'")
    return separator


def _candidate(rows: list[str], separator: str, decimal: str) -> tuple[int, _Grid] | None:
    """Grid of the rows under a separator and decimal sign; its score is the cells that it explains."""
    if separator == decimal:
        return None
    split = [_cells(line, separator) for line in rows]
    split = [cells for cells in split if any(_is_number(c, decimal) or is_stamp(c) for c in cells)]
    if not split:
        return None
    width, count = max(Counter(map(len, split)).items(), key=lambda item: (item[1], item[0]))
    columns = list(zip(*(cells for cells in split if len(cells) == width), strict=True))
    filled = [[c for c in column if not _is_missing(c)] for column in columns]
    # A column without an entry here may have one elsewhere.
    numbers = tuple(2 * sum(_is_number(x, decimal) for x in c) > len(c) or not c for c in filled)
    stamps = tuple(2 * sum(map(is_stamp, c)) > len(c) and not n for c, n in zip(filled, numbers, strict=True))
    known = sum(bool(c) and (n or s) for c, n, s in zip(filled, numbers, stamps, strict=True))
    if not any(c and n for c, n in zip(filled, numbers, strict=True)):
        return None
    # A date and a time with a blank between them are one cell under any other separator.
    dates = sum(map(all, pairwise(stamps))) if separator == WHITESPACE else 0
    score = count * (2 * known - sum(map(bool, filled)) - dates)
    return score, _Grid(separator, decimal, numbers, stamps, not filled[-1])


def _no_numbers(rows: list[str], lines: list[str]) -> str:
    found = (rows or lines)[0].strip()[:40]
    advice = "it is no log (leave it out), or its separator must be stated (text.separator)"
    return f"has no rows of numbers (found '{found}'): {advice}"


def _first_row(lines: list[str], grid: _Grid, layout: TextLayout) -> int:
    """Index of the first sample: two more rows follow it, comments and empty lines aside."""
    if layout.first_line:
        return layout.first_line - 1
    after = max(layout.header_line or 0, layout.unit_line or 0)
    candidates = [i for i in range(after, len(lines)) if lines[i].strip() and not _is_comment(lines[i])]
    for at, i in enumerate(candidates):
        # The rows after it may have a cell of text here and there.
        following = [_cells(lines[j], grid.separator) for j in candidates[at + 1 : at + 3]]
        if grid.is_row(lines[i]) and all(len(cells) == grid.width for cells in following):
            return i
    raise LogError(None, None, _no_numbers([], lines))


def _check_single_table(above: list[str], grid: _Grid) -> None:
    """Rows of another table above the samples would be lost without a word."""
    rows = [_cells(line, grid.separator) for line in above if line[:1].isdigit() or line[:1] in "+- "]
    rows = [cells for cells in rows if len(cells) > 1 and all(_is_number(c, grid.decimal) for c in cells)]
    if len(rows) > _OTHER_ROWS:
        text = f"has {len(rows)} more rows of numbers, of another table, above the samples of line {len(above) + 1} on"
        raise LogError(None, None, f"{text}: split the file, or state text.first_line")


def _names_and_units(above: list[str], grid: _Grid, layout: TextLayout) -> tuple[list[str], list[str], str]:
    """Names and units of the columns from the lines above the samples, and what was found, for the remark."""
    at_names, at_units = _header_lines(above, grid, layout)
    names = units = None
    if at_names is not None:
        names = _header_row(above, at_names, "names", "header_line", grid)
    if at_units is not None:
        units = _header_row(above, at_units, "units", "unit_line", grid)
    split = [split_unit(name) for name in names or [""] * grid.width]
    names = [name or f"column_{i}" for i, (name, _) in enumerate(split, start=1)]
    units = [bare_unit(unit) or own for unit, (_, own) in zip(units or [""] * grid.width, split, strict=True)]
    if at_names is None:
        count = sum(bool(line.strip()) for line in above)
        found = "no line of names" + (f" ({count} other lines above the samples)" if count else "")
    else:
        found = f"names in line {at_names + 1}" + (f", units in line {at_units + 1}" if at_units is not None else "")
    return names, units, found


def _header_row(above: list[str], index: int, what: str, key: str, grid: _Grid) -> list[str]:
    """Names or units of the columns, of the line that the key `key` of the layout states or that was found."""
    if index >= len(above):
        raise LogError(
            None, None, f"text.{key}: must be a line above the samples, which begin in line {len(above) + 1}"
        )
    if (cells := _header_cells(above[index], grid)) is None:
        text = f"the {what} have another number of cells than the {grid.width} of the samples"
        raise LogError(index + 1, None, f"{text}: state text.separator, or {key} 0 if it has no {what}")
    return cells


def _header_lines(above: list[str], grid: _Grid, layout: TextLayout) -> tuple[int | None, int | None]:
    """Indices of the line of names and of the line of units.

    A line of units stands below its names, or above them in some exports. A row of words that could be units ("s, A")
    holds names if there is no other line of names.
    """
    near = [i for i, line in enumerate(above) if line.strip()][-_HEADER_LINES:]
    cells = {i: c for i in near if (c := _header_cells(above[i], grid)) and _are_words(c, grid)}
    units = [i for i, c in cells.items() if all(is_unit(x) for x in c if x)]
    names = [i for i in cells if i not in units]
    if not names:
        names, units = units[:1], units[1:]
    # The line of names above the units; without units, the line nearest to the samples.
    at_units = units[-1] if units else None
    at_names = names[-1] if names else None
    if at_units is not None:
        at_names = max((i for i in names if i < at_units), default=at_names)
    if layout.header_line is not None:
        at_names = layout.header_line - 1 if layout.header_line else None
    if layout.unit_line is not None:
        at_units = layout.unit_line - 1 if layout.unit_line else None
    return at_names, at_units if at_units != at_names else None


def _header_cells(line: str, grid: _Grid) -> list[str] | None:
    """Cells of a header line, as many as a row has; None if it cannot be split so."""
    bare = line.strip(" ") if grid.separator == "\t" else line.strip()
    for sign in _COMMENT_SIGNS:
        bare = bare.removeprefix(sign)
    bare = bare.lstrip(" ")
    ways = [_cells(bare, grid.separator)]
    if grid.separator == WHITESPACE:
        # Names of several words stand apart by several blanks, and a unit belongs to the word before it.
        ways += [re.split(r"\s{2,}|\t", bare.strip())]
        ways += [re.split(r"\s+(?![\[(])", bare.strip())]
    ways += [_cells(bare, s) for s in SEPARATORS if s not in (grid.separator, WHITESPACE) and s in bare]
    for cells in ways:
        while len(cells) > grid.width and not cells[-1]:
            cells = cells[:-1]
        if grid.open_end and len(cells) == grid.width - 1:
            cells = [*cells, ""]
        if len(cells) == grid.width:
            return [cell.strip().strip("\"'").strip() for cell in cells]
    # An export for LabVIEW names a column of comments that its rows leave out.
    return ways[0][:-1] if len(ways[0]) == grid.width + 1 and ways[0][-1].lower() == "comment" else None


def _are_words(cells: list[str], grid: _Grid) -> bool:
    """Whether cells are names or units: at least half of them are filled, and few are numbers."""
    filled = [cell for cell in cells if cell]
    # "10 V" is the range of a channel, not its name.
    values = sum(_is_number(c.split()[0], grid.decimal) for c in filled)
    return 2 * len(filled) >= len(cells) and 2 * values < len(filled)


def _table(lines: list[str], first: int, grid: _Grid) -> tuple[pd.DataFrame, list[str]]:
    """Cells of the samples; the index is the line of the file."""
    numbered = [(i, line) for i, line in enumerate(lines[first:], start=first + 1) if line.strip()]
    comments = [i for i, line in numbered if line[0] in " \t#%/!*" and _is_comment(line) and not grid.is_row(line)]
    remarks = [f"{len(comments)} lines of comment among the samples are left out"] if comments else []
    hidden = set(comments)
    numbered = [pair for pair in numbered if pair[0] not in hidden]
    footer = 0
    while footer < min(_FOOTER_LINES, len(numbered) - 1) and not re.search(r"\d", numbered[-1 - footer][1]):
        footer += 1
    if footer:
        remarks.append(f"{footer} lines below the samples are left out")
        numbered = numbered[:-footer]
    if len(numbered) < 2:
        raise LogError(None, None, _no_numbers([], lines))
    rows = [_row(i, line, grid) for i, line in numbered]
    table = pd.read_csv(
        io.StringIO("\n".join(rows)),
        sep=r"\s+" if grid.separator == WHITESPACE else grid.separator,
        decimal=grid.decimal,
        header=None,
        names=range(grid.width),
        index_col=False,
        dtype={i: str for i in range(grid.width) if not grid.numbers[i]},
        na_values=list(_NO_NUMBER),
        skipinitialspace=True,
        low_memory=False,
        float_precision="round_trip",
    )
    return table.set_axis([i for i, _ in numbered]), remarks


def _row(number: int, line: str, grid: _Grid) -> str:
    """A row as it is parsed, if it has as many cells as the others."""
    if grid.separator == WHITESPACE or '"' in line:
        count = len(_cells(line, grid.separator))
    else:
        count = line.count(grid.separator) + 1
        while count > grid.width and line.rstrip(" ").endswith(grid.separator):
            line, count = line.rstrip(" ")[:-1], count - 1
    if count != grid.width:
        text = f"has {count} cells, the other rows {grid.width}: the file is cut or damaged there"
        raise LogError(number, None, f"{text}, or is no table (the map's section text states its layout)")
    return line


def _signals(
    table: pd.DataFrame, names: Sequence[str], units: Sequence[str], grid: _Grid
) -> tuple[tuple[Signal, ...], datetime | None, list[str]]:
    """Signals of the columns, the absolute time of the first time stamp, and remarks."""
    signals, remarks, started = [], [], None
    stamps = [i for i in range(grid.width) if grid.stamps[i]]
    if stamps:
        seconds, started, used, remark = seconds_of_stamps([table[i] for i in stamps[:2]])
        remarks += remark
    texts, empty = [], []
    for i in range(grid.width):
        if grid.numbers[i]:
            values, remark = _floats(table[i], names[i], grid.decimal)
            if np.isnan(values).all():
                empty += [names[i]] if names[i] != f"column_{i + 1}" else []
                continue
            signals.append(Signal(names[i], units[i], values))
            remarks += remark
        elif stamps[:1] == [i]:
            signals.append(Signal(names[i], "s", seconds, since_start=started is not None))
            what = "times of day" if started is None else "dates and times"
            remarks.append(f"'{names[i]}' holds {what}: read as seconds from the first")
        elif i in stamps[:2] and used == 2:
            continue
        elif table[i].notna().any():
            texts.append(f"{names[i]} (such as '{table[i].dropna().iloc[-1]}')")
    if texts:
        remarks.append(f"columns of text are left out: {', '.join(texts)}")
    if empty:
        remarks.append(f"columns without an entry are left out: {', '.join(empty)}")
    return tuple(signals), started, remarks


def _floats(column: pd.Series, name: str, decimal: str) -> tuple[NDArray, list[str]]:
    """A column as floats; cells without a number are nan, and said."""
    if column.dtype.kind in "iufb":
        return column.to_numpy(float), []
    text = column.astype("string").str.strip().str.strip("\"'").str.strip().str.lower()
    text = text.mask(text.isin(_NO_NUMBER))
    # "1.021" is no number where the decimal sign is a comma: it may be a thousand and twenty-one.
    numbers = text.where(text.str.fullmatch(_NUMBER[decimal].pattern))
    for written, meant in ((",", "."), ("1.#inf", "inf"), ("d", "e")):
        numbers = numbers.str.replace(written, meant, regex=False)
    values = pd.to_numeric(numbers, errors="coerce")
    bad = column[(values.isna() & text.notna()).to_numpy()]
    if bad.empty:
        return values.to_numpy(float, na_value=np.nan), []
    row, cell = int(bad.index[0]), str(bad.iloc[0])
    if not (cell.isascii() and cell.isprintable()):
        raise LogError(row, name, f"must be a number, found '{cell}': the file is damaged there, copy it again")
    many = f"{bad.size} cells of '{name}' hold" if bad.size > 1 else f"a cell of '{name}' holds"
    return values.to_numpy(float, na_value=np.nan), [f"{many} no number (row {row}: '{cell}')"]
