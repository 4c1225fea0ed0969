"""A first `batch.yaml` for a folder of logs: what the logs show is stated, what only a person knows is left empty.

`load_batch` then asks for each empty key in one line.
"""

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from ccmodel.channels import ANGLE_AT, SUM_AT, TENSIONS_AT, THETA_IN, TORQUE_AT
from ccmodel.outputs import new_file
from ccmodel.rig.angle import angle_at, resolution_seen
from ccmodel.rig.batch import DRIVE_ANGLE_COLUMNS, NAMES, recording_id, valid_name
from ccmodel.rig.calibration import resting_samples
from ccmodel.rig.findings import Defect, LogError
from ccmodel.rig.log import read_log
from ccmodel.rig.overview import ChannelOverview, Overview, overview
from ccmodel.rig.readers import registry
from ccmodel.sentences import controls_in, shown
from ccmodel.typed import InputError, Problem

ENDS = ("drive", "load")
# Spread of the pretensions of several recordings, as a share, up to which they are one.
ONE_PRETENSION = 0.1
_IF_KNOWN = "; put the tension that was set, if you know it"

Lines = Iterator[str]


@dataclass(frozen=True)
class _Log:
    """A log of the folder.

    Attributes
    ----------
    file : str
        Its path from the folder.
    table : DataFrame
        Its columns.
    """

    file: str
    table: pd.DataFrame

    @cached_property
    def resolution(self) -> dict[str, float]:
        """Step of each angle in rad, 0 without one."""
        time = self.table["time_s"].to_numpy()
        angles = [angle for angle in ANGLE_AT.values() if angle in self.table]
        return {angle: resolution_seen(time, self.table[angle].to_numpy()) for angle in angles}

    @cached_property
    def resting(self) -> int:
        """Number of samples of the rest at the start."""
        angles = (angle_at(self.table, end, None, self.resolution.get(ANGLE_AT[end])) for end in ENDS)
        return resting_samples(self.table["time_s"].to_numpy(), [angle for angle in angles if angle])

    @cached_property
    def overview(self) -> Overview:
        """What it shows."""
        time = self.table["time_s"].to_numpy()
        drive = next(column for column in DRIVE_ANGLE_COLUMNS if column in self.table)
        channels = {name: self.table[name].to_numpy() for name in self.table if name != "time_s"}
        return overview(time, channels, drive, float(time[self.resting - 1]) if self.resting else float(time[0]))

    @property
    def pretension_N(self) -> float | None:
        """Half the sum of tensions over the first half of the rest, mean of both ends; None without load cells."""
        rest, found = self.table.iloc[: self.resting // 2], []
        for end in ENDS:
            if SUM_AT[end] in rest:
                found.append(rest[SUM_AT[end]].mean() / 2)
            elif set(TENSIONS_AT[end]) <= set(rest):
                found.append(rest[list(TENSIONS_AT[end])].mean().mean())
        return float(np.mean(found)) if found and len(rest) else None


def draft_and_refuse(folder: Path) -> tuple[Path, dict[str, str]]:
    """Write a `batch.yaml` with one entry for each log of a folder.

    Parameters
    ----------
    folder : Path
        Folder with the logs, which becomes the batch.

    Returns
    -------
    file : Path
        Keys that the logs cannot show are empty, with a comment.
    refused : dict of str to str
        Logs that cannot be read, and why; they have no entry.

    Raises
    ------
    InputError
        If the folder cannot be a batch, has a `batch.yaml` already or has no log that can be read.
    """
    folder = Path(folder)
    path, name = folder / "batch.yaml", folder.resolve().name
    if not folder.is_dir():
        raise InputError.of(Problem(str(folder), None, "there is no such folder"))
    if path.exists():
        raise InputError.of(Problem(str(path), None, "is there already and is kept: edit it, or remove it first"))
    if not valid_name(name):
        raise InputError.of(
            Problem(str(folder), None, f"{name!r} cannot be a batch's name: {NAMES}; rename the folder")
        )
    logs, refused = _read(folder)
    if not logs:
        problems = [Problem(str(folder / file), None, text) for file, text in refused.items()]
        none = Problem(str(folder), None, f"has no logs ({', '.join(_suffixes())}): put them there")
        raise InputError.of(*(problems or [none]))
    with new_file(path) as fresh:
        fresh.write_text("\n".join(_content(name, logs, refused)) + "\n", encoding="utf-8")
    return path, refused


def _read(folder: Path) -> tuple[list[_Log], dict[str, str]]:
    """Logs of a folder by name, and why the others cannot be read."""
    logs, refused = [], {}
    for path in sorted(folder.rglob("*"), key=_natural):
        if not path.is_file() or not path.name.lower().removesuffix(".gz").endswith(_suffixes()):
            continue
        file = path.relative_to(folder).as_posix()
        if controls_in(file):
            text = f"{shown(file)}: has characters that do not show; rename the log"
            raise InputError.of(Problem(str(folder), None, text))
        try:
            logs.append(_Log(file, read_log(path)[0]))
        except LogError as error:
            refused[file] = in_words(error.defect)
    return logs, refused


def in_words(defect: Defect) -> str:
    """What is wrong with a log, in one line without the name of the log."""
    place = f"row {defect.row}" if defect.row else None
    return ", ".join(part for part in (place, defect.column, defect.text) if part)


def _suffixes() -> tuple[str, ...]:
    """Endings of the names of logs, of all formats."""
    return tuple(dict.fromkeys(suffix for format in registry().values() for suffix in format.suffixes))


def _natural(path: Path) -> list:
    """Order in which people count: run-2 before run-10."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", path.as_posix())]


def _content(name: str, logs: Sequence[_Log], refused: dict[str, str]) -> Lines:
    columns = set().union(*(log.table.columns for log in logs))
    from_logs = f"{len(logs)} {'log' if len(logs) == 1 else 'logs'}"
    yield f"# Drafted from {from_logs}. Fill in what is empty and correct what is wrong."
    yield "# `ccmodel check` names what is still missing. Keys and units: docs/rig-log-format.md."
    yield "format: 1"
    yield f"batch: {_text(name)}"
    yield "origin: rig  # measured; virtual-rig if it was simulated"
    yield "rig:"
    yield "  # A single cable: add `transmission: single-cable` and `far_end`, see docs/rig-log-format.md."
    for end in ENDS:
        yield f"  {end}:"
        yield from _side(end, columns, logs)
    yield "  cable:  # estimates, from which a fit starts"
    yield "    stiffness_N_per_m:  # N/m of the length below: force over stretch"
    yield "    length_m:  # m"
    yield "    friction_coefficient:  # 0.05 to 0.3 for steel in a lined or greased conduit"
    yield "  accuracy:  # of the sensors; noise and steps are proposals, a data sheet may state more"
    yield from _accuracy(logs)
    pretensions = {log.file: log.pretension_N for log in logs}
    alike = _alike(pretensions.values())
    differ = alike is None and all(p is not None and p > 0 for p in pretensions.values())
    yield "defaults:  # of all recordings; one that differs states the key below, as {id: a, ..., conduit: [...]}"
    known = [p for p in pretensions.values() if p is not None]
    if len(known) < len(pretensions):
        yield "  pretension_N:  # N, the tension to which each cable was set before the motion"
    elif min(known) <= 0:
        least = f"{min(known):.3g} N"
        yield f"  pretension_N:  # N; half the sum of tensions at rest is {least}: is a load cell's sign or zero wrong?"
    elif alike is not None:
        yield f"  pretension_N: {alike:.3g}  # half the sum of tensions at rest, mean of all recordings{_IF_KNOWN}"
    else:
        yield f"  # pretension_N differs and stands in each entry: half the sum of its tensions at rest{_IF_KNOWN}"
    yield "  conduit: [{length_m: , bend_rad: }]  # pieces of even bend, from the drive end: m, rad (180 deg = 3.1416)"
    yield "recordings:"
    ids = _ids([log.file for log in logs])
    for log in logs:
        yield from _entry(ids[log.file], log, pretensions[log.file] if differ else None)
    for file, text in refused.items():
        yield f"# not used: {file}: {shown(text)}"


def _side(end: str, columns: set[str], logs: Sequence[_Log]) -> Lines:
    yield "    pulley_radius_m:  # m, to the middle of the cable"
    angle = ANGLE_AT[end]
    if angle in columns:
        steps = [log.resolution[angle] for log in logs if angle in log.resolution]
        yield f"    angle_resolution_rad: {_step(steps)}"
    elif f"{end}_encoder_counts" in columns:
        yield "    encoder_counts_per_rev:  # counts per revolution of the pulley: 4 x the encoder's lines x gear ratio"
    if f"{end}_torque_counts" in columns:
        yield "    torque_sensor: {Nm_per_count: , zero_counts: 0}  # N m per count: calibrate it with a known weight"
    if f"{end}_current_A" in columns:
        yield "    torque_constant_Nm_per_A:  # N m/A at the pulley: the motor's data sheet x gear ratio"
    if f"{end}_load_cell_V" in columns:
        yield "    load_cell: {sensitivity_V_per_N: , zero_V: }  # V/N and V without force: hang known weights on it"
    if end == "load":
        yield "    spring_stiffness_Nm_per_rad:  # N m/rad; remove the line if there is no spring"


def _step(steps: Sequence[float]) -> str:
    # An angle that stands still shows no step.
    step = min((step for step in steps if step), default=0.0)
    if not step:
        return "0  # no step seen"
    per_rev = round(2 * np.pi / step)
    if abs(2 * np.pi / step - per_rev) < 0.02:
        return f"{2 * np.pi / per_rev:.10g}  # smallest step seen: {per_rev} in a revolution"
    return f"{step:.6g}  # smallest step seen"


def _accuracy(logs: Sequence[_Log]) -> Lines:
    # Key, unit, physical columns, raw columns, how to find it.
    rows = (
        ("encoder_rad", "rad", tuple(ANGLE_AT.values()), "encoder_counts", "one count: 2 pi / counts per revolution"),
        ("torque_Nm", "N m", tuple(TORQUE_AT.values()), ("current_A", "torque_counts"), "noise at rest {} x its scale"),
        (
            "load_cell_N",
            "N",
            (*SUM_AT.values(), *TENSIONS_AT["drive"], *TENSIONS_AT["load"]),
            "load_cell_V",
            "noise at rest {} over the sensitivity",
        ),
    )
    for key, unit, physical, suffixes, how in rows:
        found = [c for log in logs for c in log.overview.channels if c.name in physical]
        raw = [c for log in logs for c in log.overview.channels if c.name.endswith(suffixes)]
        if found and not raw:
            yield f"    {key}: {_seen(found, unit)}"
        elif raw:
            noise = max((c.noise for c in raw if c.noise), default=None)
            counted = raw[0].name.rpartition("_")[2]
            yield f"    {key}:  # {unit}; {how.format(f'{noise:.2g} {counted}' if noise else '')}"


def _seen(channels: Sequence[ChannelOverview], unit: str) -> str:
    noise, step = (max((getattr(c, name) or 0.0 for c in channels), default=0.0) for name in ("noise", "step"))
    if not max(noise, step):
        return f" # {unit}"
    what = f"the noise seen at rest, standard deviation, {unit}" if noise >= step else f"the smallest step seen, {unit}"
    return f"{max(noise, step):.3g}  # {what}"


def _alike(pretensions: Iterable[float | None]) -> float | None:
    """The mean of pretensions that are one, or None."""
    known = [p for p in pretensions if p is not None]
    if not known or np.ptp(known) > ONE_PRETENSION * abs(np.mean(known)):
        return None
    return float(np.mean(known))


def _ids(files: Sequence[str]) -> dict[str, str]:
    """Names of recordings: those of their files without endings, as far as a name can have their characters."""
    ids: dict[str, str] = {}
    for file in files:
        name = recording_id(Path(file).name)
        while name in ids.values():
            name += "-2"
        ids[file] = name
    return ids


def _entry(name: str, log: _Log, pretension_N: float | None) -> Lines:
    seen = log.overview
    in_rad = THETA_IN in log.table
    entry = f"id: {_text(name)}, file: {_text(log.file)}"
    if pretension_N is not None:
        entry += f", pretension_N: {pretension_N:.3g}"
    if seen.wave:
        # No amplitude: one that was measured always agrees with the recording, and hides a wrong scale of the angles.
        entry += f", excitation: {{wave: {seen.wave}, frequency_Hz: {seen.frequency_Hz:.3g}}}"
    comment = [
        f"{seen.rate_Hz:.4g} Hz, {seen.duration_s:.3g} s",
        f"rest {seen.rest_s:.2g} s" if seen.rest_s else "no rest",
    ]
    comment.append(f"stroke {seen.stroke:.4g} {'rad' if in_rad else 'counts'}")
    if seen.frequency_Hz:
        comment.append(f"{seen.cycles:.1f} cycles of {seen.frequency_Hz:.3g} Hz")
    yield f"- {{{entry}}}  # {', '.join(comment)}"


def _text(value: str) -> str:
    """Text as YAML: in quotes if it could be read as anything else."""
    plain = re.fullmatch(r"[A-Za-z][A-Za-z0-9_./-]*", value) and value.lower() not in ("true", "false", "null")
    return value if plain else json.dumps(value, ensure_ascii=False)
