import numpy as np
import pytest

from virtualrig.config import BatchPlan
from virtualrig.motion import Chirp, GrowingSine, Sine, StepAndHold, Triangle, WanderingSine

SINE = Sine(wave="sine", amplitude_rad=0.8, frequency_Hz=0.5, rest_s=0.6, start_up_cycles=0.5, cycles=2.0)


def test_a_sine_begins_with_a_rest():
    time = np.arange(0, SINE.duration_s, 1e-3)
    angle, rate = SINE.angle_and_rate(time)
    assert not angle[time <= 0.6].any()
    assert not rate[time <= 0.6].any()
    steady = time >= 1.6
    np.testing.assert_allclose(angle[steady], 0.8 * np.sin(np.pi * (time[steady] - 0.6)), atol=1e-12)


def test_rate_is_the_angles_derivative_and_acceleration_has_no_jump():
    time = np.arange(0, SINE.duration_s, 1e-3)
    angle, rate = SINE.angle_and_rate(time)
    np.testing.assert_allclose(rate[1:-1], (angle[2:] - angle[:-2]) / 2e-3, atol=1e-4)
    acceleration = np.diff(rate) / 1e-3
    # The sine's own jerk is A omega^3 = 25 rad/s^3; a jump would show as one of 1e3 and more.
    assert np.abs(np.diff(acceleration)).max() / 1e-3 < 300


def test_a_batch_states_the_motion():
    assert SINE.metadata == {"wave": "sine", "amplitude_rad": 0.8, "frequency_Hz": 0.5}
    assert SINE.duration_s == pytest.approx(5.6)


COMMON = {"amplitude_rad": 0.8, "rest_s": 0.5}
MOTIONS = [
    Triangle(wave="triangle", frequency_Hz=0.5, turn_share=0.2, cycles=2.25, **COMMON),
    Chirp(wave="chirp", first_Hz=0.3, last_Hz=2.0, sweep_s=5.0, start_up_cycles=0.5, **COMMON),
    GrowingSine(
        wave="growing-sine", first_amplitude_rad=0.1, frequency_Hz=0.5, start_up_cycles=0.5, cycles=4, **COMMON
    ),
    WanderingSine(wave="wandering-sine", frequency_Hz=0.5, spread=0.4, seed=3, start_up_cycles=0.5, cycles=3, **COMMON),
    StepAndHold(wave="step-and-hold", angles_rad=(0.8, -0.2, 0.1), move_s=0.5, hold_s=1.0, rest_s=0.5),
]


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda m: m.wave)
def test_every_motion_rests_and_then_moves_with_bounded_acceleration(motion):
    step = 1e-4
    time = np.arange(0, motion.duration_s, step)
    angle, rate = motion.angle_and_rate(time)
    assert not angle[time <= 0.5].any()
    assert not rate[time <= 0.5].any()
    assert np.abs(angle).max() <= 0.8 + 1e-9
    assert np.abs(angle).max() > 0.7
    np.testing.assert_allclose(rate[1:-1], (angle[2:] - angle[:-2]) / (2 * step), atol=2e-3)
    # A sine of 0.8 rad at the chirp's 2 Hz has 126 rad/s^2; a jump in speed would show as 1e4 and more.
    assert np.abs(np.diff(rate)).max() / step < 150
    assert motion.metadata["wave"] == motion.wave


def test_a_triangle_has_constant_speed_between_reversals():
    triangle = MOTIONS[0]
    time = np.arange(0, triangle.duration_s, 1e-3)
    angle, rate = triangle.angle_and_rate(time)
    straight = np.abs(angle) < 0.6
    moving = straight & (time > 0.6)
    np.testing.assert_allclose(np.abs(rate[moving]), 4 * 0.8 * 0.5 / (1 - 0.1), rtol=1e-9)


def test_a_chirp_sweeps_its_frequencies():
    chirp = MOTIONS[1]
    time = np.arange(0, chirp.duration_s, 1e-4)
    angle, _ = chirp.angle_and_rate(time)
    crossings = time[1:][np.diff(np.sign(angle)) != 0]
    half_s, middle = np.diff(crossings), (crossings[1:] + crossings[:-1]) / 2
    expected = 0.3 * (2.0 / 0.3) ** ((middle - 0.5) / 5.0)
    np.testing.assert_allclose(0.5 / half_s, expected, rtol=0.07)


def test_reversals_of_a_growing_sine_are_nested():
    angle, _ = MOTIONS[2].angle_and_rate(np.arange(0, MOTIONS[2].duration_s, 1e-3))
    reversals = angle[1:-1][(np.diff(angle)[:-1] * np.diff(angle)[1:]) < 0]
    assert (np.diff(np.abs(reversals)) > 0).all()
    assert (reversals[1:] * reversals[:-1] < 0).all()


def test_a_wandering_sine_is_drawn_from_its_seed():
    time = np.arange(0, 5, 1e-2)
    motion = MOTIONS[3]
    same, other = motion.model_copy(), motion.model_copy(update={"seed": 4})
    assert (motion.angle_and_rate(time)[0] == same.angle_and_rate(time)[0]).all()
    assert np.abs(motion.angle_and_rate(time)[0] - other.angle_and_rate(time)[0]).max() > 0.1


def test_steps_are_held():
    time = np.array([0.4, 1.2, 1.9, 2.7, 3.4, 4.9])
    angle, rate = MOTIONS[4].angle_and_rate(time)
    np.testing.assert_allclose(angle, [0.0, 0.8, 0.8, -0.2, -0.2, 0.1], atol=1e-12)
    assert not rate.any()


def test_a_batch_accepts_every_motion():
    condition = {"id": "a", "pretension_N": 7.0, "conduit": [{"length_m": 1.2, "bend_rad": 3.0}]}
    for motion in MOTIONS:
        batch = {"note": "", "repeats": 1, "excitation": motion.model_dump(mode="json"), "conditions": [condition]}
        assert BatchPlan.model_validate(batch).excitation == motion
