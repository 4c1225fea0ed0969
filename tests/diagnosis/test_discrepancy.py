"""Evidence of candidates beside a model discrepancy."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal

from ccmodel import mechanisms as registry
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.discrepancy import Discrepancy, Modes, Products, _log_evidence, evidence_of
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.normal_equations import NormalEquations, sample_weight
from ccmodel.diagnosis.settings import LARGEST_MISSING
from ccmodel.diagnosis.whitening import with_states_of
from ccmodel.inference.effective_samples import IN_EVIDENCE, prior_spread
from ccmodel.inference.problem import Free
from ccmodel.model.general import Active
from made_observations import PARAMETERS, batch, calibrated

EXCESS = 10.0


@pytest.fixture(scope="module")
def recordings():
    return batch()


@pytest.fixture(scope="module")
def discrepancy(recordings):
    return Discrepancy.of(recordings, calibrated(recordings))


def fitted(recordings, errors):
    """A candidate without unknowns whose residuals are noise and, in each channel, `errors` of the observations."""
    random = np.random.default_rng(1)
    residuals = []
    for k, w in enumerate(recordings):
        o = w.observations
        noise = random.standard_normal(o.measured.shape)
        residuals.append(w.whiten((noise + errors(k, o)).ravel()))
    jacobian = [np.zeros((len(e), 0)) for e in residuals]
    return CandidateFit(Hypothesis(), recordings, {}, {}, residuals, jacobian, np.eye(0), np.ones(0), [], residuals)


def following_the_drive(size):
    return lambda k, o: size * np.sin(4 * o.given.theta_in[o.judged])


def test_the_evidence_is_that_of_a_normal_distribution():
    """Of a few residuals with few features and unknowns, one of them off its prior's mean, by the density."""
    random = np.random.default_rng(3)
    F, J, e = random.standard_normal((12, 4)), random.standard_normal((12, 2)), random.standard_normal(12)
    prior_sd, variance = np.array([0.5, 2.0]), np.array([1.0, 0.3, 0.0, 0.7])
    from_mean = np.array([0.0, 1.3])
    modes = Modes.of(F.T @ F, variance)
    equations = NormalEquations(J.T @ J, J.T @ e, float(e @ e), prior_sd, from_mean)
    products = Products(equations, F.T @ J, F.T @ e)
    for size in (0.0, 0.2, 30.0):
        covariance = np.eye(12) + J @ np.diag(prior_sd**2) @ J.T + size * F @ np.diag(variance) @ F.T
        expected = multivariate_normal(J @ (prior_sd * from_mean), covariance).logpdf(e) + 6 * np.log(2 * np.pi)
        found = _log_evidence(products, modes.strength, modes.vectors.T @ F.T @ J, modes.vectors.T @ F.T @ e, size)
        assert found == pytest.approx(expected, rel=1e-9)


def test_scaled_equations_are_those_of_unknowns_in_another_unit():
    """The same as computed anew; in a larger unit a value is nearer to its prior's mean, whose deviation is 1 unit."""
    random = np.random.default_rng(5)
    J, e, factors = random.standard_normal((12, 3)), random.standard_normal(12), np.array([1.0, 0.1, 7.0])
    prior_sd, from_mean = np.array([0.5, 2.0, 1.0]), np.array([0.0, 1.3, 0.0])
    scaled = NormalEquations(J.T @ J, J.T @ e, float(e @ e), prior_sd, from_mean).scaled(factors)
    K, from_mean = J * factors, from_mean / factors
    anew = NormalEquations(K.T @ K, K.T @ e, float(e @ e), prior_sd, from_mean)
    assert scaled.log_evidence == pytest.approx(anew.log_evidence, rel=1e-12)
    covariance = np.linalg.inv(K.T @ K + np.diag(prior_sd**-2.0))
    change = -covariance @ (K.T @ e + from_mean / prior_sd)
    np.testing.assert_allclose(scaled.most_probable, change, rtol=1e-9)


def test_an_unknown_that_may_be_neutral_has_the_mean_evidence_of_a_model_with_it_and_one_without():
    random = np.random.default_rng(6)
    J, e, away = random.standard_normal((12, 3)), random.standard_normal(12), 0.4
    prior_sd, from_mean = np.array([0.5, 2.0, 1.0]), np.array([0.7, 0.2, 0.0])
    free = NormalEquations(J.T @ J, J.T @ e, float(e @ e), prior_sd, from_mean)
    at_neutral, rest = e - away * J[:, 1], J[:, [0, 2]]
    without = NormalEquations(
        rest.T @ rest, rest.T @ at_neutral, float(at_neutral @ at_neutral), prior_sd[[0, 2]], from_mean[[0, 2]]
    )
    mean = np.logaddexp(free.log_evidence, without.log_evidence) - np.log(2)
    optional = replace(free, from_neutral={1: away})
    assert optional.log_evidence == pytest.approx(mean, rel=1e-12)
    factors = np.array([3.0, 0.1, 2.0])
    scaled = NormalEquations(
        np.outer(factors, factors) * free.information, factors * free.score, free.square, prior_sd, from_mean / factors,
        {1: away / factors[1]},
    )  # fmt: skip
    assert optional.scaled(factors).log_evidence == pytest.approx(scaled.log_evidence, rel=1e-12)


def test_a_share_of_a_bearings_friction_may_be_zero():
    assert [p.name for p in registry.get("pulley-friction").parameters if p.optional] == ["share"]


def test_noise_has_no_discrepancy(recordings, discrepancy):
    found = evidence_of(discrepancy, fitted(recordings, lambda k, o: 0.0), 0.0, EXCESS)
    assert found.exact > found.incomplete + 2
    assert found.size <= 0.03


def test_errors_that_follow_the_drive_are_a_discrepancy(recordings, discrepancy):
    found = evidence_of(discrepancy, fitted(recordings, following_the_drive(1.0)), 0.0, EXCESS)
    assert found.incomplete > found.exact + 20
    assert found.size >= 0.1


def test_what_would_be_noticed_does_not_depend_on_what_is_there(recordings, discrepancy):
    noise, errors = (
        evidence_of(discrepancy, fitted(recordings, following_the_drive(size)), 0.0, EXCESS) for size in (0.0, 5.0)
    )
    assert noise.resolution == errors.resolution <= 0.1


def test_differences_from_run_to_run_are_less_of_one(recordings, discrepancy):
    """They cannot be a function of the rig's state."""
    signs = [1, -1, 1, -1]
    same = evidence_of(discrepancy, fitted(recordings, following_the_drive(1.0)), 0.0, EXCESS)
    apart = evidence_of(
        discrepancy, fitted(recordings, lambda k, o: signs[k] * following_the_drive(1.0)(k, o)), 0.0, EXCESS
    )
    assert apart.incomplete - apart.exact < 0.3 * (same.incomplete - same.exact)


def test_the_channel_of_a_single_fault_is_found(recordings, discrepancy):
    def errors(k, o):
        return np.array([[c == "tau_in_Nm"] for c in o.channels]) * following_the_drive(2.0)(k, o)

    found = evidence_of(discrepancy, fitted(recordings, errors), 0.0, EXCESS)
    assert max(found.in_channel, key=found.in_channel.get) == "tau_in_Nm"


def test_a_share_of_an_effect_may_be_left_by_its_equation(recordings, discrepancy):
    candidate = fitted(recordings, following_the_drive(0.7))
    strong, weak = (evidence_of(discrepancy, candidate, effect, EXCESS) for effect in (20.0, 0.02))
    assert strong.exact == weak.exact
    assert strong.other_law > strong.exact + 20
    assert weak.other_law < weak.exact + 20


def test_an_effect_below_the_least_size_leaves_no_share(recordings, discrepancy):
    found = evidence_of(discrepancy, fitted(recordings, lambda k, o: 0.0), 0.0, EXCESS)
    assert found.other_law == -np.inf


def test_the_tolerance_counts_once_for_all_recordings(recordings, discrepancy):
    """Errors that a tolerance allows are the same in every recording."""
    whole = fitted(recordings, following_the_drive(1.0))
    allowed = [replace(w, observations=_allowing(w.observations, 1.0)) for w in recordings]
    tolerated = replace(whole, whitened=allowed)
    by_noise, by_tolerance = (
        np.ptp(Discrepancy.of(c.whitened, calibrated(recordings)).log_evidence(c, [0.0, 1.0], {"tau_in_Nm": 1.0}))
        for c in (whole, tolerated)
    )
    assert by_tolerance < by_noise


@pytest.mark.parametrize(("share", "weight"), [(0.0, 1.0), (0.5, 0.625), (1.0, 0.25)])
def test_what_a_tolerance_allows_weighs_as_one_recording_of_all(recordings, share, weight):
    one = replace(recordings[0], observations=_allowing(recordings[0].observations, share))
    n = one.measured.shape[1]
    assert sample_weight(one, recordings=4) == pytest.approx(weight * IN_EVIDENCE / n)


def test_friction_between_batches_has_its_prior_in_the_evidence(recordings):
    """Five standard deviations cost 12.5, where the recordings determine it."""
    whole, key, spread = calibrated(recordings), "friction_scale@monday", 0.02
    prior = Free(1.0, 0.8, 1.25, prior_spread(spread, [w.observations for w in recordings]), mean=1.0)

    def at(value):
        # One row more, which is met.
        jacobian = [block_diag(J, 1e4) for J in whole.jacobian]
        residuals = [np.append(e, 0.0) for e in whole.residuals]
        values, free = whole.values | {key: value}, whole.free | {key: prior}
        return replace(whole, values=values, free=free, jacobian=jacobian, residuals=residuals)

    mean, away = (NormalEquations.of(at(value)).log_evidence for value in (1.0, 1.0 + 5 * spread))
    assert mean - away == pytest.approx(12.5, rel=1e-3)


@pytest.mark.parametrize("weight", [1.0, 0.2])
def test_the_states_of_a_mechanism_cost_their_determinant(recordings, weight):
    """That of the covariance with the states over that without, of residuals that all count alike."""
    worn = replace(
        PARAMETERS,
        mechanisms=(Active("running-in", "conduit", {"change": 0.1, "tau": 2.0, "per_m": 1.0, "done": 0.5}),),
    )
    plain, with_states = recordings[0], with_states_of(recordings[0], worn)
    assert plain.state_log_determinant(weight) == 0.0
    N, N0, states = with_states.effects, plain.effects, len(with_states.scalar_nuisances) - len(plain.scalar_nuisances)
    assert states > 0
    without = np.eye(len(N0)) + N0 @ N0.T
    own = N[:, [k for k, (name, *_) in enumerate(with_states.scalar_nuisances) if "/" in name]]
    information = own.T @ np.linalg.solve(without, own)
    expected = np.linalg.slogdet(np.eye(states) + weight * information)[1]
    assert expected > 0.5 * weight
    assert with_states.state_log_determinant(weight) == pytest.approx(expected, rel=1e-6)


def test_a_fault_in_one_channel_may_be_as_large_there_as_all_that_is_missing(recordings, discrepancy):
    """One channel of five that is off by five times the excess of all."""

    def of_one(k, o):
        error = np.zeros_like(o.measured)
        error[o.channels.index("tau_in_Nm")] = np.sqrt(10 * LARGEST_MISSING * EXCESS) * following_the_drive(1.0)(k, o)
        return error

    found = fitted(recordings, of_one)
    too_small = discrepancy.log_evidence(found, [LARGEST_MISSING * EXCESS], {"tau_in_Nm": 1.0})[0]
    assert evidence_of(discrepancy, found, 0.0, EXCESS).in_channel["tau_in_Nm"] > too_small


def test_a_fault_in_one_channel_of_three_may_be_small():
    """Three times the smallest discrepancy is a size of the grid but for its rounding."""
    alike = SimpleNamespace(
        channels=("a", "b", "c"),
        log_evidence=lambda c, sizes, s: np.zeros(len(sizes)),
        resolution=lambda c, sizes: 0.01,
    )
    assert all(np.isfinite(value) for value in evidence_of(alike, None, 0.0, 0.0).in_channel.values())


@pytest.mark.parametrize(("name", "parameter"), [("running-in", "done"), ("constant-drag", "s")])
def test_a_state_or_a_place_far_from_its_prior_costs_what_the_prior_says(recordings, name, parameter):
    """Two standard deviations cost 2, where the recordings determine it."""
    whole, key = calibrated(recordings), f"{name}/conduit/{parameter}"
    one = registry.get(name).parameter(parameter)
    hypothesis = Hypothesis(((name, "conduit"),))

    def at(value):
        jacobian = [block_diag(J, 1e4) for J in whole.jacobian]
        residuals = [np.append(e, 0.0) for e in whole.residuals]
        return replace(
            whole, hypothesis=hypothesis, values=whole.values | {key: value}, jacobian=jacobian, residuals=residuals
        )

    sd = one.spread or one.prior_sd
    mean, away = (NormalEquations.of(at(value)).log_evidence for value in (one.start, one.start + 2 * sd))
    assert mean - away == pytest.approx(2.0, rel=1e-3)


def _allowing(o, share):
    """The same observations with a tolerance that makes up a share of each variance."""
    sigma = np.ptp(o.measured, axis=1, keepdims=True) * np.ones_like(o.measured)
    return replace(o, sigma=sigma, tolerance=np.full(len(o.channels), np.sqrt(share)))
