from dataclasses import replace

import numpy as np
import pytest

from ccmodel.diagnose.candidate import CandidateFit
from ccmodel.diagnose.hypothesis import Hypothesis
from ccmodel.diagnose.lack_of_fit import structure
from made_observations import batch


@pytest.fixture(scope="module")
def recordings():
    return batch()


def trial(recordings, errors):
    """A trial that leaves noise and, in each channel, `errors` of a recording's observations."""
    random = np.random.default_rng(1)
    aside = []
    for k, w in enumerate(recordings):
        e = w.observations
        shape = e.measured.shape
        aside.append((random.standard_normal(shape) + errors(k, e)).ravel())
    return CandidateFit(Hypothesis(), {}, {}, [], [], np.eye(1), np.ones(1), [], aside)


def test_noise_teaches_nothing(recordings):
    found = structure(recordings, trial(recordings, lambda k, e: 0.0))
    assert found.mean < 0.02
    assert found.surely < 0.01


def test_what_follows_the_drive_is_learnt(recordings):
    found = structure(recordings, trial(recordings, lambda k, e: np.sin(4 * e.given.theta_in[e.judged])))
    assert found.surely > 0.2


def test_what_differs_from_run_to_run_cannot_be_learnt(recordings):
    signs = [1, -1, 1, -1]
    found = structure(recordings, trial(recordings, lambda k, e: signs[k] * np.sin(4 * e.given.theta_in[e.judged])))
    assert found.surely < 0.02


def test_a_single_recording_is_learnt_in_stretches(recordings):
    one = recordings[:1]
    found = structure(one, trial(one, lambda k, e: 2 * np.sin(4 * e.given.theta_in[e.judged])))
    assert found.gain.size == 4
    assert found.mean > 0.2


def test_a_channel_that_one_recording_lacks_is_learnt_from_the_others(recordings):
    lacking = [recordings[0].acting(recordings[0].observations.parameters), *recordings[1:]]
    object.__setattr__(lacking[0], "observations", lacking[0].observations.without("tau_out_Nm"))
    found = structure(lacking, trial(lacking, lambda k, e: np.sin(4 * e.given.theta_in[e.judged])))
    assert found.surely > 0.2


def test_what_a_right_model_is_allowed_to_leave_may_follow_laws(recordings):
    """An tolerance of half the noise's mean square: a law of that size is no objection, a larger one is."""
    allowed = [replace(w, observations=_allowing(w.observations, 0.5)) for w in recordings]
    small = structure(allowed, trial(allowed, lambda k, e: 0.8 * np.sin(4 * e.given.theta_in[e.judged])))
    large = structure(allowed, trial(allowed, lambda k, e: 2.0 * np.sin(4 * e.given.theta_in[e.judged])))
    assert small.surely < 0 < large.surely


def _allowing(e, share):
    """The same observations with an tolerance that makes up a share of each variance."""
    sigma = np.ptp(e.measured, axis=1, keepdims=True) / np.sqrt(share) * np.ones_like(e.measured)
    return replace(e, sigma=sigma, tolerance=np.ones(len(e.channels)))
