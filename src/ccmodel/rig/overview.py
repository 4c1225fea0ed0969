"""What a log shows before any physics: rate, rest, stroke, frequency; range, noise and resolution of each channel."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ccmodel.channels import CHANNELS, THETA_IN
from ccmodel.recording import Recording
from ccmodel.rig.angle import passes_of_zero, smallest_step

# Fewest samples of a rest from which noise is estimated.
FEWEST_AT_REST = 20
# Share of the stroke around its middle within which a crossing does not count: noise.
CROSSING_BAND = 0.1
# Largest spread of the times between crossings, as a share of their median, of a motion with one frequency.
PERIOD_SPREAD = 0.1
# Residual of a wave, as a share of its amplitude, up to which it is this wave, and the least one of any other wave.
SURE, NOT_SURE = 0.03, 0.06
# The same, up to which a motion has the frequency of its crossings though it is none of the waves.
PERIODIC = 0.25
# Samples to which a wave is fitted.
MOST_FITTED = 5000


@dataclass(frozen=True)
class ChannelOverview:
    """One channel.

    Attributes
    ----------
    name : str
    low, high : float
        Range, in the channel's unit.
    noise : float or None
        Standard deviation about a straight line over the first half of the rest; None if that is too short. Towards
        its end the drive may move by up to a count already.
    step : float or None
        Smallest step of which all differences of the readings are multiples; None if there is none.
    """

    name: str
    low: float
    high: float
    noise: float | None
    step: float | None


@dataclass(frozen=True)
class Overview:
    """A whole log.

    Attributes
    ----------
    samples : int
    rate_Hz, duration_s : float
        Samples per second by the median step, Hz; time of the last sample after the first, s.
    rest_s : float
        Duration of the rest at the start, s; 0 if there is none.
    stroke : float
        Peak to peak of the drive angle, in its unit.
    frequency_Hz, cycles : float or None
        Of a drive motion with one frequency; None for another.
    wave : str or None
        "sine" or "triangle" where the drive motion after the rest is one throughout.
    channels : tuple of ChannelOverview
    """

    samples: int
    rate_Hz: float
    duration_s: float
    rest_s: float
    stroke: float
    frequency_Hz: float | None
    cycles: float | None
    wave: str | None
    channels: tuple[ChannelOverview, ...]


def overview_of(recording: Recording) -> Overview:
    """Describe a recording in SI units; a channel that follows from others has no step of its own."""
    channels = {name: recording[name] for name in CHANNELS if name in recording}
    whole = overview(recording.time_s, channels, THETA_IN, recording.rest_s)
    logged = [
        c
        if not any(other in recording.derived_from[c.name] for other in channels if other != c.name)
        else replace(c, step=None)
        for c in whole.channels
    ]
    return replace(whole, channels=tuple(logged))


def overview(time_s: NDArray, channels: Mapping[str, NDArray], drive: str, rest_end_s: float) -> Overview:
    """Describe a log.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Sample times, s.
    channels : mapping of str to ndarray, each of shape (n,)
        Readings by channel.
    drive : str
        Name of the drive angle among them.
    rest_end_s : float
        Time at which the rest at the start ends, s; that of the first sample or earlier without a rest.
    """
    resting = int(np.searchsorted(time_s, rest_end_s, "right"))
    after = slice(max(resting - 1, 0), None)
    frequency, wave = motion_of(time_s[after], channels[drive][after])
    return Overview(
        samples=time_s.size,
        rate_Hz=float(1 / np.median(np.diff(time_s))),
        duration_s=float(time_s[-1] - time_s[0]),
        rest_s=float(max(rest_end_s - time_s[0], 0.0)),
        stroke=float(np.ptp(channels[drive])),
        frequency_Hz=frequency,
        cycles=None if frequency is None else float((time_s[-1] - time_s[after][0]) * frequency),
        wave=wave,
        channels=tuple(
            ChannelOverview(
                name, float(v.min()) + 0.0, float(v.max()) + 0.0, noise_of(v[: resting // 2]), smallest_step(v)
            )
            for name, v in channels.items()
        ),
    )


def noise_of(values: NDArray) -> float | None:
    """Standard deviation of the readings of a rest about a straight line; None if they are too few."""
    if values.size < FEWEST_AT_REST:
        return None
    if np.ptp(values) == 0:
        return 0.0
    at = np.arange(values.size)
    return float(np.std(values - np.polynomial.Polynomial.fit(at, values, 1)(at), ddof=2))


def motion_of(time_s: NDArray, angle: NDArray) -> tuple[float | None, str | None]:
    """Frequency of a motion, Hz, and its wave; None where it has not one of them throughout.

    Parameters
    ----------
    time_s, angle : ndarray, shape (n,)
        s; any unit.
    """
    middle, stroke = (angle.max() + angle.min()) / 2, np.ptp(angle)
    if stroke == 0:
        return None, None
    times = _crossings(time_s, (angle - middle) / stroke)
    half_periods = np.diff(times)
    if half_periods.size < 2 or np.ptp(half_periods) > PERIOD_SPREAD * np.median(half_periods):
        return None, None
    rough = 0.5 / float(half_periods.mean())
    upwards = angle[np.searchsorted(time_s, times[0])] > middle
    start = rough, 0.0 if upwards else np.pi
    # From the first crossing on: a motion may start smoothly.
    first = int(np.searchsorted(time_s, times[0]))
    on = slice(first, None, max(1, (time_s.size - first) // MOST_FITTED))
    fits = {name: _best_fit(time_s[on], angle[on], wave, start) for name, wave in _WAVES.items()}
    (best, (frequency, residual)), (_, (_, other)) = sorted(fits.items(), key=lambda fit: fit[1][1])
    if residual <= SURE and other >= NOT_SURE:
        return frequency, best
    return (rough if residual <= PERIODIC else None), None


def _crossings(time_s: NDArray, swing: NDArray) -> NDArray:
    """Times at which a motion of peak to peak 1 passes its middle, each once however noisy it is."""
    before, after = passes_of_zero(swing, CROSSING_BAND / 2)
    share = swing[before] / (swing[before] - swing[after])
    return time_s[before] + share * (time_s[after] - time_s[before])


# Waves of peak 1 over the phase, rad, that pass 0 upwards at phase 0.
_WAVES: dict[str, Callable[[NDArray], NDArray]] = {
    "sine": np.sin,
    "triangle": lambda phase: 2 / np.pi * np.arcsin(np.sin(phase)),
}


def _best_fit(time_s: NDArray, angle: NDArray, wave: Callable, start: Sequence[float]) -> tuple[float, float]:
    """Frequency, Hz, and rms residual over amplitude of the wave that fits best, from a frequency and phase."""
    time, scale = time_s - time_s[0], np.ptp(angle) / 2

    def residual(p: NDArray) -> NDArray:
        return p[0] + p[1] * wave(2 * np.pi * p[2] * time + p[3]) - angle / scale

    found = least_squares(residual, [(angle.max() + angle.min()) / 2 / scale, 1.0, *start])
    # A wave that runs backwards, the other way up, is the same one.
    return abs(float(found.x[2])), float(np.sqrt(np.mean(found.fun**2)) / max(abs(found.x[1]), 1e-9))
