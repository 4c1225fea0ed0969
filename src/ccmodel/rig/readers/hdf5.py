"""HDF5: every array of numbers in the file, with units in attributes; netCDF-4 is HDF5 too."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers.attempt import COPY
from ccmodel.rig.readers.columns import Columns, listed
from ccmodel.rig.readers.content import Unpacked
from ccmodel.rig.readers.contract import Format, SignalFile

_UNIT_KEYS = ("unit", "units", "Unit", "Units", "UNIT", "UNITS", "unit_string")
# Scales of a time axis that a file attaches to its arrays.
_SECONDS = {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
# Attributes of the CF conventions: what stands for a missing value, and the linear map by which values are packed.
_MISSING_KEYS = ("_FillValue", "missing_value")
_SCALE, _OFFSET = "scale_factor", "add_offset"
# An attribute of a file written by pandas or of a dimension without an array.
_NO_ARRAY = b"This is a netCDF dimension but not a netCDF variable"


def read(path: Path) -> SignalFile:
    """Read the numbers of an HDF5 file.

    Columns of a two-dimensional array and fields of a compound type are a signal each. An array with a dimension scale
    in seconds (or ms, us, ns) has it as its time axis. Values that a netCDF file packs are unpacked, and its fill
    values are nan.
    """
    import h5py

    columns = Columns()
    with h5py.File(path, "r") as file:
        found = list(_datasets(h5py, file))
        Unpacked().add(sum(size_of(dataset) for _, dataset in found))
        for name, dataset in found:
            _add(columns, name, dataset)
        packed = [name for name, dataset in found if {_SCALE, _OFFSET} & set(dataset.attrs)]
    remarks = (f"values are unpacked with their {_SCALE} and {_OFFSET}: {listed(packed)}",) if packed else ()
    return SignalFile(tuple(columns.signals), None, (*columns.remarks(), *remarks))


FORMAT = Format("HDF5 file", (".h5", ".hdf5", ".hdf", ".he5", ".nc"), read, extra="hdf5", apart=("h5py",))


def size_of(dataset: Any) -> int:
    """Bytes of an array in memory, 0 of one without values; raise `LogError` if its values are in another file."""
    others = [name for name, *_ in dataset.external or ()]
    if dataset.is_virtual:
        others += [source.file_name for source in dataset.virtual_sources() if source.file_name != "."]
    if others:
        raise LogError(None, None, f"values of '{dataset.name}' are in another file ({others[0]}): give that file")
    return (dataset.size or 0) * dataset.dtype.itemsize


def _datasets(h5py: Any, group: Any, path: str = "", above: tuple = ()) -> Iterator[tuple[str, Any]]:
    """Names and arrays of a group and the groups in it; a group that contains itself is entered once."""
    for key in group:
        if key.startswith("#"):  # what MATLAB keeps for itself
            continue
        name = f"{path}/{key}" if path else key
        link = group.get(key, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise LogError(None, None, f"'{name}' is in another file ({link.filename}): give that file")
        if isinstance(link, h5py.SoftLink) and group.get(link.path) is None:
            raise LogError(None, None, f"'{name}' is a link to '{link.path}', which is not in the file: {COPY}")
        item = group[key]
        if isinstance(item, h5py.Dataset):
            yield name, item
        elif isinstance(item, h5py.Group) and item not in above:
            yield from _datasets(h5py, item, name, (*above, item))


def _add(columns: Columns, name: str, dataset: Any) -> None:
    attributes = dict(dataset.attrs)
    if bytes(np.bytes_(attributes.get("NAME", b""))).startswith(_NO_ARRAY):
        return
    unit, time = _unit(attributes), _time_axis(dataset)
    if dataset.dtype.names:
        values = dataset[()]
        for field in dataset.dtype.names:
            columns.add(f"{name}/{field}", unit, values[field], time)
    else:
        columns.add(name, unit, _unpacked(dataset) if dataset.dtype.kind in "iufb" else None, time)


def _unpacked(dataset: Any) -> NDArray:
    """Values of an array of numbers by the CF conventions: nan where it has none, and without its packing."""
    values, attributes = dataset[()], dataset.attrs
    # Missing values are stated as they are stored, that is packed.
    missing = [np.ravel(attributes[key]) for key in _MISSING_KEYS if key in attributes]
    if missing and (absent := np.isin(values, np.concatenate(missing))).any():
        values = np.where(absent, np.nan, values)
    for key, apply in ((_SCALE, np.multiply), (_OFFSET, np.add)):
        if key in attributes:
            values = apply(values, float(np.ravel(attributes[key])[0]))
    return values


def _unit(attributes: dict) -> str:
    found = next((attributes[key] for key in _UNIT_KEYS if key in attributes), "")
    found = found.flat[0] if isinstance(found, np.ndarray) and found.size else found
    return found.decode(errors="replace") if isinstance(found, bytes) else str(found) if isinstance(found, str) else ""


def _time_axis(dataset: Any) -> NDArray | None:
    """Dimension scale of the samples, if it is in a unit of time."""
    if not dataset.ndim or dataset.is_scale or not len(dataset.dims[0]):
        return None
    scale = dataset.dims[0][0]
    unit = _unit(dict(scale.attrs)).partition(" since ")[0].strip()
    if unit not in _SECONDS or scale.shape != dataset.shape[:1] or scale.dtype.kind not in "iuf":
        return None
    size_of(scale)
    return _unpacked(scale).astype(float) * _SECONDS[unit]
