"""Sensors of the two ends under each other's names: which of them are exchanged.

Friction lets the drive turn first: the load angle follows the drive angle, and the load torque the drive torque. The
drive gives energy, and a passive load takes it. Each exchange turns a set of these relations of its own:

==========  ==============  =============  ==============  =========================
exchanged   energy is lost  lag of angles  lag of torques  load moves less than drive
==========  ==============  =============  ==============  =========================
all         turned          turned         turned          turned
torques     turned                         turned
encoders                    turned                         turned
==========  ==============  =============  ==============  =========================

Sensors of one end that come late turn lags too, but neither energy nor travel.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ccmodel.channels import TAU_IN, TAU_OUT, THETA_IN, THETA_OUT
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.parity import Parity


class Exchange(NamedTuple):
    """Sensors that are exchanged.

    Attributes
    ----------
    what : str
        The channels, or the two ends.
    text : str
        What is exchanged.
    remedy : str
        What to do.
    """

    what: str
    text: str
    remedy: str


ENDS = Exchange(
    "drive and load",
    "drive and load are exchanged",
    "exchange the columns (or the sides of batch.yaml) of drive and load",
)
TORQUES = Exchange(
    f"{TAU_IN} and {TAU_OUT}",
    "the torques (motor currents) of drive and load are exchanged, and their angles are not",
    "exchange the columns of the torques, currents or tensions of drive and load, and no others",
)
ENCODERS = Exchange(
    f"{THETA_IN} and {THETA_OUT}",
    "the encoders of drive and load are exchanged, and their torques are not",
    "exchange the columns of the two encoders, and no others",
)
# Where the lags do not tell the two apart.
ENDS_OR_TORQUES = Exchange(
    f"{ENDS.what}, or {TORQUES.what} alone",
    "drive and load are exchanged, or their torques (motor currents) alone",
    "see which of the columns are those of the drive: exchange all columns of the ends, or the torques alone",
)


def exchange_of(parities: Sequence[Parity], is_mirrored: bool = False) -> Exchange | None:
    """Which sensors are exchanged, by the energies and lags of recordings that show them alike; None if none are.

    Parameters
    ----------
    parities : sequence of Parity
        Recordings.
    is_mirrored : bool
        Whether both torques, or both angles, have the wrong sign too, as exchanged sensors have whose signs are stated
        as unlike. That turns the energies once more.

    Returns
    -------
    Exchange or None
    """
    angles, torques = _turned(parities, "angles", limits.LEAST_LAG), _turned(parities, "torques", 0.0)
    # A drive that gives nearly all that it exchanges has its own torque: the load's does little work there.
    gives = [p.signs["work"] for p in parities if "work" in p.signs]
    is_own = is_mirrored and bool(gives) and float(np.median(gives)) > limits.WORK_OF_DRIVE
    if median_loss(parities, is_mirrored) < limits.WRONG_LOSS and not is_own:
        too_far = travels_as_exchanged(parities)
        if torques and angles is too_far:
            return ENDS if too_far else TORQUES
        # Without a lag of the angles friction is small, and a filter of the drive's current does the same.
        return None if is_mirrored or angles is None else ENDS_OR_TORQUES
    turns_alone = angles is True and torques is False
    if turns_alone and travels_as_exchanged(parities) and (is_mirrored or _spring_gives(parities)):
        return ENCODERS
    return None


def median_loss(parities: Sequence[Parity], is_mirrored: bool = False) -> float:
    """Energy lost between the ends, as in `Parity.signs` or turned; 0 if no recording shows it."""
    losses = [p.signs["loss"] for p in parities if "loss" in p.signs]
    return (-1) ** is_mirrored * float(np.median(losses or [0.0]))


def _turned(parities: Sequence[Parity], name: str, least: float) -> bool | None:
    """Whether the drive follows the load in most recordings, by more than `least`; None if they disagree."""
    lags = np.array([p.lags[name] for p in parities if name in p.lags])
    for turned, of in ((True, lags < -least), (False, lags > least)):
        if lags.size and of.mean() >= limits.MOST_RECORDINGS:
            return turned
    return None


def _spring_gives(parities: Sequence[Parity]) -> bool:
    """Whether a stated spring gives energy over a cycle; True without one.

    Under its own sensors it gives none, also if both of them come late.
    """
    if parities[0].batch.rig.load.spring_stiffness_Nm_per_rad is None:
        return True
    given = [-taken[0] / taken[1] for p in parities if (taken := p.work_at_load)]
    return float(np.median(given)) > limits.SPRING_GIVES


def travel_of(parities: Sequence[Parity]) -> float | None:
    """Travel of the load over that of the drive, both at the cable, in the recording of the greatest stroke."""
    travels = [(p.stroke_rad, p.ratios["travel"]) for p in parities if "travel" in p.ratios]
    return max(travels)[1] if travels else None


def travels_as_exchanged(parities: Sequence[Parity]) -> bool:
    """Whether the travel of the load cannot be right, and would be if the encoders were exchanged."""
    travel = travel_of(parities)
    if not travel:
        return False
    is_right = limits.LEAST_TRAVEL <= travel <= limits.MOST_TRAVEL_OF_RADII
    drive, load = (end.side for end in parities[0].batch.rig.ends)
    # Exchanged angles are taken to the cable by each other's radii, and counts to angles by each other's counts per
    # turn.
    unlike = (drive.pulley_radius_m / load.pulley_radius_m) ** 2
    if drive.encoder_counts_per_rev and load.encoder_counts_per_rev:
        unlike *= (load.encoder_counts_per_rev / drive.encoder_counts_per_rev) ** 2
    return not is_right and 1 / limits.MOST_TRAVEL < 1 / (travel * unlike) <= limits.MOST_TRAVEL_OF_RADII
