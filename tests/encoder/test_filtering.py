"""The causal estimate of a motion behind its counts."""

import numpy as np
import pytest

from ccmodel.encoder.filtering import causal_motion

STEP = 0.00314


def counted(theta):
    return STEP * np.round(theta / STEP)


def sine(rate_Hz, amplitude=0.6, frequency_Hz=0.5, offset=0.0007):
    time_s = np.arange(0, 8, 1 / rate_Hz)
    since = np.maximum(time_s - 0.5, 0)
    theta = amplitude * np.sin(2 * np.pi * frequency_Hz * since) * np.clip(since / 2, 0, 1) ** 2
    return time_s, theta + offset


@pytest.mark.parametrize("rate_Hz", [250, 1000])
def test_the_error_is_well_below_that_of_the_counts(rate_Hz):
    time_s, theta = sine(rate_Hz)
    found, sigma = causal_motion(time_s, counted(theta), STEP)
    moving = time_s > 2.5
    error = (found - theta)[moving]
    assert np.sqrt(np.mean(error**2)) < 0.65 * np.std((counted(theta) - theta)[moving])
    assert 0.85 < np.mean(np.abs(error) < 1.645 * sigma[moving]) < 0.99


def test_no_value_depends_on_later_counts():
    time_s, theta = sine(250)
    counts = counted(theta)
    changed = counts.copy()
    changed[1000:] -= 7 * STEP
    for a, b in zip(causal_motion(time_s, counts, STEP), causal_motion(time_s, changed, STEP), strict=True):
        assert np.array_equal(a[:1000], b[:1000])
        assert not np.array_equal(a[1000:], b[1000:])


def test_at_rest_the_angle_is_anywhere_within_its_count():
    time_s = np.arange(200) / 250
    found, sigma = causal_motion(time_s, np.full(200, 5 * STEP), STEP)
    assert np.allclose(found, 5 * STEP)
    assert sigma[0] == pytest.approx(STEP / np.sqrt(12))
    assert (sigma <= sigma[0] * (1 + 1e-9)).all()


def test_a_gap_widens_the_estimate():
    time_s, theta = sine(250)
    kept = np.r_[0:1000, 1010 : time_s.size]
    found, sigma = causal_motion(time_s[kept], counted(theta)[kept], STEP)
    assert sigma[1000] > sigma[999]
    assert abs(found[1000] - theta[1010]) < STEP
