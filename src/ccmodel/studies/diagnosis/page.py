"""The page of a diagnosis: the headline, the rig with the place of the mismatch, and the evidence."""

import base64
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill

import jinja2
import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.channels import TABLE, THETA_IN, short_name
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.laws import visited
from ccmodel.diagnosis.location import PHASES, mismatch
from ccmodel.diagnosis.run import Diagnosis
from ccmodel.diagnosis.settings import CONSPICUOUS
from ccmodel.diagnosis.verdict import nested_choice
from ccmodel.figures import COLOURS, STYLE, legend_below, print_figure, stamp_figure, subplots, title_figure
from ccmodel.mechanisms import catalogue
from ccmodel.mechanisms.law_arguments import POSITION
from ccmodel.model.parameters import batch_key
from ccmodel.provenance import stamp
from ccmodel.recording import ORIGIN, Recording
from ccmodel.report.embedding import asset
from ccmodel.report.verdict import (
    NOT_ACCEPTED,
    SYMBOL,
    error_name,
    headline,
    law_claim,
    nearest_sentence,
    place_in_words,
    possible_places,
    printed_unit,
    quantity,
    rounded,
    with_symbols,
    worst_channel,
)
from ccmodel.rig.overview import overview_of
from ccmodel.sentences import joined

LOOPS = 3
CANDIDATES = 8
FAINT = "#9a9a9a"
# Letters of an axis label that fit beside a panel of a law.
LABEL_LETTERS = 34
# Marks of what the recordings visit of a law's argument.
MARKS = 100
WITH_FOUND = "extended model"


def _baseline(report: dict) -> str:
    """The baseline model in words."""
    return "frozen baseline" if report["is_held"] else "calibrated model"


def write_diagnosis(file: Path, found: Diagnosis, page: str | None = None) -> None:
    """Write the page with its figures inside.

    Parameters
    ----------
    file : Path
    found : Diagnosis
    page : str, optional
        Address of the page of the run, relative to `file`.
    """
    recording = found.judgement.whitened[0].observations.given.recording
    report = found.report
    nearest = report["nearest"] or {"mechanisms": []}
    named = [*report["mechanisms"], *report["likeliest"], *report["alternatives"], *nearest["mechanisms"]]
    errors = mismatch(found.calibrated, found.judgement.whitened)
    with matplotlib.rc_context(STYLE):
        text = _template("page.html.j2").render(
            report=report,
            page=page,
            headline=headline(report),
            nearest=nearest_sentence(report),
            places=possible_places(report),
            in_words=place_in_words,
            origin=ORIGIN[recording.origin],
            single_cable=recording.far_end is not None,
            symbol=SYMBOL,
            baseline=_baseline(report),
            has_found=found.judgement.best is not found.judgement.calibrated,
            candidates=candidates_of(found)[: 1 + CANDIDATES],
            unlisted=found.judgement.comparison.unlisted,
            mechanisms=[catalogue.parts(name) for name in sorted({m["name"] for m in named})],
            summaries={name: registry.get(name) for name in registry.names()},
            law_sentences=[law_claim(law) for law in report["laws"]],
            law_figures=[_encoded(_law(law, found)) for law in report["laws"]],
            map=_encoded(_map(found)),
            map_in_words=_map_in_words(errors),
            caution=_caution(report, errors),
            repeatability=repeatability_in_words(report["repeatability"]),
            loops=_encoded(_loops(found)),
            between=_between(found.judgement.best),
            recordings=[w.observations.given.recording.id for w in found.judgement.whitened],
        )
    file.write_text(text, encoding="utf-8")


def _between(fit: CandidateFit) -> list[str]:
    """The friction of each batch over the rig's, of several batches, in words."""
    start = batch_key("friction_scale", "")
    return [
        f"{key.removeprefix(start)} {fit.values[key]:.3f} ({one.low:.3f} to {one.high:.3f})"
        for key, one in fit.intervals().items()
        if key.startswith(start)
    ]


def write_inconsistent(file: Path, report: Mapping, recordings: Sequence[Recording], page: str | None = None) -> None:
    """Write the page of a batch whose inputs contradict one another: the contradictions, then what was read."""
    text = _template("inconsistent.html.j2").render(
        report=report,
        headline=headline(report),
        origin=ORIGIN[recordings[0].origin] if recordings else None,
        overviews={recording.id: overview_of(recording) for recording in recordings},
        table=TABLE,
        page=page,
    )
    file.write_text(text, encoding="utf-8")


def write_not_diagnosed(file: Path, batch: str, why: str, page: str | None = None) -> None:
    """Write the page of a batch that could not be diagnosed."""
    text = _template("not-diagnosed.html.j2").render(report={"batch": batch}, why=why, page=page)
    file.write_text(text, encoding="utf-8")


def _template(name: str) -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ccmodel", "."), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.globals |= {"asset": asset, "quantity": quantity, "joined": joined}
    environment.filters |= {"printed_unit": printed_unit, "with_symbols": with_symbols}
    return environment.get_template(f"studies/diagnosis/{name}")


def _map_in_words(errors: Mapping[str, Mapping[str, float]]) -> str:
    """The map of errors for readers who do not see it."""
    rows = (
        f"{SYMBOL[channel]} " + ", ".join(f"{phase} {value:.1f}" for phase, value in phases.items())
        for channel, phases in errors.items()
    )
    return "Residuals over the noise floor: " + "; ".join(rows)


# Where a standard deviation comes from, after the number of recordings.
SOURCES = {
    "repeats": "that repeat a condition",
    "scatter": "none of which repeats another",
    "cycles": "with consecutive cycles",
    "rest": "at rest",
    "count": "with encoder counts",
}


def repeatability_in_words(rows: Sequence[Mapping]) -> str:
    """The standard deviations that count as noise: what the recordings show, and what was assumed."""
    shown, assumed = [], []
    for row in rows:
        size = rounded(row["value"], "%" if row["unit"] == "1" else row["unit"])
        stated = f"{with_symbols(row['what'])} {size}"
        if row["from"] == "assumed":
            assumed.append(stated)
        else:
            count = row["recordings"]
            shown.append(f"{stated} ({count} recording{'' if count == 1 else 's'} {SOURCES[row['from']]})")
    parts = [f"estimated: {', '.join(shown)}"] * bool(shown) + [f"assumed: {', '.join(assumed)}"] * bool(assumed)
    return f"Standard deviations that count as noise, {'; '.join(parts)}."


def _caution(report: Mapping, errors: Mapping[str, Mapping[str, float]]) -> str | None:
    """Why a model agrees although some cells of the map are yellow; None where none is, or where it does not agree."""
    high = [
        f"{SYMBOL[channel]} {phase} ({value:.1f})"
        for channel, phases in errors.items()
        for phase, value in phases.items()
        if value > CONSPICUOUS
    ]
    if report["verdict"] != "agrees" or not high:
        return None
    square = report["fit"]["mean_square"]["calibrated"]
    return (
        f"The verdict is 'agrees' although {', '.join(high)} exceed{'s' if len(high) == 1 else ''} the noise floor. The"
        " floor is a mean over the whole motion, while differences between runs (friction, the drive's position between"
        " two counts) concentrate in parts of it. The verdict counts what these differences do not account for: the"
        f" mean square of the whitened residuals is {square:.2g} (1 is noise), and every candidate is less probable."
    )


def candidates_of(found: Diagnosis) -> list[dict]:
    """Baseline and all candidates, a row each, those with the smallest mean squares first."""
    j = found.judgement
    ranked = sorted(zip(j.candidates, j.probability, strict=True), key=lambda item: item[0].mean_square)
    return [
        {
            "candidate": str(fit.hypothesis),
            "mean_square": fit.mean_square,
            "lack_of_fit": j.comparison.evidence[fit.hypothesis].size,
            "probability": p,
            "why": _why(fit, found),
        }
        for fit, p in [(j.calibrated, None), *ranked]
    ]


def _why(fit: CandidateFit, found: Diagnosis) -> str:
    """The reason why a candidate was selected or not."""
    j = found.judgement
    if fit is j.calibrated:
        return "agrees" if found.report["verdict"] == "agrees" else "the baseline"
    if fit is j.best:
        return "the extended model"
    if not fit.is_plausible:
        return "needs implausible values"
    evidence = j.comparison.evidence[fit.hypothesis]
    if evidence.incomplete > max(evidence.exact, evidence.other_law):
        return "something is missing beside it"
    return "less probable"


def _map(found: Diagnosis) -> Figure:
    """Errors over the noise by channel and part of the motion: baseline and, if any, extended model."""
    j = found.judgement
    before = mismatch(found.calibrated, j.whitened)
    highest = max(np.nanmax([list(v.values()) for v in before.values()]), 3.0)
    shown = {_baseline(found.report): before}
    if j.best is not j.calibrated:
        shown[WITH_FOUND] = mismatch(j.best, j.whitened)
    figure, axes = subplots(1, len(shown), figsize=(4 * len(shown), 2.9), sharey=True, squeeze=False)
    for ax, (title, table) in zip(axes[0], shown.items(), strict=True):
        values = np.array([[table[c][p] for p in PHASES] for c in table])
        ax.imshow(values, cmap="cividis", norm=LogNorm(0.7, highest), aspect="auto")
        ax.set_xticks(range(len(PHASES)), PHASES)
        ax.set_yticks(range(len(table)), [SYMBOL[c] for c in table])
        ax.set_title(title, fontsize=9)
        ax.grid(False)
        for (row, column), value in np.ndenumerate(values):
            dark = value < np.sqrt(0.7 * highest)
            text, colour = (f"{value:.1f}", "white" if dark else "black") if np.isfinite(value) else ("none", "black")
            ax.text(column, row, text, ha="center", va="center", color=colour)
    what = error_name(found.report["fit"])
    title_figure(figure, f"{what} (rms), each recording's over its own noise floor", _origin(found))
    stamp_figure(figure, _stamp(found))
    return figure


def _loops(found: Diagnosis) -> Figure:
    """Worst channel of the recordings with the largest errors: measured, baseline, and extended model."""
    j = found.judgement
    chosen = nested_choice(j)
    worst = worst_channel(found.report["fit"]["error"])
    channels = j.whitened[int(np.argmax(j.calibrated.by_recording))].observations.channels
    channel = next((c for c in channels if short_name(c) == worst), channels[0])
    worst_first = np.argsort(j.calibrated.by_recording)[::-1]
    order = [i for i in worst_first if channel in j.whitened[i].observations.channels][:LOOPS]
    scale = TABLE[channel].scale
    figure, axes = subplots(1, len(order), figsize=(3.1 * len(order), 3.1), squeeze=False)
    for ax, i in zip(axes[0], order, strict=True):
        observed = j.whitened[i].observations
        c = observed.channels.index(channel)
        theta = observed.given.theta_in[observed.judged]
        ax.plot(theta, scale * observed.measured[c], color=FAINT, lw=3.0, label=_origin(found))
        # Widths, for whoever does not see the colours: dashes of cycles that lie on one another look solid.
        models = [(found.calibrated, COLOURS[0], 1.8, _baseline(found.report))]
        if chosen[i] is not j.calibrated:
            models.append((chosen[i], COLOURS[1], 0.8, WITH_FOUND))
        if found.report["nearest"] and j.nearest is not None:
            models.append((j.nearest, COLOURS[3], 0.8, f"nearest model, {NOT_ACCEPTED}"))
        for fit, colour, width, label in models:
            ax.plot(theta, scale * fit.held_out(i).modelled({})[c], color=colour, lw=width, label=label)
        ax.set_title(observed.given.recording.id, fontsize=9)
        ax.set_xlabel(TABLE[THETA_IN].axis)
    axes[0][0].set_ylabel(TABLE[channel].axis)
    legend_below(figure, axes[:, :1])
    stamp_figure(figure, _stamp(found))
    return figure


def _law(law: Mapping, found: Diagnosis) -> Figure:
    """The curve of a learned law with its 90 % band, and where the recordings visited its argument."""
    x, y, low, high = np.array(law["curve"]).T
    figure, axes = subplots(1, 1, figsize=(5.2, 3.1), squeeze=False)
    ax = axes[0][0]
    learned = registry.laws()[law["name"]]
    if learned.argument.has_two_values:
        ax.errorbar(x, y, [y - low, high - y], fmt="o", color=COLOURS[1], capsize=4, label="learned law, 90 % interval")
        ax.set_xlim(x[0] - 0.5, x[1] + 0.5)
        ax.set_xticks(x, learned.argument.two_values)
    else:
        ax.fill_between(x, low, high, color=COLOURS[1], alpha=0.25, lw=0, label="90 % band")
        ax.plot(x, y, color=COLOURS[1], lw=1.4, label="learned law")
        if learned.argument is not POSITION:
            _mark_visited(ax, visited(found.judgement.best, learned), x)
    ax.axhline(learned.form.neutral, color=FAINT, lw=1.0, ls="--", label="calibrated model")
    if learned.is_spaced_by_ratio:
        ax.set_xscale("log")
    unit = "" if learned.argument.has_two_values else f" ({law['argument_unit']})"
    ax.set_xlabel(f"{law['argument_is']}{unit}")
    ax.set_ylabel(fill(law["curve_is"], LABEL_LETTERS))
    legend_below(figure, axes)
    stamp_figure(figure, _stamp(found))
    return figure


def _mark_visited(ax: Axes, values: NDArray, x: NDArray) -> None:
    """Marks along the lower edge, each for an equal share of the samples within the range of a curve."""
    within = values[(values >= x[0]) & (values <= x[-1])]
    marked = np.quantile(within, (np.arange(MARKS) + 0.5) / MARKS)
    label = f"recorded: a mark for each {100 / MARKS:g} % of the samples"
    ax.plot(
        marked, np.full(MARKS, 0.03), "|", color="0.3", ms=7, mew=0.7, transform=ax.get_xaxis_transform(), label=label
    )


def _origin(found: Diagnosis) -> str:
    """Whether the recordings were measured, in words; a batch has one origin."""
    return ORIGIN[found.judgement.whitened[0].observations.given.recording.origin]


def _stamp(found: Diagnosis) -> str:
    """The line in the corner of a figure; the report stands for the settings, which it follows from."""
    recordings = [w.observations.given.recording for w in found.judgement.whitened]
    return stamp("ccmodel.studies.diagnosis.run", recordings, found.report)


def _encoded(figure: Figure) -> str:
    buffer = io.BytesIO()
    print_figure(figure, buffer, "png", 130)
    return base64.b64encode(buffer.getvalue()).decode()
