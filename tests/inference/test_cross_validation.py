"""Leave-one-out cross-validation and the jackknife, against fits of straight lines."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import t as student

from ccmodel.inference.cross_validation import jackknife, leave_one_out, shortened
from ccmodel.inference.least_squares import Search, minimise
from ccmodel.inference.problem import Free, Problem


def inverses(information):
    """Of all recordings' information, and of that of all but each."""
    total = sum(information)
    return np.linalg.pinv(total), [np.linalg.pinv(total - H) for H in information]


def fits_of_lines(slopes, draws=4000, seed=7):
    """Errors, standard deviations and degrees of freedom of the slope, of recordings with abscissas of these sizes."""
    random = np.random.default_rng(seed)
    J = [np.stack([np.ones(20), size * np.linspace(-1, 1, 20)], axis=1) for size in slopes]
    information = [j.T @ j for j in J]
    inverse, without = inverses(information)
    found = []
    for _ in range(draws):
        score = [j.T @ random.standard_normal(20) for j in J]
        x = inverse @ sum(score)
        aside = [V @ (sum(score) - g) for V, g in zip(without, score, strict=True)]
        covariance, freedom = jackknife(np.array(aside) - x, information, inverse, without)
        found.append([x[1], np.sqrt(covariance[1, 1]), freedom[1]])
    return np.array(found).T


@pytest.mark.parametrize("slopes", [[1.0] * 8, [4.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0], [5.0, 5.0, 0.3, 0.3, 0.3]])
def test_intervals_hold_the_truth_if_few_recordings_have_most_of_the_information(slopes):
    off, sd, freedom = fits_of_lines(slopes)
    assert np.mean(sd**2) == pytest.approx(np.var(off), rel=0.1)
    held = np.mean(np.abs(off) < student.ppf(0.95, freedom) * sd)
    assert 0.88 < held < 0.97  # conservative where two of five have nearly all the information


def test_equally_informative_recordings_are_one_degree_of_freedom_each_but_one():
    assert fits_of_lines([1.0] * 8, draws=1)[2] == pytest.approx(7.0)
    assert fits_of_lines([5.0, 5.0, 0.3, 0.3, 0.3], draws=1)[2] < 2.0


def test_a_value_without_information_keeps_its_scatter():
    blind = [np.diag([1.0, 0.0])] * 4
    moved = np.array([[0.1, 0.0], [-0.1, 0.0], [0.2, 0.0], [-0.2, 0.0]])
    covariance, freedom = jackknife(moved, blind, *inverses(blind))
    assert np.isfinite(covariance).all()
    assert freedom == pytest.approx([3.0, 1.0])


def test_a_newton_step_that_raises_the_cost_is_shortened():
    """The other recordings want 1: a step to 1 is taken, one to 4 is halved, one to 40 is not taken."""
    recordings = [SimpleNamespace(name=str(k), errors=lambda values: np.array([values["x"] - 1.0])) for k in range(4)]
    problem = Problem(recordings, {"x": Free(0.0)}, weight=lambda r: 1.0)
    joint = [np.array([-1.0])] * 4

    def step(to):
        return shortened(problem, np.array([0.0]), np.array([to]), joint, 3)[0]

    assert [step(1.0), step(4.0), step(40.0)] == [1.0, 2.0, 0.0]


def line_fit(wanted, free, **bounds):
    """A fit of one slope to recordings each of which wants a slope of its own, and its cross-validation."""
    x = np.linspace(-1, 1, 20)

    def recording(k, slope):
        return SimpleNamespace(name=str(k), session="", errors=lambda values: (values["slope"] - slope) * x)

    recordings = [recording(k, slope) for k, slope in enumerate(wanted)]
    problem = Problem(recordings, {"slope": free}, weight=lambda r: 1.0)
    return leave_one_out(problem, minimise(problem, problem.start, Search()))


@pytest.mark.parametrize("recordings", [3, 8])
def test_an_unknown_on_its_bound_stays_there_for_every_part_of_the_recordings(recordings):
    found = line_fit([-1.0] * recordings, Free(0.5, 0.0, 10.0))
    assert np.array(found.values) == pytest.approx(np.zeros((recordings, 1)), abs=1e-6)
    # Which does not mean that it is known exactly.
    assert found.covariance[0, 0] > 0


def test_an_unknown_leaves_its_bound_where_the_others_pull_it_off():
    """Without the last recording the best slope is 1, with it it is on the bound."""
    found = line_fit([1.0, 1.0, -30.0], Free(0.5, 0.0, 10.0))
    assert np.array(found.values)[:, 0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-5)


def test_of_a_single_recording_nothing_is_left_out():
    found = line_fit([2.0], Free(0.5, -10.0, 10.0, spread=5.0))
    assert found.values[0] == pytest.approx([2.0], abs=0.1)
    assert np.abs(found.residuals[0]).max() < 0.1
