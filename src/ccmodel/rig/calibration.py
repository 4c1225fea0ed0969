"""Calibration: raw columns -> SI channels and the tensions at the cables' ends.

Signs are those of `docs/rig-log-format.md`: tau = (T1 - T3) R and F = T1 + T3 at the drive, likewise T2, T4 at the
load.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.channels import ANGLE_AT, SUM_AT, TENSIONS_AT, TORQUE_AT
from ccmodel.rig.batch import Accuracy, Rig, Side
from ccmodel.rig.findings import LIMITS, Limits


@dataclass(frozen=True)
class Calibrated:
    """Channels of a recording.

    Attributes
    ----------
    channels : dict of str to ndarray, each of shape (n,)
        SI values by channel name; what cannot be derived is absent.
    derived_from : dict of str to str
        What each was computed from.
    accuracy : dict of str to float
        Accuracy of each, in its unit.
    encoder_step_rad : dict of str to float
        Angle of one count of each angle, rad.
    rest_s : float
        Time up to which the drive has not moved yet, s; 0 where the recording begins in motion.
    missing : dict of str to str
        Log columns that could not be turned into a channel: the key of `batch.yaml` that is missing for it.
    """

    channels: dict[str, NDArray]
    derived_from: dict[str, str]
    accuracy: dict[str, float]
    encoder_step_rad: dict[str, float]
    rest_s: float
    missing: dict[str, str]


def calibrate(table: pd.DataFrame, rig: Rig, limits: Limits = LIMITS) -> Calibrated:
    """Turn the raw columns of one log into SI channels.

    Parameters
    ----------
    table : DataFrame
        Raw columns, shape (n, columns), with `time_s` and `drive_encoder_counts` at least.
    rig : Rig
        Constants of the rig.
    limits : Limits
        What counts as a rest.

    Returns
    -------
    Calibrated
        Channels, what they come from and how good they are.
    """
    time = table["time_s"].to_numpy()
    resting = _resting_samples(table, limits)
    result = Calibrated({}, {}, {}, {}, float(time[resting - 1]) if resting else 0.0, {})
    for end, side in (("drive", rig.drive), ("load", rig.load)):
        _angle(result, table, end, side, resting, rig.accuracy)
        _torque(result, table, end, side, rig.accuracy)
        _sum(result, table, end, side, rig.accuracy)
        _tensions(result, end, side)
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
    # The first count of the motion itself looks like dither: the rest ends where the resting count was last seen.
    values, how_often = np.unique(counts[:still], return_counts=True)
    return int(np.flatnonzero(counts[:still] == values[np.argmax(how_often)])[-1]) + 1


def _angle(result: Calibrated, table, end: str, side: Side, resting: int, accuracy: Accuracy) -> None:
    column, channel = f"{end}_encoder_counts", ANGLE_AT[end]
    if column not in table:
        return
    if side.encoder_counts_per_rev is None:
        result.missing[column] = f"rig.{end}.encoder_counts_per_rev"
        return
    counts = table[column].to_numpy()
    zero = counts[:resting].mean() if resting else counts[0]
    where = "the mean at rest" if resting else "the first sample"
    step = 2 * np.pi / side.encoder_counts_per_rev
    result.channels[channel] = side.encoder_sign * (counts - zero) * step
    result.derived_from[channel] = (
        f"{_minus(side.encoder_sign)}({column} - {zero:g}, {where}) * 2 pi / {side.encoder_counts_per_rev:g}"
    )
    result.accuracy[channel] = side.encoder_accuracy_rad or accuracy.encoder_rad
    result.encoder_step_rad[channel] = step


def _torque(result: Calibrated, table, end: str, side: Side, accuracy: Accuracy) -> None:
    counts, current, channel = f"{end}_torque_counts", f"{end}_current_A", TORQUE_AT[end]
    sensor, constant = side.torque_sensor, side.torque_constant_Nm_per_A
    if counts in table and sensor is None:
        result.missing[counts] = f"rig.{end}.torque_sensor"
    if counts in table and sensor is not None:
        torque = (table[counts].to_numpy() - sensor.zero_counts) * sensor.Nm_per_count
        source = f"({counts} - {sensor.zero_counts:g}) * {sensor.Nm_per_count:g} Nm/count"
    elif current in table and constant is None:
        result.missing[current] = f"rig.{end}.torque_constant_Nm_per_A"
        return
    elif current in table:
        torque = table[current].to_numpy() * constant
        source = f"{current} * {constant:g} Nm/A"
    else:
        return
    result.channels[channel] = side.torque_sign * torque
    result.derived_from[channel] = _minus(side.torque_sign) + source
    result.accuracy[channel] = accuracy.torque_Nm


def _sum(result: Calibrated, table, end: str, side: Side, accuracy: Accuracy) -> None:
    column, channel, cell = f"{end}_load_cell_V", SUM_AT[end], side.load_cell
    if column not in table:
        return
    if cell is None:
        result.missing[column] = f"rig.{end}.load_cell"
        return
    result.channels[channel] = (table[column].to_numpy() - cell.zero_V) / cell.sensitivity_V_per_N
    result.derived_from[channel] = f"({column} - {cell.zero_V:g} V) / {cell.sensitivity_V_per_N:g} V/N"
    result.accuracy[channel] = accuracy.load_cell_N


def _tensions(result: Calibrated, end: str, side: Side) -> None:
    total, torque, radius = SUM_AT[end], TORQUE_AT[end], side.pulley_radius_m
    if total not in result.channels or torque not in result.channels:
        return
    difference = result.channels[torque] / radius
    # Errors of the two sensors are independent of each other.
    accuracy = float(np.hypot(result.accuracy[total], result.accuracy[torque] / radius) / 2)
    for name, sign in zip(TENSIONS_AT[end], (1, -1), strict=True):
        result.channels[name] = (result.channels[total] + sign * difference) / 2
        result.derived_from[name] = f"({total} {'+' if sign > 0 else '-'} {torque} / {radius:g} m) / 2"
        result.accuracy[name] = accuracy


def _minus(sign: int) -> str:
    return "-" if sign < 0 else ""
