"""ROS 1 and ROS 2 bags: the numbers of every message, topic by topic.

The first message of a topic shows where its numbers are. Every further message is read at the same places.
"""

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import ros_size, signatures
from ccmodel.rig.readers.columns import BYTES_OF_A_NUMBER
from ccmodel.rig.readers.content import Unpacked
from ccmodel.rig.readers.contract import Format, Signal, SignalFile

# Elements of an array that may be signals; a longer one is a picture, a cloud or a scan.
MOST_ELEMENTS = 64
# Fields that name the elements of the arrays beside them.
_NAME_FIELDS = ("name", "names", "joint_names", "interface_names")
# Units of the fields of a message type, where its definition leaves no choice. A joint state may be of an angle or of a
# displacement, and states none.
_UNITS = {("geometry_msgs/msg/Wrench", "force"): "N", ("geometry_msgs/msg/Wrench", "torque"): "N*m"}
_NS = 1_000_000_000
# Stamps of a message differ less than this from the time of its arrival, unless they are of a simulation's clock.
_SAME_CLOCK_NS = 24 * 3600 * _NS


class _Place(NamedTuple):
    """Where numbers are in a message: steps to them, the names of their elements (() for a number), and their unit."""

    steps: tuple[str | int, ...]
    name: str
    elements: tuple[str, ...]
    unit: str = ""


@dataclass
class _Series:
    """Messages of a topic that have their numbers at the same places: arrays of plain numbers, a message after another.

    Attributes
    ----------
    places : list of _Place
    values : list of array of float
        By place.
    misfits : list of int
        By place, messages that have another number of elements there.
    received, stamps : array of int
        Times, ns.
    """

    places: list[_Place]
    values: "list[array[float]]" = field(init=False)
    misfits: list[int] = field(init=False)
    received: "array[int]" = field(default_factory=lambda: array("q"))
    stamps: "array[int]" = field(default_factory=lambda: array("q"))

    def __post_init__(self) -> None:
        self.values = [array("d") for _ in self.places]
        self.misfits = [0] * len(self.places)

    @property
    def numbers(self) -> int:
        """Numbers that are kept of a message."""
        return 2 + sum(max(len(place.elements), 1) for place in self.places)

    def add(self, message: Any, received: int) -> None:
        """Keep the numbers of a message."""
        for i, place in enumerate(self.places):
            found = _number_at(message, place.steps)
            if not place.elements:
                self.values[i].append(np.nan if found is None else float(found))
            elif found is not None and len(found) == len(place.elements):
                self.values[i].extend(np.asarray(found, float).tolist())
            else:
                self.values[i].extend([np.nan] * len(place.elements))
                self.misfits[i] += 1
        self.received.append(received)
        self.stamps.append(_stamp(message))


def read(path: Path) -> SignalFile:
    """Read a ROS 1 bag, or a ROS 2 bag: its folder, or its .mcap or .db3 file.

    Fields are named by their path from the topic, elements of an array by the names beside it in the message
    (`joint_states/position/joint1`) or else by their index. The force and torque of a wrench have a unit. Time is the
    stamp of the header, or else the time at which the bag received the message.
    """
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    kind = signatures.kind_of(path)
    if path.is_file() and path.suffix != kind.advice:
        raise LogError(
            None, None, f"is {kind.text}, which is read only under its own ending: rename it to {kind.advice}"
        )
    ros_size.count(path)
    topics: dict[str, dict[tuple[str, ...], _Series]] = {}
    unknown: set[str] = set()
    unpacked = Unpacked()
    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as bag:
        _count_packed_messages(bag)
        known = {c.id: c.msgtype in bag.typestore.fielddefs for c in bag.connections}
        for connection, received, raw in bag.messages():
            if not known[connection.id]:
                unknown.add(connection.topic)
                continue
            series = _series(
                topics.setdefault(connection.topic, {}), message := bag.deserialize(raw, connection.msgtype)
            )
            unpacked.add(series.numbers * BYTES_OF_A_NUMBER)
            series.add(message, received)
    remarks = [f"topics of an unknown message type are left out: {', '.join(sorted(unknown))}"] if unknown else []
    if empty := [topic for topic, series in topics.items() if not any(s.places for s in series.values())]:
        remarks.append(f"topics without numbers are left out: {', '.join(sorted(empty))}")
    if not any(s.received for t in topics.values() for s in t.values()):
        return SignalFile((), None, (*remarks, "no messages"))
    zero = min(min(_clock(s)[0]) for t in topics.values() for s in t.values())
    signals = [s for topic, series in topics.items() for s in _signals(topic, series, zero, remarks)]
    return SignalFile(tuple(signals), datetime.fromtimestamp(zero / _NS, UTC), tuple(dict.fromkeys(remarks)))


_REPAIR = "repair it with 'rosbag reindex' (ROS 1) or 'ros2 bag reindex' (ROS 2)"
FORMAT = Format("ROS bag", (".bag", ".mcap", ".db3"), read, extra="ros", repair=_REPAIR)


def _count_packed_messages(bag: Any) -> None:
    """Raise `LogError` if messages that are compressed one by one unpack to more than the limit."""
    unpacked = Unpacked()
    for reader in bag.readers:
        if getattr(reader, "compression_mode", None) == "message":
            for storage in reader.storage.storages:
                for _, _, raw in storage.messages(storage.connections):
                    ros_size.count_packed(raw, "zstd", unpacked)


def _series(topic: dict[tuple[str, ...], _Series], message: Any) -> _Series:
    """Messages of a topic that have the places of this one."""
    names = _names_in(message)
    if names not in topic:
        topic[names] = _Series(list(_places(message, (), ())))
    return topic[names]


def _names_in(message: Any) -> tuple[str, ...]:
    for key in _NAME_FIELDS:
        names = getattr(message, key, None)
        if isinstance(names, list) and names and all(isinstance(n, str) for n in names):
            return tuple(names)
    return ()


def _places(value: Any, steps: tuple, names: tuple[str, ...]) -> Iterator[_Place]:
    """Places of the numbers in a message; `names` are those of the message that it is in."""
    name = "/".join(map(str, steps))
    if isinstance(value, bool | int | float | np.number | np.bool_):
        yield _Place(steps, name, ())
    elif isinstance(value, np.ndarray):
        if value.ndim == 1 and 0 < value.size <= MOST_ELEMENTS and value.dtype.kind in "iufb":
            yield _Place(steps, name, names if len(names) == value.size else tuple(map(str, range(value.size))))
    elif isinstance(value, list):
        for i, entry in enumerate(value[:MOST_ELEMENTS]):
            yield from _named(_places(entry, (*steps, i), ()), steps, i, names if len(names) == len(value) else ())
    elif _is_time(value):
        yield _Place(steps, name, ())
    elif hasattr(value, "__dataclass_fields__"):
        names = _names_in(value) or names
        for key in value.__dataclass_fields__:
            if key not in ("__msgtype__", "header"):
                unit = _UNITS.get((value.__msgtype__, key))
                for place in _places(getattr(value, key), (*steps, key), names):
                    yield place._replace(unit=unit or place.unit)


def _named(places: Iterator[_Place], steps: tuple, index: int, names: tuple[str, ...]) -> Iterator[_Place]:
    """Places with the name of an element of a list in place of its index."""
    start = "/".join(map(str, (*steps, index)))
    for place in places:
        called = "/".join((*map(str, steps), names[index])) if names else start
        yield place._replace(name=called + place.name[len(start) :])


def _is_time(value: Any) -> bool:
    return hasattr(value, "sec") and hasattr(value, "nanosec")


def _number_at(message: Any, steps: tuple[str | int, ...]) -> Any:
    """The number or array at a place; None if a list of this message is shorter."""
    for step in steps:
        if isinstance(step, str):
            message = getattr(message, step)
        elif step < len(message):
            message = message[step]
        else:
            return None
    return message.sec + message.nanosec / _NS if _is_time(message) else message


def _stamp(message: Any) -> int:
    """Stamp of the header in ns, 0 if there is none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return stamp.sec * _NS + stamp.nanosec if stamp is not None else 0


def _clock(series: _Series) -> tuple[Sequence[int], bool]:
    """Times of messages in ns, and whether their stamps are of another clock than the bag's.

    Stamps of another clock (a simulation) are moved to begin when the first message arrived.
    """
    if not all(series.stamps):
        return series.received, False
    moved = series.received[0] - series.stamps[0]
    if abs(moved) < _SAME_CLOCK_NS:
        return series.stamps, False
    return [stamp + moved for stamp in series.stamps], True


def _signals(topic: str, by_names: dict, zero: int, remarks: list[str]) -> Iterator[Signal]:
    chunks: dict[str, list[tuple[NDArray, NDArray]]] = {}
    units: dict[str, str] = {}
    for series in by_names.values():
        times, other = _clock(series)
        if other:
            remarks.append(f"stamps of {topic} are of another clock: moved to begin when its first message arrived")
        time = np.array([t - zero for t in times]) / _NS
        for i, place in enumerate(series.places):
            values = np.array(series.values[i]).reshape(len(time), -1)
            if count := series.misfits[i]:
                where = f"{topic}/{place.name}"
                remarks.append(f"{where}: {count} messages have another number of elements and are read as no number")
            for k, column in enumerate(values.T):
                name = "/".join(p for p in (topic.strip("/"), place.name, *place.elements[k : k + 1]) if p)
                chunks.setdefault(name, []).append((time, column))
                units[name] = place.unit
    for name, parts in chunks.items():
        time, values = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        # Several nodes may publish the same joint under lists of names that differ.
        order = np.argsort(time, kind="stable") if len(parts) > 1 else slice(None)
        yield Signal(name, units[name], values[order], time[order])
