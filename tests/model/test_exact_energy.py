"""Work put in is stored or dissipated; and an independent, slow reference with nodes and small steps."""

import numpy as np
import pytest
from numba import njit

from cable_runs import FIXED, simulate_cable
from ccmodel.geometry import ConduitPath
from ccmodel.model.exact import simulate_pair
from ccmodel.model.general import simulate
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, SpringLoad
from ccmodel.model.transmission import Transmission

LENGTH, BEND, MU, EA = 2.0, 3 * np.pi, 0.15, 2000.0
M = MU * BEND
PATH = ConduitPath([LENGTH], [BEND])


def stored(profile, axial_rigidity_N=EA):
    """Integral of T^2 / (2 EA) over a profile whose ln T is linear between points, J; a slack cable stores nothing."""
    T0, T1 = profile.tension_N[:-1], profile.tension_N[1:]
    if not profile.tension_N.any():
        return 0.0
    rise = 2 * np.log(T1 / T0)
    mean = np.where(np.abs(rise) > 1e-4, (T1**2 - T0**2) / np.where(rise == 0, 1, rise), T0 * T1 * (1 + rise**2 / 24))
    return float((mean * np.diff(profile.x_m)).sum() / (2 * axial_rigidity_N))


# Each stroke is smooth: a front on its direction, or the whole cable sliding. (start's slope, tension, displacement)
STROKES = [(-1, 25.0, -0.009), (+1, 5.0, 0.03), (-1, 25.0, 0.02), (+1, 40.0, -0.03)]


@pytest.mark.parametrize(("slope", "tension", "reach"), STROKES)
def test_work_is_stored_or_dissipated(slope, tension, reach):
    ends = tension * np.exp([0.0, slope * M])
    initial = InitialTension([0, LENGTH], ends, ends)
    t, weight = np.polynomial.legendre.leggauss(60)
    t, weight = (t + 1) / 2, weight / 2
    # d = reach t^2 takes the square-root start away
    at = np.concatenate([[0.0], reach * t**2, [reach]])
    response = simulate_cable(PATH, EA, MU, FIXED, at, initial, record_profiles_at=[0, at.size - 1])
    work = (weight * 2 * t * reach * response.T_near_N[1:-1]).sum()
    change = stored(response.profiles[at.size - 1]) - stored(response.profiles[0])
    dissipated = (
        weight
        * 2
        * t
        * abs(reach)
        * [
            friction_power(*sample)
            for sample in zip(
                response.T_near_N[1:-1], response.moving_m[1:-1, 0], np.full(t.size, np.sign(reach)), strict=True
            )
        ]
    ).sum()
    assert dissipated > 0
    assert work == pytest.approx(change + dissipated, rel=1e-9)


def friction_power(T_near, front_x, direction):
    """Friction times slip along the moving stretch, per displacement of the near end: mu phi' T v dx."""
    y, w = np.polynomial.legendre.leggauss(30)
    m = (y + 1) / 2 * M * front_x / LENGTH
    m_front = M * front_x / LENGTH
    shape = np.exp(-direction * m)

    def reach(upper):  # integral of exp(-direction m) from there to the front
        return (np.exp(-direction * upper) - np.exp(-direction * m_front)) * direction

    slip = reach(m) / reach(0.0)
    return (w / 2 * m_front * T_near * shape * slip).sum()


def test_a_closed_loop_of_the_pair_only_dissipates():
    path = ConduitPath([0.4, 0.8, 0.3, 0.5], [0.0, 3.0, 0.0, 2.0])
    one = Transmission(path, EA, MU, 0.012, 0.01)
    for pretension in (1.0, 3.5, 10.0):
        theta = np.sin(np.linspace(0, 6 * np.pi, 30001))
        response = simulate_pair(one, SpringLoad(0.01), theta, InitialTension.uniform(path, pretension))
        loop = slice(10000, 20001)
        assert np.trapezoid(response.tau_in_Nm[loop], theta[loop]) > 0
        assert np.trapezoid(response.tau_out_Nm[loop], response.theta_out_rad[loop]) == pytest.approx(0, abs=1e-9)


@njit
def relax(u, T0, k, grip, sweeps):
    """Displacements at which every inner node either sticks or slides on its capstan bound (Gauss and Seidel)."""
    for _ in range(sweeps):
        most = 0.0
        for j in range(1, u.size - 1):
            left, right = T0 + k * (u[j] - u[j - 1]), T0 + k * (u[j + 1] - u[j])
            if right > left * grip:
                step = (right - left * grip) / (k * (1 + grip))
            elif left > right * grip:
                step = -(left - right * grip) / (k * (1 + grip))
            else:
                continue
            u[j] += step
            most = max(most, abs(step))
        if most < 1e-15:
            return True
    return False


def by_nodes(near, far, elements, steps):
    """Tensions at both ends of a cable in equal elements, T0 = 10 N, ends moved in small steps."""
    u = np.zeros(elements + 1)
    k = EA / (LENGTH / elements)
    ends = []
    for i in range(near.size - 1):
        for s in np.linspace(0, 1, steps + 1)[1:]:
            u[0] = -(near[i] + s * (near[i + 1] - near[i]))
            u[-1] = far[i] + s * (far[i + 1] - far[i])
            assert relax(u, 10.0, k, np.exp(M / elements), 200_000)
        ends.append((10 + k * (u[1] - u[0]), 10 + k * (u[-1] - u[-2])))
    return np.array(ends).T


NEAR = 1e-3 * np.array([0, 12, 4, 8, 6, 14, 14, 3, 7])
FAR = 1e-3 * np.array([0, 0, 0, -3, -5, -5, 2, 2, 6])


def by_the_exact_solver():
    """Cable A with a fixed far end."""
    r = simulate_cable(PATH, EA, MU, FIXED, NEAR, InitialTension.uniform(PATH, 10.0))
    return np.stack([r.T_near_N, r.T_far_N]), 0 * FAR


def by_the_general_solver():
    """Cable A of a pair whose pulleys both move, in small steps: the path between samples matters then."""
    fine = np.linspace(0, NEAR.size - 1, 500 * (NEAR.size - 1) + 1)
    near, far = (np.interp(fine, np.arange(NEAR.size), ends) for ends in (NEAR, FAR))
    pair, initial = Transmission(PATH, EA, MU, 1.0, 1.0), InitialTension.uniform(PATH, 10.0)
    r = simulate(pair, AngleLoad(-far), 1e-3 * np.arange(fine.size), near, initial, elements=512).complete()
    return np.stack([r.T1_N, r.T2_N])[:, ::500], FAR


@pytest.mark.parametrize("solver", [by_the_exact_solver, by_the_general_solver])
def test_a_slow_reference_with_nodes_converges_to_it(solver):
    tensions, far = solver()
    solutions = []
    for elements in (12, 24, 48):
        solutions.append(by_nodes(NEAR, far, elements, 4 * elements))
    # an element's tension is that of its middle: first order, which extrapolation takes away
    ends = tensions[:, 1:]
    errors = [np.sqrt(np.mean((solution - ends) ** 2)) for solution in solutions]
    extrapolated = np.sqrt(np.mean((2 * solutions[2] - solutions[1] - ends) ** 2))
    assert errors[0] > 1.8 * errors[1] > 1.8**2 * errors[2]
    assert extrapolated < 0.1 * errors[2]
