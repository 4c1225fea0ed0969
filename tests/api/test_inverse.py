"""Estimates of the load and motions of the drive, as the interface and the command give them."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import ccmodel as cc
from ccmodel.cli import main


@pytest.fixture(scope="module")
def estimate(fitted, batch):
    return cc.estimate(fitted, batch)


def run(monkeypatch, capsys, *words):
    monkeypatch.setattr("sys.argv", ["ccmodel", *map(str, words)])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code, *capsys.readouterr()


def test_an_estimate_is_a_mapping_of_tables(estimate, batch):
    assert list(estimate) == [r.id for r in batch]
    assert len(estimate) == 3
    table = estimate["t-6N"]
    assert len(table) == batch["t-6N"].time_s.size
    assert list(table)[:3] == ["theta_out_rad", "theta_out_rad_low", "theta_out_rad_high"]
    assert estimate.left_out == () and estimate.notes == ()
    assert "3 recordings" in repr(estimate) and "theta_out_rad" in estimate._repr_html_()
    with pytest.raises(cc.InputError, match=r"no recording 't-6'; .*t-6N"):
        estimate["t-6"]


def test_errors_are_those_of_the_sensors_at_the_load(estimate, batch):
    assert set(estimate.errors["channel"]) == {"theta_out_rad", "tau_out_Nm"}
    row = estimate.errors.set_index(["recording", "channel"]).loc[("t-6N", "tau_out_Nm")]
    recorded, table = batch["t-6N"], estimate["t-6N"]
    judged = recorded.time_s >= max(recorded.rest_s, recorded.settled_s)
    error = (table["tau_out_Nm"].to_numpy() - recorded["tau_out_Nm"])[judged]
    assert row["bias"] == pytest.approx(error.mean(), rel=1e-9)
    assert row["rms"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-9)
    assert row["rms"] < 0.03 * np.ptp(recorded["tau_out_Nm"])
    assert 0.5 < row["share_within"] <= 1
    assert (estimate.visible_share.between(0.5, 0.95)).all()


def test_what_the_model_file_does_not_determine_is_said(fitted, batch):
    """And an interval of a fit to few recordings counts as wide as it is stated."""
    model = fitted.model
    stated = {name: dict(one) for name, one in model.intervals.items()}
    name = "stiffness_N_per_m"
    infinite = replace(model, intervals=stated | {name: dict.fromkeys(("low", "high", "sd"))})
    assert cc.estimate(infinite, batch).notes == (
        f"{name}: the model's interval is infinite, and its value is taken as exact",
    )
    middle, few = (stated[name]["low"] + stated[name]["high"]) / 2, 0.2 * stated[name]["high"]
    wide = replace(model, intervals=stated | {name: stated[name] | {"low": middle - few, "high": middle + few}})
    widths = [
        (table["tau_out_Nm_high"] - table["tau_out_Nm_low"]).mean()
        for table in (cc.estimate(one, batch)["t-6N"] for one in (model, wide))
    ]
    assert widths[1] > 1.005 * widths[0]


def test_an_estimate_is_written_as_the_command_writes_it(estimate, fitted, folder, tmp_path, monkeypatch, capsys):
    estimate.save(tmp_path / "mine")
    fitted.save(tmp_path / "fit.json")
    words = ["estimate", folder, "--model", tmp_path / "fit.json", "--out", tmp_path / "command", "--json"]
    code, out, _ = run(monkeypatch, capsys, *words)
    assert code == 0
    assert [row["recording"] for row in json.loads(out)["errors"]][::2] == list(estimate)
    for file in (tmp_path / "mine").iterdir():
        assert file.read_text() == (tmp_path / "command" / file.name).read_text()
    written = pd.read_csv(tmp_path / "mine/t-6N.csv")
    assert set(written["load_is_visible"]) == {0, 1}


def test_an_unknown_load_and_a_tolerance_change_the_estimate(estimate, fitted, batch):
    unknown = cc.estimate(fitted, batch, unknown_load=True)["t-6N"]
    wide = cc.estimate(fitted, batch, tolerance=0.05)["t-6N"]

    def width(table):
        return (table["tau_out_Nm_high"] - table["tau_out_Nm_low"]).median()

    assert width(unknown) > 1.2 * width(estimate["t-6N"])
    assert width(wide) > 1.5 * width(estimate["t-6N"])


def test_a_tolerance_of_the_angle_widens_its_interval_alone(estimate, fitted, batch):
    plain, wide = estimate["t-6N"], cc.estimate(fitted, batch, tolerance={"theta_out_rad": 0.01})["t-6N"]
    sd, own = ((t["theta_out_rad_high"] - t["theta_out_rad"]).iloc[-1] / 1.6449 for t in (wide, plain))
    assert sd**2 - own**2 == pytest.approx((0.01 * np.ptp(plain["theta_out_rad"])) ** 2, rel=1e-3)
    assert wide["tau_out_Nm_high"].equals(plain["tau_out_Nm_high"])


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({"tolerance": 0}, "tolerance: a share of peak to peak, above zero; got 0"),
        ({"tolerance": "2 %"}, "tolerance: .* got '2 %'"),
        ({"tolerance": {"tau_in_Nm": 0.01, "theta_out_rad": -1}}, "tolerance: .* got -1"),
        ({"tolerance": {"F_load_N": 0.01}}, "tolerance: an estimate has those of .* got 'F_load_N'"),
    ],
)
def test_options_of_an_estimate_that_cannot_be_used_are_named(fitted, batch, options, line):
    with pytest.raises(cc.InputError, match=line):
        cc.estimate(fitted, batch, **options)


def test_a_tolerance_of_another_channel_is_refused(fitted, folder, tmp_path, monkeypatch, capsys):
    fitted.save(tmp_path / "fit.json")
    words = ["estimate", folder, "--model", tmp_path / "fit.json", "--out", tmp_path / "out"]
    code, _, err = run(monkeypatch, capsys, *words, "--tolerance", "tau_out_Nm=0.02")
    assert (code, err) == (2, "--tolerance: an estimate has those of tau_in_Nm and theta_out_rad; got 'tau_out_Nm'\n")


@pytest.fixture(scope="module")
def wanted():
    time_s = np.arange(0, 3, 0.004)
    return pd.DataFrame({"time_s": time_s, "theta_out_rad": 0.3 * np.sin(np.pi * time_s) ** 2})


def test_a_compensation_is_a_motion_that_simulates_the_wanted_one(fitted, wanted, tmp_path):
    motion = cc.compensate(fitted, wanted, out=tmp_path / "deep/drive.csv")
    simulated = cc.simulate(fitted, tmp_path / "deep/drive.csv")
    assert np.abs(simulated["theta_out_rad"] - wanted["theta_out_rad"]).max() < 1e-6
    assert motion.lost_motion_rad < 1e-6 < 0.01 < motion.straight_lost_motion_rad
    said = repr(motion)
    assert "rms error of the load's angle, by the model: " in said and "lost motion" not in said
    assert said.index("mrad if the drive makes the wanted motion itself; drive speed up to") > 0


def test_limits_of_the_drive(fitted, wanted, tmp_path, monkeypatch, capsys):
    free, slow = (cc.compensate(fitted, wanted, max_speed_rad_per_s=v) for v in (None, 4.0))
    assert free.largest_speed_rad_per_s > 4.0
    assert slow.largest_speed_rad_per_s <= 4.0 * (1 + 1e-9)
    fitted.save(tmp_path / "fit.json")
    wanted.to_csv(tmp_path / "wanted.csv", index=False)
    words = ["compensate", tmp_path / "fit.json", "--wanted", tmp_path / "wanted.csv", "--out", tmp_path / "drive.csv"]
    code, out, _ = run(monkeypatch, capsys, *words, "--max-speed", "4", "--json")
    found = json.loads(out)
    assert code == 0
    assert found["lost_motion_rad"] == pytest.approx(slow.lost_motion_rad, rel=1e-6)
    assert found["samples"] == len(pd.read_csv(tmp_path / "drive.csv")) == len(wanted)


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({"max_acceleration_rad_per_s2": 5.0}, "max_acceleration_rad_per_s2: needs max_speed_rad_per_s too"),
        ({"max_speed_rad_per_s": -1.0}, "max_speed_rad_per_s: a speed, rad/s, above zero; got -1.0"),
        ({"max_speed_rad_per_s": float("nan")}, "max_speed_rad_per_s"),
        ({"pretension_N": -1}, "pretension_N"),
        ({"recording": "t-9N"}, "recording: the model knows t-7N"),
    ],
)
def test_options_of_a_compensation_that_cannot_be_used_are_named(fitted, wanted, options, line):
    with pytest.raises(cc.InputError, match=line):
        cc.compensate(fitted, wanted, **options)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda w: w.rename(columns={"theta_out_rad": "theta_in_rad"}), "wanted: no column theta_out_rad"),
        (lambda w: w.assign(theta_out_rad=0.2), "wanted: the wanted motion does not move"),
        (lambda w: w.assign(time_s=0.0), "wanted: row 1: time_s does not increase"),
        (lambda w: w.assign(theta_out_rad=np.nan), "wanted: row 0: theta_out_rad is empty"),
        (lambda w: None, "wanted: a DataFrame, a Dataset, a Recording or a CSV file; got None"),
    ],
)
def test_a_wanted_motion_that_cannot_be_used_is_named(fitted, wanted, change, line):
    with pytest.raises(cc.InputError, match=line):
        cc.compensate(fitted, change(wanted))


def test_a_model_without_a_load_law_is_refused(fitted, wanted):
    from dataclasses import replace

    unsprung = replace(fitted.model, parameters=replace(fitted.model.parameters, load_stiffness_Nm_per_rad=None))
    with pytest.raises(cc.InputError, match="the model has no law of its load"):
        cc.compensate(unsprung, wanted)
