"""ROS 1 and ROS 2 bags: fields by their path, arrays by the names beside them, time from the header."""

from pathlib import Path

import numpy as np
import pytest
import sample_files as sample
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import read_signals

BAGS = {
    "log.bag": sample.ros1,
    "log.mcap": sample.mcap,
    "log.db3": sample.db3,
    "folder": sample.ros2,
    "folder_db3": lambda path: sample.ros2(path, "SQLITE3"),
}
STORE = get_typestore(Stores.ROS2_HUMBLE)
T = STORE.types


def write(path: Path, *messages, store=STORE) -> Path:
    """A ROS 2 bag of (topic, message, ns at which the bag received it)."""
    with Writer(path, version=9) as writer:
        connections = {}
        for topic, message, at in messages:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], at, store.serialize_cdr(message, kind))
    return path


def header(ns: int):
    return T["std_msgs/msg/Header"](stamp=T["builtin_interfaces/msg/Time"](*divmod(ns, 10**9)), frame_id="")


def joints(names, position, ns):
    none = np.zeros(0)
    return T["sensor_msgs/msg/JointState"](header(ns), list(names), np.array(position, float), none, none)


def number(value):
    return T["std_msgs/msg/Float64"](float(value))


@pytest.mark.parametrize("name", BAGS)
def test_a_bag_of_any_kind(tmp_path, name):
    file = read_signals(BAGS[name](tmp_path / name))
    signals = {s.name: s for s in file.signals}
    assert signals.keys() == {"joint_states/position/drive", "joint_states/effort/drive"}
    assert (signals["joint_states/position/drive"].values == sample.ANGLE).all()
    assert (signals["joint_states/effort/drive"].values == sample.TORQUE).all()
    # Stamps of the header, not the jittered times of arrival.
    np.testing.assert_allclose(signals["joint_states/effort/drive"].time_s, sample.TIME, atol=1e-9)
    assert file.started == sample.STARTED


def test_time_of_the_bag_where_a_message_has_no_stamp(tmp_path):
    start = sample.STARTED_NS
    messages = [("/rig/tau", number(i), start + 10**7 * i) for i in range(20)]
    messages += [("/js", joints(["a"], [i], start + 10**7 * i - 10**6), start + 10**7 * i) for i in range(20)]
    signals = {s.name: s for s in read_signals(write(tmp_path / "bag", *messages)).signals}
    np.testing.assert_allclose(signals["rig/tau/data"].time_s, 0.001 + 0.01 * np.arange(20), atol=1e-9)
    np.testing.assert_allclose(signals["js/position/a"].time_s, 0.01 * np.arange(20), atol=1e-9)


def test_stamps_of_a_simulation_begin_with_the_bag(tmp_path):
    start = sample.STARTED_NS
    # Twice as fast as real time.
    messages = [("/js", joints(["a"], [i], 10**9 + 2 * 10**7 * i), start + 10**7 * i) for i in range(20)]
    messages += [("/tau", number(i), start + 10**7 * i) for i in range(20)]
    file = read_signals(write(tmp_path / "bag", *messages))
    signals = {s.name: s for s in file.signals}
    np.testing.assert_allclose(signals["js/position/a"].time_s, 0.02 * np.arange(20), atol=1e-9)
    np.testing.assert_allclose(signals["tau/data"].time_s, 0.01 * np.arange(20), atol=1e-9)
    assert any("another clock" in remark for remark in file.remarks)


def test_joints_go_by_their_names_in_any_order_and_from_several_nodes(tmp_path):
    start, messages = sample.STARTED_NS, []
    for i in range(10):
        at = start + 10**7 * i
        names, values = (("in", "out"), (i, -i)) if i % 2 else (("out", "in"), (-i, i))
        messages.append(("/js", joints(names, values, at), at))
        messages.append(("/js", joints(["spring"], [100 + i], at + 10**6), at + 10**6))
    signals = {s.name: s for s in read_signals(write(tmp_path / "bag", *messages)).signals}
    assert signals["js/position/in"].values.tolist() == list(range(10))
    assert signals["js/position/out"].values.tolist() == [-i for i in range(10)]
    assert signals["js/position/spring"].values.tolist() == [100 + i for i in range(10)]
    np.testing.assert_allclose(signals["js/position/spring"].time_s, 0.001 + 0.01 * np.arange(10), atol=1e-9)


def nested(*fields, kind="lab/msg/State"):
    """A store with a type of messages that holds others."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("\n".join(fields), kind))
    return store, store.types[kind]


def test_joints_within_a_message_go_by_their_names_in_any_order(tmp_path):
    store, state = nested("sensor_msgs/JointState drive", "sensor_msgs/JointState[] others")
    messages = []
    for i in range(10):
        at = sample.STARTED_NS + 10**7 * i
        one, other = joints(["in", "out"], [i, -i], at), joints(["out", "in"], [-i, i], at)
        order = (one, [other, one, one]) if i % 2 else (other, [one, one, other])
        messages.append(("/state", state(*order), at))
    signals = {s.name: s for s in read_signals(write(tmp_path / "bag", *messages, store=store)).signals}
    for place in ("drive", "others/0", "others/1", "others/2"):
        assert signals[f"state/{place}/position/in"].values.tolist() == list(range(10))
        assert signals[f"state/{place}/position/out"].values.tolist() == [-i for i in range(10)]


def test_names_that_do_not_tell_elements_apart_are_not_used(tmp_path):
    messages = [("/js", joints(["", ""], [i, -i], 0), sample.STARTED_NS + i) for i in range(10)]
    signals = {s.name: s for s in read_signals(write(tmp_path / "bag", *messages)).signals}
    assert signals["js/position/0"].values.tolist() == list(range(10))
    assert signals["js/position/1"].values.tolist() == [-i for i in range(10)]


def test_an_array_or_a_list_that_is_empty_at_first_is_read(tmp_path):
    store, state = nested("sensor_msgs/JointState joints", "geometry_msgs/Vector3[] forces")
    vector, layout, messages = T["geometry_msgs/msg/Vector3"], T["std_msgs/msg/MultiArrayLayout"]([], 0), []
    for i in range(10):
        at, filled = sample.STARTED_NS + 10**7 * i, i not in (0, 5)
        joint = joints(["in"], [i], at)
        joint.effort = np.full(int(filled), 7.0 + i)
        messages.append(("/state", state(joint, [vector(i, 0.0, 0.0)] * filled), at))
        messages.append(("/array", T["std_msgs/msg/Float64MultiArray"](layout, np.full(2 * filled, 1.0 * i)), at))
    file = read_signals(write(tmp_path / "bag", *messages, store=store))
    signals = {s.name: s for s in file.signals}
    expected = np.where(np.isin(np.arange(10), (0, 5)), np.nan, np.arange(10))
    np.testing.assert_array_equal(signals["state/joints/effort/in"].values, 7 + expected)
    np.testing.assert_array_equal(signals["state/forces/0/x"].values, expected)
    np.testing.assert_array_equal(signals["array/data/1"].values, expected)
    assert signals["state/joints/position/in"].values.tolist() == list(range(10))
    for place in ("state/joints/effort", "array/data"):
        text = f"/{place}: 2 messages have another number of elements and are read as no number"
        assert text in file.remarks


def test_fields_within_fields_arrays_by_index_and_pictures_left_out(tmp_path):
    start = sample.STARTED_NS
    vector, layout = T["geometry_msgs/msg/Vector3"], T["std_msgs/msg/MultiArrayLayout"]([], 0)
    messages = []
    for i in range(12):
        at = start + 10**7 * i
        force = T["geometry_msgs/msg/Wrench"](vector(i, 0.0, 0.0), vector(0.0, 0.0, 2.0 * i))
        messages.append(("/ft", T["geometry_msgs/msg/WrenchStamped"](header(at), force), at))
        values = np.arange(3 if i != 5 else 2, dtype=float)
        messages.append(("/counts", T["std_msgs/msg/Float64MultiArray"](layout, values), at))
        messages.append(("/picture", T["std_msgs/msg/Float64MultiArray"](layout, np.zeros(5000)), at))
        messages.append(("/say", T["std_msgs/msg/String"]("hello"), at))
    file = read_signals(write(tmp_path / "bag", *messages))
    signals = {s.name: s for s in file.signals}
    assert signals["ft/wrench/torque/z"].values.tolist() == [2.0 * i for i in range(12)]
    assert [signals[f"ft/wrench/{part}/z"].unit for part in ("force", "torque")] == ["N", "N*m"]
    assert signals["counts/data/2"].unit == ""
    assert np.flatnonzero(np.isnan(signals["counts/data/2"].values)).tolist() == [5]
    assert not any(name.startswith("picture/data") for name in signals)
    assert any("counts/data: 1 messages have another number of elements" in remark for remark in file.remarks)
    assert any("topics without numbers are left out: /say" in remark for remark in file.remarks)


def test_a_message_type_of_the_labs_own(tmp_path):
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("float64 theta\nbool on\nstring[] names\nfloat32[2] tension\n", "lab/msg/Rig"))
    message = [
        (
            "/rig",
            store.types["lab/msg/Rig"](0.1 * i, True, ["T1", "T2"], np.array([i, 2 * i], "f4")),
            sample.STARTED_NS + i,
        )
        for i in range(10)
    ]
    signals = {s.name: s for s in read_signals(write(tmp_path / "bag", *message, store=store)).signals}
    assert signals.keys() == {"rig/theta", "rig/on", "rig/tension/T1", "rig/tension/T2"}
    assert signals["rig/tension/T2"].values.tolist() == [2.0 * i for i in range(10)]


def test_a_bag_without_messages_and_a_folder_without_a_bag(tmp_path):
    with Writer(tmp_path / "bag", version=9) as writer:
        writer.add_connection("/js", "sensor_msgs/msg/JointState", typestore=STORE)
    with pytest.raises(LogError, match="holds no signals of numbers"):
        read_signals(tmp_path / "bag")
    (tmp_path / "folder").mkdir()
    with pytest.raises(LogError) as error:
        read_signals(tmp_path / "folder")
    assert "is a folder without a ROS 2 bag" in error.value.args[2]
