"""How sure a fit is of its values."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import t as student

from ccmodel.diagnose import candidate
from ccmodel.diagnose.candidate import _eased, _scatter, _shortened, fit, moved_by_finer
from ccmodel.diagnose.hypothesis import Hypothesis
from made_observations import batch, calibrated

LOW = np.array([0.0, 1e-3])
KEY = "conduit-compliance/conduit/compliance"


def test_what_a_coarse_solver_costs_is_what_it_takes_to_undo_it(monkeypatch):
    """The recordings are the paper's model's, so that what is found of a compliance beyond noise is the solver's."""
    recordings = batch()
    base = calibrated(recordings)
    hypothesis = Hypothesis((("conduit-compliance", "conduit"),))
    found = fit(recordings, hypothesis, base.free, base.values | {KEY: 1e-5})
    k = list(found.values).index(KEY)
    moved = moved_by_finer(recordings, found)
    finer = [w.acting(replace(w.observations.parameters, refinement=candidate.FINER)) for w in recordings]
    there = fit(finer, hypothesis, base.free, found.values)
    assert found.values[KEY] + moved[k] == pytest.approx(there.values[KEY], abs=0.3 * abs(moved[k]))
    monkeypatch.setattr(candidate, "FINER", 1)
    assert moved_by_finer(recordings, found) == pytest.approx(np.zeros(moved.size), abs=1e-12)


def test_the_papers_model_has_no_solver_to_refine():
    for w in batch():
        refined = w.acting(replace(w.observations.parameters, refinement=3))
        assert (w.observations.modelled({}) == refined.observations.modelled({})).all()


def inverses(information):
    """Of all recordings' information, and of that of all but each."""
    total = sum(information)
    return np.linalg.pinv(total), [np.linalg.pinv(total - H) for H in information]


def fits_of_lines(says, draws=4000, seed=7):
    """Errors, standard deviations and degrees of freedom of lines through recordings that say so much of the slope."""
    random = np.random.default_rng(seed)
    J = [np.stack([np.ones(20), size * np.linspace(-1, 1, 20)], axis=1) for size in says]
    information = [j.T @ j for j in J]
    inverse, inverses_aside = inverses(information)
    found = []
    for _ in range(draws):
        score = [j.T @ random.standard_normal(20) for j in J]
        x = inverse @ sum(score)
        aside = [V @ (sum(score) - g) for V, g in zip(inverses_aside, score, strict=True)]
        covariance, freedom = _scatter(np.array(aside) - x, information, inverse, inverses_aside)
        found.append([x[1], np.sqrt(covariance[1, 1]), freedom[1]])
    return np.array(found).T


@pytest.mark.parametrize("says", [[1.0] * 8, [4.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0], [5.0, 5.0, 0.3, 0.3, 0.3]])
def test_intervals_hold_the_truth_however_little_most_recordings_say(says):
    off, sd, freedom = fits_of_lines(says)
    assert np.mean(sd**2) == pytest.approx(np.var(off), rel=0.1)
    held = np.mean(np.abs(off) < student.ppf(0.95, freedom) * sd)
    assert 0.88 < held < 0.97  # where two of five say nearly all, rather too wide


def test_recordings_that_say_alike_are_one_degree_of_freedom_each_but_one():
    assert fits_of_lines([1.0] * 8, draws=1)[2] == pytest.approx(7.0)
    assert fits_of_lines([5.0, 5.0, 0.3, 0.3, 0.3], draws=1)[2] < 2.0


def test_a_value_that_nothing_depends_on_is_left_as_it_moved():
    blind = [np.diag([1.0, 0.0])] * 4
    moved = np.array([[0.1, 0.0], [-0.1, 0.0], [0.2, 0.0], [-0.2, 0.0]])
    covariance, freedom = _scatter(moved, blind, *inverses(blind))
    assert np.isfinite(covariance).all()
    assert freedom == pytest.approx([3.0, 1.0])


@pytest.mark.parametrize(("least", "end"), [(0.005, 0.00625), (0.08, 0.1), (0.0, 0.0015625)])
def test_a_value_is_eased_down_as_long_as_that_leaves_less(least, end):
    def solved(x):
        return SimpleNamespace(x=x, cost=1 + abs(np.log((x[1] + 1e-9) / (least + 1e-9))))

    assert _eased(solved, solved(np.array([3.0, 0.1])), 1, LOW).x == pytest.approx([3.0, end])


def test_a_step_that_goes_astray_is_shortened(monkeypatch):
    """One unknown, of which the others' errors want 1: a step to 1 is taken, one to 4 halved, one to 40 not taken."""
    monkeypatch.setattr(candidate, "errors", lambda w, values: np.array([values["x"] - 1.0]))
    others = [("a recording", np.array([-1.0]))] * 3

    def step(to):
        return _shortened(others, np.array([0.0]), np.array([to]), lambda x: {"x": x[0]})[0]

    assert [step(1.0), step(4.0), step(40.0)] == [1.0, 2.0, 0.0]


def test_with_nothing_free_a_model_stands_as_it_is():
    recordings = batch()
    found = fit(recordings, Hypothesis(), {}, {})
    assert found.values == {}
    assert found.left.mean() == pytest.approx(calibrated(recordings).left.mean(), rel=0.05)
