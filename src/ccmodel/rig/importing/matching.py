"""Offset and drift of a clock, from one quantity that two files recorded."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import correlate, correlation_lags
from scipy.stats import t as student

from ccmodel.rig.findings import LogError
from ccmodel.rig.importing.clocks import Clock

# Samples of the uniform grid on which the lag is looked for.
_GRID = 1 << 16
# Correlation of the matched signals below which they do not show the same quantity.
_LEAST_CORRELATION = 0.9
# Shortest overlap of the two, as a share of the shorter.
_LEAST_OVERLAP = 0.25
# Blocks in which errors may be correlated.
_BLOCKS = 20
_CONFIDENCE = 0.95


def match_clocks(time: NDArray, values: NDArray, first_time: NDArray, first_values: NDArray) -> Clock:
    """Estimate a clock from a quantity that was recorded by it and by the clock of the first file.

    A lag from the cross-correlation starts a least-squares fit of offset, drift, gain and zero. The intervals allow
    for errors that are correlated within a twentieth of the recording.

    Parameters
    ----------
    time, values : ndarray, shape (n,)
        Times on the clock to be estimated, s; the quantity in any unit.
    first_time, first_values : ndarray, shape (m,)
        Times on the first file's clock, s; the same quantity in any unit.

    Returns
    -------
    Clock
        With 95 % intervals.

    Raises
    ------
    LogError
        If the two do not show the same quantity.
    """
    time, values = _finite(time, values)
    first_time, first_values = _finite(first_time, first_values)
    middle = (time[0] + time[-1]) / 2
    start = _lag(time, values, first_time, first_values)

    def on_first(p):
        return time + p[0] + p[1] * (time - middle)

    inside = _inside(on_first((start, 0.0)), first_time)

    def residuals(p):
        there = np.interp(on_first(p)[inside], first_time, first_values)
        basis = np.column_stack([there, np.ones_like(there)])
        gain_and_zero = np.linalg.lstsq(basis, values[inside], rcond=None)[0]
        return values[inside] - basis @ gain_and_zero

    # Scales: a step of time, and the drift that makes one over the recording.
    step = float(np.median(np.diff(time)))
    scale = np.array([step, step / (time[-1] - time[0])])
    fit = least_squares(lambda x: residuals(x * scale + (start, 0.0)), np.zeros(2), diff_step=1e-2, x_scale=1.0)
    centre, drift = fit.x * scale + (start, 0.0)
    _check_similarity(fit.fun, values[inside])
    half = _half_widths(fit.jac / scale, fit.fun)
    text = f"matched over {np.ptp(time[inside]):.4g} s"
    # t_first = t + centre + drift (t - middle), so that the offset at time zero is centre - drift * middle.
    return Clock(float(centre - drift * middle), float(drift), float(half[0]), float(half[1]), text)


def _finite(time: NDArray, values: NDArray) -> tuple[NDArray, NDArray]:
    has = np.isfinite(time) & np.isfinite(values)
    if has.sum() < _BLOCKS or np.ptp(values[has]) == 0:
        raise LogError(None, None, "a matched signal is constant or nearly empty: match one that moves")
    if not (np.diff(time[has]) > 0).all():
        raise LogError(None, None, "the times of a matched signal must increase")
    return time[has], values[has]


def _inside(at: NDArray, first_time: NDArray) -> NDArray:
    """Samples that the other clock covers, without a margin in which the fit may move."""
    margin = 0.01 * np.ptp(at)
    return (at > first_time[0] + margin) & (at < first_time[-1] - margin)


def _lag(time: NDArray, values: NDArray, first_time: NDArray, first_values: NDArray) -> float:
    """Offset at which the two correlate most, to a step of the grid, s."""
    duration = max(np.ptp(time), np.ptp(first_time))
    step = max(duration / _GRID, min(np.median(np.diff(time)), np.median(np.diff(first_time))))
    here = _on_grid(time, values, step)
    there = _on_grid(first_time, first_values, step)
    lags = correlation_lags(there.size, here.size)
    ones = correlate(np.ones_like(there), np.ones_like(here))
    power = correlate(there**2, np.ones_like(here)) * correlate(np.ones_like(there), here**2)
    long_enough = ones > _LEAST_OVERLAP * min(here.size, there.size)
    similarity = np.abs(correlate(there, here)) / np.sqrt(np.maximum(power, power.max() * 1e-12))
    best = int(np.argmax(np.where(long_enough, similarity, 0.0)))
    return float(first_time[0] - time[0] + lags[best] * step)


def _on_grid(time: NDArray, values: NDArray, step: float) -> NDArray:
    grid = np.arange(time[0], time[-1], step)
    even = np.interp(grid, time, values)
    return even - even.mean()


def _check_similarity(residual: NDArray, values: NDArray) -> None:
    correlation = np.sqrt(max(1 - np.var(residual) / np.var(values), 0.0))
    if correlation < _LEAST_CORRELATION:
        text = f"the matched signals correlate by {correlation:.2f} only: match two of the same quantity"
        raise LogError(None, None, text)


def _half_widths(jacobian: NDArray, residual: NDArray) -> NDArray:
    """Half-widths of the intervals, with errors that are correlated within blocks."""
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    blocks = np.array_split(jacobian * residual[:, None], _BLOCKS)
    scores = np.array([block.sum(axis=0) for block in blocks])
    covariance = bread @ (scores.T @ scores) @ bread * _BLOCKS / (_BLOCKS - jacobian.shape[1])
    return student.ppf((1 + _CONFIDENCE) / 2, _BLOCKS - jacobian.shape[1]) * np.sqrt(np.diag(covariance))
