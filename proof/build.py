"""Cases on disk: the batch that is diagnosed, and the held-out recordings that only the scorer reads."""

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proof.cases import Case
from virtualrig.campaign import as_yaml, compress, description, log_name, prepare, recording_generator, rig_during, run
from virtualrig.config import Campaign, LoadCell, RecordingPlan, Repeatability, TorqueSensor
from virtualrig.motion import Excitation, smooth_step
from virtualrig.sensors import log, sensed_sides
from virtualrig.trajectory import Preparation, SimulationError, Trajectory

NOTE = "recordings of a simulated rig; its physics is not disclosed"
# The tension limit is multiplied by this factor each time a run exceeds it.
LIMIT_FACTOR = 1.5
HIGHEST_LIMIT_N = 2000.0
# Time over which the drive's sub-count offset is added to the motion, s.
OFFSET_RISE_S = 0.3


def build(case: Case, out: Path) -> dict:
    """Write a case's batch to `out`/cases and its held-out recordings to `out`/kept-back.

    Returns
    -------
    dict
        The manifest's entry: digests of the answer, of the batch and of the held-out recordings. It holds no answer.
    """
    batch, held_out = out / "cases" / case.name, out / "kept-back" / case.name
    record(case, case.recordings, batch)
    floors = noise_floors(case, record(case, case.kept_back, held_out))
    (held_out / "floor.json").write_text(json.dumps(floors, indent=1), encoding="utf-8")
    return {"key": case.digest, "batch": folder_digest(batch), "kept-back": folder_digest(held_out)}


def folder_digest(folder: Path) -> str:
    """SHA-256 of the names and contents of a folder's files."""
    digest = hashlib.sha256()
    for file in sorted(folder.iterdir()):
        digest.update(file.name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def simulate(campaign: Campaign, plan: RecordingPlan, preparation: Preparation) -> Trajectory:
    """Simulate a recording, raising the tension limit until the run stays below it.

    The lowest sufficient limit gives the longest stable time step.

    Raises
    ------
    SimulationError
        If the run exceeds `HIGHEST_LIMIT_N`.
    """
    limit = campaign.numerics.tension_limit_N
    while True:
        numerics = campaign.numerics.model_copy(update={"tension_limit_N": limit})
        try:
            return run(campaign.model_copy(update={"numerics": numerics}), plan, preparation)
        except SimulationError:
            limit *= LIMIT_FACTOR
            if limit > HIGHEST_LIMIT_N:
                raise


def noise_free_channels(campaign: Campaign, trajectory: Trajectory) -> dict[str, NDArray]:
    """Sensor readings without noise, sensor faults included; each of shape (samples,)."""
    drive, load = sensed_sides(trajectory, campaign.rig)
    return {
        "theta_out_rad": load.angle_rad,
        "tau_in_Nm": drive.torque_Nm,
        "tau_out_Nm": load.torque_Nm,
        "F_drive_N": drive.force_N,
        "F_load_N": load.force_N,
    }


@dataclass(frozen=True)
class OffsetMotion:
    """A motion with a constant offset (rad), added smoothly over `OFFSET_RISE_S` after the rest.

    It stands for the drive angle within its first encoder count, which no log shows.
    """

    motion: Excitation
    offset_rad: float

    @property
    def duration_s(self) -> float:
        """Length of the whole motion, s."""
        return self.motion.duration_s

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        angle, rate = self.motion.angle_and_rate(time_s)
        step, slope = smooth_step((time_s - self.motion.rest_s) / OFFSET_RISE_S)
        return angle + self.offset_rad * step, rate + self.offset_rad * slope / OFFSET_RISE_S


@dataclass(frozen=True)
class Start:
    """The first samples of a motion."""

    motion: Excitation
    duration_s: float

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        return self.motion.angle_and_rate(time_s)


def noise_floor(
    campaign: Campaign, plan: RecordingPlan, preparation: Preparation, trajectory: Trajectory
) -> dict[str, float]:
    """Root mean square error of a model with the true physics, by channel: repeatability plus sensors.

    The recording is simulated again with friction higher by its standard deviation from run to run, the drive offset by
    one standard deviation of its sub-count position, and a past in the middle of its range. A model takes the tensions
    at both ends of the cables from the rest, so these are the same there. The sign of the offset is by chance: the
    square of the difference is the mean over both. It is added to the variances of the sensors' noise and of their
    zeros. The load's sub-count position counts twice, because its zero is read at the same rest. Both load cells give
    the pretension at rest, so that each is off by half the difference of their zeros.

    Parameters
    ----------
    campaign : Campaign
    plan : RecordingPlan
    preparation : Preparation
        Friction, pretension and tension profile of this run.
    trajectory : Trajectory
        The run.
    """
    sensors = campaign.sensors
    count_variance = (2 * np.pi / sensors.encoder.counts_per_rev) ** 2 / 12
    repeat = _repeat(campaign, plan, preparation, trajectory)
    first = noise_free_channels(campaign, trajectory)
    squares = dict.fromkeys(first, 0.0)
    for sign in (-1, 1):
        motion = OffsetMotion(plan.excitation, sign * np.sqrt(count_variance))
        again = simulate(campaign, plan.model_copy(update={"excitation": motion}), repeat)
        for name, values in noise_free_channels(campaign, again).items():
            squares[name] += float(np.mean((values - first[name]) ** 2)) / 2
    torque = _noise_variance(sensors.torque) + sensors.torque.accuracy_Nm**2 / 3
    force = _noise_variance(sensors.load_cell) + sensors.load_cell.accuracy_N**2 / 6
    sensor_variance = {
        "theta_out_rad": 2 * count_variance,
        "tau_in_Nm": torque,
        "tau_out_Nm": torque,
        "F_drive_N": force,
        "F_load_N": force,
    }
    return {name: float(np.sqrt(square + sensor_variance[name])) for name, square in squares.items()}


def _repeat(campaign: Campaign, plan: RecordingPlan, preparation: Preparation, trajectory: Trajectory) -> Preparation:
    """Another run with higher friction and the usual past that begins with the same tensions at the ends."""
    factor = 1 + campaign.repeatability.friction
    repeat = replace(
        preparation,
        friction_coefficient=factor * preparation.friction_coefficient,
        # The curvature does not change the ratio of a cable's end tensions.
        profile_share=tuple(share / factor for share in preparation.profile_share),
        **_usual_past(campaign.repeatability),
    )
    start = plan.model_copy(update={"excitation": Start(plan.excitation, 1 / campaign.sensors.sample_rate_Hz)})
    began = simulate(campaign, start, repeat)
    ratios = trajectory.T1_N[0] / began.T1_N[0], trajectory.T3_N[0] / began.T3_N[0]
    pretension_N = tuple(mean * ratio for mean, ratio in zip(repeat.pretension_N, ratios, strict=True))
    return replace(repeat, pretension_N=pretension_N)


def _usual_past(spread: Repeatability) -> dict[str, Any]:
    """The past that a model takes for a recording which shows none: the middle of its range, by field."""
    middle = {name: float(np.mean(getattr(spread, name))) for name in ("tensioned_before_s", "ran_in_before")}
    return {**middle, "profile_curvature": (float(np.mean(spread.profile_curvature)),) * 2}


def _noise_variance(sensor: TorqueSensor | LoadCell) -> float:
    """Variance of white and slow noise together, in the sensor's unit squared."""
    noise = sensor.noise_Nm if isinstance(sensor, TorqueSensor) else sensor.noise_N
    return noise**2 * (1 + (sensor.slow_noise.ratio if sensor.slow_noise else 0.0) ** 2)


def record(
    case: Case, plans: Sequence[RecordingPlan], folder: Path, recorded: Path | None = None
) -> dict[str, tuple[Preparation, Trajectory]]:
    """Simulate some of a case's recordings and write them as a batch to a new folder.

    Logs that the batch `recorded` of the same case has already are copied.

    Returns
    -------
    dict of str to (Preparation, Trajectory)
        Initial state and trajectory of each simulated recording, by id.
    """
    # An interrupted build may have left a partial folder.
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    campaign, runs = case.campaign, {}
    for plan in plans:
        if recorded is not None and (recorded / log_name(plan)).exists():
            shutil.copyfile(recorded / log_name(plan), folder / log_name(plan))
            continue
        draw = recording_generator(case.seed, case.name, plan.id)
        preparation = prepare(campaign, plan, draw)
        trajectory = simulate(campaign, plan, preparation)
        runs[plan.id] = preparation, trajectory
        columns = log(trajectory, campaign.sensors, rig_during(campaign, plan), draw)
        (folder / log_name(plan)).write_bytes(compress(columns))
    described = description(campaign, case.name, NOTE, plans)
    (folder / "batch.yaml").write_text(as_yaml(described), encoding="utf-8")
    return runs


def noise_floors(case: Case, runs: Mapping[str, tuple[Preparation, Trajectory]]) -> dict[str, dict[str, float]]:
    """`noise_floor` of every held-out recording, by id; `runs` is what `record` returned for them."""
    return {plan.id: noise_floor(case.campaign, plan, *runs[plan.id]) for plan in case.kept_back}
