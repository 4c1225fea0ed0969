"""Error of the model over the project's commits: a panel for each batch, a line for each parameter set."""

from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from ccmodel.figures import COLOURS, LINES, MARKERS, STYLE, empty_figure, legend_below, subplots, title_figure

COLUMNS = 3
# Commits that a panel has room to name.
NAMED = 20


def history_figure(history: pd.DataFrame, present: pd.DataFrame, origins: Mapping[str, str]) -> Figure:
    """Median and largest error over the channels of each batch, at every commit and, as the last point, in this run.

    Parameters
    ----------
    history, present : DataFrame
        With the columns of `ccmodel.accuracy.history.COLUMNS`.
    origins : mapping of str to str
        Origin of each batch, as figures name it.
    """
    table = pd.concat([history, present], ignore_index=True)
    batches, commits = sorted(set(present["batch"])), list(dict.fromkeys(table["commit"]))
    if not batches:
        return empty_figure("no recording that the model could be run on")
    sets = list(dict.fromkeys(present["set"])) + sorted(set(table["set"]) - set(present["set"]))
    columns = min(COLUMNS, len(batches))
    rows = -(-len(batches) // columns)
    with matplotlib.rc_context(STYLE):
        figure, axes = subplots(
            rows, columns, figsize=(4 * columns, 1.4 + 2.4 * rows), squeeze=False, sharey=True, sharex=True
        )
        for ax in axes.flat[len(batches) :]:
            ax.set_axis_off()
        for k, (ax, batch) in enumerate(zip(axes.flat, batches, strict=False)):
            _panel(ax, table[table["batch"] == batch], commits, sets)
            ax.set_title(f"{batch}: {origins[batch]}", loc="left", fontsize=9)
            if k % columns == 0:
                ax.set_ylabel("error, % of peak to peak")
            # The axes are shared: names of commits stand below the last panel of each column.
            ax.tick_params(labelbottom=k + columns >= len(batches))
        legend_below(figure, axes)
        title_figure(figure, "Error of the model over commits: median of the channels (thick) and worst channel (thin)")
    return figure


def _panel(ax: Axes, table: pd.DataFrame, commits: list[str], sets: list[str]) -> None:
    at = {commit: k for k, commit in enumerate(commits)}
    for k, name in enumerate(sets):
        errors = table[table["set"] == name].groupby("commit")["error"]
        if not errors.ngroups:
            continue
        x = np.arange(len(commits))
        style: dict[str, Any] = {"color": COLOURS[k % len(COLOURS)], "ls": LINES[k % len(LINES)]}
        ax.plot(
            x, errors.median().reindex(commits), lw=1.4, marker=MARKERS[k % len(MARKERS)], ms=4, label=name, **style
        )
        ax.plot(x, errors.max().reindex(commits), lw=0.6, marker=".", ms=2, **style)
    ax.axvline(at[commits[-1]], color="#999999", lw=0.8, ls=":")
    ax.set_yscale("log")
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_formatter(NullFormatter())
    ax.set_xlim(-0.5, len(commits) - 0.5)
    every = -(-len(commits) // NAMED)
    named = sorted({*range(0, len(commits) - every, every), len(commits) - 1})
    ax.set_xticks(named, [commits[k] for k in named], rotation=90, fontsize=7)
