"""The verdict from what trials leave, without any model run."""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ccmodel.diagnose import comparison
from ccmodel.diagnose.candidate import CandidateFit, Score
from ccmodel.diagnose.comparison import (
    ENOUGH,
    RIVAL,
    SURE,
    Comparison,
    _fit_all,
    _looks,
    _names_more,
    _verdict,
    _weighed_anew,
    is_listed,
    nested_errors,
)
from ccmodel.diagnose.hypothesis import Hypothesis
from ccmodel.diagnose.lack_of_fit import LackOfFit
from ccmodel.inference.problem import Free
from made_observations import batch, calibrated

FRICTION, SCALE = ("pulley-friction", "drive-pulley"), ("torque-scale", "drive-sensor")
PROBES = [
    {"torque-scale/drive-sensor/gain": 0.05},
    {f"pulley-friction/drive-pulley/{name}": 2e-3 for name in ("friction_torque", "presliding")},
]
BASE_VALUES = {"friction_coefficient": 0.15}
VALUES = {"pulley-friction/drive-pulley/friction_torque": 4e-3, "torque-scale/drive-sensor/gain": 0.05}
CHANNELS = ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N")
WEIGHED = [SimpleNamespace(observations=SimpleNamespace(channels=CHANNELS, tolerance_share=0.0))] * 8


@pytest.fixture(autouse=True)
def would_do(monkeypatch):
    """What each part would leave beyond noise, were it at fault alone, and its places; none unless a test adds."""
    found = []
    monkeypatch.setattr(comparison, "cleared", lambda weighed, calibrated: found)
    return found


def trial(left, *acting, **values):
    own = {k: v for k, v in VALUES.items() if any(k.startswith(f"{n}/{p}/") for n, p in acting)} | values
    left = np.broadcast_to(np.asarray(left, float), 8)
    aside = list(np.sqrt(left)[:, None])
    return CandidateFit(
        Hypothesis(acting), {}, BASE_VALUES | own, [], [], np.eye(1), np.ones(1), [BASE_VALUES] * 8, aside
    )


def verdict(base, *trials, learnable=0.0):
    """Of trials that leave what they leave, and in that something to be learnt, the same in every recording."""
    trials = sorted(trials, key=lambda t: t.left.mean())
    unlearnt = {t.hypothesis: LackOfFit(np.full(8, learnable)) for t in (base, *trials)}
    return _verdict(Comparison(WEIGHED, base, trials, unlearnt), [])


def test_nothing_missing():
    assert verdict(trial(0.95), trial(0.94, FRICTION), trial(0.95, SCALE)).verdict == "agrees"
    assert verdict(trial(1.1)).verdict == "agrees"


def test_one_mechanism_brings_it_down_to_noise_and_nothing_else_does():
    found = verdict(trial(6.0), trial(1.0, FRICTION), trial(4.0, SCALE))
    assert found.verdict == "explained"
    assert found.best.hypothesis.acting == (FRICTION,)
    assert found.probability[0] > 0.99


def test_what_helps_one_recording_and_harms_others_is_not_missing():
    base = trial(1.1)
    learnt = trial([0.1, *[1.15] * 7], FRICTION)
    known = trial([0.1, *[1.1] * 7], FRICTION)
    assert learnt.left.mean() < 0.95 * base.left.mean()
    assert verdict(base, learnt).verdict == "agrees"
    assert verdict(base, known).verdict != "agrees"


def test_two_that_do_as_well_are_not_told_apart():
    found = verdict(trial(6.0), trial(1.0, FRICTION), trial(1.0005, SCALE))
    assert found.verdict == "undecided"
    assert sum(found.probability) == pytest.approx(1.0, abs=1e-6)


def test_a_mechanism_that_could_be_at_either_of_two_places_is_named():
    values = {"torque-scale/load-sensor/gain": 0.05}
    found = verdict(trial(6.0), trial(1.0, SCALE), trial(1.0005, ("torque-scale", "load-sensor"), **values))
    assert found.verdict == "explained"
    assert max(found.probability) < 0.8


def test_what_may_as_well_be_on_no_list_is_not_named_alone():
    """A list's best always takes something off a small excess; a large one is seldom met by chance."""
    weak = verdict(trial(1.4), trial(1.12, FRICTION))
    assert weak.verdict == "undecided"
    assert weak.probability[0] > SURE > weak.listed * weak.probability[0]
    assert verdict(trial(14.0), trial(1.12, FRICTION)).verdict == "explained"


def test_what_is_all_but_surely_on_no_list_is_unexplained():
    poor, hopeless = verdict(trial(6.0), trial(1.74, FRICTION)), verdict(trial(2.0), trial(1.54, FRICTION))
    assert min(poor.probability[0], hopeless.probability[0]) > SURE
    assert hopeless.listed < RIVAL < poor.listed < 0.5
    assert (poor.verdict, hopeless.verdict) == ("undecided", "unexplained")


def test_a_single_recording_gives_no_sure_name():
    """Nothing can be held out of it, so whatever is fitted is only fitted."""
    one = replace(trial(6.0), held_out=[BASE_VALUES], aside=[np.sqrt([6.0])])
    friction = replace(trial(1.0, FRICTION), held_out=[BASE_VALUES], aside=[np.ones(1)])
    unlearnt = {t.hypothesis: LackOfFit(np.zeros(4)) for t in (one, friction)}
    found = _verdict(Comparison(WEIGHED[:1], one, [friction], unlearnt), [])
    assert found.verdict == "undecided"
    assert found.listed * found.probability[0] < SURE
    assert nested_errors(found) == [friction]


def test_without_a_known_pretension_no_name_is_sure():
    blind = replace(trial(6.0), free={"pretension_share": Free(1.0)})
    friction = trial(1.0, FRICTION)
    unlearnt = {t.hypothesis: LackOfFit(np.zeros(8)) for t in (blind, friction)}
    found = _verdict(Comparison(WEIGHED, blind, [friction], unlearnt), [])
    assert found.verdict == "undecided"
    assert found.best is friction


def test_an_allowance_takes_from_what_is_sure_as_much_as_it_is_of_what_may_be_left():
    def sure(allowed):
        weighed = [SimpleNamespace(observations=SimpleNamespace(channels=CHANNELS, tolerance_share=allowed))] * 8
        base, friction = trial(6.0), trial(1.0, FRICTION)
        unlearnt = {t.hypothesis: LackOfFit(np.zeros(8)) for t in (base, friction)}
        return _verdict(Comparison(weighed, base, [friction], unlearnt), [])

    shares = [sure(allowed).listed for allowed in (0.0, 0.01, 0.5, 1.0)]
    assert all(more > less for more, less in itertools.pairwise(shares))
    assert sure(0.01).verdict == "explained"
    assert (sure(1.0).verdict, shares[-1] / shares[0]) == ("undecided", pytest.approx(0.75))


def test_the_list_is_the_less_likely_the_more_is_left_and_the_more_was_tried():
    base, lefts = trial(10.0), (0.95, 1.1, 1.4, 2.0, 5.0)
    odds = [is_listed(trial(left, FRICTION), base) for left in lefts]
    assert all(a > b for a, b in itertools.pairwise(odds))
    assert odds[0] > 0.98
    assert odds[-1] < 0.2
    assert all(is_listed(trial(left, FRICTION, SCALE), base) < p for left, p in zip(lefts[:3], odds, strict=False))


def test_a_single_that_leaves_a_little_too_much_is_asked_for_company():
    def asks(left):
        one = trial(left, FRICTION)
        nothing = {one.hypothesis: LackOfFit(np.zeros(8))}
        return Comparison(WEIGHED, trial(10.0), [one], nothing).wants_more

    assert asks(ENOUGH + 0.05)
    assert not asks(ENOUGH - 0.05)


def test_what_a_right_model_may_leave_is_one_look_at_it_however_often_it_is_seen():
    allowing = [SimpleNamespace(observations=SimpleNamespace(channels=CHANNELS, tolerance_share=1.0))] * 8
    assert _looks(allowing) == pytest.approx(_looks(WEIGHED) / 8)


def test_what_no_mechanism_brings_down_is_unexplained():
    assert verdict(trial(40.0), trial(30.0, FRICTION), trial(35.0, SCALE)).verdict == "unexplained"
    assert verdict(trial(5.0)).verdict == "unexplained"


@pytest.mark.parametrize("law_left, said", [(0.0, "agrees"), (0.05, "explained")])
def test_a_mechanism_that_takes_little_counts_if_law_was_left(law_left, said):
    base, scale = trial(0.93), trial(0.90, SCALE)
    unlearnt = {base.hypothesis: LackOfFit(np.full(8, law_left)), scale.hypothesis: LackOfFit(np.zeros(8))}
    assert _verdict(Comparison(WEIGHED, base, [scale], unlearnt), []).verdict == said


def test_what_leaves_something_to_be_learnt_is_not_the_explanation():
    assert verdict(trial(1.3), learnable=0.2).verdict == "unexplained"
    assert verdict(trial(3.0), trial(1.2, FRICTION), learnable=0.3).verdict == "unexplained"


def test_a_value_out_of_its_range_explains_nothing():
    wild = trial(1.0, FRICTION, **{"pulley-friction/drive-pulley/friction_torque": 0.5})
    assert verdict(trial(6.0), wild).verdict == "unexplained"


def test_a_rival_that_cannot_be_takes_nothing_from_one_that_can():
    wild = trial(0.95, SCALE, **{"torque-scale/drive-sensor/gain": 5.0})
    found = verdict(trial(6.0), trial(1.0, FRICTION), wild)
    assert found.verdict == "explained"
    assert found.best.hypothesis.acting == (FRICTION,)
    assert found.probability == pytest.approx([1.0, 0.0], abs=1e-6)
    assert found.nearest.hypothesis.acting == (FRICTION,)


def test_the_best_of_many_has_more_to_prove():
    """Of one recording, where the price of having asked so many is a few per cent of what is left."""
    one = [replace(t, held_out=[BASE_VALUES], aside=t.aside[:1]) for t in (trial(1.0), trial(0.9, FRICTION))]
    few, many = (Comparison(WEIGHED[:1], one[0], one[1:], {}, asked).probability[0] for asked in (1, 32))
    assert few / (1 - few) == pytest.approx(32 * many / (1 - many))


def test_a_pair_must_halve_what_its_members_leave():
    alone = trial(1.9, FRICTION)
    assert not _names_more(trial(1.6, FRICTION, SCALE), [alone])
    assert _names_more(trial(1.2, FRICTION, SCALE), [alone])


def test_a_recording_is_judged_by_what_the_others_chose():
    base = trial(6.0)
    # The first recording alone speaks for the friction; without it the other one wins.
    friction = trial([0.0, *[1.5] * 7], FRICTION)
    scale = trial([9.0, *[1.4] * 7], SCALE)
    chosen = nested_errors(verdict(base, friction, scale))
    assert chosen[0].hypothesis.acting == (SCALE,)
    assert chosen[1].hypothesis.acting == (FRICTION,)


def test_a_pair_must_leave_less_than_a_single():
    alone = [trial(9.0, FRICTION), trial(9.0, SCALE)]
    assert verdict(trial(10.0), trial(1.5, FRICTION), alone[1]).verdict == "explained"
    assert verdict(trial(10.0), trial(1.5, FRICTION, SCALE), *alone).verdict == "unexplained"
    assert verdict(trial(10.0), trial(1.2, FRICTION, SCALE), *alone).verdict == "explained"


def test_a_pair_that_a_single_fault_elsewhere_may_imitate_is_not_named(would_do):
    def of_pair():
        return verdict(trial(10.0), trial(1.0, FRICTION, SCALE), trial(9.0, FRICTION), trial(9.0, SCALE)).verdict

    would_do.append((ENOUGH, ("load-sensor",)))
    assert of_pair() == "explained"  # without that sensor something is left: it is not at fault alone
    would_do.append((0.1, ("load-sensor",)))
    assert of_pair() == "unexplained"
    would_do.append((0.1, ("drive-pulley", "drive-sensor")))
    assert of_pair() == "explained"  # both of the pair are faults of that part themselves


def test_a_pair_is_not_ruled_out_by_a_fault_that_the_list_has_a_name_for(would_do):
    """One of the pair would do by itself, where that fault sits: this is not on no list, but the second is not sure."""
    would_do.append((0.1, ("drive-sensor",)))
    both, other = trial(1.0, FRICTION, SCALE), trial(9.0, FRICTION)
    assert verdict(trial(10.0), both, other, trial(9.0, SCALE)).verdict == "unexplained"
    found = verdict(trial(10.0), both, other, trial(1.9, SCALE))
    assert (found.verdict, found.probability[0] > SURE) == ("undecided", True)


def test_recordings_are_weighed_anew_about_what_explains_them_best():
    recordings = batch(lambda said: {"tau_in_Nm": 0.1 * said["tau_in_Nm"]})
    base = calibrated(recordings)
    scores = [Score(Hypothesis((a,)), 0.0, probe) for a, probe in zip((SCALE, FRICTION), PROBES, strict=True)]
    trials = _fit_all(recordings, base.free, base, scores, lambda text: None)
    again = _weighed_anew(Comparison.of(recordings, base, trials), base.free, lambda text: None)
    assert again.trials[0].hypothesis.acting == (SCALE,)
    assert again.trials[0].values[f"{SCALE[0]}/{SCALE[1]}/gain"] == pytest.approx(0.1, abs=0.005)
    assert {t.hypothesis for t in again.trials} == {t.hypothesis for t in trials}
    assert again.base.left.mean() > again.trials[0].left.mean()
    assert again.weighed[0].observations.parameters == recordings[0].observations.parameters
    assert not np.allclose(again.weighed[0].shrink, recordings[0].shrink, rtol=1e-6)
