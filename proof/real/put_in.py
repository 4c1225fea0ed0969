"""Something put into the raw logs of a measured batch: what the sensors would have logged had it been there.

Each kind is one function that takes a log, the rig's constants as its ``batch.yaml`` states them and a size, and gives
the changed log. They work in the logs' own units: counts stay whole numbers where they were, currents stay currents.
None of them shares code with the mechanisms that a diagnosis asks for.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

# The way over which a drag builds up after the drive has turned, rad: a few counts of its encoder.
DRAG_BUILDS_UP_RAD = 4e-3

Rig = Mapping[str, Mapping]
Change = Callable[[pd.DataFrame, Rig, float], pd.DataFrame]


def torque_column(log: pd.DataFrame, end: str) -> str:
    """The column that an end's torque is read from: its sensor's, else the motor's current."""
    counts = f"{end}_torque_counts"
    return counts if counts in log else f"{end}_current_A"


def unit_Nm(column: str, side: Mapping) -> float:
    """N m a unit of a torque column, with its sign."""
    size = side["torque_sensor"]["Nm_per_count"] if column.endswith("counts") else side["torque_constant_Nm_per_A"]
    return size * side.get("torque_sign", 1)


def torque_Nm(log: pd.DataFrame, rig: Rig, end: str) -> NDArray:
    """An end's torque as its sensor has it, shape (n,)."""
    column = torque_column(log, end)
    return unit_Nm(column, rig[end]) * (log[column].to_numpy() - _zero(column, rig[end]))


def angle_rad(log: pd.DataFrame, rig: Rig, end: str) -> NDArray:
    """An end's angle from its encoder's own zero, shape (n,)."""
    side = rig[end]
    step = 2 * np.pi / side["encoder_counts_per_rev"]
    return side.get("encoder_sign", 1) * step * log[f"{end}_encoder_counts"].to_numpy()


def gain(end: str) -> Change:
    """A torque sensor that reads (1 + size) times the torque, its electrical zero kept."""

    def change(log, rig, size):
        column = torque_column(log, end)
        zero = _zero(column, rig[end])
        return _with(log, column, zero + (1 + size) * (log[column].to_numpy() - zero))

    return change


def late(*columns: str) -> Change:
    """Columns that show at time t what was at t - size (s); before the log begins, what it begins with."""

    def change(log, rig, size):
        time_s = log["time_s"].to_numpy()
        for column in [c for c in columns if c in log]:
            log = _with(log, column, np.interp(time_s - size, time_s, log[column].to_numpy()))
        return log

    return change


def drift(end: str) -> Change:
    """The zero of a torque sensor that moves by size (N m/s) from the start of every recording on."""

    def change(log, rig, size):
        return _add_torque(log, rig, end, size * (log["time_s"] - log["time_s"].iloc[0]).to_numpy())

    return change


def lost_motion(log: pd.DataFrame, rig: Rig, size: float) -> pd.DataFrame:
    """A play of +-size (rad) between the load and what its encoder sees."""
    step = 2 * np.pi / rig["load"]["encoder_counts_per_rev"]
    counts = log["load_encoder_counts"].to_numpy()
    return _with(log, "load_encoder_counts", play(counts, size / step))


def drag(log: pd.DataFrame, rig: Rig, size: float) -> pd.DataFrame:
    """A drag of size (N m) against the drive's motion, in the drive's torque."""
    return _add_torque(log, rig, "drive", size * _direction(log, rig))


def drag_with_load(log: pd.DataFrame, rig: Rig, size: float) -> pd.DataFrame:
    """A drag against the drive's motion of a share of the load's torque, in the drive's torque."""
    share = size * np.abs(torque_Nm(log, rig, "load"))
    return _add_torque(log, rig, "drive", share * _direction(log, rig))


KINDS: dict[str, Change] = {
    "gain-of-drive-torque": gain("drive"),
    "gain-of-load-torque": gain("load"),
    "late-drive-side": late("drive_encoder_counts", "drive_torque_counts", "drive_current_A"),
    "late-load-side": late("load_encoder_counts", "load_torque_counts", "load_current_A"),
    "late-drive-torque": late("drive_torque_counts", "drive_current_A"),
    "drift-of-drive-torque": drift("drive"),
    "lost-motion-of-jaw": lost_motion,
    "drag": drag,
    "drag-with-load": drag_with_load,
}


def play(course: NDArray, half: float) -> NDArray:
    """What follows a course through a play of +-half, at first in the middle of it; shape (n,)."""
    followed = np.empty(len(course))
    at = course[0]
    for i, value in enumerate(course):
        at = min(max(at, value - half), value + half)
        followed[i] = at
    return followed


def _direction(log: pd.DataFrame, rig: Rig) -> NDArray:
    """-1 to 1 with the drive's motion: what is left of its way once a play has taken its part. 0 until it moves."""
    theta = angle_rad(log, rig, "drive")
    return (theta - play(theta, DRAG_BUILDS_UP_RAD / 2)) / (DRAG_BUILDS_UP_RAD / 2)


def _zero(column: str, side: Mapping) -> float:
    return side["torque_sensor"].get("zero_counts", 0.0) if column.endswith("counts") else 0.0


def _add_torque(log: pd.DataFrame, rig: Rig, end: str, torque: NDArray) -> pd.DataFrame:
    column = torque_column(log, end)
    return _with(log, column, log[column].to_numpy() + torque / unit_Nm(column, rig[end]))


def _with(log: pd.DataFrame, column: str, values: NDArray) -> pd.DataFrame:
    """A log with other values in a column, whole numbers where it had them."""
    if pd.api.types.is_integer_dtype(log[column]):
        values = np.rint(values).astype(int)
    return log.assign(**{column: values})


def described(batch: Path) -> dict:
    """What a batch's ``batch.yaml`` states."""
    return yaml.safe_load((batch / "batch.yaml").read_text(encoding="utf-8"))


def write_batch(
    source: Path, recordings: Sequence[str], out: Path, kind: str | None = None, size: float = 0.0
) -> dict[str, float]:
    """Write some of a batch's recordings as a batch of `out`'s name, with one thing put into all of them.

    Parameters
    ----------
    source : Path
        The measured batch, which stays as it is.
    recordings : sequence of str
        Ids of those that are written.
    out : Path
        Folder that is made.
    kind : str, optional
        Of `KINDS`; without it the logs are copied byte for byte.
    size : float
        In the kind's unit.

    Returns
    -------
    dict of str to float
        By channel, the standard deviation of what was changed over the channel's peak to peak, root mean square over
        all recordings from their stated start-up on; channels that stay are left out.
    """
    stated = described(source)
    kept = {r["id"]: r for r in stated["recordings"] if r["id"] in recordings}
    if missing := [name for name in recordings if name not in kept]:
        raise ValueError(f"{source}: there is no recording {', '.join(missing)}")
    out.mkdir(parents=True)
    shares: dict[str, list[float]] = {}
    for recording in kept.values():
        before = source / recording["file"]
        after = out / recording["file"]
        after.parent.mkdir(parents=True, exist_ok=True)
        if kind is None:
            after.write_bytes(before.read_bytes())
            continue
        log = pd.read_csv(before)
        changed = KINDS[kind](log, stated["rig"], size)
        changed.to_csv(after, index=False, float_format="%.9g")
        judged = (log["time_s"] >= recording.get("settled_s", 0.0)).to_numpy()
        for channel, share in _shares(log[judged], changed[judged], stated["rig"]).items():
            shares.setdefault(channel, []).append(share)
    text = yaml.safe_dump(stated | {"batch": out.name, "recordings": list(kept.values())}, sort_keys=False)
    (out / "batch.yaml").write_text(text, encoding="utf-8")
    return {channel: float(np.sqrt(np.mean(np.square(s)))) for channel, s in shares.items() if max(s) > 0}


def _shares(log: pd.DataFrame, changed: pd.DataFrame, rig: Rig) -> dict[str, float]:
    read = {
        f"{what}_{'in' if end == 'drive' else 'out'}": (of, end)
        for end in ("drive", "load")
        for what, of in (("theta", angle_rad), ("tau", torque_Nm))
    }
    found = {}
    for channel, (of, end) in read.items():
        was, became = of(log, rig, end), of(changed, rig, end)
        found[channel] = float(np.std(became - was) / np.ptp(was))
    return found
