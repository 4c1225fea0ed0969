"""A kink: a sharp bend of both conduits at a share of their length."""

from collections.abc import Mapping

from virtualrig.effects.contract import OpenShare, Seeded, Twin
from virtualrig.strict import NonNegative, Strict


class Kink(Strict):
    """Its angle and place."""

    bend_rad: NonNegative
    place_share: OpenShare


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"kinks": [{"bend_rad": size, "place_share": also["s"]}]}, {"beta": size, "s": also["s"]}


TWIN = Twin(
    name="kink",
    fields={"rig": {"kinks": (tuple[Kink, ...], ())}},
    places=("conduit",),
    size=(0.1, 1.5),
    unit="rad",
    also={"s": (0.15, 0.85)},
    seed=_seed,
)
