"""Fit of the calibrated model to a batch."""

from pathlib import Path
from typing import Annotated

import typer

from ccmodel.cli.group import MODEL, command
from ccmodel.cli.interruption import leaving
from ccmodel.cli.options import Batch, Json, Quiet, out_file
from ccmodel.cli.output import Output


def add_to(app: typer.Typer) -> None:
    """Add the command."""
    command(app, "fit", MODEL, ["ccmodel fit data/raw/loops --out fit.json"])(fit)


def fit(
    batch: Batch,
    out: Annotated[Path, out_file("File for the fitted model, JSON.")],
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fit the calibrated model to a batch, with 90 % intervals.

    Exits with 1 if the fit did not succeed or a recording was left out.
    """
    import ccmodel

    output = Output(as_json, quiet)
    with leaving(out), output.progress() as progress:
        loaded = ccmodel.load(batch)
        fitted = ccmodel.fit(loaded, progress=progress)
        fitted.save(out)
    output.result(fitted.to_dict(), repr(fitted), f"wrote {out}")
    refused = [finding for finding in loaded.findings if finding.severity != "warning"]
    for finding in refused:
        output.finding(str(finding), finding.severity)
    if refused or not fitted.succeeded:
        raise typer.Exit(1)
