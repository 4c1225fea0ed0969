"""Calibration: raw columns to SI channels and the tensions at the cable ends.

Signs are those of `docs/rig-log-format.md`: tau = (T1 - T3) R and F = T1 + T3 at the drive, likewise T2, T4 at the
load.
"""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.rig.batch import Accuracy, End, Rig
from ccmodel.rig.limits import LIMITS, Limits


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


def calibrate(table: pd.DataFrame, rig: Rig, limits: Limits = LIMITS) -> Calibrated:
    """Convert the raw columns of one log to SI channels.

    Parameters
    ----------
    table : DataFrame, shape (n, columns)
        Raw columns, with at least `time_s` and `drive_encoder_counts`.
    rig : Rig
        Constants of the rig.
    limits : Limits
        Limits of a rest.

    Returns
    -------
    Calibrated
        Channels with formula and accuracy.
    """
    time = table["time_s"].to_numpy()
    resting = _resting_samples(table, limits)
    result = Calibrated(float(time[resting - 1]) if resting else 0.0)
    for end in rig.ends:
        _angle(result, table, end, resting, rig.accuracy)
        _torque(result, table, end, rig.accuracy)
        _force(result, table, end, rig.accuracy)
        _tensions(result, end)
    return result


def _resting_samples(table: pd.DataFrame, limits: Limits) -> int:
    """Number of samples at the start during which drive and load only dither; 0 if the rig begins in motion."""
    time = table["time_s"].to_numpy()
    columns = [c for c in ("drive_encoder_counts", "load_encoder_counts") if c in table]
    resting = min(_still_samples(table[c].to_numpy(), limits) for c in columns)
    return resting if time[resting - 1] - time[0] >= limits.shortest_rest_s else 0


def _still_samples(counts: NDArray, limits: Limits) -> int:
    spread = np.maximum.accumulate(counts) - np.minimum.accumulate(counts)
    still = int(np.argmax(spread > limits.still_counts)) if spread[-1] > limits.still_counts else counts.size
    # The first count of the motion looks like dither, so the rest ends at the last sample of its most frequent count.
    values, frequency = np.unique(counts[:still], return_counts=True)
    return int(np.flatnonzero(counts[:still] == values[np.argmax(frequency)])[-1]) + 1


def _angle(result: Calibrated, table: pd.DataFrame, end: End, resting: int, accuracy: Accuracy) -> None:
    column, side = f"{end.name}_encoder_counts", end.side
    if column not in table:
        return
    if side.encoder_counts_per_rev is None:
        result.missing[column] = f"rig.{end.name}.encoder_counts_per_rev"
        return
    counts = table[column].to_numpy()
    zero = counts[:resting].mean() if resting else counts[0]
    where = "the mean at rest" if resting else "the first sample"
    step = 2 * np.pi / side.encoder_counts_per_rev
    formula = f"{_minus(side.encoder_sign)}({column} - {zero:g}, {where}) * 2 pi / {side.encoder_counts_per_rev:g}"
    values = side.encoder_sign * (counts - zero) * step
    result.add(end.angle, values, formula, side.encoder_accuracy_rad or accuracy.encoder_rad)
    result.encoder_step_rad[end.angle] = step


def _torque(result: Calibrated, table: pd.DataFrame, end: End, accuracy: Accuracy) -> None:
    counts, current = f"{end.name}_torque_counts", f"{end.name}_current_A"
    sensor, constant = end.side.torque_sensor, end.side.torque_constant_Nm_per_A
    if counts in table and sensor is None:
        result.missing[counts] = f"rig.{end.name}.torque_sensor"
    if counts in table and sensor is not None:
        torque = (table[counts].to_numpy() - sensor.zero_counts) * sensor.Nm_per_count
        formula = f"({counts} - {sensor.zero_counts:g}) * {sensor.Nm_per_count:g} Nm/count"
    elif current in table and constant is None:
        result.missing[current] = f"rig.{end.name}.torque_constant_Nm_per_A"
        return
    elif current in table:
        torque = table[current].to_numpy() * constant
        formula = f"{current} * {constant:g} Nm/A"
    else:
        return
    sign = end.side.torque_sign
    result.add(end.torque, sign * torque, _minus(sign) + formula, accuracy.torque_Nm)


def _force(result: Calibrated, table: pd.DataFrame, end: End, accuracy: Accuracy) -> None:
    column, cell = f"{end.name}_load_cell_V", end.side.load_cell
    if column not in table:
        return
    if cell is None:
        result.missing[column] = f"rig.{end.name}.load_cell"
        return
    values = (table[column].to_numpy() - cell.zero_V) / cell.sensitivity_V_per_N
    formula = f"({column} - {cell.zero_V:g} V) / {cell.sensitivity_V_per_N:g} V/N"
    result.add(end.force, values, formula, accuracy.load_cell_N)


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


def _minus(sign: int) -> str:
    return "-" if sign < 0 else ""
