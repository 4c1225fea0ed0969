"""The study from its settings to its tables: effects alone, more finely where they come nearest, and in pairs."""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from ccmodel.compare.table_one.cases import Case, Tell, pair_cases, run, single_cases, usable_conditions
from ccmodel.compare.table_one.effects import Effect, finer
from ccmodel.compare.table_one.rank import RANKINGS, nearest, scored
from ccmodel.compare.table_one.rigs import conditions
from ccmodel.compare.table_one.settings import TableOne


@dataclass(frozen=True)
class Outcome:
    """What the study found.

    Attributes
    ----------
    singles, pairs : DataFrame
        Every case that ran, with its distances (`ccmodel.compare.table_one.rank.scored`).
    failed : DataFrame
        Every case that did not.
    left_out : int
        Conditions that the paper's sensors could not have recorded.
    """

    singles: pd.DataFrame
    pairs: pd.DataFrame
    failed: pd.DataFrame
    left_out: int


def run_study(study: TableOne, cores: int = 1, tell: Tell = lambda text: None) -> Outcome:
    """Try everything; the same settings give the same tables, however many processes share the work."""
    stated, usable = conditions(study.not_stated), usable_conditions(study, study.not_stated)
    groups = single_cases(study, usable)
    coarse = _run(study, groups, cores, tell, "effects")
    cases = [case for group in groups for case in group]
    around = [_around(study, cases[i]) for i in _best_rows(scored(coarse, study))]
    singles = pd.concat([coarse, _run(study, around, cores, tell, "effects, finer")], ignore_index=True)
    cases += [case for group in around for case in group]
    found = scored(singles, study)
    paired = pair_cases(study, usable_conditions(study, study.pairs.not_stated), _leading(study, found, cases))
    pairs = _run(study, paired, cores, tell, "pairs")
    failed = pd.concat([singles, pairs], ignore_index=True)
    failed = failed[failed["failed"] != ""]
    ran = scored(pairs, study) if len(pairs) else found.iloc[:0]
    return Outcome(found, ran, failed, len({c.without_fit for c in stated} - {c.without_fit for c in usable}))


def _run(study: TableOne, groups: Sequence[Sequence[Case]], cores: int, tell: Tell, what: str) -> pd.DataFrame:
    tell(f"{what}: {sum(map(len, groups))} cases")
    return run(study, groups, cores, lambda text: tell(f"{what}: {text}"))


def _best_rows(found: pd.DataFrame) -> list[int]:
    """Cases at which any effect comes nearest by any ranking, in the order tried."""
    return sorted({int(i) for column, *_ in RANKINGS for i in nearest(found, column).index})


def _around(study: TableOne, case: Case) -> list[Case]:
    condition, (effect,) = case
    return [(condition, (e,)) for e in finer(effect, study.grid)]


def _leading(study: TableOne, found: pd.DataFrame, cases: Sequence[Case]) -> list[Effect]:
    """The nearest effects by each ranking, at the numbers at which they come nearest; each once."""
    leading: dict[tuple, Effect] = {}
    for column, *_ in RANKINGS:
        for i in nearest(found, column).index[: study.pairs.singles]:
            (effect,) = cases[i][1]
            leading.setdefault((effect.name, effect.place), effect)
    return list(leading.values())
