"""Where model and recordings differ: by channel, by phase of the motion, by place along the transmission."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ccmodel.diagnose.candidate import CandidateFit
from ccmodel.diagnose.comparison import Judgement
from ccmodel.diagnose.drive import is_moving, since_reversal
from ccmodel.diagnose.isolation import PLACES_OF, channels_of, cleared
from ccmodel.diagnose.whitening import Whitened
from ccmodel.model.run import ModelInput

# Parts of a motion by what the drive does.
PARTS = ("at rest", "after a reversal", "under way")
# A reversal's mark is looked for over this share of the drive's stroke after it.
AFTER_REVERSAL = 0.25
# A channel is named if it carries this share of the error beyond noise that the worst one does, in units of its noise;
# a part of the motion likewise.
NAMED_SHARE, PARTS_SHARE = 0.35, 0.7
# One suspect alone accounts for a mismatch if without it no more than this share of it is left. Of places that this
# does not tell apart the screening chooses.
ALONE = 0.05
BETWEEN = ("conduit",)

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


def location(judgement: Judgement) -> dict:
    """Place, channels and parts of the motion that carry the mismatch, and a sentence."""
    if judgement.verdict == "agrees":
        return {"place": None, "channels": [], "phases": [], "text": "model and recordings agree within the noise"}
    acting = judgement.best.hypothesis.acting
    places = list(dict.fromkeys(place for _, place in acting)) or judgement.one_fault or _places(judgement)
    table = mismatch(judgement.weighed, judgement.calibrated)
    square = {c: float(np.nanmean(np.square(list(parts.values())))) for c, parts in table.items()}
    channels = _sticking_out(square, NAMED_SHARE)
    squares = {p: np.array([table[c][p] ** 2 for c in channels]) for p in PARTS}
    by_part = {p: float(np.nanmean(s)) for p, s in squares.items() if np.isfinite(s).any()}
    parts = sorted(_sticking_out(by_part, PARTS_SHARE), key=PARTS.index)
    verb = "is" if len(channels) == 1 else "are"
    where = (" and " if acting else " or ").join(TEXT[place] for place in places)
    text = f"The mismatch sits {where}: {', '.join(channels)} {verb} off most, {' and '.join(parts)}."
    return {"place": places[0], "channels": channels, "phases": parts, "text": text}


def _sticking_out(square: dict[str, float], share: float) -> list[str]:
    """Of mean squares over what a right model leaves, the names of those furthest beyond it, the worst first."""
    beyond = {name: max(value - 1.0, 0.0) for name, value in square.items()}
    worst = max(beyond.values())
    ranked = sorted(square, key=lambda name: -square[name])
    return [name for name in ranked if beyond[name] > share**2 * worst] or ranked[:1]


def _places(judgement: Judgement) -> list[str]:
    """Where the mismatch sits as far as it can be said without a mechanism that accounts for it, likeliest first.

    What no suspect alone accounts for (`ccmodel.diagnose.isolation`) lies in between, and there nearly everything
    that can be wrong is wrong along the conduits.
    """
    weighed, calibrated = judgement.weighed, judgement.calibrated
    left, places = min(cleared(weighed, calibrated), default=(0.0, PLACES_OF[channels_of(weighed)[0]]))
    suspects = places if left <= ALONE * max(float(calibrated.left.mean() - 1.0), 0.0) else BETWEEN
    found = [s.hypothesis.acting[0][1] for s in judgement.scores if s.values]
    return list(dict.fromkeys([*(place for place in found if place in suspects), *suspects]))


def mismatch(weighed: Sequence[Whitened], trial: CandidateFit) -> dict[str, dict[str, float]]:
    """Root mean square of the held-out errors over what a right model leaves, by channel and part of the motion."""
    sums: dict[str, dict[str, list]] = {}
    for i, w in enumerate(weighed):
        e = replace(w.observations, parameters=trial.hypothesis.of(w.observations.parameters))
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
    moving = is_moving(given)
    just_turned = np.abs(since_reversal(given)[0]) < AFTER_REVERSAL * np.ptp(given.theta_in)
    return np.where(moving, np.where(just_turned, 1, 2), 0)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
