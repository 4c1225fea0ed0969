"""A torque that reads (1 + torque_gain) times as much."""

from typing import Any

from numpy.typing import NDArray

from virtualrig.effects.contract import TORQUES_NM, Side, TrueLaw, Twin, added_by, along, group_of, sensor_map


def _read(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    return reading._replace(torque_Nm=(1 + faults.torque_gain) * reading.torque_Nm)


def _law(rig: Any, place: str) -> TrueLaw:
    tau, faults = along(TORQUES_NM), getattr(rig.effects, group_of(place))
    return sensor_map(place, "reading", "torque", tau, added_by(_read, faults, "torque", "torque", tau))


TWIN = Twin(
    name="torque-scale",
    fields={"sensors": {"torque_gain": (float, 0.0)}},
    places=("drive-sensor", "load-sensor"),
    size=(0.005, 0.1),
    unit="1",
    signed=True,
    seed=lambda size, also, place, spring: ({group_of(place): {"torque_gain": size}}, {"gain": size}),
    read=_read,
    law=_law,
)
