"""The load that is recovered from the drive's side of simulated runs, with both solvers."""

import numpy as np
import pytest
from inverse_runs import (
    EVEN,
    GROWING,
    K_E,
    PAIR,
    RATE_HZ,
    TIME_S,
    WANDER,
    drive_side,
    errors,
    estimate_exactly,
    estimate_generally,
    prior,
)

from ccmodel import mechanisms as registry
from ccmodel.inverse import exact
from ccmodel.inverse.update import BY_MISFIT, GAIN, GROWTH, MISFIT, joint_estimate
from ccmodel.model.exact import simulate_pair
from ccmodel.model.general import Active, simulate
from ccmodel.model.load import SpringLoad, TorqueLoad
from ccmodel.model.transmission import Transmission


@pytest.fixture(scope="module")
def sprung():
    return simulate_pair(PAIR, SpringLoad(K_E), GROWING, EVEN)


@pytest.mark.parametrize("stiffness", [K_E, 0.0])
def test_the_torque_of_the_drive_gives_the_load_with_and_without_its_law(sprung, stiffness):
    visible, hidden = errors(estimate_exactly(sprung, GROWING, stiffness), sprung)
    assert visible.max() < 1e-9
    # A load that rests keeps what it came to rest with.
    assert hidden.max() < 1e-9


def test_a_law_that_is_wrong_by_a_fifth_gives_the_load_all_the_same(sprung):
    run = exact.run(PAIR, 0.8 * K_E, EVEN, drive_side(GROWING, sprung.tau_in_Nm), prior(False))
    assert errors(run, sprung)[0].max() < 1e-9
    # The misfit is what the spring lacks.
    late = (run.trace[BY_MISFIT] > 0) & (TIME_S > 1)
    lacks = sprung.tau_out_Nm - 0.8 * K_E * sprung.theta_out_rad
    assert np.abs(run.trace[MISFIT] - lacks)[late].max() < 1e-9 * np.ptp(sprung.tau_out_Nm)


def test_a_stiffening_load_without_a_law():
    mechanisms = [Active("load-stiffening", "load", {"K3": 0.05})]
    true = simulate(PAIR, SpringLoad(K_E), TIME_S, GROWING, EVEN, mechanisms).complete()
    # Two solvers: the general one's grid is in the error.
    by_exact = estimate_exactly(true, GROWING, 0.0)
    off = np.abs(by_exact.out[1] - true.tau_out_Nm)[by_exact.trace[BY_MISFIT] > 0] / np.ptp(true.tau_out_Nm)
    assert np.quantile(off, 0.95) < 0.003
    assert errors(estimate_generally(true, GROWING, 0.0), true)[0].max() < 1e-6


@pytest.mark.parametrize("stiffness", [0.0, 0.8 * K_E])
@pytest.mark.parametrize(
    "mechanism",
    [
        ("presliding", "conduit", {"z0": 5e-5}),
        ("viscous-friction", "conduit", {}),
        ("conduit-compliance", "conduit", {}),
        ("pulley-friction", "load-pulley", {}),
        ("pulley-friction", "drive-pulley", {}),
        ("pulley-eccentricity", "drive-pulley", {}),
        ("relaxation", "cable", {}),
    ],
    ids=lambda one: one[0],
)
def test_with_mechanisms(mechanism, stiffness):
    name, place, values = mechanism
    start = {p.name: p.start for p in registry.get(name).parameters}
    acting = [Active(name, place, start | values)]
    true = simulate(PAIR, SpringLoad(K_E), TIME_S, GROWING, EVEN, acting).complete()
    run = estimate_generally(true, GROWING, stiffness, acting)
    visible = run.trace[BY_MISFIT] > 0
    assert visible.mean() > 0.5
    off = np.abs(run.out[1] - true.tau_out_Nm)[visible] / np.ptp(true.tau_out_Nm)
    assert np.quantile(off, 0.95) < 1e-7
    # As the load begins to move, a small change of the drive torque is a large one of the load.
    assert off.max() < 0.03


def test_static_friction_has_more_than_one_load_for_a_torque_just_after_a_reversal():
    """Breakaway lowers friction as the load gives way: the estimate is right once the cables slide."""
    acting = [Active("stribeck", "conduit", {p.name: p.start for p in registry.get("stribeck").parameters})]
    true = simulate(PAIR, SpringLoad(K_E), TIME_S, GROWING, EVEN, acting).complete()
    run = estimate_generally(true, GROWING, 0.8 * K_E, acting)
    off = np.abs(run.out[1] - true.tau_out_Nm)[run.trace[BY_MISFIT] > 0] / np.ptp(true.tau_out_Nm)
    assert np.quantile(off, 0.8) < 1e-5


def test_friction_hides_the_load_after_each_reversal(sprung):
    run = estimate_exactly(sprung, GROWING, 0.0)
    hidden = run.trace[BY_MISFIT] == 0
    turns = np.flatnonzero(np.diff(np.sign(np.diff(GROWING)))) + 1
    assert turns.size == 6
    assert hidden[turns + 1].all()
    assert not hidden[turns - 2].any()
    assert (run.trace[GAIN][hidden] == 0).all()
    # Until the load moves again: neither before nor long after.
    load_moves = np.abs(np.gradient(sprung.theta_out_rad)) > 1e-12
    assert (hidden[1:-1] == ~load_moves[1:-1]).mean() > 0.98


def test_a_load_that_jumps_while_it_is_hidden_is_found_once_it_shows():
    """Torque that changes at a reversal, behind the friction of the cables."""
    torque = K_E * 0.5 * GROWING
    turn = RATE_HZ // 4
    torque[turn:] += 0.01 * np.clip((np.arange(TIME_S.size - turn)) / 10, 0, 1)
    true = simulate(PAIR, TorqueLoad(torque), TIME_S, GROWING, EVEN).complete()
    run = estimate_generally(true, GROWING, 0.0)
    off = np.abs(run.out[1] - true.tau_out_Nm) / np.ptp(torque)
    hidden = run.trace[BY_MISFIT] == 0
    assert hidden[turn + 5 : turn + 50].all()
    assert off[turn + 10 : turn + 50].min() > 0.2
    # The first stroke on which the drive sees it, to the next reversal.
    first = turn + 50 + int(np.argmin(hidden[turn + 50 :]))
    assert off[first + 5 : 3 * turn - 2].max() < 1e-9


def test_a_single_cable():
    single = Transmission(PAIR.path, PAIR.axial_rigidity_N, PAIR.friction_coefficient, PAIR.drive_radius_m, 0.006, True)
    theta = 0.15 * np.sin(2 * np.pi * TIME_S)
    true = simulate_pair(single, SpringLoad(0.2), theta, EVEN)
    run = exact.run(single, 0.0, EVEN, drive_side(theta, true.tau_in_Nm), prior(False))
    assert np.abs(run.out[1] - true.tau_out_Nm).max() < 1e-9 * np.ptp(true.tau_out_Nm)
    # The true angle counts from where the spring has no torque, the estimate from the start.
    from_start = true.theta_out_rad - true.theta_out_rad[0]
    assert np.abs(run.out[0] - from_start).max() < 1e-9 * np.ptp(from_start)


def test_the_joint_filter_is_that_of_least_squares():
    """With a constant misfit and two lasting errors the filter is Bayesian linear regression."""
    draw = np.random.default_rng(3)
    n, noise, first = 40, 0.3, 4.0
    H, effects = draw.normal(size=n), draw.normal(size=(2, n))
    outputs, by_misfit = draw.normal(size=(2, 1, n)), draw.normal(size=(1, n))
    y = draw.normal(size=n)
    trace = np.zeros((5, n))
    trace[BY_MISFIT] = H
    correction, variance = joint_estimate(trace, y, first, np.full(n, noise**2), effects, outputs, by_misfit)
    A = np.vstack([H, effects]).T
    covariance = np.linalg.inv(A.T @ A / noise**2 + np.diag([1 / first, 1, 1]))
    g = np.array([by_misfit[0, -1], *outputs[:, 0, -1]])
    assert correction[0, -1] == pytest.approx(g @ covariance @ A.T @ y / noise**2, rel=1e-9)
    assert variance[0, -1] == pytest.approx(g @ covariance @ g, rel=1e-9)


def test_the_variance_of_a_load_without_a_law_grows_with_the_travel_whatever_the_sampling_rate(sprung):
    fine = estimate_exactly(sprung, GROWING, 0.0).trace[GROWTH].sum()
    thinned = simulate_pair(PAIR, SpringLoad(K_E), GROWING[::5], EVEN)
    coarse = estimate_exactly(thinned, GROWING[::5], 0.0).trace[GROWTH].sum()
    assert fine == pytest.approx(WANDER * np.abs(np.diff(GROWING)).sum(), rel=1e-9)
    assert coarse == pytest.approx(fine, rel=1e-3)
