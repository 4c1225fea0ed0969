"""Load-dependent friction: the friction coefficient times (T / reference)^exponent, constant below `floor_N`."""

from typing import Annotated, Any

from numba import njit
from pydantic import Field, PositiveFloat

from virtualrig.effects.contract import Law, Twin
from virtualrig.strict import Strict


class LoadDependentFriction(Strict):
    """Its numbers."""

    exponent: Annotated[float, Field(gt=-1, lt=1)]
    reference_N: PositiveFloat = 5.0
    floor_N: PositiveFloat = 0.1


def _numbers(effects: Any) -> dict[str, Any]:
    given = effects.load_dependent_friction
    return {
        "tension_exponent": given.exponent if given else 0.0,
        "tension_reference": given.reference_N if given else 1.0,
        "tension_floor": given.floor_N if given else 0.0,
    }


@njit
def _value(p: Any, y: float, tension: float, time: float, travel: float, position: float) -> float:
    if p.tension_exponent == 0.0:
        return y
    return y * (max(tension, p.tension_floor) / p.tension_reference) ** p.tension_exponent


TWIN = Twin(
    name="load-dependent-friction",
    fields={"rig": {"load_dependent_friction": (LoadDependentFriction | None, None)}},
    places=("conduit",),
    size=(0.02, 0.35),
    unit="1",
    seed=lambda size, also, place, spring: ({"load_dependent_friction": {"exponent": -size}}, {"n": -size}),
    numbers=_numbers,
    slow_friction=Law(_value, lambda p, tension_N: (tension_N / p.tension_reference) ** p.tension_exponent),
)
