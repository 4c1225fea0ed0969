"""What the exact solver must not depend on, what it must remember, and what holds at every sample of any motion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccmodel.geometry import ConduitPath
from ccmodel.model.exact import PHASES, Status, simulate_pair
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission

TENSIONS = ("T1_N", "T2_N", "T3_N", "T4_N")
EA = 2000.0
PATH = ConduitPath([0.4, 0.8, 0.3, 0.5], [0.0, 3.0, 0.0, 2.0])


def transmission(path=PATH, mu=0.15, drive=0.012, load=0.01):
    return Transmission(path, EA, mu, drive, load)


def tensions(response):
    return np.stack([getattr(response, name) for name in TENSIONS])


def refined(knots, steps):
    at = np.linspace(0, knots.size - 1, (knots.size - 1) * steps + 1)
    return np.interp(at, np.arange(knots.size), knots)


motions = st.lists(st.floats(-2, 2), min_size=2, max_size=8).map(lambda knots: np.array([0.0, *knots]))


@st.composite
def paths(draw):
    pieces = draw(
        st.lists(st.tuples(st.floats(0.05, 1), st.sampled_from([0.0, 0.01, 1.0, 4.0])), min_size=1, max_size=6)
    )
    return ConduitPath(*np.array(pieces).T)


@st.composite
def profiles(draw, path, mu):
    """An initial tension that friction can hold, corners anywhere."""
    inner = sorted(set(draw(st.lists(st.integers(1, 19), max_size=4))))
    x = path.length_m * np.array([0, *inner, 20]) / 20
    m = mu * path.bend_at(x)
    both = []
    for _ in range(2):
        slopes = np.array([draw(st.sampled_from([-1.0, -0.5, 0.0, 0.3, 1.0])) for _ in range(x.size - 1)])
        level = draw(st.sampled_from([0.5, 3.0, 10.0]))
        both.append(level * np.exp(np.concatenate([[0.0], np.cumsum(slopes * np.diff(m))])))
    return InitialTension(x, *both)


@st.composite
def cases(draw):
    path, mu = draw(paths()), draw(st.sampled_from([0.0, 0.03, 0.15, 0.4]))
    stiffness = draw(st.sampled_from([0.0, 1e-3, 0.1, 10.0]))
    one = transmission(path, mu, draw(st.sampled_from([0.006, 0.012])), 0.01)
    return one, SpringLoad(stiffness), draw(profiles(path, mu)), draw(motions)


@settings(max_examples=150, deadline=None)
@given(cases())
def test_invariants_of_any_run(case):
    one, load, initial, knots = case
    theta = refined(knots, 7)
    every = range(theta.size)
    response = simulate_pair(one, load, theta, initial, record_profiles_at=every)
    assert response.status is Status.OK
    T = tensions(response)
    assert np.isfinite(T).all() and (T >= 0).all()
    scale = max(T.max(), 1.0)
    assert response.tau_out_Nm == pytest.approx(
        load.stiffness_Nm_per_rad * response.theta_out_rad, abs=1e-11 * scale * one.load_radius_m
    )
    e0 = None
    for i in every:
        for c, (profile, near, far) in enumerate(zip(response.profiles[i], T[::2, i], T[1::2, i], strict=True)):
            tension = profile.tension_N
            assert tension[[0, -1]] == pytest.approx([near, far], rel=1e-12, abs=1e-12)
            stretch = stretch_of(profile) / EA
            moved = (1 - 2 * c) * (theta[i] * one.drive_radius_m - response.theta_out_rad[i] * one.load_radius_m)
            if i == 0 and c == 0:
                e0 = [None, None]
            if i == 0:
                e0[c] = stretch - moved
            if tension.min() > 0:
                bound = one.friction_coefficient * np.diff(profile.bend_rad)
                assert (np.abs(np.diff(np.log(tension))) <= bound + 1e-12).all()
                assert stretch == pytest.approx(e0[c] + moved, abs=1e-13 + 1e-12 * abs(moved))
            else:
                assert tension.max() == 0 and e0[c] + moved <= 1e-13


def stretch_of(profile):
    """Integral of T over arc length; ln T is linear in x between the profile's points."""
    T0, T1 = profile.tension_N[:-1], profile.tension_N[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        rise = np.log(T1 / T0)
        mean = np.where(np.abs(rise) > 1e-5, (T1 - T0) / rise, np.sqrt(np.abs(T0 * T1)) * (1 + rise**2 / 24))
    return float((np.where(T0 == T1, T0, mean) * np.diff(profile.x_m)).sum())


@settings(max_examples=60, deadline=None)
@given(cases())
def test_one_step_or_many_is_the_same(case):
    one, load, initial, knots = case
    coarse = simulate_pair(one, load, knots, initial)
    fine = simulate_pair(one, load, refined(knots, 50), initial)
    assert tensions(coarse) == pytest.approx(tensions(fine)[:, ::50], rel=1e-11, abs=1e-11)
    assert coarse.theta_out_rad == pytest.approx(fine.theta_out_rad[::50], rel=1e-11, abs=1e-13)


@pytest.mark.parametrize("pretension", [0.7, 3.5, 10.0])
def test_one_large_step_or_ten_thousand_small_ones(pretension):
    knots = np.array([0, 1, -1, 0.3, -0.2, 0.1, -1.5])
    initial = InitialTension.uniform(PATH, pretension)
    coarse = simulate_pair(transmission(), SpringLoad(0.003), knots, initial)
    fine = simulate_pair(transmission(), SpringLoad(0.003), refined(knots, 10_000), initial)
    assert tensions(coarse) == pytest.approx(tensions(fine)[:, ::10_000], rel=1e-11)
    assert coarse.theta_out_rad == pytest.approx(fine.theta_out_rad[::10_000], rel=1e-11)


@settings(max_examples=60, deadline=None)
@given(cases())
def test_splitting_a_piece_changes_nothing(case):
    one, load, initial, knots = case
    split = ConduitPath(np.repeat(one.path.piece_length_m / 2, 2), np.repeat(one.path.piece_bend_rad / 2, 2))
    other = Transmission(split, EA, one.friction_coefficient, one.drive_radius_m, one.load_radius_m)
    a, b = (tensions(simulate_pair(t, load, knots, initial)) for t in (one, other))
    assert a == pytest.approx(b, abs=1e-12 * max(a.max(), 1))


@settings(max_examples=60, deadline=None)
@given(cases())
def test_mirror(case):
    one, load, initial, knots = case
    swapped = InitialTension(initial.x_m, initial.tension_B_N, initial.tension_A_N)
    a = simulate_pair(one, load, knots, initial)
    b = simulate_pair(one, load, -knots, swapped)
    assert tensions(a) == pytest.approx(tensions(b)[[2, 3, 0, 1]], rel=1e-12, abs=1e-12)
    assert a.theta_out_rad == pytest.approx(-b.theta_out_rad, rel=1e-12, abs=1e-15)
    assert (a.phase == b.phase).all()


def test_units_scale_out():
    knots = np.array([0, 1, -0.7, 0.4, -1.2])
    a = simulate_pair(transmission(), SpringLoad(0.003), knots, InitialTension.uniform(PATH, 3.0))
    stiffer = Transmission(PATH, 8 * EA, 0.15, 0.012, 0.01)
    b = simulate_pair(stiffer, SpringLoad(0.024), knots, InitialTension.uniform(PATH, 24.0))
    assert tensions(b) == pytest.approx(8 * tensions(a), rel=1e-13)
    assert b.theta_out_rad == pytest.approx(a.theta_out_rad, rel=1e-13)


@pytest.mark.parametrize("radius", [0.05, 0.1, 0.2])
def test_full_slip_ratio_depends_on_the_bend_alone(radius):
    bend = np.pi
    path = ConduitPath([0.3, radius * bend, 0.9 - radius * bend], [0.0, bend, 0.0])
    response = simulate_pair(
        transmission(path), SpringLoad(0.01), np.array([0, 1.5]), InitialTension.uniform(path, 7.0)
    )
    assert PHASES[response.phase[-1]] == "III"
    assert np.log(response.T1_N[-1] / response.T2_N[-1]) == pytest.approx(0.15 * bend, rel=1e-13)
    assert np.log(response.T4_N[-1] / response.T3_N[-1]) == pytest.approx(0.15 * bend, rel=1e-13)


def test_nested_loops_close_and_are_forgotten():
    initial = InitialTension.uniform(PATH, 10.0)
    nested = np.array([0, 1, -0.4, 0.3, -0.1, 0.05, -0.02, 0.05, -0.1, 0.3, -0.4, 1])
    T = tensions(simulate_pair(transmission(), SpringLoad(0.003), nested, initial))
    for i, j in ((5, 7), (4, 8), (3, 9), (2, 10), (1, 11)):
        assert T[:, i] == pytest.approx(T[:, j], rel=1e-12)
    # once the outer loop is closed nothing remains of the inner ones
    after = np.array([-0.8, 0.6])
    with_history = tensions(simulate_pair(transmission(), SpringLoad(0.003), np.concatenate([nested, after]), initial))
    without = tensions(simulate_pair(transmission(), SpringLoad(0.003), np.concatenate([[0, 1], after]), initial))
    assert with_history[:, -2:] == pytest.approx(without[:, -2:], rel=1e-12)


def test_thousands_of_nested_reversals_need_no_fixed_room():
    amplitude = 0.12 * np.linspace(1, 0, 4001)[:4000]
    theta = np.concatenate([[0.0], amplitude * (-1) ** np.arange(4000)])
    there_and_back = np.concatenate([theta, theta[-2:0:-1]])
    response = simulate_pair(transmission(), SpringLoad(0.003), there_and_back, InitialTension.uniform(PATH, 10.0))
    assert response.status is Status.OK
    T = tensions(response)
    assert T[:, 2:4000] == pytest.approx(T[:, -2:-4000:-1], rel=1e-9)


def test_two_thousand_cycles_do_not_drift():
    theta = np.tile([0.0, 1.0, 0.0, -1.0], 2000)
    T = tensions(simulate_pair(transmission(), SpringLoad(0.003), theta, InitialTension.uniform(PATH, 3.0)))
    assert T[:, 4:8] == pytest.approx(T[:, -4:], abs=1e-12)


def test_phases_in_order_and_slack_through_a_reversal():
    theta = refined(np.array([0, 1, -1, 1.0]), 500)
    seen = {
        t0: simulate_pair(transmission(), SpringLoad(k), theta, InitialTension.uniform(PATH, t0)).phase
        for t0, k in ((10.0, 0.003), (3.5, 0.2), (0.7, 0.2))
    }
    stroke = seen[10.0][501:1001]
    assert (np.diff(stroke) >= 0).all() and set(stroke) == {0, 1, 2}
    assert PHASES.index("IVa") in seen[3.5]
    assert PHASES.index("IVb") in seen[0.7]


def test_a_start_out_of_balance_settles_with_the_drive_at_rest():
    x = np.array([0, PATH.length_m])
    initial = InitialTension(x, [12.0, 9.0], [8.0, 7.0])
    response = simulate_pair(transmission(), SpringLoad(0.0), np.array([0.0, 0.1]), initial)
    assert response.status is Status.OK
    assert response.theta_out_rad[0] > 0
    assert response.tau_out_Nm == pytest.approx(0.0, abs=1e-15)
    assert response.T4_N[0] == pytest.approx(response.T2_N[0], rel=1e-12)
    assert 7.0 < response.T4_N[0] < 9.0


def test_a_spring_starts_where_it_holds_the_initial_tensions():
    initial = InitialTension(np.array([0, PATH.length_m]), [12.0, 9.0], [8.0, 7.0])
    response = simulate_pair(transmission(), SpringLoad(0.003), np.array([0.0, 0.1]), initial)
    assert tensions(response)[:, 0] == pytest.approx([12.0, 9.0, 8.0, 7.0], rel=1e-12)
    assert response.theta_out_rad[0] == pytest.approx((9.0 - 7.0) * transmission().load_radius_m / 0.003, rel=1e-12)
    assert response.tau_out_Nm == pytest.approx(0.003 * response.theta_out_rad, rel=1e-12)


def test_inputs_that_cannot_be_are_refused():
    initial = InitialTension.uniform(PATH, 5.0)
    with pytest.raises(ValueError, match="finite"):
        simulate_pair(transmission(), SpringLoad(0.1), np.array([0, np.nan]), initial)
    with pytest.raises(ValueError, match="unit"):
        simulate_pair(
            transmission(ConduitPath([1.0], [9000.0])),
            SpringLoad(0.1),
            [0.0],
            InitialTension.uniform(ConduitPath([1.0], [9000.0]), 1.0),
        )
    with pytest.raises(ValueError, match="friction cannot hold"):
        steep = InitialTension([0, PATH.length_m], [10.0, 1.0], [10.0, 10.0])
        simulate_pair(transmission(), SpringLoad(0.1), np.zeros(2), steep)
    with pytest.raises(ValueError, match="positive along the whole"):
        InitialTension([0, 1.0], [0.0, 1.0], [1.0, 1.0])


def test_a_start_far_out_of_balance_settles_alike_on_a_path_in_more_pieces():
    initial = InitialTension([0.0, 5.0], [3.0, 3.0], 10.0 * np.exp([0.0, -0.03]))
    whole = ConduitPath(np.ones(5), [0.0, 0.0, 0.0, 1.0, 1.0])
    split = ConduitPath(np.full(10, 0.5), np.repeat([0.0, 0.0, 0.0, 0.5, 0.5], 2))
    a, b = (simulate_pair(transmission(p, 0.03), SpringLoad(0.0), np.zeros(1), initial) for p in (whole, split))
    assert tensions(a) == pytest.approx(tensions(b), rel=1e-13)
