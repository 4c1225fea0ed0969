"""A bearing: a torque against the motion of a pulley that builds up over a small angle.

The torque of a preloaded ball bearing is constant, that of a plain bearing is in proportion to the cables' pull; the
`share` of the torque grows with it. The torque of a ball bearing under load grows faster: with the power 4/3, since its
coefficient rises with the cube root of the load (Palmgren, Ball and Roller Bearing Engineering, 3rd edition, 1959).
"""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numba import njit
from pydantic import PositiveFloat

from virtualrig.effects.contract import ANGLES_RAD, Seeded, TrueLaw, Twin, along, group_of
from virtualrig.strict import NonNegative, Share, Strict


class PulleyFriction(Strict):
    """Its torque at a pull of both cables, the share that grows with it, and the angle over which it builds up."""

    law: Literal["linear", "palmgren"] = "linear"
    torque_Nm: NonNegative
    share: Share = 0.0
    at_pull_N: PositiveFloat = 20.0
    presliding_rad: PositiveFloat = 1e-3

    @property
    def power(self) -> float:
        """Power of the pull with which the share grows."""
        return 4 / 3 if self.law == "palmgren" else 1.0


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.load_pulley.friction
    return {
        "bearing_torque": given.torque_Nm if given else 0.0,
        "bearing_angle": given.presliding_rad if given else 1.0,
        "bearing_share": given.share if given else 0.0,
        "bearing_pull": given.at_pull_N if given else 1.0,
        "bearing_power": given.power if given else 1.0,
    }


@njit
def under_pull(pull_N: Any, share: float, at_pull_N: float, power: float) -> Any:
    """Factor of the torque under the pull of both cables."""
    return 1.0 - share + share * (np.maximum(pull_N, 0.0) / at_pull_N) ** power


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    share = also["share"]
    # The mechanism states the torque at a pull of 10 N.
    constant, grows = 1.0 - share, share * 10.0 / also["at_pull_N"]
    values = {"friction_torque": size * (constant + grows), "share": grows / (constant + grows)}
    friction = {"torque_Nm": size} | {name: also[name] for name in ("share", "at_pull_N", "presliding_rad")}
    return {group_of(place): {"friction": friction}}, values


def _palmgren(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    settings, _ = _seed(size, also, place, spring)
    settings[group_of(place)]["friction"]["law"] = "palmgren"
    return settings, {}


def _law(rig: Any, place: str) -> TrueLaw:
    """The torque that builds up from rest, by the travel of the pulley's rim; at the pull at which it is stated."""
    given, angle = getattr(rig.effects, group_of(place)).friction, along((0.0, ANGLES_RAD[1]))
    torque = given.torque_Nm * -np.expm1(-angle / given.presliding_rad)
    return TrueLaw("bearing-torque", "distance-since-reversal", rig.pulley_radius_m * angle, torque)


TWIN = Twin(
    name="pulley-friction",
    fields={"pulley": {"friction": (PulleyFriction | None, None)}},
    places=("drive-pulley", "load-pulley"),
    size=(2e-4, 2e-2),
    unit="N m",
    also={"presliding_rad": (1e-3, 5e-3), "share": (0.05, 1.0), "at_pull_N": (10.0, 40.0)},
    seed=_seed,
    other_laws={"palmgren": _palmgren},
    numbers=_numbers,
    law=_law,
)
