"""Effects of the virtual rig: no trace where they are not, what is known of them where they are."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError
from virtual_runs import changed, channels, plan_of, strung

from virtualrig import dynamics, effect_dynamics, effect_march
from virtualrig.campaign import prepare, rig_during, run
from virtualrig.config import Campaign
from virtualrig.effects import TWINS, Effects
from virtualrig.grid import make_grid
from virtualrig.sensors import Side, sensed
from virtualrig.trajectory import Preparation, Trajectory

ALONE = {
    "presliding-dahl": {"presliding": {"law": "dahl", "length_m": 1e-4}},
    "presliding-iwan": {"presliding": {"law": "iwan", "shortest_m": 1e-5, "longest_m": 2e-4}},
    "stribeck": {"stribeck": {"rise": 0.3, "speed_m_per_s": 3e-3}},
    "viscous": {"viscous_Ns_per_m2": 200.0},
    "load-dependent": {"load_dependent_friction": {"exponent": -0.3}},
    "drag": {"drag_N": 1.0},
    "kink": {"kinks": [{"bend_rad": 0.8, "place_share": 0.4}]},
    "running-in": {"running_in": {"change": 0.3, "scale": 0.5}},
    "running-in-by-travel": {"running_in": {"change": 0.3, "over": "travel_m", "scale": 5e-3}},
    "friction-asymmetry": {"cable_asymmetry": {"friction_ratio": 1.3}},
    "stiffness-asymmetry": {"cable_asymmetry": {"stiffness_ratio": 0.8}},
    "relaxation": {
        "relaxation": [{"share": 0.1, "time_constant_s": 0.3}, {"share": 0.1, "time_constant_s": 5.0}],
    },
    "settling": {"strand_settling": {"tension_scale_N": 3.0}},
    "drive-termination": {"termination_compliance": {"drive_m_per_N": 5e-5}},
    "load-termination": {"termination_compliance": {"load_m_per_N": 5e-5}},
    "conduit": {"conduit_compliance_m_per_N": 4e-5},
    "drive-bearing": {"drive_pulley": {"friction": {"torque_Nm": 4e-3}}},
    "load-bearing": {"load_pulley": {"friction": {"torque_Nm": 4e-3}}},
    "drive-eccentricity": {"drive_pulley": {"eccentricity": {"share": 0.05, "phase_rad": 0.5}}},
    "load-eccentricity": {"load_pulley": {"eccentricity": {"share": 0.05, "phase_rad": 0.5}}},
    "backlash": {"load": {"half_gap_rad": 0.03}},
    "stiffening": {"load": {"cubic_Nm_per_rad3": 0.1}},
    "inertia": {"load": {"inertia_kg_m2": 5e-4}},
    "hysteretic-load": {"hysteretic_load": {"torque_Nm": 4e-3, "angle_rad": 0.1}},
    "presliding-bouc-wen": {"presliding": {"law": "bouc-wen", "length_m": 1e-4, "exponent": 0.5}},
    "stribeck-hess-soom": {"stribeck": {"law": "hess-soom", "rise": 0.3, "speed_m_per_s": 3e-3}},
    "stribeck-logarithmic": {"stribeck": {"law": "logarithmic", "rise": 0.3, "speed_m_per_s": 3e-3}},
    "viscous-thinning": {"viscous_Ns_per_m2": 200.0, "viscous_power": 0.5},
    "viscous-eyring": {"viscous_Ns_per_m2": 200.0, "viscous_eyring_m_per_s": 3e-3},
    "load-dependent-logarithmic": {"load_dependent_friction": {"law": "logarithmic", "exponent": -0.3}},
    "seal": {"drag_N": 1.0, "drag_at_share": 0.9},
    "two-seals": {"drag_N": 1.0, "drag_at_share": 0.1, "drag_far_share": 0.9, "drag_far_part": 0.4},
    "spread-kink": {"kinks": [{"bend_rad": 0.8, "place_share": 0.4, "spread_m": 0.05}]},
    "hyperbolic-running-in": {"running_in": {"law": "hyperbolic", "change": 0.3, "scale": 0.5}},
    "settling-exponential": {"strand_settling": {"law": "exponential", "tension_scale_N": 3.0}},
    "settling-toe": {"strand_settling": {"law": "toe", "tension_scale_N": 3.0}},
    "knot": {"termination_compliance": {"load_m_per_N": 1e-4, "load_bedding_N": 3.0}},
    "closing-conduit": {"conduit_compliance_m_per_N": 6e-5, "conduit_closes_N": 2.0},
    "plain-drive-bearing": {"drive_pulley": {"friction": {"torque_Nm": 4e-3, "share": 1.0, "at_pull_N": 15.0}}},
    "plain-load-bearing": {"load_pulley": {"friction": {"torque_Nm": 4e-3, "share": 1.0, "at_pull_N": 15.0}}},
    "palmgren-drive-bearing": {
        "drive_pulley": {"friction": {"law": "palmgren", "torque_Nm": 4e-3, "share": 0.6, "at_pull_N": 15.0}}
    },
    "two-lobes": {"load_pulley": {"eccentricity": {"share": 0.05, "second_share": 0.03, "second_phase_rad": 0.5}}},
    "soft-gap": {"load": {"half_gap_rad": 0.03, "soft_flank_rad": 0.01}},
    "exponential-spring": {"load": {"exponential_per_rad": 3.0}},
    "bumper": {"load": {"bumper_Nm_per_rad": 0.05, "bumper_at_rad": 0.2}},
    "directional": {"directional_friction": {"bias": 0.2}},
    "positional": {"positional_friction": {"rise": 0.2, "period_m": 0.01}},
    "yielding-liner": {"yielding_liner": {"rise": 0.4, "tension_N": 8.0, "width_N": 1.0}},
    "breathing": {"breathing_friction": {"swing": 0.2, "period_s": 3.0, "phase_rad": 0.3}},
    "worn-coating": {"worn_coating": {"rise": 0.4, "travel_m": 4e-3, "width_m": 5e-4}},
    "strengthening-liner": {"strengthening_liner": {"rise": 0.2, "speed_m_per_s": 1e-3}},
    "ageing": {"ageing_contact": {"rise": 0.1, "shortest_s": 0.02, "renewal_m": 2e-4}},
    "detents": {"load": {"detent_Nm": 2e-3, "detent_number": 12.0, "detent_phase_rad": 0.7}},
    "yielding-cable": {"yielding_cable": {"share": 0.4, "tension_N": 8.0}},
}
TENSIONS = ("T1_N", "T2_N", "T3_N", "T4_N")


@pytest.fixture(scope="module")
def coarse(campaign):
    """The committed rig on a quarter of the cells, which is fast, and right to a percent."""
    return changed(
        campaign,
        numerics__cell_length_m=0.05,
        numerics__cell_bend_rad=0.2,
        numerics__bristle_length_m=4e-7,
        numerics__tension_limit_N=40.0,
    )


@pytest.fixture(scope="module")
def recorded(coarse):
    """Call with effects by name for a run of them, over three quarters of a cycle; each is simulated once."""
    made = {}

    def simulated(name, profile_share=(0.2, 0.2), **excitation):
        key = (name, profile_share, *excitation.items())
        if key not in made:
            kept = {"rest_s": 0.05, "start_up_cycles": 0.25, "cycles": 0.5} | excitation
            plan = plan_of(coarse, "half-loop", "half-loop-7.3N-a", **kept)
            rig = changed(coarse, rig__effects=Effects.model_validate(ALONE.get(name, {})))
            made[key] = run(rig, plan, strung(rig, plan, profile_share))
        return made[key]

    return simulated


def full_slip(t):
    """A late stretch in which cable A is pulled: it slips over its whole length."""
    rate = np.gradient(t.theta_in_rad, t.time_s)
    return (rate > 0.5 * rate.max()) & (t.theta_in_rad > 0.5)


def test_the_ideal_rig_is_the_same_with_and_without_the_paths_of_effects(coarse):
    plan = plan_of(coarse, "half-loop", "half-loop-7.3N-a", rest_s=0.05, start_up_cycles=0.25, cycles=0.5)
    numerics = coarse.numerics
    grid = make_grid(plan.conduit, numerics.cell_length_m, numerics.cell_bend_rad)
    time_s = np.arange(700) / 500
    motion = plan.excitation.angle_and_rate(time_s)
    plain, other = (
        simulate(coarse.rig, grid, numerics, strung(coarse, plan), time_s, motion)
        for simulate in (dynamics.simulate, effect_dynamics.simulate)
    )
    for name in (*TENSIONS, "theta_out_rad", "tau_in_Nm", "tau_out_Nm"):
        np.testing.assert_allclose(getattr(other, name), getattr(plain, name), atol=1e-5, err_msg=name)


@pytest.mark.parametrize("name", ALONE)
def test_it_rests_in_balance_and_then_acts(coarse, recorded, name):
    t, ideal = recorded(name), recorded("none")
    rest = t.time_s <= 0.05
    # At rest tensions change where the cable relaxes, and hardly where bristles hold less from moment to moment.
    slowly = ("running-in", "hyperbolic-running-in", "breathing", "ageing")
    settles = ({"relaxation": 0.15} | dict.fromkeys(slowly, 1e-3)).get(name, 1e-6)
    for tension in TENSIONS:
        assert np.ptp(getattr(t, tension)[rest]) < settles * 7.3, tension
    seen, wanted = channels(coarse, t) | {"tau_in": t.tau_in_Nm}, channels(coarse, ideal)
    assert max(np.abs(seen[c] - wanted[c]).max() / np.ptp(wanted[c]) for c in seen) > 0.01


def test_friction_of_one_cable_shows_in_that_cable(campaign, recorded):
    t = recorded("friction-asymmetry", cycles=1.0)
    loss = campaign.rig.cable.friction_coefficient * np.pi
    rate = np.gradient(t.theta_in_rad, t.time_s)
    back = (rate < 0.7 * rate.min()) & (t.theta_in_rad < 0)
    np.testing.assert_allclose(np.log(t.T1_N / t.T2_N)[full_slip(t)], loss, rtol=3e-3)
    np.testing.assert_allclose(np.log(t.T3_N / t.T4_N)[back], 1.3 * loss, rtol=3e-3)


def test_a_kink_adds_its_bend(campaign, recorded):
    t = recorded("kink")
    expected = campaign.rig.cable.friction_coefficient * (np.pi + 0.8)
    np.testing.assert_allclose(np.log(t.T1_N / t.T2_N)[full_slip(t)], expected, rtol=3e-3)


def test_friction_knows_its_direction(campaign, recorded):
    t = recorded("directional")
    slip, loss = full_slip(t), campaign.rig.cable.friction_coefficient * np.pi
    np.testing.assert_allclose(np.log(t.T1_N / t.T2_N)[slip], 1.2 * loss, rtol=5e-3)
    np.testing.assert_allclose(np.log(t.T4_N / t.T3_N)[slip], 0.8 * loss, rtol=5e-3)


def true_law(coarse, name):
    """The law of the one effect of `ALONE`, as the proof's answers have it."""
    rig = changed(coarse, rig__effects=Effects.model_validate(ALONE[name])).rig
    twins = [twin for twin in TWINS.values() if twin.fields.get("rig", {}).keys() & ALONE[name].keys()]
    (twin,) = twins or [TWINS["unlisted-detent-load"]]
    return twin.law(rig, twin.places[0])


def test_friction_follows_the_table_of_its_law(coarse, recorded):
    """Along a cable in full slip dT / (f T) is mu dphi: its integral from end to end is mu pi."""
    loss = coarse.rig.cable.friction_coefficient * np.pi
    for name in ("yielding-liner", "load-dependent", "breathing", "worn-coating", "strengthening-liner"):
        t, law = recorded(name), true_law(coarse, name)
        rate = 0.006 * np.abs(np.gradient(t.theta_in_rad, t.time_s))
        travel = 0.006 * np.abs(np.diff(t.theta_in_rad, prepend=t.theta_in_rad[0])).cumsum()
        state = {"time": t.time_s, "travel": travel, "speed": np.log10(rate.clip(1e-9))}
        for k in np.flatnonzero(full_slip(t))[::10]:
            T = np.geomspace(t.T2_N[k], t.T1_N[k], 400)
            x = T if law.argument == "tension" else np.full(400, state[law.argument][k])
            found = np.trapezoid(1 / (T * np.interp(x, law.x, law.y)), T)
            assert found == pytest.approx(loss, rel=0.015), name


def test_contacts_that_have_rested_hold_more_by_their_age(coarse, recorded):
    """In motion at 15 mm/s a contact is 13 ms old: friction is that of this age."""
    t, law = recorded("ageing"), true_law(coarse, "ageing")
    k = np.flatnonzero(full_slip(t))[5]
    speed = 0.006 * np.gradient(t.theta_in_rad, t.time_s)[k]
    expected = coarse.rig.cable.friction_coefficient * np.pi * np.interp(np.log10(2e-4 / speed), law.x, law.y)
    assert np.log(t.T1_N[k] / t.T2_N[k]) == pytest.approx(expected, rel=0.02)


def test_detents_are_on_top_of_the_springs_torque(coarse, recorded):
    t, law = recorded("detents"), true_law(coarse, "detents")
    slip = full_slip(t) & (t.theta_out_rad < law.x[-1])
    over = t.tau_out_Nm - coarse.rig.load.spring_stiffness_Nm_per_rad * t.theta_out_rad
    assert slip.sum() > 20
    np.testing.assert_allclose(over[slip], np.interp(t.theta_out_rad[slip], law.x, law.y), atol=2e-4)


def test_a_cable_that_yields_has_the_compliance_of_its_law(coarse):
    """Elongation and tension are inverse, and the elongation is the integral of the law's compliance."""
    rig = changed(coarse, rig__effects=Effects.model_validate(ALONE["yielding-cable"]))
    physics = effect_dynamics._physics(rig.rig, rig.numerics, Preparation(0.1, (7.3, 7.3), (0.0, 0.0)))
    law, tension = true_law(coarse, "yielding-cable"), np.array([[2.0, 8.0, 8.5, 14.0, 19.0]])
    one = np.ones_like(tension)
    stretch = effect_dynamics._elongation(physics, tension, one, 0 * one)
    fine = np.linspace(0.0, 20.0, 20001)
    compliance = np.where(fine > 8.0, np.interp(12.0, law.x, law.y), np.interp(4.0, law.x, law.y))
    whole = np.concatenate([[0.0], np.cumsum(np.diff(fine) * compliance[1:])])
    np.testing.assert_allclose(stretch[0], np.interp(tension[0], fine, whole), atol=2e-3)
    back = np.empty(5)
    effect_march._set_elastic(physics, back, np.zeros(6), stretch[0], one[0], 0 * one[0], 0 * one[0], 0.0, False)
    np.testing.assert_allclose(back, tension[0], rtol=1e-12)


@pytest.mark.parametrize("name", ["settling", "settling-exponential", "settling-toe"])
def test_a_settling_cable_has_the_compliance_of_its_law(coarse, name):
    rig, law = changed(coarse, rig__effects=Effects.model_validate(ALONE[name])), true_law(coarse, name)
    physics = effect_dynamics._physics(rig.rig, rig.numerics, Preparation(0.1, (7.3, 7.3), (0.0, 0.0)))
    scale, step = np.full(law.x.shape, 3.0), 1e-4
    more, less = (effect_dynamics._elongation(physics, law.x + s, np.ones_like(scale), scale) for s in (step, -step))
    compliance = (more - less) / (2 * step)
    np.testing.assert_allclose(compliance, law.y, rtol=2e-3)


def test_a_gap_and_a_bearing_are_what_their_laws_say(coarse):
    for name in ("backlash", "soft-gap"):
        rig = changed(coarse, rig__effects=Effects.model_validate(ALONE[name]))
        physics = effect_dynamics._physics(rig.rig, rig.numerics, Preparation(0.1, (7.3, 7.3), (0.0, 0.0)))
        law = TWINS["backlash"].law(rig.rig, "load-pulley")
        torque = [effect_march.spring_torque(physics, theta) - physics.spring * theta for theta in law.x]
        np.testing.assert_allclose(torque, law.y, atol=1e-12)
    rig = changed(coarse, rig__effects=Effects.model_validate(ALONE["drive-bearing"])).rig
    law = TWINS["pulley-friction"].law(rig, "drive-pulley")
    course = 4e-3 * effect_march.bearing_course(law.x / rig.pulley_radius_m, 1e-3)
    np.testing.assert_allclose(course, law.y, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "side", "faults"),
    [
        ("unlisted-cogging-motor", "torque_Nm", {"cogging_Nm": 2e-3, "cogging_poles": 14.0, "cogging_phase_rad": 0.4}),
        ("unlisted-windage", "torque_Nm", {"windage_Nms2": 1e-3}),
        ("unlisted-bent-load-cell", "force_N", {"force_curvature_per_N": -4e-3}),
        ("unlisted-side-force", "force_N", {"side_force_N": 0.3, "side_force_lobes": 3.0, "side_force_phase_rad": 1.0}),
        ("unlisted-breathing-torque-zero", "torque_Nm", {"zero_swing_Nm": 1e-3, "zero_period_s": 8.0}),
        ("unlisted-torque-curvature", "torque_Nm", {"torque_curvature_per_Nm2": 20.0}),
        ("unlisted-encoder-runout", "angle_rad", {"angle_runout_rad": 0.02, "angle_runout_phase_rad": 0.3}),
        ("torque-scale", "torque_Nm", {"torque_gain": 0.05}),
        ("load-cell-scale", "force_N", {"load_cell_gain": 0.05}),
        ("load-cell-drift", "force_N", {"load_cell_drift_N_per_s": 0.1, "load_cell_warm_up_s": 3.0}),
        (
            "load-cell-drift",
            "force_N",
            {"load_cell_drift_N_per_s": 0.1, "load_cell_warm_up_s": 3.0, "load_cell_warms_up": "by-root"},
        ),
    ],
)
def test_a_sensor_reads_more_by_the_table_of_its_law(campaign, name, side, faults):
    twin, time_s = TWINS[name], np.linspace(0, 8, 2001)
    place = "drive-sensor" if "drive-pulley" in twin.places else twin.places[0]
    group = {"drive-sensor": "drive_sensors", "load-sensor": "load_sensors"}[place]
    rig = changed(campaign, rig__effects=Effects.model_validate({group: faults})).rig
    truth = Side(0.5 * np.sin(time_s), 0.06 * np.cos(time_s), 12 + 5 * np.sin(2 * time_s))
    law = twin.law(rig, place)
    of_side = dict(zip(("angle_rad", "torque_Nm", "force_N"), truth, strict=True))
    speed = np.gradient(truth.angle_rad, time_s)
    x = {"reading": of_side[side], "time": time_s, "speed": speed}.get(law.argument, truth.angle_rad)
    read = sensed(time_s, truth, rig, getattr(rig.effects, group))
    added = getattr(read, side) - of_side[side]
    assert np.ptp(added) > 0
    np.testing.assert_allclose(added, np.interp(x, law.x, law.y), atol=0.03 * np.ptp(added))


def test_relaxation_decays_with_both_time_constants(recorded):
    t = recorded("relaxation", profile_share=(0.0, 0.0), rest_s=1.0, start_up_cycles=1e-3, cycles=1e-3)
    rest = t.time_s <= 1.0
    expected = 7.3 * (1 - 0.1 * -np.expm1(-t.time_s / 0.3) - 0.1 * -np.expm1(-t.time_s / 5.0))
    for tension in TENSIONS:
        np.testing.assert_allclose(getattr(t, tension)[rest], expected[rest], rtol=1e-4)


def test_a_cable_that_was_tensioned_earlier_relaxes_on_from_there(coarse):
    """The rest goes on where a rest that began with the tensioning has come, at the tension that it has there."""
    rig = changed(coarse, rig__effects=Effects.model_validate(ALONE["relaxation"]))
    plan = plan_of(rig, "half-loop", "half-loop-7.3N-a", rest_s=2.0, start_up_cycles=1e-3, cycles=1e-3)
    fresh = run(rig, plan, strung(rig, plan, (0.0, 0.0)))
    relaxed_N = float(np.interp(0.5, fresh.time_s, fresh.T1_N))
    earlier = replace(strung(rig, plan, (0.0, 0.0)), pretension_N=(relaxed_N, relaxed_N), tensioned_before_s=0.5)
    later = run(rig, plan, earlier)
    for tension in TENSIONS:
        expected = np.interp(later.time_s + 0.5, fresh.time_s, getattr(fresh, tension))
        rest = later.time_s <= 1.4
        np.testing.assert_allclose(getattr(later, tension)[rest], expected[rest], rtol=1e-4)


def test_the_time_since_the_tensioning_is_drawn_within_its_range(coarse):
    rig = changed(coarse, repeatability__tensioned_before_s=(120.0, 300.0))
    plan = plan_of(rig, "half-loop", "half-loop-7.3N-a")
    drawn = [prepare(rig, plan, np.random.default_rng(seed)).tensioned_before_s for seed in range(20)]
    assert 120 <= min(drawn) < 200 < 220 < max(drawn) <= 300
    assert prepare(coarse, plan, np.random.default_rng(0)).tensioned_before_s == 0.0


def test_bearings_show_where_they_are(coarse, recorded):
    ideal, drive, load = (recorded(name) for name in ("none", "drive-bearing", "load-bearing"))
    slip = full_slip(ideal)
    for tension in TENSIONS:
        np.testing.assert_allclose(getattr(drive, tension), getattr(ideal, tension), atol=1e-4)
    np.testing.assert_allclose((drive.tau_in_Nm - ideal.tau_in_Nm)[slip], 4e-3, rtol=1e-2)
    spring = coarse.rig.load.spring_stiffness_Nm_per_rad * load.theta_out_rad
    np.testing.assert_allclose(load.tau_out_Nm[slip], spring[slip], atol=1e-4)
    across = coarse.rig.pulley_radius_m * (load.T2_N - load.T4_N) - load.tau_out_Nm
    np.testing.assert_allclose(across[slip], 4e-3, rtol=1e-2)


@pytest.mark.parametrize(
    ("name", "torque"),
    [
        ("plain-drive-bearing", lambda pull: 4e-3 * pull / 15.0),
        ("palmgren-drive-bearing", lambda pull: 4e-3 * (0.4 + 0.6 * (pull / 15.0) ** (4 / 3))),
    ],
)
def test_friction_of_a_drives_bearing_grows_with_the_cables_pull(coarse, recorded, name, torque):
    ideal, t = recorded("none"), recorded(name)
    slip = full_slip(t)
    np.testing.assert_allclose((t.tau_in_Nm - ideal.tau_in_Nm)[slip], torque(t.T1_N + t.T3_N)[slip], rtol=1e-2)


def test_friction_of_a_plain_bearing_at_the_load_is_between_cables_and_sensor(coarse, recorded):
    t = recorded("plain-load-bearing")
    slip = full_slip(t)
    across = coarse.rig.pulley_radius_m * (t.T2_N - t.T4_N) - t.tau_out_Nm
    np.testing.assert_allclose(across[slip], 4e-3 * (t.T2_N + t.T4_N)[slip] / 15.0, rtol=1e-2)


def test_a_hysteretic_spring_shows_in_the_loads_torque(coarse, recorded):
    t = recorded("hysteretic-load", cycles=1.0)
    over = t.tau_out_Nm - coarse.rig.load.spring_stiffness_Nm_per_rad * t.theta_out_rad
    assert over[full_slip(t)].mean() == pytest.approx(4e-3, rel=0.05)
    assert over.min() < -3e-3


def test_every_law_of_a_load_spring_is_the_torque_at_the_pulley(coarse, recorded):
    spring, tau = coarse.rig.load.spring_stiffness_Nm_per_rad, "tau_out_Nm"
    laws = {
        "exponential-spring": lambda theta: spring * np.sinh(3.0 * theta) / 3.0,
        "bumper": lambda theta: spring * theta + 0.05 * np.sign(theta) * np.maximum(np.abs(theta) - 0.2, 0.0),
    }
    for name, law in laws.items():
        t = recorded(name)
        slip = full_slip(t)
        assert getattr(t, tau)[slip] == pytest.approx(law(t.theta_out_rad[slip]), abs=2e-4), name


def test_a_drag_of_a_power_below_one_falls_less_at_low_speed(recorded):
    ideal, linear, thins = (recorded(name) for name in ("none", "viscous", "viscous-thinning"))
    slip = full_slip(ideal)
    drag = [np.mean((t.T1_N - t.T2_N - ideal.T1_N + ideal.T2_N)[slip]) for t in (linear, thins)]
    speed = 0.006 * np.gradient(ideal.theta_in_rad, ideal.time_s)[slip].mean()
    assert drag[1] / drag[0] == pytest.approx((speed / 0.01) ** -0.5, rel=0.15)


def test_eyrings_drag_is_the_linear_one_at_low_speed_and_less_above(recorded):
    ideal, linear, thins = (recorded(name) for name in ("none", "viscous", "viscous-eyring"))
    slip = full_slip(ideal)
    drag = [np.mean((t.T1_N - t.T2_N - ideal.T1_N + ideal.T2_N)[slip]) for t in (linear, thins)]
    over = 0.006 * np.gradient(ideal.theta_in_rad, ideal.time_s)[slip].mean() / 3e-3
    assert drag[1] / drag[0] == pytest.approx(np.arcsinh(over) / over, rel=0.15)


def test_a_spread_kink_bends_as_much(campaign, recorded):
    t = recorded("spread-kink")
    expected = campaign.rig.cable.friction_coefficient * (np.pi + 0.8)
    np.testing.assert_allclose(np.log(t.T1_N / t.T2_N)[full_slip(t)], expected, rtol=3e-3)


@pytest.mark.parametrize(("name", "within"), [("seal", 0.4), ("two-seals", 0.1)])
def test_seals_drag_as_much_as_a_cable_all_along(recorded, name, within):
    """In full slip it matters little where a drag acts; in front of the load the whole cable has slipped before."""
    seals, drag, ideal = (recorded(one) for one in (name, "drag", "none"))
    slip = full_slip(ideal)
    over = [np.mean((t.T1_N - ideal.T1_N - (t.T2_N - ideal.T2_N))[slip]) for t in (seals, drag)]
    assert over[0] == pytest.approx(over[1], rel=within)
    assert not np.allclose(seals.T1_N, drag.T1_N, atol=0.05)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("delay_s", [0.001, 0.004, 0.02])
def test_a_filter_delays_slow_motions_as_a_late_clock_does(campaign, delay_s, order):
    """Delays below and above the 4 ms between two samples."""
    time_s = np.arange(2000) / 250
    truth = Side(np.sin(time_s), np.cos(time_s), 12 + time_s)
    late, filtered = (
        sensed(time_s, truth, campaign.rig, Effects(drive_sensors=fault).drive_sensors)
        for fault in ({"delay_s": delay_s}, {"filter_s": delay_s, "filter_order": order})
    )
    for there, here in zip(late, filtered, strict=True):
        assert here[100:] == pytest.approx(there[100:], abs=max(2 * delay_s**2, 4e-6))
    assert filtered.torque_Nm[0] == truth.torque_Nm[0]


@pytest.mark.parametrize(("order", "gain"), [(1, 0.5**0.5), (2, 0.2**0.5)])
def test_a_filter_of_higher_order_passes_on_less(campaign, order, gain):
    """One of first order at the angular frequency 1 / delay; Butterworth's at 2 / delay, twice its corner squared."""
    time_s, delay_s = np.arange(4000) / 1000, 0.05
    truth = Side(*[np.sin(order * time_s / delay_s)] * 3)
    faults = Effects(load_sensors={"filter_s": delay_s, "filter_order": order}).load_sensors
    settled = sensed(time_s, truth, campaign.rig, faults).torque_Nm[2000:]
    assert np.ptp(settled) / 2 == pytest.approx(gain, rel=0.01)


def test_nothing_turns_the_load_inside_its_gap(recorded):
    t = recorded("backlash")
    inside = np.abs(t.theta_out_rad) < 0.028
    assert inside.sum() > 20
    assert np.abs(t.tau_out_Nm[inside]).max() < 2e-4


def test_all_effects_together_run_through_every_motion(coarse):
    everything = {}
    for effects in ALONE.values():
        for name, value in effects.items():
            both = isinstance(value, dict) and isinstance(everything.get(name), dict) and name != "presliding"
            everything[name] = everything[name] | value if both else value
    rig = changed(coarse, rig__effects=Effects.model_validate(everything))
    plan = plan_of(
        rig, "half-loop", "half-loop-7.3N-a", rest_s=0.05, start_up_cycles=0.25, cycles=0.5, amplitude_rad=0.6
    )
    t = run(rig, plan, strung(rig, plan))
    for name in (*TENSIONS, "theta_out_rad", "tau_in_Nm", "tau_out_Nm"):
        assert np.isfinite(getattr(t, name)).all()
    assert np.ptp(t.theta_out_rad) > 0.1


def test_the_zero_of_a_load_cell_drifts_from_recording_to_recording(coarse):
    effects = Effects(load_sensors={"load_cell_offset_N": 0.5, "load_cell_zero_drift_N": -0.4})
    rig = changed(coarse, rig__effects=effects)
    plan = plan_of(rig, "half-loop", "half-loop-7.3N-a", rest_s=0.05, start_up_cycles=0.25, cycles=0.5)
    offsets = [rig_during(rig, plan.model_copy(update={"position": x})).effects.load_sensors for x in (-0.5, 0, 0.5)]
    assert [of.load_cell_offset_N for of in offsets] == pytest.approx([0.7, 0.5, 0.3])
    assert not any(of.load_cell_zero_drift_N for of in offsets)
    assert rig_during(coarse, plan) == coarse.rig


def test_sensors_err_as_they_are_told(campaign):
    time_s = np.linspace(0, 2, 201)
    truth = Side(np.sin(time_s), 0.03 * np.cos(time_s), 12 + time_s)
    radius = campaign.rig.pulley_radius_m

    def shown(**faults):
        return sensed(time_s, truth, campaign.rig, Effects(drive_sensors=faults).drive_sensors)

    assert shown() is truth
    assert shown(torque_gain=0.05).torque_Nm == pytest.approx(1.05 * truth.torque_Nm)
    assert shown(load_cell_gain=-0.1).force_N == pytest.approx(0.9 * truth.force_N)
    drifting = shown(load_cell_offset_N=0.5, load_cell_drift_N_per_s=0.1)
    assert drifting.force_N == pytest.approx(truth.force_N + 0.5 + 0.1 * time_s)
    crossed = shown(load_cell_crosstalk=0.08)
    assert crossed.force_N == pytest.approx(truth.force_N + 0.08 * truth.torque_Nm / radius)
    late = shown(delay_s=0.05)
    assert late.angle_rad[5:] == pytest.approx(truth.angle_rad[:-5])
    assert late.force_N[5:] == pytest.approx(truth.force_N[:-5])


def test_faults_of_sensors_leave_the_motion_alone():
    assert not Effects(load_sensors={"torque_gain": 0.1}).are_in_the_motion
    assert Effects(drag_N=0.1).are_in_the_motion


@pytest.mark.parametrize(
    ("effects", "named"),
    [
        ({"presliding": {"law": "iwan", "shortest_m": 2e-4, "longest_m": 1e-5}}, "below shortest_m"),
        ({"kinks": [{"bend_rad": 0.5, "place_share": 1.5}]}, "place_share"),
        ({"relaxation": [{"share": 0.6, "time_constant_s": 1.0}] * 2}, "less than 1 in all"),
        ({"stribek": {}}, "stribek"),
        ({"drag_N": float("inf")}, "drag_N"),
    ],
)
def test_what_cannot_be_is_refused_by_name(effects, named):
    with pytest.raises(ValidationError, match=named):
        Effects.model_validate(effects)


def test_a_campaign_states_its_effects(campaign):
    stated = campaign.model_dump(mode="json")
    stated["rig"]["effects"] = {"drag_N": 0.7}
    assert Campaign.model_validate(stated).rig.effects == Effects(drag_N=0.7)
    assert campaign.rig.effects == Effects()
    assert {f for f in Trajectory.__dataclass_fields__} >= {"tau_in_Nm", "tau_out_Nm"}
