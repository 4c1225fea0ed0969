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
    from ccmodel.steps.predict import predict as run

    output = Output(as_json, quiet)
    with leaving(out), output.progress() as progress:
        messages, errors = run(batch, model, out, progress)
    lines = []
    if len(errors):
        by_channel = errors.pivot(index="recording", columns="channel", values="nrmse_percent")
        table = by_channel[errors["channel"].unique()].to_string(float_format="%.2f")
        lines = ["root mean square error over the last cycle, % of peak to peak", table]
    output.result({"out": out, "errors": errors.to_dict("records"), "left_out": messages}, *lines)
    for line in messages:
        output.finding(line, "refused")
    if messages:
        raise typer.Exit(1)
