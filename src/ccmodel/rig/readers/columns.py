"""Signals of the arrays of a file: vectors, and the columns of matrices."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ccmodel.rig.readers.content import Unpacked
from ccmodel.rig.readers.contract import Signal

# Columns of a matrix that may be signals; a matrix with more is a picture or a map.
MOST_COLUMNS = 64
BYTES_OF_A_NUMBER = np.dtype(float).itemsize


@dataclass
class Columns:
    """The signals found so far, and the names of what holds none."""

    signals: list[Signal] = field(default_factory=list)
    text: list[str] = field(default_factory=list)
    scalars: list[str] = field(default_factory=list)
    others: list[str] = field(default_factory=list)
    unpacked: Unpacked = field(default_factory=Unpacked)

    def add(self, name: str, unit: str, values: NDArray | None, time: NDArray | None = None) -> None:
        """Add an array; None is one without numbers.

        Parameters
        ----------
        values : ndarray, shape (n,), (n, k) or (k, n)
            The longer side of a matrix are its samples. A matrix is a signal a column, "name/1" to "name/k".
        time : ndarray, shape (n,), optional
            Time axis, s; left out where its length is another.
        """
        if values is None or values.dtype.kind not in "iufbc" or values.dtype.kind == "c":
            self.text.append(name)
            return
        values = np.squeeze(values)
        if values.ndim == 0:
            self.scalars.append(name)
        elif values.ndim == 1:
            self._append(name, unit, values, time)
        elif values.ndim == 2 and min(values.shape) <= MOST_COLUMNS:
            # Samples are the rows, unless there are more columns or the time axis says otherwise.
            lying = values.shape[1] > values.shape[0]
            if time is not None and len(time) in values.shape:
                lying = len(time) != values.shape[0]
            for i, column in enumerate(values if lying else values.T, start=1):
                self._append(f"{name}/{i}", unit, column, time)
        else:
            self.others.append(name)

    def _append(self, name: str, unit: str, values: NDArray, time: NDArray | None) -> None:
        # Numbers of one byte in a file take eight here.
        self.unpacked.add(len(values) * BYTES_OF_A_NUMBER)
        time = np.asarray(time, float) if time is not None and len(time) == len(values) else None
        self.signals.append(Signal(name, unit, np.asarray(values, float), time))

    def remarks(self) -> tuple[str, ...]:
        """What was left out, a sentence each."""
        left_out = {
            "text or objects, no numbers": self.text,
            "single numbers": self.scalars,
            f"more than {MOST_COLUMNS} columns": self.others,
        }
        return tuple(f"left out ({why}): {listed(names)}" for why, names in left_out.items() if names)


def listed(names: list[str], most: int = 8) -> str:
    """The first of some names, and how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
