"""Use of a model from the drive's side: the load that the drive feels, and the drive's motion for a wanted one."""

from pathlib import Path
from typing import Annotated

import typer

from ccmodel.cli.group import MODEL, command
from ccmodel.cli.interruption import leaving
from ccmodel.cli.options import (
    Batch,
    BatchOption,
    ConduitsOf,
    Json,
    Model,
    Pretension,
    Quiet,
    Tolerance,
    input_file,
    out_file,
    out_folder,
    tolerance_of,
)
from ccmodel.cli.output import Output
from ccmodel.paths import try_file


def add_to(app: typer.Typer) -> None:
    """Add the commands."""
    example = "ccmodel estimate data/raw/later --model out/model.json --out estimated"
    command(app, "estimate", MODEL, [example])(estimate)
    example = "ccmodel compensate out/model.json --wanted wanted.csv --out drive.csv --max-speed 10"
    command(app, "compensate", MODEL, [example])(compensate)


def estimate(
    batch: Batch,
    model: Model,
    out: Annotated[Path, out_folder("Folder for the estimates, a CSV for each recording.")],
    unknown_load: Annotated[
        bool, typer.Option("--unknown-load", help="Take the load as unknown, though the model has a spring.")
    ] = False,
    tolerance: Tolerance = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Estimate the load's torque and angle, with 90 % intervals, from the drive's angle and torque.

    Each value depends on the samples up to its own time alone. Sensors at the load are used for the printed errors
    alone. Exits with 1 if a recording has no estimate.
    """
    import ccmodel

    output = Output(as_json, quiet)
    shares = tolerance_of(tolerance)
    with leaving(out), output.progress() as progress:
        found = ccmodel.estimate(model, batch, out, unknown_load=unknown_load, tolerance=shares, progress=progress)
    lines = [found.errors.to_string(index=False, float_format="{:.3g}".format)] if len(found.errors) else []
    errors, visible = found.errors.to_dict("records"), found.visible_share.to_dict()
    data = {"out": out, "errors": errors, "visible_share": visible, "notes": found.notes}
    data |= {"findings": [str(finding) for finding in found.findings], "left_out": found.left_out}
    output.result(data, *lines)
    for line in found.notes:
        output.message(line)
    output.findings(found.findings, found.left_out)


def compensate(
    model: Annotated[
        Path,
        typer.Argument(
            metavar="MODEL",
            help="A model file, as a diagnosis or a fit writes it.",
            callback=input_file,
            show_default=False,
        ),
    ],
    wanted: Annotated[
        Path,
        typer.Option(
            "--wanted", help="CSV with the columns time_s and theta_out_rad.", callback=input_file, show_default=False
        ),
    ],
    out: Annotated[Path, out_file("File for the drive's motion, CSV.")],
    max_speed: Annotated[
        float | None, typer.Option(help="Largest speed of the drive, rad/s.", show_default=False)
    ] = None,
    max_acceleration: Annotated[
        float | None,
        typer.Option(help="Largest acceleration of the drive, rad/s^2; needs --max-speed.", show_default=False),
    ] = None,
    batch: BatchOption = None,
    recording: ConduitsOf = None,
    pretension: Pretension = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find the drive's motion that makes the load follow a wanted motion, by a fitted model with a load spring.

    At a reversal of the load the drive crosses the lost motion at once, or within its limits.
    """
    import ccmodel

    output = Output(as_json, quiet)
    # The same check as below, with the name that the option has here.
    try_file(out, "--out", read=(model, wanted))
    with leaving(out), output.progress() as progress:
        found = ccmodel.compensate(
            model,
            wanted,
            max_speed_rad_per_s=max_speed,
            max_acceleration_rad_per_s2=max_acceleration,
            recording=recording,
            batch=batch,
            pretension_N=pretension,
            out=out,
            progress=progress,
        )
    data = {
        "out": out,
        "samples": len(found.table),
        "lost_motion_rad": found.lost_motion_rad,
        "straight_lost_motion_rad": found.straight_lost_motion_rad,
        "largest_speed_rad_per_s": found.largest_speed_rad_per_s,
        "notes": found.notes,
    }
    output.result(data)
    for line in found.notes:
        output.finding(line, "warning")
    output.hint(f"wrote {out}. {found!r}")
