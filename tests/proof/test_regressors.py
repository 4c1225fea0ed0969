"""Reference regressors learn the residuals that their features express, and do not fit noise."""

import numpy as np
import pytest

from proof import regressors


def recordings(seed, law, noise):
    """Features, residuals and recording numbers of six synthetic recordings."""
    random = np.random.default_rng(seed)
    names = ["theta", "omega", "direction", "tau_in", "F_drive", "theta_out", "time"]
    n = 6 * regressors.SAMPLES
    features = {"one": np.ones(n)} | {name: random.normal(size=n) for name in names}
    return features, law(features) + noise * random.normal(size=n), np.repeat(np.arange(6), regressors.SAMPLES)


def linear(f):
    return 0.4 * f["direction"] - 0.2 * f["tau_in"]


def curved(f):
    return np.sin(2 * f["theta"]) * f["direction"]


def errors(fit, law, noise=0.02):
    """Standard deviations of new residuals with and without the correction."""
    correction = fit(*recordings(1, law, noise))
    other, residuals, _ = recordings(2, law, noise)
    return np.std(residuals - correction(other)), np.std(residuals)


def test_stepwise_learns_a_linear_law():
    after, before = errors(regressors.stepwise, linear)
    assert after == pytest.approx(0.02, rel=0.1)
    assert before > 0.4


def test_sparse_regression_learns_a_linear_law():
    pytest.importorskip("pysindy")
    after, _ = errors(regressors.sparse, linear)
    assert after == pytest.approx(0.02, rel=0.1)


def test_gaussian_process_learns_a_nonlinear_law():
    pytest.importorskip("sklearn")
    after, before = errors(regressors.gaussian_process, curved)
    linear_terms, _ = errors(regressors.stepwise, curved)
    assert after < 0.5 * linear_terms
    assert after < 0.5 * before


def test_boosting_learns_what_depends_on_the_past():
    """A residual that an earlier speed decides, which the features of the moment do not show."""
    pytest.importorskip("sklearn")
    earlier = f"{regressors.MEMORY}omega 0.16 s before"
    features, _, recording = recordings(1, linear, 0.0)
    features[earlier] = np.random.default_rng(3).normal(size=recording.size)
    residuals = np.sign(features[earlier])
    after = np.std(residuals - regressors.boosting(features, residuals, recording)(features))
    assert after < 0.2
    assert np.std(residuals - regressors.stepwise(features, residuals, recording)(features)) > 0.9


def test_memory_is_that_of_the_motion():
    time_s = np.arange(500) / 250
    theta = np.sin(2 * np.pi * time_s)
    memory = regressors._memory(time_s, theta, np.gradient(theta, time_s))
    k = 300
    assert memory[f"{regressors.MEMORY}theta 0.16 s before"][k] == pytest.approx(theta[k - 40] - theta[k])
    assert memory[f"{regressors.MEMORY}time since the reversal"][k] == pytest.approx(time_s[k] - 0.75, abs=0.01)
    assert memory[f"{regressors.MEMORY}travel since the reversal"][k] == pytest.approx(theta[k] + 1, abs=0.01)


def test_stepwise_does_not_fit_noise():
    after, before = errors(regressors.stepwise, lambda f: 0.0 * f["theta"], noise=1.0)
    assert after == pytest.approx(before, rel=0.02)
