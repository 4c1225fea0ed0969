"""Comparison of the columns of a batch's logs with each other and with the sensors that `batch.yaml` states.

A log that lacks a column of the majority is damaged. A column that no log of several has is taken as left out on
purpose: one warning. A batch of one log has no majority, so a missing column refuses the log.
"""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import pandas as pd

from ccmodel.rig.batch import SENSOR_COLUMNS, Rig
from ccmodel.rig.findings import Defect, LogError


class _Sensor(NamedTuple):
    """A sensor of `batch.yaml`: its keys, the columns that may carry it and the channels that need it."""

    keys: tuple[str, ...]
    columns: tuple[str, ...]
    channels: tuple[str, ...]

    @property
    def absent(self) -> Defect:
        keys, columns, verb = " and ".join(self.keys), " or ".join(self.columns), "are" if self.channels[1:] else "is"
        text = f"states {keys}, but no log has {columns}: {', '.join(self.channels)} {verb} absent"
        return Defect(None, None, text)


class ColumnChecks:
    """The columns of all logs of a batch.

    Parameters
    ----------
    rig : Rig
        The sensors that `batch.yaml` states.
    logs : sequence of DataFrame or None
        All logs of the batch; None for those that were refused, which count for nothing.
    """

    def __init__(self, rig: Rig, logs: Sequence[pd.DataFrame | None]):
        sensors = _stated(rig)
        self.readable = sum(log is not None for log in logs)
        self.single = len(logs) == 1
        self.count = Counter(column for log in logs if log is not None for column in log)
        self.stated = {column for sensor in sensors for column in sensor.columns}
        self.absent = [s for s in sensors if self.readable and not any(self.count[c] for c in s.columns)]

    @property
    def warnings(self) -> list[Defect]:
        """A warning for each sensor that is in no log of several."""
        return [] if self.single else [sensor.absent for sensor in self.absent]

    def check(self, log: pd.DataFrame) -> list[Defect]:
        """Columns of `log` that the other logs lack.

        Raises
        ------
        LogError
            If it lacks columns itself.
        """
        if self.single and self.absent:
            lost = ", ".join(f"{' or '.join(s.columns)} (stated by {' and '.join(s.keys)})" for s in self.absent)
            raise LogError(
                1,
                self.absent[0].columns[0],
                f"column missing though batch.yaml states its sensor: {lost}; restore the column or, if the rig has no"
                " such sensor, take its key out of batch.yaml",
            )
        lost = [c for c in SENSOR_COLUMNS if self._expected(c) and c not in log]
        if lost:
            raise LogError(1, lost[0], f"column missing though other logs of the batch have it: {', '.join(lost)}")
        rare = [c for c in log if c in self.stated and not self._expected(c)]
        return [Defect(1, c, f"only {self.count[c]} of {self.readable} logs have this column") for c in rare]

    def _expected(self, column: str) -> bool:
        """Whether most logs have a column; if half of them have it, `batch.yaml` decides."""
        twice = 2 * self.count[column]
        return twice > self.readable or (twice == self.readable and column in self.stated)


def _stated(rig: Rig) -> list[_Sensor]:
    sensors = []
    for end in rig.ends:
        key, side = f"rig.{end.name}", end.side
        if end.name == "load" and side.encoder_counts_per_rev:
            sensors.append(_Sensor((f"{key}.encoder_counts_per_rev",), ("load_encoder_counts",), (end.angle,)))
        torques = {"torque_sensor": "torque_counts", "torque_constant_Nm_per_A": "current_A"}
        torques = {f"{key}.{name}": f"{end.name}_{column}" for name, column in torques.items() if getattr(side, name)}
        if torques:
            sensors.append(_Sensor(tuple(torques), tuple(torques.values()), (end.torque, *end.tensions)))
        if side.load_cell:
            sensors.append(_Sensor((f"{key}.load_cell",), (f"{end.name}_load_cell_V",), (end.force, *end.tensions)))
    return sensors
