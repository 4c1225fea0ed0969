"""Pipes, devices, and files that are too large or unpack to more: each is one line, and nothing waits or fills up."""

import gzip
import os
import struct
import tracemalloc
import zlib

import h5py
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

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


@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("a.h5", hdf5_bomb),
        ("a.nc", netcdf_bomb),
        ("a.mat", mat73_bomb),
        ("b.mat", mat5_bomb),
        ("a.parquet", parquet_bomb),
    ],
)
def test_what_unpacks_to_too_much_is_refused_before_it_is_read(name, make, tmp_path, monkeypatch):
    monkeypatch.setenv(inputs.UNPACKED, "100")
    make(tmp_path / name)
    assert (tmp_path / name).stat().st_size < 2e6
    tracemalloc.start()
    try:
        with pytest.raises(LogError) as error:
            readers.read_signals(tmp_path / name)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    expected = f"unpacks to what is larger than 100 MB; if that is right, set {inputs.UNPACKED} to its MB"
    assert error.value.args[2] == expected
    assert most < 20e6
