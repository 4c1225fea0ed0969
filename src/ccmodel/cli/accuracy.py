"""Accuracy of a run against the accepted one."""

from pathlib import Path
from typing import Annotated

import typer

from ccmodel.cli.group import RESULTS, Commands, command
from ccmodel.cli.interruption import leaving
from ccmodel.cli.options import Cores, Json, Quiet, RunResults
from ccmodel.cli.output import Output


def add_to(app: typer.Typer) -> None:
    """Add the group of commands."""
    group = typer.Typer(cls=Commands, help="Watch the model's accuracy: compare a run with what was accepted.")
    command(group, "check", None, ["ccmodel accuracy check results"])(check)
    command(group, "accept", None, ['ccmodel accuracy accept results --reason "a new batch"'])(accept)
    command(group, "history", None, ["ccmodel accuracy history"])(history)
    app.add_typer(group, name="accuracy", rich_help_panel=RESULTS)


def check(results: RunResults = Path("results"), as_json: Json = False, quiet: Quiet = False) -> None:
    """Compare the last run with the accepted accuracy.

    Exits with 0 if everything was compared and nothing was lost, with 1 on a loss or something that could not be
    compared, with 2 if there is no run, if its results have changed since, or if there is no baseline that can be read.
    """
    from ccmodel.accuracy.baseline import ACCEPT
    from ccmodel.accuracy.comparison import GAINED
    from ccmodel.accuracy.gate import check as run
    from ccmodel.cli.output import say

    output = Output(as_json, quiet)
    found, summary = run(results)
    gained = found.of(GAINED)
    data = {
        "summary": summary,
        "lost": found.losses,
        "gained": list(map(str, gained)),
        "not_compared": found.not_compared,
    }
    output.result(data, *(f"gained: {change}" for change in gained[:3]))
    if not as_json:
        for line in found.losses:
            say(f"lost: {line}", "red")
        for line in found.not_compared:
            say(f"not compared: {line}", "yellow")
        typer.echo(f"accuracy: {summary}")
    if found.losses or found.not_compared or gained:
        output.hint(f"if this accuracy is right, accept it: {ACCEPT}")
    if found.losses or found.not_compared:
        raise typer.Exit(1)


def accept(
    reason: Annotated[
        str, typer.Option(help="Why this accuracy is right, for the reader of the baseline.", show_default=False)
    ],
    results: RunResults = Path("results"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Make the last run the accepted accuracy, and append it to the history."""
    from ccmodel.accuracy.gate import accept as run

    state = run(results, reason)
    Output(as_json, quiet).result(
        {"baseline": state.baseline, "history": state.history, "batches": sorted(state.batches)},
        f"{state.baseline}: {len(state.batches)} batches; {state.history} has the run as its last. Commit both.",
    )


def history(
    rev: Annotated[
        list[str],
        typer.Option(
            help="Commits A..B (along first parents, without A) or one commit; may be repeated.", show_default=False
        ),
    ] = [],  # noqa: B006
    file: Annotated[Path, typer.Option("--history", help="The history.")] = Path("config/accuracy-history.csv"),
    cores: Cores = 2,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Print the accuracy of past commits; with --rev, run these commits first and add them.

    Exits with 1 if a commit could not be run.
    """
    from ccmodel.accuracy.gate import fill_history
    from ccmodel.accuracy.history import overview, read_history

    output = Output(as_json, quiet)
    go_on = "commits in the history need not be named again"
    with leaving(file, go_on=go_on), output.progress() as progress:
        skipped = fill_history(file, rev, cores, progress)
    output.result({"history": read_history(file).to_dict("records"), "left_out": skipped}, overview(file))
    for line in skipped:
        output.finding(line, "refused")
    if skipped:
        raise typer.Exit(1)
