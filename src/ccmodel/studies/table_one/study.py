"""The study from its settings to its tables and figure: single effects, finer near the best ones, and pairs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ccmodel import provenance
from ccmodel.report.figures import save_figure
from ccmodel.steps.files import write_json, write_table
from ccmodel.studies.table_one.cases import Case, Report, pair_cases, run, single_cases, usable_conditions
from ccmodel.studies.table_one.effects import Effect, finer
from ccmodel.studies.table_one.figure import table_one_figure
from ccmodel.studies.table_one.rank import RANKINGS, nearest, rankings, room_for_torque, scored
from ccmodel.studies.table_one.rigs import conditions
from ccmodel.studies.table_one.settings import TableOne
from ccmodel.typed import load_yaml_model


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
        Number of conditions beyond the ranges of the paper's sensors.
    """

    singles: pd.DataFrame
    pairs: pd.DataFrame
    failed: pd.DataFrame
    left_out: int


def run_study(study: TableOne, cores: int = 1, report: Report = lambda text: None) -> Outcome:
    """Run all cases; the tables do not depend on the number of processes."""
    stated, usable = conditions(study.not_stated), usable_conditions(study, study.not_stated)
    groups = single_cases(study, usable)
    coarse = _run(study, groups, cores, report, "effects")
    cases = [case for group in groups for case in group]
    around = [_around(study, cases[i]) for i in _best_rows(scored(coarse, study))]
    singles = pd.concat([coarse, _run(study, around, cores, report, "effects, finer")], ignore_index=True)
    cases += [case for group in around for case in group]
    found = scored(singles, study)
    paired = pair_cases(study, usable_conditions(study, study.pairs.not_stated), _leading(study, found, cases))
    pairs = _run(study, paired, cores, report, "pairs")
    failed = pd.concat([singles, pairs], ignore_index=True)
    failed = failed[failed["failed"] != ""]
    ran = scored(pairs, study) if len(pairs) else found.iloc[:0]
    return Outcome(found, ran, failed, len({c.without_fit for c in stated} - {c.without_fit for c in usable}))


def _run(study: TableOne, groups: Sequence[Sequence[Case]], cores: int, report: Report, stage: str) -> pd.DataFrame:
    report(f"{stage}: {sum(map(len, groups))} cases")
    return run(study, groups, cores, lambda text: report(f"{stage}: {text}"))


def _best_rows(found: pd.DataFrame) -> list[int]:
    """Cases at which an effect is nearest by some ranking, in the order of the cases."""
    return sorted({int(i) for column, *_ in RANKINGS for i in nearest(found, column).index})


def _around(study: TableOne, case: Case) -> list[Case]:
    condition, (effect,) = case
    return [(condition, (e,)) for e in finer(effect, study.grid)]


def _leading(study: TableOne, found: pd.DataFrame, cases: Sequence[Case]) -> list[Effect]:
    """The nearest effects by each ranking, at the values at which they are nearest; each once."""
    leading: dict[tuple, Effect] = {}
    for column, *_ in RANKINGS:
        for i in nearest(found, column).index[: study.pairs.singles]:
            (effect,) = cases[i][1]
            leading.setdefault((effect.name, effect.place), effect)
    return list(leading.values())


def table_one(settings: Path, out: Path, figure: Path, cores: int = 1, report: Report = lambda text: None) -> str:
    """Run the study and return a line on the number of cases.

    Writes cases.csv, pairs.csv, failed.csv, ranking.csv and summary.json into `out`, and the figure.

    Raises
    ------
    InputError
        If the settings cannot be used.
    """
    study = load_yaml_model(settings, TableOne)
    found = run_study(study, cores, report)
    ranked = rankings(found.singles, found.pairs, study)
    out.mkdir(parents=True, exist_ok=True)
    tables = {"cases": found.singles, "pairs": found.pairs, "failed": found.failed, "ranking": ranked}
    for name, table in tables.items():
        write_table(out / f"{name}.csv", table)
    summary = {
        "cases": len(found.singles),
        "pairs": len(found.pairs),
        "failed": len(found.failed),
        "conditions_left_out": found.left_out,
        "room_for_tau_in_percent": room_for_torque(found.singles, study),
        "provenance": provenance.of_inputs([settings], settings.parent),
    }
    write_json(out / "summary.json", summary)
    figure.parent.mkdir(parents=True, exist_ok=True)
    save_figure(table_one_figure(ranked, found.singles, study), figure)
    return (
        f"{len(found.singles)} cases of one effect and {len(found.pairs)} of two; {len(found.failed)} could not be "
        f"run, {found.left_out} conditions are beyond the sensors' ranges: {out / 'ranking.csv'}, {figure}"
    )
