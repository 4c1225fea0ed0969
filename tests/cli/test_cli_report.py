"""The summary of a run and of a diagnosis."""

import json

import pytest

from ccmodel.outputs import new_files
from ccmodel.report.verdict import sentence

ERROR = {"tau_in": {"before": 0.012, "after": 0.002, "noise": 0.001, "unit": "N*m"}}
FIT = {"error": ERROR, "held_out": ["a"]}
AGREES = {"batch": "loops", "verdict": "agrees", "is_held": False, "fit": FIT, "not_judged": []}


def write(file, content):
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(content))


def test_a_run(run, tmp_path):
    write(tmp_path / "left-out.json", {"left_out": ["a.csv: is empty"], "warnings": ["b.csv: has a gap"]})
    write(tmp_path / "diagnoses/loops/diagnosis.json", AGREES)
    write(tmp_path / "diagnoses/bad/diagnosis.json", {"batch": "bad", "verdict": None, "why": "no recording"})
    (tmp_path / "index.html").touch()
    ended = run("report", tmp_path)
    assert ended.code == 1
    assert ended.out.splitlines() == [
        "bad: Not diagnosed: no recording.",
        f"loops: agrees. {sentence(AGREES)}",
        "  held-out error over the noise floor: τ_in 12.0 -> 2.0",
        f"page: {tmp_path / 'index.html'}",
    ]
    assert ended.err.splitlines() == ["warning: b.csv: has a gap", "refused: a.csv: is empty"]
    content = json.loads(run("report", tmp_path, "--json").out)
    assert content["left_out"] == ["a.csv: is empty"]
    assert [v["verdict"] for v in content["verdicts"]] == [None, "agrees"]


def test_a_verdict_of_an_earlier_run_is_not_reported(run, tmp_path):
    for name in ("loops", "taken-out"):
        write(tmp_path / f"diagnoses/{name}/diagnosis.json", AGREES | {"batch": name})
    write(tmp_path / "left-out.json", {"left_out": [], "warnings": [], "diagnosed": ["loops"]})
    content = json.loads(run("report", tmp_path, "--json").out)
    assert [v["batch"] for v in content["verdicts"]] == ["loops"]


def test_a_diagnosis(run, tmp_path):
    write(tmp_path / "diagnosis.json", AGREES)
    ended = run("report", tmp_path)
    assert ended.code == 0
    assert ended.out.startswith("loops: agrees.")


@pytest.mark.parametrize("verdict", ["agrees", "inputs-inconsistent"])
def test_a_file_that_the_diagnosis_refused_was_left_out(run, tmp_path, verdict):
    refused = {"what": "b.csv", "why": "is empty", "refused": True}
    other = {"what": "a.csv, drive_current_A", "why": "is 0 throughout"}
    write(tmp_path / "diagnosis.json", AGREES | {"verdict": verdict, "not_judged": [other, refused]})
    ended = run("report", tmp_path)
    assert ended.code == 1
    assert ended.err.splitlines()[-1] == "refused: b.csv: is empty"
    assert json.loads(run("report", tmp_path, "--json").out)["left_out"] == ["b.csv: is empty"]


def test_a_folder_whose_files_a_killed_command_has_put_aside(run, tmp_path):
    with pytest.raises(ValueError, match="stopped"), new_files(tmp_path) as fresh:
        write(fresh / "diagnosis.json", AGREES)
        write(tmp_path / "diagnosis.json", AGREES)
        ended = run("report", tmp_path)
        raise ValueError("stopped")
    assert ended.err.splitlines() == [
        f"warning: {tmp_path}: a command is writing there, or was killed: run it again, and it restores or replaces the"
        " earlier files"
    ]
    assert run("report", tmp_path).err == ""


@pytest.mark.parametrize("quiet, warned", [([], True), (["--quiet"], False)])
def test_inputs_that_contradict_one_another(quiet, warned, run, tmp_path):
    contradiction = {"what": "a.csv, drive_current_A", "why": "is 0 throughout"}
    write(
        tmp_path / "diagnosis.json",
        AGREES | {"verdict": "inputs-inconsistent", "fit": None, "not_judged": [contradiction]},
    )
    ended = run("report", tmp_path, *quiet)
    assert ended.code == 1
    assert "inconsistent: a.csv, drive_current_A: is 0 throughout" in ended.err
    write(tmp_path / "diagnosis.json", AGREES | {"not_judged": [contradiction]})
    ended = run("report", tmp_path, *quiet)
    assert ended.code == 0
    assert bool(ended.err) == warned
