"""Files and folders that are written whole: made beside their place, then renamed.

Whatever ends a command (an error, a full disk, a kill), a place holds what was there before or what is new, never half
of it, and nothing of what was there before is lost. What a killed command has left, the next one that writes there
brings to an end.
"""

import os
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from ccmodel.paths import UNFINISHED, expanded
from ccmodel.typed import InputError

try:
    import fcntl
except ImportError:  # not Unix
    fcntl = None  # type: ignore[assignment]

# Where `new_files` works, within the folder of its files, and what its new files are called once they may take places.
_FILES = f"{UNFINISHED}files"
_COMPLETE = "complete"
# Held by the command that writes into the folder; the system lets go of the lock of a killed one.
_LOCK = f"{UNFINISHED}lock"


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Name the file or folder in an error of the system: one of a full disk does not.

    An error that names a file elsewhere, such as one that is read, is one of that file.
    """
    try:
        yield
    except OSError as error:
        place = path.resolve()
        named = Path(error.filename).resolve() if isinstance(error.filename, str) else place
        is_unfinished = any(part.startswith(UNFINISHED) for part in named.parts)
        if is_unfinished or named.is_relative_to(place) or place.is_relative_to(named):
            raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None
        raise InputError(f"{error.filename}: cannot be used ({error.strerror or error})") from None


@contextmanager
def new_file(path: str | Path) -> Iterator[Path]:
    """Where to write a file that takes the place of `path` at the end, if nothing was raised.

    Missing folders above it are made.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    path = expanded(path)
    with _naming(path):
        place = path.resolve()
        place.parent.mkdir(parents=True, exist_ok=True)
        fresh = place.with_name(UNFINISHED + place.name)
        try:
            yield fresh
            fresh.replace(place)
        finally:
            fresh.unlink(missing_ok=True)


@contextmanager
def new_files(folder: str | Path, last: str | None = None, without: Collection[str] = ()) -> Iterator[Path]:
    """Where to write files that belong together; at the end they take their places in `folder`, if nothing was raised.

    The files that they replace are put aside first, and other files stay. So the files in the folder are never from two
    runs. After a kill in between, the next call brings the earlier files back, or the rest of the new ones.

    Parameters
    ----------
    folder : str or Path
        It is made if it is missing.
    last : str, optional
        Name of the file that says that the others are complete: the first that goes and the last that comes.
    without : collection of str
        Names of files of an earlier run that go even if no new one takes their place.

    Raises
    ------
    InputError
        If they cannot be written, or another command is writing into the folder.
    """
    folder = expanded(folder)
    with _naming(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with _alone_in(folder):
            _settle(folder, last)
            work = folder / _FILES
            fresh, earlier = work / "new", work / "earlier"
            for made in (work, fresh, earlier):
                made.mkdir()
            try:
                yield fresh
                for name in (*reversed(_in_order(fresh, last)), *without):
                    with suppress(FileNotFoundError):
                        (folder / name).rename(earlier / name)
                fresh.rename(work / _COMPLETE)
            finally:
                _settle(folder, last)


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """The only command that writes into a folder; raises `InputError` if there is another one."""
    lock = folder / _LOCK
    file = _held(lock)
    try:
        yield
    finally:
        # Before it is let go of, so that nobody holds a file that is going to be removed.
        lock.unlink(missing_ok=True)
        file.close()


def _held(lock: Path) -> IO[str]:
    """The file of a lock, open and locked as far as the file system knows locks."""
    while True:
        file = lock.open("w")
        try:
            if fcntl:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.close()
            raise InputError(f"{lock.parent}: another command is writing there; try again when it has ended") from None
        except OSError:
            return file
        # The command that had the lock may have removed its file since it was opened here.
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file.fileno()), lock.stat()):
                return file
        file.close()


def is_unfinished(folder: Path) -> bool:
    """Whether files of a command lie aside in a folder: it goes on, or it was killed."""
    return (folder / _FILES).exists()


def _settle(folder: Path, last: str | None) -> None:
    """Bring what `new_files` began to an end: all new files take their places, or all earlier ones take them again.

    The new ones do if all earlier files were put aside.
    """
    work = folder / _FILES
    complete, earlier = work / _COMPLETE, work / "earlier"
    source = complete if complete.exists() else earlier
    if source.exists():
        for name in _in_order(source, last):
            (source / name).rename(folder / name)
    # Before the sign that they are not wanted again.
    shutil.rmtree(earlier, ignore_errors=True)
    shutil.rmtree(work, ignore_errors=True)


def _in_order(folder: Path, last: str | None) -> list[str]:
    """Names of the files in a folder, with `last` at the end."""
    return sorted((file.name for file in folder.iterdir()), key=lambda name: (name == last, name))


@contextmanager
def new_folder(path: str | Path) -> Iterator[Path]:
    """Where to make a folder that takes the place of `path` as a whole at the end, if nothing was raised.

    Yields
    ------
    Path
        Of the same name as `path`; it does not exist yet.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    path = expanded(path)
    with _naming(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        # In the parent of `path`, since a folder can only be renamed within a file system.
        work = path.with_name(UNFINISHED + path.name)
        fresh, earlier = work / path.name, work / f"earlier-{path.name}"
        # A command that was killed between the two renamings below.
        if earlier.exists() and not path.exists():
            earlier.rename(path)
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir()
        try:
            yield fresh
            if path.exists():
                path.rename(earlier)
            try:
                fresh.rename(path)
            except BaseException:
                if earlier.exists():
                    earlier.rename(path)
                raise
        finally:
            shutil.rmtree(work, ignore_errors=True)
