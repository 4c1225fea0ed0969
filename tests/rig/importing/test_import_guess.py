"""The guess on the headers of labs, all made up."""

import numpy as np
import pytest
from made_up_lab import counts, recording, write_text

from ccmodel.rig.importing import import_files, shapes, write_guess
from ccmodel.rig.importing.map import load_map
from ccmodel.typed import InputError

R = recording()
T, DEG, KT = R["time_s"], 180 / np.pi, 0.0234


def guess(tmp_path, columns, **layout):
    """Lines of the guess that are sure (sign and signal by column), and those that are not."""
    write_text(tmp_path / "lab/run.csv", columns, **layout)
    guessed = write_guess([tmp_path / "lab/run.csv"], tmp_path / "batch").guessed["main"]
    sure = {g.column: (g.sign * 1, g.signal, g.unit) for g in guessed.guesses if g.column and g.sure}
    open_ = {g.column: (g.sign, g.signal, g.unit) for g in guessed.guesses if g.column and not g.sure}
    return guessed, sure, open_


def imported(tmp_path):
    return import_files([tmp_path / "lab/run.csv"], tmp_path / "batch/map.yaml", tmp_path / "batch").recordings["run"]


def test_a_german_lab(tmp_path):
    columns = {
        "Zeit [ms]": 1e3 * T,
        "Antriebswinkel [°]": DEG * R["theta_in_rad"],
        "Abtriebswinkel [°]": -DEG * R["theta_out_rad"],
        "Antriebsmoment [mNm]": -1e3 * R["tau_in_Nm"],
        "Abtriebsmoment [mNm]": 1e3 * R["tau_out_Nm"],
        "Kraftsumme Antrieb [N]": R["F_drive_N"],
        "Sollwinkel [°]": DEG * R["theta_in_rad"],
    }
    layout = {"separator": ";", "decimal": ",", "encoding": "cp1252", "head": ["Prüfstand 3", "Datum: 1.2.2024"]}
    guessed, sure, open_ = guess(tmp_path, columns, **layout)
    assert (guessed.time.signal, guessed.time.unit, guessed.time_is_sure) == ("Zeit", "ms", True)
    assert guessed.time_why.endswith("; the file states ms")
    assert sure == {
        "theta_in_rad": (1, "Antriebswinkel", "°"),
        "theta_out_rad": (-1, "Abtriebswinkel", "°"),
        "tau_in_Nm": (-1, "Antriebsmoment", "mNm"),
        "tau_out_Nm": (1, "Abtriebsmoment", "mNm"),
        "F_drive_N": (1, "Kraftsumme Antrieb", "N"),
    }
    assert open_ == {}
    table = imported(tmp_path).table
    for column in sure:
        assert table[column].to_numpy() == pytest.approx(R[column], abs=1e-9), column


def test_an_english_lab_of_encoders_currents_and_load_cells(tmp_path):
    columns = {
        "timestamp_us": 1e6 * T,
        "enc_motor": counts(R["theta_in_rad"]),
        "enc_load": counts(R["theta_out_rad"]),
        "motor_current_A": R["tau_in_Nm"] / KT,
        "loadcell_prox_V": 0.1 * R["F_drive_N"] + 0.25,
        "loadcell_dist_V": 0.1 * R["F_load_N"] + 0.25,
        "motor_pos_cmd": R["theta_in_rad"],
    }
    guessed, sure, open_ = guess(tmp_path, columns, separator="\t")
    assert guessed.time.unit == "us"
    assert sure == {
        "drive_encoder_counts": (1, "enc_motor", "count"),
        "load_encoder_counts": (1, "enc_load", "count"),
        "drive_current_A": (1, "motor_current_A", "A"),
        "drive_load_cell_V": (1, "loadcell_prox_V", "V"),
        "load_load_cell_V": (1, "loadcell_dist_V", "V"),
    }
    assert open_ == {}
    said = " ".join(guessed.open)
    assert "torque constant of the drive motor" in said
    assert "sensitivity and zero of the load load cell" in said
    assert "stiffness of the load's spring" in said


def test_a_lab_with_the_papers_tensions(tmp_path):
    columns = {
        "Time (s)": T,
        "Input Angle (deg)": DEG * R["theta_in_rad"],
        "Output Angle (deg)": DEG * R["theta_out_rad"],
        **{f"T{n} (N)": R[f"T{n}_N"] for n in (1, 2, 3, 4)},
    }
    _, sure, _ = guess(tmp_path, columns)
    assert {c: s[1] for c, s in sure.items() if c.startswith("T")} == {f"T{n}_N": f"T{n}" for n in (1, 2, 3, 4)}


def test_tensions_that_are_numbered_otherwise_are_not_sure(tmp_path):
    columns = {
        "Time (s)": T,
        "Input Angle (deg)": DEG * R["theta_in_rad"],
        **{f"T{n} (N)": R[f"T{m}_N"] for n, m in ((1, 1), (2, 3), (3, 2), (4, 4))},
    }
    guessed, sure, open_ = guess(tmp_path, columns)
    assert set(sure) == {"theta_in_rad"}
    assert set(open_) == {"T1_N", "T2_N", "T3_N", "T4_N"}
    assert any("tension 1 moves like 3, and not like 2" in " ".join(g.why) for g in guessed.guesses)


def test_a_lab_without_units_is_left_to_the_person(tmp_path):
    columns = {"t": T, "q_m": R["theta_in_rad"], "q_l": R["theta_out_rad"], "tau_m": R["tau_in_Nm"]}
    guessed, sure, open_ = guess(tmp_path, columns)
    assert sure == {}
    assert (guessed.time.signal, guessed.time.unit, guessed.time_is_sure) == ("t", "s", True)
    assert "500 Hz in s" in guessed.time_why
    assert {column: signal for column, (_, signal, _) in open_.items()} == {
        "theta_in_rad": "q_m",
        "theta_out_rad": "q_l",
        "tau_in_Nm": "tau_m",
    }
    with pytest.raises(InputError, match="the drive angle is missing"):
        imported(tmp_path)
    text = (tmp_path / "batch/map.yaml").read_text()
    (tmp_path / "batch/map.yaml").write_text(text.replace("\n  # ", "\n  "))
    assert imported(tmp_path).table["theta_in_rad"].to_numpy() == pytest.approx(R["theta_in_rad"])


def test_a_lab_that_numbers_its_sensors(tmp_path):
    """The ends are seen by the lag only, so that nothing is sure."""
    columns = {
        "Time [s]": T,
        "Encoder1 [counts]": counts(R["theta_out_rad"]),
        "Encoder2 [counts]": counts(R["theta_in_rad"]),
        "Force1 [lbf]": R["F_drive_N"],
        "Force2 [lbf]": R["F_load_N"],
    }
    _, sure, open_ = guess(tmp_path, columns)
    assert sure == {}
    assert open_["drive_encoder_counts"][1] == "Encoder2"
    assert open_["load_encoder_counts"][1] == "Encoder1"
    assert {open_[c][1] for c in ("F_drive_N", "F_load_N")} == {"Force1", "Force2"}


def test_a_lab_of_bare_channels(tmp_path):
    columns = {
        "sample": np.arange(T.size),
        "a0": R["F_drive_N"],
        "a1": DEG * R["theta_out_rad"],
        "a2": DEG * R["theta_in_rad"],
    }
    guessed, sure, open_ = guess(tmp_path, columns, separator=" ")
    assert (guessed.time, sure) == (None, {})
    assert "rate_Hz" in guessed.time_why
    assert {c: s[1] for c, s in open_.items()} == {"theta_in_rad": "a2", "theta_out_rad": "a1"}


def test_a_lab_of_weights_and_pulling_cells_with_the_wrong_sign(tmp_path):
    columns = {
        "time [s]": T,
        "actuator position [rad]": R["theta_in_rad"],
        "tip angle [rad]": R["theta_out_rad"],
        "Kraft Motor [N]": -R["F_drive_N"],
        "tendon force distal [g]": R["F_load_N"] * 1e3 / 9.80665,
    }
    guessed, sure, open_ = guess(tmp_path, columns)
    assert sure["F_drive_N"] == (-1, "Kraft Motor", "N")
    assert open_ == {"F_load_N": (1, "tendon force distal", "gf")}
    assert "g is a mass" in " ".join(next(g for g in guessed.guesses if g.column == "F_load_N").why)


def test_two_signals_that_may_be_one_column_are_both_left_open(tmp_path):
    columns = {
        "time [s]": T,
        "motor angle [deg]": DEG * R["theta_in_rad"],
        "input angle [deg]": DEG * R["theta_in_rad"],
    }
    guessed, sure, _ = guess(tmp_path, columns)
    assert sure == {}
    assert "'input angle' may be" in " ".join(guessed.guesses[0].why)


def test_counts_win_over_an_angle_that_is_made_from_them(tmp_path):
    columns = {
        "time [s]": T,
        "motor angle [deg]": DEG * R["theta_in_rad"],
        "motor encoder [counts]": counts(R["theta_in_rad"]),
    }
    _, sure, open_ = guess(tmp_path, columns)
    assert set(sure) == {"drive_encoder_counts"}
    assert set(open_) == {"theta_in_rad"}


def test_a_unit_that_cannot_be_is_doubted(tmp_path):
    columns = {"time [s]": T, "motor angle [rad]": DEG * R["theta_in_rad"] * 3}
    guessed, sure, _ = guess(tmp_path, columns)
    assert sure == {}
    assert "in rad it would turn" in " ".join(guessed.guesses[0].why)


@pytest.mark.parametrize(("scale", "unit"), [(1, "s"), (1e3, "ms"), (1e6, "us")])
def test_the_unit_of_time_follows_from_the_rate(tmp_path, scale, unit):
    guessed, _, _ = guess(tmp_path, {"time": scale * T, "motor angle [rad]": R["theta_in_rad"]})
    assert (guessed.time.unit, guessed.time_is_sure) == (unit, True)


def test_a_rate_that_may_be_in_two_units_is_left_open(tmp_path):
    """10 000 steps of 0.1: 1000 s at 10 Hz, or 1 s at 10 kHz."""
    r = recording(seconds=20)
    guessed, _, _ = guess(tmp_path, {"time": 50 * r["time_s"], "motor angle [rad]": r["theta_in_rad"]})
    assert not guessed.time_is_sure
    assert "a step of 0.1 may be in s or ms: state the unit" in guessed.time_why


def test_names_that_yaml_would_not_read_as_text(tmp_path):
    columns = {"time [s]": T, "motor: angle, {x #1} [rad]": R["theta_in_rad"], "yes [N]": R["F_drive_N"]}
    write_text(tmp_path / "lab/run.csv", columns, separator="\t")
    guessed = write_guess([tmp_path / "lab/run.csv"], tmp_path / "batch")
    stated = load_map(guessed.file)
    assert stated.channels["theta_in_rad"].signal == guessed.guessed["main"].guesses[0].signal


def test_further_files_of_a_recording_are_seen_by_their_names(tmp_path):
    r = R
    for name in ("sine", "step"):
        write_text(tmp_path / f"lab/{name}_drive.csv", {"t [s]": T, "motor angle [rad]": r["theta_in_rad"]})
        load = {"t [ms]": 1e3 * T[::2], "load angle [deg]": DEG * r["theta_out_rad"][::2]}
        write_text(tmp_path / f"lab/{name}_load.csv", load)
    files = sorted((tmp_path / "lab").iterdir())
    write_guess(files, tmp_path / "batch")
    written = import_files(files, tmp_path / "batch/map.yaml", tmp_path / "batch")
    assert list(written.recordings) == ["sine", "step"]
    table = written.recordings["sine"].table
    assert table["theta_out_rad"].to_numpy() == pytest.approx(r["theta_out_rad"][: len(table)], abs=2e-3)


@pytest.mark.parametrize("every", [1, 2])
def test_a_file_with_a_time_of_each_end_gives_each_signal_its_own(tmp_path, every):
    """By the end that both are called by; with a step of 2 the load also has fewer samples than the first time."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.h5", "w") as file:
        late = T[::every] + 0.25
        columns = {"time_drive": T, "angle_drive": R["theta_in_rad"], "time_load": late}
        columns["angle_load"] = np.interp(late, T, R["theta_out_rad"])
        for name, values in columns.items():
            file[name] = values
            file[name].attrs["units"] = "s" if name.startswith("time") else "rad"
    write_guess([tmp_path / "run.h5"], tmp_path / "batch")
    stated = load_map(tmp_path / "batch/map.yaml").channels
    assert stated["theta_in_rad"].time is None
    assert stated["theta_out_rad"].time.signal == "time_load"
    table = import_files([tmp_path / "run.h5"], tmp_path / "batch/map.yaml", tmp_path / "batch").recordings["run"].table
    real = np.interp(table["time_s"] + 0.25, T, R["theta_out_rad"])
    assert table["theta_out_rad"].to_numpy() == pytest.approx(real, abs=2e-3)


def two_files_with_a_copy(root, motion, late_s=0.35):
    """Recordings with the drive's counts in one file, and the load angle and a copy of the drive angle in another."""
    for name in ("sine", "step"):
        encoder = {"t [s]": T, "drive encoder": counts(motion(T), 100_000)}
        write_text(root / f"{name}_drive.csv", encoder)
        copy, load = DEG * motion(T + late_s), 0.9 * DEG * motion(T + late_s - 0.02)
        write_text(root / f"{name}_load.csv", {"t [s]": T, "Drive pos copy [deg]": copy, "load angle [deg]": load})
    return sorted(root.iterdir())


@pytest.mark.parametrize(("of_first", "sign"), [("drive", 1), ("load", -1)])
def test_a_copy_of_the_drive_angle_in_the_other_file_tells_its_clock(tmp_path, of_first, sign):
    """Both are surely the drive angle: the counts of the drive's own file are kept, whichever file comes first."""
    files = two_files_with_a_copy(tmp_path / "lab", lambda t: 0.5 * np.sin(2 * t + 0.3 * t**2))
    files.sort(key=lambda file: of_first not in file.name)
    guessed = write_guess(files, tmp_path / "batch").guessed
    sure = {g.column: role for role, one in guessed.items() for g in one.guesses if g.column and g.sure}
    assert sure == {"drive_encoder_counts": "drive", "theta_out_rad": "load"}
    text = (tmp_path / "batch/map.yaml").read_text()
    assert "# theta_in_rad: " in text and "the same quantity as 'drive encoder' of 'drive'" in text
    further, first = ("Drive pos copy", "drive encoder")[::sign]
    assert f"    clock: {{match: [{further}, {first}]}}" in text
    table = import_files(files, tmp_path / "batch/map.yaml", tmp_path / "batch").recordings["sine"].table
    drive = table["drive_encoder_counts"].to_numpy() * 2 * np.pi / 100_000
    late = np.interp(table["time_s"] - 0.02, table["time_s"], drive)
    assert table["theta_out_rad"].to_numpy()[50:] == pytest.approx(0.9 * late[50:], abs=3e-3)


def test_a_copy_that_repeats_tells_no_clock_and_is_not_used(tmp_path):
    files = two_files_with_a_copy(tmp_path / "lab", lambda t: 0.5 * np.sin(2 * np.pi * t))
    write_guess(files, tmp_path / "batch")
    text = (tmp_path / "batch/map.yaml").read_text()
    assert (
        "    # clock: {match: [Drive pos copy, drive encoder]}   # the same quantity in both, but the matched" in text
    )
    written = import_files(files, tmp_path / "batch/map.yaml", tmp_path / "batch")
    assert any("taken to start together" in remark for remark in written.recordings["sine"].remarks)


def test_files_that_do_not_belong_together_are_said(tmp_path):
    write_text(tmp_path / "lab/a.csv", {"t [s]": T, "motor angle [rad]": R["theta_in_rad"]})
    write_text(tmp_path / "lab/b.csv", {"t [s]": T, "temperature [s]": R["theta_in_rad"]})
    guessed = write_guess(sorted((tmp_path / "lab").iterdir()), tmp_path / "batch")
    assert any(remark.startswith("b.csv: other signals than a.csv") for remark in guessed.remarks)


def folders(root, files=("drive", "load")):
    """Recordings that are folders of two files with equal columns."""
    for name in ("sine", "step"):
        for file, end in zip(files, ("in", "out"), strict=True):
            columns = {"t_s": T, "angle_deg": DEG * R[f"theta_{end}_rad"], "torque_mNm": 1e3 * R[f"tau_{end}_Nm"]}
            write_text(root / f"{name}/{file}.csv", columns)
    return sorted(root.glob("*/*.csv"))


def test_folders_with_a_file_of_each_end_are_recordings(tmp_path):
    files = folders(tmp_path / "lab")
    write_guess(files, tmp_path / "batch")
    written = import_files(files, tmp_path / "batch/map.yaml", tmp_path / "batch")
    assert list(written.recordings) == ["sine", "step"]
    for column in ("theta_in_rad", "theta_out_rad", "tau_in_Nm", "tau_out_Nm"):
        assert written.recordings["sine"].table[column].to_numpy() == pytest.approx(R[column]), column


def test_one_folder_is_one_recording(tmp_path):
    files = folders(tmp_path / "lab")[:2]
    write_guess(files, tmp_path / "batch")
    written = import_files(files, tmp_path / "batch/map.yaml", tmp_path / "batch")
    assert list(written.recordings) == ["sine"]


def test_files_of_equal_signals_that_are_not_called_by_an_end_are_recordings(tmp_path):
    guessed = write_guess(folders(tmp_path / "lab", ("first", "second")), tmp_path / "batch")
    assert list(guessed.guessed) == ["main"]


def test_files_of_both_ends_that_cannot_be_paired_are_said(tmp_path):
    files = folders(tmp_path / "lab")[:3]
    guessed = write_guess(files, tmp_path / "batch")
    assert list(guessed.guessed) == ["main"]
    assert any("state by 'files' which is which" in remark for remark in guessed.remarks)


def test_names_that_end_with_a_prefixed_unit(tmp_path):
    columns = {
        "time_µs": 1e6 * T,
        "motor_angle_mrad": 1e3 * R["theta_in_rad"],
        "motor_current_mA": 1e3 * R["tau_in_Nm"] / KT,
        "load_torque_µNm": 1e6 * R["tau_out_Nm"],
        "F_drive_kN": 1e-3 * R["F_drive_N"],
        "loadForceN": R["F_load_N"],
    }
    guessed, sure, _ = guess(tmp_path, columns)
    assert guessed.time.unit == "µs"
    assert {column: unit for column, (_, _, unit) in sure.items()} == {
        "theta_in_rad": "mrad",
        "drive_current_A": "mA",
        "tau_out_Nm": "µNm",
        "F_drive_N": "kN",
        "F_load_N": "N",
    }


def test_a_unit_joined_to_a_word_that_may_be_its_prefix_is_left_open(tmp_path):
    """Motor strom A, or stro mA?"""
    columns = {"time [s]": T, "motor angle [rad]": R["theta_in_rad"], "MotorStromA": R["tau_in_Nm"] / KT}
    _, sure, open_ = guess(tmp_path, columns)
    assert set(sure) == {"theta_in_rad"}
    assert open_["drive_current_A"][1] == "MotorStromA"


def test_a_motor_at_the_load(tmp_path):
    """The group says the end where both ends have a motor; where a name says both ends, none is sure."""
    columns = {
        "time [s]": T,
        "Drive/Position [rad]": R["theta_in_rad"],
        "Load/Position [rad]": R["theta_out_rad"],
        "Drive/Motor current [A]": R["tau_in_Nm"] / KT,
        "Load/Motor current [A]": R["tau_out_Nm"] / KT,
        "load motor torque [Nm]": R["tau_out_Nm"],
    }
    _, sure, open_ = guess(tmp_path, columns)
    assert sure["drive_current_A"][1] == "Drive/Motor current"
    assert sure["load_current_A"][1] == "Load/Motor current"
    assert {signal for _, signal, _ in open_.values()} == {"load motor torque"}


def tensions_by_cable(first, second):
    columns = {"time [s]": T, "drive angle [rad]": R["theta_in_rad"], "load angle [rad]": R["theta_out_rad"]}
    columns |= {f"f{first}_drive [N]": R["T1_N"], f"f{second}_drive [N]": R["T3_N"]}
    return columns | {f"f{first}_load [N]": R["T2_N"], f"f{second}_load [N]": R["T4_N"]}


def test_forces_in_each_cable_are_tensions(tmp_path):
    _, sure, _ = guess(tmp_path, tensions_by_cable("A", "B"))
    tensions = {column: signal for column, (_, signal, _) in sure.items() if column.startswith("T")}
    assert tensions == {"T1_N": "fA_drive", "T2_N": "fA_load", "T3_N": "fB_drive", "T4_N": "fB_load"}


def test_cables_that_a_positive_angle_does_not_pull_are_not_sure(tmp_path):
    guessed, sure, open_ = guess(tmp_path, tensions_by_cable("B", "A"))
    assert set(sure) == {"theta_in_rad", "theta_out_rad"}
    assert set(open_) == {"T1_N", "T2_N", "T3_N", "T4_N"}
    assert any("which cable is A" in " ".join(g.why) for g in guessed.guesses)


def test_a_map_is_never_overwritten(tmp_path):
    guess(tmp_path, {"t [s]": T, "motor angle [rad]": R["theta_in_rad"]})
    with pytest.raises(InputError, match="there is a map; use it with --map"):
        write_guess([tmp_path / "lab/run.csv"], tmp_path / "batch")


def test_letters_and_words_of_two_meanings(tmp_path):
    """T is a torque by its unit; l is the load beside m only; load may be a force."""
    columns = {
        "t [s]": T,
        "q_m [rad]": R["theta_in_rad"],
        "q_l [rad]": R["theta_out_rad"],
        "T_in [Nm]": R["tau_in_Nm"],
        "Load [N]": R["F_drive_N"],
    }
    _, sure, open_ = guess(tmp_path, columns)
    assert {c: s[1] for c, s in sure.items()} == {"theta_in_rad": "q_m", "theta_out_rad": "q_l", "tau_in_Nm": "T_in"}
    assert {s[1] for s in open_.values()} == {"Load"}


def test_left_is_not_load(tmp_path):
    columns = {"t [s]": T, "motor angle [rad]": R["theta_in_rad"], "F_l [N]": R["F_drive_N"], "F_r [N]": R["F_load_N"]}
    _, sure, _ = guess(tmp_path, columns)
    assert set(sure) == {"theta_in_rad"}


def test_times_of_an_uneven_clock_are_still_times(tmp_path):
    steps = np.random.default_rng(0).choice([1, 2, 5], T.size)
    guessed, _, _ = guess(
        tmp_path, {"millis [ms]": np.cumsum(steps).astype(float), "motor angle [rad]": R["theta_in_rad"]}
    )
    assert (guessed.time.signal, guessed.time.unit) == ("millis", "ms")


def test_numbers_of_a_damaged_file_say_nothing_of_a_sign():
    angle, torque = np.resize([0.0, 1e308, -1e308], 30), np.resize([1e308, -1e308], 30)
    with np.errstate(all="ignore"):
        assert shapes.sign_of_drive_torque(angle, torque) is None
