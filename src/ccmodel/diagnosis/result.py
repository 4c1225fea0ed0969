"""A judgement as plain data, the content of diagnosis.json (docs/diagnosis-files.md)."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.channels import short_name, unit_of
from ccmodel.deadline import UNLIMITED, Deadline, OutOfTimeError
from ccmodel.diagnosis import experiment, location, repeatability, settings
from ccmodel.diagnosis.candidate import CandidateFit, fit, is_at_bound
from ccmodel.diagnosis.comparison import friction_of
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.law_report import laws_of
from ccmodel.diagnosis.linear_functions import covariance_by_information
from ccmodel.diagnosis.observations import NotJudged
from ccmodel.diagnosis.verdict import Judgement, nested_choice
from ccmodel.distributions import normal_quantile
from ccmodel.failure import ModelError
from ccmodel.inference.intervals import COVERAGE
from ccmodel.inference.problem import Free
from ccmodel.model.parameters import Parameters, mechanism_key

FORMAT = 1


def report(
    batch: str,
    judgement: Judgement,
    calibrated: CandidateFit,
    estimates: Parameters,
    not_judged: NotJudged,
    deadline: Deadline = UNLIMITED,
) -> dict:
    """The content of diagnosis.json.

    Parameters
    ----------
    batch : str
    judgement : Judgement
    calibrated : CandidateFit
        The calibration before any candidate. The one of the comparison is fitted with the best candidate's covariance,
        which may raise its errors.
    estimates : Parameters
    not_judged : list of {"what", "why"}
    deadline : Deadline
        When the isolation of a fault is given up.
    """
    best, base, whitened = judgement.best, judgement.calibrated, judgement.whitened
    of_list = judgement.identified
    named = [best.hypothesis.acting[k] for k in of_list]
    failures: NotJudged = []
    laws = laws_of(judgement)
    is_open = judgement.is_open or any(law["indistinguishable"] for law in laws)
    try:
        located = location.location(judgement, calibrated, deadline)
    except OutOfTimeError:
        located = location.location(judgement, calibrated, isolating=False)
        why = "the limit was reached before the model was fitted without each channel"
        failures = [{"what": "the place of the mismatch", "why": why}]
    return {
        "format": FORMAT,
        "batch": batch,
        "verdict": judgement.verdict,
        "is_held": base.hypothesis.is_frozen,
        "location": located,
        "mechanisms": _stated(judgement, of_list),
        "laws": laws,
        "alternatives": alternatives_of(judgement, dict(named)),
        "likeliest": likeliest_of(judgement),
        "nearest": _nearest(judgement, calibrated),
        "fit": {
            "held_out": [w.observations.id for w in whitened] if len(whitened) > 1 else [],
            "calibrated": calibrated.values,
            "mean_square": {"calibrated": base.mean_square, "extended": best.mean_square},
            "error": held_out_errors(judgement, calibrated, nested_choice(judgement)),
        },
        "repeatability": repeatability.report(whitened),
        "next_experiment": experiment.proposed(judgement, estimates) if is_open else None,
        "not_judged": [
            *not_judged,
            *contradicting_recording(judgement),
            *deviating_friction(best),
            *_at_bounds(best),
            *failures,
        ],
    }


def _nearest(judgement: Judgement, calibrated: CandidateFit) -> dict | None:
    """The nearest candidate of an unexplained batch, its leave-one-out mean square and errors; otherwise None."""
    if judgement.verdict != "unexplained" or (nearest := judgement.nearest) is None:
        return None
    acting = [mechanism_of(nearest, k, 0.0) for k in range(len(nearest.hypothesis.acting))]
    return {
        "mechanisms": [{key: value for key, value in m.items() if key != "confidence"} for m in acting],
        "mean_square": nearest.mean_square,
        "error": held_out_errors(judgement, calibrated, [nearest] * len(judgement.whitened)),
        "one_fault_at": list(judgement.single_fault_places),
    }


def alternatives_of(judgement: Judgement, named: Mapping[str, str]) -> list[dict]:
    """Every other mechanism with a probability worth mentioning, at its likeliest place; of a named one, the others."""
    if judgement.verdict in ("agrees", "learned", "unexplained"):
        return []
    confidence = judgement.confidence
    every = {acting for hypothesis in confidence for acting in hypothesis.acting if acting[0] not in registry.laws()}
    places: dict[str, str] = {}
    for name, place in sorted(every, key=lambda acting: (-_place_probability(acting, confidence), acting)):
        places.setdefault(name, place)
    others = [(n, p, _below_certainty(judgement.confidence_in(n))) for n, p in places.items() if n not in named]
    elsewhere = [acting for acting in every if acting[0] in named and acting not in judgement.best.hypothesis.acting]
    others += [(*acting, _below_certainty(_place_probability(acting, confidence))) for acting in sorted(elsewhere)]
    ranked = sorted(others, key=lambda one: -one[2])[: settings.MOST_ALTERNATIVES]
    return [{"name": n, "place": p, "confidence": round(c, 4)} for n, p, c in ranked if c > settings.ALTERNATIVE]


def likeliest_of(judgement: Judgement) -> list[dict]:
    """The mechanisms of an undecided verdict's model, with the values that it predicts with; of other verdicts none."""
    if judgement.verdict != "undecided":
        return []
    return _stated(judgement, range(len(judgement.best.hypothesis.acting)))


def _stated(judgement: Judgement, positions: Sequence[int]) -> list[dict]:
    """Mechanisms of a verdict's model, by their positions, with their confidences."""
    confidence = judgement.confidences
    return [mechanism_of(judgement.best, k, _below_certainty(confidence[k])) for k in positions]


def _below_certainty(confidence: float) -> float:
    """A confidence as it is reported."""
    return min(settings.MOST_CONFIDENT, confidence)


def _place_probability(acting: tuple[str, str], confidence: Mapping[Hypothesis, float]) -> float:
    """Probability that a mechanism acts at a place."""
    return sum(p for hypothesis, p in confidence.items() if acting in hypothesis.acting)


def mechanism_of(candidate: CandidateFit, k: int, confidence: float) -> dict:
    """A mechanism's values, corrected for the discretisation error, with intervals that contain the correction.

    The model file keeps the values as fitted, which are the best on the solver that runs them.
    """
    name, place = candidate.hypothesis.acting[k]
    names = list(candidate.values)
    free = candidate.hypothesis.free(candidate.values)
    reach = _half_widths(candidate, free)
    parameters = []
    mechanism = registry.get(name)
    for p in mechanism.parameters:
        key = mechanism_key(name, place, p.name)
        i, low, high = names.index(key), free[key].low, free[key].high
        value = float(np.clip(candidate.values[key] + candidate.discretisation[i], low, high))
        is_relative = bool(mechanism.states) and p in mechanism.strengths
        ends = interval(value, float(reach[i]), is_relative)
        if is_relative:
            least = least_strength(candidate, key, mechanism_key(name, place, mechanism.states[0].name))
            nearest = int(np.argmin(np.abs(ends)))
            ends[nearest] = np.sign(value) * min(least, abs(ends[nearest]))
        ends = ends.clip(low, high).tolist()
        unit = p.unit.replace(" ", "*")
        parameters.append({"name": p.name, "value": value, "low": ends[0], "high": ends[1], "unit": unit})
    return {"name": name, "place": place, "confidence": round(confidence, 4), "parameters": parameters}


def _half_widths(candidate: CandidateFit, free: Mapping[str, Free]) -> NDArray:
    """Half-widths of the unknowns' intervals; of one at its bound, at least that of the information.

    There it does not scatter between recordings, however little they show of it.
    """
    reach = candidate.half_widths()
    at_bound = [name in free and is_at_bound(value, free[name]) for name, value in candidate.values.items()]
    if not any(at_bound):
        return reach
    by_information = np.sqrt(np.diag(covariance_by_information(candidate)).clip(0.0))
    return np.where(at_bound, np.maximum(reach, normal_quantile(0.5 + COVERAGE / 2) * by_information), reach)


def interval(value: float, reach: float, is_relative: bool) -> NDArray:
    """Ends of an interval of half-width `reach`, shape (2,); of a relative one on the logarithmic scale.

    The strength of a mechanism with a state is what shows of it over one less the state: its error is a factor, and the
    strength may be many times as large as the value, but not much smaller.
    """
    if not is_relative or value == 0.0:
        return np.array([value - reach, value + reach])
    # A factor beyond exp(20) is beyond any bound.
    return np.sort(value * np.exp(np.array([-1, 1]) * min(reach / abs(value), 20.0)))


def least_strength(candidate: CandidateFit, strength: str, state: str) -> float:
    """The most that shows of a strength in any recording, at the lower end of its 90 % interval.

    No recording tells whether more of it was over before all of them. The state's prior favours recordings that differ
    little, and so a larger strength than has shown anywhere.

    Parameters
    ----------
    candidate : CandidateFit
    strength, state : str
        Unknowns: the strength, and the share of it that is over when a recording starts, on average.

    Returns
    -------
    float
        Infinite if the recordings' times give the state.
    """
    own = [w.states_within_range(candidate.values) for w in candidate.whitened]
    value, mean = candidate.values[strength], candidate.values[state]
    if not all(state in states for states in own) or not own or value * (1 - mean) == 0.0:
        return np.inf
    names = list(candidate.values)
    some = [names.index(strength), names.index(state)]
    by_both = np.array([1 - mean, -value])
    spread = np.sqrt(max(by_both @ candidate.covariance[np.ix_(some, some)] @ by_both, 0.0)) / abs(value * (1 - mean))
    least_over = min(states[state] for states in own)
    return float(abs(value) * (1 - least_over) * np.exp(-normal_quantile(0.5 + COVERAGE / 2) * spread))


def held_out_errors(judgement: Judgement, calibrated: CandidateFit, chosen: Sequence[CandidateFit]) -> dict[str, dict]:
    """Root mean square error on held-out recordings by channel, and the noise floor.

    "before" is the calibrated model, "after" the model that is `chosen` for each recording.
    """
    squares: dict[str, list[tuple[float, float, float]]] = {}
    for i, w in enumerate(judgement.whitened):
        o = w.observations
        after_fit = calibrated if chosen[i] is judgement.calibrated else chosen[i]
        before, after = (c.held_out(i).errors({}) for c in (calibrated, after_fit))
        for c, channel in enumerate(o.channels):
            row = *(np.mean((e[c] * o.sigma[c]) ** 2) for e in (before, after)), w.noise_floor[channel] ** 2
            squares.setdefault(channel, []).append(row)
    found = {}
    for channel, rows in squares.items():
        before, after, noise = np.sqrt(np.mean(rows, axis=0)).tolist()
        name = short_name(channel)
        found[name] = {"before": before, "after": after, "noise": noise, "unit": unit_of(channel).replace(" ", "*")}
    return found


def contradicting_recording(judgement: Judgement) -> NotJudged:
    """Of an unexplained batch, the recording without which the calibrated model fits; a list of one or none."""
    base, whitened = judgement.calibrated, judgement.whitened
    if judgement.verdict != "unexplained" or len(whitened) < settings.FEWEST_TO_CONTRADICT:
        return []
    worst = int(np.argmax(base.by_recording))
    others = [w for i, w in enumerate(whitened) if i != worst]
    try:
        without = fit(others, base.hypothesis, base.free, base.values).mean_square
    except (ModelError, ValueError):
        return []
    if without > settings.GOOD_FIT:
        return []
    why = (
        f"the calibrated model has a mean square of {without:.2f} (1: noise) in the others without it, and of"
        f" {float(base.by_recording[worst]):.3g} in this one: check its bend, pretension and wiring against the batch"
        " file"
    )
    return [{"what": whitened[worst].observations.id, "why": why}]


def deviating_friction(candidate: CandidateFit) -> NotJudged:
    """Recordings whose friction deviates from that of the others, if it differs by more than from run to run."""
    if friction_of(candidate).log_factor_about_trend > settings.FRICTION_SCATTERS:
        return []
    return [
        {
            "what": id_,
            "why": f"its friction is {abs(100 * share):.2g} % {'higher' if share > 0 else 'lower'} than in the others,"
            " and more than from run to run: check its bend against the batch file",
        }
        for id_, share in repeatability.friction_of_deviating(candidate.whitened, candidate.residuals).items()
    ]


def _at_bounds(candidate: CandidateFit) -> NotJudged:
    """Calibrated values that stand at one of their bounds."""
    return [
        {"what": name, "why": f"stands at the end of its range, {candidate.values[name]:.4g}: not a value to rely on"}
        for name in candidate.at_bounds()
    ]
