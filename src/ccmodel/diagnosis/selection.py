"""Forward selection: single mechanisms by their screening score, and a second mechanism where one does not suffice."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit, fit
from ccmodel.diagnosis.comparison import Comparison
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.screening import Score, screen
from ccmodel.diagnosis.whitening import Whitened, relinearised
from ccmodel.failure import ModelError
from ccmodel.inference.pool import each
from ccmodel.inference.problem import Free
from ccmodel.progress import Progress, silent, within

# Shares of a whole selection at which the mechanisms are screened, the single ones fitted and the covariance linearised
# anew; the rest is the pairs'. Of the pairs' share, that of the screening for a second mechanism, and that at which all
# are fitted. Measured on two batches, data/raw/loops and half-loop; they only serve the estimate of the time left.
SCREENED, FITTED, RELINEARISED = 0.15, 0.35, 0.5
PARTNERS_SCREENED, PAIRS_FITTED = 0.5, 0.8


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
        Singles or pairs that are fitted whatever their screening score.
    progress : Progress
    """

    free: Mapping[str, Free]
    mechanisms: Sequence[Hypothesis]
    forced: Sequence[Hypothesis] = ()
    progress: Progress = field(default=silent)

    def run(self, whitened: Sequence[Whitened], base: CandidateFit) -> tuple[Comparison, list[Score]]:
        """Select from all mechanisms; the comparison of what was fitted, and the screening scores."""
        text = f"calibrated model: leave-one-out mean square {base.mean_square:.2f} (1: noise); screening"
        self.progress(f"{text} {len(self.mechanisms)} mechanisms", 0.0)
        scores = screen(base, self.mechanisms)
        fewest = settings.FEWEST_FITTED if base.mean_square > settings.ADEQUATE else 0
        worth = [s for k, s in enumerate(scores) if s.values and (s.gain > settings.WORTH_FITTING or k < fewest)]
        leading = worth[: settings.MOST_FITTED]
        chosen = [s.hypothesis for s in leading]
        forced = [Score(h, 0.0, h.start) for h in self.forced if h not in chosen]
        singles = self._part(SCREENED, FITTED).fit_all(whitened, base, [*leading, *forced])
        found = Comparison.of(whitened, base, singles, len(self.mechanisms))
        if not found.is_sufficient:
            found = self._part(FITTED, RELINEARISED).relinearise(found)
        if not found.is_sufficient:
            found = self._part(RELINEARISED, 1.0).with_pairs(found)
        return found, scores

    def _part(self, low: float, high: float) -> Self:
        """The same, whose work takes these shares of the whole."""
        return replace(self, progress=within(self.progress, low, high))

    def fit_all(self, whitened: Sequence[Whitened], base: CandidateFit, chosen: Sequence[Score]) -> list[CandidateFit]:
        """Fit extensions of a fitted model, from the values of their scores."""
        fitted = []
        for k, score in enumerate(chosen):
            hypothesis = base.hypothesis.and_also(score.hypothesis)
            self.progress(f"fitting {hypothesis}", k / len(chosen))
            try:
                candidate = fit(whitened, hypothesis, self.free, base.values | score.values)
            except (ModelError, ValueError) as error:
                self.progress(f"{hypothesis}: cannot be run ({error})")
                continue
            self.progress(f"{hypothesis}: leave-one-out mean square {candidate.mean_square:.2f}")
            fitted.append(candidate)
        return fitted

    def with_pairs(self, found: Comparison) -> Comparison:
        """The same with pairs that improve on their members, from adequate singles where there are any."""
        singles = [c for c in found.candidates if not c.hypothesis.is_pair]
        firsts = [c for c in singles if found.is_adequate(c)] or singles
        pairs = self._part(0.0, PAIRS_FITTED)._pairs(found.whitened, firsts[: settings.FIRSTS])
        every = [*found.candidates, *pairs]
        improving = [c for c in every if improves_on_members(c, every)]
        paired = Comparison.of(found.whitened, found.base, improving, found.screened)
        if not paired.has_adequate and paired.candidates[0].hypothesis.is_pair:
            paired = self._part(PAIRS_FITTED, 1.0).relinearise(paired)
            improving = [c for c in paired.candidates if improves_on_members(c, paired.candidates)]
            paired = replace(paired, candidates=improving)
        # An inadequate pair does not displace an adequate single mechanism.
        return found if found.has_adequate and not paired.has_adequate else paired

    def _pairs(self, whitened: Sequence[Whitened], firsts: Sequence[CandidateFit]) -> list[CandidateFit]:
        self.progress("a single mechanism is not sufficient; fitting pairs", 0.0)
        found, seen = [], set()
        for k, first in enumerate(firsts):
            part = self._part(k / len(firsts), (k + 1) / len(firsts))
            part.progress(f"screening mechanisms beside {first.hypothesis}", 0.0)
            partners = [h for h in self.mechanisms if h.acting[0] not in first.hypothesis.acting]
            chosen: list[Score] = []
            for s in screen(first, partners):
                pair = frozenset(first.hypothesis.acting + s.hypothesis.acting)
                if s.gain > settings.WORTH_FITTING and pair not in seen and len(chosen) < settings.PARTNERS:
                    seen.add(pair)
                    chosen.append(s)
            found += part._part(PARTNERS_SCREENED, 1.0).fit_all(whitened, first, chosen)
        return found

    def relinearise(self, found: Comparison) -> Comparison:
        """Singles and leading pairs fitted again, with the covariance linearised about the best of them.

        The paper's model, for instance, has no ringing load, and so no error of it from the uncertain drive motion.
        Where the initial tension is not observed, every candidate is fitted from the best one's calibration too: the
        cost has several minima there.
        """
        best = found.candidates[0]
        self.progress(f"linearising the covariance about {best.hypothesis}", 0.0)
        models = [best.model(w.observations.parameters) for w in found.whitened]

        def starts(candidate: CandidateFit) -> list[dict[str, float]]:
            if candidate is best or "pretension_share" not in self.free:
                return [candidate.values]
            return [candidate.values, candidate.values | {name: best.values[name] for name in self.free}]

        try:
            whitened = each(found.whitened, lambda i, w: relinearised(w, models[i]))
            base = min(
                (fit(whitened, found.base.hypothesis, self.free, s) for s in starts(found.base)),
                key=lambda c: c.mean_square,
            )
        except ModelError as error:
            self.progress(f"the covariance stays as it is ({error})")
            return found
        leading = [c for k, c in enumerate(found.candidates) if k < settings.CONTENDERS or not c.hypothesis.is_pair]
        again = self.fit_all(whitened, base, [Score(c.hypothesis, 0.0, s) for c in leading for s in starts(c)])
        best_of = {c.hypothesis: c for c in sorted(again, key=lambda c: c.mean_square, reverse=True)}
        return Comparison.of(whitened, base, list(best_of.values()), found.screened)


def improves_on_members(candidate: CandidateFit, candidates: Sequence[CandidateFit]) -> bool:
    """Whether a pair halves the excess mean square of each of its members alone; true of a single."""
    if not candidate.hypothesis.is_pair:
        return True
    members = set(candidate.hypothesis.acting)
    alone = [c.mean_square for c in candidates if set(c.hypothesis.acting) < members]
    pair = candidate.mean_square
    return all(pair - 1 < settings.PAIR_SHARE * (single - 1) and pair < single for single in alone)
