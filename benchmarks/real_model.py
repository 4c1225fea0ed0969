"""What a diagnosis names, against the yardstick: the same recordings held out, the model refitted to the others.

The model of a diagnosis is refitted without all recordings of one load level, then of one rate, and says what the
sensors would have read there. Refits start from the values of all recordings together: which valley of the errors is
the right one is not asked again.

    python benchmarks/real_model.py results/real/diagnoses/Tool_4_Maryland_L_2/nearest.json \
        results/real/raw/Tool_4_Maryland_L_2 --yardstick yardstick.json --figure held-out.png
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from real_regressor import COUNTS, STEP_S, TARGETS, VARIED, folds, is_resolved, rms

from ccmodel.config import load_config
from ccmodel.diagnose.candidate import fit
from ccmodel.diagnose.diagnosis import calibration, first_cycles
from ccmodel.diagnose.hypothesis import Hypothesis
from ccmodel.diagnose.whitening import weigh
from ccmodel.inference.observations import Observations
from ccmodel.inference.pool import each
from ccmodel.model.files import read_model
from ccmodel.model.parameters import Parameters
from ccmodel.rig.ingest import ingest_batch

AROUND = 0.12  # Of a cycle, to either side of a turn: what is drawn of it.
CONFIG = Path(__file__).parents[1] / "config" / "real.yaml"


def held_out(
    fitted: Sequence[Observations], observations: Sequence[Observations], model: Parameters, varied: str
) -> list[NDArray]:
    """By recording, what the model errs by with values from those that do not share its load level or its rate.

    It is fitted to as much of them as a diagnosis takes, and judged on all of the others.
    """
    hypothesis = Hypothesis(tuple((m.name, m.place) for m in model.mechanisms))
    free = calibration(observations[0].parameters, observations)
    start = {name: model.value_of(name) for name in free}
    start |= {f"{m.name}/{m.place}/{k}": v for m in model.mechanisms for k, v in m.values.items()}
    weighed = each(fitted, lambda i, e: weigh(e, replace(model, mechanisms=())))
    errors: list = [None] * len(observations)
    for _, out in folds([e.given.recording for e in observations], varied):
        known = [w for w, aside in zip(weighed, out, strict=True) if not aside]
        values = fit(known, hypothesis, free, start).values
        for i in np.flatnonzero(out):
            e = replace(observations[i], parameters=hypothesis.of(observations[i].parameters))
            errors[i] = e.modelled(values) - e.measured
    return errors


def rows(batch: Path, model_file: Path) -> tuple[list[dict], list[Observations], dict]:
    """One row for each channel and each thing held out, as the yardstick has them; what they rest on."""
    ingested = ingest_batch(batch)
    stated = load_config(CONFIG).diagnosing
    model = read_model(model_file)
    estimates = Parameters.estimated(ingested.batch.rig)
    observations = [Observations.of(r, estimates, step_s=STEP_S) for r in ingested.recordings]
    short = [first_cycles(r, stated.cycles) for r in ingested.recordings]
    fitted = [Observations.of(r, estimates, step_s=STEP_S, tolerance=stated.tolerance) for r in short]
    by_varied = {varied: held_out(fitted, observations, model, varied) for varied in VARIED}
    found = []
    for channel, varied in product(TARGETS, VARIED):
        errors = [e[observations[0].channels.index(channel)] for e in by_varied[varied]]
        away = [e[is_resolved(v.given)[v.judged]] for e, v in zip(errors, observations, strict=True)]
        found.append(
            {
                "batch": batch.name,
                "channel": channel,
                "held_out": varied,
                "rms": rms(errors),
                "rms_away_from_turns": rms(away),
                "by_recording": {v.given.recording.id: rms([e]) for v, e in zip(observations, errors, strict=True)},
            }
        )
    return found, observations, by_varied


def draw(file: Path, observations: Sequence[Observations], errors: Sequence[NDArray]) -> None:
    """Drive torque over drive angle and, at a turn, over time: slowest and fastest, at the least and the most load."""

    def key(i):
        x = observations[i].given.recording.excitation
        return x["load_level"], x["frequency_Hz"]

    order = sorted(range(len(observations)), key=key)
    loads = sorted({key(i)[0] for i in order})
    shown = [i for load in (loads[0], loads[-1]) for i in _ends([i for i in order if key(i)[0] == load])]
    figure, (loops, turns) = plt.subplots(2, 4, figsize=(13, 6.4), sharey=True)
    for loop, turn, i in zip(loops, turns, shown, strict=True):
        e = observations[i]
        c = e.channels.index("tau_in_Nm")
        theta = e.given.theta_in[e.judged]
        after_s, window, stands = _turn(e, 1 / key(i)[1])
        for label, torque, style in (
            ("recording (measured)", e.measured[c], {"color": "#9a9a9a", "lw": 2.2}),
            ("model, held out", e.measured[c] + errors[i][c], {"lw": 1.0}),
        ):
            loop.plot(theta, 1e3 * torque, label=label, **style)
            turn.plot(after_s, 1e3 * torque[window], marker=".", **style)
        turn.axvspan(*after_s[stands][[0, -1]], color="#e69f00", alpha=0.2, lw=0, label="the drive stands")
        loop.set_title(f"load level {key(i)[0]:g}, {key(i)[1]:g} Hz", fontsize=9)
        loop.set_xlabel("drive angle (rad)")
        turn.set_xlabel("time about a turn (s)")
    for ax in (loops[0], turns[0]):
        ax.set_ylabel("drive torque (mN m)")
        ax.legend(fontsize=7, loc="lower left")
    figure.tight_layout()
    figure.savefig(file, dpi=110)


def _turn(e: Observations, period_s: float) -> tuple[NDArray, NDArray, NDArray]:
    """Time (s) about the furthest turn, the judged samples that it is, and at which of these the drive stands."""
    theta, time_s = e.given.theta_in[e.judged], e.given.recording.time_s[e.judged]
    well_in = (time_s > time_s[0] + period_s / 4) & (time_s < time_s[-1] - period_s / 4)
    stands = theta > theta[well_in].max() - COUNTS * e.given.recording.encoder_step_rad["theta_in_rad"]
    turned = np.flatnonzero(well_in & stands)
    first = turned[: 1 + int(np.argmax(np.diff(turned, append=turned[-1] + theta.size) > 1))]
    middle = time_s[first].mean()
    window = np.flatnonzero(np.abs(time_s - middle) < AROUND * period_s)
    return time_s[window] - middle, window, np.isin(window, first)


def _ends(items: list) -> tuple:
    return items[0], items[-1]


def main() -> None:
    """Print what the model leaves, and its ratio to the yardstick's where that is given."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path, help="a model file of a diagnosis")
    parser.add_argument("batch", type=Path, help="the imported batch that it is of")
    parser.add_argument("--yardstick", type=Path, help="what real_regressor.py wrote with --out")
    parser.add_argument("--figure", type=Path, help="draw held-out loops here")
    asked = parser.parse_args()
    yardstick = json.loads(asked.yardstick.read_text()) if asked.yardstick else []
    found, observations, errors = rows(asked.batch, asked.model)
    for row in found:
        same = ("batch", "channel", "held_out")
        its = next((y for y in yardstick if all(y[k] == row[k] for k in same)), None)
        unit = "mN m" if row["channel"].startswith("tau") else "mrad"
        text = f"{row['batch']}  {row['channel']}  other {row['held_out']}: {1e3 * row['rms']:.2f} {unit}"
        text += f" ({1e3 * row['rms_away_from_turns']:.2f} away from turns)"
        if its:
            everywhere, away = (row[k] / its[k] for k in ("rms", "rms_away_from_turns"))
            text += f", {everywhere:.2f} times the yardstick ({away:.2f} away from turns)"
        print(text, flush=True)
    if asked.figure:
        draw(asked.figure, observations, errors["load_level"])


if __name__ == "__main__":
    main()
