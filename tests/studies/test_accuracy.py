"""Bias and scatter recovered from numbers made with known ones; comparison errors of a model known to be off."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import builders
from builders import recording
from ccmodel.inference.fit import FitResult
from ccmodel.inference.intervals import Interval
from ccmodel.model.model_input import ModelInput
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import PRESCRIBED, simulate, simulate_recording
from ccmodel.rig.ingest import ingest_batch
from ccmodel.steps.files import fitted, write_json
from ccmodel.steps.ingest import ingest
from ccmodel.studies.accuracy.figure import ratio_figure, scatter_figure
from ccmodel.studies.accuracy.settings import Accuracy
from ccmodel.studies.accuracy.study import (
    BY_RECORDING,
    Case,
    _cases,
    _every_other,
    _prescribed,
    _shifted,
    bias_and_scatter,
    comparison_table,
    sensor_uncertainty,
    summary,
)
from ccmodel.studies.claims import model_runs
from ccmodel.studies.loops.measures import QUANTITIES, Quantity, measure
from ccmodel.studies.loops.settings import Measuring
from model_runs import CABLE, STUDY
from single_cable_batches import write_batch

ASKED, HOW = Accuracy(), Measuring()


def made(delta, sigma_M, sigma_E, n, seed=1):
    random = np.random.default_rng(seed)
    truth = random.uniform(1, 10, n)
    recorded = truth * (1 + sigma_E * random.standard_normal(n))
    return delta * truth * (1 + sigma_M * random.standard_normal(n)), recorded


def test_known_bias_and_scatter_are_recovered():
    found = bias_and_scatter(*made(1.2, 0.08, 0.05, 20_000), sigma_E=0.05, coverage=0.9)
    assert found.delta == pytest.approx(1.2, rel=0.003)
    assert found.sigma_M == pytest.approx(0.08, rel=0.03)
    assert not found.limited


def test_the_bias_is_that_of_the_values_and_not_of_their_logarithms():
    found = bias_and_scatter(*made(1.2, 0.2, 0.15, 200_000), sigma_E=0.15, coverage=0.9)
    assert found.delta == pytest.approx(1.2, rel=0.004)


def test_the_scatter_of_three_pairs_by_hand():
    found = bias_and_scatter(np.exp([0.0, 0.1, 0.2]), np.ones(3), sigma_E=0.0, coverage=0.9)
    assert found.sigma_M == pytest.approx(0.1)
    # t of 2 degrees of freedom at 95 % is 2.920.
    reach = 2.920 * 0.1 / np.sqrt(3)
    assert np.log([found.delta, found.delta_low, found.delta_high]) == pytest.approx(
        [0.105, 0.105 - reach, 0.105 + reach], abs=1e-5
    )


def test_the_uncertainty_of_a_quantity_is_that_of_two_readings():
    one = recording(tau_in_Nm=np.sin, tau_out_Nm=np.cos, theta_out_rad=np.sin)
    one = replace(one, accuracy={"theta_in_rad": 3e-3, "tau_out_Nm": 4e-3}, encoder_step_rad={"theta_in_rad": 0.012})
    share = Quantity("a share", "%", 100.0, lambda cycle: 0.0, ("tau_out_Nm",))
    assert sensor_uncertainty(share, one) == pytest.approx(100.0 * np.sqrt(2) * 4e-3)
    share = replace(share, channels=("theta_in_rad",))
    assert sensor_uncertainty(share, one) == pytest.approx(100.0 * np.sqrt(2) * 0.012 / np.sqrt(12))
    ratio = replace(share, channels=("theta_in_rad", "tau_out_Nm"))
    slope = np.ptp(one["theta_in_rad"]) / np.ptp(one["tau_out_Nm"])
    assert sensor_uncertainty(ratio, one) == pytest.approx(
        100.0 * np.sqrt(2) * np.hypot(0.012 / np.sqrt(12), slope * 4e-3)
    )
    assert sensor_uncertainty(replace(share, channels=("tau_in_Nm",)), one) is None
    # An error of the torque acts along the whole stroke of 2 rad.
    one = replace(one, accuracy=one.accuracy | {"tau_in_Nm": 5e-3})
    assert sensor_uncertainty(QUANTITIES["work_lost"], one) == pytest.approx(1e3 * np.sqrt(2) * 5e-3 * 2, rel=1e-3)


@pytest.mark.parametrize("pairs", [4, 12])
def test_the_bias_lies_in_its_interval_as_often_as_stated(pairs):
    hits = 0
    for seed in range(400):
        found = bias_and_scatter(*made(0.9, 0.06, 0.03, pairs, seed), sigma_E=0.03, coverage=0.9)
        hits += found.delta_low < 0.9 < found.delta_high
    assert hits / 400 == pytest.approx(0.9, abs=0.05)


def test_a_model_is_not_shown_to_be_nearer_to_the_truth_than_the_recordings():
    found = bias_and_scatter(*made(1.0, 0.0, 0.05, 5000), sigma_E=0.05, coverage=0.9)
    assert found.limited
    assert found.sigma_M == pytest.approx(found.sigma_E)
    assert found.sigma_M == pytest.approx(0.05 / np.sqrt(2), rel=0.05)


@pytest.mark.parametrize(("pairs", "said"), [(2, "2 pairs, fewer than the 3"), (0, "0 pairs")])
def test_too_few_pairs_are_refused(pairs, said):
    with pytest.raises(ValueError, match=said):
        bias_and_scatter(np.ones(pairs), np.ones(pairs), 0.01, 0.9)


def test_a_value_without_a_logarithm_is_refused():
    with pytest.raises(ValueError, match="not positive"):
        bias_and_scatter([1.0, 0.0, 1.0], [1.0, 1.0, 1.0], 0.01, 0.9)


def cases(stiffness_off=0.0, accuracy=0.0005):
    """Runs of the model as recordings, and a model whose stiffness is off."""
    found = []
    for i, pretension in enumerate((6.0, 7.0, 8.0)):
        study = STUDY.model_copy(update={"pretension_N": pretension})
        recorded = model_runs.run(CABLE, model_runs.even(study), study, 0.05)
        recorded = replace(
            recorded, batch="b", id=f"r{i}-a", origin="virtual-rig", accuracy=dict.fromkeys(recorded.channels, accuracy)
        )
        off = replace(CABLE, stiffness_N_per_m=CABLE.stiffness_N_per_m * (1 + stiffness_off), pretension_N=pretension)
        sd = {"stiffness_N_per_m": 0.02 * CABLE.stiffness_N_per_m}
        found.append(Case(recorded, simulate_recording(recorded, off), off, sd, fitted=i == 0))
    return found


def test_a_model_that_is_off_by_its_inputs_uncertainty_is_within_what_can_be_seen():
    table = comparison_table(cases(stiffness_off=0.02, accuracy=1e-6), ASKED, HOW)
    assert list(table.columns) == list(BY_RECORDING)
    lost = table[table["quantity"] == "lost_motion"]
    assert (lost["E"] < 0).all()
    assert lost["u_input"].to_numpy() == pytest.approx(lost["E"].abs().to_numpy(), rel=0.05)
    assert lost["within"].all()
    assert lost["fitted"].sum() == 1


def test_a_model_that_is_off_by_more_is_not():
    table = comparison_table(cases(stiffness_off=0.2, accuracy=1e-6), ASKED, HOW)
    assert not table.loc[table["quantity"] == "lost_motion", "within"].any()
    line = next(line for line in summary(table, ASKED) if line["quantity"] == "lost_motion")
    # Lost motion goes with the cable's compliance.
    assert line["delta"] == pytest.approx(1 / 1.2, rel=0.01)
    assert line["within"] == 0


@pytest.mark.parametrize("drawn", [scatter_figure, ratio_figure])
def test_each_batch_has_a_colour_and_a_marker_of_its_own(drawn):
    every = [replace(c, recorded=replace(c.recorded, batch=name)) for name in ("b", "c", "d") for c in cases()]
    table = comparison_table(every, ASKED, HOW)
    axes = drawn(table, summary(table, ASKED), ASKED.coverage_factor).axes[0]
    of_batch = {line.get_label(): line for line in axes.lines if str(line.get_label()).startswith("batch")}
    assert list(of_batch) == ["batch b", "batch c", "batch d"]
    for style in ("get_color", "get_marker"):
        assert len({getattr(line, style)() for line in of_batch.values()}) == 3


def test_a_sensor_that_states_no_accuracy_judges_nothing():
    bare = [replace(case, recorded=replace(case.recorded, accuracy={})) for case in cases()]
    table = comparison_table(bare, ASKED, HOW)
    assert table.empty
    assert summary(table, ASKED) == []


def test_a_quantity_with_too_few_recordings_says_so():
    (line, *_) = summary(comparison_table(cases()[:2], ASKED, HOW), ASKED)
    assert line["gap"] == "2 pairs, fewer than the 3 that a scatter takes"
    assert line["delta"] is None


def test_an_input_that_is_not_determined_is_named():
    (case, *_) = cases()
    table = comparison_table([replace(case, input_sd={"friction_coefficient": np.inf})], ASKED, HOW)
    assert (table["inputs_left_out"] == "friction_coefficient").all()
    assert (table["u_input"] == 0).all()


def test_a_parameter_that_a_fit_does_not_determine_is_left_out_of_the_inputs(tmp_path):
    """Its standard deviation is infinite, which the JSON of a fit has as null."""
    recordings, fit = tmp_path / "known.nc", tmp_path / "fit.json"
    ingest(builders.write_batch(tmp_path / "known", pretensions=(7.0,)), recordings, tmp_path / "known.json")
    name = "friction_coefficient"
    write_json(fit, FitResult(True, "", {name: 0.2}, {name: Interval.about(0.2, np.inf)}).as_dict())
    known = fitted(recordings, fit)
    assert known.sds == {"friction_coefficient": np.inf}
    table = comparison_table([replace(case, input_sd=known.sds) for case in cases()], ASKED, HOW)
    assert (table["inputs_left_out"] == "friction_coefficient").all()


def test_repeats_count_as_far_as_the_model_was_not_told_of_them():
    """Two recordings of one condition that differ as the model says they do, and two that differ by more."""
    a, b = cases()[:2]
    told = [replace(c, recorded=replace(c.recorded, id=f"r-{x}")) for c, x in ((a, "a"), (b, "b"))]
    table = comparison_table(told, ASKED, HOW)
    assert table["u_repeat"].max() < 1e-3 * table["recorded"].max()
    louder = dict(b.recorded.channels) | {"tau_in_Nm": 1.02 * b.recorded["tau_in_Nm"]}
    told[1] = replace(told[1], recorded=replace(told[1].recorded, channels=louder))
    table = comparison_table(told, ASKED, HOW).set_index("quantity")
    assert table.loc["tau_in", "u_repeat"].iloc[0] == pytest.approx(
        np.log(1.02) / np.sqrt(2) * table.loc["tau_in", "recorded"].iloc[0], rel=0.01
    )


def test_a_single_cable_with_a_measured_tension_has_uncertainties_of_its_own(tmp_path):
    """The measurement at its far end is thinned with the rest, and its tension at rest is an input."""
    ingested = ingest_batch(write_batch(tmp_path / "one", "measured-tension"))
    measured, parameters = ingested.recordings[0], Parameters.estimated(ingested.stated.rig)
    given = ModelInput.of(measured)
    thinned = _every_other(given)
    assert "F_load" in given.series
    assert {name: v.shape[-1] for name, v in thinned.series.items()} == dict.fromkeys(
        given.series, thinned.theta_in.size
    )
    fine, coarse = simulate(given, parameters), simulate(thinned, parameters)
    assert np.abs(coarse["tau_in_Nm"] - fine["tau_in_Nm"][::2]).max() < 0.02 * np.ptp(fine["tau_in_Nm"])
    shifted = _shifted(Case(measured, fine, parameters, {}, False))["pretension_scale"]
    accuracy = max(measured.accuracy[tension] for tension in measured.tensions)
    assert shifted == pytest.approx(1.0 + accuracy / measured.pretension_N) and shifted > 1.0


def test_the_motors_angle_is_thinned_with_the_drives():
    drive = recording(theta_in_rad=np.sin, theta_motor_rad=np.sin)
    given = ModelInput.of(drive)
    assert _every_other(given).theta_motor.size == _every_other(given).theta_in.size


def test_the_numerical_uncertainty_is_the_change_with_half_the_samples_and_adds_in_squares():
    (case, *_) = cases(accuracy=1e-9)
    table = comparison_table([replace(case, input_sd={})], ASKED, HOW).set_index("quantity")
    thinned = _every_other(ModelInput.of(case.recorded))
    coarse = measure(simulate(thinned, case.parameters), ["lost_motion"], HOW)[0]["lost_motion"]
    lost = table.loc["lost_motion"]
    assert lost["u_num"] == pytest.approx(abs(coarse - lost["modelled"]), rel=1e-6) and lost["u_num"] > 10 * lost["u_D"]
    assert lost["u_val"] == pytest.approx(np.hypot(lost["u_num"], lost["u_D"]), rel=1e-12)


def test_a_quantity_with_a_channel_that_the_model_was_given_is_not_judged_apart_from_the_drives_angle():
    (case, *_) = cases()
    assert case.modelled.derived_from["theta_in_rad"] == PRESCRIBED
    assert not _prescribed(QUANTITIES["lost_motion"], case.modelled)
    sources = dict(case.modelled.derived_from) | {"tau_out_Nm": PRESCRIBED}
    given = replace(case, modelled=replace(case.modelled, derived_from=sources))
    every, judged = (set(comparison_table([one], ASKED, HOW)["quantity"]) for one in (case, given))
    assert every - judged == {"tau_out", "width", "backlash"}


def test_a_case_is_fitted_if_the_fit_had_its_recording():
    (case, *others) = cases()
    fit = SimpleNamespace(parameters=case.parameters, sds={}, recordings=["b/r0-a"])
    pairs = [(one.recorded, one.modelled) for one in (case, *others)] + [(case.recorded, None)]
    assert [one.fitted for one in _cases(SimpleNamespace(fitted=fit, pairs=pairs))] == [True, False, False]


# Three recordings, two of them of one condition.
BY_HAND = pd.DataFrame(
    {"batch": "b", "recording": ["r-a", "r-b", "s"], "origin": "rig", "quantity": "width", "unit": "mN·m"}
    | {"recorded": 100.0, "modelled": [99.0, 101.0, 97.0], "E": [-1.0, 1.0, -3.0]}
    | {"u_num": 12.0, "u_input": 4.0, "u_sensor": 3.0, "u_repeat": 0.0, "u_D": 3.0, "u_val": 13.0}
    | {"within": True, "fitted": [True, False, False], "inputs_left_out": ["", "x", "x y"]}
)


def test_a_summary_by_hand():
    (line,) = summary(BY_HAND, ASKED)
    assert line["sigma_E_stated"] == pytest.approx(0.05), "data and inputs: 3 and 4 of 100"
    assert (line["E_mean"], line["E_rms"]) == pytest.approx((-1.0, np.sqrt(11 / 3)))
    assert (line["repeats"], line["fitted"], line["within"], line["recordings"]) == (1, 1, 3, 3)
    assert line["inputs_left_out"] == ["x", "y"]


def test_the_bands_reach_as_many_standard_deviations_as_the_coverage_factor():
    (line,) = summary(BY_HAND, ASKED)
    line |= {"delta": 0.5, "sigma_M": 0.1}
    ax = ratio_figure(BY_HAND, [line], 3.0).axes[0]
    drawn = {str(one.get_label()): one.get_ydata() for one in ax.lines}
    assert drawn["batch b"] == pytest.approx([99.0, 101.0, 97.0])
    assert drawn["± 3 σ_E, sensors and parameters"] == pytest.approx([115.0, 115.0])
    assert drawn["the model's bias δ"] == pytest.approx([50.0, 50.0])
    assert min(one.get_ydata()[0] for one in ax.lines if one.get_linestyle() == "--") == pytest.approx(85.0)
    (band,) = ax.collections
    heights = band.get_paths()[0].vertices[:, 1]
    assert band.get_label() == "± 3 σ_M of the model about it"
    assert (heights.min(), heights.max()) == pytest.approx((35.0, 65.0))
