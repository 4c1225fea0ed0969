"""Where model and recordings differ: by channel, by phase of the motion, by place along the transmission."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ccmodel.diagnose.evidence import Weighed
from ccmodel.diagnose.judge import Judgement
from ccmodel.diagnose.trial import Trial
from ccmodel.model.run import ModelInput

# Parts of a motion by what the drive does.
PARTS = ("at rest", "after a reversal", "under way")
# A reversal's mark is looked for over this share of the drive's stroke after it.
AFTER_REVERSAL = 0.25
STILL_SHARE = 0.02
# A channel is named if it carries this share of the error that the worst one does, in units of its noise.
NAMED_SHARE = 0.35

TEXT = {
    "drive-pulley": "at the drive pulley, between its torque and the cables",
    "drive-end": "where the cables are fastened at the drive",
    "cable": "in the cables themselves",
    "conduit": "between cable and conduit",
    "load-end": "where the cables are fastened at the load",
    "load-pulley": "at the load pulley",
    "load": "in the load",
    "drive-sensor": "in a sensor at the drive",
    "load-sensor": "in a sensor at the load",
}


def location(judgement: Judgement, weighed: Sequence[Weighed]) -> dict:
    """Place, channels and parts of the motion that carry the mismatch, and a sentence."""
    if judgement.verdict == "agrees":
        return {"place": None, "channels": [], "phases": [], "text": "model and recordings agree within the noise"}
    place = _place(judgement)
    table = mismatch(weighed, judgement.calibrated)
    by_channel = {c: float(np.sqrt(np.nanmean(np.square(list(parts.values()))))) for c, parts in table.items()}
    worst = max(by_channel.values())
    channels = [c for c, value in sorted(by_channel.items(), key=lambda i: -i[1]) if value > NAMED_SHARE * worst]
    by_part = {p: float(np.sqrt(np.nanmean([table[c][p] ** 2 for c in channels]))) for p in PARTS}
    parts = [p for p in PARTS if by_part[p] > 0.7 * max(by_part.values())]
    verb = "is" if len(channels) == 1 else "are"
    text = f"The mismatch sits {TEXT[place]}: {', '.join(channels)} {verb} off most, {' and '.join(parts)}."
    return {"place": place, "channels": channels, "phases": parts, "text": text}


def _place(judgement: Judgement) -> str:
    """The place of the mechanism that is named, or at which mechanisms explain most."""
    if judgement.verdict in ("explained", "undecided") or judgement.trials:
        best = judgement.best if judgement.best.hypothesis.acting else judgement.trials[0]
        return best.hypothesis.acting[0][1]
    return judgement.scores[0].hypothesis.acting[0][1]


def mismatch(weighed: Sequence[Weighed], trial: Trial) -> dict[str, dict[str, float]]:
    """Root mean square of the held-out errors over what a right model leaves, by channel and part of the motion."""
    sums: dict[str, dict[str, list]] = {}
    for i, w in enumerate(weighed):
        e = replace(w.evidence, parameters=trial.hypothesis.of(w.evidence.parameters))
        floor = np.array([w.floor[c] for c in e.channels])[:, None]
        errors = e.errors(trial.held_out[i]) * e.sigma / floor
        part = parts_of(e.given)[e.judged]
        for c, channel in enumerate(e.channels):
            by_part = sums.setdefault(channel.rsplit("_", 1)[0], {p: [] for p in PARTS})
            for k, p in enumerate(PARTS):
                by_part[p].append(errors[c][part == k])
    return {
        channel: {p: _rms(np.concatenate(values)) for p, values in by_part.items()} for channel, by_part in sums.items()
    }


def parts_of(given: ModelInput) -> np.ndarray:
    """Index into `PARTS` of every sample, shape (n,)."""
    theta, time_s = given.theta_in, given.recording.time_s
    speed = np.gradient(theta, time_s)
    moving = np.abs(speed) > STILL_SHARE * np.abs(speed).max() if np.ptp(theta) > 0 else np.zeros(theta.size, bool)
    part = np.where(moving, 2, 0)
    reach = AFTER_REVERSAL * np.ptp(theta)
    turned_at, way = theta[0], 0.0
    for i in np.flatnonzero(moving):
        if np.sign(speed[i]) != way:
            turned_at, way = theta[i], np.sign(speed[i])
        if abs(theta[i] - turned_at) < reach:
            part[i] = 1
    return part


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
