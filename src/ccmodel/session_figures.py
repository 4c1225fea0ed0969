"""Figures for a session of Python: they use the backend that the user has."""

from collections.abc import Callable, Mapping
from functools import wraps

import matplotlib
import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ccmodel.channels import CHANNELS, MEASURED, TABLE, THETA_IN
from ccmodel.figures import COLOURS, LINES, STYLE, legend_below, title_figure
from ccmodel.typed import InputError, advice


def session_figure(draw: Callable[..., Figure]) -> Callable[..., Figure]:
    """Draw in the style of all figures; a notebook shows a figure that is returned, and must not show it twice."""

    @wraps(draw)
    def drawn(*arguments: object) -> Figure:
        with plt.rc_context(STYLE):
            figure = draw(*arguments)
            is_interactive = matplotlib.is_interactive()
        # The first figure of a session starts its backend; what that sets must outlive the style.
        matplotlib.interactive(is_interactive)
        if "inline" in matplotlib.get_backend():
            plt.close(figure)
        return figure

    return drawn


@session_figure
def channels_over_time(
    recorded: Mapping[str, tuple[NDArray, Mapping[str, NDArray]]], title: str, channel: str | None = None
) -> Figure:
    """A panel for each channel, with all recordings that have it.

    Parameters
    ----------
    recorded : mapping of str to (NDArray of float, shape (n,), mapping of str to NDArray of float, shape (n,))
        Times (s) and channels (SI units) of each recording, by its id.
    title : str
    channel : str, optional
        This channel alone; without it, every angle, torque and sum of tensions.

    Raises
    ------
    InputError
        If no recording has the channel.
    """
    present = [c for c in CHANNELS if any(c in values for _, values in recorded.values())]
    if channel is not None and channel not in present:
        raise InputError(f"no recording has the channel '{channel}'; {advice(channel, present)}")
    shown = [channel] if channel else [c for c in present if c in (THETA_IN, *MEASURED)]
    figure, axes = plt.subplots(
        len(shown), 1, figsize=(9, 0.9 + (2.4 if channel else 1.5) * len(shown)), sharex=True, squeeze=False
    )
    for ax, name in zip(axes[:, 0], shown, strict=True):
        having = [(id, time_s, values[name]) for id, (time_s, values) in recorded.items() if name in values]
        for k, (id, time_s, values) in enumerate(having):
            style = {"color": COLOURS[k % len(COLOURS)], "ls": LINES[k // len(COLOURS) % len(LINES)]}
            ax.plot(time_s, TABLE[name].scale * values, lw=1.0, label=id, **style)
        ax.set_ylabel(short_label(name))
    axes[-1, 0].set_xlabel("time (s)")
    title_figure(figure, title)
    legend_below(figure, axes)
    return figure


def short_label(channel: str) -> str:
    """Symbol and unit of a channel, for an axis with little room."""
    return f"{TABLE[channel].tex} ({TABLE[channel].plot_unit or TABLE[channel].unit})"
