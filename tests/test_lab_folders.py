"""The folders of made-up labs hold, in their own units and signs, what the virtual rig recorded."""

import json

import numpy as np
import pandas as pd
import pytest
import yaml

from benchmarks.lab_folders import CAMPAIGN, LABS, LOAD_CLOCK_AHEAD_S, read_runs, write_lab

NEEDS = {"mat-v73": "h5py", "hdf5": "h5py", "mdf4": "asammdf", "tdms": "nptdms", "ros1": "rosbags", "ros2": "rosbags"}
N, COUNTS, KT = 81, 4096, 0.0234


@pytest.fixture
def batch(tmp_path):
    """A batch of one recording, as the virtual rig writes it."""
    folder = tmp_path / "lab"
    folder.mkdir()
    wave = np.sin(np.linspace(0, 7, N))
    log = {"time_s": 0.001 * np.arange(N), "drive_encoder_counts": np.round(300 * wave).astype(int)}
    log |= {
        "load_encoder_counts": np.round(200 * wave).astype(int),
        "drive_current_A": wave,
        "load_current_A": wave / 2,
    }
    log |= {"drive_load_cell_V": 1.25 + 0 * wave, "load_load_cell_V": 1.05 + 0 * wave}
    pd.DataFrame(log).to_csv(folder / "one.csv.gz", index=False)
    side = {"pulley_radius_m": 0.006, "encoder_counts_per_rev": COUNTS, "torque_constant_Nm_per_A": KT}
    side["load_cell"] = {"sensitivity_V_per_N": 0.1, "zero_V": 0.25}
    rig = {"drive": side, "load": side | {"spring_stiffness_Nm_per_rad": 0.05}}
    rig["cable"] = {"stiffness_N_per_m": 13000, "length_m": 1.2, "friction_coefficient": 0.14}
    rig["accuracy"] = {"encoder_rad": 0.0015, "torque_Nm": 0.0001, "load_cell_N": 0.1}
    entry = {"id": "one", "file": "one.csv.gz", "pretension_N": 7.0, "excitation": {"wave": "sine"}}
    entry["conduit"] = [{"length_m": 1.2, "bend_rad": float(np.pi)}]
    (folder / "batch.yaml").write_text(yaml.safe_dump({"rig": rig, "recordings": [entry]}))
    return folder


@pytest.mark.parametrize("name", LABS)
def test_every_lab_writes_its_recording_and_what_it_knows(name, batch, tmp_path):
    if name in NEEDS:
        pytest.importorskip(NEEDS[name])
    folder = write_lab(name, read_runs(batch), tmp_path / "labs")
    (recording,) = [file for file in folder.iterdir() if file.name != "README.txt"]
    text = (folder / "README.txt").read_text()
    for known in ("diameter of\n12 mm", "0.05 N m/rad", "13 N/mm", "180 deg", "7 N", recording.name, "simulated"):
        assert known in text
    for concealed in ("friction torque", "pulley friction"):
        assert concealed not in text


def test_units_and_signs_are_the_labs_own(batch, tmp_path):
    (run,) = read_runs(batch)
    for name in ("csv-semicolon", "txt-tabs", "two-clocks"):
        write_lab(name, [run], tmp_path)
    german = pd.read_csv(
        tmp_path / "csv-semicolon/Messung_01.csv", sep=";", decimal=",", encoding="cp1252", skiprows=[1]
    )
    assert german["Zeit"].iloc[1] == 2.0
    assert german["Winkel Antrieb"].to_numpy() == pytest.approx(run.counts_in[::2] * 360 / COUNTS, abs=1e-4)
    assert german["Seilkräfte Abtrieb"].to_numpy() == pytest.approx(8.0)
    tabs = pd.read_csv(tmp_path / "txt-tabs/one.txt", sep="\t", skiprows=6)
    assert tabs["M2 [mNm]"].to_numpy() == pytest.approx(-1e3 * KT * run.current_out_A[::4], abs=1e-5)
    assert tabs["S1 [kgf]"].to_numpy() == pytest.approx(10 / 9.80665, abs=1e-5)
    drive, load = (pd.read_csv(tmp_path / f"two-clocks/one/{side}.csv") for side in ("drive", "load"))
    assert (len(drive), len(load)) == (N, N // 2)
    assert load["time_s"].iloc[0] == pytest.approx(0.001 + LOAD_CLOCK_AHEAD_S)


def test_tensions_of_the_cable_ends(batch):
    (run,) = read_runs(batch)
    t1, t2, t3, t4 = run.tensions_N
    assert (t1 - t3) * 0.006 == pytest.approx(KT * run.current_in_A)
    assert t2 + t4 == pytest.approx(8.0)


def test_the_concealed_effect_is_the_campaigns_only_one():
    effects = yaml.safe_load(CAMPAIGN.read_text())["rig"]["effects"]
    assert json.loads(json.dumps(effects)) == {
        "drive_pulley": {"friction": {"torque_Nm": 0.009, "presliding_rad": 0.002}}
    }
