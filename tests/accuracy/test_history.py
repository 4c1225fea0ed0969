"""Past commits: run in a clean worktree, measured by the present sources, skipped with a line where they fail."""

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks.accuracy_gate import run_pipeline
from builders import write_batch
from ccmodel.accuracy.gate import fill_history
from ccmodel.accuracy.history import COLUMNS, add_rows, head, overview, read_history, rows_of
from ccmodel.accuracy.measure import BatchAccuracy, ChannelAccuracy, SetAccuracy
from ccmodel.typed import InputError

# A pipeline that "simulates" by taking files that stand in the repository.
SNAKEFILE = (
    'rule all:\n    output: "results/tables/errors.csv"\n    shell: "cp -r stored/. results && touch {output}"\n'
)
# One whose job does not end by itself, and states its process.
WAITING = (
    'rule all:\n    output: "results/tables/errors.csv"\n'
    '    shell: "echo $$ > {job}; while true; do mkdir -p results; touch results/$RANDOM; sleep 0.05; done"\n'
)
FAILING = 'raise ValueError("this commit has a fault")\n'


def git(folder: Path, *arguments: str) -> str:
    identity = ["-c", "user.name=test", "-c", "user.email=test@example.org"]
    run = subprocess.run(["git", *identity, *arguments], cwd=folder, capture_output=True, text=True, check=True)
    return run.stdout.strip()


def commit(folder: Path, snakefile: str, version: str) -> str:
    (folder / "pyproject.toml").write_text(f'[project]\nname = "ccmodel"\nversion = "{version}"\n')
    (folder / "Snakefile").write_text(snakefile)
    git(folder, "add", "-A")
    git(folder, "commit", "-qm", version)
    return git(folder, "log", "-1", "--format=%h")


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    raw, results = tmp_path_factory.mktemp("raw"), tmp_path_factory.mktemp("results")
    write_batch(raw / "tiny")
    return results, run_pipeline(raw, ["tiny"], {}, results)


@pytest.fixture
def repository(measured, tmp_path, monkeypatch):
    """A repository with an empty first commit, whose later commits make the stored results."""
    git(tmp_path, "init", "-q")
    git(tmp_path, "commit", "-qm", "empty", "--allow-empty")
    shutil.copytree(measured[0], tmp_path / "stored")
    (tmp_path / "config").mkdir()
    (tmp_path / "config/config.yaml").write_text("{}\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_past_commits_are_run_and_measured_and_failures_are_lines(repository, measured):
    shutil.copytree(repository / "stored/simulated/estimated", repository / "stored/simulated/nearest")
    first, good = git(repository, "rev-parse", "HEAD"), commit(repository, SNAKEFILE, "0.5.0")
    bad = commit(repository, FAILING, "0.5.1")
    heard, file = [], repository / "history.csv"
    said = fill_history(file, [f"{first}..HEAD", first], 1, lambda text, done=None: heard.append(text))
    assert heard[0] == f"running commit {good}"
    assert said[0].startswith(f"{bad}: skipped: its run failed")
    assert "this commit has a fault" in said[0]
    assert "it has no pipeline" in said[1]
    table = read_history(file)
    assert set(table["commit"]) == {good}
    assert set(table["version"]) == {"0.5.0"}
    assert set(table["set"]) == {"estimated"}, "no verdict accepts the nearest model"
    now = measured[1]["tiny"].sets["estimated"].channels
    for row in table.itertuples():
        assert row.error == pytest.approx(now[row.channel].error, rel=1e-3)
        assert row.bias == pytest.approx(now[row.channel].bias, rel=1e-3)
    assert good in overview(file)
    assert git(repository, "worktree", "list").count("\n") == 0, "no worktree is left"


@pytest.mark.parametrize("number, code", [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_an_interruption_ends_the_run_of_a_past_commit_with_its_jobs(repository, number, code):
    job = repository / "job"
    commit(repository, WAITING.format(job=job), "0.5.0")
    command = [sys.executable, "-m", "ccmodel.cli", "accuracy", "history", "--rev", "HEAD", "--history", "h.csv"]
    # A job in the background of a shell ignores this signal, and its processes inherit that.
    heeding = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **heeding)
    until(lambda: job.exists() and job.read_text().strip())
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == code
    assert said.startswith("interrupted: nothing was written to h.csv")
    until(lambda: not Path(f"/proc/{job.read_text().strip()}").exists())
    assert git(repository, "worktree", "list").count("\n") == 0, "no worktree is left"


def until(holds):
    ends = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < ends
        time.sleep(0.05)


def test_an_unknown_revision_is_one_line(repository):
    with pytest.raises(InputError, match="rev-list"):
        fill_history(repository / "history.csv", ["nothing..HEAD"], 1, print)


def test_rows_of_a_commit_replace_earlier_ones_and_stand_in_the_order_of_dates(measured, tmp_path):
    file, batches = tmp_path / "history.csv", measured[1]
    for name, date in (("b", "2026-02-01"), ("a", "2026-01-01"), ("b", "2026-02-01")):
        add_rows(file, rows_of(batches, name, date, "1"))
    table = read_history(file)
    assert list(table.columns) == list(COLUMNS)
    assert list(dict.fromkeys(table["commit"])) == ["a", "b"]
    assert len(table) == 2 * len(batches["tiny"].sets["estimated"].channels)


def test_a_row_has_bias_scatter_and_error_by_hand():
    channel = ChannelAccuracy(biases=[3.0, -1.0], errors=[5.0, 7.0])
    one = BatchAccuracy(
        rig="rig",
        origin="rig",
        digest="",
        verdict="agrees",
        recordings={name: [0.0, 1.0, 100.0] for name in ("r-a", "r-b")},
        sets={"fitted": SetAccuracy(fitted_to=[], channels={"tau_in_Nm": channel})},
    )
    (row,) = rows_of({"b": one}, "abc", "2026-01-01", "1").to_dict("records")
    # Mean square 37, which is 1 of the bias and 36 of the scatter.
    assert row == {
        "commit": "abc", "date": "2026-01-01", "version": "1", "batch": "b", "channel": "tau_in_Nm", "set": "fitted",
        "bias": 1.0, "scatter": 6.0, "error": 6.083, "verdict": "agrees",
    }  # fmt: skip


def test_dates_of_two_time_zones_are_in_their_order(measured, tmp_path):
    file = tmp_path / "history.csv"
    for name, date in (("later", "2026-01-01T09:00:00+00:00"), ("earlier", "2026-01-01T10:30:00+02:00")):
        add_rows(file, rows_of(measured[1], name, date, "1"))
    assert list(dict.fromkeys(read_history(file)["commit"])) == ["earlier", "later"]


@pytest.mark.parametrize("date", ["yesterday", "9999999-01-01"])
def test_a_date_that_is_none_is_named(measured, tmp_path, date):
    rows = rows_of(measured[1], "abc", "2026-01-01T00:00:00+00:00", "1")
    add_rows(tmp_path / "history.csv", rows)
    text = (tmp_path / "history.csv").read_text().replace("2026-01-01T00:00:00+00:00", date)
    (tmp_path / "history.csv").write_text(text)
    with pytest.raises(InputError, match="history.csv: a date is none of ISO 8601"):
        add_rows(tmp_path / "history.csv", rows.assign(commit="def"))


def test_a_day_stands_among_times(measured, tmp_path):
    for name, date in (("b", "2026-01-02"), ("c", "2026-01-02T10:00:00+00:00"), ("a", "2026-01-01T00:00:00+00:00")):
        add_rows(tmp_path / "history.csv", rows_of(measured[1], name, date, "1"))
    assert list(dict.fromkeys(read_history(tmp_path / "history.csv")["commit"])) == ["a", "b", "c"]


def test_rows_with_more_cells_than_the_header_are_refused(tmp_path):
    (tmp_path / "history.csv").write_text(",".join(COLUMNS) + "\n" + ",".join("0" * (len(COLUMNS) + 1)) + "\n")
    with pytest.raises(InputError, match="more cells than its header"):
        read_history(tmp_path / "history.csv")


def test_a_file_with_other_columns_is_refused(tmp_path):
    file = tmp_path / "history.csv"
    file.write_text("commit,error\na,1\n")
    with pytest.raises(InputError, match="columns must be commit, date"):
        read_history(file)


def test_changes_that_are_not_committed_are_marked(repository):
    name = commit(repository, SNAKEFILE, "0.5.0")
    assert head(repository)[0] == name
    (repository / "Snakefile").write_text("")
    assert head(repository)[0] == f"{name}+"
