"""The verdict, decided from the comparison of candidate models."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.comparison import Comparison
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.isolation import isolate
from ccmodel.diagnosis.lack_of_fit import LackOfFit
from ccmodel.diagnosis.screening import Score
from ccmodel.diagnosis.whitening import Whitened


@dataclass(frozen=True)
class Judgement:
    """A verdict with the comparison that it rests on.

    Attributes
    ----------
    verdict : {"agrees", "explained", "undecided", "unexplained"}
    best : CandidateFit
        The most probable candidate if the verdict is explained or undecided, otherwise the calibrated model.
    comparison : Comparison
    candidates : list of CandidateFit
        Those of the comparison, by descending probability.
    probability : list of float
        Closed-world posterior probability of each of `candidates`.
    well_specified : float
        Probability that the most probable candidate is correct and no imitation (`Comparison.well_specified`).
    scores : list of Score
        Screening scores of all mechanisms.
    single_fault_places : sequence of str
        Places where a single fault of unknown kind would explain the recordings as well as the most probable set.
    """

    verdict: str
    best: CandidateFit
    comparison: Comparison
    candidates: list[CandidateFit]
    probability: list[float]
    well_specified: float
    scores: list[Score]
    single_fault_places: Sequence[str] = ()

    @property
    def calibrated(self) -> CandidateFit:
        """The calibrated model."""
        return self.comparison.base

    @property
    def whitened(self) -> Sequence[Whitened]:
        """The observations of the comparison."""
        return self.comparison.whitened

    @property
    def lack_of_fit(self) -> Mapping[Hypothesis, LackOfFit]:
        """Of the calibrated model and the leading candidates."""
        return self.comparison.lack_of_fit

    @property
    def confidence(self) -> dict[Hypothesis, float]:
        """Probability of each candidate: its closed-world probability times `well_specified`."""
        pairs = zip(self.candidates, self.probability, strict=True)
        return {c.hypothesis: self.well_specified * p for c, p in pairs}

    @property
    def nearest(self) -> CandidateFit | None:
        """The plausible candidate with the lowest leave-one-out mean square; None without candidates."""
        return min(self.candidates, key=lambda c: (not c.is_plausible, c.mean_square), default=None)


def judge(comparison: Comparison, scores: list[Score]) -> Judgement:
    """Decide the verdict.

    - ``agrees``: the calibrated model is adequate, and no candidate is a large enough improvement.
    - ``unexplained``: the calibrated model is inadequate, and no candidate improves on it or is more probable; or the
      most probable candidate is inadequate; or that candidate is a set of mechanisms, while a single fault that no
      candidate describes would suffice; or it is almost certainly an imitation.
    - ``explained``: the most probable candidate is adequate, and its mechanisms have enough probability.
    - ``undecided``: otherwise.
    """
    most_probable, probability = comparison.most_probable, comparison.posterior
    order = np.argsort(-np.array(probability), kind="stable")
    unexplained = Judgement(
        "unexplained", comparison.base, comparison, [comparison.candidates[k] for k in order],
        [probability[k] for k in order], comparison.well_specified, scores,
    )  # fmt: skip
    agrees = comparison.is_adequate(comparison.base)
    # An inadequate model may fail by its lack of fit alone. A mechanism that removes it may gain little mean square.
    least = settings.WORTH_NAMING if agrees else 0.0
    probability_of_base = 1.0 - sum(probability)
    if not improves(most_probable, comparison.base, least) or probability_of_base > 0.5:
        return replace(unexplained, verdict="agrees") if agrees else unexplained
    if not comparison.is_adequate(most_probable):
        return unexplained
    places = single_fault_places(comparison, most_probable.hypothesis)
    # If an adequate candidate describes that single fault, the verdict is undecided, otherwise unexplained.
    if places and not any(_is_at(c, places) and comparison.is_adequate(c) for c in comparison.candidates):
        return replace(unexplained, single_fault_places=places)
    if comparison.well_specified * max(probability) <= settings.RIVAL:
        return unexplained
    # Every candidate with a mechanism, at whatever place and beside whatever others, counts towards its probability.
    of_each = [
        sum(p for c, p in zip(comparison.candidates, probability, strict=True) if name in c.hypothesis.names)
        for name in most_probable.hypothesis.names
    ]
    is_sure = comparison.well_specified * min(of_each) >= settings.SURE and not places
    return replace(unexplained, verdict="explained" if is_sure else "undecided", best=most_probable)


def improves(candidate: CandidateFit, base: CandidateFit, least: float) -> bool:
    """Whether a candidate lowers the mean square by more than a share `least`, and not at some recordings' expense.

    Where the mean square rises, it may rise by less than `UNSTEADY` times its decrease in the other recordings. An
    effect that is present on the rig raises it in none.
    """
    gain = base.by_recording - candidate.by_recording
    better, worse = gain.clip(0.0).mean(), -gain.clip(None, 0.0).mean()
    return bool(better - worse > least * max(1.0, base.mean_square) and worse < settings.UNSTEADY * better)


def _is_at(candidate: CandidateFit, places: Sequence[str]) -> bool:
    """Whether a candidate is a single mechanism at one of these places."""
    return candidate.hypothesis.size == 1 and set(candidate.hypothesis.places) <= set(places)


def single_fault_places(comparison: Comparison, hypothesis: Hypothesis) -> list[str]:
    """Places where a single fault of unknown kind would explain the recordings as well as a set of mechanisms does.

    The places are those of every part without which the calibrated model fits (`isolate`), the best first. A single
    fault is more probable than two mechanisms that together imitate it: an eccentric encoder disc, for instance, is
    imitated by an eccentric pulley and a torque gain. If all mechanisms of the set act at one of these parts, fault
    isolation cannot tell the set from a single fault, and the list is empty.
    """
    if hypothesis.size < 2:
        return []
    set_places = set(hypothesis.places)
    isolated = sorted(
        (excess, places)
        for excess, places in isolate(comparison.whitened, comparison.base)
        if excess <= settings.SUFFICIENT - 1.0
    )
    if any(set_places <= set(places) for _, places in isolated):
        return []
    return list(dict.fromkeys(place for _, places in isolated for place in places))


def nested_choice(judgement: Judgement) -> list[CandidateFit]:
    """By recording, the model with the lowest mean square on all other recordings (nested cross-validation).

    The error of a recording that is reported as held out must not have influenced the choice of the model either. The
    choice is the verdict's model throughout if that is the calibrated model, or if there is a single recording.
    """
    count = len(judgement.whitened)
    if judgement.best is judgement.calibrated or count == 1:
        return [judgement.best] * count
    every = [judgement.calibrated, *judgement.candidates]
    mean_squares = np.stack([c.by_recording for c in every])
    others = mean_squares.sum(axis=1, keepdims=True) - mean_squares
    return [every[k] for k in np.argmin(others, axis=0)]
