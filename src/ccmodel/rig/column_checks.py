"""Comparison of the columns of a batch's logs with each other and with the sensors that `batch.yaml` states.

A log that lacks a column of the majority is damaged. A column that no log of several has is taken as left out on
purpose: one warning. A batch of one log has no majority, so a missing column refuses the log.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import pandas as pd

from ccmodel.channels import CHANNELS, F_LOAD, SUM_AT, T2, TAU_OUT, TENSIONS, THETA_MOTOR, THETA_OUT, TORQUE_AT
from ccmodel.rig.batch import RAW_COLUMNS, SENSOR_COLUMNS, Batch, Rig, Side
from ccmodel.rig.findings import Defect, LogError
from ccmodel.typed import meaning_at


class _Sensor(NamedTuple):
    """A sensor of `batch.yaml`: its keys, the columns that may carry it and the channels that need it.

    `others` are physical columns that may stand in place of the raw ones.
    """

    keys: tuple[str, ...]
    columns: tuple[str, ...]
    channels: tuple[str, ...]
    others: tuple[str, ...] = ()

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
        self.rig = rig
        # A physical column needs no sensor in batch.yaml that converts it.
        self.stated = {column for sensor in sensors for column in sensor.columns} | set(CHANNELS)
        self.absent = [s for s in sensors if self.readable and not any(self.count[c] for c in (*s.columns, *s.others))]

    @property
    def refusals(self) -> list[Defect]:
        """Keys without which the columns of the logs cannot be used, one line each: the batch is refused."""
        return [
            Defect(None, None, f"{'.'.join(key)}: fill in {meaning_at(Batch, key)}; the logs have {', '.join(found)}")
            for key, columns in _needed(self.rig)
            if (found := [column for column in columns if self.count[column]])
        ]

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
        missing = [c for c in SENSOR_COLUMNS if self._expected(c) and not {c, *_SAME_QUANTITY[c]} & set(log)]
        if missing:
            text = f"column missing though other logs of the batch have it: {', '.join(missing)}"
            raise LogError(1, missing[0], text)
        wanted = _FAR_END_COLUMNS.get(self.rig.far_end or "", ())
        if wanted and not set(wanted) & set(log) & self.stated:
            text = f"far_end is {self.rig.far_end}: one of {', '.join(wanted)} is needed, and the key that converts it"
            raise LogError(1, wanted[0], text)
        rare = [c for c in log if c in self.stated and not self._expected(c)]
        return [Defect(1, c, f"only {self.count[c]} of {self.readable} logs have this column") for c in rare]

    def _expected(self, column: str) -> bool:
        """Whether most logs have a column; if half of them have it, `batch.yaml` decides."""
        twice = 2 * self.count[column]
        return twice > self.readable or (twice == self.readable and column in self.stated)


# Columns of which the model's far end takes one.
_FAR_END_COLUMNS = {
    "measured-motion": (*RAW_COLUMNS[THETA_OUT], THETA_OUT),
    "measured-tension": (*RAW_COLUMNS[F_LOAD], *RAW_COLUMNS[TAU_OUT], F_LOAD, TAU_OUT, T2),
}
# A raw column and the physical one that may stand in its place.
_SAME_QUANTITY: dict[str, tuple[str, ...]] = {
    column: (channel,) for channel, columns in RAW_COLUMNS.items() for column in columns
}
_SAME_QUANTITY |= {channel: RAW_COLUMNS.get(channel, ()) for channel in CHANNELS}


def _stated(rig: Rig) -> list[_Sensor]:
    sensors = []
    for end in rig.ends:
        key, side = f"rig.{end.name}", end.side
        if end.name == "load":
            columns = {"encoder_counts_per_rev": "load_encoder_counts", "angle_resolution_rad": end.angle}
            sensors += _sensor(key, side, columns, (end.angle,), (end.angle,))
        else:
            columns = {"motor_counts_per_rev": RAW_COLUMNS[THETA_MOTOR][0]}
            sensors += _sensor(key, side, columns, (THETA_MOTOR,), (THETA_MOTOR,))
        columns = {"torque_sensor": f"{end.name}_torque_counts", "torque_constant_Nm_per_A": f"{end.name}_current_A"}
        sensors += _sensor(key, side, columns, (end.torque, *end.tensions), (end.torque, *end.tensions))
        columns = {"load_cell": f"{end.name}_load_cell_V"}
        sensors += _sensor(key, side, columns, (end.force, *end.tensions), (end.force, *end.tensions))
    return sensors


def _sensor(key: str, side: Side, columns: Mapping[str, str], channels: tuple, others: tuple) -> list[_Sensor]:
    """The sensor of these columns by key, if one of its keys is stated."""
    stated = {f"{key}.{name}": column for name, column in columns.items() if getattr(side, name) is not None}
    return [_Sensor(tuple(stated), tuple(stated.values()), channels, others)] if stated else []


def _needed(rig: Rig) -> Iterator[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Keys that `batch.yaml` lacks, and the columns that cannot be used without them."""
    counted = ["drive"] + ["load"] * (rig.far_end == "measured-motion")
    for end in rig.ends:
        if end.name in counted and end.side.encoder_counts_per_rev is None:
            yield ("rig", end.name, "encoder_counts_per_rev"), RAW_COLUMNS[end.angle]
    if rig.accuracy.torque_Nm is None:
        yield ("rig", "accuracy", "torque_Nm"), tuple(TORQUE_AT.values())
    if rig.accuracy.load_cell_N is None:
        yield ("rig", "accuracy", "load_cell_N"), (*SUM_AT.values(), *TENSIONS)
