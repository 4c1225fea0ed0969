"""Backlash: a dead zone of `half_gap_rad` on either side between pulley and spring."""

from virtualrig.effects.contract import Twin
from virtualrig.strict import NonNegative

TWIN = Twin(
    name="backlash",
    fields={"load": {"half_gap_rad": (NonNegative, 0.0)}},
    places=("load-pulley",),
    size=(1e-3, 7e-2),
    unit="rad",
    seed=lambda size, also, place, spring: ({"load": {"half_gap_rad": size}}, {"half_gap": size}),
    numbers=lambda effects: {"half_gap": effects.load.half_gap_rad},
)
