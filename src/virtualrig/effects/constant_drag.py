"""Constant drag: friction of a whole cable that does not depend on its tension, along all of it or in one seal."""

from collections.abc import Mapping

from virtualrig.effects.contract import OpenShare, Seeded, TrueLaw, Twin
from virtualrig.strict import NonNegative


def _seal(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"drag_N": size, "drag_at_share": also["share"]}, {"f0": size}


TWIN = Twin(
    name="constant-drag",
    fields={"rig": {"drag_N": (NonNegative, 0.0), "drag_at_share": (OpenShare | None, None)}},
    places=("conduit",),
    size=(0.05, 3.0),
    unit="N",
    also={"share": (0.02, 0.98)},
    seed=lambda size, also, place, spring: ({"drag_N": size}, {"f0": size}),
    other_laws={"seal": _seal},
    law=lambda rig, place: TrueLaw("sliding-friction", "tension"),
)
