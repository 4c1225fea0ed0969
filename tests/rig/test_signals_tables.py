"""MDF, TDMS, Parquet and HDF5: values, units and times come back as they were written."""

from datetime import timedelta

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import sample_files as sample
import xarray as xr
from asammdf import MDF, Signal
from nptdms import ChannelObject, GroupObject, TdmsWriter

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import read_signals

T, X, Y = sample.TIME, sample.ANGLE, sample.TORQUE


def by_name(file):
    return {s.name: s for s in file.signals}


@pytest.mark.parametrize("compression", [0, 1, 2])
def test_mdf(tmp_path, compression):
    file = read_signals(sample.mdf4(tmp_path / "log.mf4", compression))
    assert [(s.name, s.unit) for s in file.signals] == [("fast/angle", "deg"), ("fast/torque", "Nm")]
    assert file.started == sample.STARTED
    for signal, values in zip(file.signals, (X, Y), strict=True):
        assert (signal.values == values).all() and (signal.time_s == T).all()


@pytest.mark.parametrize(("version", "name"), [("3.30", "log.mdf"), ("4.10", "log.dat"), ("4.20", "log.mf4")])
def test_mdf_of_several_rates_states_and_text(tmp_path, version, name):
    slow = T[::5]
    with MDF(version=version) as file:
        file.header.start_time = sample.STARTED
        file.append([Signal(X, T, name="angle", unit="deg")])
        gear = {"val_0": 0, "text_0": b"off", "val_1": 1, "text_1": b"on"}
        switch = np.arange(len(slow), dtype="u1") % 2
        words = np.array([b"a", b"b"] * (len(slow) // 2), "S8")
        file.append(
            [
                Signal(switch, slow, name="switch", conversion=gear),
                Signal(np.arange(len(slow), dtype="i2"), slow, name="count", conversion={"a": 0.5, "b": 1.0}),
                Signal(words, slow, name="words", encoding="utf-8"),
            ]
        )
        path = file.save(tmp_path / "saved", overwrite=True)
    file = read_signals(path.rename(tmp_path / name))
    signals = by_name(file)
    assert signals.keys() == {"angle", "switch", "count"}
    assert (signals["switch"].values == switch).all() and (signals["switch"].time_s == slow).all()
    assert (signals["count"].values == 0.5 * np.arange(len(slow)) + 1).all()
    assert any("words" in remark for remark in file.remarks)


def test_mdf_invalid_samples_are_nan(tmp_path):
    invalid = np.zeros(len(T), bool)
    invalid[7] = True
    with MDF(version="4.10") as file:
        file.append([Signal(X, T, name="angle", invalidation_bits=invalid)])
        file.save(tmp_path / "log.mf4", overwrite=True)
    (signal,) = read_signals(tmp_path / "log.mf4").signals
    assert np.flatnonzero(np.isnan(signal.values)).tolist() == [7] or len(signal.values) == len(T) - 1


@pytest.mark.parametrize(("name", "sync"), [("angle", 2), ("distance", 3), ("index", 4)])
def test_a_master_of_mdf_that_is_no_time_is_a_signal(tmp_path, name, sync):
    with MDF(version="4.10") as file:
        file.append([Signal(Y, 0.5 * X, name="torque", unit="Nm", master_metadata=(name, sync))])
        file.save(tmp_path / "log.mf4", overwrite=True)
    signals = by_name(read_signals(tmp_path / "log.mf4"))
    assert signals.keys() == {name, "torque"}
    assert (signals[name].values == 0.5 * X).all() and (signals["torque"].values == Y).all()
    assert all(signal.time_s is None for signal in signals.values())


def test_tdms(tmp_path):
    file = read_signals(sample.tdms(tmp_path / "log.tdms"))
    assert [(s.name, s.unit) for s in file.signals] == [("rig/angle", "deg"), ("rig/torque", "Nm")]
    assert file.started == sample.STARTED
    for signal, values in zip(file.signals, (X, Y), strict=True):
        assert (signal.values == values).all()
        np.testing.assert_allclose(signal.time_s, T, atol=1e-12)


def test_tdms_channels_that_start_later_time_stamps_and_text(tmp_path):
    start = np.datetime64("2024-05-31T12:00:00")
    stamps = start.astype("M8[us]") + (1e6 * T).astype("m8[us]")
    with TdmsWriter(tmp_path / "log.tdms") as writer:
        writer.write_segment(
            [
                GroupObject("g", properties={"operator": "A. B."}),
                ChannelObject("g", "a", X, {"wf_increment": 0.002, "wf_start_time": start}),
                ChannelObject("g", "b", Y, {"wf_increment": 0.002, "wf_start_time": start + np.timedelta64(500, "ms")}),
                ChannelObject("g", "c", X.astype("i2")),
                ChannelObject("g", "at", stamps),
                ChannelObject("g", "note", ["x", "y"]),
            ]
        )
    file = read_signals(tmp_path / "log.tdms")
    signals = by_name(file)
    assert signals.keys() == {"g/a", "g/b", "g/c", "g/at"}
    np.testing.assert_allclose(signals["g/b"].time_s - signals["g/a"].time_s, 0.5, atol=1e-9)
    assert signals["g/c"].time_s is None and file.started == sample.STARTED
    np.testing.assert_allclose(signals["g/at"].values, T, atol=1e-9)
    assert signals["g/at"].unit == "s" and any("g/note" in remark for remark in file.remarks)


def stamps(late_s):
    """The times of the samples as absolute ones, from a time after the start of the recording on."""
    return np.datetime64("2024-05-31T12:00:00", "us") + np.round(1e6 * (T + late_s)).astype("m8[us]")


def test_tdms_columns_of_absolute_time_have_one_zero(tmp_path):
    waveform = {"wf_increment": 0.002, "wf_start_time": np.datetime64("2024-05-31T12:00:00.500")}
    with TdmsWriter(tmp_path / "log.tdms") as writer:
        channels = [ChannelObject("drive", "at", stamps(0.25)), ChannelObject("load", "at", stamps(0.0))]
        writer.write_segment([*channels, ChannelObject("load", "torque", Y, waveform)])
    file = read_signals(tmp_path / "log.tdms")
    signals = by_name(file)
    assert file.started == sample.STARTED
    assert signals["drive/at"].since_start and signals["load/at"].since_start
    np.testing.assert_allclose(signals["drive/at"].values, T + 0.25, atol=1e-9)
    np.testing.assert_allclose(signals["load/at"].values, T, atol=1e-9)
    np.testing.assert_allclose(signals["load/torque"].time_s, T + 0.5, atol=1e-9)


def test_a_waveform_of_tdms_without_a_start_is_named(tmp_path):
    """The zero of LabVIEW's clock, which it writes where no start is set, is none."""
    unset = {"wf_increment": 0.002, "wf_start_time": np.datetime64("1904-01-01T00:00:00")}
    with TdmsWriter(tmp_path / "log.tdms") as writer:
        writer.write_segment([ChannelObject("g", "a", X, unset), ChannelObject("g", "at", stamps(0.0))])
    file = read_signals(tmp_path / "log.tdms")
    assert file.started == sample.STARTED
    np.testing.assert_allclose(by_name(file)["g/a"].time_s, T, atol=1e-9)
    assert "waveforms without a start are taken to begin at the file's earliest time: g/a" in file.remarks


def test_parquet(tmp_path):
    file = read_signals(sample.parquet(tmp_path / "log.parquet"))
    assert [(s.name, s.unit) for s in file.signals] == [("time", "s"), ("angle", "deg"), ("torque", "Nm")]
    assert all((s.values == v).all() for s, v in zip(file.signals, (T, X, Y), strict=True))


def test_parquet_of_pandas_with_a_time_index_and_other_columns(tmp_path):
    index = pd.DatetimeIndex([sample.STARTED + timedelta(seconds=t) for t in T], name="at")
    table = pd.DataFrame({"angle [deg]": X, "on": X > 0, "state": "RUN", "gap": np.where(X > 29, np.nan, Y)}, index)
    table.to_parquet(tmp_path / "log.parquet")
    file = read_signals(tmp_path / "log.parquet")
    signals = by_name(file)
    assert signals.keys() == {"angle", "on", "gap", "at"}
    assert signals["angle"].unit == "deg" and file.started == sample.STARTED
    np.testing.assert_allclose(signals["at"].values, T, atol=1e-9)
    np.testing.assert_array_equal(signals["gap"].values, table["gap"])
    assert signals["on"].values.tolist() == (X > 0).tolist()
    assert any("state" in remark for remark in file.remarks)


def test_parquet_columns_of_absolute_time_have_one_zero(tmp_path):
    late = stamps(0.25)
    late[[0, 7]] = np.datetime64("NaT")
    table = pd.DataFrame({"at_drive": late, "angle": X, "at_load": stamps(0.0), "torque": Y})
    table["at_category"] = table["at_drive"].astype("category")
    table.to_parquet(tmp_path / "log.parquet")
    file = read_signals(tmp_path / "log.parquet")
    signals = by_name(file)
    assert file.started == sample.STARTED
    expected = np.where(np.isnat(late), np.nan, T + 0.25)
    for name, times in (("at_drive", expected), ("at_category", expected), ("at_load", T)):
        assert signals[name].since_start
        np.testing.assert_allclose(signals[name].values, times, atol=1e-9)


def test_parquet_without_a_single_absolute_time_has_no_start(tmp_path):
    pd.DataFrame({"at": np.full(T.size, np.datetime64("NaT", "us")), "angle": X}).to_parquet(tmp_path / "log.parquet")
    file = read_signals(tmp_path / "log.parquet")
    assert file.started is None and np.isnan(by_name(file)["at"].values).all()


def test_parquet_of_nested_columns(tmp_path):
    columns = {
        "drive": pa.array([{"angle": x, "torque": y} for x, y in zip(X, Y, strict=True)]),
        "pair": pa.array([[x, y] for x, y in zip(X, Y, strict=True)], pa.list_(pa.float64(), 2)),
        "elapsed": pa.array((1e6 * T).astype("i8"), pa.duration("us")),
    }
    pq.write_table(pa.table(columns), tmp_path / "log.pq")
    signals = by_name(read_signals(tmp_path / "log.pq"))
    assert signals.keys() == {"drive/angle", "drive/torque", "pair/0", "pair/1", "elapsed"}
    assert (signals["drive/torque"].values == Y).all() and (signals["pair/1"].values == Y).all()
    np.testing.assert_allclose(signals["elapsed"].values, T, atol=1e-12)


def test_hdf5(tmp_path):
    file = read_signals(sample.hdf5(tmp_path / "log.h5"))
    assert {s.name: s.unit for s in file.signals} == {"rig/time": "s", "rig/angle": "deg", "rig/torque": "Nm"}
    signals = by_name(file)
    assert (signals["rig/torque"].values == Y).all() and (signals["rig/torque"].time_s == T).all()


def test_hdf5_columns_records_and_what_is_left_out(tmp_path):
    with h5py.File(tmp_path / "log.hdf5", "w") as file:
        file["a/b/both"] = np.c_[X, Y]
        file["records"] = np.array(list(zip(T, X, strict=True)), [("t", "f8"), ("x", "f4")])
        file["note"] = "made by hand"
        file["rate"] = 500.0
        file["picture"] = np.zeros((100, 100))
        file["again"] = file["a"]
        file["a/self"] = file["a"]
    file = read_signals(tmp_path / "log.hdf5")
    signals = by_name(file)
    assert {"a/b/both/1", "a/b/both/2", "records/t", "records/x"} <= signals.keys()
    assert (signals["a/b/both/2"].values == Y).all() and (signals["records/x"].values == X.astype("f4")).all()
    said = " ".join(file.remarks)
    assert all(name in said for name in ("note", "rate", "picture"))


def test_netcdf_time_in_milliseconds(tmp_path):
    netcdf = pytest.importorskip("netCDF4")
    with netcdf.Dataset(tmp_path / "log.nc", "w") as file:
        file.createDimension("time", len(T))
        file.createVariable("time", "f8", ("time",)).units = "ms since 2024-05-31 12:00"
        file["time"][:] = 1e3 * T
        file.createVariable("angle", "f8", ("time",)).units = "deg"
        file["angle"][:] = X
    angle = by_name(read_signals(tmp_path / "log.nc"))["angle"]
    assert angle.unit == "deg" and (angle.values == X).all()
    np.testing.assert_allclose(angle.time_s, T, atol=1e-12)


def test_packed_and_missing_values_of_netcdf(tmp_path):
    """A file that xarray writes with its own packing: read as xarray reads it, with nan where a value is missing."""
    torque, force = Y.copy(), 7.0 + X
    torque[3], force[[5, 6]] = np.nan, np.nan
    table = xr.Dataset(
        {"torque": ("time", torque, {"units": "N*m"}), "force": ("time", force, {"units": "N"})},
        coords={"time": ("time", 1e3 * T, {"units": "ms"})},
    )
    packing = {
        "torque": {"dtype": "int16", "scale_factor": 1e-3, "add_offset": 0.01, "_FillValue": -32768},
        "force": {"_FillValue": 9.96921e36},
        "time": {"dtype": "int32", "scale_factor": 0.5, "_FillValue": None},
    }
    table.to_netcdf(tmp_path / "log.nc", encoding=packing)
    file = read_signals(tmp_path / "log.nc")
    signals = by_name(file)
    for name, expected, tolerance in (("torque", torque, 5.1e-4), ("force", force, 0.0)):
        np.testing.assert_allclose(signals[name].values, expected, rtol=0, atol=tolerance)
        np.testing.assert_allclose(signals[name].time_s, T, rtol=0, atol=2.6e-4)
    (remark,) = file.remarks
    assert "scale_factor" in remark and "torque" in remark and "force" not in remark


def test_links_that_lead_nowhere_are_named(tmp_path):
    for link, said in (
        (h5py.ExternalLink("other.h5", "/x"), "is in another file (other.h5)"),
        (h5py.SoftLink("/gone"), "is a link to '/gone', which is not in the file"),
    ):
        with h5py.File(tmp_path / "log.h5", "w") as file:
            file["x"], file["y"] = X, link
        with pytest.raises(LogError) as error:
            read_signals(tmp_path / "log.h5")
        assert said in error.value.args[2]
