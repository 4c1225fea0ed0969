"""The gate in the pipeline: the study, its part of the page, and the three commands."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from test_pipeline import snakemake

from builders import write_batch
from ccmodel.accuracy.baseline import make_baseline, versions
from ccmodel.accuracy.gate import state_of
from ccmodel.accuracy.history import now, read_history
from ccmodel.provenance import file_digest
from ccmodel.studies.baseline.settings import AgainstBaseline


def accuracy(folder: Path, *arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-c", "from ccmodel.cli import main; main()", "accuracy", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A run of a tiny batch without a baseline."""
    folder = tmp_path_factory.mktemp("run")
    write_batch(folder / "data/raw/tiny")
    files = {"file": "config/baseline.json", "history": "config/history.csv"}
    (folder / "config.yaml").write_text(yaml.safe_dump({"baseline": files}))
    run = snakemake(folder)
    assert run.returncode == 0, run.stdout + run.stderr
    return folder


@pytest.mark.long
def test_from_no_baseline_to_a_loss(finished):
    """One run, in the order in which a project goes through it."""
    page, baseline = finished / "results/index.html", finished / "config/baseline.json"
    assert "there is no baseline" in page.read_text()
    said = accuracy(finished, "check")
    assert (said.returncode, said.stderr.count("\n")) == (2, 1)
    assert "accuracy accept" in said.stderr

    assert accuracy(finished, "accept", "--reason", " ").returncode == 2
    assert accuracy(finished, "accept", "--reason", "the first").returncode == 0
    assert accuracy(finished, "check").returncode == 0
    assert read_history(finished / "config/history.csv")["batch"].eq("tiny").all()
    assert "tiny" in accuracy(finished, "history", "--file", "config/history.csv").stdout

    run = snakemake(finished)
    assert "Making study baseline" in run.stdout + run.stderr, "an accepted baseline is an input of the page"
    assert "No loss of accuracy" in page.read_text()
    assert (finished / "results/figures/accuracy-history.png").stat().st_size > 10_000

    content = json.loads(baseline.read_text())
    channel = content["batches"]["tiny"]["sets"]["estimated"]["channels"]["tau_in_Nm"]
    channel["errors"] = [error / 1.2 for error in channel["errors"]]
    baseline.write_text(json.dumps(content))
    said = accuracy(finished, "check")
    assert said.returncode == 1
    (line,) = [line for line in said.stderr.splitlines() if line.startswith("lost")]
    assert "batch tiny, τ_in with estimated parameters" in line
    assert "+20.0 %" in line

    channel["errors"] = [error * 2 for error in channel["errors"]]
    baseline.write_text(json.dumps(content))
    said = accuracy(finished, "check")
    assert said.returncode == 0, "a gain is no failure"
    assert "gained: batch tiny, τ_in" in said.stdout
    assert "accept it" in said.stdout

    del content["batches"]["tiny"]
    baseline.write_text(json.dumps(content))
    said = accuracy(finished, "check")
    assert said.returncode == 1
    assert said.stderr.strip() == (
        "not compared: batch tiny: the baseline does not have it; accept it once its accuracy is right"
    )

    baseline.write_text(json.dumps(content | {"format": 9}))
    said = accuracy(finished, "check")
    assert (said.returncode, said.stderr.count("\n")) == (2, 1)
    assert "format 9" in said.stderr


def git(folder: Path, *arguments: str) -> str:
    command = ["git", "-c", "user.name=a", "-c", "user.email=a@b", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.strip()


@pytest.mark.long
def test_an_accepted_baseline_states_the_commit_and_the_versions_of_the_run(finished, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(finished, folder, copy_function=shutil.copy2)
    shutil.rmtree(folder / "config", ignore_errors=True)
    git(folder, "init", "-q")
    (folder / "notes").write_text("1")
    git(folder, "add", "notes", "config.yaml")
    git(folder, "commit", "-qm", "one")
    (folder / "notes").write_text("2")
    assert snakemake(folder).returncode == 0
    state = folder / "results/tables/baseline.json"
    measured = json.loads(state.read_text())
    assert measured["commit"].endswith("+") and measured["versions"] == versions()

    git(folder, "commit", "-qam", "two")
    assert "Making study baseline" in snakemake(folder, "--dry-run").stdout
    assert snakemake(folder).returncode == 0
    assert "Nothing to be done" in snakemake(folder, "--dry-run").stdout
    measured = json.loads(state.read_text()) | {"versions": {"ccmodel": "0.0", "numpy": "0.1"}}
    state.write_text(json.dumps(measured))
    assert accuracy(folder, "accept", "--reason", "why").returncode == 0
    accepted = json.loads((folder / "config/baseline.json").read_text())
    assert accepted["commit"] == git(folder, "log", "-1", "--format=%h")
    assert accepted["versions"] == {"ccmodel": "0.0", "numpy": "0.1"}
    assert set(read_history(folder / "config/history.csv")["version"]) == {"0.0"}

    # An older baseline takes its place.
    assert snakemake(folder).returncode == 0
    (folder / "config/baseline.json").write_text(json.dumps(accepted | {"reason": "another"}))
    os.utime(folder / "config/baseline.json", (0, 0))
    assert "Making study baseline" in snakemake(folder, "--dry-run").stdout


def test_the_versions_are_those_of_the_run(measured):
    assert state_of(measured / "out/results").versions == versions(), "a run of before does not state them"
    file = measured / "out/results/tables/baseline.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"versions": {"numpy": "0.1"}}))
    state = state_of(measured / "out/results")
    assert state.versions == {"numpy": "0.1"}
    accepted = make_baseline({}, state.limits, state.date, state.commit, "why", state.versions)
    assert accepted.versions == {"numpy": "0.1"}


@pytest.fixture
def measured(tmp_path):
    """The study's file beside what it has measured, of a run in a folder of its own."""
    folder = tmp_path / "project"
    inputs = {f"out/results/{name}": "1" for name in ("recordings/tiny.nc", "simulated/estimated/tiny.nc")}
    for name, text in (inputs | {"config/baseline.json": "{}"}).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    stated = {"file": "config/baseline.json", "history": "config/history.csv"}
    digests = {name: file_digest(folder / name) for name in (*inputs, "config/baseline.json")}
    content = {"settings": stated | AgainstBaseline().limits.model_dump(), "measured": {}}
    content |= {"commit": "abc1234", "date": "2026-01-01T00:00:00+00:00", "provenance": {"sha256": digests}}
    (folder / "out/results/tables").mkdir()
    (folder / "out/results/tables/baseline.json").write_text(json.dumps(content))
    return folder


@pytest.mark.parametrize("started_in", [".", "project", "project/config"])
def test_baseline_and_commit_are_those_of_the_run(measured, tmp_path, monkeypatch, started_in):
    monkeypatch.chdir(tmp_path / started_in)
    state = state_of(measured / "out/results")
    assert state.baseline.samefile(measured / "config/baseline.json")
    assert state.history.parent.samefile(measured / "config")
    assert (state.commit, state.date) == ("abc1234", "2026-01-01T00:00:00+00:00")
    (measured / "config/baseline.json").write_text("accepted since")
    assert state_of(measured / "out/results") == state


def test_a_run_with_changes_that_are_not_committed_has_the_present_date(measured):
    file = measured / "out/results/tables/baseline.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"commit": "abc1234+", "date": None}))
    state = state_of(measured / "out/results")
    assert state.commit == "abc1234+"
    assert state.date[:10] == now()[:10]


@pytest.mark.parametrize("change", [lambda file: file.write_text("2"), lambda file: file.unlink()])
def test_results_that_have_changed_since_they_were_measured_are_refused(measured, change):
    change(measured / "out/results/simulated/estimated/tiny.nc")
    for words in (["check"], ["accept", "--reason", "why"]):
        said = accuracy(measured, *words, "out/results")
        assert (said.returncode, said.stderr) == (
            2,
            "out/results/simulated/estimated/tiny.nc: the results have changed since their accuracy was measured; run"
            " again\n",
        )


def test_a_folder_without_a_run_is_one_line(tmp_path):
    assert accuracy(tmp_path, "check").stderr == "results: there is no such folder\n"
    (tmp_path / "results").mkdir()
    said = accuracy(tmp_path, "check")
    assert said.returncode == 2
    assert "no run with the key 'baseline'" in said.stderr
