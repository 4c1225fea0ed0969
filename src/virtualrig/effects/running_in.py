"""Running-in: the friction coefficient times 1 + change (1 - exp(-x / scale)), x the time or the drive's travel.

A recording starts at an age that its past has left (`Preparation.ran_in_before`).
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from numba import njit
from pydantic import Field, PositiveFloat

from virtualrig.effects.contract import Law, Seeded, Twin
from virtualrig.strict import Strict


class RunningIn(Strict):
    """Its numbers."""

    change: Annotated[float, Field(gt=-1)]
    over: Literal["time_s", "travel_m"] = "time_s"
    scale: PositiveFloat


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.running_in
    return {
        "run_in_change": given.change if given else 0.0,
        "run_in_scale": given.scale if given else 1.0,
        "run_in_before": 0.0,
        "run_in_by_travel": given is not None and given.over == "travel_m",
    }


@njit
def _value(p: Any, y: float, tension: float, time: float, travel: float, position: float) -> float:
    if p.run_in_change == 0.0:
        return y
    age = p.run_in_before + (travel if p.run_in_by_travel else time)
    return y * (1.0 + p.run_in_change * -np.expm1(-age / p.run_in_scale))


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    # Running in over travel is a form of the rig's own; it is drawn where the time constant comes out short.
    if also["tau"] < 10:
        return {"running_in": {"change": size, "over": "travel_m", "scale": also["travel_m"]}}, {"change": size}
    return {"running_in": {"change": size, "scale": also["tau"]}}, {"change": size, "tau": also["tau"]}


TWIN = Twin(
    name="running-in",
    fields={"rig": {"running_in": (RunningIn | None, None)}},
    places=("conduit",),
    size=(0.02, 0.3),
    unit="1",
    signed=True,
    also={"tau": (3.0, 40.0), "travel_m": (0.01, 0.1)},  # a recording lasts 8 s and travels 5 cm
    seed=_seed,
    numbers=_numbers,
    slow_friction=Law(_value, lambda p, tension_N: max(1.0, 1 + p.run_in_change)),
)
