"""Recording: the one shape that measured and simulated data share."""

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

# How figures and pages call each origin: nothing may leave a reader in doubt about where its numbers come from.
ORIGIN = {
    "rig": "recording (measured)",
    "virtual-rig": "recording (virtual rig, simulated)",
    "model": "model",
}


@dataclass(frozen=True)
class Recording:
    """One run of a rig or of a model: channels over a common time base, and what they were obtained from.

    Attributes
    ----------
    batch, id : str
        The batch's name and the recording's name within it.
    origin : str
        Where the numbers come from: "rig" (measured), "virtual-rig" (a simulated rig) or "model".
    time_s : ndarray, shape (n,)
        Sample times, s, strictly increasing.
    channels : mapping of str to ndarray, each of shape (n,)
        SI values by channel name (`CHANNELS`). A channel that could not be derived is absent, never zero.
    derived_from : mapping of str to str
        What each channel was computed from.
    pretension_N : float
        Tension that was aimed at when the cables were tensioned, N.
    path : ConduitPath
        The conduits' path.
    accuracy : mapping of str to float
        Accuracy stated for each measured channel, in the channel's unit; empty for a model.
    encoder_step_rad : mapping of str to float
        Angle of one count, rad, of each angle that was counted.
    excitation : mapping
        A note of what was asked of the drive, not of what happened.
    rest_s : float
        Time up to which the drive has not moved yet, s; 0 where the recording begins in motion. Where there is a
        rest, angles are zero there.
    settled_s : float
        Time from which the recording is to be judged, s: later than 0 where it begins with a start-up transient.
    warnings : tuple of str
        What was found wrong with the recording and yet left it usable.
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
                raise ValueError(f"{name} is no channel of a recording; channels are {', '.join(CHANNELS)}")
            if values.shape != self.time_s.shape:
                raise ValueError(f"{name} has {values.size} samples, time has {self.time_s.size}")

    def __contains__(self, channel: str) -> bool:
        return channel in self.channels

    def __getitem__(self, wanted: str | slice):
        """A channel by its name, or some of the samples of all channels by a slice."""
        if isinstance(wanted, str):
            return self.channels[wanted]
        channels = {name: values[wanted] for name, values in self.channels.items()}
        return replace(self, time_s=self.time_s[wanted], channels=channels)

    def with_channels(self, channels: Mapping[str, NDArray], derived_from: Mapping[str, str], origin: str):
        """The same run with other channels: what a model says of it, or a part of what was measured."""
        return replace(
            self,
            channels=dict(channels),
            derived_from=dict(derived_from),
            origin=origin,
            accuracy=self.accuracy if origin == self.origin else {},
        )


def stride(recording: Recording, step_s: float | None) -> int:
    """Samples to step over for one every `step_s` seconds, as near as the recording's own step allows; 1 for None."""
    return 1 if step_s is None else max(1, round(step_s / float(np.median(np.diff(recording.time_s)))))


def write_recordings(path: Path, recordings: list[Recording], provenance: Mapping) -> None:
    """Write recordings to one netCDF file, a group each, with `provenance` (versions, hashes) on the root."""
    with netCDF4.Dataset(path, "w") as root:
        root.setncatts({"format": "ccmodel recordings 1", "provenance": json.dumps(provenance)})
    for recording in recordings:
        _to_dataset(recording).to_netcdf(path, mode="a", group=recording.id, engine="netcdf4")


def read_recordings(path: Path) -> list[Recording]:
    """Read back what `write_recordings` wrote, in the same order."""
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
