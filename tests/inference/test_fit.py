"""Fits of drawn batches, whose truth is known: what is found, what is refused, and that fewer rows do."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from ccmodel.channels import TENSIONS
from ccmodel.failure import ModelError
from ccmodel.inference.fit import fit
from ccmodel.inference.least_squares import Search, minimise, solve
from ccmodel.inference.observations import Observations
from ccmodel.inference.problem import Block, Free, Problem
from drawn_batches import CONDITIONS, SPREAD, draw, problem_of


@pytest.fixture(scope="module")
def drawn():
    return draw(1, duration_s=2.4)


@pytest.fixture(scope="module")
def problem(drawn):
    return problem_of(drawn)


@pytest.fixture(scope="module")
def found(problem):
    return fit(problem, starts=3, profiled=["stiffness_N_per_m", "friction_coefficient"])


def dense_residuals(problem, x):
    """All weighted errors and prior errors, whose sum of squares is the cost."""
    return np.concatenate([*(e.ravel() for e in problem.errors(x)), problem.prior_errors(x)])


def dense_jacobian(problem, x):
    """As `least_squares` wants it: all rows by all unknowns."""
    blocks = problem.blocks(x)
    rows = []
    for block in blocks:
        J = np.zeros((block.errors.size, x.size))
        J[:, block.columns] = block.derivatives.reshape(-1, block.columns.size)
        rows.append(J)
    return np.concatenate([*rows, np.diag(problem.prior_precision)])


def test_finds_what_the_batch_was_made_with_from_a_fifth_off(drawn, found):
    assert found.succeeded, found.message
    # Friction scatters by 1 % between four recordings, so its mean is known to 0.5 %; 3 standard deviations.
    assert found.values["friction_coefficient"] == pytest.approx(drawn.shared["friction_coefficient"], rel=0.015)
    assert found.values["stiffness_N_per_m"] == pytest.approx(drawn.shared["stiffness_N_per_m"], rel=0.005)
    assert found.values["load_stiffness_Nm_per_rad"] == pytest.approx(
        drawn.shared["load_stiffness_Nm_per_rad"], rel=0.002
    )


def test_every_recording_has_values_of_its_own_within_what_their_intervals_say(drawn, found):
    """Five standard deviations: 20 values, of which chance takes one out of 100,000 further."""
    assert list(found.own) == [f"drawn/r{i}" for i in range(len(CONDITIONS))]
    for (recording, intervals), truth in zip(found.own_intervals.items(), drawn.own, strict=True):
        for name, true in truth.items():
            middle = (intervals[name].low + intervals[name].high) / 2
            assert abs(middle - true) < 5 * intervals[name].sd, (recording, name)
        # A recording's own friction is known better than the population's it was drawn from.
        assert intervals["friction"].sd < found.intervals["friction_coefficient"].sd
        mu = found.values["friction_coefficient"] * found.own[recording]["friction_scale"]
        assert (intervals["friction"].low + intervals["friction"].high) / 2 == pytest.approx(mu)


def test_an_initial_tension_that_bends_between_the_ends_is_found():
    """The rest shows the ends alone; taken for straight, a profile like this would be taken for something else."""
    drawn = draw(4, conditions=CONDITIONS[:2], duration_s=2.4, curvature=0.5)
    said = fit(problem_of(drawn, SPREAD | {"tension_curvature_A": 0.3, "tension_curvature_B": 0.3}))
    straight = fit(problem_of(drawn))
    assert straight.cost > 1.5 * said.cost
    for own in said.own_intervals.values():
        for name, true in (("tension_curvature_A", 0.5), ("tension_curvature_B", 0.0)):
            assert (own[name].low + own[name].high) / 2 == pytest.approx(true, abs=0.1)


def test_where_the_drive_rests_is_told_by_more_than_its_motion(found):
    """All that its counts say of the first rest is one standard deviation; torques and tensions say more."""
    for own in found.own_intervals.values():
        assert own["drive_encoder_offset"].sd < 0.9
        assert abs(own["drive_encoder_offset"].low + own["drive_encoder_offset"].high) / 2 < 4


def test_all_rows_give_the_same(problem):
    """Scipy's trust region on every row of the same cost, where ours gives it a root of their products."""
    problem = Problem(problem.observations[:2], problem.shared, problem.own)
    ours = solve(problem, problem.start)
    assert ours.message.startswith("converged")
    theirs = least_squares(
        lambda x: dense_residuals(problem, x), problem.start, jac=lambda x: dense_jacobian(problem, x),
        bounds=problem.bounds, x_scale=problem.sizes, ftol=1e-15, xtol=1e-12, gtol=1e-15, max_nfev=30,
    )  # fmt: skip
    shared = len(problem.shared)
    assert ours.x[:shared] == pytest.approx(theirs.x[:shared], rel=1e-6)
    assert ours.x[shared:] == pytest.approx(theirs.x[shared:], abs=1e-4 * problem.sizes[shared:].max())
    assert ours.cost == pytest.approx(2 * theirs.cost, rel=1e-6)


def test_derivatives_carried_along_by_secants_lead_to_the_same_minimum_in_fewer_runs(problem, monkeypatch):
    computed = []
    blocks = Problem.blocks
    monkeypatch.setattr(Problem, "blocks", lambda self, *given: computed.append(1) or blocks(self, *given))
    how = Search(tolerance=1e-8, gradient=1e-8)
    every = minimise(problem, problem.start, how)
    by_every = len(computed)
    few = minimise(problem, problem.start, replace(how, secants=True))
    assert few.converged
    assert few.cost == pytest.approx(every.cost, rel=1e-6)
    assert len(computed) - by_every < by_every
    # The derivatives of the solution are computed ones.
    for block, own in zip(few.blocks, blocks(problem, few.x), strict=True):
        np.testing.assert_allclose(block.derivatives, own.derivatives, rtol=1e-6, atol=1e-6)


def test_a_secant_agrees_with_the_errors_at_both_points_and_keeps_what_the_step_does_not_show():
    random = np.random.default_rng(5)
    sizes, step = np.array([1.0, 1e3, 1e-3, 1.0]), np.array([0.2, -40.0, 0.0, 7.0])
    block = Block(np.array([0, 1, 2]), random.normal(size=(2, 5)), random.normal(size=(2, 5, 3)))
    errors = random.normal(size=(2, 5))
    moved = block.by_secant(step, sizes, errors)
    np.testing.assert_allclose(moved.derivatives @ step[:3], errors - block.errors)
    # Across the step, in units of the sizes.
    across = np.array([sizes[0] ** 2 * step[1], -(sizes[1] ** 2) * step[0], 3.0])
    scaled = across / sizes[:3] ** 2 @ step[:3]
    assert scaled == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(moved.derivatives @ across, block.derivatives @ across, rtol=1e-9)
    assert block.by_secant(np.zeros(4), sizes, block.errors).derivatives is block.derivatives


def test_several_starts_end_at_the_same_optimum(found):
    assert not [w for w in found.warnings if "starts" in w]


def test_a_start_that_ends_elsewhere_is_said(problem, monkeypatch):
    real = solve
    calls = []

    def astray(problem, x):
        calls.append(x)
        found = real(problem, x)
        return found if len(calls) == 1 else replace(found, x=found.x * 1.1, cost=found.cost * 2)

    monkeypatch.setattr("ccmodel.inference.fit.solve", astray)
    assert "1 of 2 starts ended elsewhere, at a higher or equal error" in fit(problem, starts=2).warnings


def test_a_bound_that_was_hit_is_named(problem):
    low = problem.start[0]
    free = problem.shared | {"stiffness_N_per_m": Free(low, low, 2 * low)}  # truth lies a sixth lower
    said = fit(Problem(problem.observations, free, problem.own))
    assert said.at_bound == ["stiffness_N_per_m"]
    assert said.values["stiffness_N_per_m"] == low


def test_a_start_outside_its_bounds_is_refused_by_name(problem):
    free = problem.shared | {"stiffness_N_per_m": Free(1.0, 10.0, 1e5)}
    said = fit(Problem(problem.observations, free))
    assert not said.succeeded
    assert "stiffness_N_per_m starts at 1, outside" in said.message


def test_a_fit_that_is_not_finite_is_refused_with_its_reason(problem):
    observations = problem.observations[0]
    measured = observations.measured.copy()
    measured[0, 10] = np.nan
    said = fit(Problem([replace(observations, measured=measured)], problem.shared, problem.own))
    assert not said.succeeded
    assert "not finite" in said.message
    assert not said.values


def test_a_model_that_cannot_be_run_on_the_way_makes_the_search_turn_back(problem, drawn, monkeypatch):
    real = Observations.errors

    def picky(self, values):
        if values["stiffness_N_per_m"] < 0.95 * drawn.shared["stiffness_N_per_m"]:
            raise ModelError("too soft")
        return real(self, values)

    monkeypatch.setattr(Observations, "errors", picky)
    assert fit(problem).values["stiffness_N_per_m"] == pytest.approx(drawn.shared["stiffness_N_per_m"], rel=0.005)


def test_a_profile_that_the_model_cannot_be_run_along_is_said(problem, monkeypatch):
    def unable(*_):
        raise ModelError("too soft")

    monkeypatch.setattr("ccmodel.inference.fit.profile", unable)
    said = fit(problem, profiled=["stiffness_N_per_m"])
    assert said.succeeded
    assert "no profile of stiffness_N_per_m: too soft" in said.warnings


@pytest.fixture
def uphill(monkeypatch):
    """Slopes that point uphill: no step along one can help."""
    real = Problem.blocks

    def reversed_slope(self, x, *step):
        return [replace(b, derivatives=-b.derivatives) for b in real(self, x, *step)]

    monkeypatch.setattr(Problem, "blocks", reversed_slope)


def test_a_stalled_search_is_refused_with_its_reason(problem, uphill, monkeypatch):
    monkeypatch.setattr("ccmodel.inference.least_squares.SIMPLEX_UNKNOWNS", 0)
    said = fit(problem)
    assert not said.succeeded
    assert said.message.startswith("stalled")


def test_where_slopes_lead_nowhere_few_unknowns_are_searched_without(problem, drawn, uphill):
    said = fit(Problem(problem.observations, problem.shared))
    assert said.succeeded
    assert "without derivatives" in said.message
    stiffness = said.values["stiffness_N_per_m"]
    assert stiffness == pytest.approx(drawn.shared["stiffness_N_per_m"], rel=0.01)


def test_tensions_do_not_enter_a_second_time(problem, drawn):
    """With other tensions in the recording the errors are what they were: they are derived from torques and sums."""
    recording = drawn.recordings[0]
    channels = {c: v + (100.0 if c in TENSIONS else 0.0) for c, v in recording.channels.items()}
    given = problem.observations[0].given
    tampered = Observations.of(replace(recording, channels=channels), problem.observations[0].parameters)
    assert not set(tampered.channels) & set(TENSIONS)
    assert tampered.measured == pytest.approx(problem.observations[0].measured)
    assert given.recording.id == recording.id


def test_weights_are_the_noise_that_the_rest_shows(drawn, problem):
    """Torque noise of 0.1 mN m is found from 80 samples at rest, to within a quarter of it."""
    e = problem.observations[0]
    quiet = e.sigma[e.channels.index("tau_out_Nm")]
    assert quiet.min() == pytest.approx(1e-4, rel=0.25)
    assert e.sigma[e.channels.index("F_load_N")].min() == pytest.approx(0.05, rel=0.25)
    # Where the drive's motion is uncertain its torque counts for less.
    assert e.sigma[e.channels.index("tau_in_Nm")].max() > 1.05 * quiet.min()


def test_the_result_is_plain_json(found):
    said = json.loads(json.dumps(found.as_dict(), allow_nan=False))
    assert said["intervals"]["stiffness_N_per_m"]["low"] < said["values"]["stiffness_N_per_m"]
    assert set(said["profiles"]) == {"stiffness_N_per_m", "friction_coefficient"}


def test_own_values_of_which_less_scatter_is_expected_than_there_is_widen_the_intervals():
    """Friction that differs by 5 % where 1 % is expected."""
    drawn = draw(3, conditions=CONDITIONS[:2] * 2, friction=0.05)
    said = fit(problem_of(drawn, {"friction_scale": 0.01, "theta_out_zero_rad": SPREAD["theta_out_zero_rad"]}))
    scatter = said.scatter["friction_scale"]
    assert scatter.expected == 0.01
    assert scatter.of_repeats is None  # Every recording is a condition of its own.
    assert scatter.found > 0.02
    assert any("friction_scale differs" in w for w in said.warnings)
    # Were the scatter as expected: 1 % over the root of four recordings, at the least.
    assert said.intervals["friction_coefficient"].sd > 2 * 0.005 * said.values["friction_coefficient"]
