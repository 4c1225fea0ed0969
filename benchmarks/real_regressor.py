"""The yardstick on measured recordings: what a flexible regressor with memory makes of those it has not seen.

Gradient boosting learns each measured channel from what the model is given too: the drive's angle and the torque at
the load, now and a while ago, the drive's speed and direction, and how far it has gone since it last turned round. No
physics is in it. With --ahead it is told what comes, too, as a model is that runs on the whole motion. All recordings
of one load level, then of one rate, are held out in turn; the settings are searched on the other recordings alone, by
levels held out among these in the same way.

    python benchmarks/real_regressor.py results/real/raw/Tool_4_Maryland_L_2
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingRegressor

from ccmodel.diagnose.drive import since_reversal, speed
from ccmodel.model.run import ModelInput
from ccmodel.recording import Recording
from ccmodel.rig.ingest import ingest_batch

STEP_S = 0.04
LAGS_S = (0.04, 0.08, 0.16, 0.32, 0.64, 1.28)
VARIED = ("load_level", "frequency_Hz")
TARGETS = ("tau_in_Nm", "theta_out_rad")
# Settings that are searched: how many leaves a tree has, how many samples a leaf, and then how many trees.
SETTINGS = [
    {"max_leaf_nodes": leaves, "min_samples_leaf": least, "learning_rate": 0.1}
    for leaves, least in product((6, 20), (20, 80))
]
MOST_TREES = 300
SEED = 0
# A count of the drive's encoder hides where in it the drive turns; so far from there it no longer matters.
COUNTS = 2


def features(given: ModelInput, ahead: bool = False) -> NDArray:
    """What is known of every sample, of what was before it or also of what comes, shape (n, features)."""
    theta, torque, time_s = given.theta_in, given.tau_out, given.recording.time_s
    omega = speed(given)
    travel, since_s = since_reversal(given)
    lags = (*LAGS_S, *(-lag for lag in LAGS_S)) if ahead else LAGS_S
    lagged = [_earlier(values, time_s, lag) - values for values in (theta, torque) for lag in lags]
    other_speeds = [_earlier(omega, time_s, lag) for lag in lags]
    to_come = _until_reversal(given) if ahead else ()
    return np.column_stack([theta, omega, np.sign(omega), travel, since_s, torque, *lagged, *other_speeds, *to_come])


def _earlier(values: NDArray, time_s: NDArray, lag: float) -> NDArray:
    return np.interp(time_s - lag, time_s, values)


def target(given: ModelInput, channel: str) -> NDArray:
    """What is learnt of every sample: an angle, which has no zero of its own here, about its mean; shape (n,)."""
    values, judged = given.recording[channel], is_judged(given)
    return values - values[judged].mean() if channel.startswith("theta") else values


def is_judged(given: ModelInput) -> NDArray:
    """Samples that count, shape (n,)."""
    return given.recording.time_s >= max(given.recording.settled_s, given.recording.rest_s)


def is_resolved(given: ModelInput) -> NDArray:
    """Samples at which the drive has gone some counts since it last turned round and has them to go, shape (n,)."""
    forth, back = (np.abs(t) for t in (since_reversal(given)[0], _until_reversal(given)[0]))
    return np.minimum(forth, back) > COUNTS * given.recording.encoder_step_rad["theta_in_rad"]


def _until_reversal(given: ModelInput) -> tuple[NDArray, NDArray]:
    recording = given.recording
    turned = recording.with_channels({}, {}, "model")
    backwards = replace(given, recording=replace(turned, time_s=-recording.time_s[::-1]), theta_in=given.theta_in[::-1])
    travel, left_s = since_reversal(backwards)
    return travel[::-1], left_s[::-1]


def folds(recordings: Sequence[Recording], varied: str) -> Iterator[tuple[float, NDArray]]:
    """Every value of what was varied, and which recordings have it."""
    values = np.array([r.excitation[varied] for r in recordings])
    for value in np.unique(values):
        yield float(value), values == value


def held_out(inputs: Sequence[ModelInput], channel: str, varied: str, ahead: bool = False) -> list[NDArray]:
    """By recording what the regressor errs by, each predicted without all that share its value."""
    recordings = [g.recording for g in inputs]
    X = [features(g, ahead)[is_judged(g)] for g in inputs]
    y = [target(g, channel)[is_judged(g)] for g in inputs]
    errors: list = [None] * len(inputs)
    for _, out in folds(recordings, varied):
        known = np.flatnonzero(~out)
        groups = [where[known] for _, where in folds(recordings, varied) if where[known].any()]
        # With one value left there is no other to search by; then every recording is by itself.
        groups = groups if len(groups) > 1 else list(np.eye(known.size, dtype=bool))
        searched = [_searched(settings, X, y, known, groups) for settings in SETTINGS]
        best = int(np.argmin([s.min() for s in searched]))
        model = _learnt(SETTINGS[best], X, y, known, 1 + int(searched[best].argmin()))
        for i in np.flatnonzero(out):
            errors[i] = model.predict(X[i]) - y[i]
    return errors


def _searched(settings: dict, X, y, known: NDArray, groups: Sequence[NDArray]) -> NDArray:
    """Mean square by number of trees on the groups, each held out of the known recordings in turn."""
    found = []
    for group in groups:
        model = _learnt(settings, X, y, known[~group], MOST_TREES)
        for i in known[group]:
            found.append([np.mean((said - y[i]) ** 2) for said in model.staged_predict(X[i])])
    return np.mean(found, axis=0)


def _learnt(settings: dict, X, y, which: NDArray, trees: int) -> HistGradientBoostingRegressor:
    model = HistGradientBoostingRegressor(**settings, max_iter=trees, early_stopping=False, random_state=SEED)
    return model.fit(np.concatenate([X[i] for i in which]), np.concatenate([y[i] for i in which]))


def yardstick(batch: Path, ahead: bool = False) -> list[dict]:
    """One row for each channel and each thing held out: rms error, and peak to peak of the typical recording."""
    inputs = [ModelInput.of(r, STEP_S) for r in ingest_batch(batch).recordings]
    rows = []
    for channel, varied in product(TARGETS, VARIED):
        span = float(np.median([np.ptp(g.recording[channel][is_judged(g)]) for g in inputs]))
        errors = held_out(inputs, channel, varied, ahead)
        away = [e[is_resolved(g)[is_judged(g)]] for e, g in zip(errors, inputs, strict=True)]
        rows.append(
            {
                "batch": batch.name,
                "channel": channel,
                "held_out": varied,
                "peak_to_peak": span,
                "rms": rms(errors),
                "rms_away_from_turns": rms(away),
                "by_recording": {g.recording.id: rms([e]) for g, e in zip(inputs, errors, strict=True)},
            }
        )
    return rows


def rms(errors: Sequence[NDArray]) -> float:
    """Root mean square of errors, every recording alike."""
    return float(np.sqrt(np.mean([np.mean(e**2) for e in errors])))


def main() -> None:
    """Print the yardstick of every batch named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("batches", nargs="+", type=Path, help="folders that `ccmodel import-mis-tool` wrote")
    parser.add_argument("--out", type=Path, help="write the rows here, JSON")
    parser.add_argument("--ahead", action="store_true", help="tell it what comes, too")
    asked = parser.parse_args()
    rows = []
    for batch in asked.batches:
        for row in yardstick(batch, asked.ahead):
            unit = "mN m" if row["channel"].startswith("tau") else "mrad"
            share = 100 * row["rms"] / row["peak_to_peak"]
            print(
                f"{row['batch']}  {row['channel']}  other {row['held_out']}: {1e3 * row['rms']:.2f} {unit},"
                f" {share:.2f} % of peak to peak ({1e3 * row['rms_away_from_turns']:.2f} away from turns)",
                flush=True,
            )
            rows.append(row)
    if asked.out:
        asked.out.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
