"""A recording that is not what its batch file says."""

from dataclasses import replace

import numpy as np
import pytest

from ccmodel.diagnose.comparison import Judgement
from ccmodel.diagnose.diagnosis import odd_one_out
from ccmodel.diagnose.whitening import weigh
from ccmodel.geometry import ConduitPath
from made_observations import PARAMETERS, batch, calibrated


def judged(recordings):
    base = calibrated(recordings)
    return Judgement("unexplained", base, base, [], [], 1.0, [], {}, recordings)


@pytest.fixture(scope="module")
def contradicting():
    """Four recordings, of which the batch says that the third was bent twice as much as it was."""
    recordings = batch()
    e = recordings[2].observations
    stated = replace(e.given.recording, path=ConduitPath([1.2], [2 * np.pi]))
    recordings[2] = weigh(replace(e, given=replace(e.given, recording=stated)), PARAMETERS)
    return recordings


def test_it_is_named(contradicting):
    (found,) = odd_one_out(judged(contradicting))
    assert found["what"] == "r2"
    assert "check its bend" in found["why"]


def test_where_all_are_off_none_is():
    recordings = batch(lambda said: {"tau_in_Nm": 2e-3 * np.sin(25 * said["theta_in_rad"])})
    assert odd_one_out(judged(recordings)) == []


def test_three_recordings_do_not_say_which(contradicting):
    assert odd_one_out(judged(contradicting[:3])) == []
