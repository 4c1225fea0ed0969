"""Comparison of candidate models: posterior probabilities, adequacy, and the probability of misspecification.

The log posterior of a candidate is its log evidence plus a log prior. The evidence is that of the BIC, computed from
leave-one-out mean squares with an effective sample size instead of the number of samples, and integrated over what the
mechanisms' equations may leave (`log_evidence`). Leave-one-out mean squares already penalise superfluous unknowns; the
BIC penalises them a second time.

The posterior assumes a closed world: one of the candidates is correct. In fact the missing physics may be outside the
list of mechanisms, and the best candidate may only imitate it. `Comparison.well_specified` is the probability that this
is not so. The confidence in a candidate is the product of both probabilities.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress

import numpy as np
from scipy.stats import norm

from ccmodel import mechanisms as registry
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.lack_of_fit import LackOfFit, lack_of_fit
from ccmodel.diagnosis.repeatability import FRICTION, friction_probabilities, friction_repeats, log_bayes_factor
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.inference.effective_samples import in_comparison

# Model-form error, over the scatter of mean squares, below which it changes no probability.
NEGLIGIBLE = 1e-3


@dataclass(frozen=True)
class Comparison:
    """Candidate models fitted to the same whitened observations.

    Attributes
    ----------
    whitened : sequence of Whitened
    base : CandidateFit
        The calibrated model.
    candidates : list of CandidateFit
        The calibrated model with mechanisms, by ascending leave-one-out mean square; those with a strength
        outside its plausible range last.
    passed_over : list of CandidateFit
        Fitted sets of mechanisms that do not improve enough on a part of theirs (`improves_on_members`), likewise.
    lack_of_fit : mapping of Hypothesis to LackOfFit
        Of the calibrated model, the candidates with the lowest mean squares and the most probable one.
    screened : int
        Number of hypotheses that were screened, among which the prior probability is shared.
    linearised_about : CandidateFit or None
        The candidate, with its values, about which the covariance is linearised; None for the model of the first fit.
    """

    whitened: Sequence[Whitened]
    base: CandidateFit
    candidates: list[CandidateFit]
    lack_of_fit: Mapping[Hypothesis, LackOfFit]
    screened: int = 0
    linearised_about: CandidateFit | None = None
    passed_over: Sequence[CandidateFit] = ()

    @classmethod
    def of(
        cls,
        whitened: Sequence[Whitened],
        base: CandidateFit,
        candidates: Sequence[CandidateFit],
        screened: int = 0,
        linearised_about: CandidateFit | None = None,
    ) -> "Comparison":
        """Order the candidates, and compute the lack of fit of those that may be named."""
        every = sorted(candidates, key=lambda c: (not c.is_plausible, c.mean_square))
        improves = [improves_on_members(c, every) for c in every]
        ordered = list(compress(every, improves))
        others = [c for c, better in zip(every, improves, strict=True) if not better]
        found = cls(whitened, base, ordered, {}, screened, linearised_about, others)
        contenders = {c.hypothesis: c for c in [base, *ordered[: settings.CONTENDERS], found.most_probable]}
        lacks = {hypothesis: lack_of_fit(c) for hypothesis, c in contenders.items()}
        return replace(found, lack_of_fit=lacks)

    @property
    def fitted(self) -> list[CandidateFit]:
        """All that were fitted, by ascending mean square; those with a strength outside its plausible range last."""
        return sorted([*self.candidates, *self.passed_over], key=lambda c: (not c.is_plausible, c.mean_square))

    def is_linearised_about(self, candidate: CandidateFit) -> bool:
        """Whether the covariance is linearised about these mechanisms, within a standard deviation of each value."""
        about = self.linearised_about
        if about is None or about.hypothesis != candidate.hypothesis:
            return False
        moved = np.array([candidate.values[name] - value for name, value in about.values.items()])
        return bool(np.all(np.abs(moved) <= candidate.standard_deviations()))

    @cached_property
    def posterior(self) -> list[float]:
        """Closed-world posterior probability of each candidate; the remainder is the calibrated model's.

        It is the log evidence plus a log prior. The noise is max(1, m_min), with m_min the lowest leave-one-out mean
        square of all candidates and the calibrated model.

        The calibrated model has the prior `PRIOR_AGREES`. All screened hypotheses share the rest equally, whether or
        not they were fitted: the best of many is good by chance. An implausible candidate has probability zero.
        """
        every = [self.base, *self.candidates]
        mean_squares = np.array([c.mean_square for c in every])
        evidence = np.array([self.log_evidence(c, max(1.0, mean_squares.min())) for c in every])
        count = len(self.candidates)
        prior_of_each = (1 - settings.PRIOR_AGREES) / max(self.screened, count, 1)
        log_posterior = evidence + np.log([settings.PRIOR_AGREES, *[prior_of_each] * count])
        log_posterior[1:][[not c.is_plausible for c in self.candidates]] = -np.inf
        weight = np.exp(log_posterior - log_posterior.max())
        return (weight / weight.sum())[1:].tolist()

    def log_evidence(self, candidate: CandidateFit, noise: float) -> float:
        """Logarithm of the evidence of a candidate at a mean square `noise` of the noise, up to a constant.

        It is the log likelihood less p/2 ln N, with N the effective sample size and p the number of unknowns that the
        candidate has in addition to the calibrated model's. Without the integral over the model-form error it is
        -BIC/2. Friction that does not repeat speaks against a candidate: whitening keeps it out of the mean square.
        """
        samples = in_comparison([w.observations for w in self.whitened])
        unknowns = len(candidate.values) - len(self.base.values)
        above, form = candidate.mean_square - 1.0, self.form_error(candidate)
        tests = friction_probabilities(candidate.whitened, candidate.residuals, FRICTION in candidate.values)
        repeats = sum(map(log_bayes_factor, tests))
        return log_likelihood(above, form, samples / (2 * noise)) + repeats - unknowns * float(np.log(samples)) / 2

    @property
    def most_probable(self) -> CandidateFit:
        """The candidate with the highest posterior probability; the calibrated model if there are no candidates."""
        return self.candidates[int(np.argmax(self.posterior))] if self.candidates else self.base

    @property
    def excess(self) -> float:
        """Mean square of the calibrated model minus 1, that of noise; at least 0."""
        return max(self.base.mean_square - 1.0, 0.0)

    def is_adequate(self, candidate: CandidateFit) -> bool:
        """Whether the mean square and the lack of fit of a candidate are as low as the true physics could leave them.

        The limits allow for noise and for the model-form error of the added mechanisms. Friction must differ between
        recordings by no more than from run to run.
        """
        lack = self.lack_of_fit.get(candidate.hypothesis)
        if lack is None or not candidate.is_plausible:
            return False
        if not friction_repeats(candidate.whitened, candidate.residuals, FRICTION in candidate.values):
            return False
        highest_lack = settings.ADEQUATE_LACK_OF_FIT + self.form_error(candidate)
        return candidate.mean_square <= self.adequate_mean_square(candidate) and lack.lower_bound <= highest_lack

    def adequate_mean_square(self, candidate: CandidateFit) -> float:
        """Highest mean square of an adequate candidate; the calibrated model gets no allowance for its form."""
        if candidate is self.base:
            return settings.ADEQUATE
        limit = settings.ADEQUATE_SET if candidate.hypothesis.size > 1 else settings.ADEQUATE
        return limit + max(settings.ADEQUATE_SHARE / _imitations(candidate) * self.excess, self.form_error(candidate))

    def form_error(self, candidate: CandidateFit) -> float:
        """Mean square that the equations of a candidate's mechanisms may leave: of each, a share of its own effect.

        The effect of a mechanism is the decrease of the mean square from the candidate without it, where that was
        fitted, and otherwise from the calibrated model.
        """
        fitted = {frozenset(c.hypothesis.acting): c.mean_square for c in [self.base, *self.fitted]}
        members = frozenset(candidate.hypothesis.acting)
        return sum(
            registry.get(one[0]).model_form_error
            * max(fitted.get(members - {one}, self.base.mean_square) - max(candidate.mean_square, 1.0), 0.0)
            for one in members
        )

    @property
    def has_adequate(self) -> bool:
        """Whether the candidate with the lowest mean square is adequate."""
        return bool(self.candidates) and self.is_adequate(self.candidates[0])

    @property
    def is_sufficient(self) -> bool:
        """Whether no further mechanism is needed: the best candidate is adequate and close to the noise.

        Also true without candidates, since a further mechanism is only added to a first.
        """
        if not self.has_adequate:
            return not self.candidates
        best = self.candidates[0]
        return best.mean_square <= settings.SUFFICIENT + self.form_error(best)

    @property
    def well_specified(self) -> float:
        """Probability that the most probable candidate is correct and no imitation, times `_discount`."""
        if not self.candidates:
            return self._discount
        best = self.most_probable
        return self._discount * well_specified(best, self.base, self.form_error(best))

    @property
    def _discount(self) -> float:
        """Factor on the confidence, below 1 where the test of adequacy is weak.

        The test is weak for a single recording, which leaves none to hold out; for an initial tension that is not
        observed and therefore fitted; and as far as a tolerance takes the place of measured noise.
        """
        is_weak = len(self.whitened) == 1 or "pretension_share" in self.base.free
        share = 1.0 if is_weak else np.mean([w.observations.tolerance_share for w in self.whitened])
        return float(settings.UNTESTED**share)


def is_part_of(candidate: CandidateFit, other: CandidateFit) -> bool:
    """Whether another candidate has all of its mechanisms and more."""
    return set(candidate.hypothesis.acting) < set(other.hypothesis.acting)


def improves_on_members(candidate: CandidateFit, candidates: Sequence[CandidateFit]) -> bool:
    """Whether a set halves the excess mean square of each candidate with fewer of its members; true of a single."""
    lowest = candidate.mean_square
    parts = [c.mean_square for c in candidates if is_part_of(c, candidate)]
    return all(lowest - 1 < settings.SET_SHARE * (part - 1) and lowest < part for part in parts)


def log_likelihood(above: float, form_error: float, rate: float) -> float:
    """Log likelihood of a mean square that is `above` that of noise, up to a constant.

    A model that leaves a mean square g beside the noise has the likelihood exp(-rate |above - g|). Every second
    candidate is exact: g = 0. Of the others g is uniform from 0 to `form_error`. What a true mechanism's equation
    misses is therefore no evidence for a further mechanism that imitates it.
    """
    exact, most = -rate * above, rate * form_error
    if most < NEGLIGIBLE:
        return exact
    inside = float(np.clip(above, 0.0, form_error))
    area = -np.expm1(-rate * inside) - np.expm1(-rate * (form_error - inside))
    simplified = -rate * abs(above - inside) + np.log(area / most)
    return float(np.logaddexp(exact, simplified) - np.log(2))


def well_specified(candidate: CandidateFit, base: CandidateFit, form_error: float) -> float:
    """Probability that a candidate is the missing physics and no imitation of it, given the candidate's mean square.

    Bayes' rule with the prior `PRIOR_MISSPECIFIED` and two densities of the mean square above `CORRECT_LEVEL`
    (`form_error`: as of `Comparison.form_error`):

    - of a correct candidate: normal about zero. In every second case a half-normal model-form error is added, because
      the real effect does not follow the mechanism's equation exactly;
    - of an imitation: uniform from zero to the excess of the calibrated model. A set is taken for the best of several
      imitations, with the density of the smallest of as many uniform variables.
    """
    excess = max(base.mean_square - settings.CORRECT_LEVEL, settings.CORRECT_SPREAD)
    above = candidate.mean_square - settings.CORRECT_LEVEL
    form = max(settings.FORM_SHARE * excess, form_error)
    width = np.hypot(settings.CORRECT_SPREAD, form)
    exact = norm.pdf(above, scale=settings.CORRECT_SPREAD)
    # The half-normal form error convolved with the normal scatter of correct models.
    simplified = 2 * norm.pdf(above, scale=width) * norm.cdf(above * form / (settings.CORRECT_SPREAD * width))
    n = _imitations(candidate)
    share = float(np.clip(above / excess, 0.0, 1.0))
    # The uniform density begins at zero with the scatter of correct models instead of a step.
    imitation = norm.cdf(above / settings.CORRECT_SPREAD) * n * (1 - share) ** (n - 1) / excess
    correct = (1 - settings.PRIOR_MISSPECIFIED) * (exact + simplified) / 2
    return float(correct / (correct + settings.PRIOR_MISSPECIFIED * imitation))


def _imitations(candidate: CandidateFit) -> int:
    """Number of imitations of which a candidate may be the best: for a set the partners that were fitted, else one."""
    return settings.PARTNERS if candidate.hypothesis.size > 1 else 1
