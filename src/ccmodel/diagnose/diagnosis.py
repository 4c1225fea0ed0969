"""A batch's recordings -> a diagnosis, as plain data."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student
from threadpoolctl import threadpool_limits

from ccmodel import mechanisms as registry
from ccmodel.diagnose import experiment, location
from ccmodel.diagnose.candidate import CandidateFit, fit, moved_by_finer
from ccmodel.diagnose.comparison import MOST_ALTERNATIVES, RIGHT, RIVAL, Judgement, judge, nested_errors
from ccmodel.diagnose.hypothesis import Hypothesis, singles
from ccmodel.diagnose.whitening import FRICTION_SPREAD, Whitened, weigh
from ccmodel.failure import ModelError
from ccmodel.inference.intervals import COVERAGE
from ccmodel.inference.problem import MEASURED, Free, Observations, Problem, Tolerance, each
from ccmodel.inference.search import solve
from ccmodel.model.parameters import ZERO_OF, Parameters, mechanism_key
from ccmodel.recording import Recording, unit_of

FORMAT = 1
# What no number of samples can promise: that the list of hypotheses holds the truth.
MOST_CONFIDENT = 0.99
# So near to the end of its range a number stands at it.
AT_BOUND = 1e-3
# Fewer recordings do not say which of them is the odd one.
FEWEST_TO_CONTRADICT = 4
# Enough samples for what such rigs do in a recording; more of them are more work and no more observations.
STEP_S, MOST_SAMPLES = 0.008, 2000
STIFFNESS_N_PER_M, FRICTION, LOAD = (1e2, 1e7), (0.005, 1.5), (1e-4, 10.0)


@dataclass(frozen=True)
class Diagnosis:
    """What a diagnosis found, and what it was found from.

    Attributes
    ----------
    said : dict
        The content of diagnosis.json.
    judgement : Judgement
    estimates : Parameters
        The batch's own, beforehand.
    """

    said: dict
    judgement: Judgement
    estimates: Parameters

    def model(self, trial: CandidateFit) -> Parameters:
        """A trial's model, for any recording."""
        return trial.hypothesis.of(self.estimates).with_values(trial.values)


# Recordings are worked on side by side; sums of several threads besides differ in their last digits with their number.
@threadpool_limits.wrap(limits=1, user_api="blas")
def diagnose(
    recordings: Sequence[Recording],
    estimates: Parameters,
    not_judged: Sequence[Mapping[str, str]] = (),
    without: Collection[str] = (),
    tell: Callable[[str], None] = lambda text: None,
    tolerance: Tolerance = 0.0,
    step_s: float = STEP_S,
    cycles: int | None = None,
    forced_candidates: Sequence[Sequence[str]] = (),
    baseline: Parameters | None = None,
    freeze: bool = False,
) -> Diagnosis:
    """Say whether the calibrated model explains recordings, and if not, where and why.

    Parameters
    ----------
    recordings : sequence of Recording
        Of one batch.
    estimates : Parameters
        The batch's own.
    not_judged : sequence of {"what", "why"}
        What could not be judged, as far as is known already.
    without : collection of str
        Mechanisms that are not asked for: what a diagnosis says when the truth is not on its list.
    tell : callable
        Is told how the work goes on.
    tolerance : float or mapping of str to float
        Share of a channel's peak to peak that a right model may leave, besides the noise, one for all or by channel:
        what is finer is not judged.
    step_s : float
        Time from one sample that is compared to the next, at least.
    cycles : int, optional
        Cycles of a sine that are compared, once it has settled; further ones are more work and the same again.
    forced_candidates : sequence of sequence of str
        One or two mechanisms, each as "name at place", that are fitted in full whatever the screening says of them.
    baseline : Parameters, optional
        A model that such a rig was fitted with before, as a diagnosis writes it. What it has besides the paper's
        physics then belongs to the model in question, all is fitted anew from its values, and asked is what else is
        missing.
    freeze : bool
        Whether nothing of that model is fitted anew but sensors' zeros that no rest shows: asked is what has changed.

    Raises
    ------
    ModelError
        If the model cannot be run on any of the recordings.
    """
    not_judged = [dict(n) for n in not_judged]
    observations = []
    for recording in recordings:
        try:
            step = max(step_s, float(np.ptp(recording.time_s)) / MOST_SAMPLES)
            observations.append(
                Observations.of(first_cycles(recording, cycles), estimates, step_s=step, tolerance=tolerance)
            )
        except (ModelError, ValueError) as error:
            not_judged.append({"what": recording.id, "why": str(error)})
    if not observations:
        raise ModelError("none of the recordings can be compared with the model: " + not_judged[0]["why"])
    if any(e.given.initial_tension_observed for e in observations):
        why = "no rest with load cells shows its pretension, as the others' do"
        not_judged += [
            {"what": e.given.recording.id, "why": why} for e in observations if not e.given.initial_tension_observed
        ]
        observations = [e for e in observations if e.given.initial_tension_observed]
    not_judged += _what_is_missing(observations)
    why = "as the run was asked to: part of what the noise is taken to be"
    not_judged += [{"what": what, "why": why} for what in _allowed(tolerance)]
    calibrated = calibration(estimates, observations)
    estimates = estimates.with_values({name: free.start for name, free in calibrated.items()})
    model = Hypothesis(baseline=tuple((m.name, m.place) for m in baseline.mechanisms) if baseline else ())
    aimed_at_N = float(np.mean([e.given.recording.pretension_N for e in observations]))
    known = _values_of(baseline, calibrated, model, aimed_at_N) if baseline else {}
    if freeze:
        model, estimates = replace(model, is_frozen=True), model.of(estimates).with_values(known)
        # A zero may have changed by itself since the model was fitted.
        calibrated = {name: free for name, free in calibrated.items() if name in ZERO_OF.values()}
        why = "held as the model given has them, as the run was asked to"
        not_judged.append({"what": "stiffness, friction and whatever else a calibration would fit", "why": why})
    observations = [replace(e, parameters=estimates) for e in observations]
    in_question = "the model given" if baseline else "the paper's model"
    tell(f"calibrating {in_question} on {len(observations)} recordings")
    start = known if baseline else _first_fit(observations, calibrated)
    fitted = model.of(estimates).with_values(start)
    weighed = each(observations, lambda i, e: weigh(e, fitted))
    listed = singles(without, model)
    judgement = judge(weighed, calibrated, start, listed, tell, [_suspect(s) for s in forced_candidates], model)
    not_judged += odd_one_out(judgement) + _at_bounds(judgement.best)
    return Diagnosis(_said(recordings[0].batch, judgement, estimates, not_judged), judgement, estimates)


def _allowed(tolerance: Tolerance) -> list[str]:
    by_channel = tolerance if isinstance(tolerance, Mapping) else {"a channel": tolerance}
    return [f"errors below {100 * share:g} % of {name}'s peak to peak" for name, share in by_channel.items() if share]


def _at_bounds(trial: CandidateFit) -> list[dict[str, str]]:
    """What a calibration left at the end of its range."""
    found = []
    for name, free in trial.free.items():
        value = trial.values[name]
        if any(np.isclose(value, bound, rtol=AT_BOUND, atol=0.0) for bound in (free.low, free.high)):
            found.append({"what": name, "why": f"stands at the end of its range, {value:.4g}: not a value to rely on"})
    return found


def odd_one_out(judgement: Judgement) -> list[dict[str, str]]:
    """Of an unexplained batch, the recording without which the paper's model would do."""
    base, weighed = judgement.calibrated, judgement.weighed
    if judgement.verdict != "unexplained" or len(weighed) < FEWEST_TO_CONTRADICT:
        return []
    odd = int(np.argmax(base.left))
    others = [w for i, w in enumerate(weighed) if i != odd]
    try:
        left = float(fit(others, base.hypothesis, base.free, base.values).left.mean())
    except (ModelError, ValueError):
        return []
    if left > RIGHT:
        return []
    why = (
        f"without it the calibrated model leaves {left:.2f} of the noise's mean square in the others, and with them"
        f" {float(base.left[odd]):.3g} in this one: check its bend, pretension and wiring against the batch file"
    )
    return [{"what": weighed[odd].observations.given.recording.id, "why": why}]


def _suspect(stated: Sequence[str]) -> Hypothesis:
    return Hypothesis(tuple(tuple(one.split(" at ", 1)) for one in stated))


def first_cycles(recording: Recording, cycles: int | None) -> Recording:
    """A recording up to so many cycles after it settled; all of it where it is no sine or none are asked for."""
    frequency = recording.excitation.get("frequency_Hz")
    if cycles is None or not frequency or recording.excitation.get("wave") != "sine":
        return recording
    wanted = recording.time_s <= recording.time_s[0] + max(recording.settled_s, recording.rest_s) + cycles / frequency
    return recording[: int(wanted.sum())]


def calibration(estimates: Parameters, observations: Sequence[Observations]) -> dict[str, Free]:
    """What a calibration leaves free: stiffness, friction, the load's spring, and what no rest shows."""
    free = {
        "stiffness_N_per_m": _free(estimates.stiffness_N_per_m, *STIFFNESS_N_PER_M),
        "friction_coefficient": _free(estimates.friction_coefficient, *FRICTION),
    }
    load_is_free = not any(e.given.recording.load_motion_is_given for e in observations)
    if estimates.load_stiffness_Nm_per_rad is not None:
        free["load_stiffness_Nm_per_rad"] = _free(estimates.load_stiffness_Nm_per_rad, *LOAD)
    elif load_is_free and all("tau_in_Nm" in e.channels for e in observations):
        # A batch that states no spring may have one all the same, which the torque measured at the load does not feel.
        size = float(
            np.median([np.ptp(e.given.recording["tau_in_Nm"]) / np.ptp(e.given.theta_in) for e in observations])
        )
        free["spring_beside_load_Nm_per_rad"] = Free(0.1 * size, 0.0, 10 * size)
    if not all(e.given.initial_tension_observed for e in observations):
        free["pretension_share"] = Free(1.0, 0.01, 100.0)  # of what each recording was aimed at
        if load_is_free:
            radius_m = estimates.load_radius_m
            free["load_radius_m"] = Free(radius_m, 0.3 * radius_m, 3 * radius_m)
        torques = [e.given.recording["tau_in_Nm"] for e in observations if "tau_in_Nm" in e.channels]
        if torques:
            reach = max(float(np.ptp(torque)) for torque in torques)
            free["tau_in_zero_Nm"] = Free(0.0, -reach, reach)
            free["tau_out_zero_Nm"] = Free(0.0, -reach, reach)
    return free


def _free(estimate: float, low: float, high: float) -> Free:
    """From an estimate as far as a fit may go anyway, and ten times as far as an estimate that lies beyond."""
    if estimate > 0:
        low, high = min(low, estimate / 10), max(high, 10 * estimate)
    return Free(float(np.clip(estimate, low, high)), low, high)


def _values_of(
    baseline: Parameters, calibrated: Mapping[str, Free], model: Hypothesis, aimed_at_N: float
) -> dict[str, float]:
    """A model's values of what a calibration leaves free, where it has them, and of the numbers of its mechanisms.

    A model that has one pretension for all recordings has it as a share of what these were aimed at, on average.
    """
    known = {name: baseline.value_of(name) for name in [*calibrated, *model.start]}
    if baseline.pretension_N is not None and "pretension_share" in known:
        known["pretension_share"] *= baseline.pretension_N / aimed_at_N
    return {name: calibrated[name].start if value is None else value for name, value in known.items()}


def _first_fit(observations: Sequence[Observations], calibrated: Mapping[str, Free]) -> dict[str, float]:
    problem = Problem(observations, calibrated, {"friction_scale": Free(1.0, 0.2, 5.0, FRICTION_SPREAD)})
    found = solve(problem, problem.start, most_evaluations=20, tolerance=1e-4)
    return dict(zip(calibrated, found.x.tolist(), strict=False))


def _what_is_missing(observations: Sequence[Observations]) -> list[dict[str, str]]:
    found = []
    recorded = {c for e in observations for c in e.channels}
    for channel in MEASURED:
        lacking = [e.given.recording.id for e in observations if channel not in e.channels]
        if channel not in recorded:
            found.append({"what": channel, "why": "not recorded, or the load's course had to be taken from it"})
        elif lacking:
            found.append({"what": f"{channel} of {', '.join(lacking)}", "why": "not recorded there, or not usable"})
    if not all(e.given.initial_tension_observed for e in observations):
        why = "no rest with load cells shows them: fitted, the pretension as one share of what each was aimed at"
        found.append({"what": "pretension, ratio of the pulleys, zeros of the torques", "why": why})
    if len(observations) == 1:
        found.append({"what": "held-out error", "why": "a single recording: nothing can be held out"})
    if len({round(e.given.recording.path.bend_rad, 3) for e in observations}) == 1:
        found.append({"what": "friction apart from bend", "why": "one bend angle: only the product of the two shows"})
    return found


def _said(batch, judgement: Judgement, estimates: Parameters, not_judged) -> dict:
    best, base, weighed = judgement.best, judgement.calibrated, judgement.weighed
    named = best.hypothesis.acting if judgement.verdict == "explained" else ()
    moved = _by_finer_solver(judgement, not_judged) if named else None
    sure = [judgement.listed * p for p in judgement.probability]
    confidence = dict(zip([t.hypothesis for t in judgement.trials], sure, strict=True))
    alternatives = _alternatives(judgement, named, confidence)
    next_experiment = None
    if judgement.verdict in ("undecided", "unexplained"):
        next_experiment = experiment.proposed(judgement, estimates)
    return {
        "format": FORMAT,
        "batch": batch,
        "verdict": judgement.verdict,
        "is_held": base.hypothesis.is_frozen,
        "location": location.location(judgement),
        "mechanisms": [_mechanism(best, k, _named(name, confidence), moved) for k, (name, _) in enumerate(named)],
        "alternatives": alternatives,
        "likeliest": [{"name": n, "place": p} for n, p in best.hypothesis.acting if judgement.verdict == "undecided"],
        "nearest": _nearest(judgement),
        "fit": {
            "held_out": [w.observations.given.recording.id for w in weighed] if len(weighed) > 1 else [],
            "calibrated": base.values,
            "mean_square": {"calibrated": float(base.left.mean()), "extended": float(best.left.mean())},
            "error": held_out_errors(judgement),
        },
        "next_experiment": next_experiment,
        "not_judged": list(not_judged),
    }


def _nearest(judgement: Judgement) -> dict | None:
    """Where nothing explains a batch: what came nearest, and what it left of the noise's mean square on held-out.

    It may leave little enough, where a single fault of one part would do as well as the two that it takes.
    """
    if judgement.verdict != "unexplained" or (trial := judgement.nearest) is None:
        return None
    acting = [_mechanism(trial, k, 0.0) for k in range(len(trial.hypothesis.acting))]
    return {
        "mechanisms": [{key: value for key, value in m.items() if key != "confidence"} for m in acting],
        "mean_square": float(trial.left.mean()),
        "one_fault_at": list(judgement.one_fault),
    }


def _alternatives(judgement: Judgement, named, confidence) -> list[dict]:
    """What else it could be: each mechanism that is not named already, at its likeliest place."""
    if judgement.verdict in ("agrees", "unexplained"):
        return []
    every = {acting for hypothesis in confidence for acting in hypothesis.acting}
    places: dict[str, str] = {}
    for name, place in sorted(every, key=lambda acting: (-_confidence(acting, confidence), acting)):
        places.setdefault(name, place)
    told = [(n, p, _named(n, confidence)) for n, p in places.items() if n not in dict(named)]
    ranked = sorted(told, key=lambda one: -one[2])[:MOST_ALTERNATIVES]
    return [{"name": n, "place": p, "confidence": round(c, 4)} for n, p, c in ranked if c > RIVAL]


def _named(name: str, confidence: Mapping[Hypothesis, float]) -> float:
    """Probability that a mechanism acts at any of its places, and never certainty."""
    return min(MOST_CONFIDENT, sum(p for hypothesis, p in confidence.items() if name in hypothesis.names))


def _confidence(acting: tuple[str, str], confidence: Mapping[Hypothesis, float]) -> float:
    """Probability that a mechanism acts at a place: of all hypotheses together that have it there."""
    return sum(p for hypothesis, p in confidence.items() if acting in hypothesis.acting)


def _by_finer_solver(judgement: Judgement, not_judged: list) -> NDArray | None:
    """By how much a finer solver would move the best trial's values; None where it cannot be run."""
    try:
        return moved_by_finer(judgement.weighed, judgement.best)
    except ModelError as error:
        not_judged.append({"what": "what the solver's grid costs the values", "why": str(error)})
        return None


def _mechanism(trial: CandidateFit, k: int, confidence: float, moved: NDArray | None = None) -> dict:
    """A mechanism's numbers where a finer solver would have them, in intervals that know of that move.

    A model file keeps the numbers that were fitted: on the solver that it runs on these are the best.
    """
    name, place = trial.hypothesis.acting[k]
    names = list(trial.values)
    moved = np.zeros(len(names)) if moved is None else moved
    sds = np.hypot(np.sqrt(np.diag(trial.covariance).clip(0.0)), moved)
    reach = student.ppf(0.5 + COVERAGE / 2, trial.freedom) * sds  # of infinite freedom: the normal distribution's
    free = trial.hypothesis.free(trial.values)
    parameters = []
    for p in registry.get(name).parameters:
        key = mechanism_key(name, place, p.name)
        i, low, high = names.index(key), free[key].low, free[key].high
        value = float(np.clip(trial.values[key] + moved[i], low, high))
        parameters.append(
            {
                "name": p.name,
                "value": value,
                "low": max(float(value - reach[i]), low),
                "high": min(float(value + reach[i]), high),
                "unit": p.unit.replace(" ", "*"),
            }
        )
    return {"name": name, "place": place, "confidence": round(confidence, 4), "parameters": parameters}


def held_out_errors(judgement: Judgement) -> dict[str, dict]:
    """Root mean square on held-out recordings by channel, before and after, and what a right model leaves."""
    chosen = nested_errors(judgement)
    square: dict[str, list[tuple[float, float, float]]] = {}
    for i, w in enumerate(judgement.weighed):
        before = _raw(w, judgement.calibrated, i)
        after = before if chosen[i] is judgement.calibrated else _raw(w, chosen[i], i)
        for c, channel in enumerate(w.observations.channels):
            row = (np.mean(before[c] ** 2), np.mean(after[c] ** 2), w.floor[channel] ** 2)
            square.setdefault(channel, []).append(row)
    found = {}
    for channel, rows in square.items():
        before, after, noise = np.sqrt(np.mean(rows, axis=0)).tolist()
        name = channel.rsplit("_", 1)[0]
        found[name] = {"before": before, "after": after, "noise": noise, "unit": unit_of(channel).replace(" ", "*")}
    return found


def _raw(w: Whitened, trial: CandidateFit, i: int) -> NDArray:
    e = replace(w.observations, parameters=trial.hypothesis.of(w.observations.parameters))
    return e.errors(trial.held_out[i]) * e.sigma
