"""A kink: a bend of both conduits at a share of their length, sharp or spread over some centimetres."""

from collections.abc import Mapping

from virtualrig.effects.contract import OpenShare, Seeded, TrueLaw, Twin
from virtualrig.strict import NonNegative, Strict


class Kink(Strict):
    """Its angle, the place of its middle, and the length that it is spread over."""

    bend_rad: NonNegative
    place_share: OpenShare
    spread_m: NonNegative = 0.0


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"kinks": [{"bend_rad": size, "place_share": also["s"]}]}, {"beta": size, "s": also["s"]}


def _spread(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    settings, values = _seed(size, also, place, spring)
    settings["kinks"][0]["spread_m"] = also["spread_m"]
    return settings, values


TWIN = Twin(
    name="kink",
    fields={"rig": {"kinks": (tuple[Kink, ...], ())}},
    places=("conduit",),
    size=(0.1, 1.5),
    unit="rad",
    also={"s": (0.15, 0.85), "spread_m": (0.01, 0.06)},
    seed=_seed,
    other_laws={"spread": _spread},
    law=lambda rig, place: TrueLaw("sliding-friction", "position-along-conduit"),
)
