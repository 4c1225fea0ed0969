"""Cables that are worn unevenly along their length: friction 1 + rise sin(2 pi x / period + phase).

x is the travel of the drive: both cables have their worn parts in the conduits' bends at the same drive angles.
"""

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from numba import njit
from pydantic import Field, PositiveFloat

from virtualrig.effects.contract import ANGLES_RAD, Law, Seeded, TrueLaw, Twin, along, slow_factor
from virtualrig.strict import Strict


class PositionalFriction(Strict):
    """Its numbers."""

    rise: Annotated[float, Field(ge=0, lt=1)]
    period_m: PositiveFloat
    phase_rad: float = 0.0


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.positional_friction
    return {
        "wear_rise": given.rise if given else 0.0,
        "wear_period": given.period_m if given else 1.0,
        "wear_phase": given.phase_rad if given else 0.0,
    }


@njit
def _value(p: Any, y: float, tension: float, time: float, travel: float, position: float) -> float:
    return y * (1.0 + p.wear_rise * np.sin(2 * np.pi * position / p.wear_period + p.wear_phase))


def _law(rig: Any, place: str) -> TrueLaw:
    theta = along(ANGLES_RAD)
    factor = slow_factor(_value, _numbers(rig.effects), "position", rig.pulley_radius_m * theta)
    return TrueLaw("sliding-friction", "drive-angle", theta, factor)


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    wear = {"rise": size, "period_m": also["period_m"], "phase_rad": also["phase"]}
    return {"positional_friction": wear}, {}


TWIN = Twin(
    name="unlisted-positional-friction",
    fields={"rig": {"positional_friction": (PositionalFriction | None, None)}},
    places=("conduit",),
    size=(0.03, 0.6),
    unit="1",
    also={"period_m": (2e-3, 1e-2)},
    seed=_seed,
    numbers=_numbers,
    law=_law,
    slow_friction=Law(_value, lambda p, tension_N: 1 + p.wear_rise),
)
