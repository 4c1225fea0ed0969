"""The mechanisms that a diagnosis knows."""

from pathlib import Path
from typing import Annotated

import typer

from ccmodel.cli import completion
from ccmodel.cli.group import RESULTS, command
from ccmodel.cli.options import Json, Quiet, new_folder
from ccmodel.cli.output import Output


def add_to(app: typer.Typer) -> None:
    """Add the command."""
    command(app, "mechanisms", RESULTS, ["ccmodel mechanisms", "ccmodel mechanisms backlash"])(mechanisms)


def mechanisms(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="Print the whole entry of this one.",
            autocompletion=completion.mechanisms,
            show_default=False,
        ),
    ] = None,
    markdown: Annotated[
        Path | None,
        typer.Option(
            help="Write the pages of all mechanisms into this folder.",
            callback=new_folder,
            show_default=False,
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """List the mechanisms: names, places, parameters with range and unit."""
    from rich.table import Table

    from ccmodel.mechanisms import UnknownMechanismError, catalogue, names
    from ccmodel.typed import InputError

    output = Output(as_json, quiet)
    if markdown is not None:
        catalogue.write_pages(markdown)
        output.result({"out": markdown})
        return
    try:
        if name is not None:
            output.result(catalogue.data(name), catalogue.entry(name))
            return
    except UnknownMechanismError as error:
        raise InputError(str(error)) from None
    table = Table("name", "places", "parameters", "what it is", box=None)
    for row in catalogue.rows():
        table.add_row(*row)
    output.result(list(map(catalogue.data, names())), table)
