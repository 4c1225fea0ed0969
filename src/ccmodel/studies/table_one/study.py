"""The study of Table I, from its settings to its tables and its figure.

It runs every single effect on a coarse grid of strengths, then on a finer grid near the best strengths, and then pairs
of the best effects. A case is one condition (rig, motion, load) with one effect or two.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ccmodel import provenance
from ccmodel.figures import FORMATS, save_figure, stamp_figure
from ccmodel.outputs import new_file, new_files
from ccmodel.progress import Progress, silent, within
from ccmodel.steps.files import write_json, write_table
from ccmodel.studies.table_one.cases import Case, pair_cases, run, single_cases, usable_conditions
from ccmodel.studies.table_one.effects import Effect, finer
from ccmodel.studies.table_one.figure import table_one_figure
from ccmodel.studies.table_one.rank import RANKINGS, nearest, rankings, room_for_torque, scored
from ccmodel.studies.table_one.rigs import conditions
from ccmodel.studies.table_one.settings import TableOne
from ccmodel.typed import InputError, load_yaml_model

# Shares of the time at which the coarse and the finer cases of one effect are done.
SINGLES, FINER = 0.4, 0.5


@dataclass(frozen=True)
class Outcome:
    """Results of the study.

    Attributes
    ----------
    singles, pairs : DataFrame
        All cases that ran, with their distances (`ccmodel.studies.table_one.rank.scored`).
    failed : DataFrame
        All cases that failed.
    left_out : int
        Number of conditions that were not run, since they exceed the ranges of the paper's sensors.
    """

    singles: pd.DataFrame
    pairs: pd.DataFrame
    failed: pd.DataFrame
    left_out: int


def run_study(study: TableOne, cores: int = 1, progress: Progress = silent) -> Outcome:
    """Run all cases; the tables do not depend on the number of processes."""
    every, usable = conditions(study.not_stated), usable_conditions(study, study.not_stated)
    coarse_cases = single_cases(study, usable)
    coarse = _run(study, coarse_cases, cores, within(progress, 0.0, SINGLES), "effects")
    # `cases[i]` belongs to row i of the table; `scored` keeps the rows' numbers.
    cases = [case for group in coarse_cases for case in group]
    finer_cases = [_finer_cases(study, cases[i]) for i in _best_rows(scored(coarse, study))]
    singles = pd.concat(
        [coarse, _run(study, finer_cases, cores, within(progress, SINGLES, FINER), "effects, finer")], ignore_index=True
    )
    cases += [case for group in finer_cases for case in group]
    scored_singles = scored(singles, study)
    leading = _leading(study, scored_singles, cases)
    cases_of_pairs = pair_cases(study, usable_conditions(study, study.pairs.not_stated), leading)
    pairs = _run(study, cases_of_pairs, cores, within(progress, FINER, 1.0), "pairs")
    scored_pairs = scored(pairs, study) if len(pairs) else scored_singles.iloc[:0]
    failed = pd.concat([singles, pairs], ignore_index=True)
    failed = failed[failed["failed"] != ""]
    # Conditions that differ in the fit alone share one motion of the rig and count once.
    left_out = {c.without_fit for c in every} - {c.without_fit for c in usable}
    return Outcome(scored_singles, scored_pairs, failed, len(left_out))


def _run(study: TableOne, groups: Sequence[Sequence[Case]], cores: int, progress: Progress, stage: str) -> pd.DataFrame:
    """Run groups of cases, with the stage's name in front of each line of progress."""
    progress(f"{stage}: {sum(map(len, groups))} cases", 0.0)

    def of_stage(text: str, done: float | None = None) -> None:
        progress(f"{stage}: {text}", done)

    return run(study, groups, cores, of_stage)


def _best_rows(found: pd.DataFrame) -> list[int]:
    """Row numbers of the cases at which an effect comes nearest to Table I by any of the rankings, ascending."""
    return sorted({int(i) for column, *_ in RANKINGS for i in nearest(found, column).index})


def _finer_cases(study: TableOne, case: Case) -> list[Case]:
    """The case of one effect at further strengths near its own (`finer`)."""
    condition, (effect,) = case
    return [(condition, (e,)) for e in finer(effect, study.grid)]


def _leading(study: TableOne, found: pd.DataFrame, cases: Sequence[Case]) -> list[Effect]:
    """The best effects of every ranking, each at the values of its nearest case; no effect twice at one place."""
    leading: dict[tuple, Effect] = {}
    for column, *_ in RANKINGS:
        for i in nearest(found, column).index[: study.pairs.singles]:
            (effect,) = cases[i][1]
            leading.setdefault((effect.name, effect.place), effect)
    return list(leading.values())


def table_one(settings: Path, out: Path, figure: Path, cores: int = 1, progress: Progress = silent) -> str:
    """Run the study and return a line on the number of cases.

    Writes cases.csv, pairs.csv, failed.csv, ranking.csv, summary.json and table-one.png, .svg and .pdf into `out`, and
    the figure once more where the caller wants it.

    Raises
    ------
    InputError
        If the settings cannot be used, or the figure's name has no ending of a figure.
    """
    if figure.suffix.removeprefix(".") not in FORMATS:
        raise InputError(f"{figure}: a figure's name ends with {', '.join(f'.{ending}' for ending in FORMATS)}")
    study = load_yaml_model(settings, TableOne)
    found = run_study(study, cores, progress)
    ranked = rankings(found.singles, found.pairs, study)
    tables = {"cases": found.singles, "pairs": found.pairs, "failed": found.failed, "ranking": ranked}
    summary = {
        "cases": len(found.singles),
        "pairs": len(found.pairs),
        "failed": len(found.failed),
        "conditions_left_out": found.left_out,
        "room_for_tau_in_percent": room_for_torque(found.singles, study),
        "provenance": provenance.of_inputs([settings], settings.parent),
    }
    drawn = table_one_figure(ranked, found.singles, study)
    stamp_figure(drawn, provenance.stamp(__name__, study.model_dump(mode="json")))
    with new_files(out, last="summary.json") as fresh:
        for name, table in tables.items():
            write_table(fresh / f"{name}.csv", table)
        write_json(fresh / "summary.json", summary)
        save_figure(drawn, *(fresh / f"table-one.{ending}" for ending in FORMATS))
    with new_file(figure) as fresh_figure:
        save_figure(drawn, fresh_figure)
    return (
        f"{len(found.singles)} cases of one effect and {len(found.pairs)} of two; {len(found.failed)} could not be "
        f"run, {found.left_out} conditions are beyond the sensors' ranges: {out / 'ranking.csv'}, {figure}"
    )
