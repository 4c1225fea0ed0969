"""One small recording, written in every format by the format's own library."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd

N, STEP = 500, 0.002
TIME = np.round(STEP * np.arange(N), 6)
ANGLE = np.round(30 * np.sin(2 * np.pi * TIME) + 0.01 * np.random.default_rng(1).normal(size=N), 4)
TORQUE = np.round(0.1 * np.cos(2 * np.pi * TIME) + 0.001 * np.random.default_rng(2).normal(size=N), 5)
STARTED = datetime(2024, 5, 31, 12, tzinfo=UTC)
STARTED_NS = int(STARTED.timestamp()) * 10**9


def text(path: Path, separator=",", decimal=".", header="time [s],angle [deg],torque [Nm]\n", encoding="utf-8") -> Path:
    table = pd.DataFrame({"time": TIME, "angle": ANGLE, "torque": TORQUE})
    rows = table.to_csv(sep=separator, decimal=decimal, index=False, header=False)
    path.write_bytes((header.replace(",", separator) + rows).encode(encoding))
    return path


def semicolons(path: Path) -> Path:
    return text(path, ";", ",", encoding="cp1252", header="Prüfstand 7\nZeit [s],Winkel [°],Moment (Nm)\n")


def mat5(path: Path, compression=True) -> Path:
    from scipy.io import savemat

    savemat(path, {"time": TIME, "angle": ANGLE, "torque": TORQUE}, do_compression=compression)
    return path


def controldesk(path: Path) -> Path:
    """A capture as ControlDesk exports it: axes X, signals Y."""
    from scipy.io import savemat

    y = np.zeros(2, [("Name", "O"), ("Data", "O"), ("Unit", "O"), ("XIndex", "O")])
    y[0] = ("Model Root/angle", ANGLE[None, :], "deg", 1)
    y[1] = ("Model Root/torque", TORQUE[None, :], "Nm", 1)
    x = {"Name": "time", "Data": TIME[None, :], "Unit": "s", "Raster": "HostService"}
    savemat(path, {"run_001": {"X": x, "Y": y, "Description": {"General": "none"}}})
    return path


def mat73(path: Path) -> Path:
    """As MATLAB writes it: a header in the user block, the class of each variable as an attribute."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in {"time": TIME, "angle": ANGLE, "torque": TORQUE}.items():
            file.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Fri May 31 12:00:00 2024 HDF5 schema 1.00 ."
    with open(path, "r+b") as file:
        file.write(header.ljust(124) + b"\x00\x02IM")
    return path


def mdf4(path: Path, compression=0) -> Path:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.header.start_time = STARTED
        signals = [Signal(ANGLE, TIME, name="angle", unit="deg"), Signal(TORQUE, TIME, name="torque", unit="Nm")]
        file.append(signals, acq_name="fast")
        file.save(path, overwrite=True, compression=compression)
    return path


def mdf3(path: Path) -> Path:
    from asammdf import MDF, Signal

    with MDF(version="3.30") as file:
        signals = [Signal(ANGLE, TIME, name="angle", unit="deg"), Signal(TORQUE, TIME, name="torque", unit="Nm")]
        file.append(signals)
        file.save(path, overwrite=True)
    return path


def tdms(path: Path) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    waveform = {"wf_increment": STEP, "wf_start_offset": 0.0, "wf_start_time": np.datetime64("2024-05-31T12:00:00")}
    with TdmsWriter(path) as writer:
        for part in np.array_split(np.arange(N), 4):
            channels = {"angle": (ANGLE, "deg"), "torque": (TORQUE, "Nm")}.items()
            writer.write_segment(
                [ChannelObject("rig", name, v[part], {**waveform, "unit_string": unit}) for name, (v, unit) in channels]
            )
    return path


def parquet(path: Path, compression="snappy", dictionary=True) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    units = {"time": "s", "angle": "deg", "torque": "Nm"}
    schema = pa.schema([pa.field(name, pa.float64(), metadata={"unit": unit}) for name, unit in units.items()])
    pq.write_table(
        pa.table([TIME, ANGLE, TORQUE], schema=schema), path, compression=compression, use_dictionary=dictionary
    )
    return path


def hdf5(path: Path, compression="gzip") -> Path:
    import h5py

    with h5py.File(path, "w") as file:
        rig = file.create_group("rig")
        for name, values, unit in (("time", TIME, "s"), ("angle", ANGLE, "deg"), ("torque", TORQUE, "Nm")):
            rig.create_dataset(name, data=values, compression=compression).attrs["units"] = unit
        rig["time"].make_scale()
        rig["angle"].dims[0].attach_scale(rig["time"])
        rig["torque"].dims[0].attach_scale(rig["time"])
    return path


def _joint_states(writer, store, serialise, header: dict) -> None:
    types = store.types
    state, stamp = types["sensor_msgs/msg/JointState"], types["builtin_interfaces/msg/Time"]
    connection = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
    for t, angle, torque in zip(TIME, ANGLE, TORQUE, strict=True):
        at = STARTED_NS + round(t * 1e9)
        head = types["std_msgs/msg/Header"](stamp=stamp(*divmod(at, 10**9)), frame_id="", **header)
        none = np.zeros(0)
        message = state(head, ["drive"], np.array([angle]), none, np.array([torque]))
        # The bag receives a message up to 5 ms after its stamp.
        writer.write(connection, at + int(1e6 * (1 + 4 * abs(np.sin(37 * t)))), serialise(message, state.__msgtype__))


def ros1(path: Path, compression=None) -> Path:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    writer = Writer(path)
    if compression:
        writer.set_compression(Writer.CompressionFormat[compression])
    with writer:
        _joint_states(writer, store, store.serialize_ros1, {"seq": 0})
    return path


def ros2(folder: Path, plugin="MCAP", compressed=False) -> Path:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin[plugin])
    if compressed:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        _joint_states(writer, store, store.serialize_cdr, {})
    return folder


def mcap(path: Path, compressed=False) -> Path:
    return next(ros2(path.parent / f"bag_{path.stem}_mcap", compressed=compressed).glob("*.mcap")).rename(path)


def db3(path: Path) -> Path:
    return next(ros2(path.parent / "bag_db3", "SQLITE3").glob("*.db3")).rename(path)


# By the name of a file of the format.
WRITERS: dict[str, Callable[[Path], Path]] = {
    "log.csv": text,
    "semicolons.txt": semicolons,
    "v5.mat": mat5,
    "controldesk.mat": controldesk,
    "v73.mat": mat73,
    "log.mf4": mdf4,
    "log.tdms": tdms,
    "log.parquet": parquet,
    "log.h5": hdf5,
    "log.bag": ros1,
    "log.mcap": mcap,
    "log.db3": db3,
}
