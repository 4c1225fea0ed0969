"""The verdict, decided from the posterior probabilities of the candidate models."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp

import numpy as np

from ccmodel import mechanisms as registry
from ccmodel.channels import PLACES_OF
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.comparison import Comparison
from ccmodel.diagnosis.hypothesis import Hypothesis, law_of, laws_in
from ccmodel.diagnosis.observations import NotJudged
from ccmodel.diagnosis.screening import Score
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.failure import ModelError
from ccmodel.mechanisms.learned import Law


@dataclass(frozen=True)
class Judgement:
    """A verdict with the comparison that it rests on.

    Attributes
    ----------
    verdict : {"agrees", "explained", "learned", "undecided", "unexplained"}
    best : CandidateFit
        If the verdict is explained, the candidate of the reason that holds (`judge`); if learned, the most probable
        candidate with a law; if undecided, the best predictor of the listed ones; else the calibrated model.
    comparison : Comparison
    candidates : list of CandidateFit
        Those of the comparison, by descending probability.
    probability : list of float
        Posterior probability of each of `candidates` to be complete.
    scores : list of Score
        Screening scores of all mechanisms.
    single_fault_places : sequence of str
        Places of a channel in which a single fault of unknown kind would explain an unexplained batch.
    """

    verdict: str
    best: CandidateFit
    comparison: Comparison
    candidates: list[CandidateFit]
    probability: list[float]
    scores: list[Score]
    single_fault_places: Sequence[str] = ()

    @property
    def calibrated(self) -> CandidateFit:
        """The calibrated model."""
        return self.comparison.base

    @property
    def is_open(self) -> bool:
        """Whether something is missing and not found."""
        return self.verdict in ("undecided", "unexplained")

    @property
    def whitened(self) -> Sequence[Whitened]:
        """The observations of the comparison."""
        return self.comparison.whitened

    @property
    def confidences(self) -> list[float]:
        """Probability of each mechanism of the best candidate, in its order."""
        return self.comparison.confidences(self.best.hypothesis)

    @property
    def identified(self) -> list[int]:
        """Positions of the best candidate's mechanisms that the verdict names (`identified`)."""
        return identified(self.verdict, self.best.hypothesis, self.confidences)

    @property
    def confidence(self) -> dict[Hypothesis, float]:
        """Probability of each candidate, complete or not: that its mechanisms act, and no others of the list."""
        return {c.hypothesis: exp(self.comparison.log_weight(c)) for c in self.candidates}

    def confidence_in(self, name: str) -> float:
        """Probability that a mechanism acts, at whatever place and beside whatever others."""
        return self.comparison.confidence_in(name)

    def confidence_in_slot(self, law: Law) -> float:
        """Probability of the laws of one slot, whatever their argument."""
        every = self.confidence.items()
        return sum(p for hypothesis, p in every if any(one.is_of_slot(law) for one in laws_in(hypothesis)))

    @property
    def nearest(self) -> CandidateFit | None:
        """The plausible listed candidate with the lowest leave-one-out mean square; None without candidates."""
        listed = (c for c in self.candidates if law_of(c.hypothesis) is None)
        return min(listed, key=lambda c: (not c.is_plausible, c.mean_square), default=None)


def judge(comparison: Comparison, scores: list[Score]) -> Judgement:
    """Decide the verdict.

    The first of these whose condition holds:

    - ``agrees``: the calibrated model is complete with a probability above one half.
    - ``learned``: the laws of one slot have a probability above one half together.
    - ``explained``, for one of three reasons. Each mechanism of the most probable complete candidate has at least the
      probability `DECIDED`, exactly these are missing with a probability above one half, and no larger set outdoes
      them (`Comparison.is_outdone`). Or the mechanisms with at least the probability `DECIDED` give a good fit
      (`Comparison.certain`). Or one set alone gives a good fit (`Comparison.best_of_list`).
    - ``unexplained``: unlisted effects and laws have a probability above one half together, and none of the
      listed mechanisms has one.
    - ``undecided``: otherwise.
    """
    probability = np.array(comparison.probability)
    order = np.argsort(-probability, kind="stable")
    candidates = [comparison.candidates[k] for k in order]
    found = Judgement("agrees", comparison.base, comparison, candidates, probability[order].tolist(), scores)
    if comparison.probability_of_base > 0.5:
        return found
    by_law = ((c, law) for c in comparison.leading for law in laws_in(c.hypothesis))
    if candidate := next((c for c, law in by_law if found.confidence_in_slot(law) > 0.5), None):
        return replace(found, verdict="learned", best=candidate)
    listed = [c for c in candidates if law_of(c.hypothesis) is None]
    if comparison.most_probable in listed and _is_explained(found, comparison.most_probable):
        return replace(found, verdict="explained", best=comparison.most_probable)
    sufficient = comparison.certain or comparison.best_of_list
    if sufficient is not None and law_of(sufficient.hypothesis) is None:
        return replace(found, verdict="explained", best=sufficient)
    names = {name for c in listed for name in c.hypothesis.names}
    # Candidates with a law beside which something is missing too are part of `unlisted`.
    learned = sum(p for c, p in zip(candidates, found.probability, strict=True) if law_of(c.hypothesis) is not None)
    if comparison.unlisted + learned > 0.5 and max(map(found.confidence_in, names), default=0.0) <= 0.5:
        return replace(found, verdict="unexplained", single_fault_places=single_fault_places(comparison))
    return replace(found, verdict="undecided", best=comparison.best_predictor)


def identified(verdict: str, hypothesis: Hypothesis, confidence: Sequence[float]) -> list[int]:
    """Positions of the listed mechanisms that a verdict names, the highest confidence first.

    An undecided verdict names those with at least the probability `DECIDED`: what is open is what else is missing.
    """
    least = {"explained": 0.0, "learned": 0.0, "undecided": settings.DECIDED}.get(verdict, np.inf)
    listed = [k for k, (name, _) in enumerate(hypothesis.acting) if name not in registry.laws()]
    named = (k for k in listed if confidence[k] >= least)
    return sorted(named, key=lambda k: -min(settings.MOST_CONFIDENT, confidence[k]))


def with_discretisation(judgement: Judgement) -> tuple[Judgement, NotJudged]:
    """The verdict once the values of what it names have their discretisation error, and what was not computed.

    A strength that is no larger than this error does not support its mechanism. The verdict may then name others, whose
    values need theirs.
    """
    while judgement.identified and judgement.best.shift is None:
        try:
            comparison = judgement.comparison.with_discretisation(judgement.best)
        except ModelError as error:
            return judgement, [{"what": "discretisation error of the values", "why": str(error)}]
        judgement = judge(comparison, judgement.scores)
    return judgement, []


def _is_explained(judgement: Judgement, best: CandidateFit) -> bool:
    names = sorted(best.hypothesis.names)
    pairs = zip(judgement.candidates, judgement.probability, strict=True)
    alone = sum(p for c, p in pairs if sorted(c.hypothesis.names) == names)
    comparison = judgement.comparison
    is_decided = min(comparison.confidences(best.hypothesis)) >= settings.DECIDED and alone > 0.5
    return is_decided and not comparison.is_outdone(best)


def single_fault_places(comparison: Comparison) -> list[str]:
    """Places of the channels in which a single unknown fault is probable, the most probable first."""
    by_channel = comparison.faulty_channels
    probable = sorted((c for c, p in by_channel.items() if p > settings.ALTERNATIVE), key=lambda c: -by_channel[c])
    return list(dict.fromkeys(place for channel in probable for place in PLACES_OF[channel]))


def nested_choice(judgement: Judgement) -> list[CandidateFit]:
    """By recording, the plausible model with the lowest mean square on all other recordings (nested cross-validation).

    The error of a recording that is reported as held out must not have influenced the choice of the model either, but
    for the fits that leave out one of the others. The choice is the verdict's model throughout if that is the
    calibrated model, or if there is a single recording.
    """
    count = len(judgement.whitened)
    if judgement.best is judgement.calibrated or count == 1:
        return [judgement.best] * count
    every = [judgement.calibrated, *(c for c in judgement.candidates if c.is_plausible)]
    mean_squares = np.stack([c.by_recording for c in every])
    others = mean_squares.sum(axis=1, keepdims=True) - mean_squares
    return [every[k] for k in np.argmin(others, axis=0)]
