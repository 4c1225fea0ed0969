"""The solvers over the whole range that is stated for them: a status, or an answer that satisfies the mechanics.

These are the capstan bound of each cable, the balance of the load pulley, the load's law, and that friction gives no
energy.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_exact_energy import stored

from ccmodel import mechanisms
from ccmodel.geometry import ConduitPath
from ccmodel.model.exact import Status, simulate_pair
from ccmodel.model.general import Active, simulate
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import FixedLoad, SpringLoad
from ccmodel.model.transmission import MAX_FRICTION_ANGLE, Transmission
from fuzzing import examples

LOADS = ("fixed", "spring", "free")
# A solver that always gives up satisfies all else. Up to these mu phi none does, whatever the drive; a rig's is 2. A
# load that moves freely between cables as soft as 10 N may leave the general solver without a balance at any mu phi.
EXACT_SOLVES = 20.0
GENERAL_SOLVES = {"fixed": 5.0, "spring": 5.0, "free": 0.0}
# Share of the general solver's runs that come to their end, of those to 300 too.
SOLVED = 0.5


def decades(low, high):
    return st.floats(low, high).map(lambda power: 10**power)


@st.composite
def cases(draw, load):
    """Bends to 300 rad, mu to 1, mu phi to 300, tensions to 500 N, stiffness over six decades, drives that jump."""
    pieces = draw(st.integers(1, 4))
    bend, mu = draw(st.floats(0.0, 299.99)), draw(decades(-2, 0))
    shares = np.array([draw(st.floats(0.0, 1.0)) for _ in range(pieces)]) + 1e-9
    path = ConduitPath([draw(st.floats(0.05, 1.0)) for _ in range(pieces)], bend * shares / shares.sum())
    single = load == "fixed" or draw(st.booleans())
    one = Transmission(path, draw(decades(1, 7)), mu, 0.006, 0.008, single)
    stiffness = draw(decades(-4, 2)) if load == "spring" else 0.0
    initial = InitialTension.uniform(path, draw(decades(-2, np.log10(500.0))))
    steps = np.array(draw(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=60)))
    theta = draw(decades(-4, 1)) * np.concatenate([[0.0], np.cumsum(steps)])
    return one, FixedLoad() if load == "fixed" else SpringLoad(stiffness), initial, theta


@pytest.mark.parametrize("load", LOADS)
@settings(max_examples=examples(150))
@given(data=st.data())
def test_a_status_or_tensions_within_the_capstan_bound(load, data):
    one, far, initial, theta = data.draw(cases(load))
    assert friction_angle(one) <= MAX_FRICTION_ANGLE
    found = simulate_pair(one, far, theta, initial)
    assert found.status is Status.OK or friction_angle(one) > EXACT_SOLVES
    check_mechanics(one, far, initial, found, solved_to=1e-9)


@pytest.mark.parametrize("stiffness", [0.1, 1.0, 1e4])
@pytest.mark.parametrize("back_rad", [0.35, 0.7, 1.0])
def test_a_cable_that_goes_slack_in_one_step(stiffness, back_rad):
    path = ConduitPath([1.0, 0.25], [0.0, 6.0])
    one = Transmission(path, 1000.0, 0.75, 0.006, 0.008, True)
    found = simulate(
        one, SpringLoad(stiffness), np.arange(2.0), np.array([0.0, -back_rad]), InitialTension.uniform(path, 1.0)
    ).complete()
    np.testing.assert_allclose([found.T1_N[-1], found.T2_N[-1]], 0.0, atol=1e-5)


@pytest.mark.parametrize("load", LOADS)
def test_the_general_solver_too(load):
    statuses = []

    @settings(max_examples=examples(50), deadline=None)
    @given(data=st.data(), elements=st.sampled_from([1, 8, 32]))
    def each(data, elements):
        one, far, initial, theta = data.draw(cases(load))
        found = simulate(one, far, 0.01 * np.arange(theta.size), theta, initial, elements=elements)
        statuses.append(found.status)
        assert found.status is Status.OK or friction_angle(one) > GENERAL_SOLVES[load]
        # What a step whose search stalls is accepted with (`ccmodel.model.general.newton.LOOSE_TOLERANCE`).
        check_mechanics(one, far, initial, found, solved_to=1e-5)

    each()
    assert np.mean([status is Status.OK for status in statuses]) > SOLVED


@pytest.mark.parametrize("samples", [1, 2, 1_000_000])
@pytest.mark.parametrize(("solver", "solved_to"), [("exact", 1e-9), ("general", 1e-5)])
def test_one_sample_and_a_million_noisy_ones(solver, solved_to, samples):
    path, load = ConduitPath([0.6, 0.9], [1.0, 8.0]), SpringLoad(0.05)
    one, initial = Transmission(path, 1e4, 0.15, 0.006, 0.008, False), InitialTension.uniform(path, 3.0)
    time_s, noise = 1e-3 * np.arange(samples), np.random.default_rng(5).normal(scale=1e-4, size=samples)
    theta = 0.5 * np.sin(2 * np.pi * time_s) + noise - noise[0]
    if solver == "exact":
        found = simulate_pair(one, load, theta, initial)
    else:
        found = simulate(one, load, time_s, theta, initial)
    assert found.status is Status.OK
    assert found.T1_N.size == samples
    check_mechanics(one, load, initial, found, solved_to)


@pytest.mark.parametrize("name", mechanisms.names())
@settings(max_examples=examples(5), deadline=None)
@given(data=st.data())
def test_the_general_solver_with_each_mechanism_has_a_status_or_tensions_that_no_cable_pushes_with(name, data):
    one, far, initial, theta = data.draw(cases(data.draw(st.sampled_from(("spring", "free")))))
    mechanism = mechanisms.get(name)
    values = {p.name: p.at(data.draw(st.floats(0.0, 1.0))) for p in mechanism.parameters}
    signs = {p.name: data.draw(st.sampled_from((-1, 1))) if p.signed else 1 for p in mechanism.parameters}
    active = Active(name, data.draw(st.sampled_from(mechanism.places)), {n: signs[n] * v for n, v in values.items()})
    found = simulate(one, far, 0.01 * np.arange(theta.size), theta, initial, [active], elements=8)
    if found.status is Status.OK:
        ends = [found.T1_N, found.T2_N, *(() if one.is_single_cable else (found.T3_N, found.T4_N))]
        assert np.isfinite([*ends, found.theta_out_rad, found.tau_in_Nm, found.tau_out_Nm]).all()
        assert np.min(ends) >= 0


def friction_angle(one):
    """Product mu phi of a conduit."""
    return one.friction_coefficient * one.path.bend_rad


def check_mechanics(one, far, initial, found, solved_to):
    """Nothing is claimed of a run that ended with a status.

    Forces balance within `solved_to` times the largest tension, that of the start included.
    """
    if found.status is not Status.OK:
        return
    both = ((found.T1_N, found.T2_N), (found.T3_N, found.T4_N))[: 1 if one.is_single_cable else 2]
    error_N = solved_to * max(np.max(both), initial.tension_A_N.max())
    bound = friction_angle(one) * (1 + 1e-9) + 1e-9
    for near, beyond in both:
        assert np.isfinite([near, beyond]).all() and (near >= 0).all() and (beyond >= 0).all()
        low, high = np.minimum(near, beyond), np.maximum(near, beyond)
        assert (high - error_N <= np.exp(np.minimum(bound, 700.0)) * (low + error_N)).all()
    difference = found.T2_N - (0.0 if one.is_single_cable else found.T4_N)
    error_Nm = one.load_radius_m * error_N
    assert are_near(found.tau_out_Nm, one.load_radius_m * difference, error_Nm)
    if isinstance(far, SpringLoad):
        assert are_near(found.tau_out_Nm, far.stiffness_Nm_per_rad * found.theta_out_rad, error_Nm)
    else:
        assert are_near(found.theta_out_rad, 0.0, 1e-12)


def are_near(found, expected, error):
    """What `pytest.approx` with this absolute error says, which takes half a minute over a million samples."""
    return (np.abs(found - expected) <= np.maximum(1e-6 * np.abs(expected), error)).all()


@pytest.mark.parametrize("load", LOADS)
@settings(max_examples=examples(40), deadline=None)
@given(data=st.data())
def test_no_motion_gives_more_energy_than_it_takes(load, data):
    one, far, initial, corners = data.draw(cases(load))
    fine = np.linspace(0, corners.size - 1, 200 * (corners.size - 1) + 1)
    theta = np.interp(fine, np.arange(corners.size), corners)
    found = simulate_pair(one, far, theta, initial, record_profiles_at=[0, theta.size - 1])
    if found.status is not Status.OK:
        return
    work_J = np.trapezoid(found.tau_in_Nm, theta)
    before_J, after_J = (stored_J(one, far, found, at) for at in (0, theta.size - 1))
    # The torque changes in one direction between two samples; the trapezoids err by no more than this.
    quadrature_J = 0.5 * np.abs(np.diff(found.tau_in_Nm) * np.diff(theta)).sum()
    assert work_J - (after_J - before_J) >= -quadrature_J - 1e-9 * (before_J + after_J)


def stored_J(one, far, found, at):
    """Energy in the cables and the load's spring at one sample, J."""
    spring = far.stiffness_Nm_per_rad if isinstance(far, SpringLoad) else 0.0
    cables = sum(stored(profile, one.axial_rigidity_N) for profile in found.profiles[at])
    return cables + 0.5 * spring * found.theta_out_rad[at] ** 2


@pytest.mark.parametrize("drive", [4.8e-307, 1e-200, 5e-324])
def test_a_motion_below_all_resolution_changes_nothing(drive):
    path = ConduitPath([2.0], [3.0])
    one, initial = Transmission(path, 5000.0, 0.15, 0.006, 0.008), InitialTension.uniform(path, 7.0)
    found = simulate_pair(one, SpringLoad(0.0), np.array([0.0, -drive, drive]), initial)
    assert found.status is Status.OK
    assert pytest.approx(7.0) == found.T1_N and pytest.approx(7.0) == found.T4_N
