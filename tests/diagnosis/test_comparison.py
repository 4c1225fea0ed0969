"""Comparison, selection and verdict from given evidence, without model runs."""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ccmodel.deadline import UNLIMITED, Deadline
from ccmodel.diagnosis import comparison as comparisons
from ccmodel.diagnosis import selection as selections
from ccmodel.diagnosis.candidate import LAST_SEARCH, VALUES_STAY, CandidateFit
from ccmodel.diagnosis.comparison import Comparison, imitation, log_priors, priors_of_further
from ccmodel.diagnosis.discrepancy import Evidence
from ccmodel.diagnosis.hypothesis import PAPER, Hypothesis
from ccmodel.diagnosis.laws import Proposal
from ccmodel.diagnosis.repeatability import FrictionPValues
from ccmodel.diagnosis.result import alternatives_of
from ccmodel.diagnosis.screening import Score
from ccmodel.diagnosis.selection import Selection, contenders, lower
from ccmodel.diagnosis.settings import (
    CONTENDERS,
    DECIDED,
    LAW_FAR_BEHIND,
    MISSTATED_NOISE,
    PRIOR_AGREES,
    PRIOR_FURTHER,
    PRIOR_LAW,
    PRIOR_LISTED,
    SCATTER,
    SETTLED,
)
from ccmodel.diagnosis.verdict import judge, nested_choice, with_discretisation
from ccmodel.failure import ModelError
from ccmodel.inference.problem import Free
from ccmodel.mechanisms import laws
from made_observations import batch, calibrated

FRICTION, SCALE = ("pulley-friction", "drive-pulley"), ("torque-scale", "drive-sensor")
KINK, STRIBECK = ("kink", "conduit"), ("stribeck", "conduit")
STARTS = [
    {"torque-scale/drive-sensor/gain": 0.05},
    {f"pulley-friction/drive-pulley/{name}": 2e-3 for name in ("friction_torque", "presliding")}
    | {"pulley-friction/drive-pulley/share": 0.0},
]
BASE_VALUES = {"friction_coefficient": 0.15}
VALUES = {
    "pulley-friction/drive-pulley/friction_torque": 4e-3,
    "pulley-friction/load-pulley/friction_torque": 4e-3,
    "torque-scale/drive-sensor/gain": 0.05,
    "torque-scale/load-sensor/gain": 0.05,
    "kink/conduit/beta": 0.5,
    "presliding/conduit/z0": 5e-5,
    "presliding/conduit/spread": 4.0,
    "presliding/conduit/creep": 0.5,
    "stribeck/conduit/a": 0.2,
}
CHANNELS = ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N")
# Of samples that are the same in every channel, one is enough.
OBSERVATIONS = SimpleNamespace(channels=CHANNELS, tolerance_share=0.0, has_tolerance=False)
WHITENED = [SimpleNamespace(observations=OBSERVATIONS, measured=np.zeros((5, 1)))] * 8
# Log evidence at which nothing is left, and of something that is far from it.
NONE, FAR = -10.0, -500.0
SCREENED = 34
# Mean square, mechanism and log evidence.
SINGLES = [(90.0, KINK, -100.0), (95.0, SCALE, -110.0), (80.0, FRICTION, -120.0), (30.0, STRIBECK, -130.0)]


@pytest.fixture(autouse=True)
def repeats(monkeypatch):
    """Friction that differs between recordings as from run to run."""
    same = FrictionPValues(0.5, 0.5, 0.5)
    monkeypatch.setattr(comparisons, "friction_p_values", lambda whitened, residuals, is_fitted: same)


def fitted(mean_square, *acting, **values):
    """A fit whose residuals have one mean square in every channel of each recording."""
    own = {k: v for k, v in VALUES.items() if any(k.startswith(f"{n}/{p}/") for n, p in acting)} | values
    mean_squares = np.broadcast_to(np.asarray(mean_square, float), 8)
    residuals = list(np.sqrt(mean_squares)[:, None] * np.ones(5))
    return CandidateFit(
        Hypothesis(acting),
        WHITENED,
        {},
        BASE_VALUES | own,
        residuals,
        [],
        np.zeros((len(BASE_VALUES | own),) * 2),
        np.full(len(BASE_VALUES | own), np.inf),
        [BASE_VALUES] * 8,
        residuals,
    )


def evidence(complete=FAR, incomplete=FAR, size=0.0, resolution=0.01, **in_channel):
    return Evidence(complete, complete, incomplete, in_channel or {"tau_in_Nm": FAR}, size, resolution)


def compared(base, *candidates, whitened=WHITENED, screened=SCREENED, model=None):
    """Of the calibrated model's evidence and of pairs of a fit and its evidence."""
    base_fit = model or fitted(6.0)
    found = {base_fit.hypothesis: base} | {c.hypothesis: e for c, e in candidates}
    return Comparison(whitened, base_fit, [c for c, _ in candidates], found, screened)


def verdict(*given, **also):
    return judge(compared(*given, **also), [])


def test_nothing_missing():
    said = verdict(evidence(complete=NONE), (fitted(0.99, FRICTION), evidence(complete=NONE)))
    assert said.verdict == "agrees"
    assert verdict(evidence(complete=NONE)).verdict == "agrees"


def test_one_mechanism_leaves_nothing_and_nothing_else_does():
    found = verdict(evidence(), (fitted(1.0, FRICTION), evidence(NONE)), (fitted(4.0, SCALE), evidence()))
    assert found.verdict == "explained"
    assert found.best.hypothesis.acting == (FRICTION,)
    assert found.probability[0] > 0.99


def test_what_nobody_listed_competes_with_what_is_listed():
    friction = fitted(3.0, FRICTION)
    assert verdict(evidence(incomplete=NONE), (friction, evidence())).verdict == "unexplained"
    assert verdict(evidence(), (friction, evidence(FAR, NONE))).verdict == "unexplained"
    assert verdict(evidence(incomplete=NONE)).verdict == "unexplained"


def test_two_equally_good_candidates_are_undecided():
    found = verdict(evidence(), (fitted(1.0, FRICTION), evidence(NONE)), (fitted(1.0, SCALE), evidence(NONE)))
    assert found.verdict == "undecided"
    assert found.probability == pytest.approx([0.5, 0.5], abs=1e-3)


def test_a_mechanism_at_either_of_two_places_is_named():
    at_load = ("torque-scale", "load-sensor")
    found = verdict(evidence(), (fitted(1.0, SCALE), evidence(NONE)), (fitted(1.0, at_load), evidence(NONE)))
    assert found.verdict == "explained"
    assert max(found.probability) < DECIDED


def test_a_mechanism_at_a_second_place_has_a_confidence_of_its_own():
    """The set with both places is the most probable complete one, but one place alone may be all."""
    other = ("pulley-friction", "load-pulley")
    both, one = fitted(1.0, FRICTION, other), fitted(1.01, FRICTION)
    found = verdict(evidence(), (both, evidence(NONE)), (one, evidence(NONE - 3.0)))
    first, second = found.comparison.confidences(both.hypothesis)
    assert first == found.confidence_in("pulley-friction") >= DECIDED > second
    assert found.verdict != "explained" or found.best is not both


def test_a_set_that_leaves_nothing_is_outdone_by_none():
    """One bad channel makes the fit no good one, but a larger set leaves no less."""
    bad = np.full((8, 5), np.sqrt(0.7))
    bad[:, 1] = np.sqrt(2.4)
    single = replace(fitted(1.0, FRICTION), loo_residuals=list(bad))
    assert not single.is_good
    pair = fitted(1.0, FRICTION, KINK)
    of_both = compared(evidence(), (single, evidence(NONE)), (pair, evidence(NONE - 5.0)))
    assert of_both.unexplained_mean_square(single) == of_both.unexplained_mean_square(pair) == 0.0
    assert not of_both.is_outdone(single)


def test_no_recording_is_predicted_by_an_implausible_candidate():
    kink = fitted(0.5, KINK, **{"kink/conduit/beta": 50.0})
    found = verdict(evidence(), (fitted(1.0, FRICTION), evidence(NONE)), (kink, evidence(NONE)))
    assert found.verdict == "explained"
    assert {c.hypothesis.acting for c in nested_choice(found)} == {(FRICTION,)}


def test_a_set_in_another_order_is_the_same_set():
    pairs = fitted(1.2, FRICTION, KINK), fitted(1.1, KINK, FRICTION)
    found = comparisons.lowest(pairs)
    assert [c.hypothesis.acting for c in found] == [(KINK, FRICTION)]


def test_an_implausible_fit_of_a_set_takes_no_plausible_ones_place():
    high = fitted(1.1, KINK, **{"kink/conduit/beta": 50.0})
    assert comparisons.lowest([fitted(1.2, KINK), high])[0].is_plausible


def test_a_mechanism_has_the_probability_of_all_sets_that_contain_it():
    """Which of two look-alikes stands beside a mechanism is open; the mechanism itself is not."""
    sets = [(fitted(1.0, FRICTION, other), evidence(NONE)) for other in (SCALE, KINK)]
    found = verdict(evidence(), *sets)
    assert found.verdict == "undecided"
    shares = {a["name"]: a["confidence"] for a in alternatives_of(found, {})}
    assert shares["pulley-friction"] == pytest.approx(2 * shares["kink"], rel=0.05)
    assert shares["pulley-friction"] > DECIDED


@pytest.mark.parametrize(("error", "said"), [(1.2, "explained"), (1.3, "undecided")])
def test_what_may_be_missing_beside_a_good_fit_is_of_no_consequence(error, said):
    """The pair's members are certain; whether a third is missing is open, and matters only if the pair's fit is bad."""
    pair = fitted(error**2, FRICTION, KINK), evidence(NONE, size=0.1)
    sets = [(fitted(1.0, FRICTION, KINK, other), evidence(NONE + 12.0)) for other in (SCALE, STRIBECK)]
    found = verdict(evidence(), (fitted(300.0, KINK), evidence()), pair, *sets, model=fitted(3000.0))
    assert found.verdict == said
    assert {n for n in ("kink", "pulley-friction", "torque-scale") if found.confidence_in(n) > DECIDED} == {
        "kink",
        "pulley-friction",
    }
    if said == "explained":
        assert found.best is pair[0]


def test_a_single_bad_channel_makes_a_fit_bad():
    good = fitted(1.0, FRICTION)
    assert good.is_good
    assert good.by_channel == pytest.approx(dict.fromkeys(CHANNELS, 1.0))
    bad = replace(good, loo_residuals=[rows * [1, 1, 1.6, 1, 1] for rows in good.loo_residuals])
    assert bad.mean_square < 1.4
    assert not bad.is_good
    assert bad.by_channel["tau_out_Nm"] == pytest.approx(2.56)


@pytest.mark.parametrize(
    ("single", "larger", "said"),
    [(19.0, 15.0, "explained"), (19.0, 9.0, "undecided"), (1.4, 1.1, "explained")],
)
def test_what_a_larger_set_leaves_far_less_of_is_not_explained(single, larger, said):
    """The second mechanism imitates what the kink's equations leave, most probably; it leaves most of it or little."""
    kink = fitted(single, KINK), evidence(NONE - 30.0, size=single - 1.0)
    pair = fitted(larger, FRICTION, KINK), evidence(NONE, size=larger - 1.0)
    found = verdict(evidence(), kink, pair, model=fitted(3000.0))
    assert found.confidence_in("kink") > DECIDED
    assert found.confidence_in("pulley-friction") < 0.5
    assert found.verdict == said


@pytest.mark.parametrize(
    ("rival", "left", "said"), [(FAR, 1.3, "explained"), (NONE - 1.0, 1.3, "undecided"), (FAR, 3.0, "undecided")]
)
def test_a_set_that_alone_leaves_a_good_fit_is_named_although_something_unlisted_may_be_imitated(rival, left, said):
    """The last member leaves 4 % of what was there without it: it is more probable than not, but not certain."""
    kink, pair = (fitted(9.0, KINK), evidence(size=8.0)), (fitted(left, FRICTION, KINK), evidence(NONE, size=0.3))
    other = fitted(left, SCALE, KINK), evidence(rival, size=0.3)
    found = verdict(evidence(), kink, pair, other, model=fitted(600.0))
    assert found.verdict == said
    if said == "explained":
        assert found.best is pair[0]
        assert 0.5 < found.confidence_in("pulley-friction") < DECIDED


@pytest.mark.parametrize(("calibrated", "said"), [(1.6, "explained"), (1.45, "undecided")])
def test_a_good_fit_shows_nothing_where_the_calibrated_model_has_one(calibrated, said):
    kink, pair = (fitted(1.3, KINK), evidence(size=0.3)), (fitted(1.0, FRICTION, KINK), evidence(NONE, size=0.03))
    found = verdict(evidence(size=calibrated - 1.0), kink, pair, model=fitted(calibrated))
    assert min(map(found.confidence_in, ("kink", "pulley-friction"))) > 0.5
    assert found.verdict == said


@pytest.mark.parametrize(("deviation", "degrees", "named"), [(0.2, 9.0, True), (0.45, 9.0, False), (0.3, 1.0, False)])
def test_a_strength_that_scatters_between_recordings_is_not_named(deviation, degrees, named):
    """The deviation is in units of the strength; what is clear on ten recordings is not on two."""
    strength = fitted(1.0, FRICTION, KINK).values["pulley-friction/drive-pulley/friction_torque"]
    both = fitted(1.0, FRICTION, KINK)
    spreads = [deviation * strength if name.startswith("pulley-friction") else 0.0 for name in both.values]
    both = replace(both, covariance=np.diag(spreads) ** 2, degrees_of_freedom=np.full(len(spreads), degrees))
    t2 = deviation**-2
    expected = (degrees + 1) / 2 * np.log1p(t2 / degrees) - np.log(degrees + 1) / 2
    assert both.log_support(*FRICTION) == pytest.approx(expected)
    assert both.log_support(*KINK) == np.inf
    kink = fitted(1.3, KINK), evidence(NONE - 40.0, NONE - 45.0, size=0.3)
    found = verdict(evidence(), kink, (both, evidence(NONE)), model=fitted(600.0))
    assert (found.confidence_in("pulley-friction") > DECIDED) == named
    assert found.confidence_in("kink") > DECIDED


def test_the_strength_of_a_mechanism_with_a_state_is_what_is_left_of_it():
    """Strength 0.4, of which 0.1 is left; where both scatter together, that is known to a tenth."""
    acting = ("running-in", "conduit")
    one = fitted(1.0, acting, **{f"running-in/conduit/{n}": v for n, v in {"change": -0.4, "done": 0.75}.items()})
    names = list(one.values)
    change, done = names.index("running-in/conduit/change"), names.index("running-in/conduit/done")
    apart, together = np.zeros((2, len(names), len(names)))
    apart[change, change], apart[done, done] = 0.2**2, 0.125**2  # 0.05 each of what is left
    together[change, change], together[done, done] = apart[change, change], apart[done, done]
    together[change, done] = together[done, change] = -0.2 * 0.125 * 0.98
    degrees = np.full(len(names), 9.0)

    def support(covariance):
        return replace(one, covariance=covariance, degrees_of_freedom=degrees).log_support(*acting)

    assert support(apart) == pytest.approx(5 * np.log1p(2.0 / 9) - np.log(10) / 2)
    assert support(together) == pytest.approx(5 * np.log1p(100.0 / 9) - np.log(10) / 2)


@pytest.mark.parametrize(("degrees", "left"), [(9.0, 7.0), (2.5, 2.5)])
def test_a_strength_is_judged_for_the_shape_that_was_fitted(degrees, left):
    """Share, time and spread of a relaxation scatter together: each alone is known to a half, for the others to 0.1."""
    acting, names = ("relaxation", "cable"), ("r", "tau", "spread")
    values = dict(zip(names, (0.2, 30.0, 10.0), strict=True))
    given = values | {"relaxed": 0.0}
    one = fitted(1.0, acting, **{f"relaxation/cable/{n}": v for n, v in given.items()})
    every = list(one.values)
    at = [every.index(f"relaxation/cable/{n}") for n in names]
    spread = 0.5 * np.array(list(values.values()))
    covariance = np.zeros((len(every), len(every)))
    covariance[np.ix_(at, at)] = (0.96 + 0.04 * np.eye(3)) * np.outer(spread, spread)
    found = replace(one, covariance=covariance, degrees_of_freedom=np.full(len(every), degrees)).log_support(*acting)
    for_shape = 0.25 * (1 - 2 * 0.96**2 / 1.96)
    t2 = 1 / (for_shape if left < degrees else 0.25)
    assert found == pytest.approx((left + 1) / 2 * np.log1p(t2 / left) - np.log(left + 1) / 2)


def test_a_wider_interval_is_no_support():
    """Ten standard deviations of the scatter on 3 degrees; seven of an interval that counts every sample."""
    one = fitted(1.0, SCALE)
    k = list(one.values).index("torque-scale/drive-sensor/gain")

    def of(sd, degrees):
        covariance = np.zeros((len(one.values),) * 2)
        covariance[k, k] = sd**2
        return covariance, np.full(len(one.values), degrees)

    scatter, interval = of(0.005, 3.0), of(0.05 / 7, np.inf)
    by_scatter = replace(one, covariance=scatter[0], degrees_of_freedom=scatter[1])
    by_interval = replace(one, covariance=interval[0], degrees_of_freedom=interval[1])
    assert by_interval.log_support(*SCALE) == pytest.approx(24.5)
    assert by_scatter.log_support(*SCALE) == pytest.approx(2 * np.log1p(100 / 3) - np.log(2))
    assert replace(by_interval, jackknife=scatter).log_support(*SCALE) == by_scatter.log_support(*SCALE)


@pytest.mark.parametrize(("shift", "t2"), [(0.05, 1.0), (-0.05, 0.0), (0.0, 400.0)])
def test_a_strength_that_a_finer_solver_changes_by_as_much_is_not_supported(shift, t2):
    """Known to a twentieth on the usual solver, and twice as large or gone on the finer one."""
    one = fitted(1.0, SCALE)
    k = list(one.values).index("torque-scale/drive-sensor/gain")
    covariance, moved = np.zeros((len(one.values),) * 2), np.zeros(len(one.values))
    covariance[k, k], moved[k] = 0.0025**2, shift
    support = replace(one, covariance=covariance, shift=moved).log_support(*SCALE)
    assert support == pytest.approx(t2 / 2, rel=5e-3)
    assert replace(one, covariance=covariance).log_support(*SCALE) == pytest.approx(200.0)


def shifts(**by_name):
    """`discretisation_shift` with a shift of each strength by its mechanism, as a share of it."""

    def shift(candidate):
        names = [key.split("/")[0].replace("-", "_") for key in candidate.values]
        values = zip(names, candidate.values.values(), strict=True)
        return np.array([by_name.get(name, 0.0) * value for name, value in values])

    return shift


def known_to(share, candidate):
    """The candidate with each of its values known to a share of it."""
    variances = [(share * value) ** 2 for value in candidate.values.values()]
    return replace(candidate, covariance=np.diag(variances))


def test_a_verdict_names_nothing_that_is_a_discretisation_error(monkeypatch):
    friction, scale = (known_to(0.05, fitted(1.0, one)) for one in (FRICTION, SCALE))
    found = verdict(evidence(), (friction, evidence(NONE)), (scale, evidence(NONE - 4)))
    assert found.verdict == "explained"
    monkeypatch.setattr(comparisons, "discretisation_shift", shifts())
    stays, not_computed = with_discretisation(found)
    assert (stays.verdict, stays.best.hypothesis, not_computed) == ("explained", found.best.hypothesis, [])
    assert stays.best.shift is not None
    monkeypatch.setattr(comparisons, "discretisation_shift", shifts(pulley_friction=1.0))
    open_, _ = with_discretisation(found)
    assert open_.verdict == "undecided"
    assert 0.5 < open_.confidence_in("pulley-friction") < DECIDED


def test_of_two_mechanisms_the_one_that_is_no_discretisation_error_is_named(monkeypatch):
    """The part of a pair gets the discretisation error of its own values."""
    alone = known_to(0.05, fitted(1.5, FRICTION)), evidence(NONE - 40.0, NONE - 45.0, size=0.5)
    pair = known_to(0.05, fitted(1.0, FRICTION, SCALE)), evidence(NONE)
    found = verdict(evidence(), alone, pair, model=fitted(61.0))
    assert min(map(found.confidence_in, ("pulley-friction", "torque-scale"))) > DECIDED
    monkeypatch.setattr(comparisons, "discretisation_shift", shifts(torque_scale=1.0))
    later, _ = with_discretisation(found)
    assert later.confidence_in("torque-scale") < 0.5
    assert later.confidence_in("pulley-friction") > DECIDED
    assert all(c.shift is not None for c in later.candidates)


def test_a_finer_solver_that_fails_leaves_the_verdict_and_is_reported(monkeypatch):
    def fails(candidate):
        raise ModelError("no balance")

    found = verdict(evidence(), (known_to(0.05, fitted(1.0, FRICTION)), evidence(NONE)))
    monkeypatch.setattr(comparisons, "discretisation_shift", fails)
    same, not_computed = with_discretisation(found)
    assert same is found
    assert [(n["what"], n["why"]) for n in not_computed] == [("discretisation error of the values", "no balance")]


def test_the_strength_of_a_frozen_baselines_mechanism_is_its_change():
    """4.0 mN m, where the baseline has 3.9, with a standard deviation of 0.1: no clear change, though clearly there."""
    known = SimpleNamespace(name=FRICTION[0], place=FRICTION[1], values={"friction_torque": 3.9e-3, "presliding": 2e-3})
    observations = SimpleNamespace(**vars(OBSERVATIONS), parameters=SimpleNamespace(mechanisms=(known,)))
    whitened = [SimpleNamespace(observations=observations, measured=np.zeros((5, 1)))] * 8
    free = fitted(1.0, FRICTION, **{"pulley-friction/drive-pulley/presliding": 2e-3})
    k = list(free.values).index("pulley-friction/drive-pulley/friction_torque")
    covariance = np.zeros((len(free.values),) * 2)
    covariance[k, k] = (1e-4) ** 2
    j = list(free.values).index("pulley-friction/drive-pulley/presliding")
    covariance[j, j] = (1e-2) ** 2
    free = replace(free, whitened=whitened, covariance=covariance, degrees_of_freedom=np.full(len(free.values), 7.0))
    frozen = replace(free, hypothesis=Hypothesis((FRICTION,), baseline=(FRICTION,), is_frozen=True))
    assert free.log_support(*FRICTION) > 10
    assert frozen.log_support(*FRICTION) < 0
    # Its other parameter may be what has changed.
    covariance = covariance.copy()
    covariance[j, j] = (1e-4) ** 2
    values = frozen.values | {"pulley-friction/drive-pulley/presliding": 4e-3}
    assert replace(frozen, covariance=covariance, values=values).log_support(*FRICTION) > 10


def test_a_search_goes_on_from_what_may_be_an_imitation():
    """The pair takes off half of what the kink leaves, as an imitation would, and as one of three effects would."""
    kink, pair = (fitted(60.0, KINK), evidence(NONE - 100, NONE - 90, size=59.0)), fitted(30.0, KINK, SCALE)
    found = compared(evidence(), kink, (pair, evidence(NONE, NONE, size=29.0)), model=fitted(600.0))
    assert found.leading[0] is kink[0]
    assert found.by_evidence[0] is pair


def test_an_implausible_candidate_has_no_probability():
    wild = fitted(0.95, SCALE, **{"torque-scale/drive-sensor/gain": 5.0})
    found = verdict(evidence(), (fitted(1.0, FRICTION), evidence(NONE)), (wild, evidence(0.0)))
    assert found.best.hypothesis.acting == (FRICTION,)
    assert found.probability == pytest.approx([1.0, 0.0], abs=2e-3)
    assert found.nearest.hypothesis.acting == (FRICTION,)


def test_the_prior_is_shared_by_all_screened_mechanisms():
    friction = fitted(1.0, FRICTION), evidence(NONE)
    few, many = (compared(evidence(NONE), friction, screened=n).probability[0] for n in (1, 32))
    assert few / (1 - few) == pytest.approx(32 * many / (1 - many), rel=1e-3)


def test_the_priors_of_all_sets_and_of_what_is_unlisted_add_up_to_one():
    """Over any number of mechanisms, each set counted once; what is unlisted is at any place in the sequence."""
    sizes = range(60)
    # All sets of a size together: of as many mechanisms as there are, there is one.
    complete = sum(np.exp(log_priors(k, k)[0]) for k in sizes)
    unlisted = sum(np.exp(log_priors(k, k)[1]) for k in sizes)
    assert np.exp(log_priors(0, 34)[0]) == pytest.approx(PRIOR_AGREES)
    # The rest has two unlisted effects and more.
    assert 0.97 < complete + unlisted < 1.0


def test_friction_that_does_not_repeat_speaks_against_a_candidate(monkeypatch):
    monkeypatch.setattr(
        comparisons,
        "friction_p_values",
        lambda w, residuals, is_fitted: FrictionPValues(0.5, 1e-6 if residuals == "trend" else 0.5, 0.5),
    )
    drifts = replace(fitted(1.0, FRICTION), residuals="trend")
    found = verdict(evidence(), (drifts, evidence(NONE)), (fitted(1.0, SCALE), evidence(NONE)))
    assert found.candidates[0].hypothesis.acting == (SCALE,)
    assert found.probability[0] > 0.9


DRIFT = ("friction-drift", "conduit")


def test_friction_that_differs_between_recordings_is_something_unlisted(monkeypatch):
    """It leaves no residuals, since each recording has a friction of its own."""
    assert verdict(evidence(NONE), model=fitted(1.0)).verdict == "agrees"
    scatters = FrictionPValues(1e-3, 0.5, 1e-3)
    monkeypatch.setattr(comparisons, "friction_p_values", lambda w, residuals, is_fitted: scatters)
    assert verdict(evidence(NONE), model=fitted(1.0)).verdict == "unexplained"


@pytest.mark.parametrize("left, is_named", [(0.5, True), (0.02, False)])
def test_a_drift_accounts_for_how_friction_differs(left, is_named, monkeypatch):
    """`left` is the p-value of the scatter of friction about the drift."""
    p_values = {True: FrictionPValues(left, 0.5, left), False: FrictionPValues(1e-3, 1e-3, left)}
    monkeypatch.setattr(
        comparisons, "friction_p_values", lambda w, residuals, is_fitted: p_values[residuals == "drift"]
    )
    values = {"friction-drift/conduit/change": 0.15}
    drift = replace(fitted(1.0, DRIFT, **values), residuals="drift")
    found = verdict(evidence(NONE - 20, size=1.0), (drift, evidence(NONE)), model=fitted(2.0))
    assert (found.comparison.confidence_in(DRIFT[0]) >= DECIDED) == is_named
    assert (found.verdict == "explained") == is_named


def test_where_nothing_can_be_held_out_a_complete_model_has_less_probability():
    friction = fitted(1.0, FRICTION)
    given = evidence(), (friction, evidence(NONE, NONE))
    free = replace(fitted(6.0), free={"pretension_share": Free(1.0)})
    (usual,) = compared(*given).probability
    for found in (compared(*given, whitened=WHITENED[:1]), compared(*given, model=free)):
        assert found.probability == pytest.approx([0.75 * usual])
        assert found.unlisted == pytest.approx(1 - 0.75 * usual)
        assert judge(found, []).verdict == "undecided"


def test_a_tolerance_lowers_the_probability_in_proportion_to_its_share():
    def unlisted(share):
        allowing = SimpleNamespace(observations=SimpleNamespace(channels=CHANNELS, tolerance_share=share))
        return compared(evidence(), (fitted(1.0, FRICTION), evidence(NONE, NONE)), whitened=[allowing] * 8).unlisted

    assert all(less < more for less, more in itertools.pairwise(map(unlisted, (0.0, 0.01, 0.5, 1.0))))


def test_the_place_of_a_single_unknown_fault_is_that_of_its_channel():
    base = evidence(incomplete=NONE - np.log(2), tau_in_Nm=FAR, theta_out_rad=NONE)
    found = verdict(base, (fitted(3.0, FRICTION), evidence()))
    assert found.verdict == "unexplained"
    assert set(found.single_fault_places) == {"load-sensor"}


def test_what_takes_off_little_of_what_another_equation_leaves_is_not_named():
    """Its evidence is high, since it follows what is left better than the features of the discrepancy do."""
    base, kink = (fitted(60.0), evidence()), (fitted(3.0, KINK), evidence(NONE - 100, size=2.0))
    for left, named in ((2.6, (KINK,)), (1.05, (KINK, SCALE))):
        both = fitted(1 + left - 1, KINK, SCALE), evidence(NONE, size=left - 1)
        found = verdict(base[1], kink, both, model=base[0])
        assert tuple(m for m in (KINK, SCALE) if found.confidence_in(m[0]) > 0.5) == named


def test_what_one_member_imitates_leaves_the_others_named():
    """A second mechanism takes off a share that tells little; the first one took off nearly all."""
    alone = fitted(2.0, FRICTION), evidence(FAR, FAR, size=1.0)
    both = fitted(1.3, FRICTION, SCALE), evidence(FAR, NONE, size=0.3)
    found = judge(compared(evidence(size=100.0), alone, both, model=fitted(101.0)), [])
    assert found.comparison.unlisted > 0.5
    assert found.confidence_in("pulley-friction") > 0.8 > found.confidence_in("torque-scale")
    assert found.verdict == "undecided"


def test_what_an_imitation_of_a_remainder_leaves_is_not_unlisted():
    """A further mechanism takes off part of what a strong effect's equation leaves, and a little is left."""
    alone = fitted(1.1, FRICTION), evidence(NONE - 40, NONE - 40, size=0.06, resolution=0.1)
    both = fitted(1.05, FRICTION, SCALE), evidence(NONE - 5, NONE, size=0.02, resolution=0.1)
    found = compared(evidence(size=60.0), alone, both, model=fitted(61.0))
    assert found.unlisted < 0.4
    assert found.most_probable.hypothesis.acting == (FRICTION,)


def test_what_is_unlisted_may_be_imitated():
    """A mechanism that takes off half of what is missing has less probability than one that takes off nearly all."""
    halves, most = (
        compared(evidence(), (fitted(1 + left, SCALE), evidence(NONE, size=left)), model=fitted(61.0))
        for left in (20.0, 0.5)
    )
    assert halves.unlisted > 0.5
    assert most.unlisted < 0.2


def test_a_weak_mechanism_is_not_named():
    """Of an effect that no discrepancy shows, no share is known: it may be an imitation, as probably as a priori."""
    found = verdict(evidence(NONE - 20), (fitted(1.0, FRICTION), evidence(NONE)), model=fitted(1.01))
    assert found.verdict == "undecided"
    assert found.probability[0] == pytest.approx(imitation(0.0, 1.0, priors_of_further(False))[0], rel=1e-3)
    assert 0.5 < found.probability[0] < DECIDED


def test_the_laws_of_a_slot_are_learned_together_though_another_slots_law_is_the_most_probable():
    """Maps of one load cell by collinear arguments, beside friction of the drive's bearing."""
    arguments = ("reading", "drive-angle", "torque")
    of_cell = [(f"learned-sensor-map-F-drive-by-{argument}", "drive-sensor") for argument in arguments]
    bearing = ("learned-bearing-torque-by-speed", "drive-pulley")
    every = [(fitted(1.0, bearing), evidence(NONE)), *((fitted(1.0, one), evidence(NONE - 0.3)) for one in of_cell)]
    found = verdict(evidence(NONE - 40), *every)
    assert found.candidates[0].hypothesis.acting == (bearing,)
    assert found.verdict == "learned"
    assert found.best.hypothesis.acting[0] in of_cell


@pytest.mark.parametrize("law, said", [(NONE - 20, "explained"), (NONE, "undecided"), (NONE + 20, "learned")])
def test_a_weak_mechanism_is_named_if_no_law_does_as_well(law, said):
    """Laws were tried: what they describe is no imitation, but a candidate of its own."""
    direction = ("learned-sliding-friction-by-direction", "conduit")
    listed, learned = (fitted(1.0, FRICTION), evidence(NONE)), (fitted(1.0, direction), evidence(law))
    found = compared(evidence(NONE - 20), listed, learned, model=fitted(1.01))
    assert judge(found, []).verdict != "explained", "laws were fitted, but not all of them were tried"
    tried = replace(found, laws_beside=frozenset([found.base.hypothesis]))
    assert judge(tried, []).verdict == said


@pytest.mark.parametrize("before, left, is_more_probable", [(0.02, 0.005, True), (60.0, 0.0, True), (60.0, 3.0, False)])
def test_laws_say_nothing_for_a_mechanism_that_visibly_leaves_something(before, left, is_more_probable):
    """What is missing may then be no law of one quantity."""
    listed = fitted(1.0 + left, FRICTION), evidence(NONE, size=left)
    found = compared(evidence(size=before), listed, model=fitted(1.0 + before))
    tried = replace(found, laws_beside=frozenset([found.base.hypothesis]))
    assert (tried.probability[0] > found.probability[0]) == is_more_probable


def test_laws_beside_a_mechanism_say_nothing_of_another():
    alone, both = (fitted(3.0, FRICTION), evidence(NONE - 40)), (fitted(1.0, FRICTION, SCALE), evidence(NONE))
    found = compared(evidence(), alone, both)
    beside = [Hypothesis((one,)) for one in (FRICTION, SCALE)]
    before, of_part, of_other = (
        replace(found, laws_beside=frozenset(tried)).unlisted for tried in ([], beside[:1], beside[1:])
    )
    assert of_part < before
    assert of_other == before


def test_slips_that_no_feature_follows_are_left_all_the_same():
    found = compared(evidence(), (fitted(4.0, FRICTION), evidence(NONE, size=0.0)))
    assert found.unexplained_mean_square(found.candidates[0]) == pytest.approx(3.0 - MISSTATED_NOISE - SCATTER)
    noisy = compared(evidence(), (fitted(1.15, FRICTION), evidence(NONE, size=0.0)))
    assert noisy.unexplained_mean_square(noisy.candidates[0]) == 0.0


@pytest.mark.parametrize("with_laws", [False, True])
@pytest.mark.parametrize("has_part", [False, True])
def test_shares_have_proper_densities(has_part, with_laws):
    """Each of the three explanations has all of its shares, so that on average none is more probable than a priori."""
    shares = np.linspace(0, 1, 20001)
    for smallest in (0.003, 0.1, 1.0):
        priors = priors_of_further(has_part, laws_tried=with_laws)
        weights = np.array([imitation(share, smallest, priors) for share in shares])
        # The third has the same density at every share.
        densities = weights / weights[:, 2:]
        further, unlisted = PRIOR_FURTHER if has_part else 1.0, 1 - PRIOR_LISTED
        unlisted *= 1 - PRIOR_LAW if with_laws else 1.0
        expected = np.array([further * PRIOR_LISTED, 1 - further, further * unlisted]) / (further * unlisted)
        assert np.trapezoid(densities, shares, axis=0) == pytest.approx(expected, rel=0.05)


def test_a_fit_with_an_implausible_strength_is_no_reason_to_stop():
    """The only candidate leaves nothing, but its strength is beyond what it can be."""
    missing = evidence(incomplete=NONE, size=5.0)
    huge = fitted(1.0, FRICTION, **{"pulley-friction/drive-pulley/friction_torque": 1e3})
    found = compared(missing, (huge, evidence(NONE)))
    assert found.most_probable is found.base
    assert not found.is_adequate
    assert verdict(missing, (huge, evidence(NONE))).verdict == "unexplained"


@pytest.mark.parametrize(
    "mean_square, given, enough",
    [
        (1.05, evidence(NONE), True),
        (1.05, evidence(NONE, size=0.1), False),
        (1.5, evidence(NONE), False),
    ],
)
def test_a_further_mechanism_is_searched_for_where_something_is_left(mean_square, given, enough):
    assert compared(evidence(), (fitted(mean_square, FRICTION), given)).is_adequate == enough


@pytest.mark.parametrize(
    "mean_square, size, unlisted, is_settled",
    [
        (1.05, 0.0, NONE - 20, True),  # it leaves nothing
        (1.4, 0.2, NONE - 20, True),  # its equation is not exact
        (1.4, 0.2, NONE + 2, False),  # it is certain, but something may be missing beside it
        (3.0, 2.0, NONE + 2, False),  # nothing leaves a good fit
    ],
)
def test_laws_are_learned_where_what_is_certain_leaves_something(mean_square, size, unlisted, is_settled):
    given = evidence(NONE, unlisted, size=size)
    found = compared(evidence(size=60.0), (fitted(mean_square, FRICTION), given), model=fitted(61.0))
    assert found.is_settled == is_settled
    assert (found.certain is not None) == (mean_square < 1.5)


@pytest.mark.parametrize("left, learned", [(0.0, []), (0.4, ["a law"])])
def test_a_selection_ends_with_laws_where_what_is_certain_leaves_something(monkeypatch, left, learned):
    single = fitted(1.0 + left, FRICTION), evidence(NONE, NONE + 2, size=left)
    found, calls = compared(evidence(size=60.0), single, model=fitted(61.0)), []
    monkeypatch.setattr(Selection, "relinearise", lambda self, found: found)
    monkeypatch.setattr(Selection, "extended", lambda self, found, screening, size: found)
    monkeypatch.setattr(Selection, "learn", lambda self, found: calls.extend(self.laws) or found)
    assert Selection({}, [], laws=["a law"]).further(found, None) is found
    assert calls == learned


@pytest.mark.parametrize(
    "left, law, left_by_listed, is_proposed",
    [
        (0.0, NONE + 5, 0.4, False),  # it leads, and leaves nothing
        (0.4, NONE + 5, 0.4, True),  # it leaves something, with a good fit
        (0.0, NONE - 20, 0.4, True),  # it leaves nothing, but the listed mechanism leads
        (0.0, NONE - 20, 0.0, False),  # the listed mechanism leaves nothing
    ],
)
def test_laws_are_proposed_beside_what_is_listed_unless_one_of_them_leaves_nothing(
    monkeypatch, left, law, left_by_listed, is_proposed
):
    direction = ("learned-sliding-friction-by-direction", "conduit")
    listed = fitted(1.0 + left_by_listed, FRICTION), evidence(NONE, NONE, size=left_by_listed)
    learned = fitted(1.0 + left, direction), evidence(law, law, size=left)
    found, proposed = compared(evidence(size=60.0), listed, model=fitted(61.0)), []
    fits = iter([[learned[0]]])
    monkeypatch.setattr(
        selections, "proposals", lambda beside, *others: proposed.append(beside.hypothesis.acting) or []
    )
    monkeypatch.setattr(Selection, "fit_all", lambda *given: next(fits, []))
    both = compared(evidence(size=60.0), listed, learned, model=fitted(61.0))
    monkeypatch.setattr(Comparison, "with_candidates", lambda self, every: both)
    for step in ("relinearise", "beside_law"):
        monkeypatch.setattr(Selection, step, lambda self, found: found)
    assert Selection({}, [], laws=[laws()[direction[0]]]).learn(found) is both
    assert ((FRICTION,) in proposed) == is_proposed


def test_laws_that_leave_far_more_than_a_listed_set_are_followed_by_no_others():
    listed = fitted(2.0, FRICTION), evidence(NONE, size=1.0)
    found = compared(evidence(size=60.0), listed, model=fitted(61.0))
    far, near = fitted(41.0, ("learned-sliding-friction-by-direction", "conduit")), fitted(20.0, SCALE)
    assert selections.are_hopeless([far], found)
    assert not selections.are_hopeless([far, near], found)
    assert not selections.are_hopeless([], found)
    assert not selections.are_hopeless([far], compared(evidence(size=60.0), model=fitted(61.0)))


@pytest.mark.parametrize(("left", "is_tried"), [(4.0, True), (0.4, False)])
def test_a_law_and_a_mechanism_that_leave_much_may_be_two_laws(monkeypatch, left, is_tried):
    """The mechanism's own law may have another form; a second law is looked for beside the first by itself."""
    names = "learned-sliding-friction-by-direction", "learned-cable-stretch-by-tension"
    one, proposed, screened = (names[0], "conduit"), [], []
    alone = fitted(36.0, one), evidence(NONE - 9, NONE - 9, size=35.0)
    both = fitted(1.0 + left, one, FRICTION), evidence(NONE + 5, NONE + 5, size=left)
    found = compared(evidence(size=60.0), alone, both, model=fitted(61.0))
    assert found.leading[0] is both[0]
    monkeypatch.setattr(
        selections, "proposals", lambda beside, others, *_: proposed.append((beside, [w.name for w in others])) or []
    )
    monkeypatch.setattr(Selection, "_screened", lambda self, *given: screened.append(given))
    assert Selection({}, [], laws=[laws()[name] for name in names]).beside_law(found) is found
    assert proposed == ([(alone[0], [names[1]])] if is_tried else [])
    assert not screened


def test_the_leading_set_is_the_largest_that_leads_on_or_else_a_pair():
    kink, scale = (fitted(m, one) for m, one in ((60.0, KINK), (80.0, SCALE)))
    pair, triple = fitted(40.0, KINK, SCALE), fitted(15.0, KINK, SCALE, FRICTION)
    law = fitted(3.0, ("learned-sliding-friction-by-direction", "conduit"), KINK)

    def leading(*candidates):
        every = [(c, evidence(size=c.mean_square - 1.0)) for c in candidates]
        return selections.leading_set(compared(evidence(size=99.0), *every, model=fitted(100.0)))

    assert leading(kink, scale) is None
    assert leading(kink, scale, pair, law) is pair
    assert leading(kink, scale, pair, triple) is triple
    assert leading(kink, scale, pair, fitted(30.0, KINK, SCALE, FRICTION)) is pair
    assert leading(kink, scale, fitted(1.4, KINK, SCALE)) is None


def test_a_mechanism_of_the_leading_set_may_have_another_form(monkeypatch):
    """The kink's law is learned beside the friction, with which a single was fitted; the friction's beside nothing."""
    names = ("learned-sliding-friction-bend-by-position-along-conduit", "learned-cable-stretch-by-tension")
    of_bearing = "learned-bearing-torque-by-speed"
    friction, pair = fitted(60.0, FRICTION), fitted(20.0, KINK, FRICTION)
    every = [(c, evidence(size=c.mean_square - 1.0)) for c in (friction, pair)]
    found, proposed, asked = compared(evidence(size=99.0), *every, model=fitted(100.0)), [], []

    def propose(beside, own, *_):
        proposed.append((beside, [law.name for law in own]))
        return [Proposal(Hypothesis(((law.name, law.place),)), 1.0, {}) for law in own]

    monkeypatch.setattr(selections, "proposals", propose)
    monkeypatch.setattr(
        Selection, "fit_all", lambda self, whitened, beside, chosen: asked.append((beside, chosen)) or []
    )
    Selection({}, [], laws=[laws()[name] for name in (*names, of_bearing)])._other_forms(found, pair)
    assert proposed == [(friction, [names[0]])]
    assert [(beside, [s.hypothesis.names for s in chosen]) for beside, chosen in asked] == [(friction, [(names[0],)])]


def test_of_two_laws_none_is_by_itself():
    one, other = ("learned-sliding-friction-by-direction", "conduit"), ("learned-cable-stretch-by-tension", "cable")
    alone, two, beside = fitted(9.0, one), fitted(1.0, one, other), fitted(2.0, other, FRICTION)
    found = compared(evidence(), *((c, evidence()) for c in (alone, two, beside)), model=fitted(61.0))
    assert selections.law_by_itself(found, alone) is alone
    assert selections.law_by_itself(found, two) is None
    # It was never fitted without the mechanism.
    assert selections.law_by_itself(found, beside) is None


def test_what_may_be_an_imitation_competes_with_laws():
    """A mechanism that leaves nothing is identified without laws only with the probability `SETTLED`."""
    strong = compared(evidence(), (fitted(1.0, FRICTION), evidence(NONE)), model=fitted(61.0))
    weak = compared(evidence(NONE - 20), (fitted(1.0, FRICTION), evidence(NONE)), model=fitted(1.01))
    assert strong.probability[0] > SETTLED
    assert strong.is_settled
    assert weak.is_adequate
    assert not weak.is_settled
    # Certain by a good fit while something may be missing beside it, and not probable enough.
    between = evidence(NONE, NONE + 2), evidence(NONE - 1.5, NONE)
    doubtful = compared(
        evidence(), (fitted(1.0, FRICTION), between[0]), (fitted(1.0, SCALE), between[1]), model=fitted(61.0)
    )
    assert doubtful.certain is not None
    assert DECIDED <= doubtful.confidence_in(FRICTION[0]) < SETTLED
    assert not doubtful.is_settled


def test_a_discounted_mechanism_is_settled_with_a_discounted_probability():
    strong = (fitted([1.0], FRICTION), evidence(NONE))
    alone = compared(evidence(), strong, whitened=WHITENED[:1], model=fitted(61.0))
    assert alone.probability[0] < DECIDED
    assert alone.is_settled


def test_a_scattered_strength_is_not_supported_by_laws_that_were_tried(monkeypatch):
    """What differs from recording to recording as much as by chance is not identified."""
    monkeypatch.setattr(CandidateFit, "log_support", lambda self, name, place: 0.0)
    found = compared(evidence(), (fitted(1.0, FRICTION), evidence(NONE)), model=fitted(61.0))
    tried = replace(found, laws_beside=frozenset([found.base.hypothesis]))
    for one in (found, tried):
        assert one.probability[0] == pytest.approx(priors_of_further(False)[0], rel=1e-3)
        assert one.probability[0] < DECIDED


def test_a_law_imitates_what_is_no_law():
    """Of a small effect that only a law describes: it acts as probably as an unlisted effect is a law."""
    direction = ("learned-sliding-friction-by-direction", "conduit")
    found = compared(evidence(NONE - 20), (fitted(1.0, direction), evidence(NONE)), model=fitted(1.01))
    own, _, other = priors_of_further(False, is_law=True)
    assert own / (own + other) == pytest.approx(PRIOR_LAW)
    expected = imitation(0.0, 1.0, priors_of_further(False, is_law=True))[0]
    assert found.probability[0] == pytest.approx(expected, rel=1e-3)


def test_laws_count_as_tried_where_all_of_them_were():
    found = compared(evidence(NONE - 20), (fitted(1.0, FRICTION), evidence(NONE)), model=fitted(1.01))
    found = replace(found, discrepancy=object())
    every = {c.hypothesis: found.evidence[c.hypothesis] for c in [found.base, *found.candidates]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Comparison, "_evidence_of", lambda self, candidate: every[candidate.hypothesis])
        of_laws = ["a law"]
        in_time, late, without = (
            Selection({}, [], laws=laws_tried, deadline=deadline).with_laws(found, found.base, [])
            for laws_tried, deadline in ((of_laws, UNLIMITED), (of_laws, Deadline(0.0)), ([], UNLIMITED))
        )
        assert in_time.laws_beside == {found.base.hypothesis}
        assert in_time.with_candidates([]).laws_beside == {found.base.hypothesis}
    assert late.laws_beside == without.laws_beside == frozenset()


def test_a_law_far_behind_a_listed_mechanism_is_fitted_only_where_effects_are_large(monkeypatch):
    monkeypatch.setattr(selections, "NormalEquations", SimpleNamespace(of=evidence_to_first_order))
    listed, both = (fitted(1.0, FRICTION), evidence(NONE)), (fitted(1.0, FRICTION, SCALE), evidence(NONE))
    impossible = fitted(1.0, SCALE, **{"torque-scale/drive-sensor/gain": 9.0}), evidence(NONE)
    small, large = (compared(evidence(NONE - 20), listed, impossible, model=fitted(size)) for size in (1.01, 9.0))
    assert selections.least_evidence(small) == pytest.approx(40.0 - LAW_FAR_BEHIND)
    assert selections.least_evidence(large) == -np.inf
    assert selections.least_evidence(compared(evidence(NONE - 20), model=fitted(1.01))) == -np.inf
    pair = compared(evidence(NONE - 20), both, model=fitted(1.01))
    behind = pair.log_prior(1) - pair.log_prior(2)
    assert behind > 3.0
    assert selections.least_evidence(pair) == pytest.approx(50.0 - behind - LAW_FAR_BEHIND)


def evidence_to_first_order(candidate):
    given = {(): -60.0, (FRICTION[0],): -20.0, (SCALE[0],): 30.0, (FRICTION[0], SCALE[0]): -10.0}
    return SimpleNamespace(log_evidence=given[candidate.hypothesis.names])


def test_laws_that_are_learned_are_those_in_reach_and_count_as_tried(monkeypatch):
    """Of a calibrated model with a good fit, and beside a listed mechanism that leaves something."""
    direction = laws()["learned-sliding-friction-by-direction"]
    acting = Hypothesis(((direction.name, "conduit"),))
    monkeypatch.setattr(selections, "NormalEquations", SimpleNamespace(of=evidence_to_first_order))
    monkeypatch.setattr(
        selections,
        "proposals",
        lambda *given: [Proposal(acting, value, {}) for value in (31.0, 29.0)] if given[1] else [],
    )
    asked = []
    monkeypatch.setattr(Selection, "fit_all", lambda *given: asked.append(len(given[3])) or [])
    for step in ("relinearise", "beside_law"):
        monkeypatch.setattr(Selection, step, lambda self, found: found)
    listed = fitted(1.1, FRICTION), evidence(NONE, NONE, size=0.1)
    found = compared(evidence(size=0.5), listed, model=fitted(1.5))
    every = {c.hypothesis: found.evidence[c.hypothesis] for c in [found.base, *found.candidates]}
    monkeypatch.setattr(Comparison, "_evidence_of", lambda self, candidate: every[candidate.hypothesis])
    learned = Selection({}, [], laws=[direction]).learn(replace(found, discrepancy=object()))
    assert asked == [1, 0, 2]
    assert learned.laws_beside == {found.base.hypothesis, listed[0].hypothesis}


def test_nothing_is_learned_where_nothing_was_fitted(monkeypatch):
    """The time was over before, or no law could be proposed."""
    found = replace(compared(evidence(FAR, NONE)), discrepancy=object())
    assert not found.is_settled
    late = Selection({}, [], laws=["a law"], deadline=Deadline(0.0), sets_until=Deadline(0.0))
    assert late.further(found, None) is found
    monkeypatch.setattr(selections, "proposals", lambda *given: [])
    monkeypatch.setattr(Comparison, "_evidence_of", lambda self, candidate: found.evidence[candidate.hypothesis])
    assert Selection({}, [], laws=["a law"]).learn(found).candidates == []


def test_no_law_is_learned_where_nothing_is_missing():
    assert compared(evidence(complete=NONE)).is_settled
    assert compared(evidence(complete=NONE), (fitted(1.1, FRICTION), evidence(NONE - 10))).is_settled


def test_without_candidates_there_is_nothing_to_extend():
    assert compared(evidence(FAR, NONE)).is_adequate


def test_a_recording_is_predicted_by_the_choice_of_the_others():
    # The first recording alone speaks for the friction; without it the other one wins.
    friction = fitted([0.0, *[1.5] * 7], FRICTION)
    scale = fitted([9.0, *[1.4] * 7], SCALE)
    chosen = nested_choice(verdict(evidence(), (friction, evidence(NONE)), (scale, evidence(NONE))))
    assert chosen[0].hypothesis.acting == (SCALE,)
    assert chosen[1].hypothesis.acting == (FRICTION,)


def test_a_further_mechanism_is_not_credited_with_a_worse_minimum_of_a_part(monkeypatch):
    """The single mechanism was fitted before, and its search had ended at a worse minimum."""
    monkeypatch.undo()
    recordings = batch(lambda simulated: {"tau_in_Nm": 0.1 * simulated["tau_in_Nm"]})
    base = calibrated(recordings)
    selection = Selection(base.free, [])
    (single,) = selection.fit_all(recordings, base, [Score(Hypothesis((SCALE,)), 0.0, STARTS[0])])
    stuck = replace(
        single, loo_residuals=[4 * e for e in single.loo_residuals], residuals=[4 * e for e in single.residuals]
    )
    (both,) = selection.fit_all(recordings, base, [Score(Hypothesis((SCALE, FRICTION)), 0.0, STARTS[0] | STARTS[1])])
    monkeypatch.setattr(Selection, "_sets", lambda *given: [both])
    found = selection.extended(Comparison.of(recordings, base, [stuck], SCREENED), None, 2)
    assert found.leading[0].hypothesis.acting == (SCALE,)
    assert found.leading[0].mean_square == pytest.approx(single.mean_square, rel=1e-3)


def test_partners_are_looked_for_again_beside_a_part_that_is_found_to_be_far_better(monkeypatch):
    stuck, pair, asked = fitted(5.0, KINK), fitted(3.0, KINK, SCALE), []
    monkeypatch.setattr(Selection, "_sets", lambda *given: [pair])
    monkeypatch.setattr(Selection, "_beside", lambda self, w, first, seen: asked.append((first, seen)) or [])
    monkeypatch.setattr(Comparison, "with_candidates", lambda self, every: found_with(every))

    def found_with(candidates):
        return compared(evidence(), *((c, evidence(NONE if c is pair else FAR)) for c in candidates))

    for part in (fitted(3.9, KINK), fitted(4.1, KINK)):
        monkeypatch.setattr(Selection, "_subsets", lambda *given, part=part: [part, fitted(1.5, SCALE)])
        Selection({}, []).extended(found_with([stuck]), None, 2)
        assert asked == ([(part, set())] if part.mean_square < 4.0 else [])
        asked.clear()


def test_the_set_that_leaves_least_is_extended_too(monkeypatch):
    """Far from the truth, the evidence may prefer a set that leaves more, but what a smooth discrepancy explains."""
    firsts = [(fitted(m, a), evidence(*2 * (e,), size=m)) for m, a, e in SINGLES]
    monkeypatch.setattr(Selection, "_beside", lambda self, w, first, seen: [first])
    extended = Selection({}, [])._sets(compared(evidence(), *firsts), SimpleNamespace(sets=lambda size: []), 2)
    assert [c.hypothesis.acting for c in extended] == [(KINK,), (SCALE,), (STRIBECK,)]


@pytest.mark.parametrize(
    ("left_by_pair", "until", "order"),
    [
        (10.0, UNLIMITED, ["set of 2", "set of 3", "set of 4", "laws"]),
        (25.0, UNLIMITED, ["set of 2", "laws", "set of 3", "set of 4"]),
        (10.0, Deadline(0.0), ["set of 2", "laws", "set of 2", "set of 3", "set of 4"]),
    ],
)
def test_laws_come_where_sets_do_not_lead_on_or_their_time_is_over(monkeypatch, left_by_pair, until, order):
    single = fitted(31.0, KINK), evidence(size=30.0)
    sets = [(KINK, SCALE), (KINK, SCALE, FRICTION), (KINK, SCALE, FRICTION, STRIBECK)]
    left = [left_by_pair, left_by_pair / 4, left_by_pair / 10]
    steps = []

    def of(size):
        pairs = zip(left[: size - 1], sets, strict=False)
        further = [(fitted(1 + m, *s), evidence(*2 * (NONE - 300 / len(s),), size=m)) for m, s in pairs]
        return compared(evidence(), single, *further, model=fitted(600.0))

    monkeypatch.setattr(Selection, "relinearise", lambda self, found: found)
    monkeypatch.setattr(Selection, "extended", lambda self, f, s, size: steps.append(f"set of {size}") or of(size))
    monkeypatch.setattr(Selection, "learn", lambda self, found: steps.append("laws") or found)
    Selection({}, [], laws=(None,), sets_until=until).further(of(1), None)
    assert steps == order


def of_three(all_three, singles=(50.0, 70.0, 95.0), pairs=(20.0, 40.0, 60.0)):
    """A rig with three effects: what single mechanisms, pairs and all three of them leave, of 100."""
    every = (FRICTION, SCALE, KINK)
    sets = zip([*((one,) for one in every), *itertools.combinations(every, 2)], [*singles, *pairs], strict=True)
    further = [(fitted(1 + left, *acting), evidence(-30 * left, -30 * left + 5, size=left)) for acting, left in sets]
    whole = fitted(1 + all_three, *every), evidence(NONE, NONE, size=all_three)
    return compared(evidence(-9e3, -9e3, size=100.0), *further, whole, model=fitted(101.0))


@pytest.mark.parametrize(("left", "least"), [(0.0, 0.95), (0.5, 0.9), (2.0, 0.65)])
def test_each_of_several_effects_is_judged_by_what_it_takes_off_beside_the_others(left, least):
    """The first takes off half by itself, and what is left then is the effect of the others."""
    found = of_three(left)
    assert min(found.confidence_in(name) for name, _ in (FRICTION, SCALE)) > least
    assert found.probability_of_base < 1e-6, "nothing says that all is explained without them"


def test_a_mechanism_that_a_second_one_imitates_is_judged_by_itself_too():
    """Either accounts for all, and both together for hardly more."""
    sets = [(fitted(1.02, FRICTION), 0.02), (fitted(1.03, SCALE), 0.03), (fitted(1.015, FRICTION, SCALE), 0.015)]
    given = [(c, evidence(NONE - 5 * (c.hypothesis.size - 1), NONE - 5, size=size)) for c, size in sets]
    found = compared(evidence(size=100.0), *given, model=fitted(101.0))
    assert found.confidence_in(FRICTION[0]) + found.confidence_in(SCALE[0]) > 0.9
    assert found.unlisted < 0.2


def test_the_set_that_leaves_least_stays_to_be_extended():
    far = compared(
        evidence(FAR, NONE, size=100.0),
        *((fitted(ms, one), evidence(log, log)) for ms, one, log in SINGLES),
        (fitted(31.0, ("presliding", "conduit")), evidence(-200.0, -200.0)),
        (fitted(96.0, ("pulley-friction", "load-pulley")), evidence(-115.0, -115.0)),
        model=fitted(101.0),
    )
    near, _ = contenders(far)
    assert STRIBECK in [c.hypothesis.acting[0] for c in near], "it leaves 30, and is fifth by its evidence"


def test_every_rival_of_a_complete_candidate_stays():
    """Of an incomplete one only the leading ones do, which lead on."""
    rivals = [(FRICTION, NONE), (KINK, -40.0), (SCALE, -50.0), (STRIBECK, -60.0), (("presliding", "conduit"), -70.0)]
    rivals.append((("pulley-friction", "load-pulley"), -80.0))
    assert len(rivals) > CONTENDERS

    def stay(incomplete):
        of = [
            (fitted(3.0, one), evidence(FAR if incomplete else log, log if incomplete else FAR)) for one, log in rivals
        ]
        near, far = contenders(compared(evidence(size=100.0), *of, model=fitted(101.0)))
        return len(near) + len(far)

    assert stay(incomplete=False) == len(rivals)
    assert stay(incomplete=True) == CONTENDERS


def test_values_that_stayed_are_no_minimum():
    before, now = fitted(10.0, FRICTION), fitted(5.0, FRICTION)
    assert lower([now], [before]) is now
    assert lower([now], [replace(before, message=VALUES_STAY)]) is None


def test_contenders_are_fitted_to_the_end_and_others_stay(monkeypatch):
    """A lower cost counts, also if the held-out mean square is a little higher."""
    best, hopeless = fitted(1.4, SCALE), fitted(60.0, FRICTION)
    found = compared(evidence(), (best, evidence(NONE, size=0.4)), (hopeless, evidence()))
    end, asked = fitted(1.45, SCALE), []
    monkeypatch.setattr(Selection, "fit_all", lambda *given, calibration: asked.append(given[3:]) or [end])
    monkeypatch.setattr(Comparison, "with_candidates", lambda self, every: every)
    assert Selection({}, []).completed(found) == [end, hopeless]
    assert asked == [([Score(best.hypothesis, 0.0, best.values)], LAST_SEARCH)]
    assert Selection({}, [], deadline=Deadline(0.0)).completed(found) is found, "some may not be fitted to the end"
    enough = compared(evidence(), (fitted(1.0, SCALE), evidence(NONE)))
    assert Selection({}, []).completed(enough) is enough


def test_the_covariance_is_linearised_about_the_best_candidate(monkeypatch):
    monkeypatch.undo()
    recordings = batch(lambda simulated: {"tau_in_Nm": 0.1 * simulated["tau_in_Nm"]})
    base = calibrated(recordings)
    selection = Selection(base.free, [])
    scores = [Score(Hypothesis((a,)), 0.0, values) for a, values in zip((SCALE, FRICTION), STARTS, strict=True)]
    candidates = selection.fit_all(recordings, base, scores)
    again = selection.relinearise(Comparison.of(recordings, base, candidates, SCREENED))
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

    # A rival that is far behind has its former values under the new covariance.
    monkeypatch.setattr(selections, "contenders", lambda found: (found.by_evidence[:1], found.by_evidence[1:]))
    compared_before = Comparison.of(recordings, base, candidates, SCREENED)
    assert [compared_before.is_far_behind(c) for c in candidates] == [False, True]
    rival = next(c for c in selection.relinearise(compared_before).candidates if c.hypothesis.acting == (FRICTION,))
    assert rival.values == pytest.approx(candidates[1].values, rel=1e-6, abs=1e-6)
    assert rival.whitened[0].shrinkage == pytest.approx(again.whitened[0].shrinkage)

    deadline = SimpleNamespace(has_passed=False, check=lambda: None)

    def in_time_for_one(self, *given, calibration):
        deadline.has_passed = True
        return candidates[:1]

    # Where the time is over, a rival has its former values under the new covariance.
    monkeypatch.setattr(Selection, "fit_all", in_time_for_one)
    monkeypatch.setattr(selections, "contenders", lambda found: (found.by_evidence, []))
    late_selection = Selection(base.free, [], deadline=deadline)
    found = late_selection.relinearise(Comparison.of(recordings, base, candidates, SCREENED))
    first, late = found.candidates
    assert first is candidates[0]
    assert late.hypothesis == candidates[1].hypothesis
    assert late.values == pytest.approx(candidates[1].values, rel=1e-6, abs=1e-6)
    assert late.whitened[0].shrinkage == pytest.approx(again.whitened[0].shrinkage)
    # So does one that cannot be run from them.
    deadline.has_passed = False
    monkeypatch.setattr(Selection, "fit_all", lambda *given, calibration: candidates[:1])
    failed = late_selection.relinearise(Comparison.of(recordings, base, candidates, SCREENED)).candidates[1]
    assert failed.values == pytest.approx(candidates[1].values, rel=1e-6, abs=1e-6)
    assert failed.message == VALUES_STAY
    # Where laws follow, all are fitted again with them.
    monkeypatch.setattr(Selection, "fit_all", in_time_for_one)
    deadline.has_passed = False
    before = Comparison.of(recordings, base, candidates, SCREENED)
    assert replace(late_selection, goes_on=True).relinearise(before) is before
    # What was tried before counts as tried.
    deadline.has_passed = False
    tried = Comparison.of(recordings, base, candidates, SCREENED, laws_beside=frozenset([base.hypothesis]))
    assert late_selection.relinearise(tried).laws_beside == {base.hypothesis}


@pytest.mark.parametrize(
    "behind, best",
    [(0.0, "pair"), (2.5, "pair"), (3.5, "single")],
    ids=["as much evidence", "less evidence", "far less evidence"],
)
def test_the_best_predictor_errs_least_of_what_evidence_hardly_tells_apart(behind, best):
    single, pair = fitted(1.5, FRICTION), fitted(1.2, FRICTION, SCALE)
    prior = log_priors(1, SCREENED)[0] - log_priors(2, SCREENED)[0]
    found = compared(evidence(), (single, evidence(-10.0)), (pair, evidence(-10.0 + prior - behind)))
    assert found.best_predictor is {"single": single, "pair": pair}[best]
    assert compared(evidence()).best_predictor.hypothesis == PAPER


def test_with_a_tolerance_the_search_goes_on_whatever_a_candidate_leaves():
    """The tolerance is estimated from what it leaves, and does not show whether something is missing beside it."""
    allowing = SimpleNamespace(channels=CHANNELS, tolerance_share=0.9, has_tolerance=True)
    within = [SimpleNamespace(observations=allowing)] * 8
    given = fitted(0.9, FRICTION), evidence(NONE)
    assert compared(evidence(), given).is_adequate
    assert not compared(evidence(), given, whitened=within).is_adequate
    assert compared(evidence(NONE), given, whitened=within, model=fitted(0.9)).is_adequate


def test_a_law_beside_which_something_is_missing_counts_once_as_unexplained():
    """A law is complete with 0.12 and incomplete with 0.2; two listed mechanisms are as probable as one another."""
    law = next(iter(laws().values()))
    shares = {
        (law.name, law.place): (0.12, 0.2),
        ("kink", "conduit"): (0.31, 0.0),
        ("stribeck", "conduit"): (0.31, 0.0),
    }
    candidates = [SimpleNamespace(hypothesis=Hypothesis((acting,))) for acting in shares]
    whole = {c.hypothesis.names[0]: sum(p) for c, p in zip(candidates, shares.values(), strict=True)}
    found = SimpleNamespace(
        base=None,
        candidates=candidates,
        probability=[complete for complete, _ in shares.values()],
        probability_of_base=0.0,
        unlisted=0.2 + 0.06,
        leading=candidates,
        best_predictor=candidates[1],
        most_probable=candidates[1],
        certain=None,
        best_of_list=None,
        faulty_channels={},
        confidence_in=whole.__getitem__,
        confidences=lambda hypothesis: [whole[name] for name, _ in hypothesis.acting],
        log_weight=lambda c: np.log(whole[c.hypothesis.names[0]]),
    )
    assert judge(found, []).verdict == "undecided"
    found.unlisted = 0.4
    assert judge(found, []).verdict == "unexplained"
