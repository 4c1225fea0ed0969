"""A load cell that the pulley's shaft pushes aside: it reads push sin(lobes theta + phase) more."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualrig.effects.contract import ANGLES_RAD, Seeded, Side, TrueLaw, Twin, added_by, along, group_of, sensor_map


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    push = faults.side_force_N * np.sin(faults.side_force_lobes * truth.angle_rad + faults.side_force_phase_rad)
    return reading._replace(force_N=reading.force_N + push)


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {
        group_of(place): {
            "side_force_N": size,
            "side_force_lobes": also["lobes"],
            "side_force_phase_rad": also["phase"],
        }
    }, {}


def _law(rig: Any, place: str) -> TrueLaw:
    theta, faults = along(ANGLES_RAD), getattr(rig.effects, group_of(place))
    push = added_by(_read, faults, "force", "angle", theta)
    return sensor_map(place, f"{place.split('-')[0]}-angle", "force", theta, push)


TWIN = Twin(
    name="unlisted-side-force",
    fields={
        "sensors": {
            "side_force_N": (float, 0.0),
            "side_force_lobes": (float, 0.0),
            "side_force_phase_rad": (float, 0.0),
        }
    },
    places=("drive-sensor", "load-sensor"),
    size=(0.05, 1.0),
    unit="N",
    also={"lobes": (2.0, 8.0)},
    seed=_seed,
    read=_read,
    law=_law,
)
