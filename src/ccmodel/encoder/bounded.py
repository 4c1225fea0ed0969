"""Curves that are known only to lie between bounds: Gaussian estimates by expectation propagation, compiled.

A bound is taken for the normal distribution that has the same mean and variance beside everything else that is known
(expectation propagation, Minka 2001); with bounds the posterior is convex and the rounds settle.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

# How far beyond a bound an angle may lie, in counts: no encoder's edges are sharper.
SOFTNESS = 0.02
# Part of a round's correction that is made: all of it swings where many bounds say the same.
DAMPING = 0.7
# Precision of a bound before the first round: that of a uniform distribution over one count.
UNIFORM = 12.0
# Weight that holds neighbouring samples of a rest together, against 12 of a bound.
TIE = 1e9


@njit(cache=True)
def truncated(mean, variance, low, high):
    """Mean, variance and log of the mass of a normal distribution within bounds."""
    sd = math.sqrt(variance)
    a, b, side = (low - mean) / sd, (high - mean) / sd, 1.0
    if a + b < 0:  # Mirrored, so that the bounds lie in the upper tail, where differences stay accurate.
        a, b, side = -b, -a, -1.0
    mass = 0.5 * (math.erfc(a / math.sqrt(2.0)) - math.erfc(b / math.sqrt(2.0)))
    if a > 6 or mass < 1e-12:  # An exponential distribution from `a` on, cut at `b`.
        a = max(a, 1e-3)
        cut = math.exp(-min(a * (b - a), 700.0))
        rest = (b - a) * cut / max(1 - cut, 1e-300)
        shift = min(1 / a - rest, 0.5 * (b - a))
        spread = max(1 / a**2 - rest * (b - a) / max(1 - cut, 1e-300), 1e-6 / a**2)
        return mean + side * sd * (a + shift), variance * min(spread, 1.0), -0.5 * a * a - math.log(2.5 * a)
    at_a, at_b = 0.3989422804014327 * math.exp(-0.5 * a * a), 0.3989422804014327 * math.exp(-0.5 * b * b)
    shift = (at_a - at_b) / mass
    spread = max(1 + (a * at_a - b * at_b) / mass - shift * shift, 1e-9)
    return mean + side * sd * shift, variance * spread, math.log(mass)


@njit(cache=True)
def matched(mean, variance, precision, pull, low, high):
    """The bound at one sample as a normal factor that fits beside everything else.

    Parameters
    ----------
    mean, variance : float
        What is known of the sample, the bound's present factor included.
    precision, pull : float
        Present factor: exp(-precision x^2 / 2 + pull x).
    low, high : float
        The bounds.

    Returns
    -------
    precision, pull : float
        The factor that gives the mean and variance that the true bound gives.
    likelihood : float
        Log of the probability that the rest of the data give to the bounds.
    scale : float
        Log of the factor's scale, for the evidence.
    """
    rest = max(1 / variance - precision, 1e-12)
    before, spread = (mean / variance - pull) / rest, 1 / rest
    seen = spread + SOFTNESS**2
    middle, width, likelihood = truncated(before, seen, low, high)
    gain = spread / seen
    after, left = before + gain * (middle - before), spread - gain * gain * (seen - width)
    new = max(1 / left - rest, 0.0)
    new_pull = after / left - before * rest if new > 0 else 0.0
    scale = (
        likelihood
        + 0.5 * math.log(1 + precision * spread)
        - 0.5 * ((before * rest + pull) ** 2 / (rest + precision) - before * before * rest)
    )
    return new, new_pull, likelihood, scale


@njit(cache=True)
def factored(difference, weight, tie, precision):
    """Cholesky factor of the banded precision matrix of a curve; entry [i, k] is L[i, i - k].

    `difference` is a tuple, so that its length is known to the compiler and the inner loops unroll.
    """
    order, n = len(difference) - 1, precision.size
    A = np.zeros((n, order + 1))
    A[:, 0] = precision
    for row in range(n - order):
        for a in range(order + 1):
            for b in range(a + 1):
                A[row + a, a - b] += weight[row] * difference[a] * difference[b]
    for i in range(n - 1):
        A[i, 0] += tie[i]
        A[i + 1, 0] += tie[i]
        A[i + 1, 1] -= tie[i]
    for i in range(n):
        for k in range(min(order, i), -1, -1):
            s = A[i, k]
            for r in range(k + 1, min(order, i) + 1):
                s -= A[i, r] * A[i - k, r - k]
            A[i, k] = s / A[i - k, 0] if k > 0 else math.sqrt(s)
    return A


@njit(cache=True)
def solved_upper(L, x):
    """Solution of L^T y = x, in place: turns white noise into a curve's deviation."""
    order, n = L.shape[1] - 1, x.size
    for i in range(n - 1, -1, -1):
        for k in range(1, min(order, n - 1 - i) + 1):
            x[i] -= L[i + k, k] * x[i + k]
        x[i] /= L[i, 0]


@njit(cache=True)
def solved(L, x):
    """Solution of L L^T y = x, in place."""
    order = L.shape[1] - 1
    for i in range(x.size):
        for k in range(1, min(order, i) + 1):
            x[i] -= L[i, k] * x[i - k]
        x[i] /= L[i, 0]
    solved_upper(L, x)


@njit(cache=True)
def covariances(L, difference):
    """Covariances of samples at most `order` apart (Takahashi); entry [i, k] is that of i and i - k."""
    order, n = len(difference) - 1, L.shape[0]
    S = np.zeros((n, order + 1))
    for i in range(n - 1, -1, -1):
        reach = min(order, n - 1 - i)
        for k in range(reach, -1, -1):
            s = 0.0
            for r in range(1, reach + 1):
                s -= L[i + r, r] * (S[i + max(k, r), abs(k - r)] if k > 0 else S[i + r, r])
            S[i + k, k] = s / L[i, 0] if k > 0 else (s + 1 / L[i, 0]) / L[i, 0]
    return S


@njit(cache=True)
def one_round(difference, weight, tie, low, high, bounded, precision, pull):
    """Estimate a curve and correct the factor of every bound, in place.

    Parameters
    ----------
    difference : tuple of float
        Weights of the difference that the prior holds small.
    weight : ndarray, shape (n - order,)
        Precision of that difference, at each of its places.
    tie : ndarray, shape (n,)
        Weight that holds a sample and the next together.
    low, high : ndarray, shape (n,)
        The bounds.
    bounded : ndarray of bool, shape (n,)
        Where they count.
    precision, pull : ndarray, shape (n,)
        Factors, corrected here where `bounded`.

    Returns
    -------
    mean, variance : ndarray, shape (n,)
    L : ndarray, shape (n, order + 1)
        Factor of the precision matrix.
    kick, blur : ndarray, shape (n - order,)
        Estimate and variance of the difference.
    likelihood : float
        Sum over bounds of the log of the probability that all other bounds give to it.
    """
    order, n = len(difference) - 1, low.size
    L = factored(difference, weight, tie, precision)
    mean = pull.copy()
    solved(L, mean)
    S = covariances(L, difference)
    likelihood = 0.0
    for i in range(n):
        if bounded[i]:
            new, new_pull, log_mass, _ = matched(mean[i], S[i, 0], precision[i], pull[i], low[i], high[i])
            precision[i] += DAMPING * (new - precision[i])
            pull[i] += DAMPING * (new_pull - pull[i])
            likelihood += log_mass
    kick, blur = np.zeros(n - order), np.zeros(n - order)
    for row in range(n - order):
        for a in range(order + 1):
            kick[row] += difference[a] * mean[row + a]
            blur[row] += difference[a] ** 2 * S[row + a, 0]
            for b in range(a):
                blur[row] += 2 * difference[a] * difference[b] * S[row + a, a - b]
    return mean, S[:, 0].copy(), L, kick, blur, likelihood


@njit(cache=True)
def fitted(basis, prior, low, high, rounds):
    """Weights of a few basis curves of which only bounds are known.

    Parameters
    ----------
    basis : ndarray, shape (n, d)
    prior : ndarray, shape (d,)
        Precision of each weight about 0.
    low, high : ndarray, shape (n,)
        The bounds.
    rounds : int

    Returns
    -------
    evidence : float
        Log of the probability of the bounds.
    mean, variance : float
        Of the first weight.
    """
    n, d = basis.shape
    precision, pull = np.full(n, 1.0), (low + high) / 2
    evidence, mean, cov = 0.0, np.zeros(d), np.zeros((d, d))
    for _ in range(rounds):
        cov = np.linalg.inv(np.diag(prior) + (basis.T * precision) @ basis)
        mean = cov @ (basis.T @ pull)
        evidence = 0.5 * (math.log(np.linalg.det(cov)) + np.log(prior).sum())
        for i in range(n):
            at, spread = 0.0, 0.0
            for a in range(d):
                at += basis[i, a] * mean[a]
                for b in range(d):
                    spread += basis[i, a] * cov[a, b] * basis[i, b]
            new, new_pull, _, scale = matched(at, spread, precision[i], pull[i], low[i], high[i])
            evidence += scale + 0.5 * pull[i] * at
            precision[i] += DAMPING * (new - precision[i])
            pull[i] += DAMPING * (new_pull - pull[i])
    return evidence, mean[0], cov[0, 0]


def start(low: NDArray, high: NDArray, bounded: NDArray) -> tuple[NDArray, NDArray]:
    """Factors before the first round."""
    precision = np.where(bounded, UNIFORM, 0.0)
    return precision, np.where(bounded, UNIFORM * (low + high) / 2, 0.0)
