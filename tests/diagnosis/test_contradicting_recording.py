"""A recording that is not what its batch file says."""

from dataclasses import replace

import numpy as np
import pytest

from ccmodel.diagnosis.comparison import Comparison
from ccmodel.diagnosis.result import contradicting_recording
from ccmodel.diagnosis.verdict import Judgement
from ccmodel.diagnosis.whitening import whiten
from ccmodel.geometry import ConduitPath
from made_observations import PARAMETERS, batch, calibrated


def judged(recordings):
    base = calibrated(recordings)
    return Judgement("unexplained", base, Comparison(recordings, base, [], {}), [], [], [])


@pytest.fixture(scope="module")
def contradicting():
    """Four recordings, of which the batch says that the third was bent twice as much as it was."""
    recordings = batch()
    e = recordings[2].observations
    stated = replace(e.given.recording, path=ConduitPath([1.2], [2 * np.pi]))
    recordings[2] = whiten(replace(e, given=replace(e.given, recording=stated)), PARAMETERS)
    return recordings


def test_the_contradicting_recording_is_named(contradicting):
    (found,) = contradicting_recording(judged(contradicting))
    assert found["what"] == "r2"
    assert "check its bend" in found["why"]


def test_none_is_named_if_all_are_off():
    recordings = batch(lambda simulated: {"tau_in_Nm": 2e-3 * np.sin(25 * simulated["theta_in_rad"])})
    assert contradicting_recording(judged(recordings)) == []


def test_three_recordings_are_too_few(contradicting):
    assert contradicting_recording(judged(contradicting[:3])) == []
