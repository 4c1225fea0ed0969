"""The table of a log whose signals already carry the names of the format's columns."""

from math import isclose

import numpy as np
import pandas as pd

from ccmodel.rig import units
from ccmodel.rig.columns import UNIT_OF
from ccmodel.rig.findings import LogError
from ccmodel.rig.readers.attempt import IMPORTING
from ccmodel.rig.readers.contract import SignalFile
from ccmodel.rig.readers.names import bare_unit

TIME = "time_s"


def log_of_signals(file: SignalFile, format: str) -> pd.DataFrame:
    """Signals over one time base as the table of a log.

    Parameters
    ----------
    file : SignalFile
        Signals of the same length. Time is the signal `time_s`, or the time axis that all of them share.
    format : str
        Name of the format, for messages.

    Returns
    -------
    DataFrame
        A column a signal, named as the signal without its group; the index counts the samples from 1.

    Raises
    ------
    LogError
        If the signals have no common time, or a unit is stated that is not that in the column's name, or not known.
    """
    names = [s.name.rpartition("/")[2] for s in file.signals]
    for name, signal in zip(names, file.signals, strict=True):
        _check_unit(name, signal.unit, format)
    lengths = {len(s.values) for s in file.signals}
    if len(lengths) > 1:
        text = f"the signals of the {format} have different lengths ({min(lengths)} to {max(lengths)} samples)"
        raise LogError(None, None, f"{text}: {IMPORTING}")
    columns = [s.values for s in file.signals]
    if TIME not in names:
        axes = [s.time_s for s in file.signals]
        if axes[0] is None or any(a is None or not np.array_equal(a, axes[0]) for a in axes):
            text = f"the signals of the {format} have no common time axis and none is named {TIME}"
            raise LogError(None, TIME, f"{text}: {IMPORTING}")
        names, columns = [TIME, *names], [axes[0], *columns]
    index = np.arange(1, len(columns[0]) + 1)
    # By position: a log with a name twice is refused by the checks of the columns.
    return pd.DataFrame(dict(enumerate(columns)), index=index).set_axis(names, axis=1)


def _check_unit(column: str, stated: str, format: str) -> None:
    """Raise `LogError` if the file states another unit of a column than its name ends in."""
    needed = UNIT_OF.get(column)
    # A time of netCDF has "seconds since" a date.
    unit = bare_unit(stated.partition(" since ")[0])
    if needed is not None and units.states_unit(unit) and not _is_same(unit, needed):
        text = f"the {format} states its unit as '{stated}', and its name ends in another one"
        raise LogError(None, column, f"{text}: {IMPORTING}")


def _is_same(unit: str, needed: str) -> bool:
    """Whether two units are the same one; one that cannot be read is no other."""
    try:
        return units.quantity_of(unit) == units.quantity_of(needed) and isclose(units.factor(unit, needed), 1.0)
    except units.UnitError:
        return False
