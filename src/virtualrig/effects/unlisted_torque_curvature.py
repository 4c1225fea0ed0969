"""A torque that reads (1 + curvature tau^2) times as much."""

from typing import Any

from numpy.typing import NDArray

from virtualrig.effects.contract import TORQUES_NM, Side, TrueLaw, Twin, added_by, along, group_of, sensor_map


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    factor = 1 + faults.torque_curvature_per_Nm2 * reading.torque_Nm**2
    return reading._replace(torque_Nm=factor * reading.torque_Nm)


def _law(rig: Any, place: str) -> TrueLaw:
    tau, faults = along(TORQUES_NM), getattr(rig.effects, group_of(place))
    return sensor_map(place, "reading", "torque", tau, added_by(_read, faults, "torque", "torque", tau))


TWIN = Twin(
    name="unlisted-torque-curvature",
    fields={"sensors": {"torque_curvature_per_Nm2": (float, 0.0)}},
    places=("drive-sensor", "load-sensor"),
    size=(2.0, 40.0),  # 1.3 to 26 % at 80 mN m
    unit="1/(N m)^2",
    signed=True,
    seed=lambda size, also, place, spring: ({group_of(place): {"torque_curvature_per_Nm2": size}}, {}),
    read=_read,
    law=_law,
)
