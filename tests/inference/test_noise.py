"""What counts may be wrong by."""

from types import SimpleNamespace

import numpy as np
import pytest

from ccmodel.inference.effective_samples import IN_DIAGNOSIS
from ccmodel.inference.noise import ROUNDING_PHASES, SensorNoise, pooled, repeated, rounding_errors, sensor_noise

STEP = 0.003


def test_a_count_is_wrong_by_half_a_step_at_most_and_by_its_deviation_on_average():
    errors = rounding_errors(np.linspace(0.0, 0.05, 300), STEP)
    assert errors.shape == (ROUNDING_PHASES.size, 300)
    assert np.abs(errors).max() <= STEP / 2
    assert errors.std() == pytest.approx(STEP / np.sqrt(12), rel=0.01)
    # No phase is preferred: at every angle they cancel.
    np.testing.assert_allclose(errors.mean(axis=0), 0.0, atol=STEP / ROUNDING_PHASES.size)


def test_counts_of_an_angle_are_wrong_alike_while_it_rests():
    angle = np.concatenate([np.linspace(0.0, 0.05, 100), np.full(100, 0.05)])
    errors = rounding_errors(angle, STEP)
    assert np.ptp(errors[:, 100:], axis=1).max() < 1e-12
    assert np.ptp(errors[:, :100], axis=1).min() > 0.9 * STEP


def noise_of(rest, accuracy=None, step=None, values=(0.0, 1.0)):
    stated = {} if accuracy is None else {"c": accuracy}
    steps = {} if step is None else {"c": step}
    recording = SimpleNamespace(channels={"c": np.asarray(values)}, accuracy=stated, encoder_step_rad=steps)
    return sensor_noise(SimpleNamespace(recording=recording, resting={"c": np.asarray(rest)}))["c"]


def test_a_counted_angle_has_the_deviation_of_its_step():
    assert noise_of(np.zeros(100), step=STEP).sd == pytest.approx(STEP / np.sqrt(12))


def test_the_scatter_at_rest_has_no_bias_and_no_drift_in_it():
    random = np.random.default_rng(1)
    drift = 0.5 * np.arange(40)
    found = [noise_of(drift + random.standard_normal(40)) for _ in range(3000)]
    assert {one.source for one in found} == {"rest"}
    assert np.mean([one.sd**2 for one in found]) == pytest.approx(1.0, rel=0.03)


def test_a_short_rest_shows_nothing_and_a_quiet_one_little_less_than_the_accuracy():
    assert noise_of(np.zeros(19), accuracy=0.2) == SensorNoise(0.2, "assumed")
    assert noise_of(np.zeros(100), accuracy=0.2).sd == pytest.approx(0.02)


@pytest.mark.parametrize("at_rest, found", [(1.9, SensorNoise(1.9, "rest")), (2.1, SensorNoise(1.0, "cycles"))])
def test_a_rest_that_scatters_twice_as_much_as_cycles_is_none(at_rest, found):
    assert repeated(SensorNoise(at_rest, "rest"), 1.0, 5.0) == found


def test_cycles_that_do_not_scatter_show_no_less_than_a_quiet_rest():
    """Of a channel that repeats exactly, as one that a program has made, noise would be zero."""
    assert repeated(SensorNoise(0.1, "rest", 8, least=0.1), 0.0, 3.0).sd == 0.1


def test_cycles_and_rest_are_weighed_by_their_degrees_of_freedom():
    found = repeated(SensorNoise(1.0, "rest"), 4.0, 0.2)
    assert IN_DIAGNOSIS == 20
    assert found.sd**2 == pytest.approx((4.0 * 1.0 + 4.0 * 4.0) / 8.0)


def rests(true_sd, samples=37, seed=0):
    """Scatter of a sensor at rest in several recordings."""
    random, freedom = np.random.default_rng(seed), samples - 2
    return [SensorNoise(sd * np.sqrt(random.chisquare(freedom) / freedom), "rest", freedom) for sd in true_sd]


def test_rests_of_one_sensor_have_one_noise():
    found = pooled(rests(np.ones(200)))
    assert np.std([one.sd for one in found]) < 0.02
    assert np.mean([one.sd**2 for one in found]) == pytest.approx(1.0, abs=0.05)


def test_the_inverse_of_the_pooled_variance_has_no_bias():
    """It is the weight of a recording's errors: of its own rest alone it would be 6 % too large."""
    inverse = [[1 / one.sd**2 for one in own(rests(np.ones(10), seed=k))] for own in (list, pooled) for k in range(200)]
    alone, together = np.mean(inverse[:200]), np.mean(inverse[200:])
    assert alone == pytest.approx(35 / 33, abs=0.02)
    assert together == pytest.approx(1.0, abs=0.02)


def test_noises_that_differ_between_recordings_stay_apart():
    true = np.exp(0.3 * np.random.default_rng(3).standard_normal(60))
    given = rests(true)
    found = pooled(given)

    def error(noises):
        return np.mean(np.log([one.sd for one in noises] / true) ** 2)

    assert error(found) < error(given)
    assert np.corrcoef(np.log([one.sd for one in found]), np.log(true))[0, 1] > 0.9


def test_what_no_rest_shows_is_not_pooled():
    given = [SensorNoise(0.1, "assumed"), *rests([1.0]), SensorNoise(0.5, "count")]
    assert pooled(given) == given
    assert pooled([*given, *rests([1.0], seed=1)])[0] == given[0]
