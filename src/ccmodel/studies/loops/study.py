"""Figures of loops: recordings and the model of them."""

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import cycle

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ccmodel.channels import TABLE, TAU_IN, TAU_OUT, THETA_IN
from ccmodel.errors import last_cycle
from ccmodel.model.run import PRESCRIBED
from ccmodel.recording import ORIGIN, Recording
from ccmodel.report import figures
from ccmodel.report.figures import COLOURS, name_axes
from ccmodel.steps.files import Pair
from ccmodel.studies.loops.settings import Measuring, Study
from ccmodel.studies.run import Outcome, Run
from ccmodel.studies.variables import labelled, origins_of

SETTINGS = Study


def judge(study: Study, runs: Sequence[Run], measuring: Measuring | None = None) -> Outcome:
    """Draw the study's figure."""
    return Outcome([draw([pair for run in runs for pair in run.pairs], study)])


def draw(pairs: Sequence[Pair], study: Study) -> Figure:
    """Draw a study as its settings ask; a study without a usable recording has a figure that says so."""
    if not pairs:
        return figures.empty_figure(f"{study.title}: no usable recording (see what was left out)")
    with plt.rc_context(figures.STYLE):
        return _DRAW[study.figure](pairs, study)


def transmission_figure(pairs: Sequence[Pair], study: Study) -> Figure:
    """The paper's Figs. 8 and 9: loops of the tensions, torques and angles of one run, recording and model.

    Only the first pair is drawn. A panel whose channels were not recorded is missing.
    """
    recorded, simulated = pairs[0]
    panels = [(x, y) for x, y in figures.TRANSMISSION if x in recorded and y in recorded]
    figure, axes = plt.subplots(2, 2, figsize=(9, 7.4))
    for ax in axes.flat[len(panels) :]:
        ax.set_axis_off()
    for ax, (x, y) in zip(axes.flat, panels, strict=False):
        _loop(ax, recorded, x, y, color=COLOURS[4], linewidth=2.4, label=ORIGIN[recorded.origin])
        if simulated is not None:
            _loop(ax, simulated, x, y, color="black", label=_model_title([pairs[0]]))
        name_axes(ax, x, y)
    figures.letter_panels(axes.flat[: len(panels)])
    figures.legend_below(figure, axes)
    figure.suptitle(f"{study.title}: {recorded.batch}/{recorded.id}")
    return figure


def loops_figure(pairs: Sequence[Pair], study: Study, x: str = TAU_IN, y: str = TAU_OUT) -> Figure:
    """Loops of channel `y` over channel `x`, recordings on the left and the model on the right.

    With the two torques, the paper's Figs. 10 and 11. Each value of `study.rows` has a row of panels.
    """
    rows = _by_label(pairs, study.rows) if study.rows else {"": pairs}
    conditions = _by_label(pairs, study.variable)
    size = (9, 0.8 + 3.4 * len(rows))
    figure, axes = plt.subplots(len(rows), 2, figsize=size, sharex=True, sharey=True, squeeze=False)
    for (row_label, row_pairs), (left, right) in zip(rows.items(), axes, strict=True):
        in_row = {id(recorded) for recorded, _ in row_pairs}
        for (label, group), style in zip(conditions.items(), _styles(), strict=False):
            for recorded, simulated in (pair for pair in group if id(pair[0]) in in_row):
                _loop(left, recorded, x, y, label=label, **style)
                _loop(right, simulated, x, y, label=label, **style)
        left.set_title(_joined(row_label, origins_of(r for r, _ in row_pairs)), loc="left")
        right.set_title(_joined(row_label, _model_title(row_pairs)), loc="left")
        for ax in (left, right):
            _finish(ax, x, y)
            ax.label_outer()
    figures.legend_below(figure, axes)
    figure.suptitle(study.title)
    return figure


def loops_apart_figure(pairs: Sequence[Pair], study: Study) -> Figure:
    """The paper's Fig. 12: a panel for the recordings of each condition, and one for the model of all of them."""
    x, y = TAU_IN, TAU_OUT
    conditions = _by_label(pairs, study.variable)
    rows = -(-(len(conditions) + 1) // 2)
    figure, axes = plt.subplots(rows, 2, figsize=(9, 0.8 + 3.2 * rows), sharex=True, sharey=True, squeeze=False)
    for ax in axes.flat[len(conditions) + 1 :]:
        ax.set_axis_off()
    *apart, together = axes.flat[: len(conditions) + 1]
    for ax, (label, group), style in zip(apart, conditions.items(), _styles(), strict=False):
        for recorded, simulated in group:
            _loop(ax, recorded, x, y, label=label, **style)
            _loop(together, simulated, x, y, label=label, **style)
        ax.set_title(f"{label}, {origins_of(r for r, _ in group)}", loc="left")
    together.set_title(f"{_model_title(pairs)}, all of them", loc="left")
    for ax in (*apart, together):
        _finish(ax, x, y)
        ax.tick_params(labelbottom=True)
    figures.legend_below(figure, axes)
    figure.suptitle(study.title)
    return figure


_DRAW = {
    "transmission": transmission_figure,
    "torque-loops": loops_figure,
    "drive-loops": partial(loops_figure, x=THETA_IN, y=TAU_IN),
    "torque-loops-apart": loops_apart_figure,
}


def _by_label(pairs: Sequence[Pair], variable: str) -> dict[str, list[Pair]]:
    """Pairs by the label of their recording's condition, in the order of the variable's values."""
    pair_of = {id(recorded): (recorded, simulated) for recorded, simulated in pairs}
    groups: dict[str, list[Pair]] = {}
    for label, recorded in labelled((r for r, _ in pairs), variable):
        groups.setdefault(label, []).append(pair_of[id(recorded)])
    return groups


def _styles() -> Iterator[dict]:
    """Colour and dash of each condition; the dash changes when all colours are used."""
    for linestyle in cycle(figures.LINES):
        for color in COLOURS:
            yield {"color": color, "linestyle": linestyle}


def _model_title(pairs: Sequence[Pair]) -> str:
    """Title of the model's panel, with a load torque that the model was given."""
    given = any(s is not None and s.derived_from[TAU_OUT] == PRESCRIBED for _, s in pairs)
    return f"{ORIGIN['model']}, given the recorded load torque" if given else ORIGIN["model"]


def _finish(ax: Axes, x: str, y: str) -> None:
    """Label the axes; an empty panel says why it is empty."""
    name_axes(ax, x, y)
    if not ax.lines:
        figures.say_in_panel(ax, f"not recorded, or not simulated:\n{TABLE[x].axis} over {TABLE[y].axis}")


def _loop(ax: Axes, recording: Recording | None, x: str, y: str, **style) -> None:
    """The last cycle in one panel; nothing without a simulation or where a channel was not recorded."""
    if recording is not None and x in recording and y in recording:
        figures.plot_channels(ax, recording, x, y, last_cycle(recording), **({"linewidth": 1.0} | style))


def _joined(*parts: str) -> str:
    return ", ".join(p for p in parts if p)
