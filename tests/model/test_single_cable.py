"""A single cable: the general solver against the exact one, and what its absent cable B must not do."""

import numpy as np
import pytest

from ccmodel import mechanisms
from ccmodel.geometry import ConduitPath
from ccmodel.model import exact, general
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import AngleLoad, FixedLoad, SpringLoad, TorqueLoad
from ccmodel.model.transmission import Transmission

PATH = ConduitPath([0.4, 0.3, 0.5], [1.0, 0.0, 2.0])
CABLE = Transmission(PATH, 9300.0, 0.15, 0.006, 0.008, is_single_cable=True)
INITIAL = InitialTension.uniform(PATH, 7.0)
TIME = np.arange(1500) * 0.002
DRIVE = 0.5 * np.sin(2 * np.pi * TIME) + 0.1 * np.sin(9 * TIME)
OUTPUTS = ("T1_N", "T2_N", "theta_out_rad", "tau_in_Nm", "tau_out_Nm")


def by_general(load, active=(), elements=32, drive=DRIVE):
    return general.simulate(CABLE, load, TIME[: drive.size], drive, INITIAL, active, elements).complete()


@pytest.mark.parametrize("load", [SpringLoad(0.05), SpringLoad(0.5), FixedLoad()])
@pytest.mark.parametrize("amplitude", [1.0, 3.0])  # the larger one lets the cable go slack
def test_both_solvers_agree(load, amplitude):
    reference = exact.simulate_pair(CABLE, load, amplitude * DRIVE, INITIAL).complete()
    found = by_general(load, drive=amplitude * DRIVE)
    assert amplitude == 1.0 or (reference.T1_N == 0).any() or isinstance(load, SpringLoad)
    for name in OUTPUTS:
        a, b = getattr(found, name), getattr(reference, name)
        assert np.sqrt(np.mean((a - b) ** 2)) <= 1e-3 * max(np.ptp(b), 1e-12), name
    assert (found.T3_N == 0).all() and (found.T4_N == 0).all()


def test_a_measured_tension_or_motion_gives_the_springs_response_back():
    spring = exact.simulate_pair(CABLE, SpringLoad(0.05), DRIVE, INITIAL)
    motion = AngleLoad(spring.theta_out_rad - spring.theta_out_rad[0])
    for load in (TorqueLoad(spring.tau_out_Nm), motion):
        found = by_general(load)
        for name in ("T1_N", "T2_N"):
            assert getattr(found, name) == pytest.approx(getattr(spring, name), abs=5e-3 * np.ptp(spring.T1_N))


@pytest.mark.parametrize(
    ("name", "place"), [(n, p) for n in mechanisms.names() for p in mechanisms.get(n).places if n != "cable-asymmetry"]
)
def test_every_effect_runs_on_a_single_cable(name, place):
    found = by_general(SpringLoad(0.05), [general.Active(name, place, mechanisms.get(name).start)])
    assert (found.T3_N == 0).all() and (found.T4_N == 0).all()
    assert np.isfinite(found.T1_N).all()


def test_an_unlike_cable_B_that_is_absent_changes_nothing():
    start = {"ratio": 1.3, "K_ratio": 0.7}
    plain, unlike = (by_general(SpringLoad(0.05), [general.Active("cable-asymmetry", "cable", v)]) for v in (
        {"ratio": 1.0, "K_ratio": 1.0}, start))  # fmt: skip
    assert pytest.approx(plain.T1_N, abs=1e-6) == unlike.T1_N


def test_a_load_that_turns_freely_lets_the_cable_go_slack():
    response = exact.simulate_pair(CABLE, SpringLoad(0.0), DRIVE, INITIAL).complete()
    assert np.abs([response.T1_N, response.T2_N]).max() < 1e-9
