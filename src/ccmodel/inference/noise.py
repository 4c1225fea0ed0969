"""Noise of a recording under the correct model: sensor noise, encoder steps, and the uncertain drive motion.

Source
------
The scatter at rest of several recordings, each by what its own samples and all recordings say: Smyth, Linear models and
empirical Bayes methods, Stat. Appl. Genet. Mol. Biol. 3 (2004), Section 6.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.special import polygamma

from ccmodel.inference.effective_samples import IN_DIAGNOSIS
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate

# Fewest samples of a rest from which a sensor's noise is estimated; with fewer the stated accuracy is taken.
FEWEST_AT_REST = 20
# Least noise of a sensor, as a share of its stated accuracy, however small its scatter at rest.
BEST_SHARE = 0.1
# Weight of the noise at rest beside that of consecutive cycles, as degrees of freedom.
REST_FREEDOM = 4.0
# Scatter at rest over that of cycles from which on the rest is none.
RESTLESS = 2.0
# Time over which the variance of a few draws of the drive motion is averaged.
ALIKE_S = 0.05
# Sub-count offsets of the load encoder, uniform over a count.
ROUNDING_PHASES = (np.arange(16) + 0.5) / 16 - 0.5


@dataclass(frozen=True)
class SensorNoise:
    """Noise of a channel.

    Attributes
    ----------
    sd : float
        Standard deviation, in the channel's unit.
    source : {"cycles", "rest", "count", "assumed"}
        Consecutive cycles, scatter at rest, the step of a counted angle, or the stated accuracy.
    freedom : float
        Degrees of freedom of the scatter at rest; 0 of another source.
    least : float
        Least standard deviation that a rest, or cycles in its place, may show.
    """

    sd: float
    source: str
    freedom: float = 0.0
    least: float = 0.0


def sensor_noise(given: ModelInput) -> dict[str, SensorNoise]:
    """Noise of each channel without regard to its motion.

    The scatter about a straight line through the first half of the rest at the recording's start (before the drive's
    first count, friction already gives way in the second half), or the stated accuracy if the rest is too short. A
    counted angle has the standard deviation of its step, a channel without rest and accuracy a hundredth of its range.
    This is the prior of what consecutive cycles show (`repeated`).
    """
    recording, found = given.recording, {}
    for channel, values in recording.channels.items():
        stated = recording.accuracy.get(channel)
        rest = given.resting[channel]
        if (step := recording.encoder_step_rad.get(channel)) is not None:
            prior = SensorNoise(step / np.sqrt(12), "count")
        elif rest.size >= FEWEST_AT_REST:
            best = BEST_SHARE * stated if stated else 1e-6 * max(float(np.abs(values).max()), 1e-9)
            first = rest[: max(FEWEST_AT_REST, rest.size // 2)]
            prior = SensorNoise(max(_scatter(first), best), "rest", first.size - 2, best)
        else:
            prior = SensorNoise(stated or 0.01 * max(float(np.ptp(values)), 1e-9), "assumed")
        found[channel] = prior
    return found


def pooled(noises: Sequence[SensorNoise]) -> list[SensorNoise]:
    """Noise of one channel in several recordings, the scatter at each rest drawn towards that of all rests.

    A rest has few samples, and its variance scatters by a quarter; the sensor is the same one. The variances of all
    recordings are drawn from a scaled inverse chi-squared distribution, whose mean and degrees of freedom follow from
    mean and variance of their logarithms. Noise of another source is left as it is.
    """
    freedom = np.array([one.freedom for one in noises])
    variance = np.array([one.sd**2 for one in noises])
    at_rest = freedom > 0
    if at_rest.sum() < 2:
        return list(noises)
    n, s2 = freedom[at_rest], variance[at_rest]
    scatter = np.var(np.log(s2), ddof=1) - np.mean(polygamma(1, n / 2))
    if scatter <= 0:
        drawn = np.full(n.size, n @ s2 / n.sum())
    else:
        # The inverse of the trigamma function, from its first two terms at a large argument.
        prior_freedom = (1 + np.sqrt(1 + 2 * scatter)) / scatter
        of_logarithm = np.mean(np.log(s2) - polygamma(0, n / 2) + np.log(n / 2))
        prior = np.exp(of_logarithm + polygamma(0, prior_freedom / 2) - np.log(prior_freedom / 2))
        drawn = (prior_freedom * prior + n * s2) / (prior_freedom + n)
    variance[at_rest] = drawn
    return [replace(one, sd=float(np.sqrt(v))) for one, v in zip(noises, variance, strict=True)]


def repeated(prior: SensorNoise, variance: float | None, cycles: float) -> SensorNoise:
    """Noise from a prior and the variance between so many consecutive cycles.

    A channel may repeat less well in motion than at rest, and never better. A rest that scatters far more than cycles
    do is no rest.
    """
    if variance is not None and prior.source == "rest" and prior.sd**2 > RESTLESS**2 * variance:
        return SensorNoise(max(float(np.sqrt(variance)), prior.least), "cycles")
    if variance is None or variance <= prior.sd**2:
        return prior
    freedom = IN_DIAGNOSIS * cycles
    square = (REST_FREEDOM * prior.sd**2 + freedom * variance) / (REST_FREEDOM + freedom)
    return SensorNoise(float(np.sqrt(square)), "cycles")


def drive_errors(given: ModelInput, parameters: Parameters, offset_is_free: bool) -> dict[str, NDArray]:
    """Draws of the error in each channel that the uncertain drive motion causes, shape (draws, n).

    The sub-count offset of the drive encoder is part of that error unless `offset_is_free`, an unknown of the fit.
    """
    simulated = simulate(given, parameters)
    deviations = given.deviations_given_offset if offset_is_free else given.drive_deviations
    aside = [simulate(replace(given, theta_in=given.theta_in + d), parameters) for d in deviations]
    return {
        c: np.array([a[c] - simulated[c] for a in aside]).reshape(-1, simulated.time_s.size) for c in simulated.channels
    }


def rounding_errors(angle_rad: NDArray, step_rad: float) -> NDArray:
    """Rounding error of an encoder over a motion, for each sub-count offset of its start; shape (phases, n), rad.

    The error lasts as long as the motion reverses or rests: it is not white noise.
    """
    counts = angle_rad / step_rad + ROUNDING_PHASES[:, None]
    return (np.round(counts) - counts) * step_rad


def size_over_time(errors: NDArray, time_s: NDArray) -> NDArray:
    """Standard deviation over a few draws at each sample, smoothed over `ALIKE_S`; shape (n,)."""
    if not errors.size:
        return np.zeros_like(time_s)
    samples = max(1, round(ALIKE_S / float(np.median(np.diff(time_s)))))
    return np.sqrt(np.maximum(uniform_filter1d((errors**2).mean(axis=0), samples), 0.0))


def _scatter(values: NDArray) -> float:
    at = np.arange(values.size)
    return float(np.std(values - np.polynomial.Polynomial.fit(at, values, 1)(at), ddof=2))
