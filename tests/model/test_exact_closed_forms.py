"""The exact solver against what the capstan equation gives in closed form: one bend of radius R = L / phi."""

import numpy as np
import pytest

from cable_runs import FIXED, simulate_cable
from ccmodel.geometry import ConduitPath
from ccmodel.model.exact import Status
from ccmodel.model.initial import InitialTension

LENGTH, BEND, MU, EA = 2.0, 3 * np.pi, 0.15, 2000.0
PATH = ConduitPath([LENGTH], [BEND])
M = MU * BEND
COMPLIANCE = LENGTH / (M * EA)  # dx / (EA d(mu phi))


def line(T1, slope):
    """A sliding line as an initial profile, from the drive end's tension."""
    ends = T1 * np.exp([0.0, slope * M])
    return InitialTension([0.0, LENGTH], ends, ends)


def run(displacement, initial, far_stiffness=FIXED):
    response = simulate_cable(PATH, EA, MU, far_stiffness, np.asarray(displacement), initial)
    assert response.status is Status.OK
    return response


@pytest.mark.parametrize("y", [1e-8, 1e-4, 0.03, 0.5, 0.99 * M])
def test_first_loading_from_uniform_pretension(y):
    # T1 = T0 exp(y) once the front has run through y = mu phi; stretch is the integral of T1 exp(-mu phi) - T0
    T0 = 10.0
    series = sum(y**n / np.prod(np.arange(1.0, n + 1)) for n in range(2, 30))
    response = run([0.0, COMPLIANCE * T0 * series], InitialTension.uniform(PATH, T0))
    assert response.T_near_N[-1] == pytest.approx(T0 * np.exp(y), rel=1e-12)
    assert response.T_near_N[-1] - T0 == pytest.approx(T0 * np.expm1(y), rel=1e-12, abs=1e-15 * T0)
    assert response.T_far_N[-1] == T0
    assert response.moving_m[-1] == pytest.approx([LENGTH * y / M, LENGTH], rel=1e-12)


@pytest.mark.parametrize("y", [1e-6, 1e-3, 0.03, 0.5, 0.99 * M])
def test_unloading_a_pulled_cable(y):
    # the release's line exp(+mu phi) meets the pull's exp(-mu phi) at y: T1 = Tm exp(-2 y)
    Tm = 25.0
    response = run([0.0, -COMPLIANCE * Tm * np.expm1(-y) ** 2], line(Tm, -1))
    assert response.T_near_N[-1] == pytest.approx(Tm * np.exp(-2 * y), rel=1e-12)
    assert response.T_far_N[-1] == pytest.approx(Tm * np.exp(-M), rel=1e-15)


@pytest.mark.parametrize("y", [1e-6, 1e-3, 0.03, 0.5, 0.99 * M])
def test_loading_again_after_a_release(y):
    Tm = 3.0
    response = run([0.0, COMPLIANCE * Tm * np.expm1(y) ** 2], line(Tm, +1))
    assert response.T_near_N[-1] == pytest.approx(Tm * np.exp(2 * y), rel=1e-12)


def test_lost_motion_before_the_far_end_feels_a_reversal():
    Tm = 25.0
    lost = COMPLIANCE * Tm * np.expm1(-M) ** 2
    displacement = -lost * np.array([0.0, 1 - 1e-12, 1.0, 1 + 1e-12, 1.1, 1.2])
    response = run(displacement, line(Tm, -1))
    assert response.T_far_N[1] == Tm * np.exp(-M)
    assert response.T_far_N[3] < Tm * np.exp(-M)
    assert response.T_near_N[2] == pytest.approx(Tm * np.exp(-2 * M), rel=1e-12)
    # and where the straight line of the full slip that follows begins
    per_m = np.diff(response.T_far_N[4:])[0] / np.diff(displacement[4:])[0]
    begins = displacement[4] + (Tm * np.exp(-M) - response.T_far_N[4]) / per_m
    assert begins == pytest.approx(-lost, rel=1e-12)


@pytest.mark.parametrize(
    ("direction", "stiffness"), [(1, 1 / (-np.expm1(-M) * COMPLIANCE)), (-1, 1 / (np.expm1(M) * COMPLIANCE))]
)
def test_apparent_stiffness_in_full_slip_differs_by_direction(direction, stiffness):
    response = run(np.array([0.0, 1.0, 2.0]) * direction * 1e-4, line(40.0, -direction))
    assert np.diff(response.T_near_N) == pytest.approx(direction * 1e-4 * stiffness, rel=1e-12)
    assert response.T_far_N / response.T_near_N == pytest.approx(np.exp(-direction * M), rel=1e-14)


@pytest.mark.parametrize("direction", [1, -1])
def test_full_slip_against_a_spring(direction):
    k, T1 = 700.0, 20.0
    step = direction * 3e-3
    response = run([0.0, step], line(T1, -direction), k)
    along = -direction * np.expm1(-direction * M) * COMPLIANCE  # stretch per near tension
    ratio = np.exp(-direction * M)
    rise = step / (along + ratio / k)
    assert response.T_near_N[-1] - T1 == pytest.approx(rise, rel=1e-12)
    assert response.T_far_N[-1] == pytest.approx((T1 + rise) * ratio, rel=1e-12)
    assert response.far_displacement_m[-1] == pytest.approx(rise * ratio / k, rel=1e-12)


@pytest.mark.parametrize("y", [0.01, 0.4, 0.9 * M])
def test_unloading_and_loading_against_a_spring_before_it_is_felt(y):
    Tm = 25.0
    response = run([0.0, -COMPLIANCE * Tm * np.expm1(-y) ** 2], line(Tm, -1), 300.0)
    assert response.T_near_N[-1] == pytest.approx(Tm * np.exp(-2 * y), rel=1e-12)
    assert response.far_displacement_m[-1] == 0.0
    response = run([0.0, COMPLIANCE * Tm * np.expm1(y) ** 2], line(Tm, +1), 300.0)
    assert response.T_near_N[-1] == pytest.approx(Tm * np.exp(2 * y), rel=1e-12)
    assert response.far_displacement_m[-1] == 0.0


@pytest.mark.parametrize("y", [0.01, 0.4, 0.9 * M])
def test_first_loading_and_unloading_in_turn_before_the_far_end_feels_it(y):
    # pulled to y, released by half of it, pulled again: the point of return, and then the first loading goes on
    T0, z = 10.0, 0.5 * y
    pulled = COMPLIANCE * T0 * (np.expm1(y) - y)
    released = pulled - COMPLIANCE * T0 * np.exp(y) * np.expm1(-z) ** 2
    for stiffness in (FIXED, 300.0):
        response = run([0.0, pulled, released, pulled], InitialTension.uniform(PATH, T0), stiffness)
        expected = T0 * np.exp([0.0, y, y - 2 * z, y])
        assert response.T_near_N == pytest.approx(expected, rel=1e-12)
        assert (response.T_far_N == T0).all()


def test_spring_follows_through_unloading_and_loading():
    # pulled through, released through, pulled through: each time from one line to the other and then on it
    k, T1 = 300.0, 20.0
    e0 = -np.expm1(-M) * COMPLIANCE * T1
    for target in (-0.12, -0.25):
        response = run([0.0, target, 0.1], line(T1, -1), k)
        far0 = T1 * np.exp(-M)
        # released: T2 = T1 exp(M); e = e0 + d - q; T2 = far0 + k q
        e_per_T2 = np.expm1(M) * COMPLIANCE * np.exp(-M)
        T2 = (far0 + k * (e0 + target)) / (1 + k * e_per_T2)
        if T2 > 0:
            assert response.T_far_N[1] == pytest.approx(T2, rel=1e-12)
        else:
            assert response.T_far_N[1] == 0.0
            assert response.far_displacement_m[1] == pytest.approx(-far0 / k, rel=1e-12)
        e_per_T2 = -np.expm1(-M) * COMPLIANCE * np.exp(M)
        T2 = (far0 + k * (e0 + 0.1)) / (1 + k * e_per_T2)
        assert response.T_far_N[2] == pytest.approx(T2, rel=1e-12)


@pytest.mark.parametrize("k", [FIXED, 500.0])
def test_without_friction_tension_is_uniform(k):
    displacement = 0.01 * np.sin(np.linspace(0, 20, 101))
    response = simulate_cable(PATH, EA, 0.0, k, displacement, InitialTension.uniform(PATH, 10.0))
    expected = np.maximum(10.0 + displacement / (LENGTH / EA + 1 / k), 0.0)
    assert response.T_near_N == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert (response.T_near_N == response.T_far_N).all()


def test_a_straight_path_is_a_path_without_friction():
    straight = ConduitPath([1.0, 1.0], [0.0, 0.0])
    displacement = 0.01 * np.sin(np.linspace(0, 20, 101))
    initial = InitialTension.uniform(straight, 10.0)
    one = simulate_cable(straight, EA, 0.3, FIXED, displacement, initial)
    other = simulate_cable(PATH, EA, 0.0, FIXED, displacement, initial)
    assert one.T_near_N == pytest.approx(other.T_near_N, rel=1e-14)


@pytest.mark.parametrize("mu", [1e-12, 1e-9, 1e-6])
def test_little_friction_tends_to_none(mu):
    displacement = 0.01 * np.sin(np.linspace(0, 20, 101))
    initial = InitialTension.uniform(PATH, 10.0)
    one = simulate_cable(PATH, EA, mu, 300.0, displacement, initial)
    other = simulate_cable(PATH, EA, 0.0, 300.0, displacement, initial)
    assert one.T_near_N == pytest.approx(other.T_near_N, abs=300 * mu + 1e-11)


def test_slack_holds_no_memory_and_ends_where_it_began():
    T1 = 20.0
    e0 = -np.expm1(-M) * COMPLIANCE * T1
    displacement = np.array([0.0, -0.9 * e0, -e0, -1.7 * e0, -1.2 * e0, -1.5 * e0, -0.9 * e0])
    response = run(displacement, line(T1, -1))
    assert (response.T_near_N[2:6] == 0).all()
    assert response.T_near_N[1] == pytest.approx(0.1 * e0 / (np.expm1(M) * COMPLIANCE), rel=1e-12)
    assert response.T_near_N[6] == pytest.approx(0.1 * e0 / (-np.expm1(-M) * COMPLIANCE), rel=1e-12)


@pytest.mark.parametrize("y", [0.5, 30.0, 45.0, 120.0, 290.0])
def test_release_along_a_conduit_of_three_hundred(y):
    """A release of uniform pretension up to the stated limit of mu phi; exp(-y) is far below rounding."""
    path, T0, m = ConduitPath([LENGTH], [1000.0]), 10.0, 300.0
    compliance = LENGTH / (m * EA)
    displacement = -compliance * T0 * (y + np.expm1(-y))
    found = simulate_cable(path, EA, 0.3, FIXED, np.array([0.0, displacement]), InitialTension.uniform(path, T0))
    assert found.status is Status.OK
    assert found.T_near_N[-1] == pytest.approx(T0 * np.exp(-y), rel=1e-10)
    assert found.T_far_N[-1] == T0
    assert found.moving_m[-1] == pytest.approx([LENGTH * y / m, LENGTH], rel=1e-12)
