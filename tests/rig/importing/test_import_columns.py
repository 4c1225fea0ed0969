"""Units, signs, gains and zeros of a map come back exactly."""

import numpy as np
import pytest
from made_up_lab import recording, write_text

from ccmodel.rig.importing import import_files
from ccmodel.rig.log import read_log

# Signal as the lab writes it from SI values; its line of the map.
LAB = {
    "theta_in_rad": (lambda v: np.rad2deg(v), "unit: deg"),
    "theta_out_rad": (lambda v: -v / (2 * np.pi), "unit: rev, sign: -1"),
    "tau_in_Nm": (lambda v: v / 0.0234 * 1e3, "unit: mA, gain: 0.0234 N*m/A"),
    "tau_out_Nm": (lambda v: -(v / (0.27801385095378125 * 0.0254)) + 4, "unit: ozf*in, sign: -1, zero: 4"),
    "F_drive_N": (lambda v: v / 9.80665, "unit: kgf"),
    "F_load_N": (lambda v: 250 + 1e3 * 0.1 * v, "unit: mV, zero: 250, gain: 10 N/V"),
    "T1_N": (lambda v: v / 4.4482216152605 / 2, "unit: lbf, gain: 2"),
}


def test_every_unit_sign_gain_and_zero(tmp_path):
    r = recording()
    columns = {"t": 1e3 * r["time_s"] + 5000} | {f"s_{name}": to_lab(r[name]) for name, (to_lab, _) in LAB.items()}
    log = write_text(tmp_path / "lab/run.csv", columns, separator=";", decimal=",")
    lines = [f"  {name}: {{signal: s_{name}, {line}}}" for name, (_, line) in LAB.items()]
    text = "\n".join(["format: 1", "time: {signal: t, unit: ms}", "channels:", *lines])
    (tmp_path / "map.yaml").write_text(text)
    import_files([log], tmp_path / "map.yaml", tmp_path / "batch")
    table, warnings = read_log(tmp_path / "batch/run.csv.gz")
    assert warnings == []
    assert list(table) == ["time_s", *LAB]
    assert table["time_s"].to_numpy() == pytest.approx(r["time_s"], abs=1e-9)
    for name in LAB:
        assert table[name].to_numpy() == pytest.approx(r[name], rel=1e-11, abs=1e-12), name


def test_a_fixed_rate_where_the_file_has_no_time(tmp_path):
    r = recording()
    log = write_text(tmp_path / "lab/run.csv", {"q": r["theta_in_rad"], "F": r["F_drive_N"]})
    text = "format: 1\ntime: {rate_Hz: 500}\nchannels: {theta_in_rad: {signal: q, unit: rad}}\n"
    (tmp_path / "map.yaml").write_text(text)
    built = import_files([log], tmp_path / "map.yaml", tmp_path / "batch").recordings["run"]
    assert built.table["time_s"].to_numpy() == pytest.approx(r["time_s"])
