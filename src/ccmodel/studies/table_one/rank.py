"""Distance of a case to Table I, and to the paper's fitted stiffness and friction.

The distance of two patterns is the root mean square, over their channels, of the logarithm of their ratio: 0 if they
are equal, ln 2 if each number is off by a factor of two. `flat_distance` is the distance of the best uniform pattern;
an effect that is no nearer than that explains nothing of the pattern.
"""

from collections.abc import Mapping
from typing import TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.channels import T1, T3, TABLE_ONE, TAU_IN
from ccmodel.studies.table_one.cases import CONDITION
from ccmodel.studies.table_one.refit import NORMS
from ccmodel.studies.table_one.settings import Cable, Rig, TableOne

MEASURED_RIGS = ("measured", "measured-free")
# A fit within this distance of the paper's stiffness and friction counts as the paper's fit.
SAME_FIT = 0.15
# Rankings of the effects: column, quantity that is compared, norm. The nearest effects of each are tried more finely
# and in pairs.
RANKINGS = (
    *((f"noisy_{norm}", "errors", norm) for norm in NORMS),
    *((f"both_{norm}", "errors and fit", norm) for norm in NORMS),
    ("fit", "fit", "maximum"),
)
# Further rankings, without more cases: the errors of those cases whose fit is the paper's.
READ_OFF = tuple((f"held_{norm}", "errors at the paper's fit", norm) for norm in NORMS)


def target(study: TableOne) -> NDArray:
    """Table I in the order of `TABLE_ONE`, %."""
    return np.array([study.pattern_percent[c] for c in TABLE_ONE])


def distance(pattern: NDArray, wanted: NDArray) -> NDArray:
    """Root mean square of the logarithms of the ratios over the last axis."""
    return np.sqrt((np.log(pattern / wanted) ** 2).mean(axis=-1))


def flat_distance(wanted: NDArray) -> float:
    """Distance of the uniform pattern that comes nearest."""
    return float(np.log(wanted).std())


def sensor_noise(rig: Rig) -> NDArray:
    """Standard deviation of the sensors' noise in every channel, in its unit."""
    torque = rig.torque_accuracy_Nm
    tension = np.hypot(rig.load_cell_accuracy_N, torque / rig.pulley_radius_m) / 2
    return np.array([rig.encoder_step_rad / np.sqrt(12), torque, torque, *[tension] * 4])


def patterns(table: pd.DataFrame, study: TableOne, norm: str, noise: bool) -> NDArray:
    """Errors of each case, %, shape (cases, channels); with `noise`, that of the sensors is added in squares."""
    rmse = table[[f"rmse_{c}" for c in TABLE_ONE]].to_numpy()
    size = table[[f"{norm}_{c}" for c in TABLE_ONE]].to_numpy()
    error = np.hypot(rmse, sensor_noise(study.rig)) if noise else rmse
    return np.maximum(100 * error / size, study.rounding_percent)


def scored(table: pd.DataFrame, study: TableOne) -> pd.DataFrame:
    """The cases that ran, with their distances to Table I for each norm, and to the paper's fit.

    ``bare`` and ``noisy`` compare the errors without and with the sensors' noise. ``fit`` compares the fitted stiffness
    and friction with the paper's, on rigs with the measured ones; NaN on the others. ``both`` compares nine numbers:
    the errors with noise, and the two fitted parameters. ``held`` is ``noisy`` where ``fit`` is below `SAME_FIT`, else
    NaN.
    """
    table = table[table["failed"] == ""]
    wanted, parameters, paper_fit = target(study), _fitted(table, study), _of(study.rig.fitted)
    measured = table["rig"].isin(MEASURED_RIGS)
    added = {"fit": np.where(measured, distance(parameters, paper_fit), np.nan)}
    for norm in NORMS:
        noisy = patterns(table, study, norm, noise=True)
        nine = np.concatenate([noisy, parameters], axis=1), np.concatenate([wanted, paper_fit])
        added[f"bare_{norm}"] = distance(patterns(table, study, norm, noise=False), wanted)
        added[f"noisy_{norm}"] = distance(noisy, wanted)
        added[f"both_{norm}"] = distance(*nine)
        added[f"held_{norm}"] = np.where(added["fit"] < SAME_FIT, added[f"noisy_{norm}"], np.nan)
    return table.assign(**added)


def _fitted(table: pd.DataFrame, study: TableOne) -> NDArray:
    """Fitted stiffness (N/m) and friction coefficient of each case, shape (cases, 2)."""
    is_fitted = (table["rig"] == "fitted").to_numpy()[:, None]
    own = np.where(is_fitted, _of(study.rig.fitted), _of(study.rig.measured))
    return table[["stiffness_ratio", "friction_ratio"]].to_numpy() * own


def _of(cable: Cable) -> NDArray:
    return np.array([cable.stiffness_N_per_m, cable.friction_coefficient])


def nearest(table: pd.DataFrame, column: str) -> pd.DataFrame:
    """The nearest plausible case of every effect by a column, nearest first; of equal ones the first."""
    chosen = table[table["plausible"] & table[column].notna()]
    return chosen.sort_values(column, kind="stable").drop_duplicates("effect")


Size = TypeVar("Size", float, pd.Series)


def torque_allowed(pattern: Mapping[str, float], sizes: Mapping[str, Size], radius_m: float) -> Size:
    """Upper bound on the error of tau_in (% of its size) by the errors of T1 and T3.

    tau_in = (T1 - T3) R holds for the errors too; the root mean square of a difference is at most the sum of both.

    Parameters
    ----------
    pattern : mapping of str to float
        Errors of T1_N and T3_N, % of their sizes.
    sizes : mapping of str to float
        Norms of T1_N, T3_N and tau_in_Nm, in the channels' units.
    radius_m : float
    """
    return (pattern[T1] * sizes[T1] + pattern[T3] * sizes[T3]) * radius_m / sizes[TAU_IN]


def room_for_torque(table: pd.DataFrame, study: TableOne) -> dict[str, dict[str, float]]:
    """By norm, the smallest and the largest `torque_allowed` of Table I over the plausible cases."""
    table, found = table[table["plausible"]], {}
    for norm in NORMS:
        sizes = {c: table[f"{norm}_{c}"] for c in (T1, T3, TAU_IN)}
        room = torque_allowed(study.pattern_percent, sizes, study.rig.pulley_radius_m)
        found[norm] = {"least": float(room.min()), "most": float(room.max())}
    return found


def rankings(singles: pd.DataFrame, pairs: pd.DataFrame, study: TableOne) -> pd.DataFrame:
    """Every effect and pair at its nearest case, by each ranking, with its errors.

    Returns
    -------
    DataFrame
        ``by`` and ``norm`` as in `RANKINGS` and `READ_OFF`, ``kind``, ``rank``, ``effect``, ``numbers``, ``distance``,
        the condition, both ratios, and ``error_...`` in % over the norm, with the sensors' noise.
    """
    return pd.concat(
        [
            _ranking(table, kind, *ranking, study)
            for ranking in (*RANKINGS, *READ_OFF)
            for kind, table in (("single", singles), ("pair", pairs))
        ],
        ignore_index=True,
    )


def _ranking(table: pd.DataFrame, kind: str, column: str, by: str, norm: str, study: TableOne) -> pd.DataFrame:
    best = nearest(table, column)
    errors = patterns(best, study, norm, noise=True)
    columns = {
        "by": by,
        "norm": norm,
        "kind": kind,
        "rank": np.arange(1, len(best) + 1),
        "effect": best["effect"],
        "numbers": best["numbers"],
        "distance": best[column],
        "bare_errors": best[f"bare_{norm}"],
        **{c: best[c] for c in (*CONDITION, "stiffness_ratio", "friction_ratio")},
        **{f"error_{c}": errors[:, i] for i, c in enumerate(TABLE_ONE)},
    }
    return pd.DataFrame(columns)
