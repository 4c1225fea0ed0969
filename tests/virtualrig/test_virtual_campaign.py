"""Batches on disk: the committed ones are complete and reproducible."""

import gzip
import json
import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from typer.testing import CliRunner
from virtual_runs import ROOT, changed, plan_of

from virtualrig.campaign import concealed, describe, record
from virtualrig.cli import app
from virtualrig.config import read_campaign
from virtualrig.effects import Effects
from virtualrig.sensors import DECIMALS

RAW = ROOT / "data" / "raw"
CONFIG = ROOT / "config" / "virtual-rig.yaml"
CAMPAIGN = read_campaign(CONFIG)


def read_log(path):
    return pd.read_csv(path)


@pytest.fixture(scope="module")
def small_campaign(campaign):
    """One batch of two short recordings."""
    batch = changed(campaign.batches["half-loop"], excitation__rest_s=0.05, excitation__cycles=0.1)
    return campaign.model_copy(update={"batches": {"half-loop": batch}})


@pytest.mark.parametrize("name", CAMPAIGN.batches)
def test_committed_description_follows_from_the_config(name):
    committed = yaml.safe_load((RAW / name / "batch.yaml").read_text())
    assert committed == describe(CAMPAIGN, name)
    assert committed["origin"] == "virtual-rig"
    files = {path.name for path in (RAW / name).iterdir()}
    assert files == {"batch.yaml"} | {recording["file"] for recording in committed["recordings"]}


def test_what_is_concealed_follows_from_the_config():
    committed = json.loads((ROOT / "data" / "concealed.json").read_text())
    assert committed == concealed(CAMPAIGN)
    (rig,) = committed["rigs"]
    assert rig["batches"] == list(CAMPAIGN.batches)
    assert {"name": "pulley-friction", "place": "drive-pulley", "text": "friction torque 22 mN m"}.items() <= (
        rig["effects"][0].items()
    )


def test_every_effect_of_the_rig_is_among_the_concealed():
    sizes = {key for effect in CAMPAIGN.concealed for key, *_ in effect.sizes.values()}
    present = CAMPAIGN.rig.effects.model_dump(exclude_defaults=True)
    for name, value in present.items():
        parts = value if name in ("drive_pulley", "load_pulley", "load", "drive_sensors", "load_sensors") else {"": 0}
        for part in parts:
            prefix = f"rig.effects.{name}.{part}".rstrip(".")
            assert any(key.startswith(prefix) for key in sizes), prefix
    assert CAMPAIGN.rig.effects != Effects()


@pytest.mark.parametrize(
    ("key", "message"),
    [("rig.effects.drag", "has no"), ("rig.effects.relaxation.7.share", "has no"), ("rig", "no number")],
)
def test_a_size_that_the_campaign_does_not_state_is_refused(key, message):
    described = CAMPAIGN.model_dump(mode="json")
    described["concealed"][0]["sizes"] = {"size": [key, 1.0, "m"]}
    with pytest.raises(ValueError, match=message):
        type(CAMPAIGN).model_validate(described)


@pytest.mark.parametrize("name", CAMPAIGN.batches)
def test_committed_logs_are_complete_and_within_the_sensors_range(name):
    sensors = CAMPAIGN.sensors
    for plan in CAMPAIGN.batches[name].recordings:
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


def test_radii_are_those_of_the_paper():
    for condition in CAMPAIGN.batches["radius"].conditions:
        before, loop, after = condition.conduit
        radius_cm = float(condition.id.removeprefix("radius-").removesuffix("cm"))
        assert 100 * loop.length_m / loop.bend_rad == pytest.approx(radius_cm, abs=1e-3)
        assert before == after
        assert sum(piece.length_m for piece in condition.conduit) == pytest.approx(CAMPAIGN.rig.cable.length_m)


@pytest.mark.parametrize("name", [name for name, batch in CAMPAIGN.batches.items() if batch.repeats == 2])
def test_repeats_differ_by_a_few_percent(name):
    for condition in CAMPAIGN.batches[name].conditions:
        a, b = (read_log(RAW / name / f"{condition.id}-{letter}.csv.gz") for letter in "ab")
        cycle = a.time_s > a.time_s.iloc[-1] - 2
        difference = (a.drive_current_A - b.drive_current_A)[cycle]
        # Means over 20 ms reduce the white noise to 0.03 % of the torque's range. At 0.7 N the difference is little
        # more, because both cables are slack most of the time.
        smooth = difference.rolling(10).mean().dropna()
        assert 5e-4 < (smooth - smooth.mean()).std() / np.ptp(a.drive_current_A[cycle]) < 0.06, condition.id


def test_a_committed_recording_is_reproducible():
    """On another processor, rounding changes a few samples after a slack cable becomes taut."""
    plan = plan_of(CAMPAIGN, "pretension", "pretension-0.7N-a")
    again = np.genfromtxt(gzip.decompress(record(CAMPAIGN, "pretension", plan)).decode().splitlines(), delimiter=",")
    committed = np.genfromtxt(RAW / "pretension" / "pretension-0.7N-a.csv.gz", delimiter=",")
    assert again.shape == committed.shape
    difference = again[1:] - committed[1:]
    sensors = CAMPAIGN.sensors
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


@pytest.mark.long
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
    result = CliRunner().invoke(app, ["record", str(CONFIG), "--out", str(tmp_path), "--batch", "lopps"])
    assert result.exit_code == 2
    assert not list(tmp_path.iterdir())
