"""Fit of the calibrated model to a batch."""

from pathlib import Path
from typing import Annotated

import typer

from ccmodel.cli.group import MODEL, command
from ccmodel.cli.interruption import leaving
from ccmodel.cli.options import (
    Batch,
    Cycles,
    Json,
    Quiet,
    Step,
    Tolerance,
    TrustInputs,
    out_file,
    tolerance_of,
)
from ccmodel.cli.output import Output
from ccmodel.progress import within


def add_to(app: typer.Typer) -> None:
    """Add the command."""
    partly = "ccmodel fit data/raw/loops --free stiffness_N_per_m --free friction_coefficient --out partly.json"
    command(app, "fit", MODEL, ["ccmodel fit data/raw/loops --out fit.json", partly])(fit)


def fit(
    batch: Batch,
    out: Annotated[Path, out_file("File for the fitted model, JSON.")],
    free: Annotated[
        list[str],
        typer.Option(
            help="Parameter that is fitted, the others keep their estimates; may be repeated. Without it, all that the"
            " recordings determine.",
            show_default=False,
        ),
    ] = [],  # noqa: B006
    tolerance: Tolerance = [],  # noqa: B006
    step: Step = None,
    cycles: Cycles = None,
    trust_inputs: TrustInputs = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fit the calibrated model to a batch, with 90 % intervals.

    Exits with 1 if the fit did not succeed or a recording was left out.
    """
    import ccmodel
    from ccmodel.api.batch import check_consistent
    from ccmodel.api.options import settings_of
    from ccmodel.studies.diagnosis.run import INGEST

    output, shares = Output(as_json, quiet), tolerance_of(tolerance)
    # The same check as below, before the batch is read.
    settings_of(shares, step, cycles)
    with leaving(out), output.progress() as progress:
        loaded = ccmodel.load(batch, progress=within(progress, 0.0, INGEST))
        check_consistent(loaded, trust_inputs, "--trust-inputs")
        fitted = ccmodel.fit(
            loaded,
            free or None,
            tolerance=shares,
            step_s=step,
            cycles=cycles,
            trust_inputs=trust_inputs,
            progress=progress,
        )
        fitted.save(out)
    refused = [finding for finding in fitted.batch.findings if finding.is_refused]
    trusted = [finding for finding in fitted.batch.findings if finding.is_inconsistent and not finding.is_refused]
    left_out = list(map(str, refused))
    data = {**fitted.to_dict(), "out": out, "warnings": fitted.warnings, "notes": fitted.notes, "left_out": left_out}
    output.result(data, fitted.text)
    for line in fitted.warnings:
        output.finding(line, "warning")
    for finding in [*trusted, *refused]:
        output.finding(str(finding), finding.severity)
    output.hint(f"wrote {out}")
    if refused or not fitted.succeeded:
        raise typer.Exit(1)
