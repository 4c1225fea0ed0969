"""From a folder to a simulation in five lines, on a batch whose truth is known."""

import gzip
import json
import re
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from typer.testing import CliRunner

import ccmodel as cc
from builders import spoil, write_batch
from ccmodel import cli
from ccmodel.model.files import read_model_file
from ccmodel.model.general.run import Active

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
    assert model.parameters == fitted.model.parameters == read_model_file(tmp_path / "fit.json").parameters
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


@pytest.mark.parametrize(("verdict", "confidence"), [("learned", 0.7), ("explained", 0.9), ("unexplained", None)])
def test_the_confidence_is_that_of_what_the_verdict_names(batch, verdict, confidence):
    named = {"laws": [{"confidence": 0.95}, {"confidence": 0.7}], "mechanisms": [{"confidence": 0.9}]}
    content = {"verdict": verdict, "alternatives": [], "not_judged": []} | named
    assert cc.Diagnosis(batch, SimpleNamespace(content=content)).confidence == confidence


def test_a_diagnosis_shows_its_verdict_and_its_candidates(found, truth):
    assert found.report == json.loads(json.dumps(found.report))
    assert found.confidence is None
    assert "agrees" in repr(found)
    assert "agrees" in found._repr_html_()
    candidates = found.to_frame()
    assert candidates.index[0] == "the calibrated model"
    assert candidates.loc["the calibrated model", "mean_square"] == pytest.approx(1, abs=0.5)
    assert list(found.errors.columns) == ["before", "noise", "unit"]
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


def test_a_fit_or_a_diagnosis_stands_for_its_model(fitted, found, batch):
    tau_in = cc.simulate(fitted.model, MOTION)["tau_in_Nm"]
    assert np.array_equal(cc.simulate(fitted, MOTION)["tau_in_Nm"], tau_in)
    assert np.array_equal(cc.simulate(found, MOTION)["tau_in_Nm"], tau_in)
    assert cc.predict(fitted, batch).errors.equals(cc.predict(fitted.model, batch).errors)


def test_a_recording_is_a_motion(fitted, batch):
    recording = batch["t-6N"]
    simulated = cc.simulate(fitted, recording)
    assert np.array_equal(simulated.time_s, recording.time_s)
    assert np.array_equal(simulated["theta_in_rad"], recording["theta_in_rad"])


def test_friction_of_the_drive_pulley_is_in_the_derived_tensions_alone(fitted):
    """The drive's motion is prescribed: the cables do not feel the bearing, the torque and what follows from it do."""
    friction = Active("pulley-friction", "drive-pulley", {"friction_torque": 5e-3, "presliding": 2e-3})
    model = cc.Model(replace(fitted.model.parameters, mechanisms=(friction,)), fitted.model.rig)
    with_it, alone = cc.simulate(model, MOTION), cc.simulate(model.without("pulley-friction"), MOTION)
    assert max(abs(with_it["T1_N"] - alone["T1_N"])) == pytest.approx(
        5e-3 / 2 / model.parameters.drive_radius_m, rel=0.02
    )
    # The two solvers differ by as much as their grids do.
    for channel in ("F_drive_N", "T2_N"):
        np.testing.assert_allclose(with_it[channel], alone[channel], atol=0.02)


def test_a_prediction_is_written_as_the_command_writes_it(fitted, folder, tmp_path):
    fitted.save(tmp_path / "fit.json")
    cc.predict(tmp_path / "fit.json", folder, tmp_path / "mine")
    words = ["predict", folder, "--model", tmp_path / "fit.json", "--out", tmp_path / "command"]
    assert CliRunner().invoke(cli.app, list(map(str, words))).exit_code == 0
    written = sorted(file.name for file in (tmp_path / "mine").iterdir())
    assert written == ["t-5N.csv", "t-6N.csv", "t-7N.csv"]
    for name in written:
        assert (tmp_path / "mine" / name).read_bytes() == (tmp_path / "command" / name).read_bytes()


def test_a_simulation_is_written_as_the_command_writes_it(fitted, tmp_path):
    fitted.save(tmp_path / "fit.json")
    MOTION.to_csv(tmp_path / "motion.csv", index=False)
    cc.simulate(fitted, tmp_path / "motion.csv", out=tmp_path / "new" / "mine.csv")
    words = ["simulate", tmp_path / "motion.csv", "--model", tmp_path / "fit.json", "--out", tmp_path / "command.csv"]
    assert CliRunner().invoke(cli.app, list(map(str, words))).exit_code == 0
    assert (tmp_path / "new" / "mine.csv").read_bytes() == (tmp_path / "command.csv").read_bytes()


def test_a_batch_is_named_by_its_folder_or_its_file(folder, batch, monkeypatch):
    assert cc.load(folder / "batch.yaml").folder == batch.folder
    monkeypatch.setenv("HOME", str(folder.parent))
    assert cc.load(f"~/{folder.name}").name == batch.name


def test_a_fit_says_where_its_intervals_come_from_and_what_it_cannot_judge(fitted):
    source = (
        r"90 % intervals: Student's t of the jackknife over 3 recordings, (.*) degrees of freedom: up to (.*) standard"
    )
    freedom, reach = map(float, re.search(source, repr(fitted)).groups())
    # No more than recordings less one; Student's t of two degrees of freedom has 90 % within 2.92.
    assert 1 <= freedom <= 2
    assert reach >= 2.9
    assert "note: friction apart from bend: one bend angle" in repr(fitted)
    assert "note: friction apart from bend" in fitted._repr_html_()


def test_a_fit_that_errs_says_what_its_intervals_lack(fitted, monkeypatch):
    monkeypatch.setattr(cc.Fit, "mean_square", 23.2)
    (line, *_) = fitted.warnings
    assert "depend on the weights of the residuals, and the intervals do not include this; 'ccmodel diagnose'" in line


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


def test_a_drift_of_the_models_session_leaves_other_recordings_alone(fitted, folder, batch, tmp_path):
    """Their order says nothing of the session that the model was fitted to."""
    drift = Active("friction-drift", "conduit", {"change": 0.4})
    drifting = replace(fitted.model, parameters=replace(fitted.model.parameters, mechanisms=(drift,)))
    other = cc.load(write_batch(tmp_path / "other", pretensions=(6.5, 7.5)))
    for use in (cc.predict, cc.estimate):
        changed = {
            r.id: not np.array_equal(use(drifting, one)[r.id]["theta_out_rad"], use(fitted, one)[r.id]["theta_out_rad"])
            for one in (batch, other)
            for r in one
        }
        assert changed == {"t-7N": True, "t-6N": False, "t-5N": True, "t-6.5N": False, "t-7.5N": False}


def test_a_prediction_says_what_is_wrong_with_its_batch(fitted, folder, tmp_path):
    other = shutil.copytree(folder, tmp_path / folder.name)
    described = (other / "batch.yaml").read_text()
    (other / "batch.yaml").write_text(
        described.replace("encoder_counts_per_rev: 2000", "encoder_counts_per_rev: 8000", 1)
    )
    predicted, estimated = cc.predict(fitted, other), cc.estimate(fitted, other)
    for found in (predicted, estimated):
        assert any(finding.is_inconsistent and "encoder" in str(finding) for finding in found.findings)
    assert cc.predict(fitted, folder).findings == ()


def test_files_of_an_earlier_model_do_not_stay_for_a_recording_that_now_has_none(fitted, folder, tmp_path):
    batch, out = shutil.copytree(folder, tmp_path / folder.name), tmp_path / "out"
    for use in (cc.predict, cc.estimate):
        use(fitted, batch, out)
    (out / "notes.csv").write_text("mine")
    (batch / "t-6N.csv.gz").write_bytes(b"")
    for use in (cc.predict, cc.estimate):
        shutil.copy(out / "t-5N.csv", out / "t-6N.csv")
        assert "t-6N.csv.gz" in use(fitted, batch, out).left_out[0]
        assert sorted(file.name for file in out.iterdir()) == ["notes.csv", "t-5N.csv", "t-7N.csv"]


def test_a_model_of_a_pair_does_not_predict_a_single_cable(fitted, batch):
    of_single = replace(fitted.model, rig=replace(fitted.model.rig, far_end="fixed"))
    with pytest.raises(cc.InputError, match="is of a pair of cables, and the model is of a single cable"):
        cc.predict(of_single, batch)


def test_the_clock_of_a_log_is_that_of_its_prediction_alone(fitted, folder, batch, tmp_path):
    later = shutil.copytree(folder, tmp_path / folder.name)
    for log in later.glob("*.csv*"):
        pd.read_csv(log).eval("time_s = time_s + 100").to_csv(log, index=False, float_format="%.12g")
    predicted, moved = cc.predict(fitted.model, batch), cc.predict(fitted.model, cc.load(later))
    pd.testing.assert_frame_equal(moved.errors, predicted.errors, rtol=1e-5)
    before = predicted.to_frame().reset_index("time_s")
    after = moved.to_frame().reset_index("time_s")
    np.testing.assert_allclose(after["time_s"] - 100, before["time_s"], atol=1e-9)


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


def test_all_long_work_reports_progress(fitted, folder):
    heard = []

    def hear(text, done=None):
        heard.append((text, done))

    def shares(work):
        heard.clear()
        work()
        return [done for _, done in heard if done is not None]

    for work in (
        lambda: cc.load(folder, progress=hear),
        lambda: cc.predict(fitted, folder, progress=hear),
        lambda: cc.simulate(fitted, MOTION, batch=folder, progress=hear),
        lambda: cc.fit(folder, progress=hear),
    ):
        found = shares(work)
        assert found == sorted(found)
        assert found[0] == 0.0
        assert found[-1] <= 1.0
