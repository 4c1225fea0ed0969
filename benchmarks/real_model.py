"""Cross-validation of a diagnosed model on measured recordings, compared with a black-box regressor.

The model is refitted without the recordings of one load level, or of one frequency, and predicts the sensors of those.
Each refit starts from the values fitted to all recordings, so that it stays in the same minimum.

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
from ccmodel.diagnosis.calibration import calibration
from ccmodel.diagnosis.candidate import fit
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.observations import first_cycles
from ccmodel.diagnosis.whitening import whiten
from ccmodel.inference.observations import Observations
from ccmodel.inference.pool import each
from ccmodel.model.files import read_model_file
from ccmodel.model.parameters import Parameters
from ccmodel.rig.ingest import ingest_batch

AROUND = 0.12  # Cycles to either side of a reversal that the figure shows.
CONFIG = Path(__file__).parents[1] / "config" / "real.yaml"


def held_out(
    fitted: Sequence[Observations], observations: Sequence[Observations], model: Parameters, varied: str
) -> list[NDArray]:
    """By recording, the model's errors with parameters fitted to recordings of other load levels or frequencies.

    Parameters
    ----------
    fitted : sequence of Observations
        The part of every recording that a diagnosis fits.
    observations : sequence of Observations
        Every recording as a whole.
    model : Parameters
        Mechanisms and starting values.
    varied : str
        The condition that is held out, one value at a time.

    Returns
    -------
    list of ndarray, each of shape (channels, samples)
        Modelled minus measured.
    """
    hypothesis = Hypothesis(tuple((m.name, m.place) for m in model.mechanisms))
    free = calibration(observations[0].parameters, observations)
    start = {name: model.value_of(name) for name in free}
    start |= {f"{m.name}/{m.place}/{k}": v for m in model.mechanisms for k, v in m.values.items()}
    weighed = each(fitted, lambda i, e: whiten(e, replace(model, mechanisms=())))
    errors: list = [None] * len(observations)
    for _, out in folds([e.given.recording for e in observations], varied):
        training = [w for w, is_held_out in zip(weighed, out, strict=True) if not is_held_out]
        values = fit(training, hypothesis, free, start).values
        for i in np.flatnonzero(out):
            e = replace(observations[i], parameters=hypothesis.of(observations[i].parameters))
            errors[i] = e.modelled(values) - e.measured
    return errors


def rows(batch: Path, model_file: Path) -> tuple[list[dict], list[Observations], dict]:
    """One row for each channel and held-out condition, as in `real_regressor`; then the observations and errors."""
    ingested = ingest_batch(batch)
    stated = load_config(CONFIG).diagnosing
    model = read_model_file(model_file).parameters
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
    """Draw drive torque over drive angle, and over time about a reversal.

    Shown are the lowest and the highest frequency at the least and the largest load.
    """

    def key(i):
        x = observations[i].given.recording.excitation
        return x["load_level"], x["frequency_Hz"]

    order = sorted(range(len(observations)), key=key)
    loads = sorted({key(i)[0] for i in order})
    shown = [i for load in (loads[0], loads[-1]) for i in _ends([i for i in order if key(i)[0] == load])]
    figure, (loops, reversals) = plt.subplots(2, 4, figsize=(13, 6.4), sharey=True)
    for loop, reversal, i in zip(loops, reversals, shown, strict=True):
        e = observations[i]
        c = e.channels.index("tau_in_Nm")
        theta = e.given.theta_in[e.judged]
        after_s, window, is_at_rest = _reversal(e, 1 / key(i)[1])
        for label, torque, style in (
            ("recording (measured)", e.measured[c], {"color": "#9a9a9a", "lw": 2.2}),
            ("model, held out", e.measured[c] + errors[i][c], {"lw": 1.0}),
        ):
            loop.plot(theta, 1e3 * torque, label=label, **style)
            reversal.plot(after_s, 1e3 * torque[window], marker=".", **style)
        reversal.axvspan(*after_s[is_at_rest][[0, -1]], color="#e69f00", alpha=0.2, lw=0, label="drive at rest")
        loop.set_title(f"load level {key(i)[0]:g}, {key(i)[1]:g} Hz", fontsize=9)
        loop.set_xlabel("drive angle (rad)")
        reversal.set_xlabel("time from the reversal (s)")
    for ax in (loops[0], reversals[0]):
        ax.set_ylabel("drive torque (mN m)")
        ax.legend(fontsize=7, loc="lower left")
    figure.tight_layout()
    figure.savefig(file, dpi=110)


def _reversal(e: Observations, period_s: float) -> tuple[NDArray, NDArray, NDArray]:
    """Samples about the reversal at the largest drive angle.

    Returns
    -------
    time_s : ndarray
        Time from the reversal, s.
    window : ndarray of int
        The samples, among the judged ones.
    is_at_rest : ndarray of bool
        Whether the drive is within `COUNTS` encoder counts of the reversal.
    """
    theta, time_s = e.given.theta_in[e.judged], e.given.recording.time_s[e.judged]
    is_inner = (time_s > time_s[0] + period_s / 4) & (time_s < time_s[-1] - period_s / 4)
    is_near = theta > theta[is_inner].max() - COUNTS * e.given.recording.encoder_step_rad["theta_in_rad"]
    near = np.flatnonzero(is_inner & is_near)
    first = near[: 1 + int(np.argmax(np.diff(near, append=near[-1] + theta.size) > 1))]
    middle = time_s[first].mean()
    window = np.flatnonzero(np.abs(time_s - middle) < AROUND * period_s)
    return time_s[window] - middle, window, np.isin(window, first)


def _ends(items: list) -> tuple:
    return items[0], items[-1]


def main() -> None:
    """Print the model's cross-validated errors, and their ratio to those of the regressor if given."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path, help="model file of a diagnosis")
    parser.add_argument("batch", type=Path, help="the imported batch of that diagnosis")
    parser.add_argument("--yardstick", type=Path, help="errors of the regressor, as written by real_regressor.py --out")
    parser.add_argument("--figure", type=Path, help="draw cross-validated loops to this file")
    arguments = parser.parse_args()
    yardstick = json.loads(arguments.yardstick.read_text()) if arguments.yardstick else []
    found, observations, errors = rows(arguments.batch, arguments.model)
    for row in found:
        same = ("batch", "channel", "held_out")
        reference = next((y for y in yardstick if all(y[k] == row[k] for k in same)), None)
        unit = "mN m" if row["channel"].startswith("tau") else "mrad"
        text = f"{row['batch']}  {row['channel']}  other {row['held_out']}: {1e3 * row['rms']:.2f} {unit}"
        text += f" ({1e3 * row['rms_away_from_turns']:.2f} away from reversals)"
        if reference:
            everywhere, away = (row[k] / reference[k] for k in ("rms", "rms_away_from_turns"))
            text += f", {everywhere:.2f} times the regressor's ({away:.2f} away from reversals)"
        print(text, flush=True)
    if arguments.figure:
        draw(arguments.figure, observations, errors["load_level"])


if __name__ == "__main__":
    main()
