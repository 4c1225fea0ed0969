"""A load spring that stiffens with the cube of its angle beyond the gap."""

from collections.abc import Mapping

from virtualrig.effects.contract import FULL_STROKE_RAD, Seeded, Twin
from virtualrig.strict import NonNegative


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    cubic = size * spring / FULL_STROKE_RAD**2
    return {"load": {"cubic_Nm_per_rad3": cubic}}, {"K3": cubic}


TWIN = Twin(
    name="load-stiffening",
    fields={"load": {"cubic_Nm_per_rad3": (NonNegative, 0.0)}},
    places=("load",),
    size=(0.01, 1.0),  # cubic over linear torque at 0.6 rad
    unit="1",
    seed=_seed,
    numbers=lambda effects: {"cubic": effects.load.cubic_Nm_per_rad3},
)
