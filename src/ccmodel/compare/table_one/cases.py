"""Every case tried: a row each, with what was left after the fit and what it can be divided by."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import combinations, product

import pandas as pd
from numpy.typing import NDArray

from ccmodel.compare.table_one.effects import Effect, all_effects, knows_time, scaled
from ccmodel.compare.table_one.refit import NORMS, refit
from ccmodel.compare.table_one.rigs import Condition, conditions, recorded, within_ranges
from ccmodel.compare.table_one.settings import CHANNELS, NotStated, TableOne
from ccmodel.failure import ModelError

CONDITION = ("rig", "load_stiffness_Nm_per_rad", "amplitude_rad", "frequency_Hz", "fit_over")
Case = tuple[Condition, tuple[Effect, ...]]
Tell = Callable[[str], None]


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


def run(study: TableOne, groups: Sequence[Sequence[Case]], cores: int, tell: Tell) -> pd.DataFrame:
    """Rows of all cases, in their order; they are shared out among processes a condition at a time.

    Fits under one condition share what they need of the plain model.
    """
    cases = [case for group in groups for case in group]
    rows: list[dict] = [{}] * len(cases)
    parts = _parts(cases)
    for done, (at, part) in enumerate(
        zip(parts, _each(partial(_rows, study), [[cases[i] for i in p] for p in parts], cores), strict=True), 1
    ):
        for i, row in zip(at, part, strict=True):
            rows[i] = row
        tell(f"part {done} of {len(parts)}, {len(part)} cases")
    return pd.DataFrame(rows)


def _parts(cases: Sequence[Case]) -> list[list[int]]:
    """Where the cases of each condition stand, whatever is done in the fit."""
    parts: dict[Condition, list[int]] = {}
    for i, (condition, _) in enumerate(cases):
        parts.setdefault(condition.without_fit, []).append(i)
    return list(parts.values())


def _each(work, groups, cores: int) -> Iterable[list[dict]]:
    if cores == 1:
        yield from map(work, groups)
        return
    with ProcessPoolExecutor(cores) as pool:
        yield from pool.map(work, groups)


def _under(usable: Sequence[Condition], acting: Sequence[tuple[Effect, ...]]) -> list[Case]:
    """Effects under all conditions; of the rates only the first where none of them knows the time."""
    first_rate = usable[0].frequency_Hz if usable else None
    return [(c, e) for e in acting for c in usable if c.frequency_Hz == first_rate or knows_time(e)]


def _rows(study: TableOne, cases: Sequence[Case]) -> list[dict]:
    """Rows of cases; a rig that is fitted in several ways one after the other is made up once."""
    rows, before, made_up = [], None, None
    for condition, effects in cases:
        if (condition.without_fit, effects) != before:
            before, made_up = (condition.without_fit, effects), _made_up(study, condition, effects)
        rows.append(_row(study, condition, effects, made_up))
    return rows


def _made_up(study: TableOne, condition: Condition, effects: tuple[Effect, ...]) -> NDArray | str:
    """What the rig shows, or why there is no such rig."""
    try:
        return recorded(study.rig, condition, effects)
    except (ModelError, ValueError) as error:
        return str(error)


def _row(study: TableOne, condition: Condition, effects: tuple[Effect, ...], made_up: NDArray | str) -> dict:
    row = {
        "effect": " + ".join(f"{e.name} at {e.place}" for e in effects),
        "numbers": "; ".join(" ".join(f"{k}={v:.6g}" for k, v in e.values.items()) for e in effects),
        "plausible": all(e.plausible for e in effects),
        **{name: getattr(condition, name) for name in CONDITION},
        "failed": "",
    }
    if isinstance(made_up, str):
        return row | {"failed": made_up}
    try:
        found = refit(study.rig, condition, made_up)
    except (ModelError, ValueError) as error:
        return row | {"failed": str(error)}
    row |= {"stiffness_ratio": found.stiffness_ratio, "friction_ratio": found.friction_ratio}
    row |= {f"rmse_{c}": v for c, v in zip(CHANNELS, found.rmse.tolist(), strict=True)}
    for name, norm in NORMS.items():
        row |= {f"{name}_{c}": v for c, v in zip(CHANNELS, norm(made_up).tolist(), strict=True)}
    return row
