"""Pipes, devices, and files that are too large or unpack to more: each is one line, and nothing waits or fills up."""

import gzip
import os
import re
import struct
import zlib
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import sample_files as sample
from measured_reads import MeasuredReads

from ccmodel import inputs
from ccmodel.paths import existing_file, try_file
from ccmodel.rig import readers
from ccmodel.rig.findings import LogError
from ccmodel.rig.ingest import ingest_batch
from ccmodel.typed import MAX_VALUES, InputError

PIPE = "it is a pipe; a regular file is needed"
DEVICE = "it is a device; a regular file is needed"


def refusals(bench):
    return [f"{f.file.rpartition('/')[2]}: {f.text}" for f in ingest_batch(bench.folder).findings]


@pytest.fixture
def written(bench):
    return bench.write()


def test_a_pipe_as_a_log_or_as_the_batch_file_is_refused(written):
    for name in ("one.csv", "batch.yaml"):
        (written.folder / name).unlink()
        os.mkfifo(written.folder / name)
        assert any(line.startswith(name) and PIPE in line for line in refusals(written))


@pytest.mark.parametrize("name", ["one.csv", "batch.yaml"])
def test_an_endless_device_is_refused(name, written):
    (written.folder / name).unlink()
    (written.folder / name).symlink_to("/dev/zero")
    assert any(line.startswith(name) and DEVICE in line for line in refusals(written))


@pytest.mark.parametrize("read", [readers.read, readers.read_signals])
def test_pipes_and_large_files_are_no_logs(read, tmp_path):
    pipe, sparse = tmp_path / "a.csv", tmp_path / "b.csv"
    os.mkfifo(pipe)
    with open(sparse, "wb") as file:
        file.truncate(2_000_000_000)
    for path, text in ((pipe, PIPE), (sparse, f"larger than 1000 MB; if that is right, set {inputs.LOG} to its MB")):
        with pytest.raises(LogError) as error:
            read(path)
        assert text in error.value.args[2]


def test_the_limits_are_those_of_the_environment(written, monkeypatch):
    assert not any("larger" in line for line in refusals(written))
    monkeypatch.setenv(inputs.LOG, "0.01")
    assert any(line.startswith("one.csv") and "larger than 0.01 MB" in line for line in refusals(written))
    monkeypatch.setenv(inputs.DOCUMENT, "0.0001")
    assert any(line.startswith("batch.yaml") and "larger than 0.0001 MB" in line for line in refusals(written))


@pytest.mark.parametrize("read", [readers.read, readers.read_signals])
def test_a_log_that_unpacks_to_more_than_the_limit_is_refused(read, tmp_path, monkeypatch):
    bomb = tmp_path / "a.csv.gz"
    bomb.write_bytes(gzip.compress(b"time_s,theta_in_rad\n" + b"0.001,0.5\n" * 200_000))
    assert len(bomb.read_bytes()) < 20_000
    monkeypatch.setenv(inputs.UNPACKED, "1")
    with pytest.raises(LogError) as error:
        read(bomb)
    assert f"which is larger than 1 MB; if that is right, set {inputs.UNPACKED}" in error.value.args[2]


def test_aliases_that_repeat_one_another_are_refused(written):
    levels = [f"l{k}: &l{k} [{', '.join([f'*l{k - 1}'] * 9)}]" for k in range(1, 10)]
    file = written.folder / "batch.yaml"
    file.write_text("\n".join(["l0: &l0 [1]", *levels, file.read_text()]))
    assert refusals(written) == [
        f"batch.yaml: not valid YAML: holds more than {MAX_VALUES} values, repeated ones counted each time: write less"
    ]


def test_a_batch_file_of_too_many_values_is_not_read_to_its_end(written):
    file = written.folder / "batch.yaml"
    # The bracket that is never closed lies behind so many values.
    file.write_text(f"a: [{'1, ' * (MAX_VALUES + 10)}{{")
    (refused,) = refusals(written)
    assert "holds more than" in refused


def test_an_alias_in_its_place_is_read(written):
    file = written.folder / "batch.yaml"
    pieces = "\n  - length_m: 0.4\n    bend_rad: 0.0\n  - length_m: 0.8\n    bend_rad: 3.1416\n"
    first, second, rest = file.read_text().split(f"conduit:{pieces}")
    file.write_text(f"{first}conduit: &path{pieces}{second}conduit: *path\n{rest}")
    for recording in ingest_batch(written.folder).recordings:
        assert list(recording.path.piece_bend_rad) == [0.0, 3.1416]


def test_a_file_that_a_command_reads_or_writes_is_a_regular_one(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match=f"^{pipe}: {PIPE}$"):
        existing_file(pipe)
    with pytest.raises(InputError, match=f"^--out: {pipe}: {PIPE}$"):
        try_file(pipe, "--out")


def hdf5_bomb(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("a", shape=(10**11,), dtype="f8", chunks=(10**6,), compression="gzip")


def netcdf_bomb(path):
    with h5py.File(path, "w") as file:
        for name in "ab":  # each is below the limit, both are not
            file.create_dataset(name, shape=(10**7,), dtype="f8", chunks=(10**6,), compression="gzip")


def mat73_bomb(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("log/a", shape=(10**11,), dtype="f8", chunks=(10**6,), compression="gzip")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: PCWIN64".ljust(124) + b"\x00\x02IM")


def mat5_bomb(path):
    packer = zlib.compressobj(9)
    packed = b"".join(packer.compress(bytes(10**7)) for _ in range(11)) + packer.flush()
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + struct.pack("<II", 15, len(packed)) + packed)


def mat5_array(kind, shape, name, content):
    def element(number, data):
        return struct.pack("<II", number, len(data)) + data + b"\0" * (-len(data) % 8)

    head = element(6, struct.pack("<II", kind, 0)) + element(5, struct.pack("<2i", *shape)) + element(1, name)
    return element(14, head + content)


NO_FIELDS = struct.pack("<HHiII", 5, 4, 32, 1, 0)
MAT5 = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"


def empty_structs(path):
    path.write_bytes(MAT5 + mat5_array(2, (1, 10**8), b"a", NO_FIELDS))


def packed_empty_structs(path):
    packed = zlib.compress(mat5_array(2, (1, 10**8), b"a", NO_FIELDS))
    path.write_bytes(MAT5 + struct.pack("<II", 15, len(packed)) + packed)


EMPTY_STRUCTS = mat5_array(2, (1, 10**8), b"", NO_FIELDS)


def structs_in_a_cell(path):
    path.write_bytes(MAT5 + mat5_array(1, (1, 1), b"a", EMPTY_STRUCTS))


def structs_in_a_packed_struct(path):
    one_field = struct.pack("<HHiII", 5, 4, 32, 1, 32) + b"f".ljust(32, b"\0")
    packed = zlib.compress(mat5_array(2, (1, 1), b"a", one_field + EMPTY_STRUCTS))
    path.write_bytes(MAT5 + struct.pack("<II", 15, len(packed)) + packed)


def characters(path):
    path.write_bytes(MAT5 + mat5_array(4, (1, 10**8), b"a", struct.pack("<II", 16, 0)))


def bytes_bomb(path):
    with h5py.File(path, "w") as file:  # below the limit in the file, above it as floating-point numbers
        file.create_dataset("a", shape=(4 * 10**7,), dtype="i1", chunks=(10**6,), compression="gzip")


def mat73_links(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("a0", shape=(10**6,), dtype="f8", chunks=(10**6,), compression="gzip")
        for i in range(1, 40):
            file[f"a{i}"] = file["a0"]
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: PCWIN64".ljust(124) + b"\x00\x02IM")


def parquet_bomb(path):
    one = pa.table({"a": pa.DictionaryArray.from_arrays(pa.array([0] * 10**6, pa.int8()), pa.array([1.0]))})
    with pq.ParquetWriter(path, one.schema) as writer:
        for _ in range(13):
            writer.write_table(one)


def parquet_lists(path):
    rows = pa.FixedSizeListArray.from_arrays(pa.array([1.0] * 10**6), 1000)
    pq.write_table(pa.table({"a": pa.chunked_array([rows] * 20)}), path)


def mdf_bomb(path):
    from asammdf import MDF, Signal

    zeros = np.zeros(7 * 10**6)
    with MDF(version="4.10") as file:
        file.append([Signal(zeros, zeros, name="a")])
        file.save(path, compression=2)


def tdms_channels(path):
    """The bytes of a card that 60 channels read: each is a million numbers."""

    def text(value):
        return struct.pack("<I", len(value)) + value

    int8, buffer, offset, bits, scale = 1, 0, 0, 0, 0
    scaler = struct.pack("<5I", int8, buffer, offset, bits, scale)
    index = struct.pack("<IIIQI", 0x1269, int8, 1, 10**6, 1) + scaler
    objects = b"".join(text(b"/'card'/'%d'" % i) + index + struct.pack("<III", 1, 1, 0) for i in range(60))
    metadata = struct.pack("<I", 60) + objects
    contents = 2 | 4 | 8 | 128  # metadata of new objects, and raw data of a card
    lead_in = b"TDSm" + struct.pack("<IIQQ", contents, 4713, len(metadata) + 10**6, len(metadata))
    path.write_bytes(lead_in + metadata + bytes(10**6))


def texts(writer, distribution, serialise, count=110):
    """A bag with texts of a MB."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores[distribution])
    message = store.types["std_msgs/msg/String"](data="x" * 10**6)
    raw = getattr(store, serialise)(message, message.__msgtype__)
    with writer:
        connection = writer.add_connection("/a", message.__msgtype__, typestore=store)
        for i in range(count):
            writer.write(connection, i, raw)


def bag_bomb(path):
    from rosbags.rosbag1 import Writer

    writer = Writer(path)
    writer.set_compression(Writer.CompressionFormat["BZ2"])
    texts(writer, "ROS1_NOETIC", "serialize_ros1")


def mcap_bomb(path):
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    writer = Writer(path.parent / "bag", version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    texts(writer, "ROS2_HUMBLE", "serialize_cdr")
    next((path.parent / "bag").glob("*.mcap")).rename(path)


IN_LINUX = pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak of memory is read from /proc")


@pytest.fixture(scope="module")
def limited():
    """Reads of files that may unpack to 100 MB. The growth of the peak includes what libraries written in C take."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(inputs.UNPACKED, "100")
        process = MeasuredReads()
    yield process
    process.close()


@IN_LINUX
@pytest.mark.parametrize(
    ("name", "make", "found"),
    [
        ("a.h5", hdf5_bomb, 800_000),
        ("a.nc", netcdf_bomb, 160),
        ("b.h5", bytes_bomb, 320),
        ("a.mat", mat73_bomb, 800_000),
        ("links.mat", mat73_links, 104),
        ("b.mat", mat5_bomb, 101),
        ("structs.mat", empty_structs, 10_000),
        ("packed.mat", packed_empty_structs, 10_000),
        ("cell.mat", structs_in_a_cell, 10_000),
        ("struct.mat", structs_in_a_packed_struct, 10_000),
        ("characters.mat", characters, 800),
        ("a.parquet", parquet_bomb, 104),
        ("b.parquet", parquet_lists, 160),
        ("a.mf4", mdf_bomb, 101),
        ("a.tdms", tdms_channels, 480),
        ("a.bag", bag_bomb, 101),
        ("a.mcap", mcap_bomb, 101),
    ],
)
def test_what_unpacks_to_too_much_is_refused_before_it_is_read(name, make, found, tmp_path, limited):
    make(tmp_path / name)
    assert (tmp_path / name).stat().st_size < 2e6
    read = limited.read(tmp_path / name)
    said, most = read.refusal, read.megabytes
    assert not read.fault
    limit = f"larger than 100 MB; if that is right, set {inputs.UNPACKED} to its MB"
    assert re.fullmatch(rf"unpacks to (\d+) MB or more, which is {limit}", said), said
    assert float(said.split()[2]) == pytest.approx(found, rel=0.02)
    # Links are counted as they are read, up to the limit; numbers of one byte are read as such before they are refused.
    assert most < {mat73_links: 150, bytes_bomb: 60}.get(make, 20)


@pytest.mark.parametrize("mode", ["MESSAGE", "FILE"])
def test_what_a_folder_of_a_bag_unpacks_to_is_counted(mode, tmp_path, monkeypatch):
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    writer = Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3)
    writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    texts(writer, "ROS2_HUMBLE", "serialize_cdr", count=3)
    monkeypatch.setenv(inputs.UNPACKED, "2")
    with pytest.raises(LogError, match="or more, which is larger than 2 MB"):
        readers.read_signals(tmp_path / "bag")
    monkeypatch.setenv(inputs.UNPACKED, "4")
    with pytest.raises(LogError, match="holds no signals of numbers"):
        readers.read_signals(tmp_path / "bag")


@pytest.mark.parametrize("name", ["log.bag", "log.mcap", "log.db3"])
def test_the_numbers_of_messages_are_counted(name, tmp_path, monkeypatch):
    path = sample.WRITERS[name](tmp_path / name)
    # An angle, a torque and two times of 500 messages are 16 kB.
    monkeypatch.setenv(inputs.UNPACKED, "0.017")
    assert len(readers.read_signals(path).signals) == 2
    monkeypatch.setenv(inputs.UNPACKED, "0.015")
    with pytest.raises(LogError, match="unpacks to 0 MB or more, which is larger than 0.015 MB"):
        readers.read_signals(path)


def test_channels_of_an_mdf_file_are_counted_as_numbers(tmp_path, monkeypatch):
    path = sample.mdf3(tmp_path / "log.mdf")
    # Two signals and their times, 500 samples each.
    monkeypatch.setenv(inputs.UNPACKED, "0.0121")
    assert len(readers.read_signals(path).signals) == 2
    monkeypatch.setenv(inputs.UNPACKED, "0.0119")
    with pytest.raises(LogError, match="unpacks to 0 MB or more"):
        readers.read_signals(path)


@IN_LINUX
def test_the_measure_of_memory_sees_what_a_library_takes(tmp_path):
    bytes_bomb(tmp_path / "b.h5")
    process = MeasuredReads()
    read = process.read(tmp_path / "b.h5")
    process.close()
    assert (read.names, read.fault, read.megabytes > 300) == (["a"], "", True)


@IN_LINUX
def test_a_text_that_a_parquet_file_repeats_takes_its_memory_once(tmp_path, limited):
    repeated = pa.DictionaryArray.from_arrays(pa.array([0] * 10**4, pa.int8()), pa.array(["x" * 20_000]))
    pq.write_table(pa.table({"note": repeated, "a": [1.0] * 10**4}), tmp_path / "a.parquet", store_schema=False)
    read = limited.read(tmp_path / "a.parquet")
    assert (read.names, read.fault, read.megabytes < 60) == (["a"], "", True)


def stored_elsewhere(file, other):
    file.create_dataset("a", shape=(100,), dtype="u1", external=[(str(other), 0, 100)])


def virtual(file, other):
    layout = h5py.VirtualLayout(shape=(100,), dtype="u1")
    layout[:] = h5py.VirtualSource(str(other), "b", shape=(100,))
    file.create_virtual_dataset("a", layout)


def linked(file, other):
    file["a"] = h5py.ExternalLink(str(other), "b")


@pytest.mark.parametrize("make", [stored_elsewhere, virtual, linked])
@pytest.mark.parametrize("ending", [".h5", ".mat"])
def test_an_hdf5_file_reads_no_other_file(make, ending, tmp_path):
    path, other = tmp_path / f"a{ending}", tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["b"] = list(range(100))
    with h5py.File(path, "w", userblock_size=512 if ending == ".mat" else 0) as file:
        make(file, other)
    if ending == ".mat":
        with open(path, "r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file, Platform: PCWIN64".ljust(124) + b"\x00\x02IM")
    with pytest.raises(LogError, match=r"in another file \(.*other.h5\): give that file"):
        readers.read_signals(path)
