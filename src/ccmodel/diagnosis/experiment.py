"""Experiment design: the recording that would best separate the leading candidate models.

Candidates fitted to the same recordings may differ in a new one only because their values are uncertain, and a refit
with the new recording would bring them together. The difference of their predictions is therefore whitened by the
covariance of both candidates' values and of the nuisances of a run, so that only the part counts that no refit absorbs
(Buzzi-Ferraris and Forzatti, Chemical Engineering Science 38(2), 1983).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.drive import speed
from ccmodel.diagnosis.hypothesis import laws_in
from ccmodel.diagnosis.verdict import Judgement
from ccmodel.diagnosis.whitening import Whitened, nuisances, shrinkage_of
from ccmodel.failure import ModelError
from ccmodel.inference.effective_samples import IN_DIAGNOSIS
from ccmodel.inference.jacobian import inward, jacobian, size_of
from ccmodel.inference.observations import Observations
from ccmodel.inference.pool import each
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput
from ccmodel.recording import Recording

STEEPEST = 15 / 8  # Highest over mean slope of a smooth step.
SMOOTH_SIGN = 0.05  # Speed over the fastest at which the smooth sign of a motion changes.


@dataclass(frozen=True)
class Experiment:
    """A drive motion, a share of a recording's pretension and its conduits, in words and in numbers.

    Attributes
    ----------
    text : str
    motion : dict
        The motion as `excitation` in a batch.yaml.
    theta_in : ndarray, shape (n,)
        The drive angle, rad.
    pretension_share : float
        Of the pretension of `like`.
    like : Recording
        The recording whose conduits it has.
    load : mapping of str to ndarray, each of shape (n,)
        The load at the far end as in the recordings (`load_as_recorded`); a load with a law does without.
    """

    text: str
    motion: dict
    theta_in: NDArray
    pretension_share: float
    like: Recording
    load: Mapping[str, NDArray] = field(default_factory=dict)

    def recording(self, count: int) -> dict:
        """What is to be recorded, and how often, as plain data for diagnosis.json."""
        return {
            "excitation": self.motion,
            "pretension_N": self.pretension_share * self.like.pretension_N,
            "bend_rad": self.like.path.bend_rad,
            "recordings": count,
        }


def proposed(judgement: Judgement, estimates: Parameters) -> dict | None:
    """The experiment that best separates the leading candidates; None without two that can be run.

    Of a learned law, it separates the arguments that it may have.
    """
    candidates = (_by_argument if judgement.verdict == "learned" else _leading)(judgement)[: settings.SEPARATED]
    if len(candidates) < 2:
        return None
    template = max(judgement.whitened, key=lambda w: w.observations.given.recording.pretension_N).observations
    every = experiments(judgement.whitened)
    planned = [[planned_observations(e, c, template, estimates) for c in candidates] for e in every]
    as_fitted = np.array(each(planned, lambda i, of_candidates: separation(of_candidates)))
    leading = [int(k) for k in np.argsort(-as_fitted, kind="stable")[: settings.REFITTED] if as_fitted[k] > 0]
    refitted = each(leading, lambda i, k: separation(planned[k], candidates))
    if max(refitted, default=0.0) <= 0:
        return None
    best = int(np.argmax(refitted))
    names = list(dict.fromkeys(_in_words(name) for c in candidates for name, _ in c.hypothesis.acting))
    differ = f"there any two candidates differ by at least {refitted[best]:.2g} times the noise after a refit"
    wanted = recordings_wanted(refitted[best], len(template.channels))
    give = "one such recording gives" if wanted == 1 else f"{wanted} such recordings give"
    chosen = every[leading[best]]
    odds = f"odds of {settings.WANTED_ODDS:g} for the better of two"
    text = f"{chosen.text}: {differ}, more than in any other motion tried; {give} {odds}."
    if wanted > settings.MANY_RECORDINGS:
        text += " The candidates are nearly alike in all of these motions: a few recordings are unlikely to decide."
    return {"text": text, "separates": names, "recording": chosen.recording(wanted)}


def _leading(judgement: Judgement) -> list[CandidateFit]:
    """The probable candidates, and the calibrated model if it may be all or if there are too few others."""
    pairs = zip(judgement.candidates, judgement.probability, strict=True)
    candidates = [c for c, p in pairs if p > settings.ALTERNATIVE]
    if judgement.comparison.probability_of_base > settings.ALTERNATIVE or len(candidates) < 2:
        return [judgement.calibrated, *(candidates or judgement.candidates)]
    return candidates


def _by_argument(judgement: Judgement) -> list[CandidateFit]:
    """The most probable candidate with each argument and form that the recordings do not exclude for a learned law."""
    learned, confidence = laws_in(judgement.best.hypothesis), judgement.confidence
    found: dict[tuple[tuple[str, str], ...], CandidateFit] = {}
    for candidate in (judgement.best, *judgement.candidates):
        laws = [law for law in laws_in(candidate.hypothesis) if any(law.is_of_slot(one) for one in learned)]
        if laws and (candidate is judgement.best or confidence[candidate.hypothesis] > settings.ALTERNATIVE):
            found.setdefault(tuple(sorted((law.argument.name, law.form.name) for law in laws)), candidate)
    return list(found.values())


def _in_words(name: str) -> str:
    """A mechanism's name, or the slot and the argument of a learned law."""
    law = registry.laws().get(name)
    return name if law is None else f"{law.slot} by {law.argument.name}"


def recordings_wanted(apart: float, channels: int) -> int:
    """Number of recordings that give odds of `WANTED_ODDS` for a separation `apart` in units of the noise."""
    return int(np.ceil(2 * np.log(settings.WANTED_ODDS) / (IN_DIAGNOSIS * channels * apart**2)))


def experiments(whitened: Sequence[Whitened]) -> list[Experiment]:
    """Motions within the amplitudes and speeds of the batch, at its smallest and its largest bend."""
    given = [w.observations.given for w in whitened]
    amplitude = max(np.ptp(g.theta_in) / 2 for g in given)
    fastest = max(np.abs(speed(g)).max() for g in given)
    highest_N = max(g.recording.pretension_N for g in given)
    bends = {round(g.recording.path.bend_rad, 3): g.recording for g in given}
    load = load_as_recorded(given)
    found = []
    for bend in dict.fromkeys((max(bends), min(bends))):
        like = replace(bends[bend], id="experiment", pretension_N=highest_N)
        for size, pretension in settings.EXPERIMENT_SIZES:
            at = f"pretension {pretension:.0%} of the highest recorded"
            at += f", bend {bend:.2g} rad" if len(bends) > 1 else ""
            found += [
                Experiment(f"{text}, {at}", motion, theta, pretension, like, load(theta))
                for text, motion, theta in motions(size * amplitude, fastest)
            ]
    return found


def load_as_recorded(given: Sequence[ModelInput]) -> Callable[[NDArray], dict[str, NDArray]]:
    """What was measured at the load, as a function of a further motion: linear in its angle and smooth sign of speed.

    A load without a law is an input of the model. What it will be in a new motion is not known; candidates are told
    apart as if it were as in the recordings.
    """
    fastest = max(np.abs(speed(g)).max() for g in given)

    def regressors(angle: NDArray, rate: NDArray) -> NDArray:
        return np.column_stack([np.ones_like(angle), angle, np.tanh(rate / (SMOOTH_SIGN * fastest))])

    recorded = np.concatenate([regressors(g.theta_in, speed(g)) for g in given])
    weights = {}
    for name in ("theta_out", "tau_out", "F_load"):
        values = [getattr(g, name) for g in given]
        if all(v is not None for v in values):
            weights[name] = np.linalg.lstsq(recorded, np.concatenate(values), rcond=None)[0]

    def of_motion(theta_in: NDArray) -> dict[str, NDArray]:
        further = regressors(theta_in, np.gradient(theta_in) * settings.EXPERIMENT_RATE_HZ)
        return {name: further @ of_channel for name, of_channel in weights.items()}

    return of_motion


def motions(a: float, fastest: float) -> Iterator[tuple[str, dict, NDArray]]:
    """Text, numbers and drive angles (rad) of motions with an amplitude (rad), no faster than a speed (rad/s)."""
    time_s = np.arange(0, settings.EXPERIMENT_S, 1 / settings.EXPERIMENT_RATE_HZ)
    start = np.clip(time_s - settings.EXPERIMENT_REST_S, 0, None)
    highest_Hz = fastest / (2 * np.pi * a)
    for rate in dict.fromkeys(min(rate, highest_Hz) for rate in settings.SINES_HZ):
        sine = {"wave": "sine", "amplitude_rad": float(a), "frequency_Hz": float(rate)}
        yield f"a sine of {a:.2g} rad at {rate:.2g} Hz", sine, a * np.sin(2 * np.pi * rate * start)
    for hold in settings.HOLDS_S:
        move_s = max(settings.STEP_DURATION_S, STEEPEST * a / fastest)
        angles = [float(a), 0.0, float(-a), 0.0]
        steps = {"wave": "step-and-hold", "angles_rad": angles, "move_s": float(move_s), "hold_s": hold}
        yield f"steps of {a:.2g} rad held for {hold:g} s", steps, _steps(a, start, hold, move_s)
    rate = min(settings.NESTED_HZ, highest_Hz)
    nested = a * np.sin(2 * np.pi * rate * start) * (1 - start / start[-1])
    shrinking = {"wave": "growing-sine", "first_amplitude_rad": float(a), "amplitude_rad": 0.0}
    shrinking["frequency_Hz"] = float(rate)
    yield f"nested reversals from {a:.2g} rad down at {rate:.2g} Hz", shrinking, nested


def _steps(amplitude: float, start: NDArray, hold_s: float, move_s: float) -> NDArray:
    """Steps to either side and back with continuous acceleration, shape (n,), rad."""
    phase = start / (hold_s + move_s)
    k, s = np.floor(phase).astype(int), np.clip((phase % 1) * (hold_s + move_s) / move_s, 0, 1)
    levels = amplitude * np.array([0.0, 1.0, 0.0, -1.0])
    smooth = s**3 * (10 - 15 * s + 6 * s**2)
    return levels[k % 4] + (levels[(k + 1) % 4] - levels[k % 4]) * smooth


def planned_observations(
    experiment: Experiment, candidate: CandidateFit, template: Observations, estimates: Parameters
) -> Observations:
    """An experiment as a candidate predicts it, in units of the noise of the rig's recordings."""
    shape = len(template.channels), experiment.theta_in.size
    time_s = np.arange(shape[1]) / settings.EXPERIMENT_RATE_HZ
    model, like = candidate.model(estimates), experiment.like
    return Observations(
        given=ModelInput.prescribed(like, time_s, experiment.theta_in, like.pretension_N, **experiment.load),
        parameters=replace(model, pretension_scale=model.pretension_scale * experiment.pretension_share),
        channels=template.channels,
        judged=np.ones(shape[1], bool),
        measured=np.zeros(shape),
        sigma=np.broadcast_to(np.median(template.sigma, axis=1, keepdims=True), shape),
        tolerance=np.zeros(shape[0]),
    )


def separation(planned: Sequence[Observations], refitted: Sequence[CandidateFit] | None = None) -> float:
    """Smallest rms difference between two candidates' predictions over the noise; 0 if one cannot be run.

    With the candidates `refitted` the part is removed that a refit of either would absorb.
    """
    try:
        predicted = [o.errors({}).ravel() for o in planned]
        absorbed = [_absorbed(*one) for one in zip(planned, predicted, refitted, strict=True)] if refitted else None
    except (ModelError, ValueError):
        return 0.0
    distances = []
    for a, b in combinations(range(len(planned)), 2):
        difference = predicted[a] - predicted[b]
        if absorbed:
            U, s, _ = np.linalg.svd(np.hstack([absorbed[a], absorbed[b]]), full_matrices=False)
            difference = difference - U @ (shrinkage_of(s) * (U.T @ difference))
        distances.append(np.sqrt(np.mean(difference**2)))
    return float(min(distances))


def _absorbed(o: Observations, predicted: NDArray, candidate: CandidateFit) -> NDArray:
    """Effects of the uncertain values and nuisances, a standard deviation of each over the noise; (rows, k)."""
    names, x = list(candidate.values), np.array(list(candidate.values.values()))
    free = {**candidate.free} | candidate.hypothesis.free(candidate.values)
    sizes = np.array([size_of(name, value) for name, value in candidate.values.items()])
    steps = inward(settings.FIT_DIFFERENCE * sizes, x, np.array([free[name].high for name in names]))
    effects = jacobian(lambda at: o.errors(dict(zip(names, at, strict=True))).ravel(), x, steps, predicted)
    variances, axes = np.linalg.eigh(candidate.covariance)
    return np.hstack([effects @ (axes * np.sqrt(variances.clip(0.0))), nuisances(o)])
