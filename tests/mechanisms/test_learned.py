"""Laws that no list holds: what they do to a run, and what they look like at neutral values."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import least_squares

from ccmodel import mechanisms as registry
from ccmodel.channels import TAU_IN, TAU_OUT, THETA_IN, THETA_OUT
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.mechanisms import Sensing, laws
from ccmodel.mechanisms.law_forms import DRAG, RISING, basis
from ccmodel.mechanisms.learned import COARSE, FINE
from ccmodel.mechanisms.presliding import Contacts
from ccmodel.mechanisms.tables import Table, pulled, stretched
from ccmodel.mechanisms.winding import pulley_of, winding, winding_change
from ccmodel.model.active import Active
from ccmodel.model.general.run import friction_factors, settings_of
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, FixedLoad, SpringLoad, TorqueLoad
from ccmodel.model.transmission import Transmission
from tests.general_runs import HALF_LOOP, K_E, MU, K, L, R, loop_area, run, sine

EVERY = list(laws().values())
RANGES = {"tension": (1.0, 12.0), "position-along-conduit": (0.0, 1.0), "distance-since-reversal": (1e-5, 1.0)}
SCALES = {"end-stretch": 5e-5}
LOAD_CELL = "load-cell-crosstalk"


def values_of(law, **coefficients):
    first, last = (0.0, 0.05) if law.form is DRAG else RANGES.get(law.argument.name, (-1.0, 1.0))
    fixed = {"first": first, "last": last, "scale": 1.0 if law.form is DRAG else SCALES.get(law.slot, 0.1)}
    return fixed | dict.fromkeys(law.coefficients, 0.0) | coefficients


def learned(law, **coefficients):
    return law.name, law.place, values_of(law, **coefficients)


def test_laws_are_found_by_name_and_are_on_no_list():
    assert not set(laws()) & set(registry.names())
    assert all(registry.get(name).name == name for name in laws())


@pytest.mark.parametrize("resolution", [COARSE, FINE])
@pytest.mark.parametrize("is_centred", [True, False])
def test_the_coefficients_make_smooth_curves_of_variance_one(resolution, is_centred):
    B = basis(*resolution, is_centred)
    assert np.mean((B**2).sum(axis=1)) == pytest.approx(1.0)
    if is_centred:
        assert np.abs(B.mean(axis=0)).max() < 1e-9, "the mean belongs to the calibration"
    curves = B @ np.random.default_rng(1).standard_normal((B.shape[1], 200))
    assert np.mean(np.diff(curves, axis=0) ** 2) < 0.5 * np.mean(curves**2)


@pytest.mark.parametrize("law", EVERY, ids=lambda law: f"{law.name}-{law.place}")
def test_a_law_with_more_knots_is_no_second_law(law):
    alike = [one for one in EVERY if one.has_the_quantity_of(law)]
    assert law in alike and (law.finer() is None or law.finer() in alike)
    assert {(one.slot, one.place, one.channel, one.argument, one.form) for one in alike} == {
        (law.slot, law.place, law.channel, law.argument, law.form)
    }


@pytest.mark.parametrize("law", [law for law in EVERY if law.is_first], ids=lambda law: law.name)
def test_without_coefficients_a_law_changes_nothing_and_with_one_it_does(law):
    theta_in = sine(cycles=1)
    without, neutral, with_law = run(theta_in), run(theta_in, learned(law)), run(theta_in, learned(law, z1=1.0))
    for channel, reading in without.read.items():
        np.testing.assert_array_equal(neutral.read[channel], reading)
    assert any(np.abs(with_law.read[c] - reading).max() > 1e-6 for c, reading in without.read.items())


def test_friction_by_direction_is_larger_where_the_cable_slides_towards_the_drive():
    """The loss of one stroke grows by as much as that of the other falls: capstan ratios of mu (1 +- b)."""
    law = laws()["learned-sliding-friction-by-direction"]
    values = values_of(law, z1=2.0)
    b = float(law.at_knots(values)[1][-1])
    response = run(sine(), (law.name, "conduit", values))
    mu_phi = MU * HALF_LOOP.bend_rad
    for samples, direction in ((slice(560, 600), 1), (slice(810, 850), -1)):
        ratio = response.T1_N[samples] / response.T2_N[samples]
        np.testing.assert_allclose(np.log(ratio), direction * mu_phi * (1 + direction * b), rtol=0.02)


@pytest.mark.parametrize(
    ("law", "ratio", "of"),
    [
        ("learned-sliding-friction-by-cable", "ratio", lambda b: {"mu": MU * (1 - b)}),
        ("learned-cable-stretch-by-cable", "K_ratio", lambda b: {"k": K / (1 - b)}),
    ],
)
def test_a_law_of_the_cable_is_two_cables_that_differ(law, ratio, of):
    """Cable A has 1 - b times the friction or the compliance, and cable B 1 + b times."""
    law = laws()[law]
    values = values_of(law, z1=2.0)
    b = float(law.at_knots(values)[1][-1])
    b_over_a = (1 + b) / (1 - b)
    asymmetry = {"ratio": 1.0, "K_ratio": 1.0} | {ratio: b_over_a if ratio == "ratio" else 1 / b_over_a}
    found, wanted = (
        run(sine(), (law.name, law.place, values)),
        run(sine(), ("cable-asymmetry", "cable", asymmetry), **of(b)),
    )
    assert b > 0.1
    assert largest_difference(found, wanted) < 1e-6


@pytest.mark.parametrize("place", ["drive-pulley", "load-pulley"])
def test_elements_of_a_bearing_that_yield_soon_are_its_friction(place):
    law = next(law for law in EVERY if law.slot == "bearing-torque" and law.place == place and law.form.has_elements)
    values = values_of(law) | {"first": 1e-5, "last": 1e-3, "scale": 4e-3}
    x, _ = law.at_knots(values)
    # An element that yields after 0.1 mm has all of the friction.
    values |= coefficients_for(law, values, 4e-3 * (np.arange(x.size) == 4))
    friction = float(np.sum(acting_values(law, values)))
    found = run(sine(), (law.name, place, values))
    wanted = run(sine(), ("pulley-friction", place, {"friction_torque": friction, "presliding": 0.01}))
    assert friction > 2e-3
    for channel in found.read:
        effect = np.std(run(sine()).read[channel] - wanted.read[channel])
        assert np.std(found.read[channel] - wanted.read[channel]) < 0.3 * effect + 1e-9, channel


def in_bearing(torque, argument="speed"):
    """A torque of so many N m by rad/s in the bearing of the load's pulley."""
    law = laws()[f"learned-bearing-torque-load-by-{argument}"]
    return with_values(law, lambda x: torque * x, scale=torque)


def test_the_bearing_of_a_load_without_a_spring_has_its_torque_between_cables_and_sensor():
    """On the motion of a sprung load a driven pulley has the same tensions with and without it; the sensor has less."""
    sprung = run(sine())
    driven, with_law = (run(sine(), some, load=AngleLoad(sprung.theta_out_rad)) for some in ((), in_bearing(2e-3)))
    np.testing.assert_array_equal(with_law.T2_N, driven.T2_N)
    # The speed at the end of a step, of second order.
    turned = np.diff(sprung.theta_out_rad, prepend=sprung.theta_out_rad[0])
    speed = 500 * (1.5 * turned - 0.5 * np.concatenate([[0.0], turned[:-1]]))
    np.testing.assert_allclose(driven.tau_out_Nm - with_law.tau_out_Nm, 2e-3 * speed.clip(-1, 1), atol=2e-4)
    torque = TorqueLoad(sprung.tau_out_Nm)
    np.testing.assert_allclose(run(sine(), in_bearing(2e-3), load=torque).tau_out_Nm, sprung.tau_out_Nm, atol=1e-9)


@pytest.mark.parametrize("channel", ["theta-out", "tau-in", "tau-out", "F-drive", "F-load"])
def test_where_no_time_passes_no_reading_has_a_rate(channel):
    law = laws()[f"learned-sensor-map-{channel}-by-rate"]
    for time_s in (np.zeros(1), np.zeros(2)):
        sensing = Sensing(time_s, {str(law.channel): np.full(time_s.size, 3.0)}, 0.006, 0.006)
        np.testing.assert_array_equal(law.argument.of(sensing), 0.0)


def test_a_single_cable_has_no_law_by_cable():
    law = laws()["learned-sliding-friction-by-cable"]
    of_both = {name: np.ones(4) for name in ("T1_N", "T2_N", "T3_N", "T4_N")}
    of_A = {name: of_both[name] for name in ("T1_N", "T2_N")}
    visited = [np.unique(law.argument.of(Sensing(np.arange(4.0), c, 0.006, 0.006))) for c in (of_both, of_A)]
    assert [v.tolist() for v in visited] == [[-1.0, 1.0], [-1.0]]


@pytest.mark.parametrize("place", ["drive-sensor", "load-sensor"])
def test_a_constant_delay_is_a_late_side_and_none_is_early(place):
    law = laws()[f"learned-sensor-map-{place.split('-')[0]}-delay-by-time"]
    wanted = run(sine(), ("time-skew", place, {"delay": 0.02}))
    found = run(sine(), with_values(law, lambda t: np.full(t.size, 0.02), scale=0.02))
    assert largest_difference(found, wanted) < 0.05 * largest_difference(run(sine()), wanted)
    early = run(sine(), with_values(law, lambda t: np.full(t.size, -0.02), scale=0.02))
    assert largest_difference(early, run(sine())) == 0.0


@pytest.mark.parametrize("place", ["drive-sensor", "load-sensor"])
def test_a_load_cell_by_the_torque_has_the_crosstalk_of_its_own_end(place):
    law = laws()[f"learned-sensor-map-F-{place.split('-')[0]}-by-torque"]
    name, _, values = with_values(law, lambda pull: 0.05 * pull, scale=0.05)
    wide = {"first": -30.0, "last": 30.0, "scale": 0.05 * 30.0}
    found, wanted = run(sine(), (name, place, values | wide)), run(sine(), (LOAD_CELL, place, {"crosstalk": 0.05}))
    assert largest_difference(found, wanted) < 0.03 * largest_difference(run(sine()), wanted)


def test_a_reading_by_its_rate_is_one_that_follows_slowly():
    """To first order a filter's reading is behind by its time constant times the rate."""
    law = laws()["learned-sensor-map-theta-out-by-rate"]
    name, place, values = with_values(law, lambda rate: -0.01 * rate, scale=0.01)
    theta_in = sine()
    found = run(theta_in, (name, place, values | {"first": -10.0, "last": 10.0, "scale": 0.1})).read[THETA_OUT]
    late = run(theta_in, ("time-skew", "load-sensor", {"delay": 0.01})).read[THETA_OUT]
    without = run(theta_in).read[THETA_OUT]
    # The load stops and starts at once, where a rate is that of a sample.
    assert np.std(found - late) < 0.2 * np.std(without - late)


def with_values(law, y, scale=None):
    """The law whose values at its knots are next to these: (name, place, values)."""
    values = values_of(law) | ({} if scale is None else {"scale": scale})
    x, _ = law.at_knots(values)
    return law.name, law.place, values | coefficients_for(law, values, y(x))


def coefficients_for(law, values, y):
    """Coefficients whose possible values at the knots are next to these."""

    def of(z):
        return dict(zip(law.coefficients, z.tolist(), strict=True))

    z = np.linalg.lstsq(values["scale"] * law.basis, y, rcond=None)[0]
    if law.form.has_elements:
        z = least_squares(lambda z: (acting_values(law, values | of(z)) - y) / values["scale"], z).x
    return of(z)


def acting_values(law, values):
    return law.form.possible(law.at_knots(values)[1])


def largest_difference(one, other):
    return max(np.abs(one.read[c] - other.read[c]).max() / np.ptp(other.read[c]) for c in one.read)


def test_friction_by_the_drives_angle_is_the_same_in_both_cables():
    """An odd law: at a positive angle both conduits have more friction, and not one more and one less."""
    law = laws()["learned-sliding-friction-by-drive-angle"]
    x = np.linspace(-0.6, 0.6, len(law.basis))
    z = np.linalg.lstsq(law.basis, x, rcond=None)[0]
    values = {"first": -0.6, "last": 0.6, "scale": 0.5} | dict(zip(law.coefficients, z, strict=True))
    time_s, transmission = np.linspace(0.0, 4.0, 1001), Transmission(HALF_LOOP, K * L, MU, R, R)
    theta = 0.6 * np.sin(2 * np.pi * 0.5 * time_s)
    factor = friction_factors(transmission, settings_of([Active(law.name, law.place, values)]), time_s, theta)
    np.testing.assert_array_equal(factor[:, 0], factor[:, 1])
    np.testing.assert_allclose(factor[:, 0], 1 + 0.5 * theta, atol=0.02)


def test_an_error_of_the_drives_encoder_is_taken_from_the_motion():
    """The model driven by the reading, with the law of its error, is the one driven by the true angle."""
    law = laws()["learned-sensor-map-theta-in-by-reading-fine"]
    read = sine()
    knots = np.linspace(read.min(), read.max(), len(law.basis))
    z = np.linalg.lstsq(0.05 * law.basis, 0.03 * np.sin(3 * knots), rcond=None)[0]
    ends = {"first": knots[0], "last": knots[-1], "scale": 0.05}
    acting = Active(law.name, law.place, ends | dict(zip(law.coefficients, z.tolist(), strict=True)))
    error = np.interp(read, *law.at_knots(acting.values))
    assert np.abs(error).max() > 0.02
    # The drive is where the cables have their initial tension at the start.
    found, wanted = run(read, (acting,)), run(read - (error - error[0]))
    for name in ("T1_N", "T2_N", "T3_N", "T4_N", "theta_out_rad", "tau_in_Nm"):
        np.testing.assert_allclose(getattr(found, name), getattr(wanted, name), atol=2e-4, err_msg=name)


@pytest.mark.parametrize(("first", "last"), [(-0.3, 1.4), (-1.05, 1.0), (-1.0, 1.0)])
def test_two_laws_of_a_pulleys_radius_are_their_sum_at_every_angle(first, last):
    names = "learned-pulley-radius-drive-by-drive-angle", "learned-pulley-radius-drive-by-drive-angle-fine"
    acting, ranges = [], ((-1.05, 1.0), (first, last))
    for name, between, of in zip(names, ranges, (lambda a: 0.01 * a, lambda a: 0.02 * np.sin(4 * a)), strict=True):
        law = laws()[name]
        z = np.linalg.lstsq(0.03 * law.basis, of(np.linspace(*between, len(law.basis))), rcond=None)[0]
        ends = {"first": between[0], "last": between[1], "scale": 0.03}
        acting.append(Active(name, law.place, ends | dict(zip(law.coefficients, z, strict=True))))
    table = settings_of(acting).drive_radius_factor
    angles = np.linspace(-1.2, 1.6, 401)
    pulley = pulley_of(0.006, 0.0, 0.0, table)
    np.testing.assert_allclose([winding(a, pulley)[1] for a in angles], table.at(angles), atol=1e-12)
    assert np.diff(table.knots).min() > 1e-9


def test_friction_by_tension_is_that_of_a_power_law_with_these_values():
    """The table has the power law at its knots; between them and of its average little is left."""
    law = laws()["learned-sliding-friction-by-tension-fine"]
    x = np.geomspace(*RANGES["tension"], FINE[0])
    power = (x / 5) ** -0.25
    found = run(sine(), with_values(law, lambda x: (x / 5) ** -0.25 / power.mean() - 1), mu=MU * power.mean())
    wanted = run(sine(), ("load-dependent-friction", "conduit", {"n": -0.25}))
    assert largest_difference(found, wanted) < 0.1 * largest_difference(run(sine()), wanted)


def test_friction_by_tension_holds_the_tension_at_rest_too():
    """Tensions that friction holds stay as they are at the load until the drive's motion arrives there."""
    law = laws()["learned-sliding-friction-by-tension-fine"]
    x = np.geomspace(*RANGES["tension"], FINE[0])
    power = (x / 5) ** -0.6
    tensioned = InitialTension.between_ends(HALF_LOOP, 0.6 * MU, (8.0, 6.0), (6.5, 7.0))
    begins = 0.02 * sine()[:60]
    table = with_values(law, lambda x: (x / 5) ** -0.6 / power.mean() - 1)
    found = run(begins, table, mu=MU * power.mean(), T=tensioned)
    wanted = run(begins, ("load-dependent-friction", "conduit", {"n": -0.6}), T=tensioned)
    assert np.abs(found.tau_in_Nm - wanted.tau_in_Nm).max() < 0.01 * np.ptp(wanted.tau_in_Nm)
    assert found.read["F_load_N"] == pytest.approx(6.0 + 7.0, abs=1e-6)


def test_a_table_acts_beside_a_power_of_the_tension():
    law = laws()["learned-sliding-friction-by-tension-fine"]
    part = np.geomspace(*RANGES["tension"], FINE[0]) ** -0.15
    table = with_values(law, lambda x: x**-0.15 / part.mean() - 1)
    mu = MU * part.mean() * 5**0.15
    both = run(sine(), [table, ("load-dependent-friction", "conduit", {"n": -0.1})], mu=mu)
    wanted = run(sine(), ("load-dependent-friction", "conduit", {"n": -0.25}))
    assert largest_difference(both, wanted) < 0.1 * largest_difference(run(sine()), wanted)


def test_friction_by_position_is_where_the_bend_is():
    """Twice the friction in the first half and none in the other is a path that bends in the first half alone."""
    law = laws()["learned-sliding-friction-by-position-along-conduit-fine"]
    place = with_values(law, lambda x: np.tanh((0.5 - x) / 0.06))
    bent = ConduitPath([L / 2, L / 2], [np.pi, 0.0])
    found, wanted = run(sine(), place), run(sine(), path=bent)
    assert largest_difference(found, wanted) < 0.2 * largest_difference(run(sine()), wanted)


BEND = "learned-sliding-friction-bend-by-position-along-conduit"


@pytest.mark.parametrize(("added_rad", "bend_rad"), [(1.5, np.pi + 1.5), (-2.0, np.pi - 2.0), (-9.0, 0.0)])
def test_bend_that_is_added_evenly_is_that_of_another_loop(added_rad, bend_rad):
    """No conduit has less bend than none."""
    law = with_values(laws()[BEND], lambda x: np.full(x.size, added_rad), scale=1.0)
    found, wanted = run(sine(), law), run(sine(), path=ConduitPath([L], [bend_rad]))
    assert largest_difference(found, wanted) < 0.02 * largest_difference(run(sine()), wanted)


@pytest.mark.parametrize("loop_rad", [np.pi, 3 * np.pi])
def test_bend_that_is_added_at_one_place_is_a_kink_in_any_loop(loop_rad):
    """A kink of 0.8 rad, over a width of a twentieth; a factor of friction would grow with the loop's bend."""
    path = ConduitPath([L], [loop_rad])
    law = with_values(laws()[f"{BEND}-fine"], lambda x: 0.8 / 0.05 * (1 - abs(x - 0.5) / 0.05).clip(0), scale=4.0)
    found = run(sine(), law, path=path, elements=64)
    wanted = run(sine(), ("kink", "conduit", {"beta": 0.8, "s": 0.5}), path=path, elements=64)
    assert largest_difference(found, wanted) < 0.2 * largest_difference(run(sine(), path=path, elements=64), wanted)


def test_cables_of_a_learned_compliance_are_those_that_settle():
    """Over its own tension a settling cable has the compliance 1 / (1 - exp(-u / u_s))."""
    law = laws()["learned-cable-stretch-by-tension-fine"]
    over_settled = np.linspace(0.2, 10.0, 4000)
    tension = 2.0 * (over_settled - 1 + np.exp(-over_settled))
    compliance = lambda T: np.interp(T, tension, 1 / (1 - np.exp(-over_settled)))  # noqa: E731
    mean = compliance(np.geomspace(*RANGES["tension"], FINE[0])).mean()
    found = run(sine(), with_values(law, lambda T: compliance(T) / mean - 1), k=K / mean)
    wanted = run(sine(), ("strand-settling", "cable", {"T_scale": 2.0}))
    assert largest_difference(found, wanted) < 0.1 * largest_difference(run(sine()), wanted)


@pytest.mark.parametrize(
    ("end", "name"),
    [
        ("drive", "learned-pulley-radius-drive-by-drive-angle-fine"),
        ("load", "learned-pulley-radius-load-by-load-angle-fine"),
    ],
)
def test_a_radius_by_angle_is_that_of_an_eccentric_pulley(end, name):
    law = laws()[name]
    eccentric = ("pulley-eccentricity", f"{end}-pulley", {"e": 0.06, "psi": 0.7})
    found = run(sine(), with_values(law, lambda theta: 0.06 * np.sin(theta + 0.7)))
    wanted = run(sine(), eccentric)
    assert largest_difference(found, wanted) < 0.01 * largest_difference(run(sine()), wanted)


@pytest.mark.parametrize("load", [FixedLoad(), AngleLoad(0.5 * sine())], ids=["fixed", "driven"])
def test_a_radius_by_angle_acts_with_a_load_that_is_held_or_driven(load):
    law = laws()["learned-pulley-radius-drive-by-drive-angle-fine"]
    found = run(sine(), with_values(law, lambda theta: 0.06 * np.sin(theta + 0.7)), load=load)
    wanted = run(sine(), ("pulley-eccentricity", "drive-pulley", {"e": 0.06, "psi": 0.7}), load=load)
    np.testing.assert_allclose(found.T1_N, wanted.T1_N, rtol=0, atol=1e-3 * np.ptp(wanted.T1_N))


def test_the_travel_is_the_integral_of_the_radius():
    """Between knots, at them and beyond them; a table and the bore's eccentricity add up."""
    x = np.array([-0.5, 0.1, 0.7, 1.3])
    pulley = pulley_of(R, 0.05, 0.3, Table(x, np.array([1.1, 0.8, 1.3, 0.9])))
    theta = np.linspace(-1.0, 2.0, 3001)
    travel, factor, slope = np.array([winding(angle, pulley) for angle in theta]).T
    assert travel - travel[0] == pytest.approx(cumulative_trapezoid(factor, theta, initial=0.0), abs=1e-6)
    inside = np.abs(theta[:, None] - x).min(axis=1) > 2e-3
    assert np.gradient(factor, theta)[inside][1:-1] == pytest.approx(slope[inside][1:-1], abs=1e-6)
    assert winding_change(-0.8, 2.4, pulley) == pytest.approx(winding(1.6, pulley)[0] - winding(-0.8, pulley)[0])


def test_a_radius_by_angle_keeps_the_work_of_its_torque():
    """Without friction, the drive's work over a cycle is none."""
    law = laws()["learned-pulley-radius-drive-by-drive-angle"]
    theta_in = sine(cycles=3)
    response = run(theta_in, with_values(law, lambda theta: 0.2 * np.cos(3 * theta)), mu=0.0)
    cycle = slice(500, 1501)
    work = np.trapezoid(response.tau_in_Nm[cycle], theta_in[cycle])
    taken = np.abs(np.diff(theta_in[cycle]) * response.tau_in_Nm[cycle][1:]).sum()
    assert abs(work) < 2e-3 * taken


def test_a_torque_by_acceleration_is_a_mass():
    law = laws()["learned-load-by-acceleration"]
    J, values = 2e-4, values_of(law) | {"first": -300.0, "last": 300.0, "scale": 1.0}
    found = run(sine(), (law.name, law.place, values | {"z1": 300.0 * J / law.basis[-1, 0]}))
    wanted = run(sine(), ("load-inertia", "load", {"J": J, "zeta": 0.0}))
    assert largest_difference(found, wanted) < 1e-9
    assert largest_difference(run(sine()), wanted) > 0.01
    negative = run(sine(), (law.name, law.place, values | {"z1": -1.0}))
    assert largest_difference(negative, run(sine())) == 0.0, "no mass is negative"


@pytest.mark.parametrize("end", ["drive", "load"])
def test_a_fastening_of_constant_compliance_is_the_listed_one(end):
    law = laws()[f"learned-end-stretch-{end}-by-tension"]
    found = run(sine(), with_values(law, lambda T: np.full(T.size, 4e-5)))
    wanted = run(sine(), ("termination-compliance", f"{end}-end", {"compliance": 4e-5}))
    assert largest_difference(found, wanted) < 0.02 * largest_difference(run(sine()), wanted)


@pytest.mark.parametrize("name", ["cable-stretch-by-tension", "end-stretch-load-by-tension"])
def test_a_spring_that_is_learned_makes_no_work(name):
    """Without friction the work of a cycle is zero, however the spring bends."""
    law = laws()[f"learned-{name}"]
    curve = with_values(law, lambda T: values_of(law)["scale"] * 5 * np.sin(T), scale=values_of(law)["scale"] * 5)
    stiff, bent = run(sine(), mu=1e-9), run(sine(), curve, mu=1e-9)
    assert largest_difference(bent, stiff) > 1e-3
    assert abs(loop_area(bent)) < 1e-5 * np.ptp(bent.read[TAU_IN])


def test_friction_that_is_learned_is_never_negative():
    """A law that would fall below zero gives no work."""
    law = laws()["learned-sliding-friction-by-tension"]
    r = run(sine(), with_values(law, lambda T: np.linspace(-3.0, 3.0, T.size), scale=3.0))
    assert loop_area(r) > 0
    assert registry.get(law.name).settings == {}


def test_a_table_of_a_spring_is_inverted_exactly():
    random = np.random.default_rng(3)
    table = Table(np.concatenate([[1.0], np.sort(random.uniform(1.0, 8.0, 7)), [8.0]]), random.uniform(0.1, 3.0, 9))
    rows = np.repeat(table.rows_of_spring[:, None, None], 2, axis=1)
    for T in np.concatenate([[-2.0, 0.0, 1.0, 8.0, 12.0], random.uniform(0.0, 9.0, 40)]):
        stretch = stretched(rows, 0, 1, 0, T)
        back, slope = pulled(rows, 0, 1, 0, stretch)
        assert back == pytest.approx(T, abs=1e-9)
        assert slope == pytest.approx(1 / table.at(T), rel=1e-9)
    assert stretched(rows, 0, 0, 0, 0.0) == pytest.approx(0.0, abs=1e-12)
    fine = np.linspace(0.0, 8.0, 20001)
    assert stretched(rows, 0, 0, 0, 8.0) == pytest.approx(np.trapezoid(table.at(fine), fine), rel=1e-6)


def test_a_law_with_memory_is_a_sum_of_maxwell_slip_elements():
    """A reversal builds the torque up over twice the travel at which an element yields, and cycles close."""
    law = laws()["learned-bearing-torque-by-distance-since-reversal"]
    theta = np.concatenate([np.linspace(0, 2, 401), np.linspace(2, -2, 801)[1:], np.linspace(-2, 2, 801)[1:]])
    sensing = Sensing(np.arange(theta.size) * 0.01, {THETA_IN: theta, TAU_IN: 0 * theta}, 1.0, 1.0)
    values = values_of(law, z1=1.0) | {"first": 0.01, "last": 1.0}
    torque = law.added(sensing, *law.at_knots(values))
    assert torque[400] == pytest.approx(law.at_knots(values)[1].sum())
    assert torque[1200] == pytest.approx(-torque[400])
    assert torque[2000] == pytest.approx(torque[400])
    up, down = torque[1200:2001], torque[400:1201]
    np.testing.assert_allclose(up, -down, atol=1e-12)


@pytest.mark.parametrize("slot", ["bearing-torque", "load"])
def test_the_curve_of_a_law_with_memory_is_half_of_its_rise_since_a_reversal(slot):
    """Of Dahl's law, which takes no longer after a reversal than from rest, elements fit the former in most samples."""
    law = laws()[f"learned-{slot}-by-distance-since-reversal"]
    x, y = law.at_knots(values_of(law, z1=1.0) | {"first": 0.01, "last": 1.0})
    back = np.concatenate([np.linspace(0.0, 3.0, 50), 3.0 - x])
    sensing = Sensing(np.arange(back.size) * 0.01, {THETA_IN: back, TAU_IN: 0 * back}, 1.0, 1.0)
    torque = law.added(sensing, x, y)
    np.testing.assert_allclose(law.shown(x) @ y, (torque[49] - torque[50:]) / 2, rtol=1e-12)
    np.testing.assert_allclose(law.behind(x, law.shown(x, law.determined_at(x)) @ y), y, atol=1e-12)


def test_a_law_of_the_sliding_distance_is_a_sum_of_elements_at_every_contact():
    """With the shares of the mechanism's elements at its knots, it acts and looks as the mechanism does."""
    law = laws()["learned-sliding-friction-by-distance-since-reversal"]
    values = values_of(law) | {"first": 1e-5, "last": 2e-3, "scale": 0.3}
    travel, _ = law.at_knots(values)
    spread = float(travel[5] / travel[2])
    alike = {"z0": float(travel[2]) / 2 * spread**0.5, "spread": spread, "creep": 0.0}
    shares = np.isin(np.arange(travel.size), [2, 3, 4, 5]) / 4
    by_law, by_mechanism = Contacts.of_law(travel[2:6], shares[2:6]), Contacts.of_mechanism(**alike)
    assert by_law.element_m == pytest.approx(by_mechanism.element_m)
    assert by_law.element_share == pytest.approx(by_mechanism.element_share)
    assert (by_law.creep, by_law.elements) == (0.0, by_mechanism.elements)
    # A law is smooth over its knots, so that it has these shares nearly.
    theta_in = sine(cycles=2)
    found = run(theta_in, (law.name, "conduit", values | coefficients_for(law, values, shares)))
    expected, without = run(theta_in, ("presliding", "conduit", alike)), run(theta_in)
    for channel in (TAU_IN, THETA_OUT):
        change = np.abs(expected.read[channel] - without.read[channel]).max()
        assert np.abs(found.read[channel] - expected.read[channel]).max() <= 0.1 * change
    # What is shown is friction over that of sliding after a reversal: from -1 to 1.
    at = np.array([1e-9, *travel])
    curve = 1 + law.shown(travel, at) @ shares
    assert curve[[0, -1]] == pytest.approx([-1.0, 1.0], abs=1e-3)
    (listed,) = registry.get("presliding").curves
    np.testing.assert_allclose(listed.of(at, alike), curve, atol=1e-9)
    there = law.determined_at(travel)
    np.testing.assert_allclose(law.behind(travel, listed.of(there, alike)), shares, atol=1e-9)


@pytest.mark.parametrize(
    ("mechanism", "drag_N_per_m"),
    [
        (("viscous-friction", "conduit", {"c": 60.0}), lambda speed: 60.0 * speed),
        (("constant-drag", "conduit", {"f0": 0.5}), lambda speed: np.full(speed.shape, 0.5 / L)),
    ],
    ids=lambda one: one[0] if isinstance(one, tuple) else "",
)
def test_a_drag_by_speed_is_that_of_each_contact(mechanism, drag_N_per_m):
    """A law that is proportional to the speed is viscous friction, and a constant one the constant drag."""
    law = laws()["learned-sliding-friction-drag-by-speed"]
    values = values_of(law)
    x, _ = law.at_knots(values)
    z = np.linalg.lstsq(values["scale"] * law.basis, drag_N_per_m(x), rcond=None)[0]
    values |= dict(zip(law.coefficients, z, strict=True))
    assert law.at_knots(values)[1] == pytest.approx(drag_N_per_m(x), abs=0.05)
    theta_in = sine(cycles=2)
    found, expected, without = run(theta_in, (law.name, "conduit", values)), run(theta_in, mechanism), run(theta_in)
    for channel in (TAU_IN, THETA_OUT):
        change = np.abs(expected.read[channel] - without.read[channel]).max()
        assert np.abs(found.read[channel] - expected.read[channel]).max() <= 0.05 * change


DRAG_ALONG = "learned-sliding-friction-drag-by-position-along-conduit"


def test_a_drag_that_is_the_same_everywhere_is_the_constant_drag():
    law = with_values(laws()[DRAG_ALONG], lambda x: np.full(x.size, 0.5 / L), scale=1.0)
    found, wanted = run(sine(), law), run(sine(), ("constant-drag", "conduit", {"f0": 0.5}))
    assert largest_difference(found, wanted) < 0.02 * largest_difference(run(sine()), wanted)


@pytest.mark.parametrize("place", [0.2, 0.8])
def test_a_drag_at_one_place_of_a_straight_conduit_is_the_loss_wherever_it_is(place):
    """0.4 N over a fifth to both sides, without Coulomb friction; while both cables slide, they lose it."""
    shape = lambda x: 0.4 / 0.2 / L * (1 - abs(x - place) / 0.2).clip(0)  # noqa: E731
    law = with_values(laws()[f"{DRAG_ALONG}-fine"], shape, scale=1.0)
    slid = run(sine(), law, path=ConduitPath([L], [0.0]), elements=64)
    for samples, direction in ((slice(560, 600), 1), (slice(810, 850), -1)):
        np.testing.assert_allclose(slid.T1_N[samples] - slid.T2_N[samples], direction * 0.4, rtol=0.02)


def test_elements_take_work_and_no_more_than_all_friction_builds_up():
    law = laws()["learned-sliding-friction-by-distance-since-reversal"]
    name, place, values = with_values(law, lambda x: np.where(np.arange(x.size) < 4, 0.5, -0.5), scale=1.0)
    x, y = law.at_knots(values)
    assert y.min() < 0.0
    found = Contacts.of_law(*law.written(x, y, None))
    assert min(found.element_share) == 0.0
    assert (sum(found.element_share), found.creep) == pytest.approx((1.0, 0.0))
    assert run(sine(), (name, place, values)).reached == sine().size
    assert law.written(x, 3.0 * y, None).values.sum() == pytest.approx(1.0), (
        "also as a kept law of three times its size"
    )
    bearing = laws()["learned-bearing-torque-by-distance-since-reversal"]
    assert bearing.form.possible(np.array([0.3, -0.1, 2.0])) == pytest.approx([0.3, 0.0, 2.0])


def test_elements_have_no_torque_at_the_first_sample():
    """The first step only balances the start, even if the load turns far in it."""
    law = laws()["learned-load-by-distance-since-reversal"]
    elements = with_values(law, lambda x: np.full(x.size, 1e-3), scale=1e-3)
    beside = with_values(laws()["learned-load-by-load-angle"], lambda x: 0.02 * x - 0.01, scale=0.02)
    first = run(sine(), [beside, elements]).tau_out_Nm[0]
    assert first == pytest.approx(run(sine(), beside).tau_out_Nm[0], abs=1e-9)


def test_a_measured_torque_is_all_that_the_load_does():
    law = learned(laws()["learned-load-by-load-angle"], z1=1.0)
    for parallel in (0.0, 0.02):
        load = TorqueLoad(run(sine()).tau_out_Nm, parallel)
        without, found = run(sine(), load=load), run(sine(), law, load=load)
        np.testing.assert_array_equal(found.theta_out_rad, without.theta_out_rad)
        np.testing.assert_array_equal(found.tau_out_Nm, without.tau_out_Nm)


def test_friction_builds_up_by_one_law_only():
    law = learned(laws()["learned-sliding-friction-by-distance-since-reversal"], z1=1.0)
    with pytest.raises(ModelError, match="keep one of them"):
        run(sine(cycles=1), [law, ("presliding", "conduit", {"z0": 5e-5})])


def test_a_load_that_is_held_has_no_law():
    theta_in = sine(cycles=1)
    law = learned(laws()["learned-load-by-speed"], z1=1.0)
    held, with_law = run(theta_in, load=FixedLoad()), run(theta_in, law, load=FixedLoad())
    for channel, reading in held.read.items():
        np.testing.assert_array_equal(with_law.read[channel], reading)


def test_a_law_of_the_load_is_the_loads_own_torque():
    """A law that is linear in the angle is a stiffer spring."""
    law = laws()["learned-load-by-load-angle"]
    x = np.linspace(-1.0, 1.0, COARSE[0])
    z, *_ = np.linalg.lstsq(law.basis, x / 0.1 * 0.002, rcond=None)
    values = values_of(law, **dict(zip(law.coefficients, z, strict=True)))
    slope = np.polyfit(x, law.at_knots(values)[1], 1)[0]
    theta_in = sine(cycles=1)
    soft, stiff = run(theta_in), run(theta_in, load=SpringLoad(K_E + slope))
    found = run(theta_in, (law.name, "load", values))
    change = np.abs(stiff.read[THETA_OUT] - soft.read[THETA_OUT]).max()
    assert np.abs(found.read[THETA_OUT] - stiff.read[THETA_OUT]).max() < 0.02 * change


def test_a_torque_by_speed_beside_a_mass_that_rings_is_its_damping():
    J, zeta = 2e-4, 0.16
    damping = 2 * zeta * np.sqrt(J * K_E)
    law = with_values(laws()["learned-load-by-speed"], lambda x: 40 * damping * x, scale=40 * damping)
    law[2].update(first=-40.0, last=40.0)
    theta_in = np.where(sine() > 0.3, 0.3, sine())  # the drive stops, and the load rings
    mass = [("load-inertia", "load", {"J": J, "zeta": z}) for z in (0.0, zeta)]
    found, undamped, damped = run(theta_in, [mass[0], law]), run(theta_in, mass[:1]), run(theta_in, mass[1:])
    for channel in (THETA_OUT, TAU_OUT):
        effect = np.std(undamped.read[channel] - damped.read[channel])
        assert np.std(found.read[channel] - damped.read[channel]) < 0.04 * effect, channel


@pytest.mark.parametrize("name", ["learned-load-by-speed", "learned-bearing-torque-load-by-speed"])
def test_a_torque_on_the_load_never_falls_with_the_speed(name):
    """With a load without mass there would be no balance of torques."""
    law = laws()[name]
    falling = with_values(law, lambda x: -0.01 * x, scale=0.01)
    rising = with_values(law, lambda x: 0.01 * x, scale=0.01)
    assert largest_difference(run(sine(), falling), run(sine())) < 1e-9
    assert largest_difference(run(sine(), rising), run(sine())) > 0.05
    rugged = run(sine(), learned(law, **{z: (-1.0) ** k for k, z in enumerate(law.coefficients)}))
    assert rugged.reached == sine().size


def test_what_rises_stays_and_of_what_falls_the_mean_is_left():
    y = np.array([-1.0, 0.5, 0.2, 2.0])
    np.testing.assert_allclose(RISING.possible(y), [-1.0, 0.35, 0.35, 2.0])
    np.testing.assert_allclose(RISING.possible(-np.sort(y)), np.full(4, -y.mean()))


def test_elements_of_the_load_are_a_spring_until_they_yield():
    law = laws()["learned-load-by-distance-since-reversal"]
    values = values_of(law) | {"first": 1e-2, "last": 1.0, "scale": 1e-3}
    x, _ = law.at_knots(values)
    values |= coefficients_for(law, values, x)
    y = acting_values(law, values)
    found = run(sine(), (law.name, law.place, values))
    travel = R * np.abs(found.theta_out_rad).max()
    assert travel < x[0], "no element yields"
    wanted = run(sine(), load=SpringLoad(K_E + float(R * np.sum(y / x))))
    assert largest_difference(found, wanted) < 1e-6
    assert largest_difference(run(sine()), wanted) > 0.01


def test_two_laws_of_the_load_are_their_sum():
    """So are a law that was kept and one that is learned beside it."""
    one = with_values(laws()["learned-load-by-load-angle"], lambda x: 0.01 * x**3, scale=0.01)
    other = with_values(laws()["learned-load-by-load-angle-fine"], lambda x: 0.02 * np.sin(5 * x), scale=0.02)
    both = run(sine(), [one, other])
    added = [np.interp(both.theta_out_rad, *laws()[name].at_knots(values)) for name, _, values in (one, other)]
    np.testing.assert_allclose(both.tau_out_Nm - K_E * both.theta_out_rad, sum(added), atol=1e-9)
    assert min(np.ptp(torque) for torque in added) > 1e-3
