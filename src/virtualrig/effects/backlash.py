"""Backlash: a dead zone of `half_gap_rad` on either side between pulley and spring, with hard or with soft flanks."""

from collections.abc import Mapping

from virtualrig.effects.contract import Seeded, Twin
from virtualrig.strict import NonNegative


def _soft(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {"load": {"half_gap_rad": size, "soft_flank_rad": also["softness"] * size}}, {"half_gap": size}


TWIN = Twin(
    name="backlash",
    fields={"load": {"half_gap_rad": (NonNegative, 0.0), "soft_flank_rad": (NonNegative, 0.0)}},
    places=("load-pulley",),
    size=(1e-3, 7e-2),
    unit="rad",
    also={"softness": (0.1, 0.5)},
    seed=lambda size, also, place, spring: ({"load": {"half_gap_rad": size}}, {"half_gap": size}),
    other_laws={"soft": _soft},
    numbers=lambda effects: {"half_gap": effects.load.half_gap_rad, "soft_flank": effects.load.soft_flank_rad},
)
