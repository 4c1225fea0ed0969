"""Intervals of linear functions of a candidate's unknowns, such as the values of a learned law at its knots."""

import numpy as np
from numpy.typing import NDArray

from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.distributions import normal_quantile, student_quantile
from ccmodel.inference.cross_validation import inverse_of, jackknife
from ccmodel.inference.effective_samples import mean_weight, of_recording
from ccmodel.inference.intervals import COVERAGE


def half_widths_of(candidate: CandidateFit, functions: NDArray) -> NDArray:
    """Half-widths of the 90 % intervals of linear functions of a candidate's unknowns.

    Each is the wider of two: that of the jackknife over recordings, and that of the information of all recordings at
    the effective sample size, with what the model misses: the jackknife does not see what all recordings have alike.
    Intervals of the unknowns do not give them: over few recordings, the jackknife's correlations of many unknowns are
    chance.

    Parameters
    ----------
    candidate : CandidateFit
    functions : ndarray, shape (functions, unknowns)
        Coefficients of each function.

    Returns
    -------
    ndarray, shape (functions,)
    """
    by_information = functions @ covariance_with_misfit(candidate) @ functions.T
    reach = normal_quantile(0.5 + COVERAGE / 2) * np.sqrt(np.diag(by_information).clip(0.0))
    if len(candidate.whitened) == 1:
        return reach
    information, sizes, total = candidate.information, candidate.sizes, candidate.total_information
    without = [inverse_of(total - one, sizes) for one in information]
    joint = np.array(list(candidate.values.values()))
    moved = np.array([[values[name] for name in candidate.values] for values in candidate.loo_values]) - joint
    covariance, degrees = jackknife(moved, information, inverse_of(total, sizes), without, functions)
    return np.maximum(reach, student_quantile(0.5 + COVERAGE / 2, degrees) * np.sqrt(np.diag(covariance).clip(0.0)))


def covariance_by_information(candidate: CandidateFit) -> NDArray:
    """Covariance of all unknowns by the information of all recordings at the effective sample size, and the priors'."""
    count = [of_recording(w.observations) for w in candidate.whitened]
    information = sum(n * one for n, one in zip(count, candidate.information, strict=True))
    return inverse_of(information + np.mean(count) * np.diag(candidate.prior_precision**2), candidate.sizes)


def covariance_with_misfit(candidate: CandidateFit) -> NDArray:
    """The same with what the model misses: of each channel, its mean square above that of noise.

    A model misses alike what recordings have alike, and such errors do not average out over recordings: by the
    Cauchy-Schwarz inequality, the variance of a sum is at most that of its terms times their number. The covariance
    about these scores is White's (Econometrica 48(4), 817-838, 1980, doi:10.2307/1912934).
    """
    by_information = covariance_by_information(candidate)
    scores = np.zeros_like(by_information)
    for w, J in zip(candidate.whitened, candidate.jacobian, strict=True):
        channels = w.observations.channels
        missed = np.sqrt([max(candidate.by_channel[channel] - 1.0, 0.0) for channel in channels])
        D = np.repeat(missed, w.measured.size // len(channels))[:, None] * J[: w.measured.size]
        scores += of_recording(w.observations) * mean_weight(w.observations) * D.T @ D
    return by_information + len(candidate.whitened) * by_information @ scores @ by_information
