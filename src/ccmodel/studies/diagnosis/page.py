"""The page of a diagnosis: the headline, the rig with the place of the mismatch, and the evidence."""

import base64
import io
from collections.abc import Sequence
from pathlib import Path

import jinja2
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ccmodel import mechanisms as registry
from ccmodel.channels import TABLE, THETA_IN, short_name
from ccmodel.diagnose.candidate import CandidateFit
from ccmodel.diagnose.diagnosis import Diagnosis
from ccmodel.diagnose.location import PHASES, mismatch
from ccmodel.diagnose.settings import ADEQUATE_LACK_OF_FIT
from ccmodel.diagnose.verdict import nested_choice
from ccmodel.recording import ORIGIN
from ccmodel.report.figures import COLOURS, STYLE

LOOPS = 3
RIVALS = 8
FAINT = "#9a9a9a"
WITH_FOUND = "with the mechanisms found"
# By the short names of diagnosis.json.
SYMBOL = {channel.short_name: channel.symbol for channel in TABLE.values()}


def _baseline(said: dict) -> str:
    """The baseline model in words."""
    return "model given" if said["is_held"] else "calibrated model"


def headline(said: dict) -> str:
    """The result of a diagnosis in one sentence."""
    batch, worst = said["batch"], _worst_channel(said)
    e = said["fit"]["error"][worst]
    fall = f"{e['before'] / e['noise']:.1f} to {e['after'] / e['noise']:.1f} times the noise in {SYMBOL[worst]}"
    model, left_out, missing = _baseline(said), "was left out", "is missing"
    if said["is_held"]:
        left_out, missing = f"has changed since the {model} was fitted", "has changed"
    if said["verdict"] == "agrees":
        return f"{batch}: the {model} agrees with the recordings; they show nothing that {missing}."
    if said["verdict"] == "explained":
        names = (f"{registry.get(m['name']).summary} ({m['name']}, {m['place']})" for m in said["mechanisms"])
        return f"{batch}: {' and '.join(names)} {left_out}; in the model, it lowers the held-out error from {fall}."
    if said["verdict"] == "undecided":
        names, together = _placed(said["alternatives"]), _placed(said["likeliest"])
        if len(together) > 1:
            names = [f"{' and '.join(together)} together", *(name for name in names if name not in together)]
        if len(names) == 1:
            return f"{batch}: something {missing}; it may be {names[0]}, but these recordings do not confirm it."
        return f"{batch}: something {missing}, and these recordings cannot tell {' or '.join(names)} apart."
    place = said["location"]["place"]
    return f"{batch}: something {missing} at the {place}, and no known mechanism explains it."


def _placed(claims: Sequence[dict]) -> list[str]:
    return [f"{claim['name']} at {claim['place']}" for claim in claims]


def write_diagnosis(file: Path, found: Diagnosis) -> None:
    """Write the page with its figures inside."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ccmodel.studies.diagnosis", "."),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    origin = found.judgement.whitened[0].observations.given.recording.origin
    with plt.rc_context(STYLE):
        text = environment.get_template("page.html.j2").render(
            said=found.report,
            headline=headline(found.report),
            origin=ORIGIN[origin],
            symbol=SYMBOL,
            baseline=_baseline(found.report),
            has_found=found.judgement.best is not found.judgement.calibrated,
            rivals=_rivals(found),
            listed=found.judgement.well_specified,
            summaries={name: registry.get(name) for name in registry.names()},
            map=_encoded(_map(found)),
            loops=_encoded(_loops(found)),
            recordings=[w.observations.given.recording.id for w in found.judgement.whitened],
        )
    file.write_text(text, encoding="utf-8")


def _rivals(found: Diagnosis) -> list[dict]:
    j = found.judgement
    ranked = sorted(zip(j.candidates, j.probability, strict=True), key=lambda item: item[0].mean_square)
    rows = [(j.calibrated, None), *ranked[:RIVALS]]
    return [
        {
            "what": str(candidate.hypothesis),
            "left": candidate.mean_square,
            "learnable": max(lack.mean, 0.0) if (lack := j.lack_of_fit.get(candidate.hypothesis)) else None,
            "p": p,
            "why": _why(candidate, found),
        }
        for candidate, p in rows
    ]


def _why(candidate: CandidateFit, found: Diagnosis) -> str:
    """The reason why a candidate was selected or not."""
    j = found.judgement
    if candidate is j.calibrated:
        return "agrees" if found.report["verdict"] == "agrees" else "the baseline"
    if candidate is j.best:
        return "most probable"
    if not candidate.is_plausible:
        return "needs implausible values"
    if j.comparison.is_adequate(candidate):
        if j.single_fault_places and candidate.hypothesis.is_pair:
            return f"adequate, but one fault at the {' or '.join(j.single_fault_places)} is as adequate"
        ratio = candidate.mean_square / j.best.mean_square
        return f"adequate, with {ratio:.3g} times the mean square" if ratio > 1 else "adequate, with more parameters"
    lack = j.lack_of_fit.get(candidate.hypothesis)
    if lack is not None and lack.lower_bound > ADEQUATE_LACK_OF_FIT:
        return "lack of fit"
    return "others have a smaller mean square"


def _map(found: Diagnosis) -> Figure:
    """Errors over the noise by channel and part of the motion: baseline and, if any, with the mechanisms found."""
    j = found.judgement
    before = mismatch(j.whitened, j.calibrated)
    highest = max(np.nanmax([list(v.values()) for v in before.values()]), 3.0)
    shown = {_baseline(found.report): before}
    if j.best is not j.calibrated:
        shown[WITH_FOUND] = mismatch(j.whitened, j.best)
    figure, axes = plt.subplots(1, len(shown), figsize=(4 * len(shown), 2.9), sharey=True, squeeze=False)
    for ax, (title, table) in zip(axes[0], shown.items(), strict=True):
        values = np.array([[table[c][p] for p in PHASES] for c in table])
        ax.imshow(values, cmap="cividis", norm=LogNorm(0.7, highest), aspect="auto")
        ax.set_xticks(range(len(PHASES)), PHASES)
        ax.set_yticks(range(len(table)), [SYMBOL[c] for c in table])
        ax.set_title(title, fontsize=9)
        ax.grid(False)
        for (row, column), value in np.ndenumerate(values):
            dark = value < np.sqrt(0.7 * highest)
            ax.text(column, row, f"{value:.1f}", ha="center", va="center", color="white" if dark else "black")
    figure.suptitle("rms error on held-out recordings, in units of the noise", fontsize=9)
    return figure


def _loops(found: Diagnosis) -> Figure:
    """Worst channel of the recordings with the largest errors: measured, baseline, and with the mechanisms found."""
    j = found.judgement
    chosen = nested_choice(j)
    worst = _worst_channel(found.report)
    channels = j.whitened[int(np.argmax(j.calibrated.by_recording))].observations.channels
    channel = next((c for c in channels if short_name(c) == worst), channels[0])
    worst_first = np.argsort(j.calibrated.by_recording)[::-1]
    order = [i for i in worst_first if channel in j.whitened[i].observations.channels][:LOOPS]
    scale = TABLE[channel].scale
    figure, axes = plt.subplots(1, len(order), figsize=(3.1 * len(order), 3.1), squeeze=False)
    for ax, i in zip(axes[0], order, strict=True):
        w = j.whitened[i]
        e = w.observations
        c = e.channels.index(channel)
        theta = e.given.theta_in[e.judged]
        ax.plot(theta, scale * e.measured[c], color=FAINT, lw=2.2, label="recording")
        for candidate, colour, line, name in (
            (j.calibrated, COLOURS[0], "--", _baseline(found.report)),
            (chosen[i], COLOURS[1], "-", WITH_FOUND),
        ):
            if name == WITH_FOUND and candidate is j.calibrated:
                continue
            predicted = e.with_parameters(candidate.held_out(i, w)).modelled({})[c]
            ax.plot(theta, scale * predicted, color=colour, lw=1.0, ls=line, label=name)
        ax.set_title(e.given.recording.id, fontsize=9)
        ax.set_xlabel(TABLE[THETA_IN].axis)
    axes[0][0].set_ylabel(TABLE[channel].axis)
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _worst_channel(said: dict) -> str:
    """Short name of the channel whose baseline error is largest over its noise."""
    error = said["fit"]["error"]
    return max(error, key=lambda c: error[c]["before"] / error[c]["noise"])


def _encoded(figure: Figure) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=130, format="png")
    plt.close(figure)
    return base64.b64encode(buffer.getvalue()).decode()
