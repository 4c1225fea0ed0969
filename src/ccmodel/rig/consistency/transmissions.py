"""A pair of cables that is stated as a single cable, and a single cable that is stated as a pair."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import SUM_AT, TORQUE_AT
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.contradiction import Contradiction
from ccmodel.rig.consistency.parity import Parity

_KEY = "rig.transmission"


def wrong_transmission(parities: Sequence[Parity]) -> list[Contradiction]:
    """The transmission, if the recordings show that the torques are of the other kind.

    A single cable only pulls its pulley one way, with a torque that is its tension times the radius. Two cables pull
    both ways, and their torque is zero at rest.
    """
    is_single = parities[0].recording.far_end is not None
    return _of_a_pair(parities) if is_single else _of_one_cable(parities)


def _of_a_pair(parities: Sequence[Parity]) -> list[Contradiction]:
    """Torques that turn both pulleys both ways, which one cable cannot.

    That of the drive alone is no evidence: a motor's current holds the friction of its train, which turns with it.
    """
    turns = {}
    for end, channel in TORQUE_AT.items():
        ranges = [np.quantile(p.moving[channel], [0.05, 0.95]) for p in parities if channel in p.moving]
        turning = [(low, high) for low, high in ranges if min(-low, high) > limits.BOTH_WAYS * max(-low, high)]
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


def _of_one_cable(parities: Sequence[Parity]) -> list[Contradiction]:
    """Torques that are the whole sum of tensions throughout, rest and reversals included: no cable B carries any."""
    shares = {end: [s for p in parities if (s := _share(p, end)) is not None] for end in SUM_AT}
    if not any(shares.values()) or any(np.min(of, initial=np.inf) < limits.WHOLE_SUM for of in shares.values()):
        return []
    text = (
        "no cable B carries a tension: torque over radius is "
        + " and ".join(f"{np.median(of):.3g} of the sum of tensions at the {end}" for end, of in shares.items() if of)
        + " (or more in 95 % of the samples of each recording, median), at rest as well; state single-cable and"
        " rig.far_end, or check the zero of the torques"
    )
    return [Contradiction(_KEY, text)]


def _share(parity: Parity, end: str) -> float | None:
    """Torque over radius and sum of tensions that is exceeded in 95 % of the samples; None without both sensors."""
    torque, force = TORQUE_AT[end], SUM_AT[end]
    r = parity.recording
    if torque not in r or force not in r:
        return None
    radius = {e.name: e.side.pulley_radius_m for e in parity.batch.rig.ends}[end]
    taut = np.abs(r[force]) > parity.taut_N
    if taut.sum() < limits.FEWEST_SAMPLES:
        return None
    pulling: NDArray = np.abs(r[torque][taut]) / radius / np.abs(r[force][taut])
    return float(np.quantile(pulling, 0.05))
