"""The paper's discretisation against closed forms and against what must hold whatever the numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.paper import simulate_pair
from ccmodel.model.transmission import Transmission

R, K_E, T0 = 0.006, 0.05, 7.3
HALF_LOOP = ConduitPath([1.2], [np.pi])


def transmission(path=HALF_LOOP, mu=0.156, k=7750.0):
    return Transmission(path, k * 1.2, mu, R, R)


def sine(amplitude=0.6, cycles=2, samples=500):
    return amplitude * np.sin(2 * np.pi * np.arange(cycles * samples + 1) / samples)


def run(theta_in, path=HALF_LOOP, T=T0, load=None, sections=16, **kw):
    load = load or SpringLoad(K_E)
    return simulate_pair(transmission(path, **kw), load, theta_in, InitialTension.uniform(path, T), sections)


def test_full_slip_loses_the_capstan_ratio():
    r = run(np.linspace(0, 0.6, 50))
    assert np.log(r.T1_N[-1] / r.T2_N[-1]) == pytest.approx(0.156 * np.pi, rel=1e-12)
    assert np.log(r.T4_N[-1] / r.T3_N[-1]) == pytest.approx(0.156 * np.pi, rel=1e-12)


def test_whole_slide_has_the_elongation_of_the_closed_form():
    # T1 (1 - exp(-mu phi)) L / (mu phi K) is the stretch of a cable that slides as a whole, (12).
    theta = np.linspace(0, 0.6, 50)
    r = run(theta)
    mu_phi, K = 0.156 * np.pi, 7750 * 1.2
    slack = theta[-1] * R - (r.theta_out_rad[-1]) * R + T0 / 7750
    assert r.T1_N[-1] * -np.expm1(-mu_phi) / mu_phi * 1.2 / K == pytest.approx(slack, rel=1e-12)


def test_the_first_pull_reaches_as_far_as_friction_lets_it():
    """Pull of a uniformly tensioned cable: the front at phi gives d = R_c T0 / (K mu) (exp(mu phi) - 1 - mu phi)."""
    mu, K, bend = 0.156, 7750 * 1.2, np.pi
    front = 0.5 * bend
    d = (1.2 / bend) * T0 / (K * mu) * (np.exp(mu * front) - 1 - mu * front)
    r = run(np.linspace(0, d / R, 2000), sections=512)
    assert r.T1_N[-1] == pytest.approx(T0 * np.exp(mu * front), rel=1e-5)
    assert r.theta_out_rad[-1] == 0
    assert r.T2_N[-1] == pytest.approx(T0, rel=1e-14)


def test_the_load_is_in_balance_at_every_sample():
    r = run(sine())
    assert np.abs(r.tau_out_Nm - K_E * r.theta_out_rad).max() < 1e-12


def test_nothing_moves_at_rest_or_without_friction_difference():
    r = run(np.zeros(20))
    for T in (r.T1_N, r.T2_N, r.T3_N, r.T4_N):
        assert pytest.approx(T0, rel=1e-14) == T
    assert (r.theta_out_rad == 0).all()


def test_without_friction_the_pair_is_two_springs():
    theta = sine(0.3)
    r = run(theta, mu=0.0)
    k = 7750.0
    expected = 2 * k * R**2 * theta / (2 * k * R**2 + K_E)
    assert r.theta_out_rad == pytest.approx(expected, abs=1e-12)
    assert pytest.approx(r.T2_N, abs=1e-10) == r.T1_N


def test_a_straight_path_is_without_friction():
    straight = ConduitPath([1.2], [0.0])
    theta = sine(0.3)
    assert pytest.approx(run(theta, mu=0.0).T1_N, abs=1e-10) == run(theta, path=straight).T1_N


def test_mirrored_motion_swaps_the_cables():
    theta = sine()
    r, m = run(theta), run(-theta)
    assert pytest.approx(m.T3_N, abs=1e-9) == r.T1_N
    assert pytest.approx(m.T4_N, abs=1e-9) == r.T2_N
    assert r.theta_out_rad == pytest.approx(-m.theta_out_rad, abs=1e-11)


def test_the_second_cycle_repeats_the_one_before():
    r = run(sine(cycles=3))
    assert r.T1_N[501:1001] == pytest.approx(r.T1_N[1001:], abs=1e-9)


def test_pace_does_not_matter():
    fine, coarse = run(sine(samples=1000)), run(sine(samples=500))
    assert fine.T1_N[::2] == pytest.approx(coarse.T1_N, abs=0.02)
    assert fine.theta_out_rad[::2] == pytest.approx(coarse.theta_out_rad, abs=2e-5)


def test_error_falls_with_the_number_of_sections():
    """Near tension and load angle settle as sections are added; the order is that of the mean-tension rule (17)."""
    theta = sine(samples=2000)
    reference = run(theta, sections=512)
    rms = [np.sqrt(np.mean((run(theta, sections=n).T1_N - reference.T1_N) ** 2)) for n in (8, 16, 32, 64)]
    orders = np.log2(np.array(rms[:-1]) / rms[1:])
    assert (orders > 1.0).all(), orders
    assert rms[1] < 0.005 * T0


def test_pretension_decides_on_slack():
    """No slack at a high pretension, one cable slack at the end of the stroke below, through a reversal at 0.7 N."""
    theta = sine(0.9)
    assert run(theta, T=7.0).T3_N.min() > 0
    low = run(theta, T=3.5)
    assert low.T3_N.min() == 0
    lowest = run(theta, T=0.7)
    reversal = 500 + 125
    assert (lowest.T3_N[reversal - 20 : reversal + 20] == 0).all()


def test_slack_cable_leaves_the_other_alone_with_the_load():
    theta = sine(0.6)
    r = run(theta, T=0.7)
    slack = r.T4_N == 0
    assert slack.any()
    assert r.T2_N[slack] * R == pytest.approx(K_E * r.theta_out_rad[slack], abs=1e-12)


def test_more_bend_widens_the_backlash():
    widths = []
    for half_loops in (1, 2, 3):
        r = run(sine(0.4, cycles=3), path=ConduitPath([1.2], [half_loops * np.pi]), T=5.0)
        last = slice(1000, None)
        still = np.abs(np.gradient(r.theta_out_rad[last])) < 1e-9
        widths.append(np.ptp(r.tau_in_Nm[last][still]))
    assert widths[0] < widths[1] < widths[2]


def test_radius_alone_changes_little():
    loops = []
    for radius in (0.0457, 0.0762):
        loop = np.pi * radius
        side = (1.2 - loop) / 2
        loops.append(run(sine(), path=ConduitPath([side, loop, side], [0, np.pi, 0])).tau_out_Nm)
    assert np.abs(loops[0] - loops[1]).max() < 0.02 * np.ptp(loops[0])


@pytest.mark.parametrize("curvature", [-1.0, 0.4, 1.0])
def test_a_profile_that_bends_keeps_its_ends_and_what_friction_holds(curvature):
    path = ConduitPath([0.4, 0.6, 0.2], [0.0, 2.0, 1.0])
    tension = InitialTension.between_ends(path, 0.1, (8.0, 7.0), (7.0, 7.0), (curvature, 0.0))
    assert tension.tension_A_N[[0, -1]] == pytest.approx([8.0, 7.0])
    assert path.bend_at(tension.x_m)[1] == pytest.approx(1.5)
    off = np.log(tension.tension_A_N[1]) - np.log([8.0, 7.0]).mean()
    assert off == pytest.approx(curvature * 0.5 * (0.3 - np.log(8 / 7)))
    tension.log_slopes(path, 0.1)  # Refuses more than friction holds.
    assert tension.tension_B_N == pytest.approx(7.0)


def test_initial_ends_beyond_friction_are_brought_to_its_bound():
    tension = InitialTension.between_ends(HALF_LOOP, 0.1, (10.0, 2.0), (5.0, 5.0))
    assert np.log(tension.tension_A_N[0] / tension.tension_A_N[1]) == pytest.approx(0.1 * np.pi)
    assert np.prod(tension.tension_A_N) == pytest.approx(20.0)
    assert tension.tension_B_N == pytest.approx([5.0, 5.0], rel=1e-14)


def test_bad_input_is_refused_by_name():
    with pytest.raises(ModelError, match="theta_in is not finite at sample 3"):
        run(np.array([0, 0.1, 0.2, np.nan]))
    with pytest.raises(ValueError, match="not negative"):
        SpringLoad(-1.0)
    with pytest.raises(ValueError, match="positive length"):
        ConduitPath([0.0], [1.0])


@given(
    mu=st.floats(0.02, 0.4),
    T=st.floats(0.2, 20),
    bends=st.lists(st.floats(0, 3), min_size=1, max_size=4),
    reversals=st.lists(st.floats(-0.6, 0.6), min_size=2, max_size=6),
)
def test_friction_and_balance_hold_for_any_path_and_motion(mu, T, bends, reversals):
    path = ConduitPath(np.full(len(bends), 0.3), bends)
    theta = np.concatenate([np.linspace(a, b, 40) for a, b in zip([0.0, *reversals[:-1]], reversals, strict=True)])
    r = run(theta, path=path, T=T, mu=mu)
    # Where moving parts meet within a segment the imbalance jumps by what the discretisation leaves.
    assert np.abs(r.tau_out_Nm - K_E * r.theta_out_rad).max() < 1e-7
    for near, far in ((r.T1_N, r.T2_N), (r.T3_N, r.T4_N)):
        assert near.min() >= 0
        assert far.min() >= 0
        taut = (near > 1e-6) & (far > 1e-6)
        assert np.abs(np.log(near[taut] / far[taut])).max(initial=0) <= mu * path.bend_rad + 1e-6
