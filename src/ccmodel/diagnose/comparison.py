"""Comparison of candidate models: posterior probabilities, adequacy, and the probability of misspecification.

The log posterior of a candidate is -BIC/2 plus a log prior. The BIC is computed from leave-one-out mean squares, with
an effective sample size instead of the number of samples. These mean squares are held out already, so that the BIC's
penalty on the number of unknowns comes on top of cross-validation.

This posterior assumes a closed world: one of the candidates is correct. The probability that none is, and that the best
candidate only imitates the missing physics, is worked out from its mean square and multiplies every probability.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from ccmodel.diagnose import settings
from ccmodel.diagnose.candidate import CandidateFit
from ccmodel.diagnose.hypothesis import Hypothesis
from ccmodel.diagnose.lack_of_fit import LackOfFit, lack_of_fit
from ccmodel.diagnose.whitening import Whitened
from ccmodel.inference.effective_samples import in_comparison


@dataclass(frozen=True)
class Comparison:
    """Candidate models fitted to the same whitened observations.

    Attributes
    ----------
    whitened : sequence of Whitened
    base : CandidateFit
        The calibrated model.
    candidates : list of CandidateFit
        Its extensions, by leave-one-out mean square; implausible ones last.
    lack_of_fit : mapping of Hypothesis to LackOfFit
        Of the calibrated model and the leading candidates.
    screened : int
        Number of hypotheses from which the candidates were chosen.
    """

    whitened: Sequence[Whitened]
    base: CandidateFit
    candidates: list[CandidateFit]
    lack_of_fit: Mapping[Hypothesis, LackOfFit]
    screened: int = 0

    @classmethod
    def of(
        cls, whitened: Sequence[Whitened], base: CandidateFit, candidates: Sequence[CandidateFit], screened: int = 0
    ) -> "Comparison":
        """Candidates in their order, with the lack of fit of the leading and the most probable."""
        ordered = sorted(candidates, key=lambda c: (not c.is_plausible, c.mean_square))
        likely = np.argsort(posterior(whitened, base, ordered, screened))[-1:]
        contenders = {c.hypothesis: c for c in [base, *ordered[: settings.CONTENDERS], *(ordered[k] for k in likely)]}
        lacks = {hypothesis: lack_of_fit(whitened, c) for hypothesis, c in contenders.items()}
        return cls(whitened, base, ordered, lacks, screened)

    @property
    def posterior(self) -> list[float]:
        """Closed-world posterior probability of each candidate; the remainder is the calibrated model's."""
        return posterior(self.whitened, self.base, self.candidates, self.screened)

    @property
    def most_probable(self) -> CandidateFit:
        """The candidate with the highest posterior; the calibrated model without candidates."""
        return self.candidates[int(np.argmax(self.posterior))] if self.candidates else self.base

    @property
    def excess(self) -> float:
        """Mean square of the calibrated model above the noise."""
        return max(self.base.mean_square - 1.0, 0.0)

    def is_adequate(self, candidate: CandidateFit) -> bool:
        """Whether a candidate leaves no more than noise and model-form error, without predictable residuals."""
        lack = self.lack_of_fit.get(candidate.hypothesis)
        form = candidate.hypothesis.model_form_error
        if lack is None or not candidate.is_plausible:
            return False
        if candidate is self.base and candidate.mean_square > settings.ADEQUATE:
            return False
        most = settings.ADEQUATE_PAIR if candidate.hypothesis.is_pair else settings.ADEQUATE
        most += max(settings.ADEQUATE_SHARE / _imitations(candidate), form) * self.excess
        return candidate.mean_square <= most and lack.lower_bound <= settings.ADEQUATE_LACK_OF_FIT + form * self.excess

    @property
    def has_adequate(self) -> bool:
        """Whether the best candidate is adequate."""
        return bool(self.candidates) and self.is_adequate(self.candidates[0])

    @property
    def is_sufficient(self) -> bool:
        """Whether there is no candidate to improve on, or the best leaves no room for another mechanism."""
        if not self.has_adequate:
            return not self.candidates
        best = self.candidates[0]
        return best.mean_square <= settings.SUFFICIENT + best.hypothesis.model_form_error * self.excess

    @property
    def well_specified(self) -> float:
        """Probability that the most probable candidate is correct and no imitation, as far as it could be tested."""
        if not self.candidates:
            return self._tested
        return self._tested * well_specified(self.most_probable, self.base)

    @property
    def _tested(self) -> float:
        """Confidence discount: below one where adequacy is not tested against held-out noise."""
        untested = len(self.whitened) == 1 or "pretension_share" in self.base.free
        share = 1.0 if untested else np.mean([w.observations.tolerance_share for w in self.whitened])
        return float(settings.UNTESTED**share)


def posterior(
    whitened: Sequence[Whitened], base: CandidateFit, candidates: Sequence[CandidateFit], screened: int
) -> list[float]:
    """Posterior probability of each candidate, -BIC/2 plus a log prior; the remainder is the calibrated model's.

    With effective sample size N, leave-one-out mean square m, smallest of all max(1, m_min) and p further unknowns, the
    BIC is N m / max(1, m_min) + p ln N. The calibrated model has the prior `PRIOR_AGREES`, and all screened hypotheses
    share the rest equally, since the best of many is good by chance. An implausible candidate has probability zero.
    """
    if not candidates:
        return []
    samples = in_comparison([w.observations for w in whitened])
    mean_squares = np.array([base.mean_square, *(c.mean_square for c in candidates)])
    unknowns = np.array([0, *(len(c.values) - len(base.values) for c in candidates)])
    bic = samples * mean_squares / max(1.0, mean_squares.min()) + unknowns * np.log(samples)
    each = (1 - settings.PRIOR_AGREES) / max(screened, len(candidates))
    log = -bic / 2 + np.log([settings.PRIOR_AGREES, *[each] * len(candidates)])
    log[1:][[not c.is_plausible for c in candidates]] = -np.inf
    weight = np.exp(log - log.max())
    return (weight / weight.sum())[1:].tolist()


def well_specified(candidate: CandidateFit, base: CandidateFit) -> float:
    """Probability that the missing physics is a mechanism of the registry, given a candidate's mean square.

    By Bayes' rule from two densities of the mean square. A correct candidate comes to the noise, with a half-normal
    model-form error in every second case. An imitation comes to any share of the calibrated model's excess with the
    same density, and the best of several imitations to the lowest of as many shares.
    """
    excess = max(base.mean_square - settings.CORRECT_LEVEL, settings.CORRECT_SPREAD)
    over = candidate.mean_square - settings.CORRECT_LEVEL
    form = max(settings.FORM_SHARE, candidate.hypothesis.model_form_error) * excess
    width = np.hypot(settings.CORRECT_SPREAD, form)
    exact = norm.pdf(over, scale=settings.CORRECT_SPREAD)
    # A half-normal form error convolved with the normal scatter of correct models.
    simplified = 2 * norm.pdf(over, scale=width) * norm.cdf(over * form / (settings.CORRECT_SPREAD * width))
    n = _imitations(candidate)
    share = float(np.clip(over / excess, 0.0, 1.0))
    imitation = norm.cdf(over / settings.CORRECT_SPREAD) * n * (1 - share) ** (n - 1) / excess
    correct = (1 - settings.PRIOR_MISSPECIFIED) * (exact + simplified) / 2
    return float(correct / (correct + settings.PRIOR_MISSPECIFIED * imitation))


def _imitations(candidate: CandidateFit) -> int:
    """Number of independent imitations of which a candidate may be the best: a pair's partners, otherwise one."""
    return settings.PARTNERS if candidate.hypothesis.is_pair else 1
