import gzip
from pathlib import Path

import numpy as np
import pytest

from ccmodel.recording import read_recordings, write_recordings
from ccmodel.rig.ingest import ingest_batch

CASES = Path(__file__).parents[3] / "shared/concealed/cases"


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


# What is done to log "one", then row, column and part of the one line that must be said of it.
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
    "cells empty in bulk": (
        changed("drive_current_A", lambda t: t.drive_current_A.where((t.index < 50) | (t.index > 60))),
        52,
        "drive_current_A",
        "11 cells have no number, 11 of them in a row",
    ),
    "column empty": (changed("load_current_A", lambda t: np.nan), None, "load_current_A", "has no numbers"),
    "row too short": (line(20, lambda s: s.rsplit(",", 1)[0]), 20, None, "has 6 cells, the header has 7"),
    "row too long": (line(20, lambda s: s + ",1"), 20, None, "has 8 cells, the header has 7"),
    "cut between cells": (write_bytes(lambda raw: raw[: raw.rindex(b",") - 3]), 401, None, "cut in the middle"),
    "cut within a cell": (write_bytes(lambda raw: raw[: raw.rindex(b".") + 1]), 401, None, "cut in the middle"),
    "time back": (cell(30, 0, "0.05"), 30, "time_s", "time must increase, found 0.05 s after 0.112 s"),
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
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_bad_log_is_refused_in_one_line_and_the_good_one_comes_through(bench, name):
    damage, row, column, text = REFUSED[name]
    damage(bench.write())
    ingested = ingest_batch(bench.folder)
    assert [r.id for r in ingested.recordings] == ["two"]
    (finding,) = ingested.findings
    assert finding.severity == "refused"
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
    "infinite": (cell(50, 3, "inf"), 50, "drive_current_A", "no number: row dropped"),
    "two empty cells": (
        changed("drive_current_A", lambda t: t.drive_current_A.where(~t.index.isin([50, 51]))),
        52,
        "drive_current_A",
        "2 cells have no number",
    ),
    "sample twice": (frame(lambda t: t.loc[[*range(100), 99, *range(100, 400)]]), 102, None, "the same sample again"),
    "no end": (write_bytes(lambda raw: raw[:-1] + b"0"), 401, None, "the last line has no end"),
    "extra column": (
        changed("motor_temperature_degC", lambda t: "warm"),
        1,
        "motor_temperature_degC",
        "unknown column",
    ),
    "clipped": (
        changed("drive_current_A", lambda t: t.drive_current_A.clip(upper=0.5)),
        None,
        "drive_current_A",
        "flat at its extreme value",
    ),
}


@pytest.mark.parametrize("name", WARNED)
def test_a_small_fault_is_one_warning(bench, name):
    damage, row, column, text = WARNED[name]
    damage(bench.write())
    ingested = ingest_batch(bench.folder)
    (finding,) = ingested.findings
    assert [r.id for r in ingested.recordings] == ["one", "two"]
    assert (finding.severity, finding.column) == ("warning", column)
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
    assert (finding.severity, finding.column) == ("warning", column)
    assert text in finding.text
    one, two = ingested.recordings
    assert set(two.channels) - set(one.channels) == channels


def test_load_encoder_that_stops_is_told_and_kept(bench):
    changed("load_encoder_counts", lambda t: t.load_encoder_counts.where(t.index < 120, -30))(bench)
    ingested = ingest_batch(bench.folder)
    (finding,) = ingested.findings
    assert (finding.column, finding.severity) == ("load_encoder_counts", "warning")
    assert "stands still up to row 401 while the drive runs through its whole range" in finding.text
    assert "theta_out_rad" in ingested.recordings[0]


def test_range_of_a_sensor(bench):
    bench.described["rig"]["ranges"] = {"drive_current_A": [-0.4, 0.4]}
    findings = ingest_batch(bench.write().folder).findings
    assert {f.column for f in findings} == {"drive_current_A"}
    assert all("end of the sensor's range [-0.4, 0.4]" in f.text for f in findings)


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
        (edit("recordings", 1, "id", value="a/b"), "recordings[1].id: a name is letters, digits"),
        (edit("recordings", 1, "file", value="../one.csv"), "recordings[1].file: a log lies inside"),
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


def test_no_description_at_all(tmp_path):
    (finding,) = ingest_batch(tmp_path).findings
    assert "there is no such file" in finding.text


def test_nothing_left_after_the_transient(bench):
    bench.described["recordings"][0]["settled_s"] = 4.0
    ingested = ingest_batch(bench.write().folder)
    assert [r.id for r in ingested.recordings] == ["two"]
    assert "before settled_s 4 s" in ingested.findings[0].text


def test_rig_without_a_sensor_lacks_its_channels_without_a_finding(bench):
    for name, frame in bench.tables.items():
        bench.tables[name] = frame.drop(columns=["load_current_A", "drive_load_cell_V"])
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    assert set(ingested.recordings[0].channels) == {"theta_in_rad", "theta_out_rad", "tau_in_Nm", "F_load_N"}


def test_sensor_that_the_description_does_not_know(bench):
    del bench.described["rig"]["drive"]["load_cell"]
    ingested = ingest_batch(bench.write().folder)
    assert {str(f).split(": ", 1)[1] for f in ingested.findings} == {
        "not used: batch.yaml has no rig.drive.load_cell to make sense of it"
    }
    assert "F_drive_N" not in ingested.recordings[0]


@pytest.mark.parametrize("case", sorted(CASES.glob("case-*")) or [None], ids=str)
def test_outside_batches_come_in_without_a_finding(case):
    if case is None:
        pytest.skip(f"no outside batches beside the repository ({CASES.name} of shared/concealed)")
    ingested = ingest_batch(case)
    assert ingested.findings == []
    assert len(ingested.recordings) == len(ingested.batch.recordings)
    for recording in ingested.recordings:
        assert len(recording.channels) == 10
        assert 0.3 < recording.rest_s < 0.8
        assert abs(recording["theta_in_rad"][recording.time_s <= recording.rest_s]).max() < 0.0032
        assert recording["F_drive_N"][:50].mean() == pytest.approx(2 * recording.pretension_N, rel=0.3)
