"""Command line of the virtual rig."""

import json
import os
from pathlib import Path
from typing import Annotated

import typer
from pydantic import ValidationError
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from virtualrig.campaign import BatchExistsError, concealed, record_campaign
from virtualrig.config import read_campaign

app = typer.Typer(no_args_is_help=True, add_completion=False)
_errors = Console(stderr=True)


@app.callback()
def _describe() -> None:
    """Record batches on a simulated rig. None of its output is experimental."""


@app.command()
def record(
    config: Annotated[Path, typer.Argument(exists=True, dir_okay=False, help="The campaign's YAML file.")],
    out: Annotated[Path, typer.Option(file_okay=False, help="Folder that gets one folder a batch.")],
    batch: Annotated[list[str] | None, typer.Option(help="Record only this batch; may be repeated.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Number of processes; the recordings do not depend on it.")] = (
        os.cpu_count() or 1
    ),
    concealed_file: Annotated[
        Path | None, typer.Option("--concealed", dir_okay=False, help="File for what the rig has and no batch states.")
    ] = None,
) -> None:
    """Record the batches of a campaign; earlier batches of the virtual rig are replaced."""
    try:
        campaign = read_campaign(config)
    except ValidationError as error:
        _fail(f"{config}: {error}")
    names = batch or list(campaign.batches)
    if unknown := [name for name in names if name not in campaign.batches]:
        _fail(f"{config} has no batch {', '.join(unknown)}; it has {', '.join(campaign.batches)}")
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=_errors) as progress:
        task = progress.add_task("recording", total=sum(len(campaign.batches[name].recordings) for name in names))
        try:
            record_campaign(campaign, out, names, jobs, lambda done: progress.update(task, advance=1, description=done))
        except BatchExistsError as error:
            _fail(str(error))
    if concealed_file:
        text = json.dumps(concealed(campaign), indent=1, ensure_ascii=False)
        concealed_file.write_text(text + "\n", encoding="utf-8")


def _fail(message: str) -> None:
    _errors.print(message, style="red", markup=False, highlight=False)
    raise typer.Exit(code=2)


def main() -> None:
    """Run the command line."""
    app()
