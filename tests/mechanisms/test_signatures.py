"""The signature of each mechanism in a run of the general solver."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.mechanisms.constant_drag import drag_shares
from ccmodel.mechanisms.presliding import element_lengths
from ccmodel.mechanisms.pulley_friction import PRESLIDING_RAD
from ccmodel.mechanisms.relaxation import BRANCHES, branch_times, followed, kept_at_rest, relaxed_after
from ccmodel.mechanisms.viscous_friction import power_of_speed
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, SpringLoad
from ccmodel.model.response import Status
from general_runs import HALF_LOOP, K_E, MU, T0, TENSIONS, K, L, R, last_cycle, loop_area, rms, run, sine

DRIVE_ONLY = (*TENSIONS, "theta_out_rad", "tau_out_Nm")


@pytest.fixture(scope="module")
def base():
    return run(sine())


def triangle(amplitude=0.6, cycles=2, samples=500):
    phase = np.arange(cycles * samples + 1) / samples
    return amplitude * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * phase))


def test_presliding_rounds_reversals(base):
    """tau_in reverses over some presliding lengths, and full slip is unchanged."""
    rounded = run(sine(), ("presliding", "conduit", {"z0": 100e-6}))
    reversal = slice(500 + 127, 500 + 140)
    change = [np.diff(r.tau_in_Nm)[reversal] / np.diff(sine())[reversal] for r in (base, rounded)]
    assert np.abs(change[0]).max() > 1.3 * np.abs(change[1]).max()
    assert np.log(rounded.T1_N[600] / rounded.T2_N[600]) == pytest.approx(MU * np.pi, rel=2e-2)


def test_small_reversals_lose_no_work_with_presliding_and_some_with_a_termination():
    """Both soften a small reversal alike, and close."""

    def loop(mechanism, swing_rad):
        phase = np.linspace(0, 8 * np.pi, 401)
        theta = np.concatenate([np.linspace(0, 0.5, 200), 0.5 - swing_rad / 2 * (1 - np.cos(phase))])
        T1 = run(theta, mechanism).T1_N
        assert T1[500] == pytest.approx(T1[600], abs=1e-3)
        last = slice(500, 601)
        return abs(np.trapezoid(T1[last], theta[last])) / np.ptp(T1[last]) / swing_rad

    presliding = ("presliding", "conduit", {"z0": 100e-6, "creep": 0.0})
    end = ("termination-compliance", "drive-end", {"compliance": 40e-6})
    assert loop(presliding, 0.008) < 1e-6 < 0.02 < loop(end, 0.008)
    assert loop(presliding, 0.08) == pytest.approx(loop(end, 0.08), rel=0.1)


def test_small_nested_reversals_creep_with_a_bristle_and_close_with_a_termination():
    """Both soften a small reversal alike; only a bristle lets tension creep from one to the next."""
    phase = np.linspace(0, 8 * np.pi, 401)
    theta = np.concatenate([np.linspace(0, 0.5, 200), 0.5 - 0.002 * (1 - np.cos(phase))])
    bristles = run(theta, ("presliding", "conduit", {"z0": 100e-6, "creep": 1.0})).T1_N
    end = run(theta, ("termination-compliance", "drive-end", {"compliance": 40e-6})).T1_N
    swing = [np.ptp(T[500:]) for T in (run(theta).T1_N, bristles, end)]
    assert swing[1] < 0.4 * swing[0]
    assert swing[2] < 0.4 * swing[0]
    assert bristles[200] - bristles[600] > swing[1]
    assert end[600] == pytest.approx(end[200], abs=1e-6)


def test_elements_are_evenly_spaced_about_the_stated_length():
    lengths = element_lengths(50e-6, 8.0)
    assert np.diff(np.log(lengths)) == pytest.approx(np.log(8.0) / 3)
    assert np.prod(lengths) == pytest.approx((50e-6) ** 4)
    assert element_lengths(50e-6, 1.0) == pytest.approx((50e-6,) * 4)


def test_viscous_friction_widens_loops_with_speed_and_not_with_tension():
    mechanism = ("viscous-friction", "conduit", {"c": 100.0})
    plain = {T: loop_area(run(triangle(), T=T)) for T in (5.0, 10.0)}
    extra = {
        (T, period): loop_area(run(triangle(), mechanism, T=T, period_s=period)) - plain[T]
        for T in (5.0, 10.0)
        for period in (1.0, 4.0)
    }
    assert extra[5.0, 1.0] > 3.5 * extra[5.0, 4.0] > 0
    assert extra[5.0, 1.0] == pytest.approx(extra[10.0, 1.0], rel=0.15)


@pytest.mark.parametrize("power", [0.3, 0.6, 1.0])
def test_a_viscous_drag_rises_with_its_power_of_the_speed(power):
    """Loops of triangles, which move at one speed, at four times the speed."""
    plain = loop_area(run(triangle()))
    extra = [
        loop_area(run(triangle(), ("viscous-friction", "conduit", {"c": 40.0, "power": power}), period_s=p)) - plain
        for p in (1.0, 4.0)
    ]
    assert extra[0] / extra[1] == pytest.approx(4**power, rel=0.1)


@pytest.mark.parametrize("power", [0.5, 1.0])
def test_a_viscous_drag_is_of_second_order_in_the_time_step(power):
    """Half a step's delay of the speed would be a drag in proportion to acceleration, as of a mass."""
    mechanism = ("viscous-friction", "conduit", {"c": 100.0, "power": power})
    coarse, fine, finest = (
        run(sine(samples=n), mechanism, samples=n).tau_in_Nm[:: n // 500] for n in (500, 1000, 4000)
    )
    assert rms(coarse, finest) > 2.5 * rms(fine, finest)


@pytest.mark.parametrize("power", [0.2, 0.7, 1.0])
def test_the_drag_of_a_power_has_its_slope(power):
    speed = np.array([-0.03, -1e-3, -2e-5, 0.0, 1e-6, 5e-5, 0.01, 0.2])

    def drag(v):
        return v * np.array([power_of_speed(float(one), power)[0] for one in v])

    step = 1e-7 * np.maximum(np.abs(speed), 1e-5)
    slopes = [power_of_speed(float(v), power)[1] for v in speed]
    assert slopes == pytest.approx((drag(speed + step) - drag(speed - step)) / (2 * step), rel=1e-5)
    assert drag(np.array([0.01])) == pytest.approx(0.01, rel=1e-5)


def test_stribeck_peaks_at_break_away_and_loses_less_at_speed():
    mechanism = ("stribeck", "conduit", {"a": 0.4, "vs": 2e-3})
    slow, fast = (loop_area(run(triangle(), mechanism, period_s=p)) for p in (20.0, 0.5))
    plain = loop_area(run(triangle()))
    assert slow > 1.1 * fast
    assert fast == pytest.approx(plain, rel=0.08)


def test_running_in_follows_time_or_travel_at_any_speed():
    """In full slip the capstan exponent is that of the elapsed time, or of the cable travel."""
    theta = np.concatenate([np.linspace(0, 2, 400), np.linspace(2, 0, 400), np.linspace(0, 2, 400)])
    exponents = {}
    for period_s in (1.0, 4.0):
        for numbers in ({"tau": 2.0}, {"tau": 1e9, "per_m": 30.0}):
            mechanism = ("running-in", "conduit", {"change": 0.3, **numbers})
            r = run(theta, mechanism, load=AngleLoad(theta), period_s=period_s)
            exponents[period_s, "per_m" in numbers] = np.log(r.T1_N[-1] / r.T2_N[-1]) / (np.pi * MU)
    travel_m, seconds = 6 * R, (theta.size - 1) / 500
    for period_s in (1.0, 4.0):
        by_time, by_travel = exponents[period_s, False], exponents[period_s, True]
        assert by_time == pytest.approx(1 + 0.3 * (1 - np.exp(-period_s * seconds / 2.0)), rel=1e-3)
        assert by_travel == pytest.approx(1 + 0.3 * (1 - np.exp(-30.0 * travel_m)), rel=1e-3)


@pytest.mark.parametrize("delta", [1.0, 2.0])
def test_stribeck_friction_falls_with_speed_along_its_curve(delta):
    """In steady full slip ln(T1/T2) is the bend times mu (1 + a exp(-(v / vs)^delta))."""
    a, vs, speed = 0.4, 3e-3, 2e-3
    theta = np.linspace(0, 2.0, 800)
    r = run(theta, ("stribeck", "conduit", {"a": a, "vs": vs, "delta": delta}), load=AngleLoad(theta),
            period_s=500 / 800 * 2.0 * R / speed)  # fmt: skip
    friction = np.log(r.T1_N[-1] / r.T2_N[-1]) / np.pi
    assert friction == pytest.approx(MU * (1 + a * np.exp(-((speed / vs) ** delta))), rel=5e-3)


@pytest.mark.parametrize("renewal", [1e-3, 3e-3])
def test_stribeck_friction_adapts_over_its_renewal_length(renewal):
    """Far above the Stribeck speed, ln(T1/T2) in full slip is the bend times mu (1 + a exp(-s / renewal))."""
    a, theta = 0.4, np.linspace(0, 0.5, 800)
    r = run(theta, ("stribeck", "conduit", {"a": a, "vs": 1e-4, "renewal": renewal}), load=AngleLoad(theta))
    friction, slid_m = np.log(r.T1_N[-1] / r.T2_N[-1]) / np.pi, 0.5 * R
    assert friction == pytest.approx(MU * (1 + a * np.exp(-slid_m / renewal)), rel=0.02)


def test_a_parameter_that_a_model_omits_has_its_default():
    stated = {"delta": 2.0, "renewal": 2e-5}
    given, omitted = (run(sine(), ("stribeck", "conduit", {"a": 0.3, "vs": 2e-3, **more})) for more in (stated, {}))
    assert (given.T1_N == omitted.T1_N).all()
    with pytest.raises(ModelError, match="stribeck has the parameters a, delta, renewal, vs; got a"):
        run(sine(), ("stribeck", "conduit", {"a": 0.3}))


def test_stribeck_is_smooth_in_slip_and_independent_of_the_sampling():
    mechanism = ("stribeck", "conduit", {"a": 0.3, "vs": 3e-3})
    r, fine = run(sine(), mechanism), run(sine(samples=4000), mechanism, samples=4000)
    slip = slice(560, 606)
    assert np.abs(np.diff(r.T1_N[slip], 2)).max() < 0.003 * T0
    # As it slows down before a reversal it sticks and slips, and a sample more or less decides when.
    assert rms(r.T1_N, fine.T1_N[::8]) < 0.003 * np.ptp(fine.T1_N)


def test_full_slip_ratio_falls_with_tension_by_a_power():
    n = -0.2
    ratio = []
    for T in (4.0, 8.0):
        r = run(np.linspace(0, 0.9, 200), ("load-dependent-friction", "conduit", {"n": n}), T=T, mu=0.05)
        ratio.append((np.log(r.T1_N[-1] / r.T2_N[-1]), np.sqrt(r.T1_N[-1] * r.T2_N[-1])))
    measured = np.log(ratio[1][0] / ratio[0][0]) / np.log(ratio[1][1] / ratio[0][1])
    assert measured == pytest.approx(n, rel=0.02)


def test_constant_drag_remains_at_zero_tension():
    f0 = 0.8
    theta = np.linspace(0, 0.6, 200)
    r = run(theta, ("constant-drag", "conduit", {"f0": f0}), T=0.02, mu=1e-6)
    assert r.T1_N[-1] - r.T2_N[-1] == pytest.approx(f0, rel=1e-3)


def test_a_seal_stalls_the_front_at_its_place_and_a_drag_all_along_does_not():
    f0 = 0.8
    theta = np.linspace(0, 0.6, 1200)
    plain = run(theta, mu=1e-6)
    seal, spread = (
        run(theta, ("constant-drag", "conduit", {"f0": f0, "local": local, "s": 0.25}), mu=1e-6) for local in (1.0, 0.0)
    )
    for r in (seal, spread):
        assert r.T1_N[-1] - r.T2_N[-1] == pytest.approx(f0, rel=1e-4)
    # Until the drive pulls with f0 only the cable between drive and seal stretches: a quarter of it.
    held = (seal.T1_N - seal.T1_N[0])[1:] < 0.9 * f0
    stiffness = np.diff(seal.T1_N)[held] / (R * np.diff(theta)[held])
    assert stiffness == pytest.approx(K / 0.25, rel=0.03)
    assert np.diff(seal.T1_N)[-1] == pytest.approx(np.diff(plain.T1_N)[-1], rel=1e-3)


def test_a_seal_at_the_drive_is_like_the_friction_of_its_bearing():
    theta = np.linspace(0, 0.6, 400)
    seal = run(theta, ("constant-drag", "conduit", {"f0": 0.4, "local": 1.0, "s": 0.0}))
    bearing = run(theta, ("pulley-friction", "drive-pulley", {"friction_torque": 0.8 * R, "presliding": 1e-5}))
    assert seal.theta_out_rad[-1] == pytest.approx(bearing.theta_out_rad[-1], rel=5e-3)
    assert seal.tau_in_Nm[-1] == pytest.approx(bearing.tau_in_Nm[-1], rel=5e-3)


@pytest.mark.parametrize("s", [0.0, 0.03, 0.31, 0.5, 1.0])
def test_the_drag_of_a_seal_is_divided_so_that_its_mean_place_is_stated(s):
    cell = np.array([0.5, 1.0, 1.0, 2.0, 0.5])
    middle = (np.cumsum(cell) - cell / 2) / cell.sum()
    seal, spread = (drag_shares(SimpleNamespace(drag_local=local, drag_place=s), cell) for local in (1.0, 0.0))
    assert seal.sum() == pytest.approx(1.0)
    assert seal @ middle == pytest.approx(np.clip(s, middle[0], middle[-1]))
    assert np.count_nonzero(seal) <= 2
    assert spread == pytest.approx(cell / cell.sum())
    assert drag_shares(SimpleNamespace(drag_local=1.0, drag_place=s), cell[:1]) == pytest.approx([1.0])


def test_kink_adds_its_bend_to_the_loss_and_stalls_the_front():
    mechanism = ("kink", "conduit", {"beta": 1.0, "s": 0.5})
    theta = np.linspace(0, 0.6, 600)
    kinked, plain = run(theta, mechanism), run(theta)
    assert np.log(kinked.T1_N[-1] / kinked.T2_N[-1]) == pytest.approx(MU * (np.pi + 1.0), rel=1e-7)
    arrival = [np.argmax(r.theta_out_rad > 1e-5) for r in (plain, kinked)]
    assert arrival[1] > arrival[0] + 5
    # Until the front reaches the kink nothing differs.
    early = theta < 0.2 * theta[arrival[0]]
    assert kinked.T1_N[early] == pytest.approx(plain.T1_N[early], rel=2e-3)


def test_running_in_makes_loops_drift():
    r = run(sine(cycles=6), ("running-in", "conduit", {"change": 0.3, "tau": 3.0}))
    ratio = np.log(r.T1_N / r.T2_N)
    for cycle in (1, 5):
        at = cycle * 500 + 110
        expected = MU * np.pi * (1 + 0.3 * -np.expm1(-(at / 500) / 3.0))
        assert ratio[at] == pytest.approx(expected, rel=1e-6)


def test_asymmetry_is_odd_in_direction():
    r = run(sine(), ("cable-asymmetry", "cable", {"ratio": 1.3, "K_ratio": 1.0}))
    pull, back = 500 + 110, 500 + 360
    assert np.log(r.T1_N[pull] / r.T2_N[pull]) == pytest.approx(MU * np.pi, rel=1e-6)
    assert np.log(r.T3_N[back] / r.T4_N[back]) == pytest.approx(1.3 * MU * np.pi, rel=1e-6)


def test_stiffness_asymmetry_leaves_friction_alone():
    r = run(sine(), ("cable-asymmetry", "cable", {"ratio": 1.0, "K_ratio": 0.7}))
    assert np.log(r.T3_N[860] / r.T4_N[860]) == pytest.approx(MU * np.pi, rel=1e-6)


def test_relaxation_decays_at_rest_as_the_standard_linear_solid():
    r, tau = 0.1, 30.0
    run_ = run(np.zeros(501), ("relaxation", "cable", {"r": r, "tau": tau}), period_s=60.0)
    expected = T0 * (1 - r * -np.expm1(-run_.time_s / tau))
    for name in TENSIONS:
        assert getattr(run_, name) == pytest.approx(expected, rel=1e-6)
    assert np.abs(run_.theta_out_rad).max() < 1e-9


@pytest.mark.parametrize("relaxed", [0.4, 1.0])
def test_relaxation_goes_on_from_where_a_recording_starts(relaxed):
    """Of the tension that the rest shows, r (1 - relaxed) is yet to be lost."""
    r, tau = 0.2, 30.0
    run_ = run(np.zeros(501), ("relaxation", "cable", {"r": r, "tau": tau, "relaxed": relaxed}), period_s=60.0)
    expected = T0 * (1 - r * (1 - relaxed) * -np.expm1(-run_.time_s / tau))
    for name in TENSIONS:
        assert getattr(run_, name) == pytest.approx(expected, rel=1e-6)


def test_relaxation_of_several_times_decays_as_the_mean_of_exponentials():
    r, tau, spread, held_s = 0.2, 10.0, 30.0, 7.0
    times = np.geomspace(tau / np.sqrt(spread), tau * np.sqrt(spread), BRANCHES)
    state = relaxed_after(held_s, r, tau, spread)
    run_ = run(
        np.zeros(501),
        ("relaxation", "cable", {"r": r, "tau": tau, "spread": spread, "relaxed": state}),
        period_s=60.0,
    )
    since = held_s + np.append(run_.time_s, -held_s)  # the last value is that of a fresh cable
    left = 1 - r * np.mean(-np.expm1(-since[:, None] / times), axis=1)
    for name in TENSIONS:
        assert getattr(run_, name) == pytest.approx(T0 * left[:-1] / left[0], rel=1e-6)
    assert kept_at_rest(5.0, r, tuple(times), state) == pytest.approx(np.interp(5.0, run_.time_s, run_.T1_N) / T0)
    assert 1 - state == pytest.approx((left[0] - (1 - r)) / (left[0] * r))


@pytest.mark.parametrize("relaxed", [0.0, 0.3, 0.9])
def test_all_branches_have_followed_as_long(relaxed):
    r, times = 0.2, branch_times(10.0, 30.0)
    of_each = followed(r, times, relaxed)
    seconds = -times[-1] * np.log1p(-of_each[-1])
    assert of_each == pytest.approx(-np.expm1(-seconds / np.array(times)))
    assert relaxed_after(seconds, r, 10.0, 30.0) == pytest.approx(relaxed, abs=1e-9)
    assert followed(r, times, 1.0) == pytest.approx(1.0)


def test_a_run_goes_on_as_the_later_part_of_a_longer_one():
    """Held at rest for a time, a fresh cable has relaxed by 1 - exp(-t / tau), and its friction has run in by it."""
    theta, held_s, tau = sine(), 4.0, 5.0
    several = {"r": 0.15, "tau": tau, "spread": 20.0}
    mechanisms = [
        ("relaxation", "cable", {"r": 0.15, "tau": tau}, {"relaxed": relaxed_after(held_s, 0.15, tau)}),
        ("relaxation", "cable", several, {"relaxed": relaxed_after(held_s, 0.15, tau, 20.0)}),
        ("running-in", "conduit", {"change": -0.3, "tau": tau}, {"done": -np.expm1(-held_s / tau)}),
    ]
    for name, place, values, state in mechanisms:
        whole = run(np.concatenate([np.zeros(2000), theta]), (name, place, values))
        later = run(theta, (name, place, values | state), T=whole.T1_N[2000])
        for tension in TENSIONS:
            assert getattr(later, tension) == pytest.approx(getattr(whole, tension)[2000:], rel=1e-4), name


def test_a_state_without_a_strength_is_the_papers_model_bit_for_bit(base):
    for name, place, values in (
        ("relaxation", "cable", {"r": 0.0, "tau": 30.0, "relaxed": 0.7}),
        ("running-in", "conduit", {"change": 0.0, "tau": 30.0, "done": 0.7}),
    ):
        neutral = run(sine(), (name, place, values))
        assert all((getattr(neutral, tension) == getattr(base, tension)).all() for tension in TENSIONS), name


def test_relaxation_does_not_depend_on_the_step():
    theta = np.interp(np.arange(501) / 500, [0, 0.2, 1], [0, 0.4, 0.4])
    fine = run(theta, ("relaxation", "cable", {"r": 0.1, "tau": 10.0}), period_s=20.0)
    coarse = run(theta[::10], ("relaxation", "cable", {"r": 0.1, "tau": 10.0}), period_s=20.0, samples=50)
    assert coarse.T1_N[-1] == pytest.approx(fine.T1_N[-1], rel=2e-4)


def test_strands_make_the_cable_soft_near_slack_only():
    """Stiffness of the pair against a small rotation, load blocked and without friction."""
    theta = np.linspace(0, 1e-3, 3)
    blocked = AngleLoad(np.zeros(3))
    stiffness = {}
    for T in (0.3, 20.0):
        r = run(theta, ("strand-settling", "cable", {"T_scale": 1.0}), T=T, mu=0.0, load=blocked)
        plain = run(theta, T=T, mu=0.0, load=blocked)
        stiffness[T] = (r.tau_in_Nm[-1] - r.tau_in_Nm[0]) / (plain.tau_in_Nm[-1] - plain.tau_in_Nm[0])
    assert stiffness[0.3] < 0.6
    assert stiffness[20.0] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    ("place", "name"), [("drive-end", "termination"), ("load-end", "termination"), ("conduit", "")]
)
def test_compliance_adds_to_the_cables_own(place, name):
    """Without friction all compliances are in series: 1 / K = 1 / K_cable + c."""
    c = 50e-6
    mechanism = ("termination-compliance" if name else "conduit-compliance", place, {"compliance": c})
    theta = np.linspace(0, 0.01, 3)
    r = run(theta, mechanism, mu=0.0, load=AngleLoad(np.zeros(3)))
    per_turn = (r.T1_N[-1] - T0) / (R * theta[-1])
    assert per_turn == pytest.approx(1 / (1 / 7750 + c), rel=1e-7)


def test_a_termination_yields_at_once_and_a_conduit_with_the_mean_tension():
    """Start of a pull: the cable stretches up to the front, a termination at once, a conduit by its mean tension."""
    theta = np.linspace(0, 2e-3, 20)
    plain = run(theta)
    end = run(theta, ("termination-compliance", "drive-end", {"compliance": 40e-6}))
    conduit = run(theta, ("conduit-compliance", "conduit", {"compliance": 40e-6}))
    rise = [r.T1_N[-1] - T0 for r in (plain, end, conduit)]
    assert rise[1] < 0.9 * rise[0]
    assert abs(rise[2] - rise[0]) < 0.25 * abs(rise[1] - rise[0])


def test_drive_pulley_friction_is_a_square_wave_in_tau_in_alone(base):
    torque = 4e-3
    r = run(sine(), ("pulley-friction", "drive-pulley", {"friction_torque": torque}))
    for name in DRIVE_ONLY:
        assert (getattr(r, name) == getattr(base, name)).all()
    extra = r.tau_in_Nm - base.tau_in_Nm
    omega = np.gradient(sine())
    moving = np.abs(omega) > 1.0 * PRESLIDING_RAD
    steady = moving & (np.abs(np.arange(1001) % 500 - 250) < 100)
    assert extra[steady] == pytest.approx(torque * np.sign(omega[steady]), abs=0.05 * torque)


@pytest.mark.parametrize("place", ["drive-pulley", "load-pulley"])
def test_a_bearings_friction_builds_up_over_its_presliding_angle(place):
    """Dahl's law from an unloaded bearing: after an angle theta it is 1 - exp(-theta / presliding) of all."""
    torque, presliding = 4e-3, 10e-3
    values = {"friction_torque": torque, "presliding": presliding}
    drive = np.linspace(0, 0.1, 200)
    r = run(drive, ("pulley-friction", place, values))
    if place == "drive-pulley":
        theta, extra = drive, r.tau_in_Nm - (r.T1_N - r.T3_N) * R
    else:
        theta, extra = r.theta_out_rad, (r.T2_N - r.T4_N) * R - r.tau_out_Nm
    assert extra == pytest.approx(torque * (1 - np.exp(-theta / presliding)), abs=1e-6)


@pytest.mark.parametrize("share", [0.4, 1.0])
@pytest.mark.parametrize("place", ["drive-pulley", "load-pulley"])
def test_a_share_of_a_bearings_friction_is_in_proportion_to_the_cables_pull(place, share):
    """It is 1 - share + share pull / (10 N) of the torque that is stated at 10 N."""
    torque, presliding = 4e-3, 10e-3
    values = {"friction_torque": torque, "presliding": presliding, "share": share}
    drive = np.linspace(0, 3.0, 400)
    r = run(drive, ("pulley-friction", place, values))
    if place == "drive-pulley":
        theta, pull, extra = drive, r.T1_N + r.T3_N, r.tau_in_Nm - (r.T1_N - r.T3_N) * R
    else:
        theta, pull, extra = r.theta_out_rad, r.T2_N + r.T4_N, (r.T2_N - r.T4_N) * R - r.tau_out_Nm
    assert pull.max() > 1.3 * pull.min()
    of_sliding = 1 - np.exp(-theta / presliding)
    assert extra == pytest.approx(torque * (1 - share + share * pull / 10.0) * of_sliding, abs=1e-6)


def test_a_plain_bearing_that_all_but_locks_the_load_is_solved():
    """Its friction has a lever of 0.8 radii, so that the load hardly moves; one cable goes slack."""
    values = {"friction_torque": 8.0 * R, "presliding": 2e-3, "share": 1.0}
    r = run(6 * sine(), ("pulley-friction", "load-pulley", values))
    assert r.T4_N.min() == 0.0
    balance = (r.T2_N - r.T4_N) * R - K_E * r.theta_out_rad
    assert (np.abs(balance) <= 0.8 * R * (r.T2_N + r.T4_N) * (1 + 1e-6)).all()


def test_load_pulley_friction_is_a_step_absent_from_the_loads_torque():
    torque = 4e-3
    r = run(sine(), ("pulley-friction", "load-pulley", {"friction_torque": torque}))
    assert r.tau_out_Nm == pytest.approx(K_E * r.theta_out_rad, abs=1e-9)
    extra = (r.T2_N - r.T4_N) * R - r.tau_out_Nm
    omega = np.gradient(r.theta_out_rad)
    moving = np.abs(omega) > 1.5e-3
    assert np.abs(extra).max() <= torque * (1 + 1e-6)
    assert np.median(extra[moving] * np.sign(omega[moving])) == pytest.approx(torque, rel=0.05)


@pytest.mark.parametrize("place", ["drive-pulley", "load-pulley"])
def test_eccentricity_repeats_with_the_angle(place):
    """Without friction and with a stiff pair, the cable travel is the same at both pulleys."""
    e, psi = 0.05, 0.7
    theta = np.linspace(0, 4 * np.pi, 400)
    r = run(theta, ("pulley-eccentricity", place, {"e": e, "psi": psi}), mu=0.0, k=1e9, T=50.0)
    round_, eccentric = (r.theta_out_rad, theta) if place == "drive-pulley" else (theta, r.theta_out_rad)
    travel = eccentric - e * (np.cos(eccentric + psi) - np.cos(psi))
    assert round_ == pytest.approx(travel, abs=1e-4)
    # Ideal pulleys lose no power.
    power_in = np.trapezoid(r.tau_in_Nm, theta)
    assert power_in == pytest.approx(0.5 * K_E * r.theta_out_rad[-1] ** 2, rel=1e-3)


def test_backlash_flattens_the_loads_torque_around_zero():
    b = 0.05
    r = run(sine(), ("backlash", "load-pulley", {"half_gap": b}))
    inside = np.abs(r.theta_out_rad) < b
    assert inside.sum() > 20
    assert r.tau_out_Nm[inside] == pytest.approx(0.0, abs=1e-8)
    beyond = r.theta_out_rad > b
    assert r.tau_out_Nm[beyond] == pytest.approx(K_E * (r.theta_out_rad[beyond] - b), abs=1e-9)


@pytest.mark.parametrize(
    "T2, known_to, place, side",
    [
        (7.4, 0.0, 0.0, 1.0),
        (7.2, 0.0, 0.5, -1.0),
        (7.3, 0.0, 0.5, 0.5),
        (7.4, 1.2e-3, 0.5, 0.5),  # 0.1 N on 6 mm are half of the known torque
        (7.4, 0.6e-3, 0.0, 0.5),
        (7.4, 0.6e-3, -1.0, 0.0),
    ],
)
def test_a_load_with_a_gap_rests_against_the_side_of_its_torque(T2, known_to, place, side):
    b = 0.05
    tensioned = InitialTension.between_ends(HALF_LOOP, MU, (T0, T2), (T0, T0))
    load = SpringLoad(K_E, known_to, place)
    r = run(sine(), ("backlash", "load-pulley", {"half_gap": b}), T=tensioned, load=load)
    assert r.theta_out_rad[0] == pytest.approx(R * (T2 - T0) / K_E + side * b, abs=2e-5)
    if abs(side) == 1:
        assert r.tau_out_Nm[0] == pytest.approx(R * (T2 - T0), abs=1e-6)


def test_stiffening_curves_torque_against_angle():
    r = run(sine(), ("load-stiffening", "load", {"K3": 0.05}))
    assert r.tau_out_Nm == pytest.approx(K_E * r.theta_out_rad + 0.05 * r.theta_out_rad**3, abs=1e-9)


def test_inertia_grows_with_the_square_of_the_frequency():
    extra = []
    for period in (2.0, 1.0):
        r = run(sine(cycles=3), ("load-inertia", "load", {"J": 1e-4, "zeta": 0.0}), period_s=period, mu=0.02)
        torque = r.tau_out_Nm - K_E * r.theta_out_rad
        extra.append(np.abs(np.fft.rfft(last_cycle(torque))[1]))
    assert extra[1] / extra[0] == pytest.approx(4.0, rel=0.02)


# Sensors: only the channel of the fault changes


def changed(base, r):
    return {name for name in base.read if not np.array_equal(r.read[name], base.read[name])}


@pytest.mark.parametrize("side", ["drive", "load"])
@pytest.mark.parametrize(
    ("name", "values", "channel", "expected"),
    [
        ("torque-scale", {"gain": 0.05}, "tau", lambda F, tau, t: 1.05 * tau),
        ("load-cell-scale", {"gain": -0.05}, "F", lambda F, tau, t: 0.95 * F),
        ("load-cell-offset", {"offset": 0.7}, "F", lambda F, tau, t: F + 0.7),
        ("load-cell-drift", {"rate": 0.1}, "F", lambda F, tau, t: F + 0.1 * t),
        ("load-cell-drift", {"rate": 0.1, "slowing": 1e-12}, "F", lambda F, tau, t: F + 0.1 * t),
        ("load-cell-drift", {"rate": 0.1, "slowing": 0.5}, "F", lambda F, tau, t: F + 0.2 * (1 - np.exp(-t / 2))),
        ("load-cell-crosstalk", {"crosstalk": 0.08}, "F", lambda F, tau, t: F + 0.08 * tau / R),
    ],
)
def test_a_sensor_fault_shows_in_one_channel(base, side, name, values, channel, expected):
    r = run(sine(), (name, f"{side}-sensor", values))
    torque = {"drive": "tau_in_Nm", "load": "tau_out_Nm"}[side]
    wanted = torque if channel == "tau" else f"F_{side}_N"
    assert changed(base, r) == {wanted}
    reading = expected(base.read[f"F_{side}_N"], base.read[torque], base.time_s)
    assert r.read[wanted] == pytest.approx(reading, rel=1e-12)
    assert (base.T1_N == r.T1_N).all()


def test_a_fastening_that_hardly_yields_is_rigid():
    """Its tension would be the rounding error of a difference of positions."""
    rigid = run(sine())
    for compliance in (1e-18, 1e-13, 1e-10, 2e-10):
        found = run(sine(), ("termination-compliance", "drive-end", {"compliance": compliance}))
        assert found.status is Status.OK
        assert pytest.approx(rigid.T1_N, abs=1e-4) == found.T1_N


def test_a_late_drive_ends_as_its_load_went_on():
    """Of the last samples, which a recording on the drive's clock does not show, the rate is known and no more."""
    theta, delay = np.linspace(0.0, 0.5, 200), 0.05
    whole, late = run(theta), run(theta, ("time-skew", "drive-sensor", {"delay": delay}))
    rate = np.diff(whole.theta_out_rad)[-1] / np.diff(late.time_s)[-1]
    assert late.read["theta_out_rad"][-1] == pytest.approx(whole.theta_out_rad[-1] + rate * delay)


def test_skewed_clocks_shift_one_side_against_the_other(base):
    steps = 6
    delay = steps / 500
    load = run(sine(), ("time-skew", "load-sensor", {"delay": delay}))
    drive = run(sine(), ("time-skew", "drive-sensor", {"delay": delay}))
    assert changed(base, load) == changed(base, drive) == {"theta_out_rad", "tau_out_Nm", "F_load_N"}
    assert load.read["F_load_N"][steps:] == pytest.approx(base.read["F_load_N"][:-steps], abs=1e-9)
    assert drive.read["F_load_N"][:-steps] == pytest.approx(base.read["F_load_N"][steps:], abs=1e-9)


def test_order_of_sensor_faults_is_the_order_given(base):
    gain, offset = (
        ("load-cell-scale", "drive-sensor", {"gain": 0.1}),
        ("load-cell-offset", "drive-sensor", {"offset": 1.0}),
    )
    a, b = run(sine(), [gain, offset]), run(sine(), [offset, gain])
    assert b.read["F_drive_N"] - a.read["F_drive_N"] == pytest.approx(0.1, abs=1e-9)


def test_return_point_memory_with_presliding():
    """A nested loop closes on itself, and the outer loop continues as without it."""
    mechanism = ("presliding", "conduit", {"z0": 20e-6})
    corners = [0.0, 0.5, 0.3, 0.5, 0.6]
    nested = np.concatenate([np.linspace(a, b, 100, endpoint=False) for a, b in itertools.pairwise(corners)])
    r, direct = run(np.append(nested, 0.6), mechanism), run(np.linspace(0, 0.6, 400), mechanism)
    assert r.T1_N[-1] == pytest.approx(direct.T1_N[-1], rel=2e-3)
    assert rms(r.T1_N[[100]], r.T1_N[[300]]) < 5e-3 * T0


def test_uneven_initial_tension_under_every_friction_law_stays_at_rest():
    initial = InitialTension.between_ends(HALF_LOOP, 0.6 * MU, (8.0, 6.0), (6.5, 7.0))
    for mechanism in (
        ("presliding", "conduit", {"z0": 50e-6}),
        ("load-dependent-friction", "conduit", {"n": -0.1}),
        ("stribeck", "conduit", {"a": 0.3, "vs": 1e-3}),
        ("constant-drag", "conduit", {"f0": 0.3}),
    ):
        r = run(np.zeros(5), mechanism, T=initial)
        profile = [initial.tension_A_N[0], initial.tension_A_N[-1], initial.tension_B_N[0], initial.tension_B_N[-1]]
        assert [getattr(r, name)[-1] for name in TENSIONS] == pytest.approx(profile, rel=1e-6), mechanism


def test_path_of_many_pieces_takes_every_conduit_effect():
    path = ConduitPath(np.full(6, L / 6), [0, 1, 0.2, 0, 1.5, 0])
    for mechanism in (("kink", "conduit", {"beta": 0.5, "s": 0.3}), ("constant-drag", "conduit", {"f0": 1.0})):
        coarse, fine = run(sine(), mechanism, path=path), run(sine(), mechanism, path=path, elements=128)
        assert rms(coarse.T1_N, fine.T1_N) < 2e-3 * np.ptp(fine.T1_N)
