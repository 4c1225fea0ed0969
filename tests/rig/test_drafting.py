import gzip
import os
import re

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from ccmodel.cli import app
from ccmodel.model.model_input import ModelInput
from ccmodel.rig.batch import load_batch
from ccmodel.rig.drafting import draft_and_refuse
from ccmodel.rig.importing.sources import names_of
from ccmodel.rig.ingest import ingest_batch
from ccmodel.sentences import controls_in
from ccmodel.typed import InputError

STEP = 2 * np.pi / 4096


def draft_batch(folder):
    """The file that is drafted."""
    return draft_and_refuse(folder)[0]


# What a person fills in, by key, wherever it is empty.
KNOWN = {
    "pulley_radius_m": 0.006,
    "encoder_counts_per_rev": 4096,
    "torque_constant_Nm_per_A": 0.0234,
    "sensitivity_V_per_N": 0.1,
    "zero_V": 0.25,
    "spring_stiffness_Nm_per_rad": 0.05,
    "stiffness_N_per_m": 13880,
    "friction_coefficient": 0.15,
    "encoder_rad": 0.0015,
    "torque_Nm": 0.0001,
    "load_cell_N": 0.1,
    "pretension_N": 5,
    "bend_rad": 3.1416,
    "length_m": 1.2,
}


def physical(pretension=5.0, amplitude=0.6, frequency=0.5, noise=0.02, seed=0, step=STEP):
    random, time = np.random.default_rng(seed), np.arange(0, 9, 0.004)
    theta = amplitude * np.sin(2 * np.pi * frequency * np.maximum(time - 1, 0))
    table = {"time_s": time, "theta_in_rad": 1.3 + theta, "theta_out_rad": -0.2 + 0.8 * theta}
    if step:
        for angle in ("theta_in_rad", "theta_out_rad"):
            table[angle] = np.round(table[angle] / step) * step
    table["tau_in_Nm"] = 0.05 * theta + random.normal(0, 1e-4, time.size)
    for end in ("drive", "load"):
        table[f"F_{end}_N"] = 2 * pretension + 0.3 * abs(theta) + random.normal(0, noise, time.size)
    return pd.DataFrame(table).round(7)


def run(seed):
    """A run of its own: no two have the same angles."""
    return physical(seed=seed, amplitude=0.6 + 0.004 * seed)


def raw(seed=0):
    table = run(seed)
    return pd.DataFrame(
        {
            "time_s": table.time_s,
            "drive_encoder_counts": (table.theta_in_rad / STEP).round(),
            "load_encoder_counts": (table.theta_out_rad / STEP).round(),
            "drive_current_A": (table.tau_in_Nm / 0.0234).round(5),
            "drive_load_cell_V": (0.25 + 0.1 * table.F_drive_N).round(4),
        }
    )


def folder_of(tmp_path, tables, name="lab"):
    folder = tmp_path / name
    folder.mkdir()
    for file, table in tables.items():
        table.to_csv(folder / file, index=False)
    return folder


def without_comments(text):
    return [line for line in text.splitlines() if not line.lstrip().startswith("#")]


def fill_in(path):
    text = path.read_text()
    for key, value in KNOWN.items():
        text = re.sub(rf"(\b{key}:)(?= *(?:[,}}]|#|$))", rf"\1 {value}", text, flags=re.MULTILINE)
    path.write_text(text)


@pytest.mark.parametrize("make", [run, raw])
def test_six_recordings_are_drafted_filled_in_and_modelled(tmp_path, make):
    folder = folder_of(tmp_path, {f"run-{i}.csv.gz": make(i) for i in range(6)})
    path = draft_batch(folder)
    assert path == folder / "batch.yaml"
    assert len(without_comments(path.read_text())) < 45
    with pytest.raises(InputError) as raised:
        load_batch(folder)
    assert all(": fill in " in problem.text for problem in raised.value.problems)
    assert len({problem.text for problem in raised.value.problems}) == len(raised.value.problems)
    fill_in(path)
    ingested = ingest_batch(folder)
    assert ingested.findings == []
    assert [r.id for r in ingested.recordings] == [f"run-{i}" for i in range(6)]
    recording = ingested.recordings[0]
    assert recording.pretension_N == pytest.approx(5, rel=0.01)
    assert recording.encoder_step_rad == pytest.approx({"theta_in_rad": STEP, "theta_out_rad": STEP})
    assert recording.excitation["wave"] == "sine"
    assert recording.excitation["frequency_Hz"] == 0.5
    assert recording.rest_s == pytest.approx(1, abs=0.02)
    given = ModelInput.of(recording)
    assert np.abs(given.theta_in).max() == pytest.approx(0.6, rel=0.01)


def test_what_the_logs_show_is_stated_with_its_source(tmp_path):
    folder = folder_of(
        tmp_path, {"slow.csv": physical(frequency=0.25), "fast.csv": physical(frequency=1.0, amplitude=0.3)}
    )
    text = draft_batch(folder).read_text()
    assert "batch: lab\n" in text
    assert f"angle_resolution_rad: {STEP:.10g}  # smallest step seen: 4096 in a revolution" in text
    assert "pretension_N: 5  # half the sum of tensions at rest" in text
    assert re.search(r"torque_Nm: (9|0\.0001|9\.\d+e-05).*# the noise seen at rest", text)
    assert re.search(r"load_cell_N: 0\.0[12]\d*  # the noise seen at rest, standard deviation, N", text)
    assert re.search(r"encoder_rad: 0\.00153  # the smallest step seen, rad", text)
    assert "encoder_counts_per_rev" not in text and "load_cell:" not in text and "torque_constant" not in text
    fast, slow = (line for line in text.splitlines() if line.startswith("- {"))
    assert "excitation: {wave: sine, frequency_Hz: 1}}" in fast
    assert "excitation: {wave: sine, frequency_Hz: 0.25}}  # 250 Hz, 9 s, rest 1 s, stroke 1.2" in slow
    assert "2.0 cycles of 0.25 Hz" in slow


def test_pretensions_that_differ_stand_in_their_entries(tmp_path):
    tables = {f"{t}N.csv": physical(pretension=t) for t in (3, 10)}
    path = draft_batch(folder_of(tmp_path, tables))
    fill_in(path)
    found = {entry.id: entry.pretension_N for entry in load_batch(path.parent).recordings}
    assert found == {"3N": pytest.approx(3, rel=0.01), "10N": pytest.approx(10, rel=0.01)}
    # In the order of counting, and not of letters.
    assert list(found) == ["3N", "10N"]


def test_tensions_give_the_pretension(tmp_path):
    table = physical(pretension=4).drop(columns=["F_drive_N", "F_load_N"])
    noise = np.random.default_rng(0).normal(0, 0.02, (len(table), 2))
    table["T1_N"], table["T3_N"] = 4 + table.tau_in_Nm / 0.012 + noise[:, 0], 4 - table.tau_in_Nm / 0.012 + noise[:, 1]
    text = draft_batch(folder_of(tmp_path, {"a.csv": table})).read_text()
    assert "  pretension_N: 4  # half the sum" in text
    assert "load_cell_N: 0.0" in text


def test_a_negative_pretension_is_not_proposed(tmp_path):
    tables = {"a.csv": physical(), "b.csv": physical().assign(F_drive_N=-10.0, F_load_N=-10.0)}
    text = draft_batch(folder_of(tmp_path, tables)).read_text()
    assert (
        "  pretension_N:  # N; half the sum of tensions at rest is -5 N: is a load cell's sign or zero wrong?" in text
    )
    assert text.count("pretension_N") == 1


def test_an_angle_without_a_step_is_said_to_have_none(tmp_path):
    table = physical(step=None)
    table["theta_in_rad"] += np.random.default_rng(0).normal(0, 1e-3, len(table)).round(4)
    path = draft_batch(folder_of(tmp_path, {"a.csv": table}))
    assert path.read_text().count("angle_resolution_rad: 0  # no step seen") == 2
    fill_in(path)
    (recording,) = ingest_batch(path.parent).recordings
    assert recording.encoder_step_rad == {}
    assert recording.rest_s == pytest.approx(1, abs=0.03)


def test_a_motion_that_is_no_wave_has_no_excitation(tmp_path):
    table = physical()
    table["theta_in_rad"] = np.round(np.minimum(table.time_s, 4) ** 2 / 20 / STEP) * STEP
    text = draft_batch(folder_of(tmp_path, {"a.csv": table})).read_text()
    assert "- {id: a, file: a.csv}  # 250 Hz" in text


def test_an_existing_description_is_kept(tmp_path):
    folder = folder_of(tmp_path, {"a.csv": physical()})
    (folder / "batch.yaml").write_text("mine")
    with pytest.raises(InputError, match=r"batch\.yaml: is there already and is kept"):
        draft_batch(folder)
    assert (folder / "batch.yaml").read_text() == "mine"


def test_logs_that_cannot_be_read_are_left_out_with_the_reason(tmp_path):
    folder = folder_of(tmp_path, {"a.csv": physical(), "b.csv": physical().drop(columns="theta_in_rad")})
    (folder / "notes.md").write_text("no log")
    (folder / "map.yaml").write_text("a: 1\n")
    (folder / "import.json").write_text("{}")
    (folder / "logs").mkdir()
    (folder / "logs" / "a.csv.gz").write_bytes(gzip.compress((folder / "a.csv").read_bytes()))
    text = draft_batch(folder).read_text()
    assert "# not used: b.csv: row 1, drive_encoder_counts, this column, or theta_in_rad, is required" in text
    assert re.findall(r"\{id: (.*?), file: (.*?)[,}]", text) == [("a", "a.csv"), ("a-2", "logs/a.csv.gz")]
    assert len([line for line in text.splitlines() if "map.yaml" in line or "notes" in line]) == 0


@pytest.mark.parametrize(
    ("files", "name", "text"),
    [
        ({}, "lab", "has no logs"),
        ({"a.csv": "time_s,x\n1,2\n"}, "lab", "is required and missing"),
        ({"a.csv": "time_s,x\n1,2\n"}, "my lab", "cannot be a batch's name"),
        (None, "lab", "there is no such folder"),
    ],
)
def test_a_folder_that_cannot_be_a_batch(tmp_path, files, name, text):
    folder = tmp_path / name
    if files is not None:
        folder.mkdir()
        for file, content in files.items():
            (folder / file).write_text(content)
    with pytest.raises(InputError, match=text):
        draft_batch(folder)
    assert not (folder / "batch.yaml").exists()


def test_names_that_yaml_would_take_for_numbers_stay_text(tmp_path):
    path = draft_batch(
        folder_of(tmp_path, {"007.csv": physical(), "1e5.csv": physical(), "run (2).csv": physical()}, "12")
    )
    fill_in(path)
    batch = load_batch(path.parent)
    assert batch.batch == "12"
    assert [(r.id, r.file) for r in batch.recordings] == [
        ("1e5", "1e5.csv"),
        ("007", "007.csv"),
        ("run-2", "run (2).csv"),
    ]


def test_the_command_says_what_to_fill_in(tmp_path):
    folder = folder_of(tmp_path, {"a.csv": physical()})
    result = CliRunner().invoke(app, ["init", str(folder)])
    assert result.exit_code == 0
    first, *rest = result.output.splitlines()
    assert first == f"{folder / 'batch.yaml'}: fill in what is empty, then run: ccmodel check {folder}"
    assert "rig.drive.pulley_radius_m: fill in the radius of the drive pulley, m" in rest[0]
    checked = CliRunner().invoke(app, ["check", str(folder)])
    assert checked.exit_code == 1
    assert all(line.split(": ", 2)[2] in checked.output.replace("\n", "") for line in rest)


@pytest.mark.parametrize("scale", [1e3, 1.0])
def test_a_log_that_cannot_be_read_is_named_with_its_place(tmp_path, scale):
    gap = run(1)
    gap.loc[1000:, "time_s"] += 0.5
    damaged = {1e3: run(1).assign(time_s=lambda t: scale * t.time_s), 1.0: gap}[scale]
    draft_batch(folder_of(tmp_path, {"good.csv": run(0), "bad.csv": damaged}))
    (said,) = [line for line in (tmp_path / "lab/batch.yaml").read_text().splitlines() if "not used" in line]
    assert said.startswith("# not used: bad.csv: row ")
    (tmp_path / "lab/batch.yaml").unlink()
    ended = CliRunner().invoke(app, ["init", str(tmp_path / "lab")])
    assert ended.exit_code == 1
    assert f"refused: {tmp_path}/lab/bad.csv: row " in ended.output.replace("\n", "")
    assert ("are the times in ms?" if scale > 1 else "too long to be bridged") in said


def test_a_log_whose_angle_stands_still_hides_no_step(tmp_path):
    still = run(1).assign(theta_out_rad=0.2)
    draft_batch(folder_of(tmp_path, {"moves.csv": run(0), "stands.csv": still}))
    assert "angle_resolution_rad: 0 " not in (tmp_path / "lab/batch.yaml").read_text()


def test_a_name_with_a_raised_digit_is_a_name(tmp_path):
    draft_batch(folder_of(tmp_path, {"1²2.csv": run(0)}))
    assert "file: " in (tmp_path / "lab/batch.yaml").read_text()


@pytest.mark.parametrize("name", ["z\nnote: EVIL\n#.csv", "\x1b]0;evil\x07.csv", os.fsdecode(b"Pr\xfcf.csv")])
def test_a_log_whose_name_does_not_show_is_refused(tmp_path, name):
    (tmp_path / name).write_text("time_s\n0\n")
    with pytest.raises(InputError) as refused:
        draft_batch(tmp_path)
    assert str(refused.value).isprintable()
    assert "has characters that do not show; rename the log" in str(refused.value)
    assert not (tmp_path / "batch.yaml").exists()
    with pytest.raises(InputError, match="has characters that do not show; rename the file"):
        names_of([tmp_path / name])


def test_a_wide_or_fixed_space_is_a_name():
    assert not controls_in("run\u00a01\u3000Prüf.csv")
