"""The style of all figures, and the parts that several have: loops, axes, legends."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ccmodel.channels import CABLES, TABLE, TAU_IN, TAU_OUT, THETA_IN, THETA_OUT

# The palette of Okabe and Ito without its yellow, which is too faint on white; readable with any colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
LINES = ("-", "--", "-.", ":")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
# Panels of the paper's Figs. 5, 8 and 9: channel on the x axis, channel on the y axis.
TRANSMISSION = (*CABLES.values(), (TAU_IN, TAU_OUT), (THETA_IN, THETA_OUT))
STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
}


def plot_channels(ax: Axes, values, x: str, y: str, samples: slice = slice(None), **style) -> None:
    """Channel `y` over channel `x`, in the units of their axes; `values` gives the values of a channel by its name."""
    ax.plot(values[x][samples] * TABLE[x].scale, values[y][samples] * TABLE[y].scale, **style)


def name_axes(ax: Axes, x: str, y: str) -> None:
    """Label both axes with a channel, its symbol and its unit."""
    ax.set(xlabel=TABLE[x].axis, ylabel=TABLE[y].axis)


def letter_panels(axes: Sequence[Axes]) -> None:
    """Title panels (a), (b), ... from left to right and from top to bottom."""
    for ax, letter in zip(axes, "abcdefgh", strict=False):
        ax.set_title(f"({letter})", loc="left")


def say_in_panel(ax: Axes, text: str) -> None:
    """Write in the middle of an empty panel why it is empty."""
    ax.text(0.5, 0.5, text, ha="center", va="center", transform=ax.transAxes, wrap=True)


def empty_figure(text: str) -> Figure:
    """A figure without data, which says why."""
    with plt.rc_context(STYLE):
        figure, ax = plt.subplots(figsize=(9, 2))
        ax.set_axis_off()
        say_in_panel(ax, text)
    return figure


def legend_below(figure: Figure, axes: NDArray, columns: int | None = None) -> None:
    """One legend for all panels below them, each label once; without `columns`, as many as its longest label allows."""
    handles = {}
    for ax in axes.flat:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    columns = columns or max(1, min(4, 100 // (6 + max(map(len, handles), default=1))))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns)


def save_figure(figure: Figure, file: Path) -> None:
    """Write a figure as PNG or SVG; equal figures give equal files, and text in an SVG stays text."""
    with plt.rc_context({"svg.fonttype": "none", "svg.hashsalt": "ccmodel"}):
        figure.savefig(file, dpi=150, metadata={"Date": None} if file.suffix == ".svg" else None)
