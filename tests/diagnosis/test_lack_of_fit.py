"""The part of residuals that recordings predict of one another."""

from dataclasses import replace

import numpy as np
import pytest

from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.lack_of_fit import lack_of_fit
from made_observations import batch


@pytest.fixture(scope="module")
def recordings():
    return batch()


def fitted(recordings, errors):
    """A candidate whose residuals are noise and, in each channel, `errors` of a recording's observations."""
    random = np.random.default_rng(1)
    residuals = []
    for k, w in enumerate(recordings):
        e = w.observations
        shape = e.measured.shape
        residuals.append((random.standard_normal(shape) + errors(k, e)).ravel())
    return CandidateFit(Hypothesis(), recordings, {}, {}, [], [], np.eye(1), np.ones(1), [], residuals)


def test_noise_is_not_predicted(recordings):
    found = lack_of_fit(fitted(recordings, lambda k, e: 0.0))
    assert found.mean < 0.02
    assert found.lower_bound < 0.01


def test_errors_that_follow_the_drive_are_predicted(recordings):
    found = lack_of_fit(fitted(recordings, lambda k, e: np.sin(4 * e.given.theta_in[e.judged])))
    assert found.lower_bound > 0.2


def test_differences_from_run_to_run_are_not_predicted(recordings):
    signs = [1, -1, 1, -1]
    found = lack_of_fit(fitted(recordings, lambda k, e: signs[k] * np.sin(4 * e.given.theta_in[e.judged])))
    assert found.lower_bound < 0.02


def test_a_single_recording_is_predicted_in_stretches(recordings):
    one = recordings[:1]
    found = lack_of_fit(fitted(one, lambda k, e: 2 * np.sin(4 * e.given.theta_in[e.judged])))
    assert found.reduction.size == 4
    assert found.mean > 0.2


def test_a_channel_may_be_missing_in_a_recording(recordings):
    lacking = [recordings[0].with_parameters(recordings[0].observations.parameters), *recordings[1:]]
    object.__setattr__(lacking[0], "observations", lacking[0].observations.without("tau_out_Nm"))
    found = lack_of_fit(fitted(lacking, lambda k, e: np.sin(4 * e.given.theta_in[e.judged])))
    assert found.lower_bound > 0.2


def test_errors_within_the_tolerance_do_not_count(recordings):
    """A tolerance of half the noise's mean square: predictable errors of that size do not count, larger ones do."""
    allowed = [replace(w, observations=_allowing(w.observations, 0.5)) for w in recordings]
    small = lack_of_fit(fitted(allowed, lambda k, e: 0.8 * np.sin(4 * e.given.theta_in[e.judged])))
    large = lack_of_fit(fitted(allowed, lambda k, e: 2.0 * np.sin(4 * e.given.theta_in[e.judged])))
    assert small.lower_bound < 0 < large.lower_bound


def _allowing(e, share):
    """The same observations with a tolerance that makes up a share of each variance."""
    sigma = np.ptp(e.measured, axis=1, keepdims=True) / np.sqrt(share) * np.ones_like(e.measured)
    return replace(e, sigma=sigma, tolerance=np.ones(len(e.channels)))
