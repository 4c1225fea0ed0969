"""The angle of one end as a log has it: counts, an angle in rad that moves in steps, or one without a step.

Counts and steps are whole numbers here, so that an angle is judged and calibrated alike however it was logged.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from ccmodel.channels import ANGLE_AT, THETA_MOTOR
from ccmodel.rig import limits
from ccmodel.rig.batch import RAW_COLUMNS, End, Rig

# The samples near one, without itself and its neighbours, with which a lost count may share the jump.
NEAR = np.ones(2 * limits.NEAR_SAMPLES + 1, bool)
NEAR[limits.NEAR_SAMPLES - 1 : limits.NEAR_SAMPLES + 2] = False


@dataclass(frozen=True)
class Angle:
    """An angle in its own unit: counts, steps or rad.

    Attributes
    ----------
    column : str
        Column of the log.
    values : ndarray, shape (n,)
        The angle from any zero; whole numbers where it moves in steps.
    rad_per_unit : float or None
        None for counts of an encoder whose counts per revolution are not stated.
    counted : bool
        Whether it moves in steps of one unit.
    grain : float
        The change from which on the angle has moved: one count or step, or the width of its noise.
    key : str
        The key of `batch.yaml` that converts it.
    step_stated : bool
        Whether `batch.yaml` states this key.
    """

    column: str
    values: NDArray
    rad_per_unit: float | None
    counted: bool
    grain: float
    key: str
    step_stated: bool

    @property
    def step_rad(self) -> float | None:
        """Angle of one step, rad; None without a step."""
        return self.rad_per_unit if self.counted else None

    def in_words(self, change: float) -> str:
        """A change of the angle with its unit."""
        counts = self.column.endswith("counts")
        return f"{change:g} counts" if counts or self.rad_per_unit is None else f"{change * self.rad_per_unit:.4g} rad"

    def outstanding_changes(self, time_s: NDArray) -> NDArray:
        """Whether each change from sample to sample is larger than all others near it by more than counting explains.

        A change over a gap in time is judged by its rate.

        Parameters
        ----------
        time_s : ndarray, shape (n,)
            Times of the samples, s.

        Returns
        -------
        ndarray of bool, shape (n - 1,)
        """
        step = np.diff(time_s)
        change = np.abs(np.diff(self.values)) / np.maximum(step / np.median(step), 1.0)
        near = maximum_filter(change, footprint=NEAR, mode="mirror")
        return change > limits.OUTSTANDING_FACTOR * near + limits.OUTSTANDING_GRAINS * self.grain

    def still_samples(self) -> int:
        """Number of samples at the start during which the angle only dithers."""
        values = self.values
        spread = np.maximum.accumulate(values) - np.minimum.accumulate(values)
        band = limits.STILL_COUNTS * self.grain
        still = int(np.argmax(spread > band)) if spread[-1] > band else values.size
        if self.counted:
            # The first count of the motion looks like dither, so the rest ends at the last sample of its most
            # frequent count.
            levels, frequency = np.unique(values[:still], return_counts=True)
            at_rest = values[:still] == levels[np.argmax(frequency)]
        elif still == values.size:
            return still
        else:
            # The motion is seen when it leaves the noise, and began when it last was on the other side of the rest.
            level = np.median(values[:still])
            at_rest = (values[:still] - level) * (values[still] - level) <= 0
        return int(np.flatnonzero(at_rest)[-1]) + 1


def angle_of(table: pd.DataFrame, end: End) -> Angle | None:
    """The angle that a log has of one end; None if it has none.

    Parameters
    ----------
    table : DataFrame, shape (n, columns)
        Columns of the log.
    end : End
        The end of the rig.
    """
    return angle_at(table, end.name, end.side.encoder_counts_per_rev, end.side.angle_resolution_rad)


def angle_at(table: pd.DataFrame, end: str, counts_per_rev: float | None, step_rad: float | None) -> Angle | None:
    """The same from the name of the end ("drive" or "load") and the two constants, where they are known."""
    (counts,), angle, key = RAW_COLUMNS[ANGLE_AT[end]], ANGLE_AT[end], f"rig.{end}"
    counted = _counted(table, counts, counts_per_rev, f"{key}.encoder_counts_per_rev")
    if counted or angle not in table:
        return counted
    values, key = table[angle].to_numpy(), f"{key}.angle_resolution_rad"
    if step_rad:
        return Angle(angle, np.round((values - values[0]) / step_rad), step_rad, True, 1.0, key, True)
    width = noise_width(table["time_s"].to_numpy(), values)
    return Angle(angle, values, 1.0, False, width, key, step_rad is not None)


def angle_of_motor(table: pd.DataFrame, rig: Rig) -> Angle | None:
    """The motor's angle at the drive pulley, as a log has it; None if it has none."""
    (counts,), key = RAW_COLUMNS[THETA_MOTOR], "rig.drive.motor_counts_per_rev"
    counted = _counted(table, counts, rig.drive.motor_counts_per_rev, key)
    if counted or THETA_MOTOR not in table:
        return counted
    return Angle(THETA_MOTOR, table[THETA_MOTOR].to_numpy(), 1.0, False, limits.FINE_STEP_RAD, key, True)


def _counted(table: pd.DataFrame, counts: str, counts_per_rev: float | None, key: str) -> Angle | None:
    """An angle whose log has an encoder's counts; None if it has none."""
    if counts not in table:
        return None
    rad = 2 * np.pi / counts_per_rev if counts_per_rev else None
    return Angle(counts, table[counts].to_numpy(), rad, True, 1.0, key, counts_per_rev is not None)


def noise_width(time_s: NDArray, angle_rad: NDArray) -> float:
    """Width of the noise of an angle without a step, rad: the scatter about a parabola at the recording's start."""
    n = max(int(np.searchsorted(time_s, time_s[0] + limits.SHORTEST_REST_S)), limits.FEWEST_SAMPLES)
    time, start = time_s[:n] - time_s[0], angle_rad[:n]
    curve = np.polynomial.Polynomial.fit(time, start, 2)
    return max(limits.NOISE_WIDTH_SDS * float(np.std(start - curve(time), ddof=3)), limits.FINE_STEP_RAD)


def passes_of_zero(values: NDArray, band: float) -> tuple[NDArray, NDArray]:
    """Last sample before and first sample after each pass of zero, from beyond a band on one side to beyond the other.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Deviations from the level that is passed.
    band : float
        Deviation up to which noise about the level does not count.
    """
    side = np.sign(np.where(np.abs(values) > band, values, 0.0))
    known = np.flatnonzero(side)
    changes = np.flatnonzero(np.diff(side[known]))
    return known[changes], known[changes + 1]


def smallest_step(values: NDArray) -> float | None:
    """The step of which all differences of values are multiples: their greatest common divisor, or None.

    Values may be rounded to a few per cent of the step. A step below a billionth of the range is none.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Readings of a sensor, in its unit.
    """
    levels = np.unique(values)
    if levels.size < 2:
        return None
    finest = max(1e-9 * (levels[-1] - levels[0]), 16 * np.finfo(float).eps * np.abs(levels).max())
    gaps = np.sort(np.diff(levels))
    gaps = gaps[gaps > finest]
    step, smaller = gaps[0], True
    while smaller:
        step, smaller = _divided(gaps, step, finest)
    return step


def _divided(gaps: NDArray, step: float, finest: float) -> tuple[float | None, bool]:
    """The step, refined by gaps of which it is a divisor; or a smaller one as soon as it is none, and whether it is."""
    length, multiples = 0.0, 0.0
    for gap in gaps:  # from the smallest on: a long one needs a step known well
        n = round(gap / step)
        rest = abs(gap - n * step)
        if rest > limits.OFF_STEP * step:
            return (rest, True) if rest > finest else (None, False)
        length, multiples = length + gap, multiples + n
        step = length / multiples
    return float(step), False


def resolution_seen(time_s: NDArray, angle_rad: NDArray) -> float:
    """Step in which an angle moves, rad; 0 if it has none that matters: a fine one, or one below its noise."""
    step = smallest_step(angle_rad)
    if step is None or step < limits.FINE_STEP_RAD:
        return 0.0
    return step if limits.NOISE_WIDTH_SDS * step > noise_width(time_s, angle_rad) else 0.0
