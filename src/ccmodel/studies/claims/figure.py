"""The figures of the claims: recordings and simulations over a study's variable, and the model alone."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ccmodel.channels import TABLE, TAU_IN, TAU_OUT, THETA_IN, THETA_OUT
from ccmodel.errors import last_cycle
from ccmodel.figures import (
    COLOURS,
    LINES,
    MARKERS,
    STYLE,
    legend_above,
    legend_below,
    legend_of,
    letter_panels,
    name_axes,
    plot_channels,
    say_in_panel,
    subplots,
    title_figure,
)
from ccmodel.recording import Recording
from ccmodel.studies.claims.claim import Claim, Row
from ccmodel.studies.loops.measures import QUANTITIES

D = TypeVar("D")
# Panels: claim, quantities, y axis, x axis.
PANELS = (
    ("backlash-and-bend", ("backlash", "width"), "drive torque (mN·m)", "number of half-loops"),
    ("slope-and-bend", ("slope", "slack_slope"), "slope of the torque loop (–)", "number of half-loops"),
    ("slack-and-bend", ("slack_share",), "share of the cycle (%)", "number of half-loops"),
    ("backlash-and-pretension", ("backlash", "width"), "drive torque (mN·m)", "pretension"),
    ("phases-and-pretension", ("IVa_share", "IVb_share"), "share of the cycle (%)", "pretension"),
    ("radius", ("backlash", "width"), "drive torque (mN·m)", "loop radius"),
)
SHORT = {
    "backlash": "backlash (flat part)",
    "width": "width in the middle",
    "slope": "both cables taut",
    "slack_slope": "one cable slack",
    "slack_share": "a cable slack",
    "IVa_share": "phase IVa",
    "IVb_share": "phase IVb",
}
MODELLED: dict[str, Any] = {"ls": "", "marker": "_", "ms": 16, "mew": 1.2, "color": "black"}
POINT: dict[str, Any] = {"ls": "", "marker": "o", "ms": 4.5, "color": "0.5"}


def recordings_figure(claims: Sequence[Claim], origins: str) -> Figure:
    """Means over recordings with their intervals, and the model, a panel for each claim.

    Parameters
    ----------
    claims : sequence of Claim
    origins : str
        Which batches were measured and which simulated; empty without recordings.
    """
    rows_of = {claim.name: claim.rows for claim in claims}
    with matplotlib.rc_context(STYLE):
        figure, axes = subplots(2, 3, figsize=(12, 7.2))
        for ax, (name, quantities, ylabel, xlabel) in zip(axes.flat, PANELS, strict=True):
            rows = [row for row in rows_of[name] if np.isfinite(row.at)]
            ticks = list(dict.fromkeys(row.condition for row in rows))
            for i, quantity in enumerate(quantities):
                shift = 0.16 * (2 * i - 1) if len(quantities) > 1 else 0.0
                at = {tick: n + shift for n, tick in enumerate(ticks)}
                style = {"color": COLOURS[i], "fmt": MARKERS[i], "label": SHORT[quantity]}
                _with_intervals(ax, at, [row for row in rows if row.quantity == quantity], style)
            ax.set_xticks(range(len(ticks)), ticks)
            ax.set(xlim=(-0.5, max(len(ticks), 1) - 0.5), xlabel=xlabel, ylabel=ylabel)
            top = 1.03 * ax.get_ylim()[1]
            ax.set_ylim(-0.03 * top, top)
            legend_above(ax)
        letter_panels(axes.flat)
        handles = {
            "mean over recordings, with its interval where they were repeated": Line2D([], [], **POINT),
            "model of the same recordings": Line2D([], [], **MODELLED),
        }
        legend_of(figure, handles, columns=2)
        title_figure(figure, "The paper's statements: recordings and model", origins or "no recording")
    return figure


def _with_intervals(ax: Axes, at: Mapping[str, float], rows: Sequence[Row], style: Mapping) -> None:
    """One quantity of a panel; `at` is the place of each condition on the x axis."""
    known = [(at[row.condition], row.value, _reach(row.value, row)) for row in rows if row.value is not None]
    if known:
        x, y, reach = zip(*known, strict=True)
        ax.errorbar(x, y, np.transpose(reach), ms=4.5, capsize=3, **style)
    modelled = [(at[row.condition], row.model) for row in rows if row.model is not None]
    ax.plot([x for x, _ in modelled], [y for _, y in modelled], **MODELLED)


def _reach(value: float, row: Row) -> tuple[float, float]:
    """How far the interval reaches below and above its mean; nothing without an interval."""
    return (0.0, 0.0) if row.low is None or row.high is None else (value - row.low, row.high - value)


def model_figure(claims: Sequence[Claim], loops: Mapping[str, Recording]) -> Figure:
    """The model alone: lost motion over the load, error over sections, place of the loop.

    Parameters
    ----------
    claims : sequence of Claim
    loops : mapping of str to Recording
        Runs by the place of the loop.
    """
    rows_of = {claim.name: [row for row in claim.rows if row.model is not None] for claim in claims}
    with matplotlib.rc_context(STYLE):
        figure, axes = subplots(2, 2, figsize=(10, 7.8))
        letter_panels(axes.flat)
        _panel(axes[0, 0], _load_panel, rows_of.get("deadband-and-load"))
        _panel(axes[0, 1], _sections_panel, rows_of.get("sections"))
        _panel(axes[1, 0], _torque_panel, loops)
        _panel(axes[1, 1], _motion_panel, loops)
        # The places of the loop, which (c) and (d) share; (b) has a legend of its own.
        legend_below(figure, axes[1])
        title_figure(
            figure,
            "Model alone: load, sections of the paper's discretisation, place of the loop",
            "simulated (no recording)",
        )
    return figure


def _panel(ax: Axes, panel: Callable[[Axes, D], None], data: D | None) -> None:
    """Draw a panel, or why it is empty."""
    if data:
        panel(ax, data)
    else:
        say_in_panel(ax, "the model could not be run")


def _load_panel(ax: Axes, rows: Sequence[Row]) -> None:
    """Lost motion and slack over the stiffness of the load; slack has a y axis of its own on the right."""
    slack = ax.twinx()
    slack.grid(False)
    slack.spines["right"].set_visible(True)
    for i, (side, quantity) in enumerate(((ax, "lost_motion"), (slack, "slack_share"))):
        _plot_model(side, [row for row in rows if row.quantity == quantity], i)
        q = QUANTITIES[quantity]
        side.set_ylabel(f"{q.text} ({q.unit})", color=COLOURS[i])
        side.set(xscale="log")
        side.set_ylim(bottom=0)
    ax.set_xlabel("stiffness of the load's spring (N·m/rad)")


def _plot_model(ax: Axes, rows: Sequence[Row], number: int, **style: Any) -> None:
    """The model's values over the study's variable, in the style of the curve's number."""
    style |= {"color": COLOURS[number], "marker": MARKERS[number % 4], "ls": LINES[number % 4], "ms": 4.5}
    ax.plot([row.at for row in rows], [float("nan") if row.model is None else row.model for row in rows], **style)


def _sections_panel(ax: Axes, rows: Sequence[Row]) -> None:
    for i, bend in enumerate(dict.fromkeys(row.condition.split(",")[0] for row in rows)):
        _plot_model(ax, [row for row in rows if row.condition.split(",")[0] == bend], i, label=f"{bend} of bend")
    ax.set(xscale="log", yscale="log")
    ax.set(xlabel="sections of each cable", ylabel="rms error, worst channel\n(% of peak to peak)")
    ticks = sorted({int(row.at) for row in rows})
    ax.set_xticks(ticks, [str(t) for t in ticks])
    ax.minorticks_off()
    legend_above(ax)


def _torque_panel(ax: Axes, loops: Mapping[str, Recording]) -> None:
    for (place, run), color, ls in zip(loops.items(), COLOURS, LINES, strict=False):
        plot_channels(ax, run, TAU_IN, TAU_OUT, last_cycle(run), label=f"loop {place}", color=color, ls=ls, lw=1.1)
    name_axes(ax, TAU_IN, TAU_OUT)


def _motion_panel(ax: Axes, loops: Mapping[str, Recording]) -> None:
    """Lag of the load angle behind the drive angle."""
    for run, color, ls in zip(loops.values(), COLOURS, LINES, strict=False):
        cycle = run[last_cycle(run)]
        ax.plot(cycle[THETA_IN], cycle[THETA_IN] - cycle[THETA_OUT], color=color, ls=ls, lw=1.1)
    ax.set(xlabel=TABLE[THETA_IN].axis, ylabel=r"lag $\theta_{in} - \theta_{out}$ (rad)")
