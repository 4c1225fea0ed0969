"""Faults seeded into the raw logs of a measured batch: what the sensors would have logged with the fault present.

Each fault is a function of a log, the rig's constants from ``batch.yaml`` and a size, and returns the changed log. It
works in the units of the log: counts stay whole numbers and currents stay currents. No fault shares code with the
mechanisms of the diagnosis.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

# Drive travel over which a drag reverses after a reversal of the motion, rad: a few counts of the encoder.
DRAG_REVERSAL_RAD = 4e-3
# Periods of a cogging torque in a revolution of the spindle, which turns by a sixth of one.
COGS = 24
# Torque by which the bent torque sensor is stated: the drive's largest in the recordings. A sensor has one curve,
# however large the torque of a recording is.
FULL_SCALE_NM = 0.112

Rig = Mapping[str, Mapping]
Fault = Callable[[pd.DataFrame, Rig, float], pd.DataFrame]


def torque_column(log: pd.DataFrame, end: str) -> str:
    """The column that holds an end's torque: its torque sensor's if there is one, otherwise the motor current."""
    counts = f"{end}_torque_counts"
    return counts if counts in log else f"{end}_current_A"


def unit_Nm(column: str, side: Mapping) -> float:
    """Torque of one unit of a torque column, N m, with the sensor's sign."""
    size = side["torque_sensor"]["Nm_per_count"] if column.endswith("counts") else side["torque_constant_Nm_per_A"]
    return size * side.get("torque_sign", 1)


def torque_Nm(log: pd.DataFrame, rig: Rig, end: str) -> NDArray:
    """Measured torque of an end, N m, shape (n,)."""
    column = torque_column(log, end)
    return unit_Nm(column, rig[end]) * (log[column].to_numpy() - _zero(column, rig[end]))


def angle_rad(log: pd.DataFrame, rig: Rig, end: str) -> NDArray:
    """Measured angle of an end from its encoder's zero, rad, shape (n,)."""
    side = rig[end]
    step = 2 * np.pi / side["encoder_counts_per_rev"]
    return side.get("encoder_sign", 1) * step * log[f"{end}_encoder_counts"].to_numpy()


def gain(end: str) -> Fault:
    """A torque sensor that reads (1 + size) times the torque, with an unchanged electrical zero."""

    def change(log, rig, size):
        column = torque_column(log, end)
        zero = _zero(column, rig[end])
        return _with(log, column, zero + (1 + size) * (log[column].to_numpy() - zero))

    return change


def delay(*columns: str) -> Fault:
    """Columns delayed by size (s); the first `size` seconds repeat the first sample."""

    def change(log, rig, size):
        time_s = log["time_s"].to_numpy()
        for column in [c for c in columns if c in log]:
            log = _with(log, column, np.interp(time_s - size, time_s, log[column].to_numpy()))
        return log

    return change


def drift(end: str) -> Fault:
    """A torque sensor's zero that drifts by size (N m/s) from the start of each recording."""

    def change(log, rig, size):
        return _add_torque(log, rig, end, size * (log["time_s"] - log["time_s"].iloc[0]).to_numpy())

    return change


def lost_motion(log: pd.DataFrame, rig: Rig, size: float) -> pd.DataFrame:
    """A play of +-size (rad) between the load and its encoder."""
    step = 2 * np.pi / rig["load"]["encoder_counts_per_rev"]
    counts = log["load_encoder_counts"].to_numpy()
    return _with(log, "load_encoder_counts", play(counts, size / step))


def drag(log: pd.DataFrame, rig: Rig, size: float) -> pd.DataFrame:
    """A friction torque of size (N m) against the drive's motion, added to the drive's torque."""
    return _add_torque(log, rig, "drive", size * _direction(log, rig))


def drag_with_load(log: pd.DataFrame, rig: Rig, size: float) -> pd.DataFrame:
    """A friction torque against the drive's motion of size times the load's torque, added to the drive's torque."""
    share = size * np.abs(torque_Nm(log, rig, "load"))
    return _add_torque(log, rig, "drive", share * _direction(log, rig))


def drag_in_one_direction(log: pd.DataFrame, rig: Rig, size: float) -> pd.DataFrame:
    """A friction torque of size (N m) against the drive's motion to greater angles only."""
    return _add_torque(log, rig, "drive", size * np.maximum(_direction(log, rig), 0.0))


def cogging(log: pd.DataFrame, rig: Rig, size: float) -> pd.DataFrame:
    """A torque of amplitude size (N m) that the drive's angle decides, with `COGS` periods a revolution."""
    return _add_torque(log, rig, "drive", size * np.sin(COGS * angle_rad(log, rig, "drive")))


def bent_torque_sensor(log: pd.DataFrame, rig: Rig, size: float) -> pd.DataFrame:
    """A drive torque sensor that reads `FULL_SCALE_NM` size (a share) too high, and lower torques less, by a square."""
    torque = torque_Nm(log, rig, "drive")
    return _add_torque(log, rig, "drive", size * torque * np.abs(torque) / FULL_SCALE_NM)


FAULTS: dict[str, Fault] = {
    "gain-of-drive-torque": gain("drive"),
    "gain-of-load-torque": gain("load"),
    "late-drive-side": delay("drive_encoder_counts", "drive_torque_counts", "drive_current_A", "motor_encoder_counts"),
    "late-load-side": delay("load_encoder_counts", "load_torque_counts", "load_current_A"),
    "late-drive-torque": delay("drive_torque_counts", "drive_current_A"),
    "drift-of-drive-torque": drift("drive"),
    "lost-motion-of-jaw": lost_motion,
    "drag": drag,
    "drag-with-load": drag_with_load,
    "drag-in-one-direction": drag_in_one_direction,
    "cogging": cogging,
    "bent-torque-sensor": bent_torque_sensor,
}


def play(values: NDArray, half_width: float) -> NDArray:
    """Output of a play (backlash) operator of +-half_width, initially centred; shape (n,)."""
    output = np.empty(len(values))
    position = values[0]
    for i, value in enumerate(values):
        position = min(max(position, value - half_width), value + half_width)
        output[i] = position
    return output


def _direction(log: pd.DataFrame, rig: Rig) -> NDArray:
    """Direction of the drive's motion, -1 to 1, shape (n,).

    It is 0 until the drive moves, and reverses linearly over `DRAG_REVERSAL_RAD` (a stop operator).
    """
    theta = angle_rad(log, rig, "drive")
    return (theta - play(theta, DRAG_REVERSAL_RAD / 2)) / (DRAG_REVERSAL_RAD / 2)


def _zero(column: str, side: Mapping) -> float:
    return side["torque_sensor"].get("zero_counts", 0.0) if column.endswith("counts") else 0.0


def _add_torque(log: pd.DataFrame, rig: Rig, end: str, torque: NDArray) -> pd.DataFrame:
    column = torque_column(log, end)
    return _with(log, column, log[column].to_numpy() + torque / unit_Nm(column, rig[end]))


def _with(log: pd.DataFrame, column: str, values: NDArray) -> pd.DataFrame:
    """A log with new values in a column, rounded if the column holds whole numbers."""
    if pd.api.types.is_integer_dtype(log[column]):
        values = np.rint(values).astype(int)
    return log.assign(**{column: values})


def description(batch: Path) -> dict:
    """Content of a batch's ``batch.yaml``."""
    return yaml.safe_load((batch / "batch.yaml").read_text(encoding="utf-8"))


def write_batch(
    source: Path, recordings: Sequence[str], out: Path, fault: str | None = None, size: float = 0.0
) -> dict[str, float]:
    """Write some of a batch's recordings as a batch named after `out`, with one fault seeded into all of them.

    Parameters
    ----------
    source : Path
        The measured batch, which is not changed.
    recordings : sequence of str
        Ids of the recordings to write.
    out : Path
        Folder that is made.
    fault : str, optional
        A key of `FAULTS`; without it the logs are copied byte for byte.
    size : float
        In the fault's unit.

    Returns
    -------
    dict of str to float
        By changed channel, the standard deviation of the change over the channel's peak to peak: the root mean square
        over all recordings, each after its stated start-up.

    Raises
    ------
    ValueError
        If the batch lacks one of the recordings.
    """
    stated = description(source)
    chosen = _chosen(stated, recordings, source)
    out.mkdir(parents=True)
    shares: dict[str, list[float]] = {}
    for recording in chosen:
        before = source / recording["file"]
        after = out / recording["file"]
        after.parent.mkdir(parents=True, exist_ok=True)
        if fault is None:
            after.write_bytes(before.read_bytes())
            continue
        log = pd.read_csv(before)
        changed = FAULTS[fault](log, stated["rig"], size)
        changed.to_csv(after, index=False, float_format="%.9g")
        since_start = (log["time_s"] - log["time_s"].iloc[0]).to_numpy()
        settled = since_start >= recording.get("settled_s", 0.0)
        for channel, share in _shares(log[settled], changed[settled], stated["rig"]).items():
            shares.setdefault(channel, []).append(share)
    text = yaml.safe_dump(stated | {"batch": out.name, "recordings": chosen}, sort_keys=False)
    (out / "batch.yaml").write_text(text, encoding="utf-8")
    return {channel: float(np.sqrt(np.mean(np.square(s)))) for channel, s in shares.items() if max(s) > 0}


def _chosen(stated: dict, recordings: Sequence[str], source: Path) -> list[dict]:
    """Entries of the named recordings, in the order of the batch."""
    if missing := set(recordings).difference(r["id"] for r in stated["recordings"]):
        raise ValueError(f"{source}: there is no recording {', '.join(sorted(missing))}")
    return [r for r in stated["recordings"] if r["id"] in recordings]


def _shares(log: pd.DataFrame, changed: pd.DataFrame, rig: Rig) -> dict[str, float]:
    """By channel, the standard deviation of a change over the channel's peak to peak."""
    channels = {
        f"{quantity}_{'in' if end == 'drive' else 'out'}": (measure, end)
        for end in ("drive", "load")
        for quantity, measure in (("theta", angle_rad), ("tau", torque_Nm))
    }
    found = {}
    for channel, (measure, end) in channels.items():
        before, after = measure(log, rig, end), measure(changed, rig, end)
        found[channel] = float(np.std(after - before) / np.ptp(before))
    return found
