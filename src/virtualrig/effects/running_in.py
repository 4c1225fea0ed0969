"""Running-in: the friction coefficient times 1 + change g(x / scale), x the time or the drive's travel.

g(a) is 1 - exp(-a), or a / (1 + a), which goes on for decades (a wear rate that falls with the wear done, Blau 2005).

A recording starts at an age that its past has left (`Preparation.ran_in_before`).
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from numba import njit
from pydantic import Field, PositiveFloat

from virtualrig.effects.contract import TIMES_S, TRAVELS_M, Law, Seeded, TrueLaw, Twin, along, slow_factor
from virtualrig.strict import Strict


class RunningIn(Strict):
    """Its numbers."""

    change: Annotated[float, Field(gt=-1)]
    law: Literal["exponential", "hyperbolic"] = "exponential"
    over: Literal["time_s", "travel_m"] = "time_s"
    scale: PositiveFloat


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.running_in
    return {
        "run_in_change": given.change if given else 0.0,
        "run_in_scale": given.scale if given else 1.0,
        "run_in_before": 0.0,
        "run_in_is_hyperbolic": given is not None and given.law == "hyperbolic",
        "run_in_by_travel": given is not None and given.over == "travel_m",
    }


@njit
def _value(p: Any, y: float, tension: float, time: float, travel: float, position: float) -> float:
    if p.run_in_change == 0.0:
        return y
    age = p.run_in_before + (travel if p.run_in_by_travel else time)
    a = age / p.run_in_scale
    return y * (1.0 + p.run_in_change * (a / (1.0 + a) if p.run_in_is_hyperbolic else -np.expm1(-a)))


def _true_law(rig: Any, place: str) -> TrueLaw:
    """The law of a fresh contact."""
    by_travel = rig.effects.running_in.over == "travel_m"
    argument, x = ("travel", along(TRAVELS_M)) if by_travel else ("time", along(TIMES_S))
    return TrueLaw("sliding-friction", argument, x, slow_factor(_value, _numbers(rig.effects), argument, x))


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    # By wear where the time constant comes out short.
    if also["tau"] < 10:
        return {"running_in": {"change": size, "over": "travel_m", "scale": also["travel_m"]}}, {"change": size}
    return {"running_in": {"change": size, "scale": also["tau"]}}, {"change": size, "tau": also["tau"]}


def _hyperbolic(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    settings, _ = _seed(size, also, place, spring)
    settings["running_in"]["law"] = "hyperbolic"
    return settings, {}


TWIN = Twin(
    name="running-in",
    fields={"rig": {"running_in": (RunningIn | None, None)}},
    places=("conduit",),
    size=(0.02, 0.3),
    unit="1",
    signed=True,
    also={"tau": (3.0, 40.0), "travel_m": (0.01, 0.1)},  # a recording lasts 8 s and travels 5 cm
    seed=_seed,
    other_laws={"hyperbolic": _hyperbolic},
    numbers=_numbers,
    law=_true_law,
    slow_friction=Law(_value, lambda p, tension_N: max(1.0, 1 + p.run_in_change)),
)
