"""The page of a diagnosis: one sentence, the rig with the guilty place lit, and what it rests on."""

import base64
import io
from collections.abc import Sequence
from pathlib import Path

import jinja2
import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from ccmodel import mechanisms as registry
from ccmodel.diagnose.candidate import CandidateFit
from ccmodel.diagnose.diagnosis import Diagnosis
from ccmodel.diagnose.location import PHASES, mismatch
from ccmodel.diagnose.settings import ADEQUATE_LACK_OF_FIT
from ccmodel.diagnose.verdict import nested_choice
from ccmodel.recording import ORIGIN
from ccmodel.report.figures import AXIS, COLOURS, STYLE

LOOPS = 3
RIVALS = 8
FAINT = "#9a9a9a"
WITH_FOUND = "with what was found"
SYMBOL = {"theta_out": "θ_out", "tau_in": "τ_in", "tau_out": "τ_out", "F_drive": "F_drive", "F_load": "F_load"}


def _in_question(said: dict) -> str:
    """The model that the recordings are compared with first, in words."""
    return "model given" if said["is_held"] else "calibrated model"


def headline(said: dict) -> str:
    """The one sentence of a diagnosis."""
    batch, error = said["batch"], said["fit"]["error"]
    worst = max(error, key=lambda c: error[c]["before"] / error[c]["noise"])
    e = error[worst]
    fall = f"{e['before'] / e['noise']:.1f} to {e['after'] / e['noise']:.1f} times the noise in {SYMBOL[worst]}"
    left_out, missing = "was left out", "is missing"
    if said["is_held"]:
        left_out, missing = f"has changed since the {_in_question(said)} was fitted", "has changed"
    if said["verdict"] == "agrees":
        return f"{batch}: the {_in_question(said)} agrees with the recordings; nothing {missing} that they could show."
    if said["verdict"] == "explained":
        what = " and ".join(
            f"{registry.get(m['name']).summary} ({m['name']}, {m['place']})" for m in said["mechanisms"]
        )
        return f"{batch}: what {left_out} is {what}; with it the held-out error falls from {fall}."
    if said["verdict"] == "undecided":
        names, together = _placed(said["alternatives"]), _placed(said["likeliest"])
        if len(together) > 1:
            names = [f"{' and '.join(together)} together", *(name for name in names if name not in together)]
        if len(names) == 1:
            return f"{batch}: something {missing}; it may be {names[0]}, of which these recordings cannot make sure."
        return f"{batch}: something {missing}, and these recordings cannot tell {' or '.join(names)} apart."
    place = said["location"]["place"]
    return f"{batch}: something {missing} at the {place}, and no mechanism known here accounts for it."


def _placed(claims: Sequence[dict]) -> list[str]:
    return [f"{claim['name']} at {claim['place']}" for claim in claims]


def write_diagnosis(file: Path, found: Diagnosis) -> None:
    """Write the page, its figures inside it."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ccmodel.report", "."), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    origin = found.judgement.whitened[0].observations.given.recording.origin
    with plt.rc_context(STYLE):
        text = environment.get_template("diagnosis.html.j2").render(
            said=found.report,
            headline=headline(found.report),
            origin=ORIGIN[origin],
            symbol=SYMBOL,
            in_question=_in_question(found.report),
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
            "what": str(trial.hypothesis),
            "left": trial.mean_square,
            "learnable": max(j.lack_of_fit[trial.hypothesis].mean, 0.0) if trial.hypothesis in j.lack_of_fit else None,
            "p": p,
            "why": _why(trial, found),
        }
        for trial, p in rows
    ]


def _why(trial: CandidateFit, found: Diagnosis) -> str:
    """Why a hypothesis was not taken, or that it was."""
    j = found.judgement
    if trial is j.calibrated:
        return "agrees" if found.report["verdict"] == "agrees" else "what is asked about"
    if trial is j.best:
        return "the likeliest"
    if not trial.is_plausible:
        return "only with more of it than there can be"
    if j.comparison.is_adequate(trial):
        if j.single_fault_places and trial.hypothesis.is_pair:
            return f"would do, as would one fault at the {' or '.join(j.single_fault_places)}"
        ratio = trial.mean_square / j.best.mean_square
        return f"would do, but leaves {ratio:.3g} times as much" if ratio > 1 else "would do, but has more unknowns"
    learnable = j.lack_of_fit.get(trial.hypothesis)
    if learnable is not None and learnable.lower_bound > ADEQUATE_LACK_OF_FIT:
        return "what it leaves follows laws that it does not know"
    return "others leave less"


def _map(found: Diagnosis) -> Figure:
    """Errors over the noise, channel by part of the motion, before and, where something was found, after."""
    j = found.judgement
    before = mismatch(j.whitened, j.calibrated)
    highest = max(np.nanmax([list(v.values()) for v in before.values()]), 3.0)
    shown = {_in_question(found.report): before}
    if j.best is not j.calibrated:
        shown[WITH_FOUND] = mismatch(j.whitened, j.best)
    figure, axes = plt.subplots(1, len(shown), figsize=(4 * len(shown), 2.9), sharey=True, squeeze=False)
    for ax, (title, table) in zip(axes[0], shown.items(), strict=True):
        values = np.array([[table[c][p] for p in PHASES] for c in table])
        ax.imshow(values, cmap="cividis", norm=matplotlib.colors.LogNorm(0.7, highest), aspect="auto")
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
    """Torque loops of the recordings that were off most, before and after, held out."""
    j = found.judgement
    chosen = nested_choice(j)
    channel = _worst_channel(found)
    order = [i for i in np.argsort(j.calibrated.by_recording)[::-1] if channel in j.whitened[i].observations.channels][
        :LOOPS
    ]
    label, scale = AXIS.get(channel, (f"{channel.rsplit('_', 1)[0]} (N)", 1))
    figure, axes = plt.subplots(1, len(order), figsize=(3.1 * len(order), 3.1), squeeze=False)
    for ax, i in zip(axes[0], order, strict=True):
        w = j.whitened[i]
        e = w.observations
        c = e.channels.index(channel)
        theta = e.given.theta_in[e.judged]
        ax.plot(theta, scale * e.measured[c], color=FAINT, lw=2.2, label="recording")
        for trial, colour, line, name in (
            (j.calibrated, COLOURS[0], "--", _in_question(found.report)),
            (chosen[i], COLOURS[1], "-", WITH_FOUND),
        ):
            if name == WITH_FOUND and trial is j.calibrated:
                continue
            said = e.with_parameters(trial.held_out(i, w)).modelled({})[c]
            ax.plot(theta, scale * said, color=colour, lw=1.0, ls=line, label=name)
        ax.set_title(e.given.recording.id, fontsize=9)
        ax.set_xlabel(AXIS["theta_in_rad"][0])
    axes[0][0].set_ylabel(label)
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _worst_channel(found: Diagnosis) -> str:
    error = found.report["fit"]["error"]
    worst = max(error, key=lambda c: error[c]["before"] / error[c]["noise"])
    channels = found.judgement.whitened[int(np.argmax(found.judgement.calibrated.by_recording))].observations.channels
    return next((c for c in channels if c.rsplit("_", 1)[0] == worst), channels[0])


def _encoded(figure: Figure) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=130, format="png")
    plt.close(figure)
    return base64.b64encode(buffer.getvalue()).decode()
