"""Intervals that mean it, and what the recordings do not tell apart."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom
from scipy.stats import t as student

from ccmodel.inference import intervals
from ccmodel.inference.fit import fit
from ccmodel.inference.interval_checks import bootstrap, profile
from ccmodel.inference.intervals import REACH, covariance
from ccmodel.inference.least_squares import information_and_gradient, solve
from ccmodel.inference.problem import Block, Free, Problem
from drawn_batches import CONDITIONS, SPREAD, draw, problem_of

EXTRA_BEND = Free(0.0, -1.0, 3.0)
FEW = {name: SPREAD[name] for name in ("friction_scale", "theta_out_zero_rad")}


@pytest.fixture(scope="module")
def solved():
    problem = problem_of(draw(1), FEW)
    return problem, solve(problem, problem.start)


@pytest.fixture(scope="module")
def of_one_path():
    """Bend and friction of recordings that all have the same path."""
    drawn = draw(2, conditions=[CONDITIONS[0], CONDITIONS[2]], friction=0.0)
    return drawn, fit(problem_of(drawn, SPREAD | {"friction_scale": 1e-4}, extra_bend_rad=EXTRA_BEND))


def test_of_one_path_only_friction_times_bend_is_known(of_one_path):
    drawn, said = of_one_path
    (group,) = said.undetermined
    assert group.parameters == ["friction_coefficient", "extra_bend_rad"]
    text = r"friction_coefficient and extra_bend_rad are not determined apart; known is friction_coefficient \+ "
    weight, known = re.fullmatch(text + r"(\S+) x extra_bend_rad = (\S+)", group.text).groups()
    # mu (phi + e) is what is known: mu + (mu / (phi + e)) e to the first order.
    mu, e = said.values["friction_coefficient"], said.values["extra_bend_rad"]
    assert float(weight) == pytest.approx(mu / (np.pi + e), rel=0.01)
    product = drawn.shared["friction_coefficient"] * np.pi
    assert mu * (np.pi + e) == pytest.approx(product, rel=0.01)
    assert float(known) == pytest.approx(mu + mu / (np.pi + e) * e, rel=0.01)


def test_what_is_not_determined_has_no_interval_and_the_rest_keeps_its_own(of_one_path):
    drawn, said = of_one_path
    for name in ("friction_coefficient", "extra_bend_rad"):
        assert np.isinf(said.intervals[name].sd)
    k = said.intervals["stiffness_N_per_m"]
    assert abs(said.values["stiffness_N_per_m"] - drawn.shared["stiffness_N_per_m"]) < 4 * k.sd < 100


def test_what_is_not_determined_is_so_by_the_linear_theory_itself(of_one_path):
    """Not for being named: its standard deviation is beyond anything that friction can be."""
    drawn, _ = of_one_path
    problem = problem_of(drawn, SPREAD | {"friction_scale": 1e-4}, extra_bend_rad=EXTRA_BEND)
    solution = solve(problem, problem.start)
    variance = np.diag(covariance(problem, solution))
    assert np.sqrt(variance[problem.names.index("friction_coefficient")]) > 0.3


def test_of_two_paths_both_are_known():
    drawn = draw(2, conditions=CONDITIONS[:2], friction=0.0)
    said = fit(problem_of(drawn, SPREAD | {"friction_scale": 1e-4}, extra_bend_rad=EXTRA_BEND))
    assert not said.undetermined
    # There is no extra bend in truth.
    assert abs(said.values["extra_bend_rad"]) < 4 * said.intervals["extra_bend_rad"].sd < 0.2


def test_an_unknown_on_which_nothing_depends_is_named_alone(solved):
    """The load cells' zeros without the load cells' channels, tensions from elsewhere."""
    problem, _ = solved
    observations = [replace(e, parameters=replace(e.parameters, pretension_N=7.0)) for e in problem.observations]
    at = [e.channels.index("theta_out_rad") for e in observations]
    observations = [
        replace(e, channels=("theta_out_rad",), measured=e.measured[[k]], sigma=e.sigma[[k]])
        for e, k in zip(observations, at, strict=True)
    ]
    said = fit(
        Problem(observations, {n: problem.shared[n] for n in ("stiffness_N_per_m",)} | {"F_load_zero_N": Free(0.0)})
    )
    (group,) = said.undetermined
    assert group.text == "F_load_zero_N is not determined by these recordings"
    assert said.as_dict()["intervals"]["F_load_zero_N"]["low"] is None


def test_a_profile_agrees_with_the_linear_interval_where_the_cost_is_a_parabola(solved):
    problem, solution = solved
    variance = np.diag(covariance(problem, solution))
    linear = intervals.intervals(problem, solution, variance)["friction_coefficient"]
    found = profile(problem, solution, "friction_coefficient", variance)
    assert found.low == pytest.approx(linear.low, abs=0.1 * linear.sd)
    assert found.high == pytest.approx(linear.high, abs=0.1 * linear.sd)


def test_a_profile_stops_at_a_bound(solved):
    problem, solution = solved
    variance = np.diag(covariance(problem, solution))
    k = problem.names.index("friction_coefficient")
    near = float(solution.x[k] + 0.5 * np.sqrt(variance[k]))
    free = problem.shared | {"friction_coefficient": replace(problem.shared["friction_coefficient"], high=near)}
    bounded = Problem(problem.observations, free, problem.own)
    assert profile(bounded, solution, "friction_coefficient", variance).high == near


def test_resampled_recordings_scatter_as_the_intervals_say():
    """Eight recordings: the standard deviation of resampling is itself known to a quarter or so."""
    problem = problem_of(draw(7, conditions=CONDITIONS * 2, duration_s=2.4), FEW)
    solution = solve(problem, problem.start)
    sd = np.sqrt(np.diag(covariance(problem, solution)))[problem.names.index("friction_coefficient")]
    assert 0.4 < bootstrap(problem, solution)["friction_coefficient"] / sd < 2


@pytest.mark.parametrize("rho", [0.0, 0.8])
def test_noise_that_is_alike_from_sample_to_sample_is_known_to_be(rho):
    """A mean of n samples that follow one another by rho has variance (1 + rho) / (1 - rho) / n."""
    random, n, found = np.random.default_rng(0), 2000, []
    for _ in range(40):
        noise = np.zeros(n)
        for i in range(1, n):
            noise[i] = rho * noise[i - 1] + np.sqrt(1 - rho**2) * random.standard_normal()
        block = Block(np.arange(1), (noise - noise.mean())[None], np.ones((1, n, 1)))
        found.append(intervals.noise_of(block)[0, 0] / intervals.WIDER**2 / n)
    # The mean that was taken out and the window take up to a sixth of it; 40 draws leave 4 % of chance.
    assert 0.75 < np.mean(found) / ((1 + rho) / (1 - rho)) < 1.1


def test_errors_that_are_accounted_for_do_not_count_again():
    """White noise beside a slow error of which likely draws are known: left is the white noise's say."""
    random, n, found = np.random.default_rng(0), 400, []
    time = np.linspace(0, 1, n)
    J = np.stack([np.ones(n), np.sin(9 * time)], axis=1)[None]
    information = J[0].T @ J[0]

    def slow(draws):
        weights = random.standard_normal((draws, 2, 1))
        return 2 * (weights[:, :1] * np.sin(12 * time) + weights[:, 1:] * np.cos(12 * time))

    for _ in range(40):
        block = Block(np.arange(2), np.zeros((1, n)), J)
        inverse = np.linalg.inv(information)
        likely = intervals.residual_part(block, inverse, slow(40))
        (left,) = intervals.residual_part(block, inverse, slow(1) + random.standard_normal((1, 1, n)))
        block = replace(block, errors=left)
        said = (np.diag(intervals.noise_of(block, each)) for each in ([], [likely]))
        found.append([d / intervals.WIDER**2 / np.diag(information) for d in said])
    twice, once = np.mean(found, axis=0)
    assert (twice > 10).all()
    # Draws of two weights differ in their size by as much as themselves; what is negative counts as nothing.
    assert (once > 0.7).all() and (once < 0.5 * twice).all()


def test_more_that_is_accounted_for_than_there_is_leaves_nothing():
    random = np.random.default_rng(0)
    block = Block(np.arange(3), random.standard_normal((2, 300)), random.standard_normal((2, 300, 3)))
    found = intervals.noise_of(block, [10 * random.standard_normal((8, 2, 300))])
    scale = np.abs(intervals.noise_of(block)).max()
    assert np.linalg.eigvalsh(found).min() > -1e-12 * scale
    assert np.abs(found).max() < 0.01 * scale


def test_what_the_fit_leaves_of_an_error_is_what_a_new_fit_leaves_of_it(solved):
    """Of a single recording, so that nothing is left by way of others."""
    problem, _ = solved
    problem = Problem(
        problem.observations[:1], problem.shared, {"theta_out_zero_rad": problem.own["theta_out_zero_rad"]}
    )
    solution = solve(problem, problem.start)
    (block,), (observations,) = solution.blocks, problem.observations
    k = observations.channels.index("theta_out_rad")
    error = np.zeros_like(observations.measured)
    # The zero takes up the middle of it, nothing the rest.
    error[k] = 0.05 * observations.sigma[k] * (1 + np.sin(np.linspace(0, 40, error[k].size)))
    moved = Problem([replace(observations, measured=observations.measured - error)], problem.shared, problem.own)
    (added,) = (a - b for a, b in zip(moved.errors(solution.x), problem.errors(solution.x), strict=True))
    information = block.information + np.diag(problem.prior_precision**2)
    (said,) = intervals.residual_part(block, np.linalg.inv(information), added[None])
    found = moved.errors(solve(moved, solution.x).x)[0] - problem.errors(solution.x)[0]
    assert np.linalg.norm(said) < 0.8 * np.linalg.norm(added)
    assert np.linalg.norm(said - found) < 0.05 * np.linalg.norm(added - said)


def test_what_rounding_does_to_a_fit_stands_in_its_covariance(solved):
    """With residuals of nothing, against encoders of many phases; without a step, there is no rounding."""
    problem, solution = solved
    silent = replace(solution, blocks=[replace(b, errors=np.zeros_like(b.errors)) for b in solution.blocks])
    drive = {"theta_in_rad": problem.observations[0].given.recording.encoder_step_rad["theta_in_rad"]}
    read = [replace(e.given.recording, encoder_step_rad=drive) for e in problem.observations]
    uncounted = [
        replace(e, given=replace(e.given, recording=r)) for e, r in zip(problem.observations, read, strict=True)
    ]
    said = covariance(problem, silent) - covariance(Problem(uncounted, problem.shared, problem.own), silent)
    random, scores = np.random.default_rng(0), np.zeros((400, problem.start.size))
    for i, (e, block) in enumerate(zip(problem.observations, solution.blocks, strict=True)):
        k, step = e.channels.index("theta_out_rad"), e.given.recording.encoder_step_rad["theta_out_rad"]
        place = e.modelled(problem.values_of(solution.x, i))[k] / step + random.uniform(size=(400, 1))
        errors = (np.floor(place) + 0.5 - place) * step / e.sigma[k] * np.sqrt(problem.weight(e))
        scores[:, block.columns] += errors @ block.derivatives[k]
    information, _ = information_and_gradient(problem, solution.x, solution.blocks)
    moved = scores @ np.linalg.inv(information)
    shared = slice(0, len(problem.shared))
    np.testing.assert_allclose(np.diag(said)[shared], moved.var(axis=0)[shared], rtol=0.25)


def test_a_variance_from_few_draws_of_the_drives_motion_is_wider(solved):
    """By Student's quantile over the normal one, squared: draws that come four times say the same of the variance."""
    problem, solution = solved
    # With residuals of nothing, from which no draw subtracts.
    silent = replace(solution, blocks=[replace(b, errors=np.zeros_like(b.errors)) for b in solution.blocks])

    def with_draws(times):
        given = [replace(e.given, drive_deviations=np.tile(e.given.drive_deviations, (times, 1))) for e in each]
        drawn = [replace(e, given=one) for e, one in zip(each, given, strict=True)]
        return np.diag(covariance(Problem(drawn, problem.shared, problem.own), silent))[: len(problem.shared)]

    each = problem.observations
    draws = sum(len(e.given.drive_deviations) for e in each)
    wider = (student.ppf(0.95, draws) / student.ppf(0.95, 4 * draws)) ** 2
    assert (with_draws(1) - with_draws(0)) / (with_draws(4) - with_draws(0)) == pytest.approx(wider, rel=1e-3)
    assert wider > 1.01


def test_nine_out_of_ten_intervals_hold_the_truth():
    """A quick look at what `make coverage` counts with care: shared and own values of ten small batches together."""
    held = []
    for seed in range(300, 310):
        drawn = draw(seed, conditions=CONDITIONS[:2], duration_s=2.4)
        problem = problem_of(drawn)
        said = fit(problem)
        assert said.succeeded, said.message
        pairs = [(said.intervals[n], true) for n, true in drawn.shared.items()]
        for e, own in zip(problem.observations, drawn.own, strict=True):
            pairs += [(said.own_intervals[e.name][n], true) for n, true in own.items()]
        held += [i.low <= true <= i.high for i, true in pairs]
    # Not all of them are independent, so the limits are those of half as many, 1 in 1,000 either side.
    low, high = binom.ppf([1e-3, 1 - 1e-3], len(held) // 2, 0.9) / (len(held) // 2)
    assert low <= np.mean(held) <= high, f"{np.mean(held):.3f} of {len(held)}"


def test_ninety_percent_is_what_the_reach_says():
    assert pytest.approx(1.645, abs=1e-3) == REACH
