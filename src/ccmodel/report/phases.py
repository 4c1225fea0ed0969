"""The paper's Figs. 5 to 7: one simulated motion, its phases I to IV and its instants 1 to 8."""

from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ccmodel.config import PHASE_FIGURES
from ccmodel.model.exact import CableProfile
from ccmodel.model.phases import PAPERS_PHASES, PhaseStudy
from ccmodel.report.figures import AXIS, COLOURS, STYLE, legend_below

# What every one of these figures calls itself: nobody may take it for a measurement.
SIMULATED = "simulated (no recording)"
PHASE_COLOURS = (COLOURS[4], COLOURS[1], COLOURS[2], COLOURS[3])
STROKES = ((1, 2, 3, 4, 5), (5, 6, 7, 8, 1))


def response_figure(study: PhaseStudy) -> Figure:
    """The paper's Fig. 5, and the same over time: tensions, torques and angles with instants 1 to 8."""
    panels = [("T1_N", "T2_N"), ("T3_N", "T4_N"), ("tau_in_Nm", "tau_out_Nm"), ("theta_in_rad", "theta_out_rad")]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(3, 2, figsize=(9, 10.4))
        for ax, letter, (x, y) in zip(axes.flat, "abcd", panels, strict=False):
            _loop(ax, study, x, y)
            ax.set_title(f"({letter})", loc="left")
        _over_time(axes[2, 0], study, ("T1_N", "T2_N", "T3_N", "T4_N"), "tension (N)")
        _over_time(axes[2, 1], study, ("tau_in_Nm", "tau_out_Nm"), "torque (mN·m)")
        for ax, letter in zip(axes[2], "ef", strict=True):
            ax.set_title(f"({letter})", loc="left")
        legend_below(figure, axes)
        figure.suptitle(f"response to a sine of the drive, {SIMULATED}")
    return figure


def torque_loop_figure(study: PhaseStudy) -> Figure:
    """The paper's Fig. 6: load torque over drive torque, phases I to IV in colour and by name."""
    x, y = _values(study, "tau_in_Nm"), _values(study, "tau_out_Nm")
    with plt.rc_context(STYLE):
        figure, ax = plt.subplots(figsize=(7.2, 5.8))
        ax.plot(x[: study.first_reversal + 1], y[: study.first_reversal + 1], color="0.6", lw=0.9, label="from rest")
        for first, last in _spells(study):
            name = study.phase[last]
            label = f"phase {PAPERS_PHASES[name]}"
            ax.plot(x[first : last + 1], y[first : last + 1], color=PHASE_COLOURS[name], linewidth=2.4, label=label)
            _beside(ax, x, y, _halfway_along(x, y, first, last), PAPERS_PHASES[name], 15, weight="bold", size=11)
        _mark_instants(ax, study, x, y)
        _name_axes(ax, "tau_in_Nm", "tau_out_Nm")
        ax.margins(0.08)
        handles = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=5)
        figure.suptitle(f"torque transmission and its phases, {SIMULATED}")
    return figure


def profiles_figure(study: PhaseStudy) -> Figure:
    """The paper's Fig. 7: tension along both cables at instants 1 to 8, a column a stroke."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 2, figsize=(9.4, 7.6), sharex=True, sharey=True)
        for column, stroke in enumerate(STROKES):
            for row, cable in enumerate("AB"):
                ax = axes[row, column]
                _profiles(ax, study, stroke, row)
                ax.set_title(f"cable {cable}, instants {stroke[0]} to {stroke[-1]}", loc="left")
                ax.set_xlabel("arc length from the drive (m)")
                ax.set_ylabel("tension (N)")
                ax.label_outer()
            axes[1, column].legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=6, title="instant",
                                   handlelength=2.2, columnspacing=1.2)  # fmt: skip
        figure.suptitle(f"tension along the cables, {SIMULATED}")
    return figure


DRAW = dict(zip(PHASE_FIGURES, (response_figure, torque_loop_figure, profiles_figure), strict=True))

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
    """A profile with points between its corners, where ln T and not T runs straight."""
    x = np.unique(np.concatenate([np.linspace(0, profile.x_m[-1], points), profile.x_m]))
    if profile.tension_N.min() <= 0:
        return x, np.zeros(x.size)
    return x, np.exp(np.interp(x, profile.x_m, np.log(profile.tension_N)))


def _values(study: PhaseStudy, channel: str) -> NDArray:
    """A channel in the unit that its axis shows."""
    values = study.theta_in_rad if channel == "theta_in_rad" else getattr(study.response, channel)
    return values * AXIS[channel][1]


def _loop(ax: Axes, study: PhaseStudy, x_name: str, y_name: str) -> None:
    """The cycle in black, the way into it in grey, instants numbered."""
    x, y, start = _values(study, x_name), _values(study, y_name), study.first_reversal
    ax.plot(x[: start + 1], y[: start + 1], color="0.6", linewidth=0.9, label="from rest")
    ax.plot(x[start:], y[start:], color="black", linewidth=1.2, label="cycle")
    _mark_instants(ax, study, x, y)
    _name_axes(ax, x_name, y_name)
    ax.margins(0.13)


def _over_time(ax: Axes, study: PhaseStudy, channels: tuple[str, ...], unit: str) -> None:
    for channel, color, dashes in zip(channels, COLOURS, _DASHES, strict=False):
        label = AXIS[channel][0].rsplit(" (", 1)[0].split(" at ")[0].split(", ")[0]
        ax.plot(study.time_s, _values(study, channel), color=color, dashes=dashes, linewidth=1.3, label=label)
    for instant, sample in study.instants.items():
        ax.axvline(study.time_s[sample], color="0.75", linewidth=0.7, zorder=0)
        ax.text(study.time_s[sample], 1.0, str(instant), transform=ax.get_xaxis_transform(), ha="center", va="bottom")
    ax.set_xlabel("time (s)")
    ax.set_ylabel(unit)


def _mark_instants(ax: Axes, study: PhaseStudy, x: NDArray, y: NDArray) -> None:
    """A dot at every instant and its number outside the loop; instants at the same place share one text."""
    at = _scaled(x, y)
    places: list[list[int]] = []
    for instant, sample in study.instants.items():
        ax.plot(x[sample], y[sample], "o", color="black", markersize=4)
        near = (p for p in places if np.hypot(*(at[:, study.instants[p[0]]] - at[:, sample])) < 0.01)
        place = next(near, None)
        if place is None:
            places.append([instant])
        else:
            place.append(instant)
    for place in places:
        _beside(ax, x, y, study.instants[place[0]], ", ".join(map(str, sorted(place))))


def _scaled(x: NDArray, y: NDArray) -> NDArray:
    """A curve in parts of its own extent, as it looks on the page; shape (2, n)."""
    curve = np.stack([x, y])
    extent = np.ptp(curve, axis=1, keepdims=True)
    return curve / np.where(extent > 0, extent, 1)


def _beside(ax: Axes, x: NDArray, y: NDArray, sample: int, text: str, points: float = 11, **style) -> None:
    """Text beside a sample of a curve, on the side where it is farthest from the whole curve; outward of two alike."""
    curve = _scaled(x, y)
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    direction = np.stack([np.cos(angle), np.sin(angle)])
    here, middle = curve[:, sample], (curve.max(axis=1) + curve.min(axis=1)) / 2
    tried = here[:, None] + 0.06 * direction
    clearance = np.hypot(*(tried[:, :, None] - curve[:, None, :])).min(axis=1)
    best = direction[:, np.argmax(clearance + 0.02 * (here - middle) @ direction)]
    ax.annotate(text, (x[sample], y[sample]), points * best, textcoords="offset points", ha="center", va="center",
                **style)  # fmt: skip


def _spells(study: PhaseStudy) -> list[tuple[int, int]]:
    """First and last sample of each phase of the cycle, neighbours sharing a sample."""
    start = study.first_reversal
    changes = start + 1 + np.flatnonzero(np.diff(study.phase[start + 1 :]))
    edges = [start, *changes.tolist(), study.phase.size - 1]
    return list(pairwise(edges))


def _halfway_along(x: NDArray, y: NDArray, first: int, last: int) -> int:
    """Sample halfway along the way from one sample to another, which is not the middle of the samples."""
    way = np.cumsum(np.hypot(*np.diff(_scaled(x, y)[:, first : last + 1])))
    return first + 1 + int(np.searchsorted(way, way[-1] / 2))


def _name_axes(ax: Axes, x: str, y: str) -> None:
    ax.set_xlabel(AXIS[x][0])
    ax.set_ylabel(AXIS[y][0])
