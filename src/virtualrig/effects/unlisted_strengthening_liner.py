"""A polymer liner on which friction grows with the logarithm of the speed: 1 + rise log10(1 + |v| / speed)."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
from numba import njit
from pydantic import PositiveFloat

from virtualrig.effects.contract import LOG_SPEEDS, Law, Seeded, TrueLaw, Twin, along
from virtualrig.strict import NonNegative, Strict

# No cable is faster.
FASTEST_M_PER_S = 10.0


class StrengtheningLiner(Strict):
    """Its rise a decade of speed, and the speed at which it begins."""

    rise: NonNegative
    speed_m_per_s: PositiveFloat


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.strengthening_liner
    return {
        "strengthening_rise": given.rise if given else 0.0,
        "strengthening_speed": given.speed_m_per_s if given else 1.0,
    }


@njit
def _value(p: Any, force: float, bristle: float, speed: float) -> float:
    if p.strengthening_rise == 0.0:
        return force
    return force * (1.0 + p.strengthening_rise * np.log10(1.0 + abs(speed) / p.strengthening_speed))


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"strengthening_liner": {"rise": size, "speed_m_per_s": also["speed_m_per_s"]}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    log_speed, p = along(LOG_SPEEDS), SimpleNamespace(**_numbers(rig.effects))
    factor = np.array([_value.py_func(p, 1.0, 1.0, 10.0**one) for one in log_speed])
    return TrueLaw("sliding-friction", "speed", log_speed, factor)


TWIN = Twin(
    name="unlisted-strengthening-liner",
    fields={"rig": {"strengthening_liner": (StrengtheningLiner | None, None)}},
    places=("conduit",),
    size=(0.01, 0.3),  # a decade of speed
    unit="1",
    also={"speed_m_per_s": (2e-4, 2e-3)},
    seed=_seed,
    numbers=_numbers,
    friction=Law(_value, lambda p, tension_N: _value.py_func(p, 1.0, 1.0, FASTEST_M_PER_S)),
    law=_law,
)
