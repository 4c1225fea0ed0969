"""ROS 1 and ROS 2 bags: the numbers of every message, topic by topic."""

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import lru_cache
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
_NUMBER = float | int | np.number | np.bool_
_NS = 1_000_000_000
# Stamps of a message differ less than this from the time of its arrival, unless they are of a simulation's clock.
_SAME_CLOCK_NS = 24 * 3600 * _NS


class _Numbers(NamedTuple):
    """Numbers at one place of a message.

    Attributes
    ----------
    path : tuple of str
        Fields and elements of lists on the way to them.
    names : tuple of str
        Those that the messages on the way give to elements.
    elements : tuple of str
        Names of the elements of an array; () of a single number.
    unit : str
    values : list of float
    """

    path: tuple[str, ...]
    names: tuple[str, ...]
    elements: tuple[str, ...]
    unit: str
    values: list[float]


@dataclass
class _Column:
    """Numbers at one place of the messages of a series: plain numbers, a message after another.

    Attributes
    ----------
    elements : tuple of str
    unit : str
        Those of the first message that has numbers there, see `_Numbers`.
    values : array of float
        nan for a message that has none there, or another number of them.
    fits : int
        Messages that are not nan.
    width : int
        Numbers of a message.
    """

    elements: tuple[str, ...]
    unit: str
    values: "array[float]" = field(default_factory=lambda: array("d"))
    fits: int = 0
    width: int = field(init=False)

    def __post_init__(self) -> None:
        self.width = max(len(self.elements), 1)

    def add(self, values: list[float], row: int) -> None:
        """Keep the numbers of a message; `row` is the number of messages before it."""
        if len(values) == self.width:
            if self.fits < row:
                self._fill(row)
            self.values.extend(values)
            self.fits += 1

    def by_element(self, rows: int) -> NDArray:
        """Numbers of so many messages, shape (width, rows)."""
        self._fill(rows)
        return np.reshape(self.values, (rows, self.width)).T

    def _fill(self, rows: int) -> None:
        self.values.extend([np.nan] * (rows * self.width - len(self.values)))


@dataclass
class _Series:
    """Messages of a topic that give the same names to their numbers.

    Attributes
    ----------
    columns : dict of path to _Column
    received, stamps : array of int
        Times, ns.
    """

    columns: dict[tuple[str, ...], _Column] = field(default_factory=dict)
    received: "array[int]" = field(default_factory=lambda: array("q"))
    stamps: "array[int]" = field(default_factory=lambda: array("q"))

    def add(self, found: Sequence[_Numbers], received: int, stamp: int) -> int:
        """Keep the numbers of a message; how many more numbers are kept then, nan included."""
        row, late = len(self.received), 0
        for path, _, elements, unit, values in found:
            if (column := self.columns.get(path)) is None:
                column = self.columns[path] = _Column(elements, unit)
                late += row * column.width
            column.add(values, row)
        self.received.append(received)
        self.stamps.append(stamp)
        return 2 + late + sum(column.width for column in self.columns.values())


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
    topics: dict[str, dict[tuple, _Series]] = {}
    unknown: set[str] = set()
    unpacked = Unpacked()
    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as bag:
        _count_packed_messages(bag)
        known = {c.id: c.msgtype in bag.typestore.fielddefs for c in bag.connections}
        for connection, received, raw in bag.messages():
            if not known[connection.id]:
                unknown.add(connection.topic)
                continue
            message = bag.deserialize(raw, connection.msgtype)
            found: list[_Numbers] = []
            _collect(found, message)
            names = tuple(dict.fromkeys((one.path[:-1], one.names) for one in found if one.names))
            series = topics.setdefault(connection.topic, {}).setdefault(names, _Series())
            unpacked.add(series.add(found, received, _stamp(message)) * BYTES_OF_A_NUMBER)
    remarks = [f"topics of an unknown message type are left out: {', '.join(sorted(unknown))}"] if unknown else []
    if empty := [topic for topic, series in topics.items() if not any(s.columns for s in series.values())]:
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


def _collect(
    found: list[_Numbers],
    value: Any,
    path: tuple[str, ...] = (),
    above: tuple[str, ...] = (),
    beside: tuple[str, ...] = (),
    unit: str = "",
) -> None:
    """Find the numbers of a message.

    Parameters
    ----------
    found : list of _Numbers
        They are added to it: a generator would take half as long again.
    value : Any
        The message, or a part of it at `path`.
    above, beside : tuple of str
        Names of elements on the way, and those in the nearest message, which may be of the elements of `value`.
    unit : str
        Unit of its numbers, if the message that it is in leaves no choice.
    """
    if isinstance(value, _NUMBER):
        found.append(_Numbers(path, above, (), unit, [float(value)]))
    elif isinstance(value, np.ndarray):
        if value.ndim == 1 and 0 < value.size <= MOST_ELEMENTS and value.dtype.kind in "iufb":
            elements = _elements(beside, value.size)
            found.append(_Numbers(path, above, elements, unit, value.astype(float).tolist()))
    elif isinstance(value, list):
        if value and not isinstance(value[0], str):
            for element, entry in zip(_elements(beside, len(value)), value[:MOST_ELEMENTS], strict=False):
                _collect(found, entry, (*path, element), above, unit=unit)
    elif _is_time(value):
        found.append(_Numbers(path, above, (), unit, [value.sec + value.nanosec / _NS]))
    else:
        names = _names_in(value)
        for key, known in _fields(value.__class__):
            _collect(found, getattr(value, key), (*path, key), above + names, names or beside, known or unit)


@lru_cache(maxsize=1000)
def _fields(kind: type) -> tuple[tuple[str, str], ...]:
    """Fields of a type of messages that may hold numbers, and their units; () of what is no message."""
    keys = [key for key in getattr(kind, "__dataclass_fields__", ()) if key not in ("__msgtype__", "header")]
    return tuple((key, _UNITS.get((getattr(kind, "__msgtype__", ""), key), "")) for key in keys)


def _names_in(message: Any) -> tuple[str, ...]:
    """Names of the elements of the arrays in a message; () where they do not tell them apart."""
    for key in _NAME_FIELDS:
        names = getattr(message, key, None)
        if isinstance(names, list) and names and all(isinstance(n, str) for n in names):
            return tuple(names) if len(set(names)) == len(names) else ()
    return ()


def _elements(names: tuple[str, ...], size: int) -> tuple[str, ...]:
    """Names of the elements of an array, or else their indices."""
    return names if len(names) == size else tuple(map(str, range(size)))


def _is_time(value: Any) -> bool:
    return hasattr(value, "sec") and hasattr(value, "nanosec")


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
        for path, column in series.columns.items():
            if column.elements and (count := len(time) - column.fits):
                where = "/".join((topic, *path))
                remarks.append(f"{where}: {count} messages have another number of elements and are read as no number")
            for element, values in zip(column.elements or ("",), column.by_element(len(time)), strict=True):
                name = "/".join(part for part in (topic.strip("/"), *path, element) if part)
                chunks.setdefault(name, []).append((time, values))
                units[name] = column.unit
    for name, parts in chunks.items():
        time, values = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        # Several nodes may publish the same joint under lists of names that differ.
        order = np.argsort(time, kind="stable") if len(parts) > 1 else slice(None)
        yield Signal(name, units[name], values[order], time[order])
