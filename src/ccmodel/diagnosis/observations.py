"""First stage: the recordings of a batch as observations, and a list of what could not be judged."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ccmodel.channels import MEASURED
from ccmodel.diagnosis import settings
from ccmodel.failure import ModelError
from ccmodel.inference.observations import Observations, Tolerance, with_pooled_noise
from ccmodel.model.parameters import Parameters
from ccmodel.recording import Recording

NotJudged = list[dict[str, str]]


def observations_of(
    recordings: Sequence[Recording],
    estimates: Parameters,
    tolerance: Tolerance = 0.0,
    step_s: float = settings.STEP_S,
    cycles: int | None = None,
) -> tuple[list[Observations], NotJudged]:
    """Observations of every usable recording, and what could not be judged.

    Of more than `MOST_RECORDINGS`, so many are taken, evenly from all conditions. If the initial tension is observed at
    rest in some recordings, those without are left out: friction and initial tension cannot be separated in them.

    Raises
    ------
    ModelError
        If the model cannot be run on any of the recordings.
    """
    usable, not_judged = [], []
    chosen = spread_over_conditions(recordings, settings.MOST_RECORDINGS)
    if len(chosen) < len(recordings):
        what = f"{len(recordings) - len(chosen):,} of {len(recordings):,} recordings"
        why = f"a diagnosis compares at most {settings.MOST_RECORDINGS}, taken evenly from all conditions and over time"
        not_judged.append(_entry(what, why))
    for recording in chosen:
        step = max(step_s, float(np.ptp(recording.time_s)) / settings.MOST_SAMPLES)
        try:
            shown = first_cycles(recording, cycles)
            usable.append(Observations.of(shown, estimates, step_s=step, tolerance=tolerance, whole=recording))
        except (ModelError, ValueError) as error:
            not_judged.append(_entry(recording.id, str(error)))
    if not usable:
        raise ModelError("none of the recordings can be compared with the model: " + not_judged[-1]["why"])
    observed = [o for o in usable if o.given.initial_tension_observed]
    if observed:
        why = "its tensions are not observed at rest by load cells and torques, as those of the others are"
        not_judged += [_entry(o.id, why) for o in usable if o not in observed]
    usable = _with_lone_batches(with_pooled_noise(observed or usable))
    return usable, [*not_judged, *_missing(usable), *_tolerated(tolerance)]


def spread_over_conditions(recordings: Sequence[Recording], most: int) -> list[Recording]:
    """At most so many recordings, as equal a number of each stated condition as there are, evenly over its sequence."""
    if len(recordings) <= most:
        return list(recordings)
    by_condition: dict[str, list[int]] = {}
    for i, r in enumerate(recordings):
        stated = r.batch, r.pretension_N, r.path.bend_rad, r.path.length_m, sorted(r.excitation.items())
        by_condition.setdefault(repr(stated), []).append(i)
    share = Counter[str]()
    while share.total() < most:
        left = [condition for condition, of in by_condition.items() if share[condition] < len(of)]
        evenly = np.linspace(0, len(left) - 1, min(len(left), most - share.total())).round()
        share.update(left[int(k)] for k in evenly)
    chosen = [
        of[int(k)]
        for condition, of in by_condition.items()
        for k in np.linspace(0, len(of) - 1, share[condition]).round()
    ]
    return [recordings[i] for i in sorted(chosen)]


def _with_lone_batches(observations: Sequence[Observations]) -> list[Observations]:
    """Observations in which the only recording of a batch among several has the friction between batches as its own.

    Where a batch has more recordings, its friction is an unknown (`ccmodel.diagnosis.calibration`).
    """
    counts = Counter(o.session for o in observations)
    if len(counts) == 1:
        return list(observations)
    between = {1: settings.FRICTION_BETWEEN}
    return [replace(o, friction_between=between.get(counts[o.session], 0.0)) for o in observations]


def first_cycles(recording: Recording, cycles: int | None) -> Recording:
    """A sinusoidal recording up to so many cycles after its start-up transient; any other recording whole."""
    frequency = recording.excitation.get("frequency_Hz")
    if cycles is None or not frequency or recording.excitation.get("wave") != "sine":
        return recording
    wanted = recording.time_s <= max(recording.settled_s, recording.rest_s) + cycles / frequency
    return recording[: int(wanted.sum())]


def _entry(what: str, why: str) -> dict[str, str]:
    return {"what": what, "why": why}


def _tolerated(tolerance: Tolerance) -> NotJudged:
    by_channel = tolerance if isinstance(tolerance, Mapping) else {"a channel": tolerance}
    why = "within the tolerance of this run, which counts as noise unless a candidate leaves less"
    return [
        _entry(f"errors below {100 * share:g} % of {name}'s peak to peak", why)
        for name, share in by_channel.items()
        if share
    ]


def _missing(observations: Sequence[Observations]) -> NotJudged:
    """Channels, conditions and recordings that a complete diagnosis would need."""
    found = []
    recorded = {c for o in observations for c in o.channels}
    for channel in MEASURED:
        lacking = [o.id for o in observations if channel not in o.channels]
        if channel not in recorded:
            found.append(_entry(channel, "not recorded, or prescribed to the model as the load's motion or torque"))
        elif lacking:
            found.append(_entry(f"{channel} of {', '.join(lacking)}", "not recorded there, or not usable"))
    if not all(o.given.initial_tension_observed for o in observations):
        why = (
            "load cells and torques of both ends do not show them at rest: the initial tension is fitted as one share"
            " of the stated pretension"
        )
        found.append(_entry("initial tension, ratio of the pulley radii, zeros of the torques", why))
    if len(observations) == 1:
        found.append(_entry("held-out error", "a single recording: nothing can be held out"))
    if len({round(o.given.recording.path.bend_rad, 3) for o in observations}) == 1:
        found.append(_entry("friction apart from bend", "one bend angle: only the product of the two is determined"))
    return found
