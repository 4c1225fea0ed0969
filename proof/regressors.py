"""Reference regressors: black-box models of the calibrated model's residuals, on the same recordings.

Each regressor learns, channel by channel, the residuals of the calibrated model on the batch, from features that every
recording has: the drive's motion and the model's own outputs. It then corrects the calibrated model's predictions of
the held-out recordings. A regressor knows no mechanisms and identifies none, so that only its prediction is compared.
"""

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

from proof.measured import CHANNELS, REST_S, in_si

SAMPLES = 250  # samples of each recording
GP_SAMPLES = 300  # samples of all recordings together; the cost of a Gaussian process grows with their third power
# Speed over which the smoothed sign of the motion changes, rad/s. A sine of 0.6 rad at 0.5 Hz reaches twenty times it.
SIGN_SPEED_RAD_PER_S = 0.1
SMOOTHING_S = 0.05
THRESHOLDS = (0.01, 0.03, 0.1, 0.3)
# Times before a sample at which the regressor with memory knows the drive's angle and speed, s.
LAGS_S = (0.02, 0.04, 0.08, 0.16, 0.32, 0.64)
MEMORY = "memory: "
BOOSTING = {"max_iter": 150, "max_leaf_nodes": 15, "min_samples_leaf": 20, "learning_rate": 0.1, "random_state": 0}
GP_FEATURES = ("theta", "direction", "omega", "tau_in", "F_drive")

Features = dict[str, NDArray]
Correction = Callable[[Features], NDArray]
Regressor = Callable[[Features, NDArray, NDArray], Correction]


def regressors() -> dict[str, Regressor]:
    """Every reference regressor by its name."""
    return {
        "stepwise by BIC": stepwise,
        "sparse regression (pysindy)": sparse,
        "Gaussian process (scikit-learn)": gaussian_process,
        "gradient boosting with memory (scikit-learn)": boosting,
    }


def errors(batch: Path, batch_predictions: Path, held_out: Path, held_out_predictions: Path) -> dict:
    """By regressor and channel, the root mean square error on held-out recordings, in the channel's unit.

    Parameters
    ----------
    batch, held_out : Path
        Folders of recordings: the training set and the test set.
    batch_predictions, held_out_predictions : Path
        Folders with the calibrated model's predictions of them.
    """
    training, test = _recordings(batch, batch_predictions), _recordings(held_out, held_out_predictions)
    recording = np.concatenate([np.full(len(f["theta"]), i) for i, (f, _) in enumerate(training)])
    features = {name: np.concatenate([f[name] for f, _ in training]) for name in training[0][0]}
    found: dict[str, dict[str, float]] = {}
    for name, fit in regressors().items():
        found[name] = {}
        for channel in CHANNELS:
            correction = fit(features, np.concatenate([residuals[channel] for _, residuals in training]), recording)
            squares = [np.mean((residuals[channel] - correction(f)) ** 2) for f, residuals in test]
            found[name][channel] = float(np.sqrt(np.mean(squares)))
    return found


def _recordings(batch: Path, predictions: Path) -> list[tuple[Features, Features]]:
    """Features and residuals of each recording, at `SAMPLES` evenly spaced samples."""
    described = yaml.safe_load((batch / "batch.yaml").read_text(encoding="utf-8"))
    return [_recording(batch, one["id"], predictions / f"{one['id']}.csv") for one in described["recordings"]]


def _recording(batch: Path, name: str, prediction: Path) -> tuple[Features, Features]:
    measured, predicted = in_si(batch, name), pd.read_csv(prediction)
    time_s = measured["time_s"]
    modelled = {c: np.interp(time_s, predicted["time_s"], predicted[c]) for c in (*CHANNELS, "theta_in_rad")}
    residuals = {c: measured[c] - modelled[c] for c in CHANNELS}
    residuals["theta_out_rad"] = residuals["theta_out_rad"] - residuals["theta_out_rad"][time_s < REST_S].mean()
    features = _features(time_s, modelled)
    some = np.linspace(0, time_s.size - 1, min(SAMPLES, time_s.size)).astype(int)
    return {k: v[some] for k, v in features.items()}, {k: v[some] for k, v in residuals.items()}


def _features(time_s: NDArray, modelled: Mapping[str, NDArray]) -> Features:
    """Candidate terms of the regressions, each of shape (samples,)."""
    theta, omega, alpha = _motion(time_s, modelled["theta_in_rad"])
    direction = np.tanh(omega / SIGN_SPEED_RAD_PER_S)
    return {
        "one": np.ones_like(theta),
        "theta": theta,
        "theta^2": theta**2,
        "theta^3": theta**3,
        "sin": np.sin(theta),
        "cos": np.cos(theta),
        "omega": omega,
        "omega |omega|": omega * np.abs(omega),
        "alpha": alpha,
        "direction": direction,
        "direction theta": direction * theta,
        "tau_in": modelled["tau_in_Nm"],
        "tau_out": modelled["tau_out_Nm"],
        "F_drive": modelled["F_drive_N"],
        "F_load": modelled["F_load_N"],
        "direction F_drive": direction * modelled["F_drive_N"],
        "direction F_load": direction * modelled["F_load_N"],
        "omega F_drive": omega * modelled["F_drive_N"],
        "tau_in^2": modelled["tau_in_Nm"] ** 2,
        "tau_in^3": modelled["tau_in_Nm"] ** 3,
        "theta_out": modelled["theta_out_rad"],
        "time": time_s,
        **_memory(time_s, theta, omega),
    }


def _memory(time_s: NDArray, theta: NDArray, omega: NDArray) -> Features:
    """What came before each sample: earlier angles and speeds, travel and time since the last reversal."""
    found = {}
    for lag in LAGS_S:
        found[f"{MEMORY}theta {lag:g} s before"] = np.interp(time_s - lag, time_s, theta) - theta
        found[f"{MEMORY}omega {lag:g} s before"] = np.interp(time_s - lag, time_s, omega)
    reverses = np.flatnonzero(np.diff(np.sign(omega)) != 0) + 1
    last = np.concatenate([[0], reverses])[np.searchsorted(reverses, np.arange(time_s.size), side="right")]
    found[f"{MEMORY}travel since the reversal"] = theta - theta[last]
    found[f"{MEMORY}time since the reversal"] = time_s - time_s[last]
    return found


def _motion(time_s: NDArray, theta: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Angle (rad), rate and acceleration of the drive; each derivative is smoothed once more."""
    width = max(1, int(SMOOTHING_S / (time_s[1] - time_s[0])))
    mean = np.ones(width) / width

    def smooth(values):
        return np.convolve(np.pad(values, (width, width), mode="edge"), mean, mode="same")[width:-width]

    theta = smooth(theta)
    omega = smooth(np.gradient(theta, time_s))
    return theta, omega, smooth(np.gradient(omega, time_s))


def _design(features: Mapping[str, NDArray]) -> tuple[NDArray, Callable[[Mapping[str, NDArray]], NDArray]]:
    """Design matrix of standardised columns, shape (n, features), and the function that makes it of other features."""
    names = [n for n in features if n != "one" and not n.startswith(MEMORY)]
    columns = np.column_stack([features[n] for n in names])
    mean, spread = columns.mean(axis=0), columns.std(axis=0)
    spread[spread == 0] = 1.0

    def design_of(other):
        return np.column_stack([other["one"], (np.column_stack([other[n] for n in names]) - mean) / spread])

    return design_of(features), design_of


def stepwise(features: Features, residuals: NDArray, recording: NDArray) -> Correction:
    """Forward stepwise least squares: terms are added as long as the Bayesian information criterion falls."""
    design, design_of = _design(features)
    n, chosen = residuals.size, [0]

    def criterion(terms):
        weights, *_ = np.linalg.lstsq(design[:, terms], residuals, rcond=None)
        return n * np.log(np.mean((residuals - design[:, terms] @ weights) ** 2)) + len(terms) * np.log(n), weights

    best, weights = criterion(chosen)
    while len(chosen) < design.shape[1]:
        candidates = [(*criterion([*chosen, j]), j) for j in range(design.shape[1]) if j not in chosen]
        value, candidate_weights, j = min(candidates, key=lambda candidate: candidate[0])
        if value >= best:
            break
        best, weights, chosen = value, candidate_weights, [*chosen, j]
    return lambda other: design_of(other)[:, chosen] @ weights


def sparse(features: Features, residuals: NDArray, recording: NDArray) -> Correction:
    """Sequentially thresholded least squares (pysindy's STLSQ).

    The threshold is the one with the least error on every third recording, fitted to the others.
    """
    from pysindy import STLSQ

    design, design_of = _design(features)
    scale = residuals.std() or 1.0

    def weights(rows, threshold):
        fitted = STLSQ(threshold=threshold, alpha=1e-3).fit(design[rows], (residuals[rows] / scale)[:, None])
        return np.asarray(fitted.coef_)[0] * scale

    held_out = recording % 3 == 0
    if held_out.all() or not held_out.any():
        held_out = np.arange(residuals.size) % 3 == 0
    squares = [np.mean((residuals[held_out] - design[held_out] @ weights(~held_out, t)) ** 2) for t in THRESHOLDS]
    final = weights(slice(None), THRESHOLDS[int(np.argmin(squares))])
    return lambda other: design_of(other) @ final


def gaussian_process(features: Features, residuals: NDArray, recording: NDArray) -> Correction:
    """Gaussian process for the model discrepancy (scikit-learn), after Kennedy and O'Hagan (2001).

    M. C. Kennedy and A. O'Hagan, "Bayesian calibration of computer models", J. R. Stat. Soc. B 63 (2001) 425-464,
    doi:10.1111/1467-9868.00294.
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    design, design_of = _design({name: features[name] for name in ("one", *GP_FEATURES)})
    rows = np.random.default_rng(0).permutation(residuals.size)[:GP_SAMPLES]
    kernel = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(np.ones(len(GP_FEATURES)), (0.1, 1e3)) + WhiteKernel(
        1.0, (1e-4, 10)
    )
    scale = residuals.std() or 1.0
    with warnings.catch_warnings():
        # A length scale at its upper bound marks an irrelevant feature; the warning says no more than that.
        warnings.simplefilter("ignore", ConvergenceWarning)
        fitted = GaussianProcessRegressor(kernel, random_state=0).fit(design[rows, 1:], residuals[rows] / scale)
    return lambda other: fitted.predict(design_of(other)[:, 1:]) * scale


def boosting(features: Features, residuals: NDArray, recording: NDArray) -> Correction:
    """Gradient-boosted trees on all features and on the memory of the motion (scikit-learn)."""
    from sklearn.ensemble import HistGradientBoostingRegressor

    names = [name for name in features if name != "one"]
    scale = residuals.std() or 1.0
    fitted = HistGradientBoostingRegressor(**BOOSTING).fit(
        np.column_stack([features[n] for n in names]), residuals / scale
    )
    return lambda other: fitted.predict(np.column_stack([other[n] for n in names])) * scale
