"""Location of the mismatch: its place in the transmission, its channels and its phases of the motion."""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import PLACES_OF, short_name
from ccmodel.deadline import UNLIMITED, Deadline
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.drive import is_moving, since_reversal
from ccmodel.diagnosis.isolation import channels_of, isolate
from ccmodel.diagnosis.verdict import Judgement
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.model.run import ModelInput
from ccmodel.sentences import joined

# Phases of the drive's motion.
PHASES = ("at rest", "after a reversal", "under way")
# Place of a mismatch that no single part at fault explains: between drive and load.
BETWEEN = ("conduit",)

TEXT = {
    "drive-pulley": "at the drive pulley (between its torque and the cables)",
    "drive-end": "where the cables are fastened at the drive",
    "cable": "in the cables themselves",
    "conduit": "between cable and conduit",
    "load-end": "where the cables are fastened at the load",
    "load-pulley": "at the load pulley",
    "load": "in the load",
    "drive-sensor": "in a sensor at the drive",
    "load-sensor": "in a sensor at the load",
}


def location(
    judgement: Judgement, calibrated: CandidateFit, deadline: Deadline = UNLIMITED, isolating: bool = True
) -> dict:
    """Most likely place of the mismatch and all possible ones, the calibration's worst channels and phases, a text.

    Without `isolating`, a fault of one channel or of the load is not looked for. A mismatch that no mechanism explains
    then has no possible place; readers of `place` get the one along which nearly every effect acts.

    Raises
    ------
    ccmodel.deadline.OutOfTimeError
        If the deadline passes while a fault is isolated.
    """
    if judgement.verdict == "agrees":
        text = "model and recordings agree within the noise"
        return {"place": None, "is_found": False, "places": [], "channels": [], "phases": [], "text": text}
    hypothesis = judgement.best.hypothesis
    places = hypothesis.places or judgement.single_fault_places
    if not places and isolating:
        places = _places(judgement, deadline)
    table = mismatch(calibrated, judgement.whitened)
    square = {c: float(np.nanmean(np.square(list(phases.values())))) for c, phases in table.items()}
    channels = prominent(square, settings.NAMED_CHANNEL)
    squares = {p: np.array([table[c][p] ** 2 for c in channels]) for p in PHASES}
    by_phase = {p: float(np.nanmean(s)) for p, s in squares.items() if np.isfinite(s).any()}
    phases = sorted(prominent(by_phase, settings.NAMED_PHASE), key=PHASES.index)
    where = joined([TEXT[place] for place in places], "and" if hypothesis.acting else "or")
    text = f"Most likely place: {where}." if places else "The place was not looked for: a limit was reached before."
    return {
        "place": (*places, *BETWEEN)[0],
        "is_found": bool(places),
        "places": list(places),
        "channels": channels,
        "phases": phases,
        "text": f"{text} Largest errors: {joined(channels)}, {joined(phases)}.",
    }


def prominent(square: dict[str, float], share: float) -> list[str]:
    """Names whose mean squares exceed the noise floor by at least a share of the worst one's, the worst first."""
    beyond = {name: max(value - 1.0, 0.0) for name, value in square.items()}
    worst = max(beyond.values())
    ranked = sorted(square, key=lambda name: -square[name])
    return [name for name in ranked if beyond[name] > share**2 * worst] or ranked[:1]


def _places(judgement: Judgement, deadline: Deadline) -> list[str]:
    """Possible places of a mismatch that no mechanism explains, the most likely first.

    If no part alone is at fault (`ccmodel.diagnosis.isolation`), the fault lies between drive and load, where nearly
    every effect acts along the conduits. Places that this does not separate are ordered by their screening scores.
    """
    whitened, calibrated = judgement.whitened, judgement.calibrated
    least, places = min(isolate(whitened, calibrated, deadline), default=(0.0, PLACES_OF[channels_of(whitened)[0]]))
    possible = places if least <= settings.ISOLATED_SHARE * judgement.comparison.excess else BETWEEN
    scored = [s.hypothesis.acting[0][1] for s in judgement.scores if s.values]
    return list(dict.fromkeys([*(place for place in scored if place in possible), *possible]))


def mismatch(candidate: CandidateFit, whitened: Sequence[Whitened]) -> dict[str, dict[str, float]]:
    """Root mean square of the held-out errors over the noise floor, by channel and phase of the motion."""
    collected: dict[str, dict[str, list[NDArray]]] = defaultdict(lambda: {p: [] for p in PHASES})
    for i, w in enumerate(whitened):
        o = candidate.held_out(i)
        floor = np.array([w.noise_floor[c] for c in o.channels])[:, None]
        errors = o.errors({}) * o.sigma / floor
        phase = phases_of(o.given)[o.judged]
        for c, channel in enumerate(o.channels):
            for k, p in enumerate(PHASES):
                collected[short_name(channel)][p].append(errors[c][phase == k])
    return {
        channel: {p: _rms(np.concatenate(values)) for p, values in by_phase.items()}
        for channel, by_phase in collected.items()
    }


def phases_of(given: ModelInput) -> np.ndarray:
    """Index into `PHASES` of every sample, shape (n,)."""
    moving = is_moving(given)
    just_reversed = np.abs(since_reversal(given)[0]) < settings.AFTER_REVERSAL * np.ptp(given.theta_in)
    return np.where(moving, np.where(just_reversed, 1, 2), 0)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
