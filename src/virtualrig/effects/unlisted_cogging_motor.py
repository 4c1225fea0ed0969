"""A motor that pulls to the next of its poles: cogging_Nm sin(poles theta + phase) on top of its torque."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualrig.effects.contract import ANGLES_RAD, Seeded, Side, TrueLaw, Twin, added_by, along


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    cogging = faults.cogging_Nm * np.sin(faults.cogging_poles * truth.angle_rad + faults.cogging_phase_rad)
    return reading._replace(torque_Nm=reading.torque_Nm + cogging)


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {
        "drive_sensors": {"cogging_Nm": size, "cogging_poles": also["poles"], "cogging_phase_rad": also["phase"]}
    }, {}


def _law(rig: Any, place: str) -> TrueLaw:
    theta = along(ANGLES_RAD)
    torque = added_by(_read, rig.effects.drive_sensors, "torque", "angle", theta)
    return TrueLaw("bearing-torque", "drive-angle", theta, torque)


TWIN = Twin(
    name="unlisted-cogging-motor",
    fields={"sensors": {"cogging_Nm": (float, 0.0), "cogging_poles": (float, 0.0), "cogging_phase_rad": (float, 0.0)}},
    places=("drive-pulley",),
    size=(3e-4, 6e-3),
    unit="N m",
    also={"poles": (6.0, 24.0)},
    seed=_seed,
    read=_read,
    law=_law,
)
