"""Both ends drawn apart or let in at once: the point that stays still, against an independent integration."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model.exact import MotionEnd, SpringEnd, Status, pair, simulate_cable, simulate_pair
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, SpringLoad, TorqueLoad
from ccmodel.model.transmission import Transmission

MU, EA = 0.15, 2000.0
PATH = ConduitPath([0.6, 0.9, 0.5], [2.0, 1.0, 3.0])


def still_point_by_scipy(path, initial_m, elongation, a, b, sigma):
    """m of the still point after the ends have gone out by a and b, from m and elongation, one piece at a time."""
    node_x = np.concatenate([[0], np.cumsum(path.piece_length_m)])
    node_m = MU * np.concatenate([[0], np.cumsum(path.piece_bend_rad)])
    total = node_m[-1]

    def compliance(low, high, value):
        points = [m for m in node_m if low < m < high]

        def integrand(m):
            x_per_m = np.interp(m, node_m, np.arange(node_m.size))
            i = min(int(x_per_m), node_m.size - 2)
            return value(m) * (node_x[i + 1] - node_x[i]) / (node_m[i + 1] - node_m[i]) / EA

        edges = [low, *points, high]
        return sum(quad(integrand, p, q, epsabs=1e-16, epsrel=1e-13)[0] for p, q in itertools.pairwise(edges))

    def rate(s, y):
        m = y[0]
        left = compliance(0, m, lambda v: np.exp(sigma * (m - v)))
        right = compliance(m, total, lambda v: np.exp(sigma * (v - m)))
        lowest = (elongation + s * (a + b)) / (left + right)
        return [sigma * (a / (left * lowest) - b / (right * lowest)) / 2]

    return solve_ivp(rate, (0, 1), [initial_m], method="DOP853", rtol=1e-12, atol=1e-13).y[0, -1]


@pytest.mark.parametrize("sigma", [1, -1])
def test_still_point_wanders_as_an_independent_integration_says(sigma):
    initial = InitialTension.uniform(PATH, 30.0)
    a1, b1, a2, b2 = sigma * np.array([0.008, 0.009, 0.005, 0.0015])
    near, far = np.array([0, a1, a1 + a2]), np.array([0, b1, b1 + b2])
    response = simulate_cable(PATH, EA, MU, MotionEnd(-far), near, initial)
    x1, x2 = response.moving_m[1:, 0]
    assert response.moving_m[1, 0] == response.moving_m[1, 1]
    m1, m2 = MU * PATH.bend_at(np.array([x1, x2]))
    e1 = 30.0 * 2.0 / EA + a1 + b1
    assert m2 == pytest.approx(still_point_by_scipy(PATH, m1, e1, a2, b2, sigma), abs=1e-10)
    # T1 / T2 follows from where the still point is
    total = MU * PATH.bend_rad
    assert np.log(response.T_near_N[2] / response.T_far_N[2]) == pytest.approx(sigma * (2 * m2 - total), abs=1e-12)


@pytest.mark.parametrize("sigma", [1, -1])
@pytest.mark.parametrize("bends", [[2.0, 1.0, 3.0], [2.0, 0.0, 3.0], [0.0, 2.0, 0.0], [3.0, 0.0, 0.0]])
def test_one_step_or_many_on_a_straight_way(sigma, bends):
    path = ConduitPath([0.6, 0.9, 0.5], bends)
    initial = InitialTension.uniform(path, 30.0)
    knots = sigma * 0.01 * np.array([[0, 1, 1.5, 3.0], [0, 0.4, 2.0, 2.3]])
    fine = np.linspace(0, 3, 3001)
    near, far = (np.interp(fine, range(4), k) for k in knots)
    one = simulate_cable(path, EA, MU, MotionEnd(-knots[1]), knots[0], initial)
    many = simulate_cable(path, EA, MU, MotionEnd(-far), near, initial)
    assert one.T_near_N == pytest.approx(many.T_near_N[::1000], rel=1e-10)
    assert one.T_far_N == pytest.approx(many.T_far_N[::1000], rel=1e-10)


def test_the_order_of_displacements_matters():
    initial = InitialTension.uniform(PATH, 10.0)
    ways = ([0, 1, 1], [0, 0, 1]), ([0, 0, 1], [0, 1, 1]), ([0, 0.5, 1], [0, 0.5, 1])
    last = [
        simulate_cable(PATH, EA, MU, MotionEnd(-0.02 * np.array(far)), 0.02 * np.array(near), initial).T_near_N[-1]
        for near, far in ways
    ]
    assert np.ptp(last) > 1.0


def test_from_slack_the_still_point_starts_where_both_shares_agree():
    path = ConduitPath([1.0], [3.0])
    slack = InitialTension([0.0, 1.0], [0.0, 0.0], [0.0, 0.0])
    s = np.linspace(0, 1, 11)
    response = simulate_cable(path, EA, MU, MotionEnd(-0.01 * s), 0.01 * s, slack)
    assert response.moving_m[1:] == pytest.approx(0.5, abs=1e-9)
    stretch = 2 * np.expm1(MU * 1.5) / (MU * 3.0) / EA  # of the V, per lowest tension
    assert response.T_near_N == pytest.approx(0.02 * s / stretch * np.exp(MU * 1.5), rel=1e-9, abs=1e-12)


PAIR = Transmission(ConduitPath([0.4, 0.8, 0.3, 0.5], [0.0, 3.0, 0.0, 2.0]), EA, MU, 0.012, 0.01)


@pytest.mark.parametrize("pretension", [2.0, 10.0])
@pytest.mark.parametrize("per_cycle", [37, 200, 1000])
def test_measured_torque_and_angle_give_back_the_springs_response(pretension, per_cycle):
    initial = InitialTension.uniform(PAIR.path, pretension)
    theta = 0.9 * np.sin(2 * np.pi * np.arange(3 * per_cycle) / per_cycle)
    spring = simulate_pair(PAIR, SpringLoad(0.003), theta, initial)
    by_angle = simulate_pair(PAIR, AngleLoad(spring.theta_out_rad), theta, initial)
    by_torque = simulate_pair(PAIR, TorqueLoad(spring.tau_out_Nm), theta, initial)
    for name in ("T1_N", "T2_N", "T3_N", "T4_N"):
        scale = np.abs(getattr(spring, name)).max()
        assert getattr(by_angle, name) == pytest.approx(getattr(spring, name), abs=2e-2 * scale)
        if pretension == 10.0:
            assert getattr(by_torque, name) == pytest.approx(getattr(spring, name), abs=2e-2 * scale)
    assert by_torque.status is by_angle.status is Status.OK
    assert by_torque.tau_out_Nm == pytest.approx(spring.tau_out_Nm, abs=1e-11)


def test_a_given_torque_against_the_drive_is_balanced_at_every_sample():
    rng = np.random.default_rng(0)
    for _ in range(20):
        theta, torque = 0.3 * rng.normal(size=60), 0.02 * rng.normal(size=60)
        response = simulate_pair(PAIR, TorqueLoad(torque), theta, InitialTension.uniform(PAIR.path, 10.0))
        assert response.status is Status.OK
        assert response.tau_out_Nm == pytest.approx(torque, abs=1e-11)
        tensions = np.stack([response.T1_N, response.T2_N, response.T3_N, response.T4_N])
        assert (tensions >= 0).all()


def test_given_torque_finer_steps_change_little():
    knots_theta, knots_torque = np.array([0, 0.5, 0.3, 0.9, 0.2]), 0.01 * np.array([0, 1.0, -1.5, 2.0, 2.5])
    fine = np.linspace(0, 4, 4 * 500 + 1)
    initial = InitialTension.uniform(PAIR.path, 10.0)
    one = simulate_pair(PAIR, TorqueLoad(knots_torque), knots_theta, initial)
    theta, torque = (np.interp(fine, range(5), k) for k in (knots_theta, knots_torque))
    many = simulate_pair(PAIR, TorqueLoad(torque), theta, initial)
    for name in ("T1_N", "T2_N", "T3_N", "T4_N", "theta_out_rad"):
        assert getattr(one, name) == pytest.approx(getattr(many, name)[::500], abs=1e-8)


def test_a_far_force_a_cable_cannot_push_is_said():
    from ccmodel.model.exact import ForceEnd

    force = np.array([10.0, 5.0, -1.0])
    response = simulate_cable(PATH, EA, MU, ForceEnd(force), np.zeros(3), InitialTension.uniform(PATH, 10.0))
    assert response.status is Status.UNBALANCED
    assert "only pull" in response.status.value
    assert np.isfinite(response.T_near_N).all()
    assert (
        simulate_cable(PATH, EA, MU, SpringEnd(0.0), np.zeros(3), InitialTension.uniform(PATH, 1.0)).status is Status.OK
    )


def violent(seed, samples=40):
    """A pair and a load that jumps about as much as the drive, by torque (odd seeds) or by angle."""
    rng = np.random.default_rng(seed)
    pieces = rng.integers(1, 6)
    bends = rng.choice([0.0, 0.5, 1.0, 2.0, 4.0], pieces)
    one = Transmission(ConduitPath(rng.uniform(0.05, 1, pieces), bends), EA, rng.choice([0.03, 0.1, 0.15, 0.3]), 0.012,
                       0.01)  # fmt: skip
    theta = rng.normal(size=samples) * rng.choice([0.1, 0.5, 2.0])
    initial = InitialTension.uniform(one.path, rng.choice([0.5, 3.0, 10.0]))
    load = rng.normal(size=samples)
    if seed % 2:
        return one, TorqueLoad(load * rng.choice([0.003, 0.02, 0.1])), theta, initial
    return one, AngleLoad(load * rng.choice([0.1, 0.5, 2.0])), theta, initial


@pytest.mark.parametrize("seed", [*range(40), 205, 299, 383])
def test_violent_loads_never_stop_it(seed):
    one, load, theta, initial = violent(seed)
    response = simulate_pair(one, load, theta, initial)
    assert response.status is not Status.STUCK
    tensions = np.stack([response.T1_N, response.T2_N, response.T3_N, response.T4_N])
    assert np.isfinite(tensions).all() and (tensions >= 0).all()
    bound = one.friction_coefficient * one.path.bend_rad
    for near, far in (tensions[:2], tensions[2:]):
        taut = (near > 1e-6) & (far > 1e-6)
        assert (np.abs(np.log(near[taut] / far[taut])) <= bound + 1e-9).all()


def test_a_front_that_sets_out_beside_a_still_point_at_the_load_takes_many_events_but_not_for_ever():
    assert simulate_pair(*violent(383, 1000)).status is Status.OK


@pytest.mark.parametrize("seed", [9, 15, 293])
def test_a_sample_that_wants_too_many_steps_is_given_up_with_advice(seed, monkeypatch):
    monkeypatch.setattr(pair, "MAX_STEPS", 100)
    response = simulate_pair(*violent(seed))
    assert response.status is Status.STUCK
    assert response.reached == response.T1_N.size < 40
    assert np.isfinite(response.T1_N).all()
    with pytest.raises(ModelError, match=f"stuck at sample {response.reached}: .*sample the drive"):
        response.complete()
