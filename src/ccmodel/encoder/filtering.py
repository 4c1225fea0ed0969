"""Causal estimate of the motion behind an encoder's counts: sample by sample, from the counts up to each.

A Kalman filter of angle, speed and acceleration, with white jerk; a count is an interval for the angle, which assumed
density filtering turns into a mean and a variance. How strongly a drive jerks is not known beforehand: filters with
several intensities run side by side, and each counts by how well it has predicted the latest counts.
"""

from math import exp

import numpy as np
from numpy.typing import NDArray

from ccmodel.encoder.expectation_propagation import EDGE_SD, truncated_moments
from ccmodel.kernel import kernel

# Intensities of white jerk, counts^2 / step^5: from slow sines that pass a count in hundreds of samples to drives that
# turn within a few.
INTENSITIES = 10.0 ** np.arange(-13.0, 0.0, 3.0)
# Variance of a count's position before any motion, counts^2: uniform.
UNIFORM_VARIANCE = 1.0 / 12.0
# A prediction counts less by 1/e after so many samples.
MEMORY_SAMPLES = 100.0


@kernel(allocates=True)
def filter_counts(steps: NDArray, counts: NDArray, intensities: NDArray, mean: NDArray, variance: NDArray) -> None:
    """Write mean and variance of the angle, counts and counts^2, at each sample.

    Parameters
    ----------
    steps : ndarray, shape (n,)
        Time since the sample before, in any unit of which `intensities` are; the first is not used.
    counts : ndarray, shape (n,)
        Middle of each sample's count.
    intensities : ndarray, shape (filters,)
    mean, variance : ndarray, shape (n,)
        Results. The motion starts from rest or from motion at the first count, with zero speed.
    """
    filters = intensities.size
    x, P, predicted = np.zeros((filters, 3)), np.zeros((filters, 3, 3)), np.empty((3, 3))
    score, z = np.zeros(filters), np.empty(2)
    for f in range(filters):
        x[f, 0], P[f, 0, 0] = counts[0], UNIFORM_VARIANCE
    mean[0], variance[0] = counts[0], UNIFORM_VARIANCE
    for i in range(1, counts.size):
        dt = steps[i]
        keep = exp(-dt / MEMORY_SAMPLES)
        best = -np.inf
        for f in range(filters):
            q, S = intensities[f], P[f]
            x[f, 0] += dt * (x[f, 1] + 0.5 * dt * x[f, 2])
            x[f, 1] += dt * x[f, 2]
            # F P F' + Q of a triple integrator.
            h = 0.5 * dt * dt
            for k in range(3):
                predicted[0, k] = S[0, k] + dt * S[1, k] + h * S[2, k]
                predicted[1, k] = S[1, k] + dt * S[2, k]
                predicted[2, k] = S[2, k]
            for k in range(3):
                S[k, 0] = predicted[k, 0] + dt * predicted[k, 1] + h * predicted[k, 2]
                S[k, 1] = predicted[k, 1] + dt * predicted[k, 2]
                S[k, 2] = predicted[k, 2]
            S[0, 0] += q * dt**5 / 20.0
            S[0, 1] += q * dt**4 / 8.0
            S[1, 0] += q * dt**4 / 8.0
            S[0, 2] += q * dt**3 / 6.0
            S[2, 0] += q * dt**3 / 6.0
            S[1, 1] += q * dt**3 / 3.0
            S[1, 2] += q * dt * dt / 2.0
            S[2, 1] += q * dt * dt / 2.0
            S[2, 2] += q * dt
            total = S[0, 0] + EDGE_SD**2
            z[0], z[1], log_mass = truncated_moments(x[f, 0], total, counts[i] - 0.5, counts[i] + 0.5)
            shift, kept = (z[0] - x[f, 0]) / total, (1.0 - z[1] / total) / total
            for k in range(3):
                predicted[0, k] = S[k, 0]
            for k in range(3):
                x[f, k] += predicted[0, k] * shift
                for m in range(3):
                    S[k, m] -= predicted[0, k] * predicted[0, m] * kept
            score[f] = keep * score[f] + log_mass
            best = max(best, score[f])
        total, first, second = 0.0, 0.0, 0.0
        for f in range(filters):
            weight = exp(score[f] - best)
            total += weight
            first += weight * x[f, 0]
            second += weight * (P[f, 0, 0] + x[f, 0] ** 2)
        mean[i] = first / total
        variance[i] = max(second / total - mean[i] ** 2, 0.0)


def causal_motion(time_s: NDArray, theta_counts_rad: NDArray, step_rad: float) -> tuple[NDArray, NDArray]:
    """Angle behind its counts, and its standard deviation, each from the counts up to the same sample; rad.

    Parameters
    ----------
    time_s, theta_counts_rad : ndarray, shape (n,)
        Sample times, s, and the angle as counted, rad.
    step_rad : float
        Angle of a count.

    Returns
    -------
    theta_rad, sigma_rad : ndarray, shape (n,)
    """
    counts = (theta_counts_rad - theta_counts_rad[0]) / step_rad
    mean, variance = np.empty(counts.size), np.empty(counts.size)
    # The unit of time is the first step: a median over all would look ahead.
    steps = np.diff(time_s, prepend=time_s[0]) / (time_s[1] - time_s[0] if time_s.size > 1 else 1.0)
    filter_counts(steps, counts, INTENSITIES, mean, variance)
    return theta_counts_rad[0] + step_rad * mean, step_rad * np.sqrt(variance)
