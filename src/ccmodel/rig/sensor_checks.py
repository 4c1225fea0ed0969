"""Checks for dead, stuck, reset, frozen and saturated sensors.

A faulty drive encoder refuses the recording, since the drive angle is the input of the model. Any other dead sensor
only removes its channel. Both contradict `batch.yaml`, which states a sensor that works.
"""

import numpy as np
import pandas as pd

from ccmodel.rig import limits
from ccmodel.rig.batch import Rig
from ccmodel.rig.findings import Defect, LogError
from ccmodel.rig.log import length, longest_run, runs

DRIVE, LOAD = "drive_encoder_counts", "load_encoder_counts"


def check_sensors(table: pd.DataFrame, rig: Rig, largest_travel: float) -> tuple[pd.DataFrame, list[Defect]]:
    """Find faulty sensors.

    Parameters
    ----------
    table : DataFrame
        Raw columns of a log; the index is the row in the file.
    rig : Rig
        The rig that wrote it.
    largest_travel : float
        Largest travel of the drive in a log of the batch (`drive_travel`).

    Returns
    -------
    table : DataFrame
        The columns that can be used.
    defects : list of Defect
        Faults of the other sensors, and faults that leave a column usable.

    Raises
    ------
    LogError
        If the drive encoder is faulty.
    """
    _check_drive(table, rig)
    defects, dead = [], []
    is_small = drive_travel(table) < limits.SMALL_TRAVEL_FRACTION * largest_travel
    for column in table.columns.drop(["time_s", DRIVE]):
        if fault := _dead(table, column, rig):
            contradicts = fault.contradicts and not (is_small and fault.row is None)
            defects.append(fault._replace(text=f"{fault.text}: column not used", contradicts=contradicts))
            dead.append(column)
        elif column == LOAD:
            defects += _load_stands(table)
        else:
            # A sensor at the end of its range repeats one value: it is clipped and not frozen.
            defects += _saturated(table, column, rig.ranges.get(column)) or _frozen(table, column)
    return table.drop(columns=dead), defects


def drive_travel(table: pd.DataFrame) -> float:
    """Travel of the drive over a log, in counts."""
    return float(np.ptp(table[DRIVE]))


def _check_drive(table: pd.DataFrame, rig: Rig) -> None:
    counts = table[DRIVE]
    if np.ptp(counts) <= limits.STILL_COUNTS:
        text = "stands still throughout: encoder stuck or drive switched off, the model has no input"
        raise LogError(None, DRIVE, text, True)
    if jump := _jump(table, DRIVE, rig.drive.encoder_counts_per_rev):
        raise LogError(*jump)
    # The load cannot move by itself: if it moves, the drive moves too.
    still = longest_run(np.diff(counts.to_numpy(), prepend=np.nan) == 0)
    if LOAD in table and length(still):
        creep = max(limits.OTHER_END_COUNTS, limits.OTHER_END_FRACTION * np.ptp(table[LOAD]))
        if np.ptp(table[LOAD].iloc[still]) > creep:
            first, last = table.index[still][[0, -1]]
            text = f"stands still up to row {last} while the load moves: encoder stuck"
            raise LogError(int(first), DRIVE, text, True)


def _is_noisy_at_rest(table: pd.DataFrame, column: str, odd: np.ndarray, most_repeats: float) -> bool:
    """Whether a sensor repeats fewer than a share of its values while the drive rests, `odd` samples left out.

    A converter that is coarser than its noise keeps its value wherever the cables keep their tension: at a rest, and
    while friction takes up a motion. Only of a sensor that is noisy at rest is a constant value a fault.
    """
    rests = [
        run
        for run in runs(np.diff(table[DRIVE].to_numpy(), prepend=np.nan) == 0)
        if length(run) > limits.FROZEN_SAMPLES
    ]
    at_rest = np.zeros(len(table), bool)
    for rest in rests:
        at_rest[rest] = True
    repeats = (np.diff(table[column].to_numpy(), prepend=np.nan) == 0)[at_rest & ~odd]
    return repeats.size > limits.FROZEN_SAMPLES and repeats.mean() < most_repeats


def _dead(table: pd.DataFrame, column: str, rig: Rig) -> Defect | None:
    values = table[column]
    if column == LOAD:
        if np.ptp(values) <= limits.STILL_COUNTS:
            text = "stands still throughout while the drive moves: encoder stuck or load locked"
            # A load that batch.yaml states as fixed has to stand still.
            return Defect(None, column, text, contradicts=rig.far_end != "fixed")
        counts_per_rev = rig.load.encoder_counts_per_rev
        return _jump(table, column, counts_per_rev) if counts_per_rev else None
    if np.ptp(values) == 0:
        text = f"is {values.iloc[0]:g} throughout: a sensor that is dead or was never connected"
        return Defect(None, column, text, contradicts=True)
    return None


def _jump(table: pd.DataFrame, column: str, counts_per_rev: float) -> Defect | None:
    """The first change of an encoder that is too fast for a pulley."""
    step = np.diff(table[column].to_numpy())
    speed = np.abs(step) * (2 * np.pi / counts_per_rev) / np.diff(table["time_s"].to_numpy())
    jumps = np.flatnonzero((speed > limits.FASTEST_RAD_PER_S) & (np.abs(step) > limits.LOST_COUNTS))
    if jumps.size == 0:
        return None
    more = f" (and {jumps.size - 1} more such jumps)" if jumps.size > 1 else ""
    text = f"jumps by {step[jumps[0]]:g} counts in one sample{more}: counter reset, wrapped or counts lost"
    return Defect(int(table.index[jumps[0] + 1]), column, text, contradicts=True)


def _load_stands(table: pd.DataFrame) -> list[Defect]:
    """A load encoder that stops for a while: a loose plug or real lost motion, so its column stays."""
    drive = table[DRIVE].to_numpy()
    for still in _standstills(table, LOAD):
        if np.ptp(drive[still]) >= limits.WHOLE_TRAVEL_FRACTION * np.ptp(drive):
            first, last = table.index[still][[0, -1]]
            text = f"stands still up to row {last} while the drive runs through its whole range"
            return [Defect(int(first), LOAD, f"{text}: loose plug or lost motion")]
    return []


def _frozen(table: pd.DataFrame, column: str) -> list[Defect]:
    """A noisy sensor that keeps one value for a while: a loose plug, or a converter that hung."""
    still = _standstills(table, column)
    drive = table[DRIVE].to_numpy()
    frozen = [part for part in still if np.ptp(drive[part]) > limits.STILL_COUNTS]
    repeats = np.diff(table[column].to_numpy(), prepend=np.nan) == 0
    for part in still:
        repeats[part] = False
    if not frozen or repeats.mean() >= limits.FROZEN_NOISE_FRACTION:
        return []
    first, last = table.index[frozen[0]][[0, -1]]
    more = f" (and {len(frozen) - 1} more times)" if len(frozen) > 1 else ""
    value = table[column].iloc[frozen[0].start]
    text = f"stays at {value:g} up to row {last} while the drive moves{more}: sensor frozen"
    is_still = np.zeros(len(table), bool)
    for part in still:
        is_still[part] = True
    contradicts = _is_noisy_at_rest(table, column, is_still, limits.FROZEN_NOISE_FRACTION)
    return [Defect(int(first), column, text, contradicts)]


def _standstills(table: pd.DataFrame, column: str) -> list[slice]:
    """Parts of a log in which a column keeps one value for long."""
    time = table["time_s"].to_numpy()
    # The sample before a run of repeats has the same value.
    parts = [slice(run.start - 1, run.stop) for run in runs(np.diff(table[column].to_numpy(), prepend=np.nan) == 0)]
    return [
        part
        for part in parts
        if length(part) > limits.FROZEN_SAMPLES + 1 and time[part.stop - 1] - time[part.start] > limits.FROZEN_S
    ]


def _saturated(table: pd.DataFrame, column: str, sensor_range: tuple[float, float] | None) -> list[Defect]:
    numbers = table[column].to_numpy()
    if sensor_range:
        ends = [numbers <= sensor_range[0], numbers >= sensor_range[1]]
        what = f"at the end of the sensor's range [{sensor_range[0]:g}, {sensor_range[1]:g}]"
    else:
        ends = [numbers == numbers.min(), numbers == numbers.max()]
        inside = ~(ends[0] | ends[1])
        repeats = np.mean((np.diff(numbers) == 0)[inside[1:]]) if inside[1:].any() else 1.0
        # A channel without noise dwells at its extremes by nature.
        if repeats >= limits.FLAT_NOISE_FRACTION:
            return []
        what = "flat at its extreme value"
    found = []
    contradicts = bool(sensor_range) or _is_noisy_at_rest(table, column, ends[0] | ends[1], limits.FLAT_NOISE_FRACTION)
    for end in ends:
        run = longest_run(end)
        if length(run) >= limits.FLAT_SAMPLES:
            text = f"{what} in {end.sum()} samples, {length(run)} in a row from here: saturated"
            found.append(Defect(int(table.index[run.start]), column, text, contradicts))
    return found
