"""Accuracy over the project's commits: a CSV file in version control, and the past commits that fill it."""

import os
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd

from ccmodel import inputs
from ccmodel.accuracy.measure import NOT_ACCEPTED, Batches, Simulated, measure
from ccmodel.outputs import new_file
from ccmodel.steps.files import longer_rows_refused
from ccmodel.typed import InputError

COLUMNS = (
    dict.fromkeys(("commit", "date", "version", "batch", "channel", "set"), str)
    | dict.fromkeys(("bias", "scatter", "error"), float)
    | {"verdict": str}
)
CONFIG = "config/config.yaml"
# What a past run has to make: the table of errors needs every simulation.
TARGET = "results/tables/errors.csv"


def read_history(file: Path) -> pd.DataFrame:
    """All rows of a history; none without a file.

    Raises
    ------
    InputError
        If the file is no history.
    """
    if not file.exists():
        return pd.DataFrame(columns=list(COLUMNS)).astype(COLUMNS)
    try:
        inputs.check_file(file, inputs.LOG)
        with longer_rows_refused():
            table = pd.read_csv(file, dtype=COLUMNS, keep_default_na=False, index_col=False)
    except (ValueError, OSError) as error:
        raise InputError(f"{file}: not a history of the model's accuracy ({error})") from None
    if list(table.columns) != list(COLUMNS):
        raise InputError(f"{file}: the columns must be {', '.join(COLUMNS)}; found {', '.join(table.columns)}")
    return table


def rows_of(batches: Batches, commit: str, date: str, version: str) -> pd.DataFrame:
    """Rows of a history for one commit; errors in % of peak to peak."""
    rows = [
        (commit, date, version, batch, channel, parameters, *numbers, accuracy.verdict or "")
        for batch, accuracy in sorted(batches.items())
        for parameters, one in accuracy.sets.items()
        for channel, of in one.channels.items()
        for numbers in [tuple(float(f"{value:.4g}") for value in (of.bias, of.scatter, of.error))]
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS)).astype(COLUMNS)


def add_rows(file: Path, rows: pd.DataFrame) -> None:
    """Add the rows of a commit, in the order of dates; they replace earlier rows of the same commit."""
    table = read_history(file)
    table = pd.concat([table[~table["commit"].isin(rows["commit"])], rows], ignore_index=True)
    try:
        # Dates have the time zones of their authors.
        dates = pd.to_datetime(table["date"], utc=True, format="ISO8601")
    except ValueError as error:
        raise InputError(f"{file}: a date is none of ISO 8601 ({error})") from None
    table = table.iloc[dates.argsort(kind="stable")]
    with new_file(file) as fresh:
        table.to_csv(fresh, index=False, lineterminator="\n")


def overview(file: Path) -> str:
    """A history as a table: the median error over the channels, % of peak to peak, by commit, batch and set."""
    table = read_history(file)
    if table.empty:
        return f"{file}: no commit yet"
    by_commit = table.assign(commit=table["date"].str[:10] + " " + table["commit"])
    columns = by_commit.pivot_table("error", "commit", ["batch", "set"], "median", sort=False)
    return "median error over the channels, % of peak to peak\n" + columns.to_string(float_format="%.2f", na_rep="-")


def head(folder: Path = Path()) -> tuple[str, str | None]:
    """Commit of a folder's sources and its date.

    "+" marks changes that are not committed, and "unknown" no repository; both have no date.
    """
    try:
        commit, date = _git(folder, "log", "-1", "--format=%h %cI").split()
        changed = _git(folder, "status", "--porcelain", "--untracked-files=no")
    except InputError:
        return "unknown", None
    return (commit + "+", None) if changed else (commit, date)


def now() -> str:
    """The present date and time, for what has no commit."""
    return pd.Timestamp.now("UTC").isoformat(timespec="seconds")


def commits_in(revisions: Iterable[str]) -> list[str]:
    """Commits of ranges ``A..B`` along the first parents, without A, and single commits; the oldest first.

    Raises
    ------
    InputError
        If git does not know a revision.
    """
    commits: dict[str, None] = {}
    for revision in revisions:
        how = ["--first-parent", "--reverse"] if ".." in revision else ["--no-walk"]
        commits |= dict.fromkeys(_git(Path(), "rev-list", *how, revision, "--").split())
    return list(commits)


def run_commit(commit: str, cores: int) -> tuple[pd.DataFrame, str]:
    """Rows of a past commit, run in a clean worktree with the present environment; or none, and a line on why.

    The commit's own sources, configuration and recordings make its simulations; the present sources measure them, so
    that the numbers of all commits mean the same.
    """
    name, date = _git(Path(), "log", "-1", "--format=%h %cI", commit).split()
    with _worktree(commit) as folder:
        why = _run_pipeline(folder, cores)
        if why:
            return rows_of({}, name, date, ""), f"{name}: skipped: {why}"
        try:
            batches = measure(_simulated_in(folder / "results"), for_comparison=False)
        except Exception as error:  # a former format of the files, in any of the libraries that read them
            return rows_of({}, name, date, ""), f"{name}: skipped: its files cannot be read ({_one_line(error)})"
        return rows_of(batches, name, date, _version(folder)), f"{name}: {len(batches)} batches"


@contextmanager
def _worktree(commit: str) -> Iterator[Path]:
    with TemporaryDirectory(prefix="ccmodel-history-", ignore_cleanup_errors=True) as scratch:
        folder = Path(scratch) / "tree"
        _git(Path(), "worktree", "add", "--detach", "--quiet", str(folder), commit)
        try:
            yield folder
        finally:
            _git(Path(), "worktree", "remove", "--force", str(folder))


def _run_pipeline(folder: Path, cores: int) -> str:
    """Run a worktree's pipeline; "" if it came to its end, or the line that says why not."""
    if not (folder / "Snakefile").exists() or not (folder / CONFIG).exists():
        return "it has no pipeline"
    command = [sys.executable, "-m", "snakemake", "--cores", str(cores), "--configfile", CONFIG, "--", TARGET]
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    run = _run(command, folder, environment)
    if run.returncode == 0:
        return ""
    lines = [line.strip() for line in (run.stderr + run.stdout).splitlines() if line.strip()]
    first = next((k for k, line in enumerate(lines) if "error" in line.lower()), 0)
    return f"its run failed ({_one_line(' '.join(lines[first : first + 2]).replace(f'{folder}/', ''))})"


def _run(command: list[str], folder: Path, environment: Mapping[str, str]) -> subprocess.CompletedProcess[str]:
    """Run a command in a process group of its own, which ends if this process is interrupted."""
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, cwd=folder, env=environment, start_new_session=True, **pipes) as process:
        try:
            out, err = process.communicate()
        except BaseException:
            # The jobs too: Snakemake itself waits for those that run, and they write into the folder.
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGTERM)
            process.communicate()
            raise
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def _simulated_in(results: Path) -> list[Simulated]:
    """Every simulation in a folder of results that is watched, with the diagnosis of its batch, if any."""
    return [
        Simulated("", file.parent.name, results / "recordings" / file.name, file,
                  results / "diagnoses" / file.stem / "model.json")
        for file in sorted(results.glob("simulated/*/*.nc"))
        if file.parent.name not in NOT_ACCEPTED
    ]  # fmt: skip


def _version(folder: Path) -> str:
    """Version of a past commit, from its pyproject.toml."""
    return tomllib.loads((folder / "pyproject.toml").read_text())["project"]["version"]


def _one_line(text: object) -> str:
    return " ".join(str(text).split())[:160]


def _git(folder: Path, *arguments: str) -> str:
    try:
        run = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True, check=False)
    except OSError as error:
        raise InputError(f"git cannot be run: {error}") from None
    if run.returncode:
        raise InputError(f"git {' '.join(arguments[:2])}: {_one_line(run.stderr)}")
    return run.stdout.strip()
