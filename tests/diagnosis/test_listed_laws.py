"""A learned law is recognised as that of a listed mechanism, or as none."""

from dataclasses import replace

import numpy as np
import pytest

from ccmodel import mechanisms
from ccmodel.diagnosis.listed_laws import Learned, distance, nearest_listed
from ccmodel.mechanisms import laws
from ccmodel.mechanisms.contract import Parameter
from ccmodel.mechanisms.law_forms import CONSTANT_DRAG
from ccmodel.mechanisms.learned import FINE
from ccmodel.report.verdict import law_claim, law_size

# What recordings visit of each argument.
RANGES = {
    ("speed", "log10(m/s)"): (-3.5, -1.0),
    ("speed", "rad/s"): (-3.0, 3.0),
    ("speed", "m/s"): (0.0, 0.05),
    ("time", "s"): (0.0, 25.0),
    ("travel", "m"): (0.0, 0.6),
    ("drive-angle", "rad"): (-2.5, 2.5),
    ("load-angle", "rad"): (-0.8, 0.8),
    ("distance-since-reversal", "m"): (1e-4, 1e-2),
    ("reading", "N"): (2.0, 18.0),
    ("tension", "N"): (1.0, 12.0),
    ("position-along-conduit", "1"): (0.0, 1.0),
    ("reading", "N m"): (-0.1, 0.1),
    ("reading", "rad"): (-1.0, 1.0),
    ("cable", "1"): (-1.0, 1.0),
    ("torque", "N"): (-12.0, 12.0),
    ("rate", "N/s"): (-20.0, 20.0),
    ("acceleration", "rad/s^2"): (-300.0, 300.0),
}
CURVES = [(name, curve) for name in mechanisms.names() for curve in mechanisms.get(name).curves]


def law_of(curve):
    """The learned law that stands for a curve."""
    return next(
        law
        for law in laws().values()
        if law.is_first
        and (law.slot, law.argument.name, law.form.name) == (curve.slot, curve.argument, curve.form)
        and (not curve.channels or law.channel in curve.channels)
    )


def learned(law, y, sd=0.03):
    """A law with these values at its knots, its coefficients known to `sd` of their prior and off by so much."""
    first, last = RANGES[law.argument.name, law.argument.unit]
    values = {"first": first, "last": last, "scale": 1.0}
    x, _ = law.at_knots(values | dict.fromkeys(law.coefficients, 0.0))
    if law.form.is_centred:
        y = y(x) / y(x).mean() - 1 if law.form.is_factor else y(x) - y(x).mean()
    else:
        y = law.behind(x, y(law.determined_at(x)))
    scale = 3 * float(np.abs(y).max())
    z = np.linalg.lstsq(scale * law.basis, y, rcond=None)[0]
    z += sd * np.random.default_rng(7).standard_normal(z.size)
    covariance = sd**2 * np.eye(z.size)
    return Learned(law, values | {"scale": scale} | dict(zip(law.coefficients, z, strict=True)), covariance)


@pytest.mark.parametrize(("name", "curve"), CURVES, ids=lambda one: one if isinstance(one, str) else one.argument)
def test_the_law_of_a_listed_mechanism_is_within_the_band_of_that_mechanism(name, curve):
    constants = {p.name: p.start for p in curve.constants}
    found = learned(law_of(curve), lambda x: curve.of(x, constants))
    nearest = nearest_listed(found)
    assert nearest["distance"] <= distance(found, curve) < (nearest["limit"] or np.inf)


@pytest.mark.parametrize(
    ("name", "slot", "argument", "y"),
    [
        ("stribeck", "sliding-friction", "speed", lambda v: 1 + 0.3 * np.exp(-((10**v / 3e-3) ** 1.4))),
        ("viscous-friction", "sliding-friction", "speed", lambda v: 1 + 6.0 * 10**v),
        ("viscous-friction", "sliding-friction", "speed", lambda v: 1 + 0.06 * (10**v / 0.01) ** 0.6),
        ("running-in", "sliding-friction", "travel", lambda w: 1 - 0.2 * np.expm1(-w * 8)),
        ("running-in", "sliding-friction", "time", lambda t: 1 - 0.2 * np.expm1(-t / 7)),
        ("relaxation", "sliding-friction", "time", lambda t: 1 - 0.05 * (1 - np.exp(-t / 15))),
        ("pulley-eccentricity", "bearing-torque", "drive-angle", lambda a: 2e-3 * np.sin(a + 1.2)),
        ("pulley-eccentricity", "pulley-radius", "drive-angle", lambda a: 1 + 0.04 * np.sin(a + 1.2)),
        ("load-inertia", "load", "acceleration", lambda a: 2e-4 * a),
        ("pulley-friction", "bearing-torque", "speed", lambda w: 4e-3 * np.tanh(w / 0.4)),
        ("presliding", "sliding-friction", "distance-since-reversal", lambda s: 1 - 2 * np.exp(-s / 3e-5)),
        ("pulley-friction", "load", "distance-since-reversal", lambda s: 4e-3 * (1 - np.exp(-s / 6e-4))),
        ("load-stiffening", "load", "load-angle", lambda a: -0.02 * a**3),
        ("backlash", "load", "load-angle", lambda a: -0.05 * np.clip(a, -0.06, 0.06)),
        ("load-dependent-friction", "sliding-friction", "tension", lambda T: (T / 5) ** -0.3),
        ("constant-drag", "sliding-friction", "tension", lambda T: 1 + 1.5 / T),
        ("kink", "sliding-friction", "position-along-conduit", lambda x: 1 + 2 * (1 - abs(x - 0.3) / 0.12).clip(0)),
        ("termination-compliance", "end-stretch", "tension", lambda T: np.full(T.shape, 3e-5)),
        ("load-cell-scale", "sensor-map", "reading", lambda f: -0.04 * f),
        ("load-cell-offset", "sensor-map", "reading", lambda f: np.full(f.shape, -0.8)),
        ("load-cell-drift", "sensor-map", "time", lambda t: 0.07 * t),
        ("load-cell-drift", "sensor-map", "time", lambda t: 0.2 * (1 - np.exp(-t / 4))),
        ("load-cell-crosstalk", "sensor-map", "torque", lambda pull: -0.06 * pull),
        ("cable-asymmetry", "sliding-friction", "cable", lambda cable: 1 + 0.1 * cable),
        ("cable-asymmetry", "cable-stretch", "cable", lambda cable: 1 - 0.1 * cable),
    ],
)
def test_the_mechanism_of_a_law_is_the_nearest(name, slot, argument, y):
    channel = {"sensor-map": "F_load_N"}.get(slot)
    law = next(
        one
        for one in laws().values()
        if (one.slot, one.argument.name) == (slot, argument) and (channel is None or one.channel == channel)
    )
    found = nearest_listed(learned(law, y, sd=0.01))
    assert found["name"] == name
    assert found["distance"] < (found["limit"] or np.inf)


def test_a_law_of_another_period_is_far_from_an_eccentric_pulley():
    law = replace(law_of(by_name("pulley-eccentricity", "bearing-torque")), resolution=FINE)
    found = nearest_listed(learned(law, lambda a: 2e-3 * np.sin(2 * np.pi * a / 0.7)))
    assert found["distance"] > 3 * found["limit"]


def by_name(name, slot):
    return next(curve for curve in mechanisms.get(name).curves if curve.slot == slot)


def test_what_is_hardly_known_is_within_the_band_of_more():
    law = law_of(by_name("stribeck", "sliding-friction"))
    rising = [
        distance(learned(law, lambda v: 1 + 6.0 * 10**v, sd), by_name("stribeck", "sliding-friction"))
        for sd in (0.01, 0.1)
    ]
    assert rising[0] > 3
    assert rising[1] < rising[0] / 3


def test_correlated_coefficients_are_measured_along_their_correlation():
    """A slope that a calibration nearly absorbs is no distance."""
    curve = by_name("load-stiffening", "load")
    law = law_of(curve)
    found = learned(law, lambda a: 0.02 * a**3 + 0.05 * a, sd=0.01)
    x, _ = law.at_knots(found.values)
    slope = np.linalg.lstsq(found.values["scale"] * law.basis, x, rcond=None)[0]
    free = replace(found, covariance=found.covariance + np.outer(slope, slope))
    assert distance(found, curve) > 3
    assert distance(free, curve) < nearest_listed(free)["limit"]


@pytest.mark.parametrize("name", [n for n, law in laws().items() if law.form.has_elements])
@pytest.mark.parametrize("y", [np.full(9, 0.08), np.linspace(-0.08, 0.2, 9)], ids=["all act", "some cannot act"])
def test_a_kept_law_with_elements_is_itself(name, y):
    law = laws()[name]
    z = np.linalg.lstsq(0.1 * law.basis, y, rcond=None)[0]
    values = {"first": 2e-5, "last": 1e-2, "scale": 0.1} | dict(zip(law.coefficients, z, strict=True))
    kept = law.curve(*law.at_knots(values), Parameter("strength", "1", 0.1, 3.0, 1.0, "size"))
    assert distance(Learned(law, values, 0.01 * np.eye(z.size)), kept) < 1e-3


def test_the_limit_is_that_of_laws_which_are_the_listed_one():
    """All coefficients but one are errors of a standard deviation of 1: one of twenty distances is above the limit."""
    law = laws()["learned-sensor-map-tau-in-by-reading"]
    found = learned(law, lambda x: 0.05 * x)
    random, coefficients = np.random.default_rng(5), len(found.covariance)
    limit = nearest_listed(found)["limit"]
    over = np.mean(random.chisquare(coefficients - 1, 100_000) / coefficients > limit**2)
    assert over == pytest.approx(0.05, abs=0.003)


def test_a_slot_that_no_listed_mechanism_has_has_no_nearest():
    law = laws()["learned-sliding-friction-by-direction"]
    assert nearest_listed(Learned(law, {"first": -1.0, "last": 1.0, "scale": 0.1, "z1": 1.0}, np.eye(1))) is None


def test_a_map_is_compared_with_faults_of_its_own_sensor():
    law = laws()["learned-sensor-map-tau-in-by-reading"]
    assert nearest_listed(learned(law, lambda x: 0.05 * x))["name"] == "torque-scale"
    assert nearest_listed(learned(laws()["learned-sensor-map-theta-out-by-reading"], lambda x: 0.05 * x)) is None


def said(formula="a + b x", name_of_law="learned-sliding-friction-by-speed", **nearest):
    law = {
        "name": name_of_law,
        "formula": formula,
        "slot": "sliding-friction",
        "curve": [[-2.0, 1.1, 1.0, 1.2], [-1.0, 0.9, 0.8, 1.0]],
        "argument_unit": "log10(m/s)",
        "place": "conduit",
        "argument_is": "the speed",
        "indistinguishable": [],
        "confidence": 0.9,
        "channel": None,
        "nearest_listed": nearest or None,
        "parameters": [{"name": "a", "value": 1.2, "low": 1.1, "high": 1.3, "unit": "y"}],
    }
    return law_claim(law)


def test_the_report_says_whether_it_is_a_listed_law():
    assert "Within its uncertainty this is the law of stribeck" in said(name="stribeck", distance=0.9, limit=1.2)
    far = said(name="stribeck", distance=7.4, limit=1.2)
    assert "No listed mechanism does this (the nearest is stribeck, 7.4 standard" in far
    assert "A law with so few constants may be stribeck" in said(name="stribeck", distance=0.0, limit=None)
    assert "No listed mechanism does this; the law" in said()


def test_the_report_says_where_a_law_is_a_constant():
    friction = said("a", name="stribeck", distance=0.9, limit=1.2)
    assert "Friction along the conduits is constant: 1.2 (1.1 to 1.3) times the calibrated one, confidence" in friction
    drag = next(name for name, law in laws().items() if law.form is CONSTANT_DRAG)
    assert "Friction along the conduits has a constant drag of a cable per length of conduit: 1.2 N/m (1.1 to" in said(
        "a", name_of_law=drag
    )


def test_a_factor_that_may_be_zero_has_no_upper_limit_in_the_report():
    """Two recordings hardly determine friction by direction."""
    law = laws()["learned-sliding-friction-by-direction"]
    stated = {"name": law.name, "slot": "sliding-friction", "curve": [[-1.0, 0.8, -0.1, 1.7], [1.0, 1.2, 0.3, 2.1]]}
    assert law_size(stated).startswith("50 % (at least -")


def test_the_report_says_by_how_much_a_radius_is_wrong():
    law = {
        "name": "learned-pulley-radius-drive-by-drive-angle",
        "formula": "a",
        "slot": "pulley-radius",
        "curve": [[-0.5, 1.03, 1.02, 1.04], [0.5, 1.03, 1.02, 1.04]],
        "argument_unit": "rad",
        "place": "drive-pulley",
        "argument_is": "the drive pulley's angle",
        "parameters": [{"name": "a", "value": 1.0312, "low": 1.03, "high": 1.033, "unit": "1"}],
        "indistinguishable": [],
        "confidence": 0.95,
        "channel": None,
        "nearest_listed": None,
    }
    assert "The radius of the drive pulley is 1.03 times the stated one, confidence 0.95" in law_claim(law)


def test_a_delay_is_said_of_its_end_and_compared_with_a_late_clock():
    law = laws()["learned-sensor-map-load-delay-by-time"]
    found = learned(law, lambda t: np.full(t.shape, 0.012), sd=0.01)
    assert nearest_listed(found)["name"] == "time-skew"
    x, _ = law.at_knots(found.values)
    kept = law.curve(x, np.full(x.size, 0.012), Parameter("strength", "1", 0.1, 3.0, 1.0, "size"))
    assert distance(found, kept) < 1.2 and law.has_the_form_of(kept)
    stated = {"slot": law.slot, "place": law.place, "channel": None, "argument_is": "the time", "confidence": 0.9}
    curve = {"name": law.name, "curve": [[0.0, 0.0, 0.0, 0.0], [9.0, 0.012, 0.01, 0.02]], "argument_unit": "s"}
    text = law_claim(stated | curve | {"indistinguishable": [], "nearest_listed": None})
    assert text.startswith(
        "The delay of the load's channels depends on the time: from 0 s at 0 s to 12 ms at 9 s, conf"
    )


@pytest.mark.parametrize(
    ("name", "curve", "says"),
    [
        (
            "learned-sliding-friction-by-direction",
            [[-1.0, 0.9, 0.89, 0.91], [1.0, 1.1, 1.09, 1.11]],
            "22 % (20 to 25 %) higher towards the drive than away from the drive",
        ),
        (
            "learned-sliding-friction-by-cable",
            [[-1.0, 1.1, 1.09, 1.11], [1.0, 0.9, 0.89, 0.91]],
            "22 % (20 to 25 %) higher in cable A than in cable B",
        ),
        (
            "learned-sliding-friction-by-tension",
            [[0.5, 1.05, 1.0, 1.1], [5.0, 0.97, 0.96, 0.98], [25.0, 0.93, 0.92, 0.94]],
            "from 0.93 times the calibrated one at 25 N to 1.05 times at 0.5 N",
        ),
        (
            "learned-bearing-torque-by-drive-angle",
            [[-0.6, 0.001, 0.0, 0.002], [0.0, -0.0057, -0.006, -0.005], [0.6, 0.0061, 0.006, 0.007]],
            "from -5.7 mN m at 0 rad to 6.1 mN m at 0.6 rad",
        ),
        (
            "learned-sliding-friction-bend-by-position-along-conduit",
            [[0.0, -0.1, -0.2, 0.0], [0.5, 0.9, 0.8, 1.0]],
            "bend added to the conduits from -0.1 rad at 0 to 0.9 rad at 0.5",
        ),
    ],
)
def test_a_law_says_how_large_it_is(name, curve, says):
    learned = laws()[name]
    law = {"name": name, "slot": learned.slot, "curve": curve, "argument_unit": learned.argument.unit}
    assert law_size(law) == says


def test_a_mass_is_said_by_its_constant():
    (name,) = (n for n, law in laws().items() if law.form.in_proportion)
    constant = {"name": "a", "value": 4.06e-4, "low": 4.0e-4, "high": 4.1e-4, "unit": "N*m/(rad/s^2)"}
    assert law_size({"name": name, "slot": laws()[name].slot, "curve": [], "parameters": [constant]}).endswith(
        " times it"
    )
