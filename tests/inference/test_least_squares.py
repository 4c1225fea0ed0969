"""The search's own bookkeeping of derivatives."""

from types import SimpleNamespace

import numpy as np
from scipy import optimize

from ccmodel.inference.least_squares import Search, _Reduced, minimise
from ccmodel.inference.problem import Free, Problem


def test_derivatives_are_computed_where_they_were_carried_along_or_belong_to_another_point():
    asked = []
    reduced = object.__new__(_Reduced)
    reduced.problem = SimpleNamespace(blocks=lambda x, difference: asked.append(x.tolist()) or ["computed"])
    reduced.how = SimpleNamespace(difference=None)
    for is_computed, at in ((True, 1.0), (False, 1.0), (True, 2.0)):
        reduced.point, reduced.blocks, reduced.is_computed = np.array([1.0]), ["stored"], is_computed
        reduced.blocks_at(np.array([at]))
    assert asked == [[1.0], [2.0]]


class Ringing:
    """Noisy samples of a decaying cosine with a step, in the form of observations."""

    measured, session = np.zeros((1, 200)), ""

    def __init__(self, seed: int, detuning: float):
        self.time, self.detuning = np.linspace(0.0, 1.0, 200), detuning
        noise = np.random.default_rng(seed).normal(0.0, 0.05, 200)
        self.samples = self.curve({"a": 2.0, "b": 3.0, "c": 0.7, "d": 0.4}) + noise

    def curve(self, v):
        decay = v["a"] * np.exp(-v["b"] * self.time)
        step = v["d"] ** 1.5 * np.tanh(20 * (self.time - v["c"] / 2))
        return decay * np.cos(6 * v["c"] * self.time * (1 + self.detuning)) + step

    def errors(self, values):
        return ((self.curve(values) - self.samples) / 0.05)[None]


def ringing(seed: int) -> Problem:
    """A problem of four unknowns that start off their true values by some ten per cent to two times."""
    random = np.random.default_rng(seed)
    start = {
        name: value * np.exp(spread * random.standard_normal())
        for name, value, spread in (("a", 2.0, 0.6), ("b", 3.0, 0.6), ("c", 0.7, 0.3), ("d", 0.4, 0.6))
    }
    observations = [Ringing(10 * seed + i, 0.2 * i) for i in range(3)]
    return Problem(observations, {name: Free(value, 0.01, 20.0) for name, value in start.items()})


def test_a_search_goes_on_from_its_own_residuals(monkeypatch):
    """The rows at the start of each search, and the gradient that they give with the derivatives there."""
    real, continued = optimize.least_squares, []

    def spied(residuals, y, jacobian, *given, **named):
        reduced = residuals.__self__
        if reduced.point is not None:
            wanted = reduced.rows[:, -1].copy()
            continued.append(np.allclose(residuals(y), wanted, rtol=1e-9, atol=1e-9))
        return real(residuals, y, jacobian, *given, **named)

    monkeypatch.setattr(optimize, "least_squares", spied)
    how = Search(tolerance=1e-4, shortest=1e-4, gradient=1e-4, difference=3e-4, own_units=True, secants=True)
    for seed in range(60):
        minimise(ringing(seed), ringing(seed).start, how)
    assert len(continued) >= 5
    assert all(continued)
