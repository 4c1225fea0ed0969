"""Repeatability: conditions, spreads, and the tests of friction's deviations."""

from dataclasses import replace

import numpy as np
import pytest

import made_observations as made
from ccmodel.diagnosis import repeatability
from ccmodel.diagnosis.candidate import fit
from ccmodel.diagnosis.comparison import Comparison
from ccmodel.diagnosis.hypothesis import PAPER
from ccmodel.diagnosis.repeatability import (
    Deviations,
    between_p_value,
    conditions,
    corrected,
    deviating,
    deviations,
    estimated,
    friction_p_values,
    log_bayes_factor,
    relative_spread,
    report,
    sequences,
    trend_p_value,
    within_p_value,
    without_trend,
    zero_spread,
)
from ccmodel.diagnosis.result import deviating_friction
from ccmodel.diagnosis.result import report as diagnosed
from ccmodel.diagnosis.settings import MOST_SCATTER, SPREAD_FREEDOM, TREND_LEVEL
from ccmodel.diagnosis.spreads import FRICTION, PRETENSION
from ccmodel.diagnosis.verdict import Judgement
from ccmodel.diagnosis.whitening import relinearised, whiten
from ccmodel.inference.observations import Observations
from ccmodel.model.active import Active

# Significance level of these tests: no clean batch with the stated spread (1 %) scatters too much.
SCATTER_LEVEL = 0.005
ALONE = [[i] for i in range(9)]


def observed(values, variance=0.0):
    return Deviations(np.array(values, float), np.full(len(values), variance))


def trend(found):
    return trend_p_value(found, [range(found.values.size)])


def with_frictions(*ratios, pretensions=(7.0, 7.0, 5.0, 6.0, 7.0, 5.0, 6.0)):
    """Recordings of the model, each with its own friction; the first two are repeats."""
    truths = [replace(made.PARAMETERS, friction_scale=ratio) for ratio in ratios]
    return [made.whitened(0.6, 1.0, pretensions[k], seed=k, truth=truth) for k, truth in enumerate(truths)]


def calibrated(recordings):
    found = made.calibrated(recordings)
    return found, estimated(recordings, found.residuals)


def recorded(observations, **changed):
    """Observations of a changed recording."""
    recording = replace(observations.given.recording, **changed)
    return replace(observations, given=replace(observations.given, recording=recording))


def test_repeats_are_found_by_their_motion_conduit_and_pretension():
    every = [made.whitened(*at, seed=k).observations for k, at in enumerate((
        (0.6, 1.0, 7.0), (0.6, 1.0, 7.0), (0.6, 1.0, 5.0), (0.5, 1.0, 7.0), (0.6, 1.1, 7.0),
    ))]  # fmt: skip
    assert conditions(every) == [[0, 1], [2], [3], [4]]
    bent = recorded(every[1], path=every[1].given.recording.path.with_extra_bend(0.5))
    assert conditions([every[0], bent]) == [[0], [1]]


def test_recordings_under_other_measured_loads_are_no_repeats():
    one, other = (made.whitened(seed=k).observations.without("tau_out_Nm") for k in (0, 1))
    assert conditions([one, other]) == [[0, 1]]
    channels = other.given.recording.channels
    heavier = recorded(other, channels=dict(channels, tau_out_Nm=1.3 * channels["tau_out_Nm"]))
    assert conditions([one, heavier]) == [[0], [1]]


def test_recordings_are_in_the_order_of_their_starts():
    recordings = with_frictions(1.0, 1.0, 1.0)
    assert sequences(recordings) == [[0, 1, 2]]
    starts = zip(recordings, (30.0, 10.0, 20.0), strict=True)
    assert sequences([replace(w, observations=recorded(w.observations, started_at_s=s)) for w, s in starts]) == [
        [1, 2, 0]
    ]


def test_deviations_are_those_of_the_rig_and_not_shrunk():
    ratios = np.array([1.03, 0.99, 1.0, 0.98, 1.02])
    recordings = with_frictions(*ratios)
    found, repeatability = calibrated(recordings)
    values = deviations(recordings, found.residuals, FRICTION).values
    assert values - values.mean() == pytest.approx(100 * (ratios / ratios.mean() - 1), abs=0.7)
    again = [relinearised(w, found.model(made.PARAMETERS), repeatability) for w in recordings]
    assert again[0].scalar_nuisances[0][2] != pytest.approx(recordings[0].scalar_nuisances[0][2], rel=0.05)
    refitted = fit(again, PAPER, found.free, found.values)
    assert deviations(again, refitted.residuals, FRICTION).values == pytest.approx(values, abs=0.7)


def test_a_recording_is_linearised_about_its_own_friction():
    """Fifteen per cent are beyond the linear range: the errors that remain are those of the noise all the same."""
    recordings = with_frictions(1.0, 1.15, 1.0, 1.0, 1.0, pretensions=(7.0, 7.0, 7.0, 5.0, 5.0))
    found, repeatability = calibrated(recordings)
    again = [relinearised(w, found.model(made.PARAMETERS), repeatability) for w in recordings]
    truth = {"friction_coefficient": made.PARAMETERS.friction_coefficient}

    def mean_square(w):
        return np.mean(w.errors(truth)[: w.measured.size] ** 2)

    assert mean_square(recordings[1]) > 1.1 * mean_square(recordings[0])
    assert mean_square(again[1]) == pytest.approx(1.0, abs=0.1)


def test_the_spread_is_that_of_repeats_with_the_stated_one_as_prior():
    nu = SPREAD_FREEDOM
    found = relative_spread(FRICTION, observed([2.0, -2.0, 0.0]), [[0, 1], [2]])
    assert (found.ratio, found.source, found.recordings) == (pytest.approx(np.sqrt((nu + 8) / (nu + 1))), "repeats", 2)
    # The errors of the deviations are no difference of the rig.
    assert relative_spread(FRICTION, observed([2.0, -2.0, 0.0], 4.0), [[0, 1], [2]]).ratio == pytest.approx(
        np.sqrt(nu / (nu + 1)) * np.sqrt((nu + 4) / nu)
    )
    assert relative_spread(FRICTION, observed([0.1, 0.0, 0.0]), [[0, 1], [2]]).ratio < 1


def test_without_repeats_scatter_counts_up_to_a_limit():
    modest, wild = observed([1.8, -1.8] * 4), observed([9.0, -9.0] * 4)
    assert 1 < relative_spread(FRICTION, modest, ALONE[:8]).ratio < MOST_SCATTER
    assert relative_spread(FRICTION, wild, ALONE[:8]).ratio == MOST_SCATTER
    assert relative_spread(FRICTION, wild, ALONE[:8]).source == "scatter"
    assert relative_spread(FRICTION, observed([3.0, -3.0]), ALONE[:2]).source == "assumed"


def test_repeats_never_make_a_zero_better_than_its_stated_accuracy():
    assert zero_spread("tau_in_zero_Nm", observed([0.0, 0.0]), [[0, 1]]).ratio == 1.0
    assert zero_spread("tau_in_zero_Nm", observed([4.0, -4.0]), [[0, 1]]).ratio > 1.5


def test_the_stated_scatter_passes_and_many_times_as_much_does_not():
    draws = np.random.default_rng(1).standard_normal((200, 9))
    passed = {
        size: np.mean([between_p_value(observed(size * d), ALONE) > SCATTER_LEVEL for d in draws])
        for size in (1.0, 2.0, 8.0)
    }
    assert passed[1.0] == 1.0
    assert passed[2.0] > 0.95
    assert passed[8.0] < 0.1


def test_scatter_is_judged_by_that_of_repeats():
    groups = [[0, 1, 2, 3], [4], [5], [6], [7]]
    frictions = [0.0, 0.0, 0.0, 0.0, 6.0, -6.0, 5.0, -5.0]
    assert between_p_value(observed(frictions), groups) < SCATTER_LEVEL
    frictions[:4] = [4.0, -4.0, 4.0, -4.0]
    assert between_p_value(observed(frictions), groups) > SCATTER_LEVEL
    # Repeats that differ by far more than stated are no repeats.
    assert (
        within_p_value(observed([8.0, -8.0]), [[0, 1]])
        < SCATTER_LEVEL
        < within_p_value(observed([2.0, -2.0]), [[0, 1]])
    )


def test_a_trend_is_no_scatter():
    drift = np.linspace(-7.5, 7.5, 9) + np.random.default_rng(0).standard_normal(9)
    assert trend(observed(drift)) < TREND_LEVEL
    assert trend(observed(drift[np.random.default_rng(2).permutation(9)])) > TREND_LEVEL
    assert np.std(without_trend(observed(drift), [range(9)]).values) < 0.3 * drift.std()
    draws = np.random.default_rng(3).standard_normal((500, 9))
    assert np.mean([trend(observed(d)) < TREND_LEVEL for d in draws]) <= 0.01


def test_batches_of_different_length_keep_their_means_without_the_trend():
    drift = np.concatenate([np.linspace(-1, 1, n) * n for n in (3, 9)])
    left = without_trend(observed(drift), [range(3), range(3, 12)]).values
    assert abs(left[:3].mean() - left[3:].mean()) < 0.05
    assert left.std() < 0.3 * drift.std()


def test_the_error_of_a_mean_is_no_scatter_of_a_frozen_friction():
    """Nothing scatters: all that the frictions differ by is the error of their estimates."""
    draws = np.random.default_rng(5).standard_normal((2000, 9))
    low = [between_p_value(observed(d, variance=0.9), ALONE, is_fitted=False) < 0.05 for d in draws]
    assert np.mean(low) < 0.05


def test_a_trend_is_that_of_each_batch():
    """Batches one after another, each of which drifts alike and begins anew."""
    drift = np.tile(np.linspace(-4, 4, 5), 3) + np.random.default_rng(0).standard_normal(15)
    batches = [range(0, 5), range(5, 10), range(10, 15)]
    assert trend_p_value(observed(drift), batches) < TREND_LEVEL < trend(observed(drift))
    apart = np.repeat([-9.0, 0.0, 9.0], 5) + np.random.default_rng(1).standard_normal(15)
    assert trend(observed(apart)) < TREND_LEVEL < trend_p_value(observed(apart), batches)
    assert trend_p_value(observed([5.0, -5.0, 0.0, 1.0]), [[0], [1], [2], [3]]) == 1.0


def test_a_recording_that_does_not_determine_friction_does_not_count():
    values = [*np.linspace(-7.5, 7.5, 8), np.nan]
    assert trend(observed(values)) < TREND_LEVEL
    assert relative_spread(FRICTION, observed([3.0, np.nan, 0.0]), [[0, 1], [2]]).source == "assumed"


def test_an_initial_tension_that_is_not_observed_may_differ_from_run_to_run():
    o = made.whitened().observations
    channels = {c: v for c, v in o.given.recording.channels.items() if not c.startswith(("F_", "T"))}
    blind = Observations.of(replace(o.given.recording, channels=channels), made.PARAMETERS)
    names = {name: spread for name, _, spread in whiten(blind, made.PARAMETERS).scalar_nuisances}
    assert names[PRETENSION] == pytest.approx(0.01)
    assert PRETENSION not in {name for name, _, _ in made.whitened().scalar_nuisances}


@pytest.mark.parametrize("drift, repeats", [(0.0, True), (0.12, False)])
def test_friction_that_drifts_does_not_repeat(drift, repeats):
    recordings = with_frictions(*(1 + drift * np.linspace(-0.5, 0.5, 7)))
    found, repeatability = calibrated(recordings)
    assert found.mean_square < 1.5
    again = [relinearised(w, found.model(made.PARAMETERS), repeatability) for w in recordings]
    refitted = fit(again, PAPER, found.free, found.values)
    p = friction_p_values(again, refitted.residuals, True)
    assert (p.scatter > SCATTER_LEVEL and p.trend > TREND_LEVEL) == repeats
    assert p.about_trend > SCATTER_LEVEL


def test_the_friction_of_a_recording_that_deviates_is_said():
    for ratio, said in ((0.88, "12 % lower"), (1.12, "12 % higher")):
        ratios = [1.0, 1.0, 1.0, ratio, 1.0, 1.0, 1.0]
        recordings = with_frictions(*ratios)
        found, repeatability = calibrated(recordings)
        again = [relinearised(w, found.model(made.PARAMETERS), repeatability) for w in recordings]
        refitted = fit(again, PAPER, found.free, found.values)
        agrees = Judgement("agrees", refitted, Comparison(again, refitted, [], {}), [], [], [])
        (entry,) = diagnosed("b", agrees, refitted, made.PARAMETERS, [])["not_judged"]
        assert entry["what"] == again[3].observations.id
        percent, higher = float(entry["why"].split()[3]), said.split()[2]
        assert percent == pytest.approx(12.0, abs=1.5)
        assert f"% {higher} than in the others" in entry["why"]
        assert "check its bend" in entry["why"]


def test_no_friction_is_said_to_deviate_if_it_differs_as_from_run_to_run():
    recordings = with_frictions(1.01, 0.99, 1.0, 0.985, 1.015, 1.0, 1.0)
    found, repeatability = calibrated(recordings)
    again = [relinearised(w, found.model(made.PARAMETERS), repeatability) for w in recordings]
    assert deviating_friction(fit(again, PAPER, found.free, found.values)) == []


def test_recordings_that_deviate_from_the_others_are_few_and_clearly_apart():
    rest = np.random.default_rng(0).standard_normal(12)
    for size in (0, 1, 2, 3):
        values = rest.copy()
        values[:size] += 12.0
        assert deviating(observed(values)) == list(range(size))
    # Half of them are no exceptions to the other half, and neither is a wide scatter.
    assert deviating(observed([12.0, -12.0] * 6)) == []
    assert deviating(observed(5 * rest)) == []
    assert deviating(observed([12.0, *[np.nan] * 11])) == []
    # What the errors of the estimates account for is no deviation.
    assert deviating(observed([6.0, *rest[1:]])) == [0]
    assert deviating(observed([6.0, *rest[1:]], variance=9.0)) == []


@pytest.mark.parametrize(("order", "scatters"), [((0, 1, 2, 3, 4, 5, 6), False), ((3, 6, 1, 5, 0, 4, 2), True)])
def test_a_zero_that_drifts_through_the_repeats_of_a_condition_does_not_scatter(order, scatters):
    offsets = np.linspace(-1.0, 1.0, 7)[list(order)]
    truths = [
        replace(made.PARAMETERS, mechanisms=(Active("load-cell-offset", "load-sensor", {"offset": offset}),))
        for offset in offsets
    ]
    recordings = [made.whitened(0.6, 1.0, 7.0, seed=k, truth=truth) for k, truth in enumerate(truths)]
    _, found = calibrated(recordings)
    assert (found.ratio("F_load_zero_N") > 2) == scatters
    assert found.ratio("F_drive_zero_N") < 1.1


def test_recordings_are_rarely_said_to_deviate_from_run_to_run():
    draws = np.random.default_rng(1).standard_normal((2000, 9))
    assert 0 < np.mean([bool(deviating(observed(d))) for d in draws]) < 0.02


def test_the_deviations_of_friction_are_estimated_once_for_all_tests(monkeypatch):
    recordings = with_frictions(1.0, 1.01, 0.99, 1.0)
    found, _ = calibrated(recordings)
    calls = []
    monkeypatch.setattr(repeatability, "deviations", lambda *given: calls.append(1) or deviations(*given))
    p = friction_p_values(recordings, found.residuals, True)
    assert (len(calls), p.about_trend) == (1, p.scatter)
    comparison = Comparison(recordings, found, [], {})
    assert comparison.friction[found.hypothesis] == comparison.friction[found.hypothesis] == p
    assert len(calls) == 2


def test_the_report_says_what_was_assumed():
    recordings = with_frictions(1.0, 1.0, 1.0, 1.0)
    said = {row["what"]: row for row in report(recordings)}
    for what in ("friction from run to run", "zero of F_load from run to run"):
        assert (said[what]["from"], said[what]["recordings"]) == ("assumed", 0)
    assert said["noise of tau_in"]["value"] == pytest.approx(made.NOISE["tau_in_Nm"], rel=0.25)
    assert said["noise of tau_in"]["from"] in ("rest", "cycles")
    row = {"what": "friction from run to run", "value": pytest.approx(0.01), "unit": "1"}
    assert report(recordings)[0] == row | {"from": "assumed", "recordings": 0}
    found, repeatability = calibrated(recordings)
    rows = report([relinearised(w, found.model(made.PARAMETERS), repeatability) for w in recordings])
    assert (rows[0]["from"], rows[0]["recordings"]) == ("repeats", 2)
    assert rows[0]["value"] < 0.01


def test_the_smaller_p_value_of_two_is_corrected_for_their_number():
    draws = np.random.default_rng(0).uniform(size=(20_000, 2))
    found = np.array([corrected(pair) for pair in draws.tolist()])
    assert np.mean(found < 0.05) == pytest.approx(0.05, abs=0.005)
    assert corrected([0.05, 1.0]) == pytest.approx(1 - 0.95**2)
    assert corrected([0.05]) == pytest.approx(0.05)
    assert corrected([]) == corrected([1.0, 1.0]) == 1.0
    assert corrected([1e-300, 0.5]) == pytest.approx(2e-300)


def test_a_test_without_repeats_or_conditions_is_none():
    frictions = observed([3.0, -3.0, 3.0])
    assert within_p_value(frictions, [[0], [1], [2]]) is None
    assert between_p_value(frictions, [[0, 1, 2]]) is None


def test_an_unlikely_scatter_speaks_against_a_model_and_a_likely_one_for_nothing():
    assert log_bayes_factor(0.5) == log_bayes_factor(1.0) == 0.0
    assert log_bayes_factor(0.01) == pytest.approx(np.log(-np.e * 0.01 * np.log(0.01)))
    assert np.isfinite(log_bayes_factor(0.0))
    assert log_bayes_factor(1e-8) < log_bayes_factor(1e-4) < -5
