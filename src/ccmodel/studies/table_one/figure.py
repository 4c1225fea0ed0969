"""The paper's Table I with the errors of the nearest effects, and the distance of every effect."""

from typing import Any

import matplotlib
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ccmodel.channels import TABLE, TABLE_ONE
from ccmodel.figures import COLOURS, STYLE, title_figure
from ccmodel.studies.table_one.rank import flat_distance, target
from ccmodel.studies.table_one.refit import NORMS
from ccmodel.studies.table_one.settings import TableOne

MARKERS = dict(zip(NORMS, "osD", strict=True))
# Errors that are drawn: ranking, single effects or pairs, number, style.
DRAWN: tuple[tuple[str, str, int, dict[str, Any]], ...] = (
    ("errors", "single", 3, {"marker": "o", "linestyle": "-"}),
    ("errors and fit", "pair", 1, {"marker": "D", "linestyle": ":"}),
    ("errors at the paper's fit", "single", 1, {"marker": "s", "linestyle": "--"}),
)
# Number of effects in the plane of stiffness and friction.
CLOUDS = 6


def table_one_figure(ranked: pd.DataFrame, singles: pd.DataFrame, study: TableOne) -> Figure:
    """Table I with the nearest errors by each norm, the fitted parameters, and the ranking."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(13, 11))
        above, below = figure.subfigures(2, 1, squeeze=False, height_ratios=(1, 1.3)).flat
        for ax, norm in zip(above.subplots(1, len(NORMS)), NORMS, strict=True):
            _patterns(ax, ranked, norm, study)
        left, right = below.subplots(1, 2)
        _fitted(left, ranked, singles, study)
        _ranking(right, ranked, study)
        title_figure(
            figure,
            "Which left-out effect errs as the paper's Table I does?",
            "Bars and star: the paper's rig (measured); all else is simulated",
        )
    return figure


def _patterns(ax: Axes, ranked: pd.DataFrame, norm: str, study: TableOne) -> None:
    """Table I as bars, the nearest effects' errors as points."""
    wanted, at = target(study), range(len(TABLE_ONE))
    ax.bar(at, wanted, color="#d0d0d0", width=0.8, label="paper, Table I")
    colours = iter(COLOURS)
    for by, kind, count, style in DRAWN:
        table = ranked[(ranked["by"] == by) & (ranked["norm"] == norm) & (ranked["kind"] == kind)].head(count)
        for (_, row), colour in zip(table.iterrows(), colours, strict=False):
            errors = [row[f"error_{c}"] for c in TABLE_ONE]
            label = f"by {by}: {_short(row['effect'])} ({row['distance']:.2f})"
            ax.plot(at, errors, ms=4, lw=1, color=colour, label=label, **style)
    ax.set(yscale="log", ylim=(0.3, 60), ylabel="rms error (%)")
    ax.set_yticks([0.5, 1, 2, 5, 10, 20, 50], labels=["0.5", "1", "2", "5", "10", "20", "50"])
    ax.set_xticks(at, [TABLE[c].tex for c in TABLE_ONE])
    ax.set_title(f"errors over {norm}", loc="left")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), fontsize=7)


def _fitted(ax: Axes, ranked: pd.DataFrame, singles: pd.DataFrame, study: TableOne) -> None:
    """Fitted stiffness and friction of the effects nearest to the paper's fit, over all conditions."""
    fitted, measured = study.rig.fitted, study.rig.measured
    table = ranked[(ranked["by"] == "fit") & (ranked["kind"] == "single")].head(CLOUDS)
    cases = singles[singles["plausible"] & (singles["rig"] == "measured")]
    for (_, row), colour in zip(table.iterrows(), COLOURS, strict=False):
        own = cases[cases["effect"] == row["effect"]]
        label = f"{_short(row['effect'])} ({row['distance']:.2f})"
        ax.plot(own["stiffness_ratio"], own["friction_ratio"], ".", ms=4, color=colour, alpha=0.7, label=label)
    stiffness_ratio = fitted.stiffness_N_per_m / measured.stiffness_N_per_m
    friction_ratio = fitted.friction_coefficient / measured.friction_coefficient
    ax.plot(stiffness_ratio, friction_ratio, "k*", ms=14, label="paper: fitted over measured")
    ax.plot(1, 1, "k+", ms=10, label="nothing left out")
    ax.set(xlim=(0.3, 1.15), xlabel="fitted stiffness over the rig's (–)")
    ax.set(ylim=(0.8, 1.35), ylabel="fitted friction over the rig's (–)")
    ax.set_title("plain model fitted to rigs of the measured stiffness, no free cable", loc="left")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=2, fontsize=7)


def _ranking(ax: Axes, ranked: pd.DataFrame, study: TableOne) -> None:
    """Distance of every effect to Table I by each norm; the nearest on top."""
    table = ranked[(ranked["kind"] == "single") & (ranked["by"] == "errors")]
    distances = table.pivot(index="effect", columns="norm", values="distance")
    distances = distances.loc[distances.min(axis=1).sort_values(kind="stable").index[::-1]]
    at = range(len(distances))
    ax.hlines(at, distances.min(axis=1), distances.max(axis=1), color="#c0c0c0", lw=1)
    for (norm, marker), colour in zip(MARKERS.items(), COLOURS, strict=False):
        ax.plot(distances[norm], at, marker, ms=4, color=colour, label=f"errors over {norm}")
    flat = flat_distance(target(study))
    ax.axvline(flat, color="black", lw=0.8, ls="--", label=f"the same error everywhere ({flat:.2f})")
    ax.set_yticks(at, [_short(e) for e in distances.index], fontsize=7)
    ax.set(xlim=(0, None), xlabel="distance to Table I: rms of ln (error / the paper's) (–)")
    ax.set_ylim(-0.7, len(distances) - 0.3)
    ax.set_title("every effect at its nearest", loc="left")
    ax.legend(loc="upper center", bbox_to_anchor=(0.4, -0.09), ncols=2, fontsize=7)


def _short(effect: str) -> str:
    """Name of an effect or of a pair, for a legend."""
    return effect.replace(" at ", ", ").replace(" + ", "\n+ ")
