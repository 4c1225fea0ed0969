"""The outcome of a run or of a diagnosis."""

from pathlib import Path
from typing import Annotated

import typer

from ccmodel.cli.group import RESULTS, command
from ccmodel.cli.options import Json, Quiet, Results, input_folder
from ccmodel.cli.output import Output, say


def add_to(app: typer.Typer) -> None:
    """Add the command, also under its former name."""
    command(app, "report", RESULTS, ["ccmodel report results", "ccmodel report out"])(report)
    app.command("left-out", hidden=True)(left_out)


def report(results: Results = Path("results"), as_json: Json = False, quiet: Quiet = False) -> None:
    """Print the verdicts of a run, or of one diagnosis: held-out errors, what was not used, contradictions, the page.

    Exits with 1 if something was left out or inputs contradict one another.
    """
    from ccmodel.outputs import is_unfinished
    from ccmodel.report.summary import summary_of

    output = Output(as_json, quiet)
    if is_unfinished(results):
        text = "a command is writing there, or was killed: run it again, and it restores or replaces the earlier files"
        output.finding(f"{results}: {text}", "warning")
    summary = summary_of(results)
    output.result(summary.as_dict(), *summary.lines())
    for line in summary.warnings:
        output.finding(line, "warning")
    for line in summary.inconsistent:
        output.finding(line, "inconsistent")
    for line in summary.left_out:
        output.finding(line, "refused")
    if summary.left_out or summary.inconsistent:
        raise typer.Exit(1)


def left_out(results: Annotated[Path, typer.Argument(callback=input_folder)]) -> None:
    """Former name of `report`."""
    say("left-out is now part of: ccmodel report", "yellow")
    report(results)
