"""Log readers: one module a format.

To add a format, add a module to this folder with

- `SUFFIXES`: the endings of its file names, such as `(".csv", ".csv.gz")`;
- `read(path)`: the log as a DataFrame. The columns have the names and the order of the file, repeated names included. A
  cell is a number, a text or missing. The index is the row in the file as an editor counts it. A damaged or cut file
  raises `LogError`; a missing file may raise any `OSError`.

The checks of columns, cells and time are common to all formats (`ccmodel.rig.log`).
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pandas as pd

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import csv


@cache
def registry() -> dict[str, Callable[[Path], pd.DataFrame]]:
    """Readers by suffix."""
    modules = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
    return {suffix: module.read for module in modules for suffix in module.SUFFIXES}


def read(path: Path) -> pd.DataFrame:
    """Read a log with the reader of its suffix; one of an unknown suffix is read as CSV.

    Raises
    ------
    LogError
        If the file is missing, damaged or cut.
    """
    readers = registry()
    suffix = max((s for s in readers if path.name.lower().endswith(s)), key=len, default=None)
    try:
        return readers.get(suffix, csv.read)(path)
    except FileNotFoundError:
        raise LogError(None, None, "there is no such file: put it there or take it out of batch.yaml") from None
    except OSError as error:
        raise LogError(None, None, f"cannot be read ({error.strerror})") from None
