"""Commands for those who work on the project itself."""

import json
from pathlib import Path
from typing import Annotated

import typer

from ccmodel.cli.group import PROJECT, command
from ccmodel.cli.interruption import leaving
from ccmodel.cli.options import Cores, Json, Quiet, input_file, new_file, out_folder
from ccmodel.cli.output import Output


def add_to(app: typer.Typer) -> None:
    """Add the commands."""
    example = "ccmodel table-one config/table-one.yaml --out results/table-one --figure docs/figures/table-one.png"
    command(app, "table-one", PROJECT, [example])(table_one)
    command(app, "schema", PROJECT, ["ccmodel schema > schema.json"])(schema)
    command(app, "reference", PROJECT, ["ccmodel reference > docs/command-line.md"])(reference)


def table_one(
    settings: Annotated[
        Path,
        typer.Argument(
            metavar="SETTINGS", help="config/table-one.yaml or one like it.", callback=input_file, show_default=False
        ),
    ],
    out: Annotated[Path, out_folder("Folder for the tables.")],
    figure: Annotated[
        Path, typer.Option(help="File for the figure, PNG, SVG or PDF.", callback=new_file, show_default=False)
    ],
    cores: Cores = 1,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find the left-out effects, and their sizes, that give the errors of the paper's Table I."""
    from ccmodel.steps.files import read_json
    from ccmodel.studies.table_one.study import table_one as run

    output = Output(as_json, quiet)
    with leaving(out, figure), output.progress() as progress:
        text = run(settings, out, figure, cores, progress)
    output.result(read_json(out / "summary.json"), text)


def schema() -> None:
    """Print the JSON schema of the configuration."""
    from ccmodel.config import Config

    typer.echo(json.dumps(Config.model_json_schema(), indent=1))


def reference(context: typer.Context) -> None:
    """Print docs/command-line.md."""
    from ccmodel.cli.reference import page

    typer.echo(page(context.find_root().command), nl=False)
