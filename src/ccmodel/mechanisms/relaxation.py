"""Relaxation: a stretched cable (and its conduit) slowly gives up part of its tension.

Equation: standard linear solid. Of the elastic tension T_e a share r q is lost, T = T_e - r q, and q follows T_e
with the time constant tau, dq/dt = (T_e - q) / tau. The cable is fresh (q = 0) when a run starts, so its initial
tension decays as well. Between samples T_e is taken as linear in time, and q is then exact.

Signature: tension decays at rest and over cycles, while the angles stay. The paper measured 10.5 % in 30 s on its
rig and left it out.

Mistaken for a load cell that drifts. Both ends and both cables relax together; a cell drifts alone.
"""

import numpy as np

from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter


@kernel
def lag_weights(step_over_tau):
    """Weights (q, T_e before, T_e after) that make up q after a step, for T_e linear in the step."""
    y = step_over_tau
    keep = np.exp(-y)
    if y < 1e-4:
        mean = 1.0 - y / 2 + y * y / 6
        return keep, y / 2 - y * y / 3, y / 2 - y * y / 6
    mean = (1.0 - keep) / y
    return keep, mean - keep, 1.0 - mean


def _modifies_physics(settings, place, values):
    if not values["r"] < 1:
        raise ValueError(f"a cable relaxes by a share r of its tension below 1; got {values['r']}")
    if not values["tau"] > 0:
        raise ValueError(f"a cable relaxes with a time constant above zero; got tau = {values['tau']} s")
    settings.relaxing_share = values["r"]
    settings.relaxing_time_s = values["tau"]


MECHANISM = Mechanism(
    name="relaxation",
    places=("cable",),
    parameters=(Parameter("r", "1", 0.01, 0.2, 0.05), Parameter("tau", "s", 5.0, 100.0, 30.0, neutral=30.0)),
    summary="tension decays at rest and over cycles",
    mistaken_for="load-cell-drift",
    separated_by="both ends and both cables together, at rest",
    modifies_physics=_modifies_physics,
)
