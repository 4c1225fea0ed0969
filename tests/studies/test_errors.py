"""Error tables by hand, and the cycle they are taken over."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.errors import COLUMNS, error_table, last_cycle
from ccmodel.model.run import PRESCRIBED
from ccmodel.studies.variables import by_label, label_of, origins_of, value_of


def test_error_is_rms_in_units_and_over_peak_to_peak():
    measured = recording(tau_in_Nm=lambda t: 0.05 * np.sin(2 * np.pi * t))
    off = measured.with_channels({"tau_in_Nm": measured["tau_in_Nm"] + 0.002}, {"tau_in_Nm": "model"}, "model")
    table = error_table([(measured, off)], "fitted")
    assert list(table.columns) == list(COLUMNS)
    assert table["rmse"].item() == pytest.approx(0.002)
    assert table["nrmse_percent"].item() == pytest.approx(100 * 0.002 / 0.1, rel=1e-3)
    assert table["unit"].item() == "N m"


def test_numbers_of_four_samples_by_hand():
    """Simulated minus recorded is 5, -2, 0 and 1: its mean is 1, its median 0.5 and its mean square 30 / 4."""
    read, errors = np.array([-5.0, 2.0, 3.0, 4.0]), np.array([5.0, -2.0, 0.0, 1.0])
    measured = recording(0.03, theta_in_rad=lambda t: t, tau_in_Nm=lambda t: read)
    model = measured.with_channels({"tau_in_Nm": read + errors}, {"tau_in_Nm": "model"}, "model")
    (row,) = error_table([(measured, model)], "fitted").to_dict("records")
    numbers = {name: value for name, value in row.items() if not isinstance(value, str)}
    assert numbers == pytest.approx(
        {
            "bias": 1.0,
            "rmse": np.sqrt(7.5),
            "peak_to_peak": 9.0,
            "maximum": 5.0,
            "rms": np.sqrt(13.5),
            "nrmse_percent": 100 * np.sqrt(7.5) / 9,
            "window_from_s": 0.0,
            "window_to_s": 0.03,
            "samples": 4,
        }
    )


def test_channels_not_recorded_or_prescribed_have_no_row():
    measured = recording(tau_in_Nm=np.sin, tau_out_Nm=np.sin)
    model = measured.with_channels(
        {"tau_in_Nm": measured["tau_in_Nm"], "tau_out_Nm": measured["tau_out_Nm"], "T1_N": measured["tau_in_Nm"]},
        {"tau_in_Nm": "model", "tau_out_Nm": PRESCRIBED, "T1_N": "model"},
        "model",
    )
    assert set(error_table([(measured, model)], "x")["channel"]) == {"tau_in_Nm"}


def test_a_flat_channel_has_no_normalised_error():
    measured = recording(tau_in_Nm=np.zeros_like)
    table = error_table([(measured, measured.with_channels(measured.channels, {"tau_in_Nm": "model"}, "model"))], "x")
    assert np.isnan(table["nrmse_percent"].item())


def test_last_cycle_is_one_period_and_the_last_whole_one():
    r = recording(duration=4.6)  # 1 Hz sine
    cycle = last_cycle(r)
    start, end = r.time_s[cycle][[0, -1]]
    assert end - start == pytest.approx(1.0, abs=0.011)
    assert 4.6 - end < 1.0


def test_a_cycle_has_both_of_its_crossings():
    """The drive crosses its middle 5 ms before the samples at 1.01 s, 2.01 s, 3.01 s and 4.01 s."""
    r = recording(duration=4.6, theta_in_rad=lambda t: np.sin(2 * np.pi * (t - 0.005)))
    assert r.time_s[last_cycle(r)] == pytest.approx(3.01 + 0.01 * np.arange(101))


def test_dither_about_the_middle_makes_no_cycle():
    # More from sample to sample than the motion's 0.063, so that the middle is crossed several times in each cycle.
    dither = 0.1 * (-1.0) ** np.arange(461)
    r = recording(duration=4.6, theta_in_rad=lambda t: np.sin(2 * np.pi * t) + dither[: t.size])
    rising = np.flatnonzero((r["theta_in_rad"][:-1] < 0) & (r["theta_in_rad"][1:] >= 0))
    assert rising.size >= 8
    assert np.diff(r.time_s[last_cycle(r)][[0, -1]]) == pytest.approx(1.0, abs=0.011)


def test_without_a_cycle_all_that_is_judged_is_the_window():
    r = recording(duration=2.0, theta_in_rad=lambda t: t, settled_s=0.5)
    assert r.time_s[last_cycle(r)][0] == pytest.approx(0.5)
    assert r.time_s[last_cycle(r)][-1] == pytest.approx(2.0)


def test_repeats_of_a_condition_share_a_label_in_the_order_of_values():
    recordings = [recording(pretension_N=p, id=f"r{i}") for i, p in enumerate([7.0, 0.7, 7.0, 3.5])]
    groups = by_label([(r, None) for r in recordings], "pretension")
    labels = [(label, r.id) for label, pairs in groups.items() for r, _ in pairs]
    assert labels == [("0.7 N", "r1"), ("3.5 N", "r3"), ("7 N", "r0"), ("7 N", "r2")]


def test_measured_and_simulated_recordings_in_one_study_are_told_apart():
    simulated = recording()
    measured = simulated.with_channels(simulated.channels, simulated.derived_from, "rig")
    labels = list(by_label([(simulated, None), (measured, None)], "pretension"))
    assert labels == ["7 N, recording (virtual rig, simulated)", "7 N, recording (measured)"]
    assert origins_of([simulated, measured]) == "recording (measured) and recording (virtual rig, simulated)"


def test_a_note_of_the_excitation_that_is_no_number_is_not_stated():
    noted = replace(recording(), excitation={"frequency_Hz": "about 1"})
    assert np.isnan(value_of(noted, "frequency"))


def test_labels_name_values_as_people_do():
    assert label_of(2 * np.pi, "bend") == "2 × 180°"
    assert label_of(1.0, "bend") == "57°"
    assert label_of(np.inf, "radius") == "straight"
    assert label_of(0.0457, "radius") == "4.57 cm"
    assert label_of(np.nan, "load_level") == "load level not stated"
