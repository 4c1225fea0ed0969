"""Scatter plots of simulated over recorded quantities, with the bands of model and recordings."""

from collections.abc import Callable, Sequence
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ccmodel.figures import COLOURS, MARKERS, STYLE, empty_figure, legend_below, subplots, title_figure
from ccmodel.recording import ORIGIN
from ccmodel.studies.variables import batches_by_origin

COLUMNS = 4
# All but the colour of the model's bias.
BATCH_COLOURS = (COLOURS[0], *COLOURS[2:])


def scatter_figure(table: pd.DataFrame, lines: Sequence[dict], coverage_factor: float) -> Figure:
    """Simulated over recorded values, a panel for each quantity, with the bands of model and recordings.

    Parameters
    ----------
    table : DataFrame
        With the columns of `ccmodel.studies.accuracy.study.BY_RECORDING`.
    lines : sequence of dict
        Its `ccmodel.studies.accuracy.study.summary`.
    coverage_factor : float
        Number of standard deviations that a band reaches to both sides.
    """
    return _panels(table, lines, coverage_factor, _scatter_panel, "Modelled over recorded values")


def ratio_figure(table: pd.DataFrame, lines: Sequence[dict], coverage_factor: float) -> Figure:
    """The same with the ratio of simulated to recorded on the y axis, which separates the bands near the diagonal."""
    return _panels(table, lines, coverage_factor, _ratio_panel, "Modelled values as a share of the recorded ones")


_Panel = Callable[[Axes, pd.DataFrame, dict, Sequence[str], float], None]


def _panels(table: pd.DataFrame, lines: Sequence[dict], coverage_factor: float, panel: _Panel, title: str) -> Figure:
    if not lines:
        return empty_figure("no recording that the model could be run on")
    with matplotlib.rc_context(STYLE):
        rows = -(-len(lines) // COLUMNS)
        figure, axes = subplots(rows, COLUMNS, figsize=(12, 0.9 + 2.7 * rows), squeeze=False)
        for ax in axes.flat[len(lines) :]:
            ax.set_axis_off()
        batches = sorted(set(table["batch"]))
        mixed = len(set(table["origin"])) > 1
        for ax, line in zip(axes.flat, lines, strict=False):
            mine = table[(table["quantity"] == line["quantity"]) & (table["origin"] == line["origin"])]
            panel(ax, mine, line, batches, coverage_factor)
            text = line["text"][0].upper() + line["text"][1:]
            origin = f"\n{ORIGIN[line['origin']]}" if mixed else ""
            ax.set_title(text.replace(" (its flat part)", "") + origin, fontsize=9, loc="left")
            ax.set_xlabel(f"recorded ({line['unit']})")
        legend_below(figure, axes, columns=4)
        origins = batches_by_origin(zip(table["batch"], table["origin"], strict=True))
        title_figure(figure, f"{title}, last cycle of each recording", origins)
    return figure


def _points(ax: Axes, table: pd.DataFrame, values: pd.Series, batches: Sequence[str]) -> None:
    for i, batch in enumerate(batches):
        mine = table["batch"] == batch
        if mine.any():
            style: dict[str, Any] = {
                "color": BATCH_COLOURS[i % len(BATCH_COLOURS)],
                "marker": MARKERS[i % len(MARKERS)],
            }
            ax.plot(table["recorded"][mine], values[mine], ls="", ms=4.5, mfc="none", label=f"batch {batch}", **style)


def _range(values: np.ndarray) -> np.ndarray:
    low, high = float(values.min()), float(values.max())
    margin = 0.08 * (high - low) or 0.05 * abs(high)
    return np.array([low - margin, high + margin])


def _scatter_panel(ax: Axes, table: pd.DataFrame, line: dict, batches: Sequence[str], factor: float) -> None:
    at = np.maximum(_range(np.r_[table["recorded"], table["modelled"]]), 0.0)
    _points(ax, table, table["modelled"], batches)
    _bands(ax, at, at, line, factor)
    ax.set_xlim(*at)
    ax.set_ylim(*at)
    ax.set_aspect("equal")
    ax.set_ylabel(f"modelled ({line['unit']})")


def _ratio_panel(ax: Axes, table: pd.DataFrame, line: dict, batches: Sequence[str], factor: float) -> None:
    at = _range(table["recorded"].to_numpy())
    _points(ax, table, 100 * table["modelled"] / table["recorded"], batches)
    _bands(ax, at, np.full(2, 100.0), line, factor)
    ax.set_xlim(*at)
    ax.set_ylabel("modelled / recorded (%)")


def _bands(ax: Axes, at: np.ndarray, equal: np.ndarray, line: dict, factor: float) -> None:
    """The lines of equality and of the bias, with `factor` standard deviations on both sides of each."""
    ax.plot(at, equal, color="black", lw=0.9, label="model = recording")
    if line["delta"] is None:
        return
    for sign in (-1, 1):
        label = f"± {factor:g} σ_E, sensors and parameters" if sign > 0 else None
        ax.plot(at, equal * (1 + factor * sign * line["sigma_E_stated"]), color="black", lw=0.9, ls="--", label=label)
    biased, band = line["delta"] * equal, factor * line["sigma_M"]
    ax.plot(at, biased, color=COLOURS[1], lw=0.9, label="the model's bias δ")
    ax.fill_between(at, biased * (1 - band), biased * (1 + band), color=COLOURS[1], alpha=0.2, lw=0,
                    label=f"± {factor:g} σ_M of the model about it")  # fmt: skip
