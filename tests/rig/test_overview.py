from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from ccmodel.cli import app
from ccmodel.rig.ingest import ingest_batch
from ccmodel.rig.overview import _best_fit, motion_of, overview, overview_of

TIME = np.arange(0, 8, 0.004)
PHASE = 2 * np.pi * 0.5 * np.maximum(TIME - 1, 0)
SINE = 0.6 * np.sin(PHASE)
TRIANGLE = 0.6 * 2 / np.pi * np.arcsin(np.sin(PHASE))


@pytest.mark.parametrize(
    ("angle", "frequency", "wave"),
    [
        (SINE, 0.5, "sine"),
        (-SINE + 4, 0.5, "sine"),
        (TRIANGLE, 0.5, "triangle"),
        (np.round(SINE / 0.01), 0.5, "sine"),
        (SINE + np.random.default_rng(0).normal(0, 0.005, TIME.size), 0.5, "sine"),
        (np.where(np.sin(PHASE) > 0, 0.6, -0.6) * (TIME > 1), None, None),
        (SINE * TIME / 8, None, None),
        (0.6 * np.sin(0.3 * PHASE * TIME), None, None),
        (np.minimum(TIME, 3), None, None),
        (np.zeros(TIME.size), None, None),
        (np.random.default_rng(0).normal(0, 1, TIME.size), None, None),
    ],
)
def test_waves_are_named_where_sure(angle, frequency, wave):
    found = motion_of(TIME[TIME >= 1], angle[TIME >= 1])
    assert found == (frequency and pytest.approx(frequency, rel=1e-3), wave)


def test_a_wave_that_a_search_finds_backwards_has_a_positive_frequency():
    assert _best_fit(TIME, np.sin(2 * np.pi * 0.3 * TIME), np.sin, (-0.3, 0.0))[0] == pytest.approx(0.3)


def test_a_wave_between_sine_and_triangle_has_a_frequency_only():
    found, wave = motion_of(TIME[TIME >= 1], (SINE + TRIANGLE)[TIME >= 1] / 2)
    assert found == pytest.approx(0.5, rel=1e-2)
    assert wave is None


def test_numbers_that_are_known():
    noise = np.random.default_rng(1).normal(0, 0.02, TIME.size)
    counts, force = np.round(SINE / 0.01) + 40, 7 + noise
    seen = overview(TIME, {"counts": counts, "force": force, "fine": force.round(3)}, "counts", 1.0)
    assert (seen.samples, seen.rate_Hz, seen.duration_s) == (2000, pytest.approx(250), pytest.approx(7.996))
    assert seen.rest_s == 1
    assert seen.stroke == 120
    assert (seen.frequency_Hz, seen.wave) == (pytest.approx(0.5, rel=1e-3), "sine")
    assert seen.cycles == pytest.approx(3.5, rel=0.01)
    angle, exact, rounded = seen.channels
    assert (angle.low, angle.high, angle.noise, angle.step) == (-20, 100, 0, 1)
    assert exact.noise == pytest.approx(0.02, rel=0.15) and exact.step is None
    assert rounded.step == pytest.approx(0.001)


def test_a_motion_from_the_first_sample_on_has_no_rest_and_no_noise():
    seen = overview(TIME, {"angle": np.sin(3 * TIME)}, "angle", 0.0)
    assert seen.rest_s == 0
    assert seen.channels[0].noise is None


def test_channels_that_follow_from_others_have_no_step(bench):
    recording = ingest_batch(bench.write().folder).recordings[0]
    steps = {c.name: c.step for c in overview_of(recording).channels}
    assert steps["theta_in_rad"] == pytest.approx(np.pi / 1000)
    assert steps["tau_in_Nm"] == pytest.approx(1e-5 * 0.0234)
    assert steps["F_drive_N"] == pytest.approx(1e-5 / 0.1)
    assert {steps[f"T{i}_N"] for i in (1, 2, 3, 4)} == {None}
    assert overview_of(replace(recording, rest_s=0.0)).rest_s == 0


def test_check_prints_a_table_for_each_recording_and_its_findings(bench):
    bench.tables["two"]["extra"] = 1.0
    result = CliRunner().invoke(app, ["check", str(bench.write().folder)])
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    heads = [line for line in lines if line.startswith(("one:", "two:"))]
    assert len(heads) == 2
    assert "400 samples at 250 Hz, 1.596 s; rest 0.396 s; stroke 0.9676 rad" in heads[0]
    rows = [line.split() for line in lines if line.startswith("F_drive_N")]
    assert [len(row) for row in rows] == [6, 6]
    assert float(rows[0][1]) < 7 < float(rows[0][2])
    assert rows[0][3] == "N"
    assert float(rows[0][4]) == pytest.approx(0.1, rel=0.5)
    assert float(rows[0][5]) == pytest.approx(1e-4)
    assert "unknown column, not used" in result.output
    assert lines[-1].endswith(f"Next: ccmodel diagnose {bench.folder} --out DIR")


def test_check_says_that_the_initial_tension_will_not_be_observed(bench):
    with_torques = CliRunner().invoke(app, ["check", str(bench.write().folder)]).output
    for end in ("drive", "load"):
        del bench.described["rig"][end]["torque_constant_Nm_per_A"]
        for table in bench.tables.values():
            del table[f"{end}_current_A"]
    without = CliRunner().invoke(app, ["check", str(bench.write().folder)])
    assert without.exit_code == 0
    assert "the logs do not show the tensions at both ends" in without.output
    assert "the logs do not show" not in with_torques


def test_check_exits_with_1_if_a_log_is_refused(bench):
    bench.write().log().unlink()
    result = CliRunner().invoke(app, ["check", str(bench.folder)])
    assert result.exit_code == 1
    assert "two: 400 samples" in result.output
    assert "there is no such file" in result.output
    assert "Next:" not in result.output
