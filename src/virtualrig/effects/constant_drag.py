"""Constant drag: friction of a whole cable that does not depend on its tension.

It acts along all of the conduit, in one seal, or in two, as in a tube that is sealed at both ends.
"""

from collections.abc import Mapping

from virtualrig.effects.contract import OpenShare, Seeded, TrueLaw, Twin
from virtualrig.strict import NonNegative, Share


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    # In half of the rigs it is the drag of a seal.
    if also["seal"] < 1.0:
        return {"drag_N": size}, {"f0": size, "local": 0.0}
    return {"drag_N": size, "drag_at_share": also["share"]}, {"f0": size, "local": 1.0, "s": also["share"]}


def _two_seals(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    seals = {"drag_at_share": also["near"], "drag_far_share": also["far"], "drag_far_part": also["far_part"]}
    return {"drag_N": size} | seals, {"f0": size}


TWIN = Twin(
    name="constant-drag",
    fields={
        "rig": {
            "drag_N": (NonNegative, 0.0),
            "drag_at_share": (OpenShare | None, None),
            "drag_far_share": (OpenShare, 0.5),
            "drag_far_part": (Share, 0.0),
        }
    },
    places=("conduit",),
    size=(0.05, 3.0),
    unit="N",
    also={
        "seal": (0.5, 2.0),
        "share": (0.02, 0.98),
        "near": (0.02, 0.3),
        "far": (0.7, 0.98),
        "far_part": (0.25, 0.75),
    },
    seed=_seed,
    other_laws={"two-seals": _two_seals},
    law=lambda rig, place: TrueLaw("sliding-friction", "tension"),
)
