"""Prediction of a batch by a model."""

from pathlib import Path
from typing import Annotated

import typer

from ccmodel.cli.group import MODEL, command
from ccmodel.cli.interruption import leaving
from ccmodel.cli.options import Batch, Json, Model, Quiet, out_folder
from ccmodel.cli.output import Output


def add_to(app: typer.Typer) -> None:
    """Add the command."""
    example = "ccmodel predict data/raw/later --model out/model.json --out predicted"
    command(app, "predict", MODEL, [example])(predict)


def predict(
    batch: Batch,
    model: Model,
    out: Annotated[Path, out_folder("Folder for the predictions, a CSV for each recording.")],
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Predict the sensor readings of a batch's recordings by a fitted model, and print the errors.

    Exits with 1 if a recording has no prediction.
    """
    import ccmodel

    output = Output(as_json, quiet)
    with leaving(out), output.progress() as progress:
        predicted = ccmodel.predict(model, batch, out, progress=progress)
    lines = []
    if len(predicted):
        table = predicted.table.reset_index().to_string(index=False, float_format="%.2f")
        lines = ["root mean square error over the last cycle, % of peak to peak", table]
    errors = predicted.errors.to_dict("records")
    findings = [str(finding) for finding in predicted.findings]
    data = {"out": out, "errors": errors, "findings": findings, "notes": predicted.notes}
    output.result({**data, "left_out": predicted.left_out}, *lines)
    for line in predicted.notes:
        output.finding(line, "warning")
    output.findings(predicted.findings, predicted.left_out)
