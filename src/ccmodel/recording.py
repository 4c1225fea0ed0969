"""Recording: the common type of measured and simulated data, and its netCDF file."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import netCDF4
import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ccmodel.channels import CABLES, CHANNELS, TENSIONS, unit_of
from ccmodel.geometry import ConduitPath
from ccmodel.outputs import new_file
from ccmodel.typed import InputError, advice

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# What holds the far end of a single cable.
FAR_ENDS = ("spring", "fixed", "measured-tension", "measured-motion")

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
        Name of the batch, and of the recording within it. If several batches of a rig are taken together
        (``ccmodel.rig.joint``), the name of all, and batch and recording as ``loops/loops-1-a``.
    origin : str
        "rig" (measured), "virtual-rig" (a simulated rig) or "model".
    time_s : ndarray, shape (n,)
        Sample times, s, strictly increasing; a measured recording's count from its first sample.
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
    started_at_s, tensioned_at_s : float or None
        When the recording started and when its cables were tensioned, s since 1970 (UTC); None if not stated.
    log_start_s : float
        Time of the first sample on the log's own clock, s; see `log_time_s`.
    position : float
        Place in the session by the order of the recordings, -1/2 to 1/2; 0 if unknown.
    far_end : str or None
        What holds the far end of a single cable, one of `FAR_ENDS`; None for a pull-pull pair.
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
    far_end: str | None = None
    started_at_s: float | None = None
    tensioned_at_s: float | None = None
    log_start_s: float = 0.0
    position: float = 0.0

    def __post_init__(self) -> None:
        for name, values in self.channels.items():
            if name not in CHANNELS:
                raise ValueError(f"{name} is not a channel of a recording; channels are {', '.join(CHANNELS)}")
            if values.shape != self.time_s.shape:
                raise ValueError(f"{name} has {values.size} samples, time has {self.time_s.size}")

    def __repr__(self) -> str:
        rate = f" at {self.rate_Hz:.4g} Hz" if self.time_s.size > 1 else ""
        name = f"Recording {self.batch}/{self.id}, {ORIGIN[self.origin]}"
        return f"{name}: {self.time_s.size} samples{rate}; {', '.join(self.channels)}"

    def __contains__(self, channel: str) -> bool:
        return channel in self.channels

    @overload
    def __getitem__(self, wanted: str) -> NDArray: ...

    @overload
    def __getitem__(self, wanted: slice) -> "Recording": ...

    def __getitem__(self, wanted: str | slice) -> "NDArray | Recording":
        """A channel by its name, or by a slice the recording with these samples of all channels.

        Raises
        ------
        InputError
            If the recording has no such channel.
        """
        if isinstance(wanted, str):
            if wanted not in self.channels:
                raise InputError(f"{self.batch}/{self.id}: no channel '{wanted}'; {advice(wanted, self.channels)}")
            return self.channels[wanted]
        channels = {name: values[wanted] for name, values in self.channels.items()}
        return replace(self, time_s=self.time_s[wanted], channels=channels)

    @property
    def log_time_s(self) -> NDArray:
        """Sample times on the log's own clock, s, shape (n,): those of every table that stands beside the log."""
        return self.time_s + self.log_start_s

    @property
    def rate_Hz(self) -> float:
        """Samples per second, by the median step."""
        return float(1 / np.median(np.diff(self.time_s)))

    def to_frame(self) -> pd.DataFrame:
        """Channels over time: index ``time_s`` as in the log, a column for each channel, SI units as the names say."""
        columns = {name: self.channels[name] for name in CHANNELS if name in self.channels}
        return pd.DataFrame(columns, index=pd.Index(self.log_time_s, name="time_s"))

    def to_xarray(self) -> xr.Dataset:
        """Channels over ``time_s`` as in the log, and the conduit's pieces; units and sources are attributes."""
        return _to_dataset(replace(self, time_s=self.log_time_s, log_start_s=0.0))

    def plot(self, channel: str | None = None) -> "Figure":
        """Channels over time, a panel for each.

        Parameters
        ----------
        channel : str, optional
            One channel alone, as ``tau_in_Nm``; without it, every angle, torque and sum of tensions.

        Raises
        ------
        InputError
            If the recording does not have the channel.
        """
        return plotted([self], channel)

    @property
    def session(self) -> str:
        """Batch of the recording among several that are taken together; empty for a batch by itself."""
        return self.id.rpartition("/")[0]

    @property
    def tensions(self) -> tuple[str, ...]:
        """Channels of the tensions at the cables' ends, of cable A alone where there is no cable B."""
        return CABLES["A"] if self.far_end else TENSIONS

    @property
    def shows_tensions(self) -> bool:
        """Whether the tensions at all ends of the cables are recorded or follow from other channels."""
        return all(tension in self for tension in self.tensions)

    @property
    def load_motion_is_given(self) -> bool:
        """Whether the far end of a single cable is fixed or follows its recorded motion."""
        return self.far_end in ("fixed", "measured-motion")

    def with_channels(
        self, channels: Mapping[str, NDArray], derived_from: Mapping[str, str], origin: str
    ) -> "Recording":
        """The same run with other channels: those of a model, or some of the measured ones."""
        channels, derived_from = dict(channels), dict(derived_from)
        accuracy = self.accuracy if origin == self.origin else {}
        return replace(self, channels=channels, derived_from=derived_from, origin=origin, accuracy=accuracy)


def plotted(recordings: Sequence[Recording], channel: str | None = None) -> "Figure":
    """Figure of the channels of a batch's recordings, or of one channel alone (`Recording.plot`)."""
    # By name: no computation on recordings depends on how they are drawn, and none is repeated for a change of it.
    figures = import_module("ccmodel.session_figures")
    first = recordings[0]
    recorded = {r.id: (r.time_s, r.channels) for r in recordings}
    return figures.channels_over_time(recorded, f"{first.batch}: {ORIGIN[first.origin]}", channel)


def stride(recording: Recording, step_s: float | None) -> int:
    """Stride in samples nearest to a step of `step_s` seconds; 1 for None."""
    return 1 if step_s is None else max(1, round(step_s / float(np.median(np.diff(recording.time_s)))))


def write_recordings(path: Path, recordings: list[Recording], provenance: Mapping) -> None:
    """Write recordings to a netCDF file, one group each, with `provenance` (versions, hashes) on the root."""
    # By netCDF4, as xarray writes each variable as soon as it is defined. The library then closes the definitions of
    # the whole file once a variable: a thousand recordings took 200 s instead of 5 s.
    values = []
    with new_file(path) as fresh, netCDF4.Dataset(fresh, "w") as root:
        root.setncatts({"format": "ccmodel recordings 1", "provenance": json.dumps(provenance)})
        for recording in recordings:
            group, dataset = root.createGroup(recording.id), _to_dataset(recording)
            group.setncatts(dataset.attrs)
            for dimension, size in dataset.sizes.items():
                group.createDimension(str(dimension), size)
            for name, column in dataset.variables.items():
                dimensions = tuple(map(str, column.dims))
                variable = group.createVariable(str(name), column.dtype, dimensions, fill_value=np.nan)
                variable.setncatts(column.attrs)
                values.append((variable, column.values))
        for variable, written in values:
            variable[:] = written


def in_order(recordings: Sequence[Recording]) -> list[Recording]:
    """Recordings with their positions in the session by their order, -1/2 to 1/2; a single one has 0.

    Of batches that are taken together, each is a session: nothing says which of them was recorded first.
    """
    sessions = [(r.batch, r.id.rpartition("/")[0]) for r in recordings]
    size, before, placed = Counter(sessions), Counter[tuple[str, str]](), []
    for recording, session in zip(recordings, sessions, strict=True):
        share = before[session] / (size[session] - 1) if size[session] > 1 else 0.5
        placed.append(replace(recording, position=share - 0.5))
        before[session] += 1
    return placed


def read_recordings(path: Path) -> list[Recording]:
    """Read a file of `write_recordings`, in the same order."""
    with xr.open_datatree(path, engine="netcdf4") as tree:
        return [_from_dataset(name, node.to_dataset()) for name, node in tree.children.items()]


def read_provenance(path: Path) -> dict:
    """Versions and hashes that `write_recordings` put on a file."""
    with xr.open_datatree(path, engine="netcdf4") as tree:
        return json.loads(tree.attrs["provenance"])


_SCALARS = {
    "batch": str, "origin": str, "pretension_N": float, "rest_s": float, "settled_s": float, "log_start_s": float,
    "position": float,
}  # fmt: skip
_IF_STATED = ("far_end", "started_at_s", "tensioned_at_s")
# Numbers of each channel of a sensor.
_OF_SENSORS = ("accuracy", "encoder_step_rad")


def _to_dataset(recording: Recording) -> xr.Dataset:
    variables = {}
    for name, values in recording.channels.items():
        attributes = {"units": unit_of(name), "derived_from": recording.derived_from.get(name, "")}
        for key in _OF_SENSORS:
            if name in getattr(recording, key):
                attributes[key] = getattr(recording, key)[name]
        variables[name] = ("time_s", values, attributes)
    variables["piece_length_m"] = ("piece", recording.path.piece_length_m, {"units": "m"})
    variables["piece_bend_rad"] = ("piece", recording.path.piece_bend_rad, {"units": "rad"})
    attributes = {name: getattr(recording, name) for name in _SCALARS}
    attributes["excitation"] = json.dumps(dict(recording.excitation))
    for name in _IF_STATED:
        if (value := getattr(recording, name)) is not None:
            attributes[name] = value
    attributes["warnings"] = json.dumps(list(recording.warnings))
    return xr.Dataset(variables, coords={"time_s": ("time_s", recording.time_s, {"units": "s"})}, attrs=attributes)


def _from_dataset(name: str, dataset: xr.Dataset) -> Recording:
    channels = {c: dataset[c].values for c in CHANNELS if c in dataset}
    # An earlier version did not write all of them.
    written = {name: kind for name, kind in _SCALARS.items() if name in dataset.attrs}
    scalars: dict[str, Any] = {name: kind(dataset.attrs[name]) for name, kind in written.items()}
    attributes = {c: dataset[c].attrs for c in channels}
    of_sensors: dict[str, Any] = {
        key: {c: float(a[key]) for c, a in attributes.items() if key in a} for key in _OF_SENSORS
    }
    if_stated: dict[str, Any] = {name: dataset.attrs.get(name) for name in _IF_STATED}
    return Recording(
        id=name,
        time_s=dataset["time_s"].values,
        channels=channels,
        derived_from={c: a["derived_from"] for c, a in attributes.items()},
        path=ConduitPath(dataset["piece_length_m"].values, dataset["piece_bend_rad"].values),
        excitation=json.loads(dataset.attrs["excitation"]),
        warnings=tuple(json.loads(dataset.attrs["warnings"])),
        **if_stated,
        **scalars,
        **of_sensors,
    )
