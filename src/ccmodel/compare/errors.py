"""Errors of a model against recordings, in units and normalised as in the paper's Table I."""

from collections.abc import Iterable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.model.run import PRESCRIBED
from ccmodel.recording import CHANNELS, Recording, unit_of

COLUMNS = {
    "batch": str,
    "recording": str,
    "origin": str,
    "parameters": str,
    "channel": str,
    "unit": str,
    "rmse": float,
    "peak_to_peak": float,
    "nrmse_percent": float,
    "window_from_s": float,
    "window_to_s": float,
    "samples": int,
}


def last_cycle(recording: Recording) -> slice:
    """The samples of the last whole cycle of the drive; of all that is judged where the motion does not repeat.

    A cycle runs from one upward crossing of the middle of the drive's range to the next. Only a drive that has
    gone most of the way down in between has made a cycle, so that dither about the middle makes none.
    """
    judged = np.flatnonzero(recording.time_s >= max(recording.rest_s, recording.settled_s))
    if judged.size < 2:
        return slice(0, recording.time_s.size)
    first = judged[0]
    theta = recording["theta_in_rad"][first:]
    high, low = theta.max(), theta.min()
    if high == low:
        return slice(first, recording.time_s.size)
    crossings = _upward_crossings((theta - low) / (high - low))
    if len(crossings) < 2:
        return slice(first, recording.time_s.size)
    return slice(first + crossings[-2], first + crossings[-1] + 1)


def _upward_crossings(share: NDArray) -> list[int]:
    """Samples at which `share` rises through one half, after having been below one quarter."""
    starts = np.flatnonzero((share[:-1] < 0.5) & (share[1:] >= 0.5)) + 1
    crossings, armed_from = [], 0
    for sample in starts:
        if (share[armed_from:sample] < 0.25).any():
            crossings.append(int(sample))
            armed_from = sample
    return crossings


def error_table(pairs: Iterable[tuple[Recording, Recording | None]], parameters: str) -> pd.DataFrame:
    """Root mean square error of each channel over one cycle.

    The paper's Table I does not say what it divides by; here it is the recording's peak to peak over the cycle.

    Parameters
    ----------
    pairs : iterable of (Recording, Recording or None)
        Recordings, each with what the model says of it, if it could be run.
    parameters : str
        Name of the parameter set that the model ran with.

    Returns
    -------
    DataFrame
        A row a recording and channel with the columns of `COLUMNS`: `rmse` and `peak_to_peak` in `unit`. Channels
        that were not recorded, or that the model was given, have no row.
    """
    rows = []
    for recorded, simulated in pairs:
        if simulated is None:
            continue
        window = last_cycle(recorded)
        for channel in CHANNELS:
            if channel not in recorded or simulated.derived_from.get(channel) in (PRESCRIBED, None):
                continue
            measured = recorded[channel][window]
            rmse = float(np.sqrt(np.mean((simulated[channel][window] - measured) ** 2)))
            span = float(np.ptp(measured))
            rows.append(
                {
                    "batch": recorded.batch,
                    "recording": recorded.id,
                    "origin": recorded.origin,
                    "parameters": parameters,
                    "channel": channel,
                    "unit": unit_of(channel),
                    "rmse": rmse,
                    "peak_to_peak": span,
                    "nrmse_percent": 100 * rmse / span if span > 0 else np.nan,
                    "window_from_s": recorded.time_s[window][0],
                    "window_to_s": recorded.time_s[window][-1],
                    "samples": measured.size,
                }
            )
    return pd.DataFrame(rows, columns=list(COLUMNS)).astype(COLUMNS)
