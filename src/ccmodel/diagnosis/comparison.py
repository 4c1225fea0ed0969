"""Comparison of candidate models: the posterior probability that each is complete, and that something is missing.

Every candidate is two hypotheses. It is *complete*: nothing else is missing, and it is exact or has a model-form error,
a share of its own effect. Or it is *incomplete*: an unlisted effect is missing too, a discrepancy with a mean square
from `SMALLEST_MISSING` to the excess of the calibrated model times `LARGEST_MISSING`. The calibrated model is a
candidate like any other, so unlisted effects compete with listed mechanisms.

The log posterior of each is its log evidence (`ccmodel.diagnosis.discrepancy`) plus a log prior, which follows from the
number of mechanisms; all that were screened are equally probable.

A mechanism may also only imitate what is missing, and better than a Gaussian process does. What it takes off has three
explanations (`imitation`), which the share that it leaves tells apart: an effect's own mechanism leaves little, the
best imitation of something unlisted leaves any share, and a mechanism that only fits what another one's equation leaves
takes off little of it.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import comb, exp, log

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit, discretisation_shift
from ccmodel.diagnosis.discrepancy import Discrepancy, Evidence, evidence_of
from ccmodel.diagnosis.hypothesis import Hypothesis, laws_in
from ccmodel.diagnosis.repeatability import FrictionPValues, friction_p_values
from ccmodel.diagnosis.spreads import FRICTION, FRICTION_SCALE
from ccmodel.diagnosis.whitening import Whitened

# Beyond it, an exponential function is infinite.
LARGEST_EXPONENT = 700.0


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
    evidence : mapping of Hypothesis to Evidence
        Of the calibrated model and of each candidate.
    screened : int
        Number of hypotheses that were screened, among which the prior probability is shared.
    linearised_about : CandidateFit or None
        The candidate, with its values, about which the covariance is linearised; None for the model of the first fit.
    discrepancy : Discrepancy or None
        From which the evidence was computed.
    laws_beside : frozenset of Hypothesis
        Models, the calibrated one or candidates, beside each of which every law that may be learned was proposed and
        the leading ones fitted.
    """

    whitened: Sequence[Whitened]
    base: CandidateFit
    candidates: list[CandidateFit]
    evidence: Mapping[Hypothesis, Evidence]
    screened: int = 0
    linearised_about: CandidateFit | None = None
    discrepancy: Discrepancy | None = field(default=None, repr=False)
    laws_beside: frozenset[Hypothesis] = frozenset()

    @classmethod
    def of(
        cls,
        whitened: Sequence[Whitened],
        base: CandidateFit,
        candidates: Sequence[CandidateFit],
        screened: int = 0,
        linearised_about: CandidateFit | None = None,
        laws_beside: frozenset[Hypothesis] = frozenset(),
    ) -> "Comparison":
        """Order the candidates, and compute their evidence."""
        discrepancy = Discrepancy.of(whitened, base)
        nothing = cls(whitened, base, [], {}, screened, linearised_about, discrepancy, laws_beside)
        return nothing.with_candidates(candidates)

    def _evidence_of(self, candidate: CandidateFit) -> Evidence:
        assert self.discrepancy is not None
        part = self.part_of(candidate)
        effect = max(part.mean_square - 1.0, 0.0) if part else 0.0
        return evidence_of(self.discrepancy, candidate, effect, self.excess)

    def with_candidates(self, candidates: Sequence[CandidateFit]) -> "Comparison":
        """The same with other candidates, fitted to the same whitened observations; of each set its best fit."""
        ordered = sorted(lowest(candidates), key=_rank)
        found = replace(self, candidates=ordered, evidence={})
        return replace(found, evidence={c.hypothesis: found._evidence_of(c) for c in [self.base, *ordered]})

    def with_discretisation(self, candidate: CandidateFit) -> "Comparison":
        """The same with the discretisation error of a candidate's values, and of those of its parts (`part_of`).

        Raises
        ------
        ModelError
            If one of them cannot be run on the finer solver.
        """
        known: dict[Hypothesis, CandidateFit] = {}
        part: CandidateFit | None = candidate
        while part is not None and part is not self.base:
            if part.shift is None:
                known[part.hypothesis] = replace(part, shift=discretisation_shift(part))
            part = self.part_of(part)
        return replace(self, candidates=[known.get(c.hypothesis, c) for c in self.candidates])

    def is_linearised_about(self, candidate: CandidateFit) -> bool:
        """Whether the covariance is linearised about these mechanisms, within a standard deviation of each value."""
        about = self.linearised_about
        if about is None or about.hypothesis != candidate.hypothesis:
            return False
        moved = np.array([candidate.values[name] - value for name, value in about.values.items()])
        return bool(np.all(np.abs(moved) <= candidate.standard_deviations()))

    @property
    def excess(self) -> float:
        """Mean square of the calibrated model minus 1, that of noise; at least 0."""
        return max(self.base.mean_square - 1.0, 0.0)

    def part_of(self, candidate: CandidateFit) -> CandidateFit | None:
        """The fitted candidate whose mechanisms this one extends by as few as possible; of several the best fit.

        It is the calibrated model if there is none. The calibrated model extends nothing: None.
        """
        if candidate is self.base:
            return None
        parts = [c for c in self.candidates if c.is_plausible and is_part_of(c, candidate)]
        return min(parts, key=lambda c: (-c.hypothesis.size, c.mean_square), default=self.base)

    @cached_property
    def log_weights(self) -> NDArray:
        """Log evidence plus log prior that a candidate is complete, and that it is not; shape (1 + candidates, 2).

        The calibrated model comes first. A candidate with a strength outside its plausible range has none.
        """
        found = []
        for candidate in [self.base, *self.candidates]:
            evidence, friction = self.evidence[candidate.hypothesis], self.friction[candidate.hypothesis]
            repeats = friction.log_factor
            priors = log_priors(candidate.hypothesis.size, self._alike)
            # What no list holds is any law of any slot.
            unlisted = log((1 - settings.PRIOR_LISTED) / settings.PRIOR_LISTED)
            priors = priors + len(laws_in(candidate.hypothesis)) * unlisted
            complete = evidence.exact
            if candidate is not self.base:
                by_law = log(settings.SAME_LAW), log(1 - settings.SAME_LAW)
                complete = float(np.logaddexp(evidence.exact + by_law[0], evidence.other_law + by_law[1]))
            # What an effect does to friction alone, which each recording has of its own, leaves no residuals. A trend
            # is that of a listed mechanism.
            with np.errstate(divide="ignore"):
                share = -settings.IN_FRICTION * np.expm1(friction.log_factor_about_trend)
                in_friction = complete + np.log(share)
            incomplete = np.logaddexp(evidence.incomplete + repeats, in_friction)
            weights = np.array([complete + repeats, incomplete]) + priors
            is_possible = candidate is self.base or candidate.is_plausible
            found.append(weights if is_possible else np.full(2, -np.inf))
        return np.array(found)

    @property
    def _alike(self) -> int:
        """Number of hypotheses among which the prior probability is shared."""
        return max(self.screened, len(self.candidates))

    def log_prior(self, size: int) -> float:
        """Log prior that a set of `size` listed mechanisms is complete."""
        return float(log_priors(size, self._alike)[0])

    def is_far_behind(self, candidate: CandidateFit) -> bool:
        """Whether a candidate has a far lower weight than the leading one; False of one that is not plausible."""
        by_candidate = np.logaddexp.reduce(self.log_weights, axis=1)
        own = by_candidate[[self.base, *self.candidates].index(candidate)]
        return bool(np.isfinite(own) and own < by_candidate.max() - settings.FAR_BEHIND)

    @cached_property
    def log_posterior(self) -> NDArray:
        """Log posterior probabilities, arranged as `log_weights`.

        The probability that a mechanism is an imitation goes to the set without it. What `settings.DISCOUNT` takes from
        all sets goes to the incomplete calibrated model.
        """
        every, weights = [self.base, *self.candidates], self.log_weights.copy()
        # By candidate: log weights that it is incomplete, from larger sets of which a member imitates what is unlisted.
        inherited: list[list[tuple[float, CandidateFit]]] = [[] for _ in every]
        for k in sorted(range(1, len(every)), key=lambda k: -every[k].hypothesis.size):
            part = self.part_of(every[k])
            assert part is not None
            p = every.index(part)
            true, of_part, other = self._log_imitation(every[k], part)
            total = np.logaddexp.reduce(weights[k])
            # What an imitation of the part's remainder leaves is that remainder too, and nothing unlisted.
            weights[p, 0] = np.logaddexp(weights[p, 0], total + of_part)
            inherited[p].append((total + other, every[k]))
            weights[k] += true
            for weight, larger in inherited[k]:
                true, *imitates = self._log_imitation(every[k], part, larger)
                weights[k, 1] = np.logaddexp(weights[k, 1], weight + true)
                inherited[p].append((weight + np.logaddexp(*imitates), larger))
        weights[0, 1] = np.logaddexp.reduce([weights[0, 1], *(weight for weight, _ in inherited[0])])
        weights -= np.logaddexp.reduce(weights, axis=None)
        if self._discount < 1:
            discounted = float(np.logaddexp.reduce(weights[1:], axis=None, initial=-np.inf)) + np.log1p(-self._discount)
            weights[0, 1] = np.logaddexp(weights[0, 1], discounted)
            weights[1:] += log(self._discount)
        return weights

    def _log_imitation(
        self, candidate: CandidateFit, part: CandidateFit, larger: CandidateFit | None = None
    ) -> NDArray:
        """Log probabilities of the three explanations of what a candidate takes off beyond its part; shape (3,).

        Beside what is unlisted, which a `larger` set imitates, a candidate leaves that too, and this is no lack of fit
        of its own: it takes off what the larger set does beside the same set without the mechanisms in question.
        """
        further = set(candidate.hypothesis.acting) - set(part.hypothesis.acting)
        share, smallest = self._left(candidate, part)
        if any(registry.get(name).drift == FRICTION_SCALE for name, _ in further):
            share = max(share, self._friction_left(candidate, part))
        if larger is not None and (without := self.without(larger, further)) is not None:
            share, smallest = min((share, smallest), self._left(larger, without))
        support = min(candidate.log_support(*one) for one in further)
        is_law = bool(laws_in(Hypothesis(tuple(further))))
        # Where a mechanism visibly leaves something and no law does better, what is missing may be no law at all.
        laws_tried = part.hypothesis in self.laws_beside and share <= smallest
        has_part = part is not self.base
        found = imitation(share, smallest, priors_of_further(has_part, is_law, laws_tried))
        # That no law fits better does not support a strength that differs from recording to recording.
        with np.errstate(divide="ignore"):
            return np.log(limited(found, priors_of_further(has_part, is_law)[0], support))

    def _left(self, candidate: CandidateFit, part: CandidateFit) -> tuple[float, float]:
        """Share of a part's lack of fit that a candidate leaves, and the least share that would be noticed."""
        before = max(self.unexplained_mean_square(part), self.evidence[part.hypothesis].resolution, 1e-12)
        resolution = self.evidence[candidate.hypothesis].resolution
        return min(self.unexplained_mean_square(candidate) / before, 1.0), min(resolution / before, 1.0)

    def _friction_left(self, candidate: CandidateFit, part: CandidateFit) -> float:
        """Share of how friction differs from recording to recording that a candidate with a drift leaves to its part.

        It is measured by the logarithm of the Bayes factor, which residuals do not show.
        """
        after, before = (self.friction[c.hypothesis].log_factor for c in (candidate, part))
        return min(after / before, 1.0) if before < 0.0 else 0.0

    @cached_property
    def friction(self) -> dict[Hypothesis, FrictionPValues]:
        """`friction_of` the base and each candidate."""
        return {c.hypothesis: friction_of(c) for c in [self.base, *self.candidates]}

    def is_good(self, candidate: CandidateFit) -> bool:
        """Whether a candidate's fit is good, and friction differs between recordings as from run to run."""
        return candidate.is_good and self.friction[candidate.hypothesis].log_factor > settings.FRICTION_SCATTERS

    def without(self, candidate: CandidateFit, members: set[tuple[str, str]]) -> CandidateFit | None:
        """The fitted candidate of the same mechanisms but for some; None if they were not fitted."""
        wanted = set(candidate.hypothesis.acting) - members
        return next((c for c in self.candidates if c.is_plausible and set(c.hypothesis.acting) == wanted), None)

    def unexplained_mean_square(self, candidate: CandidateFit) -> float:
        """Mean square above the noise that a candidate does not explain (1: noise).

        It is the size of its discrepancy, limited to within `SCATTER` of its excess mean square: errors that are no
        function of the rig's state, such as slips at other instants, show in the mean square only.
        """
        lowest = min(c.mean_square for c in [self.base, *self.candidates])
        noise = 1.0 + float(np.clip(lowest - 1.0, 0.0, settings.MISSTATED_NOISE))
        above = candidate.mean_square - noise
        size = self.evidence[candidate.hypothesis].size
        return max(min(size, above + settings.SCATTER), above - settings.SCATTER, 0.0)

    @property
    def probability(self) -> list[float]:
        """Probability of each candidate to be complete."""
        return np.exp(self.log_posterior[1:, 0]).tolist()

    @property
    def probability_of_base(self) -> float:
        """Probability that nothing is missing in the calibrated model."""
        return float(np.exp(self.log_posterior[0, 0]))

    @property
    def unlisted(self) -> float:
        """Probability that something is missing that no candidate describes, alone or beside what one describes."""
        return float(np.exp(self.log_posterior[:, 1]).sum())

    @property
    def is_adequate(self) -> bool:
        """Whether no further mechanism is searched for: the best candidate leaves nothing of a further effect.

        A tolerance is estimated from what the best candidate leaves, and then shows nothing about it: only the
        calibrated model can be adequate.
        """
        if not self.candidates:
            return True
        best = self.most_probable if self.probability_of_base < 0.5 else self.base
        is_open = best is not self.base and any(w.observations.has_tolerance for w in self.whitened)
        return not is_open and self.unexplained_mean_square(best) == 0.0

    @property
    def leading_law_leaves_nothing(self) -> bool:
        """Whether a law is the most probable candidate, and leaves nothing of a further effect."""
        leading = self.leading[0] if self.candidates else self.base
        return bool(laws_in(leading.hypothesis)) and self.unexplained_mean_square(leading) == 0.0

    @property
    def is_decided(self) -> bool:
        """Whether a model is complete with the probability `DECIDED`, or one leaves a good fit and is `certain`."""
        return self._has_complete or self.certain is not None

    @property
    def _has_complete(self) -> bool:
        """Whether the calibrated model or one candidate is complete with a probability of `DECIDED`."""
        return max(self.probability_of_base, *self.probability, 0.0) >= settings.DECIDED

    @property
    def is_settled(self) -> bool:
        """Whether no law is learned: nothing is missing, or what is missing has a probability of `SETTLED`.

        That is a candidate that is complete, or one that is `certain` and leaves nothing. What is less probable may be
        the best imitation of a law that no list holds, and has to compete with laws.
        """
        enough = settings.SETTLED * self._discount
        if self.probability_of_base > 0.5 or max(self.probability, default=0.0) >= enough:
            return True
        certain = self.certain
        if certain is None or self.unexplained_mean_square(certain) > 0.0:
            return False
        return min(self.confidences(certain.hypothesis)) >= enough

    def confidence_in(self, name: str, places: int = 1) -> float:
        """Probability that a mechanism acts at so many places or more, whichever, and beside whatever others."""
        weights = np.logaddexp.reduce(self.log_posterior[1:], axis=1).tolist()
        pairs = zip(self.candidates, weights, strict=True)
        return sum(exp(weight) for c, weight in pairs if c.hypothesis.names.count(name) >= places)

    def confidences(self, hypothesis: Hypothesis) -> list[float]:
        """Confidence in each mechanism of a set, in its order; a second place of one has that of two places."""
        seen = Counter[str]()
        found = []
        for name, _ in hypothesis.acting:
            seen[name] += 1
            found.append(self.confidence_in(name, seen[name]))
        return found

    @property
    def certain(self) -> CandidateFit | None:
        """The candidate of exactly the mechanisms whose probability is at least `DECIDED`, if its fit is good.

        Anything else that is missing is then of no consequence. Of several such candidates, it is the most probable one
        that is plausible. None if the calibrated model's own fit is good, since a good fit then shows nothing.
        """
        if self.is_good(self.base):
            return None
        most = Counter[str]()
        for c in self.candidates:
            most |= Counter(c.hypothesis.names)
        every = ((name, places) for name, count in most.items() for places in range(1, count + 1))
        identified = sorted(name for name, places in every if self.confidence_in(name, places) >= settings.DECIDED)
        alone = (c for c in self.leading if identified and list(c.hypothesis.names) == identified)
        return next((c for c in alone if c.is_plausible and self.is_good(c)), None)

    @property
    def best_of_list(self) -> CandidateFit | None:
        """The most probable complete candidate, if it is a set of two or more listed mechanisms that has no equal.

        Its fit is good, it has at least `DECIDED` of the probability of all complete candidates, and each member has a
        probability above one half. None if the calibrated model's own fit is good.
        """
        best = self.most_probable
        if self.is_good(self.base) or best is self.base or best.hypothesis.size < 2:
            return None
        if not self.is_good(best) or laws_in(best.hypothesis):
            return None
        names, complete = best.hypothesis.names, np.array(self.probability)
        same = np.array([c.hypothesis.names == names for c in self.candidates])
        if min(self.confidences(best.hypothesis)) <= 0.5 or complete[same].sum() < settings.DECIDED * complete.sum():
            return None
        return best

    @property
    def most_probable(self) -> CandidateFit:
        """The candidate that is most probably complete; the calibrated model if none is plausible."""
        complete = self.log_posterior[1:, 0]
        if not np.isfinite(complete).any():
            return self.base
        return self.candidates[int(np.argmax(complete))]

    @property
    def leading(self) -> list[CandidateFit]:
        """Candidates by descending probability, complete or not; those that are not possible by their mean square."""
        weights = np.logaddexp.reduce(self.log_posterior[1:], axis=1)
        return [self.candidates[k] for k in np.argsort(-weights, kind="stable")]

    @property
    def by_evidence(self) -> list[CandidateFit]:
        """Candidates by descending evidence and prior, whether they may be imitations or not: where a search goes on.

        A mechanism that takes off a part of what is missing may be an imitation, but also one of several.
        """
        weights = np.logaddexp.reduce(self.log_weights[1:], axis=1)
        return [self.candidates[k] for k in np.argsort(-weights, kind="stable")]

    @property
    def best_predictor(self) -> CandidateFit:
        """Of the listed sets that evidence and prior hardly tell apart, the one with the lowest leave-one-out error.

        Its members may be real, or imitate what the equations of the others leave. The calibrated model if there is no
        plausible set.
        """
        listed = [c for c in self.by_evidence if c.is_plausible and not laws_in(c.hypothesis)]
        weights = dict(zip(self.candidates, np.logaddexp.reduce(self.log_weights[1:], axis=1), strict=True))
        near = (c for c in listed if weights[c] > weights[listed[0]] - log(settings.STRONG_EVIDENCE))
        return min(near, key=lambda c: c.mean_square, default=self.base)

    def leads_on(self, size: int) -> bool:
        """Whether the best set of `size` mechanisms leaves at most half of what the best smaller one leaves.

        Larger sets are then worth their time; a law that no list holds is better looked for otherwise.
        """
        ranked = [self.base, *self.candidates]
        left, before = (
            min((self.unexplained_mean_square(c) for c in ranked if is_size(c.hypothesis.size)), default=np.inf)
            for is_size in (lambda s: s == size, lambda s: s < size)
        )
        return bool(left <= settings.LEADING_ON * before) and before > 0.0

    def is_outdone(self, candidate: CandidateFit) -> bool:
        """Whether a candidate's fit is not good, and a larger set has at most half of its `unexplained_mean_square`.

        Whether the further mechanisms are missing or imitate what the equations leave, the candidate alone is then no
        complete account: what an imitation takes off is seldom half.
        """
        left = self.unexplained_mean_square(candidate)
        if candidate.is_good or left == 0.0:
            return False
        larger = (c for c in self.candidates if c.is_plausible and is_part_of(candidate, c))
        return any(self.unexplained_mean_square(c) <= settings.LEADING_ON * left for c in larger)

    def log_weight(self, candidate: CandidateFit) -> float:
        """Log posterior of a candidate, complete or not."""
        return float(np.logaddexp.reduce(self.log_posterior[1 + self.candidates.index(candidate)]))

    @property
    def faulty_channels(self) -> dict[str, float]:
        """Probability that the calibrated model is right but for one channel, by channel, imitations aside."""
        evidence, total = self.evidence[self.base.hypothesis], np.logaddexp.reduce(self.log_weights, axis=None)
        shift = self.log_weights[0, 1] - evidence.incomplete - log(2 * len(evidence.in_channel)) - total
        return {channel: exp(value + shift) for channel, value in evidence.in_channel.items()}

    @property
    def _discount(self) -> float:
        """Factor on the probability of every set of mechanisms, below 1 where nothing shows how well models predict.

        That is so for a single recording, which leaves none to hold out; for an initial tension that is not observed
        and therefore fitted; and as far as a tolerance takes the place of measured noise.
        """
        is_weak = len(self.whitened) == 1 or "pretension_share" in self.base.free
        share = 1.0 if is_weak else np.mean([w.observations.tolerance_share for w in self.whitened])
        return float(settings.DISCOUNT**share)


def log_priors(size: int, screened: int) -> NDArray:
    """Log prior that a set of `size` mechanisms is complete, and that one effect is missing beside it; shape (2,)."""

    def of_number(effects: int) -> float:
        if effects == 0:
            return log(settings.PRIOR_AGREES)
        further = (effects - 1) * log(settings.PRIOR_FURTHER) + log(1 - settings.PRIOR_FURTHER)
        return log(1 - settings.PRIOR_AGREES) + further

    listed = size * log(settings.PRIOR_LISTED) - log(comb(max(screened, size), size))
    beside = log(1 - settings.PRIOR_LISTED) + log(size + 1)
    return np.array([of_number(size) + listed, of_number(size + 1) + listed + beside])


def imitation(share: float, smallest: float, prior: NDArray) -> NDArray:
    """Probabilities of the three explanations of a mechanism's effect.

    Parameters
    ----------
    share : float
        Unexplained mean square with the mechanism over that without it, from 0 to 1.
    smallest : float
        The least share that would be noticed, above 0.
    prior : ndarray, shape (3,)
        Prior probabilities of the explanations (`priors_of_further`).

    Returns
    -------
    ndarray, shape (3,)
        That it is missing; that it imitates what the equations of the others leave; and that it imitates something
        unlisted.
    """
    least, most = settings.LEFT_BY_LAW
    power, uniform = settings.IMITATION_POWER + 1, settings.UNIFORM_PART
    exact = exp(-share / smallest) / (smallest * (1 - exp(-1 / smallest)))
    # Shares below the smallest that would be noticed are not told apart, and have their mean density.
    at = max(share, smallest)
    if share < smallest:
        by_law = float(np.clip(log(at / least) / log(most / least), 0.0, 1.0)) / at
        of_others = uniform + (1 - uniform) * at ** (power - 1)
    else:
        by_law = 1 / (log(most / least) * at) if at < most else 0.0
        of_others = uniform + (1 - uniform) * power * at ** (power - 1)
    of_its_own = settings.SAME_LAW * exact + (1 - settings.SAME_LAW) * by_law
    found = prior * np.array([of_its_own, of_others, 1.0])
    return found / found.sum()


def limited(probabilities: NDArray, prior: float, log_support: float) -> NDArray:
    """Probabilities as of `imitation`, the first of which has no more than a prior and a Bayes factor give it."""
    most = 1.0 / (1.0 + (1.0 - prior) / prior * exp(-min(log_support, LARGEST_EXPONENT)))
    if probabilities[0] <= most:
        return probabilities
    others = probabilities[1:] * (1.0 - most) / probabilities[1:].sum()
    return np.array([most, *others])


def priors_of_further(has_part: bool, is_law: bool = False, laws_tried: bool = False) -> NDArray:
    """Prior probabilities of the three explanations of what a mechanism, or a law, takes off; shape (3,).

    Parameters
    ----------
    has_part : bool
        Whether there are other mechanisms, whose equations may leave something.
    is_law : bool
        Whether it is a law that no list holds.
    laws_tried : bool
        Whether these laws were tried beside the other mechanisms. What they describe is then a candidate of its own,
        and only the rest of what is unlisted can be imitated.
    """
    further, unlisted = settings.PRIOR_FURTHER if has_part else 1.0, 1 - settings.PRIOR_LISTED
    of_laws, no_law = unlisted * settings.PRIOR_LAW, unlisted * (1 - settings.PRIOR_LAW)
    own = of_laws if is_law else settings.PRIOR_LISTED
    found = np.array([further * own, 1 - further, further * (no_law if is_law or laws_tried else unlisted)])
    return found / found.sum()


def friction_of(candidate: CandidateFit) -> FrictionPValues:
    """P-values of how friction differs between recordings under a candidate.

    Whitening keeps friction that differs from run to run out of the residuals, and so may keep out too much.
    """
    return friction_p_values(candidate.whitened, candidate.residuals, FRICTION in candidate.values)


def _rank(candidate: CandidateFit) -> tuple[bool, float]:
    return not candidate.is_plausible, candidate.mean_square


def lowest(every: Sequence[CandidateFit]) -> list[CandidateFit]:
    """Of the fits of each set of mechanisms the one with the lowest mean square, a plausible one if there is one."""
    best: dict[frozenset, CandidateFit] = {}
    for candidate in every:
        members = frozenset(candidate.hypothesis.acting)
        if members not in best or _rank(candidate) < _rank(best[members]):
            best[members] = candidate
    return list(best.values())


def is_part_of(candidate: CandidateFit, other: CandidateFit) -> bool:
    """Whether another candidate has all of its mechanisms and more."""
    return set(candidate.hypothesis.acting) < set(other.hypothesis.acting)
