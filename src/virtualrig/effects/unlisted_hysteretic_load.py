"""A load spring with inner friction, such as rubber, which the load's own torque shows, unlike a bearing's."""

from typing import Any

import numpy as np
from pydantic import PositiveFloat

from virtualrig.effects.contract import ANGLES_RAD, TrueLaw, Twin, along
from virtualrig.strict import NonNegative, Strict


class HystereticLoad(Strict):
    """Up to `torque_Nm` on top of the spring's torque, built up over `angle_rad`."""

    torque_Nm: NonNegative
    angle_rad: PositiveFloat


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.hysteretic_load
    return {
        "hysteresis_torque": given.torque_Nm if given else 0.0,
        "hysteresis_angle": given.angle_rad if given else 1.0,
    }


def _law(rig: Any, place: str) -> TrueLaw:
    """The torque that builds up from rest, by the travel of the pulley's rim."""
    given, angle = rig.effects.hysteretic_load, along((0.0, ANGLES_RAD[1]))
    torque = given.torque_Nm * -np.expm1(-angle / given.angle_rad)
    return TrueLaw("load", "distance-since-reversal", rig.pulley_radius_m * angle, torque)


TWIN = Twin(
    name="unlisted-hysteretic-load",
    fields={"rig": {"hysteretic_load": (HystereticLoad | None, None)}},
    places=("load",),
    size=(5e-4, 1e-2),
    unit="N m",
    also={"angle_rad": (0.05, 0.3)},
    seed=lambda size, also, place, spring: (
        {"hysteretic_load": {"torque_Nm": size, "angle_rad": also["angle_rad"]}},
        {},
    ),
    numbers=_numbers,
    law=_law,
)
