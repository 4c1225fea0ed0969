"""Intervals of linear functions of a candidate's unknowns, such as the values of a learned law at its knots."""

import numpy as np
from numpy.typing import NDArray

from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.distributions import normal_quantile, student_quantile
from ccmodel.inference.cross_validation import inverse_of, jackknife
from ccmodel.inference.effective_samples import of_recording
from ccmodel.inference.intervals import COVERAGE


def half_widths_of(candidate: CandidateFit, functions: NDArray) -> NDArray:
    """Half-widths of the 90 % intervals of linear functions of a candidate's unknowns.

    Each is the wider of two: that of the jackknife over recordings, and that of the information of all recordings at
    the effective sample size. Intervals of the unknowns do not give them: over few recordings, the jackknife's
    correlations of many unknowns are chance.

    Parameters
    ----------
    candidate : CandidateFit
    functions : ndarray, shape (functions, unknowns)
        Coefficients of each function.

    Returns
    -------
    ndarray, shape (functions,)
    """
    by_information = functions @ covariance_by_information(candidate) @ functions.T
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
