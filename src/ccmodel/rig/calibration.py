"""Calibration: raw columns to SI channels and the tensions at the cable ends.

Signs are those of `docs/rig-log-format.md`: tau = (T1 - T3) R and F = T1 + T3 at the drive, likewise T2, T4 at the
load.
"""

from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.rig import limits
from ccmodel.rig.batch import Accuracy, End, LoadCell, Rig, TorqueSensor


@dataclass
class Calibrated:
    """Channels of a recording.

    Attributes
    ----------
    rest_s : float
        End of the initial rest, s; 0 if the recording begins in motion.
    channels : dict of str to ndarray, each of shape (n,)
        SI values by channel name; a channel that cannot be derived is absent.
    derived_from : dict of str to str
        Formula of each channel.
    accuracy : dict of str to float
        Accuracy of each channel, in its unit.
    encoder_step_rad : dict of str to float
        Angle of one count of each angle, rad.
    missing : dict of str to str
        Log columns without a channel: the key that `batch.yaml` lacks for it.
    """

    rest_s: float
    channels: dict[str, NDArray] = field(default_factory=dict)
    derived_from: dict[str, str] = field(default_factory=dict)
    accuracy: dict[str, float] = field(default_factory=dict)
    encoder_step_rad: dict[str, float] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)

    def add(self, channel: str, values: NDArray, formula: str, accuracy: float) -> None:
        """Add a channel."""
        self.channels[channel], self.derived_from[channel], self.accuracy[channel] = values, formula, accuracy


def calibrate(table: pd.DataFrame, rig: Rig) -> Calibrated:
    """Convert the raw columns of one log to SI channels.

    Parameters
    ----------
    table : DataFrame, shape (n, columns)
        Raw columns, with at least `time_s` and `drive_encoder_counts`.
    rig : Rig
        Constants of the rig.

    Returns
    -------
    Calibrated
        Channels with formula and accuracy.
    """
    time = table["time_s"].to_numpy()
    resting = _resting_samples(table)
    result = Calibrated(float(time[resting - 1]) if resting else 0.0)
    for end in rig.ends:
        _add_sensors(result, table, end, resting, rig.accuracy)
        (_single_tension if rig.far_end else _tensions)(result, end)
    return result


def _resting_samples(table: pd.DataFrame) -> int:
    """Number of samples at the start during which drive and load only dither; 0 if the rig begins in motion."""
    time = table["time_s"].to_numpy()
    columns = [c for c in ("drive_encoder_counts", "load_encoder_counts") if c in table]
    resting = min(_still_samples(table[c].to_numpy()) for c in columns)
    return resting if time[resting - 1] - time[0] >= limits.SHORTEST_REST_S else 0


def _still_samples(counts: NDArray) -> int:
    spread = np.maximum.accumulate(counts) - np.minimum.accumulate(counts)
    still = int(np.argmax(spread > limits.STILL_COUNTS)) if spread[-1] > limits.STILL_COUNTS else counts.size
    # The first count of the motion looks like dither, so the rest ends at the last sample of its most frequent count.
    values, frequency = np.unique(counts[:still], return_counts=True)
    return int(np.flatnonzero(counts[:still] == values[np.argmax(frequency)])[-1]) + 1


def _add_sensors(result: Calibrated, table: pd.DataFrame, end: End, resting: int, accuracy: Accuracy) -> None:
    """Add the channels of the sensors at one end; a torque sensor is used rather than a current."""
    side = end.side
    angle, angle_accuracy = partial(_angle, resting), side.encoder_accuracy_rad or accuracy.encoder_rad
    # Column of the log, key of its constants, calibration; sign, name and accuracy of the channel.
    sensors = (
        ("encoder_counts", "encoder_counts_per_rev", angle, side.encoder_sign, end.angle, angle_accuracy),
        ("torque_counts", "torque_sensor", _sensor_torque, side.torque_sign, end.torque, accuracy.torque_Nm),
        ("current_A", "torque_constant_Nm_per_A", _motor_torque, side.torque_sign, end.torque, accuracy.torque_Nm),
        ("load_cell_V", "load_cell", _force, 1, end.force, accuracy.load_cell_N),
    )
    for suffix, key, calibration, sign, channel, accuracy_of_channel in sensors:
        column, constants = f"{end.name}_{suffix}", getattr(side, key)
        if column not in table or channel in result.channels:
            continue
        if constants is None:
            result.missing[column] = f"rig.{end.name}.{key}"
            continue
        values, formula = calibration(table[column].to_numpy(), column, constants)
        result.add(channel, sign * values, f"{'-' if sign < 0 else ''}{formula}", accuracy_of_channel)
    if end.angle in result.channels:
        result.encoder_step_rad[end.angle] = 2 * np.pi / side.encoder_counts_per_rev


def _angle(resting: int, counts: NDArray, column: str, counts_per_rev: float) -> tuple[NDArray, str]:
    zero, where = (counts[:resting].mean(), "the mean at rest") if resting else (counts[0], "the first sample")
    formula = f"({column} - {zero:g}, {where}) * 2 pi / {counts_per_rev:g}"
    return (counts - zero) * (2 * np.pi / counts_per_rev), formula


def _sensor_torque(counts: NDArray, column: str, sensor: TorqueSensor) -> tuple[NDArray, str]:
    formula = f"({column} - {sensor.zero_counts:g}) * {sensor.Nm_per_count:g} Nm/count"
    return (counts - sensor.zero_counts) * sensor.Nm_per_count, formula


def _motor_torque(current: NDArray, column: str, constant: float) -> tuple[NDArray, str]:
    return current * constant, f"{column} * {constant:g} Nm/A"


def _force(volts: NDArray, column: str, cell: LoadCell) -> tuple[NDArray, str]:
    formula = f"({column} - {cell.zero_V:g} V) / {cell.sensitivity_V_per_N:g} V/N"
    return (volts - cell.zero_V) / cell.sensitivity_V_per_N, formula


def _tensions(result: Calibrated, end: End) -> None:
    force, torque, radius = end.force, end.torque, end.side.pulley_radius_m
    if force not in result.channels or torque not in result.channels:
        return
    difference = result.channels[torque] / radius
    # The errors of the two sensors are independent.
    accuracy = float(np.hypot(result.accuracy[force], result.accuracy[torque] / radius) / 2)
    for name, sign in zip(end.tensions, (1, -1), strict=True):
        formula = f"({force} {'+' if sign > 0 else '-'} {torque} / {radius:g} m) / 2"
        result.add(name, (result.channels[force] + sign * difference) / 2, formula, accuracy)


def _single_tension(result: Calibrated, end: End) -> None:
    """Tension of a single cable at one end, from the load cell or else from the torque sensor."""
    (name,) = end.tensions
    force, torque, radius = end.force, end.torque, end.side.pulley_radius_m
    if force in result.channels:
        result.add(name, result.channels[force], force, result.accuracy[force])
    elif torque in result.channels:
        formula = f"{torque} / {radius:g} m"
        result.add(name, result.channels[torque] / radius, formula, result.accuracy[torque] / radius)
