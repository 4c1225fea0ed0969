"""Run a study: from the files of its runs to its tables and figures."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from ccmodel import provenance
from ccmodel.figures import save_figure, stamp_figure
from ccmodel.progress import Progress, each_of, silent, within
from ccmodel.steps.files import Fitted, Pair, fitted, read_json, read_pairs, write_json, write_table
from ccmodel.studies.loops.settings import Measuring

# Share of the judgement in the time of a study. Estimated.
JUDGED = 0.6


@dataclass(frozen=True)
class Run:
    """A batch and the model of it, in files.

    Attributes
    ----------
    label : str
        What the batch is for in the study (`StudySettings.needs`).
    recordings, simulated : Path
        Recordings and simulations (netCDF).
    fit : Path or None
        The model's fit or diagnosis (JSON); None for the batch's own estimates.
    """

    label: str
    recordings: Path
    simulated: Path
    fit: Path | None = None

    @cached_property
    def pairs(self) -> list[Pair]:
        """Every recording with its simulation."""
        return read_pairs(self.recordings, self.simulated)

    @cached_property
    def fitted(self) -> Fitted:
        """Parameters that the model ran with."""
        return fitted(self.recordings, self.fit)

    @property
    def content(self) -> list:
        """What the files hold, without where they came from: the inputs of a figure, for its digest."""
        fit = read_json(self.fit) if self.fit else {}
        return [self.label, self.pairs, {key: value for key, value in fit.items() if key != "provenance"}]


def runs_of(
    labels: Sequence[str], recordings: Sequence[str], simulated: Sequence[str], fits: Sequence[str]
) -> list[Run]:
    """Runs from lists of equal length; the fit "" stands for the batch's own estimates."""
    rows = zip(labels, recordings, simulated, fits, strict=True)
    return [Run(label, Path(r), Path(s), Path(fit) if fit else None) for label, r, s, fit in rows]


@dataclass(frozen=True)
class Outcome:
    """Results of a study, in the order of the names in its settings.

    Attributes
    ----------
    figures : sequence of Figure
    tables : sequence of DataFrame
    summary : dict
        What the page shows; written as JSON if there are tables.
    """

    figures: Sequence[Figure]
    tables: Sequence[pd.DataFrame] = ()
    summary: dict = field(default_factory=dict)


def run_study(
    kind: str, settings: str, measuring: str, runs: Sequence[Run], tables: Sequence[Path],
    figures: Sequence[Sequence[Path]], progress: Progress = silent,
) -> None:  # fmt: skip
    """Judge a study and write its tables and figures.

    Parameters
    ----------
    kind : str
        Folder of the study in `ccmodel.studies`.
    settings, measuring : str
        The study's settings and how loops are measured, as JSON.
    runs : sequence of Run
    tables : sequence of Path
        The CSV files in the order of the settings, then the JSON file; empty for a study without tables.
    figures : sequence of sequence of Path
        The files of each figure in the order of the settings, one for each of its formats.
    progress : Progress
    """
    study = import_module(f"ccmodel.studies.{kind}.study")
    stated = study.SETTINGS.model_validate_json(settings)
    progress(f"judging {kind} on {len(runs)} runs", 0.0)
    outcome = study.judge(stated, runs, Measuring.model_validate_json(measuring))
    for file, table in zip(tables[:-1], outcome.tables, strict=True):
        write_table(file, table)
    if tables:
        inputs = {file for run in runs for file in (run.recordings, run.simulated, run.fit) if file is not None}
        inputs |= set(map(Path, stated.files))
        write_json(tables[-1], outcome.summary | {"provenance": provenance.of_inputs(sorted(inputs))})
    read = [Path(file).read_text() for file in stated.files]
    stamp = provenance.stamp(study.__name__, settings, measuring, [run.content for run in runs], *read)
    pairs = list(zip(figures, outcome.figures, strict=True))
    for files, figure in each_of(pairs, within(progress, JUDGED, 1.0), lambda pair: f"drawing {Path(pair[0][0]).stem}"):
        stamp_figure(figure, stamp)
        save_figure(figure, *files)
