"""Accuracy of a run against the accepted one, and over past commits (`ccmodel.accuracy`)."""

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import pandas as pd

from ccmodel.accuracy.baseline import read_baseline, versions
from ccmodel.accuracy.comparison import GAINED, Change, Comparison, compare
from ccmodel.accuracy.gate import summary
from ccmodel.accuracy.history import head, read_history, rows_of
from ccmodel.accuracy.measure import Simulated, measure
from ccmodel.recording import ORIGIN
from ccmodel.studies.baseline.figure import history_figure
from ccmodel.studies.baseline.settings import AgainstBaseline
from ccmodel.studies.loops.settings import Measuring
from ccmodel.studies.run import Outcome, Run
from ccmodel.typed import InputError
from ccmodel.version import __version__

SETTINGS = AgainstBaseline
NOW = "this run"


def judge(settings: AgainstBaseline, runs: Sequence[Run], measuring: Measuring) -> Outcome:
    """Measure all runs and compare them with the baseline; without one, the page says so."""
    batches = measure(simulated_of(runs))
    found, message, accepted = Comparison(), "", None
    try:
        baseline = read_baseline(Path(settings.file))
        found = compare(baseline.batches, batches, settings.limits)
        accepted = baseline.model_dump(include={"date", "commit", "reason", "versions"})
        message = summary(found, baseline.date, baseline.commit)
    except InputError as error:
        message = str(error)
    history, present = read_history(Path(settings.history)), rows_of(batches, NOW, "", __version__)
    commit, date = head()
    content = {
        "commit": commit,
        "date": date,
        "versions": versions(),
        "settings": settings.model_dump(),
        "message": message,
        "accepted": accepted,
        "comparison": found.as_dict(),
        "gained": len(found.of(GAINED)),
        "commits": history["commit"].nunique(),
        "measured": {name: batch.model_dump() for name, batch in batches.items()},
    }
    columns = [field.name for field in fields(Change)]
    table = pd.DataFrame([vars(change) for change in found.changes], columns=columns)
    origins = {name: ORIGIN[batch.origin] for name, batch in batches.items()}
    return Outcome([history_figure(history, present, origins)], [table], content)


def simulated_of(runs: Sequence[Run]) -> list[Simulated]:
    """The study's runs, whose labels are rigs and whose simulations stand in a folder for each parameter set."""
    return [Simulated(run.label, run.simulated.parent.name, run.recordings, run.simulated, run.fit) for run in runs]
