"""Figures of predictions, fits and diagnoses for a session of Python."""

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ccmodel.api.batch import Batch
from ccmodel.channels import CHANNELS, MEASURED, TABLE
from ccmodel.diagnosis.run import Calibration
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.errors import is_compared
from ccmodel.figures import COLOURS, legend_below, title_figure
from ccmodel.recording import ORIGIN, Recording
from ccmodel.report.verdict import NOT_ACCEPTED, SYMBOL
from ccmodel.session_figures import session_figure, short_label
from ccmodel.typed import InputError, advice

# Most recordings that have a column of their own.
MOST_COLUMNS = 6


@session_figure
def compared(pairs: Sequence[tuple[Recording, Recording]], channel: str | None = None) -> Figure:
    """Recorded and predicted channels over time, by channel (rows) and recording (columns)."""
    common = [c for c in CHANNELS if any(is_compared(*pair, c) for pair in pairs)]
    if channel is not None and channel not in common:
        raise InputError(f"no recording and its prediction have the channel '{channel}'; {advice(channel, common)}")
    rows = [channel] if channel else [c for c in common if c in MEASURED]
    columns = pairs[:MOST_COLUMNS]
    figure, axes = plt.subplots(
        len(rows), len(columns), figsize=(max(7.5, 3.2 * len(columns)), 0.9 + (2.6 if channel else 1.6) * len(rows)),
        sharex="col", sharey="row", squeeze=False,
    )  # fmt: skip
    for j, (recorded, predicted) in enumerate(columns):
        for ax, name in zip(axes[:, j], rows, strict=True):
            if is_compared(recorded, predicted, name):
                scale = TABLE[name].scale
                ax.plot(recorded.time_s, scale * recorded[name], lw=1.6, color="#8c8c8c", label="recorded")
                ax.plot(predicted.time_s, scale * predicted[name], lw=0.9, color=COLOURS[1], label="predicted")
        axes[0, j].set_title(recorded.id, fontsize=9)
        axes[-1, j].set_xlabel("time (s)")
    for ax, name in zip(axes[:, 0], rows, strict=True):
        ax.set_ylabel(short_label(name))
    some = f"; the first {len(columns)} of {len(pairs)}" if len(columns) < len(pairs) else ""
    title_figure(figure, f"{pairs[0][0].batch}: {ORIGIN[pairs[0][0].origin]} and prediction{some}")
    legend_below(figure, axes)
    return figure


@session_figure
def residuals(calibration: Calibration, batch: Batch) -> Figure:
    """Residuals of the calibrated model over the noise floor, by channel (rows) and recording (columns)."""
    whitened = calibration.fit.whitened
    of = {w.observations.id: w.observations.errors(calibration.fit.values) for w in whitened}
    floors = {w.observations.id: w for w in whitened}
    size = {
        id: float(np.mean((errors * w.observations.sigma) ** 2 / _floor(w)[:, None] ** 2))
        for (id, errors), w in zip(of.items(), whitened, strict=True)
    }
    largest = sorted(size, key=lambda id: -size[id])[:MOST_COLUMNS]
    columns = [id for id in of if id in largest]
    rows = [c for c in MEASURED if any(c in floors[id].observations.channels for id in columns)]
    figure, axes = plt.subplots(
        len(rows), len(columns), figsize=(max(6.0, 2.9 * len(columns)), 0.9 + 1.5 * len(rows)),
        sharex="col", sharey="row", squeeze=False,
    )  # fmt: skip
    for j, id in enumerate(columns):
        w = floors[id]
        o = w.observations
        time_s = o.given.recording.time_s[o.judged]
        for i, channel in enumerate(rows):
            ax = axes[i, j]
            ax.axhspan(-1, 1, color="#d9d9d9", lw=0, label="noise floor")
            if channel in o.channels:
                c = o.channels.index(channel)
                ax.plot(time_s, of[id][c] * o.sigma[c] / w.noise_floor[channel], color=COLOURS[0], lw=0.7,
                        label="model minus recording")  # fmt: skip
        axes[0, j].set_title(id, fontsize=9)
        axes[-1, j].set_xlabel("time (s)")
    for ax, channel in zip(axes[:, 0], rows, strict=True):
        ax.set_ylabel(f"{TABLE[channel].tex}\n(noise floors)")
    some = f"; the {len(columns)} of {len(of)} with the largest" if len(columns) < len(of) else ""
    title_figure(figure, f"{batch.name}: residuals over the noise floor{some}; {ORIGIN[batch.origin]}")
    legend_below(figure, axes)
    return figure


def _floor(whitened: Whitened) -> NDArray:
    return np.array([whitened.noise_floor[channel] for channel in whitened.observations.channels])


@session_figure
def errors(table: pd.DataFrame, batch: Batch, verdict: str) -> Figure:
    """Held-out errors by channel over the noise floor: a bar for each model."""
    models = {"before": "calibrated model"}
    if "after" in table:
        models["after"] = "extended model"
    if "nearest" in table:
        models["nearest"] = f"nearest model, {NOT_ACCEPTED}"
    colours = {"before": COLOURS[0], "after": COLOURS[1], "nearest": COLOURS[3]}
    figure, ax = plt.subplots(figsize=(7.5, 1.4 + 0.5 * len(table)))
    height = 0.8 / len(models)
    for k, (column, label) in enumerate(models.items()):
        ratios = table[column] / table["noise"]
        at = np.arange(len(table)) + (k - (len(models) - 1) / 2) * height
        bars = ax.barh(at, ratios, 0.9 * height, color=colours[column], label=label)
        # The white box keeps the line of the noise floor off the number.
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
        ax.bar_label(bars, [f"{ratio:.1f}" for ratio in ratios], padding=3, fontsize=8, bbox=box)
    ax.axvline(1.0, color="black", lw=1.0, ls="--", label="noise floor")
    ax.set_yticks(range(len(table)), [SYMBOL[channel] for channel in table.index])
    ax.invert_yaxis()
    ax.grid(False, axis="y")
    ax.set(xlabel="root mean square error on held-out recordings (noise floors)", ylabel="channel")
    title_figure(figure, f"{batch.name}, verdict '{verdict}': {ORIGIN[batch.origin]}")
    legend_below(figure, np.array([ax]))
    return figure
