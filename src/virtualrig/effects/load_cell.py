"""Faults of a load cell, which reads (1 + gain) F + offset + drift t + crosstalk tau / R.

As a cell warms up, its drift falls off exponentially. While heat flows evenly into a thick body, its surface warms up
with the root of the time (Carslaw and Jaeger, Conduction of Heat in Solids, 2nd edition, 1959, Section 2.9).
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from virtualrig.effects.contract import (
    FORCES_N,
    PULLS_N,
    TIMES_S,
    Range,
    Read,
    Seeded,
    Side,
    TrueLaw,
    Twin,
    added_by,
    along,
    group_of,
    sensor_map,
)
from virtualrig.strict import NonNegative


def _scale(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    return reading._replace(force_N=(1 + faults.load_cell_gain) * reading.force_N)


def _offset(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    return reading._replace(force_N=reading.force_N + faults.load_cell_offset_N)


def _drift(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    since, warm_up_s = time_s - time_s[0], faults.load_cell_warm_up_s
    if faults.load_cell_warms_up == "by-root":
        grown = np.sqrt(warm_up_s * since)
    else:
        grown = warm_up_s * -np.expm1(-since / warm_up_s) if warm_up_s else since
    return reading._replace(force_N=reading.force_N + faults.load_cell_drift_N_per_s * grown)


def _crosstalk(reading: Side, truth: Side, faults: Any, time_s: NDArray, radius_m: float) -> Side:
    return reading._replace(force_N=reading.force_N + faults.load_cell_crosstalk * truth.torque_Nm / radius_m)


def _map(read: Read, argument: str) -> Callable[[Any, str], TrueLaw]:
    # With a radius of 1 a torque is also its pull.
    table = {"reading": ("force", FORCES_N), "time": ("time", TIMES_S), "torque": ("torque", PULLS_N)}
    over, between = table[argument]

    def law(rig: Any, place: str) -> TrueLaw:
        x, faults = along(between), getattr(rig.effects, group_of(place))
        return sensor_map(place, argument, "force", x, added_by(read, faults, "force", over, x))

    return law


def _twin(name: str, field: str, parameter: str, size: Range, unit: str, read: Read) -> Twin:
    return Twin(
        name=name,
        fields={"sensors": {field: (float, 0.0)}},
        places=("drive-sensor", "load-sensor"),
        size=size,
        unit=unit,
        signed=True,
        seed=lambda size, also, place, spring: ({group_of(place): {field: size}}, {parameter: size}),
        read=read,
    )


def _drifting(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    # In half of the rigs the drift falls off during a recording, which lasts 8 s; in the others it does not.
    warm_up_s = also["warm_up_s"] if also["warm_up_s"] < 8 else 0.0
    settings = {"load_cell_drift_N_per_s": size, "load_cell_warm_up_s": warm_up_s}
    return {group_of(place): settings}, {"rate": size, "slowing": 1 / warm_up_s if warm_up_s else 0.0}


def _by_root(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    law = {"load_cell_warm_up_s": also["warm_up_s"], "load_cell_warms_up": "by-root"}
    return {group_of(place): {"load_cell_drift_N_per_s": size} | law}, {}


TWINS = (
    replace(_twin("load-cell-scale", "load_cell_gain", "gain", (0.005, 0.1), "1", _scale), law=_map(_scale, "reading")),
    _twin("load-cell-offset", "load_cell_offset_N", "offset", (0.1, 3.0), "N", _offset),
    replace(
        _twin("load-cell-drift", "load_cell_drift_N_per_s", "rate", (0.005, 0.2), "N/s", _drift),
        fields={
            "sensors": {
                "load_cell_drift_N_per_s": (float, 0.0),
                "load_cell_warm_up_s": (NonNegative, 0.0),
                "load_cell_warms_up": (Literal["exponentially", "by-root"], "exponentially"),
            }
        },
        also={"warm_up_s": (2.0, 32.0)},
        seed=_drifting,
        other_laws={"by-root": _by_root},
        law=_map(_drift, "time"),
    ),
    replace(
        _twin("load-cell-crosstalk", "load_cell_crosstalk", "crosstalk", (0.005, 0.1), "1", _crosstalk),
        law=_map(_crosstalk, "torque"),
    ),
)
