"""Checks for dead, stuck, reset, frozen and saturated sensors.

A faulty drive encoder refuses the recording, since the drive angle is the input of the model. Any other dead sensor
only removes its channel. Both contradict `batch.yaml`, which states a sensor that works.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ccmodel.channels import TAU_OUT
from ccmodel.rig import limits
from ccmodel.rig.angle import Angle, angle_of, angle_of_motor, resolution_seen, smallest_step
from ccmodel.rig.batch import Rig
from ccmodel.rig.findings import Defect, LogError
from ccmodel.rig.log import length, longest_run, runs
from ccmodel.rig.outliers import without


def check_sensors(table: pd.DataFrame, rig: Rig, largest_travel: float) -> tuple[pd.DataFrame, list[Defect]]:
    """Find faulty sensors.

    Parameters
    ----------
    table : DataFrame
        Columns of a log; the index is the row in the file.
    rig : Rig
        The rig that wrote it.
    largest_travel : float
        Largest travel of the drive in a log of the batch (`drive_travel`).

    Returns
    -------
    table : DataFrame
        The columns and rows that can be used.
    warnings : list of Defect
        Faults of the other sensors, and faults that leave a column usable.

    Raises
    ------
    LogError
        If the drive encoder is faulty.
    """
    table, beyond = _drop_beyond(table, rig.ranges)
    drive, load = _drive_angle(table, rig), angle_of(table, rig.ends[1])
    for angle in (drive, load):
        if angle:
            _check_steps(table, angle)
    _check_drive(table, drive, load)
    defects, dead, analog = [*beyond, *_missing_steps(table, drive)], [], []
    motor = angle_of_motor(table, rig)
    is_small = drive_travel(table, rig) < limits.SMALL_TRAVEL_FRACTION * largest_travel
    for column in table.columns.drop(["time_s", drive.column]):
        load_here = load if load is not None and column == load.column else None
        if motor is not None and column == motor.column:
            fault = _dead(table, column) or _jump(table, motor)
        else:
            fault = _dead(table, column) if load_here is None else _dead_load(table, load_here, rig)
        if fault:
            contradicts = fault.contradicts and not (is_small and load_here is not None and fault.row is None)
            defects.append(fault._replace(text=f"{fault.text}: column not used", contradicts=contradicts))
            dead.append(column)
        elif load_here is not None:
            defects += _missing_steps(table, load_here) + _load_stands(table, drive, load_here)
        elif motor is None or column != motor.column:
            # A sensor at the end of its range repeats one value: it is clipped and not frozen.
            defects += _saturated(table, column, drive, rig.ranges.get(column)) or _frozen(table, column, drive)
            analog.append(column)
    encoders = [angle.column for angle in (load, motor) if angle is not None and angle.column not in dead]
    return table.drop(columns=dead), defects + _held(table[["time_s", *analog, *encoders]], drive.values)


def _drop_beyond(table: pd.DataFrame, ranges: Mapping[str, tuple[float, float]]) -> tuple[pd.DataFrame, list[Defect]]:
    """Drop the rows of single readings outside the stated range of their sensor, which no sensor gives.

    Where they are many, the range is wrong, and they are not dropped. Several in a row are a sensor at the end of its
    range.
    """
    bad, defects = np.zeros(len(table), bool), []
    for column in (name for name in ranges if name in table):
        values, (low, high) = table[column].to_numpy(), ranges[column]
        slack = limits.BEYOND_RANGE * (high - low)
        beyond = (values < low - slack) | (values > high + slack)
        for run in runs(beyond, limits.FLAT_SAMPLES):
            beyond[run] = False
        if not (count := int(beyond.sum())):
            continue
        first = int(np.argmax(beyond))
        is_wrong = beyond.mean() > limits.BAD_CELLS_FRACTION
        text = f"reads {values[first]:g}, outside its range [{low:g}, {high:g}] in rig.ranges"
        more = f" (and {count - 1} more such readings)" if count > 1 else ""
        end = ": is the range right, and in the column's unit? They are used" if is_wrong else ": not used"
        defects.append(Defect(int(table.index[first]), column, f"{text}{more}{end}", contradicts=is_wrong))
        if not is_wrong:
            bad |= beyond
    return without(table, bad), defects


def drive_travel(table: pd.DataFrame, rig: Rig) -> float:
    """Peak to peak of the drive angle over a log, rad."""
    drive = _drive_angle(table, rig)
    return float(np.ptp(drive.values) * (drive.rad_per_unit or np.nan))


def _drive_angle(table: pd.DataFrame, rig: Rig) -> Angle:
    """The drive's angle, without which no log is read."""
    if (drive := angle_of(table, rig.ends[0])) is None:
        raise LogError(1, None, "the drive angle is missing")
    return drive


def _check_steps(table: pd.DataFrame, angle: Angle) -> None:
    """Refuse an angle in rad that does not move in the steps that `batch.yaml` states."""
    step_rad = angle.step_rad
    if not angle.key.endswith("angle_resolution_rad") or step_rad is None:
        return
    values = table[angle.column].to_numpy()
    off = np.abs((values - values[0]) / step_rad - angle.values) > limits.OFF_STEP
    if off.mean() > limits.OFF_STEP_FRACTION:
        seen = smallest_step(values)
        if seen and np.isclose(seen, np.degrees(step_rad), rtol=0.02):
            text = f"moves in steps of {seen:.4g}, which is {angle.key} in degrees: is the column in degrees?"
            raise LogError(int(table.index[np.argmax(off)]), angle.column, text, True)
        known = f"the readings have a step of {seen:.6g} rad" if seen else "the readings have no step"
        text = f"does not move in steps of {angle.key} {angle.step_rad:g} rad: {known}; state 0 to take it as it is"
        raise LogError(int(table.index[np.argmax(off)]), angle.column, text, True)


def _missing_steps(table: pd.DataFrame, angle: Angle) -> list[Defect]:
    """An angle in rad that moves in steps which `batch.yaml` does not state, so that they are taken for motion."""
    if angle.counted or angle.step_stated:
        return []
    step = resolution_seen(table["time_s"].to_numpy(), angle.values)
    if not step:
        return []
    text = f"moves in steps of {step:.6g} rad, which are taken for motion: state {angle.key}, 0 if it has none"
    return [Defect(None, angle.column, text)]


def _check_drive(table: pd.DataFrame, drive: Angle, load: Angle | None) -> None:
    if np.ptp(drive.values) <= limits.STILL_COUNTS * drive.grain:
        text = "stands still throughout: encoder stuck or drive switched off, the model has no input"
        raise LogError(None, drive.column, text, True)
    if jump := _lost_samples(table, drive, load) or _jump(table, drive):
        raise LogError(*jump)
    # The load cannot move by itself: if it moves, the drive moves too.
    still = longest_run(np.diff(drive.values, prepend=np.nan) == 0)
    if load and length(still):
        creep = max(limits.OTHER_END_COUNTS * load.grain, limits.OTHER_END_FRACTION * np.ptp(load.values))
        if np.ptp(load.values[still]) > creep:
            first, last = table.index[still][[0, -1]]
            text = f"stands still up to row {last} while the load moves: encoder stuck"
            raise LogError(int(first), drive.column, text, True)


def _is_noisy(table: pd.DataFrame, column: str, drive: Angle, odd: NDArray, most_repeats: float) -> bool:
    """Whether a sensor repeats fewer than a share of its values at rest, `odd` samples left out.

    A converter that is coarser than its noise keeps its value wherever the cables keep their tension: at a rest, and
    while friction takes up a motion. Only of a sensor that is noisy at rest is a constant value a fault. In a log
    without a rest, noise is what turns the readings up and down from sample to sample.
    """
    at_rest = np.zeros(len(table), bool)
    at_rest[: drive.still_samples()] = True
    for run in runs(np.diff(drive.values, prepend=np.nan) == 0, limits.FROZEN_SAMPLES + 1):
        at_rest[run] = True
    change = np.diff(table[column].to_numpy(), prepend=np.nan)
    repeats = (change == 0)[at_rest & ~odd]
    if repeats.size > limits.FROZEN_SAMPLES:
        return bool(repeats.mean() < most_repeats)
    return is_noisy(change[~odd][1:])


def is_noisy(change: NDArray) -> bool:
    """Whether the changes of a channel from sample to sample turn it up and down as noise does.

    Parameters
    ----------
    change : ndarray, shape (n,)
        Differences of the readings.
    """
    turns = np.diff(np.sign(change[change != 0])) != 0
    return turns.size > limits.FROZEN_SAMPLES and bool(turns.mean() > limits.NOISY_TURNS)


def _dead_load(table: pd.DataFrame, load: Angle, rig: Rig) -> Defect | None:
    if np.ptp(load.values) <= limits.STILL_COUNTS * load.grain:
        text = "stands still throughout while the drive moves: encoder stuck or load locked"
        # A load that batch.yaml states as fixed has to stand still, and one that no torque moves may.
        contradicts = rig.far_end != "fixed" and _is_moved(table, load, rig)
        return Defect(None, load.column, text, contradicts=contradicts)
    return _jump(table, load)


def _is_moved(table: pd.DataFrame, load: Angle, rig: Rig) -> bool:
    """Whether the load's torque would move it against its spring; True where torque or spring is not known."""
    scales = {
        TAU_OUT: 1.0,
        "load_current_A": rig.load.torque_constant_Nm_per_A,
        "load_torque_counts": rig.load.torque_sensor and rig.load.torque_sensor.Nm_per_count,
    }
    spring = rig.load.spring_stiffness_Nm_per_rad
    column = next((name for name, scale in scales.items() if scale and name in table), None)
    if column is None or spring is None or load.rad_per_unit is None:
        return True
    values = table[column].to_numpy()
    low, high = np.quantile(values, [0.05, 0.95])
    # The change from sample to sample is mostly noise, of twice its variance.
    noise = np.std(np.diff(values)) / np.sqrt(2)
    moved_rad = (high - low) * scales[column] / spring
    is_noise = high - low < limits.ABOVE_NOISE_SDS * noise
    return not is_noise and bool(moved_rad > limits.MOVED_GRAINS * load.grain * load.rad_per_unit)


def _dead(table: pd.DataFrame, column: str) -> Defect | None:
    values = table[column]
    if np.ptp(values) == 0:
        text = f"is {values.iloc[0]:g} throughout: a sensor that is dead or was never connected"
        return Defect(None, column, text, contradicts=True)
    return None


def _jumps(table: pd.DataFrame, angle: Angle) -> NDArray:
    """Samples after which an angle changes too fast for a pulley."""
    if angle.rad_per_unit is None:
        return np.array([], dtype=int)
    step = np.abs(np.diff(angle.values))
    speed = step * angle.rad_per_unit / np.diff(table["time_s"].to_numpy())
    return np.flatnonzero((speed > limits.FASTEST_RAD_PER_S) & (step > limits.LOST_COUNTS * angle.grain))


def _jump(table: pd.DataFrame, angle: Angle) -> Defect | None:
    """The first change of an angle that is too fast for a pulley; or the unit, if it moves so fast for long."""
    jumps = _jumps(table, angle)
    if jumps.size == 0:
        return None
    step = np.diff(angle.values)[jumps[0]]
    row = int(table.index[jumps[0] + 1])
    if jumps.size > limits.FAST_FRACTION * len(table):
        text = (
            f"changes by more than {limits.FASTEST_RAD_PER_S:g} rad/s in {jumps.size} of {len(table)} samples, as in"
            f" {angle.in_words(step)} here: is it in degrees, or in another unit than {angle.key} states?"
        )
        return Defect(row, angle.column, text, contradicts=True)
    more = f" (and {jumps.size - 1} more such jumps)" if jumps.size > 1 else ""
    text = f"jumps by {angle.in_words(step)} in one sample{more}: counter reset, wrapped or counts lost"
    return Defect(row, angle.column, text, contradicts=True)


def _lost_samples(table: pd.DataFrame, drive: Angle, load: Angle | None) -> Defect | None:
    """A sample at which the angles of both ends jump: samples are missing, and the time does not show it."""
    if load is None or len(table) <= 2 * limits.NEAR_SAMPLES:
        return None
    time = table["time_s"].to_numpy()
    at_drive, at_load = drive.outstanding_changes(time), load.outstanding_changes(time)
    jumps = np.flatnonzero(at_drive & (at_load | np.roll(at_load, 1) | np.roll(at_load, -1)))
    # Noise of an angle without a step stands out now and then, in both at once only by chance.
    if jumps.size == 0 or jumps.size > limits.FAST_FRACTION * len(table):
        return None
    at = jumps[0]
    # The load's change may be logged a sample earlier or later.
    near = np.arange(max(at - 1, 0), min(at + 2, at_load.size))
    also = near[np.argmax(np.abs(np.diff(load.values)[near]))]
    more = f" (and {jumps.size - 1} more times)" if jumps.size > 1 else ""
    text = (
        f"{drive.column} jumps by {drive.in_words(np.diff(drive.values)[at])} and {load.column} by"
        f" {load.in_words(np.diff(load.values)[also])} in one sample{more}: samples were lost and the time does not"
        " show it"
    )
    return Defect(int(table.index[at + 1]), "time_s", text, contradicts=True)


def _load_stands(table: pd.DataFrame, drive: Angle, load: Angle) -> list[Defect]:
    """A load encoder that stops for a while: a loose plug or real lost motion, so its column stays."""
    for still in _standstills(table, load.values):
        if np.ptp(drive.values[still]) >= limits.WHOLE_TRAVEL_FRACTION * np.ptp(drive.values):
            first, last = table.index[still][[0, -1]]
            text = f"stands still up to row {last} while the drive runs through its whole range"
            return [Defect(int(first), load.column, f"{text}: loose plug or lost motion")]
    return []


def _frozen(table: pd.DataFrame, column: str, drive: Angle) -> list[Defect]:
    """A noisy sensor that keeps one value for a while: a loose plug, or a converter that hung."""
    values = table[column].to_numpy()
    still = _standstills(table, values)
    frozen = [part for part in still if np.ptp(drive.values[part]) > limits.STILL_COUNTS * drive.grain]
    repeats = np.diff(values, prepend=np.nan) == 0
    for part in still:
        repeats[part] = False
    if not frozen or repeats.mean() >= limits.FROZEN_NOISE_FRACTION:
        return []
    first, last = table.index[frozen[0]][[0, -1]]
    more = f" (and {len(frozen) - 1} more times)" if len(frozen) > 1 else ""
    text = f"stays at {values[frozen[0].start]:g} up to row {last} while the drive moves{more}: sensor frozen"
    is_still = np.zeros(len(table), bool)
    for part in still:
        is_still[part] = True
    contradicts = _is_noisy(table, column, drive, is_still, limits.FROZEN_NOISE_FRACTION)
    return [Defect(int(first), column, text, contradicts)]


def _held(table: pd.DataFrame, drive: NDArray) -> list[Defect]:
    """Readings that are logged several times each, as of a converter or counter slower than the log: one line."""
    every = {column: held_for(table[column], drive) for column in table.columns.drop("time_s")}
    held = {column: samples for column, samples in every.items() if samples}
    if not held:
        return []
    first, longest = next(iter(held)), max(held.values())
    hold_s = longest * float(np.median(np.diff(table["time_s"])))
    others = f", as in {', '.join(c for c in held if c != first)}" if len(held) > 1 else ""
    text = (
        f"each reading stands in {longest} samples{others}: a sensor that is read more slowly than it is logged, whose"
        f" readings are late by up to {1e3 * hold_s:.3g} ms, {500 * hold_s:.3g} ms on average; log at its rate of"
        f" {1 / hold_s:.3g} Hz or less"
    )
    return [Defect(None, first, text, contradicts=hold_s > limits.HELD_S)]


def held_for(values: ArrayLike, drive: NDArray) -> int:
    """Samples for which each reading is held; 0 if readings differ or their repeats are those of a coarse converter.

    A coarse converter keeps its value as long as it takes to the next step. One that holds changes in even intervals,
    by whatever came together since. A drive that goes in steps and stands still between them is no converter.
    """
    changes = np.diff(np.asarray(values))
    at = np.flatnonzero(changes)
    if at.size < limits.FEWEST_HELD:
        return 0
    moves = drive[at[1:]] != drive[at[:-1] + 1]
    if np.mean(moves) < limits.HELD_MOVING:
        return 0
    between = np.diff(at)
    samples = int(np.median(between))
    is_even = np.mean(np.abs(between - samples) <= 1) > limits.HELD_EVENLY
    sizes = np.abs(changes[at])
    is_fine = np.median(sizes) > limits.HELD_STEPS * sizes.min()
    return samples if samples >= limits.HELD_SAMPLES and is_even and is_fine else 0


def _standstills(table: pd.DataFrame, values: NDArray) -> list[slice]:
    """Parts of a log in which a sensor keeps one value for long."""
    time = table["time_s"].to_numpy()
    # The sample before a run of repeats has the same value.
    repeats = runs(np.diff(values, prepend=np.nan) == 0, limits.FROZEN_SAMPLES + 1)
    parts = [slice(run.start - 1, run.stop) for run in repeats]
    return [part for part in parts if time[part.stop - 1] - time[part.start] > limits.FROZEN_S]


def _saturated(
    table: pd.DataFrame, column: str, drive: Angle, sensor_range: tuple[float, float] | None
) -> list[Defect]:
    numbers = table[column].to_numpy()
    most_repeats = limits.FLAT_NOISE_FRACTION
    if sensor_range:
        ends = [numbers <= sensor_range[0], numbers >= sensor_range[1]]
        what = f"at the end of the sensor's range [{sensor_range[0]:g}, {sensor_range[1]:g}]"
    else:
        ends = [numbers == numbers.min(), numbers == numbers.max()]
        inside, repeats = ~(ends[0] | ends[1])[1:], np.diff(numbers) == 0
        if not inside.any():
            return []
        at_ends, elsewhere = max(length(longest_run(end)) for end in ends), length(longest_run(repeats & inside))
        if at_ends > limits.FLAT_OVER_INSIDE * elsewhere:
            most_repeats = limits.FROZEN_NOISE_FRACTION
        elif repeats[inside].mean() >= limits.FLAT_NOISE_FRACTION:
            # A channel without noise dwells at its extremes by nature, one with few steps everywhere.
            return []
        what = "flat at its extreme value"
    found = []
    at_end = ends[0] | ends[1]
    contradicts = bool(sensor_range) or _is_noisy(table, column, drive, at_end, most_repeats)
    for end in ends:
        run = longest_run(end)
        if length(run) >= limits.FLAT_SAMPLES:
            text = f"{what} in {end.sum()} samples, {length(run)} in a row from here: saturated"
            found.append(Defect(int(table.index[run.start]), column, text, contradicts))
    return found
