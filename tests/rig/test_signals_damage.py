"""Damaged files of every format: each is read, or refused in one clear line that says what to do."""

import gzip
import struct
import subprocess
import sys

import numpy as np
import pytest
import sample_files as sample

from ccmodel import inputs
from ccmodel.rig import readers
from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import apart, read_signals, signatures

FORMATS = {
    "log.csv": "text file",
    "semicolons.txt": "text file",
    "v5.mat": "MATLAB file",
    "controldesk.mat": "MATLAB file",
    "v73.mat": "MATLAB file",
    "log.mf4": "MDF file",
    "log.tdms": "TDMS file",
    "log.parquet": "Parquet file",
    "log.h5": "HDF5 file",
    "log.bag": "ROS bag",
    "log.mcap": "ROS bag",
    "log.db3": "ROS bag",
}
TEXT = ("log.csv", "semicolons.txt")
# Words of which each refusal has one: what to do.
REMEDIES = """copy it again|rename it|record it again|export it|is no table|save it|reindex|give the|fetch|unpack
|must be stated|if that is right""".replace("\n", "").split("|")


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """The bytes of a sound file of each format."""
    folder = tmp_path_factory.mktemp("sound")
    return {name: write(folder / name).read_bytes() for name, write in sample.WRITERS.items()}


def refusal(path) -> str | None:
    """The line of the refusal; None if the file is read."""
    try:
        file = read_signals(path)
    except LogError as error:
        row, column, text = error.args
        assert row is None or row > 0
        assert column is None or isinstance(column, str)
        assert text and "\n" not in text and len(text) < 400 and "Traceback" not in text
        assert any(remedy in text for remedy in REMEDIES), text
        return text
    assert file.signals and all(s.values.ndim == 1 and s.values.dtype == float for s in file.signals)
    assert all(s.time_s is None or s.time_s.shape == s.values.shape for s in file.signals)
    return None


def overwritten(raw: bytes) -> bytes:
    return np.random.default_rng(0).bytes(min(1024, len(raw))) + raw[1024:]


CUTS = {"cut in half": lambda raw: raw[: len(raw) // 2], "cut near the end": lambda raw: raw[:-100]}
GONE = {
    "first KB overwritten": overwritten,
    "first KB zero": lambda raw: bytes(min(1024, len(raw))) + raw[1024:],
    "empty": lambda raw: b"",
    "only zeros": lambda raw: bytes(len(raw)),
    "a byte": lambda raw: raw[:1],
}


@pytest.mark.parametrize("damage", CUTS)
@pytest.mark.parametrize("name", FORMATS)
def test_a_cut_file_is_refused_by_its_format(sound, tmp_path, name, damage):
    (tmp_path / name).write_bytes(CUTS[damage](sound[name]))
    said = refusal(tmp_path / name)
    if name in TEXT:
        # A text may end after any row; the row that is cut is not used.
        file = read_signals(tmp_path / name)
        assert said is None and "may be cut and is left out" in " ".join(file.remarks)
        assert (file.signals[1].values == sample.ANGLE[: len(file.signals[1].values)]).all()
    else:
        assert said is not None and FORMATS[name] in said and "cut short" in said


@pytest.mark.parametrize("damage", GONE)
@pytest.mark.parametrize("name", FORMATS)
def test_a_file_without_its_beginning_is_refused(sound, tmp_path, name, damage):
    (tmp_path / name).write_bytes(GONE[damage](sound[name]))
    said = refusal(tmp_path / name)
    if name == "log.parquet" and damage.startswith("first KB"):
        return  # a table may begin anywhere in the file
    assert said is not None
    if damage == "empty":
        assert "is empty" in said


@pytest.mark.parametrize("name", FORMATS)
def test_a_file_of_another_ending_is_called_by_its_format(sound, tmp_path, name):
    for ending in (".csv", ".mat", ".tdms"):
        path = tmp_path / f"renamed{ending}"
        path.write_bytes(sound[name])
        if (name in TEXT and ending == ".csv") or ending == "." + name.rpartition(".")[2]:
            continue
        said = refusal(path)
        assert said is not None and said.startswith("is ") and "rename it to ." in said
        assert signatures.kind_of(path).text in said


@pytest.mark.parametrize("name", FORMATS)
def test_without_an_ending_a_file_is_read_by_its_first_bytes(sound, tmp_path, name):
    (tmp_path / "log").write_bytes(sound[name])
    said = refusal(tmp_path / "log")
    # The library of bags goes by the ending.
    assert said is None if FORMATS[name] != "ROS bag" else "rename it to ." + name.rpartition(".")[2] in said


@pytest.fixture
def child(monkeypatch):
    """Let another process than the usual one read what is read apart."""

    def replaced(code):
        monkeypatch.setattr(apart, "_CHILD", code)
        monkeypatch.setattr(apart, "_apart", apart._Apart())

    return replaced


def reading(function: str) -> str:
    """Code of a process that calls another function than `read_here`."""
    return f"import os, time; from ccmodel.rig.readers import apart; apart.read_here = {function}; apart._main()"


@pytest.mark.parametrize(
    "code",
    [
        "import os; os.abort()",
        reading("lambda *_: os.abort()"),
        reading("lambda *_: os.kill(os.getpid(), 9)"),
        reading("lambda *_: os._exit(0)"),
        reading("lambda *_: exit(0)"),
    ],
)
def test_a_library_that_ends_the_process_is_one_line(tmp_path, child, code):
    (tmp_path / "log.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    child(code)
    for _ in range(2):
        assert refusal(tmp_path / "log.h5") == (
            "the HDF5 file is cut short or damaged (its library fails on it): copy it again from the recorder"
        )


@pytest.mark.parametrize("code", ["import time; time.sleep(60)", reading("lambda *_: time.sleep(60)")])
def test_a_library_that_waits_is_one_line(tmp_path, child, monkeypatch, code):
    (tmp_path / "log.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    child(code)
    monkeypatch.setattr(apart, "_PATIENCE_S", 0.2)
    assert "not read after 0 s" in refusal(tmp_path / "log.h5")


def test_a_library_that_goes_round_in_circles_is_one_line(sound, tmp_path, child, monkeypatch):
    (tmp_path / "log.h5").write_bytes(sound["log.h5"])
    child(reading("lambda *_: any(iter(int, 1))"))
    monkeypatch.setattr(apart, "_COMPUTING_S", 3.0)
    assert "(not read after 3 s of computing)" in refusal(tmp_path / "log.h5")


UNLESS_NAMED_END = "lambda format, path: os.abort() if path.name == 'end.h5' else usual(format, path)"


def test_a_process_reads_file_after_file_and_starts_again_after_it_has_failed(sound, tmp_path, child):
    (tmp_path / "log.h5").write_bytes(sound["log.h5"])
    (tmp_path / "end.h5").write_bytes(sound["log.h5"])
    child("from ccmodel.rig.readers import apart; usual = apart.read_here; " + reading(UNLESS_NAMED_END))
    assert refusal(tmp_path / "log.h5") is None
    first = apart._apart._process
    assert refusal(tmp_path / "log.h5") is None
    assert apart._apart._process is first
    assert "its library fails" in refusal(tmp_path / "end.h5")
    assert refusal(tmp_path / "log.h5") is None
    assert apart._apart._process is not first


def test_where_no_process_can_be_forked_each_file_has_one(sound, tmp_path, child, monkeypatch):
    (tmp_path / "log.h5").write_bytes(sound["log.h5"])
    monkeypatch.setattr(apart, "_FORKS", False)
    child("from ccmodel.rig.readers import apart; apart._FORKS = False; apart._main()")
    for _ in range(2):
        assert refusal(tmp_path / "log.h5") is None
    child("import os; from ccmodel.rig.readers import apart; apart._FORKS = False; " + reading("lambda *_: os.abort()"))
    assert "its library fails" in refusal(tmp_path / "log.h5")


def test_modules_in_the_users_folder_are_not_imported(sound, tmp_path):
    (tmp_path / "log.h5").write_bytes(sound["log.h5"])
    for name in ("h5py", "pickle", "numpy"):
        (tmp_path / f"{name}.py").write_text("from pathlib import Path; Path('run').touch(); raise ImportError")
    code = "from ccmodel.rig.readers import read_signals; read_signals('log.h5')"
    search = ":".join(filter(None, sys.path))
    subprocess.run([sys.executable, "-P", "-c", code], cwd=tmp_path, env={"PYTHONPATH": search}, check=True)
    assert not (tmp_path / "run").exists()


def test_a_library_that_cannot_be_loaded_says_why(sound, tmp_path):
    (tmp_path / "log.h5").write_bytes(sound["log.h5"])
    (tmp_path / "old").mkdir()
    (tmp_path / "old/h5py.py").write_text("raise ValueError('numpy.dtype size changed, may indicate incompatibility')")
    code = "from ccmodel.rig.readers import read_signals; read_signals('log.h5')"
    search = ":".join([str(tmp_path / "old"), *filter(None, sys.path)])
    command = [sys.executable, "-c", code]
    child = subprocess.run(command, cwd=tmp_path, env={"PYTHONPATH": search}, capture_output=True, text=True)
    assert "numpy.dtype size changed" in child.stderr


@pytest.mark.parametrize("limit_s", [2, 100])
def test_an_inherited_limit_of_computing_is_kept(limit_s):
    code = f"""
import resource
from ccmodel.rig.readers.apart import limit_computing
resource.setrlimit(resource.RLIMIT_CPU, ({limit_s}, {limit_s}))
limit_computing(8)
print(*resource.getrlimit(resource.RLIMIT_CPU))
"""
    environment = {"PYTHONPATH": ":".join(filter(None, sys.path))}
    said = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert said.stdout.split() == [str(min(8, limit_s)), str(min(9, limit_s))]


def test_a_file_is_read_with_the_limits_of_the_time(sound, tmp_path, monkeypatch):
    (tmp_path / "log.h5").write_bytes(sound["log.h5"])
    assert refusal(tmp_path / "log.h5") is None
    monkeypatch.setenv(inputs.UNPACKED, "0.0001")
    assert inputs.UNPACKED in refusal(tmp_path / "log.h5")


def test_what_an_interrupted_reading_still_gives_answers_no_other(sound, tmp_path, monkeypatch):
    (tmp_path / "log.h5").write_bytes(sound["log.h5"])
    monkeypatch.setattr(apart.pickle, "load", interrupted)
    with pytest.raises(KeyboardInterrupt):
        refusal(tmp_path / "log.h5")
    monkeypatch.undo()
    assert apart._apart._process is None
    assert refusal(tmp_path / "log.h5") is None


def interrupted(stream):
    raise KeyboardInterrupt


def test_an_mdf_file_with_records_of_a_huge_length_is_refused_at_once(sound, tmp_path):
    raw = bytearray(sound["log.mf4"])
    # Bytes for marks of invalid samples in each record: asammdf would take minutes over them.
    struct.pack_into("<I", raw, raw.find(b"##CG") + 100, 0xEE000000)
    (tmp_path / "log.mf4").write_bytes(raw)
    assert refusal(tmp_path / "log.mf4").startswith("unpacks to 1996489 MB or more")


LIBRARIES = {"h5py": "hdf5", "asammdf": "mdf", "nptdms": "tdms", "rosbags": "ros"}
FILES = {"h5py": "log.h5", "asammdf": "log.mf4", "nptdms": "log.tdms", "rosbags": "log.bag"}


@pytest.mark.parametrize("library", LIBRARIES)
def test_a_missing_library_is_named_with_its_extra(sound, tmp_path, library):
    path = tmp_path / FILES[library]
    path.write_bytes(sound[FILES[library]])
    (tmp_path / "hide").mkdir()
    (tmp_path / f"hide/{library}.py").write_text(f"raise ModuleNotFoundError('no', name='{library}')")
    code = "import sys; from ccmodel.rig.readers import read_signals; read_signals(sys.argv[1])"
    search = ":".join([str(tmp_path / "hide"), *filter(None, sys.path)])
    child = subprocess.run(
        [sys.executable, "-c", code, path], env={"PYTHONPATH": search}, capture_output=True, text=True
    )
    assert f"needs the library {library}: in a copy of ccmodel: pip install '.[{LIBRARIES[library]}]'" in child.stderr
    assert "During handling" not in child.stderr


OTHERS = {
    "xlsx": (b"PK\x03\x04" + bytes(20) + b"[Content_Types].xml xl/workbook.xml", "an Excel workbook (xlsx)", "as CSV"),
    "zip": (b"PK\x03\x04" + bytes(60), "a zip archive", "unpack it"),
    "xls": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(60), "an old Excel workbook (xls)", "as CSV"),
    "png": (b"\x89PNG\r\n\x1a\n" + bytes(60), "a PNG picture", "give the log itself"),
    "pdf": (b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n", "a PDF document", "give the log itself"),
    "arrow": (b"ARROW1\0\0" + bytes(60), "an Arrow (Feather) file", "save it as Parquet"),
    "npy": (b"\x93NUMPY\x01\0v\0" + bytes(60), "a NumPy array (npy)", "save it as"),
    "netcdf": (b"CDF\x01" + bytes(60), "a classic netCDF file", "save it as"),
    "blf": (b"LOGG" + bytes(60), "a Vector BLF file", "save it as MDF4"),
    "sqlite": (b"SQLite format 3\0" + bytes(60), "an SQLite database without a ROS 2 bag", "as CSV"),
    "web page": (b"<!DOCTYPE html>\n<html></html>\n", "a web page", "give the log itself"),
    "pointer": (b"version https://git-lfs.github.com/spec/v1\noid x\nsize 12345\n", "Git LFS", "git lfs pull"),
    "index": (b"TDSh" + bytes(60), "the index of a TDMS file", "give the .tdms file"),
    "gzipped mat": (gzip.compress(b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM"), "gzipped", "unpack it first"),
}


@pytest.mark.parametrize("case", OTHERS)
def test_a_file_of_no_log_format_is_called_by_its_name(tmp_path, case):
    raw, called, advice = OTHERS[case]
    (tmp_path / "log.csv").write_bytes(raw)
    for read in (read_signals, readers.read):
        with pytest.raises(LogError) as error:
            read(tmp_path / "log.csv")
        row, _, text = error.value.args
        assert row is None and called in text and advice in text


@pytest.mark.parametrize("name", [name for name in FORMATS if name not in TEXT])
def test_the_strict_reader_of_logs_calls_a_binary_by_its_format(sound, tmp_path, name):
    (tmp_path / "log.csv").write_bytes(sound[name])
    with pytest.raises(LogError) as error:
        readers.read(tmp_path / "log.csv")
    assert ", not text: rename it to ." in error.value.args[2] and "damaged" not in error.value.args[2]


@pytest.mark.parametrize("word", ["LOGGER", "PAR1", "ORC", "MDF", "BZh", "Rar!", "TDSm", "CDF"])
def test_a_text_that_begins_like_another_format_is_a_text(tmp_path, word):
    (tmp_path / "log.csv").write_text(f"{word};x\n0;1\n1;2\n2;3\n")
    assert [s.name for s in read_signals(tmp_path / "log.csv").signals] == [word, "x"]


def test_a_missing_file_is_named(tmp_path):
    for name in ("log.csv", "log.mf4", "log.bag"):
        with pytest.raises(LogError, match="there is no such file"):
            read_signals(tmp_path / name)


NO_LOGS = {
    "prose": "Dear colleague,\nthe rig was not ready today.\n",
    "a single row": "size 12345\n",
    "names only": "t,x\n",
    "strings": "t,x\na,b\nc,d\n",
    "blank": "\n \n\t\n",
}


@pytest.mark.parametrize("case", NO_LOGS)
def test_a_text_that_is_no_log_is_refused(tmp_path, case):
    (tmp_path / "log.csv").write_text(NO_LOGS[case])
    with pytest.raises(LogError) as error:
        read_signals(tmp_path / "log.csv")
    assert "no rows of numbers" in error.value.args[2] or "is empty" in error.value.args[2]
