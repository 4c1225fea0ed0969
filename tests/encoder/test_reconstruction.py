from itertools import pairwise

import numpy as np
import pytest

from ccmodel.encoder.reconstruction import reconstruct_motion

COARSE, FINE = np.pi / 1000, 2 * np.pi / 8192
REST = 0.4


def rising(s):
    s = np.clip(s, 0, 1)
    return s**3 * (10 - 15 * s + 6 * s**2)


def sine(time):
    s = np.maximum(time - REST, 0)
    return 0.6 * np.sin(np.pi * s) * rising(s / 2)


def slow(time):
    s = np.maximum(time - REST, 0)
    return 0.05 * np.sin(0.5 * np.pi * s) * rising(s / 2)


def triangle(time):
    """Reversals of 80 ms."""
    grid = np.arange(-1, time[-1] + 1, 1e-4)
    corner = 0.45 * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * 0.4 * np.maximum(grid - REST - 0.04, 0)))
    smooth = np.convolve(np.pad(corner, 400, mode="edge"), np.ones(801) / 801, "valid")
    return np.interp(time, grid, smooth)


def steps(time):
    """Minimum-jerk steps of half a second, holds of one and a half."""
    levels = [0.0, 0.5, 0.2, 0.6]
    return sum((b - a) * rising((time - REST - 2 * i) / 0.5) for i, (a, b) in enumerate(pairwise(levels)))


def ramps(time):
    """Constant acceleration, constant speed, constant deceleration, hold."""

    def ramp(s):
        s = np.clip(s, 0, 1.0)
        return np.where(s < 1 / 3, 2.25 * s**2, np.where(s < 2 / 3, 1.5 * s - 0.25, 1 - 2.25 * (1 - s) ** 2))

    return 0.5 * ramp((time - REST) / 0.6) - 0.3 * ramp((time - REST - 2) / 0.6) + 0.4 * ramp((time - REST - 4) / 0.6)


MOTIONS = [sine, slow, triangle, steps, ramps]


def recorded(motion, step=COARSE, rate=250, seed=0):
    """Time, true angle, angle as counted (zero at rest) and end of the rest."""
    time = np.arange(1, 6 * rate) / rate
    truth = motion(time)
    counts = np.floor(truth / step + np.random.default_rng(seed).uniform(0, 1))
    counts -= counts[0]
    return time, truth, counts * step, time[np.flatnonzero(counts)[0] - 1]


def errors(motion, step, rate, seeds=8):
    """Errors of the motion from the rest on, in counts, and their stated standard deviations; (seeds, n) each."""
    found = []
    for seed in range(seeds):
        time, truth, counted, rest = recorded(motion, step, rate, seed)
        estimate = reconstruct_motion(time, counted, step, rest)
        found.append([(estimate.theta_rad - truth) / step, estimate.sigma_rad / step])
    return np.array(found).swapaxes(0, 1)


def rms(x):
    return np.sqrt(np.mean(np.square(x)))


@pytest.mark.parametrize(("step", "rate"), [(COARSE, 250), (COARSE, 1000), (FINE, 1000)])
@pytest.mark.parametrize(
    ("motion", "moving", "all_of_it"),
    [(sine, 0.06, 0.15), (slow, 0.06, 0.25), (triangle, 0.1, 0.3), (steps, 0.15, 0.3), (ramps, 0.2, 0.45)],
)
def test_motions_are_recovered(motion, moving, all_of_it, step, rate):
    error, _ = errors(motion, step, rate, seeds=4)
    truth = recorded(motion, step, rate)[1]
    moves = abs(np.gradient(truth)) > 1e-9
    # The offset of the first rest within its count is constant in the motion after it.
    within = error[:, moves] - error[:, moves].mean(axis=1, keepdims=True)
    assert rms(within) < moving
    assert rms(error) < all_of_it


@pytest.mark.parametrize("motion", MOTIONS)
def test_the_stated_uncertainty_covers_the_error(motion):
    error, sigma = errors(motion, COARSE, 250)
    covered = abs(error) < 1.645 * sigma + 1e-9
    assert covered.mean() > 0.7
    # The stated uncertainty is not merely large: an unknown offset within a count alone is 0.29.
    assert rms(sigma) < 0.45


@pytest.mark.parametrize("motion", MOTIONS)
def test_the_motion_stays_within_the_counts(motion):
    time, _, counted, rest = recorded(motion)
    estimate = reconstruct_motion(time, counted, COARSE, rest)
    assert abs(estimate.theta_rad + estimate.zero_rad - counted).max() < 0.55 * COARSE


@pytest.mark.parametrize("motion", [steps, ramps])
def test_holds_are_constant(motion):
    time, truth, counted, rest = recorded(motion)
    estimate = reconstruct_motion(time, counted, COARSE, rest)
    for begin in (2.0, 4.0):  # Shortly before the next step.
        hold = (time > begin + REST - 0.8) & (time < begin + REST - 0.2)
        assert np.ptp(truth[hold]) == 0
        assert np.ptp(estimate.theta_rad[hold]) < 1e-9
        assert np.ptp(estimate.deviations_rad[:, hold], axis=1).max() < 1e-3 * COARSE


@pytest.mark.parametrize("motion", [steps, ramps])
def test_no_false_reversal_before_a_hold(motion):
    for seed in range(4):
        time, _, counted, rest = recorded(motion, seed=seed)
        estimate = reconstruct_motion(time, counted, COARSE, rest)
        first = time < REST + 1.8  # The first step and its hold.
        for angle in (estimate.theta_rad, *(estimate.theta_rad + estimate.deviations_rad[:2])):
            hold = angle[first][-1]
            assert angle[first].max() <= hold + 1e-9
            assert angle[first].min() >= angle[0] - 1e-9


def test_rests_where_the_drive_rests():
    time, _, counted, rest = recorded(steps)
    estimate = reconstruct_motion(time, counted, COARSE, rest)
    assert abs(estimate.theta_rad[time < 0.3]).max() < 1e-9
    assert abs(estimate.sigma_rad[time < 0.3]).max() < 1e-3 * COARSE


def test_the_deviations_are_as_large_as_stated():
    time, _, counted, rest = recorded(sine)
    estimate = reconstruct_motion(time, counted, COARSE, rest)
    assert rms(estimate.deviations_rad) == pytest.approx(rms(estimate.sigma_rad), rel=0.6)


def test_a_start_in_motion():
    time = np.arange(1500) / 250
    truth = 0.6 * np.sin(np.pi * time + 0.5)
    counted = (np.floor(truth / COARSE) + 0.5) * COARSE
    estimate = reconstruct_motion(time, counted, COARSE, 0.0)
    assert rms(estimate.theta_rad - truth) < 0.06 * COARSE
    assert estimate.zero_rad == 0


def test_constant_recordings_stay_constant():
    time = np.arange(500) / 250
    for rest in (0.0, 2.0):
        estimate = reconstruct_motion(time, np.full(500, 7 * COARSE), COARSE, rest)
        assert np.ptp(estimate.theta_rad) < 1e-9
    assert reconstruct_motion(time, np.full(500, 7 * COARSE), COARSE, 0.0).sigma_rad == pytest.approx(
        COARSE / np.sqrt(12), rel=0.1
    )


def test_a_rest_that_dithers_stands_on_the_edge():
    time, _, counted, rest = recorded(sine)
    counted = counted + COARSE * ((np.arange(time.size) % 3 == 0) & (time < rest - 0.15))
    estimate = reconstruct_motion(time, counted, COARSE, rest)
    assert estimate.zero_rad == pytest.approx(0.5 * COARSE, abs=0.2 * COARSE)
    assert np.ptp(estimate.theta_rad[time < 0.25]) < 1e-9


def test_slower_than_a_count_in_a_hundred_samples():
    time = np.arange(3000) / 250
    truth = 2.0 * COARSE * np.sin(0.3 * time)
    counted = np.floor(truth / COARSE) * COARSE
    estimate = reconstruct_motion(time, counted, COARSE, 0.0)
    assert rms(estimate.theta_rad - truth - 0.0 - np.mean(estimate.theta_rad - truth)) < 0.3 * COARSE


@pytest.mark.parametrize("motion", MOTIONS)
def test_invariance_to_time_scale_direction_and_zero(motion):
    time, _, counted, rest = recorded(motion)
    plain = reconstruct_motion(time, counted, COARSE, rest)
    near = {"abs": 0.03 * COARSE}
    assert reconstruct_motion(time + 8, counted, COARSE, rest + 8).theta_rad == pytest.approx(plain.theta_rad, **near)
    assert reconstruct_motion(time, 3 * counted, 3 * COARSE, rest).theta_rad == pytest.approx(
        3 * plain.theta_rad, abs=0.09 * COARSE
    )
    assert reconstruct_motion(time, -counted, COARSE, rest).theta_rad == pytest.approx(-plain.theta_rad, **near)
    assert reconstruct_motion(time, counted + 40 * COARSE, COARSE, rest).theta_rad == pytest.approx(
        plain.theta_rad, **near
    )


def test_small_gaps_are_bridged():
    time, _, counted, rest = recorded(sine)
    keep = np.ones(time.size, bool)
    keep[[300, 301, 700]] = False
    whole, gappy = (
        reconstruct_motion(time, counted, COARSE, rest),
        reconstruct_motion(time[keep], counted[keep], COARSE, rest),
    )
    assert gappy.theta_rad.shape == time[keep].shape
    assert abs(gappy.theta_rad - whole.theta_rad[keep]).max() < 0.5 * COARSE


@pytest.mark.parametrize("glitch", [1, -3, 1000])
def test_a_glitch_is_survived(glitch):
    time, truth, counted, rest = recorded(sine)
    counted[900] += glitch * COARSE
    estimate = reconstruct_motion(time, counted, COARSE, rest)
    assert np.isfinite(estimate.theta_rad).all() and np.isfinite(estimate.sigma_rad).all()
    assert rms(estimate.theta_rad[time < 3] - truth[time < 3]) < 0.5 * COARSE


@pytest.mark.parametrize(("n", "step"), [(3, 0.1), (10, 0.0)])
def test_invalid_input_is_refused(n, step):
    with pytest.raises(ValueError, match="must be"):
        reconstruct_motion(np.arange(n), np.zeros(n), step, 0.0)


def counted_at(true_s, time_s, motion):
    """A motion as counted at true times, reconstructed from the times that a log states; error in counts."""
    truth = motion(true_s)
    counts = np.floor(truth / COARSE + 0.3)
    counts -= counts[0]
    found = reconstruct_motion(time_s, counts * COARSE, COARSE, time_s[np.flatnonzero(counts)[0] - 1])
    outside = np.abs(found.theta_rad + found.zero_rad - counts * COARSE) / COARSE - 0.5
    error = (found.theta_rad - truth) / COARSE
    return np.std(error), outside.max()


@pytest.mark.parametrize("rate", [60, 120, 227, 240, 300, 480])
def test_a_clock_of_whole_milliseconds_is_no_drift(rate):
    """Of samples at 240 Hz the median step is 4 ms, whose multiples drift away from them."""
    true_s = np.arange(1, 6 * rate) / rate
    error, outside = counted_at(true_s, np.round(true_s, 3), sine)
    assert error < 0.3
    assert outside < 0.4


def test_a_gap_of_half_a_step_more_moves_nothing_after_it():
    true_s = np.arange(1, 1500) / 250
    true_s = np.where(true_s > 2.0, true_s + 0.042, true_s)
    error, outside = counted_at(true_s, true_s, sine)
    assert error < 0.15
    assert outside < 0.1
