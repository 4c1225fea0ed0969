"""Screening: a score test (Lagrange multiplier test) of every mechanism against a fitted model.

One run of the model with a mechanism at each of a few values gives the direction in which it changes the errors. The
part of that direction which a recalibration would absorb is projected out; the rest is compared with the residuals.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.failure import ModelError
from ccmodel.inference.pool import each
from ccmodel.model.parameters import mechanism_key


@dataclass(frozen=True)
class Score:
    """Result of the score test of a mechanism.

    Attributes
    ----------
    hypothesis : Hypothesis
    gain : float
        Predicted share of the mean square that the mechanism takes off, after recalibration.
    values : dict of str to float
        The best of the screened values, extrapolated to the strength with the largest gain; empty if none has a gain.
    """

    hypothesis: Hypothesis
    gain: float
    values: dict[str, float]


def screen(whitened: Sequence[Whitened], base: CandidateFit, hypotheses: Sequence[Hypothesis]) -> list[Score]:
    """Score tests of mechanisms against a fitted model that they extend, the largest gain first."""
    distances, derivatives = base.prior
    absorbed, _ = np.linalg.qr(np.concatenate([_stacked(whitened, base.jacobian), derivatives]))
    residuals = np.concatenate([_stacked(whitened, base.residuals), distances])
    test = _Test(whitened, base, absorbed, residuals - absorbed @ (absorbed.T @ residuals))
    return sorted((test.score(h) for h in hypotheses), key=lambda s: -s.gain)


@dataclass(frozen=True)
class _Test:
    """A fitted model's residuals, and the space of changes that a recalibration absorbs.

    Attributes
    ----------
    absorbed : ndarray, shape (rows, unknowns)
        Orthonormal basis of that space.
    residuals : ndarray, shape (rows,)
        Residuals outside of it, each recording weighted by its mean square.
    """

    whitened: Sequence[Whitened]
    base: CandidateFit
    absorbed: NDArray
    residuals: NDArray

    def score(self, hypothesis: Hypothesis) -> Score:
        """The best over the values at which the mechanism is screened."""
        own = self._baseline_values(hypothesis)
        if own is None:
            screened = hypothesis.screening_values()
        else:
            screened = (own | {key: (1 + settings.SCREENED_CHANGE) * value} for key, value in own.items())
        best = Score(hypothesis, 0.0, {})
        for values in screened:
            found = self._at(hypothesis, values, own)
            if found is not None and found.gain > best.gain:
                best = found
        return best

    def _at(self, hypothesis: Hypothesis, values: dict[str, float], own: Mapping[str, float] | None) -> Score | None:
        direction = self._direction(hypothesis, values)
        size = 0.0 if direction is None else float(direction @ direction)
        # A recalibration absorbs the mechanism, or the model cannot be run with it.
        if size < 1e-12:
            return None
        strength = -float(direction @ self.residuals) / size
        gain = strength**2 * size / float(self.residuals @ self.residuals)
        extrapolated = scaled(hypothesis, values, strength) if own is None else changed(own, values, strength)
        return None if extrapolated is None else Score(hypothesis, gain, extrapolated)

    def _direction(self, hypothesis: Hypothesis, values: Mapping[str, float]) -> NDArray | None:
        """Change of the weighted errors that a recalibration does not absorb."""
        extended = self.base.hypothesis.and_also(hypothesis)
        modelled = [w.with_parameters(extended.of(w.observations.parameters)) for w in self.whitened]
        every = {**self.base.values, **values}
        try:
            moved = each(modelled, lambda i, w: w.errors(every) - self.base.residuals[i])
        except ModelError:
            return None
        d = np.concatenate([_stacked(self.whitened, moved), np.zeros(self.base.prior[0].size)])
        return d - self.absorbed @ (self.absorbed.T @ d)

    def _baseline_values(self, hypothesis: Hypothesis) -> dict[str, float] | None:
        """Values of a mechanism that a frozen baseline has already; None for any other."""
        if hypothesis.acting[0] not in self.base.hypothesis.baseline:
            return None
        model = self.base.hypothesis.of(self.whitened[0].observations.parameters)
        return {key: model.value_of(key) for key in hypothesis.start}


def _stacked(whitened: Sequence[Whitened], by_recording: Sequence[NDArray]) -> NDArray:
    """Rows of all recordings, each with its weight."""
    return np.concatenate([rows / np.sqrt(w.measured.size) for w, rows in zip(whitened, by_recording, strict=True)])


def changed(own: Mapping[str, float], values: Mapping[str, float], strength: float) -> dict[str, float]:
    """A change of a baseline's values extrapolated to another strength, without a change of sign."""
    share = float(np.clip(settings.SCREENED_CHANGE * strength, -0.9, 10.0)) / settings.SCREENED_CHANGE
    return {key: own[key] + share * (value - own[key]) for key, value in values.items()}


def scaled(hypothesis: Hypothesis, values: Mapping[str, float], strength: float) -> dict[str, float] | None:
    """Screened values extrapolated to another strength; None if the mechanism cannot have it.

    A mechanism that states its screening grid for a strength is not linear in it: its values stay as they are.
    """
    ((name, place),) = hypothesis.acting
    strengths = registry.get(name).strengths
    if strength <= 0 and not any(p.signed or p.ratio for p in strengths):
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
