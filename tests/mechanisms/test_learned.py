"""Laws that no list holds: what they do to a run, and what they look like at neutral values."""

import numpy as np
import pytest

from ccmodel import mechanisms as registry
from ccmodel.channels import TAU_IN, THETA_IN, THETA_OUT
from ccmodel.mechanisms import Sensing, laws
from ccmodel.mechanisms.learned import COARSE, FINE, basis
from ccmodel.model.load import FixedLoad, SpringLoad
from tests.general_runs import HALF_LOOP, K_E, MU, run, sine

EVERY = list(laws().values())


def values_of(law, **coefficients):
    fixed = {"first": -1.0 if law.opposes is None else 1e-4, "last": 1.0, "scale": 0.1}
    return fixed | dict.fromkeys(law.coefficients, 0.0) | coefficients


def learned(law, **coefficients):
    return law.name, law.place, values_of(law, **coefficients)


def test_laws_are_found_by_name_and_are_on_no_list():
    assert not set(laws()) & set(registry.names())
    assert all(registry.get(name).name == name for name in laws())
    assert all(registry.get(name).by_name_only for name in laws())


@pytest.mark.parametrize("resolution", [COARSE, FINE])
@pytest.mark.parametrize("is_centred", [True, False])
def test_the_coefficients_make_smooth_curves_of_variance_one(resolution, is_centred):
    B = basis(*resolution, is_centred)
    assert np.mean((B**2).sum(axis=1)) == pytest.approx(1.0)
    if is_centred:
        assert np.abs(B.mean(axis=0)).max() < 1e-9, "the mean belongs to the calibration"
    curves = B @ np.random.default_rng(1).standard_normal((B.shape[1], 200))
    assert np.mean(np.diff(curves, axis=0) ** 2) < 0.5 * np.mean(curves**2)


@pytest.mark.parametrize("law", [law for law in EVERY if law.resolution == COARSE], ids=lambda law: law.name)
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


def test_a_law_with_memory_is_a_sum_of_maxwell_slip_elements():
    """A reversal builds the torque up over twice the travel at which an element yields, and cycles close."""
    law = laws()["learned-bearing-torque-by-distance-since-reversal"]
    theta = np.concatenate([np.linspace(0, 2, 401), np.linspace(2, -2, 801)[1:], np.linspace(-2, 2, 801)[1:]])
    sensing = Sensing(np.arange(theta.size) * 0.01, {THETA_IN: theta, TAU_IN: 0 * theta}, 1.0, 1.0)
    values = values_of(law, z1=1.0) | {"first": 0.01, "last": 1.0}
    torque = law.added(sensing, values)
    assert torque[400] == pytest.approx(law.at_knots(values)[1].sum())
    assert torque[1200] == pytest.approx(-torque[400])
    assert torque[2000] == pytest.approx(torque[400])
    up, down = torque[1200:2001], torque[400:1201]
    np.testing.assert_allclose(up, -down, atol=1e-12)


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
    assert np.abs(found.read[THETA_OUT] - stiff.read[THETA_OUT]).max() < 0.05 * change
