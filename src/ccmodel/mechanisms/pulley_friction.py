"""Friction in a pulley's bearing.

Equation: a torque tau_b sgn(omega) against the pulley's motion, built up over a presliding angle with Dahl's law, as in
`ccmodel.mechanisms.presliding`: some mrad in ball bearings, more where a seal or a wound cable gives way.

Signature: at the drive tau_in is off by a square wave in step with the speed, and all else is right. At the load
(T2 - T4) R shows a step at each reversal that the torque of the load itself does not show.

Mistaken for a torque sensor's gain and for constant drag. The load tells: a gain's error grows with the torque, a
bearing's has the sign of the speed and one size.
"""

import numpy as np

from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import PRESLIDING_RAD, Mechanism, Parameter, side
from ccmodel.mechanisms.presliding import dahl


@kernel
def bearing(theta, presliding_rad):
    """Friction over friction torque (-1 to 1) along a course of angles (rad, shape (n,)) that starts unloaded."""
    share = np.zeros_like(theta)
    for j in range(1, theta.size):
        share[j] = dahl(share[j - 1], theta[j] - theta[j - 1], presliding_rad)[0]
    return share


def _modifies_physics(settings, place, values):
    if side(place) == "drive":
        settings.drive_friction_Nm, settings.drive_presliding_rad = values["friction_torque"], values["presliding"]
    else:
        settings.load_friction_Nm, settings.load_presliding_rad = values["friction_torque"], values["presliding"]


MECHANISM = Mechanism(
    name="pulley-friction",
    places=("drive-pulley", "load-pulley"),
    parameters=(
        Parameter("friction_torque", "N m", 0.5e-3, 50e-3, 5e-3),
        Parameter(
            "presliding",
            "rad",
            0.5e-3,
            20e-3,
            PRESLIDING_RAD,
            neutral=PRESLIDING_RAD,
            screening_grid=(0.4,),
            default=PRESLIDING_RAD,
        ),
    ),
    summary="a friction torque in a pulley's bearing",
    mistaken_for="torque-scale, constant-drag",
    separated_by="parity of the error against speed and load",
    modifies_physics=_modifies_physics,
)
