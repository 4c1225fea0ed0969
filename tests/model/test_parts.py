"""Parts run alone between what the whole showed at their boundaries show what the whole showed."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.failure import ModelError
from ccmodel.model import parts
from ccmodel.model.general.run import Active
from ccmodel.model.run import ModelInput, simulate
from model_runs import PULLED

PARAMETERS = replace(PULLED, load_radius_m=0.005)
FRICTION = Active("pulley-friction", "drive-pulley", {"friction_torque": 4e-3})
GAP = Active("backlash", "load-pulley", {"half_gap": 0.02})
STIFFENING = Active("load-stiffening", "load", {"K3": 0.2})


def whole(parameters=PARAMETERS):
    """A model's run as if it had been recorded."""
    drive = recording(theta_in_rad=lambda t: 0.6 * np.sin(2 * np.pi * t))
    said = simulate(ModelInput.of(drive), parameters)
    measured = replace(said, origin="virtual-rig", derived_from=dict.fromkeys(said.channels, "made by hand"))
    return measured, ModelInput.of(measured)


def agrees(a, b, tolerance):
    """Whether two courses are as near as this share of the second one's peak to peak."""
    return np.abs(a - b).max() <= tolerance * np.ptp(b)


def test_the_cables_between_both_angles():
    said, given = whole()
    between = simulate(given, PARAMETERS, "angle")
    for channel in ("T1_N", "T2_N", "T3_N", "T4_N"):
        assert agrees(between[channel], said[channel], 1e-9)


@pytest.mark.parametrize("name, near, far", [("A", "T1_N", "T2_N"), ("B", "T3_N", "T4_N")])
def test_one_cable_by_the_angle_or_by_the_tension_at_its_far_end(name, near, far):
    said, given = whole()
    moved = parts.cable(given, PARAMETERS, name)
    assert agrees(moved.T_near_N, said[near], 1e-9)
    assert agrees(moved.T_far_N, said[far], 1e-9)
    held = parts.cable(given, PARAMETERS, name, far="tension")
    assert agrees(held.T_near_N, said[near], 2e-3)


def test_a_fault_of_one_cable_shows_in_that_cable_alone():
    slow = Active("cable-asymmetry", "cable", {"ratio": 1.3, "K_ratio": 1.0})
    said, given = whole(replace(PARAMETERS, mechanisms=(slow,)))
    A, B = (parts.cable(given, PARAMETERS, name) for name in "AB")
    assert agrees(A.T_near_N, said["T1_N"], 2e-3)
    assert np.abs(B.T_near_N - said["T3_N"]).max() > 0.02 * np.ptp(said["T3_N"])


def test_the_drive_pulley_and_its_friction():
    rubbing = replace(PARAMETERS, mechanisms=(FRICTION,))
    said, given = whole(rubbing)
    T1, T3 = ((said["F_drive_N"] + s * simulate(given, rubbing, "angle")["tau_in_Nm"] / 0.006) / 2 for s in (1, -1))
    assert said["T1_N"] == pytest.approx(T1, abs=1e-3)
    free = parts.drive_pulley(given.theta_in, T1, T3, PARAMETERS)
    with_friction = parts.drive_pulley(given.theta_in, T1, T3, rubbing)
    assert np.ptp(with_friction - free) == pytest.approx(2 * 4e-3, rel=1e-6)


@pytest.mark.parametrize("mechanisms", [(), (GAP,), (STIFFENING,), (GAP, STIFFENING)])
def test_the_load_by_its_angle(mechanisms):
    parameters = replace(PARAMETERS, mechanisms=mechanisms)
    said, given = whole(parameters)
    assert agrees(parts.load(given, parameters), said["tau_out_Nm"], 1e-6)


def test_what_was_not_recorded_cannot_be_given():
    drive = ModelInput.of(recording(theta_in_rad=lambda t: 0.6 * np.sin(2 * np.pi * t)))
    with pytest.raises(ModelError, match="no angle"):
        simulate(drive, PARAMETERS, "angle")
    with pytest.raises(ModelError, match="far end of cable B was not recorded"):
        parts.cable(drive, PARAMETERS, "B", far="tension")
    with pytest.raises(ModelError, match="no angle or no law"):
        parts.load(drive, PARAMETERS)
