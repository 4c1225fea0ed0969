"""Comparison, selection and verdict from given mean squares, without model runs."""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ccmodel.diagnosis import comparison as comparisons
from ccmodel.diagnosis import verdict as verdicts
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.comparison import Comparison, improves_on_members, log_likelihood, well_specified
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.lack_of_fit import LackOfFit
from ccmodel.diagnosis.result import alternatives_of
from ccmodel.diagnosis.screening import Score
from ccmodel.diagnosis.selection import Selection, grows
from ccmodel.diagnosis.settings import RIVAL, SUFFICIENT, SURE
from ccmodel.diagnosis.verdict import judge, nested_choice
from ccmodel.inference.effective_samples import in_comparison
from ccmodel.inference.problem import Free
from ccmodel.mechanisms import get
from made_observations import batch, calibrated

FRICTION, SCALE = ("pulley-friction", "drive-pulley"), ("torque-scale", "drive-sensor")
KINK = ("kink", "conduit")
STARTS = [
    {"torque-scale/drive-sensor/gain": 0.05},
    {f"pulley-friction/drive-pulley/{name}": 2e-3 for name in ("friction_torque", "presliding")},
]
BASE_VALUES = {"friction_coefficient": 0.15}
VALUES = {
    "pulley-friction/drive-pulley/friction_torque": 4e-3,
    "torque-scale/drive-sensor/gain": 0.05,
    "kink/conduit/beta": 0.5,
    "presliding/conduit/z0": 5e-5,
    "presliding/conduit/spread": 4.0,
    "presliding/conduit/creep": 0.5,
    "stribeck/conduit/a": 0.2,
}
CHANNELS = ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N")
WHITENED = [SimpleNamespace(observations=SimpleNamespace(channels=CHANNELS, tolerance_share=0.0))] * 8


@pytest.fixture(autouse=True)
def isolated(monkeypatch):
    """Excess mean square without each part, and its places; none unless a test adds some."""
    found = []
    monkeypatch.setattr(verdicts, "isolate", lambda whitened, calibrated: found)
    return found


def fitted(mean_square, *acting, **values):
    own = {k: v for k, v in VALUES.items() if any(k.startswith(f"{n}/{p}/") for n, p in acting)} | values
    mean_squares = np.broadcast_to(np.asarray(mean_square, float), 8)
    residuals = list(np.sqrt(mean_squares)[:, None])
    return CandidateFit(
        Hypothesis(acting), WHITENED, {}, BASE_VALUES | own, [], [], np.eye(1), np.ones(1), [BASE_VALUES] * 8, residuals
    )


def verdict(base, *candidates, lack=0.0):
    """Of candidates with these mean squares and the same lack of fit in every recording."""
    ordered = sorted(candidates, key=lambda c: c.mean_square)
    lacks = {c.hypothesis: LackOfFit(np.full(8, lack)) for c in (base, *candidates)}
    return judge(Comparison(WHITENED, base, ordered, lacks), [])


def test_nothing_missing():
    assert verdict(fitted(0.95), fitted(0.94, FRICTION), fitted(0.95, SCALE)).verdict == "agrees"
    assert verdict(fitted(1.1)).verdict == "agrees"


def test_one_mechanism_brings_it_down_to_noise_and_nothing_else_does():
    found = verdict(fitted(6.0), fitted(1.0, FRICTION), fitted(4.0, SCALE))
    assert found.verdict == "explained"
    assert found.best.hypothesis.acting == (FRICTION,)
    assert found.probability[0] > 0.99


def test_a_mechanism_that_improves_one_recording_at_the_expense_of_others_is_not_named():
    base = fitted(1.1)
    learnt = fitted([0.1, *[1.15] * 7], FRICTION)
    known = fitted([0.1, *[1.1] * 7], FRICTION)
    assert learnt.mean_square < 0.95 * base.mean_square
    assert verdict(base, learnt).verdict == "agrees"
    assert verdict(base, known).verdict != "agrees"


def test_two_equally_good_candidates_are_undecided():
    found = verdict(fitted(6.0), fitted(1.0, FRICTION), fitted(1.0005, SCALE))
    assert found.verdict == "undecided"
    assert sum(found.probability) == pytest.approx(1.0, abs=1e-6)


def test_a_mechanism_at_either_of_two_places_is_named():
    values = {"torque-scale/load-sensor/gain": 0.05}
    found = verdict(fitted(6.0), fitted(1.0, SCALE), fitted(1.0005, ("torque-scale", "load-sensor"), **values))
    assert found.verdict == "explained"
    assert max(found.probability) < 0.8


def test_a_small_excess_may_be_an_imitation():
    """The best of many reduces a small excess by chance, a large one seldom."""
    weak = verdict(fitted(1.4), fitted(1.12, FRICTION))
    assert weak.verdict == "undecided"
    assert weak.probability[0] > SURE > weak.well_specified * weak.probability[0]
    assert verdict(fitted(14.0), fitted(1.12, FRICTION)).verdict == "explained"


def test_a_most_likely_imitation_is_unexplained():
    poor, hopeless = verdict(fitted(6.0), fitted(1.74, FRICTION)), verdict(fitted(2.0), fitted(1.54, FRICTION))
    assert min(poor.probability[0], hopeless.probability[0]) > SURE
    assert hopeless.well_specified < RIVAL < poor.well_specified < 0.5
    assert (poor.verdict, hopeless.verdict) == ("undecided", "unexplained")


def test_a_single_recording_is_at_most_undecided():
    """Nothing can be held out of it."""
    one = replace(fitted(6.0), loo_values=[BASE_VALUES], loo_residuals=[np.sqrt([6.0])])
    friction = replace(fitted(1.0, FRICTION), loo_values=[BASE_VALUES], loo_residuals=[np.ones(1)])
    lacks = {t.hypothesis: LackOfFit(np.zeros(4)) for t in (one, friction)}
    found = judge(Comparison(WHITENED[:1], one, [friction], lacks), [])
    assert found.verdict == "undecided"
    assert found.well_specified * found.probability[0] < SURE
    assert nested_choice(found) == [friction]


def test_without_an_observed_initial_tension_nothing_is_named():
    blind = replace(fitted(6.0), free={"pretension_share": Free(1.0)})
    friction = fitted(1.0, FRICTION)
    lacks = {t.hypothesis: LackOfFit(np.zeros(8)) for t in (blind, friction)}
    found = judge(Comparison(WHITENED, blind, [friction], lacks), [])
    assert found.verdict == "undecided"
    assert found.best is friction


def test_a_tolerance_lowers_the_confidence_in_proportion_to_its_share():
    def sure(allowed):
        whitened = [SimpleNamespace(observations=SimpleNamespace(channels=CHANNELS, tolerance_share=allowed))] * 8
        base, friction = fitted(6.0), fitted(1.0, FRICTION)
        lacks = {t.hypothesis: LackOfFit(np.zeros(8)) for t in (base, friction)}
        return judge(Comparison(whitened, base, [friction], lacks), [])

    shares = [sure(allowed).well_specified for allowed in (0.0, 0.01, 0.5, 1.0)]
    assert all(more > less for more, less in itertools.pairwise(shares))
    assert sure(0.01).verdict == "explained"
    assert (sure(1.0).verdict, shares[-1] / shares[0]) == ("undecided", pytest.approx(0.75))


@pytest.mark.parametrize("above", [-0.03, 0.0, 0.05, 2.0, 30.0])
@pytest.mark.parametrize("form, rate", [(0.6, 500.0), (10.0, 30.0), (0.01, 500.0)])
def test_the_likelihood_is_the_integral_over_the_model_form_error(above, form, rate):
    left = np.linspace(0.0, form, 400_001)
    simplified = np.trapezoid(np.exp(-rate * np.abs(above - left)), left) / form
    exact = np.exp(-rate * above)
    # Of a mean square far above both, the logarithm is all that is left.
    if (either := exact + simplified) > 0:
        assert log_likelihood(above, form, rate) == pytest.approx(np.log(either / 2), abs=1e-3)
    else:
        assert log_likelihood(above, form, rate) < -500


def test_without_a_model_form_error_the_likelihood_is_the_noises():
    assert log_likelihood(0.2, 0.0, 500.0) == log_likelihood(0.2, 1e-9, 500.0) == -100.0


def test_what_an_equation_misses_is_no_evidence_for_a_further_mechanism():
    """Stribeck friction leaves some of its effect; a second mechanism that takes part of that is not more probable."""
    left = get("stribeck").model_form_error * 100.0
    stribeck = ("stribeck", "conduit")
    base, alone = fitted(101.0), fitted(1.0 + 0.9 * left, stribeck)
    both, exact = fitted(1.0 + 0.4 * left, stribeck, FRICTION), fitted(1.0, stribeck, FRICTION)
    assert verdict(base, alone, both).best is alone
    # One that takes all of it is.
    assert verdict(base, alone, exact).best is exact


def test_friction_that_does_not_repeat_speaks_against_a_candidate(monkeypatch):
    """A candidate of lower mean square whose friction has a trend is less probable than one without."""
    base, drifts, repeats = fitted(20.0), fitted(1.0, FRICTION), fitted(1.005, SCALE)
    drifts = replace(drifts, residuals=["trend"])
    monkeypatch.setattr(
        comparisons, "friction_probabilities", lambda w, residuals, fitted: (0.5, 1e-6 if residuals else 0.5)
    )
    assert verdict(base, drifts, repeats).probability[0] > 0.9
    assert verdict(base, drifts, repeats).candidates[0] is repeats


def test_misspecification_is_more_likely_the_higher_the_mean_square_and_the_more_was_tried():
    base, mean_squares = fitted(10.0), (0.95, 1.1, 1.4, 2.0, 5.0)
    odds = [well_specified(fitted(mean_square, FRICTION), base, 0.0) for mean_square in mean_squares]
    assert all(a > b for a, b in itertools.pairwise(odds))
    assert odds[0] > 0.98
    assert odds[-1] < 0.2
    pairs = [well_specified(fitted(mean_square, FRICTION, SCALE), base, 0.0) for mean_square in mean_squares[:3]]
    assert all(pair < single for pair, single in zip(pairs, odds, strict=False))


def test_a_single_above_the_sufficient_mean_square_is_extended():
    def asks(left):
        one = fitted(left, FRICTION)
        nothing = {one.hypothesis: LackOfFit(np.zeros(8))}
        return not Comparison(WHITENED, fitted(10.0), [one], nothing).is_sufficient

    limit = SUFFICIENT + get(FRICTION[0]).model_form_error * (10.0 - SUFFICIENT)
    assert asks(limit + 0.05)
    assert not asks(limit - 0.05)


def test_the_tolerance_counts_once_for_all_recordings():
    allowing = [SimpleNamespace(observations=SimpleNamespace(channels=CHANNELS, tolerance_share=1.0))] * 8
    plain = in_comparison([w.observations for w in WHITENED])
    assert in_comparison([w.observations for w in allowing]) == pytest.approx(plain / 8)


def test_a_mean_square_that_no_mechanism_reduces_is_unexplained():
    assert verdict(fitted(40.0), fitted(30.0, FRICTION), fitted(35.0, SCALE)).verdict == "unexplained"
    assert verdict(fitted(5.0)).verdict == "unexplained"


@pytest.mark.parametrize("lack, said", [(0.0, "agrees"), (0.05, "explained")])
def test_a_small_gain_counts_if_it_removes_lack_of_fit(lack, said):
    base, scale = fitted(0.93), fitted(0.905, SCALE)
    lacks = {base.hypothesis: LackOfFit(np.full(8, lack)), scale.hypothesis: LackOfFit(np.zeros(8))}
    assert judge(Comparison(WHITENED, base, [scale], lacks), []).verdict == said


def test_a_candidate_with_lack_of_fit_explains_nothing():
    assert verdict(fitted(1.3), lack=0.2).verdict == "unexplained"
    assert verdict(fitted(3.0), fitted(1.2, FRICTION), lack=0.3).verdict == "unexplained"


def test_an_implausible_value_explains_nothing():
    wild = fitted(1.0, FRICTION, **{"pulley-friction/drive-pulley/friction_torque": 0.5})
    assert verdict(fitted(6.0), wild).verdict == "unexplained"


def test_an_implausible_candidate_has_no_probability():
    wild = fitted(0.95, SCALE, **{"torque-scale/drive-sensor/gain": 5.0})
    found = verdict(fitted(6.0), fitted(1.0, FRICTION), wild)
    assert found.verdict == "explained"
    assert found.best.hypothesis.acting == (FRICTION,)
    assert found.probability == pytest.approx([1.0, 0.0], abs=1e-6)
    assert found.nearest.hypothesis.acting == (FRICTION,)


def test_the_prior_is_shared_by_all_screened_mechanisms():
    """Of one recording, where the prior matters."""
    one = [
        replace(t, loo_values=[BASE_VALUES], loo_residuals=t.loo_residuals[:1])
        for t in (fitted(1.0), fitted(0.9, FRICTION))
    ]
    few, many = (Comparison(WHITENED[:1], one[0], one[1:], {}, asked).posterior[0] for asked in (1, 32))
    assert few / (1 - few) == pytest.approx(32 * many / (1 - many))


def test_a_pair_must_halve_the_excess_of_its_members():
    alone = fitted(1.9, FRICTION)
    assert not improves_on_members(fitted(1.6, FRICTION, SCALE), [alone])
    assert improves_on_members(fitted(1.2, FRICTION, SCALE), [alone])


def test_a_set_of_three_must_halve_the_excess_of_each_part_of_it():
    pairs = [fitted(3.0, FRICTION, SCALE), fitted(2.6, FRICTION, KINK), fitted(1.5, SCALE, KINK)]
    assert improves_on_members(fitted(1.2, FRICTION, SCALE, KINK), pairs)
    assert not improves_on_members(fitted(1.3, FRICTION, SCALE, KINK), pairs)


def test_the_form_error_of_a_set_is_a_share_of_the_effect_of_each_member():
    presliding = ("presliding", "conduit")
    singles = [fitted(50.0, presliding), fitted(20.0, KINK)]
    both = fitted(4.0, presliding, KINK)
    found = Comparison(WHITENED, fitted(100.0), [both, *singles], {})
    assert found.form_error(both) == pytest.approx(
        get("presliding").model_form_error * 16.0 + get("kink").model_form_error * 46.0
    )
    assert found.form_error(singles[0]) == pytest.approx(get("presliding").model_form_error * 50.0)
    assert found.form_error(found.base) == 0.0


def test_sets_grow_as_long_as_they_gain_evidence():
    """Three effects alike in size: no pair halves the excess of its members, and yet the pairs lead on."""
    singles = [fitted(3.2, one) for one in (FRICTION, SCALE, KINK)]
    pairs = [fitted(2.5, *two) for two in itertools.combinations((FRICTION, SCALE, KINK), 2)]
    assert not any(improves_on_members(pair, singles) for pair in pairs)
    found = Comparison(WHITENED, fitted(4.5), singles, {}, passed_over=pairs)
    assert grows(found, 2)
    assert not grows(found, 3)
    same = Comparison(WHITENED, fitted(4.5), singles, {}, passed_over=[fitted(3.195, FRICTION, SCALE)])
    assert not grows(same, 2)


def test_a_mechanism_has_the_probability_of_all_sets_that_contain_it():
    """Which of two look-alikes stands beside a mechanism is open; the mechanism itself is not."""
    sets = [fitted(1.0, FRICTION, SCALE), fitted(1.0, FRICTION, KINK)]
    found = verdict(fitted(9.0), *sets)
    assert found.verdict == "undecided"
    assert found.probability == pytest.approx([0.5, 0.5], abs=0.01)
    shares = {a["name"]: a["confidence"] for a in alternatives_of(found, {})}
    assert shares["pulley-friction"] == pytest.approx(2 * shares["kink"], rel=0.05)
    assert shares["pulley-friction"] > SURE


def test_a_recording_is_predicted_by_the_choice_of_the_others():
    base = fitted(6.0)
    # The first recording alone speaks for the friction; without it the other one wins.
    friction = fitted([0.0, *[1.5] * 7], FRICTION)
    scale = fitted([9.0, *[1.4] * 7], SCALE)
    chosen = nested_choice(verdict(base, friction, scale))
    assert chosen[0].hypothesis.acting == (SCALE,)
    assert chosen[1].hypothesis.acting == (FRICTION,)


def test_a_pair_must_come_closer_to_the_noise_than_a_single():
    alone = [fitted(9.0, FRICTION), fitted(9.0, SCALE)]
    assert verdict(fitted(10.0), fitted(1.5, FRICTION), alone[1]).verdict == "explained"
    assert verdict(fitted(10.0), fitted(1.5, FRICTION, SCALE), *alone).verdict == "unexplained"
    assert verdict(fitted(10.0), fitted(1.2, FRICTION, SCALE), *alone).verdict == "explained"


def test_a_pair_that_may_imitate_a_single_fault_is_not_named(isolated):
    def of_pair():
        return verdict(fitted(10.0), fitted(1.0, FRICTION, SCALE), fitted(9.0, FRICTION), fitted(9.0, SCALE)).verdict

    isolated.append((SUFFICIENT, ("load-sensor",)))
    assert of_pair() == "explained"  # without that sensor something is left: it is not at fault alone
    isolated.append((0.1, ("load-sensor",)))
    assert of_pair() == "unexplained"
    isolated.append((0.1, ("drive-pulley", "drive-sensor")))
    assert of_pair() == "explained"  # both of the pair are faults of that part themselves


def test_a_pair_is_undecided_if_a_mechanism_is_that_single_fault(isolated):
    """One of the pair is adequate alone at the place of that fault."""
    isolated.append((0.1, ("drive-sensor",)))
    both, other = fitted(1.0, FRICTION, SCALE), fitted(9.0, FRICTION)
    assert verdict(fitted(10.0), both, other, fitted(9.0, SCALE)).verdict == "unexplained"
    found = verdict(fitted(10.0), both, other, fitted(1.9, SCALE))
    assert (found.verdict, found.probability[0] > SURE) == ("undecided", True)


def test_a_further_mechanism_is_not_credited_with_a_worse_minimum_of_a_part(monkeypatch):
    """The single mechanism was fitted before, and its search had ended at a worse minimum."""
    recordings = batch(lambda simulated: {"tau_in_Nm": 0.1 * simulated["tau_in_Nm"]})
    base = calibrated(recordings)
    selection = Selection(base.free, [])
    (single,) = selection.fit_all(recordings, base, [Score(Hypothesis((SCALE,)), 0.0, STARTS[0])])
    stuck = replace(single, loo_residuals=[4 * e for e in single.loo_residuals])
    (both,) = selection.fit_all(recordings, base, [Score(Hypothesis((SCALE, FRICTION)), 0.0, STARTS[0] | STARTS[1])])
    monkeypatch.setattr(Selection, "_sets", lambda *given: [both])
    found = selection.extended(Comparison.of(recordings, base, [stuck]), None, 2)
    assert found.candidates[0].hypothesis.acting == (SCALE,)
    assert found.candidates[0].mean_square == pytest.approx(single.mean_square, rel=1e-3)
    assert both.hypothesis in [c.hypothesis for c in found.passed_over]


def test_the_covariance_is_linearised_about_the_best_candidate():
    recordings = batch(lambda simulated: {"tau_in_Nm": 0.1 * simulated["tau_in_Nm"]})
    base = calibrated(recordings)
    selection = Selection(base.free, [])
    scores = [Score(Hypothesis((a,)), 0.0, values) for a, values in zip((SCALE, FRICTION), STARTS, strict=True)]
    candidates = selection.fit_all(recordings, base, scores)
    again = selection.relinearise(Comparison.of(recordings, base, candidates))
    assert again.candidates[0].hypothesis.acting == (SCALE,)
    assert again.candidates[0].values[f"{SCALE[0]}/{SCALE[1]}/gain"] == pytest.approx(0.1, abs=0.005)
    # The other one leaves more than twenty times as much; it is not fitted again.
    assert [c.hypothesis.acting for c in again.candidates] == [(SCALE,)]
    assert again.base.mean_square > again.candidates[0].mean_square
    assert again.whitened[0].observations.parameters == recordings[0].observations.parameters
    assert not np.allclose(again.whitened[0].shrinkage, recordings[0].shrinkage, rtol=1e-6)
    # Once more only if a value has moved by more than its standard deviation.
    assert selection.relinearise(again) is again
    moved = replace(again.linearised_about, values=dict.fromkeys(again.linearised_about.values, 0.0))
    assert not replace(again, linearised_about=moved).is_linearised_about(again.candidates[0])
