"""A bearing: a torque against the motion of a pulley that builds up over a small angle.

The torque of a preloaded ball bearing is constant, that of a plain bearing is in proportion to the cables' pull.
"""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import PositiveFloat

from virtualrig.effects.contract import ANGLES_RAD, Seeded, TrueLaw, Twin, along, group_of
from virtualrig.strict import NonNegative, Strict


class PulleyFriction(Strict):
    """Its torque, at the cables' tensions at rest, and the angle over which it builds up."""

    law: Literal["constant", "proportional"] = "constant"
    torque_Nm: NonNegative
    presliding_rad: PositiveFloat = 1e-3


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.load_pulley.friction
    return {
        "bearing_torque": given.torque_Nm if given else 0.0,
        "bearing_angle": given.presliding_rad if given else 1.0,
        "bearing_is_proportional": given is not None and given.law == "proportional",
    }


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    friction = {"torque_Nm": size, "presliding_rad": also["presliding_rad"]}
    return {group_of(place): {"friction": friction}}, {"friction_torque": size}


def _proportional(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    settings, values = _seed(size, also, place, spring)
    settings[group_of(place)]["friction"]["law"] = "proportional"
    return settings, values


def _law(rig: Any, place: str) -> TrueLaw:
    """The torque that builds up from rest, by the travel of the pulley's rim; at the cables' tensions at rest."""
    given, angle = getattr(rig.effects, group_of(place)).friction, along((0.0, ANGLES_RAD[1]))
    torque = given.torque_Nm * -np.expm1(-angle / given.presliding_rad)
    return TrueLaw("bearing-torque", "distance-since-reversal", rig.pulley_radius_m * angle, torque)


TWIN = Twin(
    name="pulley-friction",
    fields={"pulley": {"friction": (PulleyFriction | None, None)}},
    places=("drive-pulley", "load-pulley"),
    size=(2e-4, 2e-2),
    unit="N m",
    also={"presliding_rad": (1e-3, 5e-3)},
    seed=_seed,
    other_laws={"proportional": _proportional},
    numbers=_numbers,
    law=_law,
)
