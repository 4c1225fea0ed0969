"""Rivals find what they can express, on residuals made up from it, and leave noise alone."""

import numpy as np
import pytest

from proof import rivals


def recordings(seed, left_by, noise):
    """Quantities, what is left and which recording it is of, for six made-up recordings."""
    random = np.random.default_rng(seed)
    names = ["theta", "omega", "way", "tau_in", "F_drive", "theta_out", "time"]
    n = 6 * rivals.SAMPLES
    quantities = {"one": np.ones(n)} | {name: random.normal(size=n) for name in names}
    return quantities, left_by(quantities) + noise * random.normal(size=n), np.repeat(np.arange(6), rivals.SAMPLES)


def linear(q):
    return 0.4 * q["way"] - 0.2 * q["tau_in"]


def curved(q):
    return np.sin(2 * q["theta"]) * q["way"]


def left_after(learns, left_by, noise=0.02):
    corrects = learns(*recordings(1, left_by, noise))
    other, left, _ = recordings(2, left_by, noise)
    return np.std(left - corrects(other)), np.std(left)


def test_stepwise_takes_in_what_is_there():
    left, before = left_after(rivals.stepwise, linear)
    assert left == pytest.approx(0.02, rel=0.1)
    assert before > 0.4


def test_sparse_regression_takes_in_what_is_there():
    pytest.importorskip("pysindy")
    left, _ = left_after(rivals.sparse, linear)
    assert left == pytest.approx(0.02, rel=0.1)


def test_process_follows_a_curve_that_no_line_does():
    pytest.importorskip("sklearn")
    left, before = left_after(rivals.process, curved)
    lines, _ = left_after(rivals.stepwise, curved)
    assert left < 0.5 * lines
    assert left < 0.5 * before


def test_stepwise_leaves_noise_alone():
    left, before = left_after(rivals.stepwise, lambda q: 0.0 * q["theta"], noise=1.0)
    assert left == pytest.approx(before, rel=0.02)
