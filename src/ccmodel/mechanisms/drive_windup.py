"""A drive train that winds up: a motor that turns back before the pulley does.

Equation: between the motor at angle phi and the pulley at theta there are a spring of compliance c and a lost motion g,
which friction in the train makes and which is crossed at whatever torque there is: while the pulley moves,
phi = theta + c tau + g sgn(theta') / 2. At a turn the pulley's own friction holds it, and no law of theta says the
torque. But the motor goes smoothly through its turn: phi is taken to be the cubic that goes on from what it did before
and after, and the torque to follow it through lost motion and spring.

Signature: at a turn the torque falls before the pulley moves, the earlier the slower the motion.

Mistaken for friction in the drive's pulley, in which the torque falls as soon as the pulley moves. The motor's own
encoder tells, or turns at two speeds.

It says nothing unless the pulley stands at its turns, and where counts are coarse every pulley seems to. It is
therefore asked for by name only.
"""

import numpy as np

from ccmodel.channels import TAU_IN, THETA_IN
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter

# About its turning point a pulley that stands creeps and its encoder dithers.
STANDS_WITHIN_RAD = 2e-3
# Where the motor is known from what the pulley does, in lengths of the stand from its middle.
KNOWN_AT = np.array([-0.8, -0.7, -0.6, -0.5, 0.5, 0.6, 0.7, 0.8])
# The cubic of least squares through these: its coefficients are this times what is known there.
CUBIC = np.linalg.pinv(np.vander(KNOWN_AT, 4))


@kernel
def wound(time_s, theta, tau, compliance, lost_motion):
    """Torque at the drive (N m) where its pulley stands at a turn; elsewhere `tau`.

    Parameters
    ----------
    time_s, theta, tau : ndarray, shape (n,)
        s; angle of the pulley, rad; what the torque would be without a drive train, N m.
    compliance, lost_motion : float
        rad/(N m); rad.

    Returns
    -------
    ndarray, shape (n,)
    """
    found = tau.copy()
    within = min(STANDS_WITHIN_RAD, lost_motion + compliance * (tau.max() - tau.min()))
    if compliance <= 0.0 or within <= 0.0:
        return found
    # A turn is a last extreme from which the pulley has gone back by more than it might creep.
    extreme, way = 0, 0.0
    for i in range(1, theta.size):
        back = theta[extreme] - theta[i]
        if way == 0.0:
            if abs(back) > 2 * within:
                way, extreme = -np.sign(back), i
        elif way * back <= 0.0:
            extreme = i
        elif way * back > 2 * within:
            _at_turn(time_s, theta, tau, compliance, lost_motion, within, way, extreme, found)
            way, extreme = -way, i
    return found


@kernel
def _at_turn(time_s, theta, tau, compliance, lost_motion, within, way, extreme, found):
    """Fill in one turn, at sample `extreme`, to which the pulley came in the direction `way`."""
    first, last = extreme, extreme
    while first > 0 and abs(theta[first] - theta[extreme]) <= within:
        first -= 1
    while last < theta.size - 1 and abs(theta[last] - theta[extreme]) <= within:
        last += 1
    middle, length = (time_s[first] + time_s[last]) / 2, time_s[last] - time_s[first]
    known_s = middle + KNOWN_AT * length
    if way * (tau[first] - tau[last]) <= 0.0 or known_s[0] < time_s[0] or known_s[-1] > time_s[-1]:
        return  # Nothing that would have to wind back, or the motor's course is not known on both sides.
    pulley, torque = np.interp(known_s, time_s, theta), np.interp(known_s, time_s, tau)
    a3, a2, a1, a0 = CUBIC @ (pulley + compliance * torque - way * np.sign(KNOWN_AT) * lost_motion / 2)
    # The motor may not pull the pulley on: once its spring has given way, it has.
    most, least = way * tau[first], way * tau[last]
    for i in range(first + 1, last):
        x = (time_s[i] - middle) / length
        phi = a0 + x * (a1 + x * (a2 + x * a3))
        most = min(most, (way * (phi - theta[extreme]) + lost_motion / 2) / compliance)
        found[i] = way * max(least, most)


def _modifies_observation(sensing, place, values):
    given = sensing.time_s, sensing.channels[THETA_IN], sensing.channels[TAU_IN]
    return {TAU_IN: wound(*map(np.ascontiguousarray, given), values["compliance"], values["lost_motion"])}


MECHANISM = Mechanism(
    name="drive-windup",
    places=("drive-pulley",),
    parameters=(
        Parameter("compliance", "rad/(N m)", 0.02, 2.0, 0.25),
        Parameter("lost_motion", "rad", 2e-3, 0.2, 0.05),
    ),
    summary="a drive train that winds up before the pulley turns back",
    mistaken_for="pulley-friction",
    separated_by="the motor's own encoder",
    by_name_only=True,
    modifies_observation=_modifies_observation,
)
