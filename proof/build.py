"""Cases on disk: the batch that a diagnosis is given, and what only the scorer sees."""

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from proof.cases import Case
from virtualrig.campaign import as_yaml, compress, description, log_name, prepare, recording_generator, run
from virtualrig.config import Campaign, LoadCell, RecordingPlan, TorqueSensor
from virtualrig.motion import Excitation, smooth_step
from virtualrig.sensors import log, sensed_sides
from virtualrig.trajectory import Preparation, SimulationError, Trajectory

NOTE = "recordings of a simulated rig; its physics is not disclosed"
RAISE = 1.5
HIGHEST_LIMIT_N = 2000.0
# By which friction differs from run to run: what a model with the right physics cannot know of a recording.
FLOOR_FRICTION = 1.01
# Within which a drive that stood elsewhere in its count comes to where the counts say.
DISPLACED_IN_S = 0.3


def build(case: Case, out: Path) -> dict:
    """Write a case's batch to `out`/cases and what is kept back to `out`/kept-back.

    Returns
    -------
    dict
        The manifest's entry: digests of the key, the batch and what is kept back. No answer.
    """
    batch, kept = out / "cases" / case.name, out / "kept-back" / case.name
    record(case, case.recordings, batch)
    floors = floors_of(case, record(case, case.kept_back, kept))
    (kept / "floor.json").write_text(json.dumps(floors, indent=1), encoding="utf-8")
    return {"key": case.digest, "batch": folder_digest(batch), "kept-back": folder_digest(kept)}


def folder_digest(folder: Path) -> str:
    """Digest of a folder's files, names included."""
    digest = hashlib.sha256()
    for file in sorted(folder.iterdir()):
        digest.update(file.name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def simulate(campaign: Campaign, plan: RecordingPlan, preparation: Preparation) -> Trajectory:
    """Run a recording with the lowest tension limit, and so the longest time step, that holds it."""
    limit = campaign.numerics.tension_limit_N
    while True:
        numerics = campaign.numerics.model_copy(update={"tension_limit_N": limit})
        try:
            return run(campaign.model_copy(update={"numerics": numerics}), plan, preparation)
        except SimulationError:
            limit *= RAISE
            if limit > HIGHEST_LIMIT_N:
                raise


def shown(campaign: Campaign, trajectory: Trajectory) -> dict[str, NDArray]:
    """Channels as faulty sensors without noise would show them."""
    drive, load = sensed_sides(trajectory, campaign.rig)
    return {
        "theta_out_rad": load.angle_rad,
        "tau_in_Nm": drive.torque_Nm,
        "tau_out_Nm": load.torque_Nm,
        "F_drive_N": drive.force_N,
        "F_load_N": load.force_N,
    }


@dataclass(frozen=True)
class Displaced:
    """A motion that begins by as much more as the drive's first count leaves open."""

    motion: Excitation
    by_rad: float

    @property
    def duration_s(self) -> float:
        """Length of the whole motion, s."""
        return self.motion.duration_s

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s)."""
        angle, rate = self.motion.angle_and_rate(time_s)
        way, slope = smooth_step((time_s - self.motion.rest_s) / DISPLACED_IN_S)
        return angle + self.by_rad * way, rate + self.by_rad * slope / DISPLACED_IN_S


def floor_of(
    campaign: Campaign, plan: RecordingPlan, preparation: Preparation, trajectory: Trajectory
) -> dict[str, float]:
    """Root mean square error that the true physics would leave in each channel of a recording that went like this.

    It does not know this run's friction to better than one per cent, where in its count the drive stood at rest, the
    sensors' noise and the zeros of the torques. Where in its count the load stood counts twice, as its zero is taken
    from the same rest. The pretension is what two load cells show at rest: each is then off by half of what their
    zeros differ by.
    """
    sensors = campaign.sensors
    count = (2 * np.pi / sensors.encoder.counts_per_rev) ** 2 / 12
    other = replace(preparation, friction_coefficient=preparation.friction_coefficient * FLOOR_FRICTION)
    moved = plan.model_copy(update={"excitation": Displaced(plan.excitation, np.sqrt(count))})
    a = shown(campaign, trajectory)
    b = shown(campaign, simulate(campaign, moved, other))
    torque = _variance(sensors.torque) + sensors.torque.accuracy_Nm**2 / 3
    force = _variance(sensors.load_cell) + sensors.load_cell.accuracy_N**2 / 6
    unknown = {
        "theta_out_rad": 2 * count,
        "tau_in_Nm": torque,
        "tau_out_Nm": torque,
        "F_drive_N": force,
        "F_load_N": force,
    }
    return {name: float(np.sqrt(np.mean((a[name] - b[name]) ** 2) + unknown[name])) for name in a}


def _variance(sensor: TorqueSensor | LoadCell) -> float:
    """Of white and slow noise, in the sensor's unit squared."""
    noise = sensor.noise_Nm if isinstance(sensor, TorqueSensor) else sensor.noise_N
    return noise**2 * (1 + (sensor.slow_noise.ratio if sensor.slow_noise else 0.0) ** 2)


def record(case: Case, plans: Sequence[RecordingPlan], folder: Path) -> dict[str, tuple[Preparation, Trajectory]]:
    """Write a batch of some of a case's recordings into a folder of its own; by id, how each began and went."""
    # What a build that was stopped left behind.
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    campaign, went = case.campaign, {}
    for plan in plans:
        draw = recording_generator(case.seed, case.name, plan.id)
        preparation = prepare(campaign, plan, draw)
        trajectory = simulate(campaign, plan, preparation)
        went[plan.id] = preparation, trajectory
        (folder / log_name(plan)).write_bytes(compress(log(trajectory, campaign.sensors, campaign.rig, draw)))
    described = description(campaign, case.name, NOTE, plans)
    (folder / "batch.yaml").write_text(as_yaml(described), encoding="utf-8")
    return went


def floors_of(case: Case, went: Mapping[str, tuple[Preparation, Trajectory]]) -> dict[str, dict[str, float]]:
    """Floors of the kept-back recordings by their ids (`floor_of`), from how each began and went."""
    return {plan.id: floor_of(case.campaign, plan, *went[plan.id]) for plan in case.kept_back}
