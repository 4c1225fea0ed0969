"""A load with detents, such as a rotary switch: its torque is that of a spring and of detents.

Detents add detent (sin(number theta + phase) - sin(phase)): nothing at the spring's neutral angle.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from virtualrig.effects.contract import ANGLES_RAD, Seeded, TrueLaw, Twin, along
from virtualrig.strict import NonNegative


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    # A detent that is steeper than the spring would hold the load.
    torque = size * spring / also["number"]
    return {"load": {"detent_Nm": torque, "detent_number": also["number"], "detent_phase_rad": also["phase"]}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    load, theta = rig.effects.load, along(ANGLES_RAD)
    phase = load.detent_phase_rad
    torque = load.detent_Nm * (np.sin(load.detent_number * theta + phase) - np.sin(phase))
    return TrueLaw("load", "load-angle", theta, torque)


TWIN = Twin(
    name="unlisted-detent-load",
    fields={
        "load": {
            "detent_Nm": (NonNegative, 0.0),
            "detent_number": (NonNegative, 0.0),
            "detent_phase_rad": (float, 0.0),
        }
    },
    places=("load",),
    size=(0.05, 0.8),  # its slope over the spring's
    unit="1",
    also={"number": (5.0, 16.0)},
    seed=_seed,
    numbers=lambda effects: {
        "detent": effects.load.detent_Nm,
        "detent_number": effects.load.detent_number,
        "detent_phase": effects.load.detent_phase_rad,
    },
    law=_law,
)
