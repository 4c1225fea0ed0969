"""Offset and drift of a clock, from one quantity that two files recorded."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import least_squares
from scipy.signal import correlate, correlation_lags
from scipy.stats import t as student

from ccmodel.rig.findings import LogError
from ccmodel.rig.importing.clocks import Clock
from ccmodel.rig.importing.map import LARGEST_DRIFT

# Samples of the uniform grid on which the lag is looked for.
_GRID = 1 << 16
# Correlation of the matched signals below which they do not show the same quantity.
_LEAST_CORRELATION = 0.9
# Shortest overlap of the two, as a share of the shorter; overlap from which two fits are rivals; and how much a longer
# overlap is preferred where fits are started.
_LEAST_OVERLAP, _FULL_OVERLAP, _OVERLAP_POWER = 0.25, 0.7, 0.2
# Lags from which a fit is started.
_CANDIDATES = 6
# Fits that leave at most this factor and this share of the power more than the best are as good.
_SAME_MISFIT, _NO_MISFIT = 1.2, 1e-5
# Width of the filter before the fit, as a share of the period of the highest frequency; the share of the power up to
# that frequency; and how far the filter reaches, in widths.
_WIDTH, _POWER_SHARE, _REACH = 0.05, 0.95, 4.0
# Step of the filtered signals, as a share of the filter's width: they have no more detail than that.
_THINNED = 0.125
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
    time, values = _finite(time, values, "the matched signal")
    first_time, first_values = _finite(first_time, first_values, "the matched signal of the first file")
    step = _step(time, first_time)
    here, there = _on_grid(time, values, step), _on_grid(first_time, first_values, step)
    highest = _highest_frequency(there, step)
    lags = _lags(here, there, 0.25 / highest / step)
    # The same filter on both moves neither, and takes the noise out of the slopes that the fits follow.
    width = _WIDTH / highest / step
    every = max(1, int(width * _THINNED))
    # Near its ends a filtered signal is distorted, and offsets that fit alike would leave unequal errors.
    end = min(int(_REACH * width), min(here.size, there.size) // 4)
    here, there = (gaussian_filter1d(values, width)[end : values.size - end : every] for values in (here, there))
    starts = [first_time[0] - time[0] + step * lag for lag in lags]
    begins = time[0] + step * end, first_time[0] + step * end
    fits = [_fit(start, begins[0], here, begins[1], there, step * every) for start in starts]
    return _best([fit for fit in fits if fit is not None], 0.25 / highest)


@dataclass(frozen=True)
class _Fit:
    """A clock, the share of the power that it leaves unexplained, and the overlap as a share of the shorter signal.

    `middle_s` is its offset in the middle of the overlap, which the fit determines best.
    """

    clock: Clock
    misfit: float
    overlap: float
    middle_s: float


def _fit(start: float, begin: float, here: NDArray, first_begin: float, there: NDArray, step: float) -> _Fit | None:
    """Fit offset, drift, gain and zero from one start; None if nothing overlaps."""
    slope = np.gradient(there, step)
    t, t_first = begin + step * np.arange(here.size), first_begin + step * np.arange(there.size)
    whole, middle = t, (t[0] + t[-1]) / 2
    inside = _inside(t + start, t_first)
    if inside.sum() < _BLOCKS or np.ptp(here[inside]) == 0:
        return None
    t, here = t[inside], here[inside]

    def on_first(p: NDArray) -> NDArray:
        return t + p[0] + p[1] * (t - middle)

    def residuals(p: NDArray) -> NDArray:
        return p[2] * np.interp(on_first(p), t_first, there) + p[3] - here

    def jacobian(p: NDArray) -> NDArray:
        at = on_first(p)
        value, rise = np.interp(at, t_first, there), p[2] * np.interp(at, t_first, slope)
        return np.column_stack([rise, rise * (t - middle), value, np.ones_like(value)])

    gain, zero = np.polyfit(np.interp(t + start, t_first, there), here, 1)
    fit = least_squares(residuals, [start, 0.0, gain, zero], jac=jacobian, x_scale="jac", xtol=1e-12, ftol=1e-12)
    centre, drift = map(float, fit.x[:2])
    # t_first = t + centre + drift (t - middle), so that the offset at time zero is centre - drift * middle. An error of
    # the drift is an error of this offset, however well the offset in the middle is known.
    offset, of_drift = _half_widths(fit.jac, fit.fun, np.array([[1.0, -middle, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]))
    clock = Clock(centre - drift * middle, drift, offset, of_drift, f"matched over {np.ptp(t):.4g} s")
    # Fits from several starts may end as one clock, and have its overlap.
    overlap = _inside(whole + centre + drift * (whole - middle), t_first).sum() / min(whole.size, there.size)
    return _Fit(clock, float(np.var(fit.fun) / np.var(here)), float(overlap), centre)


def _best(fits: list[_Fit], apart_s: float) -> Clock:
    """The fit that leaves least; of several clocks that leave the same, the one with the longest overlap.

    Fits whose offsets differ by less than `apart_s` are one clock, found from several starts.
    """
    least = min((fit.misfit for fit in fits), default=1.0)
    if least > 1 - _LEAST_CORRELATION**2:
        text = f"the matched signals correlate by {max(1 - least, 0) ** 0.5:.2f} only: match two of the same quantity"
        raise LogError(None, None, text)
    alike: list[_Fit] = []
    for fit in sorted(fits, key=lambda fit: (fit.misfit, -fit.overlap)):
        is_new = all(abs(fit.middle_s - other.middle_s) > apart_s for other in alike)
        if is_new and fit.misfit <= _SAME_MISFIT * least + _NO_MISFIT:
            alike.append(fit)
    rivals = [fit for fit in alike if fit.overlap > _FULL_OVERLAP]
    if len(rivals) > 1:
        offsets = " and ".join(f"{fit.clock.offset_s:.4g} s" for fit in rivals[:2])
        text = f"the matched signals repeat, and offsets of {offsets} fit alike"
        raise LogError(None, None, f"{text}: match a motion that does not repeat, or state offset_s")
    best = max(alike, key=lambda fit: fit.overlap).clock
    if abs(best.drift) > LARGEST_DRIFT:
        text = f"the clocks of the matched signals differ by {100 * best.drift:.3g} %: check the units of time"
        raise LogError(None, None, text)
    return best


def _finite(time: NDArray, values: NDArray, which: str) -> tuple[NDArray, NDArray]:
    has = np.isfinite(time) & np.isfinite(values)
    if has.sum() < _BLOCKS or np.ptp(values[has]) == 0:
        raise LogError(None, None, f"{which} is constant or nearly empty: match one that moves")
    if not (np.diff(time[has]) > 0).all():
        raise LogError(None, None, f"the times of {which} must increase")
    return time[has], values[has]


def _inside(at: NDArray, first_time: NDArray) -> NDArray:
    """Samples that the other clock covers, without a margin in which the fit may move."""
    margin = 0.01 * np.ptp(at)
    return (at > first_time[0] + margin) & (at < first_time[-1] - margin)


def _step(time: NDArray, first_time: NDArray) -> float:
    """Step of the grid, s: the finer of the two, unless the recording has too many of them."""
    duration = max(np.ptp(time), np.ptp(first_time))
    return float(max(duration / _GRID, min(np.median(np.diff(time)), np.median(np.diff(first_time)))))


def _lags(here: NDArray, there: NDArray, lobe: float) -> list[int]:
    """Samples by which the beginning of `here` may be later in `there`: where the two are most alike, best first."""
    lags = correlation_lags(there.size, here.size)
    ones = np.ones_like(here), np.ones_like(there)
    overlap = np.maximum(correlate(ones[1], ones[0]), 0.0) / min(here.size, there.size)
    power = correlate(there**2, ones[0]) * correlate(ones[1], here**2)
    likeness = np.abs(correlate(there, here)) / np.sqrt(np.maximum(power, power.max() * 1e-12))
    score = np.where(overlap < _LEAST_OVERLAP, 0.0, likeness * overlap**_OVERLAP_POWER)
    found: list[int] = []
    while len(found) < _CANDIDATES and score.max() > 0:
        found.append(int(lags[np.argmax(score)]))
        score[np.abs(lags - found[-1]) <= lobe] = 0.0
    return found


def _highest_frequency(values: NDArray, step: float) -> float:
    """Frequency below which a signal has nearly all of its power, Hz."""
    power = np.abs(np.fft.rfft(values * np.hanning(values.size))) ** 2
    share = np.cumsum(power) / power.sum()
    return float(max(int(np.searchsorted(share, _POWER_SHARE)), 1) / (values.size * step))


def _on_grid(time: NDArray, values: NDArray, step: float) -> NDArray:
    even = np.interp(np.arange(time[0], time[-1], step), time, values)
    return even - even.mean()


def _half_widths(jacobian: NDArray, residual: NDArray, sums: NDArray) -> list[float]:
    """Half-widths of the intervals of sums of the parameters, with errors that are correlated within blocks.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
    residual : ndarray, shape (n,)
    sums : ndarray, shape (k, p)
        Coefficients of the parameters in each sum.
    """
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    blocks = np.array_split(jacobian * residual[:, None], _BLOCKS)
    scores = np.array([block.sum(axis=0) for block in blocks])
    covariance = bread @ (scores.T @ scores) @ bread * _BLOCKS / (_BLOCKS - jacobian.shape[1])
    variances = np.einsum("ki,ij,kj->k", sums, covariance, sums)
    quantile = student.ppf((1 + _CONFIDENCE) / 2, _BLOCKS - jacobian.shape[1])
    return [float(width) for width in quantile * np.sqrt(np.maximum(variances, 0.0))]
