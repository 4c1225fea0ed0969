"""Noise from consecutive cycles."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.inference.cycles import cycle_noise
from ccmodel.inference.noise import REST_FREEDOM, SensorNoise, repeated, sensor_noise
from ccmodel.model.run import ModelInput

RATE_HZ, NOISE = 250.0, 1e-3


def sine(cycles=3.0, noise=NOISE, added=lambda t: 0.0, step_rad=None, amplitude=lambda t: 0.6):
    """A sine of 0.5 Hz after half a second of rest, and a torque that follows it with friction and noise."""
    t = np.arange(round((0.5 + 2 * cycles) * RATE_HZ)) / RATE_HZ
    moving = np.clip(t - 0.5, 0.0, None)
    drive = amplitude(t) * np.sin(np.pi * moving)
    torque = 0.05 * drive + 0.01 * np.tanh(np.gradient(drive, t) / 0.05) + added(moving)
    torque = torque + noise * np.random.default_rng(0).standard_normal(t.size)
    read = drive if step_rad is None else step_rad * np.round(drive / step_rad)
    made = recording(theta_in_rad=np.zeros_like)
    return replace(
        made,
        time_s=t,
        channels={"theta_in_rad": read, "tau_in_Nm": torque},
        derived_from={},
        accuracy={"tau_in_Nm": 1e-4},
        encoder_step_rad={} if step_rad is None else {"theta_in_rad": step_rad},
        rest_s=0.5,
    )


@pytest.mark.parametrize("step_rad", [None, 0.00314])
def test_white_noise_is_found_whatever_the_steps_of_the_drive_encoder(step_rad):
    found = cycle_noise(sine(step_rad=step_rad))
    # The first three quarters still hold the start; a quarter of a cycle is too short to be compared.
    assert found.cycles == pytest.approx(1.0, abs=0.05)
    assert np.sqrt(found.variance["tau_in_Nm"]) == pytest.approx(NOISE, rel=0.1)


@pytest.mark.parametrize(
    "drift",
    [
        lambda t: 0.02 * np.exp(-t / 5.0),
        lambda t: 0.02 * np.exp(-t / 5.0) * np.tanh(np.cos(np.pi * t) / 0.03),
        lambda t: 0.01 * t * np.sin(np.pi * t),
    ],
    ids=["relaxation", "running-in", "growing gain"],
)
def test_what_drifts_over_the_cycles_is_no_noise(drift):
    found = cycle_noise(sine(added=drift))
    assert np.sqrt(found.variance["tau_in_Nm"]) < 1.3 * NOISE


def test_what_differs_from_cycle_to_cycle_is():
    bumps = np.random.default_rng(1).standard_normal(500)

    def rough(t):
        return 3e-3 * np.interp(t, np.arange(bumps.size) / 10.0, bumps)

    quiet, loud = (cycle_noise(sine(added=a)).variance["tau_in_Nm"] for a in (lambda t: 0.0, rough))
    assert loud > 1.5 * quiet


def test_a_motion_that_does_not_repeat_shows_no_cycles():
    assert cycle_noise(sine(amplitude=lambda t: 0.1 + 0.1 * t)).variance == {}
    assert cycle_noise(sine(cycles=1.5)).variance == {}


def test_the_noise_in_motion_is_never_below_that_at_rest():
    rest, restless = SensorNoise(1e-3, "rest"), SensorNoise(1e-2, "rest")
    assert repeated(rest, 0.8e-6, 2.0) == repeated(rest, None, 0.0) == rest
    assert repeated(restless, 1e-6, 2.0) == SensorNoise(1e-3, "cycles")
    freedom = 20 * 2.0
    expected = np.sqrt((REST_FREEDOM + freedom * 9.0) / (REST_FREEDOM + freedom)) * 1e-3
    found = repeated(rest, 9e-6, 2.0)
    assert (found.sd, found.source) == (pytest.approx(expected), "cycles")


def test_a_drive_that_moves_before_its_first_count_is_no_noise():
    """In the last fifth of the rest, the torque rises to thirty times its noise."""
    made = sine(cycles=1.5)
    rise = np.where(made.time_s < 0.5, np.clip(made.time_s - 0.4, 0, None) / 0.1, 0.0) * 30 * NOISE
    made = replace(made, channels=dict(made.channels, tau_in_Nm=made["tau_in_Nm"] + rise))
    assert sensor_noise(ModelInput.of(made))["tau_in_Nm"].sd == pytest.approx(NOISE, rel=0.25)
