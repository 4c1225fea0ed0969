"""Torques without their sign: a motor controller that logs the magnitude of its current."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import TAU_IN
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.contradiction import Contradiction
from ccmodel.rig.consistency.parity import Parity, correlation, work_over
from ccmodel.rig.log import runs


def rectified_torques(parities: Sequence[Parity]) -> list[Contradiction]:
    """Torques that have no sign, of the batch or of single recordings."""
    found = []
    for end, _, angle, channel, *_ in parities[0].batch.rig.ends:
        of_one_sign = [p for p in parities if _is_of_one_sign(p, channel)]
        rectified = [p for p in of_one_sign if is_rectified(p, angle, channel)]
        if not rectified:
            continue
        # A wrong zero hides it where friction is small, but lets no torque keep one sign.
        is_batch = len(of_one_sign) >= limits.MOST_RECORDINGS * sum(channel in p.moving for p in parities)
        named = [None] if is_batch else [p.recording.id for p in rectified]
        where = f"{len(rectified)} of {len(parities)} recordings"
        times = int(np.median([zeros(p.moving[channel]).size for p in rectified]))
        text = (
            f"the {end} torque is without its sign: in {where} it comes to zero {times} times (median) and never passes"
            f" it, and only a torque that changes its sign each time would go with the motion of the {end}; log the"
            f" signed current or torque of the {end}, not its magnitude, or take the column out"
        )
        found += [Contradiction(channel, text, recording) for recording in named]
    return found


def is_rectified(parity: Parity, angle: str, torque: str) -> bool:
    """Whether a torque of one sign goes with the motion only if it changes its sign wherever it comes to zero."""
    x = parity.moving
    if angle not in x:
        return False
    read = x[torque]
    is_turned = np.searchsorted(zeros(read), np.arange(read.size), "right") % 2 == 1
    signed = np.where(is_turned, -read, read)
    # Friction makes the drive torque go with the speed, a spring the load torque with the angle.
    relation = _work if torque == TAU_IN else correlation
    cycles = parity.cycles or slice(None)
    without, with_sign = (abs(relation(values[cycles], x[angle][cycles])) for values in (read, signed))
    return bool(with_sign > without + limits.BETTER_WITH_SIGN)


def zeros(torque: NDArray) -> NDArray:
    """Samples at which a torque of one sign comes to zero, once for each time that it went away."""
    low, high = (share * np.quantile(np.abs(torque), 0.95) for share in limits.AT_ZERO)
    near = [(run, int(np.argmin(np.abs(torque[run])))) for run in runs(np.abs(torque) < high)]
    return np.array([run.start + at for run, at in near if abs(torque[run.start + at]) < low], dtype=int)


def _is_of_one_sign(parity: Parity, torque: str) -> bool:
    """Whether a torque of a pair has one sign, noise included, and comes to zero now and then."""
    if torque not in parity.moving or parity.recording.far_end:
        return False
    values = parity.moving[torque]
    return not values.min() < 0 < values.max() and zeros(values).size >= limits.FEWEST_ZEROS


def _work(torque: NDArray, angle: NDArray) -> float:
    """Net work over the work exchanged."""
    found = work_over(torque, angle)
    return found[0] / found[1] if found else 0.0
