"""Diagnoses of several batches of one rig: what is one number, what is not, and what is written."""

import json
from dataclasses import replace

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

import ccmodel as cc
from builders import spoil, write_batch
from ccmodel import cli
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.calibration import calibration
from ccmodel.diagnosis.candidate import fit
from ccmodel.diagnosis.hypothesis import PAPER
from ccmodel.diagnosis.observations import observations_of
from ccmodel.diagnosis.whitening import _scalar_nuisances
from ccmodel.inference.problem import Problem
from ccmodel.model.files import read_model_file
from ccmodel.model.parameters import acts_on, batch_key, of_batch
from made_observations import PARAMETERS, batch

KEYS = [batch_key("friction_scale", name) for name in ("monday", "tuesday")]
# Friction of the two days over the rig's.
DAYS = (1.02, 0.98)


@pytest.fixture(scope="module")
def raw(tmp_path_factory):
    """Two batches of a rig, with 4 % between their frictions and one recording id in both."""
    folder = tmp_path_factory.mktemp("raw")
    for k, (name, pretensions) in enumerate((("monday", (7.0, 6.0)), ("tuesday", (7.0, 5.0)))):
        spoil(write_batch(folder / name, pretensions, mu=0.156 * DAYS[k]), seed=k)
    return folder


@pytest.fixture(scope="module")
def joint(raw, tmp_path_factory):
    """The command on both."""
    out = tmp_path_factory.mktemp("joint")
    run = CliRunner().invoke(cli.app, ["diagnose", str(raw / "monday"), str(raw / "tuesday"), "--out", str(out)])
    assert run.exit_code == 0, run.output
    return out


def test_days_with_different_friction_agree_with_one_rig(joint):
    said = json.loads((joint / "diagnosis.json").read_text())
    assert said["verdict"] == "agrees"
    calibrated = said["fit"]["calibrated"]
    assert calibrated["friction_coefficient"] == pytest.approx(0.156, rel=0.01)
    assert calibrated[KEYS[0]] / calibrated[KEYS[1]] == pytest.approx(DAYS[0] / DAYS[1], abs=0.01)


def test_errors_are_linearised_about_the_friction_of_their_own_day(raw):
    calibrated = cc.diagnose([raw / "monday", raw / "tuesday"])._outcome.found.calibrated
    assert {w.session for w in calibrated.whitened} == {"monday", "tuesday"}
    for w in calibrated.whitened:
        assert w.own["friction_scale"] == pytest.approx(1.0, abs=0.008), w.name
        model = calibrated.model(PARAMETERS, w.session)
        whole = calibrated.values["friction_coefficient"] * calibrated.values[batch_key("friction_scale", w.session)]
        assert (model.friction_coefficient, model.friction_scale) == (pytest.approx(whole), 1.0)


def test_recordings_and_batches_are_named(joint):
    said = json.loads((joint / "diagnosis.json").read_text())
    assert (said["batch"], said["batches"]) == ("monday + tuesday", ["monday", "tuesday"])
    assert said["fit"]["held_out"] == ["monday/t-7N", "monday/t-6N", "tuesday/t-7N", "tuesday/t-5N"]
    assert {file.partition("/")[0] for file in said["provenance"]["sha256"]} == {"monday", "tuesday"}
    page = (joint / "report.html").read_text()
    assert "The batches monday, tuesday are of one rig and were diagnosed together" in page
    assert "monday 1.0" in page and "tuesday 0.9" in page


def test_the_model_is_the_rigs(joint):
    """A day's friction is not part of it: the model predicts any batch of the rig."""
    model = read_model_file(joint / "model.json")
    assert model.parameters.friction_scale == 1.0
    assert [c.recording for c in model.rig.conditions][::2] == ["monday/t-7N", "tuesday/t-7N"]


@pytest.mark.parametrize("freeze", [False, True])
def test_a_model_of_the_rig_is_a_baseline_of_its_batches(raw, joint, freeze):
    both = [raw / "monday", raw / "tuesday"]
    found = cc.diagnose(both, baseline=joint / "model.json", freeze=freeze, step_s=0.005)
    assert found.verdict == "agrees"
    assert (KEYS[0] in found.report["fit"]["calibrated"]) != freeze


def test_a_list_of_one_batch_is_that_batch(raw):
    alone, listed = cc.diagnose(raw / "monday", step_s=0.02), cc.diagnose([raw / "monday"], step_s=0.02)
    assert json.dumps(alone.report) == json.dumps(listed.report)
    assert "batches" not in alone.report
    assert not any("@" in name for name in alone.report["fit"]["calibrated"])


def test_different_rigs_are_refused_before_the_work(raw, tmp_path):
    other = write_batch(tmp_path / "other", (7.0,))
    stated = yaml.safe_load((other / "batch.yaml").read_text())
    stated["rig"]["load"]["pulley_radius_m"] = 0.009
    (other / "batch.yaml").write_text(yaml.safe_dump(stated))
    run = CliRunner().invoke(
        cli.app, ["diagnose", str(raw / "monday"), str(other), "--out", str(tmp_path / "out"), "--trust-inputs"]
    )
    assert isinstance(run.exception, cc.InputError)
    line = str(run.exception)
    assert line.startswith(f"{other / 'batch.yaml'}: rig.load.pulley_radius_m is 0.009, but 0.006 in {raw / 'monday'}")
    assert not (tmp_path / "out").exists()


def test_contradictions_name_their_batch(raw, tmp_path):
    def dead(table):
        table["drive_current_A"] = 0.0
        return table

    spoiled = spoil(write_batch(tmp_path / "wednesday", (7.0, 5.0)), dead)
    found = cc.diagnose([raw / "monday", spoiled])
    assert found.verdict == "inputs-inconsistent"
    assert found.report["batches"] == ["monday", "wednesday"]
    assert all(one["what"].startswith("wednesday/") for one in found.report["not_judged"])


@pytest.mark.parametrize("given, line", [(None, "got None"), ([], "got an empty list"), ([3], "got int")])
def test_what_is_no_batch_is_named(given, line):
    with pytest.raises(cc.InputError, match=f"batch: a Batch or its folder.*{line}"):
        cc.diagnose(given)


def test_a_value_of_one_batch_acts_on_that_batch_alone():
    of_a, of_b = (batch_key("friction_scale", name) for name in ("a@5N", "b"))
    values = {"friction_coefficient": 0.1, of_a: 1.1, of_b: 2.0}
    assert of_batch(values, "a@5N") == {"friction_coefficient": 0.1, "friction_scale": 1.1}
    assert of_batch(values, "") == {"friction_coefficient": 0.1}
    assert not acts_on(of_b, "a@5N")


def of_sessions(names):
    """Whitened recordings of the paper's model, each of one of the batches."""
    found = []
    for w, name in zip(batch(), names, strict=True):
        recording = w.observations.given.recording
        given = replace(w.observations.given, recording=replace(recording, id=f"{name}/{recording.id}"))
        found.append(replace(w, observations=replace(w.observations, given=given)))
    return found


def test_no_run_is_spent_on_values_of_other_batches_and_their_derivatives_are_zero(monkeypatch):
    recordings = of_sessions(["monday", "monday", "tuesday", "tuesday"])
    free = calibration(PARAMETERS, [w.observations for w in recordings])
    problem = Problem(recordings, free)
    blocks = problem.blocks(problem.start)
    for session, block in zip(["monday"] * 2 + ["tuesday"] * 2, blocks, strict=True):
        moved = np.abs(block.derivatives).max(axis=0)
        acting = [acts_on(name, session) for name in problem.names]
        assert ((moved > 0) == acting).all()


def test_the_friction_of_a_batch_with_one_recording_is_that_recordings_nuisance():
    made = [w.observations.given.recording for w in of_sessions(["monday", "monday", "monday", "tuesday"])]
    observations, _ = observations_of(made, PARAMETERS)
    spreads = [dict((n, s / v) for n, v, s in _scalar_nuisances(o) if v)["friction_coefficient"] for o in observations]
    assert spreads == pytest.approx([0.01] * 3 + [np.hypot(0.01, 0.02)])
    assert KEYS[0] in (free := calibration(PARAMETERS, observations)) and KEYS[1] not in free


def test_a_batch_that_is_left_out_returns_to_the_prior():
    """The prior is never left out: nothing else says what the friction of a batch is without its recordings."""
    recordings = of_sessions(["monday", "monday", "monday", "tuesday"])
    free = calibration(PARAMETERS, [w.observations for w in of_sessions(["monday", "monday", "tuesday", "tuesday"])])
    start = {name: one.start for name, one in free.items()}
    found = fit(recordings, PAPER, free, start)
    assert found.loo_values[3][KEYS[1]] == pytest.approx(1.0, abs=1e-3)
    spread = settings.FRICTION_BETWEEN
    assert abs(found.values[KEYS[0]] - 1.0) < spread and abs(found.values[KEYS[1]] - 1.0) < spread


def test_the_prior_of_a_batch_weighs_one_effective_sample():
    """A friction one standard deviation off costs as much as a nuisance of a recording does."""
    recordings = of_sessions(["monday", "monday", "tuesday", "tuesday"])
    free = calibration(PARAMETERS, [w.observations for w in recordings])
    (distance, _), derivatives = fit(recordings, PAPER, free, {name: one.start for name, one in free.items()}).prior
    assert derivatives.shape == (2, len(free))
    weight = derivatives[0].max() * settings.FRICTION_BETWEEN
    # 20 effective samples in each of five channels.
    assert weight**2 == pytest.approx(1 / 100)
    assert abs(distance) < weight
