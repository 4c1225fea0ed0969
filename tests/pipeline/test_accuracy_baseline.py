"""The gate in the pipeline: the study, its part of the page, and the three commands."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from test_pipeline import snakemake

from builders import write_batch
from ccmodel.accuracy.history import read_history


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


def test_a_folder_without_a_run_is_one_line(tmp_path):
    assert accuracy(tmp_path, "check").stderr == "results: there is no such folder\n"
    (tmp_path / "results").mkdir()
    said = accuracy(tmp_path, "check")
    assert said.returncode == 2
    assert "no run with the key 'baseline'" in said.stderr
