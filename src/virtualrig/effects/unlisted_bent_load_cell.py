"""A load cell whose characteristic is bent: it reads curvature F^2 more."""

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from virtualrig.effects.contract import FORCES_N, Seeded, Side, TrueLaw, Twin, added_by, along, group_of, sensor_map


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    return reading._replace(force_N=reading.force_N + faults.force_curvature_per_N * reading.force_N**2)


def _seed(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {group_of(place): {"force_curvature_per_N": size}}, {}


def _law(rig: Any, place: str) -> TrueLaw:
    force, faults = along(FORCES_N), getattr(rig.effects, group_of(place))
    return sensor_map(place, "reading", "force", force, added_by(_read, faults, "force", "force", force))


TWIN = Twin(
    name="unlisted-bent-load-cell",
    fields={"sensors": {"force_curvature_per_N": (float, 0.0)}},
    places=("drive-sensor", "load-sensor"),
    size=(5e-4, 1e-2),
    unit="1/N",
    signed=True,
    seed=_seed,
    read=_read,
    law=_law,
)
