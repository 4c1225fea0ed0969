"""How sure fitted values are: intervals, what is not determined, and two checks that ask no linear theory.

An unknown that belongs to each recording (its friction, its zeros) is fitted with an expectation of how far it lies
from the population's; that scatter from recording to recording governs the intervals, since thirty thousand samples
of one run are not thirty thousand experiments. What the sensors' noise and the drive's unknown part add is worked out
from the residuals as they are, correlated in time.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve
from scipy.stats import chi2, norm

if TYPE_CHECKING:
    from ccmodel.identify.problem import Problem

COVERAGE = 0.90
# Residuals further apart in time than this share of a recording are taken to know nothing of each other.
CORRELATED_SHARE = 0.05
# A direction among the unknowns whose standard deviation exceeds the unknowns' own size is not determined.
UNDETERMINED_SD = 1.0
# Part that an unknown must have in such a direction to be called undetermined by it.
INVOLVED = 0.2
# Scatter from recording to recording that is less likely than this, were it what is expected, widens the intervals.
UNLIKELY_SCATTER = 0.01


@dataclass(frozen=True)
class Interval:
    """A 90 % interval and the standard deviation behind it, in the unknown's unit."""

    low: float
    high: float
    sd: float


@dataclass(frozen=True)
class Undetermined:
    """Unknowns that the recordings do not tell apart.

    Attributes
    ----------
    parameters : list of str
    determined : str
        The combination of their relative changes that is determined; empty where none is.
    """

    parameters: list[str]
    determined: str


@dataclass(frozen=True)
class Part:
    """One recording's say on the shared unknowns, its own unknowns taken out.

    Attributes
    ----------
    information : ndarray, shape (shared, shared)
    score : ndarray, shape (shared,)
        Gradient of half the sum of squares.
    noise : ndarray, shape (shared, shared)
        Covariance of the score by the noise in this recording, as its residuals show it, and by the expected scatter.
    """

    information: NDArray
    score: NDArray
    noise: NDArray


def parts(problem: "Problem", residuals: NDArray, jacobian: NDArray) -> list[Part]:
    """Every recording's say, in the order of the problem's evidence."""
    shared = len(problem.shared)
    found = []
    for i, (data, expected) in enumerate(problem.rows):
        at = np.r_[data, expected]
        A, B, r = jacobian[at, :shared], jacobian[at][:, problem.own_columns(i)], residuals[at]
        if B.shape[1]:
            Q, _ = np.linalg.qr(B)
            A, r = A - Q @ (Q.T @ A), r - Q @ (Q.T @ r)
        samples = problem.evidence[i].measured.shape
        rows = A[: data.size].reshape(*samples, shared), r[: data.size].reshape(samples)
        noise = sum(_correlated(a, e) for a, e in zip(*rows, strict=True))
        own = A[data.size :]
        found.append(Part(A.T @ A, A.T @ r, noise + own.T @ own))
    return found


def intervals(problem: "Problem", x: NDArray, residuals: NDArray, jacobian: NDArray) -> dict[str, Interval]:
    """The 90 % interval of each shared unknown at the optimum; unbounded where the recordings say nothing."""
    said = parts(problem, residuals, jacobian)
    covariance = _covariance(said, len(problem.shared)) * scatter_scale(problem, x) ** 2
    reach = norm.ppf(0.5 + COVERAGE / 2)
    found = {}
    for k, name in enumerate(problem.shared):
        sd = float(np.sqrt(covariance[k, k]))
        found[name] = Interval(float(x[k] - reach * sd), float(x[k] + reach * sd), sd)
    return found


def _covariance(said: list[Part], shared: int) -> NDArray:
    inverse = np.linalg.pinv(sum((p.information for p in said), np.zeros((shared, shared))), rcond=1e-14)
    return inverse @ sum(p.noise for p in said) @ inverse


def _correlated(sensitivity: NDArray, residual: NDArray) -> NDArray:
    """Sum over pairs of samples of sensitivity x covariance of the residuals x sensitivity; shape (shared, shared)."""
    n = residual.size
    lags = max(1, int(CORRELATED_SHARE * n))
    own = fftconvolve(residual, residual[::-1])[n - 1 : n + lags] / n
    taper = own * (1 - np.arange(lags + 1) / (lags + 1))
    kernel = np.concatenate([taper[:0:-1], taper])
    smeared = fftconvolve(sensitivity, kernel[:, None], mode="same", axes=0)
    found = sensitivity.T @ smeared
    # A covariance by its make, less what rounding and the window's ends do to it.
    value, vector = np.linalg.eigh((found + found.T) / 2)
    return (vector * np.maximum(value, 0.0)) @ vector.T


def scatter_scale(problem: "Problem", x: NDArray) -> float:
    """How many times the expected scatter the recordings' own values scatter; 1 unless chance does not explain it."""
    worst, n = 1.0, len(problem.evidence)
    for name, free in problem.own.items():
        if free.spread is None or n < 2:
            continue
        own = np.array([problem.values_of(x, i)[name] for i in range(n)])
        square = float(((own - free.start) ** 2).sum() / free.spread**2)
        if chi2.sf(square, n) < UNLIKELY_SCATTER:
            worst = max(worst, np.sqrt(square / n))
    return worst


def undetermined(problem: "Problem", residuals: NDArray, jacobian: NDArray) -> list[Undetermined]:
    """Groups of shared unknowns that the recordings do not tell apart."""
    shared = len(problem.shared)
    if not shared:
        return []
    sizes = problem.sizes[:shared]
    information = sum(p.information for p in parts(problem, residuals, jacobian)) * np.outer(sizes, sizes)
    value, vector = np.linalg.eigh(information)
    names = np.array(list(problem.shared))
    found = []
    for k in np.flatnonzero(value < 1 / UNDETERMINED_SD**2):
        involved = np.flatnonzero(np.abs(vector[:, k]) > INVOLVED)
        known = ""
        if involved.size == 2:
            # Across the direction that is not known lies the one that is.
            first, second = involved
            share = -vector[first, k] / vector[second, k]
            known = f"d {names[first]} / {sizes[first]:.3g} {share:+.2f} d {names[second]} / {sizes[second]:.3g}"
        found.append(Undetermined(names[involved].tolist(), known))
    return found


def bootstrap(said: list[Part], draws: int, seed: int) -> NDArray:
    """Standard deviation of each shared unknown over resampled sets of recordings, shape (shared,).

    One step of Newton's method from the optimum stands for each refit. A check of `intervals`: it knows of no
    expected scatter, only of what the recordings did, and wants half a dozen of them.
    """
    random = np.random.default_rng(seed)
    steps = []
    for _ in range(draws):
        drawn = [said[i] for i in random.integers(len(said), size=len(said))]
        information = sum(p.information for p in drawn)
        steps.append(-np.linalg.pinv(information, rcond=1e-14) @ sum(p.score for p in drawn))
    return np.std(steps, axis=0, ddof=1)
