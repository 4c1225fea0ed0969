"""Turning points of a sampled motion: where they are, and what the model makes of them."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.channels import TAU_IN, THETA_IN
from ccmodel.failure import ModelError
from ccmodel.model.general import Active
from ccmodel.model.general import simulate as by_general
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.model_input import ModelInput
from ccmodel.model.run import simulate
from ccmodel.model.turning_points import TurningPoints
from general_runs import HALF_LOOP, T0, transmission
from made_observations import PARAMETERS

STEP_S = 0.008


def sine(t, phase=0.0, amplitude=0.6, frequency=0.9):
    return amplitude * np.sin(2 * np.pi * frequency * t + phase)


@pytest.mark.parametrize("phase", np.linspace(0.0, 3.0, 7))
def test_a_sine_turns_at_its_amplitude_and_in_its_instant(phase):
    t = np.arange(0.0, 4.0, STEP_S)
    found = TurningPoints.of(t, sine(t, phase))
    at = np.interp(found.interval + found.share, np.arange(t.size), t)
    assert np.abs(np.abs(found.theta) - 0.6).max() < 2e-7
    turns = (np.pi / 2 - phase + np.pi * np.arange(-1, 9)) / (2 * np.pi * 0.9)
    assert np.abs(at[:, None] - turns).min(axis=1).max() < 1e-5


def test_every_turn_is_found_or_is_at_a_sample():
    t = np.arange(0.0, 60.0, STEP_S)
    theta = sine(t)
    found = TurningPoints.of(t, theta)
    assert found.interval.size == pytest.approx(0.96 * 2 * 0.9 * 60, rel=0.05)
    missed = 0.6 - np.sort(found.inserted_in_motion(theta))[-50:]
    assert missed.max() < 1e-6


def test_the_error_falls_with_the_fourth_power_of_the_step():
    errors = []
    for step in (0.02, 0.01):
        t = np.arange(0.0, 40.0, step) + 1e-3
        errors.append(np.abs(np.abs(TurningPoints.of(t, sine(t)).theta) - 0.6).max())
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.3)


@pytest.mark.parametrize("after", [0.0, -1e-9])
def test_a_motion_that_comes_to_rest_does_not_turn(after):
    ramp = np.concatenate([np.arange(10.0), 9.0 + after * np.arange(10)])
    found = TurningPoints.of(np.arange(20.0), ramp)
    assert found.inserted_in_motion(ramp).max() <= 9.0 + 1e-9


def test_the_samples_stay_what_they_are():
    t = np.arange(0.0, 4.0, STEP_S)
    turns = TurningPoints.of(t, sine(t))
    for values in (t, sine(t), np.random.default_rng(0).standard_normal(t.size)):
        inserted = turns.inserted(values)
        assert inserted.size == t.size + turns.interval.size
        np.testing.assert_array_equal(inserted[turns.samples(t.size)], values)
    assert (np.diff(turns.inserted(t)) > 0).all()


def test_a_sample_at_uneven_steps_is_taken_where_it_is():
    t = np.sort(np.random.default_rng(1).uniform(0.0, 4.0, 800))
    found = TurningPoints.of(t, 1.0 - (t - 2.0) ** 2)
    (inside,) = np.flatnonzero((t[:-1] < 2.0) & (t[1:] >= 2.0))
    assert list(found.interval) == [inside]
    assert found.theta[0] == pytest.approx(1.0, abs=1e-12)


def drive_torque(step_s, with_encoder=True):
    """Drive torque every 16 ms, of a motion that is sampled every `step_s`."""
    t = np.arange(0.0, 4.0, step_s)
    like = recording(theta_in_rad=lambda t: 0.0 * t)
    given = ModelInput.prescribed(like, t, sine(t, amplitude=0.3), like.pretension_N)
    steps = {THETA_IN: 1e-3} if with_encoder else {}
    given = replace(given, recording=replace(given.recording, encoder_step_rad=steps))
    return simulate(given, PARAMETERS)[TAU_IN][:: round(0.016 / step_s)]


def test_samples_of_a_motion_show_the_torque_of_the_motion():
    """Without the turning points, the torque after a turn is off by a part of friction's jump."""
    fine = drive_torque(0.0005)
    error, without = (np.abs(drive_torque(0.016, with_encoder) - fine).max() for with_encoder in (True, False))
    assert error < 0.02 * without


def test_a_failure_is_counted_in_the_samples_of_the_recording():
    """The load's spring pushes on beyond what the cables hold, after two turns that lie between samples."""
    t = np.arange(0.0, 4.0, STEP_S)
    theta = sine(t, amplitude=0.3) + np.where(t > 2.0, 4 * (t - 2.0), 0.0)
    turns = TurningPoints.of(t, theta)
    pushing = [Active("load-stiffening", "load", {"K3": -10.0})]
    load, initial = SpringLoad(1e-4), InitialTension.uniform(HALF_LOOP, T0)
    response = by_general(transmission(), load, turns.inserted(t), turns.inserted_in_motion(theta), initial, pushing)
    samples = turns.samples(t.size)
    first = np.flatnonzero(samples >= response.reached)[0]
    assert samples[first] > first, "turns lie before it"
    with pytest.raises(ModelError, match=rf"at sample {first}: "):
        response.complete(samples)
