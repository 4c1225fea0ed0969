"""From a lab's folder to a batch by the command line."""

import sys

import numpy as np
import pytest
from made_up_lab import recording, write_text

from ccmodel import cli


@pytest.fixture
def run(monkeypatch, capsys):
    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["ccmodel", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code, *capsys.readouterr()

    return call


def lab(folder):
    for seed, name in enumerate(("slow", "fast")):
        r = recording(seed)
        columns = {
            "Zeit [ms]": 1e3 * r["time_s"],
            "Motor [deg]": np.rad2deg(r["theta_in_rad"]),
            "F_an [N]": r["F_drive_N"],
        }
        write_text(folder / f"{name}.txt", {**columns, "F2 [kN]": r["F_load_N"]}, separator="\t")
    return sorted(folder.iterdir())


def test_guess_import_check(tmp_path, run):
    files, batch = lab(tmp_path / "lab"), tmp_path / "batch"
    code, out, err = run("import", *files, "--out", batch)
    assert (code, err) == (0, "")
    assert "theta_in_rad" in out
    command = out.splitlines()[-1]
    assert f"--map {batch}/map.yaml --out {batch}" in command
    assert "because they are uncertain: " in command
    code, out, err = run("import", *files, "--map", batch / "map.yaml", "--out", batch)
    assert (code, err) == (0, "")
    assert "fast" in out and "500 Hz" in out and f"ccmodel check {batch}" in out
    assert (batch / "batch.yaml").exists()
    code, out, err = run("check", batch)
    assert code == 1
    assert "rig.drive.pulley_radius_m" in err


def test_every_file_that_cannot_be_read_is_one_line(tmp_path, run):
    files = lab(tmp_path / "lab")
    files[0].write_bytes(b"")
    files[1].write_bytes(b"PAR1 and no more")
    code, out, err = run("import", *files, "--out", tmp_path / "batch")
    assert (code, out) == (2, "")
    assert [line[:8] for line in err.splitlines()] == ["fast.txt", "slow.txt"]
    assert not (tmp_path / "batch").exists()


def test_a_file_whose_columns_cannot_be_joined_is_one_line(tmp_path, run):
    files, batch = lab(tmp_path / "lab"), tmp_path / "batch"
    assert run("import", *files, "--out", batch)[0] == 0
    text = files[0].read_text(encoding="utf-8").splitlines()
    without = ["\t".join([*line.split("\t")[:2], "", line.split("\t")[3]]) for line in text[6:]]
    files[0].write_text("\n".join([*text[:6], *without]) + "\n", encoding="utf-8")
    _, _, err = run("import", *files, "--map", batch / "map.yaml", "--out", batch)
    (line,) = [line for line in err.splitlines() if "has 5 numbers only" in line]
    assert line.startswith("fast.txt") and "take F_drive_N out of the map" in line
    assert "Traceback" not in err
