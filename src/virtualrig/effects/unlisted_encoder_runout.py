"""An encoder's disc off its axis: the angle reads theta + runout sin(theta + phase)."""

import numpy as np

from virtualrig.effects.contract import Twin, group_of


def _read(reading, truth, faults, time_s, radius_m):
    runout = faults.angle_runout_rad * np.sin(reading.angle_rad + faults.angle_runout_phase_rad)
    return reading._replace(angle_rad=reading.angle_rad + runout)


def _seed(size, also, place, spring):
    return {group_of(place): {"angle_runout_rad": size, "angle_runout_phase_rad": also["phase"]}}, {}


TWIN = Twin(
    name="unlisted-encoder-runout",
    fields={"sensors": {"angle_runout_rad": (float, 0.0), "angle_runout_phase_rad": (float, 0.0)}},
    places=("load-sensor",),
    size=(3e-3, 6e-2),
    unit="rad",
    seed=_seed,
    read=_read,
)
