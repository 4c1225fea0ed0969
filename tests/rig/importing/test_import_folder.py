"""What an import writes, and what it never touches."""

import gzip
import hashlib
import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pandas as pd
import pytest
from made_up_lab import counts, recording, write_text

from ccmodel.rig import drafting, readers
from ccmodel.rig.imported import earlier_import
from ccmodel.rig.importing import import_files, write_guess, writing
from ccmodel.rig.importing.showing import next_of_import
from ccmodel.rig.ingest import ingest_batch
from ccmodel.rig.log import read_log
from ccmodel.typed import InputError

MAP = """\
# the lab's own comment
format: 1
time: {signal: t, unit: s}
channels:
  drive_encoder_counts: {signal: enc, unit: count}
  F_drive_N: {signal: F, unit: N}
"""


STAMPED = """\
format: 1
time: {signal: stamp}
channels:
  theta_in_rad: {signal: angle, unit: rad, file: main}
  theta_out_rad: {signal: angle, unit: rad, file: load}
files:
  load: {pattern: "*_load.csv", time: {signal: stamp}}
"""

TWO_TIMES = """\
format: 1
time: {signal: at_drive}
channels:
  theta_in_rad: {signal: angle_drive, unit: rad}
  theta_out_rad: {signal: angle_load, unit: rad, time: {signal: at_load}}
"""


FILLED_IN = """\
format: 1
batch: batch-1
origin: rig
rig:
  drive: {pulley_radius_m: 0.006, encoder_counts_per_rev: 2000}
  load: {pulley_radius_m: 0.006}
  cable: {stiffness_N_per_m: 13880.0, length_m: 1.2, friction_coefficient: 0.147}
  accuracy: {encoder_rad: 0.00314, torque_Nm: 0.0001, load_cell_N: 0.1}
defaults: {pretension_N: 7.0, conduit: [{length_m: 1.2, bend_rad: 3.14}]}
recordings:
- {id: one, file: one.csv.gz}
"""


class Lab:
    """A folder of two recordings, a map and the folder of the batch."""

    def __init__(self, root):
        self.root, self.map, self.batch = root, root / "map.yaml", root / "batch-1"
        self.map.write_text(MAP)
        self.files = [self.log("one", 1), self.log("two", 2)]

    def log(self, name, seed):
        r = recording(seed)
        columns = {"t": r["time_s"], "enc": counts(r["theta_in_rad"]), "F": r["F_drive_N"]}
        return write_text(self.root / "lab" / f"{name}.csv", columns)

    def run(self, files=None, batch=None):
        return import_files(files or self.files, self.map, batch or self.batch)

    def provenance(self):
        return json.loads((self.batch / "import.json").read_text())


@pytest.fixture
def lab(tmp_path):
    return Lab(tmp_path)


def sha256(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_a_folder_with_logs_map_and_provenance(lab):
    lab.run()
    names = {entry.name for entry in lab.batch.iterdir()} - {"batch.yaml"}
    assert names == {"one.csv.gz", "two.csv.gz", "map.yaml", "import.json"}
    assert (lab.batch / "map.yaml").read_text() == MAP
    stated = lab.provenance()
    assert stated["map"]["sha256"] == sha256(lab.map)
    assert stated["libraries"]["pint"]
    one = stated["recordings"][0]
    assert one["sources"] == [
        {"role": "main", "file": "one.csv", "sha256": sha256(lab.files[0]), "bytes": lab.files[0].stat().st_size}
    ]
    assert one["sha256"] == sha256(lab.batch / "one.csv.gz")
    assert str(lab.root) not in (lab.batch / "import.json").read_text()
    table, _ = read_log(lab.batch / "one.csv.gz")
    assert (table["drive_encoder_counts"] % 1 == 0).all()
    assert b"." not in gzip.decompress((lab.batch / "one.csv.gz").read_bytes()).splitlines()[1].split(b",")[1]


def test_the_same_files_give_the_same_bytes(lab):
    lab.run()
    first = {entry.name: entry.read_bytes() for entry in lab.batch.iterdir()}
    lab.run()
    other = lab.root / "elsewhere" / "batch-1"
    lab.run(batch=other)
    for name, content in first.items():
        assert (lab.batch / name).read_bytes() == content
        assert (other / name).read_bytes() == content


def test_a_repeated_import_replaces_its_own_and_keeps_batch_yaml(lab):
    lab.run()
    (lab.batch / "batch.yaml").write_text("mine: true\n")
    lab.run(lab.files[:1])
    assert {e.name for e in lab.batch.iterdir()} == {"one.csv.gz", "map.yaml", "import.json", "batch.yaml"}
    assert (lab.batch / "batch.yaml").read_text() == "mine: true\n"


@pytest.mark.parametrize("filled_in", [True, False])
def test_a_recording_that_was_imported_later_is_named_until_batch_yaml_lists_it(lab, filled_in):
    lab.run(lab.files[:1])
    stated = lab.batch / "batch.yaml"
    stated.write_text(FILLED_IN if filled_in else stated.read_text() + "# edited\n")
    written = lab.run()
    assert written.unlisted == ["two"]
    assert f"add two to {stated}, which does not list them, then: " in next_of_import(written, lab.batch)
    stated.write_text(FILLED_IN)
    named = [f for f in ingest_batch(lab.batch).findings if f.file == str(lab.batch / "two.csv.gz")]
    assert [(f.severity, f.text.partition(";")[0]) for f in named] == [
        ("warning", "not used: it was imported, and batch.yaml does not list it")
    ]
    (lab.batch / "two.csv.gz").unlink()
    assert not any("two" in f.file for f in ingest_batch(lab.batch).findings)


def test_a_draft_that_nobody_edited_is_drafted_again(lab):
    """A map that was wrong leaves no pretension and no noise of its own behind."""
    lab.map.write_text(MAP.replace("unit: N}", "unit: kN}"))
    lab.run(lab.files[:1])
    draft = lab.batch / "batch.yaml"
    assert "pretension_N: 3.5e+03" in draft.read_text()
    lab.map.write_text(MAP)
    written = lab.run()
    assert (written.drafted, written.unlisted, written.changed) == (True, [], [])
    assert "pretension_N: 3.5 " in draft.read_text() and "two.csv.gz" in draft.read_text()


def test_an_edited_draft_is_kept_and_said_to_be_of_an_earlier_import(lab):
    lab.map.write_text(MAP.replace("unit: N}", "unit: kN}"))
    lab.run()
    draft = lab.batch / "batch.yaml"
    edited = draft.read_text().replace("pulley_radius_m:", "pulley_radius_m: 0.006", 1)
    draft.write_text(edited)
    assert lab.run().changed == []
    lab.map.write_text(MAP)
    written = lab.run()
    assert (written.drafted, written.changed, draft.read_text()) == (False, ["one", "two"], edited)
    said = f"check the values in {draft}: it is of an earlier import, and the log of one and 1 more has changed"
    assert said in next_of_import(written, lab.batch)


def going_back(lab, name="back"):
    """A log whose 200th line has a time of before."""
    file = lab.log(name, 3)
    lines = file.read_text().splitlines()
    lines[199] = ",".join(["0.1", *lines[199].split(",")[1:]])
    file.write_text("\n".join(lines) + "\n")
    return file


@pytest.mark.parametrize("beside", [False, True])
def test_times_that_go_back_are_refused_with_the_row_of_the_file(lab, beside):
    files = [*(lab.files if beside else []), going_back(lab)]
    with pytest.raises(InputError) as caught:
        lab.run(files)
    assert str(caught.value) == "back.csv, row 200: the times of 't' must increase: 0.1 s after 0.394 s"
    assert not lab.batch.exists()


def test_a_sample_that_is_repeated_is_no_time_that_goes_back(lab):
    lines = lab.files[0].read_text().splitlines()
    lab.files[0].write_text("\n".join([*lines[:50], lines[49], *lines[50:]]) + "\n")
    lab.run()
    assert [d.text for d in read_log(lab.batch / "one.csv.gz")[1]] == ["the same sample again: dropped"]


def with_a_gap(lab, name="gap"):
    """A log that no batch can use: it lacks three seconds."""
    file = lab.log(name, 4)
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines[:500], *lines[2000:]]) + "\n")
    return file


def test_nothing_that_was_just_written_is_read_again(lab, monkeypatch):
    """A draft has read all logs; an import without one reads those that `batch.yaml` leaves out."""
    read = []

    def counted(path, *more):
        read.append(path.name)
        return read_log(path, *more)

    monkeypatch.setattr(drafting, "read_log", counted)
    monkeypatch.setattr(writing, "read_log", counted)
    lab.run([lab.files[0], with_a_gap(lab)])
    assert sorted(read) == ["gap.csv.gz", "one.csv.gz"]
    draft = lab.batch / "batch.yaml"
    draft.write_text(draft.read_text() + "# edited\n")
    read.clear()
    looked_at = []
    monkeypatch.setattr(writing, "earlier_import", lambda f: looked_at.append(f) or earlier_import(f))
    written = lab.run([lab.files[0], with_a_gap(lab)])
    assert (read, written.unlisted, len(looked_at)) == (["gap.csv.gz"], [], 1)
    assert any(remark.startswith("gap.csv.gz: not used") for remark in written.remarks)


def test_a_log_that_no_batch_can_use_is_named_with_its_reason(lab):
    written = lab.run([lab.files[0], with_a_gap(lab)])
    assert written.unlisted == []
    (remark,) = written.remarks
    assert remark.startswith("gap.csv.gz: not used: row 501, time_s, a gap of 3")
    assert "add" not in next_of_import(written, lab.batch)


def test_nothing_is_written_if_no_log_can_be_used(lab):
    with pytest.raises(InputError, match=r"^gap.csv: its log could not be used: row 501, time_s, a gap of 3"):
        lab.run([with_a_gap(lab)])
    assert {entry.name for entry in lab.root.iterdir()} == {"lab", "map.yaml"}


def test_a_file_that_is_not_there_is_named_as_it_was_given(lab):
    given = lab.root / "measurements" / "*.csv"
    for run in (lambda: lab.run([given]), lambda: write_guess([given], lab.batch)):
        with pytest.raises(InputError) as caught:
            run()
        assert str(caught.value) == f"{given}: there is no such file"


def test_an_import_whose_recordings_are_all_listed_has_no_finding_on_it(lab):
    assert lab.run().unlisted == []
    both = FILLED_IN.replace("file: one.csv.gz}", "file: ./one.csv.gz}\n- {id: second, file: two.csv.gz}")
    (lab.batch / "batch.yaml").write_text(both)
    assert not any("list" in f.text for f in ingest_batch(lab.batch).findings)
    (lab.batch / "import.json").write_text("[]")
    assert [f.severity for f in ingest_batch(lab.batch).findings if f.file.endswith("import.json")] == ["warning"]


def test_a_failed_import_leaves_all_as_it_was(lab):
    lab.run()
    before = {entry.name: entry.read_bytes() for entry in lab.batch.iterdir()}
    lab.files[0].write_bytes(b"")
    lab.files[1].write_bytes(b"\x00\x01\x02 nothing")
    with pytest.raises(InputError) as caught:
        lab.run()
    lines = str(caught.value).splitlines()
    assert [line.partition(":")[0] for line in lines] == ["one.csv", "two.csv"]
    assert {entry.name: entry.read_bytes() for entry in lab.batch.iterdir()} == before
    assert {entry.name for entry in lab.root.iterdir()} == {"lab", "map.yaml", "batch-1"}


def test_what_is_no_import_is_never_replaced(lab):
    lab.batch.mkdir()
    (lab.batch / "thesis.txt").write_text("years of work")
    with pytest.raises(InputError, match="would be replaced, but thesis.txt is from no import"):
        lab.run()
    with pytest.raises(InputError, match="would be replaced, but one.csv is from no import"):
        lab.run(batch=lab.root / "lab")
    (lab.batch / "thesis.txt").rename(lab.batch / "import.json")
    with pytest.raises(InputError, match="import.json: is not what an import wrote .*; give a new or empty folder"):
        lab.run()
    assert (lab.batch / "import.json").read_text() == "years of work"
    with pytest.raises(InputError, match="its name becomes the batch's"):
        lab.run(batch=lab.root / "a batch")


def test_files_of_one_name_from_two_folders(lab):
    for day, file in enumerate(lab.files):
        (lab.root / f"day{day}").mkdir()
        file.rename(lab.root / f"day{day}/run.csv")
    lab.run([lab.root / "day0/run.csv", lab.root / "day1/run.csv"])
    assert {r["id"]: r["sources"][0]["file"] for r in lab.provenance()["recordings"]} == {
        "day0-run": "day0/run.csv",
        "day1-run": "day1/run.csv",
    }


def test_a_point_in_a_name_is_no_ending(lab):
    names = ["pretension_2.50.csv", "pretension_2.75.csv"]
    files = [file.rename(file.with_name(name)) for file, name in zip(lab.files, names, strict=False)]
    lab.run(files)
    assert [r["id"] for r in lab.provenance()["recordings"]] == ["pretension_2.50", "pretension_2.75"]
    assert all((lab.batch / f"{name}.gz").exists() for name in names)


def test_listed_recordings_have_the_ids_of_the_map(lab):
    lab.map.write_text(MAP + "recordings:\n- {id: sine-slow, files: [two.csv]}\n")
    written = lab.run()
    assert list(written.recordings) == ["sine-slow"]
    assert written.remarks == ["one.csv: left out, no recording of the map has it"]
    lab.map.write_text(MAP + "recordings:\n- {id: sine-slow, files: [three.csv]}\n")
    with pytest.raises(InputError, match="recording 'sine-slow': 'three.csv' is not among the files given"):
        lab.run()


SEVERAL = """\
format: 1
time: {signal: t, unit: s}
channels:
  theta_in_rad: {signal: q, unit: rad, file: main}
  theta_out_rad: {signal: q, unit: rad, file: load}
  T4_N: {signal: enc, unit: N}
  F_load_N: {signal: F, unit: N, delay_s: 0.004}
files:
  load:
    pattern: "*_load.csv"
    time: {signal: ms, unit: ms}
    CLOCK
"""


def several(root, offset=0.0, drift=0.0):
    """A recording in two files: the load's clock is t_first = offset + (1 + drift) t."""
    r = recording(3)
    first = write_text(root / "lab/run1.csv", {"t": r["time_s"], "q": r["theta_in_rad"], "F": 0 * r["time_s"]})
    at = np.arange(0.2, 5.5, 0.004)
    real = {name: np.interp(at, r["time_s"], values) for name, values in r.items()}
    delayed = np.interp(at - 0.004, r["time_s"], r["theta_out_rad"])
    columns = {
        "ms": 1e3 * (at - offset) / (1 + drift),
        "q": real["theta_out_rad"],
        "again": 100 * real["theta_in_rad"],
        "enc": counts(real["theta_out_rad"]),
        "G": 6 + delayed,
    }
    return r, [first, write_text(root / "lab/run1_load.csv", columns)]


def import_several(root, clock, offset=0.0, drift=0.0):
    r, files = several(root, offset, drift)
    text = SEVERAL.replace("CLOCK", f"clock: {clock}" if clock else "").replace("signal: F,", "signal: G,")
    (root / "map.yaml").write_text(text)
    return r, import_files(files, root / "map.yaml", root / "batch")


def test_two_files_of_one_recording_with_a_stated_clock(tmp_path):
    r, written = import_several(tmp_path, "{offset_s: -12.5, drift: 1.0e-4}", -12.5, 1e-4)
    assert list(written.recordings) == ["run1"]
    table = written.recordings["run1"].table
    at = table["time_s"] + 0.2
    expected = np.interp(at, r["time_s"], r["theta_out_rad"])
    assert table["theta_out_rad"].to_numpy() == pytest.approx(expected, abs=2e-3)
    assert table["F_load_N"].to_numpy() == pytest.approx(6 + expected, abs=2e-3)
    cost = json.loads((tmp_path / "batch/import.json").read_text())["recordings"][0]["joined"]
    assert [c["column"] for c in cost] == ["theta_out_rad", "T4_N", "F_load_N"]
    assert {c["how"] for c in cost} == {"stated in the map"}
    assert cost[2]["delay_s"] == 0.004


def test_two_files_whose_clocks_are_matched(tmp_path):
    _, written = import_several(tmp_path, "{match: [again, q]}", -12.5, 1e-4)
    cost = written.recordings["run1"].costs[0]
    assert cost.drift == pytest.approx(1e-4, abs=1.5 * cost.drift_uncertainty + 1e-6)
    middle = 15.5
    assert cost.offset_s + (1 + cost.drift) * middle == pytest.approx(
        -12.5 + (1 + 1e-4) * middle, abs=1.5 * cost.offset_uncertainty_s + 1e-5
    )


def test_a_main_file_belongs_to_the_recording_of_its_folder(tmp_path):
    _, (first, load) = several(tmp_path)
    folder = tmp_path / "lab/run1"
    folder.mkdir()
    files = [first.rename(folder / "drive.csv"), load.rename(folder / "load.csv")]
    text = SEVERAL.replace("CLOCK", "").replace("signal: F,", "signal: G,").replace("*_load.csv", "*/load.csv")
    (tmp_path / "map.yaml").write_text(text)
    assert list(import_files(files, tmp_path / "map.yaml", tmp_path / "batch").recordings) == ["run1"]


def test_a_folder_that_is_called_as_a_recording_names_none_unless_the_map_says_so(tmp_path):
    _, (first, load) = several(tmp_path)
    folder = tmp_path / "lab/run1"
    folder.mkdir()
    (tmp_path / "map.yaml").write_text(SEVERAL.replace("CLOCK", "").replace("signal: F,", "signal: G,"))
    with pytest.raises(InputError, match=r"recording 'run1-drive': beside drive\.csv there is no drive_load\.csv"):
        import_files([first.rename(folder / "drive.csv"), load], tmp_path / "map.yaml", tmp_path / "batch")


def test_a_log_of_the_batch_is_not_imported_into_it(tmp_path):
    """Its columns would be turned a second time."""
    _, (first, _) = several(tmp_path)
    (tmp_path / "map.yaml").write_text(
        "format: 1\ntime: {signal: t, unit: s}\nchannels:\n  theta_in_rad: {signal: q, unit: rad}\n"
    )
    import_files([first], tmp_path / "map.yaml", tmp_path / "batch")
    written = tmp_path / "batch/run1.csv.gz"
    before = written.read_bytes()
    with pytest.raises(InputError, match=r"run1.csv.gz: lies in .*batch, which an import replaces"):
        import_files([written], tmp_path / "map.yaml", tmp_path / "batch")
    assert written.read_bytes() == before


def test_two_files_without_a_common_clock_are_taken_to_start_together(tmp_path):
    _, written = import_several(tmp_path, "", -12.5)
    one = written.recordings["run1"]
    assert "run1_load.csv: taken to start together with run1.csv; state 'clock' in the map if not" in one.remarks
    assert one.costs[0].offset_s == pytest.approx(-12.7)
    assert one.costs[0].offset_uncertainty_s is None


def test_absolute_start_times_align_files(tmp_path, monkeypatch):
    """Files that store times and their absolute start need no clock."""
    r, files = several(tmp_path)
    text = SEVERAL.replace("signal: F,", "signal: G,").replace("time: {signal: t, unit: s}\n", "")
    text = text.replace("    time: {signal: ms, unit: ms}\n    CLOCK\n", "")
    (tmp_path / "map.yaml").write_text(text)
    start = datetime(2024, 5, 1, 12, 0, 0, 1000, UTC)
    read = readers.read_signals

    def with_times(path, layout=None):
        file = read(path, layout)
        late = timedelta(seconds=0.2) if "load" in path.name else timedelta(0)
        time = file.signals[0].values * (1e-3 if late else 1) - late.total_seconds()
        signals = tuple(replace(signal, time_s=time) for signal in file.signals)
        return replace(file, signals=signals, started=start + late)

    monkeypatch.setattr(readers, "read_signals", with_times)
    written = import_files(files, tmp_path / "map.yaml", tmp_path / "batch")
    cost = written.recordings["run1"].costs[0]
    assert (cost.offset_s, cost.offset_uncertainty_s) == (0.2, 1e-3)
    assert cost.how == "absolute start times of both files"
    table = written.recordings["run1"].table
    expected = np.interp(table["time_s"] + 0.2, r["time_s"], r["theta_out_rad"])
    assert table["theta_out_rad"].to_numpy() == pytest.approx(expected, abs=2e-3)


def test_columns_of_dates_and_times_align_files(tmp_path):
    """The load's file begins 0.75 s later, by its own stamps."""
    time_s, started = np.arange(0, 6, 0.004), datetime(2026, 3, 31, 12, 0, 0, 250000)
    for name, begin in (("run1", 0.0), ("run1_load", 0.75)):
        stamps = [(started + timedelta(seconds=begin + t)).isoformat(timespec="microseconds") for t in time_s.tolist()]
        angle = np.sin(begin + time_s) + 0.2 * np.sin(7 * (begin + time_s))
        lines = [f"{stamp},{value:.6f}" for stamp, value in zip(stamps, angle, strict=True)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["stamp,angle", *lines]) + "\n")
    (tmp_path / "map.yaml").write_text(STAMPED)
    files = [tmp_path / "run1.csv", tmp_path / "run1_load.csv"]
    one = import_files(files, tmp_path / "map.yaml", tmp_path / "batch").recordings["run1"]
    assert "run1.csv: 'stamp' holds dates and times: read as seconds from the first" in one.remarks
    assert one.costs[0].how == "absolute start times of both files"
    assert one.table["theta_out_rad"].to_numpy() == pytest.approx(one.table["theta_in_rad"].to_numpy(), abs=1e-4)


def test_two_columns_of_dates_and_times_in_a_file_keep_their_offset(tmp_path):
    """The load's samples of a table begin 0.75 s after the drive's, by their own stamps."""
    time_s, started = np.arange(0, 6, 0.004), pd.Timestamp("2026-03-31T12:00:00Z")
    table = pd.DataFrame()
    for end, begin in (("drive", 0.0), ("load", 0.75)):
        table[f"at_{end}"] = started + pd.to_timedelta(begin + time_s, unit="s")
        table[f"angle_{end}"] = np.sin(begin + time_s) + 0.2 * np.sin(7 * (begin + time_s))
    table.to_parquet(tmp_path / "run1.parquet")
    (tmp_path / "map.yaml").write_text(TWO_TIMES)
    written = import_files([tmp_path / "run1.parquet"], tmp_path / "map.yaml", tmp_path / "batch")
    one = written.recordings["run1"]
    assert one.table["theta_out_rad"].to_numpy() == pytest.approx(one.table["theta_in_rad"].to_numpy(), abs=1e-4)


@pytest.mark.parametrize(
    ("damage", "text"),
    [
        (lambda lines: [*lines[:50], lines[49], *lines[50:]], "run1_load.csv: the times of 'F' must increase"),
        (
            lambda lines: [*lines[:5], *(f"{x.partition(',')[0]}," for x in lines[5:])],
            "run1_load.csv: 'F' has 4 numbers only",
        ),
    ],
)
def test_what_is_wrong_with_a_further_file_is_said_of_it(tmp_path, damage, text):
    time_s = np.arange(0, 3, 0.01)
    for name, column in (("run1", "angle"), ("run1_load", "F")):
        lines = [f"t,{column}", *(f"{t:.3f},{5 + np.sin(t):.5f}" for t in time_s)]
        lines = damage(lines) if name == "run1_load" else lines
        (tmp_path / f"{name}.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "map.yaml").write_text(
        STAMPED.replace("signal: stamp", "signal: t, unit: s").replace(
            "theta_out_rad: {signal: angle, unit: rad", "F_load_N: {signal: F, unit: N"
        )
    )
    with pytest.raises(InputError, match=text):
        import_files([tmp_path / "run1.csv", tmp_path / "run1_load.csv"], tmp_path / "map.yaml", tmp_path / "batch")


def test_a_signal_that_two_files_have_needs_its_file(tmp_path):
    _, files = several(tmp_path)
    text = SEVERAL.replace("    CLOCK\n", "").replace(", file: main", "")
    (tmp_path / "map.yaml").write_text(text)
    with pytest.raises(InputError, match="run1.csv: 'q' is also in run1_load.csv: state the channel's 'file'"):
        import_files(files, tmp_path / "map.yaml", tmp_path / "batch")


def test_a_missing_further_file_is_named(tmp_path):
    _, files = several(tmp_path)
    (tmp_path / "map.yaml").write_text(SEVERAL.replace("    CLOCK\n", ""))
    text = r"recording 'run1': beside run1.csv there is no run1_load.csv \('load'\): give that file too"
    with pytest.raises(InputError, match=text):
        import_files(files[:1], tmp_path / "map.yaml", tmp_path / "batch")
