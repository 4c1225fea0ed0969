"""Recordings that do not belong to their batch: of another rig or bend, with copied channels, of two runs."""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import (
    ANGLE_AT,
    CHANNELS,
    F_DRIVE,
    F_LOAD,
    SUM_AT,
    TAU_IN,
    TAU_OUT,
    TENSIONS,
    THETA_IN,
    THETA_MOTOR,
    THETA_OUT,
    TORQUE_AT,
)
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.contradiction import LIKELY, SURE, Contradiction
from ccmodel.rig.consistency.parity import Parity, correlation, white_noise
from ccmodel.rig.consistency.scales import beyond
from ccmodel.rig.sensor_checks import is_noisy

ANGLES = {*ANGLE_AT.values(), THETA_MOTOR}
# A comparison of a recording with the others of its batch.
Check = Callable[[Parity, Sequence[Parity]], Contradiction | None]


def foreign_runs(parities: Sequence[Parity]) -> list[Contradiction]:
    """Contradictions of single recordings: the first that is found of each."""
    found = []
    for parity in parities:
        others = [p for p in parities if p is not parity]
        contradiction = (
            _two_runs(parity)
            or _straight(parity)
            or _whatever_cells_err(forgotten_bend, parity, others)
            or _whatever_cells_err(_other_rig, parity, others)
            or wrong_pretension(parity, others)
        )
        if contradiction:
            found.append(contradiction)
    return found


def copied_channels(parities: Sequence[Parity]) -> list[Contradiction]:
    """Channels of a recording that repeat those of another, change by change."""
    found = []
    channels = [c for c in CHANNELS if c not in TENSIONS]
    alike = {channel: _alike(parities, channel) for channel in channels}
    for k, parity in enumerate(parities):
        for e in np.flatnonzero(np.any([alike[c][k, :k] for c in channels], axis=0)).tolist():
            earlier = parities[e]
            copied = [c for c in channels if alike[c][k, e] and _is_copy(parity, earlier, c)]
            # The same command gives the same counts of motor and drive, and perhaps of the load: angles that agree
            # together, or at the load alone where the drive moves alike, are no copies.
            if set(copied) - ANGLES or (copied == [THETA_OUT] and not _moves_alike(parity, earlier)):
                names, ids = ", ".join(copied), (parity.recording.id, earlier.recording.id)
                repeat = f"{names} of {ids[0]} repeat those of {ids[1]}, sample by sample"
                text = f"{repeat}: noise does not repeat; one of the two logs holds a copy"
                if all(c in copied for c in channels if c in parity.recording):
                    text = f"{ids[0]} holds the same samples as {ids[1]}: take one of the two recordings out"
                found.append(Contradiction(names, text, parity.recording.id))
    return found


def one_sensor_twice(parities: Sequence[Parity]) -> list[Contradiction]:
    """Sensors of the two ends whose columns hold one and the same signal."""
    found = []
    for at_drive, at_load in (SUM_AT.values(), TORQUE_AT.values()):
        same = [p for p in parities if at_drive in p.recording and at_load in p.recording]
        same = [p for p in same if _is_same_noise(p.recording[at_drive], p.recording[at_load])]
        if same:
            text = (
                f"{at_load} follows {at_drive} change by change in {len(same)} of {len(parities)} recordings: the noise"
                " of two sensors differs, so both columns hold one of them"
            )
            found.append(Contradiction(f"{at_drive} and {at_load}", text))
    return found


def _is_same_noise(one: NDArray, other: NDArray) -> bool:
    """Whether two noisy channels have the same noise, at whatever scale; motions hardly reach the third differences."""
    noisy = all(is_noisy(np.diff(values)) for values in (one, other))
    return noisy and abs(correlation(np.diff(one, 3), np.diff(other, 3))) > limits.SAME_NOISE


def _alike(parities: Sequence[Parity], channel: str) -> NDArray:
    """Whether pairs of recordings may be copies in a channel, by some of its changes; shape (n, n), False above k = l.

    A thousand recordings have half a million pairs: all changes are compared of a few only.
    """
    n = len(parities)
    having = [k for k, p in enumerate(parities) if channel in p.recording]
    found = np.zeros((n, n), bool)
    if not having:
        return found
    shortest = min(parities[k].recording.time_s.size for k in having)
    at = np.unique(np.linspace(0, shortest - 2, limits.COMPARED_CHANGES, dtype=int))
    values = np.array([parities[k].recording[channel][[at, at + 1]] for k in having])
    changes = values[:, 1] - values[:, 0]
    scale = 1e-9 * np.abs(values).max(initial=0.0)
    for row, k in enumerate(having):
        same = np.abs(changes[:row] - changes[row]) <= scale
        moved = (np.abs(changes[:row]) > scale) | (np.abs(changes[row]) > scale)
        few = moved.sum(axis=1) < limits.FEWEST_SAMPLES
        found[k, having[:row]] = few | ((same & moved).sum(axis=1) > limits.MAYBE_COPIED * moved.sum(axis=1))
    return found


def _is_copy(one: Parity, other: Parity, channel: str) -> bool:
    if channel not in one.recording or channel not in other.recording:
        return False
    n = min(one.recording.time_s.size, other.recording.time_s.size)
    a, b = (np.diff(p.recording[channel][:n]) for p in (one, other))
    scale = 1e-9 * max(np.abs(a).max(initial=0.0), np.abs(b).max(initial=0.0))
    changes = (np.abs(a) > scale) | (np.abs(b) > scale)
    if changes.sum() < limits.FEWEST_SAMPLES:
        return False
    is_angle = channel in ANGLES
    equal = float(np.mean(np.abs(a - b)[changes] <= scale))
    if equal <= (limits.COPIED_ANGLE if is_angle else limits.COPIED_NOISE):
        return False
    # Without noise, equal physics gives equal readings.
    least_noise = limits.NOISE_OVER_ACCURACY * one.recording.accuracy[channel]
    return is_angle or is_noisy(a) or white_noise(one.recording[channel]) > least_noise


def _moves_alike(one: Parity, other: Parity) -> bool:
    """Whether the drives of two recordings are at the same angle, within what their encoders show."""
    n = min(one.recording.time_s.size, other.recording.time_s.size)
    apart = one.recording[THETA_IN][:n] - other.recording[THETA_IN][:n]
    step = max(p.recording.encoder_step_rad.get(THETA_IN, 0.0) for p in (one, other))
    return float(np.abs(apart - np.median(apart)).max()) <= limits.ALIKE_STEPS * step


def _two_runs(parity: Parity) -> Contradiction | None:
    """Angles of the two ends that do not belong to one run."""
    together = parity.signs.get("angles")
    if together is None or abs(together) > limits.SAME_RUN:
        return None
    if parity.ratios.get("travel", 0.0) < limits.LEAST_TRAVEL:  # A load that hardly moves need not follow.
        return None
    text = (
        f"the load angle of {parity.recording.id} does not follow its drive angle (correlation {together:.2f}): one of"
        " the two is of another run, or their clocks are apart"
    )
    return Contradiction(THETA_OUT, text, parity.recording.id, LIKELY)


def _straight(parity: Parity) -> Contradiction | None:
    """Friction of a conduit that is stated as straight."""
    bend, found = parity.recording.path.bend_rad, parity.log_ratio
    if found is None or bend > limits.STRAIGHT_RAD or found < limits.STRAIGHT_LOG_RATIO + parity.capstan:
        return None
    text = (
        f"conduit of {parity.recording.id} is stated with {bend:.3g} rad of bend, but T1 / T2 reaches"
        f" {np.exp(found):.3g} in full slip, as friction along {_bend_for(parity, found)} of bend: a forgotten bend_rad"
    )
    return Contradiction("bend_rad", text, parity.recording.id, LIKELY)


def _bend_for(parity: Parity, log_ratio: float) -> str:
    mu = parity.batch.rig.cable.friction_coefficient
    return f"{log_ratio / mu:.2g} rad" if mu else "some radians"


def _whatever_cells_err(check: Check, parity: Parity, others: Sequence[Parity]) -> Contradiction | None:
    """What a check finds, unless an offset and a drift of one load cell in all recordings would account for it."""
    found = check(parity, others)
    if found is None:
        return None
    every = (parity, *others)
    most = limits.MOST_CELL_ERROR * min(_tension(p) for p in every)
    lasts_s = max(float(p.recording.time_s[-1]) for p in every)
    ends = [end for end, channel in SUM_AT.items() if all(channel in p.recording for p in every)]
    for end, offset, drift in product(ends, limits.CELL_OFFSETS_N, limits.CELL_DRIFTS_N_PER_S):
        if abs(offset) + abs(drift) * lasts_s > most:
            continue
        corrected, *rest = (p.without_cell_error(end, offset, drift) for p in every)
        if check(corrected, rest) is None:
            return None
    return found


def wrong_pretension(parity: Parity, others: Sequence[Parity]) -> Contradiction | None:
    """A recording whose tension at rest is far from the stated one, while that of most others is not.

    An offset of a load cell makes it differ most where the tension is low, but by the same force everywhere.
    """
    ratio, stated = parity.ratios.get("pretension", 0.0), _tension(parity)
    theirs = np.array([(r, _tension(p)) for p in others if (r := p.ratios.get("pretension", 0.0)) > 0]).reshape(-1, 2)
    if not (theirs.size and ratio > 0):
        return None
    typical, common_N = float(np.median(theirs[:, 0])), float(np.median((theirs[:, 0] - 1) * theirs[:, 1]))
    is_far = beyond(ratio, limits.PRETENSION_FACTOR) and beyond(ratio / typical, limits.PRETENSION_FACTOR)
    if not is_far or abs((ratio - 1) * stated - common_N) < min(stated, ratio * stated):
        return None
    text = (
        f"half the sum of tensions of {parity.recording.id} at rest is {ratio * stated:.3g} N, but its pretension_N is"
        f" {stated:g}; in the other recordings it is {typical:.2g} times the stated one. Check pretension_N of this"
        " entry"
    )
    return Contradiction("pretension_N", text, parity.recording.id, LIKELY)


def forgotten_bend(parity: Parity, others: Sequence[Parity]) -> Contradiction | None:
    """A recording with more friction for its bend than all others."""
    tension = parity.recording.pretension_N
    excess = _excess("friction", parity, [p for p in others if p.recording.pretension_N <= 1.1 * tension])
    if np.exp(excess) < limits.FORGOTTEN_BEND:
        return None
    bend = parity.recording.path.bend_rad
    text = (
        f"conduit of {parity.recording.id} is stated with {bend:.3g} rad of bend, but its friction is"
        f" {np.exp(excess):.2g} times that of the other recordings for each radian: a bend of"
        f" {bend * np.exp(excess):.2g} rad would agree with them; check bend_rad"
    )
    return Contradiction("bend_rad", text, parity.recording.id, LIKELY)


def _other_rig(parity: Parity, others: Sequence[Parity]) -> Contradiction | None:
    """A recording whose spring, friction, stiffness, travel or pretension is not that of the others."""
    deviations = {name: d / limits.SCATTER[name.split(" ")[0]] for name, d in deviations_of(parity, others).items()}
    distance = float(np.sqrt(sum(d**2 for d in deviations.values())))
    if distance < limits.OTHER_RIG:
        return None
    worst = sorted(deviations, key=lambda name: -abs(deviations[name]))[:3]
    worst = [name for name in worst if abs(deviations[name]) > 1]
    apart = [f"{name} {_times(name, parity, others)}" for name in worst]
    text = (
        f"{parity.recording.id} is of another rig or of other conditions than the batch states: compared with the other"
        f" recordings' medians, {', '.join(apart)}; check that the log is the one of this entry{_noted(worst)}"
    )
    return Contradiction(parity.recording.id, text, parity.recording.id, SURE if distance > 6 else LIKELY)


def _noted(names: Sequence[str]) -> str:
    """Keys of the entry in which what is compared was noted."""
    keys = [_NOTED[name] for name in names if name in _NOTED]
    return f", and its {' and '.join(keys)}" if keys else ""


def _times(name: str, parity: Parity, others: Sequence[Parity]) -> str:
    typical = float(np.median([p.ratios[name] for p in others if name in p.ratios]))
    return f"is {parity.ratios[name] / typical:.2g} times theirs"


def deviations_of(parity: Parity, others: Sequence[Parity]) -> dict[str, float]:
    """Logarithm of each relation over the nearest value of comparable recordings, 0 within their range.

    Physics makes a relation rise or fall with the conditions: backlash and a stiffening load raise the spring with the
    stroke and an inertia lowers it with the frequency; friction falls with the tension, and stiffness rises with it; a
    conduit with more bend takes up more travel. An excess is therefore compared only with recordings that should have
    more, a deficit with those that should have less.
    """
    found = {}
    for name, conditions in _DEPENDENCE.items():
        if parity.ratios.get(name, 0.0) > (limits.LEAST_TRAVEL if name == "travel" else 0.0):
            more = [p for p in others if all(_at_least(c(p), c(parity), sign) for c, sign in conditions)]
            less = [p for p in others if all(_at_least(c(p), c(parity), -sign) for c, sign in conditions)]
            found[name] = _excess(name, parity, more) - _excess(name, parity, less, -1)
    return found


def _stroke(parity: Parity) -> float:
    return parity.stroke_rad


def _frequency(parity: Parity) -> float:
    return parity.frequency_per_s


def _tension(parity: Parity) -> float:
    return parity.recording.pretension_N


def _bend_rad(parity: Parity) -> float:
    return parity.recording.path.bend_rad


# Relations of which a recording gives more than one estimate.
_ESTIMATES = {"friction": ("friction of the sums", "friction of the slope")}
# Key of an entry that states what a relation is compared with.
_NOTED = {"pretension": "pretension_N", "amplitude": "excitation.amplitude_rad", "frequency": "excitation.frequency_Hz"}
# Conditions that a relation rises (1) or falls (-1) with.
_DEPENDENCE = {
    "spring": ((_stroke, 1), (_frequency, -1)),
    "friction": ((_tension, -1),),
    "stiffness": ((_tension, 1),),
    "travel": ((_stroke, 1), (_bend_rad, -1)),
    "pretension": ((_tension, 1), (_tension, -1)),
    "amplitude": (),
    "frequency": (),
    **{f"noise of {channel}": () for channel in (TAU_IN, TAU_OUT, F_DRIVE, F_LOAD)},
}


def _at_least(other: float, here: float, sign: int) -> bool:
    """Whether a condition of another recording is at least (sign 1) or at most (-1) that of this one, about."""
    return other >= here / limits.ALIKE if sign > 0 else other <= here * limits.ALIKE


def _excess(name: str, parity: Parity, others: Sequence[Parity], sign: int = 1) -> float:
    """By how much the logarithm of a relation exceeds (sign 1) or falls below (-1) all others; 0 without others.

    Of a relation with two estimates that of the smaller excess: one of them may err in one recording, and the ratio
    itself may be of one estimate here and of the other there.
    """
    excesses = []
    for estimate in _ESTIMATES.get(name, (name,)):
        values = [sign * np.log(p.ratios[estimate]) for p in others if p.ratios.get(estimate, 0.0) > 0]
        if values and parity.ratios.get(estimate, 0.0) > 0:
            excesses.append(float(sign * np.log(parity.ratios[estimate]) - max(values)))
    return max(0.0, min(excesses, default=0.0))
