"""The style of all figures, the parts that several have (loops, axes, titles, legends), and their files."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import matplotlib
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import NDArray

from ccmodel.channels import CABLES, TABLE, TAU_IN, TAU_OUT, THETA_IN, THETA_OUT
from ccmodel.outputs import new_file

# The palette of Okabe and Ito without its yellow, which is too faint on white; readable with any colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
LINES = ("-", "--", "-.", ":")
# Endings of a figure's files.
FORMATS = ("png", "svg", "pdf")
# Without what would make the files of two equal runs differ: dates, and random names of an SVG's parts.
_METADATA = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
_FILES: dict[Any, Any] = {"svg.fonttype": "none", "svg.hashsalt": "ccmodel", "pdf.fonttype": 42}
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
# Panels of the paper's Figs. 5, 8 and 9: channel on the x axis, channel on the y axis.
TRANSMISSION = (*CABLES.values(), (TAU_IN, TAU_OUT), (THETA_IN, THETA_OUT))
STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
    # A vector file of noise is a fifth smaller; a third of a point is not seen.
    "path.simplify_threshold": 0.33,
}


class Channels(Protocol):
    """Values of a channel by its name: a recording, or a mapping."""

    def __getitem__(self, channel: str, /) -> NDArray: ...


def subplots(
    rows: int = 1, columns: int = 1, figsize: tuple[float, float] = (9, 4), **style: Any
) -> tuple[Figure, Any]:
    """A figure for a file, with its panels; pyplot and the backend of a user's session know nothing of it."""
    figure = Figure(figsize=figsize)
    return figure, figure.subplots(rows, columns, **style)


def plot_channels(ax: Axes, values: Channels, x: str, y: str, samples: slice = slice(None), **style: Any) -> None:
    """Channel `y` over channel `x`, in the units of their axes."""
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
    ax.text(0.5, 0.5, text, ha="center", va="center", transform=ax.transAxes, wrap=True, parse_math=False)


def empty_figure(text: str) -> Figure:
    """A figure without data, which says why."""
    with matplotlib.rc_context(STYLE):
        figure, ax = subplots(figsize=(9, 2))
        ax.set_axis_off()
        say_in_panel(ax, text)
    return figure


def title_figure(figure: Figure, *lines: str) -> None:
    """Title of a figure; every line is wrapped at the figure's width, and a dollar sign is one."""
    characters = int(12 * figure.get_figwidth())
    text = "\n".join(textwrap.fill(line, characters) for line in lines if line)
    figure.suptitle(text, fontsize="medium", parse_math=False)


def legend_below(figure: Figure, axes: NDArray, columns: int | None = None) -> None:
    """One legend for all panels below them, each label once; without `columns`, as many as its longest label allows."""
    handles: dict[str, Artist] = {}
    for ax in axes.flat:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    legend_of(figure, handles, columns)


def legend_of(figure: Figure, handles: Mapping, columns: int | None = None) -> None:
    """A legend below all panels from handles by their labels."""
    columns = columns or max(1, min(4, 100 // (6 + max(map(len, handles), default=1))))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns)


def legend_above(ax: Axes) -> None:
    """A panel's own legend above it, where no data are; nothing without labels."""
    if ax.get_legend_handles_labels()[0]:
        style = {"fontsize": 8, "handletextpad": 0.4, "columnspacing": 1.2, "borderaxespad": 0.2}
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=4, **style)


def stamp_figure(figure: Figure, text: str) -> None:
    """Write a line in the lower right corner, below everything else: what the figure was made with and from."""
    share = 0.16 / figure.get_figheight()
    room = (0, share, 1, 1 - share)
    if isinstance(engine := figure.get_layout_engine(), ConstrainedLayoutEngine):
        engine.set(rect=room)
    _lay_out(figure)
    # The layout leaves room for a legend outside the panels only as long as the legend has no place of its own.
    for legend in figure.legends:
        legend.set_bbox_to_anchor(room, figure.transFigure)
    figure.text(0.995, 0.2 * share, text, ha="right", va="bottom", fontsize=6, color="#767676")


def save_figure(figure: Figure, *files: Path) -> None:
    """Write a figure to files whose endings are among `FORMATS`.

    Equal figures give equal files: panels are laid out once, and no file holds a date. Text stays text.
    """
    with matplotlib.rc_context(_FILES):
        _lay_out(figure)
        for file in map(Path, files):
            with new_file(file) as fresh:
                print_figure(figure, fresh, file.suffix.removeprefix("."), 150)


def print_figure(figure: Figure, file: Any, ending: str, dpi: float) -> None:
    """Draw a figure that is laid out to a file or a buffer; `ending` is one of `FORMATS`.

    `Figure.savefig` would draw everything once more before, to lay it out.
    """
    figure.dpi = dpi
    canvas = get_registered_canvas_class(ending)(figure)
    getattr(canvas, f"print_{ending}")(file, metadata=_METADATA.get(ending))


def _lay_out(figure: Figure) -> None:
    """Lay out the panels, unless they are: once, and the same for every format."""
    if isinstance(figure.get_layout_engine(), ConstrainedLayoutEngine):
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
