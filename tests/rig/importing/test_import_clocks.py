import numpy as np
import pytest

from ccmodel.rig.findings import LogError
from ccmodel.rig.importing.clocks import Clock, Samples, interpolation_cost, join


def samples(column, time, values, whole=False, **more):
    return Samples(column, f"s_{column}", "run.csv", time, values, whole, Clock(), **more)


def wave(time):
    return np.sin(2 * np.pi * 0.7 * time)


BASE = np.arange(0, 5, 0.002)
DRIVE = samples("theta_in_rad", BASE, wave(BASE))


def test_equal_times_are_passed_on_as_they_are():
    values = wave(BASE)
    values[[7, 8]] = np.nan
    joined = join([DRIVE, samples("F_drive_N", BASE.copy(), values)])
    np.testing.assert_array_equal(joined.columns["F_drive_N"], values)
    np.testing.assert_array_equal(joined.time_s, np.round(BASE, 9))
    assert (joined.costs, joined.cut_s, joined.remarks) == ([], (0.0, 0.0), [])


def test_nothing_is_extrapolated_and_what_was_cut_is_said():
    time = np.arange(0.5013, 4.2, 0.005)
    joined = join([DRIVE, samples("F_drive_N", time, wave(time))])
    used = joined.time_s + 0.502
    assert joined.time_s[0] == 0
    assert used[-1] <= time[-1] < used[-1] + 0.002
    assert np.isfinite(joined.columns["F_drive_N"]).all()
    assert joined.cut_s == pytest.approx((0.502, BASE[-1] - used[-1]))
    assert "0.502 s cut at the start, before the first sample of 's_F_drive_N'" in joined.remarks
    assert any(said.endswith("s cut at the end, after the last sample of 's_F_drive_N'") for said in joined.remarks)
    np.testing.assert_allclose(joined.columns["theta_in_rad"], wave(used))


def test_the_interpolation_error_is_estimated_from_the_signal_itself():
    rng = np.random.default_rng(3)
    time = np.arange(-1, 6, 0.02)
    noise = 1e-4
    noisy = samples("F_drive_N", time, wave(time) + noise * rng.normal(size=time.size))
    joined = join([DRIVE, noisy])
    (cost,) = joined.costs
    midway = time[:-1] + 0.01
    true_error = np.sqrt(np.mean(((wave(midway - 0.01) + wave(midway + 0.01)) / 2 - wave(midway)) ** 2))
    assert cost.interpolation_error == pytest.approx(true_error, rel=0.2)
    assert cost.noise == pytest.approx(noise, rel=0.2)
    assert cost.rate_Hz == pytest.approx(50)
    truth = wave(joined.time_s)
    assert np.sqrt(np.mean((joined.columns["F_drive_N"] - truth) ** 2)) < 2 * np.hypot(true_error, noise)


def test_noise_alone_is_no_interpolation_error():
    noise = np.random.default_rng(0).normal(size=20_000)
    error, found = interpolation_cost(noise)
    assert error < 0.05
    assert found == pytest.approx(1, rel=0.03)


@pytest.mark.parametrize("step_s", [0.0003, 0.0073, 0.02])
def test_counts_stay_whole_and_are_not_late(step_s):
    """Of an encoder that is faster or slower than the drive angle; within what rounding and its steps lose."""
    time = np.arange(-0.001, 6, step_s)
    joined = join([DRIVE, samples("load_encoder_counts", time, np.round(3000 * wave(time)), whole=True)])
    found, truth = joined.columns["load_encoder_counts"], 3000 * wave(joined.time_s + BASE[0])
    assert (found == np.round(found)).all()
    speed = np.gradient(truth, joined.time_s)
    late_s = -np.mean((found - truth) * speed) / np.mean(speed**2)
    assert abs(late_s) < 2e-5
    (cost,) = joined.costs
    assert np.sqrt(np.mean((found - truth) ** 2)) < 1.5 * np.hypot(cost.interpolation_error, np.hypot(cost.noise, 0.29))
    assert cost.by == "linear interpolation, to whole counts"


def test_counts_at_the_same_instants_on_another_clock_are_not_held_back():
    """The same instants differ by rounding once a clock is converted."""
    counts = np.round(300 * wave(BASE))
    for offset in (0.1, 0.3, 1e-13, -1e-13):
        time = (BASE - offset) + offset * (1 if offset > 1e-6 else 0) + (offset if abs(offset) < 1e-6 else 0)
        joined = join([DRIVE, samples("load_encoder_counts", time, counts, whole=True)])
        np.testing.assert_array_equal(joined.columns["load_encoder_counts"], counts)


def test_a_slower_column_of_a_table_is_joined_at_its_own_rows():
    values = np.full(BASE.size, np.nan)
    values[::10] = wave(BASE[::10])
    joined = join([DRIVE, samples("F_drive_N", BASE, values)])
    assert joined.costs[0].rate_Hz == pytest.approx(50)
    assert "'s_F_drive_N' has a number in one of 10 rows: it is taken to be sampled at these only" in joined.remarks
    np.testing.assert_allclose(joined.columns["F_drive_N"], wave(BASE[: joined.time_s.size]), atol=1e-3)


def test_a_slower_drive_angle_sets_the_rows():
    values = np.full(BASE.size, np.nan)
    values[::4] = wave(BASE[::4])
    joined = join([samples("theta_in_rad", BASE, values), samples("F_drive_N", BASE, 3 * wave(BASE))])
    np.testing.assert_allclose(joined.time_s, BASE[::4])
    np.testing.assert_allclose(joined.columns["F_drive_N"], 3 * wave(BASE[::4]), atol=1e-12)


def test_a_gap_is_not_bridged():
    time = np.arange(0, 5, 0.0031)
    time = time[(time < 2) | (time > 2.4)]
    joined = join([DRIVE, samples("F_drive_N", time, wave(time))])
    empty = np.isnan(joined.columns["F_drive_N"])
    assert (joined.time_s[empty] > 1.99).all() and (joined.time_s[empty] < 2.41).all()
    assert empty.sum() > 190
    assert any("has gaps: " in remark for remark in joined.remarks)


def test_times_that_do_not_increase_are_refused_where_clocks_are_joined():
    time = np.arange(0, 5, 0.005)
    time[100] = time[99]
    with pytest.raises(LogError) as caught:
        join([DRIVE, samples("F_drive_N", time, wave(time))])
    assert "the times of 's_F_drive_N' must increase, found 0.495 s after 0.495 s (sample 101)" in caught.value.args[2]


@pytest.mark.parametrize("count", [0, 1, 5])
def test_a_column_with_hardly_any_numbers_is_refused(count):
    time = np.arange(0, 5, 0.005)
    values = np.where(np.arange(time.size) < count, 5.0, np.nan)
    with pytest.raises(LogError) as caught:
        join([DRIVE, samples("F_drive_N", time, values)])
    assert f"'s_F_drive_N' has {count} numbers only" in caught.value.args[2]


def test_no_time_in_common():
    with pytest.raises(LogError) as caught:
        join([DRIVE, samples("F_drive_N", BASE + 100, wave(BASE))])
    assert "no time in common (theta_in_rad 0 to 4.998 s, F_drive_N 100 to 104.998 s)" in caught.value.args[2]
