"""One cable on the exact solver in terms of its two ends, shared by tests."""

from types import SimpleNamespace

import numpy as np

from ccmodel.model.exact import simulate_pair
from ccmodel.model.load import FixedLoad, SpringLoad
from ccmodel.model.transmission import Transmission

FIXED = np.inf


def simulate_cable(path, rigidity_N, mu, far_stiffness_N_per_m, displacement_m, initial, record_profiles_at=()):
    """Cable A alone; displacements in m, near end out of the conduit, far end into it, zero at the start."""
    cable = Transmission(path, rigidity_N, mu, 1.0, 1.0, is_single_cable=True)
    load = FixedLoad() if far_stiffness_N_per_m == FIXED else SpringLoad(far_stiffness_N_per_m)
    r = simulate_pair(cable, load, displacement_m, initial, record_profiles_at)
    assert (r.T3_N == 0).all() and (r.T4_N == 0).all()
    held = initial.tension_A_N[-1] / far_stiffness_N_per_m if far_stiffness_N_per_m else 0.0
    return SimpleNamespace(
        T_near_N=r.T1_N,
        T_far_N=r.T2_N,
        far_displacement_m=r.theta_out_rad - held,
        moving_m=r.moving_A_m,
        status=r.status,
        profiles={i: profiles[0] for i, profiles in r.profiles.items()},
    )
