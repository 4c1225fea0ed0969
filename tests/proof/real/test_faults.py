"""Faults change raw logs as they state, in the units of the logs."""

import numpy as np
import pandas as pd
import pytest
import yaml

from proof.real.faults import COGS, DRAG_REVERSAL_RAD, FAULTS, FULL_SCALE_NM, angle_rad, play, torque_Nm, write_batch

COUNTS = {
    "drive": {
        "encoder_counts_per_rev": 8192,
        "torque_sensor": {"Nm_per_count": 4e-5, "zero_counts": 100.0},
        "torque_sign": -1,
    },
    "load": {
        "encoder_counts_per_rev": 4000,
        "encoder_sign": -1,
        "torque_sensor": {"Nm_per_count": 4e-5, "zero_counts": -20.0},
    },
}
CURRENTS = {end: {"encoder_counts_per_rev": 2000, "torque_constant_Nm_per_A": 0.0234} for end in ("drive", "load")}
TIME_S = np.arange(0, 4, 0.001)
DRIVE = 0.6 * np.sin(2 * np.pi * 0.5 * TIME_S)


def counted(angle, per_rev):
    return np.rint(angle / (2 * np.pi) * per_rev).astype(int)


@pytest.fixture
def in_counts():
    return pd.DataFrame(
        {
            "time_s": TIME_S,
            "drive_encoder_counts": counted(DRIVE, 8192),
            "load_encoder_counts": counted(-0.8 * DRIVE, 4000),
            "drive_torque_counts": np.rint(1000 * np.cos(TIME_S)).astype(int),
            "load_torque_counts": np.rint(-500 + 300 * np.cos(TIME_S)).astype(int),
        }
    )


@pytest.fixture
def in_amperes():
    return pd.DataFrame(
        {
            "time_s": TIME_S,
            "drive_encoder_counts": counted(DRIVE, 2000),
            "load_encoder_counts": counted(0.8 * DRIVE, 2000),
            "drive_current_A": np.cos(TIME_S),
            "load_current_A": 0.5 * np.sin(TIME_S),
        }
    )


def test_play_follows_its_closed_form_up_and_down():
    up, down = np.linspace(0, 10, 201), np.linspace(10, -10, 401)
    output = play(np.concatenate([up, down]), 1.5)
    np.testing.assert_allclose(output[:201], np.maximum(up - 1.5, 0.0))
    np.testing.assert_allclose(output[201:], np.minimum(down + 1.5, 8.5))


def test_lost_motion_stands_still_over_twice_its_half_width_after_a_reversal(in_counts):
    after = FAULTS["lost-motion-of-jaw"](in_counts, COUNTS, 0.05)
    theta, seen = angle_rad(in_counts, COUNTS, "load"), angle_rad(after, COUNTS, "load")
    late = TIME_S > 1
    step = 2 * np.pi / 4000
    assert np.abs(seen - theta)[late].max() == pytest.approx(0.05, abs=step)
    assert np.ptp(seen[late]) == pytest.approx(np.ptp(theta[late]) - 0.1, abs=2 * step)
    # From the upper reversal at 2.5 s it rests until the jaw has moved back by 0.1 rad.
    resting = slice(2500, 2500 + int(np.argmax(theta[2500:] < theta[2500] - 0.1)) - 5)
    assert np.unique(after["load_encoder_counts"][resting]).size == 1
    assert after["load_encoder_counts"].dtype == in_counts["load_encoder_counts"].dtype


@pytest.mark.parametrize("end", ["drive", "load"])
def test_a_gain_keeps_the_sensors_zero(end, in_counts):
    after = FAULTS[f"gain-of-{end}-torque"](in_counts, COUNTS, -0.08)
    np.testing.assert_allclose(
        torque_Nm(after, COUNTS, end), 0.92 * torque_Nm(in_counts, COUNTS, end), atol=0.51 * 4e-5
    )
    others = in_counts.columns.drop(f"{end}_torque_counts")
    pd.testing.assert_frame_equal(after[others], in_counts[others])


def test_a_gain_of_a_current_is_a_gain_of_the_current(in_amperes):
    after = FAULTS["gain-of-drive-torque"](in_amperes, CURRENTS, 0.07)
    np.testing.assert_allclose(after["drive_current_A"], 1.07 * in_amperes["drive_current_A"])


def test_delayed_columns_repeat_earlier_samples(in_amperes):
    after = FAULTS["late-load-side"](in_amperes, CURRENTS, 0.0305)
    # The delay is half way between two samples.
    current = in_amperes["load_current_A"].to_numpy()
    np.testing.assert_allclose(
        after["load_current_A"].to_numpy()[31:], (current[:-31] + current[1:-30]) / 2, atol=1e-12
    )
    assert (after["load_current_A"][:30] == current[0]).all()
    counts = in_amperes["load_encoder_counts"].to_numpy()
    assert np.abs(after["load_encoder_counts"].to_numpy()[31:] - (counts[:-31] + counts[1:-30]) / 2).max() <= 0.5
    for column in ("time_s", "drive_encoder_counts", "drive_current_A"):
        pd.testing.assert_series_equal(after[column], in_amperes[column])


def test_only_the_torque_is_delayed(in_counts):
    after = FAULTS["late-drive-torque"](in_counts, COUNTS, 0.05)
    assert [c for c in after if not after[c].equals(in_counts[c])] == ["drive_torque_counts"]


def test_a_drift_is_proportional_to_time(in_counts, in_amperes):
    for log, rig, off in ((in_counts, COUNTS, 2.1e-5), (in_amperes, CURRENTS, 1e-12)):
        after = FAULTS["drift-of-drive-torque"](log, rig, -2e-3)
        np.testing.assert_allclose(
            torque_Nm(after, rig, "drive") - torque_Nm(log, rig, "drive"), -2e-3 * TIME_S, atol=off
        )


def test_a_drag_opposes_the_motion_and_dissipates_work(in_amperes):
    after = FAULTS["drag"](in_amperes, CURRENTS, 0.01)
    added = torque_Nm(after, CURRENTS, "drive") - torque_Nm(in_amperes, CURRENTS, "drive")
    theta = angle_rad(in_amperes, CURRENTS, "drive")
    assert added[0] == pytest.approx(0.01 * theta[0] / (DRAG_REVERSAL_RAD / 2))
    moving = np.abs(np.cos(2 * np.pi * 0.5 * TIME_S)) > 0.2
    np.testing.assert_allclose(added[moving][1:], 0.01 * np.sign(np.cos(np.pi * TIME_S))[moving][1:], atol=0.01)
    # Work over the travel: 0.01 N m times all of it, less the part in which the drag reverses.
    work = np.sum(added[1:] * np.diff(theta))
    travel = np.abs(np.diff(theta)).sum()
    assert 0.01 * (travel - 5 * DRAG_REVERSAL_RAD) < work < 0.01 * travel


def test_a_drag_with_the_load_is_a_share_of_its_torque(in_counts):
    after = FAULTS["drag-with-load"](in_counts, COUNTS, 0.3)
    added = torque_Nm(after, COUNTS, "drive") - torque_Nm(in_counts, COUNTS, "drive")
    upwards = (TIME_S > 1.55) & (TIME_S < 2.45)
    load = np.abs(torque_Nm(in_counts, COUNTS, "load"))
    assert load.max() > 2 * load.min()
    np.testing.assert_allclose(added[upwards], 0.3 * load[upwards], atol=2.1e-5)


def test_laws_that_no_list_holds(in_counts):
    theta, torque = angle_rad(in_counts, COUNTS, "drive"), torque_Nm(in_counts, COUNTS, "drive")
    moves = np.abs(np.cos(2 * np.pi * 0.5 * TIME_S)) > 0.2
    rising = np.cos(np.pi * TIME_S) > 0
    count = 2.1e-5

    def added(fault, size):
        return torque_Nm(FAULTS[fault](in_counts, COUNTS, size), COUNTS, "drive") - torque

    one_way = added("drag-in-one-direction", 0.01)
    assert np.abs(one_way[moves & ~rising]).max() < count
    np.testing.assert_allclose(one_way[moves & rising][5:], 0.01, atol=count)
    np.testing.assert_allclose(added("cogging", 0.005), 0.005 * np.sin(COGS * theta), atol=count)
    bent = added("bent-torque-sensor", 0.2)
    np.testing.assert_allclose(bent, 0.2 * torque * np.abs(torque) / FULL_SCALE_NM, atol=count)


def test_a_bent_torque_sensor_has_one_curve_in_all_recordings(in_amperes):
    def added(log):
        before, after = (
            torque_Nm(one, CURRENTS, "drive") for one in (log, FAULTS["bent-torque-sensor"](log, CURRENTS, 0.3))
        )
        return after - before

    weak = in_amperes[np.abs(in_amperes["drive_current_A"]) < 0.5]
    np.testing.assert_allclose(added(weak), added(in_amperes)[weak.index])
    full = in_amperes.assign(drive_current_A=FULL_SCALE_NM / 0.0234)
    np.testing.assert_allclose(added(full), 0.3 * FULL_SCALE_NM)


def test_the_motor_is_late_with_the_drive_side(in_counts):
    log = in_counts.assign(motor_encoder_counts=35 * in_counts["drive_encoder_counts"])
    after = FAULTS["late-drive-side"](log, COUNTS, 0.02)
    assert np.abs(after["motor_encoder_counts"] - 35 * after["drive_encoder_counts"]).max() <= 35


@pytest.fixture
def batch(in_counts, tmp_path):
    folder = tmp_path / "measured"
    folder.mkdir()
    for name in ("a", "b", "c"):
        in_counts.to_csv(folder / f"{name}.csv.gz", index=False)
    recordings = [{"id": name, "file": f"{name}.csv.gz", "settled_s": 1.0} for name in "abc"]
    stated = {"format": 1, "batch": "measured", "rig": COUNTS, "recordings": recordings}
    (folder / "batch.yaml").write_text(yaml.safe_dump(stated))
    return folder


def test_without_a_fault_the_logs_are_copied(batch, tmp_path):
    assert write_batch(batch, ["c", "a"], tmp_path / "case-1") == {}
    stated = yaml.safe_load((tmp_path / "case-1" / "batch.yaml").read_text())
    assert stated["batch"] == "case-1"
    assert [r["id"] for r in stated["recordings"]] == ["a", "c"]
    assert (tmp_path / "case-1" / "a.csv.gz").read_bytes() == (batch / "a.csv.gz").read_bytes()
    assert not (tmp_path / "case-1" / "b.csv.gz").exists()


def test_the_change_is_returned_and_the_source_is_kept(batch, tmp_path):
    before = (batch / "a.csv.gz").read_bytes()
    changed = write_batch(batch, ["a", "b"], tmp_path / "case-1", "drift-of-drive-torque", 1e-3)
    log, after = (pd.read_csv(folder / "a.csv.gz") for folder in (batch, tmp_path / "case-1"))
    settled = log["time_s"] >= 1
    drifted = (1e-3 * log["time_s"])[settled].std() / np.ptp(torque_Nm(log[settled], COUNTS, "drive"))
    assert changed == {"tau_in": pytest.approx(drifted, rel=1e-2)}
    assert (batch / "a.csv.gz").read_bytes() == before
    pd.testing.assert_frame_equal(after, FAULTS["drift-of-drive-torque"](log, COUNTS, 1e-3))


def test_a_missing_recording_is_refused(batch, tmp_path):
    with pytest.raises(ValueError, match="no recording d"):
        write_batch(batch, ["a", "d"], tmp_path / "case-1")
