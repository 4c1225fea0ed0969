"""Parity relations of known values, and mistakes in recorded batches."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from made_up_batch import T0, Bench, table

from benchmarks.input_mistakes import MISTAKES, Copy, outcome, read_copy, said_of, write_copy
from ccmodel import mechanisms as registry
from ccmodel.channels import ANGLE_AT, SUM_AT, TENSIONS_AT
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.clocks import drift_of, trend
from ccmodel.rig.consistency.exchanges import TORQUES, exchange_of
from ccmodel.rig.consistency.fitted import contradicted_by_fit
from ccmodel.rig.consistency.parity import Parity, closed_part, crossings, speed, white_noise
from ccmodel.rig.consistency.rectified import is_rectified
from ccmodel.rig.consistency.runs import deviations_of, forgotten_bend
from ccmodel.rig.consistency.scales import _angle_of_one_end, pooled
from ccmodel.rig.consistency.signs import (
    EXCHANGED,
    FAULTS,
    explanation,
    negative_relations,
    turning,
    wrong_signs,
)
from ccmodel.rig.ingest import ingest_batch
from ccmodel.rig.sensor_checks import held_for
from proof.build import record
from proof.cases import draw
from single_cable_batches import write_batch
from virtualrig.effects import Effects

SIMULATED, OTHER = Path("data/raw/pretension"), Path("tests/data/ideal-rig/loops")
SIGNS = {"angles": 1.0, "torques": 0.5, "work": 0.9, "load": 1.0, "loss": 0.9, "F_drive": 1.0, "F_load": 1.0}
# Values that a rig without load cells, spring and currents does not have, and recordings of another rig: all are of one
# tool.
NOT_MEASURED = (
    "both angles",
    "both ends off",
    "load cell",
    "forgotten",
    "pretension",
    "stated",
    "another rig",
    "magnitude",
    "single",
    "mN m",
)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Four trials of the da Vinci instrument."""
    copy = read_copy(Path("data/raw/da-vinci"))
    kept = ["trial-11", "trial-21", "trial-23", "trial-43"]
    copy.description["recordings"] = [copy.entry(name) for name in kept]
    few = Copy({name: copy.logs[name] for name in kept}, copy.description, [])
    return write_copy(few, tmp_path_factory.mktemp("measured") / "da-vinci")


def logging_rad(copy):
    """The same batch with the angles in rad."""
    for end, angle in ANGLE_AT.items():
        step = 2 * np.pi / copy.rig[end].pop("encoder_counts_per_rev")
        copy.rig[end]["angle_resolution_rad"] = step
        for log in copy.logs.values():
            log[angle] = log.pop(f"{end}_encoder_counts") * step
    return copy


def logging_sums(copy):
    """The same batch with the sums of tensions in N, in place of the load cells' voltage."""
    for end, channel in SUM_AT.items():
        cell = copy.rig[end].pop("load_cell")
        for log in copy.logs.values():
            log[channel] = (log.pop(f"{end}_load_cell_V") - cell["zero_V"]) / cell["sensitivity_V_per_N"]
    return copy


def logging_tensions(copy):
    """The same batch with the four tensions, in place of load cells and currents."""
    copy = logging_sums(copy)
    for end, tensions in TENSIONS_AT.items():
        constant, radius = copy.rig[end].pop("torque_constant_Nm_per_A"), copy.rig[end]["pulley_radius_m"]
        for log in copy.logs.values():
            total, difference = log.pop(SUM_AT[end]), log.pop(f"{end}_current_A") * constant / radius
            for name, sign in zip(tensions, (1, -1), strict=True):
                log[name] = (total + sign * difference) / 2
    del copy.rig["accuracy"]["torque_Nm"]
    return copy


def logging_one_tension(copy):
    """The same batch with a tension and the sum at each end, from which the torque follows."""
    copy = logging_tensions(copy)
    for end, (one, other) in TENSIONS_AT.items():
        for log in copy.logs.values():
            log[SUM_AT[end]] = log[one] + log.pop(other)
    return copy


def parity_of(tmp_path, **changes):
    bench = Bench(tmp_path)
    bench.tables["one"] = table(n=2000, seed=1, **changes)
    ingested = ingest_batch(bench.write().folder)
    return Parity(ingested.recordings[0], ingested.batch)


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_a_simulated_batch_is_named(mistake):
    found = outcome(SIMULATED, mistake, 1, [OTHER])
    assert found.named, found.said


@pytest.mark.parametrize("mistake", [m for m in MISTAKES if not any(part in m for part in NOT_MEASURED)])
def test_a_mistake_in_a_measured_batch_is_named(measured, mistake):
    found = outcome(measured, mistake, 1, [OTHER])
    assert found.named, found.said


@pytest.mark.parametrize("factor", [10, 1000])
@pytest.mark.parametrize("has_spring", [True, False])
def test_a_load_torque_in_a_smaller_unit_is_no_wrong_angle_and_no_wrong_cell(factor, has_spring, tmp_path):
    """Spring and stiffness are too large by it as well; the sum of tensions alone tells it from the angles."""
    copy = read_copy(Path("data/raw/half-loop"))
    for log in copy.logs.values():
        log["load_current_A"] *= factor
    if not has_spring:
        del copy.rig["load"]["spring_stiffness_Nm_per_rad"]
    (said,) = said_of(write_copy(copy, tmp_path / "unit"))
    assert said.startswith("batch.yaml tau_out_Nm: the load torque over the radius reaches")


@pytest.mark.parametrize("name", ["half-loop", "loops", "pretension", "radius", "rich"])
def test_a_batch_without_mistakes_contradicts_nothing(name):
    assert said_of(Path("data/raw") / name) == []


def test_measured_trials_contradict_nothing(measured):
    assert said_of(measured) == []


def test_an_exchange_of_names_throughout_is_no_mistake(tmp_path):
    """Cables A and B may be named either way: all angles and torques then change their sign."""
    copy = read_copy(SIMULATED)
    for log in copy.logs.values():
        for column in ("drive_encoder_counts", "load_encoder_counts", "drive_current_A", "load_current_A"):
            log[column] = -log[column]
    assert said_of(write_copy(copy, tmp_path / "mirrored")) == []


def test_a_drive_torque_that_no_tension_takes_is_named(tmp_path):
    """A torque constant in mN m; friction of the drive train makes a torque larger, but not by a thousand times."""
    copy = read_copy(SIMULATED)
    copy.description["rig"]["drive"]["torque_constant_Nm_per_A"] *= 1000
    assert any(
        "the drive torque over the radius reaches" in sentence for sentence in said_of(write_copy(copy, tmp_path / "b"))
    )


def test_a_pretension_that_both_ends_contradict_alike_is_the_stated_one(tmp_path):
    """Though at one end the ratio is a little within the limit."""
    copy = read_copy(SIMULATED)
    for entry in copy.description["recordings"]:
        entry["pretension_N"] *= 2.05
    said = said_of(write_copy(copy, tmp_path / "b"))
    assert [sentence for sentence in said if "pretension_N is the tension of one cable" in sentence], said


@pytest.mark.parametrize("factor", [1000.0, 3.0, 0.3])
def test_the_pretension_of_a_single_recording_is_named(tmp_path, factor):
    copy = read_copy(SIMULATED)
    copy.description["recordings"][1]["pretension_N"] *= factor
    (said,) = said_of(write_copy(copy, tmp_path / "b"))
    assert "Check pretension_N of this entry" in said
    assert f"half the sum of tensions of {copy.description['recordings'][1]['id']} at rest is" in said


def test_a_load_with_mass_contradicts_no_spring(tmp_path):
    """Above its resonance the torque of a load with mass falls with its angle: most slopes here are negative."""
    copy, inertia_over_spring_s2 = read_copy(Path("data/raw/rich")), 0.15
    for log in copy.logs.values():
        time, torque = log["time_s"].to_numpy(), log["load_current_A"].to_numpy()
        acceleration = speed(speed(torque, time), time)
        for column in ("load_current_A", "drive_current_A"):
            log[column] += inertia_over_spring_s2 * acceleration
    folder = write_copy(copy, tmp_path / "mass")
    ingested = ingest_batch(folder)
    slopes = [Parity(recording, ingested.batch).ratios["spring"] for recording in ingested.recordings]
    assert np.median(slopes) < -0.1
    assert pooled([Parity(r, ingested.batch) for r in ingested.recordings])["spring"] == pytest.approx(1.0, rel=0.05)
    assert not any("spring" in one for one in said_of(folder))


def test_the_same_samples_under_two_names_are_said_once_and_in_one_line(tmp_path):
    copy = read_copy(SIMULATED)
    first, second = list(copy.logs)[:2]
    copy.logs[second] = copy.logs[first].copy()
    (said,) = said_of(write_copy(copy, tmp_path / "twice"))
    assert f"{second} holds the same samples as {first}: take one of the two recordings out" in said


@pytest.mark.parametrize("name", ["da-vinci", "loops"])
def test_a_cable_longer_than_any_is_in_another_unit(name, tmp_path):
    """Its length is that of its stiffness: no other relation shows it on a rig without load cells."""
    copy = read_copy(Path("data/raw") / name)
    copy.rig["cable"]["length_m"] *= 1000.0
    (said,) = said_of(write_copy(copy, tmp_path / name))
    assert said.startswith("batch.yaml rig.cable.length_m") and "is the length in mm?" in said


def test_a_bend_in_degrees_is_no_conduit(tmp_path):
    copy = read_copy(SIMULATED)
    for entry in copy.description["recordings"]:
        entry["conduit"] = [{"length_m": 1.2, "bend_rad": 540.0}]
    (said,) = said_of(write_copy(copy, tmp_path / "degrees"))
    assert said.startswith("batch.yaml bend_rad") and "bends by 540 rad: is the bend in degrees?" in said


def test_a_cable_that_looks_soft_may_have_soft_fastenings(tmp_path):
    """As a warning that names the stated stiffness: two fastenings may yield by more than a stiff cable."""
    termination = registry.get("termination-compliance").parameter("compliance")
    assert pytest.approx(2 * termination.high) == limits.END_COMPLIANCE_M_PER_N
    copy = read_copy(SIMULATED)
    copy.rig["cable"]["stiffness_N_per_m"] *= 4.5
    ingested = ingest_batch(write_copy(copy, tmp_path / "soft"))
    (said,) = [f for f in ingested.findings if "rig.cable.stiffness_N_per_m is" in f.text]
    assert said.severity == "warning" and "fastenings of the cable that yield look the same" in said.text
    assert not ingested.contradicts


def test_a_nominal_value_is_not_compared(tmp_path):
    copy = read_copy(SIMULATED)
    copy.rig["cable"]["stiffness_N_per_m"] *= 10.0
    (said,) = said_of(write_copy(copy, tmp_path / "stated"))
    assert said.startswith("batch.yaml rig.cable.stiffness_N_per_m")
    copy.rig["nominal"] = ["cable.stiffness_N_per_m"]
    assert said_of(write_copy(copy, tmp_path / "nominal")) == []


def test_relations_of_a_rig_whose_values_are_known(tmp_path):
    parity = parity_of(tmp_path)
    assert parity.log_ratio == pytest.approx(0.147 * np.pi, rel=0.03)
    expected = {"spring": 1.0, "travel": 0.9, "friction": 1.0, "pretension": 1.0}
    assert {name: parity.ratios[name] for name in expected} == pytest.approx(expected, rel=0.03)
    assert parity.ratios["noise of F_load_N"] == pytest.approx(0.1, rel=0.2)
    assert all(value > 0.1 for value in parity.signs.values())


@pytest.mark.parametrize("quantity", ["load_cell_V", "current_A"])
def test_one_sensor_under_the_names_of_both_ends_is_named(tmp_path, quantity):
    bench = Bench(tmp_path)
    if f"load_{quantity}" not in bench.tables["one"]:
        pytest.skip(f"the rig's load has no {quantity}")
    bench.tables = {name: t.assign(**{f"load_{quantity}": t[f"drive_{quantity}"]}) for name, t in bench.tables.items()}
    (finding,) = ingest_batch(bench.write().folder).findings
    assert finding.severity == "inconsistent"
    assert "both columns hold one of them" in finding.text


def test_a_relation_without_its_sensors_is_absent(tmp_path):
    bench = Bench(tmp_path)
    for side in ("drive", "load"):
        del bench.described["rig"][side]["load_cell"]
    bench.tables = {name: t.drop(columns=["drive_load_cell_V", "load_load_cell_V"]) for name, t in bench.tables.items()}
    ingested = ingest_batch(bench.write().folder)
    parity = Parity(ingested.recordings[0], ingested.batch)
    assert parity.log_ratio is None and parity.stiffnesses is None
    assert not {"friction", "stiffness", "pretension"} & set(parity.ratios)
    assert not {"F_drive", "F_load"} & set(parity.signs)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.what)
def test_a_wrong_sign_explains_what_it_makes_negative(fault):
    signs = {name: -value if name in fault.negative else value for name, value in SIGNS.items()} | {"loss": -0.5}
    assert explanation(negative_relations(signs), signs) == (fault,)


@pytest.mark.parametrize(
    ("form", "exchanged", "remedy"),
    [
        (logging_tensions, {"T1_N": "T3_N", "T3_N": "T1_N"}, "exchange the columns T1_N and T3_N"),
        (logging_tensions, {"T2_N": "T4_N", "T4_N": "T2_N"}, "exchange the columns T2_N and T4_N"),
        (logging_one_tension, {"T1_N": "T3_N"}, "rename the column T3_N to T1_N"),
    ],
)
def test_a_torque_that_follows_from_tensions_is_turned_by_their_names(tmp_path, form, exchanged, remedy):
    """`torque_sign` turns the sign of a sensor, and there is none."""
    copy = form(read_copy(SIMULATED))
    assert said_of(write_copy(copy, tmp_path / "right")) == []
    copy.logs = {name: log.rename(columns=exchanged) for name, log in copy.logs.items()}
    (said,) = said_of(write_copy(copy, tmp_path / "exchanged"))
    assert "torque has the wrong sign" in said and said.endswith(f"; {remedy}")


def test_a_sensor_of_torque_is_turned_by_its_key(tmp_path):
    remedies = turning(parity_of(tmp_path))
    assert remedies["tau_in_Nm"] == "change rig.drive.torque_sign"
    assert remedies["tau_out_Nm"] == "change rig.load.torque_sign"


def test_cables_that_are_exchanged_in_all_tensions_are_exchanged_by_their_names(tmp_path):
    copy, other = logging_tensions(read_copy(SIMULATED)), {"T1_N": "T3_N", "T2_N": "T4_N"}
    other |= {b: a for a, b in other.items()}
    copy.logs = {name: log.rename(columns=other) for name, log in copy.logs.items()}
    (said,) = said_of(write_copy(copy, tmp_path / "exchanged"))
    remedy = "exchange the columns T1_N and T3_N and exchange the columns T2_N and T4_N, or change both encoder signs"
    assert said.startswith("batch.yaml cables A and B: ") and said.endswith(f"; {remedy}")


@pytest.mark.parametrize(
    ("form", "columns", "remedy"),
    [
        (None, ["load_load_cell_V"], "the column load_load_cell_V and of rig.load.load_cell.zero_V"),
        (logging_sums, ["F_load_N"], "the column F_load_N"),
        (logging_tensions, ["T2_N", "T4_N"], "the columns T2_N and T4_N"),
    ],
)
def test_a_load_cell_of_the_wrong_sign_is_turned_in_the_batch(tmp_path, form, columns, remedy):
    """No key turns it: a sensitivity is positive."""
    copy = form(read_copy(SIMULATED)) if form else read_copy(SIMULATED)
    cell = copy.rig["load"].get("load_cell", {"zero_V": 0.0})
    for log in copy.logs.values():
        log[columns] = 2 * cell["zero_V"] - log[columns]
    found = said_of(write_copy(copy, tmp_path / "turned"))
    assert any(said.endswith(f"; turn the sign of {remedy}") for said in found), found
    cell["zero_V"] *= -1
    for log in copy.logs.values():
        log[columns] *= -1
    assert said_of(write_copy(copy, tmp_path / "right")) == []


@pytest.mark.parametrize(("sum_N", "count", "is_refused"), [(-1.0, 1, False), (-4.0, 1, True), (-1.0, 2, True)])
def test_an_offset_may_make_the_sum_of_one_recording_negative(tmp_path, sum_N, count, is_refused):
    """Not by more than cells' offsets, and not in all recordings: cables cannot push."""
    parity = parity_of(tmp_path)
    read = parity.recording["F_load_N"]
    channels = {**parity.recording.channels, "F_load_N": read + sum_N - np.median(read)}
    low = replace(parity, recording=replace(parity.recording, channels=channels))
    without = {name: values for name, values in parity.recording.channels.items() if name != "F_load_N"}
    bare = replace(parity, recording=replace(parity.recording, channels=without))
    found = wrong_signs([low] * count + [parity] * (2 - count) + [bare])
    assert bool(found) == is_refused


def test_energy_from_nowhere_means_exchanged_ends_if_all_signs_are_right():
    signs = SIGNS | {"loss": -0.9}
    assert explanation(negative_relations(signs), signs) == (EXCHANGED,)


@pytest.mark.parametrize(
    ("sensors", "late_s"),
    [
        (["torques"], 0.0),
        (["encoders"], 0.0),
        (["torques", "encoders"], 0.0),
        (["torques"], 0.05),
        (["torques", "encoders"], 0.05),
    ],
)
def test_what_is_exchanged_is_said_also_of_a_rig_whose_drive_comes_late(tmp_path, sensors, late_s):
    copy = read_copy(SIMULATED)
    for log in copy.logs.values():
        for column in ("drive_encoder_counts", "drive_current_A", "drive_load_cell_V"):
            log[column] = np.interp(log["time_s"] - late_s, log["time_s"], log[column])
        log["drive_encoder_counts"] = log["drive_encoder_counts"].round()
    what = [MISTAKES[f"{of} of drive and load exchanged"](copy, None) for of in sensors]
    (said,) = said_of(write_copy(copy, tmp_path / "exchanged"))
    truth = what[0] if len(sensors) == 1 else "drive and load"
    assert truth in said.partition(": ")[0]
    assert late_s or said.startswith(f"batch.yaml {truth}: ")


@pytest.mark.parametrize(
    ("lag_of_angles", "work", "is_mirrored", "found"),
    [
        (0.08, -0.3, False, TORQUES),
        (0.02, -0.3, False, None),  # little friction: a filter of the drive's current turns the energies as well
        (0.08, 0.1, True, TORQUES),
        (0.08, 1.0, True, None),  # a load that gives energy, and a drive that gives all it exchanges
    ],
)
def test_torques_are_exchanged_if_nothing_else_turns_the_energies(lag_of_angles, work, is_mirrored, found):
    loss = 0.3 if is_mirrored else -0.3
    ends = [SimpleNamespace(side=SimpleNamespace(encoder_counts_per_rev=2000, pulley_radius_m=0.006))] * 2
    parity = SimpleNamespace(
        signs={"loss": loss, "work": work},
        lags={"angles": lag_of_angles, "torques": -0.2},
        ratios={"travel": 0.9},
        stroke_rad=1.0,
        batch=SimpleNamespace(rig=SimpleNamespace(ends=ends)),
    )
    assert exchange_of([parity] * 3, is_mirrored) is found


@pytest.mark.parametrize(
    ("sensors", "column", "sign"),
    [("torques", "load_current_A", "torque_sign"), ("encoders", "load_encoder_counts", "encoder_sign")],
)
def test_what_is_exchanged_is_said_also_where_the_signs_of_the_ends_are_unlike(tmp_path, sensors, column, sign):
    copy = read_copy(SIMULATED)
    copy.rig["load"][sign] = -1
    for log in copy.logs.values():
        log[column] *= -1
    assert said_of(write_copy(copy, tmp_path / "right")) == []
    what = MISTAKES[f"{sensors} of drive and load exchanged"](copy, None)
    (said,) = said_of(write_copy(copy, tmp_path / "exchanged"))
    assert said.startswith(f"batch.yaml {what}: ")


@pytest.mark.parametrize("form", [None, logging_rad])
@pytest.mark.parametrize(
    ("columns", "what"), [("encoder|theta", "theta_in_rad and theta_out_rad"), ("drive|load|theta", "drive and load")]
)
def test_what_is_exchanged_is_said_also_of_pulleys_of_unlike_radii(tmp_path, form, columns, what):
    """The same rig with a load pulley one and a half times as large, which turns by as much less."""
    copy, larger = read_copy(SIMULATED), 1.5
    for key, power in (("pulley_radius_m", 1), ("torque_constant_Nm_per_A", 1), ("spring_stiffness_Nm_per_rad", 2)):
        copy.rig["load"][key] *= larger**power
    for log in copy.logs.values():
        log["load_encoder_counts"] = (log["load_encoder_counts"] / larger).round().astype(int)
    copy = form(copy) if form else copy
    assert said_of(write_copy(copy, tmp_path / "right")) == []
    other = {"drive": "load", "load": "drive", "in": "out", "out": "in"}
    renamed = {c: re.sub("^(drive|load)|(?<=theta_)(in|out)", lambda m: other[m[0]], c) for c in copy.columns(columns)}
    copy.logs = {name: log.rename(columns=renamed) for name, log in copy.logs.items()}
    (said,) = said_of(write_copy(copy, tmp_path / "exchanged"))
    assert said.startswith(f"batch.yaml {what}: ")


@pytest.mark.parametrize("end", ["drive", "load"])
@pytest.mark.parametrize("late_s", [0.05, 0.1])
def test_sensors_of_one_end_that_come_late_are_not_exchanged(tmp_path, end, late_s):
    """Though the load then seems to reverse first, and the radii a tenth off let it move further than the drive."""
    copy = read_copy(SIMULATED)
    copy.rig["load"]["pulley_radius_m"] *= 1.2
    for log in copy.logs.values():
        for column in (f"{end}_encoder_counts", f"{end}_current_A", f"{end}_load_cell_V"):
            log[column] = np.interp(log["time_s"] - late_s, log["time_s"], log[column])
        log[f"{end}_encoder_counts"] = log[f"{end}_encoder_counts"].round()
    ingested = ingest_batch(write_copy(copy, tmp_path / "late"))
    assert wrong_signs([Parity(recording, ingested.batch) for recording in ingested.recordings]) == []


def test_a_torque_without_its_sign_is_named_and_one_of_a_load_that_only_pulls_is_right(tmp_path):
    copy, column = read_copy(SIMULATED), "load_current_A"
    copy.logs = {name: log.assign(**{column: log[column].abs()}) for name, log in copy.logs.items()}
    (said,) = said_of(write_copy(copy, tmp_path / "magnitude"))
    assert said.startswith("batch.yaml tau_out_Nm: the load torque is without its sign: in 6 of 6 recordings")
    to_and_fro = np.sin(np.linspace(0, 40, 5000))
    parity = parity_of(tmp_path)
    for angle, is_wrong in ((to_and_fro, True), (1 + to_and_fro, False)):
        x = {"theta_in_rad": angle, "theta_out_rad": angle, "tau_out_Nm": np.abs(angle)}
        time = np.arange(angle.size) * 0.002
        recording = replace(parity.recording, time_s=time, rest_s=0.0, channels=x)
        assert is_rectified(Parity(recording, parity.batch), "theta_out_rad", "tau_out_Nm") == is_wrong


@pytest.mark.parametrize(("samples", "is_late"), [(1, None), (3, None), (4, False), (12, True)])
@pytest.mark.parametrize(
    "columns",
    [["drive_current_A", "load_current_A", "drive_load_cell_V", "load_load_cell_V"], ["load_encoder_counts"]],
)
def test_readings_that_are_held_are_named_by_how_late_they_are(tmp_path, columns, samples, is_late):
    """At 500 samples a second: a converter of half the rate is common, one of a twelfth reads as late sensors."""
    copy = read_copy(SIMULATED)
    for log in copy.logs.values():
        log[columns] = log[columns].to_numpy()[np.arange(len(log)) // samples * samples]
    findings = ingest_batch(write_copy(copy, tmp_path / "held")).findings
    assert len(findings) == (0 if is_late is None else len(copy.logs))
    for finding in findings:
        assert finding.column == columns[0] and f"each reading stands in {samples} samples" in finding.text
        assert finding.is_inconsistent == is_late


def test_a_coarse_converter_holds_nothing():
    """It keeps a value for as long as a smooth signal needs for a step, or noise lets it."""
    time, noise = np.arange(0, 8, 0.002), np.random.default_rng(3).normal(0, 1, 4000)
    wave = np.sin(np.pi * time)
    readings = [100 * wave, 20 * wave, 100 * wave + 0.3 * noise, np.arcsin(wave) * 40]
    moving, in_steps = np.arange(4000), np.arange(4000) // 10
    assert [held_for(np.round(r), moving) for r in readings] == [0, 0, 0, 0]
    held = np.round(100 * wave)[10 * in_steps]
    assert held_for(held, moving) == 10
    assert held_for(held, in_steps) == 0, "the drive stands still between its steps"


@pytest.mark.parametrize(("key", "by"), [("torque_Nm", 20), ("load_cell_N", 40), ("encoder_rad", 50)])
def test_an_accuracy_below_the_noise_is_named(tmp_path, key, by):
    copy = read_copy(SIMULATED)
    accuracy = copy.rig["accuracy"]
    accuracy[key] /= by
    (said,) = said_of(write_copy(copy, tmp_path / "fine"))
    assert said.startswith(f"batch.yaml rig.accuracy.{key}: rig.accuracy.{key} is {accuracy[key]:g}, but the ")
    accuracy[key] *= by / 3
    assert said_of(write_copy(copy, tmp_path / "honest")) == []


@pytest.mark.parametrize(
    ("accuracy_rad", "of_what"), [(5e-6, "the rounding to whole steps of theta_out_rad"), (0.4, "theta_out_rad reads")]
)
def test_the_accuracy_of_one_encoder_is_named_by_its_own_key(tmp_path, accuracy_rad, of_what):
    copy = read_copy(SIMULATED)
    copy.rig["load"]["encoder_accuracy_rad"] = accuracy_rad
    (said,) = said_of(write_copy(copy, tmp_path / "one"))
    key = "rig.load.encoder_accuracy_rad"
    assert said.startswith(f"batch.yaml {key}: {key} is {accuracy_rad:g}, but {of_what}")


@pytest.mark.parametrize("form", [logging_tensions, logging_one_tension])
def test_an_accuracy_is_compared_with_sensors_and_not_with_what_follows_from_them(tmp_path, form):
    copy, key = form(read_copy(SIMULATED)), "rig.accuracy.load_cell_N"
    copy.rig["accuracy"]["load_cell_N"] = 0.001
    (said,) = said_of(write_copy(copy, tmp_path / "fine"))
    assert said.startswith(f"batch.yaml {key}: {key} is 0.001, but the noise from sample to sample of ")
    copy.rig["accuracy"]["load_cell_N"] = 1000.0
    (said,) = said_of(write_copy(copy, tmp_path / "coarse"))
    assert said.startswith(f"batch.yaml {key}: {key} is 1000, but ")


@pytest.mark.parametrize(
    ("starts", "said_starts"),
    [
        (["14:00:00", "14:01:00"], None),
        (["14:01:00", "14:00:00"], None),
        (["14:00:00", "14:00:00"], None),  # noted to the minute
        (["14:00:05", "14:00:13"], None),
        (["14:01:55", "14:02:00"], None),  # the second noted to the minute
        (["14:00:05.001", "14:00:12.991"], None),  # a cut of one log, within a few samples
        (["14:00:05", "14:00:11"], "two started at 2026-03-31T14:00:11+00:00, 2 s before the end of one"),
        (["14:00:11", "14:00:05"], "one started at 2026-03-31T14:00:11+00:00, 2 s before the end of two"),
    ],
)
def test_recordings_of_one_rig_do_not_overlap(tmp_path, starts, said_starts):
    bench = honest_rig(tmp_path)  # of 8 s
    for entry, start in zip(bench.described["recordings"], starts, strict=True):
        entry["started_at"] = f"2026-03-31T{start}"
    said = said_of(bench.write().folder)
    assert len(said) == (said_starts is not None)
    assert all(text.startswith("batch.yaml started_at: ") and said_starts in text for text in said)


@pytest.mark.parametrize("far_end", ["spring", "measured-tension", "measured-motion"])
def test_a_single_cable_is_no_pair(tmp_path, far_end):
    folder = write_batch(tmp_path / "one-cable", far_end)
    assert said_of(folder) == []
    described = yaml.safe_load((folder / "batch.yaml").read_text())
    del described["rig"]["transmission"], described["rig"]["far_end"]
    (folder / "batch.yaml").write_text(yaml.safe_dump(described))
    assert any(said.startswith("batch.yaml rig.transmission: no cable B") for said in said_of(folder))
    for entry in described["recordings"]:
        entry["pretension_N"] /= 2
    (folder / "batch.yaml").write_text(yaml.safe_dump(described))
    findings = [f for f in ingest_batch(folder).findings if f.column == "rig.transmission"]
    assert [f.severity for f in findings] == ["warning"] * (far_end != "measured-motion"), "a weight does the same"


@pytest.mark.parametrize("end", ["drive", "load"])
@pytest.mark.parametrize("by", [0.5, 2.0])
def test_counts_per_turn_that_are_twice_or_half_the_true_ones_are_named(tmp_path, end, by):
    copy = read_copy(SIMULATED)
    copy.rig[end]["encoder_counts_per_rev"] *= by
    (said,) = said_of(write_copy(copy, tmp_path / "counts"))
    channel = {"drive": "theta_in_rad", "load": "theta_out_rad"}[end]
    assert said.startswith(f"batch.yaml {channel}: the scale of the {end} angle is wrong")
    assert "a factor of 2 is that of" in said and f"rig.{end}.encoder_counts_per_rev" in said


@pytest.mark.parametrize(("spring", "named"), [(0.5, 1), (0.4, 0), (None, 0)])
def test_a_travel_of_about_twice_is_a_scale_where_another_relation_is_off_by_two(spring, named):
    ratios = {"travel": 1.5} | ({} if spring is None else {"spring": spring})
    assert len(_angle_of_one_end(ratios)) == named
    assert len(_angle_of_one_end(ratios | {"travel": 1.7})) == 1, "a load cannot move so much further"


@pytest.mark.parametrize(("factor", "warnings"), [(1.1, 0), (1.35, 1)])
def test_a_load_that_moves_further_than_the_drive_is_doubtful(tmp_path, factor, warnings):
    """Without load cells nothing else tells which radius or encoder is wrong."""
    copy = read_copy(SIMULATED)
    copy.logs = {n: log.drop(columns=["drive_load_cell_V", "load_load_cell_V"]) for n, log in copy.logs.items()}
    for end in ("drive", "load"):
        del copy.rig[end]["load_cell"]
    copy.rig["load"]["pulley_radius_m"] *= factor
    findings = ingest_batch(write_copy(copy, tmp_path / "radius")).findings
    assert [f.severity for f in findings] == ["warning"] * warnings
    assert all("and no cable makes it move further; check" in f.text for f in findings)


def test_a_correlation_alone_identifies_no_sensor():
    signs = SIGNS | {"torques": -0.5}
    assert explanation(negative_relations(signs), signs) == ()
    without_load_angle = {name: value for name, value in signs.items() if name not in ("angles", "load")}
    assert explanation(negative_relations(signs), without_load_angle) == ()


@pytest.mark.parametrize("rate", [-0.02, -0.008, 0.008, 0.02])
def test_the_rate_of_a_drift_is_found(tmp_path, rate):
    bench = Bench(tmp_path)
    steady = table(n=3000, seed=1)
    time = steady.time_s.to_numpy()
    for column in [c for c in steady if c.startswith("load")]:
        steady[column] = np.interp(time * (1 - rate), time, steady[column])
    steady["load_encoder_counts"] = steady["load_encoder_counts"].round()
    bench.tables["one"] = steady[time < 11.5]
    ingested = ingest_batch(bench.write().folder)
    found, change = drift_of(Parity(ingested.recordings[0], ingested.batch))
    assert found == pytest.approx(rate, rel=0.1)
    assert np.sign(change) == np.sign(rate)


def test_lags_that_only_scatter_do_not_drift():
    """Those of a load that rings after the start: a line through five of them has two degrees of freedom left."""
    time_s, ringing_s = np.arange(5) * 1.25, np.array([-0.0428, -0.0343, -0.0203, -0.0189, -0.0139])
    assert trend(ringing_s, time_s) == (0.0, 0.0)
    by_direction_s = 0.004 * (-1.0) ** np.arange(5)
    assert trend(0.006 * time_s + by_direction_s, time_s) == pytest.approx((0.006, 0.03))


def test_clocks_that_agree_do_not_drift(tmp_path):
    assert drift_of(parity_of(tmp_path)) == pytest.approx((0.0, 0.0), abs=2e-3)


def test_white_noise_is_found_below_a_motion():
    random, time = np.random.default_rng(4), np.arange(0, 10, 0.002)
    values = 5.0 * np.sin(np.pi * time) + random.normal(0, 0.03, time.size)
    assert white_noise(values) == pytest.approx(0.03, rel=0.25)


def test_noise_is_that_of_the_rest_where_cables_stick_and_slip_throughout(tmp_path):
    parity = parity_of(tmp_path)
    quiet, recording = parity.ratios["noise of tau_in_Nm"], parity.recording
    jumps = np.where(recording.time_s > recording.rest_s, 0.1 * (-1.0) ** np.arange(recording.time_s.size), 0.0)
    channels = {**recording.channels, "tau_in_Nm": recording["tau_in_Nm"] + jumps}
    jumping = Parity(replace(recording, channels=channels), parity.batch)
    assert white_noise(jumping.moving["tau_in_Nm"]) > 0.05
    assert jumping.ratios["noise of tau_in_Nm"] == pytest.approx(quiet, rel=0.5, abs=1e-4)


def test_a_zero_does_no_work_over_the_closed_part():
    angle = np.sin(np.linspace(0, 10.5, 4000))
    part = closed_part(angle)
    assert abs(angle[part][-1] - angle[part][0]) < 2e-3
    assert crossings(angle).size == 3


def test_pretensions_are_stated_for_each_cable(tmp_path):
    bench = Bench(tmp_path)
    for entry in bench.described["recordings"]:
        entry["pretension_N"] = 3 * T0
    said = said_of(bench.write().folder)
    assert any(sentence.startswith("batch.yaml pretension_N") for sentence in said)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda d: d["rig"]["accuracy"].update(torque_Nm=0.1), "rig.accuracy.torque_Nm"),
        (lambda d: d["recordings"][0].update(conduit=[{"length_m": 1200.0, "bend_rad": 3.1416}]), "length_m"),
    ],
)
def test_a_stated_value_in_another_unit_is_named(tmp_path, change, named):
    bench = Bench(tmp_path)
    change(bench.described)
    assert any(sentence.startswith(f"batch.yaml {named}") for sentence in said_of(bench.write().folder))


def honest_rig(tmp_path, **changes):
    """A batch of the made-up rig with other sizes, all of them stated truly."""
    bench = Bench(tmp_path)
    for entry in bench.described["recordings"]:
        entry["conduit"] = [{"length_m": 1.2, "bend_rad": changes.get("bend", np.pi)}]
    bench.tables = {name: table(n=2000, seed=seed, **changes) for seed, name in enumerate(("one", "two"), 1)}
    return bench


@pytest.mark.parametrize("bend", [0.0, 0.02, 6.0])
def test_a_straight_or_tight_conduit_contradicts_nothing(tmp_path, bend):
    assert said_of(honest_rig(tmp_path, bend=bend).write().folder) == []


@pytest.mark.parametrize("without", ["load_current_A", "load_encoder_counts"])
def test_a_single_step_shows_no_sign(tmp_path, without):
    """Over less than a cycle the cables store energy, and a torque's zero does work."""
    bench = honest_rig(tmp_path)
    for name, log in bench.tables.items():
        bench.tables[name] = log[log.time_s < 0.4 + 0.45].drop(columns=without)
    side = bench.described["rig"]["load"]
    del side["torque_constant_Nm_per_A" if without == "load_current_A" else "encoder_counts_per_rev"]
    assert said_of(bench.write().folder) == []


def test_a_gap_in_time_is_no_lost_sample(tmp_path):
    bench = honest_rig(tmp_path)
    log = bench.tables["one"]
    bench.tables["one"] = log[(log.index < 150) | (log.index > 165)]
    assert said_of(bench.write().folder) == []
    jumped = bench.tables["one"].assign(time_s=log.time_s.to_numpy()[: len(bench.tables["one"])])
    bench.tables["one"] = jumped
    (said,) = said_of(bench.write().folder)
    assert "samples were lost and the time does not show it" in said


def test_a_load_that_no_torque_moves_may_rest(tmp_path):
    bench = honest_rig(tmp_path)
    log = bench.tables["one"]
    still = log.assign(load_encoder_counts=7)
    bench.tables["one"] = still
    assert any("stands still" in sentence for sentence in said_of(bench.write().folder))
    noise = np.random.default_rng(1).normal(0, 0.004, len(log)).round(5)
    bench.tables["one"] = still.assign(load_current_A=noise)
    assert not any("stands still" in sentence for sentence in said_of(bench.write().folder))


def test_degrees_in_the_place_of_rad_are_called_so(tmp_path):
    bench = honest_rig(tmp_path)
    step = 2 * np.pi / 2000
    for end, channel in (("drive", "theta_in_rad"), ("load", "theta_out_rad")):
        side = bench.described["rig"][end]
        del side["encoder_counts_per_rev"]
        side["angle_resolution_rad"] = step
        for name, log in bench.tables.items():
            counts = f"{end}_encoder_counts"
            bench.tables[name] = log.assign(**{channel: np.degrees(log[counts] * step)}).drop(columns=counts)
    assert all("is the column in degrees?" in sentence for sentence in said_of(bench.write().folder))


def test_a_load_cell_that_errs_in_all_recordings_makes_none_of_them_foreign(tmp_path):
    """Its offset of 2.2 N and its drift double the friction that one recording seems to have."""
    drawn = draw(25007)
    faults = {"load_cell_offset_N": 2.224, "load_cell_drift_N_per_s": 0.138, "load_cell_warm_up_s": 4.98}
    rig = drawn.campaign.rig.model_copy(update={"effects": Effects(load_sensors=faults)})
    case = replace(drawn, campaign=drawn.campaign.model_copy(update={"rig": rig}))
    record(case, case.recordings, tmp_path / case.name)
    assert said_of(tmp_path / case.name) == []


def test_a_conduit_with_more_bend_may_take_up_more_travel():
    def run(bend_rad, travel):
        recording = SimpleNamespace(path=SimpleNamespace(bend_rad=bend_rad))
        return SimpleNamespace(recording=recording, ratios={"travel": travel}, stroke_rad=1.2)

    others = [run(3.1, 0.9), run(6.3, 0.85)]
    assert deviations_of(run(9.4, 0.45), others) == {"travel": 0.0}
    assert deviations_of(run(3.1, 0.45), others)["travel"] == pytest.approx(np.log(0.45 / 0.85))


@pytest.mark.parametrize(("of_the_sums", "forgotten"), [(1.9, True), (0.7, False)])
def test_friction_is_another_only_where_both_estimates_are(of_the_sums, forgotten):
    """The slope over the load's tensions errs where few samples slip; the nearer to what is stated may be either."""

    def run(sums, slope):
        recording = SimpleNamespace(path=SimpleNamespace(bend_rad=3.1), pretension_N=5.0, id="half")
        nearer = min(sums, slope, key=lambda ratio: abs(ratio - 1))
        ratios = {"friction of the sums": sums, "friction of the slope": slope, "friction": nearer}
        return SimpleNamespace(recording=recording, ratios=ratios)

    others = [run(0.8, 0.75), run(0.6, 0.72)]
    found = forgotten_bend(run(of_the_sums, 1.4), others)
    assert (found is not None) == forgotten


@pytest.mark.parametrize("end", ["drive", "load"])
def test_a_large_offset_of_a_load_cell_is_no_wrong_friction(tmp_path, end):
    """3 N are half of what friction takes: the tensions' ratio then shows another friction, their rise does not."""
    copy = read_copy(SIMULATED)
    for log in copy.logs.values():
        log[f"{end}_load_cell_V"] += 3.0 * copy.description["rig"][end]["load_cell"]["sensitivity_V_per_N"]
    said = said_of(write_copy(copy, tmp_path / "offset"))
    assert not [text for text in said if "friction" in str(text)]


def test_sensors_of_the_drive_that_come_late_are_no_wrong_stiffness(tmp_path):
    """They hide how the tensions follow from the stretch, or turn it round."""
    copy = read_copy(Path("data/raw/rich"))
    for log in copy.logs.values():
        for name in ("drive_encoder_counts", "drive_current_A", "drive_load_cell_V"):
            log[name] = np.interp(log["time_s"] - 0.1, log["time_s"], log[name])
        log["drive_encoder_counts"] = log["drive_encoder_counts"].round()
    assert said_of(write_copy(copy, tmp_path / "late")) == []


def test_no_offset_of_a_load_cell_acts_on_the_rise_of_tensions():
    recordings = ingest_batch(SIMULATED)
    for recording in recordings.recordings[:3]:
        found = Parity(recording, recordings.batch)
        shifted = found.without_cell_error("drive", 2.0, 0.0)
        assert shifted.offset_free_ratio == pytest.approx(found.offset_free_ratio, rel=1e-6)
        assert found.offset_free_ratio == pytest.approx(found.log_ratio, rel=0.4)
        assert abs(shifted.log_ratio - found.log_ratio) > 0.05


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_times_that_make_the_noted_frequency_another_are_named(factor, tmp_path):
    copy = read_copy(Path("data/raw/half-loop"))
    for log in copy.logs.values():
        log["time_s"] *= factor
    (said,) = said_of(write_copy(copy, tmp_path / "half-loop"))
    assert said.startswith("batch.yaml time_s")
    assert f"the drive moves at {1 / factor:.3g} times the frequency that is noted" in said


@pytest.mark.parametrize("fitted, named", [(7500.0, True), (600.0, True), (12.0, False), (2.0, False)])
def test_a_stated_stiffness_that_a_fit_contradicts(fitted, named, tmp_path):
    copy = read_copy(Path("data/raw/loops"))
    copy.rig["cable"]["stiffness_N_per_m"] = 13.88
    batch = ingest_batch(write_copy(copy, tmp_path / "loops")).stated
    found = contradicted_by_fit(fitted, batch)
    assert [f.is_inconsistent for f in found] == [True] * named
    assert all("rig.cable.stiffness_N_per_m is 13.88" in f.text for f in found)
    copy.rig["nominal"] = ["cable.stiffness_N_per_m"]
    batch = ingest_batch(write_copy(copy, tmp_path / "nominal")).stated
    assert contradicted_by_fit(fitted, batch) == []


def test_the_speed_of_a_log_with_few_samples_a_second_is_not_late():
    time_s = np.arange(20.0)
    # Exact for a parabola, but for the constant that averaging adds, if the window is as long on either side.
    assert np.diff(speed(time_s**2, time_s))[4:-4] == pytest.approx(2.0)
    assert speed(time_s**2, time_s)[10] == pytest.approx(20.0)


@pytest.mark.parametrize(("counts", "is_named"), [(1, False), (6, True)])
def test_a_load_that_moves_alike_is_no_copy_where_the_drive_does(tmp_path, counts, is_named):
    """A repeated command moves the drive within a count of before, and may move the load through equal counts."""
    copy = read_copy(SIMULATED)
    one, other = list(copy.logs)[:2]
    n = min(len(copy.logs[one]), len(copy.logs[other]))
    copy.logs = {name: log[:n].copy() for name, log in copy.logs.items()}
    aside = np.round(counts * np.sin(np.arange(n) / 40.0)).astype(int)
    copy.logs[other]["drive_encoder_counts"] = copy.logs[one]["drive_encoder_counts"].to_numpy() + aside
    copy.logs[other]["load_encoder_counts"] = copy.logs[one]["load_encoder_counts"].to_numpy()
    said = said_of(write_copy(copy, tmp_path / "b"))
    assert any("noise does not repeat" in sentence for sentence in said) == is_named
