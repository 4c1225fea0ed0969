"""Estimates and compensation on an independent rig: explicit dynamics, draws of friction and tension, real sensors."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import ccmodel as cc
from ccmodel.model.files import RigConditions
from ccmodel.model.parameters import Parameters
from virtualrig.campaign import as_yaml, compress, description, log_name, prepare, recording_generator, run
from virtualrig.config import RecordingPlan, read_campaign
from virtualrig.dynamics import simulate
from virtualrig.grid import make_grid
from virtualrig.motion import GrowingSine, Sine, WanderingSine, smooth_step
from virtualrig.sensors import log
from virtualrig.trajectory import Preparation

pytestmark = pytest.mark.long

RIG = Path(__file__).parents[1] / "data/ideal-rig/rig.yaml"
MOTIONS = (
    Sine(wave="sine", amplitude_rad=0.6, frequency_Hz=0.5, rest_s=0.5, start_up_cycles=1, cycles=2),
    WanderingSine(
        wave="wandering-sine",
        amplitude_rad=0.6,
        frequency_Hz=0.5,
        spread=0.3,
        seed=3,
        rest_s=0.5,
        start_up_cycles=1,
        cycles=2,
    ),
    GrowingSine(
        wave="growing-sine",
        first_amplitude_rad=0.2,
        amplitude_rad=0.7,
        frequency_Hz=0.5,
        rest_s=0.5,
        start_up_cycles=1,
        cycles=3,
    ),
)
RECORDINGS = 12


@pytest.fixture(scope="module")
def campaign():
    return read_campaign(RIG)


@pytest.fixture(scope="module")
def rig(campaign, tmp_path_factory):
    """A batch of the rig with the true load of each recording, and the model with the rig's own parameters."""
    folder = tmp_path_factory.mktemp("raw") / "ideal"
    folder.mkdir()
    conduit = next(iter(campaign.batches.values())).recordings[0].conduit
    plans = [
        RecordingPlan(id=f"r{i:02d}", pretension_N=7.0, conduit=conduit, excitation=MOTIONS[i % len(MOTIONS)])
        for i in range(RECORDINGS)
    ]
    truth = {}
    for plan in plans:
        draw = recording_generator(campaign.seed, folder.name, plan.id)
        trajectory = run(campaign, plan, prepare(campaign, plan, draw))
        (folder / log_name(plan)).write_bytes(compress(log(trajectory, campaign.sensors, campaign.rig, draw)))
        angle = trajectory.theta_out_rad - trajectory.theta_out_rad[0]
        truth[plan.id] = {"theta_out_rad": angle, "tau_out_Nm": trajectory.tau_out_Nm}
    (folder / "batch.yaml").write_text(as_yaml(description(campaign, folder.name, "made for a test", plans)))
    batch = cc.load(folder)
    cable, radius = campaign.rig.cable, campaign.rig.pulley_radius_m
    parameters = Parameters(
        cable.stiffness_N_per_m,
        cable.length_m,
        cable.friction_coefficient,
        radius,
        radius,
        campaign.rig.load.spring_stiffness_Nm_per_rad,
    )
    return batch, truth, cc.Model(parameters, RigConditions.of(batch.recordings))


def shares_and_errors(rig, **options):
    """By channel: the share of true values within the interval, and the rms error, a number for each recording."""
    batch, truth, model = rig
    found = cc.estimate(model, batch, **options)
    shares, errors = {}, {}
    for channel in ("theta_out_rad", "tau_out_Nm"):
        shares[channel], errors[channel] = [], []
        for recording in batch:
            table, true = found[recording.id], truth[recording.id][channel]
            moved = recording.time_s > recording.rest_s
            inside = (table[f"{channel}_low"] <= true) & (true <= table[f"{channel}_high"])
            shares[channel].append(inside[moved].mean())
            errors[channel].append(np.sqrt(np.mean((table[channel] - true)[moved] ** 2)))
    return {c: np.array(v) for c, v in shares.items()}, {c: np.array(v) for c, v in errors.items()}


@pytest.mark.parametrize("unknown_load", [False, True])
def test_intervals_contain_the_true_load(rig, unknown_load):
    shares, _ = shares_and_errors(rig, unknown_load=unknown_load)
    # Errors of friction and tension last for a recording: with one independent value for each of twelve recordings,
    # the share within 90 % intervals has a standard error of 9 %.
    error = np.sqrt(0.9 * 0.1 / RECORDINGS)
    for channel, share in shares.items():
        assert share.mean() > 0.9 - 1.96 * error, channel


def test_the_estimate_is_near_what_the_sensors_resolve(rig, campaign):
    _, errors = shares_and_errors(rig)
    # A third of a count, and three times the noise of one sample of the torque.
    count = 2 * np.pi / campaign.sensors.encoder.counts_per_rev
    assert errors["theta_out_rad"].mean() < count / 3
    assert np.median(errors["tau_out_Nm"]) < 6 * campaign.sensors.torque.noise_Nm


def test_an_unknown_load_costs_accuracy_but_not_by_orders(rig):
    (_, known), (_, unknown) = (shares_and_errors(rig, unknown_load=u) for u in (False, True))
    assert known["tau_out_Nm"].mean() < unknown["tau_out_Nm"].mean() < 1.5e-3


@pytest.fixture(scope="module")
def wanted():
    time_s = np.arange(0, 8.5, 0.002)
    since = np.maximum(time_s - 0.5, 0)
    angle = 0.4 * np.sin(np.pi * since) * smooth_step(since / 2)[0]
    return pd.DataFrame({"time_s": time_s, "theta_out_rad": angle})


def load_of(campaign, time_s, theta, preparation):
    """The rig's load from its rest, under a motion of the drive."""
    conduit = next(iter(campaign.batches.values())).recordings[0].conduit
    grid = make_grid(conduit, campaign.numerics.cell_length_m, campaign.numerics.cell_bend_rad)
    motion = theta, np.gradient(theta, time_s)
    trajectory = simulate(campaign.rig, grid, campaign.numerics, preparation, time_s, motion)
    return trajectory.theta_out_rad - trajectory.theta_out_rad[0]


def lost_motion(angle, wanted):
    late = wanted["time_s"] > 2.5
    return float(np.sqrt(np.mean((angle - wanted["theta_out_rad"])[late] ** 2)))


def test_compensation_takes_nearly_all_lost_motion_of_the_rig(rig, campaign, wanted):
    *_, model = rig
    motion = cc.compensate(
        model, wanted, pretension_N=7.0, max_speed_rad_per_s=10.0, max_acceleration_rad_per_s2=2000.0
    )
    nominal = Preparation(campaign.rig.cable.friction_coefficient, (7.0, 7.0), (0.2, 0.2))
    time_s = wanted["time_s"].to_numpy()
    straight = load_of(campaign, time_s, wanted["theta_out_rad"].to_numpy(), nominal)
    followed = load_of(campaign, time_s, motion.table["theta_in_rad"].to_numpy(), nominal)
    assert lost_motion(straight, wanted) > 0.04
    assert lost_motion(followed, wanted) < lost_motion(straight, wanted) / 500


def test_what_is_left_is_what_runs_differ_by(rig, campaign, wanted):
    *_, model = rig
    motion = cc.compensate(
        model, wanted, pretension_N=7.0, max_speed_rad_per_s=10.0, max_acceleration_rad_per_s2=2000.0
    )
    plan = next(iter(campaign.batches.values())).recordings[0].model_copy(update={"pretension_N": 7.0})
    time_s, theta = wanted["time_s"].to_numpy(), motion.table["theta_in_rad"].to_numpy()
    angles = [load_of(campaign, time_s, theta, prepare(campaign, plan, np.random.default_rng(k))) for k in range(5)]
    left = np.array([lost_motion(angle, wanted) for angle in angles])
    runs = lost_motion(np.std(angles, axis=0, ddof=1) + wanted["theta_out_rad"], wanted)
    assert np.sqrt(np.mean(left**2)) < 1.5 * runs
    assert (left < 0.04 / 5).all()
