"""What cannot be run is named, with advice: by a ModelError before the run, by a status of the response in it."""

from dataclasses import replace

import numpy as np
import pytest

from builders import recording
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model import exact, general
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, SpringLoad, TorqueLoad
from ccmodel.model.run import ModelInput, simulate
from ccmodel.model.transmission import Transmission
from model_runs import PULLED

PATH = ConduitPath([1.2], [np.pi])
PAIR = Transmission(PATH, 9300.0, 0.15, 0.006, 0.006)
INITIAL = InitialTension.uniform(PATH, 7.3)
SPRING = SpringLoad(0.05)
DRIVE = 0.3 * np.sin(np.linspace(0, 6, 50))


def by_exact(drive=DRIVE, load=SPRING, one=PAIR, initial=INITIAL):
    return exact.simulate_pair(one, load, drive, initial)


def by_general(drive=DRIVE, load=SPRING, one=PAIR, initial=INITIAL, **mechanisms):
    acting = [general.Active(name.replace("_", "-"), *entry) for name, entry in mechanisms.items()]
    return general.simulate(one, load, np.arange(len(drive)) * 0.01, drive, initial, acting)


def as_model(**changes):
    given = ModelInput.of(recording(theta_in_rad=lambda t: 0.3 * np.sin(t)))
    return simulate(given, replace(PULLED, **changes))


def with_gap(values, at=3, gap=np.nan):
    values = np.array(values, dtype=float)
    values[at] = gap
    return values


def effect(place="conduit", **values):
    return place, values


@pytest.mark.parametrize(
    ("attempt", "message"),
    [
        (lambda: ConduitPath([], []), "at least one of each"),
        (lambda: ConduitPath([0.0], [1.0]), "positive length; got 0.0 m: leave out"),
        (lambda: ConduitPath([1.0, 0.0], [1.0, 1.0]), "positive length"),
        (lambda: ConduitPath([np.nan], [1.0]), "must be finite"),
        (lambda: ConduitPath([1.0], [-1.0]), "positive in either direction"),
        (lambda: replace(PAIR, axial_rigidity_N=0.0), "axial_rigidity_N must be positive"),
        (lambda: replace(PAIR, axial_rigidity_N=np.inf), "axial_rigidity_N must be positive and finite"),
        (lambda: replace(PAIR, drive_radius_m=-0.01), "drive_radius_m must be positive"),
        (lambda: replace(PAIR, load_radius_m=np.nan), "load_radius_m must be positive"),
        (lambda: replace(PAIR, friction_coefficient=-0.1), "lower bound of 0"),
        (lambda: replace(PAIR, friction_coefficient=np.inf), "friction_coefficient must be finite"),
        (lambda: SpringLoad(-1.0), "finite and not negative"),
        (lambda: TorqueLoad([0.0, np.nan]), "torque_Nm is not finite at sample 1: leave"),
        (lambda: TorqueLoad([0.0], -1.0), "in parallel with a measured load is finite and not negative; got -1"),
        (lambda: AngleLoad([]), "at least one"),
        (lambda: InitialTension.uniform(PATH, -1.0), "positive along the whole cable"),
        (lambda: InitialTension.uniform(PATH, np.nan), "finite"),
        (lambda: by_exact(drive=np.zeros(0)), "at least one"),
        (lambda: by_general(drive=np.zeros(0)), "at least one"),
        (lambda: by_exact(drive=with_gap(DRIVE)), "theta_in_rad is not finite at sample 3: leave"),
        (lambda: by_general(drive=with_gap(DRIVE, gap=np.inf)), "theta_in is not finite at sample 3"),
        (lambda: by_general(load=TorqueLoad(np.zeros(1))), "1 samples, the drive angle 50"),
        (lambda: by_exact(one=replace(PAIR, friction_coefficient=200.0)), "check the unit of the bend angles"),
        (lambda: by_general(one=replace(PAIR, friction_coefficient=200.0)), "check the unit of the bend angles"),
        (
            lambda: by_general(relaxation=effect("cable", r=1.2, tau=5.0)),
            "r = 1.2 .share of the tension that is lost., which must be below 1",
        ),
        (
            lambda: by_general(relaxation=effect("cable", r=0.1, tau=0.0)),
            "tau = 0 .middle time constant., which must be above 0",
        ),
        (
            lambda: by_general(relaxation=effect("cable", r=0.1, tau=5.0, relaxed=1.2)),
            "relaxed = 1.2 .share of the loss .*; it is 0 to 1",
        ),
        (lambda: by_general(running_in=effect(change=-1.5, tau=5.0)), "change = -1.5 .*must be above -1"),
        (lambda: by_general(pulley_eccentricity=effect("load-pulley", e=1.5, psi=0.0)), "e = 1.5 .*must be below 1"),
        (lambda: by_general(cable_asymmetry=effect("cable", ratio=-1.0, K_ratio=1.0)), "must not be negative"),
        (lambda: by_general(cable_asymmetry=effect("cable", ratio=1.0, K_ratio=0.0)), "K_ratio = 0 .*must be above 0"),
        (lambda: by_general(stribeck=effect(a=0.2, vs=0.0)), "vs = 0 .Stribeck speed., which must be above 0"),
        (lambda: by_general(stribeck=effect(a=0.2, vs=1e-3, renewal=0.0)), "renewal = 0 .*must be above 0"),
        (lambda: by_general(presliding=effect(z0=np.nan)), "not finite"),
        (lambda: by_general(kink=effect(beta=1.0, s=1.5)), "share of the length"),
        (lambda: as_model(stiffness_N_per_m=-1.0), "axial_rigidity_N must be positive"),
        (lambda: as_model(friction_coefficient=np.nan), "friction_coefficient must be finite"),
        (lambda: as_model(pretension_N=-3.0), "positive along the whole cable"),
    ],
)
def test_what_cannot_be_run_is_refused_by_name(attempt, message):
    with pytest.raises(ModelError, match=message):
        attempt()


def test_a_measured_torque_is_not_for_the_exact_solver():
    with pytest.raises(TypeError, match="takes a SpringLoad or a FixedLoad; got TorqueLoad"):
        by_exact(load=TorqueLoad(np.zeros(50)))
