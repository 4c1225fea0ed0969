"""Arguments and options that commands share; each has one name, meaning and type."""

import difflib
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from ccmodel.cli import completion, destination

BATCH_FILE = "batch.yaml"


def batch_folder(ctx: typer.Context, value: Path | None) -> Path | None:
    """The folder of a batch that was named by its folder or by its `batch.yaml`.

    Raises
    ------
    InputError
        If there is no such folder, or it holds no `batch.yaml`.
    """
    if value is None or ctx.resilient_parsing:
        return value
    folder = value.parent if value.name == BATCH_FILE and value.is_file() else existing_folder(value)
    if not (folder / BATCH_FILE).exists():
        from ccmodel.typed import InputError

        inside = completion.batches_in(folder)
        advice = (
            f"it holds the batches {', '.join(inside)}"
            if inside
            else f"if it has the logs of a rig, draft one with: ccmodel init {folder}"
        )
        raise InputError(f"{folder}: has no {BATCH_FILE}; {advice}")
    return folder


def existing_folder(path: Path) -> Path:
    """The folder.

    Raises
    ------
    InputError
        If there is none.
    """
    return path if path.is_dir() else _refuse(path, "folder", "file")


def _refuse(path: Path, wanted: str, other: str) -> NoReturn:
    """Say what stands in the place of a folder or file that is wanted, or which is there with a similar name."""
    from ccmodel.typed import InputError

    if path.exists():
        raise InputError(f"{path}: is a {other}; a {wanted} is expected")
    around = path.parent.iterdir() if path.parent.is_dir() else ()
    beside = [f.name for f in around if f.is_dir() == (wanted == "folder")]
    guess = difflib.get_close_matches(path.name, beside, n=1, cutoff=0.75)
    advice = f"; did you mean {path.parent / guess[0]}?" if guess else ""
    raise InputError(f"{path}: there is no such {wanted}{advice}")


def input_folder(ctx: typer.Context, value: Path | None) -> Path | None:
    """A folder that is read.

    Raises
    ------
    InputError
        If there is none.
    """
    return value if value is None or ctx.resilient_parsing else existing_folder(value)


def input_file(ctx: typer.Context, value: Path | None) -> Path | None:
    """A file that is read.

    Raises
    ------
    InputError
        If there is none.
    """
    if value is None or ctx.resilient_parsing or value.is_file():
        return value
    _refuse(value, "file", "folder")


_BATCH = {"callback": batch_folder, "autocompletion": completion.batch_folders, "show_default": False}

Batch = Annotated[Path, typer.Argument(metavar="BATCH", help="Folder of a batch, or its batch.yaml.", **_BATCH)]
BatchOption = Annotated[Path | None, typer.Option("--batch", help="Folder of a batch, or its batch.yaml.", **_BATCH)]
Model = Annotated[
    Path,
    typer.Option(
        "--model", help="A model file, as a diagnosis or a fit writes it.", callback=input_file, show_default=False
    ),
]
Results = Annotated[
    Path, typer.Argument(metavar="RESULTS", help="Folder of a run's results, or of a diagnosis.", callback=input_folder)
]
Cores = Annotated[int, typer.Option("--cores", min=1, help="Number of processes.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document; errors too.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print the result alone: no progress, hints or warnings.")]


def out_folder(text: str) -> typer.models.OptionInfo:
    """`--out` of a command that writes a folder."""
    return typer.Option("--out", help=text, callback=destination.try_folder, show_default=False)


def out_file(text: str) -> typer.models.OptionInfo:
    """`--out` of a command that writes a file."""
    return typer.Option("--out", help=text, callback=destination.try_file, show_default=False)
