"""The command line: the pipeline's functions from a shell."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import typer
from pydantic import ValidationError
from rich.console import Console
from rich.text import Text
from typer.core import TyperGroup

from ccmodel.typed import InputError

if TYPE_CHECKING:
    from ccmodel.rig.overview import Overview


class FormerOptions(TyperGroup):
    """Accepts former names of options, with a message on the current name; other command lines state their own."""

    renamed: ClassVar = {
        "--allowance": "--tolerance",
        "--suspect": "--candidate",
        "--beside": "--baseline",
        "--hold": "--freeze",
    }

    def parse_args(self, ctx, args):
        """Parse with every option under its current name."""
        current = []
        for word in args:
            option, equals, value = word.partition("=")
            if option in self.renamed:
                _err.print(f"{option} is now called {self.renamed[option]}", style="yellow", markup=False)
            current.append(self.renamed.get(option, option) + equals + value)
        return super().parse_args(ctx, current)


app = typer.Typer(
    cls=FormerOptions, help=__doc__, no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False
)
_err = Console(stderr=True, soft_wrap=True, highlight=False)

Folder = Annotated[Path, typer.Argument()]


@app.command()
def check(batch: Folder) -> None:
    """Check a batch folder: a table for each recording and all findings.

    Exits with 1 if a file cannot be used or the inputs contradict one another.
    """
    from ccmodel.rig.ingest import ingest_batch
    from ccmodel.rig.overview import overview_of

    ingested = ingest_batch(batch)
    for recording in ingested.recordings:
        _print_overview(recording.id, overview_of(recording))
    for finding in ingested.findings:
        _print_finding(str(finding), finding.severity)
    if any(f.severity != "warning" for f in ingested.findings):
        raise typer.Exit(1)
    if not any(recording.shows_tensions for recording in ingested.recordings):
        typer.echo(
            "the logs do not show the tensions at both ends, as load cells and torques do: a diagnosis will take the"
            " initial tension from pretension_N, and identify nothing with certainty"
        )
    typer.echo(f"nothing contradicts another value. Next: ccmodel diagnose {batch} --out DIR")


@app.command("import")
def import_(
    files: Annotated[list[Path], typer.Argument(help="The rig's logs, in any format.")],
    out: Annotated[Path, typer.Option(help="Folder of the batch; its name becomes the batch's.")],
    map_file: Annotated[
        Path | None, typer.Option("--map", help="What each column is made of; without it, a map is guessed.")
    ] = None,
) -> None:
    """Import logs of any format into a batch; without a map, guess one to be corrected."""
    from ccmodel.rig import importing

    if map_file is None:
        guessed = importing.write_guess(files, out)
        _print_all(importing.guess_tables(guessed))
        written = importing.next_of_guess(guessed, files, out)
    else:
        imported = importing.import_files(files, map_file, out)
        _print_all(importing.import_tables(imported))
        written = importing.next_of_import(imported, out)
    typer.echo(written)


@app.command()
def init(folder: Folder) -> None:
    """Write a commented batch.yaml for a folder of logs, and print what to fill in; keeps an existing one."""
    from ccmodel.rig.batch import load_batch
    from ccmodel.rig.drafting import draft_batch

    typer.echo(f"{draft_batch(folder)}: fill in what is empty, then run: ccmodel check {folder}")
    try:
        load_batch(folder)
    except InputError as error:
        for problem in error.problems:
            typer.echo(f"  line {problem.line}: {problem.text}")


@app.command("import-mis-tool")
def import_mis_tool(
    source: Folder,
    out: Annotated[Path, typer.Option(help="Folder for the batches, one for each tool and angle.")],
    batch: Annotated[
        str | None, typer.Option(help="Convert one folder of trials to the batch of this name, and keep all others.")
    ] = None,
) -> None:
    """Convert the public da Vinci instrument recordings in SOURCE to batches."""
    from ccmodel.rig import mis_tool

    imported = mis_tool.import_batch(source, out / batch) if batch else mis_tool.import_mis_tool(source, out)
    for batch in imported.batches:
        typer.echo(str(batch))
    for finding in imported.findings:
        _print_finding(str(finding), finding.severity)


@app.command("left-out")
def left_out(results: Folder) -> None:
    """Print what the last run left out, contradictory inputs and warnings.

    Exits with 1 if something was left out or inputs contradict one another.
    """
    from ccmodel.report.page import left_out_of

    messages = left_out_of(results)
    for line in messages["warnings"]:
        _print_finding(line, "warning")
    for line in messages["inconsistent"]:
        _print_finding(line, "inconsistent")
    _exit_if_refused(messages["left_out"])
    if messages["inconsistent"]:
        raise typer.Exit(1)


accuracy = typer.Typer(help="Watch the model's accuracy: compare a run with what was accepted.", no_args_is_help=True)
app.add_typer(accuracy, name="accuracy")
Results = Annotated[Path, typer.Argument(help="Folder of the last run's results.")]


@accuracy.command("check")
def accuracy_check(results: Results = Path("results")) -> None:
    """Compare the last run with the accepted accuracy.

    Exits with 0 if everything was compared and nothing was lost, with 1 on a loss or something that could not be
    compared, with 2 if there is no run or no baseline that can be read.
    """
    from ccmodel.accuracy.baseline import ACCEPT
    from ccmodel.accuracy.comparison import GAINED
    from ccmodel.accuracy.gate import check as run

    found, summary = run(results)
    for change in found.of(GAINED)[:3]:
        typer.echo(f"gained: {change}")
    for line in found.losses:
        _err.print(f"lost: {line}", style="red", markup=False)
    for line in found.not_compared:
        _err.print(f"not compared: {line}", style="yellow", markup=False)
    typer.echo(f"accuracy: {summary}")
    if found.losses or found.not_compared or found.of(GAINED):
        typer.echo(f"if this accuracy is right, accept it: {ACCEPT}")
    if found.losses or found.not_compared:
        raise typer.Exit(1)


@accuracy.command("accept")
def accuracy_accept(
    reason: Annotated[str, typer.Option(help="Why this accuracy is right, for the reader of the baseline.")],
    results: Results = Path("results"),
) -> None:
    """Make the last run the accepted accuracy, and append it to the history."""
    from ccmodel.accuracy.gate import accept as run

    state = run(results, reason)
    typer.echo(f"{state.baseline}: {len(state.batches)} batches; {state.history} has the run as its last. Commit both.")


@accuracy.command("history")
def accuracy_history(
    rev: Annotated[
        list[str], typer.Option(help="Commits A..B (along first parents, without A) or one commit; may be repeated.")
    ] = [],  # noqa: B006
    file: Annotated[Path, typer.Option(help="The history.")] = Path("config/accuracy-history.csv"),
    cores: Annotated[int, typer.Option(min=1, help="Number of processes of a past run.")] = 2,
) -> None:
    """Print the accuracy of past commits; with --rev, run these commits first and add them."""
    from ccmodel.accuracy.gate import fill_history
    from ccmodel.accuracy.history import overview

    fill_history(file, rev, cores, _progress)
    typer.echo(overview(file))


@app.command()
def diagnose(
    batch: Folder,
    out: Annotated[Path, typer.Option(help="Folder for diagnosis.json, the page and the models.")],
    without: Annotated[list[str], typer.Option(help="Mechanism that is no candidate; may be repeated.")] = [],  # noqa: B006
    tolerance: Annotated[
        list[str],
        typer.Option(help="Tolerance as a SHARE of peak to peak, or by channel as tau_in_Nm=0.02, repeated."),
    ] = [],  # noqa: B006
    step: Annotated[float | None, typer.Option(min=1e-4, help="Time between compared samples, s.")] = None,
    cycles: Annotated[int | None, typer.Option(min=1, help="Number of compared cycles of a sine.")] = None,
    baseline: Annotated[Path | None, typer.Option(help="Model file to start from, instead of the estimates.")] = None,
    freeze: Annotated[bool, typer.Option("--freeze", help="Keep all values of the baseline: find a change.")] = False,
    candidate: Annotated[
        list[str],
        typer.Option(help="As 'kink at conduit', or two with a comma: fit it in full whatever the screening says."),
    ] = [],  # noqa: B006
    trust_inputs: Annotated[
        bool, typer.Option("--trust-inputs", help="Diagnose even if the inputs contradict one another.")
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 unless the model agrees.")] = False,
) -> None:
    """Decide whether the calibrated model explains a batch; if not, locate and name the physics left out."""
    from ccmodel.studies.diagnosis.run import diagnose as run
    from ccmodel.studies.diagnosis.run import options_of
    from ccmodel.studies.diagnosis.settings import Diagnosing

    forced = [[one.strip() for one in stated.split(",")] for stated in candidate]
    shares = _tolerance(tolerance)
    try:
        settings = Diagnosing(tolerance=shares, step_s=step, cycles=cycles, forced_candidates=forced)
    except ValidationError as error:
        # A tolerance is a number or a dict; the error on the form that was not used is of no interest.
        first = next(e for e in error.errors() if e["type"] not in ("float_type", "dict_type"))
        option = "--tolerance" if first["loc"] else "--candidate"
        raise InputError(f"{option}: {first['msg'].removeprefix('Value error, ')}") from None
    diagnosis = run(batch, out, options_of(settings, without, freeze), baseline, _progress, trust_inputs)
    typer.echo(diagnosis["headline"])
    if strict and diagnosis["verdict"] != "agrees":
        raise typer.Exit(1)


def _tolerance(stated: list[str]) -> float | dict[str, float]:
    """One share for all channels, or one for each channel."""
    from ccmodel.channels import MEASURED

    try:
        shares = {channel: float(share) for channel, _, share in (one.rpartition("=") for one in stated)}
    except ValueError:
        raise InputError(f"--tolerance: a share is a number, as 0.02; got {', '.join(stated)}") from None
    if list(shares) == [""]:
        return shares[""]
    if unknown := shares.keys() - set(MEASURED):
        got = ", ".join(name or "a share without a channel" for name in sorted(unknown))
        raise InputError(f"--tolerance: a channel is one of {', '.join(MEASURED)}; got {got}")
    return shares


@app.command()
def predict(
    batch: Folder,
    model: Annotated[Path, typer.Option(help="A model file, as a diagnosis or a fit writes it.")],
    out: Annotated[Path, typer.Option(help="Folder for the predictions, a CSV for each recording.")],
) -> None:
    """Predict the sensor readings of a batch's recordings by a fitted model, and print the errors.

    Exits with 1 if a recording has no prediction.
    """
    from ccmodel.steps.predict import predict as run

    messages, errors = run(batch, model, out)
    if len(errors):
        typer.echo("root mean square error over the last cycle, % of peak to peak")
        by_channel = errors.pivot(index="recording", columns="channel", values="nrmse_percent")
        typer.echo(by_channel[errors["channel"].unique()].to_string(float_format="%.2f"))
    _exit_if_refused(messages)


@app.command()
def simulate(
    motion: Annotated[Path, typer.Argument(help="CSV with the columns time_s and theta_in_rad.")],
    model: Annotated[Path, typer.Option(help="A model file, as a diagnosis or a fit writes it.")],
    batch: Annotated[Path, typer.Option(help="Folder of a batch of the rig.")],
    out: Annotated[Path, typer.Option(help="File for the sensor readings, CSV.")],
    recording: Annotated[str | None, typer.Option(help="Recording with the conduits; else the first.")] = None,
    pretension: Annotated[float | None, typer.Option(min=0.0, help="Pretension, N; else that recording's.")] = None,
) -> None:
    """Simulate the sensor readings of a rig for a motion of its drive, by a fitted model."""
    from ccmodel.steps.predict import simulate_motion as run

    run(motion, model, batch, out, recording, pretension)


@app.command("table-one")
def table_one(
    settings: Annotated[Path, typer.Argument(help="config/table-one.yaml or one like it.")],
    out: Annotated[Path, typer.Option(help="Folder for the tables.")],
    figure: Annotated[Path, typer.Option(help="File for the figure, PNG or SVG.")],
    cores: Annotated[int, typer.Option(min=1, help="Number of processes.")] = 1,
) -> None:
    """Find the left-out effects, and their sizes, that give the errors of the paper's Table I."""
    from ccmodel.studies.table_one.study import table_one as run

    typer.echo(run(settings, out, figure, cores, _progress))


@app.command()
def mechanisms(
    name: Annotated[str | None, typer.Argument(help="Print the whole entry of this one.")] = None,
    markdown: Annotated[Path | None, typer.Option(help="Write the pages of all mechanisms into this folder.")] = None,
) -> None:
    """List the mechanisms: names, places, parameters with range and unit."""
    from rich.table import Table

    from ccmodel.mechanisms import UnknownMechanismError, catalogue

    if markdown is not None:
        catalogue.write_pages(markdown)
    elif name is None:
        table = Table("name", "places", "parameters", "what it is", box=None)
        for row in catalogue.rows():
            table.add_row(*row)
        Console(soft_wrap=False, highlight=False).print(table, markup=False)
    else:
        try:
            typer.echo(catalogue.entry(name))
        except UnknownMechanismError as error:
            raise InputError(str(error)) from None


@app.command()
def schema() -> None:
    """Print the JSON schema of the configuration."""
    from ccmodel.config import Config

    typer.echo(json.dumps(Config.model_json_schema(), indent=1))


def _print_all(shown: list) -> None:
    """Print tables at the width of the terminal, and each text in one line."""
    console = Console(highlight=False)
    for one in shown:
        console.print(one, soft_wrap=isinstance(one, Text))


def _progress(text: str) -> None:
    _err.print(text, style="dim", markup=False)


def _print_overview(name: str, seen: "Overview") -> None:
    """A line on the recording and a line on each channel, which stay whole whatever the width of the terminal."""
    from rich.table import Table

    from ccmodel.channels import unit_of

    rest = f"rest {seen.rest_s:.3g} s" if seen.rest_s else "no rest at the start"
    motion = f"{seen.cycles:.1f} cycles at {seen.frequency_Hz:.4g} Hz" if seen.frequency_Hz else "no single frequency"
    typer.echo(
        f"{name}: {seen.samples} samples at {seen.rate_Hz:.5g} Hz, {seen.duration_s:.4g} s; {rest};"
        f" stroke {seen.stroke:.4g} rad; {motion}{f' ({seen.wave})' if seen.wave else ''}"
    )
    table = Table("channel", box=None, pad_edge=False)
    for title in ("lowest", "highest", "unit", "noise at rest", "resolution"):
        table.add_column(title, justify="left" if title == "unit" else "right", no_wrap=True)
    for c in seen.channels:
        noise, step = ("none" if value is None else f"{value:.3g}" for value in (c.noise, c.step))
        table.add_row(c.name, f"{c.low:.4g}", f"{c.high:.4g}", unit_of(c.name), noise, step)
    Console(width=100, highlight=False).print(table, markup=False)
    typer.echo()


def _print_finding(line: str, severity: str) -> None:
    words = {"warning": ("yellow", "warning"), "refused": ("red", "left out"), "inconsistent": ("red", "inconsistent")}
    style, word = words[severity]
    _err.print(f"[{style}]{word}[/]: ", end="")
    _err.print(line, markup=False)


def _exit_if_refused(lines: list[str]) -> None:
    """Print a line on each input that was left out; exit with 1 if there is one."""
    for line in lines:
        _print_finding(line, "refused")
    if lines:
        raise typer.Exit(1)


def main() -> None:
    """Entry point: an input error is printed as one line for each problem, without a traceback, and exits with 2."""
    try:
        app()
    except InputError as error:
        _err.print(str(error), markup=False)
        sys.exit(2)
