import gzip
from dataclasses import replace
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from made_up_batch import COUNTS, KT, table

from ccmodel.recording import read_recordings, write_recordings
from ccmodel.rig import ingest
from ccmodel.rig.batch import valid_name
from ccmodel.rig.findings import Finding
from ccmodel.rig.ingest import ingest_batch
from ccmodel.steps.ingest import ingest as write_ingested

RAW = Path(__file__).parents[2] / "data/raw"


def test_a_good_batch(bench, tmp_path):
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    assert [r.id for r in ingested.recordings] == ["one", "two"]
    recording = ingested.recordings[0]
    assert recording.origin == "rig"
    assert recording.path.bend_rad == 3.1416
    assert recording.rest_s == pytest.approx(0.4, abs=0.02)
    assert ingested.batch.rig.load.spring_stiffness_Nm_per_rad == 0.05
    write_recordings(tmp_path / "r.nc", ingested.recordings, {})
    assert read_recordings(tmp_path / "r.nc")[1]["T4_N"] == pytest.approx(ingested.recordings[1]["T4_N"])


# The first of three empty cells in each of two columns, one after the other.
HOLE = {"drive_current_A": 50, "load_current_A": 53}


# Damage to log "one", then row, column and part of the text of its only finding.
def write_bytes(change):
    return lambda bench: bench.log().write_bytes(change(bench.log().read_bytes()))


def line(row, change):
    return lambda bench: bench.change_line(row, change)


def cell(row, column, value):
    def change(text):
        cells = text.split(",")
        cells[column] = value
        return ",".join(cells)

    return line(row, change)


def frame(change):
    def apply(bench):
        bench.tables["one"] = change(bench.tables["one"])
        bench.write()

    return apply


def changed(name, values):
    return frame(lambda t: t.assign(**{name: values(t)}))


REFUSED = {
    "missing file": (lambda b: b.log().unlink(), None, None, "there is no such file"),
    "empty": (write_bytes(lambda raw: b""), None, None, "is empty"),
    "header only": (write_bytes(lambda raw: raw[: raw.index(b"\n") + 1]), None, None, "has a header but no samples"),
    "too short": (frame(lambda t: t.iloc[:5]), None, None, "has 5 samples only"),
    "not text": (write_bytes(lambda raw: raw[:200] + b"\xff\xfe" + raw[200:]), 3, None, "is not text"),
    "semicolons": (write_bytes(lambda raw: raw.replace(b",", b";")), 1, None, "separated by commas"),
    "no time": (frame(lambda t: t.drop(columns="time_s")), 1, "time_s", "required and missing"),
    "no drive": (frame(lambda t: t.drop(columns="drive_encoder_counts")), 1, "drive_encoder_counts", "required"),
    "misspelt": (
        frame(lambda t: t.rename(columns={"drive_current_A": "drive_curent_A"})),
        1,
        "drive_curent_A",
        "did you mean 'drive_current_A'?",
    ),
    "column twice": (
        line(1, lambda s: s.replace("load_current_A", "drive_current_A")),
        1,
        "drive_current_A",
        "there twice",
    ),
    "text in a cell": (cell(17, 3, "over"), 17, "drive_current_A", "must be a number, found 'over'"),
    "stray quotation mark": (cell(17, 3, '"1.0'), 17, "drive_current_A", "must be a number, found '\"1.0'"),
    "cells empty in bulk": (
        changed("drive_current_A", lambda t: t.drive_current_A.where((t.index < 50) | (t.index > 60))),
        52,
        "drive_current_A",
        "11 cells have no number, 11 of them in a row",
    ),
    "hole over two columns": (
        frame(lambda t: t.assign(**{c: t[c].where((t.index < a) | (t.index > a + 2)) for c, a in HOLE.items()})),
        52,
        None,
        "cells of several columns have no number, in 6 rows in a row from here",
    ),
    "column empty": (changed("load_current_A", lambda t: np.nan), None, "load_current_A", "has no numbers"),
    "row too short": (line(20, lambda s: s.rsplit(",", 1)[0]), 20, None, "has 6 cells, the header has 7"),
    "row too long": (line(20, lambda s: s + ",1"), 20, None, "has 8 cells, the header has 7"),
    "cut between cells": (write_bytes(lambda raw: raw[: raw.rindex(b",") - 3]), 401, None, "the last line is cut"),
    "cut within a cell": (write_bytes(lambda raw: raw[: raw.rindex(b".") + 1]), 401, None, "the last line is cut"),
    "whole line without its end": (write_bytes(lambda raw: raw[:-1]), 401, None, "the last line is cut"),
    "only commas left of a line": (write_bytes(lambda raw: raw + b",,"), 402, None, "the last line is cut"),
    "time back": (cell(30, 0, "0.05"), 30, "time_s", "time must increase, found 0.05 s after 0.112 s"),
    "time that stands": (cell(30, 0, "0.112"), 30, "time_s", "time must increase, found 0.112 s after 0.112 s"),
    "gross gap": (frame(lambda t: t.drop(index=range(100, 150))), 102, "time_s", "a gap of 0.204 s"),
    "many gaps": (frame(lambda t: t.drop(index=range(150, 400, 2))), None, "time_s", "gaps"),
    "drive stuck": (changed("drive_encoder_counts", lambda t: 7), None, "drive_encoder_counts", "stands still"),
    "drive stuck later": (
        changed(
            "drive_encoder_counts", lambda t: t.drive_encoder_counts.where(t.index < 200, t.drive_encoder_counts[199])
        ),
        None,
        "drive_encoder_counts",
        "encoder stuck",
    ),
    "drive reset": (
        changed("drive_encoder_counts", lambda t: t.drive_encoder_counts - 120 * (t.index >= 180)),
        182,
        "drive_encoder_counts",
        "jumps by -1",
    ),
    "optional column lost": (
        frame(lambda t: t.drop(columns="load_current_A")),
        1,
        "load_current_A",
        "missing though other logs of the batch have it",
    ),
    "load encoder lost": (
        frame(lambda t: t.drop(columns="load_encoder_counts")),
        1,
        "load_encoder_counts",
        "missing though other logs of the batch have it",
    ),
    "path that is none": (lambda b: b.log().unlink() or b.log().mkdir(), None, None, "cannot be read"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_bad_log_is_refused_in_one_line_and_the_good_one_comes_through(bench, name):
    damage, row, column, text = REFUSED[name]
    damage(bench.write())
    ingested = ingest_batch(bench.folder)
    assert [r.id for r in ingested.recordings] == ["two"]
    (finding,) = ingested.findings
    assert finding.severity == "refused"
    contradicts = name.startswith("drive ") or "gap" in name
    assert finding.is_inconsistent == contradicts, "a damaged file contradicts nothing"
    assert text in finding.text
    assert finding.column == column
    if name not in ("many gaps", "drive stuck later"):
        assert finding.row == row
    place = f"{bench.log()}" + (f", row {finding.row}" if finding.row else "") + (f", {column}" if column else "")
    assert str(finding) == f"{place}: {finding.text}"
    assert "\n" not in str(finding)


WARNED = {
    "one gap": (frame(lambda t: t.drop(index=range(200, 205))), 202, "time_s", "a gap of 0.024 s"),
    "one empty cell": (cell(50, 3, ""), 50, "drive_current_A", "no number: row dropped"),
    "infinite": (cell(50, 3, "inf"), 50, "drive_current_A", "inf is no reading: row dropped"),
    "infinite once it is calibrated": (
        cell(50, 5, "-1e308"),
        50,
        "drive_load_cell_V",
        "-1e+308 is no reading: row dropped",
    ),
    "two empty cells": (
        changed("drive_current_A", lambda t: t.drive_current_A.where(~t.index.isin([50, 51]))),
        52,
        "drive_current_A",
        "2 cells have no number",
    ),
    "sample twice": (frame(lambda t: t.loc[[*range(100), 99, *range(100, 400)]]), 102, None, "the same sample again"),
    "uneven": (
        changed("time_s", lambda t: (t.time_s + np.random.default_rng(0).uniform(-0.0015, 0.0015, 400)).round(6)),
        None,
        "time_s",
        "sampled unevenly",
    ),
    "one sample late": (
        changed("time_s", lambda t: t.time_s + 0.003 * (t.index == 200)),
        202,
        "time_s",
        "few or none are lost",
    ),
    "late and lost": (
        frame(lambda t: t.assign(time_s=t.time_s + 0.003 * (t.index == 200)).drop(index=[300, 301])),
        202,
        "time_s",
        "samples were dropped",
    ),
    "extra column": (
        changed("motor_temperature_degC", lambda t: "warm"),
        1,
        "motor_temperature_degC",
        "unknown column",
    ),
}
CONTAMINATED = {
    "load cell frozen": (
        changed("drive_load_cell_V", lambda t: t.drive_load_cell_V.where((t.index < 150) | (t.index >= 290), 0.95)),
        152,
        "drive_load_cell_V",
        "stays at 0.95 up to row 291 while the drive moves: sensor frozen",
    ),
    "clipped": (
        changed("drive_current_A", lambda t: t.drive_current_A.clip(upper=0.5)),
        None,
        "drive_current_A",
        "flat at its extreme value",
    ),
}


@pytest.mark.parametrize("name", [*WARNED, *CONTAMINATED])
def test_a_small_fault_is_one_finding_and_keeps_the_channel(bench, name):
    damage, row, column, text = (WARNED | CONTAMINATED)[name]
    damage(bench.write())
    ingested = ingest_batch(bench.folder)
    (finding,) = ingested.findings
    assert [r.id for r in ingested.recordings] == ["one", "two"]
    assert (finding.severity, finding.column) == ("warning" if name in WARNED else "inconsistent", column)
    assert text in finding.text
    assert row is None or finding.row == row
    assert ingested.recordings[0].warnings == (str(finding),)
    assert set(ingested.recordings[0].channels) == set(ingested.recordings[1].channels)


DEAD = {
    "load stuck": ("load_encoder_counts", 3, "stands still throughout", {"theta_out_rad"}),
    "current dead": ("drive_current_A", 0.0, "is 0 throughout", {"tau_in_Nm", "T1_N", "T3_N"}),
    "load cell dead": ("load_load_cell_V", 0.25, "is 0.25 throughout", {"F_load_N", "T2_N", "T4_N"}),
}


@pytest.mark.parametrize("name", DEAD)
def test_a_dead_sensor_takes_its_channels_with_it(bench, name):
    column, value, text, channels = DEAD[name]
    changed(column, lambda t: value)(bench)
    ingested = ingest_batch(bench.folder)
    (finding,) = ingested.findings
    assert (finding.severity, finding.column, finding.confidence) == ("inconsistent", column, 1.0)
    assert text in finding.text
    one, two = ingested.recordings
    assert set(two.channels) - set(one.channels) == channels


def test_a_dead_sensor_that_is_not_stated_contradicts_nothing(bench):
    del bench.described["rig"]["drive"]["load_cell"]
    changed("drive_load_cell_V", lambda t: 0.25)(bench)
    severities = {f.text.partition(":")[0]: f.severity for f in ingest_batch(bench.folder).findings}
    assert severities["is 0.25 throughout"] == "warning"


def test_a_quiet_coarse_sensor_may_keep_its_value(bench):
    """It stays at one value while friction takes up the motion, and at its extremes while the drive holds."""
    noisy, quiet = bench.tables["one"], bench.tables["one"].copy()
    theta = np.clip((noisy.time_s - 0.4) / 0.1, 0.0, 7.0)
    quiet["drive_encoder_counts"] = np.round(200 * theta).astype(int)
    quiet["load_encoder_counts"] = np.round(160 * np.maximum(theta - 4.0, 0.0)).astype(int)
    quiet["load_current_A"] = np.round(np.maximum(theta - 4.0, 0.0), 3)
    quiet["drive_current_A"] = np.round(theta + 0.001 * np.sin(70 * theta), 3)
    bench.tables = {"one": quiet, "two": quiet.copy()}
    findings = [f for f in ingest_batch(bench.write().folder).findings if f.column.endswith("current_A")]
    assert {f.column for f in findings} == {"drive_current_A", "load_current_A"}
    assert {f.severity for f in findings} == {"warning"}


def test_a_load_may_stand_still_through_a_small_motion(bench):
    small = bench.tables["one"]
    small["drive_encoder_counts"] = 100 + (small.drive_encoder_counts - 100) // 4
    changed("load_encoder_counts", lambda t: 3)(bench)
    (finding,) = ingest_batch(bench.folder).findings
    assert (finding.column, finding.severity) == ("load_encoder_counts", "warning")
    bench.tables["two"] = small
    assert {f.severity for f in ingest_batch(bench.write().folder).findings} == {"inconsistent"}


def test_a_load_that_is_stated_as_fixed_may_stand_still(bench):
    bench.described["rig"] |= {"transmission": "single-cable", "far_end": "fixed"}
    del bench.described["rig"]["load"]["spring_stiffness_Nm_per_rad"]
    changed("load_encoder_counts", lambda t: 3)(bench)
    (finding,) = ingest_batch(bench.folder).findings
    assert finding.severity == "warning"


def test_the_recordings_of_a_batch_are_checked_against_one_another_last(bench, monkeypatch):
    found = Finding("bench", "batch.yaml", None, "rig.drive.pulley_radius_m", "inconsistent", "is too large", 0.9)
    given = []
    monkeypatch.setattr(ingest, "check_consistency", lambda *of: given.append(of) or [found])
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == [replace(found, file=str(bench.folder / "batch.yaml"))]
    assert found.is_inconsistent
    assert given == [(ingested.recordings, ingested.batch)]


def test_findings_of_an_earlier_format_are_read():
    old = {"batch": "b", "file": "raw/b/one.csv", "row": 3, "column": "time_s", "severity": "refused", "text": "gap"}
    finding = Finding(**old)
    assert (finding.confidence, finding.is_inconsistent, finding.place) == (1.0, False, "one.csv, row 3, time_s")


def test_a_load_encoder_that_stops_is_a_warning_and_kept(bench):
    changed("load_encoder_counts", lambda t: t.load_encoder_counts.where(t.index < 120, -30))(bench)
    ingested = ingest_batch(bench.folder)
    finding, *others = ingested.findings
    # What the load then shows is not what the other recording shows.
    assert all(f.severity == "inconsistent" for f in others)
    assert (finding.column, finding.severity) == ("load_encoder_counts", "warning")
    assert "stands still up to row 401 while the drive runs through its whole range" in finding.text
    assert "theta_out_rad" in ingested.recordings[0]


def test_range_of_a_sensor(bench):
    bench.described["rig"]["ranges"] = {"drive_current_A": [-0.4, 0.4]}
    findings = ingest_batch(bench.write().folder).findings
    assert {f.column for f in findings} == {"drive_current_A"}
    assert all("end of the sensor's range [-0.4, 0.4]" in f.text for f in findings)


def test_a_reading_outside_the_range_of_its_sensor_is_not_used(bench):
    rows = len(bench.tables["one"])
    bench.described["rig"]["ranges"] = {"drive_current_A": [-5.0, 5.0]}
    assert ingest_batch(bench.write().folder).findings == []
    # Among many peaks of a drive that switches, it does not stand out by itself.
    changed("drive_current_A", lambda t: t.drive_current_A.where(t.index % 20 != 7, 3.5))(bench)
    before = [f.text for f in ingest_batch(bench.folder).findings]
    changed("drive_current_A", lambda t: t.drive_current_A.where(~t.index.isin([150, 250]), 5.4))(bench)
    ingested = ingest_batch(bench.folder)
    (finding,) = [f for f in ingested.findings if "outside its range" in f.text]
    assert "outside its range" not in str(before)
    assert (finding.column, finding.severity) == ("drive_current_A", "warning")
    assert "reads 5.4, outside its range [-5, 5] in rig.ranges (and 1 more such readings): not used" in finding.text
    assert ingested.recordings[0].time_s.size == rows - 2


def test_a_range_that_many_single_readings_leave_is_wrong(bench):
    current = bench.tables["one"].drive_current_A
    top = float(current.abs().max())
    bench.described["rig"]["ranges"] = {"drive_current_A": [-1.5 * top, 1.5 * top]}
    changed("drive_current_A", lambda t: t.drive_current_A.where(t.index % 40 != 7, 1.6 * top))(bench)
    ingested = ingest_batch(bench.folder)
    (finding, *_) = [f for f in ingested.findings if "outside its range" in f.text]
    assert (finding.column, finding.severity) == ("drive_current_A", "inconsistent")
    assert "is the range right" in finding.text
    assert ingested.recordings[0].time_s.size == len(current)


def test_a_transient_that_is_most_of_a_log_is_named(bench):
    bench.described["recordings"][0]["settled_s"] = 1.2
    (finding,) = ingest_batch(bench.write().folder).findings
    assert finding.severity == "warning"
    assert "settled_s 1.2 s of batch.yaml leaves 0.396 of 1.6 s to be compared" in finding.text


def test_gzipped_and_cut(bench):
    bench.write()
    for name in ("one", "two"):
        bench.described["recordings"][0 if name == "one" else 1]["file"] = f"{name}.csv.gz"
        (bench.folder / f"{name}.csv.gz").write_bytes(gzip.compress(bench.log(name).read_bytes()))
    bench.write()
    assert ingest_batch(bench.folder).findings == []
    path = bench.folder / "one.csv.gz"
    whole = path.read_bytes()
    damaged = {
        "is cut short": whole[:-500],
        "is damaged": whole[:300] + bytes(50) + whole[350:],
        "is not gzipped": b"time_s\n1\n",
    }
    for text, raw in damaged.items():
        path.write_bytes(raw)
        ingested = ingest_batch(bench.folder)
        assert [r.id for r in ingested.recordings] == ["two"]
        (finding,) = ingested.findings
        assert text in finding.text


def edit(*keys, value=None, drop=False, new=None):
    def apply(described):
        for key in keys[:-1]:
            described = described[key]
        if drop or new:
            old = described.pop(keys[-1])
        if new:
            described[new] = old
        elif not drop:
            described[keys[-1]] = value

    return apply


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (
            edit("recordings", 1, "pretension_N", new="pretensoin_N"),
            "unknown key 'pretensoin_N' in recordings[1]; did you mean 'pretension_N'?",
        ),
        (edit("rig", "drive", "pulley_radius_m", drop=True), "key 'pulley_radius_m' is missing in rig.drive"),
        (edit("rig", "accuracy", "encoder_rad", value=0), "rig.accuracy.encoder_rad: must be above 0.0, found 0"),
        (edit("rig", "accuracy", "load_cell_N", drop=True), "accuracy.load_cell_N is missing"),
        (edit("format", value=2), "format: must be 1, found 2"),
        (edit("batch", value="other"), "batch: must be the folder's name, 'bench', found 'other'"),
        (edit("origin", value="model"), "origin: must be 'rig' or 'virtual-rig', found 'model'"),
        (edit("recordings", 1, "id", value="one"), "recordings: id 'one' is given to 2 recordings"),
        (edit("recordings", 1, "file", value="./one.csv"), "recordings: file 'one.csv' is given to 2 recordings"),
        (edit("recordings", 1, "id", value=""), "recordings[1].id: a name is letters, digits"),
        (edit("recordings", 1, "file", value=""), "recordings[1].file: must be the log's path"),
        (edit("recordings", 1, "id", value="a/b"), "recordings[1].id: a name is letters, digits"),
        (edit("recordings", 1, "id", value="a" * 151), "it has at most 150 letters (bytes in UTF-8), found 'aaa"),
        (edit("recordings", 1, "id", value="ü" * 76), "it has at most 150 letters (bytes in UTF-8), found 'üüü"),
        (
            edit("recordings", 1, "excitation", value={"wave": "sine", "frequency_Hz": 10**400}),
            "recordings[1].excitation: frequency_Hz of a sine is a number that is not negative",
        ),
        (
            edit("recordings", 1, "excitation", value={"wave": "triangle", "amplitude_rad": "large"}),
            "recordings[1].excitation: amplitude_rad of a triangle is a number that is not negative",
        ),
        (edit("recordings", 1, "file", value="../one.csv"), "recordings[1].file: a log lies inside"),
        (edit("recordings", 1, "file", value=".old/one.csv"), "recordings[1].file: a log is no hidden file"),
        (edit("recordings", 0, "conduit", value=[]), "recordings[0].conduit: needs at least 1 entries, has 0"),
        (edit("rig", "ranges", value={"drive_curent_A": [0, 1]}), "did you mean 'drive_current_A'?"),
        (edit("rig", "ranges", value={"drive_current_A": [1, 0]}), "a range is [lowest, highest], found [1.0, 0.0]"),
        (edit("rig", "load", "torque_sign", value=0), "rig.load.torque_sign: must be 1 or -1, found 0"),
    ],
)
def test_a_bad_description_refuses_the_batch_in_one_line(bench, change, text):
    change(bench.described)
    ingested = ingest_batch(bench.write().folder)
    assert ingested.recordings == [] and ingested.batch is None
    (finding,) = ingested.findings
    assert finding.severity == "refused"
    assert finding.file == str(bench.folder / "batch.yaml")
    assert text in finding.text


def test_two_spellings_of_one_name_are_given_twice(bench):
    composed, decomposed = "\u212b", "\u00c5"  # the sign of the ångström and the letter
    for entry, name in zip(bench.described["recordings"], (composed, decomposed), strict=True):
        entry["id"] = name
    (finding,) = ingest_batch(bench.write().folder).findings
    assert f"recordings: id '{decomposed}' is given to 2 recordings" in finding.text


def test_the_longest_name_can_be_written_and_read(bench, tmp_path):
    name = "ü" * 75
    bench.described["recordings"][0]["id"] = name
    write_ingested(bench.write().folder, tmp_path / "bench.nc", tmp_path / "bench.json")
    assert [r.id for r in read_recordings(tmp_path / "bench.nc")] == [name, "two"]


def test_notes_of_another_wave_may_be_anything(bench):
    bench.described["recordings"][0]["excitation"] = {"wave": "chirp", "frequency_Hz": [0.1, 5.0], "steps": 10**400}
    assert ingest_batch(bench.write().folder).findings == []


def test_one_misspelt_key_of_the_only_recording_is_one_line(bench):
    del bench.described["recordings"][1]
    recording = bench.described["recordings"][0]
    recording["pretensoin_N"] = recording.pop("pretension_N")
    (finding,) = ingest_batch(bench.write().folder).findings
    assert "did you mean 'pretension_N'?" in finding.text


def test_no_description_at_all(tmp_path):
    (finding,) = ingest_batch(tmp_path).findings
    assert "there is no such file" in finding.text


def test_nothing_left_after_the_transient(bench):
    bench.described["recordings"][0]["settled_s"] = 4.0
    ingested = ingest_batch(bench.write().folder)
    assert [r.id for r in ingested.recordings] == ["two"]
    (finding,) = ingested.findings
    assert "with 0 samples after settled_s 4 s" in finding.text
    assert (finding.severity, finding.is_inconsistent) == ("refused", True)


LACKING = ["load_current_A", "drive_load_cell_V", "load_encoder_counts"]


def drop(bench, names, columns):
    for name in names:
        bench.tables[name] = bench.tables[name].drop(columns=columns)
    return bench


def without_sensors(bench):
    for end, key in (("load", "torque_constant_Nm_per_A"), ("drive", "load_cell"), ("load", "encoder_counts_per_rev")):
        del bench.described["rig"][end][key]
    return bench


def add_logs(bench, *names):
    for seed, name in enumerate(names, start=3):
        bench.tables[name] = table(seed=seed)
        bench.described["recordings"].append({**bench.described["recordings"][0], "id": name, "file": f"{name}.csv"})
    return bench


def test_rig_without_a_sensor_lacks_its_channels_without_a_finding(bench):
    drop(without_sensors(bench), ["one", "two"], LACKING)
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    assert set(ingested.recordings[0].channels) == {"theta_in_rad", "tau_in_Nm", "F_load_N"}


def test_a_stated_sensor_that_is_in_no_log_is_one_warning(bench):
    ingested = ingest_batch(drop(bench, ["one", "two"], LACKING).write().folder)
    assert [f.severity for f in ingested.findings] == ["warning"] * 3
    assert {f.file for f in ingested.findings} == {str(bench.folder / "batch.yaml")}
    assert {f.text for f in ingested.findings} == {
        "states rig.drive.load_cell, but no log has drive_load_cell_V: F_drive_N, T1_N, T3_N are absent",
        "states rig.load.encoder_counts_per_rev, but no log has load_encoder_counts: theta_out_rad is absent",
        "states rig.load.torque_constant_Nm_per_A, but no log has load_current_A: tau_out_Nm, T2_N, T4_N are absent",
    }
    assert [set(r.channels) for r in ingested.recordings] == [{"theta_in_rad", "tau_in_Nm", "F_load_N"}] * 2


def test_a_torque_sensor_replaces_a_current(bench):
    bench.described["rig"]["drive"]["torque_sensor"] = {"Nm_per_count": KT}
    for name, frame in bench.tables.items():
        bench.tables[name] = frame.rename(columns={"drive_current_A": "drive_torque_counts"})
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    assert "tau_in_Nm" in ingested.recordings[0]


def test_a_current_beside_a_torque_sensor_may_have_faults(bench):
    bench.described["rig"]["drive"]["torque_sensor"] = {"Nm_per_count": KT}
    for name, frame in bench.tables.items():
        bench.tables[name] = frame.assign(drive_torque_counts=frame["drive_current_A"])
    whole = ingest_batch(bench.write().folder).recordings
    for frame in bench.tables.values():
        frame.loc[230, "drive_current_A"] = 1000.0
        frame.loc[300:380, "drive_current_A"] = np.nan
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    for recording, before in zip(ingested.recordings, whole, strict=True):
        assert np.array_equal(recording["tau_in_Nm"], before["tau_in_Nm"])
    # Without the sensor's constant the current is what there is.
    del bench.described["rig"]["drive"]["torque_sensor"]
    assert any(f.column == "drive_current_A" for f in ingest_batch(bench.write().folder).findings)


def test_the_majority_of_logs_decides_which_sensors_a_rig_has(bench):
    drop(add_logs(bench, "three"), ["one", "two"], ["load_current_A"])
    ingested = ingest_batch(bench.write().folder)
    (finding,) = ingested.findings
    assert (finding.file, finding.severity) == (str(bench.log("three")), "warning")
    assert "only 1 of 3 logs have this column" in finding.text
    assert ["tau_out_Nm" in r for r in ingested.recordings] == [False, False, True]


def test_a_refused_log_does_not_count_in_the_majority(bench):
    drop(add_logs(bench, "three", "four"), ["one", "two"], ["load_current_A"])
    bench.write()
    for name in ("three", "four"):
        bench.log(name).write_text(bench.log(name).read_text()[:-1])
    ingested = ingest_batch(bench.folder)
    assert [r.id for r in ingested.recordings] == ["one", "two"]
    assert [(f.severity, f.file == str(bench.folder / "batch.yaml")) for f in ingested.findings] == [
        ("warning", True),
        ("refused", False),
        ("refused", False),
    ]


def test_the_only_log_of_a_batch_must_have_all_stated_sensors(bench):
    del bench.tables["two"], bench.described["recordings"][1]
    ingested = ingest_batch(drop(bench, ["one"], LACKING).write().folder)
    (finding,) = ingested.findings
    assert ingested.recordings == []
    assert (finding.severity, finding.row, finding.column) == ("refused", 1, "drive_load_cell_V")
    assert "load_encoder_counts (stated by rig.load.encoder_counts_per_rev)" in finding.text
    assert "restore the column or, if the rig has no such sensor, take its key out of batch.yaml" in finding.text
    ingested = ingest_batch(without_sensors(bench).write().folder)
    assert ingested.findings == []
    assert set(ingested.recordings[0].channels) == {"theta_in_rad", "tau_in_Nm", "F_load_N"}


def test_a_load_encoder_without_its_constants_is_not_used(bench):
    del bench.described["rig"]["load"]["encoder_counts_per_rev"]
    ingested = ingest_batch(bench.write().folder)
    assert {f.text for f in ingested.findings} == {
        "not used: batch.yaml lacks rig.load.encoder_counts_per_rev, which converts it"
    }
    assert "theta_out_rad" not in ingested.recordings[0]


def test_uneven_sampling_with_too_long_a_gap(bench):
    late = 0.003 * (np.arange(400) % 4 == 0)
    changed("time_s", lambda t: t.time_s + late)(bench)
    assert "few or none are lost" in ingest_batch(bench.folder).findings[0].text
    frame(lambda t: t.drop(index=range(200, 240)))(bench)
    (finding,) = ingest_batch(bench.folder).findings
    assert (finding.severity, finding.row) == ("refused", 202)


def test_cells_in_quotation_marks(bench):
    plain = ingest_batch(bench.write().folder).recordings[0]
    lines = bench.log().read_text().splitlines()
    bench.log().write_text("".join('"' + line.replace(",", '","') + '"\n' for line in lines))
    ingested = ingest_batch(bench.folder)
    assert ingested.findings == []
    assert ingested.recordings[0]["T1_N"] == pytest.approx(plain["T1_N"])


def test_clock_coarser_than_half_a_step(bench):
    time = table(seed=1).time_s
    changed("time_s", lambda t: np.floor(time / 0.004 * 1.5) * 0.001)(bench)
    assert ingest_batch(bench.folder).findings == []


def test_step_of_the_drive_encoder_is_not_its_accuracy(bench):
    bench.described["rig"]["drive"]["encoder_accuracy_rad"] = 0.001
    (recording, _) = ingest_batch(bench.write().folder).recordings
    assert recording.encoder_step_rad["theta_in_rad"] == pytest.approx(2 * np.pi / COUNTS)
    assert recording.accuracy["theta_in_rad"] == 0.001


def test_a_frozen_channel_is_a_finding_unless_the_drive_rests(bench):
    changed("load_current_A", lambda t: t.load_current_A.where(t.index >= 350, t.load_current_A.abs().min()))(bench)
    findings = ingest_batch(bench.folder).findings
    assert [(f.column, f.row) for f in findings if f.row] == [("load_current_A", 2)]
    long_rest = table(n=600, rest=1.2, seed=1)
    long_rest.loc[20:220, "load_current_A"] = long_rest.load_current_A[20]
    bench.tables["one"] = long_rest
    assert ingest_batch(bench.write().folder).findings == []


def test_load_encoder_that_stops_between_longer_holds(bench):
    rest, stopped = table(n=2000, rest=4.2, seed=1), 40
    rest.loc[(rest.index >= 1200) & (rest.index < 1600), "load_encoder_counts"] = stopped
    bench.tables["one"] = rest
    (finding,) = ingest_batch(bench.write().folder).findings
    assert finding.column == "load_encoder_counts"


def test_logs_in_a_folder_of_the_batch(bench):
    bench.write()
    (bench.folder / "logs").mkdir()
    for entry in bench.described["recordings"]:
        raw = bench.log(entry["id"]).read_bytes()
        entry["file"] = f"logs/{entry['id']}.csv.gz"
        (bench.folder / entry["file"]).write_bytes(gzip.compress(raw))
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    assert [r.id for r in ingested.recordings] == ["one", "two"]


@pytest.mark.parametrize("step", ["read_log", "check_sensors", "calibrate"])
def test_an_unexpected_error_refuses_one_recording_only(bench, monkeypatch, step):
    real, calls = getattr(ingest, step), []

    def first_fails(*args):
        calls.append(args)
        if len(calls) == 1:
            raise ZeroDivisionError("odd\nlog")
        return real(*args)

    monkeypatch.setattr(ingest, step, first_fails)
    ingested = ingest_batch(bench.write().folder)
    assert [r.id for r in ingested.recordings] == ["two"]
    (finding,) = ingested.findings
    assert (finding.file, finding.severity) == (str(bench.log()), "refused")
    assert "(ZeroDivisionError: odd log)" in finding.text


def test_an_unexpected_error_in_a_description_is_a_finding(bench, monkeypatch):
    def fails(folder):
        raise KeyError("odd")

    monkeypatch.setattr(ingest, "load_batch", fails)
    (finding,) = ingest_batch(bench.write().folder).findings
    assert finding.file == str(bench.folder / "batch.yaml")
    assert "KeyError" in finding.text


@pytest.mark.parametrize("name", ["my batch", "{batch}", ".hidden"])
def test_a_folder_with_an_invalid_name(bench, name):
    assert not valid_name(name)
    folder = bench.write().folder.rename(bench.folder.parent / name)
    (finding,) = ingest_batch(folder).findings
    assert (finding.severity, finding.file) == ("refused", str(folder))
    assert f"'{name}' cannot be a batch's name" in finding.text and "rename the folder" in finding.text


def test_a_sensor_without_its_constants_is_not_used(bench):
    del bench.described["rig"]["drive"]["load_cell"]
    ingested = ingest_batch(bench.write().folder)
    assert {str(f).split(": ", 1)[1] for f in ingested.findings} == {
        "not used: batch.yaml lacks rig.drive.load_cell, which converts it"
    }
    assert "F_drive_N" not in ingested.recordings[0]


@pytest.mark.parametrize("name", ["half-loop", "loops", "pretension", "radius", "rich"])
def test_the_committed_batches_have_no_finding(name):
    ingested = ingest_batch(RAW / name)
    assert ingested.findings == []
    assert len(ingested.recordings) == len(ingested.batch.recordings)
    for recording in ingested.recordings:
        assert len(recording.channels) == 10
        assert 0.3 < recording.rest_s < 0.9
        assert abs(recording["theta_in_rad"][recording.time_s <= recording.rest_s]).max() < 0.0032
        assert recording["F_drive_N"][:50].mean() == pytest.approx(2 * recording.pretension_N, rel=0.3)


@pytest.mark.parametrize("shift", [-1.0, -2.5, 100.0, 1.7e9])
def test_the_clock_of_a_log_changes_nothing_but_the_times_of_tables(bench, shift, tmp_path):
    plain = ingest_batch(bench.write().folder).recordings
    for log in bench.tables.values():
        log["time_s"] += shift
    shifted = ingest_batch(bench.write().folder).recordings
    write_recordings(tmp_path / "r.nc", shifted, {})
    for one, other in zip(plain, read_recordings(tmp_path / "r.nc"), strict=True):
        assert other.time_s[0] == 0
        assert other.time_s == pytest.approx(one.time_s, abs=1e-6)
        assert other.rest_s == pytest.approx(one.rest_s, abs=1e-6) != 0
        assert other.to_frame().index.to_numpy() == pytest.approx(one.to_frame().index.to_numpy() + shift, abs=1e-6)
        for channel, values in one.channels.items():
            assert other[channel] == pytest.approx(values, abs=1e-12)


def test_recordings_of_an_earlier_version_are_read(bench, tmp_path):
    recordings = ingest_batch(bench.write().folder).recordings
    write_recordings(tmp_path / "r.nc", recordings, {})
    with netCDF4.Dataset(tmp_path / "r.nc", "a") as root:
        for group in root.groups.values():
            group.delncattr("log_start_s")
            group.delncattr("position")
    assert [r.log_start_s for r in read_recordings(tmp_path / "r.nc")] == [0.0, 0.0]


def test_a_file_name_that_does_not_show_is_refused(bench):
    bench.described["recordings"][0]["file"] = "\x1b]0;evil\x07.csv"
    (finding,) = ingest_batch(bench.write().folder).findings
    assert "has characters that do not show" in str(finding)
    assert str(finding).isprintable()


def test_a_day_is_no_moment(bench):
    bench.described["recordings"][0]["started_at"] = "2026-01-01"
    (finding,) = ingest_batch(bench.write().folder).findings
    assert "must be a date with a time of day" in finding.text


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda d: d["rig"]["accuracy"].update(encoder_rad=1.0),
            "rig.accuracy.encoder_rad is 1, but theta_",
        ),
        (
            lambda d: d["rig"]["cable"].update(length_m=0.0012),
            "no conduit of a cable rig; state",
        ),
    ],
)
def test_a_value_that_no_rig_has_is_inconsistent(bench, change, said):
    change(bench.described)
    found = [f for f in ingest_batch(bench.write().folder).findings if f.severity == "inconsistent"]
    assert any(said in f.text for f in found)


def test_a_transient_that_leaves_a_few_samples_leaves_too_few(bench):
    bench.described["recordings"][0]["settled_s"] = 1.59
    (finding,) = ingest_batch(bench.write().folder).findings
    assert "with 2 samples after settled_s 1.59 s" in finding.text
