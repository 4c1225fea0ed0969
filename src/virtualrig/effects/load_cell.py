"""Faults of a load cell, which reads (1 + gain) F + offset + drift t + crosstalk tau / R.

As a cell warms up, its drift falls off exponentially.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

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


def _warming(size: float, also: Mapping[str, float], place: str, spring: float) -> Seeded:
    return {group_of(place): {"load_cell_drift_N_per_s": size, "load_cell_warm_up_s": also["warm_up_s"]}}, {}


TWINS = (
    replace(_twin("load-cell-scale", "load_cell_gain", "gain", (0.005, 0.1), "1", _scale), law=_map(_scale, "reading")),
    _twin("load-cell-offset", "load_cell_offset_N", "offset", (0.1, 3.0), "N", _offset),
    replace(
        _twin("load-cell-drift", "load_cell_drift_N_per_s", "rate", (0.005, 0.2), "N/s", _drift),
        fields={"sensors": {"load_cell_drift_N_per_s": (float, 0.0), "load_cell_warm_up_s": (NonNegative, 0.0)}},
        also={"warm_up_s": (2.0, 8.0)},
        other_laws={"warm-up": _warming},
        law=_map(_drift, "time"),
    ),
    replace(
        _twin("load-cell-crosstalk", "load_cell_crosstalk", "crosstalk", (0.005, 0.1), "1", _crosstalk),
        law=_map(_crosstalk, "torque"),
    ),
)
