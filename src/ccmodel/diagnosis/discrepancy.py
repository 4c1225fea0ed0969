"""Model discrepancy: the part of a candidate's residuals that is a function of the rig's state, as a Gaussian process.

A candidate leaves whitened residuals e = J dtheta + F beta + noise. J are its derivatives by its unknowns, which have
a prior; F are features of the rig's state (random Fourier features, Rahimi and Recht 2007), the same for every
candidate; and beta are independent normal variables with a variance for each channel. Both are integrated out, so that
the evidence of a candidate with a discrepancy of a given size is that of a linear model.

A discrepancy of size zero is a candidate that is exactly right. The evidence of a large discrepancy falls with the
logarithm of its size, once for each mode that the features have, and not with the residuals' squares: this is what a
wrong candidate costs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import TAU_IN, THETA_OUT
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.drive import since_reversal, speed
from ccmodel.diagnosis.normal_equations import NormalEquations, sample_weight
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.inference.pool import each
from ccmodel.model.run import simulate

# Relative rounding of a limit: 3 * 0.1 is not exactly a size of the grid.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Modes:
    """Independent modes of the features of some channels.

    Attributes
    ----------
    strength : ndarray, shape (modes,)
        Sum of squares of each mode in the residuals for a discrepancy with a mean square of 1 (1: noise).
    vectors : ndarray, shape (features of all channels, modes)
        Map products with the features to products with the modes.
    """

    strength: NDArray
    vectors: NDArray

    @classmethod
    def of(cls, gram: NDArray, variance: NDArray) -> "Modes":
        """Modes of features with these products and a priori variances; shapes (features, features), (features,)."""
        used = np.flatnonzero(variance)
        root = np.sqrt(variance[used])
        value, vector = np.linalg.eigh(root[:, None] * gram[np.ix_(used, used)] * root)
        leading = value > settings.WEAKEST_MODE * value[-1]
        vectors = np.zeros((len(gram), int(leading.sum())))
        vectors[used] = root[:, None] * vector[:, leading]
        return cls(value[leading], vectors)


@dataclass(frozen=True)
class Products:
    """What the evidence of a candidate depends on, whatever the discrepancy.

    Attributes
    ----------
    equations : NormalEquations
        Of the candidate without a discrepancy.
    by_unknowns, by_residuals : ndarray, shapes (features, unknowns) and (features,)
        Weighted F'J and F'e.
    """

    equations: NormalEquations
    by_unknowns: NDArray
    by_residuals: NDArray


@dataclass(frozen=True)
class Discrepancy:
    """Gaussian process of the discrepancy on whitened recordings.

    Attributes
    ----------
    features : list of ndarray, each of shape (samples, features)
        By recording, the same for every channel.
    channels : list of str
        Every channel that is compared in any recording.
    """

    features: list[NDArray]
    channels: list[str]
    _modes: dict[tuple, Modes] = field(default_factory=dict, repr=False, compare=False)
    _grams: dict[tuple, tuple[Sequence[Whitened], NDArray, NDArray]] = field(
        default_factory=dict, repr=False, compare=False
    )
    _products: dict[int, tuple[CandidateFit, Products]] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def of(cls, whitened: Sequence[Whitened], base: CandidateFit) -> "Discrepancy":
        """The discrepancy as a function of the state of the rig that a fitted model simulates."""
        inputs = each(whitened, lambda i, w: _inputs(w, base))
        channels = sorted({c for w in whitened for c in w.observations.channels})
        return cls(_features(inputs), channels)

    def log_evidence(self, candidate: CandidateFit, sizes: Sequence[float], by_channel: Mapping[str, float]) -> NDArray:
        """Logarithm of the evidence of a candidate with a discrepancy, up to a constant that all candidates share.

        Parameters
        ----------
        candidate : CandidateFit
        sizes : sequence of float
            Factors of the discrepancy; 0 is none.
        by_channel : mapping of str to float
            Mean square of a discrepancy of size 1 by channel (1: noise); it has none in others.

        Returns
        -------
        ndarray, shape (sizes,)
        """
        p, modes = self._products_of(candidate), self._modes_of(candidate, by_channel)
        J, e = modes.vectors.T @ p.by_unknowns, modes.vectors.T @ p.by_residuals
        return np.array([_log_evidence(p, modes.strength, J, e, size) for size in sizes])

    def resolution(self, candidate: CandidateFit, sizes: Sequence[float]) -> float:
        """The least of these sizes, in all channels, that residuals of noise alone show to be too large."""
        strength = self._modes_of(candidate, dict.fromkeys(self.channels, 1.0)).strength
        for size in sizes:
            expected = (np.log1p(size * strength) - size * strength / (1 + size * strength)).sum() / 2
            if expected > settings.CLEARLY_WORSE:
                return size
        return sizes[-1]

    def _products_of(self, candidate: CandidateFit) -> Products:
        known = self._products.get(id(candidate))
        if known is None:
            # The candidate is kept as well: its id would otherwise be given away again.
            known = self._products[id(candidate)] = candidate, self._summed(candidate)
        return known[1]

    def _summed(self, candidate: CandidateFit) -> Products:
        unknowns, features = len(candidate.values), self.features[0].shape[1] * len(self.channels)
        by_unknowns, by_residuals = np.zeros((features, unknowns)), np.zeros(features)
        count = len(candidate.whitened)
        for w, F, e, J in zip(candidate.whitened, self.features, candidate.residuals, candidate.jacobian, strict=True):
            n, weight = w.measured.size, sample_weight(w, count)
            both = np.column_stack([J[:n], e[:n]])
            whitened = both - w.directions @ (w.shrinkage[:, None] * (w.directions.T @ both))
            whitened = whitened.reshape(*w.measured.shape, unknowns + 1)
            for k, channel in enumerate(w.observations.channels):
                part = weight * F.T @ whitened[k]
                by_unknowns[self._columns(channel)] += part[:, :-1]
                by_residuals[self._columns(channel)] += part[:, -1]
        return Products(NormalEquations.of(candidate), by_unknowns, by_residuals)

    def _columns(self, channel: str) -> slice:
        """Features of a channel among those of all channels."""
        size, k = self.features[0].shape[1], self.channels.index(channel)
        return slice(k * size, (k + 1) * size)

    def _modes_of(self, candidate: CandidateFit, by_channel: Mapping[str, float]) -> Modes:
        """Modes of a discrepancy with these sizes by channel, whitened as the candidate's residuals are."""
        whitening = tuple(id(w.directions) for w in candidate.whitened)
        key = whitening, tuple(sorted(by_channel.items()))
        if key not in self._modes:
            if whitening not in self._grams:
                self._grams[whitening] = candidate.whitened, *self._gram(candidate.whitened)
            _, gram, mean_square = self._grams[whitening]
            variance = np.zeros(len(gram))
            for channel, size in by_channel.items():
                variance[self._columns(channel)] = size
            self._modes[key] = Modes.of(gram, variance / mean_square)
        return self._modes[key]

    def _gram(self, whitened: Sequence[Whitened]) -> tuple[NDArray, NDArray]:
        """Products of the whitened features, and the mean square that those of a channel have together, by feature."""
        size = self.features[0].shape[1]
        gram, total = np.zeros((size * len(self.channels),) * 2), np.zeros(size * len(self.channels))
        count = np.zeros(len(total))
        for w, F in zip(whitened, self.features, strict=True):
            own, weight = F.T @ F, sample_weight(w, len(whitened))
            along = np.zeros((w.directions.shape[1], len(total)))
            directions = w.directions.reshape(*w.measured.shape, -1)
            for k, channel in enumerate(w.observations.channels):
                columns = self._columns(channel)
                gram[columns, columns] += weight * own
                along[:, columns] = directions[k].T @ F
                total[columns] += np.trace(own) / len(F)
                count[columns] += 1
            removed = 1 - (1 - w.shrinkage) ** 2
            gram -= weight * along.T @ (removed[:, None] * along)
        return gram, total / count


@dataclass(frozen=True)
class Evidence:
    """Log evidence of a candidate under each assumption about its discrepancy, up to a constant that all share.

    Attributes
    ----------
    exact : float
        No discrepancy, or one of at most `settings.NOT_WHITE`.
    other_law : float
        The candidate's equations leave a share of its own effect.
    incomplete : float
        Something is missing beside it.
    in_channel : dict of str to float
        The same where what is missing affects a single channel, as a sensor's fault does.
    size : float
        The least mean square of its discrepancy (1: noise) that is not clearly too small.
    resolution : float
        The least mean square of a discrepancy that would be noticed if there were none.
    """

    exact: float
    other_law: float
    incomplete: float
    in_channel: dict[str, float]
    size: float
    resolution: float


def evidence_of(discrepancy: Discrepancy, candidate: CandidateFit, effect: float, excess: float) -> Evidence:
    """Log evidence of a candidate.

    Parameters
    ----------
    discrepancy : Discrepancy
    candidate : CandidateFit
    effect : float
        Excess mean square without its last mechanism, of which its equations may leave a share; 0 without mechanisms.
    excess : float
        Excess mean square of the calibrated model. A missing effect has `LARGEST_MISSING` times this at most.
    """
    sizes, channels = np.array(settings.DISCREPANCIES), discrepancy.channels
    none, *others = discrepancy.log_evidence(candidate, [0.0, *sizes], dict.fromkeys(channels, 1.0))
    every = np.array(others)
    own = {c: discrepancy.log_evidence(candidate, settings.DISCREPANCIES, {c: 1.0}) for c in channels}

    def by_channel(low: float, high: float) -> dict[str, float]:
        tried = (sizes >= low * (1 - ROUNDING)) & (sizes <= high * (1 + ROUNDING))
        return {c: _mean(value[tried]) for c, value in own.items()}

    def anywhere(low: float, high: float, in_one: dict[str, float]) -> float:
        """In all channels or in a single one."""
        return _mean([_mean(every[(sizes >= low) & (sizes <= high)]), _mean(list(in_one.values()))])

    slight = sizes <= settings.NOT_WHITE
    exact = _mean([none, *every[slight], *(value for by_size in own.values() for value in by_size[slight])])
    of_law = settings.LEFT_BY_LAW[0] * effect, settings.LEFT_BY_LAW[1] * effect
    low, high = settings.SMALLEST_MISSING, settings.LARGEST_MISSING * max(excess, settings.SMALLEST_MISSING)
    # An excess of all channels that comes from one fault in one of them is so many times as large there.
    in_one = by_channel(len(channels) * low, len(channels) * high)
    tried = [(none, 0.0), *zip(every, sizes, strict=True)]
    # In a single channel a size is a mean square of that channel only.
    tried += [(value, size / len(own)) for by_size in own.values() for value, size in zip(by_size, sizes, strict=True)]
    best = max(value for value, _ in tried)
    return Evidence(
        exact,
        anywhere(*of_law, by_channel(*of_law)),
        anywhere(low, high, in_one),
        in_one,
        min(size for value, size in tried if value >= best - settings.CLEARLY_WORSE),
        discrepancy.resolution(candidate, settings.DISCREPANCIES),
    )


def _mean(logarithms: Sequence[float] | NDArray) -> float:
    """Logarithm of the mean of numbers given by their logarithms; that of 0 without any."""
    values = np.asarray(logarithms)
    return float(np.logaddexp.reduce(values) - np.log(len(values))) if len(values) else -np.inf


def _log_evidence(p: Products, strength: NDArray, J: NDArray, e: NDArray, size: float) -> float:
    share = size / (1 + size * strength)
    beside = replace(
        p.equations,
        information=p.equations.information - J.T @ (share[:, None] * J),
        score=p.equations.score - J.T @ (share * e),
        square=p.equations.square - float(e @ (share * e)),
    )
    return float(beside.log_evidence - np.log1p(size * strength).sum() / 2)


def _features(inputs: Sequence[NDArray]) -> list[NDArray]:
    """Constant, linear and random Fourier features by recording; shape (samples, features)."""
    random = np.random.default_rng(settings.FEATURES_SEED)
    every = np.concatenate(inputs)
    mean, scale = every.mean(axis=0), every.std(axis=0)
    # The standard deviation of a constant is a rounding error.
    scale[scale <= 1e-9 * np.abs(mean)] = 1.0
    shape = (every.shape[1], settings.FEATURES)
    used = random.random(shape) < settings.INPUTS_PER_FEATURE / every.shape[1]
    directions = used * random.standard_normal(shape) / random.choice(settings.LENGTH_SCALES, settings.FEATURES)
    shift = random.uniform(0, 2 * np.pi, settings.FEATURES)
    standardised = [(quantities - mean) / scale for quantities in inputs]
    return [np.column_stack([np.ones(len(x)), x, np.sqrt(2) * np.cos(x @ directions + shift)]) for x in standardised]


def _inputs(w: Whitened, candidate: CandidateFit) -> NDArray:
    """State of the rig at every sample, as the model simulates it; shape (samples, quantities)."""
    given, time_s = w.observations.given, w.observations.given.recording.time_s
    simulated = simulate(given, candidate.model(w.observations.parameters, w.session))
    omega = speed(given)
    travel, since_s = since_reversal(given)
    tensions = [simulated[c] for c in simulated.tensions]
    quantities = [
        given.theta_in,
        omega,
        np.tanh(omega / (settings.SATURATING_SPEED * np.abs(omega).max() or 1.0)),
        travel,
        np.tanh(travel / (settings.SATURATING_TRAVEL * np.abs(travel).max() or 1.0)),
        time_s,
        np.minimum(since_s, settings.SINCE_REVERSAL_S),
        simulated[THETA_OUT],
        simulated[TAU_IN],
        *tensions,
        np.full_like(time_s, given.recording.path.bend_rad),
        np.full_like(time_s, np.mean(tensions)),
    ]
    return np.column_stack(quantities)[w.observations.judged]
