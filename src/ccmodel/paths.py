"""Folders and files that a user names: those that are read, and those that results are written to.

The command line and the Python interface check them here, before the work. A destination is tried, and nothing remains
of the trial.
"""

import difflib
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from shlex import quote
from tempfile import TemporaryFile
from typing import NoReturn

from ccmodel import inputs

BATCH_FILE = "batch.yaml"
# Before the name of what is being made (`ccmodel.outputs`).
UNFINISHED = ".unfinished-"


def batch_folder(path: str | Path) -> Path:
    """The folder of a batch that is named by its folder or by its `batch.yaml`.

    Raises
    ------
    InputError
        If there is no such folder, or it holds no `batch.yaml`.
    """
    path = expanded(path)
    folder = path.parent if path.name == BATCH_FILE and path.is_file() else existing_folder(path)
    if not (folder / BATCH_FILE).exists():
        inside = batches_in(folder)
        advice = (
            f"it holds the batches {', '.join(inside)}"
            if inside
            else f"if it has the logs of a rig, draft one with: ccmodel init {quote(str(folder))}"
        )
        _refuse(f"{folder}: has no {BATCH_FILE}; {advice}")
    return folder


def batches_in(folder: Path) -> list[str]:
    """Folders of batches in a folder, by name."""
    return sorted(f.parent.name for f in folder.glob(f"*/{BATCH_FILE}"))


def existing_folder(path: str | Path) -> Path:
    """A folder that is read.

    Raises
    ------
    InputError
        If there is none.
    """
    path = expanded(path)
    return path if path.is_dir() else _missing(path, "folder", "file")


def existing_file(path: str | Path) -> Path:
    """A file that is read: a regular one, since a pipe or a device may have no end.

    Raises
    ------
    InputError
        If there is none.
    """
    path = expanded(path)
    if not path.exists() or path.is_dir():
        _missing(path, "file", "folder")
    _check_regular(path, "")
    return path


def _missing(path: Path, wanted: str, other: str) -> NoReturn:
    """Say what stands in the place of a folder or file that is wanted, or which is there with a similar name."""
    if path.exists():
        _refuse(f"{path}: is a {other}; a {wanted} is expected")
    around = path.parent.iterdir() if path.parent.is_dir() else ()
    beside = [f.name for f in around if f.is_dir() == (wanted == "folder")]
    guess = difflib.get_close_matches(path.name, beside, n=1, cutoff=0.75)
    advice = f"; did you mean {path.parent / guess[0]}?" if guess else ""
    _refuse(f"{path}: there is no such {wanted}{advice}")


def try_folder(
    path: str | Path, option: str = "out", files: Iterable[str] = (), read: Iterable[str | Path] = ()
) -> Path:
    """A folder that can be written to, or made, for results.

    Parameters
    ----------
    path : str or Path
    option : str
        Option that names it, in the message.
    files : iterable of str
        Names of the files that are written into it.
    read : iterable of str or Path
        Files that are read.

    Raises
    ------
    InputError
        If it cannot, or lies in the folder of a batch, or a file in it that would be written is read.
    """
    path = try_batch_folder(path, option)
    _check_outside_batches(path, option, "folder")
    for name in files:
        _check_not_read(path / name, option, read)
    return path


def _check_outside_batches(path: Path, option: str, kind: str) -> None:
    """Refuse the folder of a batch and all that lies in it: whatever a batch's folder holds becomes part of it."""
    place = path.resolve()
    if (place / BATCH_FILE).exists():
        _refuse(f"{option}: {path}: is the folder of a batch; name another one")
    if batch := next((folder for folder in place.parents if (folder / BATCH_FILE).exists()), None):
        _refuse(f"{option}: {path}: is in {batch}, the folder of a batch; name a {kind} outside it")


def _check_not_read(path: Path, option: str, read: Iterable[str | Path]) -> None:
    if path.exists() and any(path.samefile(one) for one in map(expanded, read) if one.exists()):
        _refuse(f"{option}: {path}: is read by this command; name another place")


def try_batch_folder(path: str | Path, option: str = "out") -> Path:
    """As `try_folder`, for logs and a `batch.yaml`."""
    path = expanded(path)
    _try(path, path, option, path / f"{UNFINISHED}files")
    return path


def try_file(path: str | Path, option: str = "out", read: Iterable[str | Path] = ()) -> Path:
    """A file that can be written; parameters as of `try_folder`.

    Parameters
    ----------
    read : iterable of str or Path
        Files that are read.

    Raises
    ------
    InputError
        If it cannot, or if it is read, or lies in the folder of a batch.
    """
    path = expanded(path)
    if path.is_dir():
        _refuse(f"{option}: {path}: is a folder; name a file")
    _try(path.parent, path, option, path.with_name(UNFINISHED + path.name))
    _check_outside_batches(path, option, "file")
    _check_not_read(path, option, read)
    if path.exists():
        _check_regular(path, f"{option}: ")
        try:
            path.open("ab").close()
        except OSError as error:
            _refuse(f"{option}: {path}: cannot be written ({error.strerror})")
    return path


def _check_regular(path: Path, option: str) -> None:
    try:
        inputs.check_regular(path)
    except OSError as error:
        _refuse(f"{option}{path}: {error.strerror}")


def _try(folder: Path, named: Path, option: str, unfinished: Path) -> None:
    """Write a nameless file into a folder, whose missing folders are made and removed again; try a name in it too."""
    try:
        missing = [f for f in (folder, *folder.parents) if not f.exists()]
        existing = missing[-1].parent if missing else folder
        if not existing.is_dir():
            text = "is a file; name a folder" if existing == named else f"cannot be made: {existing} is a file"
            _refuse(f"{option}: {named}: {text}")
        made: list[Path] = []
        try:
            for one in reversed(missing):
                one.mkdir()
                made.append(one)
            TemporaryFile(dir=folder).close()
            with suppress(FileNotFoundError):
                unfinished.lstat()
        finally:
            for one in reversed(made):
                one.rmdir()
    except (OSError, ValueError) as error:  # the latter for a name with a zero byte
        _refuse(f"{option}: {named}: cannot be written ({getattr(error, 'strerror', None) or error})")


def expanded(path: str | Path) -> Path:
    """A path with `~` and `~name` replaced by the user's folder."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        _refuse(f"{path}: there is no such user")


def _refuse(line: str) -> NoReturn:
    # The command line starts in a moment: what reads settings is loaded only for a message.
    from ccmodel.typed import InputError

    raise InputError(line) from None
