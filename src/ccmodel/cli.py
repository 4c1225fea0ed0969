"""The command line: the pipeline's functions from a shell."""

import json
import sys
from pathlib import Path
from typing import Annotated, ClassVar

import typer
from pydantic import ValidationError
from rich.console import Console
from typer.core import TyperGroup

from ccmodel.typed import InputError


class _FormerOptions(TyperGroup):
    """Takes options under the names that they had before, and says what they are called now."""

    renamed: ClassVar = {
        "--allowance": "--tolerance",
        "--suspect": "--candidate",
        "--beside": "--baseline",
        "--hold": "--freeze",
    }

    def parse_args(self, ctx, args):
        """Click's own, with every option under its current name."""
        current = []
        for word in args:
            option, equals, value = word.partition("=")
            if option in self.renamed:
                _err.print(f"{option} is now called {self.renamed[option]}", style="yellow", markup=False)
            current.append(self.renamed.get(option, option) + equals + value)
        return super().parse_args(ctx, current)


app = typer.Typer(
    cls=_FormerOptions, help=__doc__, no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False
)
_err = Console(stderr=True, soft_wrap=True, highlight=False)

Folder = Annotated[Path, typer.Argument()]


@app.command()
def check(batch: Folder) -> None:
    """Read a batch folder and say what is wrong with it; exits 1 where something cannot be used."""
    from ccmodel.rig.ingest import ingest_batch

    ingested = ingest_batch(batch)
    for recording in ingested.recordings:
        typer.echo(f"{recording.id}: {recording.time_s.size} samples, {', '.join(recording.channels)}")
    for finding in ingested.findings:
        _say(str(finding), finding.severity)
    if any(f.severity == "refused" for f in ingested.findings):
        raise typer.Exit(1)


@app.command("import-mis-tool")
def import_mis_tool(
    source: Folder, out: Annotated[Path, typer.Option(help="Folder that gets a batch folder a tool and wrist angle.")]
) -> None:
    """Turn the public da Vinci instrument recordings below SOURCE into batches."""
    from ccmodel.rig import mis_tool

    imported = mis_tool.import_mis_tool(source, out)
    for batch in imported.batches:
        typer.echo(str(batch))
    for finding in imported.findings:
        _say(str(finding), finding.severity)


@app.command("left-out")
def left_out(results: Folder) -> None:
    """Say what the last run left out and warned of; exits 1 where something was left out."""
    from ccmodel.stages.report import left_out_of

    said = left_out_of(results)
    for line in said.warnings:
        _say(line, "warning")
    for line in said.left_out:
        _say(line, "refused")
    if said.left_out:
        raise typer.Exit(1)


@app.command()
def diagnose(
    batch: Folder,
    out: Annotated[Path, typer.Option(help="Folder that gets diagnosis.json, the page and the models.")],
    without: Annotated[list[str], typer.Option(help="A mechanism that is not to be asked for; may be repeated.")] = [],  # noqa: B006
    tolerance: Annotated[
        list[str],
        typer.Option(help="SHARE of peak to peak that a right model may leave; or as tau_in_Nm=0.02, repeated."),
    ] = [],  # noqa: B006
    step: Annotated[float | None, typer.Option(min=1e-4, help="Compare a sample every so often, s.")] = None,
    cycles: Annotated[int | None, typer.Option(min=1, help="Compare so many cycles of a sine.")] = None,
    baseline: Annotated[
        Path | None, typer.Option(help="A model file: ask what is missing besides what it has.")
    ] = None,
    freeze: Annotated[
        bool, typer.Option("--freeze", help="Fit nothing of that model anew: ask what has changed.")
    ] = False,
    candidate: Annotated[
        list[str],
        typer.Option(help="As 'kink at conduit', or two with a comma, to fit whatever the screening says."),
    ] = [],  # noqa: B006
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 unless it agrees: for a watch.")] = False,
) -> None:
    """Say whether the calibrated model explains a batch, and if not: where it fails and what was left out."""
    from ccmodel.config import Diagnosing
    from ccmodel.stages.diagnose import diagnose as run

    forced_candidates = [[one.strip() for one in stated.split(",")] for stated in candidate]
    try:
        judged = Diagnosing(
            tolerance=_tolerance(tolerance), step_s=step, cycles=cycles, forced_candidates=forced_candidates
        )
    except ValidationError as error:
        # One of a tolerance's two forms always has another type, which is no news.
        said = next(e for e in error.errors() if e["type"] not in ("float_type", "dict_type"))
        option = "--tolerance" if said["loc"] else "--candidate"
        raise InputError(f"{option}: {said['msg'].removeprefix('Value error, ')}") from None
    said = run(batch, out, without, lambda text: _err.print(text, style="dim", markup=False), judged, baseline, freeze)
    typer.echo(said["headline"])
    if strict and said["verdict"] != "agrees":
        raise typer.Exit(1)


def _tolerance(stated: list[str]) -> float | dict[str, float]:
    """One share for all channels, or one a channel."""
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
    out: Annotated[Path, typer.Option(help="Folder that gets a CSV a recording.")],
) -> None:
    """Say what the sensors of a batch's recordings would read, by a fitted model, and how far off that is.

    Exits with 1 where it cannot be said.
    """
    from ccmodel.stages.predict import predict as run

    said, errors = run(batch, model, out)
    if len(errors):
        typer.echo("root mean square error over the last cycle, % of peak to peak")
        by_channel = errors.pivot(index="recording", columns="channel", values="nrmse_percent")
        typer.echo(by_channel[errors["channel"].unique()].to_string(float_format="%.2f"))
    for line in said:
        _say(line, "refused")
    if said:
        raise typer.Exit(1)


@app.command()
def simulate(
    motion: Annotated[Path, typer.Argument(help="CSV with the columns time_s and theta_in_rad.")],
    model: Annotated[Path, typer.Option(help="A model file, as a diagnosis or a fit writes it.")],
    batch: Annotated[Path, typer.Option(help="Folder of a batch of the rig.")],
    out: Annotated[Path, typer.Option(help="File that gets what the sensors would read, CSV.")],
    recording: Annotated[str | None, typer.Option(help="Whose conduits and pretension; else the first one's.")] = None,
    pretension: Annotated[float | None, typer.Option(min=0.0, help="Of both cables, N; else that recording's.")] = None,
) -> None:
    """Say what the sensors would read if the drive of a rig moved so, by a fitted model."""
    from ccmodel.stages.simulate_motion import simulate_motion as run

    run(motion, model, batch, out, recording, pretension)


@app.command("table-one")
def table_one(
    settings: Annotated[Path, typer.Argument(help="config/table-one.yaml or one like it.")],
    out: Annotated[Path, typer.Option(help="Folder that gets the tables.")],
    figure: Annotated[Path, typer.Option(help="File that gets the figure, PNG or SVG.")],
    cores: Annotated[int, typer.Option(min=1, help="Processes to share the work.")] = 1,
) -> None:
    """Ask which left-out effect, and of which size, errs as the paper's Table I does."""
    from ccmodel.stages.table_one import table_one as run

    typer.echo(run(settings, out, figure, cores, tell=lambda text: _err.print(text, style="dim", markup=False)))


@app.command()
def mechanisms(
    name: Annotated[str | None, typer.Argument(help="Print the whole entry of this one.")] = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print docs/mechanisms.md.")] = False,
) -> None:
    """List the mechanisms: names, places, parameters with range and unit."""
    from rich.table import Table

    from ccmodel.mechanisms import UnknownMechanismError, catalogue

    if markdown:
        typer.echo(catalogue.page())
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


def _say(line: str, severity: str) -> None:
    style = {"warning": "yellow", "refused": "red"}[severity]
    _err.print(f"[{style}]{'warning' if severity == 'warning' else 'left out'}[/]: ", end="")
    _err.print(line, markup=False)


def main() -> None:
    """Entry point: what a user gave wrong is one line each and exit code 2, not a trace."""
    try:
        app()
    except InputError as error:
        _err.print(str(error), markup=False)
        sys.exit(2)
