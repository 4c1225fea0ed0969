import numpy as np
import pytest

from virtualrig.motion import Sine

SINE = Sine(wave="sine", amplitude_rad=0.8, frequency_Hz=0.5, rest_s=0.6, start_up_cycles=0.5, cycles=2.0)


def test_it_rests_and_then_is_the_sine_that_was_asked_for():
    time = np.arange(0, SINE.duration_s, 1e-3)
    angle, rate = SINE.angle_and_rate(time)
    assert not angle[time <= 0.6].any()
    assert not rate[time <= 0.6].any()
    steady = time >= 1.6
    np.testing.assert_allclose(angle[steady], 0.8 * np.sin(np.pi * (time[steady] - 0.6)), atol=1e-12)


def test_rate_is_the_angle_s_and_acceleration_has_no_jump():
    time = np.arange(0, SINE.duration_s, 1e-3)
    angle, rate = SINE.angle_and_rate(time)
    np.testing.assert_allclose(rate[1:-1], (angle[2:] - angle[:-2]) / 2e-3, atol=1e-4)
    acceleration = np.diff(rate) / 1e-3
    # The sine's own jerk is A omega^3 = 25 rad/s^3; a jump would show as one of 1e3 and more.
    assert np.abs(np.diff(acceleration)).max() / 1e-3 < 300


def test_the_batch_notes_what_was_asked():
    assert SINE.asked == {"wave": "sine", "amplitude_rad": 0.8, "frequency_Hz": 0.5}
    assert SINE.duration_s == pytest.approx(5.6)
