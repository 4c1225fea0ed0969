"""Records the batches of a campaign: from its configuration to raw logs on disk (format 1)."""

import gzip
import io
import shutil
import zlib
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.random import Generator, SeedSequence
from numpy.typing import NDArray
from ruamel.yaml import YAML

from virtualrig.config import BatchPlan, Campaign, RecordingPlan, Repeatability, Rig
from virtualrig.dynamics import simulate
from virtualrig.effects import SideSensors
from virtualrig.grid import make_grid
from virtualrig.sensors import DECIMALS, log
from virtualrig.trajectory import Preparation, Trajectory

ORIGIN = "virtual-rig"


class BatchExistsError(FileExistsError):
    """A batch would replace a folder that the virtual rig did not make."""


def record_campaign(
    campaign: Campaign,
    out: Path,
    batches: Iterable[str],
    jobs: int,
    on_recorded: Callable[[str], None],
) -> None:
    """Record the named batches into `out`. A batch replaces an earlier one once all recordings are complete.

    Parameters
    ----------
    campaign : Campaign
        The rig and the plans of its recordings.
    out : Path
        Folder that gets one folder a batch.
    batches : iterable of str
        Names of batches of the campaign.
    jobs : int
        Number of processes. The recordings do not depend on it.
    on_recorded : callable
        Called with "batch/recording" when each is complete.

    Raises
    ------
    BatchExistsError
        If a folder to be replaced holds anything but a batch of the virtual rig.
    """
    names = list(batches)
    for name in names:
        _check_replaceable(out / name)
    out.mkdir(parents=True, exist_ok=True)
    with (
        TemporaryDirectory(dir=out, prefix=".recording-") as scratch,
        # Spawned, because forking a process with threads, such as a progress display, can hang.
        ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool,
    ):
        for name in names:
            (Path(scratch) / name).mkdir()
            _write_description(campaign, name, Path(scratch) / name)
        pending = {
            pool.submit(_record_to, Path(scratch) / name / log_name(plan), campaign, name, plan): f"{name}/{plan.id}"
            for name in names
            for plan in campaign.batches[name].recordings
        }
        for done in as_completed(pending):
            done.result()
            on_recorded(pending[done])
        for name in names:
            shutil.rmtree(out / name, ignore_errors=True)
            (Path(scratch) / name).rename(out / name)


def record(campaign: Campaign, batch: str, plan: RecordingPlan) -> bytes:
    """Simulate one recording; returns the bytes of its compressed log, equal on every call."""
    draw = recording_generator(campaign.seed, batch, plan.id)
    preparation = prepare(campaign, plan, draw)
    trajectory = run(campaign, plan, preparation)
    return compress(log(trajectory, campaign.sensors, rig_during(campaign, plan), draw))


def recording_generator(seed: int, batch: str, recording: str) -> Generator:
    """Random generator of one recording, which depends only on its name, its batch and the seed."""
    return np.random.default_rng(SeedSequence([seed, zlib.crc32(f"{batch}/{recording}".encode())]))


def prepare(campaign: Campaign, plan: RecordingPlan, draw: Generator) -> Preparation:
    """Draw the initial state of one recording: friction, pretension and tension profile."""
    spread: Repeatability = campaign.repeatability
    low, high = spread.profile_share
    drifted = 1 + campaign.rig.effects.friction_drift * plan.position
    return Preparation(
        friction_coefficient=drifted
        * campaign.rig.cable.friction_coefficient
        * (1 + spread.friction * draw.standard_normal()),
        pretension_N=(plan.pretension_N * (1 + spread.pretension * draw.standard_normal()),) * 2,
        profile_share=(draw.uniform(low, high), draw.uniform(low, high)),
        tensioned_before_s=_drawn(spread.tensioned_before_s, draw),
        ran_in_before=_drawn(spread.ran_in_before, draw),
        profile_curvature=(_drawn(spread.profile_curvature, draw), _drawn(spread.profile_curvature, draw)),
    )


def _drawn(between: tuple[float, float], draw: Generator) -> float:
    """A number between two bounds; no draw without a range, so that rigs without a past keep their noise."""
    low, high = between
    return draw.uniform(low, high) if high > low else high


def run(campaign: Campaign, plan: RecordingPlan, preparation: Preparation) -> Trajectory:
    """Simulate one recording's motion."""
    rate = campaign.sensors.sample_rate_Hz
    time_s = np.arange(round(plan.excitation.duration_s * rate) + 1) / rate
    numerics = campaign.numerics
    grid = make_grid(plan.conduit, numerics.cell_length_m, numerics.cell_bend_rad)
    motion = plan.excitation.angle_and_rate(time_s)
    return simulate(rig_during(campaign, plan), grid, numerics, preparation, time_s, motion)


def rig_during(campaign: Campaign, plan: RecordingPlan) -> Rig:
    """The rig with the stiffness and the zeros of the load cells as they are in one recording."""
    rig, effects = campaign.rig, campaign.rig.effects
    stiffness = (1 + effects.stiffness_drift * plan.position) * rig.cable.stiffness_N_per_m
    sides = {side: _drifted(getattr(effects, side), plan.position) for side in ("drive_sensors", "load_sensors")}
    return rig.model_copy(
        update={
            "cable": rig.cable.model_copy(update={"stiffness_N_per_m": stiffness}),
            "effects": effects.model_copy(update=sides),
        }
    )


def _drifted(sensors: SideSensors, position: float) -> SideSensors:
    offset_N = sensors.load_cell_offset_N + sensors.load_cell_zero_drift_N * position
    return sensors.model_copy(update={"load_cell_offset_N": offset_N, "load_cell_zero_drift_N": 0.0})


def compress(columns: dict[str, NDArray]) -> bytes:
    """A log as gzipped CSV without file name and time stamp, so that equal logs are equal files."""
    text = io.StringIO()
    formats = [f"%.{DECIMALS[name]}f" for name in columns]
    np.savetxt(text, np.column_stack(list(columns.values())), formats, ",", header=",".join(columns), comments="")
    return gzip.compress(text.getvalue().encode(), mtime=0)


def describe(campaign: Campaign, name: str) -> dict:
    """Content of a batch's ``batch.yaml``: what the experimenter knows, with estimates of the cables' parameters."""
    batch: BatchPlan = campaign.batches[name]
    return description(campaign, name, batch.note, batch.recordings)


def description(campaign: Campaign, name: str, note: str, plans: Sequence[RecordingPlan]) -> dict:
    """Content of a ``batch.yaml`` for any recordings of a campaign's rig."""
    rig, sensors = campaign.rig, campaign.sensors
    side = {
        "pulley_radius_m": rig.pulley_radius_m,
        "encoder_counts_per_rev": sensors.encoder.counts_per_rev,
        "torque_constant_Nm_per_A": sensors.torque.constant_Nm_per_A,
        "load_cell": {
            "sensitivity_V_per_N": sensors.load_cell.sensitivity_V_per_N,
            "zero_V": sensors.load_cell.zero_V,
        },
    }
    return {
        "format": 1,
        "batch": name,
        "origin": ORIGIN,
        "note": note,
        "rig": {
            "drive": side,
            "load": side | {"spring_stiffness_Nm_per_rad": rig.load.spring_stiffness_Nm_per_rad},
            "cable": rig.estimates.model_dump(),
            "accuracy": {
                "encoder_rad": sensors.encoder.accuracy_rad,
                "torque_Nm": sensors.torque.accuracy_Nm,
                "load_cell_N": sensors.load_cell.accuracy_N,
            },
        },
        "recordings": [
            {
                "id": plan.id,
                "file": log_name(plan),
                "pretension_N": plan.pretension_N,
                "conduit": [piece.model_dump() for piece in plan.conduit],
                "excitation": plan.excitation.metadata,
            }
            for plan in plans
        ],
    }


def concealed(campaign: Campaign) -> dict:
    """What the rig has and a batch does not state: each effect with its place, its size as a text, and its source."""
    effects = [
        {
            "name": effect.name,
            "place": effect.place,
            "text": ", ".join(
                f"{quantity} {factor * campaign.value_of(key):.3g} {unit}"
                for quantity, (key, factor, unit) in effect.sizes.items()
            ),
            "source": effect.source,
        }
        for effect in campaign.concealed
    ]
    return {"format": 1, "rigs": [{"batches": list(campaign.batches), "effects": effects}]}


def log_name(plan: RecordingPlan) -> str:
    """File name of a recording's log."""
    return f"{plan.id}.csv.gz"


def _record_to(path: Path, campaign: Campaign, batch: str, plan: RecordingPlan) -> None:
    path.write_bytes(record(campaign, batch, plan))


def _write_description(campaign: Campaign, name: str, folder: Path) -> None:
    (folder / "batch.yaml").write_text(as_yaml(describe(campaign, name)), encoding="utf-8")


def as_yaml(described: dict) -> str:
    """Text of a ``batch.yaml``."""
    writer, text = YAML(), io.StringIO()
    # Without anchors: constants that both sides share are written twice.
    writer.representer.ignore_aliases = lambda data: True
    writer.dump(described, text)
    return text.getvalue()


def _check_replaceable(folder: Path) -> None:
    if not folder.exists():
        return
    description = folder / "batch.yaml"
    known = YAML(typ="safe").load(description) if description.is_file() else None
    if not isinstance(known, dict) or known.get("origin") != ORIGIN:
        raise BatchExistsError(f"{folder} does not hold a batch of the virtual rig and is kept; move it away")
