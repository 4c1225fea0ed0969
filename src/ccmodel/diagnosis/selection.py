"""Forward selection: single mechanisms by their screening score, and further ones as long as the evidence grows."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Self

import numpy as np

from ccmodel import mechanisms as registry
from ccmodel.deadline import UNLIMITED, Deadline, OutOfTimeError
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import LAST_SEARCH, SEARCH, VALUES_STAY, CandidateFit, evaluated, fit
from ccmodel.diagnosis.comparison import Comparison, is_part_of, lowest
from ccmodel.diagnosis.equation_error import other_start
from ccmodel.diagnosis.hypothesis import Hypothesis, law_of, laws_in
from ccmodel.diagnosis.laws import Proposal, proposals
from ccmodel.diagnosis.normal_equations import NormalEquations
from ccmodel.diagnosis.repeatability import estimated, estimated_tolerance
from ccmodel.diagnosis.screening import Score, Screening, screen
from ccmodel.diagnosis.whitening import Whitened, relinearised
from ccmodel.failure import ModelError
from ccmodel.inference.least_squares import Search
from ccmodel.inference.pool import each
from ccmodel.inference.problem import Free
from ccmodel.mechanisms.learned import Law
from ccmodel.progress import Progress, silent, within

# Shares of a whole selection at which the mechanisms are screened and the single ones fitted; the rest is that of the
# sets. Of a set size's share, those at which the covariance is linearised and the further mechanisms are screened.
# Measured on two batches, data/raw/loops and half-loop; they only serve the estimate of the time left.
SCREENED, FITTED = 0.15, 0.35
SIZES = settings.MOST_MECHANISMS - 1
RELINEARISED, PARTNERS_SCREENED = 0.3, 0.5


@dataclass(frozen=True)
class Selection:
    """What is selected from, and how.

    Attributes
    ----------
    free : mapping of str to Free
        Unknowns of the calibration.
    mechanisms : sequence of Hypothesis
        Single mechanisms that may be missing.
    forced : sequence of Hypothesis
        Candidates that are fitted whatever their screening score.
    laws : sequence of Law
        Laws that may be learned where something is missing that is on no list.
    progress : Progress
    known, limits : mapping of str to float
        Values, and upper limits, that recordings show without a run of the model (`ccmodel.diagnosis.equation_error`).
        Fits of what they belong to also start from these values, and nothing is screened beyond these limits.
    deadline, sets_until : Deadline
        When the selection ends with what was fitted until then; and when sets are to be fitted before laws are learned.
    goes_on : bool
        Whether the deadline is that of the sets, after which the selection goes on.
    """

    free: Mapping[str, Free]
    mechanisms: Sequence[Hypothesis]
    forced: Sequence[Hypothesis] = ()
    laws: Sequence[Law] = ()
    progress: Progress = field(default=silent)
    known: Mapping[str, float] = field(default_factory=dict)
    limits: Mapping[str, float] = field(default_factory=dict)
    deadline: Deadline = UNLIMITED
    sets_until: Deadline = UNLIMITED
    goes_on: bool = False

    def run(self, whitened: Sequence[Whitened], base: CandidateFit) -> tuple[Comparison, list[Score]]:
        """Select from all mechanisms; the comparison of what was fitted, and the screening scores."""
        text = f"calibrated model: leave-one-out mean square {base.mean_square:.2f} (1: noise); screening"
        self.progress(f"{text} {len(self.mechanisms)} mechanisms", 0.0)
        screening = self._screened(base, self.mechanisms)
        scores = screening.singles()
        nothing = Comparison.of(whitened, base, [], len(self.mechanisms))
        fewest = settings.FEWEST_FITTED if nothing.unlisted > 0.5 else 0
        worth = [s for k, s in enumerate(scores) if s.values and (s.gain > settings.WORTH_FITTING or k < fewest)]
        leading = worth[: settings.MOST_FITTED if self.is_tension_observed else settings.MOST_FITTED_IF_UNOBSERVED]
        chosen = [s.hypothesis for s in leading]
        # The screening is linear, and a mass that is out of tune seems to explain nothing.
        shown = [h for h in self.mechanisms if fewest and h.start and all(name in self.known for name in h.start)]
        further = dict.fromkeys(h for h in [*self.forced, *shown] if h not in chosen)
        forced = [Score(h, 0.0, h.start) for h in further]
        singles = self._part(SCREENED, FITTED).fit_all(whitened, base, [*leading, *forced])
        found = self._part(FITTED, 1.0).further(nothing.with_candidates(singles), screening)
        # Candidates are compared, and their parameters estimated, under the best one's own covariance: about a model
        # that lacks something, friction seems to scatter.
        if found.candidates and found.probability_of_base < 0.5:
            found = self.completed(self.relinearise(found))
        return found, scores

    @property
    def is_tension_observed(self) -> bool:
        """Whether a rest shows the initial tension, so that no fit has to find it."""
        return "pretension_share" not in self.free

    def further(self, found: Comparison, screening: Screening) -> Comparison:
        """The same with sets of listed mechanisms, and with laws if sets do not lead on.

        Sets of increasing size are fitted first, within `SETS_SHARE` of both limits. Laws are learned when a size does
        not halve what smaller sets leave, or when that share has passed, unless the comparison is decided; larger sets
        follow unless a law leads that leaves nothing. Otherwise laws are learned at the end, unless the comparison is
        settled: what is less probable or has a lack of fit competes with laws.
        """
        sets, size = replace(self, deadline=self.sets_until, goes_on=True), 2
        while size <= settings.MOST_MECHANISMS:
            part = sets._part((size - 2) / SIZES, (size - 1) / SIZES)
            if not found.is_adequate:
                found = part._part(0.0, RELINEARISED).relinearise(found)
            if found.is_adequate or (size > 2 and found.by_evidence[0].is_good and found.is_decided):
                break
            found = part._part(RELINEARISED, 1.0).extended(found, screening, size)
            is_over = part.deadline.has_passed
            if sets.laws and (is_over or not found.leads_on(size)) and not found.is_decided:
                found, sets = self.learn(found), replace(self, laws=())
                if found.leading_law_leaves_nothing:
                    break
                if is_over:
                    continue
            listed = next((c for c in found.by_evidence if law_of(c.hypothesis) is None), found.base)
            if is_over or listed.hypothesis.size < size:
                break
            size += 1
        can_learn = sets.laws and not self.deadline.has_passed
        return self.learn(found) if can_learn and not found.is_settled else found

    def learn(self, found: Comparison) -> Comparison:
        """The same with laws that no list holds: the leading ones, and the best of them with more knots.

        If no law leaves nothing, a mechanism of the leading listed set may have another form: its law is learned beside
        the others.
        """
        self.progress("learning a law from the recordings", 0.0)
        base, least, leading = found.base, least_evidence(found), leading_set(found)

        def fitted(
            every: Sequence[Law], most: int, beside: CandidateFit = base, least: float = -np.inf
        ) -> list[CandidateFit]:
            proposed = proposals(beside, every, self.deadline, self.progress, self.known)
            leading = _as_scores(p for p in proposed if p.evidence > least)[:most]
            first, others = leading[: settings.PARTNERS], leading[settings.PARTNERS :]
            found_first = self.fit_all(found.whitened, beside, first)
            if not others or are_hopeless(found_first, found):
                return found_first
            return found_first + self.fit_all(found.whitened, beside, others)

        first = sorted(fitted(self.laws, settings.LAWS_FITTED, least=least), key=lambda c: c.mean_square)
        finer = [] if are_hopeless(first, found) else finer_laws([c.hypothesis for c in first])
        found = self.with_laws(found, base, first + fitted(finer, settings.LAWS_REFINED, least=least))
        if leading is not None and not found.leading_law_leaves_nothing:
            found = found.with_candidates([*found.candidates, *self._other_forms(found, leading)])
        beside = hides_a_law(found)
        if beside is not None:
            found = self.with_laws(found, beside, fitted(self.laws, settings.PARTNERS, beside))
        if not found.candidates:
            return found
        found = self.relinearise(found)
        return self.beside_law(found) if law_of(found.leading[0].hypothesis) is not None else found

    def _other_forms(self, found: Comparison, best: CandidateFit) -> list[CandidateFit]:
        """A listed set with the law of one of its mechanisms learned, at the slot and of the argument that it has."""
        learned: list[CandidateFit] = []
        for name, place in best.hypothesis.acting:
            curves = registry.get(name).curves
            own = [law for law in self.laws if law.place == place and any(map(law.has_the_form_of, curves))]
            others = found.without(best, {(name, place)}) if own else None
            if others is not None:
                proposed = proposals(others, own, self.deadline, self.progress, self.known)
                learned += self.fit_all(found.whitened, others, _as_scores(proposed[:1]))
        return learned

    def with_laws(self, found: Comparison, beside: CandidateFit, learned: Sequence[CandidateFit]) -> Comparison:
        """The same with laws beside a model, which counts as compared with them if there was time for all."""
        tried = {beside.hypothesis} if self.laws and not self.deadline.has_passed else frozenset()
        found = replace(found, laws_beside=found.laws_beside | tried)
        return found.with_candidates([*found.candidates, *learned])

    def beside_law(self, found: Comparison) -> Comparison:
        """The same with what acts beside the leading law, a listed mechanism or a second law, if something is left.

        A law and a listed mechanism that leave much may be two laws: the mechanism's own may have another form.
        """
        leading = found.leading[0]
        best = law_by_itself(found, leading)
        if found.is_adequate or self.deadline.has_passed or best is None or (best is not leading and leading.is_good):
            return found
        self.progress(f"looking for what acts beside {best.hypothesis}", 0.0)
        acting = laws_in(best.hypothesis)
        others = [law for law in self.laws if not any(law.has_the_quantity_of(one) for one in acting)]
        scores = self._screened(best, self.mechanisms).singles() if best is leading else []
        scores = [s for s in scores if s.gain > settings.WORTH_FITTING]
        second = proposals(best, others, self.deadline, self.progress, self.known)[: settings.PARTNERS]
        chosen = scores[: settings.PARTNERS] + _as_scores(second)
        pairs = self.fit_all(found.whitened, best, chosen)
        return self.relinearise(found.with_candidates([*found.candidates, *pairs])) if pairs else found

    def _screened(self, base: CandidateFit, mechanisms: Sequence[Hypothesis]) -> Screening:
        """Screening of mechanisms against a fitted model, until the deadline and within what recordings show."""
        return screen(base, mechanisms, self.deadline, self.limits)

    def _part(self, low: float, high: float) -> Self:
        """The same, whose work takes these shares of the whole."""
        return replace(self, progress=within(self.progress, low, high))

    def fit_all(
        self,
        whitened: Sequence[Whitened],
        base: CandidateFit,
        chosen: Sequence[Score],
        search: Search = SEARCH,
        calibration: Mapping[str, float] | None = None,
    ) -> list[CandidateFit]:
        """Fit extensions of a fitted model, from the values of their scores and from known ones, until the deadline.

        Of several fits of a hypothesis, the one with the lowest mean square is returned. `calibration` as of
        `ccmodel.diagnosis.candidate.fit`.
        """
        starts = [(score.hypothesis, base.values | score.values) for score in chosen]
        every = [(h, one) for h, s in starts for one in (other_start(s, self.known), s) if one is not None]
        fitted = []
        for k, (further, start) in enumerate(every):
            hypothesis = base.hypothesis.and_also(further)
            self.progress(f"fitting {hypothesis}", k / len(every))
            try:
                candidate = fit(whitened, hypothesis, self.free, start, self.deadline, search, calibration)
            except OutOfTimeError:
                self.progress(f"{hypothesis}: not fitted, the time is over")
                break
            except (ModelError, ValueError) as error:
                self.progress(f"{hypothesis}: cannot be run ({error})")
                continue
            self.progress(f"{hypothesis}: leave-one-out mean square {candidate.mean_square:.2f}")
            fitted.append(candidate)
        return lowest(fitted)

    def extended(self, found: Comparison, screening: Screening, size: int) -> Comparison:
        """The same with sets of `size` mechanisms, and with the parts of the best of them that lack a member.

        A part may be better than before: the search for it had ended at a worse minimum. Its partners are then looked
        for again.
        """
        sets = self._part(0.0, 0.6)._sets(found, screening, size)
        if not sets:
            return found
        extended = found.with_candidates([*found.candidates, *sets])
        best = extended.by_evidence[0]
        if best.hypothesis.size < size:
            return extended
        parts = self._part(0.6, 0.8)._subsets(found, best)
        extended = extended.with_candidates([*extended.candidates, *parts])
        first = lower(parts, found.candidates)
        if first is None:
            return extended
        again = self._part(0.8, 1.0)._beside(found.whitened, first, set())
        return extended.with_candidates([*extended.candidates, *again])

    def _sets(self, found: Comparison, screening: Screening, size: int) -> list[CandidateFit]:
        """Fitted sets: the leading smaller ones with the best partner each, and those that lead the first screening."""
        listed = (c for c in found.by_evidence if law_of(c.hypothesis) is None)
        smaller = [c for c in listed if c.hypothesis.size == size - 1]
        firsts = smaller[: settings.FIRSTS[size]]
        # The evidence is that of complete models. Of incomplete ones, the one that leaves least may lead further.
        firsts += [c for c in sorted(smaller, key=lambda c: c.mean_square)[:1] if c not in firsts]
        fitted, seen = [], {frozenset(c.hypothesis.acting) for c in found.candidates}
        for k, first in enumerate(firsts):
            part = self._part(k / (len(firsts) + 1), (k + 1) / (len(firsts) + 1))
            fitted += part._beside(found.whitened, first, seen)
        linear = unseen(screening.sets(size), seen, settings.LINEAR_SETS)
        part = self._part(len(firsts) / (len(firsts) + 1), 1.0)
        return fitted + part.fit_all(found.whitened, found.base, linear)

    def _beside(self, whitened: Sequence[Whitened], first: CandidateFit, seen: set[frozenset]) -> list[CandidateFit]:
        """A set with each of its best partners; sets that were seen are left out, and these are added to them."""
        self.progress(f"screening mechanisms beside {first.hypothesis}", 0.0)
        partners = [h for h in self.mechanisms if h.acting[0] not in first.hypothesis.acting]
        scores = self._screened(first, partners).singles()
        worth = [s for s in scores if s.gain > settings.WORTH_FITTING]
        chosen = unseen(worth, seen, settings.PARTNERS, first.hypothesis.acting)
        return self._part(PARTNERS_SCREENED, 1.0).fit_all(whitened, first, chosen)

    def _subsets(self, found: Comparison, best: CandidateFit) -> list[CandidateFit]:
        """The subsets of a set that lack one of its members each, fitted from its values.

        Also those that were fitted before: from other values a search may have ended at a worse minimum, and the
        further member would be credited with the difference.
        """
        parts = combinations(best.hypothesis.acting, best.hypothesis.size - 1)
        subsets = map(best.hypothesis.part, parts)
        starts = [Score(h, 0.0, {key: best.values[key] for key in h.start}) for h in subsets]
        base = replace(found.base, values={name: best.values[name] for name in found.base.values})
        return self.fit_all(found.whitened, base, starts)

    def relinearise(self, found: Comparison) -> Comparison:
        """Leading candidates fitted again, with the covariance linearised about the best of them.

        The paper's model, for instance, has no ringing load, and so no error of it from the uncertain drive motion.
        What differs from run to run is estimated again too: about a wrong model, friction seems to scatter. So is a
        tolerance: it is at most what the best model leaves.
        Where the initial tension is not observed, every candidate may start from the best one's calibration too: the
        cost has several minima there.
        """
        best = found.by_evidence[0]
        if found.is_linearised_about(best):
            return found
        self.progress(f"linearising the covariance about {best.hypothesis}", 0.0)
        models = [best.model(w.observations.parameters, w.session) for w in found.whitened]
        calibration = {name: best.values[name] for name in self.free}
        try:
            repeatability = estimated(best.whitened, best.residuals)
            tolerance = estimated_tolerance(best.whitened, best.by_channel)
            repeatability = replace(repeatability, tolerance=tolerance)
            whitened = each(found.whitened, lambda i, w: relinearised(w, models[i], repeatability, best.whitened[i]))
            start = found.base.values
            base = fit(whitened, found.base.hypothesis, self.free, start, self.deadline, calibration=calibration)
        except ModelError as error:
            self.progress(f"the covariance stays as it is ({error})")
            return found
        near, far = contenders(found)
        again = self.fit_all(whitened, base, _scores(near), calibration=calibration)
        # Until the selection ends, all are fitted again.
        if self.deadline.has_passed and self.goes_on:
            return found
        # No rival must be lost, as one that could not be fitted again: without it, the others would be more probable.
        fitted = {c.hypothesis for c in again}
        again += self._evaluated([*far, *(c for c in near if c.hypothesis not in fitted)], whitened)
        if not any(c.hypothesis == best.hypothesis for c in again):
            return found
        # About the same mechanisms once more: only if that leads on.
        about = found.linearised_about
        reached = next(c.mean_square for c in again if c.hypothesis == best.hypothesis)
        if about and about.hypothesis == best.hypothesis and reached >= best.mean_square:
            return found
        return Comparison.of(whitened, base, again, found.screened, best, found.laws_beside)

    def _evaluated(self, late: Sequence[CandidateFit], whitened: Sequence[Whitened]) -> list[CandidateFit]:
        """Candidates under another covariance with the values that they have."""
        found = []
        for candidate in late:
            self.progress(f"{candidate.hypothesis}: its values stay")
            try:
                found.append(evaluated(candidate, whitened))
            except (ModelError, ValueError) as error:
                self.progress(f"{candidate.hypothesis}: cannot be run ({error})")
        return found

    def completed(self, found: Comparison) -> Comparison:
        """The same with near contenders fitted to the end, so that rounding errors do not choose their values.

        Of a model that leaves nothing, quick searches find the minimum. If the deadline passes before all are fitted,
        all stay as they are: a longer search for some of them would tip the comparison.
        """
        if found.is_adequate:
            return found
        again = self.fit_all(found.whitened, found.base, _scores(contenders(found)[0]), LAST_SEARCH, calibration={})
        if self.deadline.has_passed:
            return found
        every = {c.hypothesis: c for c in [*found.candidates, *again]}
        return found.with_candidates(list(every.values()))


def _as_scores(proposed: Iterable[Proposal]) -> list[Score]:
    """Proposed laws as starts of a fit."""
    return [Score(p.hypothesis, 0.0, p.values) for p in proposed]


def _scores(again: Iterable[CandidateFit]) -> list[Score]:
    """Fitted candidates as starts of another fit."""
    return [Score(c.hypothesis, 0.0, c.values) for c in again]


def least_evidence(found: Comparison) -> float:
    """Log evidence to first order, over that of the calibrated model, from which a law is worth a fit.

    Where the calibrated model's own fit is good, all effects are small and nearly linear, and a law that is far behind
    a plausible listed candidate, their priors included, stays behind. Elsewhere any law may be better than it seems.
    """
    plausible = [c for c in found.candidates if c.is_plausible]
    if not (found.base.is_good and plausible):
        return -np.inf
    prior_of_law = found.log_prior(1)
    best = max(NormalEquations.of(c).log_evidence + found.log_prior(c.hypothesis.size) for c in plausible)
    return best - prior_of_law - NormalEquations.of(found.base).log_evidence - settings.LAW_FAR_BEHIND


def are_hopeless(laws: Sequence[CandidateFit], found: Comparison) -> bool:
    """Whether fitted laws leave far more than the best set of listed mechanisms; False if there is none of them."""
    least = min((c.mean_square for c in _listed(found)), default=np.inf)
    highest = 1.0 + settings.HOPELESS * max(least - 1.0, settings.NEAR_NOISE)
    return bool(laws) and min(c.mean_square for c in laws) > highest


def hides_a_law(found: Comparison) -> CandidateFit | None:
    """The single listed mechanism beside which laws are learned too: a far larger effect hides one from the base.

    None if it does not account for most of what is missing or leaves nothing, or if a law that leaves nothing leads.
    """
    excess = settings.MOSTLY_LISTED * found.excess
    singles = [c for c in _listed(found) if c.hypothesis.size == 1 and c.mean_square - 1.0 < excess]
    best = min(singles, key=lambda c: c.mean_square, default=found.base)
    if best is found.base or found.leading_law_leaves_nothing or found.unexplained_mean_square(best) == 0.0:
        return None
    return best


def _listed(found: Comparison) -> list[CandidateFit]:
    """Plausible sets of listed mechanisms, by ascending mean square."""
    return [c for c in found.candidates if c.is_plausible and law_of(c.hypothesis) is None]


def leading_set(found: Comparison) -> CandidateFit | None:
    """The listed set that leaves least, of the largest size that leads on or else of two; None if its fit is good."""
    size = next((size for size in range(settings.MOST_MECHANISMS, 2, -1) if found.leads_on(size)), 2)
    sets = [c for c in _listed(found) if c.hypothesis.size == size]
    best = min(sets, key=found.unexplained_mean_square, default=found.base)
    return best if sets and not found.is_good(best) else None


def law_by_itself(found: Comparison, candidate: CandidateFit) -> CandidateFit | None:
    """The only law of a candidate without the mechanisms beside it; None if there are several, or it was not fitted."""
    laws = laws_in(candidate.hypothesis)
    if len(laws) > 1:
        return None
    alone = (c for c in found.candidates if c.hypothesis.size == 1 and laws_in(c.hypothesis) == laws)
    return min(alone, key=lambda c: c.mean_square, default=None)


def finer_laws(fitted: Sequence[Hypothesis]) -> list[Law]:
    """The leading laws with more knots, without those that were fitted already."""
    first = [law for law in map(law_of, fitted) if law is not None]
    finer = [law.finer() for law in first[: settings.LAWS_REFINED]]
    return [law for law in finer if law is not None and law not in first]


def contenders(found: Comparison) -> tuple[list[CandidateFit], list[CandidateFit]]:
    """The candidates that stay: the best one by evidence, its largest parts, its rivals, and the one that leads on.

    The first ones are worth another fit; the other rivals are far behind. Of the largest listed sets, the one of least
    mean square leads on: it is extended, whatever its evidence (`Selection.extended`).
    """
    best = found.by_evidence[0]
    # Every rival of a complete candidate matters; of an incomplete one, only the leading ones lead on.
    most = len(found.candidates) if found.unlisted < 0.5 else settings.CONTENDERS
    highest = 1.0 + settings.HOPELESS * max(best.mean_square - 1.0, settings.NEAR_NOISE)

    leads_on = min(_listed(found), key=lambda c: (-c.hypothesis.size, c.mean_square), default=best)
    near: list[CandidateFit] = []
    far: list[CandidateFit] = []
    for k, c in enumerate(found.by_evidence):
        is_part = is_part_of(c, best)
        # What the best one's last mechanism adds is judged by its largest parts.
        is_largest_part = is_part and c.hypothesis.size == best.hypothesis.size - 1
        if c is leads_on or is_largest_part or (c.mean_square <= highest and (k < most or is_part)):
            (near if c is best or c is leads_on or is_part or not found.is_far_behind(c) else far).append(c)
    return near, far


def lower(again: Sequence[CandidateFit], before: Sequence[CandidateFit]) -> CandidateFit | None:
    """Of sets that were fitted before, the best one that has now come to another minimum, which is far lower."""
    was = {frozenset(c.hypothesis.acting): c.mean_square for c in before if c.message != VALUES_STAY}
    found = (c for c in again if c.mean_square < settings.FAR_LOWER * was.get(frozenset(c.hypothesis.acting), 0.0))
    return min(found, key=lambda c: c.mean_square, default=None)


def unseen(
    scores: Iterable[Score], seen: set[frozenset], most: int, beside: tuple[tuple[str, str], ...] = ()
) -> list[Score]:
    """The first `most` scores whose mechanisms, beside others, are none of the sets `seen`; they are added to these."""
    chosen: list[Score] = []
    for score in scores:
        members = frozenset(beside + score.hypothesis.acting)
        if len(chosen) < most and members not in seen:
            seen.add(members)
            chosen.append(score)
    return chosen
