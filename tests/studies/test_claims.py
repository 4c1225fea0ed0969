"""Claims on runs whose answer is known, and on too little to go by."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ccmodel.errors import last_cycle
from ccmodel.figures import save_figure
from ccmodel.repeats import Estimate, condition_of, difference, estimates, pooled_scatter
from ccmodel.studies.claims import model_alone, model_runs, study
from ccmodel.studies.claims.claim import Row, Verdict, spread_percent
from ccmodel.studies.claims.figure import _reach, model_figure, recordings_figure
from ccmodel.studies.claims.recordings import (
    _has_sign,
    _is_seen,
    _model_has_sign,
    _of_one_origin,
    _phases_seen,
    _sentence_and_rows,
    _Series,
    _with_interval,
)
from ccmodel.studies.claims.settings import Claims
from ccmodel.studies.claims.study import claims_of
from ccmodel.studies.loops.measures import measure
from ccmodel.studies.loops.settings import Measuring
from ccmodel.studies.variables import batches_by_origin
from model_runs import CABLE, STUDY

CLAIMS = Claims(bend="bend", pretension="pretension", radius="radius", small_percent=5.0, model=STUDY)
HOW = Measuring()


def pairs_over(paths_and_pretensions, scales=None):
    """Runs of the model as recordings, two repeats of each, and the model of both.

    `scales` are those of the friction of both repeats, by path; without them, a little more and less.
    """
    pairs = []
    for i, (path, pretension) in enumerate(paths_and_pretensions):
        study = STUDY.model_copy(update={"pretension_N": pretension, "amplitude_rad": 0.6})
        said = model_runs.run(CABLE, path, study, 0.05)
        for letter, scale in zip("ab", scales[i] if scales else (1.003, 0.997), strict=True):
            run = model_runs.run(replace(CABLE, friction_scale=scale), path, study, 0.05)
            pairs.append((replace(run, batch="b", id=f"r{i}-{letter}", origin="virtual-rig"), said))
    return pairs


def over_radii():
    """Paths with a loop of either radius in the middle, and the pretension of both."""
    studies = [STUDY.model_copy(update={"loop_radius_m": r}) for r in (0.0457, 0.0762)]
    return [(model_runs.placements(study)["in the middle"], 7.3) for study in studies]


@pytest.fixture(scope="module")
def found():
    even = model_runs.even
    pairs = {
        "bend": pairs_over([(even(STUDY, n * np.pi), 2.5) for n in (1, 2, 3)]),
        "pretension": pairs_over([(even(STUDY), T) for T in (0.3, 2.0, 7.0)]),
        "radius": pairs_over(over_radii()),
    }
    return {claim.name: claim for claim in claims_of(pairs, CABLE, CLAIMS, HOW)}


@pytest.mark.parametrize(
    "name", ["backlash-and-bend", "slope-and-bend", "slack-and-bend", "backlash-and-pretension", "slack-and-pretension",
             "phases-and-pretension", "radius", "loop-placement"]
)  # fmt: skip
def test_what_the_model_does_is_borne_out(found, name):
    assert found[name].borne_out == Verdict.YES


def test_recordings_of_the_model_hold_the_model_within_their_intervals(found):
    rows = found["backlash-and-bend"].rows
    assert all(row.low < row.model < row.high for row in rows)
    assert all(row.source == "recording (virtual rig, simulated)" for row in rows)


def test_the_deadband_knows_nothing_of_the_load_while_both_cables_are_taut(found):
    lost = [row.model for row in found["deadband-and-load"].rows if row.quantity == "lost_motion"]
    assert np.ptp(lost) < 1e-6 * np.mean(lost)


def test_a_trend_the_other_way_is_not_borne_out():
    """The longer loop first: what is called rising falls."""
    pairs = pairs_over([(model_runs.even(STUDY, n * np.pi), 2.5) for n in (2, 1)])
    swapped = [(replace(r, path=s.path), s) for (r, _), (s, _) in zip(pairs, pairs[::-1], strict=True)]
    claims = claims_of({"bend": swapped, "pretension": [], "radius": []}, None, CLAIMS, HOW)
    assert claims[0].borne_out == Verdict.NO


def test_a_flaw_of_the_rig_changes_the_recordings_claim_and_not_the_models():
    """What the model leaves out: the cable of the longest bend had hardly any friction when it was recorded."""
    paths = [(model_runs.even(STUDY, n * np.pi), 2.5) for n in (1, 2)]
    flawed = pairs_over(paths, [(1.0, 1.01), (0.2, 0.201)])
    claim = claims_of({"bend": flawed, "pretension": [], "radius": []}, None, CLAIMS, HOW)[0]
    assert claim.borne_out == Verdict.NO
    assert claim.by_model == Verdict.YES


@pytest.mark.parametrize("scales", [[(1.0, 1.01), (0.6, 0.61)], [(0.8, 1.2), (0.82, 1.22)]])
def test_radii_that_differ_in_friction_or_scatter_bear_the_claim_out_for_the_slope_alone(scales):
    """At a load with a spring the slope is that of the spring, whatever the friction."""
    flawed = pairs_over(over_radii(), scales)
    claims = claims_of({"bend": [], "pretension": [], "radius": flawed}, None, CLAIMS, HOW)
    (claim,) = (claim for claim in claims if claim.name == "radius")
    assert claim.borne_out == Verdict.PART
    assert claim.by_model == Verdict.YES


def test_what_the_model_alone_decides_has_no_second_verdict(found):
    assert {name for name, claim in found.items() if claim.by_model is None} == {
        "deadband-and-load",
        "loop-placement",
        "sections",
    }
    assert all(claim.by_model == Verdict.YES for claim in found.values() if claim.by_model is not None)


def test_without_recordings_nothing_is_determined_and_no_number_is_made_up():
    claims = claims_of({"bend": [], "pretension": [], "radius": []}, None, CLAIMS, HOW)
    assert {claim.borne_out for claim in claims} == {Verdict.OPEN}


def test_without_recordings_the_figures_can_still_be_drawn(tmp_path):
    claims = claims_of({"bend": [], "pretension": [], "radius": []}, None, CLAIMS, HOW)
    for name, figure in (("a", recordings_figure(claims, "")), ("b", model_figure(claims, {}))):
        save_figure(figure, tmp_path / f"{name}.png", tmp_path / f"{name}.svg")
    assert "no recording" in (tmp_path / "a.svg").read_text()
    assert "could not be run" in (tmp_path / "b.svg").read_text()


def test_the_figures_say_what_was_simulated(found, tmp_path):
    origins = batches_by_origin([("loops", "virtual-rig"), ("radius", "rig"), ("loops", "virtual-rig")])
    save_figure(recordings_figure(list(found.values()), origins), tmp_path / "a.svg")
    save_figure(model_figure(list(found.values()), model_runs.loop_placements(CABLE, STUDY)), tmp_path / "b.svg")
    said = (tmp_path / "a.svg").read_text()
    assert "recording (measured): radius; recording (virtual rig, simulated): loops" in said
    said = (tmp_path / "b.svg").read_text()
    assert "loop at the drive end" in said
    assert "simulated (no recording)" in said


def test_every_panel_shows_recordings_and_model(found):
    figure = recordings_figure(list(found.values()), "")
    for ax in figure.axes:
        drawn = {line.get_marker() for line in ax.lines if np.isfinite(np.asarray(line.get_ydata(), float)).any()}
        assert "_" in drawn, f"no model in the panel {ax.get_xlabel()}, {ax.get_ylabel()}"
        assert ax.containers, f"no recording in the panel {ax.get_xlabel()}, {ax.get_ylabel()}"


def test_a_panel_shows_how_far_the_load_lags_behind_the_drive(found):
    placed = model_runs.loop_placements(CABLE, STUDY)
    (panel,) = (ax for ax in model_figure(list(found.values()), placed).axes if "lag" in ax.get_ylabel())
    for line, run in zip(panel.lines, placed.values(), strict=True):
        cycle = run[last_cycle(run)]
        assert line.get_ydata() == pytest.approx(line.get_xdata() - cycle["theta_out_rad"])


def test_an_interval_reaches_as_far_above_a_spread_as_below_it(found):
    rows = [row for row in found["radius"].rows if row.quantity.endswith("_spread") and row.low is not None]
    assert rows
    for row in rows:
        assert row.high > row.value
        assert row.low == pytest.approx(max(0.0, 2 * row.value - row.high))


def test_one_value_of_the_model_has_no_trend():
    def of(*values):
        return _Series(
            [Row("width", "rad", str(k), float(k), "model", model=value) for k, value in enumerate(values)], []
        )

    assert _model_has_sign(of(1.0), 1) == _model_has_sign(of(None, 1.0), -1) == Verdict.OPEN
    assert _model_has_sign(of(1.0, 2.0), 1) == Verdict.YES
    assert _model_has_sign(of(1.0, 2.0), -1) == Verdict.NO


def test_without_repeats_there_is_no_interval_and_it_is_said():
    pairs = pairs_over([(model_runs.even(STUDY, n * np.pi), 2.5) for n in (1, 2)])[::2]
    claim = claims_of({"bend": pairs, "pretension": [], "radius": []}, None, CLAIMS, HOW)[0]
    assert claim.borne_out == Verdict.OPEN
    assert all(row.low is None and row.gap == "no repeats: no interval" for row in claim.rows)
    assert all(np.isfinite(row.value) for row in claim.rows)


def test_the_papers_sections_converge_to_the_exact_solver(found):
    few, many = (row.model for row in found["sections"].rows)
    assert many < few < 1.0


def test_sections_needed_hold_from_there_on():
    assert model_runs.sections_needed({4: 0.5, 8: 2.0, 16: 0.9, 32: 0.1}, 1.0) == 16
    assert model_runs.sections_needed({4: 3.0, 8: 2.0}, 1.0) is None


def test_scatter_is_pooled_over_conditions():
    scatter, freedom = pooled_scatter([[9.0, 11.0], [99.0, 101.0], [5.0]], relative=False)
    assert (scatter, freedom) == (pytest.approx(np.sqrt(2)), 2)
    mean = estimates([[9.0, 11.0], [99.0, 101.0]], relative=False)[0]
    # t of 2 degrees of freedom at 95 % is 2.92.
    assert mean.reach(0.9) == pytest.approx(2.92 * np.sqrt(2) / np.sqrt(2), rel=1e-3)
    assert pooled_scatter([[1.0], [2.0]], relative=True) == (0.0, 0)
    assert pooled_scatter([[0.0, 0.0], [9.0, 11.0]], relative=False)[1] == 1


def test_repeats_are_told_by_their_last_letter(found):
    recorded = pairs_over([(model_runs.even(STUDY), 7.0)])[0][0]
    assert condition_of(recorded) == "b/r0"
    assert condition_of(replace(recorded, id="t-7N")) == "b/t-7N"


def test_the_recordings_of_a_study_are_those_of_its_runs(monkeypatch):
    asked = {}
    monkeypatch.setattr(study, "claims_of", lambda pairs, parameters, *_: asked.update(pairs, of=parameters) or [])
    monkeypatch.setattr(study, "recordings_figure", lambda *_: None)
    monkeypatch.setattr(study, "model_figure", lambda found, loops: asked.update(loops=loops))
    monkeypatch.setattr(study, "batches_of", lambda pairs: "")
    runs = [
        SimpleNamespace(label=label, pairs=[label], fitted=SimpleNamespace(parameters=None))
        for label in ("radius", "bend", "pretension", "bend")
    ]
    study.judge(CLAIMS, runs, HOW)
    assert asked == {
        "bend": ["bend", "bend"],
        "pretension": ["pretension"],
        "radius": ["radius"],
        "of": None,
        "loops": {},
    }


def test_an_error_bar_ends_where_the_interval_does():
    row = Row("width", "rad", "a", 0.0, "model", value=3.0, low=1.0, high=4.0)
    assert _reach(3.0, row) == (2.0, 1.0)
    assert _reach(3.0, replace(row, low=None)) == _reach(3.0, replace(row, high=None)) == (0.0, 0.0)


def test_phases_are_seen_with_certainty_or_not_determined():
    """By the intervals of their shares, as other claims are decided."""
    seen = [_is_seen(Estimate(value, 0.5, 3, 2), CLAIMS) for value in (20.0, 1.5, 0.0)]
    certain = [_is_seen(Estimate(value, 0.01, 3, 2), CLAIMS) for value in (20.0, 1.5, 0.0)]
    assert seen == [True, None, None] and certain == [True, True, False]
    assert _phases_seen([True, True, False], [True, False, False]) == Verdict.YES
    assert _phases_seen([True, None, False], [True, False, False]) == Verdict.OPEN
    assert _phases_seen([True, None, True], [True, False, False]) == Verdict.NO
    assert _phases_seen([True, True, False], [True, True, False]) == Verdict.NO
    assert _is_seen(Estimate(20.0, 0.0, 0, 1), CLAIMS) is None, "no repeats"


@pytest.mark.parametrize(
    "seen_a, seen_b",
    [("-+-", "+--"), ("++-", "---"), ("+++", "+--"), ("++-", "+-+")],
    ids=["no IVa at the lowest", "no IVb at the lowest", "IVa at the highest", "IVb at the highest"],
)
def test_each_phase_at_each_end_of_the_pretensions_can_contradict(seen_a, seen_b):
    assert _phases_seen(*([mark == "+" for mark in seen] for seen in (seen_a, seen_b))) == Verdict.NO


def test_the_measured_recordings_of_a_study_are_judged_if_there_are_any():
    measured, simulated = ((SimpleNamespace(origin=origin), None) for origin in ("rig", "virtual-rig"))
    assert _of_one_origin([simulated, measured]) == [measured]
    assert _of_one_origin([simulated, simulated]) == [simulated, simulated]


@pytest.mark.parametrize(
    "quantity, value, ends", [("slack_share", 1.0, (0, 3)), ("slack_share", 99.0, (97, 100)), ("width", 1.0, (-1, 3))]
)
def test_an_interval_of_a_share_stays_a_share(quantity, value, ends):
    """t of 1000 degrees of freedom at 95 % is 1.646."""
    row = _with_interval(Row(quantity, "", "a", 0.0, ""), Estimate(value, 2 / 1.6464, 1000, 2), 0.9)
    assert (row.low, row.high) == pytest.approx(ends, abs=1e-3) and row.recordings == 2


@pytest.mark.parametrize(
    "means, sd, verdict",
    [
        ([100, 103, 106], 1.0, Verdict.YES),
        ([100, 102, 106], 1.0, Verdict.OPEN),
        ([100, 40, 101], 1.2, Verdict.NO),
        ([100, 40, 101], 1.4, Verdict.OPEN),
        ([100, 40, 97], 2.5, Verdict.NO),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_trend_by_hand(means, sd, verdict, sign):
    """A difference holds to 1.646 sqrt(2) sd, 2.33, 2.79, 3.26 or 5.82; a change below 5 % of the mean of 80 is 4.0."""
    found = _Series([], [Estimate(float(sign * mean), sd, 1000, 2) for mean in means])
    assert _has_sign(found, sign, CLAIMS) == verdict


def test_a_difference_has_the_uncertainty_of_both():
    assert difference(Estimate(1.0, 0.3, 4, 2), Estimate(5.0, 0.4, 4, 3)) == Estimate(4.0, 0.5, 4, 5)


def test_a_spread_is_over_the_mean():
    assert (spread_percent([1.0, 3.0]), spread_percent([-1.0, -3.0])) == (100.0, 100.0)
    assert spread_percent([1.0]) is None


def test_the_intervals_that_hold_the_model_are_counted():
    rows = [Row("width", "", "a", 0.0, "", 2, 2.0, 1.0, 3.0, model) for model in (2.0, 0.5, 3.5, None)]
    rows.append(Row("width", "", "a", 0.0, "", 1, 2.0, model=2.0))
    sentence, found = _sentence_and_rows({"width": _Series(rows, [])})
    assert found == rows and sentence.endswith("The model lies within 1 of 3 intervals.")


def test_the_models_backlash_over_radii_at_one_pretension_has_a_row_of_its_own(found):
    (row,) = (row for row in found["radius"].rows if row.condition == "all radii, one pretension")
    runs = [model_runs.run(CABLE, path, STUDY) for path, _ in over_radii()]
    backlashes = [measure(run, ["backlash"], HOW)[0]["backlash"] for run in runs]
    assert row.model == pytest.approx(100 * np.ptp(backlashes) / np.mean(backlashes), rel=1e-6)


def test_a_sliding_cable_loses_its_tension_by_the_capstan_equation():
    run = model_runs.run(CABLE, model_runs.even(STUDY), STUDY)
    assert np.log(run["T1_N"] / run["T2_N"]).max() == pytest.approx(0.156 * np.pi, rel=1e-6)


def test_the_loop_is_placed_in_a_conduit_of_the_same_length():
    loop = 0.0635 * np.pi
    for place, path in model_runs.placements(STUDY).items():
        lengths = {"drive": [loop, 1.2 - loop], "middle": [0.6 - loop / 2, loop, 0.6 - loop / 2]}
        wanted = lengths.get(place.split()[2], [1.2 - loop, loop])
        assert path.piece_length_m == pytest.approx(wanted)
        assert path.piece_length_m[path.piece_bend_rad > 0] == pytest.approx(loop)
        assert path.piece_bend_rad.sum() == pytest.approx(np.pi)


def test_the_error_of_a_discretisation_is_that_of_its_worst_channel():
    """Off by +-3 % of peak to peak in one channel and by 1 % in another."""
    exact = model_runs.run(CABLE, model_runs.even(STUDY), STUDY)
    span = {c: np.ptp(exact[c][last_cycle(exact)]) for c in ("T2_N", "tau_in_Nm")}
    signs = np.where(np.arange(exact.time_s.size) % 2, 1.0, -1.0)
    off = {
        "T2_N": exact["T2_N"] + 0.03 * span["T2_N"] * signs,
        "tau_in_Nm": exact["tau_in_Nm"] + 0.01 * span["tau_in_Nm"],
    }
    simulated = exact.with_channels({**exact.channels, **off}, exact.derived_from, "model")
    assert model_runs.error_percent(simulated, exact) == pytest.approx(3.0)


def of_loads(*rows):
    """What is measured with each load in turn: lost motion and share of slack."""
    measured = iter([({"lost_motion": lost, "width": 1.0, "slack_share": slack}, {}) for lost, slack in rows])
    return lambda *_: next(measured)


@pytest.mark.parametrize(
    "rows, verdict",
    [
        ([(1.0, 0.0), (1.02, 0.0), (1.02, 50.0)], Verdict.YES),
        ([(1.0, 0.0), (1.1, 0.0), (1.1, 50.0)], Verdict.NO),
        ([(1.0, 0.0), (1.02, 0.0), (1.1, 50.0)], Verdict.PART),
        ([(1.0, 50.0), (1.0, 50.0), (1.0, 50.0)], Verdict.OPEN),
    ],
    ids=["equal", "other with the load", "other when slack", "always slack"],
)
def test_the_deadband_over_loads_by_hand(monkeypatch, rows, verdict):
    monkeypatch.setattr(model_alone, "measure", of_loads(*rows))
    model = STUDY.model_copy(update={"load_stiffness_Nm_per_rad": [0.02, 0.05, 0.1]})
    assert model_alone._load(CABLE, CLAIMS.model_copy(update={"model": model}), HOW).borne_out == verdict


def claim_on_loads(monkeypatch, *values):
    """The claim on the deadband over loads, from what is measured with each of them."""
    measured = iter(values)
    monkeypatch.setattr(model_alone, "measure", lambda *_: (next(measured), {}))
    model = STUDY.model_copy(update={"load_stiffness_Nm_per_rad": [0.02, 0.05, 0.1][: len(values)]})
    return model_alone._load(CABLE, CLAIMS.model_copy(update={"model": model}), HOW)


def test_a_deadband_that_was_not_compared_between_loads_is_not_determined(monkeypatch):
    taut, slack = ({"lost_motion": 1.0, "width": 1.0, "slack_share": share} for share in (0.0, 50.0))
    one = claim_on_loads(monkeypatch, taut, slack)
    assert one.borne_out == Verdict.OPEN
    assert "Only with a spring of 0.02 N·m/rad does no cable go slack" in one.sentence
    assert "was not compared between loads" in one.sentence
    none = claim_on_loads(monkeypatch, {}, {})
    assert (none.borne_out, none.sentence) == (Verdict.OPEN, "With no load was there a lost motion to compare.")
    no_width = {"lost_motion": 1.0, "slack_share": 0.0}
    without = claim_on_loads(monkeypatch, taut, no_width)
    assert without.borne_out == Verdict.OPEN
    assert "the loop's width was not compared" in without.sentence
    assert claim_on_loads(monkeypatch, taut, no_width | {"lost_motion": 2.0}).borne_out == Verdict.NO


@pytest.mark.parametrize(
    "lost, slopes, verdict",
    [
        ((1.0, 1.04), (1.0, 1.04), Verdict.NO),
        ((1.0, 1.1), (1.0, 1.0), Verdict.YES),
        ((1.0, 1.0), (1.0, 1.1), Verdict.YES),
        ((1.0, 1.1), (1.0,), Verdict.OPEN),
    ],
)
def test_the_place_of_the_loop_matters_if_lost_motion_or_slope_changes(monkeypatch, lost, slopes, verdict):
    measured = [{"lost_motion": one} for one in lost]
    for values, slope in zip(measured, slopes, strict=False):
        values["slope"] = slope
    monkeypatch.setattr(model_alone.model_runs, "loop_placements", lambda *_: dict(enumerate(measured)))
    monkeypatch.setattr(model_alone, "measure", lambda values, *_: (values, {}))
    assert model_alone._placement(CABLE, CLAIMS, HOW).borne_out == verdict


@pytest.mark.parametrize(
    "errors, verdict", [((1.0, 0.5), Verdict.YES), ((0.5, 1.1), Verdict.PART), ((1.1, 2.0), Verdict.NO)]
)
def test_the_papers_sections_are_enough_if_their_error_is_within_the_limit_of_one_percent(monkeypatch, errors, verdict):
    update = {"sections": [8, 16], "sections_bend_rad": [np.pi, 2 * np.pi]}
    settings = CLAIMS.model_copy(update={"model": STUDY.model_copy(update=update)})
    # A bend after the other: 8 sections, of which nothing depends, and the paper's 16.
    of_runs = iter([5.0, errors[0], 5.0, errors[1]])
    monkeypatch.setattr(model_alone.model_runs, "run", lambda *_, **__: None)
    monkeypatch.setattr(model_alone.model_runs, "error_percent", lambda *_: next(of_runs))
    assert model_alone._sections(CABLE, settings).borne_out == verdict


def test_loads_are_drawn_over_a_logarithmic_axis(found):
    figure = model_figure(list(found.values()), {})
    on_it = [ax for ax in figure.axes if "lost motion" in ax.get_ylabel() or "slack cable" in ax.get_ylabel()]
    assert [ax.get_xscale() for ax in on_it] == ["log", "log"]
