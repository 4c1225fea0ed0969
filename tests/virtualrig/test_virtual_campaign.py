"""Batches on disk: the committed ones are complete and reproducible."""

import gzip
import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from typer.testing import CliRunner
from virtual_runs import ROOT, changed, plan_of

from virtualrig.campaign import describe, record
from virtualrig.cli import app
from virtualrig.sensors import DECIMALS

RAW = ROOT / "data" / "raw"
BATCHES = ["half-loop", "loops", "pretension", "radius"]


def read_log(path):
    return pd.read_csv(path)


@pytest.fixture(scope="module")
def small_campaign(campaign):
    """One batch of two short recordings."""
    batch = changed(campaign.batches["half-loop"], excitation__rest_s=0.05, excitation__cycles=0.1)
    return campaign.model_copy(update={"batches": {"half-loop": batch}})


@pytest.mark.parametrize("name", BATCHES)
def test_committed_description_follows_from_the_config(campaign, name):
    committed = yaml.safe_load((RAW / name / "batch.yaml").read_text())
    assert committed == describe(campaign, name)
    assert committed["origin"] == "virtual-rig"
    files = {path.name for path in (RAW / name).iterdir()}
    assert files == {"batch.yaml"} | {recording["file"] for recording in committed["recordings"]}


@pytest.mark.parametrize("name", BATCHES)
def test_committed_logs_are_complete_and_within_the_sensors_range(campaign, name):
    sensors = campaign.sensors
    for plan in campaign.batches[name].recordings:
        log = read_log(RAW / name / f"{plan.id}.csv.gz")
        assert list(log.columns) == list(DECIMALS)
        assert log.time_s.iloc[-1] == pytest.approx(plan.excitation.duration_s, abs=1 / sensors.sample_rate_Hz)
        for side in ("drive", "load"):
            torque = log[f"{side}_current_A"] * sensors.torque.constant_Nm_per_A
            force = (log[f"{side}_load_cell_V"] - sensors.load_cell.zero_V) / sensors.load_cell.sensitivity_V_per_N
            assert torque.abs().max() < sensors.torque.range_Nm
            assert force.max() < sensors.load_cell.range_N
            assert force.min() > -6 * sensors.load_cell.noise_N
        rest = log[log.time_s <= 0.5]
        assert rest.drive_encoder_counts.nunique() == 1
        assert rest.load_encoder_counts.nunique() == 1


def test_radii_are_those_of_the_paper(campaign):
    for condition in campaign.batches["radius"].conditions:
        before, loop, after = condition.conduit
        radius_cm = float(condition.id.removeprefix("radius-").removesuffix("cm"))
        assert 100 * loop.length_m / loop.bend_rad == pytest.approx(radius_cm, abs=1e-3)
        assert before == after
        assert sum(piece.length_m for piece in condition.conduit) == pytest.approx(campaign.rig.cable.length_m)


@pytest.mark.parametrize("name", BATCHES)
def test_repeats_differ_by_about_a_percent(campaign, name):
    for condition in campaign.batches[name].conditions:
        a, b = (read_log(RAW / name / f"{condition.id}-{letter}.csv.gz") for letter in "ab")
        cycle = a.time_s > a.time_s.iloc[-1] - 2
        difference = (a.drive_current_A - b.drive_current_A)[cycle]
        # Means over 20 ms reduce the white noise to 0.03 % of the torque's range. At 0.7 N the difference is little
        # more, because both cables are slack most of the time.
        smooth = difference.rolling(10).mean().dropna()
        assert 5e-4 < (smooth - smooth.mean()).std() / np.ptp(a.drive_current_A[cycle]) < 0.03, condition.id


def test_a_committed_recording_is_reproducible(campaign):
    """On another processor, rounding changes a few samples after a slack cable becomes taut."""
    plan = plan_of(campaign, "pretension", "pretension-0.7N-a")
    again = np.genfromtxt(gzip.decompress(record(campaign, "pretension", plan)).decode().splitlines(), delimiter=",")
    committed = np.genfromtxt(RAW / "pretension" / "pretension-0.7N-a.csv.gz", delimiter=",")
    assert again.shape == committed.shape
    difference = again[1:] - committed[1:]
    sensors = campaign.sensors
    noise = [sensors.torque.noise_Nm / sensors.torque.constant_Nm_per_A] * 2
    noise += [sensors.load_cell.noise_N * sensors.load_cell.sensitivity_V_per_N] * 2
    assert (np.abs(difference[:, :3]).max(axis=0) <= [0, 1, 1]).all()  # time and counts
    assert (np.sqrt((difference[:, 3:] ** 2).mean(axis=0)) < 0.1 * np.array(noise)).all()


def test_same_seed_same_bytes_and_another_seed_another_run(small_campaign):
    plan, repeat = small_campaign.batches["half-loop"].recordings
    first = record(small_campaign, "half-loop", plan)
    assert record(small_campaign, "half-loop", plan) == first
    assert record(small_campaign, "half-loop", repeat) != first
    assert record(changed(small_campaign, seed=small_campaign.seed + 1), "half-loop", plan) != first


def test_one_command_records_and_replaces(small_campaign, tmp_path):
    config, out = tmp_path / "rig.yaml", tmp_path / "raw"
    config.write_text(yaml.safe_dump(small_campaign.model_dump(mode="json")))
    command = ["record", str(config), "--out", str(out), "--jobs"]
    assert CliRunner().invoke(app, [*command, "2"]).exit_code == 0
    made = {path.name: path.read_bytes() for path in (out / "half-loop").iterdir()}
    assert set(made) == {"batch.yaml", "half-loop-7.3N-a.csv.gz", "half-loop-7.3N-b.csv.gz"}
    assert CliRunner().invoke(app, [*command, "1"]).exit_code == 0
    assert {path.name: path.read_bytes() for path in (out / "half-loop").iterdir()} == made
    assert [path.name for path in out.iterdir()] == ["half-loop"]


def test_a_batch_of_a_real_rig_is_kept(small_campaign, tmp_path):
    config, out = tmp_path / "rig.yaml", tmp_path / "raw"
    config.write_text(yaml.safe_dump(small_campaign.model_dump(mode="json")))
    shutil.copytree(RAW / "half-loop", out / "half-loop")
    description = out / "half-loop" / "batch.yaml"
    description.write_text(description.read_text().replace("origin: virtual-rig", "origin: rig"))
    before = sorted(path.name for path in (out / "half-loop").iterdir())
    result = CliRunner().invoke(app, ["record", str(config), "--out", str(out)])
    assert result.exit_code == 2
    assert sorted(path.name for path in (out / "half-loop").iterdir()) == before


def test_an_unknown_batch_is_refused(tmp_path):
    result = CliRunner().invoke(
        app, ["record", str(ROOT / "config" / "virtual-rig.yaml"), "--out", str(tmp_path), "--batch", "lopps"]
    )
    assert result.exit_code == 2
    assert not list(tmp_path.iterdir())
