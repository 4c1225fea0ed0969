"""Screening: score tests (Lagrange multiplier tests) of mechanisms against a fitted model, alone and in sets.

One run of the model with a mechanism at each of a few values gives the direction in which it changes the errors. The
part of that direction which a recalibration would absorb is projected out; the rest is compared with the residuals. The
products of all directions (their Gram matrix) give the same test for any set of mechanisms, without further runs.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.deadline import UNLIMITED, Deadline
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.failure import ModelError
from ccmodel.inference.pool import each
from ccmodel.model.parameters import mechanism_key

# Least squared length of a direction: a sum over recordings of mean squares (1: noise). Below it, the mechanism has no
# effect, or a recalibration absorbs it.
ABSORBED = 1e-12


@dataclass(frozen=True)
class Score:
    """Result of the score test of a mechanism, or of a set of them.

    Attributes
    ----------
    hypothesis : Hypothesis
    gain : float
        Predicted share of the mean square that is taken off, after recalibration.
    values : dict of str to float
        The best of the screened values, extrapolated to the strengths with the largest gain; empty if none has a gain.
    """

    hypothesis: Hypothesis
    gain: float
    values: dict[str, float]


@dataclass(frozen=True)
class Trial:
    """A mechanism at one of the values at which it is screened.

    Attributes
    ----------
    hypothesis : Hypothesis
        A single mechanism.
    values : dict of str to float
    own : mapping of str to float, or None
        Values that a frozen baseline has of this mechanism; None for any other.
    """

    hypothesis: Hypothesis
    values: dict[str, float]
    own: Mapping[str, float] | None = None

    def extrapolated(self, strength: float) -> dict[str, float] | None:
        """The values at another strength (1: as tried); None if the mechanism cannot have it."""
        if self.own is None:
            return scaled(self.hypothesis, self.values, strength)
        return changed(self.own, self.values, strength)

    def is_within(self, limits: Mapping[str, float]) -> bool:
        """Whether no value is above its limit."""
        return all(value <= limits.get(key, inf) for key, value in self.values.items())

    @property
    def but_for_strength(self) -> tuple | None:
        """What it has in common with trials of other strengths; None of a mechanism that is tried at many of them."""
        ((name, place),) = self.hypothesis.acting
        mechanism = registry.get(name)
        if self.own is not None or any(p.screening_grid for p in mechanism.strengths):
            return None
        values = {p.name: self.values[mechanism_key(name, place, p.name)] for p in mechanism.parameters}
        which = tuple(p.name for p in mechanism.strengths if values[p.name] != p.neutral)
        return name, place, which, *(values[p.name] for p in mechanism.shapes)

    @property
    def has_one_sign(self) -> bool:
        """Whether its strength cannot be negative."""
        if self.own is not None:
            return False
        return has_one_sign(self.hypothesis)


@dataclass(frozen=True)
class Screening:
    """Products of the directions of all trials with one another and with the residuals.

    Attributes
    ----------
    trials : list of Trial
    gram : ndarray, shape (trials, trials)
    product : ndarray, shape (trials,)
        Of minus the residuals with each direction: its size and sign are the strengths'.
    square : float
        Of the residuals, outside of what a recalibration absorbs.
    mechanisms : sequence of Hypothesis
        All that were screened, also those without a trial that can be run.
    """

    trials: list[Trial]
    gram: NDArray
    product: NDArray
    square: float
    mechanisms: Sequence[Hypothesis]

    def singles(self) -> list[Score]:
        """The best score of each mechanism, the largest gain first."""
        best = {h: Score(h, 0.0, {}) for h in self.mechanisms}
        for k, trial in enumerate(self.trials):
            found = self._score([k], np.array([self.product[k] / self.gram[k, k]]))
            if found is not None and found.gain > best[trial.hypothesis].gain:
                best[trial.hypothesis] = found
        return sorted(best.values(), key=lambda s: -s.gain)

    def sets(self, size: int) -> list[Score]:
        """The leading sets of `size` mechanisms, the largest gain first; each set of mechanisms once.

        A beam search: the leading sets of each size are extended by every trial of another mechanism.
        """
        beam: list[tuple[int, ...]] = [()]
        for _ in range(size):
            extended = {}
            for members in beam:
                for gain, k in self._extensions(members):
                    extended[tuple(sorted((*members, k)))] = gain
            beam = sorted(extended, key=lambda members: -extended[members])[: settings.BEAM]
        best: dict[frozenset, Score] = {}
        for members in beam:
            found = self._score(list(members), self._strengths(members))
            key = frozenset(self.trials[k].hypothesis.acting[0] for k in members)
            if found is not None and (key not in best or found.gain > best[key].gain):
                best[key] = found
        return sorted(best.values(), key=lambda s: -s.gain)

    def _extensions(self, members: tuple[int, ...]) -> Iterator[tuple[float, int]]:
        """Gain of each set that a trial of another mechanism extends, and that trial; only sets that can act."""
        taken = {self.trials[k].hypothesis for k in members}
        base = self.product[list(members)] @ self._strengths(members) if members else 0.0
        gains, left = base + self._gains(members), settings.BEAM
        for k in np.argsort(-gains, kind="stable").tolist():
            if left and self.trials[k].hypothesis not in taken and self._can_act((*members, k)):
                left -= 1
                yield float(gains[k]), k

    def _gains(self, members: tuple[int, ...]) -> NDArray:
        """Decrease of the sum of squares by each trial beside some others, shape (trials,)."""
        size, along = np.diag(self.gram), self.product
        if members:
            S = list(members)
            by_members = np.linalg.lstsq(self.gram[np.ix_(S, S)], self.gram[S], rcond=None)[0]
            size = size - np.einsum("sk,sk->k", self.gram[S], by_members)
            along = along - self.product[S] @ by_members
        # A trial that the others imitate adds nothing.
        is_new = size > settings.IMITATED * np.diag(self.gram)
        return np.divide(along**2, size, out=np.zeros_like(size), where=is_new)

    def _strengths(self, members: Sequence[int]) -> NDArray:
        S = list(members)
        return np.linalg.lstsq(self.gram[np.ix_(S, S)], self.product[S], rcond=None)[0]

    def _can_act(self, members: Sequence[int]) -> bool:
        """Whether the strengths with the largest gain are ones that the mechanisms can have."""
        strengths = self._strengths(members)
        return all(s > 0 or not self.trials[k].has_one_sign for s, k in zip(strengths, members, strict=True))

    def _score(self, members: Sequence[int], strengths: NDArray) -> Score | None:
        """Score of a set of trials, the strongest first; None if one of its mechanisms cannot have its strength."""
        values: dict[str, float] = {}
        hypothesis = Hypothesis()
        pairs = zip(members, strengths.tolist(), strict=True)
        for k, strength in sorted(pairs, key=lambda one: -(one[1] ** 2) * self.gram[one[0], one[0]]):
            extrapolated = self.trials[k].extrapolated(strength)
            if extrapolated is None:
                return None
            values |= extrapolated
            hypothesis = hypothesis.and_also(self.trials[k].hypothesis)
        return Score(hypothesis, float(self.product[list(members)] @ strengths) / self.square, values)


def screen(
    base: CandidateFit,
    hypotheses: Sequence[Hypothesis],
    deadline: Deadline = UNLIMITED,
    limits: Mapping[str, float] = MappingProxyType({}),
) -> Screening:
    """Screen mechanisms against a fitted model that they extend.

    Parameters
    ----------
    base : CandidateFit
    hypotheses : sequence of Hypothesis
        Single mechanisms.
    deadline : Deadline
        When the screening ends with the trials that were run until then.
    limits : mapping of str to float
        Upper limits of unknowns; trials beyond them are left out.
    """
    possible = ([t for t in trials_of(base, h) if t.is_within(limits)] for h in hypotheses)
    trials = [t for some in possible for t in leading(base, some, deadline)]
    return _screening(base, trials, hypotheses, deadline)


def _screening(
    base: CandidateFit, trials: Sequence[Trial], hypotheses: Sequence[Hypothesis], deadline: Deadline
) -> Screening:
    """Directions of trials outside of what a recalibration absorbs."""
    distances, derivatives = base.prior
    absorbed, _ = np.linalg.qr(np.concatenate([_stacked(base.whitened, base.jacobian), derivatives]))
    residuals = np.concatenate([_stacked(base.whitened, base.residuals), distances])
    residuals = residuals - absorbed @ (absorbed.T @ residuals)
    square = float(residuals @ residuals)
    usable, directions = [], []
    # Where a strength changes more than there is, the best one of the mechanism by itself is smaller: Cauchy-Schwarz.
    strong: set[tuple] = set()
    for trial in trials:
        if deadline.has_passed:
            break
        kind = trial.but_for_strength
        if kind in strong:
            continue
        direction = _direction(base, trial)
        # The model cannot be run with the mechanism, or a recalibration absorbs it.
        if direction is None or direction @ direction < ABSORBED:
            continue
        direction -= absorbed @ (absorbed.T @ direction)
        if direction @ direction >= ABSORBED:
            usable.append(trial)
            directions.append(direction.astype(np.float32))
        if kind is not None and direction @ direction > square:
            strong.add(kind)
    if not usable:
        return Screening([], np.empty((0, 0)), np.empty(0), square, hypotheses)
    D = np.stack(directions)
    product = -(D @ residuals.astype(np.float32))
    return Screening(usable, (D @ D.T).astype(float), product.astype(float), square, hypotheses)


def leading(base: CandidateFit, trials: list[Trial], deadline: Deadline = UNLIMITED) -> list[Trial]:
    """Of many trials of a mechanism, those that explain most in the few recordings that shake the load most.

    A load with inertia has many: a resonance that is a few per cent out of tune explains nothing.
    """
    shaken = np.argsort([-_acceleration(w) for w in base.whitened], kind="stable")[: settings.FEW_RECORDINGS].tolist()
    if len(trials) <= settings.MOST_TRIALS or len(shaken) == len(base.whitened):
        return trials
    part = replace(
        base,
        whitened=[base.whitened[i] for i in shaken],
        residuals=[base.residuals[i] for i in shaken],
        jacobian=[base.jacobian[i] for i in shaken],
    )
    found = _screening(part, trials, [trials[0].hypothesis], deadline)
    possible = [found.product[k] > 0 or not trial.has_one_sign for k, trial in enumerate(found.trials)]
    gains = np.where(possible, found.product**2 / np.diag(found.gram), 0.0)
    kept = {id(found.trials[k]) for k in np.argsort(-gains, kind="stable")[: settings.LEADING_TRIALS]}
    return [trial for trial in trials if id(trial) in kept]


def _acceleration(w: Whitened) -> float:
    """Root mean square acceleration of the drive in a recording, rad/s^2."""
    time_s = w.observations.given.recording.time_s
    rate = np.gradient(w.observations.given.theta_in, time_s)
    return float(np.sqrt(np.mean(np.gradient(rate, time_s) ** 2)))


def trials_of(base: CandidateFit, hypothesis: Hypothesis) -> Iterator[Trial]:
    """Values at which a mechanism is screened; of a frozen baseline's mechanism, a change of each of its values."""
    if hypothesis.acting[0] not in base.hypothesis.baseline:
        yield from (Trial(hypothesis, values) for values in hypothesis.screening_values())
        return
    model = base.hypothesis.of(base.whitened[0].observations.parameters)
    own = {key: model.value_of(key) for key in hypothesis.start}
    for key, value in own.items():
        yield Trial(hypothesis, own | {key: (1 + settings.SCREENED_CHANGE) * value}, own)


def _direction(base: CandidateFit, trial: Trial) -> NDArray | None:
    """Change of the weighted errors by a trial; None if the model cannot be run with it.

    If the fitted model runs on the exact solver and the trial on the general one, it contains the error of the latter's
    grid: between 32 and 64 cells in the median 1e-3 N and at most 0.01 N in the screening of one simulated batch, whose
    load cells have a noise of 0.05 N.
    """
    extended = base.hypothesis.and_also(trial.hypothesis)
    modelled = [w.with_parameters(extended.of(w.observations.parameters)) for w in base.whitened]
    every = {**base.values, **trial.values}
    try:
        moved = each(modelled, lambda i, w: w.errors(every) - base.residuals[i])
    except ModelError:
        return None
    return np.concatenate([_stacked(base.whitened, moved), np.zeros(base.prior[0].size)])


def _stacked(whitened: Sequence[Whitened], by_recording: Sequence[NDArray]) -> NDArray:
    """Rows of all recordings, each with its weight."""
    return np.concatenate([rows / np.sqrt(w.measured.size) for w, rows in zip(whitened, by_recording, strict=True)])


def changed(own: Mapping[str, float], values: Mapping[str, float], strength: float) -> dict[str, float]:
    """A change of a baseline's values extrapolated to another strength, without a change of sign."""
    share = float(np.clip(settings.SCREENED_CHANGE * strength, *settings.CHANGE_LIMITS)) / settings.SCREENED_CHANGE
    return {key: own[key] + share * (value - own[key]) for key, value in values.items()}


def has_one_sign(hypothesis: Hypothesis) -> bool:
    """Whether the strength of a single mechanism cannot be negative."""
    ((name, _),) = hypothesis.acting
    return not any(p.signed or p.ratio for p in registry.get(name).strengths)


def scaled(hypothesis: Hypothesis, values: Mapping[str, float], strength: float) -> dict[str, float] | None:
    """Screened values extrapolated to another strength; None if the mechanism cannot have it.

    A mechanism that states its screening grid for a strength is not linear in it: its values stay as they are.
    """
    ((name, place),) = hypothesis.acting
    strengths = registry.get(name).strengths
    if strength <= 0 and has_one_sign(hypothesis):
        return None
    if any(p.screening_grid for p in strengths):
        return dict(values)
    least, most = settings.EXTRAPOLATION
    strength = float(np.copysign(np.clip(abs(strength), least, most), strength))
    found = dict(values)
    for p in strengths:
        key = mechanism_key(name, place, p.name)
        found[key] = p.neutral + strength * (values[key] - p.neutral)
    return found
