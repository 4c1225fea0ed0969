"""The verdict inputs-inconsistent: no physics is blamed for recordings that contradict one another."""

import errno
import json
from dataclasses import dataclass, replace

import pandas as pd
import pytest
from test_diagnosis import run, spoil

from builders import write_batch
from ccmodel.model.files import read_model_file
from ccmodel.rig import ingest as rig
from ccmodel.rig.findings import Finding
from ccmodel.steps import ingest as step
from ccmodel.studies.diagnosis import run as stage
from ccmodel.studies.diagnosis.inconsistent import report
from ccmodel.studies.diagnosis.settings import Diagnosing
from ccmodel.typed import InputError
from model_runs import CABLE

KEYS = {
    "format", "batch", "verdict", "is_held", "location", "mechanisms", "laws", "alternatives", "likeliest", "nearest",
    "fit", "repeatability", "next_experiment", "not_judged", "headline", "provenance",
}  # fmt: skip
DEAD = "is 0 throughout: a sensor that is dead or was never connected: column not used"


def found(text="is 10 times as large as the recordings show", confidence=0.9, **of):
    given = {"batch": "b", "file": "raw/b/one.csv", "row": None, "column": None, "severity": "inconsistent"} | of
    return Finding(text=text, confidence=confidence, **given)


def rewrite(folder, name, change):
    file = folder / f"{name}.csv.gz"
    change(pd.read_csv(file)).to_csv(file, index=False)


@pytest.fixture
def batch(tmp_path):
    return spoil(write_batch(tmp_path / "bench", pretensions=(7.0, 6.0)))


@pytest.fixture
def dead(batch):
    """A batch in which the drive current of one recording is dead."""
    rewrite(batch, "t-7N", lambda table: table.assign(drive_current_A=0.0))
    return batch


def test_a_dead_sensor_ends_the_diagnosis_before_any_model(dead, tmp_path, monkeypatch):
    monkeypatch.setattr(stage, "run", lambda *_: pytest.fail("a model was run"))
    out = tmp_path / "out"
    told = run("diagnose", dead, "--out", out)
    assert told.exit_code == 0
    said = json.loads((out / "diagnosis.json").read_text())
    assert said.keys() == KEYS
    assert said["verdict"] == "inputs-inconsistent"
    assert said["not_judged"] == [{"what": "t-7N.csv.gz, drive_current_A", "why": DEAD, "confidence": 1.0}]
    assert said["location"]["place"] == "drive-sensor"
    assert said["fit"]["error"] == {} and said["mechanisms"] == [] and said["provenance"]
    assert told.stdout.splitlines()[0] == said["headline"]
    assert said["headline"].startswith("bench: The inputs contradict one another. t-7N.csv.gz, drive_current_A: is 0")
    page = (out / "report.html").read_text()
    order = [page.rindex(text) for text in ("What contradicts", DEAD, "What to correct", "What was read", "t-6N")]
    assert order == sorted(order)
    assert (page.count(">τ_in<"), page.count(">τ_out<")) == (1, 2), "the dead channel is not used"
    assert not (out / "nearest.json").exists()
    assert run("diagnose", dead, "--out", out, "--strict").exit_code == 1


def test_the_model_files_state_that_there_is_no_model(dead, tmp_path):
    run("diagnose", dead, "--out", tmp_path / "out")
    for name in ("calibrated", "model"):
        file = tmp_path / f"out/{name}.json"
        with pytest.raises(InputError) as error:
            read_model_file(file)
        reason = "verdict 'inputs-inconsistent': the diagnosis has no "
        assert str(error.value).startswith(f"{file}: holds no model: {reason}")
        assert "\n" not in str(error.value)


def test_trusted_inputs_are_diagnosed_and_the_contradiction_is_listed(dead, tmp_path):
    assert run("diagnose", dead, "--out", tmp_path, "--trust-inputs").exit_code == 0
    said = json.loads((tmp_path / "diagnosis.json").read_text())
    assert said["verdict"] != "inputs-inconsistent"
    assert said["fit"]["error"]
    assert {"what": "t-7N.csv.gz, drive_current_A", "why": DEAD, "confidence": 1.0} in said["not_judged"]


def test_a_drive_encoder_that_wraps_makes_the_batch_inconsistent_and_a_cut_file_does_not(batch, tmp_path):
    whole = (batch / "t-6N.csv.gz").read_bytes()
    (batch / "t-6N.csv.gz").write_bytes(whole[:-300])
    ingested = rig.ingest_batch(batch)
    assert [f.is_inconsistent for f in ingested.findings] == [False]
    jump = "drive_encoder_counts"
    rewrite(batch, "t-7N", lambda t: t.assign(**{jump: t[jump] + 65536 * (t.index > len(t) // 2)}))
    told = run("diagnose", batch, "--out", tmp_path)
    assert told.exit_code == 0, "although no recording is left"
    assert [line.partition(".gz")[0] for line in told.stderr.splitlines()] == [
        f"refused: {batch / name}.csv" for name in ("t-7N", "t-6N")
    ]
    said = json.loads((tmp_path / "diagnosis.json").read_text())
    assert [n.get("refused", False) for n in said["not_judged"]] == [False, True]
    assert [n["what"].partition(",")[0] for n in said["not_judged"]] == ["t-7N.csv.gz", "t-6N.csv.gz"]
    assert "jumps by 65536 counts" in said["headline"]
    assert "(1 more in the report)" in said["headline"]
    told = run("check", batch)
    assert told.exit_code == 1


@pytest.mark.parametrize("trust", [False, True])
def test_the_pipelines_diagnosis_does_the_same(dead, tmp_path, monkeypatch, trust):
    step.ingest(dead, tmp_path / "bench.nc", tmp_path / "bench.json")
    out = tmp_path / "out"
    given = []
    monkeypatch.setattr(stage, "run", lambda _r, _e, _o, _b, not_judged, _p: given.extend(not_judged) or stop())
    stage.diagnose_recordings([tmp_path / "bench.nc"], out, Diagnosing(trust_inputs=trust))
    said = json.loads((out / "diagnosis.json").read_text())
    if trust:
        assert said["verdict"] is None
        assert given == [{"what": "t-7N.csv.gz, drive_current_A", "why": DEAD, "confidence": 1.0}]
    else:
        assert said["verdict"] == "inputs-inconsistent"
        assert said.keys() == KEYS
        models = [json.loads((out / f"{name}.json").read_text()) for name in ("calibrated", "model", "nearest")]
        assert [m["succeeded"] for m in models] == [False] * 3
        assert '<a href="../../index.html">' in (out / "report.html").read_text()


def stop():
    raise stage.ModelError("far enough")


def test_a_planted_contradiction_is_told_by_check_and_by_diagnose(batch, tmp_path, monkeypatch):
    radius = found(file=str(batch / "batch.yaml"), column="rig.drive.pulley_radius_m")
    monkeypatch.setattr(rig, "check_consistency", lambda recordings, description: [radius])
    told = run("check", batch)
    assert told.exit_code == 1
    assert "inconsistent" in told.stderr and radius.text in told.stderr
    run("diagnose", batch, "--out", tmp_path)
    said = json.loads((tmp_path / "diagnosis.json").read_text())
    assert said["location"]["place"] is None
    assert said["not_judged"][0]["what"] == "batch.yaml, rig.drive.pulley_radius_m"
    assert "batch.yaml, rig.drive.pulley_radius_m" in said["next_experiment"]["text"]


def test_the_surest_contradiction_stands_first():
    unsure, sure = found("is odd", 0.6, column="tau_out_Nm"), found("is wrong", 0.99, column="load_current_A")
    refused = found("is cut", 1.0, severity="refused")
    said = report("b", [refused, unsure, sure, found("gap", 1.0, severity="warning")])
    assert [n["why"] for n in said["not_judged"]] == ["is wrong", "is odd", "is cut"]
    assert said["location"]["place"] == "load-sensor"
    assert report("b", [sure, found(column="theta_in_rad")])["location"]["place"] is None


def test_a_page_that_cannot_be_written_leaves_the_earlier_diagnosis(dead, tmp_path, monkeypatch):
    out = tmp_path / "out"
    out.mkdir()
    earlier = {name: "earlier" for name in ("diagnosis.json", "report.html", "nearest.json", "notes.txt")}
    for name, text in earlier.items():
        (out / name).write_text(text)

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(stage, "write_inconsistent", full)
        told = run("diagnose", dead, "--out", out)
    assert isinstance(told.exception, InputError)
    assert str(told.exception) == f"{out}: cannot be written (No space left on device)"
    assert {file.name: file.read_text() for file in out.iterdir()} == earlier
    run("diagnose", dead, "--out", out)
    files = {"diagnosis.json", "report.html", "calibrated.json", "model.json", "notes.txt"}
    assert {file.name for file in out.iterdir()} == files


def test_a_stiffness_in_another_unit_is_no_physics_unless_it_is_trusted(batch, monkeypatch):
    @dataclass
    class Found:
        report: dict
        calibrated: None = None

        def model(self, _):
            return replace(CABLE, stiffness_N_per_m=7500.0)

    read = rig.ingest_batch(batch)
    cable = read.stated.rig.cable.model_copy(update={"stiffness_N_per_m": 13.88})
    stated = read.stated.model_copy(update={"rig": read.stated.rig.model_copy(update={"cable": cable})})
    monkeypatch.setattr(stage, "run", lambda *_: Found({"verdict": "agrees"}))
    monkeypatch.setattr(stage, "headline", lambda report: report["verdict"])
    said = stage.diagnosed(replace(read, batch=stated), {}).content
    assert said["verdict"] == "inputs-inconsistent"
    assert said["not_judged"][0]["what"] == "batch.yaml, rig.cable.stiffness_N_per_m"
    assert "13.88, and the fit to the recordings ends at 7.5e+03 N/m, 540 times as much" in said["not_judged"][0]["why"]
    assert stage.diagnosed(replace(read, batch=stated), {}, trust_inputs=True).content["verdict"] == "agrees"
    assert stage.diagnosed(read, {}).content["verdict"] == "agrees"
