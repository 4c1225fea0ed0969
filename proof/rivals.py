"""Other ways to what the paper's model leaves, under the same data: how well they predict, and what they can say.

Each learns, channel by channel, what the calibrated model leaves on the batch's recordings from quantities that are
there in any recording to come (the drive's motion and the model's own outputs), and is then held to the recordings that
were kept back. None of them knows mechanisms, so none can name one or its place: of the proof's figures they can be
held to those of prediction alone.
"""

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

from proof.measured import CHANNELS, REST_S, in_si

SAMPLES = 250  # of each recording
GP_SAMPLES = 300  # of all: its cost goes with the third power
# Speed over which the sign of the motion turns, rad/s: a drive of 0.6 rad at 0.5 Hz reaches twenty times that.
TURN_RAD_PER_S = 0.1
SMOOTHING_S = 0.05
THRESHOLDS = (0.01, 0.03, 0.1, 0.3)
GP_QUANTITIES = ("theta", "way", "omega", "tau_in", "F_drive")

Quantities = dict[str, NDArray]
Corrects = Callable[[Quantities], NDArray]
Learns = Callable[[Quantities, NDArray, NDArray], Corrects]


def rivals() -> dict[str, Learns]:
    """Every rival by its name."""
    return {
        "stepwise by BIC": stepwise,
        "sparse regression (pysindy)": sparse,
        "Gaussian process (scikit-learn)": process,
    }


def errors(batch: Path, of_batch: Path, kept: Path, of_kept: Path) -> dict[str, dict[str, float]]:
    """By rival and channel, the root mean square error on kept-back recordings.

    Parameters
    ----------
    batch, kept : Path
        Folders of recordings: to learn from, and to be held to.
    of_batch, of_kept : Path
        Folders with the calibrated model's predictions of them.
    """
    known, held = _recordings(batch, of_batch), _recordings(kept, of_kept)
    which = np.concatenate([np.full(len(r["theta"]), i) for i, (r, _) in enumerate(known)])
    quantities = {name: np.concatenate([r[name] for r, _ in known]) for name in known[0][0]}
    found: dict[str, dict[str, float]] = {}
    for name, learns in rivals().items():
        found[name] = {}
        for channel in CHANNELS:
            corrects = learns(quantities, np.concatenate([left[channel] for _, left in known]), which)
            squares = [np.mean((left[channel] - corrects(r)) ** 2) for r, left in held]
            found[name][channel] = float(np.sqrt(np.mean(squares)))
    return found


def _recordings(batch: Path, predictions: Path) -> list[tuple[Quantities, Quantities]]:
    """Of each recording, what a rival may use and what the calibrated model leaves; `SAMPLES` evenly spaced ones."""
    described = yaml.safe_load((batch / "batch.yaml").read_text(encoding="utf-8"))
    return [
        _recording(batch, one["id"], predictions / f"{one['id']}.csv", described) for one in described["recordings"]
    ]


def _recording(batch: Path, name: str, prediction: Path, described: dict) -> tuple[Quantities, Quantities]:
    measured, said = in_si(batch, name), pd.read_csv(prediction)
    time_s = measured["time_s"]
    modelled = {c: np.interp(time_s, said["time_s"], said[c]) for c in (*CHANNELS, "theta_in_rad")}
    left = {c: measured[c] - modelled[c] for c in CHANNELS}
    left["theta_out_rad"] = left["theta_out_rad"] - left["theta_out_rad"][time_s < REST_S].mean()
    theta, omega, alpha = _motion(time_s, modelled["theta_in_rad"])
    way = np.tanh(omega / TURN_RAD_PER_S)
    quantities = {
        "one": np.ones_like(theta),
        "theta": theta,
        "theta^2": theta**2,
        "theta^3": theta**3,
        "sin": np.sin(theta),
        "cos": np.cos(theta),
        "omega": omega,
        "omega |omega|": omega * np.abs(omega),
        "alpha": alpha,
        "way": way,
        "way theta": way * theta,
        "tau_in": modelled["tau_in_Nm"],
        "tau_out": modelled["tau_out_Nm"],
        "F_drive": modelled["F_drive_N"],
        "F_load": modelled["F_load_N"],
        "way F_drive": way * modelled["F_drive_N"],
        "way F_load": way * modelled["F_load_N"],
        "omega F_drive": omega * modelled["F_drive_N"],
        "tau_in^2": modelled["tau_in_Nm"] ** 2,
        "tau_in^3": modelled["tau_in_Nm"] ** 3,
        "theta_out": modelled["theta_out_rad"],
        "time": time_s,
    }
    some = np.linspace(0, theta.size - 1, min(SAMPLES, theta.size)).astype(int)
    return {k: v[some] for k, v in quantities.items()}, {k: v[some] for k, v in left.items()}


def _motion(time_s: NDArray, theta: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Angle, rate and acceleration of the drive, each smoothed once more than the last."""
    width = max(1, int(SMOOTHING_S / (time_s[1] - time_s[0])))
    mean = np.ones(width) / width

    def smooth(values):
        return np.convolve(np.pad(values, (width, width), mode="edge"), mean, mode="same")[width:-width]

    theta = smooth(theta)
    omega = smooth(np.gradient(theta, time_s))
    return theta, omega, smooth(np.gradient(omega, time_s))


def _library(quantities: Mapping[str, NDArray]) -> tuple[NDArray, Callable[[Mapping[str, NDArray]], NDArray]]:
    """Columns of unit spread, and what makes the same of other recordings."""
    names = [n for n in quantities if n != "one"]
    columns = np.column_stack([quantities[n] for n in names])
    middle, spread = columns.mean(axis=0), columns.std(axis=0)
    spread[spread == 0] = 1.0

    def of(other):
        return np.column_stack([other["one"], (np.column_stack([other[n] for n in names]) - middle) / spread])

    return of(quantities), of


def stepwise(quantities: Quantities, left: NDArray, which: NDArray) -> Corrects:
    """Least squares, taking in one term of the library after the other as long as Bayes' criterion falls."""
    columns, of = _library(quantities)
    n, chosen = left.size, [0]

    def criterion(terms):
        weights, *_ = np.linalg.lstsq(columns[:, terms], left, rcond=None)
        return n * np.log(np.mean((left - columns[:, terms] @ weights) ** 2)) + len(terms) * np.log(n), weights

    best, weights = criterion(chosen)
    while len(chosen) < columns.shape[1]:
        tried = [(*criterion([*chosen, j]), j) for j in range(columns.shape[1]) if j not in chosen]
        value, tried_weights, j = min(tried, key=lambda t: t[0])
        if value >= best:
            break
        best, weights, chosen = value, tried_weights, [*chosen, j]
    return lambda other: of(other)[:, chosen] @ weights


def sparse(quantities: Quantities, left: NDArray, which: NDArray) -> Corrects:
    """Sequentially thresholded least squares of pysindy; the threshold is what predicts every third recording best."""
    from pysindy import STLSQ

    columns, of = _library(quantities)
    scale = left.std() or 1.0

    def weights(rows, threshold):
        fitted = STLSQ(threshold=threshold, alpha=1e-3).fit(columns[rows], (left[rows] / scale)[:, None])
        return np.asarray(fitted.coef_)[0] * scale

    held = which % 3 == 0
    if held.all() or not held.any():
        held = np.arange(left.size) % 3 == 0
    off = [np.mean((left[held] - columns[held] @ weights(~held, t)) ** 2) for t in THRESHOLDS]
    found = weights(slice(None), THRESHOLDS[int(np.argmin(off))])
    return lambda other: of(other) @ found


def process(quantities: Quantities, left: NDArray, which: NDArray) -> Corrects:
    """scikit-learn's Gaussian process for the discrepancy, as Kennedy and O'Hagan put it beside a calibrated model."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    some = {name: quantities[name] for name in ("one", *GP_QUANTITIES)}
    columns, of = _library(some)
    rows = np.random.default_rng(0).permutation(left.size)[:GP_SAMPLES]
    kernel = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(np.ones(len(GP_QUANTITIES)), (0.1, 1e3)) + WhiteKernel(
        1.0, (1e-4, 10)
    )
    scale = left.std() or 1.0
    with warnings.catch_warnings():
        # A length at its upper bound is a quantity that does not matter.
        warnings.simplefilter("ignore", ConvergenceWarning)
        fitted = GaussianProcessRegressor(kernel, random_state=0).fit(columns[rows, 1:], left[rows] / scale)
    return lambda other: fitted.predict(of(other)[:, 1:]) * scale
