"""A pair of cables that is stated as a single cable, and a single cable that is stated as a pair.

A single cable only pulls its pulley one way, with a torque that is its tension times the radius. Two cables pull both
ways, and their torque is zero at rest.
"""

from collections.abc import Sequence
from math import isclose

import numpy as np
from numpy.typing import NDArray

from ccmodel.rig.batch import End
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.contradiction import DOUBTFUL, Contradiction
from ccmodel.rig.consistency.parity import Parity

_KEY = "rig.transmission"


def pair_as_single(parities: Sequence[Parity]) -> list[Contradiction]:
    """A single cable whose torques turn both pulleys both ways, which one cable cannot.

    That of the drive alone is no evidence: a motor's current holds the friction of its train, which turns with it.
    """
    rig = parities[0].batch.rig
    if not rig.far_end:
        return []
    turns = {}
    for end in rig.ends:
        having = [p for p in parities if end.torque in p.moving]
        ranges = [r for p in having if (r := _both_ways(p, end)) is not None]
        if having and len(ranges) < limits.MOST_RECORDINGS * len(having):
            return []
        if ranges:
            low, high = np.median(ranges, axis=0)
            turns[end.name] = f"that of the {end.name} from {low:.3g} to {high:.3g} N m"
    if "load" not in turns:
        return []
    text = (
        f"{_KEY} is single-cable, but the torques pull both ways, {' and '.join(turns.values())} (median of the 5 and"
        " 95 % quantiles), and one cable pulls one way only: state pull-pull without rig.far_end if there are two"
        " cables, otherwise correct the zeros of the torques"
    )
    return [Contradiction(_KEY, text)]


def _both_ways(parity: Parity, end: End) -> NDArray | None:
    """The 5 and 95 % quantiles of a torque, N m, if it turns the pulley both ways, against a taut cable; else None."""
    low, high = found = np.quantile(parity.moving[end.torque], [0.05, 0.95])
    least = max(limits.BOTH_WAYS * max(-low, high), parity.taut_N * end.side.pulley_radius_m)
    return found if min(-low, high) > least else None


def single_as_pair(parities: Sequence[Parity]) -> list[Contradiction]:
    """A pair whose torques are the whole sum of tensions, which at rest is one pretension: there is no cable B."""
    halves = [p.ratios["pretension"] for p in parities if "pretension" in p.ratios]
    if not halves or not isclose(float(np.median(halves)), 0.5, rel_tol=limits.JUST):
        return []
    if (text := _carried_by_one(parities)) is None:
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
    rig = parities[0].batch.rig
    if rig.far_end:
        return None
    shares = {end.name: [s for p in parities if (s := _share(p, end)) is not None] for end in rig.ends}
    if not any(shares.values()) or any(np.min(of, initial=np.inf) < limits.WHOLE_SUM for of in shares.values()):
        return None
    of_ends = (f"{np.median(of):.3g} of the sum of tensions at the {end}" for end, of in shares.items() if of)
    return (
        f"no cable B carries a tension: torque over radius is {' and '.join(of_ends)} (or more in 95 % of the samples"
        " of each recording, median)"
    )


def _share(parity: Parity, end: End) -> float | None:
    """Torque over radius and sum of tensions that is exceeded in 95 % of the samples; None without both sensors."""
    r = parity.recording
    if end.torque not in r or end.force not in r:
        return None
    taut = np.abs(r[end.force]) > parity.taut_N
    if taut.sum() < limits.FEWEST_SAMPLES:
        return None
    pulling: NDArray = np.abs(r[end.torque][taut]) / end.side.pulley_radius_m / np.abs(r[end.force][taut])
    return float(np.quantile(pulling, 0.05))
