"""A motor with a fan: its torque has windage omega |omega| on top."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualrig.effects.contract import SPEEDS_RAD_PER_S, Seeded, Side, TrueLaw, Twin, along


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    omega = np.gradient(truth.angle_rad, time_s)
    return reading._replace(torque_Nm=reading.torque_Nm + faults.windage_Nms2 * omega * np.abs(omega))


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"drive_sensors": {"windage_Nms2": size}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    omega = along(SPEEDS_RAD_PER_S)
    return TrueLaw("bearing-torque", "speed", omega, rig.effects.drive_sensors.windage_Nms2 * omega * np.abs(omega))


TWIN = Twin(
    name="unlisted-windage",
    fields={"sensors": {"windage_Nms2": (float, 0.0)}},
    places=("drive-pulley",),
    size=(2e-4, 4e-3),
    unit="N m s^2",
    seed=_seed,
    read=_read,
    law=_law,
)
