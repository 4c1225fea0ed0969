"""Elementary functions without branches against numpy's."""

import numpy as np
import pytest
from numba import njit

from ccmodel.elementary import quick_exp, quick_log, quick_tanh

RNG = np.random.default_rng(0)
SPREAD = np.concatenate(
    [[0.0], RNG.uniform(-700, 700, 10_000), RNG.uniform(-3, 3, 10_000), RNG.uniform(-1e-9, 1e-9, 9)]
)


def of_each(function, x):
    """A loop that takes several at a time, under the options of the general solver's."""

    @njit(error_model="numpy", fastmath={"reassoc", "contract", "nsz", "arcp"})
    def run(x):
        y = np.empty_like(x)
        for i in range(x.size):
            y[i] = function(x[i])
        return y

    return run(x)


def test_exp():
    assert of_each(quick_exp, SPREAD) == pytest.approx(np.exp(SPREAD), rel=1e-15)
    assert of_each(quick_exp, np.array([-1e9, 1e9])) == pytest.approx(np.exp([-700.0, 700.0]))


def test_log():
    x = np.exp(SPREAD)
    assert of_each(quick_log, x) == pytest.approx(np.log(x), rel=1e-15)


def test_tanh():
    small, all_ = np.linspace(0, 0.05, 5000), np.linspace(0, 30, 5000)
    assert of_each(quick_tanh, small) == pytest.approx(np.tanh(small), rel=1e-14)
    assert of_each(quick_tanh, all_) == pytest.approx(np.tanh(all_), rel=1e-6)
