"""The general solver without effects: against the paper's discretisation refined, closed forms, and any load."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.mechanisms.kink import Kink
from ccmodel.model.general import Active, simulate
from ccmodel.model.general.grid import make_grid
from ccmodel.model.general.march import march
from ccmodel.model.general.run import _physics, _steps, settings_of
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, SpringLoad, TorqueLoad
from ccmodel.model.paper import simulate_pair
from ccmodel.model.response import Status
from general_runs import (
    HALF_LOOP,
    K_E,
    MU,
    OUTPUTS,
    T0,
    TENSIONS,
    K,
    L,
    R,
    evenly_added_bend,
    rms,
    run,
    sine,
    transmission,
)

LOOPS = ConduitPath([0.3, 0.5, 0.4], [0.0, 4.0, 1.0])


def paper(theta_in, path=HALF_LOOP, T=T0, load=None, sections=512):
    initial = InitialTension.uniform(path, T) if np.isscalar(T) else T
    return simulate_pair(transmission(path), load or SpringLoad(K_E), theta_in, initial, sections)


@pytest.mark.parametrize("path", [HALF_LOOP, LOOPS], ids=["half-loop", "pieces"])
@pytest.mark.parametrize("T", [7.3, 3.5, 0.7], ids=lambda T: f"{T}N")
def test_without_effects_it_is_the_papers_model(path, T):
    """Slack at the lower pretensions included; near tensions to 0.06 %, far tensions and the angle to 0.02 %."""
    theta = sine(0.7)
    r, ref = run(theta, path=path, T=T), paper(theta, path=path, T=T)
    for name, limit in zip(OUTPUTS, (6e-4, 2e-4, 6e-4, 2e-4, 2e-4, 4e-4, 2e-4), strict=True):
        assert rms(getattr(r, name), getattr(ref, name)) < limit * np.ptp(getattr(ref, name)), name


def test_order_of_convergence_is_two_at_both_ends():
    theta = sine()
    fine = run(theta, elements=512)
    elements = np.array([8, 16, 32, 64])
    for name in OUTPUTS:
        error = [rms(getattr(run(theta, elements=n), name), getattr(fine, name)) for n in elements]
        order = -np.polyfit(np.log(elements), np.log(error), 1)[0]
        assert order > 1.85, (name, order)


def test_order_of_convergence_is_two_with_conduits_that_yield_too():
    theta = sine()
    found = [
        run(theta, ("conduit-compliance", "conduit", {"compliance": 20e-6}), elements=n) for n in (16, 32, 64, 128)
    ]
    for name in TENSIONS:
        changes = [rms(getattr(a, name), getattr(b, name)) for a, b in itertools.pairwise(found)]
        assert changes[0] > 3 * changes[1] > 9 * changes[2], (name, changes)


@pytest.mark.parametrize(
    "effect", [("load-inertia", "load", {"J": 1e-3, "zeta": 0.1}), ("load-stiffening", "load", {"K3": 0.1})]
)
def test_a_measured_torque_is_read_as_it_was_whatever_acts_beside_it(effect):
    torque = K_E * 0.5 * sine()
    assert run(sine(), effect, load=TorqueLoad(torque)).tau_out_Nm == pytest.approx(torque)


def test_it_converges_to_the_same_as_the_paper():
    """Errors against the reference fall until they reach the reference's own."""
    theta = sine()
    ref = paper(theta)
    error = [rms(run(theta, elements=n).T1_N, ref.T1_N) for n in (16, 32, 64, 128)]
    assert error[0] > 3 * error[1] > 9 * error[2]
    assert error[3] < 2e-5 * np.ptp(ref.T1_N)


def test_full_slip_has_the_capstan_ratio_on_any_grid():
    for elements in (1, 3, 32):
        r = run(np.linspace(0, 0.6, 50), elements=elements)
        assert np.log(r.T1_N[-1] / r.T2_N[-1]) == pytest.approx(MU * np.pi, rel=1e-9)
        assert np.log(r.T4_N[-1] / r.T3_N[-1]) == pytest.approx(MU * np.pi, rel=1e-9)


def test_slack_cables_leave_a_smooth_function_of_friction():
    """Where a slack cable lies in its conduit decides how far its contacts have built up when it is taut again."""
    presliding = "presliding", "conduit", {"z0": 0.18e-3, "spread": 9.0}
    ends = [("termination-compliance", f"{end}-end", {"compliance": 50e-6}) for end in ("drive", "load")]
    path, frictions = ConduitPath([L], [3 * np.pi]), 0.15 + 4e-6 * np.arange(6)
    found = [run(sine(0.45), [presliding, *ends], path=path, T=2.0, mu=mu, k=2 * K) for mu in frictions]
    assert np.mean(found[0].T3_N == 0) > 0.2
    torque = np.array([r.tau_in_Nm for r in found])
    assert np.ptp(np.diff(torque, axis=0), axis=0).max() < 2e-7


def test_steps_may_be_large():
    """Between reversals the path does not matter: one step a stroke ends where five hundred do."""
    ends = np.array([0, 0.6, -0.6, 0.3, -0.1, 0.5])
    fine = np.concatenate([np.linspace(a, b, 100, endpoint=False) for a, b in itertools.pairwise(ends)])
    coarse, fine = run(ends), run(np.append(fine, ends[-1]))
    for name in OUTPUTS:
        assert getattr(coarse, name) == pytest.approx(getattr(fine, name)[::100], abs=2e-6), name


def test_nothing_moves_at_rest():
    r = run(np.zeros(20))
    for name in TENSIONS:
        assert getattr(r, name) == pytest.approx(T0, rel=1e-9)
    assert np.abs(r.theta_out_rad).max() < 1e-12


def test_mirrored_motion_swaps_the_cables():
    theta = sine()
    r, m = run(theta), run(-theta)
    assert pytest.approx(m.T3_N, abs=1e-6) == r.T1_N
    assert r.theta_out_rad == pytest.approx(-m.theta_out_rad, abs=1e-9)


def test_initial_profiles_within_friction_hold():
    profile = InitialTension.between_ends(HALF_LOOP, MU, (8.0, 6.0), (7.0, 7.5))
    r = run(np.zeros(5), T=profile)
    assert [getattr(r, name)[-1] for name in TENSIONS] == pytest.approx([8.0, 6.0, 7.0, 7.5], rel=1e-6)
    assert r.theta_out_rad[-1] == pytest.approx((6.0 - 7.5) * R / K_E, rel=1e-6)


def test_what_friction_holds_at_rest_it_holds_at_a_kink_too():
    kink = ("kink", "conduit", {"beta": 1.0, "s": 0.3})
    limit = np.exp(MU * (np.pi + 1.0))
    profile = InitialTension.between_ends(HALF_LOOP, MU, (2 * T0, 2 * T0 / limit), (T0, T0), kinks_rad=(1.0, 0.0))
    r = run(np.linspace(0.0, 0.1, 20), kink, T=profile)
    # All of cable A is about to slide, and the first pull is felt at its other end with no front to wait for.
    assert pytest.approx(limit, rel=1e-6) == r.T1_N / r.T2_N


def test_what_friction_holds_at_rest_it_holds_where_a_law_adds_bend_too():
    """The drive's pull slips all cells of a cable that is at its limit everywhere at once, and none before."""
    limit = np.exp(MU * (HALF_LOOP.bend_rad + 1.0))
    profile = InitialTension.between_ends(HALF_LOOP, MU, (2 * T0, 2 * T0 / limit), (T0, T0), kinks_rad=(0.5, 0.5))
    r = run(np.linspace(0.0, 0.1, 20), evenly_added_bend(1.0), T=profile)
    assert pytest.approx(limit, rel=2e-3) == r.T1_N / r.T2_N


def test_a_kink_that_holds_nothing_at_rest_is_passed_last():
    bend, limit = 1.0, np.exp(MU * np.pi)
    profile = InitialTension.between_ends(HALF_LOOP, MU, (2 * T0, 2 * T0 / limit), (T0, T0))
    r = run(np.linspace(0.0, 0.1, 200), ("kink", "conduit", {"beta": bend, "s": 0.3, "hold": 0.0}), T=profile)
    ratio = r.T1_N / r.T2_N
    assert ratio[0] == pytest.approx(limit, rel=1e-6)
    assert (np.diff(ratio) >= -1e-9).all()
    assert ratio[-1] == pytest.approx(limit * np.exp(MU * bend), rel=1e-6)
    stalled = ratio < 0.999 * ratio[-1]  # until the front is past the kink nothing arrives
    assert np.ptp(r.T2_N[stalled]) < 1e-3 * T0 < np.ptp(r.T2_N)


@pytest.mark.parametrize("wrong", [{"hold": -0.1}, {"hold": 1.1}, {"s": 1.0}])
def test_a_kink_outside_its_bounds_is_refused(wrong):
    with pytest.raises(ModelError, match="a kink"):
        run(np.zeros(3), ("kink", "conduit", {"beta": 1.0, "s": 0.3} | wrong))


def test_a_straight_path_is_two_springs():
    theta = sine(0.3)
    r = run(theta, path=ConduitPath([L], [0.0]))
    expected = 2 * K * R**2 * theta / (2 * K * R**2 + K_E)
    assert r.theta_out_rad == pytest.approx(expected, abs=1e-9)


# Loads


def test_prescribed_torque_of_the_spring_gives_the_spring_back():
    theta = sine()
    spring = run(theta)
    torque = run(theta, load=TorqueLoad(spring.tau_out_Nm))
    assert torque.theta_out_rad == pytest.approx(spring.theta_out_rad, abs=1e-5)
    assert rms(torque.T1_N, spring.T1_N) < 1e-3


def test_a_spring_beside_the_measured_torque_shares_the_load():
    """The sensor feels a part of the spring; a stiffness that it does not feel makes up for the rest."""
    theta = sine()
    spring = run(theta)
    shared = run(theta, load=TorqueLoad(0.25 * spring.tau_out_Nm, 0.75 * K_E))
    assert shared.theta_out_rad == pytest.approx(spring.theta_out_rad, abs=1e-5)
    assert rms(shared.T1_N, spring.T1_N) < 1e-3
    assert (shared.tau_out_Nm == 0.25 * spring.tau_out_Nm).all()


def test_prescribed_angle_of_the_spring_gives_the_spring_back():
    theta = sine()
    spring = run(theta)
    angle = run(theta, load=AngleLoad(spring.theta_out_rad))
    for name in OUTPUTS:
        assert rms(getattr(angle, name), getattr(spring, name)) < 1e-4 * np.ptp(getattr(spring, name)), name


def test_blocked_load_shows_the_capstan_and_no_motion():
    theta = np.linspace(0, 0.4, 60)
    r = run(theta, load=AngleLoad(np.zeros(60)))
    assert (r.theta_out_rad == 0).all()
    # A cable that slides as a whole between fixed ends: the closed form of the stretch, (12).
    stretch = T0 / K + R * theta[-1]
    T1 = stretch * K * MU * np.pi / -np.expm1(-MU * np.pi)
    assert r.T1_N[-1] == pytest.approx(T1, rel=1e-3)


def test_cubic_spring_holds_its_law():
    r = run(sine(), ("load-stiffening", "load", {"K3": 0.04}))
    assert r.tau_out_Nm == pytest.approx(K_E * r.theta_out_rad + 0.04 * r.theta_out_rad**3, abs=1e-9)
    assert pytest.approx(r.tau_out_Nm, abs=1e-7) == (r.T2_N - r.T4_N) * R


def test_inertia_oscillates_at_its_own_frequency():
    """Cables without friction and a load with mass, let go: the frequency is that of the two cables' stiffness."""
    J = 1e-3
    frequency = np.sqrt((2 * K * R**2) / J) / (2 * np.pi)
    samples = 400
    theta = np.where(np.arange(3 * samples) > 0, 0.05, 0.0)
    mass = ("load-inertia", "load", {"J": J, "zeta": 0.0})
    r = run(theta, mass, mu=0.0, load=SpringLoad(0.0), period_s=1 / frequency, samples=samples)
    crossings = np.flatnonzero(np.diff(np.sign(r.theta_out_rad - 0.05)))
    assert 2 * np.diff(crossings).mean() == pytest.approx(samples, rel=5e-3)


def test_a_ring_that_samples_hardly_show_is_followed_between_them():
    """Ten samples a ring: with a step for each, the ring would be late by a third of itself after four."""
    ring_s = 2 * np.pi * np.sqrt(1e-4 / (2 * K * R**2 + K_E))
    mass = ("load-inertia", "load", {"J": 1e-4, "zeta": 0.0})

    def pulled(samples):
        rings = np.arange(5 * samples + 1) / samples
        theta = 0.025 * (1 - np.cos(np.pi * np.clip(rings, 0, 1)))
        return run(theta, mass, mu=0.0, period_s=ring_s, samples=samples).theta_out_rad

    fine = pulled(640)
    assert rms(pulled(10), fine[::64]) < 0.02 * np.ptp(fine)


SMOOTH = "presliding", "conduit", {"z0": 2e-5, "spread": 5.0}


def let_go(rings, samples, mu=0.0, beside=(SMOOTH,), zeta=0.0):
    """A load with mass that a short pull leaves ringing, for so many rings of so many samples."""
    ring_s = 2 * np.pi * np.sqrt(1e-4 / (2 * K * R**2 + K_E))
    theta = 0.05 * np.clip(np.arange(rings * samples + 1) / samples, 0, 0.25) / 0.25
    mass = ("load-inertia", "load", {"J": 1e-4, "zeta": zeta})
    return run(theta, [mass, *beside], mu=mu, period_s=ring_s, samples=samples)


def first_and_last(samples):
    """Amplitude and phase of the second and of the fiftieth ring of an undamped load, as a complex number."""
    angle, turn = let_go(50, samples).theta_out_rad, np.exp(2j * np.pi * np.arange(samples) / samples)
    return (angle[k : k + samples] @ turn for k in (samples, 49 * samples))


def test_an_undamped_load_keeps_its_amplitude_and_its_phase():
    first, last = first_and_last(24)
    assert abs(last) == pytest.approx(abs(first), rel=1e-4)
    assert abs(np.angle(last / first)) < 0.02


def test_the_phase_error_of_a_ring_falls_with_the_fourth_power_of_the_step(monkeypatch):
    errors = []
    for step_rad in (0.6, 0.3, 0.15):
        monkeypatch.setattr("ccmodel.model.general.run.RINGING_STEP_RAD", step_rad)
        first, last = first_and_last(6)
        errors.append(abs(np.angle(last / first)))
    assert errors[0] > 12 * errors[1] > 144 * errors[2] > 0.0


def test_a_ring_on_presliding_friction_is_followed_to_a_thousandth(monkeypatch):
    """Backward differences of second order err by 1 % of the drive's torque and by several of the load's."""
    coarse = let_go(40, 14, mu=0.15, zeta=0.01)
    monkeypatch.setattr("ccmodel.model.general.run.RINGING_STEP_RAD", 0.01)
    monkeypatch.setattr("ccmodel.model.general.run.MOST_STEPS", 1024)
    fine = let_go(40, 14, mu=0.15, zeta=0.01)
    assert rms(coarse.tau_in_Nm, fine.tau_in_Nm) < 5e-4 * np.ptp(fine.tau_in_Nm)
    assert rms(coarse.tau_out_Nm, fine.tau_out_Nm) < 2e-3 * np.ptp(fine.tau_out_Nm)


@pytest.mark.parametrize("beside", [[SMOOTH], [("presliding", "conduit", {"z0": 5e-6, "spread": 1.0})]])
def test_a_load_with_mass_leaves_a_smooth_function_of_friction(beside):
    """Differences over friction are derivatives, not the jumps of a mass on contacts that stick."""
    found = [let_go(40, 20, 0.15 * (1 + 1e-4 * k), beside, zeta=0.01).tau_in_Nm for k in range(6)]
    first, second = np.diff(found, axis=0), np.diff(found, 2, axis=0)
    assert rms(second, 0.0) < 0.02 * rms(first, 0.0)


@pytest.mark.parametrize(
    ("beside", "follows"),
    [
        ([SMOOTH], True),
        ([], False),
        ([("presliding", "conduit", {"z0": 1e-6, "spread": 1.0})], False),
        ([SMOOTH, ("pulley-friction", "load-pulley", {"friction_torque": 0.02, "presliding": 1e-5})], False),
    ],
)
def test_a_ring_is_followed_without_damping_on_smooth_contacts_alone(beside, follows):
    pair = transmission()
    mass = ("load-inertia", "load", {"J": 1e-3, "zeta": 0.0})
    settings = settings_of([Active(*one) for one in (mass, *beside)])
    physics = _physics(pair, SpringLoad(K_E), settings, {})
    assert _steps(physics, pair, np.arange(1000) / 500)[1] == follows


def test_a_load_without_mass_is_stepped_once_a_sample():
    pair = transmission()
    physics = _physics(pair, SpringLoad(K_E), settings_of(()), {})
    assert _steps(physics, pair, np.arange(1000) / 500) == (1, False)


def test_a_mass_that_was_left_out_comes_with_its_damping():
    J, zeta, theta, dt = 2e-4, 0.2, sine(cycles=3), 1 / 500
    r = run(theta, ("load-inertia", "load", {"J": J, "zeta": zeta}))
    omega = np.gradient(r.theta_out_rad, dt)
    expected = K_E * r.theta_out_rad + 2 * zeta * np.sqrt(J * K_E) * omega + J * np.gradient(omega, dt)
    assert rms(r.tau_out_Nm[500:], expected[500:]) < 5e-3 * np.ptp(expected[500:])


def test_a_load_that_turns_against_the_drive_keeps_its_torque():
    theta = sine(0.3, cycles=1)
    torque = 0.02 * np.sin(2 * np.pi * np.arange(theta.size) / 170)
    r = run(theta, load=TorqueLoad(torque))
    assert pytest.approx(torque, abs=1e-7) == (r.T2_N - r.T4_N) * R
    for near, far in ((r.T1_N, r.T2_N), (r.T3_N, r.T4_N)):
        assert np.abs(np.log(near / far)).max() <= MU * np.pi + 1e-7


# Robustness and what is refused


@settings(deadline=None, max_examples=40)
@given(
    mu=st.floats(0.0, 0.4),
    T=st.floats(0.2, 20),
    bends=st.lists(st.floats(0, 3), min_size=1, max_size=4),
    reversals=st.lists(st.floats(-0.8, 0.8), min_size=2, max_size=8),
    noise=st.floats(0, 0.01),
)
def test_friction_and_balance_hold_for_any_path_and_motion(mu, T, bends, reversals, noise):
    path = ConduitPath(np.full(len(bends), L / len(bends)), bends)
    theta = np.concatenate([np.linspace(a, b, 40) for a, b in zip([0.0, *reversals[:-1]], reversals, strict=True)])
    theta += noise * np.random.default_rng(0).normal(size=theta.size)
    r = run(theta, path=path, T=T, mu=mu)
    assert np.abs((r.T2_N - r.T4_N) * R - K_E * r.theta_out_rad).max() < 1e-6
    for near, far in ((r.T1_N, r.T2_N), (r.T3_N, r.T4_N)):
        assert near.min() >= 0
        assert far.min() >= 0
        taut = (near > 1e-3) & (far > 1e-3)
        assert np.abs(np.log(near[taut] / far[taut])).max(initial=0) <= mu * path.bend_rad + 1e-5


def test_a_run_that_cannot_go_on_says_so():
    """A spring that pushes on harder than the cables hold: what was solved until then is returned, and why no more."""
    theta = np.linspace(0, 5, 100)
    pushing = [Active("load-stiffening", "load", {"K3": -10.0})]
    initial = InitialTension.uniform(HALF_LOOP, T0)
    r = simulate(transmission(), SpringLoad(1e-4), np.arange(100) * 0.01, theta, initial, pushing)
    assert r.status is Status.NO_CONVERGENCE
    assert 0 < r.reached < 100
    assert "load" in r.status.value
    for name in OUTPUTS:
        assert getattr(r, name).size == r.reached
        assert np.isfinite(getattr(r, name)).all()
    with pytest.raises(ModelError, match="no-convergence at sample"):
        r.complete()


def test_bad_input_is_refused_by_name():
    theta = np.zeros(4)
    initial = InitialTension.uniform(HALF_LOOP, T0)

    def attempt(time_s=np.arange(4.0), theta=theta, load=SpringLoad(K_E), mechanisms=(), elements=32):  # noqa: B008
        return simulate(transmission(), load, time_s, theta, initial, mechanisms, elements)

    with pytest.raises(ModelError, match="theta_in is not finite at sample 2"):
        attempt(theta=np.array([0, 0, np.nan, 0]))
    with pytest.raises(ModelError, match="time_s must increase; it does not at sample 3"):
        attempt(time_s=np.array([0.0, 1, 2, 2]))
    with pytest.raises(ModelError, match="load's series has 2 samples"):
        attempt(load=TorqueLoad(np.zeros(2)))
    with pytest.raises(ModelError, match="at least one element"):
        attempt(elements=0)
    with pytest.raises(ModelError, match="presliding acts at conduit"):
        attempt(mechanisms=[Active("presliding", "load", {"z0": 5e-5})])
    with pytest.raises(ModelError, match="z0 = -0.01 m, which must not be negative"):
        attempt(mechanisms=[Active("presliding", "conduit", {"z0": -0.01})])
    with pytest.raises(ModelError, match="share of the length"):
        attempt(mechanisms=[Active("kink", "conduit", {"beta": 0.5, "s": 1.5})])
    with pytest.raises(ModelError, match="relaxation has the parameters r, relaxed, spread, tau; got r"):
        attempt(mechanisms=[Active("relaxation", "cable", {"r": 0.1})])


def test_the_solver_is_compiled_once_whatever_the_memory_of_its_motion():
    """A column of a table, an array that cannot be written: numba would compile the solver anew for each."""
    plain = sine(samples=50, cycles=1)
    column, kept = np.column_stack([plain, plain])[:, 0], plain.copy()
    kept.setflags(write=False)
    runs = [run(theta, samples=50).theta_out_rad for theta in (plain, column, kept)]
    assert np.array_equal(runs[0], runs[1]) and np.array_equal(runs[0], runs[2])
    assert len(march.signatures) == 1


# Grid


def test_grid_respects_corners_and_kinks():
    grid = make_grid(LOOPS, 32, kinks=(Kink(0.5, 0.7, hold=0.5),))
    for corner in (0.3, 0.8, 0.6):
        assert np.abs(grid.boundary_m - corner).min() < 1e-12
    assert grid.boundary_rad[-1] == pytest.approx(LOOPS.bend_rad + 0.7)
    assert (grid.segment_m > 0).all()
    assert grid.segment_m.sum() == pytest.approx(L)
    kink = np.flatnonzero(grid.cell_m == 0)
    assert grid.cell_rad[kink] == pytest.approx([0.7])
    assert np.diff(grid.held_rad)[kink] == pytest.approx([0.35])


def test_grid_has_about_the_cells_asked_for():
    for path in (HALF_LOOP, LOOPS, ConduitPath([L], [0.0])):
        for elements in (8, 32, 128):
            assert abs(make_grid(path, elements).cell_m.size - elements) <= 3
