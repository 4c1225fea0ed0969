"""Diagnosis of a batch."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ccmodel.cli import completion
from ccmodel.cli.group import MODEL, command
from ccmodel.cli.interruption import leaving
from ccmodel.cli.options import Batch, Json, Quiet, input_file, out_folder
from ccmodel.cli.output import Output

if TYPE_CHECKING:
    from ccmodel.studies.diagnosis.settings import Diagnosing


def add_to(app: typer.Typer) -> None:
    """Add the command."""
    later = "ccmodel diagnose data/raw/later --baseline out/model.json --freeze --out later"
    command(app, "diagnose", MODEL, ["ccmodel diagnose data/raw/loops --out out", later])(diagnose)


def diagnose(
    batch: Batch,
    out: Annotated[Path, out_folder("Folder for diagnosis.json, the page and the models.")],
    without: Annotated[
        list[str],
        typer.Option(
            help="Mechanism that is no candidate; may be repeated.",
            autocompletion=completion.mechanisms,
            show_default=False,
        ),
    ] = [],  # noqa: B006
    tolerance: Annotated[
        list[str],
        typer.Option(
            help="Tolerance as a SHARE of peak to peak, or by channel as tau_in_Nm=0.02, repeated.",
            show_default=False,
        ),
    ] = [],  # noqa: B006
    step: Annotated[
        float | None, typer.Option(min=1e-4, help="Time between compared samples, s.", show_default=False)
    ] = None,
    cycles: Annotated[
        int | None, typer.Option(min=1, help="Number of compared cycles of a sine.", show_default=False)
    ] = None,
    baseline: Annotated[
        Path | None,
        typer.Option(
            help="Model file to start from, instead of the estimates.", callback=input_file, show_default=False
        ),
    ] = None,
    freeze: Annotated[bool, typer.Option("--freeze", help="Keep all values of the baseline: find a change.")] = False,
    candidate: Annotated[
        list[str],
        typer.Option(
            help="As 'kink at conduit', or two with a comma: fit it in full whatever the screening says.",
            autocompletion=completion.candidates,
            show_default=False,
        ),
    ] = [],  # noqa: B006
    trust_inputs: Annotated[
        bool, typer.Option("--trust-inputs", help="Diagnose even if the inputs contradict one another.")
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 unless the model agrees.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Decide whether the calibrated model explains a batch; if not, locate and name the physics left out.

    Exits with 0 at any verdict, unless --strict is given.
    """
    from ccmodel.studies.diagnosis.run import diagnose as run
    from ccmodel.studies.diagnosis.run import options_of

    options = options_of(settings_of(tolerance, step, cycles, candidate), without, freeze)
    output = Output(as_json, quiet)
    with leaving(out), output.progress() as progress:
        diagnosis = run(batch, out, options, baseline, progress, trust_inputs)
    output.result({**diagnosis, "out": out}, diagnosis["headline"])
    if strict and diagnosis["verdict"] != "agrees":
        raise typer.Exit(1)


def settings_of(tolerance: list[str], step: float | None, cycles: int | None, candidate: list[str]) -> "Diagnosing":
    """Settings of a diagnosis from the words of the command line.

    Raises
    ------
    InputError
        That names the option which cannot be used.
    """
    from pydantic import ValidationError

    from ccmodel.studies.diagnosis.settings import Diagnosing
    from ccmodel.typed import InputError

    forced = [[one.strip() for one in stated.split(",")] for stated in candidate]
    shares = _tolerance(tolerance)
    try:
        return Diagnosing(tolerance=shares, step_s=step, cycles=cycles, forced_candidates=forced)
    except ValidationError as error:
        # A tolerance is a number or a dict; the error on the form that was not used is of no interest.
        first = next(e for e in error.errors() if e["type"] not in ("float_type", "dict_type"))
        option = "--tolerance" if first["loc"] else "--candidate"
        raise InputError(f"{option}: {first['msg'].removeprefix('Value error, ')}") from None


def _tolerance(stated: list[str]) -> float | dict[str, float]:
    """One share for all channels, or one for each channel."""
    from ccmodel.channels import MEASURED
    from ccmodel.typed import InputError

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
