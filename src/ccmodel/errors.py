"""Errors of a model against recordings, in SI units and normalised as in the paper's Table I."""

from collections.abc import Iterable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel.channels import CHANNELS, THETA_IN, unit_of
from ccmodel.model.run import PRESCRIBED
from ccmodel.recording import Recording

COLUMNS = (
    dict.fromkeys(("batch", "recording", "origin", "parameters", "channel", "unit"), str)
    | dict.fromkeys(
        ("bias", "rmse", "peak_to_peak", "maximum", "rms", "nrmse_percent", "window_from_s", "window_to_s"), float
    )
    | {"samples": int}
)


def last_cycle(recording: Recording) -> slice:
    """Samples of the drive's last whole cycle; of a motion without a cycle, all samples after the start-up.

    A cycle runs from one upward crossing of the middle of the drive's range to the next. In between, the drive must
    have been below a quarter of its range, so that dither about the middle is no cycle.
    """
    judged = np.flatnonzero(recording.time_s >= max(recording.rest_s, recording.settled_s))
    if judged.size < 2:
        return slice(0, recording.time_s.size)
    first = judged[0]
    theta = recording[THETA_IN][first:]
    high, low = theta.max(), theta.min()
    crossings = [] if high == low else _upward_crossings((theta - low) / (high - low))
    if len(crossings) < 2:
        return slice(first, recording.time_s.size)
    return slice(first + crossings[-2], first + crossings[-1] + 1)


def _upward_crossings(share: NDArray) -> list[int]:
    """Samples at which `share` rises through 0.5 after it was below 0.25."""
    starts = np.flatnonzero((share[:-1] < 0.5) & (share[1:] >= 0.5)) + 1
    crossings, armed_from = [], 0
    for sample in starts:
        if (share[armed_from:sample] < 0.25).any():
            crossings.append(int(sample))
            armed_from = int(sample)
    return crossings


def is_compared(recorded: Recording, simulated: Recording | None, channel: str) -> bool:
    """Whether a channel has an error: it was recorded and simulated, and was not given to the model."""
    return (
        simulated is not None and channel in recorded and simulated.derived_from.get(channel) not in (PRESCRIBED, None)
    )


def error_table(pairs: Iterable[tuple[Recording, Recording | None]], parameters: str) -> pd.DataFrame:
    """Mean and root mean square error of each channel over the last cycle, simulated minus recorded.

    The normalised error is over the recording's peak to peak in that cycle. The paper's Table I does not state its
    divisor, so the recording's largest magnitude and root mean square in the cycle are stated as well.

    Parameters
    ----------
    pairs : iterable of (Recording, Recording or None)
        Recordings, each with its simulation, or None where the model could not be run.
    parameters : str
        Name of the model's parameter set.

    Returns
    -------
    DataFrame
        A row for each recording and channel, with the columns of `COLUMNS`: `bias` (the mean error), `rmse`,
        `peak_to_peak`, `maximum` and `rms` (of the recording) in `unit`. Channels that were not recorded, or that were
        given to the model, have no row.
    """
    rows = []
    for recorded, simulated in pairs:
        if simulated is None:
            continue
        window = last_cycle(recorded)
        for channel in CHANNELS:
            if not is_compared(recorded, simulated, channel):
                continue
            measured = recorded[channel][window]
            error = simulated[channel][window] - measured
            rmse = float(np.sqrt(np.mean(error**2)))
            span = float(np.ptp(measured))
            what = (recorded.batch, recorded.id, recorded.origin, parameters, channel, unit_of(channel))
            sizes = (span, float(np.abs(measured).max()), float(np.sqrt(np.mean(measured**2))))
            errors = (float(np.mean(error)), rmse, *sizes, 100 * rmse / span if span > 0 else np.nan)
            rows.append((*what, *errors, *recorded.time_s[window][[0, -1]], measured.size))
    return pd.DataFrame(rows, columns=list(COLUMNS)).astype(COLUMNS)
