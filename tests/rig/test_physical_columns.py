import re

import numpy as np
import pandas as pd
import pytest
from made_up_batch import COUNTS, KT, SENSITIVITY, ZERO, R

from ccmodel.model.model_input import ModelInput
from ccmodel.rig.angle import resolution_seen, smallest_step
from ccmodel.rig.ingest import ingest_batch

STEP = 2 * np.pi / COUNTS
ANGLES = {"drive_encoder_counts": "theta_in_rad", "load_encoder_counts": "theta_out_rad"}
RAW = ("encoder_counts_per_rev", "torque_constant_Nm_per_A", "load_cell")


def in_si_units(table: pd.DataFrame, zero=0.4321, sign=1) -> pd.DataFrame:
    """A log of the bench with its quantities in SI units, written to nine decimals."""
    columns = {"time_s": table.time_s}
    for counts, angle in ANGLES.items():
        columns[angle] = sign * (table[counts] * STEP + zero)
    for end, of in (("drive", "in"), ("load", "out")):
        columns[f"tau_{of}_Nm"] = sign * table[f"{end}_current_A"] * KT
        columns[f"F_{end}_N"] = (table[f"{end}_load_cell_V"] - ZERO) / SENSITIVITY
    return pd.DataFrame(columns).round(9)


def as_tensions(physical: pd.DataFrame) -> pd.DataFrame:
    """The same with cable-end tensions in place of sums and torques."""
    table = physical[["time_s", "theta_in_rad", "theta_out_rad"]].copy()
    for force, torque, cables in (("F_drive_N", "tau_in_Nm", (1, 3)), ("F_load_N", "tau_out_Nm", (2, 4))):
        for cable, side in zip(cables, (1, -1), strict=True):
            table[f"T{cable}_N"] = (physical[force] + side * physical[torque] / R) / 2
    return table


def without_scales(bench, resolution=STEP):
    for end in ("drive", "load"):
        side = bench.described["rig"][end]
        for key in RAW:
            side.pop(key, None)
        if resolution is not None:
            side["angle_resolution_rad"] = resolution
    return bench


def changed(bench, change):
    bench.tables = {name: change(table) for name, table in bench.tables.items()}
    return bench


@pytest.fixture
def counted(tmp_path, bench):
    return ingest_batch(bench.write().folder).recordings[0]


@pytest.mark.parametrize("sign", [1, -1])
def test_counts_and_an_angle_with_its_resolution_give_the_same_input(bench, counted, sign):
    without_scales(bench)
    for end in ("drive", "load"):
        bench.described["rig"][end] |= {"encoder_sign": sign, "torque_sign": sign}
    changed(bench, lambda t: in_si_units(t, sign=sign))
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    physical = ingested.recordings[0]
    assert physical.derived_from["tau_in_Nm"] == f"{'-' if sign < 0 else ''}tau_in_Nm of the log"
    assert physical.rest_s == counted.rest_s
    assert set(physical.channels) == set(counted.channels)
    assert physical.encoder_step_rad == pytest.approx(dict(counted.encoder_step_rad))
    assert physical.accuracy == pytest.approx(dict(counted.accuracy))
    for channel in counted.channels:
        scale = np.ptp(counted[channel])
        assert physical[channel] == pytest.approx(counted[channel], abs=1e-6 * scale), channel
    known, found = ModelInput.of(counted), ModelInput.of(physical)
    for name in ("theta_in", "theta_out", "drive_deviations", "drive_encoder_offset"):
        assert getattr(found, name) == pytest.approx(getattr(known, name), abs=1e-6 * STEP), name
    assert {c: v.size for c, v in found.resting.items()} == {c: v.size for c, v in known.resting.items()}


def test_an_angle_without_a_step_is_not_snapped_and_its_noise_is_seen(bench, counted):
    noise = 2e-4
    random = np.random.default_rng(3)

    def smooth(table):
        time = table.time_s.to_numpy()
        theta = 0.6 * np.sin(np.pi * np.maximum(time - 0.4, 0)) + 0.2
        return in_si_units(table).assign(
            theta_in_rad=theta + random.normal(0, noise, time.size),
            theta_out_rad=0.9 * theta + random.normal(0, noise, time.size),
        )

    changed(without_scales(bench, resolution=None), smooth)
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    recording = ingested.recordings[0]
    assert recording.encoder_step_rad == {}
    assert recording.rest_s == pytest.approx(0.396, abs=0.02)
    resting = recording.time_s <= 0.386
    assert recording["theta_in_rad"][resting].mean() == pytest.approx(0, abs=3 * noise)
    given = ModelInput.of(recording)
    assert (given.theta_in == recording["theta_in_rad"]).all()
    assert given.drive_deviations.std() == pytest.approx(noise, rel=0.2)
    assert given.resting["tau_in_Nm"].size == pytest.approx(100, abs=5)
    assert given.initial_tension_observed


def test_tensions_give_sums_and_torques(bench, counted):
    changed(without_scales(bench), lambda t: as_tensions(in_si_units(t)))
    del bench.described["rig"]["accuracy"]["torque_Nm"]
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    recording = ingested.recordings[0]
    for channel in counted.channels:
        assert recording[channel] == pytest.approx(counted[channel], abs=1e-6 * np.ptp(counted[channel])), channel
    assert recording.derived_from["tau_in_Nm"] == "(T1_N - T3_N) * 0.006 m"
    assert recording.derived_from["F_load_N"] == "T2_N + T4_N"
    assert recording.accuracy["F_drive_N"] == pytest.approx(np.sqrt(2) * 0.1)
    assert recording.accuracy["tau_in_Nm"] == pytest.approx(np.sqrt(2) * 0.1 * R)
    assert recording.accuracy["T4_N"] == 0.1


def test_logged_sums_and_torques_and_tensions_are_all_kept(bench):
    def with_own_sum(table):
        physical = in_si_units(table)
        return as_tensions(physical).assign(F_drive_N=physical.F_drive_N + 1, tau_in_Nm=2 * physical.tau_in_Nm)

    changed(without_scales(bench), with_own_sum)
    recording = ingest_batch(bench.write().folder).recordings[0]
    logged = bench.tables["one"]
    for channel in ("F_drive_N", "tau_in_Nm", "T1_N", "T3_N"):
        assert recording[channel] == pytest.approx(logged[channel].to_numpy()), channel
    assert recording["F_load_N"] == pytest.approx((logged.T2_N + logged.T4_N).to_numpy())


def test_one_tension_of_a_pair_is_kept_and_the_other_follows(bench, counted):
    changed(without_scales(bench), lambda t: in_si_units(t).assign(T1_N=3.0 + 0.1 * np.sin(t.time_s)))
    recording = ingest_batch(bench.write().folder).recordings[0]
    assert recording["T1_N"] == pytest.approx(bench.tables["one"].T1_N.to_numpy())
    assert recording["T3_N"] == pytest.approx(counted["T3_N"], abs=1e-6)


@pytest.mark.parametrize("logged", ["force", "torque"])
@pytest.mark.parametrize(("one", "other"), [("T1_N", "T3_N"), ("T3_N", "T1_N"), ("T2_N", "T4_N"), ("T4_N", "T2_N")])
def test_the_other_tension_follows_from_the_sum_or_the_torque(bench, counted, logged, one, other):
    force, torque = ("F_drive_N", "tau_in_Nm") if one in ("T1_N", "T3_N") else ("F_load_N", "tau_out_Nm")
    kept, derived = (force, torque) if logged == "force" else (torque, force)
    given = counted[one]
    changed(without_scales(bench), lambda t: in_si_units(t).drop(columns=derived).assign(**{one: given[: len(t)]}))
    recording = ingest_batch(bench.write().folder).recordings[0]
    for channel in (other, derived):
        assert recording[channel] == pytest.approx(counted[channel], abs=1e-5), channel
    of, cell = recording.accuracy, 0.1
    sensor = cell if kept == force else 0.0001 / R
    expected = {force: np.hypot(2 * cell, sensor), torque: R * np.hypot(2 * cell, sensor)}
    assert of[derived] == pytest.approx(expected[derived])
    assert of[other] == pytest.approx(np.hypot(cell, sensor))


@pytest.mark.parametrize("sign", [1, -1])
def test_the_formula_of_an_angle_gives_the_channel(bench, sign):
    changed(without_scales(bench), lambda t: in_si_units(t))
    bench.described["rig"]["drive"]["encoder_sign"] = sign
    recording = ingest_batch(bench.write().folder).recordings[0]
    formula = re.sub(" rad, the mean at rest", "", recording.derived_from["theta_in_rad"])
    table = bench.tables["one"]
    assert eval(formula, {"theta_in_rad": table.theta_in_rad.to_numpy()}) == pytest.approx(
        recording["theta_in_rad"], abs=1e-4
    )


def single(bench, change):
    without_scales(changed(bench, change))
    bench.described["rig"] |= {"transmission": "single-cable", "far_end": "spring"}
    return ingest_batch(bench.write().folder)


def test_the_tension_of_a_single_cable_is_its_load_cell(bench):
    ingested = single(bench, lambda t: as_tensions(in_si_units(t)).drop(columns=["T3_N", "T4_N"]))
    assert ingested.findings == []
    recording = ingested.recordings[0]
    assert (recording["F_drive_N"] == recording["T1_N"]).all()
    assert (recording["F_load_N"] == recording["T2_N"]).all()
    assert "tau_in_Nm" not in recording


def test_the_tension_of_a_single_cable_without_a_load_cell_is_its_torque_over_the_radius(bench):
    recording = single(bench, lambda t: in_si_units(t).drop(columns=["F_drive_N", "F_load_N"])).recordings[0]
    logged = bench.tables["one"]
    for tension, torque in (("T1_N", "tau_in_Nm"), ("T2_N", "tau_out_Nm")):
        assert recording[tension] == pytest.approx(logged[torque].to_numpy() / 0.006)
        # 0.1 mN m over 6 mm.
        assert recording.accuracy[tension] == pytest.approx(0.1 / 6)


def test_a_single_cable_has_no_cable_b(bench):
    ingested = single(bench, lambda t: as_tensions(in_si_units(t)).drop(columns="T4_N"))
    assert {(f.column, f.text) for f in ingested.findings} == {("T3_N", "not used: a single cable has no cable B")}
    assert "T3_N" not in ingested.recordings[0]


@pytest.mark.parametrize(
    ("far_end", "lost", "text"),
    [
        ("measured-motion", ["theta_out_rad"], "far_end is measured-motion: one of load_encoder_counts, theta_out_rad"),
        ("measured-tension", ["F_load_N", "tau_out_Nm"], "far_end is measured-tension: one of load_load_cell_V"),
    ],
)
def test_the_far_end_of_a_single_cable_is_measured(bench, far_end, lost, text):
    without_scales(changed(bench, in_si_units))
    bench.described["rig"] |= {"transmission": "single-cable", "far_end": far_end}
    del bench.described["rig"]["load"]["spring_stiffness_Nm_per_rad"]
    assert ingest_batch(bench.write().folder).findings == []
    del bench.described["rig"]["load"]["angle_resolution_rad"]
    changed(bench, lambda t: t.drop(columns=lost))
    ingested = ingest_batch(bench.write().folder)
    assert ingested.recordings == []
    assert all(text in finding.text for finding in ingested.findings)


def refused(bench):
    ingested = ingest_batch(bench.write().folder)
    assert ingested.recordings == [] and ingested.batch is None
    (finding,) = ingested.findings
    assert finding.severity == "refused"
    assert finding.file == str(bench.folder / "batch.yaml")
    return finding.text


def test_counts_need_their_counts_per_revolution(bench):
    del bench.described["rig"]["drive"]["encoder_counts_per_rev"]
    text = "rig.drive.encoder_counts_per_rev: fill in the counts of the drive encoder per revolution of its pulley"
    assert refused(bench) == f"{text}; the logs have drive_encoder_counts"


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("torque_Nm", "rig.accuracy.torque_Nm: fill in the accuracy of the torques, N m; the logs have tau_in_Nm, tau"),
        ("load_cell_N", "rig.accuracy.load_cell_N: fill in the accuracy of the load cells, N; the logs have F_drive_N"),
    ],
)
def test_physical_columns_need_an_accuracy(bench, key, text):
    without_scales(changed(bench, in_si_units))
    del bench.described["rig"]["accuracy"][key]
    assert refused(bench).startswith(text)


@pytest.mark.parametrize("raw", ["drive_encoder_counts", "load_current_A", "drive_load_cell_V"])
def test_a_quantity_is_logged_once(bench, raw):
    physical = {
        "drive_encoder_counts": "theta_in_rad",
        "load_current_A": "tau_out_Nm",
        "drive_load_cell_V": "F_drive_N",
    }
    bench.tables["one"][physical[raw]] = in_si_units(bench.tables["one"])[physical[raw]]
    (finding,) = ingest_batch(bench.write().folder).findings
    assert (finding.severity, finding.row, finding.column) == ("refused", 1, physical[raw])
    assert finding.text == f"the log has {raw} too, which is the same quantity: keep one"


def test_a_log_needs_a_drive_angle(bench):
    without_scales(changed(bench, lambda t: in_si_units(t).rename(columns={"theta_in_rad": "theta_in_deg"})))
    findings = ingest_batch(bench.write().folder).findings
    assert all("or theta_in_rad, is required and missing; found time_s, theta_in_deg" in f.text for f in findings)


def test_another_unit_is_no_misspelling(bench):
    bench.tables["one"] = bench.tables["one"].rename(columns={"drive_current_A": "drive_current_mA"})
    (finding,) = ingest_batch(bench.write().folder).findings
    text = "unknown column; did you mean 'drive_current_A'? That is in A: convert the values."
    assert (finding.severity, finding.text) == ("refused", text)


def test_logs_may_differ_in_how_they_have_a_quantity(bench):
    bench.described["rig"]["load"]["angle_resolution_rad"] = STEP
    one = bench.tables["one"]
    one["theta_out_rad"] = one.pop("load_encoder_counts") * STEP
    ingested = ingest_batch(bench.write().folder)
    assert {f.severity for f in ingested.findings} == {"warning"} or ingested.findings == []
    assert ["theta_out_rad" in r for r in ingested.recordings] == [True, True]


def angle_fault(bench, change, resolution=STEP):
    without_scales(changed(bench, in_si_units), resolution)
    bench.tables["one"] = change(bench.tables["one"])
    # A faulty angle contradicts the other recording too, which is said after the fault.
    return next(f for f in ingest_batch(bench.write().folder).findings if f.file == str(bench.log()))


# An angle in steps has no noise.
@pytest.mark.parametrize(("resolution", "noise"), [(STEP, 0), (0, 0), (0, 1e-4)])
@pytest.mark.parametrize(
    ("column", "change", "severity", "text"),
    [
        ("theta_in_rad", lambda v, i: v * 0 + 0.3, "refused", "stands still throughout: encoder stuck or drive"),
        ("theta_in_rad", lambda v, i: v.where(i < 200, v[199]), "refused", "while the load moves: encoder stuck"),
        ("theta_in_rad", lambda v, i: v - 120 * STEP * (i >= 180), "refused", "rad in one sample: counter reset"),
        ("theta_out_rad", lambda v, i: v * 0 + 0.3, "inconsistent", "stands still throughout while the drive moves"),
        ("theta_out_rad", lambda v, i: v - 120 * STEP * (i >= 180), "inconsistent", "rad in one sample: counter reset"),
        ("theta_out_rad", lambda v, i: v.where(i < 120, v[119]), "warning", "while the drive runs through its whole"),
    ],
)
def test_faults_of_an_angle_in_rad(bench, resolution, noise, column, change, severity, text):
    random = np.random.default_rng(4)

    def faulty(table):
        noisy = table[["theta_in_rad", "theta_out_rad"]] + random.normal(0, noise, (len(table), 2))
        noisy[column] = change(noisy[column], table.index)
        return table.assign(**noisy)

    finding = angle_fault(bench, faulty, resolution)
    assert (finding.severity, finding.column) == (severity, column)
    assert text in finding.text


def test_an_angle_must_move_in_its_stated_steps(bench):
    finding = angle_fault(bench, lambda t: t, resolution=1.37 * STEP)
    assert finding.severity == "refused"
    assert "does not move in steps of rig.drive.angle_resolution_rad 0.00430398 rad" in finding.text
    assert "the readings have a step of 0.00314159 rad; state 0 to take it as it is" in finding.text


def test_steps_that_are_not_stated_are_a_warning(bench):
    without_scales(changed(bench, in_si_units), resolution=None)
    ingested = ingest_batch(bench.write().folder)
    assert len(ingested.recordings) == 2
    assert {(f.severity, f.column) for f in ingested.findings} == {
        ("warning", "theta_in_rad"),
        ("warning", "theta_out_rad"),
    }
    assert "moves in steps of 0.00314159 rad, which are taken for motion: state rig.drive." in ingested.findings[0].text
    without_scales(bench, resolution=0)
    assert ingest_batch(bench.write().folder).findings == []


@pytest.mark.parametrize(
    ("values", "step"),
    [
        (np.array([3.0, 3.0]), None),
        (np.array([0.0, 1e-10, 1.0]), 1.0),
        (np.array([0.0, 6.0, 15.0]), 3.0),
        (0.1 + STEP * np.array([0, 2, 5, 9, 100, 101.0]), STEP),
        ((0.1 + STEP * np.r_[np.arange(0, 300, 2), 333, 20001]).round(6), STEP),
        ((0.1 + STEP * np.arange(300)).round(6), STEP),
        (np.random.default_rng(0).normal(0, 1, 2000), None),
        (np.random.default_rng(0).normal(0, 1, 2000).round(4), 1e-4),
    ],
)
def test_smallest_step(values, step):
    assert smallest_step(values) == (step if step is None else pytest.approx(step, rel=1e-5))


def test_digits_below_the_noise_are_no_resolution():
    time = np.arange(1000) / 250
    random = np.random.default_rng(0)
    moving = 0.5 * np.sin(2 * np.pi * np.maximum(time - 1, 0))
    assert resolution_seen(time, (moving + random.normal(0, 2e-3, 1000)).round(4)) == 0
    assert resolution_seen(time, moving.round(6)) == 0
    assert resolution_seen(time, np.round(moving / STEP) * STEP) == pytest.approx(STEP)
