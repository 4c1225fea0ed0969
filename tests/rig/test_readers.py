"""Log readers: a new format needs one module, and the checks of a log are the same for all formats."""

from importlib import import_module
from pkgutil import iter_modules

import h5py
import numpy as np
import pandas as pd
import pytest
from asammdf import MDF, Signal
from made_up_batch import table
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

from ccmodel.rig import readers
from ccmodel.rig.findings import LogError
from ccmodel.rig.ingest import ingest_batch
from ccmodel.rig.readers.columns import Columns
from ccmodel.rig.readers.mat import _axis_of_capture
from ccmodel.rig.readers.stamps import seconds_of_stamps


def test_every_module_of_the_folder_with_a_format_is_registered():
    modules = {m.name for m in iter_modules(readers.__path__)}
    assert readers.registry().keys() == {
        m for m in modules if hasattr(import_module(f"{readers.__name__}.{m}"), "FORMAT")
    }
    assert {"hdf5", "mat", "mdf", "parquet", "ros", "tdms", "text"} == readers.registry().keys()


def write_mat(table, path):
    savemat(path, {name: table[name].to_numpy() for name in table})


def write_hdf5(table, path):
    with h5py.File(path, "w") as file:
        for name in table:
            file[f"rig/{name}"] = table[name].to_numpy()


def write_mdf(table, path):
    """Time is the group's own time axis and no channel."""
    with MDF(version="4.10") as file:
        time = table["time_s"].to_numpy()
        file.append([Signal(table[name].to_numpy(), time, name=name) for name in table if name != "time_s"])
        file.save(path, overwrite=True)


def write_tdms(table, path):
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("log", name, table[name].to_numpy()) for name in table])


def write_parquet(table, path):
    table.to_parquet(path)


WRITERS = {".parquet": write_parquet, ".mat": write_mat, ".h5": write_hdf5, ".mf4": write_mdf, ".tdms": write_tdms}


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_format_gives_the_same_recording(bench, suffix):
    plain = ingest_batch(bench.write().folder).recordings
    for entry in bench.described["recordings"]:
        entry["file"] = f"{entry['id']}{suffix}"
        WRITERS[suffix](bench.tables[entry["id"]], bench.folder / entry["file"])
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    for one, other in zip(plain, ingested.recordings, strict=True):
        assert one.channels.keys() == other.channels.keys()
        assert all((one[c] == other[c]).all() for c in one.channels)


def test_signals_without_a_common_time_are_for_the_import(bench):
    log = table()
    with MDF(version="4.10") as file:
        for name in ("drive_encoder_counts", "load_encoder_counts"):
            step = 1 if name.startswith("drive") else 2
            file.append([Signal(log[name].to_numpy()[::step], log["time_s"].to_numpy()[::step], name=name)])
        file.save(bench.folder / "one.mf4", overwrite=True)
    with pytest.raises(LogError) as error:
        readers.read(bench.folder / "one.mf4")
    assert "different lengths (200 to 400 samples)" in error.value.args[2]
    assert "ccmodel import" in error.value.args[2]
    write_mat(log.drop(columns="time_s"), bench.folder / "one.mat")
    with pytest.raises(LogError) as error:
        readers.read(bench.folder / "one.mat")
    assert "none is named time_s" in error.value.args[2] and "ccmodel import" in error.value.args[2]


@pytest.mark.parametrize(
    ("column", "unit", "is_refused"),
    [
        ("theta_in_rad", "deg", True),
        ("theta_in_rad", "rad", False),
        ("theta_in_rad", "N", True),
        ("F_drive_N", "mN", True),
        ("time_s", "ms", True),
        ("time_s", "s", False),
        ("time_s", "seconds since 2024-05-31 12:00:00", False),
        ("time_s", "milliseconds since 2024-05-31 12:00:00", True),
        ("theta_in_rad", "grad", True),
        ("theta_in_rad", "milliNewtonmeter", True),
        ("theta_in_rad", "no unit at all", True),
        ("theta_in_rad", "none", False),
        ("theta_in_rad", "[-]", False),
        ("own_name", "deg", False),
    ],
)
def test_a_unit_that_the_name_of_a_column_contradicts_is_refused(column, unit, is_refused, tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for name in {"time_s": None, column: None}:
            file[name] = np.linspace(0.0, 1.0, 50)
        file[column].attrs["units"] = unit
    if not is_refused:
        assert len(readers.read(tmp_path / "log.h5")) == 50
        return
    with pytest.raises(LogError) as refused:
        readers.read(tmp_path / "log.h5")
    assert refused.value.defect.column == column
    assert f"states its unit as '{unit}'" in refused.value.defect.text
    assert "ccmodel import" in refused.value.defect.text


def test_the_checks_name_the_rows_of_the_format(bench):
    bench.described["recordings"][0]["file"] = "one.parquet"
    table(seed=1).drop(index=range(100, 150)).to_parquet(bench.folder / "one.parquet")
    (finding,) = ingest_batch(bench.write().folder).findings
    assert (finding.row, finding.column) == (101, "time_s")
    assert "a gap of 0.204 s" in finding.text


@pytest.mark.parametrize("name", ["ONE.CSV", "one.txt", "one"])
def test_a_log_of_an_unknown_suffix_is_read_as_csv(bench, name):
    bench.write().log().rename(bench.folder / name)
    raw = readers.read(bench.folder / name)
    assert list(raw.columns) == list(bench.tables["one"].columns)
    assert raw.index[0] == 2


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(LogError, match="there is no such file"):
        readers.read(tmp_path / "nowhere.csv")


@pytest.mark.parametrize(("shape", "samples", "signals"), [((2, 3), 2, 3), ((3, 2), 2, 3), ((2, 3), 3, 2)])
def test_the_time_axis_says_which_side_of_a_matrix_are_its_samples(shape, samples, signals):
    columns = Columns()
    columns.add("m", "N", np.zeros(shape), np.arange(samples))
    assert [signal.values.size for signal in columns.signals] == [samples] * signals


def test_a_capture_without_an_axis_or_numbers_has_no_times():
    axis = {"Raster": np.array([0.1])}
    assert _axis_of_capture(axis, None) is None
    assert _axis_of_capture(None, np.zeros(3)) is None
    assert _axis_of_capture(axis, np.zeros(3)).tolist() == pytest.approx([0.0, 0.1, 0.2])


def test_the_first_stamp_that_cannot_be_read_is_named():
    with pytest.raises(LogError) as refused:
        seconds_of_stamps([pd.Series(["2024-13-45 1:00", "2024-14-45 2:00"])])
    assert "times such as '2024-13-45 1:00' cannot be read" in refused.value.defect.text
