"""Figures of the validation's page."""

from math import ceil
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from proof.outcome import INCONSISTENT

# Colours of Okabe and Ito, distinguishable with any colour vision; the markers differ too.
BLUE, ORANGE, GREY, GREEN, PURPLE = "#0072B2", "#E69F00", "#999999", "#009E73", "#CC79A7"
# Panels in a row of the figure of detection.
COLUMNS = 4
# Marker and colour of each kind of case, and the kinds' names in legends where they differ.
KINDS = {
    "clean": ("o", GREY),
    "single": ("s", BLUE),
    "pair": ("^", GREEN),
    "unlisted": ("D", ORANGE),
    "poor": ("v", PURPLE),
}
NAMES = {"unlisted": "no candidate", "poor": "poor protocol"}


def write_figures(scored: dict, folder: Path) -> list[str]:
    """Draw every figure for which there are results; returns their file names."""
    folder.mkdir(parents=True, exist_ok=True)
    figures = {
        "proof-noticing.png": (_detection_by_error, scored["detection_by_error"]),
        "proof-detection.png": (_detection, scored["detection"]),
        "proof-reliability.png": (_reliability, scored["reliability"]),
        "proof-kept-back.png": (_held_out_errors, scored["kept_back"]),
        "proof-confusion.png": (_confusion, scored["confusion"]),
    }
    names = []
    for name, (draw, data) in figures.items():
        if data:
            with matplotlib.rc_context({"font.size": 8, "axes.spines.top": False, "axes.spines.right": False}):
                draw(data).savefig(folder / name, dpi=130)
            names.append(name)
    return names


def _detection_by_error(rows: list[dict]) -> Figure:
    """Rates of detection and identification of single effects over the recalibrated model's error, one point a bin."""
    figure = Figure(figsize=(4.5, 3.4), layout="constrained")
    panel = figure.subplots()
    # The second series is shifted by 5 %, so that its error bars do not cover those of the first.
    series = (("detected", "detected", BLUE, "o", 1.0), ("identified", "identified first", ORANGE, "s", 1.05))
    for key, label, colour, marker, shift in series:
        rates = [row[key] for row in rows]
        rate = np.array([r["rate"] for r in rates])
        half_widths = np.clip([rate - [r["low"] for r in rates], [r["high"] for r in rates] - rate], 0, None)
        x = [shift * row["error_before"] for row in rows]
        panel.errorbar(x, rate, half_widths, fmt=marker, color=colour, ms=5, capsize=2, label=f"{label}, 95 % Wilson")
    for row in rows:
        panel.annotate(f"{row['detected']['n']}", (row["error_before"], -0.09), fontsize=7, ha="center")
    panel.set(xscale="log", ylim=(-0.15, 1.05), ylabel="share of single effects (number below)")
    panel.set_xlabel("error of the recalibrated model (noise floors)")
    limits = panel.get_xlim()  # restored after the ticks, which would widen them
    panel.set_xticks([1, 2, 5, 10, 20, 50], ["1", "2", "5", "10", "20", "50"])
    panel.set_xlim(limits)
    panel.xaxis.set_minor_formatter(NullFormatter())
    figure.legend(loc="outside upper center", ncols=2, frameon=False)
    return figure


def _detection(detection: dict) -> Figure:
    """One panel for each effect: every case at its size, and the logistic curve of detection over log size."""
    rows = ceil(len(detection) / COLUMNS)
    figure = Figure(figsize=(9, 0.6 + 1.35 * rows), layout="constrained")
    panels = figure.subplots(rows, COLUMNS, squeeze=False, sharey=True)
    marks = {
        "identified first": (BLUE, "o", lambda p: p["identified"]),
        "detected only": (ORANGE, "^", lambda p: p["detected"] and not p["identified"]),
        "not detected": (GREY, "x", lambda p: not p["detected"]),
    }
    for panel, (name, found) in zip(panels.flat, detection.items(), strict=False):
        for label, (colour, marker, belongs) in marks.items():
            cases = [p for p in found["points"] if belongs(p)]
            panel.plot(
                [p["size"] for p in cases], [p["detected"] for p in cases], marker, color=colour, ms=4, label=label
            )
        smallest, largest = found["drawn"]  # the range from which the cases' sizes are drawn
        if found["half_size"]:
            x = np.geomspace(smallest, largest, 60)
            panel.plot(x, 1 / (1 + (x / found["half_size"]) ** -found["slope"]), color="black", lw=0.8)
        panel.set(
            xscale="log",
            xlim=(smallest / 1.3, largest * 1.3),
            ylim=(-0.15, 1.15),
            yticks=[0, 1],
            yticklabels=["missed", "detected"],
        )
        panel.set_title(name, fontsize=8)
        panel.set_xlabel({"1": "share"}.get(found["unit"], found["unit"]), fontsize=7)
        panel.xaxis.set_minor_formatter(NullFormatter())
    for panel in panels.flat[len(detection) :]:
        panel.set_axis_off()
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    return figure


def _reliability(bins: list[dict]) -> Figure:
    """Reliability diagram: share of the reported mechanisms and alternatives that are true, over stated confidence."""
    figure = Figure(figsize=(4, 4), layout="constrained")
    panel = figure.subplots()
    stated, right = [b["stated"] for b in bins], np.array([b["rate"] for b in bins])
    half_widths = np.clip([right - [b["low"] for b in bins], [b["high"] for b in bins] - right], 0, None)
    panel.plot([0, 1], [0, 1], color=GREY, lw=0.8, ls="--", label="as stated")
    panel.errorbar(stated, right, half_widths, fmt="o", color=BLUE, ms=4, capsize=2, label="right, 95 % Wilson")
    for b in bins:
        panel.annotate(f" {b['n']}", (b["stated"], b["rate"]), fontsize=7, va="top")
    panel.set(xlim=(0, 1.03), ylim=(-0.03, 1.03), xlabel="stated confidence", ylabel="share that was right")
    figure.legend(loc="outside upper center", ncols=2, frameon=False)
    return figure


def _held_out_errors(errors: list[dict]) -> Figure:
    """Errors on held-out recordings in noise floors, before and after the diagnosis."""
    figure = Figure(figsize=(4.5, 4.2), layout="constrained")
    panel = figure.subplots()
    for kind, (marker, colour) in KINDS.items():
        # An effect whose mechanism is removed from the candidates counts as one without a candidate.
        cases = [e for e in errors if {"removed": "unlisted"}.get(e["kind"], e["kind"]) == kind]
        x, y = [e["before"] for e in cases], [e["after"] for e in cases]
        panel.plot(x, y, marker, color=colour, ms=3.5, label=NAMES.get(kind, kind))
    limits = [0.5, max(max(e["before"], e["after"]) for e in errors) * 1.3]
    panel.plot(limits, limits, color=GREY, lw=0.8, ls="--")
    panel.axhline(1, color=GREY, lw=0.8)
    panel.set(xscale="log", yscale="log", xlim=limits, ylim=limits)
    panel.set(xlabel="recalibrated model (noise floors)", ylabel="diagnosed model (noise floors)")
    figure.legend(loc="outside upper center", ncols=3, frameon=False)
    return figure


def _confusion(table: dict[str, dict[str, int]]) -> Figure:
    """Confusion matrix of single effects and clean cases.

    A row is a true effect; the row "none" holds the clean cases. A column is what was reported: a mechanism, or a
    verdict that names none; the column "none" holds the cases without a diagnosis.
    """
    verdicts = ["agrees", "undecided", "unexplained", INCONSISTENT, "none"]
    # The true effects in the order of the rows, then the verdicts, then mechanisms that are no true effect of any case.
    columns = [*(n for n in table if n != "none"), *verdicts, *(n for row in table.values() for n in row)]
    reported = list(dict.fromkeys(n for n in columns if any(n in row for row in table.values())))
    counts = np.array([[row.get(name, 0) for name in reported] for row in table.values()])
    figure = Figure(figsize=(2.6 + 0.24 * len(reported), 1.8 + 0.2 * len(table)), layout="constrained")
    panel = figure.subplots()
    # Zeros stay white. The colour scale is wider than the counts, so that the numbers remain legible.
    panel.imshow(
        np.ma.masked_equal(counts, 0), cmap="Blues", norm=LogNorm(0.5, max(counts.max(), 2) * 2), aspect="auto"
    )
    for (i, j), n in np.ndenumerate(counts):
        if n:
            dark = n > counts.max() / 4
            panel.text(j, i, n, ha="center", va="center", fontsize=7, color="white" if dark else "black")
    panel.set_xticks(range(len(reported)), [{"none": "no diagnosis"}.get(n, n) for n in reported], rotation=90)
    panel.set_yticks(range(len(table)), [{"none": "clean"}.get(n, n) for n in table])
    panel.set(xlabel="diagnosis", ylabel="true effect")
    return figure
