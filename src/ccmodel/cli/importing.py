"""Import of logs in any format, and of the public da Vinci recordings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ccmodel.cli.group import PREPARE, PROJECT, command
from ccmodel.cli.interruption import leaving
from ccmodel.cli.options import Json, Quiet, input_folder, out_batch
from ccmodel.cli.output import Output

if TYPE_CHECKING:
    from ccmodel.rig.importing.draft import GuessedMap
    from ccmodel.rig.importing.writing import Written


def add_to(app: typer.Typer) -> None:
    """Add the commands."""
    logs = "ccmodel import measurements/*.csv --out data/raw/my-batch"
    command(app, "import", PREPARE, [logs, f"{logs} --map data/raw/my-batch/map.yaml"])(import_)
    example = "ccmodel import-mis-tool path/to/mis-tool-characterization --out results/real/raw"
    command(app, "import-mis-tool", PROJECT, [example])(import_mis_tool)


def import_(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILES", help="The rig's logs, in any format.", show_default=False)
    ],
    out: Annotated[Path, out_batch("Folder of the batch; its name becomes the batch's.")],
    map_file: Annotated[
        Path | None,
        typer.Option("--map", help="What each column is made of; without it, a map is guessed.", show_default=False),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Import logs of any format into a batch; without a map, guess one to be corrected.

    Exits with 1 if a file was left out.
    """
    from ccmodel.rig.importing import draft, showing, writing

    output = Output(as_json, quiet)
    with leaving(out), output.progress() as progress:
        if map_file is None:
            guessed = draft.write_guess(files, out, progress)
            shown, next_ = showing.guess_tables(guessed), showing.next_of_guess(guessed, files, out)
            data, left_out = _guess_as_data(guessed), False
        else:
            imported = writing.import_files(files, map_file, out, progress)
            shown, next_ = showing.import_tables(imported), showing.next_of_import(imported, out)
            data, left_out = _import_as_data(imported), bool(imported.remarks)
    output.result(data, *shown)
    output.hint(next_)
    if left_out:
        raise typer.Exit(1)


def _guess_as_data(guessed: "GuessedMap") -> dict:
    files = {
        guessed.names[role]: [
            {"column": g.column, "signal": g.signal, "unit": g.unit, "sign": g.sign, "sure": g.sure, "why": g.why}
            for g in one.guesses
        ]
        for role, one in guessed.guessed.items()
    }
    missing = list(dict.fromkeys(text for one in guessed.guessed.values() for text in one.open))
    return {"map": guessed.file, "files": files, "missing": missing, "remarks": guessed.remarks}


def _import_as_data(imported: "Written") -> dict:
    recordings = {
        id_: {"samples": len(one.table), "columns": one.formulas, "remarks": one.remarks}
        for id_, one in imported.recordings.items()
    }
    return {
        "folder": imported.folder,
        "recordings": recordings,
        "left_out": imported.remarks,
        "batch_file_drafted": imported.drafted,
        "not_listed": imported.unlisted,
    }


def import_mis_tool(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE", help="The data set or one of its folders.", callback=input_folder, show_default=False
        ),
    ],
    out: Annotated[Path, out_batch("Folder for the batches, one for each tool and angle.")],
    name: Annotated[
        str | None,
        typer.Option(
            help="Convert one folder of trials to the batch of this name, and keep all others.", show_default=False
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Convert the public da Vinci instrument recordings in SOURCE to batches.

    Exits with 1 if a file was left out.
    """
    from ccmodel.rig import mis_tool

    output = Output(as_json, quiet)
    with leaving(out), output.progress() as progress:
        if name:
            imported = mis_tool.import_batch(source, out / name)
        else:
            imported = mis_tool.import_mis_tool(source, out, progress)
    output.result({"batches": imported.batches, "findings": imported.findings}, *map(str, imported.batches))
    output.findings(imported.findings)
