"""Fault isolation: does the calibrated model hold without one channel, or with the measured load torque?

A fault of a sensor or a pulley affects one channel; the calibrated model is adequate in all others if that channel is
not fitted. A load with another law leaves a model adequate whose cables are driven by the measured load torque. The
kind of fault does not matter, so that faults of no known kind are isolated like any other.
"""

from collections.abc import Sequence

import numpy as np

from ccmodel.channels import PLACES_OF, TAU_OUT, THETA_OUT
from ccmodel.deadline import UNLIMITED, Deadline, OutOfTimeError
from ccmodel.diagnosis.candidate import CandidateFit, fit
from ccmodel.diagnosis.whitening import Whitened, whiten
from ccmodel.failure import ModelError
from ccmodel.inference.observations import Observations
from ccmodel.inference.pool import each

AT_THE_LOAD = ("load", "load-pulley")


def isolate(
    whitened: Sequence[Whitened], calibrated: CandidateFit, deadline: Deadline = UNLIMITED
) -> list[tuple[float, tuple[str, ...]]]:
    """For each part that may be at fault, the excess mean square without it and the places of that part.

    Raises
    ------
    ccmodel.deadline.OutOfTimeError
        If the deadline passes.
    """
    channels = channels_of(whitened)
    found = [(excess(without(c, whitened), calibrated, deadline), PLACES_OF[c]) for c in channels if len(channels) > 1]
    if all({TAU_OUT, THETA_OUT} < set(w.observations.channels) for w in whitened):
        driven = [(w, w.observations.driven_by_torque()) for w in whitened]
        found.append((excess(driven, calibrated, deadline), AT_THE_LOAD))
    return found


def channels_of(whitened: Sequence[Whitened]) -> list[str]:
    """Every channel that is compared in any recording."""
    return list(dict.fromkeys(c for w in whitened for c in w.observations.channels))


def without(channel: str, whitened: Sequence[Whitened]) -> list[tuple[Whitened, Observations]]:
    """Recordings, and their observations without a channel; recordings with no other channel are left out."""
    return [(w, o) for w in whitened if (o := w.observations.without(channel)).channels]


def excess(
    parts: Sequence[tuple[Whitened, Observations]], calibrated: CandidateFit, deadline: Deadline = UNLIMITED
) -> float:
    """Mean square above the noise of the calibrated model, fitted to a part of each recording; infinite if it fails.

    What differs from run to run has the spreads, and each recording the own values, of the whole recordings.
    """

    def whitened_part(_: int, part: tuple[Whitened, Observations]) -> Whitened:
        whole, o = part
        return whiten(o, calibrated.model(o.parameters, o.session), whole.repeatability, whole.own)

    try:
        whitened = each(parts, whitened_part)
        return fit(whitened, calibrated.hypothesis, calibrated.free, calibrated.values, deadline).mean_square - 1.0
    except OutOfTimeError:
        raise
    except ModelError:
        return np.inf
