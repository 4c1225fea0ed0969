"""A load spring that stiffens beyond the gap: with the cube of its angle, exponentially like tissue, or at a bumper."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import brentq

from virtualrig.effects.contract import ANGLES_RAD, FULL_STROKE_RAD, Seeded, TrueLaw, Twin, along
from virtualrig.strict import NonNegative


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    cubic = size * spring / FULL_STROKE_RAD**2
    return {"load": {"cubic_Nm_per_rad3": cubic}}, {"K3": cubic}


def _exponential(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    """The torque is spring sinh(rate angle) / rate, (1 + size) times the spring's at full stroke."""
    x = brentq(lambda x: np.sinh(x) / x - (1 + size), 1e-6, 20.0)
    return {"load": {"exponential_per_rad": x / FULL_STROKE_RAD}}, {}


def _bumper(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    """A further spring beyond an angle, with the same torque at full stroke."""
    begins = also["begins_share"] * FULL_STROKE_RAD
    stiffness = size * spring / (1 - also["begins_share"])
    return {"load": {"bumper_Nm_per_rad": stiffness, "bumper_at_rad": begins}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    load, spring, theta = rig.effects.load, rig.load.spring_stiffness_Nm_per_rad, along(ANGLES_RAD)
    torque = load.cubic_Nm_per_rad3 * theta**3
    if load.exponential_per_rad:
        torque = spring * (np.sinh(load.exponential_per_rad * theta) / load.exponential_per_rad - theta)
    if load.bumper_Nm_per_rad:
        torque = load.bumper_Nm_per_rad * (theta - np.clip(theta, -load.bumper_at_rad, load.bumper_at_rad))
    return TrueLaw("load", "load-angle", theta, torque)


TWIN = Twin(
    name="load-stiffening",
    fields={
        "load": {
            "cubic_Nm_per_rad3": (NonNegative, 0.0),
            "exponential_per_rad": (NonNegative, 0.0),
            "bumper_Nm_per_rad": (NonNegative, 0.0),
            "bumper_at_rad": (NonNegative, 0.0),
        }
    },
    places=("load",),
    size=(0.01, 1.0),  # further over linear torque at 0.6 rad
    unit="1",
    also={"begins_share": (0.3, 0.7)},
    seed=_seed,
    law=_law,
    other_laws={"exponential": _exponential, "bumper": _bumper},
    numbers=lambda effects: {
        "cubic": effects.load.cubic_Nm_per_rad3,
        "exponential": effects.load.exponential_per_rad,
        "bumper": effects.load.bumper_Nm_per_rad,
        "bumper_at": effects.load.bumper_at_rad,
    },
)
