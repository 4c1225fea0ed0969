"""The drive train: a motor that turns the drive pulley through a spring with a gap."""

import numpy as np
import pytest
from scipy.optimize import brentq

from ccmodel.mechanisms.drive_train import train_torque
from ccmodel.model.general.run import Motor
from ccmodel.model.load import SpringLoad
from general_runs import rms, run, sine

TRAIN = {"compliance": 0.2, "half_gap": 5e-3}
FRICTION = {"friction_torque": 0.02, "presliding": 1e-4}
COUNT = 2 * np.pi / 8192
SPRING = 0.2
MECHANISMS = [("pulley-friction", "drive-pulley", FRICTION), ("drive-train", "drive-pulley", TRAIN)]


def dead_zone(angle):
    return np.sign(angle) * max(abs(angle) - TRAIN["half_gap"], 0.0)


def gap_of(tau):
    return TRAIN["half_gap"] * np.sign(tau)


def driven_by(phi):
    """Angle and torque of a pulley on a spring, held by dry friction, behind the train; its motor's angle is `phi`."""
    theta, found = 0.0, []
    for angle in phi:
        excess = dead_zone(angle - theta) / TRAIN["compliance"] - SPRING * theta
        if abs(excess) > FRICTION["friction_torque"]:
            held = np.sign(excess) * FRICTION["friction_torque"]
            balance = lambda x: dead_zone(angle - x) / TRAIN["compliance"] - SPRING * x - held  # noqa: B023, E731
            theta = brentq(balance, -1.0, 1.0, xtol=1e-14)
        found.append((theta, dead_zone(angle - theta) / TRAIN["compliance"]))
    return np.array(found).T


@pytest.fixture(scope="module")
def motion():
    """A motor's angle, and what follows from it: the pulley's, that of its encoder and the torque of the train."""
    phi = sine(0.3, cycles=3)
    theta, tau = driven_by(phi)
    return phi, theta, COUNT * np.round(theta / COUNT), tau


def pulley(theta_in, mechanisms, motor=None):
    """The same pulley by the general solver: cables without friction and next to stiff, a spring at the load."""
    given = {} if motor is None else {"motor": motor}
    return run(theta_in, mechanisms, load=SpringLoad(SPRING), T=500.0, mu=0.0, k=1e7, elements=2, **given)


def test_the_torque_follows_the_motor_while_the_pulley_stands(motion):
    phi, theta, seen, tau = motion
    without = pulley(seen, MECHANISMS[:1])
    with_train = pulley(seen, MECHANISMS, Motor(phi, COUNT / 2))
    settled = np.arange(phi.size) > 500
    stands = settled & (np.abs(np.gradient(theta)) < 1e-9)
    assert 0.03 < stands.mean() < 0.3
    assert rms(with_train.tau_in_Nm[stands], tau[stands]) < rms(without.tau_in_Nm[stands], tau[stands]) / 8
    assert rms(with_train.tau_in_Nm[settled], tau[settled]) < 1e-3


def test_the_pulley_is_where_train_and_transmission_balance_within_what_its_encoder_leaves_open(motion):
    phi, _, seen, _ = motion
    within = COUNT / 2
    r = pulley(seen, MECHANISMS, Motor(phi, within))
    at = r.drive_angle_rad
    assert np.abs(at - seen).max() <= within + 1e-12
    free = np.abs(at - seen) < within - 1e-9
    assert free.mean() > 0.05
    # The angles have no common zero.
    torsion = phi - at
    torsion -= np.median(torsion[free] - TRAIN["compliance"] * r.tau_in_Nm[free] - gap_of(r.tau_in_Nm[free]))
    torque = np.array([train_torque(x, *TRAIN.values()) for x in torsion])
    assert np.allclose(r.tau_in_Nm[free], torque[free], atol=2e-6)
    low, high = at - seen <= -within + 1e-9, at - seen >= within - 1e-9
    assert (r.tau_in_Nm[low] >= torque[low] - 2e-6).all()
    assert (r.tau_in_Nm[high] <= torque[high] + 2e-6).all()


def test_the_zero_of_the_motor_does_not_matter(motion):
    phi, _, seen, _ = motion
    one, other = (pulley(seen, MECHANISMS, Motor(phi + zero, COUNT / 2)) for zero in (0.0, 7.5))
    assert np.allclose(one.tau_in_Nm, other.tau_in_Nm, atol=1e-9)


def test_without_a_motor_it_has_no_effect(motion):
    *_, seen, _ = motion
    assert np.array_equal(pulley(seen, MECHANISMS).tau_in_Nm, pulley(seen, MECHANISMS[:1]).tau_in_Nm)
