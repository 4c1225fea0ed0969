"""What is measured of loops, against loops whose measures are known."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.studies.claims import model_runs
from ccmodel.studies.loops.measures import QUANTITIES, measure
from ccmodel.studies.loops.settings import Measuring
from model_runs import CABLE, STUDY

HOW = Measuring()


def fine(samples_a_cycle=1000, cycles=3.2, **channels):
    """A recording of a 1 Hz sine; channels are functions of time."""
    t = np.arange(0, cycles, 1 / samples_a_cycle)
    channels = {"theta_in_rad": lambda t: np.sin(2 * np.pi * t)} | channels
    return replace(recording(), time_s=t, channels={c: f(t) for c, f in channels.items()}, accuracy={})


def play(t, width=0.03, slope=0.6, amplitude=0.1):
    """The output of a backlash: a parallelogram over its input."""
    x, y = amplitude * np.sin(2 * np.pi * t), np.zeros_like(t)
    for i in range(1, t.size):
        y[i] = min(max(y[i - 1], x[i] - width / 2), x[i] + width / 2)
    return slope * y


def parallelogram(noise=0.0, **kw):
    random = np.random.default_rng(1)
    return fine(
        tau_in_Nm=lambda t: 0.1 * np.sin(2 * np.pi * t) + noise * random.standard_normal(t.size),
        tau_out_Nm=lambda t: play(t) + noise * random.standard_normal(t.size),
        **kw,
    )


@pytest.mark.parametrize(("noise", "within"), [(0.0, 0.002), (0.0005, 0.01)])
def test_a_parallelogram_gives_its_width_its_flat_part_and_its_slope(noise, within):
    values, gaps = measure(parallelogram(noise), ["width", "backlash", "slope"], HOW)
    assert not gaps
    assert values["width"] == pytest.approx(30.0, rel=within)
    # Smoothing takes a little off the turns.
    assert values["backlash"] == pytest.approx(30.0, rel=0.03)
    assert values["slope"] == pytest.approx(0.6, rel=within)


def test_the_loop_of_a_load_cell_with_a_zero_is_that_of_one_without():
    named = ["width", "backlash", "slope"]
    loop = parallelogram()
    with_zero = loop.with_channels({**loop.channels, "tau_out_Nm": loop["tau_out_Nm"] + 0.02}, {}, "rig")
    assert measure(with_zero, named, HOW)[0] == pytest.approx(measure(loop, named, HOW)[0])


def test_peak_to_peak_is_not_that_of_the_noise():
    values, _ = measure(parallelogram(0.0005), ["tau_in"], HOW)
    assert values["tau_in"] == pytest.approx(200.0, rel=0.005)


def slack_at_times(t):
    """A tension that is there for half of a cycle of one second."""
    return np.maximum(50 * np.sin(2 * np.pi * t), 0)


def taut(t):
    return np.full_like(t, 5.0)


def test_a_cable_that_is_slack_for_half_the_cycle_is_slack_for_half_the_cycle():
    r = fine(T1_N=slack_at_times, T2_N=slack_at_times, T3_N=taut, T4_N=taut)
    assert measure(r, ["slack_share"], HOW)[0]["slack_share"] == pytest.approx(50.0, abs=1.0)


@pytest.mark.parametrize(("drive", "load", "share"), [(slack_at_times, taut, 0.0), (taut, slack_at_times, 50.0)])
def test_a_cable_is_slack_by_the_tension_at_its_load_end_alone(drive, load, share):
    r = fine(T1_N=drive, T2_N=load, T3_N=taut, T4_N=taut)
    assert measure(r, ["slack_share"], HOW)[0]["slack_share"] == pytest.approx(share, abs=1.0)


def test_phase_iv_takes_only_the_time_in_which_the_load_follows():
    """A cable that is always slack, and a load that follows from 0.11 of a stroke of 0.2: asin(0.1) past the middle."""
    flat = {"tau_in_Nm": lambda t: 0.1 * np.sin(2 * np.pi * t), "tau_out_Nm": lambda t: play(t, width=0.1)}
    r = fine(T1_N=taut, T2_N=np.zeros_like, T3_N=taut, T4_N=taut, **flat)
    values, _ = measure(r, ["IVa_share", "IVb_share"], HOW)
    share = 100 * (np.pi / 2 - np.arcsin(0.1)) / np.pi
    assert (values["IVa_share"], values["IVb_share"]) == pytest.approx((share, share), abs=1.0)


def test_the_flat_part_ends_where_the_load_begins_to_follow_however_it_goes_on():
    """After a reversal the output rests for 30 mN·m, has gradient 1 up to 35 % of its range, and then a quarter."""

    def rise(moved):
        return np.interp(moved, [0, 0.03, 0.05017, 0.2], [0, 0, 0.02017, 0.02017 + 0.25 * 0.14983])

    def bent(t):
        x, half = 0.1 * np.sin(2 * np.pi * t), rise(0.2) / 2
        return np.where(np.cos(2 * np.pi * t) < 0, half - rise(0.1 - x), rise(x + 0.1) - half)

    r = fine(tau_in_Nm=lambda t: 0.1 * np.sin(2 * np.pi * t), tau_out_Nm=bent)
    assert measure(r, ["backlash"], HOW)[0]["backlash"] == pytest.approx(30.0, rel=0.03)


def test_work_lost_is_the_area_of_the_drives_loop():
    r = fine(tau_in_Nm=lambda t: 0.1 * np.cos(2 * np.pi * t))
    assert measure(r, ["work_lost"], HOW)[0]["work_lost"] == pytest.approx(100 * np.pi, rel=0.005)


def test_the_drives_loop_is_closed_where_its_ends_are_half_a_sample_apart():
    r = fine(samples_a_cycle=40.5, tau_in_Nm=lambda t: 0.1 * np.cos(2 * np.pi * t))
    polygon = 40.5 / 2 * np.sin(2 * np.pi / 40.5)
    assert measure(r, ["work_lost"], HOW)[0]["work_lost"] == pytest.approx(100 * polygon, rel=0.005)


def test_the_models_loop_is_that_of_its_closed_forms():
    """Evenly bent: slope 1 with both cables taut, exp(-mu phi) with one slack; width 2 R sinh(mu phi) (T2 + T4)."""
    said = model_runs.run(CABLE, model_runs.even(STUDY), STUDY, 0.05)
    values, _ = measure(said, ["slope", "width"], HOW)
    middle = int(np.argmin(np.abs(said["tau_out_Nm"][-1000:]))) - 1000
    sum_N = said["T2_N"][middle] + said["T4_N"][middle]
    assert values["slope"] == pytest.approx(1.0, rel=1e-6)
    assert values["width"] == pytest.approx(1e3 * 2 * 0.006 * np.sinh(0.156 * np.pi) * sum_N, rel=0.005)

    low = STUDY.model_copy(update={"pretension_N": 3.5})
    values, _ = measure(model_runs.run(CABLE, model_runs.even(low), low, 0.05), ["slack_slope"], HOW)
    assert values["slack_slope"] == pytest.approx(np.exp(-0.156 * np.pi), rel=0.01)


def test_the_two_cases_of_phase_four():
    shares = []
    for pretension in (0.7, 3.5, 7.0):
        study = STUDY.model_copy(update={"pretension_N": pretension})
        values, _ = measure(model_runs.run(CABLE, model_runs.even(study), study, 0.05), ["IVa_share", "IVb_share"], HOW)
        shares.append((values["IVa_share"] > 1, values["IVb_share"] > 1))
    assert shares == [(True, True), (True, False), (False, False)]


def test_too_few_samples_are_a_stated_gap():
    values, gaps = measure(fine(samples_a_cycle=20, tau_in_Nm=np.sin, tau_out_Nm=np.sin), list(QUANTITIES), HOW)
    assert not values
    assert all("fewer than 40" in gap for gap in gaps.values())


def test_a_channel_that_was_not_recorded_is_a_stated_gap():
    values, gaps = measure(fine(tau_in_Nm=np.sin), ["tau_in", "width", "slack_share"], HOW)
    assert set(values) == {"tau_in"}
    assert gaps == {"width": "tau_out_Nm was not recorded", "slack_share": "a tension was not recorded"}


def test_a_drive_that_does_not_come_back_makes_no_cycle():
    r = fine(theta_in_rad=lambda t: t, tau_in_Nm=np.sin, tau_out_Nm=np.sin)
    assert measure(r, ["width"], HOW) == ({}, {"width": "the drive makes no whole cycle"})


def test_a_flat_output_is_a_stated_gap():
    r = fine(tau_in_Nm=np.sin, tau_out_Nm=np.zeros_like)
    values, gaps = measure(r, ["width", "backlash", "slope"], HOW)
    assert not values
    assert all("samples for a line" in gap for gap in gaps.values())
