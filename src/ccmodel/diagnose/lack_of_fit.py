"""Something unknown as a rival: how much of the errors that a hypothesis leaves could still be learnt.

A flexible model with no physics in it, a Gaussian process by random Fourier features, learns the errors from what the
rig was doing and predicts those of recordings that it has not seen. Where it takes something off them there is law in
what a hypothesis leaves, and the hypothesis is not the explanation, however little it leaves. What merely differs from
run to run cannot be learnt from other runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from ccmodel.diagnose.candidate import CandidateFit
from ccmodel.diagnose.drive import since_reversal, speed
from ccmodel.diagnose.whitening import Whitened
from ccmodel.inference.problem import Observations, each
from ccmodel.model.run import simulate

# Random features, how many of the quantities each looks at on average, and over which lengths (in standard deviations).
FEATURES = 200
LOOKS_AT = 3.0
LENGTHS = (0.5, 1.2, 3.0)
# Strengths of the penalty on what is learnt, relative to the mean square of a feature.
PENALTIES = (0.01, 0.1, 1.0, 10.0)
# A single recording is learnt in as many stretches.
STRETCHES = 4
SEED = 0


@dataclass(frozen=True)
class LackOfFit:
    """What could be learnt of a trial's errors.

    Attributes
    ----------
    gain : ndarray, shape (recordings,)
        By how much the mean square of a recording's whitened errors falls by what the others teach, beyond what a
        right model is allowed to leave; negative where it falls by less or rises. Of a single recording, by stretches.
    """

    gain: NDArray

    @property
    def mean(self) -> float:
        """Of all recordings."""
        return float(self.gain.mean())

    @property
    def surely(self) -> float:
        """What can be learnt by more than chance: the lower end of the mean's 95 % interval."""
        n = self.gain.size
        return self.mean - float(student.ppf(0.975, n - 1) * self.gain.std(ddof=1) / np.sqrt(n))


def structure(weighed: Sequence[Whitened], trial: CandidateFit) -> LackOfFit:
    """Learn a trial's held-out errors from what the rig was doing, each recording's from the others'."""
    about = each(weighed, lambda i, w: _circumstances(w, trial))
    errors = each(weighed, lambda i, w: _by_channel(w.observations, trial.aside[i], weighed))
    if len(weighed) == 1:
        about, errors = (np.array_split(part[0], STRETCHES) for part in (about, errors))
    features = _featured(about)
    share = [1 / len(e) for e in errors]
    gram = [s * F.T @ F for s, F in zip(share, features, strict=True)]
    cross = [s * F.T @ e for s, F, e in zip(share, features, errors, strict=True)]
    size = np.trace(sum(gram)) / len(gram[0])
    gains = [_gains(features, errors, gram, cross, penalty * size) for penalty in PENALTIES]
    best = max(gains, key=np.mean)
    allowed = np.mean([w.observations.tolerance_share for w in weighed])
    return LackOfFit((best if best.mean() > 0 else np.zeros_like(best)) - allowed)


def _gains(features, errors, gram, cross, penalty: float) -> NDArray:
    """By recording, what is taken off its mean square by a ridge regression on the others."""
    G, b = sum(gram) + penalty * np.eye(len(gram[0])), sum(cross)
    gains = []
    for F, e, own, own_cross in zip(features, errors, gram, cross, strict=True):
        learnt = F @ np.linalg.solve(G - own, b - own_cross)
        gains.append(np.mean(e**2) - np.mean((e - learnt) ** 2))
    return np.array(gains)


def _featured(about: Sequence[NDArray]) -> list[NDArray]:
    """Constant, linear and random Fourier features of quantities, by recording; shape (samples, features)."""
    random = np.random.default_rng(SEED)
    every = np.concatenate(about)
    mean, scale = every.mean(axis=0), every.std(axis=0)
    scale[scale == 0] = 1.0
    shape = (every.shape[1], FEATURES)
    looks = random.random(shape) < LOOKS_AT / every.shape[1]
    directions = looks * random.standard_normal(shape) / random.choice(LENGTHS, FEATURES)
    shift = random.uniform(0, 2 * np.pi, FEATURES)
    found = []
    for quantities in about:
        x = (quantities - mean) / scale
        found.append(np.column_stack([np.ones(len(x)), x, np.sqrt(2) * np.cos(x @ directions + shift)]))
    return found


def _circumstances(w: Whitened, trial: CandidateFit) -> NDArray:
    """What errors may depend on, sample by sample, as far as the model knows it; shape (samples, quantities)."""
    e = w.observations
    given, time_s = e.given, e.given.recording.time_s
    said = simulate(given, trial.hypothesis.of(e.parameters).with_values(trial.values))
    omega = speed(given)
    travel, since_s = since_reversal(given)
    tensions = [said[c] for c in said.tensions]
    quantities = [
        given.theta_in,
        omega,
        np.tanh(omega / (0.1 * np.abs(omega).max() or 1.0)),
        travel,
        np.tanh(travel / (0.2 * np.abs(travel).max() or 1.0)),
        time_s,
        np.minimum(since_s, 3.0),
        said["theta_out_rad"],
        said["tau_in_Nm"],
        *tensions,
        np.full_like(time_s, given.recording.path.bend_rad),
        np.full_like(time_s, np.mean(tensions)),
    ]
    return np.column_stack(quantities)[e.judged]


def _by_channel(e: Observations, errors: NDArray, weighed: Sequence[Whitened]) -> NDArray:
    """Errors by channel of any recording, none where a channel is missing; shape (samples, channels)."""
    channels = sorted({c for w in weighed for c in w.observations.channels})
    found = np.zeros((e.measured.shape[1], len(channels)))
    for channel, values in zip(e.channels, errors[: e.measured.size].reshape(e.measured.shape), strict=True):
        found[:, channels.index(channel)] = values
    return found
