"""A pair of cables that is stated as a single cable, and a single cable that is stated as a pair.

A single cable only pulls its pulley one way, with a torque that is its tension times the radius. Two cables pull both
ways, and their torque is zero at rest.
"""

from collections.abc import Sequence
from math import isclose

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import SUM_AT, TORQUE_AT
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.contradiction import DOUBTFUL, Contradiction
from ccmodel.rig.consistency.parity import Parity

_KEY = "rig.transmission"


def is_single(parities: Sequence[Parity]) -> bool:
    """Whether the batch states a single cable."""
    return parities[0].recording.far_end is not None


def pair_as_single(parities: Sequence[Parity]) -> list[Contradiction]:
    """A single cable whose torques turn both pulleys both ways, which one cable cannot.

    That of the drive alone is no evidence: a motor's current holds the friction of its train, which turns with it.
    """
    if not is_single(parities):
        return []
    turns = {}
    for end, channel in TORQUE_AT.items():
        least = [p.taut_N * _radius(p, end) for p in parities if channel in p.moving]
        ranges = [np.quantile(p.moving[channel], [0.05, 0.95]) for p in parities if channel in p.moving]
        turning = [
            (low, high)
            for (low, high), taut in zip(ranges, least, strict=True)
            if min(-low, high) > max(limits.BOTH_WAYS * max(-low, high), taut)
        ]
        if ranges and len(turning) < limits.MOST_RECORDINGS * len(ranges):
            return []
        if turning:
            low, high = np.median(turning, axis=0)
            turns[end] = f"that of the {end} from {low:.3g} to {high:.3g} N m"
    if "load" not in turns:
        return []
    text = (
        f"{_KEY} is single-cable, but the torques pull both ways, {' and '.join(turns.values())} (median of the 5 and"
        " 95 % quantiles), and one cable pulls one way only: state pull-pull without rig.far_end if there are two"
        " cables, otherwise correct the zeros of the torques"
    )
    return [Contradiction(_KEY, text)]


def single_as_pair(parities: Sequence[Parity]) -> list[Contradiction]:
    """A pair whose torques are the whole sum of tensions, which at rest is one pretension: there is no cable B."""
    halves = [p.ratios["pretension"] for p in parities if "pretension" in p.ratios]
    text = _carried_by_one(parities)
    if text is None or not halves or not isclose(float(np.median(halves)), 0.5, rel_tol=limits.JUST):
        return []
    text += "; state single-cable and rig.far_end, or check the zero of the torques"
    return [Contradiction(_KEY, f"{text} (at rest, the sum is one pretension)")]


def doubtful_pair(parities: Sequence[Parity]) -> list[Contradiction]:
    """The same without the sum at rest: a load that pulls one way by more than the pretension does it to a pair."""
    text = _carried_by_one(parities)
    if text is None:
        return []
    text += (
        "; state single-cable and rig.far_end if there is one cable, or check the zero of the torques; a load that"
        " always pulls one way, harder than the pretension, does the same"
    )
    return [Contradiction(_KEY, text, None, DOUBTFUL)]


def _carried_by_one(parities: Sequence[Parity]) -> str | None:
    """What shows that one cable of a pair carries all of the tension; None if nothing does."""
    if is_single(parities):
        return None
    shares = {end: [s for p in parities if (s := _share(p, end)) is not None] for end in SUM_AT}
    if not any(shares.values()) or any(np.min(of, initial=np.inf) < limits.WHOLE_SUM for of in shares.values()):
        return None
    of_ends = (f"{np.median(of):.3g} of the sum of tensions at the {end}" for end, of in shares.items() if of)
    return (
        f"no cable B carries a tension: torque over radius is {' and '.join(of_ends)} (or more in 95 % of the samples"
        " of each recording, median)"
    )


def _share(parity: Parity, end: str) -> float | None:
    """Torque over radius and sum of tensions that is exceeded in 95 % of the samples; None without both sensors."""
    torque, force = TORQUE_AT[end], SUM_AT[end]
    r = parity.recording
    if torque not in r or force not in r:
        return None
    taut = np.abs(r[force]) > parity.taut_N
    if taut.sum() < limits.FEWEST_SAMPLES:
        return None
    pulling: NDArray = np.abs(r[torque][taut]) / _radius(parity, end) / np.abs(r[force][taut])
    return float(np.quantile(pulling, 0.05))


def _radius(parity: Parity, end: str) -> float:
    return {e.name: e.side.pulley_radius_m for e in parity.batch.rig.ends}[end]
