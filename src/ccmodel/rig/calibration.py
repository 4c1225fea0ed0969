"""Calibration: columns of a log to SI channels, and the tensions at the cable ends.

Signs are those of `docs/rig-log-format.md`: tau = (T1 - T3) R and F = T1 + T3 at the drive, likewise T2, T4 at the
load.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.channels import TENSIONS, THETA_MOTOR
from ccmodel.rig import limits
from ccmodel.rig.angle import Angle, angle_of, angle_of_motor
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
        Step of each angle, rad: one count, or the stated resolution. Absent for an angle without a step.
    unused : dict of str to str
        Log columns without a channel: the reason.
    """

    rest_s: float
    channels: dict[str, NDArray] = field(default_factory=dict)
    derived_from: dict[str, str] = field(default_factory=dict)
    accuracy: dict[str, float] = field(default_factory=dict)
    encoder_step_rad: dict[str, float] = field(default_factory=dict)
    unused: dict[str, str] = field(default_factory=dict)

    def add(self, channel: str, values: NDArray, formula: str, accuracy: float | None) -> None:
        """Add a channel; `batch.yaml` states the accuracy of every sensor of the rig."""
        if accuracy is None:
            raise ValueError(f"{channel} has no stated accuracy")
        self.channels[channel], self.derived_from[channel], self.accuracy[channel] = values, formula, accuracy


def calibrate(table: pd.DataFrame, rig: Rig) -> Calibrated:
    """Convert the columns of one log to SI channels.

    Parameters
    ----------
    table : DataFrame, shape (n, columns)
        Columns of the log, with at least `time_s` and the drive angle.
    rig : Rig
        Constants of the rig.

    Returns
    -------
    Calibrated
        Channels with formula and accuracy.
    """
    time = table["time_s"].to_numpy()
    angles = [angle_of(table, end) for end in rig.ends]
    resting = resting_samples(time, [angle for angle in angles if angle])
    result = Calibrated(float(time[resting - 1]) if resting else 0.0)
    for end, angle in zip(rig.ends, angles, strict=True):
        if angle:
            _add_angle(result, table, end, angle, resting, rig.accuracy)
        _add_sensors(result, table, end, rig.accuracy)
        (_single_tension if rig.far_end else _tensions)(result, end, rig.accuracy.load_cell_N)
    _add_motor(result, table, rig, resting)
    _note_unused(result, table, rig)
    return result


def resting_samples(time_s: NDArray, angles: Sequence[Angle]) -> int:
    """Number of samples at the start during which drive and load only dither; 0 if the rig begins in motion."""
    resting = min(angle.still_samples() for angle in angles)
    return resting if time_s[resting - 1] - time_s[0] >= limits.SHORTEST_REST_S else 0


def _add_angle(
    result: Calibrated, table: pd.DataFrame, end: End, angle: Angle, resting: int, accuracy: Accuracy
) -> None:
    """Add the angle of one end, zero at rest or at the first sample."""
    if angle.rad_per_unit is None:
        result.unused[angle.column] = _lacks(angle.key)
        return
    values, sign, formula = table[angle.column].to_numpy(), end.side.encoder_sign, "({0} - {1:g} rad, {2})"
    zero, where = (values[:resting].mean(), "the mean at rest") if resting else (values[0], "the first sample")
    turned = values - zero
    if angle.column != end.angle:
        turned, formula = turned * angle.rad_per_unit, "({0} - {1:g}, {2}) * 2 pi / {3:g}"
    formula = formula.format(angle.column, zero, where, end.side.encoder_counts_per_rev or 0)
    result.add(
        end.angle,
        sign * turned,
        f"{'-' if sign < 0 else ''}{formula}",
        end.side.encoder_accuracy_rad or accuracy.encoder_rad,
    )
    if angle.step_rad:
        result.encoder_step_rad[end.angle] = angle.step_rad


def _add_motor(result: Calibrated, table: pd.DataFrame, rig: Rig, resting: int) -> None:
    """Add the motor's angle at the drive pulley, zero at rest or at the first sample."""
    angle, sign = angle_of_motor(table, rig), rig.drive.motor_sign
    if angle is None:
        return
    if angle.rad_per_unit is None:
        result.unused[angle.column] = _lacks(angle.key)
        return
    values = angle.values
    if angle.counted:
        formula = f"{angle.column} * 2 pi / {rig.drive.motor_counts_per_rev:g}"
    else:
        formula = f"{angle.column} of the log"
    zero = values[: max(resting, 1)].mean()
    formula = f"{'-' if sign < 0 else ''}({formula}), from its value at the start"
    result.add(THETA_MOTOR, sign * angle.rad_per_unit * (values - zero), formula, rig.accuracy.encoder_rad)


def _add_sensors(result: Calibrated, table: pd.DataFrame, end: End, accuracy: Accuracy) -> None:
    """Add torque, force and tensions that are logged at one end; a torque sensor is used rather than a current."""
    side = end.side
    # Physical column and channel, sign, accuracy.
    physical = (
        (end.torque, side.torque_sign, accuracy.torque_Nm),
        *((channel, 1, accuracy.load_cell_N) for channel in (end.force, *end.tensions)),
    )
    sign: int
    for channel, sign, accuracy_of_channel in physical:
        if channel in table:
            formula = f"{'-' if sign < 0 else ''}{channel} of the log"
            result.add(channel, sign * table[channel].to_numpy(), formula, accuracy_of_channel)
    # Raw column, key of its constants, calibration; sign, name and accuracy of the channel.
    raw = (
        ("torque_counts", "torque_sensor", _sensor_torque, side.torque_sign, end.torque, accuracy.torque_Nm),
        ("current_A", "torque_constant_Nm_per_A", _motor_torque, side.torque_sign, end.torque, accuracy.torque_Nm),
        ("load_cell_V", "load_cell", _force, 1, end.force, accuracy.load_cell_N),
    )
    for suffix, key, calibration, sign, channel, accuracy_of_channel in raw:
        column, constants = f"{end.name}_{suffix}", getattr(side, key)
        if column not in table or channel in result.channels:
            continue
        if constants is None:
            result.unused[column] = _lacks(f"rig.{end.name}.{key}")
            continue
        values, formula = calibration(table[column].to_numpy(), column, constants)
        result.add(channel, sign * values, f"{'-' if sign < 0 else ''}{formula}", accuracy_of_channel)


def _lacks(key: str) -> str:
    return f"batch.yaml lacks {key}, which converts it"


def _sensor_torque(counts: NDArray, column: str, sensor: TorqueSensor) -> tuple[NDArray, str]:
    formula = f"({column} - {sensor.zero_counts:g}) * {sensor.Nm_per_count:g} Nm/count"
    return (counts - sensor.zero_counts) * sensor.Nm_per_count, formula


def _motor_torque(current: NDArray, column: str, constant: float) -> tuple[NDArray, str]:
    return current * constant, f"{column} * {constant:g} Nm/A"


def _force(volts: NDArray, column: str, cell: LoadCell) -> tuple[NDArray, str]:
    formula = f"({column} - {cell.zero_V:g} V) / {cell.sensitivity_V_per_N:g} V/N"
    return (volts - cell.zero_V) / cell.sensitivity_V_per_N, formula


def _tensions(result: Calibrated, end: End, load_cell_N: float | None) -> None:
    """Add tensions from sum and torque, or sum and torque from tensions, whichever are not logged themselves."""
    force, torque, radius = end.force, end.torque, end.side.pulley_radius_m
    cable_a, cable_b = end.tensions
    channels = result.channels
    _other_tension(result, end, load_cell_N)
    if cable_a in channels and cable_b in channels:
        # The errors of the two sensors are independent.
        accuracy = float(np.sqrt(2) * load_cell_N)
        if force not in channels:
            result.add(force, channels[cable_a] + channels[cable_b], f"{cable_a} + {cable_b}", accuracy)
        if torque not in channels:
            formula = f"({cable_a} - {cable_b}) * {radius:g} m"
            result.add(torque, (channels[cable_a] - channels[cable_b]) * radius, formula, accuracy * radius)
    if force not in channels or torque not in channels:
        return
    difference = channels[torque] / radius
    accuracy = float(np.hypot(result.accuracy[force], result.accuracy[torque] / radius) / 2)
    for name, sign in ((cable_a, 1), (cable_b, -1)):
        if name not in channels:
            formula = f"({force} {'+' if sign > 0 else '-'} {torque} / {radius:g} m) / 2"
            result.add(name, (channels[force] + sign * difference) / 2, formula, accuracy)


def _other_tension(result: Calibrated, end: End, load_cell_N: float | None) -> None:
    """Add the second tension of an end that logs one of them and either the sum or the torque, and the other of these.

    The errors of these channels are not independent: each has its own accuracy from those of the two sensors.
    """
    force, torque, radius = end.force, end.torque, end.side.pulley_radius_m
    logged = [name for name in end.tensions if name in result.channels]
    if len(logged) != 1 or load_cell_N is None or {force, torque} <= result.channels.keys():
        return
    (one,), (other,) = logged, [name for name in end.tensions if name not in logged]
    logged_N, sign = result.channels[one], 1 if one == end.tensions[0] else -1
    if force in result.channels:
        total, accuracy = result.channels[force], result.accuracy[force]
        result.add(other, total - logged_N, f"{force} - {one}", float(np.hypot(accuracy, load_cell_N)))
        formula = f"{'-' if sign < 0 else ''}(2 {one} - {force}) * {radius:g} m"
        of_both = radius * float(np.hypot(accuracy, 2 * load_cell_N))
        result.add(torque, sign * (2 * logged_N - total) * radius, formula, of_both)
    elif torque in result.channels:
        difference, accuracy = sign * result.channels[torque] / radius, result.accuracy[torque] / radius
        formula = f"{'-' if sign > 0 else '+'} {torque} / {radius:g} m"
        result.add(other, logged_N - difference, f"{one} {formula}", float(np.hypot(accuracy, load_cell_N)))
        result.add(force, 2 * logged_N - difference, f"2 {one} {formula}", float(np.hypot(accuracy, 2 * load_cell_N)))


def _single_tension(result: Calibrated, end: End, load_cell_N: float | None) -> None:
    """Tension of a single cable at one end, from the load cell or else from the torque sensor."""
    (name,) = end.tensions
    force, torque, radius = end.force, end.torque, end.side.pulley_radius_m
    if name in result.channels:
        if force not in result.channels:
            result.add(force, result.channels[name], name, load_cell_N)
    elif force in result.channels:
        result.add(name, result.channels[force], force, result.accuracy[force])
    elif torque in result.channels:
        formula = f"{torque} / {radius:g} m"
        result.add(name, result.channels[torque] / radius, formula, result.accuracy[torque] / radius)


def _note_unused(result: Calibrated, table: pd.DataFrame, rig: Rig) -> None:
    """Tensions of a cable that the rig does not have."""
    known = {name for end in rig.ends for name in end.tensions}
    for name in TENSIONS:
        if name in table and name not in known:
            result.unused[name] = "a single cable has no cable B"
