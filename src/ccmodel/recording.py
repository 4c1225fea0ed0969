"""Recording: the common type of measured and simulated data, and its netCDF file."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ccmodel.channels import CHANNELS, unit_of
from ccmodel.geometry import ConduitPath

# Names of the origins in figures and pages: a simulated rig must never pass for a measured one.
ORIGIN = {
    "rig": "recording (measured)",
    "virtual-rig": "recording (virtual rig, simulated)",
    "model": "model",
}


@dataclass(frozen=True)
class Recording:
    """One run of a rig or a model: channels over a common time base, with their origin.

    Attributes
    ----------
    batch, id : str
        Name of the batch, and of the recording within it.
    origin : str
        "rig" (measured), "virtual-rig" (a simulated rig) or "model".
    time_s : ndarray, shape (n,)
        Sample times, s, strictly increasing.
    channels : mapping of str to ndarray, each of shape (n,)
        SI values by channel name (`CHANNELS`). A channel that cannot be derived is absent, never zero.
    derived_from : mapping of str to str
        Formula or source of each channel.
    pretension_N : float
        Nominal tension of the cables, N.
    path : ConduitPath
        Path of the conduits.
    accuracy : mapping of str to float
        Stated accuracy of each measured channel, in its unit; empty for a model.
    encoder_step_rad : mapping of str to float
        Angle of one count, rad, of each angle from an encoder.
    excitation : mapping
        Commanded motion of the drive, as noted; the actual motion may differ.
    rest_s : float
        End of the initial rest, s, at which angles are zero on average; 0 if the recording begins in motion.
    settled_s : float
        End of a start-up transient, s: comparisons begin there. 0 if there is none.
    warnings : tuple of str
        Faults that leave the recording usable.
    """

    batch: str
    id: str
    origin: str
    time_s: NDArray
    channels: Mapping[str, NDArray]
    derived_from: Mapping[str, str]
    pretension_N: float
    path: ConduitPath
    accuracy: Mapping[str, float] = field(default_factory=dict)
    encoder_step_rad: Mapping[str, float] = field(default_factory=dict)
    excitation: Mapping = field(default_factory=dict)
    rest_s: float = 0.0
    settled_s: float = 0.0
    warnings: tuple[str, ...] = ()

    def __post_init__(self):
        for name, values in self.channels.items():
            if name not in CHANNELS:
                raise ValueError(f"{name} is not a channel of a recording; channels are {', '.join(CHANNELS)}")
            if values.shape != self.time_s.shape:
                raise ValueError(f"{name} has {values.size} samples, time has {self.time_s.size}")

    def __contains__(self, channel: str) -> bool:
        return channel in self.channels

    def __getitem__(self, wanted: str | slice):
        """A channel by its name, or by a slice the recording with these samples of all channels."""
        if isinstance(wanted, str):
            return self.channels[wanted]
        channels = {name: values[wanted] for name, values in self.channels.items()}
        return replace(self, time_s=self.time_s[wanted], channels=channels)

    def with_channels(self, channels: Mapping[str, NDArray], derived_from: Mapping[str, str], origin: str):
        """The same run with other channels: those of a model, or some of the measured ones."""
        return replace(
            self,
            channels=dict(channels),
            derived_from=dict(derived_from),
            origin=origin,
            accuracy=self.accuracy if origin == self.origin else {},
        )


def stride(recording: Recording, step_s: float | None) -> int:
    """Stride in samples nearest to a step of `step_s` seconds; 1 for None."""
    return 1 if step_s is None else max(1, round(step_s / float(np.median(np.diff(recording.time_s)))))


def write_recordings(path: Path, recordings: list[Recording], provenance: Mapping) -> None:
    """Write recordings to a netCDF file, one group each, with `provenance` (versions, hashes) on the root."""
    with netCDF4.Dataset(path, "w") as root:
        root.setncatts({"format": "ccmodel recordings 1", "provenance": json.dumps(provenance)})
    for recording in recordings:
        _to_dataset(recording).to_netcdf(path, mode="a", group=recording.id, engine="netcdf4")


def read_recordings(path: Path) -> list[Recording]:
    """Read a file of `write_recordings`, in the same order."""
    with xr.open_datatree(path, engine="netcdf4") as tree:
        return [_from_dataset(name, node.to_dataset()) for name, node in tree.children.items()]


_SCALARS = ("batch", "origin", "pretension_N", "rest_s", "settled_s")


def _to_dataset(recording: Recording) -> xr.Dataset:
    variables = {}
    for name, values in recording.channels.items():
        attributes = {"units": unit_of(name), "derived_from": recording.derived_from.get(name, "")}
        if name in recording.accuracy:
            attributes["accuracy"] = recording.accuracy[name]
        if name in recording.encoder_step_rad:
            attributes["encoder_step_rad"] = recording.encoder_step_rad[name]
        variables[name] = ("time_s", values, attributes)
    variables["piece_length_m"] = ("piece", recording.path.piece_length_m, {"units": "m"})
    variables["piece_bend_rad"] = ("piece", recording.path.piece_bend_rad, {"units": "rad"})
    attributes = {name: getattr(recording, name) for name in _SCALARS}
    attributes["excitation"] = json.dumps(dict(recording.excitation))
    attributes["warnings"] = json.dumps(list(recording.warnings))
    return xr.Dataset(variables, coords={"time_s": ("time_s", recording.time_s, {"units": "s"})}, attrs=attributes)


def _from_dataset(name: str, dataset: xr.Dataset) -> Recording:
    channels = {c: dataset[c].values for c in CHANNELS if c in dataset}
    scalars = {s: dataset.attrs[s] for s in _SCALARS}
    scalars |= {s: float(scalars[s]) for s in ("pretension_N", "rest_s", "settled_s")}
    return Recording(
        id=name,
        time_s=dataset["time_s"].values,
        channels=channels,
        derived_from={c: dataset[c].attrs["derived_from"] for c in channels},
        accuracy=_numbers(dataset, channels, "accuracy"),
        path=ConduitPath(dataset["piece_length_m"].values, dataset["piece_bend_rad"].values),
        encoder_step_rad=_numbers(dataset, channels, "encoder_step_rad"),
        excitation=json.loads(dataset.attrs["excitation"]),
        warnings=tuple(json.loads(dataset.attrs["warnings"])),
        **scalars,
    )


def _numbers(dataset: xr.Dataset, channels, attribute: str) -> dict[str, float]:
    return {c: float(dataset[c].attrs[attribute]) for c in channels if attribute in dataset[c].attrs}
