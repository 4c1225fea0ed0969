"""What a run takes from a recording: its zero, its load, its tension sensors, and the initial profile, by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from builders import recording
from ccmodel import mechanisms as registry
from ccmodel.channels import MEASURED, TENSIONS
from ccmodel.geometry import ConduitPath
from ccmodel.model.general.run import Active
from ccmodel.model.initial import Held, InitialTension
from ccmodel.model.load import AngleLoad, FixedLoad, SpringLoad, TorqueLoad
from ccmodel.model.run import (
    ModelInput,
    _by_torque_alone,
    _load,
    _true_at_rest,
    _zeroed,
    initial_tension,
    simulate,
    simulate_recording,
    spring_load,
)
from ccmodel.model.sensors import read_by_sensors
from general_runs import evenly_added_bend
from model_runs import CABLE

THETA = np.linspace(1.0, 2.0, 301)


def moved(rest_s, settled_s, **channels):
    return replace(recording(settled_s=settled_s, **channels), rest_s=rest_s)


def read(t):
    return 10.0 + t


@pytest.mark.parametrize("settled_s", [0.0, 0.5])
def test_the_zero_is_that_of_the_rest(settled_s):
    found = _zeroed(THETA, THETA[0], moved(0.5, settled_s, theta_out_rad=read))
    assert found == pytest.approx(THETA - THETA[0])


@pytest.mark.parametrize("rest_s, settled_s", [(0.0, 1.0), (0.5, 1.0), (0.0, 0.0)])
def test_without_a_rest_of_use_the_judged_samples_have_the_recordings_mean(rest_s, settled_s):
    one = moved(rest_s, settled_s, theta_out_rad=read)
    judged = one.time_s >= settled_s
    found = _zeroed(THETA, THETA[0], one)
    assert found[judged].mean() == pytest.approx(one["theta_out_rad"][judged].mean())
    assert np.ptp(found - THETA) == pytest.approx(0.0, abs=1e-12)


def test_without_a_rest_and_without_that_angle_the_first_sample_is_the_zero():
    assert _zeroed(THETA, THETA[0], moved(0.0, 1.0)) == pytest.approx(THETA - THETA[0])


@pytest.mark.parametrize(
    "channels, alone",
    [(("tau_in_Nm",), True), (("F_drive_N",), False), (("tau_in_Nm", "F_drive_N"), False), ((), False)],
)
def test_a_tension_is_that_of_the_torque_where_there_is_no_load_cell(channels, alone):
    assert _by_torque_alone("drive", recording(**dict.fromkeys(channels, np.cos))) is alone


def given(far_end=None, **measured):
    one = replace(recording(), far_end=far_end)
    values = dict.fromkeys(("theta_out", "tau_out", "F_load")) | measured
    return SimpleNamespace(recording=one, **values)


TORQUE, FORCE = np.full(301, 0.02), np.full(301, 5.0)


def test_the_load_of_a_run():
    spring, zeros = CABLE, replace(CABLE, tau_out_zero_Nm=0.005, F_load_zero_N=1.0)
    none = replace(zeros, load_stiffness_Nm_per_rad=None)
    load, measured = _load(given(tau_out=TORQUE), spring, "law")
    assert isinstance(load, SpringLoad) and load.stiffness_Nm_per_rad == 0.05 and measured == ()
    for parameters, source in ((zeros, "torque"), (none, "law")):
        load, measured = _load(given(tau_out=TORQUE), parameters, source)
        assert isinstance(load, TorqueLoad) and measured == ("tau_out_Nm",)
        assert load.torque_Nm == pytest.approx(0.015)
    assert isinstance(_load(given("fixed"), none, "law")[0], FixedLoad)
    load, measured = _load(given("measured-motion", theta_out=THETA), none, "law")
    assert isinstance(load, AngleLoad) and measured == ("theta_out_rad",)
    load, measured = _load(given("measured-tension", F_load=FORCE, tau_out=TORQUE), none, "law")
    assert load.torque_Nm == pytest.approx(4.0 * none.load_radius_m) and measured == ("F_load_N", "T2_N")
    load, measured = _load(given("measured-tension", tau_out=TORQUE), zeros, "law")
    assert isinstance(load, TorqueLoad) and measured == ("tau_out_Nm",)


@pytest.mark.parametrize("curvature, reached", [(0.5, 0.5), (-0.5, -0.5), (1.0, 1.0), (3.0, 1.0), (-3.0, -1.0)])
def test_the_middle_of_an_initial_profile_is_off_by_a_share_of_what_friction_holds(curvature, reached):
    path, mu = ConduitPath([1.2], [2.0]), 0.3
    initial = InitialTension.between_ends(path, mu, (8.0, 6.0), (6.0, 8.0), (curvature, curvature))
    held = 0.5 * mu * 2.0 - 0.5 * np.log(8.0 / 6.0)
    for tension in (initial.tension_A_N, initial.tension_B_N):
        assert tension[1] == pytest.approx(np.sqrt(48.0) * np.exp(reached * held))
    initial.log_slopes(path, mu)


@pytest.mark.parametrize(
    "far_end, stiffness, tau_out", [(None, 0.05, 0.010), (None, None, 0.011), ("fixed", None, 0.010)]
)
def test_a_torque_that_is_the_load_keeps_its_reading_and_others_are_freed_of_their_sensors_fault(
    far_end, stiffness, tau_out
):
    fault = Active("torque-scale", "load-sensor", {"gain": 0.1})
    parameters = replace(CABLE, load_stiffness_Nm_per_rad=stiffness, mechanisms=(fault,))
    rest = {"time_s": 0.1, "tau_in_Nm": 0.01, "tau_out_Nm": 0.011, "F_drive_N": 14.0, "F_load_N": 14.0}
    one = SimpleNamespace(recording=replace(recording(), far_end=far_end), resting_mean=rest)
    assert _true_at_rest(one, parameters)["tau_out_Nm"] == pytest.approx(tau_out)


@pytest.mark.parametrize("added_rad", [0.0, 1.0])
def test_a_law_that_adds_bend_holds_more_of_the_tension_that_a_rest_shows(added_rad):
    """Cable A rests with a ratio of tensions that its loop alone does not hold."""
    mu, radius = CABLE.friction_coefficient, CABLE.drive_radius_m
    ratio = np.exp(mu * (np.pi + 0.8))
    T1, T2, T3, T4 = 12.0, 12.0 / ratio, 7.0, 7.0
    shown = {
        "tau_in_Nm": (T1 - T3) * radius,
        "tau_out_Nm": (T2 - T4) * radius,
        "F_drive_N": T1 + T3,
        "F_load_N": T2 + T4,
    } | dict(zip(TENSIONS, (T1, T2, T3, T4), strict=True))
    still = {"theta_in_rad": 0.0, "theta_out_rad": 0.0}
    rest = moved(0.5, 0.0, **{c: lambda t, v=v: np.full(t.size, v) for c, v in (shown | still).items()})
    parameters = replace(CABLE, mechanisms=(Active(*evenly_added_bend(added_rad)),))
    found = initial_tension(ModelInput.of(rest), parameters).tension_A_N
    held = ratio if added_rad else np.exp(mu * np.pi)
    assert found[0] / found[-1] == pytest.approx(held, rel=1e-3)


OF_SENSORS = [registry.get(name) for name in registry.names() if registry.get(name).modifies_observation]
FAULTS = [(mechanism.name, place) for mechanism in OF_SENSORS for place in mechanism.places]


@pytest.mark.parametrize("name, place", FAULTS)
def test_the_exact_solver_runs_what_only_modifies_the_observation(name, place):
    one, mechanism = recording(), registry.get(name)
    sound, neutral, faulty = (
        simulate_recording(one, replace(CABLE, mechanisms=mechanisms))
        for mechanisms in ([], [Active(name, place, mechanism.neutral)], [Active(name, place, mechanism.start)])
    )
    # A drag of zero does nothing, but a model that has one runs on the general solver.
    on_general = [Active("constant-drag", "conduit", {"f0": 0.0}), Active(name, place, mechanism.start)]
    by_grid = simulate_recording(one, replace(CABLE, mechanisms=on_general))
    for channel in MEASURED:
        np.testing.assert_array_equal(neutral[channel], sound[channel])
        # The two differ, by the error of the general solver's grid.
        assert 0 < np.abs(faulty[channel] - by_grid[channel]).max() < 5e-3 * np.ptp(faulty[channel])
    assert any((faulty[channel] != sound[channel]).any() for channel in MEASURED)


def test_a_motion_that_starts_elsewhere_comes_from_rest_in_both_solvers():
    """A mechanism without strength changes no motion, and the solvers agree on it to the general one's grid."""
    time_s = np.arange(0, 2, 0.002)
    given = ModelInput.prescribed(recording(), time_s, 0.5 * np.cos(2 * np.pi * time_s), 7.0)
    exactly = simulate(given, CABLE)
    none = (Active("constant-drag", "conduit", {"f0": 0.0}),)
    generally = simulate(given, replace(CABLE, mechanisms=none, refinement=4))
    for channel in ("tau_in_Nm", "tau_out_Nm", "theta_out_rad"):
        assert np.abs(generally[channel] - exactly[channel]).max() < 0.01 * np.ptp(exactly[channel]), channel
    assert 0.3 < exactly["theta_out_rad"][0] < 0.5


def test_a_load_cell_responds_to_the_torque_and_not_to_its_sensors_reading():
    """Whatever the order of two faults: of 14 N and 60 mN m over 6 mm, a tenth is 1 N."""
    faults = (
        Active("torque-scale", "load-sensor", {"gain": 0.1}),
        Active("load-cell-crosstalk", "load-sensor", {"crosstalk": 0.1}),
    )
    true = {"tau_out_Nm": np.full(3, 0.06), "F_load_N": np.full(3, 14.0)}
    for order in (faults, faults[::-1]):
        read = read_by_sensors(order, np.arange(3.0), true, (0.006, 0.006))
        assert read["F_load_N"] == pytest.approx(15.0)
        assert read["tau_out_Nm"] == pytest.approx(0.066)


def test_a_load_that_is_driven_by_its_torque_rests_at_what_drives_it():
    """The rest holds the torque's reading, a fault of its sensor included, where the run does."""
    fault = replace(CABLE, mechanisms=(Active("torque-scale", "load-sensor", {"gain": 0.1}),))
    rest = {"tau_in_Nm": 0.0, "F_drive_N": 14.0, "tau_out_Nm": 0.0099, "F_load_N": 14.0, "time_s": 0.1}
    given = SimpleNamespace(resting_mean=rest, recording=recording())
    assert _true_at_rest(given, fault)["tau_out_Nm"] == pytest.approx(0.009)
    assert _true_at_rest(given, fault, "torque")["tau_out_Nm"] == pytest.approx(0.0099)


@pytest.mark.parametrize(
    ("accuracy", "known_to"), [({"tau_out_Nm": 1e-4}, 2e-4), ({"tau_in_Nm": 3e-4}, 6e-4), ({}, 0.0)]
)
def test_the_torque_at_rest_is_known_to_the_accuracy_of_a_sensor(accuracy, known_to):
    assert spring_load(0.05, CABLE, accuracy).rest_known_to_Nm == pytest.approx(known_to)


@pytest.mark.parametrize("acting", [None, (Held(0.4), Held(0.2))])
def test_a_kink_off_the_middle_leaves_a_straight_profile_straight(acting):
    """Its corner lies where the kink has put it, and the profile stays within what friction holds on both sides."""
    path, mu, kink_rad = ConduitPath([1.2], [2.0]), 0.3, 1.0
    ends, kinks = (8.0, 6.5), (kink_rad, 0.0)
    held = acting or 2 * (Held(mu * 3.0),)
    for curvature in (0.0, 1e-9, 0.5, 1.0, -1.0):
        shares = (curvature, curvature)
        initial = InitialTension.between_ends(path, mu, ends, ends, shares, kinks, acting)
        for tension, (most, _) in zip((initial.tension_A_N, initial.tension_B_N), held, strict=True):
            # The first half has two thirds of all bend.
            corners = [0.0, 2 / 3, 1.0] if tension.size == 3 else [0.0, 1.0]
            near, middle, far = np.interp([0.0, 2 / 3, 1.0], corners, np.log(tension))
            assert abs(middle - near) <= most * 2 / 3 + 1e-12
            assert abs(far - middle) <= most / 3 + 1e-12
            if abs(curvature) < 1e-6:
                assert middle == pytest.approx(near + (far - near) * 2 / 3, abs=1e-8)
