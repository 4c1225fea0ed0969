"""The linear model of a candidate's residuals about its fit: its evidence without a discrepancy.

A candidate leaves whitened residuals e = J dtheta + noise. J are its derivatives by its unknowns, which have a normal
prior. What the evidence and the most probable change of the unknowns depend on is the weighted sums J'J, J'e and e'e.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.hypothesis import prior_means
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.inference.effective_samples import IN_DIAGNOSIS, IN_EVIDENCE, prior_spread
from ccmodel.mechanisms import Parameter
from ccmodel.model.parameters import mechanism_key


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations of a candidate, with the prior of its unknowns.

    Attributes
    ----------
    information : ndarray, shape (unknowns, unknowns)
        Weighted J'J.
    score : ndarray, shape (unknowns,)
        Weighted J'e.
    square : float
        Weighted e'e, and the log determinant of the states that its mechanisms have when a recording starts.
    prior_sd : ndarray, shape (unknowns,)
        Standard deviation of the unknowns' prior.
    from_mean : ndarray, shape (unknowns,)
        Distance of the unknowns from their prior's mean over its standard deviation, where the prior has a mean of its
        own: that of a law's coefficients and of a place, of what differs between batches, and of the states of
        mechanisms when a recording starts; 0 elsewhere.
    from_neutral : mapping of int to float
        Distance from the neutral value of each unknown that may as well be neutral (`Parameter.optional`), by its
        number.
    """

    information: NDArray
    score: NDArray
    square: float
    prior_sd: NDArray
    from_mean: NDArray
    from_neutral: Mapping[int, float] = field(default_factory=dict)

    @classmethod
    def of(cls, candidate: CandidateFit) -> "NormalEquations":
        """Those of a candidate at its fitted values."""
        unknowns = len(candidate.values)
        information, score, square = np.zeros((unknowns, unknowns)), np.zeros(unknowns), 0.0
        count = len(candidate.whitened)
        for w, e, J in zip(candidate.whitened, candidate.residuals, candidate.jacobian, strict=True):
            both, n = np.column_stack([J, e]), w.measured.size
            weight, weights = sample_weight(w, count), np.full(len(e), _nuisance_weight(w, count))
            weights[:n] = weight
            products = both.T @ (weights[:, None] * both)
            information += products[:-1, :-1]
            score += products[:-1, -1]
            square += float(products[-1, -1]) + w.state_log_determinant(weight)
        prior_sd = np.array([_prior_sd(candidate, name) for name in candidate.values])
        means = prior_means(candidate.hypothesis)
        means |= {n: f.prior_mean for n, f in candidate.free.items() if f.spread}
        means |= {
            mechanism_key(name, place, state.name): state.start
            for name, place in candidate.hypothesis.acting
            for state in registry.get(name).states
        }
        from_mean = [
            (value - means[name]) / sd if name in means else 0.0
            for (name, value), sd in zip(candidate.values.items(), prior_sd, strict=True)
        ]
        from_neutral = _from_neutral(candidate)
        return cls(information, score, square, prior_sd, np.array(from_mean), from_neutral)

    def scaled(self, factors: NDArray) -> Self:
        """The same with unknowns in units that are larger by factors, shape (unknowns,)."""
        return replace(
            self,
            information=factors[:, None] * self.information * factors,
            score=factors * self.score,
            from_mean=self.from_mean / factors,
            from_neutral={k: away / factors[k] for k, away in self.from_neutral.items()},
        )

    def held(self, k: int, change: float) -> Self:
        """The same where one unknown changes by so much and is known."""
        prior_sd, from_mean = self.prior_sd.copy(), self.from_mean.copy()
        prior_sd[k] = from_mean[k] = 0.0
        return replace(
            self,
            score=self.score + self.information[:, k] * change,
            square=self.square + (2 * self.score[k] + self.information[k, k] * change) * change,
            prior_sd=prior_sd,
            from_mean=from_mean,
        )

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence, up to a constant that all candidates share.

        Unknowns that may be neutral are so with a probability of one half.
        """
        if self.from_neutral:
            (k, away), *others = self.from_neutral.items()
            free = replace(self, from_neutral=dict(others))
            return float(np.logaddexp(free.log_evidence, free.held(k, -away).log_evidence) - np.log(2.0))
        root = np.linalg.cholesky(self._information_over_prior)
        along = np.linalg.solve(root, self.prior_sd * self.score + self.from_mean)
        determinant = 2 * np.log(np.diag(root)).sum()
        return float(-(self.square + self.from_mean @ self.from_mean - along @ along + determinant) / 2)

    @property
    def most_probable(self) -> NDArray:
        """Change of each unknown to its most probable value, shape (unknowns,)."""
        along = self.prior_sd * self.score + self.from_mean
        return -self.prior_sd * np.linalg.solve(self._information_over_prior, along)

    @property
    def _information_over_prior(self) -> NDArray:
        return np.eye(len(self.score)) + self.prior_sd[:, None] * self.information * self.prior_sd


def sample_weight(w: Whitened, recordings: int) -> float:
    """Weight of each squared residual of a recording, so that a channel counts as `IN_EVIDENCE` samples at most."""
    samples = w.measured.shape[1]
    return min(IN_EVIDENCE, samples) / samples * _share_of_one(w, recordings)


def _nuisance_weight(w: Whitened, recordings: int) -> float:
    """Weight of each squared posterior mean of a nuisance, which then counts by its own standard deviation."""
    return IN_DIAGNOSIS / w.measured.shape[1] * _share_of_one(w, recordings)


def _share_of_one(w: Whitened, recordings: int) -> float:
    """The tolerance stands for errors that are the same in every recording, and counts once for all of them."""
    shared = w.observations.tolerance_share
    return 1 - shared + shared / recordings


def _prior_sd(candidate: CandidateFit, unknown: str) -> float:
    """Standard deviation of an unknown's prior: of a mechanism's parameter, from its plausible range."""
    for name, place in candidate.hypothesis.acting:
        for p in registry.get(name).parameters:
            if mechanism_key(name, place, p.name) == unknown:
                return p.spread or p.prior_sd or _sd_within_range(p, candidate.values[unknown])
    free = candidate.free.get(unknown)
    if free is not None and free.spread is not None:
        # A fit has it in the units of its cost.
        return free.spread / prior_spread(1.0, [w.observations for w in candidate.whitened])
    # A baseline's mechanisms are in every candidate, and so are their priors.
    return (free.high - free.low) / np.sqrt(12) if free else 1.0


def _from_neutral(candidate: CandidateFit) -> dict[int, float]:
    numbers = {name: k for k, name in enumerate(candidate.values)}
    optional = {
        mechanism_key(name, place, p.name): p.neutral
        for name, place in candidate.hypothesis.acting
        for p in registry.get(name).parameters
        if p.optional
    }
    return {numbers[name]: candidate.values[name] - at for name, at in optional.items() if name in numbers}


def _sd_within_range(p: Parameter, value: float) -> float:
    if (p.scale == "log" or p.ratio) and p.low > 0:
        both_signs = 2 if p.signed else 1
        return float(np.clip(abs(value), p.low, p.high) * both_signs * np.log(p.high / p.low) / np.sqrt(12))
    return abs(p.high - p.low) * (2 if p.signed else 1) / np.sqrt(12)
