"""Lack of fit: the part of a candidate's residuals that can be predicted in recordings not used for the prediction.

A Gaussian process, approximated by random Fourier features, learns the leave-one-out residuals from the state of the
rig and predicts those of the recording that was left out. A reduction of their mean square is model discrepancy: the
candidate is not the explanation, however small its residuals are. Differences from run to run cannot be predicted from
other runs and do not count.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from ccmodel.channels import TAU_IN, THETA_OUT
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.drive import since_reversal, speed
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.inference.pool import each
from ccmodel.model.run import simulate


@dataclass(frozen=True)
class LackOfFit:
    """Predictable part of a candidate's residuals.

    Attributes
    ----------
    reduction : ndarray, shape (recordings,)
        By recording, reduction of the mean square of its whitened residuals by the prediction from the others, minus
        the share of the tolerance; negative where the prediction is worse. Of a single recording, by stretches.
    """

    reduction: NDArray

    @property
    def mean(self) -> float:
        """Mean over recordings."""
        return float(self.reduction.mean())

    @property
    def lower_bound(self) -> float:
        """Lower end of the 95 % interval of the mean."""
        n = self.reduction.size
        quantile = float(student.ppf(0.5 + settings.LACK_OF_FIT_COVERAGE / 2, n - 1))
        return self.mean - quantile * float(self.reduction.std(ddof=1)) / np.sqrt(n)


def lack_of_fit(candidate: CandidateFit) -> LackOfFit:
    """Predict a candidate's leave-one-out residuals from the state of the rig, each recording from all others."""
    whitened = candidate.whitened
    inputs = each(whitened, lambda i, w: _inputs(w, candidate))
    residuals = each(whitened, lambda i, w: _by_channel(w, candidate.loo_residuals[i], whitened))
    if len(whitened) == 1:
        inputs, residuals = (np.array_split(part[0], settings.STRETCHES) for part in (inputs, residuals))
    features = _features(inputs)
    share = [1 / len(e) for e in residuals]
    gram = [s * F.T @ F for s, F in zip(share, features, strict=True)]
    cross = [s * F.T @ e for s, F, e in zip(share, features, residuals, strict=True)]
    size = np.trace(sum(gram)) / len(gram[0])
    reductions = [_reductions(features, residuals, gram, cross, penalty * size) for penalty in settings.PENALTIES]
    best = max(reductions, key=np.mean)
    tolerated = np.mean([w.observations.tolerance_share for w in whitened])
    return LackOfFit((best if best.mean() > 0 else np.zeros_like(best)) - tolerated)


def _reductions(
    features: Sequence[NDArray],
    residuals: Sequence[NDArray],
    gram: Sequence[NDArray],
    cross: Sequence[NDArray],
    penalty: float,
) -> NDArray:
    """By recording, the reduction of its mean square by a ridge regression on the others."""
    G, b = sum(gram) + penalty * np.eye(len(gram[0])), sum(cross)
    predicted = [F @ np.linalg.solve(G - own, b - c) for F, own, c in zip(features, gram, cross, strict=True)]
    return np.array([np.mean(e**2) - np.mean((e - p) ** 2) for e, p in zip(residuals, predicted, strict=True)])


def _features(inputs: Sequence[NDArray]) -> list[NDArray]:
    """Constant, linear and random Fourier features by recording; shape (samples, features)."""
    random = np.random.default_rng(settings.FEATURES_SEED)
    every = np.concatenate(inputs)
    mean, scale = every.mean(axis=0), every.std(axis=0)
    scale[scale == 0] = 1.0
    shape = (every.shape[1], settings.FEATURES)
    used = random.random(shape) < settings.INPUTS_PER_FEATURE / every.shape[1]
    directions = used * random.standard_normal(shape) / random.choice(settings.LENGTH_SCALES, settings.FEATURES)
    shift = random.uniform(0, 2 * np.pi, settings.FEATURES)
    standardised = [(quantities - mean) / scale for quantities in inputs]
    return [np.column_stack([np.ones(len(x)), x, np.sqrt(2) * np.cos(x @ directions + shift)]) for x in standardised]


def _inputs(w: Whitened, candidate: CandidateFit) -> NDArray:
    """State of the rig at every sample, as the model simulates it; shape (samples, quantities)."""
    given, time_s = w.observations.given, w.observations.given.recording.time_s
    simulated = simulate(given, candidate.model(w.observations.parameters))
    omega = speed(given)
    travel, since_s = since_reversal(given)
    tensions = [simulated[c] for c in simulated.tensions]
    quantities = [
        given.theta_in,
        omega,
        np.tanh(omega / (0.1 * np.abs(omega).max() or 1.0)),
        travel,
        np.tanh(travel / (0.2 * np.abs(travel).max() or 1.0)),
        time_s,
        np.minimum(since_s, 3.0),
        simulated[THETA_OUT],
        simulated[TAU_IN],
        *tensions,
        np.full_like(time_s, given.recording.path.bend_rad),
        np.full_like(time_s, np.mean(tensions)),
    ]
    return np.column_stack(quantities)[w.observations.judged]


def _by_channel(w: Whitened, residuals: NDArray, whitened: Sequence[Whitened]) -> NDArray:
    """Residuals by channel of any recording, zero where a channel is missing; shape (samples, channels)."""
    channels = sorted({c for one in whitened for c in one.observations.channels})
    found = np.zeros((w.measured.shape[1], len(channels)))
    rows = residuals[: w.measured.size].reshape(w.measured.shape)
    for channel, values in zip(w.observations.channels, rows, strict=True):
        found[:, channels.index(channel)] = values
    return found
