"""Impossible readings: single cells of a column that are far from all readings near them.

A converter, counter or logger writes one now and then. Least squares would follow it: one current of 30 A among 9 A
moves a fitted friction by as much as a real effect does, and so does one angle that is off by 0.6 rad. An angle that
stays off after a jump is a counter that lost counts, and has a check of its own.
"""

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from ccmodel.rig import limits
from ccmodel.rig.findings import Defect

# The readings that one is compared with: so many on each side, without itself.
NEIGHBOURS = np.ones(2 * limits.OUTLIER_NEIGHBOURS + 1, bool)
NEIGHBOURS[limits.OUTLIER_NEIGHBOURS] = False


def drop_outliers(table: pd.DataFrame) -> tuple[pd.DataFrame, list[Defect]]:
    """Drop the rows of impossible readings.

    Parameters
    ----------
    table : DataFrame, shape (n, columns)
        Columns of a log as finite numbers; the index is the row in the file.

    Returns
    -------
    table : DataFrame
        The other rows.
    warnings : list of Defect
        One for each column with impossible readings; where they are many, they are not dropped.
    """
    is_bad, warnings = np.zeros(len(table), bool), []
    for column in table.columns.drop("time_s", errors="ignore"):
        values = table[column].to_numpy()
        distances = _distances(values)
        found = _few(*distances)
        if found.size:
            at, others = found[0], np.delete(values, found)
            more = f" (and {found.size - 1} more such readings): their rows are" if found.size > 1 else ": row"
            text = (
                f"reads {values[at]:g} in one sample, far from those near it; all others lie between"
                f" {others.min():g} and {others.max():g}{more} dropped"
            )
            warnings.append(Defect(int(table.index[at]), column, text))
            is_bad[found] = True
        elif (often := _many(values, *distances)).size:
            share = f"{often.size} single readings ({often.size / values.size:.1%})"
            text = f"{share} are far from all near them, up to {values[often[np.argmax(np.abs(values[often]))]]:g}"
            warnings.append(Defect(int(table.index[often[0]]), column, f"{text}: is the sensor faulty? They are used"))
    return without(table, is_bad), warnings


def without(table: pd.DataFrame, rows: NDArray) -> pd.DataFrame:
    """A table without some of its rows; the table itself if there are none."""
    return table[~rows] if rows.any() else table


def _few(distance: NDArray, least: float, is_judged: NDArray) -> NDArray:
    """Positions of impossible readings, ascending, from the `_distances` of all readings.

    They are farther from the median of their neighbours than all others are, by a factor. Whatever a rig does, from
    noise to a load that snaps, it does more than once in a recording or within several samples.
    """
    return _standing_out(distance, max(int(limits.BAD_CELLS_FRACTION * distance.size), 1), least, is_judged)


def _many(values: NDArray, distance: NDArray, least: float, is_judged: NDArray) -> NDArray:
    """As `_few`, of readings that are more than a few: each is also far from the readings before and after it.

    A load that snaps again and again is not back in the next sample.
    """
    if not distance.size:
        return np.array([], int)
    steps = np.abs(np.diff(values))
    # The first and the last reading have one neighbour, and may be part of another motion.
    single = np.minimum(np.append(steps, 0.0), np.insert(steps, 0, 0.0))
    return _standing_out(np.minimum(distance, single), int(limits.MOST_OUTLIERS * values.size), least, is_judged)


def _distances(values: NDArray) -> tuple[NDArray, float, NDArray]:
    """Distances from the median of the neighbours, the least that counts, and which readings can be judged by them.

    There are none where no step is large enough. At the ends of a log, readings on one side stand for both, and their
    median lags behind a motion that is steep there or has just reversed. A reading there can be judged if it turns back
    as a spike does, beyond both adjacent readings by most of the distance, or lies far from all the log.
    """
    steps = np.abs(np.diff(values))
    low, high = np.quantile(values, limits.OUTLIER_RANGE)
    least = max(limits.OUTLIER_SHARE * (high - low), limits.OUTLIER_GRAINS * steps[steps > 0].min(initial=np.inf))
    if not (2 * steps > least).any():
        return np.array([]), least, np.array([], bool)
    distance = np.abs(values - median_filter(values, footprint=NEIGHBOURS, mode="mirror"))
    # A first or last reading may be part of a motion that the log has not, as in the public recordings.
    is_far = np.abs(values - np.median(values)) > limits.OUTLIER_AT_ENDS * (high - low)
    distance[[0, -1]] *= is_far[[0, -1]]
    row = np.arange(values.size)
    is_inside = np.minimum(row, row[::-1]) >= limits.OUTLIER_NEIGHBOURS
    return distance, least, is_inside | is_far | (_beyond_adjacent(values) > limits.OUTLIER_SINGLE * distance)


def _beyond_adjacent(values: NDArray) -> NDArray:
    """How far each reading lies above or below both adjacent ones; zero for the first and the last, which have one."""
    inner, before, after = values[1:-1], values[:-2], values[2:]
    beyond = np.maximum(np.minimum(before, after) - inner, inner - np.maximum(before, after))
    return np.pad(np.maximum(beyond, 0.0), 1)


def _standing_out(distance: NDArray, most: int, least: float, is_judged: NDArray) -> NDArray:
    """Positions of the largest distances, at most so many, of which the last is larger than the next by a factor.

    Those that cannot be judged are left out afterwards.
    """
    order = np.argsort(-distance, kind="stable")
    leading = distance[order[: most + 1]]
    stands_out = (leading[:-1] > limits.OUTLIER_FACTOR * leading[1:]) & (leading[:-1] > least)
    found = np.sort(order[: np.flatnonzero(stands_out)[-1] + 1]) if stands_out.any() else np.array([], int)
    return found[is_judged[found]]
