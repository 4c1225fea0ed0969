"""Constant drag: friction of a whole cable that does not depend on its tension."""

from virtualrig.effects.contract import Twin
from virtualrig.strict import NonNegative

TWIN = Twin(
    name="constant-drag",
    fields={"rig": {"drag_N": (NonNegative, 0.0)}},
    places=("conduit",),
    size=(0.05, 3.0),
    unit="N",
    seed=lambda size, also, place, spring: ({"drag_N": size}, {"f0": size}),
)
