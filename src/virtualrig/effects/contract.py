"""The contract of a twin: an effect of the virtual rig, its law there and how the proof seeds it, in one file.

1. A file of this package holds one twin as ``TWIN``, or close relatives as ``TWINS``. The package finds it by listing
   the folder. It has the name of the mechanism that a diagnosis should find, or begins with "unlisted-".
2. ``fields`` declares the effect's fields of a rig's configuration: of the rig itself, of each pulley, of the load, or
   of the sensors of each side.
3. A law of friction is a compiled function, ``slow_friction`` or ``friction``. A fault of sensors is ``read``. What
   needs a state of its own stands in the time loop (`virtualrig.effect_march`); ``numbers`` gives it the values.
4. ``places`` to ``also`` are what the proof draws; ``seed`` turns a drawn size into the rig's settings and an answer.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

Range = tuple[float, float]
OpenShare = Annotated[float, Field(gt=0, lt=1)]
# Full stroke of the proof's motions, at which the load's stiffening is drawn.
FULL_STROKE_RAD = 0.6


class Side(NamedTuple):
    """What acts on the sensors of one side, or what they read; arrays of shape (samples,)."""

    angle_rad: NDArray
    torque_Nm: NDArray
    force_N: NDArray


Read = Callable[[Side, Side, Any, NDArray, float], Side]
# Settings of the rig's effects, and the answer.
Seeded = tuple[dict, dict[str, float]]
Seed = Callable[[float, Mapping[str, float], str, float], Seeded]


class TrueLaw(NamedTuple):
    """An effect as a law of one quantity at one slot of the rig, as the diagnosis format names these.

    Attributes
    ----------
    slot, argument : str
    x, y : ndarray, shape (n,)
        Arguments, and there a factor of friction, of a compliance or of a pulley's radius, or what is added to a
        torque or a reading. Up to what a calibration absorbs. Empty for a law that is none of a single quantity.
    channel : str
        Channel of a sensor map; empty at other slots.
    """

    slot: str
    argument: str
    x: NDArray = np.empty(0)
    y: NDArray = np.empty(0)
    channel: str = ""


# What the proof's recordings visit: tensions (N), times (s), the drive's travel (m), angles (rad), speeds of the cable
# (log10(m/s)) and of a pulley (rad/s), accelerations of a load that rings (rad/s^2), sums of tensions (N), torques
# (N m), ages of contacts (log10(s)).
TENSIONS_N, TIMES_S, TRAVELS_M, ANGLES_RAD = (0.5, 20.0), (0.0, 10.0), (0.0, 0.05), (-0.6, 0.6)
LOG_SPEEDS, SPEEDS_RAD_PER_S, FORCES_N, TORQUES_NM, LOG_AGES = (
    (-4.0, -1.2),
    (-2.5, 2.5),
    (4.0, 20.0),
    (-0.07, 0.07),
    (-2, 0.5),
)
ACCELERATIONS_RAD_PER_S2 = (-500.0, 500.0)
# Torques over the radius of a pulley, N.
PULLS_N = (-12.0, 12.0)
POINTS = 129
# Fields of a side that a sensor reads, by the argument of its map; and the channels of both sides.
SIDE = {"angle": "angle_rad", "torque": "torque_Nm", "force": "force_N"}
CHANNELS = {
    "drive": {"angle": "theta_in_rad", "torque": "tau_in_Nm", "force": "F_drive_N"},
    "load": {"angle": "theta_out_rad", "torque": "tau_out_Nm", "force": "F_load_N"},
}


def along(between: Range) -> NDArray:
    """Arguments of a table, shape (POINTS,)."""
    return np.linspace(*between, POINTS)


def slow_factor(value: Any, numbers: Mapping[str, Any], argument: str, x: NDArray) -> NDArray:
    """Factor of a law of slow friction over "tension", "time", "travel" or "position" alone, shape of `x`."""
    state = dict.fromkeys(("tension", "time", "travel", "position"), 0.0) | {"tension": 5.0}
    p = SimpleNamespace(**numbers)
    return np.array([value.py_func(p, 1.0, *(state | {argument: float(one)}).values()) for one in x])


def added_by(read: "Read", faults: Any, of: str, over: str, x: NDArray, radius_m: float = 1.0) -> NDArray:
    """What a fault adds to a side's "angle", "torque" or "force" where one of these, or the time, is `x`."""
    zero = np.zeros_like(x)
    side = Side(*(x if over == name else zero for name in SIDE))
    time_s = x if over == "time" else np.arange(x.size, dtype=float)
    return getattr(read(side, side, faults, time_s, radius_m), SIDE[of]) - getattr(side, SIDE[of])


def sensor_map(place: str, argument: str, of: str, x: NDArray, added: NDArray) -> TrueLaw:
    """What is added to the "angle", "torque" or "force" that the sensors at a place read, as a law."""
    return TrueLaw("sensor-map", argument, x, added, CHANNELS[place.split("-")[0]][of])


class Law(NamedTuple):
    """A law of friction.

    Attributes
    ----------
    value : compiled function
        The quantity with this law, from the same without it (`Twin`).
    bound : callable
        ``bound(numbers, tension_N)``: the largest factor that it is changed by, at tensions up to this, for the time
        step.
    """

    value: Callable
    bound: Callable[[Any, float], float]


@dataclass(frozen=True, kw_only=True)
class Twin:
    """An effect of the virtual rig.

    Attributes
    ----------
    name : str
        The mechanism's, or one that begins with "unlisted-" for an effect that a diagnosis does not know.
    fields : mapping of str to mapping of str to (type, default)
        Fields by group: "rig", "pulley", "load" or "sensors".
    places : tuple of str
        Where the proof seeds it.
    size : (float, float)
        Range of its size, from below the sensors' resolution to plain. Its logarithm is in proportion to the strength.
    unit : str
        Unit of the size.
    seed : callable
        ``seed(size, also, place, spring)`` returns what it sets in the rig's effects, nested as these, and its values
        under the names of the mechanism's parameters, as far as these mean the same in the rig. ``also`` holds the
        other drawn numbers and a phase (rad), ``spring`` is the load's stiffness (N m/rad). The law is the mechanism's.
    other_laws : mapping of str to callable
        Published laws of the effect that the mechanism does not have, by name; each like ``seed``. Values of parameters
        are those that both laws share.
    signed : bool
        Whether either sign is drawn.
    between_recordings : bool
        Whether it is a difference between recordings, so that one by itself has none of it.
    also : mapping of str to (float, float)
        Ranges of other numbers, drawn uniformly in the logarithm.
    numbers : callable
        ``numbers(effects)``: its values in the time loop, by name.
    slow_friction : Law or None
        ``value(p, y, tension, time, travel, position)``: half of mu times the bend angle of a node, which is
        evaluated again every `SLOW_S`; mean tension (N), time (s), and since the start the cable travel (m) of
        the drive to and fro, and its position (m). ``p`` holds every twin's numbers.
    friction : Law or None
        ``value(p, force, bristle, speed)``: friction of a node (N), its bristle (-1 to 1) and sliding speed (m/s).
    read : callable or None
        ``read(reading, truth, faults, time_s, radius_m)``: what one side's sensors read, from what they read without
        this fault and from the truth.
    law : callable or None
        ``law(rig, place)``: the effect as a law of one quantity (`TrueLaw`), for a rig that has it at a place.
    in_rig : callable or None
        ``in_rig(values, campaign)``: an answer's values with what else in a rig has the same law.
    """

    name: str
    fields: Mapping[str, Mapping[str, tuple[Any, Any]]]
    places: tuple[str, ...]
    size: Range
    unit: str
    seed: Seed
    other_laws: Mapping[str, Seed] = field(default_factory=dict)
    signed: bool = False
    between_recordings: bool = False
    also: Mapping[str, Range] = field(default_factory=dict)
    numbers: Callable[[Any], dict[str, Any]] = lambda effects: {}
    slow_friction: Law | None = None
    friction: Law | None = None
    read: Read | None = None
    in_rig: Callable[[dict[str, float], Any], dict[str, float]] | None = None
    law: Callable[[Any, str], TrueLaw] | None = None


def group_of(place: str) -> str:
    """Name in the rig's effects of the pulley or the sensors at a place."""
    return place.replace("-", "_") + ("s" if place.endswith("sensor") else "")
