"""The encoder of a motor behind the drive train: a further column of a log."""

import numpy as np
import pytest
from made_up_batch import COUNTS, Bench

from ccmodel.rig.ingest import ingest_batch

GEAR = 35


@pytest.fixture
def bench(tmp_path):
    """A batch whose motor leads the drive pulley by 0.01 rad and counts against it."""
    bench = Bench(tmp_path)
    bench.described["rig"]["drive"] |= {"motor_counts_per_rev": COUNTS * GEAR, "motor_sign": -1}
    for table in bench.tables.values():
        moved = table.drive_encoder_counts - table.drive_encoder_counts[0]
        lead = 0.01 * np.sign(moved) * COUNTS / 2 / np.pi
        table["motor_encoder_counts"] = 7 - np.round(GEAR * (moved + lead)).astype(int)
    return bench


def test_counts_become_the_angle_at_the_drive_pulley(bench):
    ingested = ingest_batch(bench.write().folder)
    assert not ingested.findings
    one = ingested.recordings[0]
    lead = one["theta_motor_rad"] - one["theta_in_rad"]
    moving = np.abs(one["theta_in_rad"]) > 2 * np.pi / COUNTS
    assert np.abs(lead[moving] - 0.01 * np.sign(one["theta_in_rad"][moving])).max() < 2 * np.pi / COUNTS


def test_a_log_may_have_the_angle_itself(bench):
    raw = ingest_batch(bench.write().folder).recordings[0]["theta_motor_rad"]
    for table in bench.tables.values():
        counts = table.pop("motor_encoder_counts")
        table["theta_motor_rad"] = counts * 2 * np.pi / COUNTS / GEAR
    assert ingest_batch(bench.write().folder).recordings[0]["theta_motor_rad"] == pytest.approx(raw)


def test_counts_without_their_key_are_not_used(bench):
    del bench.described["rig"]["drive"]["motor_counts_per_rev"]
    ingested = ingest_batch(bench.write().folder)
    assert "theta_motor_rad" not in ingested.recordings[0]
    assert all("batch.yaml lacks rig.drive.motor_counts_per_rev" in f.text for f in ingested.findings)
    assert len(ingested.findings) == 2


def test_a_stated_encoder_that_no_log_has_is_named(bench):
    for table in bench.tables.values():
        del table["motor_encoder_counts"]
    (finding,) = ingest_batch(bench.write().folder).findings
    assert "states rig.drive.motor_counts_per_rev, but no log has motor_encoder_counts" in finding.text


def lose_counts(table):
    table.loc[200:, "motor_encoder_counts"] += 60_000


def stand_still(table):
    table["motor_encoder_counts"] = 7


@pytest.mark.parametrize("damage", [lose_counts, stand_still])
def test_a_faulty_motor_encoder_is_named_and_not_used(bench, damage):
    damage(bench.tables["one"])
    ingested = ingest_batch(bench.write().folder)
    (finding,) = ingested.findings
    assert (finding.column, finding.severity) == ("motor_encoder_counts", "inconsistent")
    assert "column not used" in finding.text
    assert "theta_motor_rad" not in ingested.recordings[0]
    assert "theta_motor_rad" in ingested.recordings[1]
