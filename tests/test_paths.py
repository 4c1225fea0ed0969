"""Where a command may write: nowhere that it reads from, and only where it will be able to at the end."""

import os
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from builders import write_batch
from ccmodel import cli
from ccmodel.paths import existing_file, try_batch_folder, try_file, try_folder
from ccmodel.steps.files import write_table
from ccmodel.typed import InputError


def test_results_do_not_go_into_the_folder_of_a_batch(tmp_path):
    batch = write_batch(tmp_path / "known", pretensions=(7.0,))
    with pytest.raises(InputError, match="--out: .*known: is the folder of a batch"):
        try_folder(batch, "--out")
    assert try_batch_folder(batch) == batch
    for name in ("batch.yaml", "fit.json"):
        with pytest.raises(InputError, match="is in .*known, the folder of a batch; name a file outside it"):
            try_file(batch / name)


def test_predictions_leave_the_logs_of_a_batch(fitted_model, tmp_path):
    """A prediction has the name of its recording, and a log may have it too."""
    batch = write_batch(tmp_path / "known", pretensions=(7.0,))
    before = {file.name: file.read_bytes() for file in batch.iterdir()}
    for command in ("predict", "estimate"):
        words = [command, str(batch), "--model", str(fitted_model), "--out", str(batch)]
        ended = CliRunner().invoke(cli.app, words)
        assert isinstance(ended.exception, InputError)
        assert "is the folder of a batch" in str(ended.exception)
    assert {file.name: file.read_bytes() for file in batch.iterdir()} == before


@pytest.mark.parametrize("exists", [False, True])
def test_results_do_not_go_into_a_folder_within_a_batch(tmp_path, exists):
    """Its logs may lie there, and whatever the folder of a batch holds is part of what identifies the batch."""
    batch = write_batch(tmp_path / "known", pretensions=(7.0,))
    if exists:
        (batch / "logs").mkdir()
        (batch / "t-7N.csv.gz").rename(batch / "logs/t-7N.csv.gz")
        (tmp_path / "link").symlink_to(batch / "logs")
    for inside in (batch / "logs", batch / "logs/further", *([tmp_path / "link"] if exists else [])):
        with pytest.raises(InputError, match="is in .*known, the folder of a batch; name a folder outside it"):
            try_folder(inside)
        with pytest.raises(InputError, match="is in .*known, the folder of a batch; name a file outside it"):
            try_file(inside / "t-7N.csv.gz")
    assert not (batch / "logs/further").exists()


@pytest.mark.parametrize("name", ["model.json", "calibrated.json", "nearest.json"])
def test_a_diagnosis_does_not_replace_its_baseline(fitted_model, tmp_path, name):
    batch, out = write_batch(tmp_path / "known", pretensions=(7.0,)), tmp_path / "out"
    out.mkdir()
    before = fitted_model.read_bytes()
    (out / name).write_bytes(before)
    words = ["diagnose", str(batch), "--baseline", str(out / name), "--freeze", "--out", str(out)]
    ended = CliRunner().invoke(cli.app, words)
    assert isinstance(ended.exception, InputError)
    assert f"{out / name}: is read by this command" in str(ended.exception)
    assert (out / name).read_bytes() == before
    assert try_folder(out, files=["model.json"], read=[fitted_model]) == out


@pytest.mark.parametrize("read", ["motion", "model"])
def test_a_simulation_does_not_replace_what_it_reads(fitted_model, tmp_path, read):
    motion = tmp_path / "motion.csv"
    pd.DataFrame({"time_s": [0.0, 0.1], "theta_in_rad": [0.0, 0.1]}).to_csv(motion, index=False)
    out = {"motion": motion, "model": fitted_model}[read]
    before = out.read_bytes()
    words = ["simulate", str(motion), "--model", str(fitted_model), "--out", str(out)]
    ended = CliRunner().invoke(cli.app, words)
    assert isinstance(ended.exception, InputError)
    assert "is read by this command" in str(ended.exception)
    assert out.read_bytes() == before


@pytest.mark.parametrize("name", ["a" * 250, "a/" + "b" * 300, "zero\0byte"])
def test_a_name_that_cannot_be_made_is_refused_before_the_work(tmp_path, name):
    with pytest.raises(InputError, match="cannot be written"):
        try_file(tmp_path / name)
    if "/" in name:
        with pytest.raises(InputError, match="cannot be written"):
            try_folder(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_user_that_is_not_there_is_one_line():
    with pytest.raises(InputError, match="~nosuchuser/x: there is no such user"):
        existing_file("~nosuchuser/x")


def test_times_of_a_log_that_counts_from_1970_are_written_to_the_microsecond(tmp_path):
    table = pd.DataFrame({"time_s": [0.0, 1764342000.0021, 0.1 + 0.2], "tau_in_Nm": [1 / 3, 2e-9, 4.0]})
    write_table(tmp_path / "table.csv", table, digits=9)
    rows = (tmp_path / "table.csv").read_text().splitlines()
    assert rows[1] == "0,0.333333333"
    assert float(rows[2].partition(",")[0]) == pytest.approx(1764342000.0021, abs=1e-6, rel=0)
    assert rows[3] == "0.3,4"


@pytest.fixture(scope="module")
def fitted_model(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fitted")
    out = folder / "fit.json"
    words = ["fit", str(write_batch(folder / "known", pretensions=(7.0, 5.0))), "--out", str(out)]
    assert CliRunner().invoke(cli.app, words).exit_code == 0
    return out


def pipe(folder: Path) -> Path:
    os.mkfifo(folder / "pipe")
    return folder / "pipe"


@pytest.mark.parametrize("words", [("report",), ("accuracy", "history", "--history")])
def test_no_command_waits_for_a_pipe(tmp_path, words):
    if words == ("report",):
        (tmp_path / "diagnosis").mkdir()
        pipe(tmp_path / "diagnosis").rename(tmp_path / "diagnosis/diagnosis.json")
        asked = [*words, str(tmp_path / "diagnosis")]
    else:
        asked = [*words, str(pipe(tmp_path))]
    ended = CliRunner().invoke(cli.app, asked)
    assert isinstance(ended.exception, InputError)
    assert "it is a pipe" in str(ended.exception)
