"""What a person may type by mistake: one clear line for each problem, no traceback, the exit code 2; as JSON too."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from example_folder import noisy_batch

from ccmodel.model.files import model_as_dict
from ccmodel.rig.findings import Finding
from model_runs import CABLE

CHECKS = {
    "no such folder": (["check", "raw/loopss"], "raw/loopss: there is no such folder; did you mean raw/loops?"),
    "an empty word": (["check", ""], "the word after 'ccmodel check' is empty: is a variable of the shell not set?"),
    "a file in place of a folder": (["check", "a-file"], "a-file: is a file; a folder is expected"),
    "an empty folder": (["check", "empty"], "empty: has no batch.yaml; "),
    "a folder of batches": (["check", "raw"], "it holds the batches loops"),
    "a command": (["chek", "raw/loops"], "Did you mean 'check'"),
    "an option": (["check", "raw/loops", "--jsn"], "No such option: --jsn. Did you mean --json?"),
    "an option without its stop": (["check", "raw/loops", "--x"], "No such option: --x. ccmodel check --help shows"),
    "an option before the command": (["--quiet", "check"], "--quiet stands after the name of the command."),
    "no argument": (["check"], "Missing argument"),
    "an argument too many": (["check", "raw/loops", "raw/loops"], "unexpected extra argument"),
    "a mechanism": (["mechanisms", "backlsh"], "backlash"),
    "an excluded law": (
        ["diagnose", "raw/loops", "--out", "out", "--without", "learned-sliding-friction-by-speed"],
        "--without: learned-sliding-friction-by-speed is a learned law",
    ),
    "an excluded mechanism": (["diagnose", "raw/loops", "--out", "out", "--without", "kinck"], "--without: "),
    "a candidate": (["diagnose", "raw/loops", "--out", "out", "--candidate", "kink at moon"], "--candidate: "),
    "a tolerance that is no number": (["diagnose", "raw/loops", "--out", "out", "--tolerance", "abc"], "--tolerance: "),
    "a step that is no number": (["diagnose", "raw/loops", "--out", "out", "--step", "abc"], "'--step'"),
    "a step too small": (["diagnose", "raw/loops", "--out", "out", "--step", "0"], "'--step'"),
    "no --out": (["diagnose", "raw/loops"], "Missing option '--out'"),
    "--freeze alone": (["diagnose", "raw/loops", "--out", "out", "--freeze"], "--freeze: "),
    "no baseline": (
        ["diagnose", "raw/loops", "--out", "out", "--baseline", "no.json"],
        "no.json: there is no such file",
    ),
    "a model that is text": (["predict", "raw/loops", "--model", "a-file", "--out", "out"], "a-file: "),
    "a model that is a folder": (["predict", "raw/loops", "--model", "raw", "--out", "out"], "raw: is a folder"),
    "other JSON as a model": (["predict", "raw/loops", "--model", "other.json", "--out", "out"], "other.json: "),
    "a diagnosis as a model": (
        ["predict", "raw/loops", "--model", "broken/diagnosis.json", "--out", "out"],
        "broken/diagnosis.json: is a diagnosis, not a model; use broken/model.json beside it",
    ),
    "no motion": (["simulate", "no.csv", "--model", "other.json", "--out", "s.csv"], "no.csv: there is no such file"),
    "logs that are not there": (["import", "no.csv", "--out", "new"], "no.csv"),
    "no map": (["import", "a-file", "--map", "no.yaml", "--out", "new"], "no.yaml: there is no such map"),
    "no results": (["report", "nowhere"], "nowhere: there is no such folder"),
    "results of nothing": (["report", "empty"], "empty: holds no results of a run that came to its end"),
    "a broken diagnosis": (["report", "broken"], "broken/diagnosis.json: "),
    "no accepted run": (["accuracy", "check", "empty"], "tables/baseline.json: "),
    "no reason": (["accuracy", "accept", "empty", "--reason", " "], "--reason: "),
    "a commit": (["accuracy", "history", "--rev", "no-such-commit"], "git rev-list"),
    "no settings": (["table-one", "no.yaml", "--out", "t", "--figure", "t.png"], "no.yaml: there is no such file"),
    "cores": (["table-one", "a-file", "--out", "t", "--figure", "t.png", "--cores", "0"], "'--cores'"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mistakes")
    noisy_batch(folder / "raw/loops", pretensions=(7.0,))
    for name in ("empty", "broken"):
        (folder / name).mkdir()
    (folder / "a-file").write_text("a text\n")
    (folder / "other.json").write_text('{"colour": "red"}')
    (folder / "broken/diagnosis.json").write_text('{"batch": "b", "verdict": "explained"}')
    return folder


@pytest.mark.parametrize("words, message", CHECKS.values(), ids=CHECKS)
def test_a_mistake_is_answered_in_a_line(words, message, folder, run, monkeypatch):
    monkeypatch.chdir(folder)
    ended = run(*words)
    assert (ended.code, ended.out) == (2, "")
    assert message in ended.err
    assert "Traceback" not in ended.err
    assert ended.err.count("\n") == 1
    assert not (folder / "out").exists()
    as_json = run(*words, "--json")
    assert (as_json.code, as_json.err) == (2, "")
    assert message in json.loads(as_json.out)["error"][0]


def test_a_batch_may_be_named_by_its_file(folder, run):
    assert run("check", folder / "raw/loops/batch.yaml").out == run("check", folder / "raw/loops").out


def test_an_error_of_the_program_has_its_traceback_and_its_exit_code(folder, run, monkeypatch):
    monkeypatch.setattr("ccmodel.rig.ingest.ingest_batch", lambda *_: 1 / 0)
    ended = run("check", folder / "raw/loops")
    assert (ended.code, ended.out) == (70, "")
    assert ended.err.startswith("Traceback") and ended.err.splitlines()[-1].endswith(
        "ZeroDivisionError: division by zero"
    )
    as_json = run("check", folder / "raw/loops", "--json")
    assert as_json.code == 70 and "Traceback" in as_json.err
    assert "ZeroDivisionError: division by zero" in json.loads(as_json.out)["error"][0]


def test_a_reader_that_leaves_is_no_finding(folder):
    command = [sys.executable, "-m", "ccmodel.cli", "check", folder / "raw/loops"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    process.stdout.close()
    assert (process.stderr.read(), process.wait()) == ("", 141)


@pytest.mark.parametrize(
    "words, line",
    [(["check", "raw/loops", "--json"], ""), (["mechanisms"], ""), (["check", "no", "--json"], "no: there is no")],
)
def test_an_output_that_takes_nothing_is_one_line(words, line, folder):
    command = [sys.executable, "-m", "ccmodel.cli", *words]
    with open("/dev/full", "w") as full:
        ended = subprocess.run(command, cwd=folder, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stderr.startswith(f"standard output: No space left on device\n{line}")
    assert ended.stderr.count("\n") == (2 if line else 1)


def test_a_suggested_command_can_be_copied(folder, run):
    noisy_batch(folder / "my data/loops", pretensions=(7.0,))
    batch = folder / "my data/loops"
    assert f"ccmodel diagnose '{batch}' --out DIR" in run("check", batch).out
    (batch / "batch.yaml").unlink()
    assert f"ccmodel check '{batch}'" in run("init", batch).out
    (folder / "my data/none").mkdir()
    assert f"ccmodel init '{folder}/my data/none'" in run("check", folder / "my data/none").err


@pytest.mark.parametrize(
    "words, line",
    [
        (["fit", "raw/loops", "--out", "f.json", "--step", "1"], "--step: 1 s leaves "),
        (["diagnose", "raw/loops", "--out", "out", "--step", "1"], "--step: 1 s leaves "),
        (["simulate", "motion.csv", "--model", "fit.json", "--out", "s.csv", "--pretension", "inf"], "--pretension: "),
        (["simulate", "motion.csv", "--model", "fit.json", "--out", "fit.json"], "--out: fit.json: is read by"),
        (["compensate", "fit.json", "--wanted", "wanted.csv", "--out", "wanted.csv"], "--out: wanted.csv: is read by"),
        (["diagnose", "raw/loops", "--baseline", "model.json", "--out", "."], "--out: model.json: is read by"),
        (
            ["compensate", "fit.json", "--wanted", "wanted.csv", "--out", "d.csv", "--max-acceleration", "1"],
            "--max-acceleration: needs --max-speed too",
        ),
        (
            ["simulate", "motion.csv", "--model", "rig.json", "--out", "s.csv", "--recording", "x"],
            "--recording: the model knows a; got x",
        ),
        (
            ["compensate", "rig.json", "--wanted=wanted.csv", "--out=d.csv", "--recording=x"],
            "--recording: the model knows a; got x",
        ),
        (
            ["estimate", "raw/loops", "--model", "fit.json", "--out", "out", "--tolerance", "tau_out_Nm=0.02"],
            "--tolerance: an estimate has those of tau_in_Nm and theta_out_rad; got 'tau_out_Nm'",
        ),
        (
            ["diagnose", "raw/loops", "--out", "out", "--freeze"],
            "--freeze: there is no baseline to freeze; state its file, baseline=FILE or --baseline FILE",
        ),
        (["diagnose", "raw/loops", "--out", "out", "--time-limit", "-1"], "--time-limit: "),
        (["diagnose", "raw/loops", "--out", "out", "--run-limit", "0"], "--run-limit: "),
        (
            ["diagnose", "raw/loops", "--out", "out", "--suspect", "kink at moon"],
            "--suspect is now called --candidate\n--candidate: ",
        ),
        (["diagnose", "raw/loops", "--out", "out", "--keep-law", "A b"], "--keep-law: 'A b' is no name"),
        (["fit", "raw/loops", "--out", "f.json", "--tolerance", "2"], "--tolerance: "),
        # A file that has the name of an option.
        (["simulate", "recording", "--model", "fit.json", "--out", "s.csv"], "recording: no column time_s"),
    ],
)
def test_an_option_is_named_as_it_was_typed(words, line, folder, run, tmp_path, monkeypatch):
    shutil.copytree(folder / "raw", tmp_path / "raw")
    monkeypatch.chdir(tmp_path)
    for name in ("fit.json", "model.json"):
        Path(name).write_text(json.dumps(model_as_dict(CABLE, {})))
    condition = {"recording": "a", "pretension_N": 7.0, "conduit": [{"length_m": 1.0, "bend_rad": 3.0}]}
    rig = {"batch": "b", "origin": "rig", "far_end": None, "conditions": [condition]}
    Path("rig.json").write_text(json.dumps(model_as_dict(CABLE, {}) | {"rig": rig}))
    Path("recording").write_text("t\n1\n")
    for name, angle in (("motion.csv", "theta_in_rad"), ("wanted.csv", "theta_out_rad")):
        Path(name).write_text(f"time_s,{angle}\n0,0\n0.1,0.1\n")
    ended = run(*words)
    assert ended.code == 2
    assert ended.err.startswith(line)


def test_a_full_disk_is_one_line(folder, run, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device", "out/diagnosis.json")

    monkeypatch.setattr("ccmodel.diagnose", full)
    ended = run("diagnose", folder / "raw/loops", "--out", folder / "out")
    assert (ended.code, ended.err) == (2, "out/diagnosis.json: No space left on device\n")


@pytest.mark.parametrize(
    "out, message",
    [
        ("a-file", "is a file; name a folder"),
        ("a-file/below/it", "cannot be made: {folder}/a-file is a file"),
        ("/proc/none/below", "cannot be written"),
    ],
)
def test_a_folder_is_tried_before_the_work(out, message, folder, run, monkeypatch):
    monkeypatch.setattr("ccmodel.diagnose", lambda *_, **__: pytest.fail("worked"))
    ended = run("diagnose", folder / "raw/loops", "--out", folder / out)
    assert ended.code == 2
    assert f"--out: {folder / out}: {message.format(folder=folder)}" in ended.err


@pytest.mark.parametrize("out, message", [("raw", "is a folder; name a file"), ("a-file/below", "is a file")])
def test_a_file_is_tried_before_the_work(out, message, folder, run, monkeypatch):
    monkeypatch.setattr("ccmodel.simulate", lambda *_, **__: pytest.fail("worked"))
    ended = run("simulate", folder / "a-file", "--model", folder / "other.json", "--out", folder / out)
    assert ended.code == 2
    assert message in ended.err


def said(verdict, findings=(), not_judged=()):
    """A diagnosis that takes no time and writes nothing."""
    batch, report = SimpleNamespace(findings=findings), {"verdict": verdict, "not_judged": not_judged}
    found = SimpleNamespace(verdict=verdict, headline="it is as it is", report=report, batch=batch)
    return lambda *_, **__: found


def test_the_trial_leaves_nothing(folder, run, monkeypatch):
    monkeypatch.setattr("ccmodel.diagnose", said("explained"))
    ended = run("diagnose", folder / "raw/loops", "--out", folder / "new/below/it")
    assert (ended.code, ended.out.splitlines()[0], ended.err) == (0, "it is as it is", "")
    assert run("diagnose", folder / "raw/loops", "--out", folder / "new", "--quiet").out == "it is as it is\n"
    assert not (folder / "new").exists()


def test_agreement_is_no_failure_if_asked_for(folder, run, monkeypatch):
    monkeypatch.setattr("ccmodel.diagnose", said("agrees"))
    assert run("diagnose", folder / "raw/loops", "--out", folder / "out", "--strict").code == 0


@pytest.mark.parametrize("strict, code", [([], 0), (["--strict"], 1)])
@pytest.mark.parametrize("verdict", ["explained", "undecided", "unexplained", "inputs-inconsistent"])
def test_a_verdict_is_no_failure_unless_asked_for(verdict, strict, code, folder, run, monkeypatch):
    monkeypatch.setattr("ccmodel.diagnose", said(verdict))
    assert run("diagnose", folder / "raw/loops", "--out", folder / "out", *strict).code == code


def test_a_diagnosis_names_the_files_that_were_refused(folder, run, monkeypatch):
    empty = Finding("loops", "raw/loops/b.csv", None, None, "refused", "is empty")
    gap = Finding("loops", "raw/loops/a.csv", None, None, "warning", "has a gap")
    monkeypatch.setattr("ccmodel.diagnose", said("agrees", (gap, empty)))
    ended = run("diagnose", folder / "raw/loops", "--out", folder / "out")
    assert (ended.code, ended.err) == (0, "refused: raw/loops/b.csv: is empty\n")


@pytest.mark.parametrize(
    "what, why, remedy",
    [
        (
            "further candidates",
            "the limit of 9,000 model runs was reached before all of them were fitted",
            "; repeat with a higher --run-limit",
        ),
        (
            "further candidates",
            "the time limit of 160 s was reached before all of them were fitted",
            "; repeat with a higher --time-limit, such as 900",
        ),
        (
            "the place of the mismatch",
            "the limit was reached before the model was fitted without each channel",
            "; repeat with a higher --run-limit or a higher --time-limit, such as 900",
        ),
        ("friction apart from bend", "one bend angle", ""),
    ],
)
def test_a_diagnosis_says_what_it_did_not_judge_and_what_to_do_about_a_limit(
    what, why, remedy, folder, run, monkeypatch
):
    refused = {"what": "b.csv", "why": "is empty", "refused": True}
    monkeypatch.setattr("ccmodel.diagnose", said("unexplained", (), ({"what": what, "why": why}, refused)))
    words = ["diagnose", folder / "raw/loops", "--out", folder / "out"]
    assert run(*words).err == f"warning: not judged: {what}: {why}{remedy}\n"
    assert run(*words, "--quiet").err == ""


def test_contradictions_are_those_of_the_headline(folder, run, monkeypatch):
    contradiction = {"what": "a.csv", "why": "is 0 throughout", "confidence": 1.0}
    monkeypatch.setattr("ccmodel.diagnose", said("inputs-inconsistent", (), (contradiction,)))
    assert run("diagnose", folder / "raw/loops", "--out", folder / "out").err == ""


def test_no_text_of_a_file_steers_the_terminal(run, tmp_path):
    said = {"format": 1, "batch": "\x1b]0;evil\x07", "verdict": None, "why": "a\x1b[2J"}
    (tmp_path / "diagnosis.json").write_text(json.dumps(said))
    ended = run("report", tmp_path)
    assert "\x1b" not in ended.out + ended.err and "\\x1b]0;evil" in ended.out + ended.err
