"""The update of the load law's misfit by one torque: a Kalman filter of one state that considers lasting errors."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel, small_kernel

# Rows of a trace, shape (5, n): misfit f of the load's law (N m); drive torque (N m) that the model expects, and its
# derivative by f; gain; growth of the variance of f since the sample before (N^2 m^2).
MISFIT, EXPECTED, BY_MISFIT, GAIN, GROWTH = range(5)
TRACE_ROWS = 5


class Considered(NamedTuple):
    """Standard deviations of lasting errors that the gain allows for.

    Attributes
    ----------
    friction : float
        Of the friction, relative.
    zero : float
        Of the drive torque sensor's zero.
    """

    friction: float
    zero: float


class Drive(NamedTuple):
    """What is known at the drive.

    Attributes
    ----------
    theta_rad, torque_Nm : ndarray, shape (n,)
        Angle of the drive pulley and torque of the drive on it.
    theta_variance, torque_variance : ndarray, shape (n,)
        Variances of their noise.
    """

    theta_rad: NDArray
    torque_Nm: NDArray
    theta_variance: NDArray
    torque_variance: NDArray


class Prior(NamedTuple):
    """What is known of the load beforehand.

    Attributes
    ----------
    considered : Considered
    law_share : float
        Standard deviation of the misfit of a load's law, as a share of its torque.
    wander_N2m2_per_rad : float
        Growth of the variance of the torque of a load without a law, per turn of the drive; 0 for one with a law.
    """

    considered: Considered
    law_share: float
    wander_N2m2_per_rad: float


class Run(NamedTuple):
    """A run of the filter, or along its misfit.

    Attributes
    ----------
    trace : ndarray, shape (5, n)
    out : ndarray, shape (2, n)
        Angle of the load from the start (rad) and torque of the cables on it (N m).
    noise_variance : ndarray, shape (n,)
        Of the measured torque less the expected one: sensor and drive angle.
    """

    trace: NDArray
    out: NDArray
    noise_variance: NDArray


@small_kernel
def gain_of(variance: float, covariance: NDArray, by_misfit: float, effects: NDArray, noise_variance: float) -> float:
    """Gain of the misfit by the torque's innovation; 0 where the torque does not respond to the load."""
    if by_misfit == 0.0:
        return 0.0
    common = by_misfit * variance
    total = noise_variance
    for j in range(effects.size):
        common += effects[j] * covariance[j]
        total += effects[j] * (effects[j] + by_misfit * covariance[j])
    total += by_misfit * common
    return common / total if total > 0.0 else 1.0 / by_misfit


@small_kernel
def updated_variance(
    variance: float, covariance: NDArray, by_misfit: float, effects: NDArray, noise_variance: float, gain: float
) -> float:
    """Variance of the misfit after an update with any gain; writes its covariance with the lasting errors.

    The lasting errors have unit variance, `effects` are theirs on the torque.
    """
    kept = 1.0 - gain * by_misfit
    after = kept * kept * variance + gain * gain * noise_variance
    for j in range(effects.size):
        by_error = kept * covariance[j] - gain * effects[j]
        after -= 2.0 * kept * gain * effects[j] * covariance[j] - gain * gain * effects[j] * effects[j]
        covariance[j] = by_error
    return after


@kernel(allocates=True)
def joint_estimate(
    trace: NDArray,
    measured: NDArray,
    first_variance: float,
    noise_variance: NDArray,
    effects: NDArray,
    outputs: NDArray,
    by_misfit: NDArray,
) -> tuple[NDArray, NDArray]:
    """Kalman filter of the misfit and all lasting errors, linear about a run.

    Parameters
    ----------
    trace : ndarray, shape (5, n)
        Of the run.
    measured, noise_variance : ndarray, shape (n,)
        Drive torque, and the variance of its noise.
    first_variance : float
        Of the misfit before the first sample.
    effects : ndarray, shape (errors, n)
        Effect of one standard deviation of each lasting error on the expected torque, at the same misfit.
    outputs : ndarray, shape (errors, outputs, n)
        The same on each output.
    by_misfit : ndarray, shape (outputs, n)
        Derivatives of the outputs by a misfit that has been the same all along: a load that rests holds what it came
        to rest with.

    Returns
    -------
    correction, variance : ndarray, shape (outputs, n)
        Of each output: what is added to that of the run, and the variance that is left.
    """
    errors, kinds, n = outputs.shape
    size = errors + 1
    x, P, h, Ph = np.zeros(size), np.eye(size), np.empty(size), np.empty(size)
    P[0, 0] = first_variance
    correction, left = np.empty((kinds, n)), np.empty((kinds, n))
    for i in range(n):
        P[0, 0] += trace[GROWTH, i]
        # The run's own updates are no changes of the load.
        x[0] -= trace[MISFIT, i] - trace[MISFIT, max(i - 1, 0)]
        h[0] = trace[BY_MISFIT, i]
        innovation = measured[i] - trace[EXPECTED, i] - h[0] * x[0]
        for j in range(errors):
            h[j + 1] = effects[j, i]
            innovation -= h[j + 1] * x[j + 1]
        total = noise_variance[i]
        for j in range(size):
            Ph[j] = 0.0
            for k in range(size):
                Ph[j] += P[j, k] * h[k]
            total += h[j] * Ph[j]
        if total > 0.0:
            for j in range(size):
                x[j] += Ph[j] / total * innovation
                for k in range(size):
                    P[j, k] -= Ph[j] * Ph[k] / total
        for y in range(kinds):
            h[0] = by_misfit[y, i]
            correction[y, i] = h[0] * x[0]
            for j in range(errors):
                h[j + 1] = outputs[j, y, i]
                correction[y, i] += h[j + 1] * x[j + 1]
            left[y, i] = 0.0
            for j in range(size):
                for k in range(size):
                    left[y, i] += h[j] * P[j, k] * h[k]
    return correction, np.maximum(left, 0.0)


@kernel(allocates=True)
def variances(
    trace: NDArray,
    first_variance: float,
    noise_variance: NDArray,
    effects: NDArray,
    outputs: NDArray,
    by_misfit: NDArray,
) -> NDArray:
    """Variances of the outputs of a run that considers all lasting errors and estimates none, shape (outputs, n).

    Parameters as of `joint_estimate`.
    """
    errors, kinds, n = outputs.shape
    covariance, now = np.zeros(errors), np.empty(errors)
    variance, found = first_variance, np.empty((kinds, n))
    for i in range(n):
        for j in range(errors):
            now[j] = effects[j, i]
        variance += trace[GROWTH, i]
        variance = updated_variance(variance, covariance, trace[BY_MISFIT, i], now, noise_variance[i], trace[GAIN, i])
        for y in range(kinds):
            total = by_misfit[y, i] ** 2 * variance
            for j in range(errors):
                total += outputs[j, y, i] * (outputs[j, y, i] + 2.0 * by_misfit[y, i] * covariance[j])
            found[y, i] = max(total, 0.0)
    return found
