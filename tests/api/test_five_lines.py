"""From a folder to a simulation in five lines, on a batch whose truth is known."""

import gzip
import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from typer.testing import CliRunner

import ccmodel as cc
from builders import spoil, write_batch
from ccmodel import cli
from ccmodel.model.files import read_model as parameters_of

TIMES = np.arange(0, 2, 0.004)
MOTION = pd.DataFrame({"time_s": TIMES, "theta_in_rad": 0.5 * np.sin(2 * np.pi * TIMES)})


def test_a_batch_shows_itself_in_a_short_table(batch):
    said = repr(batch).splitlines()
    assert said[0] == "Batch known, recording (virtual rig, simulated): 3 recordings, no findings"
    assert all(word in said[1] for word in ("samples", "rate_Hz", "stroke_rad", "channels", "warnings"))
    assert len(said) == 2 + len(batch) == 5
    assert "t-7N" in batch._repr_html_()


def test_a_batch_is_a_sequence_of_recordings_with_ids(batch):
    assert [r.id for r in batch] == ["t-7N", "t-6N", "t-5N"]
    assert batch["t-6N"] is batch.recordings[1]
    assert "t-6N" in batch
    assert "t-1N" not in batch
    assert repr(batch["t-6N"]).startswith(
        "Recording known/t-6N, recording (virtual rig, simulated): 625 samples at 250 Hz"
    )


def test_samples_come_as_a_frame_and_as_datasets_with_units(batch):
    frame = batch.to_frame()
    assert frame.index.names == ["recording", "time_s"]
    assert frame.loc["t-7N"].equals(batch["t-7N"].to_frame())
    tree = batch.to_xarray()
    assert isinstance(tree, xr.DataTree)
    of = tree["t-7N"]
    assert of["tau_in_Nm"].attrs["units"] == "N m"
    assert of["time_s"].attrs["units"] == "s"
    assert np.array_equal(of["tau_in_Nm"], batch["t-7N"]["tau_in_Nm"])


def test_a_fit_finds_the_truth_within_its_intervals(fitted, truth):
    assert fitted.succeeded
    assert fitted.values.keys() == truth.keys()
    for name, value in truth.items():
        interval = fitted.intervals[name]
        assert interval.low < value < interval.high, name
        # 0.5 % of the value is a hundred times what the sensors' noise alone would leave.
        assert fitted.values[name] == pytest.approx(value, rel=5e-3), name


def test_a_fit_shows_values_with_intervals_and_units(fitted):
    frame = fitted.to_frame()
    assert list(frame.columns) == ["value", "sd", "low", "high", "unit", "at_bound"]
    assert frame.loc["stiffness_N_per_m", "unit"] == "N/m"
    said = repr(fitted)
    assert all(word in said for word in ("value", "standard deviation", "90 % interval", "at a bound?", "N m/rad"))
    assert "friction_coefficient" in fitted._repr_html_()


def test_a_fit_tells_recordings_apart(fitted, tmp_path):
    """The zero of the load cell at the drive has moved in one recording by 0.1 N, as its accuracy allows."""
    folder = spoil(write_batch(tmp_path / "known", pretensions=(7.0, 6.0, 5.0)))
    file = folder / "t-6N.csv.gz"
    table = pd.read_csv(file)
    table["drive_load_cell_V"] += 0.1 * 0.1
    with gzip.open(file, "wt") as f:
        table.to_csv(f, index=False)
    moved = cc.fit(folder, trust_inputs=True).by_recording - fitted.by_recording
    assert moved.loc["t-6N", "F_drive_zero_N"] == pytest.approx(0.1, rel=0.2)
    assert moved.loc["t-7N", "F_drive_zero_N"] == pytest.approx(0.0, abs=0.005)
    assert fitted.by_recording["friction_coefficient"].to_numpy() == pytest.approx(0.156, rel=0.01)


def test_the_diagnosis_has_the_same_calibrated_model(fitted, found):
    """One calibration: where the model reproduces the recordings, not a digit differs."""
    assert found.verdict == "agrees"
    assert found.report["fit"]["calibrated"] == fitted.values
    assert found.calibrated.parameters == fitted.model.parameters


def test_a_fit_of_fewer_parameters_keeps_the_estimates_of_the_others(batch):
    alone = cc.fit(batch, free=["friction_coefficient"])
    assert list(alone.values) == ["friction_coefficient"]
    assert alone.model.parameters.stiffness_N_per_m == batch._file.rig.cable.stiffness_N_per_m
    assert any("does not reproduce" in line for line in alone.warnings)
    assert "warning: the model does not reproduce" in repr(alone)


def test_what_is_saved_is_read_and_simulates_the_same(fitted, tmp_path):
    fitted.save(tmp_path / "fit.json")
    model = cc.read_model(tmp_path / "fit.json")
    assert model.parameters == fitted.model.parameters == parameters_of(tmp_path / "fit.json")
    assert model.intervals == fitted.model.intervals
    mine, read = (cc.simulate(one, MOTION)["tau_in_Nm"] for one in (fitted.model, tmp_path / "fit.json"))
    assert np.array_equal(mine, read)


def test_a_diagnosis_saves_what_the_command_writes(found, folder, tmp_path):
    found.save(tmp_path / "mine")
    done = CliRunner().invoke(cli.app, ["diagnose", str(folder), "--out", str(tmp_path / "command")])
    assert done.exit_code == 0
    names = {file.name for file in (tmp_path / "command").iterdir()}
    assert names == {file.name for file in (tmp_path / "mine").iterdir()}
    for name in ("diagnosis.json", "calibrated.json", "model.json"):
        assert (tmp_path / "mine" / name).read_bytes() == (tmp_path / "command" / name).read_bytes(), name


def test_a_diagnosis_shows_its_verdict_and_its_candidates(found, truth):
    assert found.report == json.loads(json.dumps(found.report))
    assert found.confidence is None
    assert "agrees" in repr(found)
    assert "agrees" in found._repr_html_()
    candidates = found.to_frame()
    assert candidates.index[0] == "the calibrated model"
    assert candidates.loc["the calibrated model", "mean_square"] == pytest.approx(1, abs=0.5)
    assert (found.errors()["after"] == found.errors()["before"]).all()
    assert found.nearest is None
    assert found.model.parameters.stiffness_N_per_m == pytest.approx(truth["stiffness_N_per_m"], rel=5e-3)


def test_a_model_simulates_a_motion_without_its_batch(fitted, batch):
    alone = cc.simulate(fitted.model, MOTION)
    assert alone.origin == "model"
    assert len(alone.to_frame()) == len(MOTION)
    with_batch = cc.simulate(fitted.model, MOTION, batch=batch)
    assert np.array_equal(alone["T1_N"], with_batch["T1_N"])
    first, last = (cc.simulate(fitted.model, MOTION, recording=f"t-{T}N")["F_drive_N"][0] for T in (7, 5))
    assert (first, last) == (pytest.approx(14.0), pytest.approx(10.0))
    assert cc.simulate(fitted.model, MOTION, pretension_N=3.0)["F_drive_N"][0] == pytest.approx(6.0)


def test_a_motion_may_be_a_frame_a_dataset_or_a_file(fitted, tmp_path):
    MOTION.to_csv(tmp_path / "motion.csv", index=False)
    by_time = MOTION.set_index("time_s")
    forms = [by_time, by_time.to_xarray(), tmp_path / "motion.csv", str(tmp_path / "motion.csv")]
    expected = cc.simulate(fitted.model, MOTION)["tau_in_Nm"]
    for form in forms:
        np.testing.assert_allclose(cc.simulate(fitted.model, form)["tau_in_Nm"], expected, rtol=1e-12)


def test_a_model_predicts_recordings_that_it_was_not_fitted_to(fitted, tmp_path):
    other = cc.load(write_batch(tmp_path / "other", pretensions=(6.5,)))
    predicted = cc.predict(fitted.model, other)
    assert [r.id for r in predicted] == ["t-6.5N"]
    assert predicted["t-6.5N"].origin == "model"
    assert (predicted.errors["nrmse_percent"] < 2).all()
    assert "t-6.5N" in repr(predicted)
    assert "t-6.5N" in predicted._repr_html_()
    assert predicted.left_out == ()


def test_a_baseline_is_a_model_or_its_file(batch, found, tmp_path):
    found.save(tmp_path)
    by_file = cc.diagnose(batch, baseline=tmp_path / "model.json", freeze=True)
    by_model = cc.diagnose(batch, baseline=found.model, freeze=True)
    assert by_file.report == by_model.report
    assert by_file.verdict == "agrees"


def test_progress_goes_to_a_function(batch):
    heard = []
    cc.fit(batch, progress=lambda text, done=None: heard.append(text))
    assert any("calibrating" in text for text in heard)
