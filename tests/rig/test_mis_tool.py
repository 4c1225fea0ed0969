import gzip
import json
import lzma
import os
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from ccmodel.rig.ingest import ingest_batch
from ccmodel.rig.mis_tool import import_batch, import_mis_tool
from ccmodel.typed import InputError

NM_PER_COUNT = 3.9811e-5  # stated by the data set
EXCERPT = Path(__file__).parent / "data/Tool_4_Maryland_L_Pitch_1/113.TXT.xz"
ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "data/raw/da-vinci"
# Folder of the whole public data set, as for `make real DATA=path`.
SHARED = ROOT.parent / "shared/real/mis-tool-characterization/data"
DATA = os.environ.get("MIS_TOOL_DATA") or (str(SHARED) if SHARED.is_dir() else None)
WHY_NO_DATA = f"no mis-tool-characterization data: MIS_TOOL_DATA does not name them, and {SHARED} is not there"
HEADER = "%Data taken by somebody\n%Freq_Hz=0.99\n%Back-end Time [ms], Back-end CUI Encoder [counts]\n"


def trial(frequency=0.5, level=0.2, seed=0, seconds=8.0):
    """Samples like the real ones: load angle and drive torque counted against the drive angle."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(1000 * seconds)) / 1000
    phase = 2 * np.pi * frequency * time
    drive, speed = 680 + 640 * np.sin(phase), np.cos(phase)
    columns = [
        time,
        drive.round(),
        (-1500 * np.tanh(5 * speed) + rng.normal(0, 4, time.size)).round(),
        0.1 * speed,
        (550 - 0.42 * drive).round(),
        (-1000 * level + 150 * np.tanh(5 * speed) + rng.normal(0, 3, time.size)).round(),
        np.full(time.size, level),
        speed,
        (17.5 * drive).round(),
        drive,
    ]
    return np.column_stack(columns)


def text(samples, delimiter=",", header=HEADER):
    return header + "\n".join(delimiter.join(f"{x:.3f}" for x in row) for row in samples) + "\n"


def write(folder, name, content):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(content)


def test_a_nested_data_set(tmp_path):
    source = tmp_path / "repository"
    write(source, "README.txt", "The data set\nhas 10 columns.\n")
    write(source / "data/Tool 9", "112.TXT", text(trial(0.5, 0.4)))
    write(source / "data/Tool 9", "003.txt", text(trial(0.3, 0.8, 1), delimiter="\t", header=""))
    write(source / "data/deep/Tool_8", "12.TXT", text(trial(0.2, 0.3, 2), delimiter="  ", header="some words\n\n"))
    imported = import_mis_tool(source, tmp_path / "raw")
    assert [b.name for b in imported.batches] == ["Tool-9", "Tool_8"]
    assert imported.findings == []
    ingested = ingest_batch(imported.batches[0])
    assert ingested.findings == []
    assert ingested.batch.rig.drive.torque_sign == -1
    assert ingested.batch.rig.load.encoder_sign == -1
    assert ingested.batch.rig.load.torque_sign == 1
    first, second = ingested.recordings
    assert (first.id, second.id) == ("trial-003", "trial-112")
    assert second.excitation == {"wave": "sine", "trial": "112", "frequency_Hz": 0.5, "load_level": 0.4, "stop": 1}
    assert first.excitation["frequency_Hz"] == pytest.approx(0.3, abs=0.001)
    assert second.settled_s == 4.0
    assert second.origin == "rig"
    assert set(second.channels) == {"theta_in_rad", "theta_out_rad", "tau_in_Nm", "tau_out_Nm", "theta_motor_rad"}
    assert ingested.batch.rig.drive.motor_sign == 1
    assert "cable.stiffness_N_per_m" in ingested.batch.rig.nominal
    samples = trial(0.5, 0.4)
    assert second["theta_in_rad"] == pytest.approx((samples[:, 1] - 680) * 2 * np.pi / 8192)
    assert second["tau_in_Nm"] == pytest.approx(-samples[:, 2] * NM_PER_COUNT)
    assert second.accuracy["theta_in_rad"] < second.accuracy["theta_out_rad"]
    (deep,) = ingest_batch(imported.batches[1]).recordings
    assert "stop" not in deep.excitation
    described = yaml.safe_load((imported.batches[0] / "batch.yaml").read_text())
    assert "Open Database License" in described["note"] and "10.1109/LRA.2018.2849862" in described["note"]
    assert "%Freq_Hz=0.99" in described["recordings"][1]["note"]


def test_a_single_folder_with_time_in_ms(tmp_path):
    samples = trial()
    samples[:, 0] *= 1000
    write(tmp_path / "tool", "00.TXT", text(samples))
    (batch,) = import_mis_tool(tmp_path / "tool", tmp_path / "raw").batches
    (recording,) = ingest_batch(batch).recordings
    assert recording.time_s[-1] == pytest.approx(7.999)


def test_rows_that_are_no_samples(tmp_path):
    lines = text(trial(), header="").splitlines()
    lines[100] = lines[100].replace(",", ",oops", 1)
    lines[200] = ",".join([*lines[200].split(",")[:3], "", *lines[200].split(",")[4:]])
    lines[-1] = lines[-1][:20]
    trailing = [line + ",," for line in lines[:-1]] + [lines[-1]]
    for name, content in (("plain", lines), ("trailing", trailing)):
        write(tmp_path / name, "00.TXT", "\n".join(content))
        imported = import_mis_tool(tmp_path / name, tmp_path / "raw")
        (finding,) = imported.findings
        assert finding.text == "3 rows that are no samples dropped, the first is row 101"
        (found,) = ingest_batch(imported.batches[0]).findings
        assert (found.severity, found.column) == ("warning", "time_s")


def test_a_cut_last_line(tmp_path):
    write(tmp_path / "tool", "00.TXT", text(trial())[:-40])
    (finding,) = import_mis_tool(tmp_path / "tool", tmp_path / "raw").findings
    assert "the last line is cut" in finding.text


def test_faulty_trials_are_findings_and_the_others_are_imported(tmp_path):
    reset = trial(seed=1)
    reset[5000:, 1] -= 4096
    stuck = trial(seed=2)
    stuck[:, 1] = 12
    back = trial(seed=3)
    back[3000:, 0] -= 3
    short = trial(seed=4)[:3000]
    for name, samples in {"00": trial(), "01": reset, "02": stuck, "03": back, "04": short}.items():
        write(tmp_path / "tool", f"{name}.TXT", text(samples))
    (batch,) = import_mis_tool(tmp_path / "tool", tmp_path / "raw").batches
    ingested = ingest_batch(batch)
    assert [r.id for r in ingested.recordings] == ["trial-00"]
    assert [(Path(f.file).name[6:8], f.severity) for f in ingested.findings] == [
        ("01", "refused"),
        ("02", "refused"),
        ("03", "refused"),
        ("04", "refused"),
    ]


@pytest.mark.parametrize(
    ("content", "reported"),
    [
        ("The data set\n- 10 columns,\n- 52 trials.\n\n1. Cite it.\n", False),
        ("", True),
        (HEADER, True),
        (HEADER + "0.0,1,2,3,4,5,6\n", True),
        ("0.0 1 2 3 4 5 6\n", True),
        ("words\n" + "1,2,3\n" * 600, True),
    ],
    ids=["prose", "empty", "header only", "one row", "one row without header", "few columns"],
)
def test_files_that_are_no_trials(tmp_path, content, reported):
    write(tmp_path / "tool", "00.TXT", text(trial()))
    write(tmp_path / "tool", "01.TXT", content)
    imported = import_mis_tool(tmp_path / "tool", tmp_path / "raw")
    assert [(Path(f.file).name, f.severity) for f in imported.findings] == ([("01.TXT", "refused")] if reported else [])
    assert json.loads((tmp_path / "raw/findings.json").read_text()) == [asdict(f) for f in imported.findings]


def test_an_import_replaces_an_earlier_one_only_if_it_succeeds(tmp_path):
    for folder in ("old", "new"):
        write(tmp_path / folder / f"{folder}-tool", "00.TXT", text(trial()))
    out = tmp_path / "made/raw"
    import_mis_tool(tmp_path / "old", out)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no trial found"):
        import_mis_tool(tmp_path / "empty", out)
    assert sorted(p.name for p in out.iterdir()) == ["findings.json", "old-tool"]
    (batch,) = import_mis_tool(tmp_path / "new", out).batches
    assert batch == out / "new-tool"
    assert sorted(p.name for p in out.iterdir()) == ["findings.json", "new-tool"]
    assert [p.name for p in out.parent.iterdir()] == ["raw"]


def test_an_import_replaces_nothing_else(tmp_path):
    write(tmp_path / "tool", "00.TXT", text(trial()))
    write(tmp_path / "raw/mine", "batch.yaml", "format: 1\n")
    with pytest.raises(InputError, match="mine is from no import"):
        import_mis_tool(tmp_path / "tool", tmp_path / "raw")
    assert (tmp_path / "raw/mine/batch.yaml").is_file()
    with pytest.raises(InputError, match="is no folder"):
        import_mis_tool(tmp_path / "tool", tmp_path / "tool/00.TXT")


def test_one_folder_becomes_a_batch_beside_others(tmp_path):
    write(tmp_path / "raw/mine", "batch.yaml", "format: 1\n")
    write(tmp_path / "Tool 9", "00.TXT", text(trial()))
    out = tmp_path / "raw/da-vinci"
    (batch,) = import_batch(tmp_path / "Tool 9", out).batches
    assert batch == out and ingest_batch(out).findings == [], "licence and source are no logs"
    assert ingest_batch(out).batch.batch == "da-vinci"
    assert sorted(p.name for p in out.iterdir()) == ["LICENSE", "SOURCE.md", "batch.yaml", "trial-00.csv.gz"]
    assert "folder `Tool 9` of" in (out / "SOURCE.md").read_text()
    write(tmp_path / "Tool 9", "01.TXT", text(trial(seed=1)))
    import_batch(tmp_path / "Tool 9", out)
    assert len(ingest_batch(out).recordings) == 2
    assert sorted(p.name for p in out.parent.iterdir()) == ["da-vinci", "mine"]


def test_one_batch_is_made_of_one_folder_and_replaces_nothing_else(tmp_path):
    write(tmp_path / "raw/mine", "batch.yaml", "format: 1\n")
    write(tmp_path / "set/tool", "00.TXT", text(trial()))
    for source, name, said in (
        (tmp_path / "set/tool", "mine", "mine: would be replaced, but is from no import"),
        (tmp_path / "set", "new", "has trials in tool; a batch is made of one folder"),
        (tmp_path / "set/tool", "a batch", "a name is letters"),
        (tmp_path / "raw", "new", "no trial found"),
    ):
        with pytest.raises(InputError, match=said):
            import_batch(source, tmp_path / "raw" / name)
    assert [p.name for p in (tmp_path / "raw").iterdir()] == ["mine"]


def test_no_sample_and_no_count_of_a_trial_is_lost(tmp_path):
    """The diagnosis reconstructs the motion from the times of the encoder's counts: they stay as they were recorded."""
    samples = trial(seconds=8.0)
    write(tmp_path / "tool", "00.TXT", text(samples))
    (batch,) = import_mis_tool(tmp_path / "tool", tmp_path / "raw").batches
    log = pd.read_csv(batch / "trial-00.csv.gz")
    columns = ["time_s", "drive_encoder_counts", "drive_torque_counts", "load_encoder_counts", "load_torque_counts"]
    assert log[columns].to_numpy() == pytest.approx(samples[:, [0, 1, 2, 4, 5]], abs=1e-9)


def test_the_shipped_recordings_have_licence_and_source():
    licence, source = (SHIPPED / name for name in ("LICENSE", "SOURCE.md"))
    for said in (
        "Open Database License (ODbL) 1.0",
        "https://opendatacommons.org/licenses/odbl/1-0/",
        "Database Contents License (DbCL) 1.0",
        "under the same licence",
    ):
        assert said in licence.read_text()
    for said in ("10.1109/LRA.2018.2849862", "MRDLab/mis-tool-characterization", "Tool_4_Maryland_L_2", "changed"):
        assert said in source.read_text()
    assert sum(f.stat().st_size for f in SHIPPED.iterdir()) < 4e6


def test_the_shipped_recordings_are_measured_and_without_a_finding():
    ingested = ingest_batch(SHIPPED)
    assert ingested.findings == []
    conditions = {(round(r.excitation["frequency_Hz"], 1), r.excitation["load_level"]) for r in ingested.recordings}
    assert conditions == {(f, level) for f in (0.1, 0.2, 0.3, 0.4, 0.5) for level in (0.1, 0.2, 0.3, 0.4)}
    for recording in ingested.recordings:
        assert recording.origin == "rig"
        assert recording.time_s[-1] > 19 and np.median(np.diff(recording.time_s)) == pytest.approx(1e-3)
        assert set(recording.channels) == {
            "theta_in_rad",
            "theta_out_rad",
            "tau_in_Nm",
            "tau_out_Nm",
            "theta_motor_rad",
        }


@pytest.mark.skipif(DATA is None, reason=WHY_NO_DATA)
def test_the_shipped_recordings_are_those_of_the_data_set(tmp_path):
    (trial_file,) = Path(DATA).rglob("Tool_4_Maryland_L_2/00.TXT")
    import_batch(trial_file.parent, tmp_path / "da-vinci")
    assert sorted(p.name for p in (tmp_path / "da-vinci").iterdir()) == sorted(p.name for p in SHIPPED.iterdir())
    for file in SHIPPED.iterdir():
        made = tmp_path / "da-vinci" / file.name
        if file.suffix == ".gz":  # not the compressed bytes: they depend on the version of zlib
            assert gzip.decompress(made.read_bytes()) == gzip.decompress(file.read_bytes()), file.name
        else:
            assert made.read_bytes() == file.read_bytes(), file.name


def test_signs_in_doubt_are_findings(tmp_path):
    samples = trial()
    samples[:, 5] = np.random.default_rng(0).normal(0, 10, len(samples)).round()
    write(tmp_path / "tool", "00.TXT", text(samples))
    (finding,) = import_mis_tool(tmp_path / "tool", tmp_path / "raw").findings
    assert "sign of the load torque is in doubt" in finding.text


def test_names_that_collide(tmp_path):
    for folder in ("a/tool", "b/tool"):
        for name in ("1 2.TXT", "1-2.TXT"):
            write(tmp_path / "data" / folder, name, text(trial()))
    imported = import_mis_tool(tmp_path / "data", tmp_path / "raw")
    assert [b.name for b in imported.batches] == ["tool", "tool-2"]
    assert [r.id for r in ingest_batch(imported.batches[1]).recordings] == ["trial-1-2", "trial-1-2-2"]


def test_the_same_source_gives_the_same_files(tmp_path):
    write(tmp_path / "tool", "00.TXT", text(trial()))
    one, two = (import_mis_tool(tmp_path / "tool", tmp_path / name).batches[0] for name in ("x", "y"))
    for file in one.iterdir():
        assert file.read_bytes() == (two / file.name).read_bytes()


def test_nothing_to_import(tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        import_mis_tool(tmp_path / "nowhere", tmp_path / "raw")
    with pytest.raises(InputError, match="no trial found in 0"):
        import_mis_tool(tmp_path, tmp_path / "raw")


def check_real_trial(source, out, frequency, level):
    imported = import_mis_tool(source, out)
    assert imported.findings == []
    ingested = ingest_batch(imported.batches[0])
    assert ingested.findings == []
    rig = ingested.batch.rig
    assert (rig.load.encoder_sign, rig.drive.torque_sign, rig.load.torque_sign) == (-1, -1, 1)
    (recording,) = ingested.recordings
    assert recording.excitation["frequency_Hz"] == pytest.approx(frequency, abs=0.002)
    assert recording.excitation["load_level"] == level
    assert np.corrcoef(recording["theta_in_rad"], recording["theta_out_rad"])[0, 1] > 0.9


def test_a_real_trial(tmp_path):
    write(tmp_path / "tool", "113.TXT", lzma.decompress(EXCERPT.read_bytes()).decode())
    check_real_trial(tmp_path / "tool", tmp_path / "raw", 0.5, 0.8)


@pytest.mark.skipif(DATA is None, reason=WHY_NO_DATA)
@pytest.mark.parametrize(
    ("folder", "name", "frequency", "level"),
    [
        ("Tool_4_Maryland_L_2", "21", 0.3, 0.2),
        ("Tool_4_Maryland_L_Pitch_1", "113", 0.5, 0.8),
        ("Tool_4_Maryland_L_Pitch_3", "002", 0.3, 0.6),
    ],
)
def test_whole_real_trials(tmp_path, folder, name, frequency, level):
    (file,) = Path(DATA).rglob(f"{folder}/{name}.TXT")
    write(tmp_path / folder, file.name, file.read_text())
    check_real_trial(tmp_path / folder, tmp_path / "raw", frequency, level)
