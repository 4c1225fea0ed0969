"""A moment of inertia that turns with the load pulley, on top of the rig's own."""

from virtualrig.effects.contract import Twin
from virtualrig.strict import NonNegative

TWIN = Twin(
    name="load-inertia",
    fields={"load": {"inertia_kg_m2": (NonNegative, 0.0)}},
    places=("load",),
    size=(5e-6, 5e-4),
    unit="kg m^2",
    seed=lambda size, also, place, spring: ({"load": {"inertia_kg_m2": size}}, {"J": size}),
)
