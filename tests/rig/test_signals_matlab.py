"""MATLAB files, v5 and v7.3: arrays, structs, Simulink, ControlDesk, and objects that only MATLAB reads."""

import struct
from contextlib import contextmanager

import h5py
import numpy as np
import pytest
import sample_files as sample
from scipy.io import savemat

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import read_signals

T, X, Y = sample.TIME, sample.ANGLE, sample.TORQUE


def read(path):
    return {s.name: s for s in read_signals(path).signals}


def v5(tmp_path, **variables):
    savemat(tmp_path / "log.mat", variables, long_field_names=True)
    return tmp_path / "log.mat"


@contextmanager
def v73(path):
    """A v7.3 file: the header of MATLAB in the user block, the variables in HDF5."""
    with h5py.File(path, "w", userblock_size=512) as file:
        yield file
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: PCWIN64".ljust(124) + b"\x00\x02IM")


def put(group, name, value):
    """A value as MATLAB stores it: numbers transposed, text as codes, struct arrays as references."""
    if isinstance(value, dict):
        item = group.create_group(name)
        item.attrs["MATLAB_class"] = np.bytes_("struct")
        for key, entry in value.items():
            put(item, key, entry)
    elif isinstance(value, list):
        item = group.create_group(name)
        item.attrs["MATLAB_class"] = np.bytes_("struct")
        stored = group.file.require_group("#refs#")
        for key in value[0]:
            references = np.empty((len(value), 1), h5py.ref_dtype)
            for i, entry in enumerate(value):
                put(stored, f"{name}{key}{i}", entry[key])
                references[i, 0] = stored[f"{name}{key}{i}"].ref
            item.create_dataset(key, data=references, dtype=h5py.ref_dtype)
    elif isinstance(value, str):
        codes = np.frombuffer(value.encode("utf-16-le"), "u2")
        group.create_dataset(name, data=codes[:, None]).attrs["MATLAB_class"] = np.bytes_("char")
    else:
        values = np.atleast_2d(np.asarray(value, float))
        group.create_dataset(name, data=values.T).attrs["MATLAB_class"] = np.bytes_("double")


CONTENTS = {
    "vectors": ({"t": T[:, None], "x": X[None, :], "note": "rest"}, {"t": T, "x": X}),
    "matrix": ({"data": np.c_[T, X, Y]}, {"data/1": T, "data/2": X, "data/3": Y}),
    "matrix lying": ({"ans": np.array([T, X])}, {"ans/1": T, "ans/2": X}),
    "struct": ({"s": {"t": T[:, None], "x": X[:, None], "x_unit": "deg"}}, {"s/t": T, "s/x": X}),
    "struct with units": (
        {"s": {"x": X[:, None], "y": Y[:, None], "units": {"x": "deg", "y": "Nm"}}},
        {"s/x": X, "s/y": Y},
    ),
    "struct a signal": (
        {
            "a": {"time": T[:, None], "data": X[:, None], "unit": "deg"},
            "b": {"time": T[::2, None], "data": Y[::2, None]},
        },
        {"a": X, "b": Y[::2]},
    ),
    "scalars beside": ({"x": X, "Ts": 0.002}, {"x": X}),
}
UNITS = {"struct": {"s/x": "deg"}, "struct with units": {"s/x": "deg", "s/y": "Nm"}, "struct a signal": {"a": "deg"}}


@pytest.mark.parametrize("version", ["v5", "v7.3"])
@pytest.mark.parametrize("case", CONTENTS)
def test_arrays_and_structs(tmp_path, case, version):
    variables, expected = CONTENTS[case]
    if version == "v5":
        path = v5(tmp_path, **variables)
    else:
        path = tmp_path / "log.mat"
        with v73(path) as file:
            for name, value in variables.items():
                put(file, name, value)
    signals = read(path)
    assert signals.keys() == expected.keys()
    for name, values in expected.items():
        assert (signals[name].values == values).all()
        assert signals[name].unit == UNITS.get(case, {}).get(name, "")
    if case == "struct a signal":
        assert (signals["a"].time_s == T).all() and (signals["b"].time_s == T[::2]).all()


def structure_with_time(time=T):
    signals = [
        {"values": X[:, None], "label": "angle", "blockName": "model/Scope"},
        {"values": np.c_[X, Y], "label": "", "blockName": "model/Mux out"},
    ]
    return {"time": time[:, None], "signals": signals, "blockName": "model/Scope"}


@pytest.mark.parametrize("version", ["v5", "v7.3"])
def test_a_structure_with_time_of_simulink(tmp_path, version):
    if version == "v5":
        value = structure_with_time()
        value["signals"] = np.array(value["signals"])
        path = v5(tmp_path, ScopeData=value)
    else:
        path = tmp_path / "log.mat"
        with v73(path) as file:
            put(file, "ScopeData", structure_with_time())
    signals = read(path)
    assert signals.keys() == {"angle", "Mux out/1", "Mux out/2"}
    assert (signals["Mux out/2"].values == Y).all()
    assert all((s.time_s == T).all() for s in signals.values())


def test_a_structure_without_time(tmp_path):
    path = v5(tmp_path, out={"time": np.zeros((0, 0)), "signals": {"values": X[:, None], "label": "angle"}})
    assert read(path)["angle"].time_s is None


@pytest.mark.parametrize("version", ["v5", "v7.3"])
def test_a_capture_of_controldesk(tmp_path, version):
    path = tmp_path / "capture.mat"
    if version == "v5":
        sample.controldesk(path)
    else:
        ys = [
            {"Name": "Model Root/angle", "Data": X, "Unit": "deg", "XIndex": 1},
            {"Name": "Model Root/torque", "Data": Y, "Unit": "Nm", "XIndex": 1},
        ]
        with v73(path) as file:
            put(file, "run_001", {"X": {"Name": "time", "Data": T, "Unit": "s"}, "Y": ys})
    signals = read(path)
    assert [(s.name, s.unit) for s in signals.values()] == [("Model Root/angle", "deg"), ("Model Root/torque", "Nm")]
    assert all((s.time_s == T).all() for s in signals.values())
    assert (signals["Model Root/torque"].values == Y).all()


def test_a_capture_with_two_axes_one_of_them_a_step(tmp_path):
    xs = np.array(
        [{"Name": "slow", "Data": T[::2], "Unit": "s"}, {"Name": "fast", "Data": np.zeros(0), "Raster": 0.002}]
    )
    ys = np.array([{"Name": "angle", "Data": X[::2], "XIndex": 1}, {"Name": "torque", "Data": Y, "XIndex": 2}])
    signals = read(v5(tmp_path, capture={"X": xs, "Y": ys}))
    assert (signals["angle"].time_s == T[::2]).all()
    np.testing.assert_allclose(signals["torque"].time_s, T, atol=1e-12)


def test_a_capture_that_names_no_axis_has_the_first(tmp_path):
    xs = np.array([{"Name": "slow", "Data": T, "Unit": "s"}, {"Name": "fast", "Data": 2 * T}])
    signals = read(v5(tmp_path, capture={"X": xs, "Y": np.array([{"Name": "a", "Data": X}, {"Name": "b", "Data": X}])}))
    assert (signals["a"].time_s == T).all()


def opaque(name: str, kind: str) -> bytes:
    """A variable of a MATLAB class in a v5 file: names of variable, object system and class, then a reference."""

    def element(code, data):
        return struct.pack("<II", code, len(data)) + data + b"\0" * (-len(data) % 8)

    def matrix(*parts):
        return element(14, b"".join(parts))

    reference = matrix(
        element(6, struct.pack("<II", 13, 0)),  # class uint32
        element(5, struct.pack("<ii", 1, 1)),
        element(1, b""),
        element(6, struct.pack("<I", 0xDD000000)),
    )
    names = [element(1, text.encode()) for text in (name, "MCOS", kind)]
    return matrix(element(6, struct.pack("<II", 17, 0)), *names, reference)


@pytest.mark.parametrize(
    ("kind", "advice"),
    [
        ("timetable", "writetimetable(run1, 'log.csv')"),
        ("timeseries", "writetimetable(timeseries2timetable(run1), 'log.csv')"),
        ("Dataset", "save('log.mat', '-struct', 's')"),
    ],
)
def test_an_object_is_named_with_what_to_do(tmp_path, kind, advice):
    path = v5(tmp_path)
    path.write_bytes(path.read_bytes() + opaque("run1", kind))
    with pytest.raises(LogError) as error:
        read_signals(path)
    assert f"'run1' is a {kind} object, which only MATLAB can read" in error.value.args[2]
    assert advice in error.value.args[2]
    path = v5(tmp_path, x=X)
    path.write_bytes(path.read_bytes() + opaque("run1", kind))
    file = read_signals(path)
    assert [s.name for s in file.signals] == ["x"]
    assert f"left out: 'run1' is a {kind} object" in file.remarks[-1]


def test_an_object_of_v73_is_named(tmp_path):
    path = tmp_path / "log.mat"
    with v73(path) as file:
        item = file.create_dataset("tt", data=np.zeros((1, 6), "u4"))
        item.attrs["MATLAB_class"], item.attrs["MATLAB_object_decode"] = np.bytes_("timetable"), 3
    with pytest.raises(LogError) as error:
        read_signals(path)
    assert "'tt' is a timetable object" in error.value.args[2]


def test_only_text_and_scalars_hold_no_signals(tmp_path):
    with pytest.raises(LogError) as error:
        read_signals(v5(tmp_path, Ts=0.002, note="rest", empty=np.zeros((0, 0))))
    assert "holds no signals of numbers" in error.value.args[2] and "Ts" in error.value.args[2]
