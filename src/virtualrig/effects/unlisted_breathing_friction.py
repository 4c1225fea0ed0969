"""Friction that follows the room's temperature: a factor of 1 + swing sin(2 pi t / period + phase)."""

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from numba import njit
from pydantic import Field, PositiveFloat

from virtualrig.effects.contract import TIMES_S, Law, Seeded, TrueLaw, Twin, along, slow_factor
from virtualrig.strict import Strict


class BreathingFriction(Strict):
    """Its numbers."""

    swing: Annotated[float, Field(ge=0, lt=1)]
    period_s: PositiveFloat
    phase_rad: float = 0.0


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.breathing_friction
    return {
        "breath_swing": given.swing if given else 0.0,
        "breath_period": given.period_s if given else 1.0,
        "breath_phase": given.phase_rad if given else 0.0,
    }


@njit
def _value(p: Any, y: float, tension: float, time: float, travel: float, position: float) -> float:
    return y * (1.0 + p.breath_swing * np.sin(2 * np.pi * time / p.breath_period + p.breath_phase))


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"breathing_friction": {"swing": size, "period_s": also["period_s"], "phase_rad": also["phase"]}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    t = along(TIMES_S)
    return TrueLaw("sliding-friction", "time", t, slow_factor(_value, _numbers(rig.effects), "time", t))


TWIN = Twin(
    name="unlisted-breathing-friction",
    fields={"rig": {"breathing_friction": (BreathingFriction | None, None)}},
    places=("conduit",),
    size=(0.02, 0.3),
    unit="1",
    also={"period_s": (4.0, 20.0)},
    seed=_seed,
    numbers=_numbers,
    slow_friction=Law(_value, lambda p, tension_N: 1 + p.breath_swing),
    law=_law,
)
