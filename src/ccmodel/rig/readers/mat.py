"""MATLAB files: v5 (scipy) and v7.3 (HDF5), from MATLAB, Simulink and dSPACE ControlDesk.

Both versions are read into plain data first: a struct is a dict, a struct array or a cell array a list, a text a str,
an object of a MATLAB class an `_Object`. Then signals are looked for in the same way.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple, TypeGuard

import numpy as np

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import mat5_size, signatures
from ccmodel.rig.readers.attempt import COPY
from ccmodel.rig.readers.columns import Columns
from ccmodel.rig.readers.content import Unpacked
from ccmodel.rig.readers.contract import Format, SignalFile
from ccmodel.rig.readers.hdf5 import size_of

_TIME_KEYS = ("time", "Time", "t")
_DATA_KEYS = ("data", "Data", "values", "Values", "value", "Value")
_UNIT_KEYS = ("unit", "Unit", "units", "Units")
_NAME_KEYS = ("name", "Name", "label")
# Structs within each other; a file of a rig has a few.
_DEPTH = 20


class _Object(NamedTuple):
    """An object of a MATLAB class, which only MATLAB can read."""

    kind: str


def read(path: Path) -> SignalFile:
    """Read a MATLAB file.

    Vectors and columns of matrices are signals, also in structs. In Simulink's structure with time, a capture of
    ControlDesk and a struct of time and data, each signal has the time axis beside it.
    """
    variables = _of_v73(path) if signatures.kind_of(path) is signatures.MAT73 else _of_v5(path)
    columns = Columns()
    objects: list[tuple[str, str]] = []
    captures = sum(_is_capture(v) or _is_structure_with_time(v) for v in variables.values())
    for name, value in variables.items():
        if _is_capture(value):
            _add_capture(columns, value, f"{name}/" if captures > 1 else "")
        elif _is_structure_with_time(value):
            _add_structure_with_time(columns, value, f"{name}/" if captures > 1 else "", name)
        else:
            _add(columns, name, value, "", objects)
    remarks = columns.remarks()
    if objects:
        text = _advice(objects)
        if not columns.signals:
            raise LogError(None, None, text)
        remarks = (*remarks, f"left out: {text}")
    return SignalFile(tuple(columns.signals), None, remarks)


FORMAT = Format("MATLAB file", (".mat",), read, extra="mat", apart=("scipy.io", "h5py"))


def _advice(objects: list[tuple[str, str]]) -> str:
    name, kind = objects[0]
    more = f" (and {len(objects) - 1} more)" if len(objects) > 1 else ""
    variable = name.rpartition("/")[2]
    write = {
        "timetable": f"writetimetable({variable}, 'log.csv')",
        "table": f"writetable({variable}, 'log.csv')",
        "timeseries": f"writetimetable(timeseries2timetable({variable}), 'log.csv')",
    }.get(kind, "save('log.mat', '-struct', 's') with s a struct of plain vectors")
    return f"'{name}' is a {kind} object{more}, which only MATLAB can read: write it there with {write}"


def _add(columns: Columns, name: str, value: Any, unit: str, objects: list, depth: int = 0) -> None:
    """Add what a variable or a field of a struct holds."""
    if depth > _DEPTH:
        raise LogError(
            None, None, f"'{name[:40]}...' has more than {_DEPTH} structs in each other: it is damaged, {COPY}"
        )
    if isinstance(value, _Object):
        objects.append((name, value.kind))
    elif isinstance(value, dict):
        _add_struct(columns, name, value, objects, depth)
    elif isinstance(value, list):
        for i, entry in enumerate(value, start=1):
            _add(columns, f"{name}/{_text(entry, _NAME_KEYS) or i}", entry, unit, objects, depth + 1)
    elif isinstance(value, np.ndarray):
        columns.add(name, unit, value)


def _add_struct(
    columns: Columns, name: str, struct: dict[str, Any], objects: list[tuple[str, str]], depth: int
) -> None:
    time = next((struct[k] for k in _TIME_KEYS if _is_vector(struct.get(k))), None)
    data = next((k for k in _DATA_KEYS if _is_numbers(struct.get(k))), None)
    if data:
        axis = np.ravel(time) if time is not None and time.size in struct[data].shape else None
        columns.add(name, _text(struct, _UNIT_KEYS), struct[data], axis)
        struct = {k: v for k, v in struct.items() if k != data and not (axis is not None and k in _TIME_KEYS)}
    units: dict[str, Any] = next((struct[k] for k in _UNIT_KEYS if isinstance(struct.get(k), dict)), {})
    for key, value in struct.items():
        named = [f"{key}_{k}" for k in _UNIT_KEYS]
        unit = _text(units, (key,)) or _text(struct, named)
        _add(columns, f"{name}/{key}", value, unit, objects, depth + 1)


def _is_capture(value: Any) -> bool:
    """Whether a struct is a capture of ControlDesk: axes X, signals Y."""
    if not (isinstance(value, dict) and {"X", "Y"} <= value.keys()):
        return False
    return all(isinstance(y, dict) and "Data" in y for y in _listed(value["Y"]))


def _add_capture(columns: Columns, capture: dict, prefix: str) -> None:
    axes = _listed(capture["X"])
    for i, y in enumerate(_listed(capture["Y"]), start=1):
        name = " ".join(_text(y, ("Name",)).split()) or f"Y/{i}"
        data = y["Data"] if _is_numbers(y["Data"]) else None
        index = int(np.ravel(y["XIndex"])[0]) - 1 if _is_numbers(y.get("XIndex")) and y["XIndex"].size else 0
        axis = axes[index] if 0 <= index < len(axes) else {}
        columns.add(prefix + name, _text(y, ("Unit",)), data, _axis_of_capture(axis, data))


def _axis_of_capture(axis: Any, data: Any) -> np.ndarray | None:
    """Times of a capture, s; a capture without times states their step."""
    if not isinstance(axis, dict) or data is None:
        return None
    times, step = axis.get("Data"), axis.get("Raster")
    unit = _text(axis, ("Unit",))
    scale = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}.get(unit)
    if scale is None:
        raise LogError(None, None, f"its time axis is in '{unit}': save it in s, ms or µs")
    if _is_vector(times):
        return np.ravel(times).astype(float) * scale
    if _is_numbers(step) and step.size == 1 and float(step.flat[0]) > 0:
        return np.arange(data.size) * float(step.flat[0]) * scale
    return None


def _is_structure_with_time(value: Any) -> bool:
    """Whether a struct is what Simulink saves as "structure" or "structure with time"."""
    if not (isinstance(value, dict) and "signals" in value):
        return False
    return all(isinstance(s, dict) and "values" in s for s in _listed(value["signals"]))


def _add_structure_with_time(columns: Columns, value: dict, prefix: str, variable: str) -> None:
    time = np.ravel(value["time"]) if _is_vector(value.get("time")) else None
    for i, signal in enumerate(_listed(value["signals"]), start=1):
        block = _text(signal, ("blockName",)).rpartition("/")[2]
        name = _text(signal, ("label",)) or " ".join(block.split()) or f"{variable}/{i}"
        values = signal["values"] if _is_numbers(signal["values"]) else None
        columns.add(prefix + name, _text(signal, _UNIT_KEYS), values, time)


def _listed(value: Any) -> list:
    return value if isinstance(value, list) else [value]


def _is_numbers(value: Any) -> TypeGuard[np.ndarray]:
    return isinstance(value, np.ndarray) and value.dtype.kind in "iufb"


def _is_vector(value: Any) -> TypeGuard[np.ndarray]:
    return _is_numbers(value) and value.size > 1 and value.size == max(value.shape)


def _text(struct: Any, keys: Iterable[str]) -> str:
    """The first text among these fields of a struct; "" if there is none."""
    if not isinstance(struct, dict):
        return ""
    return next((struct[k].strip() for k in keys if isinstance(struct.get(k), str)), "")


def _of_v5(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    mat5_size.count(path)
    unpacked = Unpacked()
    variables = loadmat(path)
    found = {}
    for name, value in variables.items():
        if name.startswith("__"):
            continue
        if value.dtype.names and value.dtype.names[:3] == ("s0", "s1", "s2"):  # an object has its name inside
            entry = value.flat[0]
            found[entry["s0"].decode(errors="replace")] = _Object(entry["s2"].decode(errors="replace"))
        else:
            found[name] = _plain_v5(value, unpacked)
    return found


def _plain_v5(value: Any, unpacked: Unpacked) -> Any:
    from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque

    if isinstance(value, MatlabOpaque):
        return _Object(value.flat[0]["s2"].decode(errors="replace") if value.size else "MATLAB")
    if isinstance(value, MatlabFunction):
        return _Object("function")
    if isinstance(value, MatlabObject):
        return _Object(value.classname)
    if not isinstance(value, np.ndarray):
        return _Object("sparse")
    if value.dtype.names:
        unpacked.add(value.size * mat5_size.ELEMENT)
        structs = [{k: _plain_v5(entry[k], unpacked) for k in value.dtype.names} for entry in value.flat]
        return structs[0] if len(structs) == 1 else structs
    if value.dtype.kind == "O":
        unpacked.add(value.size * mat5_size.ELEMENT)
        return [_plain_v5(entry, unpacked) for entry in value.flat]
    if value.dtype.kind in "US":
        return str(value.flat[0]) if value.size == 1 else "\n".join(map(str, value.flat))
    return value


def _of_v73(path: Path) -> dict[str, Any]:
    import h5py

    with h5py.File(path, "r") as file:
        unpacked = Unpacked()
        return {name: _plain_v73(h5py, file, file[name], unpacked) for name in file if not name.startswith("#")}


def _plain_v73(h5py: Any, file: Any, item: Any, unpacked: Unpacked, depth: int = 0) -> Any:
    """A variable as plain data; an array with several links or references to it is read, and counts, for each."""
    if item.file.filename != file.filename:
        raise LogError(None, None, f"'{item.name}' is in another file ({item.file.filename}): give that file")
    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode(errors="replace") if isinstance(kind, bytes) else str(kind)
    if depth > _DEPTH:
        raise LogError(None, None, f"has more than {_DEPTH} structs in each other: it is damaged, {COPY}")
    if item.attrs.get("MATLAB_object_decode", 0) in (1, 3) or "MATLAB_sparse" in item.attrs:
        return _Object("sparse" if "MATLAB_sparse" in item.attrs else kind or "MATLAB")
    if isinstance(item, h5py.Group):
        fields = {k: _plain_v73(h5py, file, item[k], unpacked, depth + 1) for k in item}
        # A struct array holds a list of references for each field.
        if fields and all(isinstance(item[k], h5py.Dataset) and _is_array_of_fields(item[k]) for k in item):
            count = min(len(v) for v in fields.values())
            return [{k: v[i] for k, v in fields.items()} for i in range(count)]
        return fields
    if item.attrs.get("MATLAB_empty"):
        return {"char": "", "cell": [], "struct": []}.get(kind, np.zeros(0))
    unpacked.add(item.size * mat5_size.CHARACTER if kind == "char" else size_of(item))
    if item.dtype.kind == "O":
        references = np.ravel(item[()].T)
        return [_plain_v73(h5py, file, file[r], unpacked, depth + 1) for r in references]
    value = item[()]
    if kind == "char":
        return "".join(map(chr, np.ravel(np.asarray(value).T.astype(np.int64), order="C")))
    return np.asarray(value).T


def _is_array_of_fields(item: Any) -> bool:
    return item.dtype.kind == "O" and "MATLAB_class" not in item.attrs
