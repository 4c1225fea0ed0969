"""The cases of the study, a row each: errors after the fit, and the norms by which they can be divided."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import asdict
from functools import partial
from itertools import combinations, groupby, product

import pandas as pd
from numpy.typing import NDArray

from ccmodel.channels import TABLE_ONE
from ccmodel.failure import ModelError
from ccmodel.inference.pool import processes
from ccmodel.progress import Progress
from ccmodel.studies.table_one.effects import Effect, all_effects, depends_on_time, scaled
from ccmodel.studies.table_one.refit import NORMS, refit
from ccmodel.studies.table_one.rigs import Condition, conditions, recorded, within_ranges
from ccmodel.studies.table_one.settings import NotStated, TableOne

CONDITION = tuple(Condition.__annotations__)
Case = tuple[Condition, tuple[Effect, ...]]


def usable_conditions(study: TableOne, open_: NotStated) -> list[Condition]:
    """The conditions that the paper's sensors could have recorded."""
    return [c for c in conditions(open_) if within_ranges(study.rig, c)]


def single_cases(study: TableOne, usable: Sequence[Condition]) -> list[list[Case]]:
    """A list for every effect and place."""
    return [_under(usable, [(e,) for e in group]) for group in all_effects(study.grid)]


def pair_cases(study: TableOne, usable: Sequence[Condition], best: Sequence[Effect]) -> list[list[Case]]:
    """A list for every two of the effects given, each at some shares of its strength there."""
    courses = [[scaled(effect, share) for share in study.pairs.shares] for effect in best]
    places = [(e.name, e.place) for e in best]
    return [
        _under(usable, list(product(courses[i], courses[j])))
        for i, j in combinations(range(len(best)), 2)
        if places[i] != places[j]
    ]


def run(study: TableOne, groups: Sequence[Sequence[Case]], cores: int, progress: Progress) -> pd.DataFrame:
    """Rows of all cases, in their order.

    Processes share the conditions: fits under one condition have the derivatives of the plain model in common.
    """
    cases = [case for group in groups for case in group]
    parts: dict[Condition, list[int]] = {}
    for i, (condition, _) in enumerate(cases):
        parts.setdefault(condition.without_fit, []).append(i)
    rows: dict[int, dict] = {}
    work = partial(_rows, study), [[cases[i] for i in part] for part in parts.values()]
    with processes(cores) if cores > 1 else nullcontext() as pool:
        results = (pool.map if pool else map)(*work)
        for done, (part, found) in enumerate(zip(parts.values(), results, strict=True), 1):
            rows |= zip(part, found, strict=True)
            progress(f"{done} of {len(parts)} conditions", done / len(parts))
    return pd.DataFrame([rows[i] for i in range(len(cases))])


def _under(usable: Sequence[Condition], acting: Sequence[tuple[Effect, ...]]) -> list[Case]:
    """Effects under all conditions; of the frequencies only the first if no effect depends on time."""
    first_frequency = usable[0].frequency_Hz if usable else None
    return [(c, e) for e in acting for c in usable if c.frequency_Hz == first_frequency or depends_on_time(e)]


def _rows(study: TableOne, cases: Sequence[Case]) -> list[dict]:
    """Rows of cases; a rig with several fits in succession is simulated once."""
    rows = []
    for (condition, effects), group in groupby(cases, key=lambda case: (case[0].without_fit, case[1])):
        fits = [fit for fit, _ in group]
        try:
            rig_data = recorded(study.rig, condition, effects)
        except (ModelError, ValueError) as error:
            rows += [_stated(fit, effects) | {"failed": str(error)} for fit in fits]
        else:
            rows += [_stated(fit, effects) | _fitted(study, fit, rig_data) for fit in fits]
    return rows


def _stated(condition: Condition, effects: tuple[Effect, ...]) -> dict:
    return {
        "effect": " + ".join(f"{e.name} at {e.place}" for e in effects),
        "numbers": "; ".join(" ".join(f"{k}={v:.6g}" for k, v in e.values.items()) for e in effects),
        "plausible": all(e.plausible for e in effects),
        **asdict(condition),
        "failed": "",
    }


def _fitted(study: TableOne, condition: Condition, rig_data: NDArray) -> dict:
    """Errors after the fit and norms, or the reason why the fit failed."""
    try:
        found = refit(study.rig, condition, rig_data)
    except (ModelError, ValueError) as error:
        return {"failed": str(error)}
    row = {"stiffness_ratio": found.stiffness_ratio, "friction_ratio": found.friction_ratio}
    for name, values in {"rmse": found.rmse, **{name: norm(rig_data) for name, norm in NORMS.items()}}.items():
        row |= {f"{name}_{c}": v for c, v in zip(TABLE_ONE, values.tolist(), strict=True)}
    return row
