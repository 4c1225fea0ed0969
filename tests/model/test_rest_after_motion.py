"""A recording that begins at rest after a motion: friction holds the tensions there by whatever law it has."""

from dataclasses import replace

import numpy as np
import pytest

from ccmodel.geometry import ConduitPath
from ccmodel.model.general import Active, simulate
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import simulate_recording
from ccmodel.model.transmission import Transmission
from ccmodel.recording import Recording

R, K, L, MU, SPRING = 0.006, 7750.0, 1.2, 0.156, 0.05
PATH = ConduitPath([L], [np.pi])
PAIR = Transmission(PATH, K * L, MU, R, R)
RATE_HZ, RESTS_S, CYCLE_S = 250, 0.4, 1.6
# A stroke and back, which leaves both cables at what friction holds, a rest, and a further stroke.
BEFORE = np.concatenate([np.linspace(0, 0.6, 100), np.linspace(0.6, -0.35, 160), np.linspace(-0.35, 0, 60)])
AFTER = 0.6 * np.sin(2 * np.pi * np.arange(int(CYCLE_S * RATE_HZ)) / RATE_HZ / CYCLE_S)
THETA = np.concatenate([BEFORE, np.zeros(int(RESTS_S * RATE_HZ)), AFTER])


def recorded_after(active, tension_N):
    """What perfect sensors read from the rest on."""
    even = InitialTension.uniform(PATH, tension_N)
    time_s = np.arange(THETA.size) / RATE_HZ
    found = simulate(PAIR, SpringLoad(SPRING), time_s, THETA, even, [active] if active else [])
    T1, T2, T3, T4 = (getattr(found, f"T{k}_N")[BEFORE.size :] for k in (1, 2, 3, 4))
    tau_in, tau_out = (torque[BEFORE.size :] for torque in (found.tau_in_Nm, found.tau_out_Nm))
    # As derived from torques and sums, with the stated radii.
    channels = {
        "theta_in_rad": THETA[BEFORE.size :],
        **{"tau_in_Nm": tau_in, "tau_out_Nm": tau_out, "F_drive_N": T1 + T3, "F_load_N": T2 + T4},
        **{"T1_N": (T1 + T3 + tau_in / R) / 2, "T3_N": (T1 + T3 - tau_in / R) / 2, "T2_N": T2, "T4_N": T4},
    }
    made = dict.fromkeys(channels, "made")
    return Recording("b", "r", "virtual-rig", time_s[: T1.size], channels, made, tension_N, PATH, rest_s=RESTS_S - 0.02)


def test_a_curvature_of_next_to_nothing_changes_next_to_nothing_beside_a_kink_off_the_middle():
    kink = Active("kink", "conduit", {"beta": 1.0, "s": 0.3})
    one = recorded_after(kink, 7.3)
    straight = Parameters(K, L, MU, R, R, SPRING, mechanisms=(kink,))
    curved = replace(straight, tension_curvature_A=1e-6, tension_curvature_B=-1e-6)
    found, other = (simulate_recording(one, parameters) for parameters in (straight, curved))
    for force in ("F_drive_N", "F_load_N"):
        assert np.abs(found[force] - other[force]).max() < 1e-4


@pytest.mark.parametrize(
    ("active", "tension_N", "most_N"),
    [
        (None, 7.3, 1e-3),
        (Active("kink", "conduit", {"beta": 1.0, "s": 0.5}), 7.3, 1e-3),
        (Active("cable-asymmetry", "cable", {"ratio": 1.4, "K_ratio": 1.0}), 7.3, 1e-3),
        (Active("running-in", "conduit", {"change": 0.3, "tau": 2.0, "done": 1.0}), 7.3, 1e-3),
        (Active("stribeck", "conduit", {"a": 0.3, "vs": 1e-2}), 7.3, 1e-2),
        (Active("pulley-eccentricity", "drive-pulley", {"e": 0.08, "psi": -np.pi / 2}), 7.3, 1e-3),
        (Active("constant-drag", "conduit", {"f0": 0.5}), 7.3, 1e-3),
        (Active("constant-drag", "conduit", {"f0": 2.0}), 12.0, 1e-3),
        # With one end of a cable without tension.
        (Active("constant-drag", "conduit", {"f0": 5.0}), 12.0, 0.01),
        # Between its ends the profile is that of friction in proportion to tension.
        (Active("load-dependent-friction", "conduit", {"n": -0.35}), 3.0, 0.06),
    ],
    ids=lambda one: getattr(one, "name", None),
)
def test_the_true_model_keeps_the_tensions_that_were_observed_at_rest(active, tension_N, most_N):
    one = recorded_after(active, tension_N)
    parameters = Parameters(K, L, MU, R, R, SPRING, mechanisms=(active,) if active else ())
    found = simulate_recording(one, parameters)
    rest = one.time_s < one.rest_s
    for tension in ("T1_N", "T2_N", "T3_N", "T4_N"):
        assert np.abs(found[tension] - one[tension])[rest].max() < most_N, tension
        assert np.sqrt(np.mean((found[tension] - one[tension])[~rest] ** 2)) < max(2 * most_N, 0.1), tension
