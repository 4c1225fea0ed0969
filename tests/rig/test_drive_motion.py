import numpy as np
import pytest

from ccmodel.rig.motion import drive_motion

COARSE, FINE = np.pi / 1000, 2 * np.pi / 8192


def after_rest(time):
    return np.maximum(time - 0.4, 0)


def sine(time):
    s = after_rest(time)
    return 0.6 * np.sin(np.pi * s) * np.minimum(s, 1) ** 2


def triangle(time):
    """Reversals of 60 ms."""
    grid = np.arange(0, time[-1] + 1e-4, 1e-4)
    corner = 0.45 * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * 0.4 * after_rest(grid)))
    smooth = np.convolve(np.pad(corner, 300, mode="edge"), np.ones(601) / 601, "valid")
    return np.interp(time, grid, smooth)


def error(motion, step, rate, seed):
    """Rms error of the counts and of the estimate, in counts, and that near reversals."""
    time = np.arange(1, 6 * rate) / rate
    offset = np.random.default_rng(seed).uniform(-0.5, 0.5)
    truth = motion(time)
    counts = np.round(truth / step + offset) * step
    counts -= counts[0]
    rest = time[np.flatnonzero(counts)[0] - 1]
    estimate = drive_motion(time, counts, step, rest)
    truth = truth + offset * step
    speed = np.abs(np.gradient(truth, time))
    near = (speed < 0.15 * speed.max()) & (time > 0.6)

    def rms(x):
        return np.sqrt(np.mean((x / step) ** 2))

    return rms(counts - truth), rms(estimate - truth), rms((counts - truth)[near]), rms((estimate - truth)[near])


@pytest.mark.parametrize("motion", [sine, triangle])
@pytest.mark.parametrize(("step", "rate"), [(COARSE, 250), (COARSE, 500), (COARSE, 1000), (FINE, 1000)])
def test_well_better_than_the_staircase(motion, step, rate):
    errors = np.array([error(motion, step, rate, seed) for seed in range(8)])
    counts, estimate, counts_near, estimate_near = np.sqrt((errors**2).mean(axis=0))
    assert estimate < 0.5 * counts
    if motion is sine:
        assert estimate_near < 0.5 * counts_near


def test_rests_where_the_drive_rests():
    time = np.arange(1, 1500) / 250
    counts = np.round(sine(time) / COARSE) * COARSE
    rest = time[np.flatnonzero(counts)[0] - 1]
    estimate = drive_motion(time, counts, COARSE, rest)
    assert abs(estimate[time < rest - 0.1]).max() < 0.01 * COARSE
    assert abs(estimate - counts).max() < 0.7 * COARSE


def test_constant_acceleration_and_speed_are_left_as_they_are():
    time = np.arange(2000) / 1000
    smooth = 2 * time + 3 * time**2
    assert drive_motion(time, smooth, COARSE, 0.0) == pytest.approx(smooth, abs=1e-6)


def test_small_gaps_are_bridged():
    time = np.arange(1, 1500) / 250
    keep = np.ones(time.size, bool)
    keep[[300, 301, 700]] = False
    counts = np.round(sine(time) / COARSE) * COARSE
    whole, gappy = drive_motion(time, counts, COARSE, 0.4), drive_motion(time[keep], counts[keep], COARSE, 0.4)
    assert gappy.shape == time[keep].shape
    assert abs(gappy - whole[keep]).max() < COARSE


@pytest.mark.parametrize(("n", "step"), [(3, 0.1), (10, 0.0)])
def test_what_it_refuses(n, step):
    with pytest.raises(ValueError, match="must be"):
        drive_motion(np.arange(n), np.zeros(n), step, 0.0)
