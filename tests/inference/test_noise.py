"""What counts may be wrong by."""

import numpy as np
import pytest

from ccmodel.inference.noise import PHASES, rounding_errors

STEP = 0.003


def test_a_count_is_wrong_by_half_a_step_at_most_and_by_its_deviation_on_average():
    errors = rounding_errors(np.linspace(0.0, 0.05, 300), STEP)
    assert errors.shape == (PHASES.size, 300)
    assert np.abs(errors).max() <= STEP / 2
    assert errors.std() == pytest.approx(STEP / np.sqrt(12), rel=0.01)
    # No phase is preferred: at every angle they cancel.
    np.testing.assert_allclose(errors.mean(axis=0), 0.0, atol=STEP / PHASES.size)


def test_counts_of_an_angle_are_wrong_alike_while_it_rests():
    angle = np.concatenate([np.linspace(0.0, 0.05, 100), np.full(100, 0.05)])
    errors = rounding_errors(angle, STEP)
    assert np.ptp(errors[:, 100:], axis=1).max() < 1e-12
    assert np.ptp(errors[:, :100], axis=1).min() > 0.9 * STEP
