"""The figures of the claims: what recordings and model say over what varies, and what the model alone says."""

from collections.abc import Mapping, Sequence

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ccmodel.compare.claims import Claim, Row
from ccmodel.compare.errors import last_cycle
from ccmodel.compare.loops import QUANTITIES
from ccmodel.recording import Recording
from ccmodel.report.figures import AXIS, COLOURS, LINES, STYLE

MARKERS = ("o", "s", "^", "D")
# Claim, quantities, y axis; a panel each.
PANELS = (
    ("backlash-and-bend", ("backlash", "width"), "drive torque (mN·m)", "number of half-loops"),
    ("slope-and-bend", ("slope", "slack_slope"), "slope of the torque loop", "number of half-loops"),
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


def recordings_figure(claims: Sequence[Claim]) -> Figure:
    """Recordings with their intervals and the model beside them, a panel a claim."""
    rows_of = {claim.name: claim.rows for claim in claims}
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 3, figsize=(12, 7.2))
        sources = set()
        for ax, letter, (name, quantities, ylabel, xlabel) in zip(axes.flat, "abcdef", PANELS, strict=True):
            rows = [row for row in rows_of[name] if np.isfinite(row.at)]
            sources |= {row.source for row in rows}
            ticks = list(dict.fromkeys(row.condition for row in rows))
            for i, quantity in enumerate(quantities):
                mine = [row for row in rows if row.quantity == quantity]
                aside = 0.16 * (2 * i - 1) if len(quantities) > 1 else 0.0
                _with_intervals(
                    ax, ticks, mine, aside, {"color": COLOURS[i], "fmt": MARKERS[i], "label": SHORT[quantity]}
                )
            ax.set_xticks(range(len(ticks)), ticks)
            ax.set_xlim(-0.5, max(len(ticks), 1) - 0.5)
            ax.set_xlabel(xlabel)
            ax.set_ylabel(ylabel)
            ax.set_ylim(bottom=-0.03 * ax.get_ylim()[1])
            ax.set_title(f"({letter})", loc="left")
            if ax.get_legend_handles_labels()[0]:
                ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=3, fontsize=8, handletextpad=0.3)
        said = " and ".join(sorted(sources)) or "no recording"
        figure.suptitle(f"Points: {said}; bars: interval of the mean over repeats; black: the model of them")
    return figure


def _with_intervals(ax: Axes, ticks: Sequence[str], rows: Sequence[Row], aside: float, style: Mapping) -> None:
    """One quantity of a panel, a little aside of its condition."""
    known = [row for row in rows if row.value is not None]
    reach = [[0, 0] if row.low is None else [row.value - row.low, row.high - row.value] for row in known]
    if known:
        at = [ticks.index(row.condition) + aside for row in known]
        ax.errorbar(at, [row.value for row in known], np.transpose(reach), ms=4.5, capsize=3, **style)
    modelled = [row for row in rows if row.model is not None]
    at = [ticks.index(row.condition) + aside for row in modelled]
    ax.plot(at, [row.model for row in modelled], ls="", marker="_", ms=16, mew=1.2, color="black")


def model_figure(claims: Sequence[Claim], loops: Mapping[str, Recording]) -> Figure:
    """What the model alone says: lost motion over the load, loop placement, error over sections.

    Parameters
    ----------
    claims : sequence of Claim
    loops : mapping of str to Recording
        Runs by where the loop lies.
    """
    rows_of = {claim.name: claim.rows for claim in claims}
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 2, figsize=(10, 7.8))
        for ax, letter in zip(axes.flat, "abcd", strict=True):
            ax.set_title(f"({letter})", loc="left")
        for panel, ax, name in (
            (_load_panel, axes[0, 0], "deadband-and-load"),
            (_sections_panel, axes[0, 1], "sections"),
        ):
            rows = [row for row in rows_of.get(name, []) if row.model is not None]
            panel(ax, rows) if rows else _say_not_run(ax)
        if loops:
            _placement_panels(axes[1, 0], axes[1, 1], loops)
        else:
            _say_not_run(axes[1, 0])
            _say_not_run(axes[1, 1])
        figure.suptitle("Model alone: load, sections of the paper's discretisation, place of the loop")
    return figure


def _say_not_run(ax: Axes) -> None:
    """An axis of logarithms cannot be drawn without a value."""
    ax.text(0.5, 0.5, "the model could not be run", ha="center", va="center", transform=ax.transAxes)


def _load_panel(ax: Axes, rows: Sequence[Row]) -> None:
    for i, quantity in enumerate(("lost_motion", "slack_share")):
        mine = [row for row in rows if row.quantity == quantity]
        # Two units in one panel: the share of the cycle on an axis of its own, to the right.
        side = ax if i == 0 else ax.twinx()
        line = {"color": COLOURS[i], "marker": MARKERS[i], "ls": LINES[i], "ms": 4.5}
        side.plot([row.at for row in mine], [row.model for row in mine], **line)
        q = QUANTITIES[quantity]
        side.set_ylabel(f"{q.text} ({q.unit})", color=COLOURS[i])
        side.set_ylim(bottom=0)
        side.set_xscale("log")
        if i:
            side.grid(False)
            side.spines["right"].set_visible(True)
    ax.set_xlabel("stiffness of the load's spring (N·m/rad)")


def _sections_panel(ax: Axes, rows: Sequence[Row]) -> None:
    by_bend: dict[str, list[Row]] = {}
    for row in rows:
        by_bend.setdefault(row.condition.split(",")[0], []).append(row)
    for i, (bend, mine) in enumerate(by_bend.items()):
        ax.loglog([row.at for row in mine], [row.model for row in mine], color=COLOURS[i], marker=MARKERS[i % 4],
                  ls=LINES[i % 4], ms=4.5, label=f"{bend} of bend")  # fmt: skip
    ax.set_xlabel("sections of each cable")
    ax.set_ylabel("rms error, worst channel\n(% of peak to peak)")
    ticks = sorted({int(row.at) for row in rows})
    ax.set_xticks(ticks, [str(t) for t in ticks])
    ax.minorticks_off()
    ax.legend()


def _placement_panels(torque: Axes, motion: Axes, loops: Mapping[str, Recording]) -> None:
    """The torque loop, and how far the load's angle stays behind the drive's."""
    for i, (place, said) in enumerate(loops.items()):
        cycle = said[last_cycle(said)]
        style = {"color": COLOURS[i], "ls": LINES[i % 4], "lw": 1.1, "label": f"loop {place}"}
        torque.plot(*(cycle[c] * AXIS[c][1] for c in ("tau_in_Nm", "tau_out_Nm")), **style)
        motion.plot(cycle["theta_in_rad"], cycle["theta_in_rad"] - cycle["theta_out_rad"], **style)
    torque.set_xlabel(AXIS["tau_in_Nm"][0])
    torque.set_ylabel(AXIS["tau_out_Nm"][0])
    motion.set_xlabel(AXIS["theta_in_rad"][0])
    motion.set_ylabel(r"$\theta_{in} - \theta_{out}$ (rad)")
    torque.legend(loc="upper left", fontsize=8)
