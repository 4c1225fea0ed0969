"""The simulated rig against closed forms, its own refinement and the paper's observations."""

import numpy as np
import pytest
from virtual_runs import changed, channels, plan_of, strung

from virtualrig.campaign import run
from virtualrig.dynamics import simulate
from virtualrig.grid import make_grid
from virtualrig.trajectory import SimulationError

# Standard deviations of the sensors' noise; that of an encoder is its quantisation error.
NOISE = {"theta_out": 0.00314 / 12**0.5, "tau_in": 1e-4, "tau_out": 1e-4, "F_drive": 0.05, "F_load": 0.05}


def short(campaign, batch, recording):
    plan = plan_of(campaign, batch, recording, rest_s=0.02, start_up_cycles=0.25, cycles=0.6)
    return plan, strung(campaign, plan)


def assert_same_to_the_sensors(campaign, one, other):
    one, other = channels(campaign, one), channels(campaign, other)
    for name, noise in NOISE.items():
        difference = np.abs(one[name] - other[name])
        assert np.sqrt(np.mean(difference**2)) < noise / 4, name
        # Slip fronts start at reversals with infinite slope, where one or two samples may differ by more.
        assert np.mean(difference < noise) > 0.98, name
        assert difference.max() < 5 * noise, name


@pytest.mark.parametrize(
    ("batch", "recording"),
    [("half-loop", "half-loop-7.3N-a"), ("loops", "loops-2-a"), ("pretension", "pretension-0.7N-a")],
)
def test_twice_the_nodes_and_half_the_bristle_stay_below_the_noise(campaign, batch, recording):
    finer = changed(
        campaign,
        numerics__cell_length_m=campaign.numerics.cell_length_m / 2,
        numerics__cell_bend_rad=campaign.numerics.cell_bend_rad / 2,
        numerics__bristle_length_m=campaign.numerics.bristle_length_m / 2,
    )
    plan, preparation = short(campaign, batch, recording)
    assert_same_to_the_sensors(campaign, run(campaign, plan, preparation), run(finer, plan, preparation))


@pytest.mark.parametrize(
    ("batch", "recording"), [("half-loop", "half-loop-7.3N-a"), ("pretension", "pretension-0.7N-a")]
)
def test_inertia_and_damping_stay_below_the_noise(campaign, batch, recording):
    lighter = changed(
        campaign,
        rig__cable__density_kg_per_m=campaign.rig.cable.density_kg_per_m / 2,
        rig__load__inertia_kg_m2=campaign.rig.load.inertia_kg_m2 / 2,
        rig__load__damping_Nms_per_rad=campaign.rig.load.damping_Nms_per_rad / 2,
        numerics__drag_rate_per_s=campaign.numerics.drag_rate_per_s / 2,
    )
    plan, preparation = short(campaign, batch, recording)
    assert_same_to_the_sensors(campaign, run(campaign, plan, preparation), run(lighter, plan, preparation))


def test_the_radius_study_is_resolved_as_well(campaign):
    # A coarser grid bounds the error equally well; a finer one would be slow, because this study has short cells.
    coarser = changed(
        campaign,
        numerics__cell_bend_rad=campaign.numerics.cell_bend_rad * 2,
        numerics__bristle_length_m=campaign.numerics.bristle_length_m * 2,
    )
    plan, preparation = short(campaign, "radius", "radius-7.62cm-a")
    assert_same_to_the_sensors(campaign, run(campaign, plan, preparation), run(coarser, plan, preparation))


@pytest.mark.parametrize(
    ("batch", "recording", "bend_rad"),
    [
        ("half-loop", "half-loop-7.3N-a", np.pi),
        ("loops", "loops-3-a", 3 * np.pi),
    ],
)
def test_capstan_relation_in_full_slip(campaign, trajectory, batch, recording, bend_rad):
    t = trajectory(batch, recording)
    loss = campaign.rig.cable.friction_coefficient * bend_rad
    # Long after the last reversal both cables slip over their whole length.
    rate = np.gradient(t.theta_in_rad, t.time_s)
    after = t.time_s > 1.5
    pulled = after & (rate > 0.7 * rate.max()) & (t.theta_in_rad > 0)
    released = after & (rate < 0.7 * rate.min()) & (t.theta_in_rad < 0)
    assert pulled.sum() > 50
    assert released.sum() > 50
    np.testing.assert_allclose(np.log(t.T1_N[pulled] / t.T2_N[pulled]), loss, atol=1e-3)
    np.testing.assert_allclose(np.log(t.T3_N[released] / t.T4_N[released]), loss, atol=1e-3)


def test_tension_is_the_stretch_of_the_whole_cable_in_full_slip(campaign, trajectory):
    """T1 against the closed form k e m / (1 - exp(-m)) for a pulled cable of stretch e and m = mu phi."""
    t = trajectory("half-loop", "half-loop-7.3N-a")
    rig = campaign.rig
    m = rig.cable.friction_coefficient * np.pi
    rate = np.gradient(t.theta_in_rad, t.time_s)
    sliding = (t.time_s > 1.5) & (rate > 0.7 * rate.max()) & (t.theta_in_rad > 0)
    stretch = 7.3 / rig.cable.stiffness_N_per_m + rig.pulley_radius_m * (
        t.theta_in_rad - (t.theta_out_rad - t.theta_out_rad[0])
    )
    expected = rig.cable.stiffness_N_per_m * stretch * m / -np.expm1(-m)
    np.testing.assert_allclose(t.T1_N[sliding], expected[sliding], rtol=1e-3)


def test_the_rig_rests_in_equilibrium(campaign):
    plan = plan_of(campaign, "loops", "loops-3-a", rest_s=0.3, start_up_cycles=1e-3, cycles=1e-3)
    preparation = strung(campaign, plan, profile_share=(0.4, 0.05))
    t = run(campaign, plan, preparation)
    rest = t.time_s <= 0.3
    for values in (t.T1_N, t.T2_N, t.T3_N, t.T4_N, t.theta_out_rad):
        assert np.ptp(values[rest]) < 1e-9
    torque = campaign.rig.pulley_radius_m * (t.T2_N - t.T4_N)[0]
    assert torque == pytest.approx(campaign.rig.load.spring_stiffness_Nm_per_rad * t.theta_out_rad[0])
    assert abs(torque) > 1e-3
    fall = campaign.rig.cable.friction_coefficient * 3 * np.pi * np.array(preparation.profile_share)
    np.testing.assert_allclose(np.log([t.T1_N[0] / t.T2_N[0], t.T3_N[0] / t.T4_N[0]]), fall, rtol=1e-2)


def test_the_load_is_a_spring_to_the_sensors(campaign, trajectory):
    t = trajectory("half-loop", "half-loop-7.3N-a")
    torque = campaign.rig.pulley_radius_m * (t.T2_N - t.T4_N)
    left = torque - campaign.rig.load.spring_stiffness_Nm_per_rad * t.theta_out_rad
    assert np.sqrt(np.mean(left**2)) < campaign.sensors.torque.noise_Nm / 4


def test_exchanging_the_cables_mirrors_the_run(campaign):
    plan = plan_of(campaign, "half-loop", "half-loop-7.3N-a", rest_s=0.02, cycles=0.2)
    numerics = campaign.numerics
    grid = make_grid(plan.conduit, numerics.cell_length_m, numerics.cell_bend_rad)
    time_s = np.arange(600) / 500
    angle, rate = plan.excitation.angle_and_rate(time_s)
    preparation = strung(campaign, plan, profile_share=(0.35, 0.1))
    exchanged = strung(campaign, plan, profile_share=(0.1, 0.35))
    one = simulate(campaign.rig, grid, numerics, preparation, time_s, (angle, rate))
    other = simulate(campaign.rig, grid, numerics, exchanged, time_s, (-angle, -rate))
    np.testing.assert_allclose(other.theta_out_rad, -one.theta_out_rad, atol=1e-12)
    np.testing.assert_allclose(other.T1_N, one.T3_N, atol=1e-9)
    np.testing.assert_allclose(other.T4_N, one.T2_N, atol=1e-9)


def test_friction_dissipates_energy(campaign, trajectory):
    t = trajectory("half-loop", "half-loop-7.3N-a")
    radius = campaign.rig.pulley_radius_m
    cycle = slice(-1000, None)  # the last two seconds: one cycle
    work_in = np.trapezoid((radius * (t.T1_N - t.T3_N))[cycle], t.theta_in_rad[cycle])
    work_out = np.trapezoid((radius * (t.T2_N - t.T4_N))[cycle], t.theta_out_rad[cycle])
    assert work_in > 0
    assert abs(work_out) < 1e-3 * work_in


def slack(tension):
    # The inertia of a slack cable leaves a small tension, below a hundredth of the load cell's accuracy.
    return tension < 1e-3


def test_no_cable_goes_slack_at_7_N(trajectory):
    t = trajectory("pretension", "pretension-7N-a")
    assert min(t.T1_N.min(), t.T2_N.min(), t.T3_N.min(), t.T4_N.min()) > 1


def test_at_3_5_N_a_cable_is_slack_before_the_reversal_only(trajectory):
    """Phase IVa: slack begins before the reversal and ends before the load returns."""
    t = trajectory("pretension", "pretension-3.5N-a")
    before, after = around_reversal(t)
    assert slack(t.T3_N[before]).any()
    assert (t.T1_N[slack(t.T3_N)] > 1).all()
    assert not (slack(t.T3_N) & after & load_returns(t)).any()


def test_at_0_7_N_slack_outlasts_the_reversal(trajectory):
    """Phase IVb: the load returns, driven by one cable, while the other is still slack."""
    t = trajectory("pretension", "pretension-0.7N-a")
    before, after = around_reversal(t)
    assert slack(t.T3_N[before]).mean() > 0.5
    assert (slack(t.T3_N) & after & load_returns(t)).sum() > 50


def around_reversal(t):
    """Samples within 0.5 s before and after the drive's largest angle, which is at 2.52 s of `trajectory`'s runs."""
    peak = t.time_s[np.argmax(np.where(t.time_s > 2, t.theta_in_rad, -np.inf))]
    assert peak == pytest.approx(2.52, abs=0.01)
    return (t.time_s > peak - 0.5) & (t.time_s < peak), (t.time_s > peak) & (t.time_s < peak + 0.5)


def load_returns(t):
    # 0.05 rad/s is well above the ringing of a load that is held by friction.
    return np.gradient(t.theta_out_rad, t.time_s) < -0.05


def test_more_loops_widen_the_backlash_and_keep_a_cable_slack_for_longer(campaign, trajectory):
    runs = [channels(campaign, trajectory("loops", f"loops-{n}-a")) for n in (1, 2, 3)]
    cycle = slice(-1000, None)
    widths, slack_times = [], []
    for n, run_ in enumerate(runs, start=1):
        # Drive torques at which the load torque passes through zero.
        tau_in, tau_out = run_["tau_in"][cycle], run_["tau_out"][cycle]
        crossings = np.flatnonzero(np.diff(np.sign(tau_out)))
        widths.append(np.ptp(tau_in[crossings]))
        t = trajectory("loops", f"loops-{n}-a")
        slack_times.append(slack(t.T3_N[cycle]).mean() + slack(t.T1_N[cycle]).mean())
    assert widths[0] < widths[1] < widths[2]
    assert 0 < slack_times[0] < slack_times[1] < slack_times[2]


def test_a_tension_above_the_limit_is_refused(campaign):
    tight = changed(campaign, numerics__tension_limit_N=7.5)
    plan, preparation = short(tight, "half-loop", "half-loop-7.3N-a")
    with pytest.raises(SimulationError, match=r"tension_limit_N"):
        run(tight, plan, preparation)
