"""The experiment that would tell rivals apart: where their predictions lie furthest apart, whatever a refit takes up.

Rivals that were fitted to the same recordings may differ in a new one for no better reason than that their values are
not well known, and a refit to that one as well would bring them together again. Only what no refit takes up counts: the
difference is whitened by what is not known of either rival's values and of a run (Buzzi-Ferraris and Forzatti, Chemical
Engineering Science 38(2), 1983).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ccmodel.diagnose.candidate import CandidateFit, slopes
from ccmodel.diagnose.comparison import RIVAL, Judgement
from ccmodel.diagnose.drive import speed
from ccmodel.diagnose.whitening import LOOKS, Whitened, run_differences, shrink_of
from ccmodel.failure import ModelError
from ccmodel.inference.problem import Observations, each
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput
from ccmodel.model.sensitivity import size_of
from ccmodel.recording import Recording

RATE_HZ = 125.0
SECONDS = 10.0
RIVALS = 4
# Shares of the largest amplitude and of the highest pretension that are recorded.
SIZES = ((1.0, 1.0), (1.0, 0.4), (0.4, 1.0))
RATES_HZ = (0.1, 0.4, 1.2)
HOLDS_S = (1.0, 3.0, 8.0)
NESTED_HZ = 0.5
MOVE_S = 0.5
STEEPEST = 15 / 8  # Highest slope of a step's course over its mean one.
# By which the better of two rivals should then lead.
ODDS = 20.0
# Experiments that lie furthest apart as fitted, which are then asked what a refit would leave of it.
REFITTED = 8


@dataclass(frozen=True)
class Experiment:
    """A drive motion, a share of a recording's pretension and its conduits, in words and in numbers."""

    text: str
    theta_in: NDArray
    pretension_share: float
    like: Recording

    def given(self) -> ModelInput:
        """What a model takes from it."""
        time_s = np.arange(self.theta_in.size) / RATE_HZ
        return ModelInput.prescribed(self.like, time_s, self.theta_in, self.like.pretension_N)


def proposed(judgement: Judgement, estimates: Parameters) -> dict | None:
    """The experiment that separates the leading rivals best; None where there are no two that can be run."""
    likely = [t for t, p in zip(judgement.trials, judgement.probability, strict=True) if p > RIVAL]
    rivals = likely if len(likely) > 1 else [judgement.calibrated, *judgement.trials]
    rivals = rivals[:RIVALS]
    if len(rivals) < 2:
        return None
    template = max(judgement.weighed, key=lambda w: w.observations.given.recording.pretension_N).observations
    every = candidates(judgement.weighed)
    planned = [[_planned(e, t, template, estimates) for t in rivals] for e in every]
    roughly = np.array(each(planned, lambda i, of_rivals: _apart(of_rivals)))
    leading = [int(k) for k in np.argsort(-roughly, kind="stable")[:REFITTED] if roughly[k] > 0]
    surely = each(leading, lambda i, k: _apart(planned[k], rivals))
    if max(surely, default=0.0) <= 0:
        return None
    best = int(np.argmax(surely))
    names = list(dict.fromkeys(name for t in rivals for name, _ in t.hypothesis.acting))
    differ = f"there the rivals differ by {surely[best]:.2g} times the noise, fitted to it as well"
    wanted = recordings_wanted(surely[best], len(template.channels))
    tells = "one such recording tells" if wanted == 1 else f"it takes {wanted} such recordings to tell"
    return {
        "text": f"{every[leading[best]].text}: {differ}, more than in any other tried; {tells}.",
        "separates": names,
    }


def recordings_wanted(apart: float, channels: int) -> int:
    """How many recordings in which rivals differ by so many times the noise make one of them `ODDS` times likelier."""
    return int(np.ceil(2 * np.log(ODDS) / (LOOKS * channels * apart**2)))


def candidates(weighed: Sequence[Whitened]) -> list[Experiment]:
    """Motions within the amplitudes and speeds that the batch shows the rig can do, at its least and largest bend."""
    given = [w.observations.given for w in weighed]
    amplitude = max(np.ptp(g.theta_in) / 2 for g in given)
    fastest = max(np.abs(speed(g)).max() for g in given)
    highest = max(g.recording.pretension_N for g in given)
    bends = {round(g.recording.path.bend_rad, 3): g.recording for g in given}
    found = []
    for bend in dict.fromkeys((max(bends), min(bends))):
        like = replace(bends[bend], pretension_N=highest)
        for size, pretension in SIZES:
            at = f"pretension {pretension:.0%} of the highest recorded"
            at += f", bend {bend:.2g} rad" if len(bends) > 1 else ""
            found += [
                Experiment(f"{text}, {at}", theta, pretension, like)
                for text, theta in _motions(size * amplitude, fastest)
            ]
    return found


def _motions(a: float, fastest: float) -> Iterator[tuple[str, NDArray]]:
    """What is done, and the drive's angles, rad: of an amplitude (rad), and no faster than a speed (rad/s)."""
    start = np.clip(np.arange(0, SECONDS, 1 / RATE_HZ) - 0.4, 0, None)
    highest_Hz = fastest / (2 * np.pi * a)
    for rate in dict.fromkeys(min(rate, highest_Hz) for rate in RATES_HZ):
        yield f"a sine of {a:.2g} rad at {rate:.2g} Hz", a * np.sin(2 * np.pi * rate * start)
    for hold in HOLDS_S:
        yield f"steps of {a:.2g} rad held for {hold:g} s", _steps(a, start, hold, max(MOVE_S, STEEPEST * a / fastest))
    rate = min(NESTED_HZ, highest_Hz)
    nested = a * np.sin(2 * np.pi * rate * start) * (1 - start / start[-1])
    yield f"nested reversals from {a:.2g} rad down at {rate:.2g} Hz", nested


def _steps(amplitude: float, start: NDArray, hold_s: float, move_s: float) -> NDArray:
    """To one side, back, to the other, back, and so on, without a jump of the acceleration."""
    phase = start / (hold_s + move_s)
    k, s = np.floor(phase).astype(int), np.clip((phase % 1) * (hold_s + move_s) / move_s, 0, 1)
    levels = amplitude * np.array([0.0, 1.0, 0.0, -1.0])
    smooth = s**3 * (10 - 15 * s + 6 * s**2)
    return levels[k % 4] + (levels[(k + 1) % 4] - levels[k % 4]) * smooth


def _planned(
    experiment: Experiment, rival: CandidateFit, template: Observations, estimates: Parameters
) -> Observations:
    """An experiment as a rival would have it, in units of the noise that the rig's recordings have."""
    shape = len(template.channels), experiment.theta_in.size
    model = rival.hypothesis.of(estimates).with_values(rival.values)
    return Observations(
        given=experiment.given(),
        parameters=replace(model, pretension_scale=model.pretension_scale * experiment.pretension_share),
        channels=template.channels,
        judged=np.ones(shape[1], bool),
        measured=np.zeros(shape),
        sigma=np.broadcast_to(np.median(template.sigma, axis=1, keepdims=True), shape),
        tolerance=np.zeros(shape[0]),
    )


def _apart(planned: Sequence[Observations], refitted: Sequence[CandidateFit] | None = None) -> float:
    """Least distance between two rivals' predictions, in units of the noise (rms over channels); 0 where one fails.

    With the rivals `refitted` only what a refit of either would leave of it counts.
    """
    try:
        said = [e.errors({}).ravel() for e in planned]
        taken = [_taken_up(*one) for one in zip(planned, said, refitted, strict=True)] if refitted else None
    except (ModelError, ValueError):
        return 0.0
    distances = []
    for a, b in combinations(range(len(planned)), 2):
        difference = said[a] - said[b]
        if taken:
            U, s, _ = np.linalg.svd(np.hstack([taken[a], taken[b]]), full_matrices=False)
            difference = difference - U @ (shrink_of(s) * (U.T @ difference))
        distances.append(np.sqrt(np.mean(difference**2)))
    return float(min(distances))


def _taken_up(e: Observations, said: NDArray, trial: CandidateFit) -> NDArray:
    """What is not known of a rival's values and of a run, a standard deviation of each over the noise; (rows, k).

    `said` is what the rival says, over the noise.
    """
    names, x = list(trial.values), np.array(list(trial.values.values()))
    free = trial.free | trial.hypothesis.free(trial.values)
    sizes = [size_of(name, value) for name, value in trial.values.items()]
    moves = slopes(lambda values: e.errors(values).ravel(), said, x, names, sizes, [free[name].high for name in names])
    variances, axes = np.linalg.eigh(trial.covariance)
    return np.hstack([moves @ (axes * np.sqrt(variances.clip(0.0))), run_differences(e)[0]])
