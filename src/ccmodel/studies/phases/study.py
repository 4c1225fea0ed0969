"""The simulated example: one motion with its phases I to IV and instants 1 to 8, as in the paper's Figs. 5 to 7."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ccmodel.channels import TABLE, TAU_IN, TAU_OUT, TENSIONS, THETA_IN
from ccmodel.figures import (
    COLOURS,
    STYLE,
    TRANSMISSION,
    legend_below,
    letter_panels,
    name_axes,
    plot_channels,
    subplots,
)
from ccmodel.geometry import ConduitPath
from ccmodel.model.exact import CableProfile
from ccmodel.model.load import SpringLoad
from ccmodel.model.phases import PAPERS_PHASES, PhaseStudy, simulate_phases
from ccmodel.model.transmission import Transmission
from ccmodel.studies.loops.settings import Measuring
from ccmodel.studies.phases.settings import FIGURES, PhaseExample
from ccmodel.studies.run import Outcome, Run

SETTINGS = PhaseExample

# In the title of each of these figures, so that nobody takes it for a measurement.
SIMULATED = "simulated (no recording)"
PHASE_COLOURS = (COLOURS[4], COLOURS[1], COLOURS[2], COLOURS[3])
STROKES = ((1, 2, 3, 4, 5), (5, 6, 7, 8, 1))


def judge(example: PhaseExample, runs: Sequence[Run] = (), measuring: Measuring | None = None) -> Outcome:
    """Simulate the example and draw its figures; it needs no recording."""
    study = study_of(example)
    return Outcome([draw(study) for draw in DRAW.values()])


def study_of(example: PhaseExample) -> PhaseStudy:
    """Simulation of the example's motion with the exact solver."""
    path = ConduitPath(np.array([example.conduit_length_m]), np.array([example.conduit_bend_rad]))
    rigidity = example.cable_stiffness_N_per_m * example.conduit_length_m
    radius = example.pulley_radius_m
    return simulate_phases(
        Transmission(path, rigidity, example.friction_coefficient, radius, radius),
        SpringLoad(example.load_stiffness_Nm_per_rad),
        example.pretension_N,
        example.amplitude_rad,
        example.frequency_Hz,
        example.samples_per_cycle,
    )


def response_figure(study: PhaseStudy) -> Figure:
    """The paper's Fig. 5, and the same over time: tensions, torques and angles with instants 1 to 8."""
    values = _values(study)
    with matplotlib.rc_context(STYLE):
        figure, axes = subplots(3, 2, figsize=(9, 10.4))
        for ax, (x, y) in zip(axes.flat, TRANSMISSION, strict=False):
            _loop(ax, study, values, x, y)
        _over_time(axes[2, 0], study, values, TENSIONS, "tension (N)")
        _over_time(axes[2, 1], study, values, (TAU_IN, TAU_OUT), "torque (mN·m)")
        letter_panels(axes.flat)
        legend_below(figure, axes)
        figure.suptitle(f"response to a sine of the drive, {SIMULATED}")
    return figure


def torque_loop_figure(study: PhaseStudy) -> Figure:
    """The paper's Fig. 6: load torque over drive torque, with the phases I to IV in colour and by name."""
    values = _values(study)
    curve = _curve(values, TAU_IN, TAU_OUT)
    with matplotlib.rc_context(STYLE):
        figure, ax = subplots(figsize=(7.2, 5.8))
        start = slice(study.first_reversal + 1)
        plot_channels(ax, values, TAU_IN, TAU_OUT, start, color="0.6", lw=0.9, label="from rest")
        for first, last in _spells(study):
            phase, samples = study.phase[last], slice(first, last + 1)
            name = PAPERS_PHASES[phase]
            style = {"color": PHASE_COLOURS[phase], "linewidth": 2.4, "label": f"phase {name}"}
            plot_channels(ax, values, TAU_IN, TAU_OUT, samples, **style)
            _label_sample(ax, curve, _halfway_along(curve, first, last), name, 15, weight="bold", size=11)
        _mark_instants(ax, study, curve)
        name_axes(ax, TAU_IN, TAU_OUT)
        ax.margins(0.08)
        legend_below(figure, np.array([ax]), columns=5)
        figure.suptitle(f"torque transmission and its phases, {SIMULATED}")
    return figure


def profiles_figure(study: PhaseStudy) -> Figure:
    """The paper's Fig. 7: tension along both cables at instants 1 to 8, with a column for each stroke."""
    with matplotlib.rc_context(STYLE):
        figure, axes = subplots(2, 2, figsize=(9.4, 7.6), sharex=True, sharey=True)
        for column, stroke in enumerate(STROKES):
            for row, cable in enumerate("AB"):
                ax = axes[row, column]
                _profiles(ax, study, stroke, row)
                ax.set_title(f"cable {cable}, instants {stroke[0]} to {stroke[-1]}", loc="left")
                ax.set(xlabel="arc length from the drive (m)", ylabel="tension (N)")
                ax.label_outer()
            axes[1, column].legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=6, title="instant",
                                   handlelength=2.2, columnspacing=1.2)  # fmt: skip
        figure.suptitle(f"tension along the cables, {SIMULATED}")
    return figure


DRAW = dict(zip(FIGURES, (response_figure, torque_loop_figure, profiles_figure), strict=True))

_DASHES = ((), (6, 2), (2, 1.5), (8, 2, 2, 2), (4, 1, 1, 1, 1, 1))


def _profiles(ax: Axes, study: PhaseStudy, stroke: tuple[int, ...], cable: int) -> None:
    """One cable at the instants of a stroke, and halfway through its phase II."""
    for instant, color, dashes in zip(stroke, COLOURS, _DASHES, strict=False):
        if instant in study.instants:
            x, tension = _along(study.response.profiles[study.instants[instant]][cable])
            ax.plot(x, tension, color=color, dashes=dashes, linewidth=1.6, label=str(instant))
        if instant in study.halfway:
            x, tension = _along(study.response.profiles[study.halfway[instant]][cable])
            ax.plot(x, tension, color="black", linewidth=1.0, label=f"{instant}–{instant + 1}")


def _along(profile: CableProfile, points: int = 60) -> tuple[NDArray, NDArray]:
    """A profile with points between its corners; between two corners ln T is linear, T is not."""
    x = np.unique(np.concatenate([np.linspace(0, profile.x_m[-1], points), profile.x_m]))
    if profile.tension_N.min() <= 0:
        return x, np.zeros(x.size)
    return x, np.exp(np.interp(x, profile.x_m, np.log(profile.tension_N)))


def _values(study: PhaseStudy) -> dict[str, NDArray]:
    """Channels of the simulation, SI units."""
    return {c: study.theta_in_rad if c == THETA_IN else getattr(study.response, c) for x in TRANSMISSION for c in x}


def _curve(values: dict[str, NDArray], x: str, y: str) -> NDArray:
    """Two channels in the units of their axes, shape (2, n)."""
    return np.stack([values[c] * TABLE[c].scale for c in (x, y)])


def _loop(ax: Axes, study: PhaseStudy, values: dict[str, NDArray], x: str, y: str) -> None:
    """The cycle in black, the start from rest in grey, the instants by their numbers."""
    start = study.first_reversal
    plot_channels(ax, values, x, y, slice(start + 1), color="0.6", linewidth=0.9, label="from rest")
    plot_channels(ax, values, x, y, slice(start, None), color="black", linewidth=1.2, label="cycle")
    _mark_instants(ax, study, _curve(values, x, y))
    name_axes(ax, x, y)
    ax.margins(0.13)


def _over_time(ax: Axes, study: PhaseStudy, values: dict, names: tuple[str, ...], label: str) -> None:
    for name, color, dashes in zip(names, COLOURS, _DASHES, strict=False):
        short = TABLE[name].label.split(" at ")[0]
        ax.plot(study.time_s, values[name] * TABLE[name].scale, color=color, dashes=dashes, linewidth=1.3, label=short)
    for instant, sample in study.instants.items():
        ax.axvline(study.time_s[sample], color="0.75", linewidth=0.7, zorder=0)
        ax.text(study.time_s[sample], 1.0, str(instant), transform=ax.get_xaxis_transform(), ha="center", va="bottom")
    ax.set(xlabel="time (s)", ylabel=label)


def _mark_instants(ax: Axes, study: PhaseStudy, curve: NDArray) -> None:
    """A dot at every instant and its number outside the loop; instants at the same point share one text."""
    scaled = _scaled(curve)
    groups: dict[int, list[int]] = {}
    for instant, sample in study.instants.items():
        ax.plot(*curve[:, sample], "o", color="black", markersize=4)
        near = (other for other in groups if np.hypot(*(scaled[:, other] - scaled[:, sample])) < 0.01)
        groups.setdefault(next(near, sample), []).append(instant)
    for sample, group in groups.items():
        _label_sample(ax, curve, sample, ", ".join(map(str, sorted(group))))


def _scaled(curve: NDArray) -> NDArray:
    """A curve divided by its extent in each direction, as it appears on the page; shape (2, n)."""
    extent = np.ptp(curve, axis=1, keepdims=True)
    return curve / np.where(extent > 0, extent, 1)


def _label_sample(ax: Axes, curve: NDArray, sample: int, text: str, points: float = 11, **style: Any) -> None:
    """Text next to a sample of a curve, in the direction with the largest clearance; of two equal ones the outer."""
    scaled = _scaled(curve)
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    direction = np.stack([np.cos(angle), np.sin(angle)])
    here, middle = scaled[:, sample], (scaled.max(axis=1) + scaled.min(axis=1)) / 2
    candidates = here[:, None] + 0.06 * direction
    clearance = np.hypot(*(candidates[:, :, None] - scaled[:, None, :])).min(axis=1)
    best = direction[:, np.argmax(clearance + 0.02 * (here - middle) @ direction)]
    ax.annotate(
        text,
        tuple(curve[:, sample]),
        tuple(points * best),
        textcoords="offset points",
        ha="center",
        va="center",
        **style,
    )


def _spells(study: PhaseStudy) -> list[tuple[int, int]]:
    """First and last sample of each phase of the cycle; neighbours share a sample."""
    start = study.first_reversal
    changes = start + 1 + np.flatnonzero(np.diff(study.phase[start + 1 :]))
    return list(pairwise([start, *changes.tolist(), study.phase.size - 1]))


def _halfway_along(curve: NDArray, first: int, last: int) -> int:
    """Sample at half the arc length between two samples of a curve."""
    length = np.cumsum(np.hypot(*np.diff(_scaled(curve)[:, first : last + 1])))
    return first + 1 + int(np.searchsorted(length, length[-1] / 2))
