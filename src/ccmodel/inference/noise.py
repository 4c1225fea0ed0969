"""What a right model would leave of a recording: the sensors' noise, the encoders' steps, the drive's unknown part."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate

# A rest of fewer samples than this does not show a sensor's noise; what the rig states then stands for it.
FEWEST_AT_REST = 20
# No sensor is trusted to be better than a tenth of its stated accuracy, however still its rest looks.
BEST_SHARE = 0.1
# Time over which the scatter of a few likely drive motions is averaged.
ALIKE_S = 0.05
# Where in its count a load may be that a motion starts from: evenly over the count, which nothing tells beforehand.
PHASES = (np.arange(16) + 0.5) / 16 - 0.5


def sensor_noise(given: ModelInput) -> dict[str, float]:
    """Standard deviation of each channel's noise, in its unit.

    From the scatter about a straight line through the rest at the recording's start; from the stated accuracy where
    there is no rest to speak of. A counted angle has the deviation of its step, whatever the rest shows, and a
    channel without anything to go by a hundredth of its range.
    """
    recording, found = given.recording, {}
    for channel, values in recording.channels.items():
        if (step := recording.encoder_step_rad.get(channel)) is not None:
            found[channel] = step / np.sqrt(12)
            continue
        stated = recording.accuracy.get(channel)
        if (rest := given.resting[channel]).size >= FEWEST_AT_REST:
            best = BEST_SHARE * stated if stated else 1e-6 * max(float(np.abs(values).max()), 1e-9)
            found[channel] = max(_scatter(rest), best)
        else:
            found[channel] = stated or 0.01 * max(float(np.ptp(values)), 1e-9)
    return found


def drive_errors(given: ModelInput, parameters: Parameters, offset_is_free: bool = False) -> dict[str, NDArray]:
    """What is unknown of the drive's motion, as it shows in each channel: a few likely errors, shape (draws, n).

    Where in its count the drive first rests is part of it unless it is `placed`: an unknown of the fit.
    """
    said = simulate(given, parameters)
    deviations = given.deviations_given_offset if offset_is_free else given.drive_deviations
    aside = [simulate(replace(given, theta_in=given.theta_in + d), parameters) for d in deviations]
    return {c: np.array([a[c] - said[c] for a in aside]).reshape(-1, said.time_s.size) for c in said.channels}


def rounding_errors(angle_rad: NDArray, step_rad: float) -> NDArray:
    """What an encoder's counts may be wrong by over a motion, wherever in a count it starts; shape (phases, n), rad.

    Where the motion turns or rests, a count's error lasts: it is not the white noise that its deviation suggests.
    """
    counts = angle_rad / step_rad + PHASES[:, None]
    return (np.round(counts) - counts) * step_rad


def size_over_time(errors: NDArray, time_s: NDArray) -> NDArray:
    """Standard deviation of a few likely errors at each sample, averaged over a while; shape (n,)."""
    if not errors.size:
        return np.zeros_like(time_s)
    samples = max(1, round(ALIKE_S / float(np.median(np.diff(time_s)))))
    return np.sqrt(np.maximum(uniform_filter1d((errors**2).mean(axis=0), samples), 0.0))


def _scatter(values: NDArray) -> float:
    at = np.arange(values.size)
    return float(np.std(values - np.polynomial.Polynomial.fit(at, values, 1)(at), ddof=2))
