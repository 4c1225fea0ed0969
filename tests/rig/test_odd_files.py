"""Pipes, devices, and files that are too large or unpack to more: each is one line, and nothing waits or fills up."""

import gzip
import os
import re
import struct
import tracemalloc
import zlib

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ccmodel import inputs
from ccmodel.paths import existing_file, try_file
from ccmodel.rig import readers
from ccmodel.rig.findings import LogError
from ccmodel.rig.ingest import ingest_batch
from ccmodel.rig.readers.attempt import read_here
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
    assert f"unpacks to what is larger than 1 MB; if that is right, set {inputs.UNPACKED}" in error.value.args[2]


def test_aliases_that_repeat_one_another_are_refused(written):
    levels = [f"l{k}: &l{k} [{', '.join([f'*l{k - 1}'] * 9)}]" for k in range(1, 10)]
    file = written.folder / "batch.yaml"
    file.write_text("\n".join(["l0: &l0 [1]", *levels, file.read_text()]))
    assert refusals(written) == [
        f"batch.yaml: not valid YAML: its aliases repeat values to more than {MAX_VALUES}: write out what is needed"
    ]


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


def parquet_bomb(path):
    one = pa.table({"a": pa.DictionaryArray.from_arrays(pa.array([0] * 10**6, pa.int8()), pa.array([1.0]))})
    with pq.ParquetWriter(path, one.schema) as writer:
        for _ in range(13):
            writer.write_table(one)


def mat73_references(path):
    """A hundred cells that refer to one array of 8 MB."""
    with h5py.File(path, "w", userblock_size=512) as file:
        one = file.create_dataset("#refs#/a", shape=(10**6,), dtype="f8", chunks=(10**6,), compression="gzip")
        cells = file.create_dataset("cells", (100,), dtype=h5py.ref_dtype)
        cells[:] = [one.ref] * 100
        cells.attrs["MATLAB_class"] = np.bytes_("cell")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: PCWIN64".ljust(124) + b"\x00\x02IM")


def parquet_lists(path):
    """A single row: a list of 13 million numbers."""
    numbers = pa.DictionaryArray.from_arrays(pa.array(np.zeros(13 * 10**6, np.int8)), pa.array([1.0]))
    pq.write_table(pa.table({"a": pa.ListArray.from_arrays([0, len(numbers)], numbers.dictionary_decode())}), path)


@pytest.mark.parametrize(
    ("name", "make", "memory"),
    [
        ("a.h5", hdf5_bomb, 20e6),
        ("a.nc", netcdf_bomb, 20e6),
        ("a.mat", mat73_bomb, 20e6),
        ("b.mat", mat5_bomb, 20e6),
        ("c.mat", mat73_references, 110e6),  # it is read until the limit
        ("a.parquet", parquet_bomb, 20e6),
        ("b.parquet", parquet_lists, 20e6),
    ],
)
def test_what_unpacks_to_too_much_is_refused_before_it_is_read(name, make, memory, tmp_path, monkeypatch):
    monkeypatch.setenv(inputs.UNPACKED, "100")
    make(tmp_path / name)
    assert (tmp_path / name).stat().st_size < 2e6
    format = next(one for one in readers.registry().values() if (tmp_path / name).suffix in one.suffixes)
    # Arrow's memory is not Python's.
    monkeypatch.setattr(pq.ParquetFile, "read", lambda *_, **__: pytest.fail("it is read"))
    tracemalloc.start()
    try:
        # In this process: a process of its own would hide the memory it takes.
        refusal = read_here(format, tmp_path / name)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    advice = f"larger than 100 MB; if that is right, set {inputs.UNPACKED} to its MB"
    found = re.fullmatch(rf"unpacks to at least (\S+) MB, which is {advice}", refusal.args[2])
    assert float(found[1]) > 100
    assert most < memory


def test_text_of_a_parquet_file_is_not_unpacked(tmp_path):
    # 10,000 rows repeat one text of 0.1 MB, which the file holds once.
    count = 10**4
    long = pa.DictionaryArray.from_arrays(pa.array(np.zeros(count, np.int16)), pa.array(["x" * 10**5]))
    numbers = pa.array(range(count))
    columns = {"b.text": long, "a": numbers, "s": pa.StructArray.from_arrays([long, numbers], "tn")}
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    assert (tmp_path / "a.parquet").stat().st_size < 1e6
    found = readers.read_signals(tmp_path / "a.parquet")
    assert [signal.name for signal in found.signals] == ["a", "s/n"]
    assert found.remarks == ("columns without numbers are left out: b/text, s/t",)
    assert pa.default_memory_pool().max_memory() < 0.5e9


@pytest.mark.parametrize("kind", ["virtual", "external", "link.h5", "link.mat"])
def test_an_hdf5_file_reads_no_other_file(kind, tmp_path):
    secret, log = tmp_path / "secret", tmp_path / ("a.mat" if kind.endswith("mat") else "a.h5")
    with h5py.File(secret, "w") as file:
        file["s"] = np.arange(5.0)
    with h5py.File(log, "w", userblock_size=512) as file:
        if kind == "virtual":
            layout = h5py.VirtualLayout((5,), "f8")
            layout[:] = h5py.VirtualSource(str(secret), "s", (5,))
            file.create_virtual_dataset("x", layout)
        elif kind == "external":
            file.create_dataset("x", (5,), "f8", external=[(str(secret), 0, 40)])
        else:
            file["x"] = h5py.ExternalLink(str(secret), "s")
    if log.suffix == ".mat":
        with open(log, "r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file, Platform: PCWIN64".ljust(124) + b"\x00\x02IM")
    with pytest.raises(LogError, match="is in another file .*secret.*: give that file"):
        readers.read_signals(log)
