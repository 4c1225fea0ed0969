"""One suspect alone: is the calibrated model right once one channel is not judged, or the load's law is not asked for?

A sensor or pulley at fault spoils one channel, and the calibrated model is right in all others once that channel is
not fitted. A load with another law leaves the cables right that are driven by its torque. Neither asks what the fault
is, so that what is on no list is found like anything else.
"""

from collections.abc import Sequence

import numpy as np

from ccmodel.diagnose.candidate import CandidateFit, fit
from ccmodel.diagnose.whitening import Whitened, weigh
from ccmodel.failure import ModelError
from ccmodel.inference.problem import Observations, each

# Where a fault may sit that shows in one channel and in no other.
PLACES_OF = {
    "theta_out_rad": ("load-sensor",),
    "tau_in_Nm": ("drive-pulley", "drive-sensor"),
    "tau_out_Nm": ("load-sensor",),
    "F_drive_N": ("drive-sensor",),
    "F_load_N": ("load-sensor",),
}
AT_THE_LOAD = ("load", "load-pulley")


def cleared(weighed: Sequence[Whitened], calibrated: CandidateFit) -> list[tuple[float, tuple[str, ...]]]:
    """What is left beyond noise (mean square) without each suspect, and the places where that suspect may sit."""
    channels = channels_of(weighed)
    found = [(excess(without(c, weighed), calibrated), PLACES_OF[c]) for c in channels if len(channels) > 1]
    if all({"tau_out_Nm", "theta_out_rad"} < set(w.observations.channels) for w in weighed):
        driven = [w.observations.driven_by_torque() for w in weighed]
        found.append((excess(driven, calibrated), AT_THE_LOAD))
    return found


def channels_of(weighed: Sequence[Whitened]) -> list[str]:
    """Every channel that any recording is judged in."""
    return list(dict.fromkeys(c for w in weighed for c in w.observations.channels))


def without(channel: str, weighed: Sequence[Whitened]) -> list[Observations]:
    """Recordings with a channel left out, those aside in which nothing else is judged."""
    return [e for w in weighed if (e := w.observations.without(channel)).channels]


def excess(observations: Sequence[Observations], calibrated: CandidateFit) -> float:
    """Mean square beyond noise of what is left of recordings if the calibrated model is fitted to these."""
    fitted = calibrated.hypothesis.of(observations[0].parameters).with_values(calibrated.values)
    try:
        weighed = each(observations, lambda i, e: weigh(e, fitted))
        return float(fit(weighed, calibrated.hypothesis, calibrated.free, calibrated.values).left.mean()) - 1.0
    except ModelError:
        return np.inf
