"""Offset and drift of a clock, from one quantity that two files recorded."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
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
# Width of the filter before the fit, as a share of the period of the highest frequency; and the share of the power up
# to it.
_WIDTH, _POWER_SHARE = 0.05, 0.95
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
    step = _step(time, first_time)
    here, there = _on_grid(time, values, step), _on_grid(first_time, first_values, step)
    start = first_time[0] - time[0] + step * _lag(here, there)
    # The same filter on both moves neither, and takes the noise out of the slopes that the fit follows.
    width = _WIDTH / _highest_frequency(there, step) / step
    here, there = gaussian_filter1d(here, width), gaussian_filter1d(there, width)
    slope = np.gradient(there, step)
    t, t_first = time[0] + step * np.arange(here.size), first_time[0] + step * np.arange(there.size)
    middle = (t[0] + t[-1]) / 2
    inside = _inside(t + start, t_first)
    t, here = t[inside], here[inside]

    def on_first(p):
        return t + p[0] + p[1] * (t - middle)

    def residuals(p):
        return p[2] * np.interp(on_first(p), t_first, there) + p[3] - here

    def jacobian(p):
        at = on_first(p)
        value, rise = np.interp(at, t_first, there), p[2] * np.interp(at, t_first, slope)
        return np.column_stack([rise, rise * (t - middle), value, np.ones_like(value)])

    gain, zero = np.polyfit(np.interp(t + start, t_first, there), here, 1)
    fit = least_squares(residuals, [start, 0.0, gain, zero], jac=jacobian, x_scale="jac", xtol=1e-12, ftol=1e-12)
    _check_similarity(fit.fun, here)
    centre, drift = fit.x[:2]
    half = _half_widths(fit.jac, fit.fun)
    text = f"matched over {np.ptp(t):.4g} s"
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


def _step(time: NDArray, first_time: NDArray) -> float:
    """Step of the grid, s: the finer of the two, unless the recording has too many of them."""
    duration = max(np.ptp(time), np.ptp(first_time))
    return float(max(duration / _GRID, min(np.median(np.diff(time)), np.median(np.diff(first_time)))))


def _lag(here: NDArray, there: NDArray) -> int:
    """Samples by which the beginning of `here` is later in `there`, where the two are most alike."""
    lags = correlation_lags(there.size, here.size)
    ones = np.ones_like(here), np.ones_like(there)
    overlap = correlate(ones[1], ones[0])
    power = correlate(there**2, ones[0]) * correlate(ones[1], here**2)
    likeness = np.abs(correlate(there, here)) / np.sqrt(np.maximum(power, power.max() * 1e-12))
    long_enough = overlap > _LEAST_OVERLAP * min(here.size, there.size)
    return int(lags[np.argmax(np.where(long_enough, likeness, 0.0))])


def _highest_frequency(values: NDArray, step: float) -> float:
    """Frequency below which a signal has nearly all of its power, Hz."""
    power = np.abs(np.fft.rfft(values * np.hanning(values.size))) ** 2
    share = np.cumsum(power) / power.sum()
    return float(max(np.searchsorted(share, _POWER_SHARE), 1) / (values.size * step))


def _on_grid(time: NDArray, values: NDArray, step: float) -> NDArray:
    even = np.interp(np.arange(time[0], time[-1], step), time, values)
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
