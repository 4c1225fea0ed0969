"""Cross-validated errors of a black-box regressor with memory on measured recordings, a reference for the model.

Gradient boosting learns each measured channel from the inputs of the model: drive angle and load torque, now and
earlier, the drive's speed and direction, and its travel since the last reversal. It contains no physics. With --ahead
it also gets later inputs, as a simulation of the whole motion does. All recordings of one load level, or of one
frequency, are held out in turn. The settings are chosen by cross-validation in the same way on the other recordings.

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

from ccmodel.diagnosis.drive import since_reversal, speed
from ccmodel.model.run import ModelInput
from ccmodel.recording import Recording
from ccmodel.rig.ingest import ingest_batch

STEP_S = 0.04
LAGS_S = (0.04, 0.08, 0.16, 0.32, 0.64, 1.28)
VARIED = ("load_level", "frequency_Hz")
TARGETS = ("tau_in_Nm", "theta_out_rad")
# Searched settings: leaves of a tree and samples of a leaf; the number of trees is searched up to MOST_TREES.
SETTINGS = [
    {"max_leaf_nodes": leaves, "min_samples_leaf": least, "learning_rate": 0.1}
    for leaves, least in product((6, 20), (20, 80))
]
MOST_TREES = 300
SEED = 0
# The encoder does not resolve a reversal within its count. Samples so many counts away are not affected.
COUNTS = 2


def features(given: ModelInput, ahead: bool = False) -> NDArray:
    """Features of every sample from present and past inputs, with `ahead` also from later ones; shape (n, features)."""
    theta, torque, time_s = given.theta_in, given.tau_out, given.recording.time_s
    omega = speed(given)
    travel, since_s = since_reversal(given)
    lags = (*LAGS_S, *(-lag for lag in LAGS_S)) if ahead else LAGS_S
    lagged = [_earlier(values, time_s, lag) - values for values in (theta, torque) for lag in lags]
    other_speeds = [_earlier(omega, time_s, lag) for lag in lags]
    until_reversal = _until_reversal(given) if ahead else ()
    return np.column_stack(
        [theta, omega, np.sign(omega), travel, since_s, torque, *lagged, *other_speeds, *until_reversal]
    )


def _earlier(values: NDArray, time_s: NDArray, lag: float) -> NDArray:
    return np.interp(time_s - lag, time_s, values)


def target(given: ModelInput, channel: str) -> NDArray:
    """Target of every sample, shape (n,). An angle is taken about its mean, since its encoder has no absolute zero."""
    values, judged = given.recording[channel], is_judged(given)
    return values - values[judged].mean() if channel.startswith("theta") else values


def is_judged(given: ModelInput) -> NDArray:
    """Whether each sample is after the rest and the start-up, shape (n,)."""
    return given.recording.time_s >= max(given.recording.settled_s, given.recording.rest_s)


def is_resolved(given: ModelInput) -> NDArray:
    """Whether each sample is more than `COUNTS` encoder counts from the last and the next reversal, shape (n,)."""
    since, until = (np.abs(t) for t in (since_reversal(given)[0], _until_reversal(given)[0]))
    return np.minimum(since, until) > COUNTS * given.recording.encoder_step_rad["theta_in_rad"]


def _until_reversal(given: ModelInput) -> tuple[NDArray, NDArray]:
    """Travel (rad) and time (s) until the next reversal, each of shape (n,)."""
    recording = given.recording
    without_channels = recording.with_channels({}, {}, "model")
    backwards = replace(
        given, recording=replace(without_channels, time_s=-recording.time_s[::-1]), theta_in=given.theta_in[::-1]
    )
    travel, until_s = since_reversal(backwards)
    return travel[::-1], until_s[::-1]


def folds(recordings: Sequence[Recording], varied: str) -> Iterator[tuple[float, NDArray]]:
    """Every value of a varied condition, and which recordings have it."""
    values = np.array([r.excitation[varied] for r in recordings])
    for value in np.unique(values):
        yield float(value), values == value


def held_out(inputs: Sequence[ModelInput], channel: str, varied: str, ahead: bool = False) -> list[NDArray]:
    """By recording, predicted minus measured, fitted without all recordings of the same value; shapes (samples,)."""
    recordings = [g.recording for g in inputs]
    X = [features(g, ahead)[is_judged(g)] for g in inputs]
    y = [target(g, channel)[is_judged(g)] for g in inputs]
    errors: list = [None] * len(inputs)
    for _, out in folds(recordings, varied):
        training = np.flatnonzero(~out)
        groups = [where[training] for _, where in folds(recordings, varied) if where[training].any()]
        # If only one value remains, single recordings are held out in the search.
        groups = groups if len(groups) > 1 else list(np.eye(training.size, dtype=bool))
        mean_squares = [_mean_squares(settings, X, y, training, groups) for settings in SETTINGS]
        best = int(np.argmin([m.min() for m in mean_squares]))
        model = _fitted(SETTINGS[best], X, y, training, 1 + int(mean_squares[best].argmin()))
        for i in np.flatnonzero(out):
            errors[i] = model.predict(X[i]) - y[i]
    return errors


def _mean_squares(settings: dict, X, y, training: NDArray, groups: Sequence[NDArray]) -> NDArray:
    """Cross-validated mean square by number of trees, with each group of the training recordings held out in turn."""
    found = []
    for group in groups:
        model = _fitted(settings, X, y, training[~group], MOST_TREES)
        for i in training[group]:
            found.append([np.mean((predicted - y[i]) ** 2) for predicted in model.staged_predict(X[i])])
    return np.mean(found, axis=0)


def _fitted(settings: dict, X, y, which: NDArray, trees: int) -> HistGradientBoostingRegressor:
    model = HistGradientBoostingRegressor(**settings, max_iter=trees, early_stopping=False, random_state=SEED)
    return model.fit(np.concatenate([X[i] for i in which]), np.concatenate([y[i] for i in which]))


def yardstick(batch: Path, ahead: bool = False) -> list[dict]:
    """One row for each channel and held-out condition: rms error, and the median peak to peak of the recordings."""
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
    """Root mean square of errors, with equal weight for every recording."""
    return float(np.sqrt(np.mean([np.mean(e**2) for e in errors])))


def main() -> None:
    """Print the cross-validated errors of every batch named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("batches", nargs="+", type=Path, help="folders written by `ccmodel import-mis-tool`")
    parser.add_argument("--out", type=Path, help="JSON file that gets the rows")
    parser.add_argument("--ahead", action="store_true", help="include later inputs in the features")
    arguments = parser.parse_args()
    rows = []
    for batch in arguments.batches:
        for row in yardstick(batch, arguments.ahead):
            unit = "mN m" if row["channel"].startswith("tau") else "mrad"
            share = 100 * row["rms"] / row["peak_to_peak"]
            print(
                f"{row['batch']}  {row['channel']}  other {row['held_out']}: {1e3 * row['rms']:.2f} {unit},"
                f" {share:.2f} % of peak to peak ({1e3 * row['rms_away_from_turns']:.2f} away from reversals)",
                flush=True,
            )
            rows.append(row)
    if arguments.out:
        arguments.out.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
