"""Estimates of a real instrument's jaw from its drive's side, beside a regressor with memory; whole trials held out.

The mechanisms of a diagnosed model are refitted without some trials, and the load of these is estimated from drive
angle and drive torque alone, as `ccmodel estimate` does, without a law of the load. Held out are whole trials, each
level of the load and each rate being seen in others (``trials``), or all trials of a load level (``load_level``).

The regressor is gradient boosting (`real_regressor`) from drive angle and drive torque with their past, with the same
trials held out. Its settings are chosen by cross-validation within the training trials.

    python benchmarks/real_estimate.py results/real/diagnoses/Tool_4_Maryland_L_2/nearest.json \
        results/real/raw/Tool_4_Maryland_L_2
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from real_model import CONFIG
from real_regressor import SETTINGS, STEP_S, _fitted, _mean_squares, features, folds, rms
from scipy.signal import butter, sosfiltfilt

from ccmodel.config import load_config
from ccmodel.diagnosis.calibration import calibration
from ccmodel.diagnosis.candidate import fit
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.observations import first_cycles
from ccmodel.diagnosis.whitening import whiten
from ccmodel.inference.observations import Observations
from ccmodel.inference.pool import each
from ccmodel.inverse.estimate import VISIBLE, Estimated, estimated
from ccmodel.inverse.proximal import Proximal
from ccmodel.model.files import read_model_file
from ccmodel.model.model_input import ModelInput
from ccmodel.model.parameters import Parameters
from ccmodel.recording import Recording
from ccmodel.rig.ingest import ingest_batch

TARGETS = ("tau_out_Nm", "theta_out_rad")
HELD_OUT = ("trials", "load_level")
CLOSING_RAD_PER_S = 0.25
# Trials of one fold: each rate and each level once at most.
FOLDS = 5


def held_out_masks(recordings: Sequence[Recording], held_out: str) -> list[NDArray]:
    """Which recordings each fold holds out."""
    if held_out != "trials":
        return [out for _, out in folds(recordings, held_out)]
    ranks = [
        np.unique([r.excitation[v] for r in recordings], return_inverse=True)[1] for v in ("frequency_Hz", "load_level")
    ]
    return [(ranks[0] + ranks[1]) % FOLDS == k for k in range(FOLDS)]


def judged(recording: Recording) -> NDArray:
    """Whether each sample is after the rest and the start-up, shape (n,)."""
    return recording.time_s >= max(recording.settled_s, recording.rest_s)


def is_closing(recording: Recording) -> NDArray:
    """Whether each sample is of a closing stroke, as O'Neill and others select them.

    The jaw closes at more than 0.25 rad/s after a third-order low-pass at 50 Hz without delay; the first and the last
    second are left out.
    """
    angle = sosfiltfilt(butter(3, 50.0, fs=recording.rate_Hz, output="sos"), recording["theta_out_rad"])
    speed, time_s = np.gradient(angle, recording.time_s), recording.time_s
    return (speed > CLOSING_RAD_PER_S) & (time_s > time_s[0] + 1.0) & (time_s < time_s[-1] - 1.0)


def by_model(batch: Path, model_file: Path, held_out: str) -> list[Estimated]:
    """By recording, the estimate of its load by a model that was fitted to others, with the diagnosis's tolerances."""
    ingested = ingest_batch(batch)
    stated = load_config(CONFIG).diagnosing
    tolerances = {"tolerance": stated.tolerance["tau_in_Nm"], "angle_tolerance": stated.tolerance["theta_out_rad"]}
    model = read_model_file(model_file).parameters
    estimates = Parameters.estimated(ingested.batch.rig)
    short = [first_cycles(r, stated.cycles) for r in ingested.recordings]
    fitted = [Observations.of(r, estimates, step_s=STEP_S, tolerance=stated.tolerance) for r in short]
    hypothesis = Hypothesis(tuple((m.name, m.place) for m in model.mechanisms))
    free = calibration(fitted[0].parameters, fitted)
    start = {name: model.value_of(name) for name in free}
    start |= {f"{m.name}/{m.place}/{k}": v for m in model.mechanisms for k, v in m.values.items()}
    whitened = each(fitted, lambda i, e: whiten(e, replace(model, mechanisms=())))
    found: list = [None] * len(fitted)
    for out in held_out_masks(ingested.recordings, held_out):
        training = [w for w, is_out in zip(whitened, out, strict=True) if not is_out]
        solution = fit(training, hypothesis, free, start)
        parameters = hypothesis.of(fitted[0].parameters).with_values(solution.values)
        sds = dict(zip(solution.values, np.sqrt(np.diag(solution.covariance)), strict=True))
        for i in np.flatnonzero(out):
            found[i] = _as_read(estimated(ingested.recordings[i], parameters, sds, **tolerances), parameters)
    return found


def _as_read(found: Estimated, parameters: Parameters) -> Estimated:
    """An estimate as the torque sensor at the load, whose zero the model was fitted with, would read it."""
    torques = [name for name in found.table if name.startswith("tau_out")]
    return replace(found, table=found.table.assign(**(found.table[torques] + parameters.tau_out_zero_Nm)))


def by_regressor(batch: Path, channel: str, held_out: str) -> list[NDArray]:
    """By recording, the regressor's prediction every `STEP_S`, shape (samples,)."""
    recordings = ingest_batch(batch).recordings
    X, y = [], []
    for recording in recordings:
        given = ModelInput.of(recording)
        every = max(1, round(STEP_S * recording.rate_Hz))
        # What the drive feels stands in the place of the load's torque, which the regressor is to find.
        seen = replace(given, theta_in=Proximal.of(recording).theta_in, tau_out=recording["tau_in_Nm"])
        X.append(features(seen)[judged(recording)][::every])
        y.append(_about_mean(recording[channel], recording, channel)[judged(recording)][::every])
    predicted: list = [None] * len(recordings)
    for out in held_out_masks(recordings, held_out):
        training = np.flatnonzero(~out)
        inner = [mask[training] for mask in held_out_masks(recordings, held_out) if mask[training].any()]
        mean_squares = [_mean_squares(settings, X, y, training, inner) for settings in SETTINGS]
        best = int(np.argmin([m.min() for m in mean_squares]))
        model = _fitted(SETTINGS[best], X, y, training, 1 + int(mean_squares[best].argmin()))
        for i in np.flatnonzero(out):
            predicted[i] = model.predict(X[i]) - y[i]
    return predicted


def _about_mean(values: NDArray, recording: Recording, channel: str) -> NDArray:
    """A target; an angle about its mean, since its encoder has no absolute zero."""
    return values - values[judged(recording)].mean() if channel.startswith("theta") else values


def rows(batch: Path, model_file: Path, with_regressor: bool) -> list[dict]:
    """A row for each channel and way of holding out: errors of the estimate and of the regressor."""
    found = []
    for held_out in HELD_OUT:
        estimates = by_model(batch, model_file, held_out)
        for channel in TARGETS:
            errors, inside, closing, visible = [], [], [], []
            for one in estimates:
                r, table = one.recording, one.table
                use = judged(r)
                estimate = _about_mean(table[channel].to_numpy(), r, channel)
                shift = estimate - table[channel].to_numpy()
                true = _about_mean(r[channel], r, channel)
                errors.append((estimate - true)[use])
                inside.append(
                    ((table[f"{channel}_low"] + shift <= true) & (true <= table[f"{channel}_high"] + shift))[use]
                )
                if (chosen := use & is_closing(r)).any():
                    closing.append((estimate - true)[chosen])
                visible.append((estimate - true)[use & table[VISIBLE].to_numpy()])
            row = {
                "batch": batch.name,
                "channel": channel,
                "held_out": held_out,
                "rms": rms(errors),
                "rms_closing": rms(closing),
                "rms_visible": rms(visible),
                "share_within": float(np.mean([i.mean() for i in inside])),
                "by_recording": {e.recording.id: rms([x]) for e, x in zip(estimates, errors, strict=True)},
            }
            if with_regressor:
                row["rms_regressor"] = rms(by_regressor(batch, channel, held_out))
            print(_line(row), flush=True)
            found.append(row)
    return found


def _line(row: dict) -> str:
    scale, unit = (1e3, "mN m") if row["channel"].startswith("tau") else (180 / np.pi, "deg")
    parts = [f"{name} {scale * row[key]:.3g}" for key, name in _NAMES.items() if key in row]
    share = f"{100 * row['share_within']:.0f} % within the interval"
    return f"{row['channel']}, other {row['held_out']}: {', '.join(parts)} {unit}; {share}"


_NAMES = {
    "rms": "rms",
    "rms_closing": "on closing strokes",
    "rms_visible": "where the load shows",
    "rms_regressor": "regressor",
}


def main() -> None:
    """Print the errors of the estimates, and of the regressor unless it is left out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path, help="model file of a diagnosis")
    parser.add_argument("batch", type=Path, help="the imported batch of that diagnosis")
    parser.add_argument("--no-regressor", action="store_true", help="leave the regressor out")
    parser.add_argument("--out", type=Path, help="JSON file that gets the rows")
    arguments = parser.parse_args()
    found = rows(arguments.batch, arguments.model, not arguments.no_regressor)
    if arguments.out:
        arguments.out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
