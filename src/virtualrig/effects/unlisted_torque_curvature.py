"""A torque that reads (1 + curvature tau^2) times as much."""

from virtualrig.effects.contract import Twin, group_of


def _read(reading, truth, faults, time_s, radius_m):
    factor = 1 + faults.torque_curvature_per_Nm2 * reading.torque_Nm**2
    return reading._replace(torque_Nm=factor * reading.torque_Nm)


TWIN = Twin(
    name="unlisted-torque-curvature",
    fields={"sensors": {"torque_curvature_per_Nm2": (float, 0.0)}},
    places=("drive-sensor", "load-sensor"),
    size=(2.0, 40.0),  # 1.3 to 26 % at 80 mN m
    unit="1/(N m)^2",
    signed=True,
    seed=lambda size, also, place, spring: ({group_of(place): {"torque_curvature_per_Nm2": size}}, {}),
    read=_read,
)
