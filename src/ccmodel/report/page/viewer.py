"""Data of the interactive viewer: recordings and models, thinned to what a screen shows, a short text for each run."""

import json
from collections.abc import Mapping
from functools import cache

import numpy as np
import plotly.offline
from numpy.typing import NDArray

from ccmodel.accuracy.measure import NOT_ACCEPTED
from ccmodel.channels import CABLES, CHANNELS, MEASURED, TABLE, TENSIONS, THETA_IN, THETA_OUT
from ccmodel.figures import TRANSMISSION
from ccmodel.model.run import PRESCRIBED
from ccmodel.recording import ORIGIN, Recording
from ccmodel.report.embedding import compressed

MOST_SAMPLES = 1200  # a panel is at most so many pixels wide
LEVELS = 65534  # of a channel's range; one more stands for a missing value
RECORDED = "recording"

# Phases of the paper's Section IV as the channels of the model show them. II and III differ inside the conduits only.
PHASES = ("drive at rest", "I: the load rests", "II, III: the load moves", "IV: a cable is slack")
REST_SPEED = 0.02  # of the highest speed
SHORTEST_REST_S = 0.1  # a drive that reverses is slow for a shorter time
SLACK_N = 0.1  # twice the accuracy of a tension


@cache
def library() -> str:
    """The plotting library as the text of a script element."""
    return compressed(plotly.offline.get_plotlyjs().encode())


def channel_table() -> dict[str, dict]:
    """Symbol, label, unit and factor from SI units of each channel, for the viewer."""
    return {
        c.name: {
            "symbol": c.symbol,
            "label": c.words,
            "unit": c.plot_unit or c.unit,
            "scale": c.scale,
        }
        for c in TABLE.values()
    }


def settings() -> dict:
    """What the viewer knows besides the runs: channels, order of panels, loops, phases."""
    return {
        "channels": channel_table(),
        "panels": [*MEASURED, *TENSIONS],
        "tensions": list(TENSIONS),
        "input": THETA_IN,
        "loops": [list(pair) for pair in TRANSMISSION[::-1]],
        "phases": list(PHASES),
        "missing": LEVELS + 1,
    }


def entry(recording: Recording, models: Mapping[str, Recording | None]) -> dict:
    """A run in the list of the viewer, with its data.

    Parameters
    ----------
    recording : Recording
    models : mapping of str to Recording or None
        Simulations by the name of their parameter set; None where the model could not be run.
    """
    return {
        "batch": recording.batch,
        "id": recording.id,
        "origin": ORIGIN[recording.origin],
        "measured": recording.origin == "rig",
        "sets": [name for name, model in models.items() if model is not None],
        "data": compressed(packed(recording, models)),
    }


def packed(recording: Recording, models: Mapping[str, Recording | None]) -> bytes:
    """Channels of a run and its models as bytes.

    Four bytes with the length of the header, the header (JSON), then for each series the differences between its
    levels as 16-bit numbers: all low bytes, then all high bytes, which compress well. A series that equals an earlier
    one refers to it.
    """
    every = slice(None, None, -(-recording.time_s.size // MOST_SAMPLES))
    simulated = {name: model for name, model in models.items() if model is not None}
    series = [("", "time_s", recording.time_s)]
    series += [(RECORDED, c, recording[c]) for c in CHANNELS if c in recording]
    series += [
        (name, c, model[c])
        for name, model in simulated.items()
        for c in CHANNELS
        if c in model and model.derived_from.get(c) != PRESCRIBED
    ]
    rows: list[dict[str, str | float]] = []
    blocks: list[bytes] = []
    seen: dict[bytes, int] = {}
    for set_name, channel, values in series:
        values = np.asarray(values, dtype=float)[every]
        row: dict[str, str | float] = {"set": set_name, "channel": channel}
        key = values.tobytes()
        if key in seen:
            row["same_as"] = seen[key]
        else:
            seen[key] = len(rows)
            low, step, block = _quantised(values)
            row |= {"low": low, "step": step}
            blocks.append(block)
        rows.append(row)
    of = next((name for name in reversed(simulated) if name not in NOT_ACCEPTED), None)
    shading = {"phases": phases(recording, simulated[of] if of else None), "phases_of": of}
    header = {"count": recording.time_s[every].size, "series": rows} | shading
    text = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    return len(text).to_bytes(4, "little") + text + b"".join(blocks)


def _quantised(values: NDArray) -> tuple[float, float, bytes]:
    """Lowest value and step of the levels, and the differences between the levels as bytes."""
    finite = np.isfinite(values)
    low = float(values[finite].min()) if finite.any() else 0.0
    span = float(np.ptp(values[finite])) if finite.any() else 0.0
    step = span / LEVELS if span > 0 else 1.0
    levels = np.full(values.size, LEVELS + 1, dtype=np.int64)
    levels[finite] = np.round((values[finite] - low) / step)
    differences = np.diff(levels, prepend=0).astype(np.uint16)
    return low, step, (differences & 0xFF).astype(np.uint8).tobytes() + (differences >> 8).astype(np.uint8).tobytes()


def phases(recording: Recording, model: Recording | None) -> list[list]:
    """Stretches of a run as rows of first time, last time and index into `PHASES`; none without a model."""
    if model is None:
        return []
    time_s = recording.time_s
    rests = ~_moves(model[THETA_IN], time_s)
    for first, last in _stretches(rests):
        if rests[first] and time_s[last] - time_s[first] < SHORTEST_REST_S:
            rests[first : last + 1] = False
    load_moves = _moves(model[THETA_OUT], time_s)
    slack = np.zeros(time_s.size, dtype=bool)
    for ends in CABLES.values():
        if all(end in model for end in ends):
            slack |= np.maximum(*(model[end] for end in ends)) < SLACK_N
    phase = np.select([rests, slack & load_moves, ~load_moves], [0, 3, 1], 2)
    ends = np.r_[time_s[1:], time_s[-1]]
    return [[round(float(time_s[a]), 4), round(float(ends[b]), 4), int(phase[a])] for a, b in _stretches(phase)]


def _stretches(values: NDArray) -> list[tuple[int, int]]:
    """First and last sample of each stretch of equal values."""
    first = np.flatnonzero(np.r_[True, np.diff(values) != 0])
    return list(zip(first.tolist(), [*(first[1:] - 1).tolist(), values.size - 1], strict=True))


def _moves(angle: NDArray, time_s: NDArray) -> NDArray:
    """Whether an angle changes, at each sample."""
    speed = np.abs(np.gradient(angle, time_s))
    return speed > REST_SPEED * speed.max() if speed.max() > 0 else np.zeros(angle.size, dtype=bool)
