"""The folder or file that a command will write, tried before the work; nothing remains of the trial."""

from pathlib import Path
from tempfile import TemporaryFile

import typer


def try_folder(ctx: typer.Context, param: typer.CallbackParam, value: Path | None) -> Path | None:
    """A folder that can be written to, or made.

    Raises
    ------
    InputError
        If it cannot.
    """
    if value is not None and not ctx.resilient_parsing:
        _try_folder(param, value, value)
    return value


def try_file(ctx: typer.Context, param: typer.CallbackParam, value: Path | None) -> Path | None:
    """A file that can be written.

    Raises
    ------
    InputError
        If it cannot.
    """
    if value is None or ctx.resilient_parsing:
        return value
    if value.is_dir():
        raise _refused(param, value, "is a folder; name a file")
    _try_folder(param, value.parent, value)
    if value.exists():
        try:
            value.open("ab").close()
        except OSError as error:
            raise _refused(param, value, f"cannot be written ({error.strerror})") from None
    return value


def _try_folder(param: typer.CallbackParam, folder: Path, named: Path) -> None:
    """Write a nameless file into a folder, or make the first of its missing folders and remove it again."""
    try:
        missing = [f for f in (folder, *folder.parents) if not f.exists()]
        existing = missing[-1].parent if missing else folder
        if not existing.is_dir():
            text = "is a file; name a folder" if existing == named else f"cannot be made: {existing} is a file"
            raise _refused(param, named, text)
        if missing:
            missing[-1].mkdir()
            missing[-1].rmdir()
        else:
            TemporaryFile(dir=folder).close()
    except OSError as error:
        raise _refused(param, named, f"cannot be written ({error.strerror})") from None


def _refused(param: typer.CallbackParam, path: Path, text: str) -> Exception:
    from ccmodel.typed import InputError

    return InputError(f"{param.opts[0]}: {path}: {text}")
