"""Recordings by their ids: what a batch and a prediction have in common."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pandas as pd
import xarray as xr

from ccmodel.recording import Recording, plotted
from ccmodel.typed import InputError, advice

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def counted(count: int, what: str = "recording") -> str:
    """A number of things in words, as ``2 recordings``."""
    return f"{count} {what}{'' if count == 1 else 's'}"


class Recordings:
    """Recordings of one rig, by their ids and in their order; what derives from it has them as `recordings`."""

    recordings: tuple[Recording, ...]

    def __len__(self) -> int:
        return len(self.recordings)

    def __iter__(self) -> Iterator[Recording]:
        return iter(self.recordings)

    def __contains__(self, id: object) -> bool:
        return any(recording.id == id for recording in self.recordings)

    def __getitem__(self, id: str) -> Recording:
        """The recording with this id.

        Raises
        ------
        InputError
            If there is none.
        """
        found = {recording.id: recording for recording in self.recordings}
        if id not in found:
            raise InputError(f"no recording '{id}'; {advice(str(id), found)}")
        return found[id]

    def to_frame(self) -> pd.DataFrame:
        """All samples of all recordings: index ``recording`` and ``time_s``, a column for each channel, SI units."""
        frames = {recording.id: recording.to_frame() for recording in self.recordings}
        return pd.concat(frames, names=["recording"]) if frames else pd.DataFrame()

    def to_xarray(self) -> xr.DataTree:
        """A node for each recording: channels over ``time_s``, with their units as attributes."""
        return xr.DataTree.from_dict({recording.id: recording.to_xarray() for recording in self.recordings})

    def plot(self, channel: str | None = None) -> "Figure":
        """Channels over time, a panel for each, all recordings in it.

        Parameters
        ----------
        channel : str, optional
            One channel alone, as ``tau_in_Nm``; without it, every angle, torque and sum of tensions.

        Raises
        ------
        InputError
            If no recording has the channel.
        """
        return plotted(self.recordings, channel)
