"""What an import shows on the terminal."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ccmodel.rig.columns import UNIT_OF
from ccmodel.rig.importing.clocks import Cost
from ccmodel.rig.importing.draft import GuessedMap
from ccmodel.rig.importing.guess import Guess
from ccmodel.rig.importing.writing import BATCH, MAP, Written

# Files that the next command names one by one.
_FEW_FILES = 4


def guess_tables(guessed: GuessedMap) -> list[RenderableType]:
    """A table for each kind of file: column, signal, unit, reasons; then what stays open."""
    shown: list[RenderableType] = []
    for role, one in guessed.guessed.items():
        table = Table(title=guessed.names[role], title_justify="left", box=None, pad_edge=False, title_style="bold")
        for heading in ("column", "signal", "unit", "sure", "why"):
            table.add_column(heading, overflow="fold")
        if one.time is not None:
            signal, unit = one.time.signal or "", one.time.unit or ""
            table.add_row(*_cells("time_s", signal, unit, "yes" if one.time_is_sure else "no", one.time_why))
        elif not one.time_is_sure:
            table.add_row(*_cells("time_s", "", "", "no", one.time_why))
        for guess in one.guesses:
            table.add_row(*_guess_cells(guess))
        shown += [table, Text()]
    shown += [Text(remark) for remark in guessed.remarks]
    questions = dict.fromkeys(text for one in guessed.guessed.values() for text in one.open)
    return [*shown, Text("Not in these files:"), *(Text(f"  {question}") for question in questions)]


def next_of_guess(guessed: GuessedMap, files: Sequence[Path], out: Path) -> str:
    """What to do after a guess."""
    unsure = sum(bool(g.column) and not g.sure for one in guessed.guessed.values() for g in one.guesses)
    lines = f"; lines commented out because they are uncertain: {unsure}" if unsure else ""
    map_file = Path(out) / MAP
    return f"wrote {map_file}{lines}. Correct it, then: {_command(files, out, map_file)}"


def import_tables(written: Written) -> list[RenderableType]:
    """A table of the recordings, one of the joined columns and one of their clocks, and what was assumed."""
    table = Table("recording", "samples", "duration", "rate", "columns", box=None, pad_edge=False)
    for id_, one in written.recordings.items():
        time = one.table["time_s"]
        rate = 1 / time.diff().median()
        columns = ", ".join(c for c in one.table if c != "time_s")
        table.add_row(*_cells(id_, str(len(time)), f"{time.iloc[-1]:.4g} s", f"{rate:.4g} Hz", columns))
    shown: list[RenderableType] = [table]
    costs = [(id_, cost) for id_, one in written.recordings.items() for cost in one.costs]
    if costs:
        shown += [Text(), _cost_table([cost for _, cost in costs]), Text(), _clock_table(costs)]
    remarks = [(id_, remark) for id_, one in written.recordings.items() for remark in one.remarks]
    shown += [Text(), *(Text(line) for line in _together(remarks)), *(Text(line) for line in written.remarks)]
    return shown


def next_of_import(written: Written, out: Path) -> str:
    """What to do after an import."""
    folder = shlex.quote(str(out))
    batch_file = Path(out) / BATCH
    first = [f"fill in {batch_file}"] if written.drafted else []
    if written.changed:
        whose = _and_more(written.changed)
        first.append(
            f"check the values in {batch_file}: it is of an earlier import, and the log of {whose} has changed"
        )
    if written.unlisted:
        first.append(f"add {', '.join(written.unlisted)} to {batch_file}, which does not list them")
    filled = f"{'; '.join(first)}, then: " if first else ""
    count = len(written.recordings)
    return f"wrote {count} recording{'s' if count > 1 else ''} to {out}. Next, {filled}ccmodel check {folder}"


def _guess_cells(guess: Guess) -> list[Text]:
    sign = "-" if guess.sign < 0 else ""
    sure = "" if not guess.column else "yes" if guess.sure else "no"
    why = "; ".join(filter(None, guess.why))
    return _cells(guess.column or "not used", sign + guess.signal, guess.unit, sure, why)


def _cost_table(costs: Sequence[Cost]) -> Table:
    """A row for each joined column, with its largest error and noise of all recordings."""
    headings = ("joined", "signal", "rate", "by", "error midway", "noise")
    table = Table(*headings, box=None, pad_edge=False)
    for column in dict.fromkeys(cost.column for cost in costs):
        of_column = [cost for cost in costs if cost.column == column]
        one, unit = of_column[0], UNIT_OF[column]
        errors, noises = ([c.interpolation_error for c in of_column], [c.noise for c in of_column])
        rate = min(cost.rate_Hz for cost in of_column)
        row = (column, one.signal, f"{rate:.4g} Hz", one.by, _largest(errors, unit), _largest(noises, unit))
        table.add_row(*_cells(*row))
    return table


def _clock_table(costs: Sequence[tuple[str, Cost]]) -> Table:
    """A row for each clock; recordings whose clocks are alike share one."""
    columns: dict[tuple, list[str]] = {}
    for id_, cost in costs:
        offset = f"{cost.offset_s:.6g} s" + _plus_minus(cost.offset_uncertainty_s, 1.0, "s")
        drift = f"{1e6 * cost.drift:.3g} ppm" + _plus_minus(cost.drift_uncertainty, 1e6, "ppm")
        columns.setdefault((id_, offset, drift, cost.how), []).append(cost.column)
    alike: dict[tuple, list[str]] = {}
    for (id_, *clock), joined in columns.items():
        alike.setdefault((_and_more(joined), *clock), []).append(id_)
    table = Table("recording", "joined", "offset", "drift", "clock", box=None, pad_edge=False)
    for cells, ids in alike.items():
        table.add_row(*_cells(_and_more(ids), *cells))
    return table


def _plus_minus(uncertainty: float | None, scale: float, unit: str) -> str:
    if uncertainty is None:
        return " ± unknown"
    return f" ± {scale * uncertainty:.2g} {unit}" if uncertainty else ""


def _largest(values: Sequence[float | None], unit: str) -> str:
    known = [value for value in values if value is not None]
    return f"{max(known):.3g} {unit}" if known else ""


def _and_more(names: Sequence[str]) -> str:
    return f"{names[0]}{f' and {len(names) - 1} more' if len(names) > 1 else ''}"


def _together(remarks: Sequence[tuple[str, str]]) -> list[str]:
    """Remarks, those on several recordings once."""
    by_text: dict[str, list[str]] = {}
    for id_, text in remarks:
        file, colon, rest = text.partition(": ")
        by_text.setdefault(rest if colon else text, []).append(file if colon else id_)
    return [f"{_and_more(who)}: {text}" for text, who in by_text.items()]


def _command(files: Sequence[Path], out: Path, map_file: Path) -> str:
    named = " ".join(shlex.quote(str(f)) for f in files) if len(files) <= _FEW_FILES else "FILES (as before)"
    return f"ccmodel import {named} --map {shlex.quote(str(map_file))} --out {shlex.quote(str(out))}"


def _cells(*texts: str) -> list[Text]:
    """Cells as they are: a name in brackets is no markup."""
    return [Text(text) for text in texts]
