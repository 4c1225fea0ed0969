"""The verdict from a comparison of candidate models."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ccmodel.diagnose import settings
from ccmodel.diagnose.candidate import CandidateFit
from ccmodel.diagnose.comparison import Comparison
from ccmodel.diagnose.hypothesis import Hypothesis
from ccmodel.diagnose.isolation import isolate
from ccmodel.diagnose.lack_of_fit import LackOfFit
from ccmodel.diagnose.screening import Score
from ccmodel.diagnose.whitening import Whitened


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
        Of the comparison, the most probable first.
    probability : list of float
        Closed-world posterior probability of each of these.
    well_specified : float
        Probability that the most probable candidate is correct and no imitation.
    scores : list of Score
        Of the screening.
    single_fault_places : sequence of str
        Places where a single fault of unknown kind would explain the recordings as well as the most probable pair.
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
        """Probability of each candidate, misspecification taken into account."""
        pairs = zip(self.candidates, self.probability, strict=True)
        return {c.hypothesis: self.well_specified * p for c, p in pairs}

    @property
    def nearest(self) -> CandidateFit | None:
        """The plausible candidate with the lowest leave-one-out mean square; None without candidates."""
        return min(self.candidates, key=lambda c: (not c.is_plausible, c.mean_square), default=None)


def judge(found: Comparison, scores: list[Score]) -> Judgement:
    """Come to a verdict.

    - ``agrees``: the calibrated model is adequate, and no candidate improves on it enough to be named.
    - ``unexplained``: neither it nor the most probable candidate is adequate; or the candidate is a pair where a single
      fault of unknown kind would do; or it is most likely an imitation.
    - ``explained``: the most probable candidate is adequate and its names are sure enough.
    - ``undecided``: otherwise.
    """
    likely, probability = found.most_probable, found.posterior
    order = np.argsort(-np.array(probability), kind="stable")
    unexplained = Judgement(
        "unexplained", found.base, found, [found.candidates[k] for k in order], [probability[k] for k in order],
        found.well_specified, scores,
    )  # fmt: skip
    # A mechanism that removes the lack of fit of an inadequate model counts, however small its gain.
    agrees = found.is_adequate(found.base)
    least = settings.WORTH_NAMING if agrees else 0.0
    if not improves(likely, found.base, least) or 1.0 - sum(probability) > 0.5:
        return replace(unexplained, verdict="agrees") if agrees else unexplained
    if not found.is_adequate(likely):
        return unexplained
    elsewhere = single_fault_places(found, likely.hypothesis)
    if elsewhere and not any(_is_at(c, elsewhere) and found.is_adequate(c) for c in found.candidates):
        return replace(unexplained, single_fault_places=elsewhere)
    if found.well_specified * max(probability) <= settings.RIVAL:
        return unexplained
    # Candidates with the same mechanism at different places add up to the probability of its name.
    names = likely.hypothesis.names
    named = sum(p for c, p in zip(found.candidates, probability, strict=True) if c.hypothesis.names == names)
    is_sure = found.well_specified * named >= settings.SURE and not elsewhere
    return replace(unexplained, verdict="explained" if is_sure else "undecided", best=likely)


def improves(candidate: CandidateFit, base: CandidateFit, least: float) -> bool:
    """Whether a candidate lowers the mean square by more than a share `least`, and not at some recordings' expense."""
    gain = base.by_recording - candidate.by_recording
    better, worse = gain.clip(0.0).mean(), -gain.clip(None, 0.0).mean()
    return bool(better - worse > least * max(1.0, base.mean_square) and worse < settings.UNSTEADY * better)


def _is_at(candidate: CandidateFit, places: Sequence[str]) -> bool:
    """Whether a candidate is a single mechanism at one of these places."""
    return not candidate.hypothesis.is_pair and set(candidate.hypothesis.places) <= set(places)


def single_fault_places(found: Comparison, hypothesis: Hypothesis) -> list[str]:
    """Places where a single fault of unknown kind would explain the recordings as well as a pair does.

    Two mechanisms that together imitate a single fault are the less probable explanation: an eccentric encoder disc is
    imitated by an eccentric pulley and a torque gain. If both mechanisms are faults of that part, the pair stands.
    """
    if not hypothesis.is_pair:
        return []
    acting = set(hypothesis.places)
    isolated = sorted(
        (left, at) for left, at in isolate(found.whitened, found.base) if left <= settings.SUFFICIENT - 1.0
    )
    if any(acting <= set(at) for _, at in isolated):
        return []
    return list(dict.fromkeys(place for _, at in isolated for place in at))


def nested_choice(judgement: Judgement) -> list[CandidateFit]:
    """By recording, the candidate that would be chosen without it, so that the choice is held out as well.

    Of a single recording it is the best candidate.
    """
    count = len(judgement.whitened)
    if judgement.best is judgement.calibrated or count == 1:
        return [judgement.best] * count
    every = [judgement.calibrated, *judgement.candidates]
    mean_squares = np.stack([c.by_recording for c in every])
    others = mean_squares.sum(axis=1, keepdims=True) - mean_squares
    return [every[k] for k in np.argmin(others, axis=0)]
