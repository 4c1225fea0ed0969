"""Figures of loops: recordings, the model of them, and what is between the two."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.ndimage import uniform_filter1d

from ccmodel import figures
from ccmodel.channels import TABLE, TAU_IN, TAU_OUT, THETA_IN
from ccmodel.errors import error_table, is_compared, last_cycle
from ccmodel.figures import COLOURS, LINES, name_axes
from ccmodel.model.run import PRESCRIBED
from ccmodel.recording import ORIGIN
from ccmodel.steps.files import Pair
from ccmodel.studies.loops.settings import Measuring, Study
from ccmodel.studies.run import Outcome, Run
from ccmodel.studies.variables import batches_of, by_label

SETTINGS = Study

DIFFERENCE = "Δ: model − recording; pale: samples, line: moving mean"
# With more conditions than this in a panel, each has a panel of its own.
CONDITIONS_IN_A_PANEL = 6
# A figure with more panels than this is not read any more, and a PNG file of some hundreds would be too high.
PANELS = 48


@dataclass(frozen=True, eq=False)
class Look:
    """Lines of one condition: the recording wide and pale, the model above it thin, so that both are seen."""

    recording: dict[str, Any]
    model: dict[str, Any]


ALONE = Look({"color": COLOURS[4], "linewidth": 3.5}, {"color": "black", "linewidth": 0.9})
IN_LEGEND = Look({"color": "0.75", "linewidth": 4.0}, {"color": "0.2", "linewidth": 1.1})


def judge(study: Study, runs: Sequence[Run], measuring: Measuring | None = None) -> Outcome:
    """Draw the study's figure."""
    return Outcome([draw([pair for run in runs for pair in run.pairs], study, measuring or Measuring())])


def draw(pairs: Sequence[Pair], study: Study, measuring: Measuring) -> Figure:
    """Draw a study as its settings ask; a study without a usable recording has a figure that says so."""
    if not pairs:
        return figures.empty_figure(f"{study.title}: no usable recording (see what was left out)")
    with matplotlib.rc_context(figures.STYLE):
        return _DRAW[study.figure](pairs, study, measuring.smoothing_share)


def transmission_figure(pairs: Sequence[Pair], study: Study, smoothing_share: float) -> Figure:
    """The paper's Figs. 8 and 9: loops of the tensions, torques and angles of one run, with the residuals of each.

    Only the first pair is drawn. A panel whose channels were not recorded is missing.
    """
    recorded, _ = pair = pairs[0]
    panels = [(x, y) for x, y in figures.TRANSMISSION if x in recorded and y in recorded]
    if not panels:
        return figures.empty_figure(f"{study.title}: {recorded.batch}/{recorded.id} has no two channels of one end")
    figure, cells = _grid(len(panels), 1, columns=2, shared=False)
    for (x, y), (loop, (strip,)) in zip(panels, cells, strict=True):
        _loops(loop, {ALONE: [pair]}, x, y)
        for i, channel in enumerate(c for c in (x, y) if is_compared(*pair, c)):
            style = {"color": COLOURS[i], "linestyle": LINES[i], "linewidth": 1.1, "label": f"Δ {TABLE[channel].tex}"}
            _residuals(strip, {Look({}, style): [pair]}, channel, smoothing_share)
        _finish_strip(strip, f"Δ ({_unit(y)})")
        figures.legend_above(strip)
    figures.letter_panels([loop for loop, _ in cells])
    _title_and_legend(figure, [pair], study, f"{recorded.batch}/{recorded.id}", {})
    return figure


def loops_figure(
    pairs: Sequence[Pair],
    study: Study,
    smoothing_share: float,
    x: str = TAU_IN,
    y: str = TAU_OUT,
    apart: bool = False,
) -> Figure:
    """Loops of channel `y` over channel `x`, and the residuals of both over time.

    With the two torques, the paper's Figs. 10 to 12. Each value of `study.rows` has a panel, or each condition where
    they are wanted `apart` or are too many for one.
    """
    rows = by_label(pairs, study.rows) if study.rows else {"": pairs}
    conditions = by_label(pairs, study.variable)
    looks = dict(zip(conditions, map(_look, range(len(conditions))), strict=True))
    panels = {row: _of_row(conditions, row_pairs) for row, row_pairs in rows.items()}
    if all(list(by) == [row] for row, by in panels.items()):
        # Each condition is a panel, whose title names it.
        panels, looks = {row: {"": by[row]} for row, by in panels.items()}, {"": ALONE}
    elif apart or max(map(len, panels.values())) > CONDITIONS_IN_A_PANEL:
        panels = {_joined(row, label): {"": group} for row, by in panels.items() for label, group in by.items()}
        looks = {"": ALONE}
    compared = [c for c in (x, y) if any(is_compared(*pair, c) for pair in pairs)]
    drawn_of_all = ""
    if len(panels) > PANELS:
        drawn_of_all = f"{PANELS} of {len(panels)} panels, evenly spread from the smallest error to the largest"
        panels = _spread(panels, compared)
    # Without any simulation there is still a strip, which says so.
    channels = compared or [c for c in (x, y) if c != THETA_IN]
    in_panels = {label for by in panels.values() for label in by if label}
    figure, cells = _grid(len(panels), len(channels), columns=2 if len(panels) in (2, 4) else 3)
    for (title, by), (loop, strips) in zip(panels.items(), cells, strict=True):
        drawn = {looks[label]: group for label, group in by.items()}
        _loops(loop, drawn, x, y)
        loop.set_title(title, loc="left")
        for strip, channel in zip(strips, channels, strict=True):
            _residuals(strip, drawn, channel, smoothing_share)
            _finish_strip(strip, f"Δ {TABLE[channel].tex} ({_unit(channel)})")
    named = {label: look for label, look in looks.items() if label in in_panels}
    _title_and_legend(figure, pairs, study, drawn_of_all, named)
    return figure


_DRAW: dict[str, Callable[[Sequence[Pair], Study, float], Figure]] = {
    "transmission": transmission_figure,
    "torque-loops": loops_figure,
    "drive-loops": partial(loops_figure, x=THETA_IN, y=TAU_IN),
    "torque-loops-apart": partial(loops_figure, apart=True),
}


def _look(number: int) -> Look:
    """Lines of a condition by its number: a colour, and a dash for whoever does not see the colour."""
    color = COLOURS[number % len(COLOURS)]
    dash = LINES[(number + number // len(COLOURS)) % len(LINES)]
    return Look({"color": color, "linewidth": 4.0, "alpha": 0.3}, {"color": color, "linewidth": 1.1, "linestyle": dash})


def _of_row(conditions: Mapping[str, Sequence[Pair]], row: Sequence[Pair]) -> dict[str, list[Pair]]:
    """Conditions with their pairs in a row; none without."""
    ids = {id(recorded) for recorded, _ in row}
    of_row = {label: [pair for pair in group if id(pair[0]) in ids] for label, group in conditions.items()}
    return {label: group for label, group in of_row.items() if group}


def _spread(panels: Mapping[str, dict[str, list[Pair]]], compared: Sequence[str]) -> dict[str, dict[str, list[Pair]]]:
    """`PANELS` of the panels, evenly spread by error; those of the smallest and the largest error are among them."""
    errors = []
    for by in panels.values():
        table = error_table([pair for group in by.values() for pair in group], "")
        errors.append(table.loc[table.channel.isin(compared), "nrmse_percent"].max())
    ranks = np.linspace(0, len(errors) - 1, PANELS).round().astype(int)
    # Panels without a simulation or without motion have no error; they come last.
    chosen = set(np.argsort(errors, kind="stable")[ranks])
    return {title: by for i, (title, by) in enumerate(panels.items()) if i in chosen}


def _grid(cells: int, strips: int, columns: int, shared: bool = True) -> tuple[Figure, list[tuple[Axes, list[Axes]]]]:
    """A figure of cells, each a loop above strips of residuals; a single cell has them side by side.

    `shared` loops have the same axes, and strips of the same channel the same y axis.
    """
    if cells == 1:
        figure = Figure(figsize=(9, max(3.4, 1.9 * strips) + 0.9))
        grid = figure.add_gridspec(strips, 2, width_ratios=(1.1, 1))
        places = [(grid[:, 0], [grid[i, 1] for i in range(strips)])]
    else:
        rows, depth = -(-cells // columns), 1 + strips
        figure = Figure(figsize=((4.5 if columns == 2 else 3.7) * columns, rows * (3 + 1.3 * strips) + 0.9))
        grid = figure.add_gridspec(rows * depth, columns, height_ratios=[3, *[1.2] * strips] * rows)
        corners = [(depth * (i // columns), i % columns) for i in range(cells)]
        places = [(grid[r, c], [grid[r + 1 + i, c] for i in range(strips)]) for r, c in corners]
    made: list[tuple[Axes, list[Axes]]] = []
    for place, below in places:
        first, others = made[0] if made and shared else (None, [None] * strips)
        loop = figure.add_subplot(place, sharex=first, sharey=first)
        drawn = [figure.add_subplot(strip, sharey=other) for strip, other in zip(below, others, strict=True)]
        for strip in drawn[:-1]:
            strip.sharex(drawn[-1])
            strip.tick_params(labelbottom=False)
        drawn[-1].set_xlabel("time from the start of the loop (s)")
        made.append((loop, drawn))
    return figure, made


def _loops(ax: Axes, drawn: Mapping[Look, Sequence[Pair]], x: str, y: str) -> None:
    """Recordings below and the model of them above; an empty panel says why it is empty."""
    for look, pairs in drawn.items():
        for recorded, simulated in pairs:
            window = last_cycle(recorded)
            for run, style in ((recorded, look.recording | {"zorder": 2}), (simulated, look.model | {"zorder": 3})):
                if run is not None and x in run and y in run:
                    figures.plot_channels(ax, run, x, y, window, **style)
    name_axes(ax, x, y)
    if not ax.lines:
        figures.say_in_panel(ax, f"not recorded, or not simulated:\n{TABLE[x].axis} over {TABLE[y].axis}")


def _residuals(ax: Axes, drawn: Mapping[Look, Sequence[Pair]], channel: str, smoothing_share: float) -> None:
    """Model minus recording over the time of the loop: every sample pale, and the moving mean above."""
    for look, pairs in drawn.items():
        for recorded, simulated in pairs:
            if simulated is not None and is_compared(recorded, simulated, channel):
                window = last_cycle(recorded)
                time = recorded.time_s[window] - recorded.time_s[window][0]
                residual = (simulated[channel] - recorded[channel]) * TABLE[channel].scale
                mean = uniform_filter1d(residual, max(1, round(smoothing_share * time.size)))
                ax.plot(time, residual[window], color=look.model["color"], linewidth=0.6, alpha=0.4, zorder=2)
                ax.plot(time, mean[window], **look.model, zorder=3)


def _finish_strip(ax: Axes, ylabel: str) -> None:
    """A line at zero; an empty strip says why it is empty."""
    if ax.lines:
        ax.axhline(0, color="0.4", linewidth=0.6, zorder=1)
    else:
        figures.say_in_panel(ax, "not simulated")
    ax.set_ylabel(ylabel)


def _unit(channel: str) -> str:
    return TABLE[channel].plot_unit or TABLE[channel].unit


def _title_and_legend(
    figure: Figure, pairs: Sequence[Pair], study: Study, which: str, conditions: Mapping[str, Look]
) -> None:
    """Title with the origin of each batch, and a legend of what is wide and thin and of the conditions."""
    # Without any simulation there is nothing to explain.
    simulated = any(simulated is not None for _, simulated in pairs)
    figures.title_figure(
        figure, ": ".join(filter(None, (study.title, which))), batches_of(pairs), DIFFERENCE if simulated else ""
    )
    key = IN_LEGEND if conditions else ALONE
    origins = {ORIGIN[recorded.origin] for recorded, _ in pairs}
    # Of several origins, each condition's label says which is its own.
    recording = origins.pop() if len(origins) == 1 else "recording"
    handles: dict[str, Line2D | tuple[Line2D, Line2D]] = {
        recording: Line2D([], [], **key.recording),
        _model_title(pairs): Line2D([], [], **key.model),
    }
    handles |= {
        label: (Line2D([], [], **look.recording), Line2D([], [], **look.model)) for label, look in conditions.items()
    }
    figures.legend_of(figure, handles)


def _model_title(pairs: Sequence[Pair]) -> str:
    """The model in a legend, with a load torque that it was given."""
    given = {s.derived_from[TAU_OUT] == PRESCRIBED for _, s in pairs if s is not None}
    if True not in given:
        return ORIGIN["model"]
    return f"{ORIGIN['model']}, {'in part ' if False in given else ''}given the recorded load torque"


def _joined(*parts: str) -> str:
    return ", ".join(p for p in parts if p)
