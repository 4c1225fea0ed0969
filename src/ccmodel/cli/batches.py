"""Commands on the folder of a batch: draft its batch.yaml, check it."""

from dataclasses import asdict
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from ccmodel.cli.group import PREPARE, command
from ccmodel.cli.options import Batch, Json, Quiet, input_folder
from ccmodel.cli.output import Output

if TYPE_CHECKING:
    from rich.console import RenderableType

    from ccmodel.rig.overview import Overview


def add_to(app: typer.Typer) -> None:
    """Add the commands."""
    command(app, "init", PREPARE, ["ccmodel init data/raw/bench"])(init)
    command(app, "check", PREPARE, ["ccmodel check data/raw/loops", "ccmodel check data/raw/loops --json"])(check)


def init(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Folder of logs.", callback=input_folder, show_default=False)
    ],
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a commented batch.yaml for a folder of logs, and print what to fill in; keeps an existing one.

    Exits with 1 if a log cannot be read; it has no entry.
    """
    from ccmodel.rig.batch import load_batch
    from ccmodel.rig.drafting import draft_and_refuse
    from ccmodel.typed import InputError, Problem

    output = Output(as_json, quiet)
    file, refused = draft_and_refuse(folder)
    try:
        load_batch(folder)
        problems: tuple[Problem, ...] = ()
    except InputError as error:
        problems = error.problems
    output.hint(f"{file}: fill in what is empty, then run: ccmodel check {quote(str(folder))}")
    fill_in = [{"line": p.line, "text": p.text} for p in problems]
    content = {"batch_file": file, "fill_in": fill_in, "refused": refused}
    output.result(content, *(f"  line {p.line}: {p.text}" for p in problems))
    for log, why in refused.items():
        output.finding(f"{folder / log}: {why}", "refused")
    if refused:
        raise typer.Exit(1)


def check(batch: Batch, as_json: Json = False, quiet: Quiet = False) -> None:
    """Check a batch folder: a table for each recording and all findings.

    Exits with 1 if a file cannot be used or the inputs contradict one another.
    """
    from ccmodel.rig.ingest import ingest_batch
    from ccmodel.rig.overview import overview_of

    output = Output(as_json, quiet)
    with output.progress() as progress:
        ingested = ingest_batch(batch, progress)
        seen = {recording.id: overview_of(recording) for recording in ingested.recordings}
    findings = [asdict(f) | {"line": str(f)} for f in ingested.findings]
    is_usable = not any(f.severity != "warning" for f in ingested.findings)
    output.result(
        {
            "usable": is_usable,
            "recordings": {name: _as_data(one) for name, one in seen.items()},
            "findings": findings,
        },
        *(one for name, overview in seen.items() for one in _lines(name, overview)),
    )
    for finding in ingested.findings:
        output.finding(str(finding), finding.severity)
    if not is_usable:
        output.hint(f"mend this, then run again: ccmodel check {quote(str(batch))}")
        raise typer.Exit(1)
    if not any(recording.shows_tensions for recording in ingested.recordings):
        output.hint(
            "the logs do not show the tensions at both ends, as load cells and torques do: a diagnosis will fit the"
            " initial tension, and no single mechanism reaches a confidence of 0.8 (docs/limits.md)"
        )
    output.hint(f"nothing contradicts another value. Next: ccmodel diagnose {quote(str(batch))} --out DIR")


def _as_data(seen: "Overview") -> dict:
    """An overview in SI units as plain data, with the units in it."""
    from ccmodel.channels import unit_of

    data = asdict(seen)
    channels = [{**channel, "unit": unit_of(channel["name"])} for channel in data.pop("channels")]
    return {("stroke_rad" if key == "stroke" else key): value for key, value in data.items()} | {"channels": channels}


def _lines(name: str, seen: "Overview") -> "list[RenderableType]":
    """A line on the recording and a line on each channel."""
    from rich.table import Table

    from ccmodel.channels import unit_of

    rest = f"rest {seen.rest_s:.3g} s" if seen.rest_s else "no rest at the start"
    motion = f"{seen.cycles:.1f} cycles at {seen.frequency_Hz:.4g} Hz" if seen.frequency_Hz else "no single frequency"
    text = (
        f"{name}: {seen.samples} samples at {seen.rate_Hz:.5g} Hz, {seen.duration_s:.4g} s; {rest};"
        f" stroke {seen.stroke:.4g} rad; {motion}{f' ({seen.wave})' if seen.wave else ''}"
    )
    table = Table("channel", box=None, pad_edge=False)
    for title in ("lowest", "highest", "unit", "noise at rest", "resolution"):
        table.add_column(title, justify="left" if title == "unit" else "right", no_wrap=True)
    for c in seen.channels:
        noise, step = ("none" if value is None else f"{value:.3g}" for value in (c.noise, c.step))
        table.add_row(c.name, f"{c.low:.4g}", f"{c.high:.4g}", unit_of(c.name), noise, step)
    return [text, table, ""]
