"""From trials to a verdict.

Hypotheses are compared by what they leave of recordings that they were not fitted to: the mean square of whitened
errors, which is one where nothing is missing. Samples are far too many to count each as evidence (what a model leaves
beyond noise is alike from sample to sample), so each channel of a recording counts as a number of looks.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from ccmodel.diagnose.candidate import CandidateFit, Score, fit, score
from ccmodel.diagnose.hypothesis import PAPER, Hypothesis, plausible
from ccmodel.diagnose.isolation import cleared
from ccmodel.diagnose.lack_of_fit import LackOfFit, structure
from ccmodel.diagnose.whitening import LOOKS, Whitened, weighed_about
from ccmodel.failure import ModelError
from ccmodel.inference.problem import Free, each

# A mechanism is worth a trial if it takes this share off the calibrated model's mean square, and a naming if it takes
# more than this off what is left of held-out recordings, and off nearly all of them: one that makes some worse by this
# share of what it makes others better has learnt a recording, and not the rig.
WORTH_A_TRIAL = 0.01
WORTH_A_NAME = 0.05
UNSTEADY = 0.25
# Trials after the screening, how many at least where something is missing (the screening is linear, and what rings or
# sticks is not); singles that may be one of a pair, and partners tried with each.
TRIALS, FEWEST_TRIALS = 6, 3
FIRSTS, PARTNERS = 2, 3
# What a right model leaves: the mean square of held-out recordings, with a share of the calibrated model's excess on
# top, and in that next to nothing to be learnt by more than chance, with what the simple form of a mechanism may miss.
RIGHT = 1.5
RIGHT_SHARE = 0.05
# A single mechanism that leaves more than this, with what its simple form may miss, may have company: pairs are tried.
ENOUGH = 1.2
# Of many hundred pairs one comes near by chance: a pair is right only if it leaves this, and of that share on top as
# much less as more of them were fitted, or what the simple forms of its members may miss.
RIGHT_PAIR = 1.3
LEARNABLE = 0.01
# Trials that are asked what could still be learnt of what they leave.
CONTENDERS = 4
# A second mechanism must halve what the first one leaves beyond noise.
PAIR_SHARE = 0.5
# Odds against naming something before anything is seen, and probability from which a name is given alone.
PRIOR_AGREES = 0.5
SURE = 0.8
# That what is missing is on no list, before anything is seen; and what says afterwards that it was not. Right models
# leave about LEVEL (mean and standard deviation over clean practice cases), and every other form adds a share of the
# excess, FORM_SHARE or so. What is on no list is imitated by the best of the list more or less well, to any share of
# the excess alike; by the best of all pairs that are fitted as well as the best of so many.
OFF_LIST = 0.2
LEVEL = (0.93, 0.09)
FORM_SHARE = 0.04
RIVAL = 0.02
# A single recording leaves nothing to hold out; where no rest shows the pretension the errors have valleys of which a
# fit sees some; and where something is allowed, nobody knows what a right model would leave of that. No name is sure
# then, however well its mechanism fits.
UNTESTED = 0.75
MOST_ALTERNATIVES = 4


@dataclass(frozen=True)
class Judgement:
    """What the comparison of all hypotheses came to.

    Attributes
    ----------
    verdict : {"agrees", "explained", "undecided", "unexplained"}
    calibrated : CandidateFit
        The paper's model.
    best : CandidateFit
        The likeliest hypothesis where it may explain the recordings; else the calibrated model.
    trials : list of CandidateFit
        What was fitted in full and as the recordings were weighed in the end, the likeliest first.
    probability : list of float
        Of each of these.
    scores : list of Score
        The screening.
    listed : float
        Probability that what is missing is on the list at all, by what the likeliest trial leaves.
    learnable : mapping of Hypothesis to LackOfFit
        What a flexible model could still learn of what the calibrated model and the leading trials leave.
    weighed : sequence of Whitened
        The recordings as they were weighed for all this.
    one_fault : sequence of str
        Places where a single fault of no known kind would do as well as the two mechanisms that come nearest.
    """

    verdict: str
    calibrated: CandidateFit
    best: CandidateFit
    trials: list[CandidateFit]
    probability: list[float]
    listed: float
    scores: list[Score]
    learnable: Mapping[Hypothesis, LackOfFit]
    weighed: Sequence[Whitened]
    one_fault: Sequence[str] = ()

    @property
    def nearest(self) -> CandidateFit | None:
        """The trial that leaves the least, right or not, of those that can be; None where none was worth fitting."""
        return min(self.trials, key=lambda t: (not _is_plausible(t), _left(t)), default=None)


@dataclass(frozen=True)
class Comparison:
    """Hypotheses fitted to recordings that are weighed alike: the calibrated model, and others with the best first.

    Attributes
    ----------
    weighed : sequence of Whitened
    base : CandidateFit
    trials : list of CandidateFit
    learnable : mapping of Hypothesis to LackOfFit
    asked : int
        How many hypotheses these were chosen from.
    """

    weighed: Sequence[Whitened]
    base: CandidateFit
    trials: list[CandidateFit]
    learnable: Mapping[Hypothesis, LackOfFit]
    asked: int = 0

    @classmethod
    def of(
        cls, weighed: Sequence[Whitened], base: CandidateFit, trials: Sequence[CandidateFit], asked: int = 0
    ) -> "Comparison":
        """Trials in their order, the leading and the likeliest asked what could still be learnt of what they leave.

        One that wants more of a mechanism than there can be comes after all others, whatever it leaves.
        """
        trials = sorted(trials, key=lambda t: (not _is_plausible(t), _left(t)))
        likeliest = np.argsort(_probabilities(weighed, base, trials, asked))[-1:]
        contenders = {t.hypothesis: t for t in [base, *trials[:CONTENDERS], *(trials[k] for k in likeliest)]}
        return cls(weighed, base, trials, {h: structure(weighed, t) for h, t in contenders.items()}, asked)

    @property
    def probability(self) -> list[float]:
        """Of each trial; what is missing from one is the calibrated model's."""
        return _probabilities(self.weighed, self.base, self.trials, self.asked)

    def is_right(self, trial: CandidateFit) -> bool:
        """Whether a trial leaves what a right model would."""
        return is_right(trial, self.base, self.learnable)

    @property
    def has_right(self) -> bool:
        """Whether the best trial leaves what a right model would."""
        return bool(self.trials) and self.is_right(self.trials[0])

    @property
    def wants_more(self) -> bool:
        """Whether something was found worth a trial, and even the best of it may have missed something."""
        if not self.has_right:
            return bool(self.trials)
        best = self.trials[0]
        return _left(best) > ENOUGH + best.hypothesis.model_form_error * max(_left(self.base) - 1.0, 0.0)


def judge(
    weighed: Sequence[Whitened],
    calibrated: Mapping[str, Free],
    start: Mapping[str, float],
    known: Sequence[Hypothesis],
    tell: Callable[[str], None] = lambda text: None,
    forced_candidates: Sequence[Hypothesis] = (),
    model: Hypothesis = PAPER,
) -> Judgement:
    """Try all hypotheses and come to a verdict.

    Parameters
    ----------
    weighed : sequence of Whitened
    calibrated : mapping of str to Free
        What a calibration of the paper's model leaves free.
    start : mapping of str to float
        Values of these from a first fit, and of the numbers of what the model has besides the paper's physics.
    known : sequence of Hypothesis
        Single mechanisms that may be missing.
    tell : callable
        Is told how the work goes on, a line at a time.
    forced_candidates : sequence of Hypothesis
        Singles or pairs that are fitted in full whatever the screening says of them.
    model : Hypothesis
        The model in question; the paper's unless something else is known already.
    """
    base = fit(weighed, model, calibrated, start)
    tell(f"the calibrated model leaves {_left(base):.2f} of the noise's mean square; asking every mechanism")
    scores = score(weighed, base, known)
    fewest = FEWEST_TRIALS if _left(base) > RIGHT else 0
    leading = [s for k, s in enumerate(scores) if s.values and (s.gain > WORTH_A_TRIAL or k < fewest)][:TRIALS]
    asked = [Score(h, 0.0, h.start) for h in forced_candidates if h not in [s.hypothesis for s in leading]]
    found = Comparison.of(weighed, base, _fit_all(weighed, calibrated, base, [*leading, *asked], tell), len(known))
    if found.wants_more:
        found = _weighed_anew(found, calibrated, tell)
    if found.wants_more:
        found = _with_pairs(found, calibrated, known, tell)
    return _verdict(found, scores)


def _with_pairs(found: Comparison, calibrated: Mapping[str, Free], known: Sequence[Hypothesis], tell) -> Comparison:
    """The same with pairs that are worth more than their members, of singles that would do where there are any."""
    alone = [t for t in found.trials if len(t.hypothesis.acting) == 1]
    firsts = [t for t in alone if found.is_right(t)] or alone
    trials = [*found.trials, *_pairs(found.weighed, calibrated, firsts[:FIRSTS], known, tell)]
    paired = Comparison.of(found.weighed, found.base, [t for t in trials if _names_more(t, trials)], found.asked)
    if not paired.has_right and len(paired.trials[0].hypothesis.acting) > 1:
        paired = _weighed_anew(paired, calibrated, tell)
        paired = replace(paired, trials=[t for t in paired.trials if _names_more(t, paired.trials)])
    # A pair that comes near without being right takes nothing from a single that is.
    return found if found.has_right and not paired.has_right else paired


def _weighed_anew(found: Comparison, calibrated: Mapping[str, Free], tell) -> Comparison:
    """Singles and the leading pairs again, beside what differs from run to run as the best of them feels it.

    What is not known of the drive's motion makes a load with mass ring, which the paper's model knows nothing of. Where
    no rest shows the pretension each is also fitted from where the best one ended: errors have valleys there.
    """
    best = found.trials[0]
    tell(f"weighing the recordings about {best.hypothesis}")
    model = [best.hypothesis.of(w.observations.parameters).with_values(best.values) for w in found.weighed]

    def starts(trial: CandidateFit) -> list[dict[str, float]]:
        if trial is best or "pretension_share" not in calibrated:
            return [trial.values]
        return [trial.values, trial.values | {name: best.values[name] for name in calibrated}]

    try:
        weighed = each(found.weighed, lambda i, w: weighed_about(w, model[i]))
        base = min((fit(weighed, found.base.hypothesis, calibrated, s) for s in starts(found.base)), key=_left)
    except ModelError as error:
        tell(f"they stay weighed as they are ({error})")
        return found
    leading = [t for k, t in enumerate(found.trials) if k < CONTENDERS or len(t.hypothesis.acting) == 1]
    again = _fit_all(weighed, calibrated, base, [Score(t.hypothesis, 0.0, s) for t in leading for s in starts(t)], tell)
    best_of = {t.hypothesis: t for t in sorted(again, key=_left, reverse=True)}
    return Comparison.of(weighed, base, list(best_of.values()), found.asked)


def is_right(trial: CandidateFit, base: CandidateFit, learnable: Mapping[Hypothesis, LackOfFit]) -> bool:
    """Whether a hypothesis is what a right one would be: it leaves little and no law in it, with values that can be."""
    unlearnt = learnable.get(trial.hypothesis)
    excess, missed = max(_left(base) - 1.0, 0.0), trial.hypothesis.model_form_error
    if unlearnt is None or not _is_plausible(trial) or (trial is base and _left(base) > RIGHT):
        return False
    most = RIGHT_PAIR if len(trial.hypothesis.acting) > 1 else RIGHT
    most += max(RIGHT_SHARE / _best_of(trial), missed) * excess
    return _left(trial) <= most and unlearnt.surely <= LEARNABLE + missed * excess


def _best_of(trial: CandidateFit) -> int:
    """As the best of how many independent imitations a trial may pass: a first's partners, since firsts are alike."""
    return PARTNERS if len(trial.hypothesis.acting) > 1 else 1


def _is_plausible(trial: CandidateFit) -> bool:
    return plausible(trial.hypothesis, trial.values)


def _left(trial: CandidateFit) -> float:
    return float(trial.left.mean())


def _fit_all(weighed, calibrated, base: CandidateFit, chosen: Sequence[Score], tell) -> list[CandidateFit]:
    """Fit what extends a fitted hypothesis."""
    trials = []
    for s in chosen:
        hypothesis = base.hypothesis.and_also(s.hypothesis)
        try:
            trial = fit(weighed, hypothesis, calibrated, base.values | s.values)
        except (ModelError, ValueError) as error:
            tell(f"{hypothesis}: cannot be run ({error})")
            continue
        tell(f"{hypothesis}: leaves {_left(trial):.2f}")
        trials.append(trial)
    return trials


def _pairs(weighed, calibrated, firsts: Sequence[CandidateFit], known, tell) -> list[CandidateFit]:
    tell("one mechanism is not enough; trying pairs")
    found, seen = [], set()
    for first in firsts:
        partners = [h for h in known if h.acting[0] not in first.hypothesis.acting]
        chosen = []
        for s in score(weighed, first, partners):
            pair = frozenset(first.hypothesis.acting + s.hypothesis.acting)
            if s.gain > WORTH_A_TRIAL and pair not in seen and len(chosen) < PARTNERS:
                seen.add(pair)
                chosen.append(s)
        found += _fit_all(weighed, calibrated, first, chosen, tell)
    return found


def _names_more(trial: CandidateFit, trials: Sequence[CandidateFit]) -> bool:
    """Whether a pair is worth more than each of its members alone; a single always is."""
    if len(trial.hypothesis.acting) < 2:
        return True
    members = set(trial.hypothesis.acting)
    alone = [t for t in trials if set(t.hypothesis.acting) < members]
    return all(_left(trial) - 1 < PAIR_SHARE * (_left(t) - 1) and _left(trial) < _left(t) for t in alone)


def _looks(weighed: Sequence[Whitened]) -> float:
    """Independent looks that recordings give; what a right model is allowed to leave is alike in all of them."""
    each_gives = np.array([LOOKS * len(w.observations.channels) for w in weighed])
    allowed = np.array([w.observations.tolerance_share for w in weighed])
    return float(np.sum(each_gives * (1 - allowed)) + np.mean(each_gives * allowed))


def _probabilities(weighed, base: CandidateFit, trials: Sequence[CandidateFit], asked: int) -> list[float]:
    """Probability of each trial; what is missing from one is the calibrated model's.

    The best of many that were asked leaves little by chance, so that each begins with its share of all of these.
    """
    if not trials:
        return []
    looks = _looks(weighed)
    left = np.array([_left(base), *map(_left, trials)])
    unknowns = np.array([0, *(len(t.values) - len(base.values) for t in trials)])
    scale = max(1.0, left.min())
    log = -0.5 * looks * left / scale - 0.5 * unknowns * np.log(looks)
    log += np.log([PRIOR_AGREES, *[(1 - PRIOR_AGREES) / max(asked, len(trials))] * len(trials)])
    log[1:][[not _is_plausible(t) for t in trials]] = -np.inf
    weight = np.exp(log - log.max())
    return (weight / weight.sum())[1:].tolist()


def is_listed(trial: CandidateFit, base: CandidateFit) -> float:
    """Probability that what is missing is on the list, and not something else that the best of the list imitates.

    By Bayes' rule from what the trial leaves, whose densities are those of a right model and of an imitation.
    """
    level, sd = LEVEL
    excess, over = max(_left(base) - level, sd), _left(trial) - level
    form = max(FORM_SHARE, trial.hypothesis.model_form_error) * excess
    wide = np.hypot(sd, form)
    exact = norm.pdf(over, scale=sd)
    # A share of half a normal distribution, and the level's scatter on top.
    simplified = 2 * norm.pdf(over, scale=wide) * norm.cdf(over * form / (sd * wide))
    n = _best_of(trial)
    share = float(np.clip(over / excess, 0.0, 1.0))
    imitation = norm.cdf(over / sd) * n * (1 - share) ** (n - 1) / excess
    right = (1 - OFF_LIST) * (exact + simplified) / 2
    return float(right / (right + OFF_LIST * imitation))


def _verdict(found: Comparison, scores: list[Score]) -> Judgement:
    base, trials, learnable = found.base, found.trials, found.learnable
    probability = found.probability
    likeliest = trials[int(np.argmax(probability))] if trials else base
    listed = is_listed(likeliest, base) if trials else 1.0
    blind = len(found.weighed) == 1 or "pretension_share" in base.free
    listed *= UNTESTED ** (1.0 if blind else np.mean([w.observations.tolerance_share for w in found.weighed]))

    def judged(verdict: str, best: CandidateFit) -> Judgement:
        order = np.argsort(-np.array(probability), kind="stable")
        likely = [trials[k] for k in order], [probability[k] for k in order]
        return Judgement(verdict, base, best, *likely, listed, scores, learnable, found.weighed)

    # Where law is left in what the calibrated model leaves, a mechanism that takes it away counts however little it is.
    agrees = is_right(base, base, learnable)
    if not _matters(likeliest, base, WORTH_A_NAME if agrees else 0.0) or 1.0 - sum(probability) > 0.5:
        return judged("agrees" if agrees else "unexplained", base)
    if not is_right(likeliest, base, learnable):
        return judged("unexplained", base)
    one_fault = _one_fault(found, likeliest.hypothesis)
    # What is on no list may be that fault, unless the list has one there that would do.
    if one_fault and not any(_is_at(t, one_fault) and is_right(t, base, learnable) for t in trials):
        return replace(judged("unexplained", base), one_fault=one_fault)
    if listed * max(probability) <= RIVAL:  # Nothing is left to be undecided about.
        return judged("unexplained", base)
    # A mechanism that could be at either of two places is named all the same.
    names = likeliest.hypothesis.names
    sure = sum(p for t, p in zip(trials, probability, strict=True) if t.hypothesis.names == names)
    return judged("explained" if listed * sure >= SURE and not one_fault else "undecided", likeliest)


def _is_at(trial: CandidateFit, places: Sequence[str]) -> bool:
    """Whether a trial has but one mechanism, at one of these places."""
    return len(trial.hypothesis.acting) == 1 and trial.hypothesis.acting[0][1] in places


def _one_fault(found: Comparison, hypothesis: Hypothesis) -> list[str]:
    """Places where a fault of one part alone, of whatever kind, accounts for what two mechanisms do together.

    Two that by chance do what one fault would are the less likely story: an encoder's disc off its axis is imitated by
    an eccentric pulley and a torque's gain. Both may be faults of that very part, and then there is nothing to it.
    """
    if len(hypothesis.acting) < 2:
        return []
    acting = {place for _, place in hypothesis.acting}
    would_do = sorted((left, places) for left, places in cleared(found.weighed, found.base) if left <= ENOUGH - 1.0)
    if any(acting <= set(places) for _, places in would_do):
        return []
    return list(dict.fromkeys(place for _, places in would_do for place in places))


def _matters(trial: CandidateFit, base: CandidateFit, least: float) -> bool:
    """Whether a hypothesis takes enough off what the calibrated model leaves, and not off some recordings alone.

    `least` is the share of it that must go.
    """
    gain = base.left - trial.left
    better, worse = gain.clip(0.0).mean(), -gain.clip(None, 0.0).mean()
    return bool(better - worse > least * max(1.0, _left(base)) and worse < UNSTEADY * better)


def nested_errors(judgement: Judgement) -> list[CandidateFit]:
    """By recording, the trial that would have been chosen had it not been there; of a single one, the best."""
    rivals = [judgement.calibrated, *judgement.trials]
    if judgement.best is judgement.calibrated or judgement.calibrated.left.size == 1:
        return [judgement.best] * judgement.calibrated.left.size
    left = np.stack([t.left for t in rivals])
    others = left.sum(axis=1, keepdims=True) - left
    pick: NDArray = np.argmin(others, axis=0)
    return [rivals[k] for k in pick]
