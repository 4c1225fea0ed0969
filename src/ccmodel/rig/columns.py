"""Columns of a batch's logs against each other and against `batch.yaml`: was a sensor never there, or is a log damaged?

What `batch.yaml` states is what the rig has, and its logs are the witnesses: a log that lacks what most of the others
have lost it. Where no log has a column, it was taken out of all of them on purpose, and only said once. A single log
has no witness, and is not believed against `batch.yaml`.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from ccmodel.channels import SUM_AT, TENSIONS_AT, THETA_OUT, TORQUE_AT
from ccmodel.rig.batch import SENSOR_COLUMNS, Batch, Rig
from ccmodel.rig.findings import Finding
from ccmodel.rig.logs import Log


@dataclass(frozen=True)
class _Sensor:
    """A quantity that `batch.yaml` says is measured: the keys that say so, columns that give it, what hangs on it."""

    keys: tuple[str, ...]
    columns: tuple[str, ...]
    channels: tuple[str, ...]


def check_columns(
    batch: Batch, file: str, log_files: Sequence[str], logs: Sequence[Log]
) -> tuple[list[Finding], list[list[Finding]]]:
    """Find columns that are missing.

    Parameters
    ----------
    batch : Batch
        What `batch.yaml` says.
    file : str
        That file, for the findings.
    log_files : sequence of str
        The logs' files, in the batch's order.
    logs : sequence of Log
        What was read of them; those that were refused have no say.

    Returns
    -------
    of_batch : list of Finding
        Warnings of what is stated and yet in no log.
    of_logs : list of list of Finding
        For every log one refusal, warnings, or nothing.
    """
    sensors = _stated(batch.rig)
    stated = {column for sensor in sensors for column in sensor.columns}
    readable = [log for log in logs if log.table is not None]
    votes = Counter(column for log in readable for column in log.columns)
    expected = {c for c in SENSOR_COLUMNS if 2 * votes[c] > len(readable)}
    # Of as many logs with a column as without, those are right that agree with batch.yaml.
    expected |= {c for c in stated if readable and 2 * votes[c] == len(readable)}
    absent = [sensor for sensor in sensors if readable and not any(votes[c] for c in sensor.columns)]
    of_logs = []
    for log_file, log in zip(log_files, logs, strict=True):
        lost = [c for c in SENSOR_COLUMNS if c in expected and c not in log.columns]
        rare = [c for c in log.columns if c in stated - expected]
        if log.table is None:
            found = []
        elif len(logs) == 1 and absent:
            found = [(absent[0].columns[0], "refused", _unwitnessed(absent))]
        elif lost:
            found = [(lost[0], "refused", f"column missing though other logs of the batch have it: {', '.join(lost)}")]
        else:
            found = [(c, "warning", f"only {votes[c]} of {len(readable)} logs have this column") for c in rare]
        of_logs.append([Finding(batch.batch, log_file, 1, *what) for what in found])
    told = absent if len(logs) > 1 else []
    return [Finding(batch.batch, file, None, None, "warning", _in_no_log(sensor)) for sensor in told], of_logs


def _stated(rig: Rig) -> list[_Sensor]:
    sensors = []
    for end, side in (("drive", rig.drive), ("load", rig.load)):
        tensions = TENSIONS_AT[end]
        if end == "load" and side.encoder_counts_per_rev:
            sensors.append(_Sensor(("rig.load.encoder_counts_per_rev",), ("load_encoder_counts",), (THETA_OUT,)))
        torques = {"torque_sensor": "torque_counts", "torque_constant_Nm_per_A": "current_A"}
        torques = {f"rig.{end}.{key}": f"{end}_{column}" for key, column in torques.items() if getattr(side, key)}
        if torques:
            sensors.append(_Sensor(tuple(torques), tuple(torques.values()), (TORQUE_AT[end], *tensions)))
        if side.load_cell:
            sensors.append(_Sensor((f"rig.{end}.load_cell",), (f"{end}_load_cell_V",), (SUM_AT[end], *tensions)))
    return sensors


def _in_no_log(sensor: _Sensor) -> str:
    keys, columns = " and ".join(sensor.keys), " or ".join(sensor.columns)
    verb = "are" if len(sensor.channels) > 1 else "is"
    return f"states {keys}, but no log has {columns}: {', '.join(sensor.channels)} {verb} absent"


def _unwitnessed(absent: list[_Sensor]) -> str:
    lost = ", ".join(f"{' or '.join(s.columns)} (stated by {' and '.join(s.keys)})" for s in absent)
    return (
        f"column missing though batch.yaml states its sensor: {lost}; restore the column or, if the rig has no such"
        " sensor, take its key out of batch.yaml"
    )
