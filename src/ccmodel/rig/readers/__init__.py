"""Log readers: one module a format.

To add a format, add a module to this folder with `FORMAT`, a `ccmodel.rig.readers.contract.Format`: its name, the
endings of its file names, the function that reads its signals and, if it needs a library, the extra that installs it.
`ccmodel.rig.readers.signatures` has the first bytes by which its files are known.

`read_signals` reads any file into signals. `read` reads a log of a batch, whose columns have the names of the format of
a batch; such a log in CSV is read strictly (`ccmodel.rig.readers.csv`). The checks of columns, cells and time are the
same for all formats (`ccmodel.rig.log`).
"""

from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING

import numpy as np

from ccmodel import inputs
from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import signatures
from ccmodel.rig.readers.apart import read_apart
from ccmodel.rig.readers.attempt import COPY, read_here
from ccmodel.rig.readers.contract import Format, Signal, SignalFile, TextLayout
from ccmodel.rig.readers.names import split_unit, unique

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Format", "Signal", "SignalFile", "TextLayout", "read", "read_signals", "registry"]


@cache
def registry() -> dict[str, Format]:
    """Formats by the name of their module."""
    modules = {m.name: import_module(f"{__name__}.{m.name}") for m in iter_modules(__path__)}
    return {name: module.FORMAT for name, module in modules.items() if hasattr(module, "FORMAT")}


def read_signals(path: Path, text: TextLayout | None = None) -> SignalFile:
    """Read the signals of a file of any format.

    Parameters
    ----------
    path : Path
        The file; or the folder of a ROS 2 bag.
    text : TextLayout, optional
        Layout of a text file, where it is not to be found from the file.

    Returns
    -------
    SignalFile
        Signals, at least one.

    Raises
    ------
    LogError
        If the file is missing, damaged, cut, of no known format or without numbers, or if a library is missing.
    """
    path = Path(path)
    try:
        _check_files(path)
        name = _format_of(path)
    except FileNotFoundError:
        raise LogError(None, None, "there is no such file") from None
    except OSError as error:
        raise LogError(None, None, f"cannot be read ({error.strerror})") from None
    format = registry()[name]
    result = read_apart(name, format, path) if format.apart else read_here(format, path, text)
    if isinstance(result, LogError):
        raise result
    return _checked(result, format)


def _check_files(path: Path) -> None:
    """Raise `OSError` if a file, or one in the folder of a bag, is no regular one or too large."""
    for file in sorted(path.iterdir()) if path.is_dir() else [path]:
        if file == path or not file.is_dir():
            inputs.check_file(file, inputs.LOG)


def _format_of(path: Path) -> str:
    """Name of the format of a file, of its first bytes; the ending of its name must not say otherwise."""
    kind, ending = signatures.kind_of(path), _ending(path)
    named = [name for name, format in registry().items() if ending in format.suffixes]
    asked = "text" if "text" in named else f"a {registry()[named[0]].name}" if named else "a log"
    if kind is signatures.EMPTY:
        raise LogError(None, None, f"is empty (0 bytes): record it again or {COPY}")
    if kind is signatures.UNKNOWN and asked in ("text", "a log"):
        raise LogError(None, None, f"is not text and of no format known here: {COPY}, or export it as CSV")
    if kind is signatures.UNKNOWN:
        raise LogError(None, None, f"does not begin as {asked} does: it is damaged, or of another format; {COPY}")
    if kind.module is None:
        raise LogError(None, None, f"is {kind.text}, not {asked}: {kind.advice}")
    if named and kind.module not in named:
        raise LogError(None, None, f"is {kind.text}, not {asked}: rename it to {kind.advice}")
    return kind.module


def _ending(path: Path) -> str:
    name = path.name.lower().removesuffix(".gz")
    return Path(name).suffix


def _checked(file: SignalFile, format: Format) -> SignalFile:
    """Signals with units taken out of their names, each name once."""
    signals = [s for s in file.signals if len(s.values)]
    if not signals:
        more = "; ".join(file.remarks)
        more = f" ({more})" if more else ""
        raise LogError(None, None, f"the {format.name} holds no signals of numbers{more}: record or export it again")
    split = [split_unit(s.name) if not s.unit else (s.name, s.unit) for s in signals]
    names = unique(name.strip() or "column" for name, _ in split)
    return replace(
        file,
        signals=tuple(
            replace(s, name=name, unit=unit.strip(), values=np.asarray(s.values, float))
            for name, (_, unit), s in zip(names, split, signals, strict=True)
        ),
    )


def read(path: Path) -> "pd.DataFrame":
    """Read a log of a batch: a table whose columns have the names of the format of a batch.

    Returns
    -------
    DataFrame
        The columns have the names and the order of the file, repeated names included. A cell is a number, a text or
        missing. The index is the row in the file as an editor counts it.

    Raises
    ------
    LogError
        If the file is missing, damaged or cut, or if its signals have no common time.
    """
    # They load pandas, for which the process of a file of another format (`read_apart`) would wait a second.
    from ccmodel.rig.readers import csv, log_table

    path = Path(path)
    try:
        _check_files(path)
        if (module := signatures.kind_of(path).module) not in (None, "text") and _ending(path) not in csv.SUFFIXES:
            return log_table.log_of_signals(read_signals(path), registry()[module].name)
        return csv.read(path)
    except FileNotFoundError:
        raise LogError(None, None, "there is no such file: put it there or take it out of batch.yaml") from None
    except OSError as error:
        raise LogError(None, None, f"cannot be read ({error.strerror})") from None
