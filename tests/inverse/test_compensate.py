"""The drive's motion for a wanted one of the load, by both solvers, and its limits."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from inverse_runs import EVEN, K_E, PAIR, PARAMETERS, PATH, T0, TIME_S

from ccmodel import mechanisms as registry
from ccmodel.failure import ModelError
from ccmodel.inverse import follow
from ccmodel.inverse.compensate import Limits, compensated, within_limits
from ccmodel.model.exact import simulate_pair
from ccmodel.model.general import Active
from ccmodel.model.load import SpringLoad
from ccmodel.recording import Recording

RIG = Recording("b", "r", "virtual-rig", np.empty(0), {}, {}, T0, PATH)
SWING = np.clip(TIME_S / 0.5, 0, 1) ** 2 * 0.4 * np.sin(2 * np.pi * TIME_S)
WANTED = pd.DataFrame({"time_s": TIME_S, "theta_out_rad": SWING})
FREE = Limits()


def acting(name, place):
    return Active(name, place, {p.name: p.start for p in registry.get(name).parameters})


def test_the_load_follows_by_the_exact_solver():
    theta, solved = follow.exact(PAIR, K_E, EVEN, SWING)
    assert solved == SWING.size
    load = simulate_pair(PAIR, SpringLoad(K_E), theta, EVEN).theta_out_rad
    assert np.abs(load - load[0] - SWING).max() < 1e-8


@pytest.mark.parametrize(
    "mechanism",
    [
        ("presliding", "conduit"),
        ("pulley-friction", "load-pulley"),
        ("viscous-friction", "conduit"),
        ("pulley-eccentricity", "drive-pulley"),
        ("load-stiffening", "load"),
        ("backlash", "load-pulley"),
    ],
    ids=lambda one: one[0],
)
def test_the_load_follows_with_mechanisms(mechanism):
    name, place = mechanism
    place = place if place in registry.get(name).places else registry.get(name).places[0]
    parameters = replace(PARAMETERS, mechanisms=(acting(name, place),))
    found = compensated(WANTED, parameters, RIG, FREE)
    lost = np.abs(found.table["theta_out_rad"] - SWING)
    straight = np.sqrt(np.mean((found.straight_rad - SWING) ** 2))
    assert straight > 0.01
    assert np.sqrt(np.mean(lost**2)) < straight / 50


def test_a_fault_of_the_loads_sensor_is_no_lost_motion():
    late = Active("time-skew", "load-sensor", {"delay": 0.05})
    found = compensated(WANTED, replace(PARAMETERS, mechanisms=(late,), theta_out_zero_rad=0.01), RIG, FREE)
    assert np.abs(found.table["theta_out_rad"] - SWING).max() < 1e-6


@pytest.mark.parametrize(
    ("name", "first", "last", "scale"),
    [
        ("learned-load-by-load-angle", -0.5, 0.5, 0.005),
        ("learned-load-by-speed", -3.0, 3.0, 0.002),
        ("learned-load-by-distance-since-reversal", 1e-5, 2e-3, 0.002),
        ("learned-bearing-torque-load-by-distance-since-reversal", 1e-5, 2e-3, 0.002),
        ("learned-sliding-friction-by-tension", 2.0, 15.0, 0.3),
        ("learned-pulley-radius-drive-by-drive-angle", -0.7, 0.7, 0.05),
    ],
)
def test_the_load_follows_with_a_law_that_was_learned(name, first, last, scale):
    law = registry.laws()[name]
    coefficients = dict.fromkeys(law.coefficients, 0.0) | {law.coefficients[0]: 1.0}
    acting = Active(name, law.place, {"first": first, "last": last, "scale": scale} | coefficients)
    found = compensated(WANTED, replace(PARAMETERS, mechanisms=(acting,)), RIG, FREE)
    plain = compensated(WANTED, PARAMETERS, RIG, FREE)
    straight, lost = (np.sqrt(np.mean((of - SWING) ** 2)) for of in (found.straight_rad, found.table["theta_out_rad"]))
    assert np.abs(found.straight_rad - plain.straight_rad).max() > 1e-3
    assert lost < straight / 50


def test_a_fault_of_a_sensor_changes_no_motion_of_the_drive():
    fault = acting("torque-scale", "drive-sensor")
    sound, faulty = (
        compensated(WANTED, replace(PARAMETERS, mechanisms=mechanisms), RIG, FREE) for mechanisms in ((), (fault,))
    )
    assert faulty.table["theta_in_rad"].equals(sound.table["theta_in_rad"])


def test_without_limits_the_drive_crosses_the_lost_motion_in_a_sample():
    found = compensated(WANTED, PARAMETERS, RIG, FREE)
    steps = np.abs(np.diff(found.table["theta_in_rad"]))
    assert steps.max() > 10 * np.median(steps)
    assert np.abs(found.table["theta_out_rad"] - SWING).max() < 1e-8


def test_limits_are_kept_and_centred():
    jump = np.where(TIME_S < 1.0, 0.0, 0.2)
    limits = Limits(10.0, 500.0)
    theta = within_limits(TIME_S, jump, limits)
    speed = np.diff(theta) / np.diff(TIME_S)
    assert 4.9 < np.abs(speed).max() <= 10.0
    assert np.abs(np.diff(speed) / np.diff(TIME_S)[1:]).max() <= 500.0 * 1.001
    assert TIME_S[np.argmin(np.abs(theta - 0.1))] == pytest.approx(1.0, abs=0.003)
    assert theta[0] == pytest.approx(0.0) and theta[-1] == pytest.approx(0.2)
    by_speed = within_limits(TIME_S, jump, Limits(10.0))
    assert np.abs(np.diff(by_speed) / np.diff(TIME_S)).max() == pytest.approx(10.0)
    too_fast = within_limits(TIME_S, SWING, Limits(1.5))
    assert np.abs(np.diff(too_fast) / np.diff(TIME_S)).max() == pytest.approx(1.5)


def test_a_motion_within_its_limits_is_left_as_it_is():
    slow = 0.1 * np.sin(TIME_S)
    assert np.array_equal(within_limits(TIME_S, slow, FREE), slow)
    assert np.allclose(within_limits(TIME_S, slow, Limits(5.0)), slow, atol=1e-15)


@pytest.mark.parametrize("limits", [Limits(5.0), Limits(5.0, 1000.0)])
def test_within_limits_little_of_the_lost_motion_comes_back(limits):
    found = compensated(WANTED, PARAMETERS, RIG, limits)
    lost, straight = (
        np.sqrt(np.mean((angle - SWING) ** 2)) for angle in (found.table["theta_out_rad"], found.straight_rad)
    )
    assert lost < straight / 50


@pytest.mark.parametrize(("rest_s", "exceeds"), [(0.0, True), (0.4, False)])
def test_a_start_that_no_drive_can_follow_is_said(rest_s, exceeds):
    """With limits the drive begins before the load, and needs a rest for it."""
    limits = Limits(1.5, 20.0)
    wanted = WANTED.assign(theta_out_rad=np.interp(TIME_S - rest_s, TIME_S, SWING, left=0.0))
    found = compensated(wanted, PARAMETERS, RIG, limits)
    theta = np.concatenate([[0.0, 0.0], found.table["theta_in_rad"]])
    step = TIME_S[1] - TIME_S[0]
    speed = np.diff(theta) / step
    most = max(np.abs(speed).max() / 1.5, np.abs(np.diff(speed)).max() / step / 20.0)
    assert (most > 1.001) == exceeds
    assert [("begins with a step from rest" in note) for note in found.notes] == [True] * exceeds


def test_a_pretension_of_its_own():
    nominal, half = (compensated(WANTED, PARAMETERS, RIG, FREE, T).table["theta_in_rad"] for T in (None, T0 / 2))
    assert np.abs(nominal - half).max() > 0.01


def test_a_limit_of_the_acceleration_alone_is_refused():
    with pytest.raises(ValueError, match="needs one of the speed"):
        Limits(acceleration_rad_per_s2=1.0)


def test_what_cannot_be_compensated_is_refused():
    with pytest.raises(ModelError, match="no law of its load"):
        compensated(WANTED, replace(PARAMETERS, load_stiffness_Nm_per_rad=None), RIG, FREE)
    with pytest.raises(ModelError, match="does not move"):
        compensated(WANTED.assign(theta_out_rad=0.0), PARAMETERS, RIG, FREE)
    # A single cable pulls and does not push: the spring does not come beyond its neutral position.
    far = WANTED.assign(theta_out_rad=20 * SWING)
    with pytest.raises(ModelError, match="no motion of the drive .* at sample"):
        compensated(far, PARAMETERS, replace(RIG, far_end="spring"), FREE)


@pytest.mark.parametrize(
    "mechanisms", [(), (Active("constant-drag", "conduit", {"f0": 0.1}),)], ids=["exact", "general"]
)
def test_a_wanted_motion_counts_from_where_the_load_rests(mechanisms):
    wanted = 0.2 * np.cos(np.pi * TIME_S)
    table = WANTED.assign(theta_out_rad=wanted)
    found = compensated(table, replace(PARAMETERS, mechanisms=mechanisms), RIG, FREE).table
    assert np.abs(found["theta_out_rad"] - wanted).max() < 0.01 * np.ptp(wanted)
