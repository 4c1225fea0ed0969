"""Checks of a log that can be read: do its sensors tell of the motion at all?

A drive encoder that lies makes the recording worthless, for the drive angle is the model's input. Any other dead
sensor only takes its channel with it.
"""

import numpy as np
import pandas as pd

from ccmodel.rig.batch import Rig
from ccmodel.rig.findings import LIMITS, Finding, Limits
from ccmodel.rig.logs import longest_run, runs

DRIVE, LOAD = "drive_encoder_counts", "load_encoder_counts"


def check_sensors(
    table: pd.DataFrame, rig: Rig, batch: str, file: str, limits: Limits = LIMITS
) -> tuple[pd.DataFrame | None, list[Finding]]:
    """Find dead, stuck, reset and saturated sensors.

    Parameters
    ----------
    table : DataFrame
        Raw columns of a log, the index being the row in the file.
    rig : Rig
        The rig that wrote it.
    batch, file : str
        Where it comes from, for the findings.
    limits : Limits
        What is still used.

    Returns
    -------
    table : DataFrame or None
        The columns that can be used; None if the recording cannot.
    findings : list of Finding
        What was found wrong.
    """
    refused = _drive_refused(table, rig, limits)
    if refused:
        return None, [Finding(batch, file, refused[0], DRIVE, "refused", refused[1])]
    warnings, dead = [], []
    for column in table.columns.drop(["time_s", DRIVE]):
        reason = _dead(table, column, rig, limits)
        if reason:
            warnings.append((reason[0], column, f"{reason[1]}: column not used"))
            dead.append(column)
        elif column == LOAD:
            warnings += _load_stands(table, limits)
        else:
            # A value that a sensor sticks to at the end of what it reads is clipping, not freezing.
            warnings += _saturated(table[column], rig.ranges.get(column), limits) or _frozen(table, column, limits)
    return table.drop(columns=dead), [Finding(batch, file, row, col, "warning", text) for row, col, text in warnings]


def _drive_refused(table: pd.DataFrame, rig: Rig, limits: Limits) -> tuple[int | None, str] | None:
    counts = table[DRIVE]
    if np.ptp(counts) <= limits.still_counts:
        return None, "stands still throughout: encoder stuck or drive switched off, the model has no input"
    jump = _jump(table, DRIVE, rig.drive.encoder_counts_per_rev, limits)
    if jump:
        return jump
    # The load cannot move by itself: where it does, the drive moved too and its encoder missed it.
    start, length = longest_run(np.diff(counts.to_numpy(), prepend=np.nan) == 0)
    if LOAD in table:
        load = table[LOAD]
        if np.ptp(load.iloc[start : start + length]) > max(
            limits.other_end_counts, limits.other_end_fraction * np.ptp(load)
        ):
            last = int(table.index[start + length - 1])
            return int(table.index[start]), f"stands still up to row {last} while the load moves: encoder stuck"
    return None


def _dead(table: pd.DataFrame, column: str, rig: Rig, limits: Limits) -> tuple[int | None, str] | None:
    values = table[column]
    if column == LOAD:
        if np.ptp(values) <= limits.still_counts:
            return None, "stands still throughout while the drive moves: encoder stuck or load locked"
        counts_per_rev = rig.load.encoder_counts_per_rev
        return _jump(table, column, counts_per_rev, limits) if counts_per_rev else None
    if np.ptp(values) == 0:
        return None, f"is {values.iloc[0]:g} throughout: a sensor that is dead or was never connected"
    return None


def _jump(table: pd.DataFrame, column: str, counts_per_rev: float, limits: Limits) -> tuple[int, str] | None:
    step = np.diff(table[column].to_numpy())
    speed = np.abs(step) * (2 * np.pi / counts_per_rev) / np.diff(table["time_s"].to_numpy())
    jumps = np.flatnonzero((speed > limits.fastest_rad_per_s) & (np.abs(step) > limits.lost_counts))
    if jumps.size == 0:
        return None
    more = f" (and {jumps.size - 1} more such jumps)" if jumps.size > 1 else ""
    text = f"jumps by {step[jumps[0]]:g} counts in one sample{more}: counter reset, wrapped or counts lost"
    return int(table.index[jumps[0] + 1]), text


def _load_stands(table: pd.DataFrame, limits: Limits) -> list[tuple]:
    """A load encoder that stops in mid-recording: a loose plug or real lost motion, so it is told and kept."""
    drive = table[DRIVE].to_numpy()
    enough = limits.whole_travel_fraction * np.ptp(drive)
    for part in _standstills(table, LOAD, limits):
        if np.ptp(drive[part]) >= enough:
            first, last = _first_and_last_row(table, part)
            text = f"stands still up to row {last} while the drive runs through its whole range"
            return [(first, LOAD, f"{text}: loose plug or lost motion")]
    return []


def _frozen(table: pd.DataFrame, column: str, limits: Limits) -> list[tuple]:
    """A noisy sensor that keeps one value in mid-recording: a loose plug, or a converter that hung."""
    still = _standstills(table, column, limits)
    drive = table[DRIVE].to_numpy()
    frozen = [part for part in still if np.ptp(drive[part]) > limits.still_counts]
    repeats = np.diff(table[column].to_numpy(), prepend=np.nan) == 0
    for part in still:
        repeats[part] = False
    if not frozen or repeats.mean() >= limits.frozen_noise_fraction:
        return []
    first, last = _first_and_last_row(table, frozen[0])
    more = f" (and {len(frozen) - 1} more times)" if len(frozen) > 1 else ""
    value = table[column].iloc[frozen[0].start]
    return [(first, column, f"stays at {value:g} up to row {last} while the drive moves{more}: sensor frozen")]


def _standstills(table: pd.DataFrame, column: str, limits: Limits) -> list[slice]:
    """Parts of a log in which a column keeps one value for long."""
    time = table["time_s"].to_numpy()
    starts, lengths = runs(np.diff(table[column].to_numpy(), prepend=np.nan) == 0)
    # A run of repeats begins behind the sample that they repeat.
    first, last = starts - 1, starts + lengths - 1
    long = (lengths > limits.frozen_samples) & (time[last] - time[first] > limits.frozen_s)
    return [slice(start, stop + 1) for start, stop in zip(first[long], last[long], strict=True)]


def _first_and_last_row(table: pd.DataFrame, part: slice) -> tuple[int, int]:
    return int(table.index[part.start]), int(table.index[part.stop - 1])


def _saturated(values: pd.Series, sensor_range: tuple[float, float] | None, limits: Limits) -> list[tuple]:
    numbers = values.to_numpy()
    if sensor_range:
        ends = [numbers <= sensor_range[0], numbers >= sensor_range[1]]
        what = f"at the end of the sensor's range [{sensor_range[0]:g}, {sensor_range[1]:g}]"
    else:
        ends = [numbers == numbers.min(), numbers == numbers.max()]
        inside = ~(ends[0] | ends[1])
        repeats = np.mean((np.diff(numbers) == 0)[inside[1:]]) if inside[1:].any() else 1.0
        # A channel without noise dwells at its extremes by nature.
        if repeats >= limits.flat_noise_fraction:
            return []
        what = "flat at its extreme value"
    found = []
    for end in ends:
        start, length = longest_run(end)
        if length >= limits.flat_samples:
            text = f"{what} in {end.sum()} samples, {length} in a row from here: saturated"
            found.append((int(values.index[start]), values.name, text))
    return found
