"""An encoder's disc off its axis: the angle reads theta + runout sin(theta + phase)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualrig.effects.contract import ANGLES_RAD, Seeded, Side, TrueLaw, Twin, added_by, along, group_of, sensor_map


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    runout = faults.angle_runout_rad * np.sin(reading.angle_rad + faults.angle_runout_phase_rad)
    return reading._replace(angle_rad=reading.angle_rad + runout)


def _law(rig: Any, place: str) -> TrueLaw:
    theta, faults = along(ANGLES_RAD), getattr(rig.effects, group_of(place))
    return sensor_map(place, "reading", "angle", theta, added_by(_read, faults, "angle", "angle", theta))


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {group_of(place): {"angle_runout_rad": size, "angle_runout_phase_rad": also["phase"]}}, {}


TWIN = Twin(
    name="unlisted-encoder-runout",
    fields={"sensors": {"angle_runout_rad": (float, 0.0), "angle_runout_phase_rad": (float, 0.0)}},
    places=("drive-sensor", "load-sensor"),
    size=(3e-3, 6e-2),
    unit="rad",
    seed=_seed,
    read=_read,
    law=_law,
)
