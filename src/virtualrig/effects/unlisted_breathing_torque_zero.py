"""A torque sensor whose zero follows the room's temperature: swing sin(2 pi t / period + phase) more."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualrig.effects.contract import TIMES_S, Seeded, Side, TrueLaw, Twin, added_by, along, group_of, sensor_map


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    if not faults.zero_swing_Nm:
        return reading
    swing = faults.zero_swing_Nm * np.sin(2 * np.pi * time_s / faults.zero_period_s + faults.zero_phase_rad)
    return reading._replace(torque_Nm=reading.torque_Nm + swing)


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {
        group_of(place): {
            "zero_swing_Nm": size,
            "zero_period_s": also["period_s"],
            "zero_phase_rad": also["phase"],
        }
    }, {}


def _law(rig: Any, place: str) -> TrueLaw:
    t, faults = along(TIMES_S), getattr(rig.effects, group_of(place))
    return sensor_map(place, "time", "torque", t, added_by(_read, faults, "torque", "time", t))


TWIN = Twin(
    name="unlisted-breathing-torque-zero",
    fields={"sensors": {"zero_swing_Nm": (float, 0.0), "zero_period_s": (float, 1.0), "zero_phase_rad": (float, 0.0)}},
    places=("drive-sensor", "load-sensor"),
    size=(2e-4, 6e-3),
    unit="N m",
    also={"period_s": (4.0, 20.0)},
    seed=_seed,
    read=_read,
    law=_law,
)
