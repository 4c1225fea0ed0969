"""The regressor that the model is measured by on measured recordings: what it may know and what it may not."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("sklearn", reason="the yardstick takes scikit-learn, an extra")
sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import real_regressor as yardstick

from builders import recording
from ccmodel.model.run import ModelInput


def condition(load_level, frequency, gain=1.0):
    """A sine against a load, and a drive torque that follows from them by a law with memory."""
    r = recording(
        duration=4.0,
        id=f"{load_level:g}-{frequency:g}",
        theta_in_rad=lambda t: np.sin(2 * np.pi * frequency * t),
        tau_out_Nm=lambda t: np.full_like(t, load_level),
        tau_in_Nm=lambda t: gain * (0.05 * np.sign(np.cos(2 * np.pi * frequency * t)) + 0.3 * load_level),
        theta_out_rad=lambda t: 0.9 * np.sin(2 * np.pi * frequency * (t - 0.02)),
        settled_s=1.0,
    )
    return ModelInput.of(replace(r, excitation={"load_level": load_level, "frequency_Hz": frequency}), yardstick.STEP_S)


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(yardstick, "SETTINGS", [{"max_leaf_nodes": 6, "min_samples_leaf": 10, "learning_rate": 0.2}])
    monkeypatch.setattr(yardstick, "MOST_TREES", 40)


def test_it_learns_a_law_that_other_recordings_show(quick):
    inputs = [condition(load, f) for load in (0.1, 0.2) for f in (0.5, 0.7, 1.0)]
    assert yardstick.rms(yardstick.held_out(inputs, "tau_in_Nm", "frequency_Hz")) < 0.2 * 0.05


def test_what_is_held_out_is_not_learnt_from(quick):
    """One load level follows another law: no error of its own may fall by having seen itself."""
    inputs = [condition(load, f, gain=-1.0 if load == 0.3 else 1.0) for load in (0.1, 0.2, 0.3) for f in (0.7, 1.0)]
    errors = yardstick.held_out(inputs, "tau_in_Nm", "load_level")
    assert min(yardstick.rms([e]) for e in errors[-2:]) > 0.08


def test_what_is_near_a_turn_is_told_from_the_rest():
    """A sine of 1 rad and counts of 0.01 rad: near is what lies less than two counts below its ends."""
    given = condition(0.1, 1.0)
    given = replace(given, recording=replace(given.recording, encoder_step_rad={"theta_in_rad": 0.01}))
    judged = yardstick.is_judged(given)
    near, angle = ~yardstick.is_resolved(given)[judged], np.abs(given.theta_in[judged])
    assert near[angle > 0.985].all()
    assert not near[:-1][angle[:-1] < 0.96].any()  # the end of a recording may be a turn


def test_a_sample_is_predicted_from_what_came_before_unless_it_is_asked_to_look_ahead():
    whole = condition(0.1, 0.7)
    later = whole.recording.time_s > 2.0
    stopped = np.where(later, whole.theta_in[~later][-1], whole.theta_in)
    other = replace(whole, theta_in=stopped, tau_out=np.where(later, 1.0, whole.tau_out))
    before = whole.recording.time_s < 1.9
    # Its speed and direction take the next sample too.
    assert yardstick.features(other)[before] == pytest.approx(yardstick.features(whole)[before])
    soon = before & (whole.recording.time_s > 1.0)
    ahead = yardstick.features(other, ahead=True)[soon], yardstick.features(whole, ahead=True)[soon]
    assert (ahead[0] != ahead[1]).any(axis=1).all()
