"""Expectation propagation for Gaussian curves under interval-censored observations: compiled kernels.

Each interval is replaced by a Gaussian factor (a site) that gives the same mean and variance as the interval itself
does together with all other factors (the cavity): Minka 2001, "Expectation propagation for approximate Bayesian
inference"; with the notation of Rasmussen and Williams 2006, "Gaussian processes for machine learning", section 3.6. A
site is stored as its precision and its shift, which is precision times mean. An interval is log-concave, so the
posterior is too, and the sweeps converge.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel

# Standard deviation of an encoder's edges, counts. It blurs the ends of every interval.
EDGE_SD = 0.02
# Share of the correction of a site that a sweep applies. The full correction oscillates where many intervals agree.
DAMPING = 0.7


@kernel
def truncated_moments(mean: float, variance: float, low: float, high: float) -> tuple[float, float, float]:
    """Mean, variance and log of the mass of a normal distribution between `low` and `high`."""
    sd = math.sqrt(variance)
    a, b, side = (low - mean) / sd, (high - mean) / sd, 1.0
    if a + b < 0:  # Mirror the interval into the upper tail, where differences of `erfc` stay accurate.
        a, b, side = -b, -a, -1.0
    mass = 0.5 * (math.erfc(a / math.sqrt(2.0)) - math.erfc(b / math.sqrt(2.0)))
    if a > 6 or mass < 1e-12:  # Far in the tail the density is exponential from `a` on, cut at `b`.
        a = max(a, 1e-3)
        cut = math.exp(-min(a * (b - a), 700.0))
        tail = (b - a) * cut / max(1 - cut, 1e-300)
        shift = min(1 / a - tail, 0.5 * (b - a))
        spread = max(1 / a**2 - tail * (b - a) / max(1 - cut, 1e-300), 1e-6 / a**2)
        return mean + side * sd * (a + shift), variance * min(spread, 1.0), -0.5 * a * a - math.log(2.5 * a)
    at_a, at_b = 0.3989422804014327 * math.exp(-0.5 * a * a), 0.3989422804014327 * math.exp(-0.5 * b * b)
    shift = (at_a - at_b) / mass
    spread = max(1 + (a * at_a - b * at_b) / mass - shift * shift, 1e-9)
    return mean + side * sd * shift, variance * spread, math.log(mass)


@kernel
def matched_site(
    mean: float, variance: float, precision: float, shift: float, low: float, high: float
) -> tuple[float, float, float, float]:
    """Site of one interval by moment matching.

    Parameters
    ----------
    mean, variance : float
        Present posterior of the sample, with the site.
    precision, shift : float
        Present site: exp(-precision x^2 / 2 + shift x).
    low, high : float
        The interval.

    Returns
    -------
    precision, shift : float
        Site with which the cavity has the mean and variance that it has with the interval.
    log_mass : float
        Log of the probability of the interval under the cavity.
    log_scale : float
        Log of the scale of the present site in the marginal likelihood.
    """
    cavity_precision = max(1 / variance - precision, 1e-12)
    cavity_mean, cavity_variance = (mean / variance - shift) / cavity_precision, 1 / cavity_precision
    blurred_variance = cavity_variance + EDGE_SD**2
    blurred_mean, blurred_tilted, log_mass = truncated_moments(cavity_mean, blurred_variance, low, high)
    gain = cavity_variance / blurred_variance
    tilted_mean = cavity_mean + gain * (blurred_mean - cavity_mean)
    tilted_variance = cavity_variance - gain * gain * (blurred_variance - blurred_tilted)
    new = max(1 / tilted_variance - cavity_precision, 0.0)
    new_shift = tilted_mean / tilted_variance - cavity_mean * cavity_precision if new > 0 else 0.0
    linear = cavity_mean * cavity_precision + shift
    exponent = linear**2 / (cavity_precision + precision) - cavity_mean * cavity_mean * cavity_precision
    log_scale = log_mass + 0.5 * math.log(1 + precision * cavity_variance) - 0.5 * exponent
    return new, new_shift, log_mass, log_scale


@kernel(allocates=True)
def banded_cholesky(stencil: tuple[float, ...], weight: NDArray, coupling: NDArray, precision: NDArray) -> NDArray:
    """Cholesky factor of the banded precision matrix of a curve; entry [i, k] is L[i, i - k].

    Parameters are those of `sweep`. `stencil` is a tuple, so that the compiler knows its length and unrolls the inner
    loops.
    """
    order, n = len(stencil) - 1, precision.size
    A = np.zeros((n, order + 1))
    A[:, 0] = precision
    for row in range(n - order):
        for a in range(order + 1):
            for b in range(a + 1):
                A[row + a, a - b] += weight[row] * stencil[a] * stencil[b]
    for i in range(n - 1):
        A[i, 0] += coupling[i]
        A[i + 1, 0] += coupling[i]
        A[i + 1, 1] -= coupling[i]
    for i in range(n):
        for k in range(min(order, i), -1, -1):
            s = A[i, k]
            for r in range(k + 1, min(order, i) + 1):
                s -= A[i, r] * A[i - k, r - k]
            A[i, k] = s / A[i - k, 0] if k > 0 else math.sqrt(s)
    return A


@kernel
def solve_transposed(L: NDArray, x: NDArray) -> None:
    """Solve L^T y = x in place; y has the posterior covariance if x is white noise of unit variance."""
    order, n = L.shape[1] - 1, x.size
    for i in range(n - 1, -1, -1):
        for k in range(1, min(order, n - 1 - i) + 1):
            x[i] -= L[i + k, k] * x[i + k]
        x[i] /= L[i, 0]


@kernel
def solve(L: NDArray, x: NDArray) -> None:
    """Solve L L^T y = x in place."""
    order = L.shape[1] - 1
    for i in range(x.size):
        for k in range(1, min(order, i) + 1):
            x[i] -= L[i, k] * x[i - k]
        x[i] /= L[i, 0]
    solve_transposed(L, x)


@kernel(allocates=True)
def banded_covariance(L: NDArray, stencil: tuple[float, ...]) -> NDArray:
    """Covariances of samples at most `order` apart; entry [i, k] is that of samples i and i - k.

    Takahashi's recursion: Takahashi, Fagan and Chen 1973, "Formation of a sparse bus impedance matrix".
    """
    order, n = len(stencil) - 1, L.shape[0]
    S = np.zeros((n, order + 1))
    for i in range(n - 1, -1, -1):
        reach = min(order, n - 1 - i)
        for k in range(reach, -1, -1):
            s = 0.0
            for r in range(1, reach + 1):
                s -= L[i + r, r] * (S[i + max(k, r), abs(k - r)] if k > 0 else S[i + r, r])
            S[i + k, k] = s / L[i, 0] if k > 0 else (s + 1 / L[i, 0]) / L[i, 0]
    return S


@kernel(allocates=True)
def sweep(
    stencil: tuple[float, ...],
    weight: NDArray,
    coupling: NDArray,
    low: NDArray,
    high: NDArray,
    observed: NDArray,
    precision: NDArray,
    shift: NDArray,
) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray, float]:
    """Compute the posterior of a curve and correct the site of every interval, in place.

    Parameters
    ----------
    stencil : tuple of float, length order + 1
        Finite difference with a Gaussian prior about 0.
    weight : ndarray, shape (n - order,)
        Prior precision of each difference.
    coupling : ndarray, shape (n,)
        Precision of the difference between a sample and the next, for samples of a rest; else 0.
    low, high : ndarray, shape (n,)
        The intervals.
    observed : ndarray of bool, shape (n,)
        Samples with an interval.
    precision, shift : ndarray, shape (n,)
        Sites, corrected here where `observed`.

    Returns
    -------
    mean, variance : ndarray, shape (n,)
        Posterior of the samples.
    L : ndarray, shape (n, order + 1)
        Cholesky factor of the posterior precision.
    difference, difference_variance : ndarray, shape (n - order,)
        Posterior of the differences.
    log_predictive : float
        Sum over intervals of the log of the probability of each under all others.
    """
    order, n = len(stencil) - 1, low.size
    L = banded_cholesky(stencil, weight, coupling, precision)
    mean = shift.copy()
    solve(L, mean)
    S = banded_covariance(L, stencil)
    log_predictive = 0.0
    for i in range(n):
        if observed[i]:
            new, new_shift, log_mass, _ = matched_site(mean[i], S[i, 0], precision[i], shift[i], low[i], high[i])
            precision[i] += DAMPING * (new - precision[i])
            shift[i] += DAMPING * (new_shift - shift[i])
            log_predictive += log_mass
    difference, difference_variance = np.zeros(n - order), np.zeros(n - order)
    for row in range(n - order):
        for a in range(order + 1):
            difference[row] += stencil[a] * mean[row + a]
            difference_variance[row] += stencil[a] ** 2 * S[row + a, 0]
            for b in range(a):
                difference_variance[row] += 2 * stencil[a] * stencil[b] * S[row + a, a - b]
    return mean, S[:, 0].copy(), L, difference, difference_variance, log_predictive


@kernel(allocates=True)
def fit_basis(basis: NDArray, prior: NDArray, low: NDArray, high: NDArray, sweeps: int) -> tuple[float, float, float]:
    """Bayesian linear regression on interval-censored observations.

    Parameters
    ----------
    basis : ndarray, shape (n, d)
        Basis functions at the observations.
    prior : ndarray, shape (d,)
        Prior precision of each coefficient about 0.
    low, high : ndarray, shape (n,)
        The intervals.
    sweeps : int
        Number of sweeps over all sites.

    Returns
    -------
    log_evidence : float
        Log of the marginal likelihood.
    mean, variance : float
        Posterior of the first coefficient.
    """
    n, d = basis.shape
    precision, shift = np.full(n, 1.0), (low + high) / 2
    log_evidence, mean, covariance = 0.0, np.zeros(d), np.zeros((d, d))
    for _ in range(sweeps):
        covariance = np.linalg.inv(np.diag(prior) + (basis.T * precision) @ basis)
        mean = covariance @ (basis.T @ shift)
        log_evidence = 0.5 * (math.log(np.linalg.det(covariance)) + np.log(prior).sum())
        for i in range(n):
            value, variance = 0.0, 0.0
            for a in range(d):
                value += basis[i, a] * mean[a]
                for b in range(d):
                    variance += basis[i, a] * covariance[a, b] * basis[i, b]
            new, new_shift, _, log_scale = matched_site(value, variance, precision[i], shift[i], low[i], high[i])
            log_evidence += log_scale + 0.5 * shift[i] * value
            precision[i] += DAMPING * (new - precision[i])
            shift[i] += DAMPING * (new_shift - shift[i])
    return log_evidence, mean[0], covariance[0, 0]
