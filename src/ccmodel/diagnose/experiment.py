"""The experiment that would tell rivals apart: where their fitted predictions lie furthest apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.diagnose.evidence import Weighed
from ccmodel.diagnose.judge import RIVAL, Judgement
from ccmodel.diagnose.trial import Trial
from ccmodel.failure import ModelError
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import ModelInput, simulate

RATE_HZ = 125.0
SECONDS = 10.0
RIVALS = 4


@dataclass(frozen=True)
class Experiment:
    """A drive motion and a pretension that the rig can do, in words and in numbers."""

    text: str
    theta_in: NDArray
    pretension_share: float


def proposed(judgement: Judgement, estimates: Parameters) -> dict | None:
    """The experiment that separates the leading rivals best; None where there are no two that can be run."""
    likely = [t for t, p in zip(judgement.trials, judgement.probability, strict=True) if p > RIVAL]
    rivals = likely if len(likely) > 1 else [judgement.calibrated, *judgement.trials]
    rivals = rivals[:RIVALS]
    if len(rivals) < 2:
        return None
    template = max(judgement.weighed, key=lambda w: w.evidence.given.recording.pretension_N).evidence
    best, apart = None, 0.0
    for experiment in candidates(judgement.weighed):
        distance = _apart(experiment, rivals, template, estimates)
        if distance > apart:
            best, apart = experiment, distance
    if best is None:
        return None
    names = list(dict.fromkeys(name for t in rivals for name, _ in t.hypothesis.acting))
    text = f"{best.text}: there the fitted rivals differ by {apart:.1f} times the noise, more than in any other tried."
    return {"text": text, "separates": names}


def candidates(weighed: Sequence[Weighed]) -> list[Experiment]:
    """Motions within the amplitudes and rates that the batch shows the rig can do."""
    amplitude = max(np.ptp(w.evidence.given.theta_in) / 2 for w in weighed)
    time_s = np.arange(0, SECONDS, 1 / RATE_HZ)
    start = np.clip(time_s - 0.4, 0, None)
    found = []
    for share, pretension in ((1.0, 1.0), (1.0, 0.4), (0.4, 1.0)):
        a = share * amplitude
        at = f"pretension {pretension:.0%} of the highest recorded"
        for rate in (0.1, 0.4, 1.2):
            sine = a * np.sin(2 * np.pi * rate * start)
            found.append(Experiment(f"a sine of {a:.2g} rad at {rate:g} Hz, {at}", sine, pretension))
        found.append(Experiment(f"steps of {a:.2g} rad held for 3 s, {at}", _steps(a, start), pretension))
        nested = a * np.sin(2 * np.pi * 0.5 * start) * (1 - start / start[-1])
        found.append(Experiment(f"nested reversals from {a:.2g} rad down at 0.5 Hz, {at}", nested, pretension))
    return found


def _steps(amplitude: float, start: NDArray) -> NDArray:
    phase = start / 3.5
    k, s = np.floor(phase).astype(int), np.clip((phase % 1) * 3.5 / 0.5, 0, 1)
    levels = amplitude * np.array([0.0, 1.0, 0.0, -1.0, 0.0])
    smooth = s**3 * (10 - 15 * s + 6 * s**2)
    return levels[k] + (levels[k + 1] - levels[k]) * smooth


def _apart(experiment: Experiment, rivals: Sequence[Trial], template, estimates: Parameters) -> float:
    """Least distance between two rivals' predictions, in units of the noise (rms over channels)."""
    like, time_s = template.given.recording, np.arange(experiment.theta_in.size) / RATE_HZ
    pretension_N = like.pretension_N * experiment.pretension_share
    given = ModelInput.prescribed(like, time_s, experiment.theta_in, pretension_N)
    noise = np.median(template.sigma, axis=1, keepdims=True)
    try:
        said = [simulate(given, t.hypothesis.of(estimates).with_values(t.values)) for t in rivals]
    except (ModelError, ValueError):
        return 0.0
    stacked = [np.stack([s[c] for c in template.channels]) / noise for s in said]
    distances = [np.sqrt(np.mean((a - b) ** 2)) for i, a in enumerate(stacked) for b in stacked[:i]]
    return float(min(distances))
