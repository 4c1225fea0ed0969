"""What `ccmodel accuracy` does: compare the last run with the baseline, accept it, fill the history of past commits."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath

from pydantic import BaseModel

from ccmodel.accuracy.baseline import ACCEPT, make_baseline, read_baseline, versions, write_baseline
from ccmodel.accuracy.comparison import GAINED, Comparison, Limits, compare
from ccmodel.accuracy.history import add_rows, commits_in, head, now, rows_of, run_commit
from ccmodel.accuracy.measure import Batches
from ccmodel.progress import Progress, each_of
from ccmodel.provenance import file_digest
from ccmodel.typed import InputError, load_json_model

# The study's file in a folder of results.
STATE = "tables/baseline.json"


class _Settings(Limits, extra="ignore"):
    file: str
    history: str


class _Inputs(BaseModel):
    """Digests of what was measured, by path from the folder in which the run was started."""

    sha256: dict[str, str] = {}


class _Measured(BaseModel):
    """What is read of the study's file; one of before does not state its commit or versions."""

    settings: _Settings
    measured: Batches
    commit: str | None = None
    date: str | None = None
    versions: dict[str, str] = {}
    provenance: _Inputs = _Inputs()


@dataclass(frozen=True)
class State:
    """Accuracy of the last run into a folder of results, and what it is compared with.

    Attributes
    ----------
    baseline, history : Path
    limits : Limits
    batches : dict of str to BatchAccuracy
    commit, date : str
        Commit whose sources were measured, and its date; the present date, if there were changes.
    versions : dict of str to str
        Versions of the package and libraries with which it was measured.
    """

    baseline: Path
    history: Path
    limits: Limits
    batches: Batches
    commit: str
    date: str
    versions: dict[str, str]


def state_of(results: Path) -> State:
    """Accuracy of the last run.

    Raises
    ------
    InputError
        If no run has measured it there, or the results have changed since.
    """
    file = results / STATE
    if not file.exists():
        raise InputError(
            f"{file}: not there: no run with the key 'baseline' in its configuration came to its end in {results}"
        )
    stated = load_json_model(file, _Measured, "a run")
    within = _results_of(stated.provenance.sha256)
    if changed := _changed(results, stated.provenance.sha256, within):
        raise InputError(f"{results / changed}: the results have changed since their accuracy was measured; run again")
    folder = _folder_of_run(results, within)
    limits = Limits(coverage=stated.settings.coverage, reproducibility=stated.settings.reproducibility)
    commit, date = head(folder) if stated.commit is None else (stated.commit, stated.date)
    baseline, history = folder / stated.settings.file, folder / stated.settings.history
    return State(baseline, history, limits, stated.measured, commit, date or now(), stated.versions or versions())


def _results_of(inputs: Iterable[str]) -> PurePath:
    """The folder of results as the run named it, which has the recordings that were measured."""
    return next((path.parents[1] for path in map(PurePath, inputs) if path.parent.name == "recordings"), PurePath())


def _changed(results: Path, inputs: Mapping[str, str], within: PurePath) -> PurePath | None:
    """One of the results that are no longer what was measured; the baseline and the history are none of them."""
    for path, digest in inputs.items():
        if within.parts and PurePath(path).is_relative_to(within):
            own = PurePath(path).relative_to(within)
            if not (results / own).is_file() or file_digest(results / own) != digest:
                return own
    return None


def _folder_of_run(results: Path, within: PurePath) -> Path:
    """The folder in which the run was started, which has the baseline; the present one, if nothing tells."""
    place, parts = results.resolve(), within.parts
    is_below = bool(parts) and place.parts[-len(parts) :] == parts
    return Path(os.path.relpath(place.parents[len(parts) - 1])) if is_below else Path()


def check(results: Path) -> tuple[Comparison, str]:
    """Compare the last run with the baseline as it is now; and a sentence on the outcome.

    Raises
    ------
    InputError
        If there is no run, its results have changed since, or there is no baseline that can be read.
    """
    state = state_of(results)
    baseline = read_baseline(state.baseline)
    found = compare(baseline.batches, state.batches, state.limits)
    return found, summary(found, baseline.date, baseline.commit)


def summary(found: Comparison, date: str, commit: str) -> str:
    """A sentence on a comparison."""
    counts = f"{len(found.losses)} lost, {len(found.of(GAINED))} gained, {len(found.not_compared)} not compared"
    text = f"{len(found.changes)} comparisons with the baseline of {date[:10]} ({commit}): {counts}"
    if found.again:
        text += f"; recorded again since then, so that only a larger loss is seen: {', '.join(found.again)}"
    return text


def accept(results: Path, reason: str) -> State:
    """Make the last run the baseline, and append it to the history.

    Raises
    ------
    InputError
        Without a reason or a run.
    """
    if not reason.strip():
        raise InputError(f"--reason: state why this accuracy is right, for example: {ACCEPT}")
    state = state_of(results)
    if not state.batches:
        raise InputError(f"{results}: the run has measured no batch; there is nothing to accept")
    baseline = make_baseline(state.batches, state.limits, state.date, state.commit, reason.strip(), state.versions)
    # The history first: if the baseline fails, the same command replaces this commit's rows.
    add_rows(state.history, rows_of(state.batches, state.commit, state.date, state.versions["ccmodel"]))
    write_baseline(state.baseline, baseline)
    return state


def fill_history(file: Path, revisions: Iterable[str], cores: int, progress: Progress) -> list[str]:
    """Run past commits and add their accuracy to a history; return a line on each commit that cannot be run.

    Raises
    ------
    InputError
        If git does not know a revision.
    """
    skipped = []
    for commit in each_of(commits_in(revisions), progress, lambda one: f"running commit {one[:7]}"):
        rows, line = run_commit(commit, cores)
        if len(rows):
            add_rows(file, rows)
        else:
            skipped.append(line)
    return skipped
