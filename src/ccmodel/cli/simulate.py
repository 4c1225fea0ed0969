"""Simulation of a motion by a model."""

from pathlib import Path
from typing import Annotated

import typer

from ccmodel.cli.group import MODEL, command
from ccmodel.cli.interruption import leaving
from ccmodel.cli.options import BatchOption, ConduitsOf, Json, Model, Pretension, Quiet, input_file, out_file
from ccmodel.cli.output import Output
from ccmodel.paths import try_file


def add_to(app: typer.Typer) -> None:
    """Add the command."""
    example = "ccmodel simulate motion.csv --model out/model.json --out simulated.csv"
    command(app, "simulate", MODEL, [example])(simulate)


def simulate(
    motion: Annotated[
        Path,
        typer.Argument(
            metavar="MOTION",
            help="CSV with the columns time_s and theta_in_rad.",
            callback=input_file,
            show_default=False,
        ),
    ],
    model: Model,
    out: Annotated[Path, out_file("File for the sensor readings, CSV.")],
    batch: BatchOption = None,
    recording: ConduitsOf = None,
    pretension: Pretension = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Simulate the sensor readings of a rig for a motion of its drive, by a fitted model.

    A model file of an earlier version does not know the conduits of its rig: name a batch of it with --batch.
    """
    import ccmodel

    output = Output(as_json, quiet)
    # The same check as below, with the name that the option has here.
    try_file(out, "--out", read=(model, motion))
    with leaving(out), output.progress() as progress:
        simulated = ccmodel.simulate(
            model, motion, recording=recording, batch=batch, pretension_N=pretension, out=out, progress=progress
        )
    samples = simulated.time_s.size
    data = {"out": out, "recording": simulated.id, "samples": samples, "pretension_N": simulated.pretension_N}
    output.result(data)
    output.hint(f"wrote {out}: {samples} samples, pretension {simulated.pretension_N:.4g} N")
