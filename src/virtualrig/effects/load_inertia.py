"""A moment of inertia that turns with the load pulley, on top of the rig's own."""

from typing import Any

from virtualrig.effects.contract import ACCELERATIONS_RAD_PER_S2, TrueLaw, Twin, along
from virtualrig.strict import NonNegative


def _law(rig: Any, place: str) -> TrueLaw:
    acceleration = along(ACCELERATIONS_RAD_PER_S2)
    return TrueLaw("load", "acceleration", acceleration, rig.effects.load.inertia_kg_m2 * acceleration)


TWIN = Twin(
    name="load-inertia",
    fields={"load": {"inertia_kg_m2": (NonNegative, 0.0)}},
    places=("load",),
    size=(5e-6, 5e-4),
    unit="kg m^2",
    seed=lambda size, also, place, spring: ({"load": {"inertia_kg_m2": size}}, {"J": size}),
    law=_law,
)
