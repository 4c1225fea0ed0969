"""The comparison figures: recordings beside what the model says of them."""

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import cycle
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ccmodel.compare.errors import last_cycle
from ccmodel.compare.studies import labelled, origins_of
from ccmodel.config import Study
from ccmodel.model.run import PRESCRIBED
from ccmodel.recording import ORIGIN, Recording

# A recording, and what the model says of it; None where the model could not be run.
Pair = tuple[Recording, Recording | None]

# Okabe and Ito's palette without its yellow, which is too faint on white: told apart with any kind of colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
LINES = ("-", "--", "-.", ":")
AXIS = {
    "theta_in_rad": (r"drive angle $\theta_{in}$ (rad)", 1),
    "theta_out_rad": (r"load angle $\theta_{out}$ (rad)", 1),
    "tau_in_Nm": (r"drive torque $\tau_{in}$ (mN·m)", 1e3),
    "tau_out_Nm": (r"load torque $\tau_{out}$ (mN·m)", 1e3),
    "T1_N": (r"tension $T_1$ at the drive, cable A (N)", 1),
    "T2_N": (r"tension $T_2$ at the load, cable A (N)", 1),
    "T3_N": (r"tension $T_3$ at the drive, cable B (N)", 1),
    "T4_N": (r"tension $T_4$ at the load, cable B (N)", 1),
}
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


def transmission_figure(pairs: Sequence[Pair], study: Study) -> Figure:
    """The paper's Figs. 8 and 9: both tension transmissions, torque and motion, recording and model in one panel.

    Of the pairs, the first is drawn: one run, and the model of that run. Panels of channels that were not recorded
    are left out.
    """
    if not pairs:
        return empty_figure(study)
    recorded, simulated = pairs[0]
    panels = [("T1_N", "T2_N"), ("T3_N", "T4_N"), ("tau_in_Nm", "tau_out_Nm"), ("theta_in_rad", "theta_out_rad")]
    panels = [(x, y) for x, y in panels if x in recorded and y in recorded]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 2, figsize=(9, 7.4))
        for ax in axes.flat[len(panels) :]:
            ax.set_axis_off()
        for ax, letter, (x, y) in zip(axes.flat, "abcd", panels, strict=False):
            _loop(ax, recorded, x, y, color=COLOURS[4], linewidth=2.4, label=ORIGIN[recorded.origin])
            if simulated is not None:
                _loop(ax, simulated, x, y, color="black", linewidth=1.0, label=_model_title([pairs[0]]))
            _name_axes(ax, x, y)
            ax.set_title(f"({letter})", loc="left")
        legend_below(figure, axes)
        figure.suptitle(f"{study.title}: {recorded.batch}/{recorded.id}")
    return figure


def loops_figure(pairs: Sequence[Pair], study: Study, x: str = "tau_in_Nm", y: str = "tau_out_Nm") -> Figure:
    """Loops of channel `y` over channel `x`: of the recordings on the left, of the model on the right.

    With the two torques, the paper's Figs. 10 and 11. A row of panels for each value of `study.rows`.
    """
    if not pairs:
        return empty_figure(study)
    rows = _by_label(pairs, study.rows) if study.rows else {"": pairs}
    conditions = _by_label(pairs, study.variable)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            len(rows), 2, figsize=(9, 0.8 + 3.4 * len(rows)), sharex=True, sharey=True, squeeze=False
        )
        for (row_label, row_pairs), (left, right) in zip(rows.items(), axes, strict=True):
            in_row = {id(recorded) for recorded, _ in row_pairs}
            for (label, group), style in zip(conditions.items(), _styles(), strict=False):
                for recorded, simulated in (pair for pair in group if id(pair[0]) in in_row):
                    _loop(left, recorded, x, y, label=label, **style)
                    if simulated is not None:
                        _loop(right, simulated, x, y, label=label, **style)
            left.set_title(_joined(row_label, origins_of(r for r, _ in row_pairs)), loc="left")
            right.set_title(_joined(row_label, _model_title(row_pairs)), loc="left")
            for ax in (left, right):
                _name_axes(ax, x, y)
                _say_if_empty(ax, x, y)
                ax.label_outer()
        legend_below(figure, axes)
        figure.suptitle(study.title)
    return figure


def loops_apart_figure(pairs: Sequence[Pair], study: Study) -> Figure:
    """The paper's Fig. 12: a panel for the recordings of each condition, and one for the model of all of them."""
    if not pairs:
        return empty_figure(study)
    x, y = "tau_in_Nm", "tau_out_Nm"
    conditions = _by_label(pairs, study.variable)
    rows = -(-(len(conditions) + 1) // 2)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(rows, 2, figsize=(9, 0.8 + 3.2 * rows), sharex=True, sharey=True, squeeze=False)
        for ax in axes.flat[len(conditions) + 1 :]:
            ax.set_axis_off()
        *apart, together = axes.flat[: len(conditions) + 1]
        for ax, (label, group), style in zip(apart, conditions.items(), _styles(), strict=False):
            for recorded, simulated in group:
                _loop(ax, recorded, x, y, label=label, **style)
                if simulated is not None:
                    _loop(together, simulated, x, y, label=label, **style)
            ax.set_title(f"{label}, {origins_of(r for r, _ in group)}", loc="left")
        together.set_title(f"{_model_title(pairs)}, all of them", loc="left")
        for ax in (*apart, together):
            _name_axes(ax, x, y)
            _say_if_empty(ax, x, y)
            ax.tick_params(labelbottom=True)
        legend_below(figure, axes)
        figure.suptitle(study.title)
    return figure


def empty_figure(study: Study) -> Figure:
    """A figure that says that there was nothing to draw, where every recording of a study was refused."""
    with plt.rc_context(STYLE):
        figure, ax = plt.subplots(figsize=(9, 2))
        ax.set_axis_off()
        ax.text(0.5, 0.5, f"{study.title}: no usable recording (see what was left out)", ha="center", va="center")
    return figure


def save_figure(figure: Figure, file: Path) -> None:
    """Write a figure as PNG or SVG; the same figure gives the same file, and text in an SVG stays text."""
    with plt.rc_context({"svg.fonttype": "none", "svg.hashsalt": "ccmodel"}):
        figure.savefig(file, dpi=150, metadata={"Date": None} if file.suffix == ".svg" else None)


FIGURES = {
    "transmission": transmission_figure,
    "torque-loops": loops_figure,
    "drive-loops": partial(loops_figure, x="theta_in_rad", y="tau_in_Nm"),
    "torque-loops-apart": loops_apart_figure,
}


def _by_label(pairs: Sequence[Pair], variable: str) -> dict[str, list[Pair]]:
    """Pairs under the label of their recording's condition, in the order of the variable's values."""
    pair_of = {id(recorded): (recorded, simulated) for recorded, simulated in pairs}
    groups: dict[str, list[Pair]] = {}
    for label, recorded in labelled((r for r, _ in pairs), variable):
        groups.setdefault(label, []).append(pair_of[id(recorded)])
    return groups


def _styles() -> Iterator[dict]:
    """Colour and dash of one condition after the other: dashes change where the colours are used up."""
    for linestyle in cycle(LINES):
        for color in COLOURS:
            yield {"color": color, "linestyle": linestyle}


def _model_title(pairs: Sequence[Pair]) -> str:
    """What the model's panel is called; a load torque that it was given and not asked for is said."""
    given = any(s is not None and s.derived_from["tau_out_Nm"] == PRESCRIBED for _, s in pairs)
    return f"{ORIGIN['model']}, given the recorded load torque" if given else ORIGIN["model"]


def _say_if_empty(ax: Axes, x: str, y: str) -> None:
    """An empty panel says why it is empty."""
    if not ax.lines:
        text = f"not recorded, or not simulated:\n{AXIS[x][0]} over {AXIS[y][0]}"
        ax.text(0.5, 0.5, text, ha="center", va="center", transform=ax.transAxes, wrap=True)


def _loop(ax: Axes, recording: Recording, x: str, y: str, **style) -> None:
    """One cycle of a recording in one panel; nothing where a channel was not recorded."""
    if x in recording and y in recording:
        cycle = last_cycle(recording)
        ax.plot(recording[x][cycle] * AXIS[x][1], recording[y][cycle] * AXIS[y][1], **({"linewidth": 1.0} | style))


def _name_axes(ax: Axes, x: str, y: str) -> None:
    ax.set_xlabel(AXIS[x][0])
    ax.set_ylabel(AXIS[y][0])


def legend_below(figure: Figure, axes: NDArray) -> None:
    """One legend for all panels, each label once, outside them where it cannot cover the data."""
    handles = {}
    for ax in axes.flat:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    columns = max(1, min(4, 100 // (6 + max(map(len, handles), default=1))))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns)


def _joined(*parts: str) -> str:
    return ", ".join(p for p in parts if p)
