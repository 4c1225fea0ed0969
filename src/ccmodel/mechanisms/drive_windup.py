"""Torsional compliance and backlash of the drive train.

Equation: The drive train connects the motor at angle phi with the pulley at theta. It has a torsional compliance
and a lost_motion: while the pulley moves, phi = theta + compliance tau + lost_motion sgn(dtheta/dt) / 2. At a
reversal the pulley's own friction holds it and theta does not determine the torque. The motor passes its reversal
smoothly, so phi is taken as the cubic through its values before and after, and the torque follows from it. The law
changes the torque only where the pulley stands still at its reversals. With coarse encoder counts every pulley
seems to stand still there, so a diagnosis considers this mechanism only as a forced candidate.

Signature: At a reversal the torque falls before the pulley moves, the earlier the slower the motion.

Separated by: the motor's own encoder, or reversals at two speeds.

Source: Nordin and Gutman, Controlling mechanical systems with backlash - a survey, Automatica 38(10), 1633-1649,
2002, doi:10.1016/S0005-1098(02)00047-X.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import TAU_IN, THETA_IN
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter, Sensing

# Around a reversal a stationary pulley creeps and its encoder dithers.
STANDSTILL_RAD = 2e-3
# Where the pulley's motion gives the motor's, in durations of the standstill from its middle.
SUPPORT = np.array([-0.8, -0.7, -0.6, -0.5, 0.5, 0.6, 0.7, 0.8])
# Times the motor's angles at `SUPPORT`: coefficients of the cubic of least squares through them.
CUBIC = np.linalg.pinv(np.vander(SUPPORT, 4))


@kernel
def torque_of_train(time_s: NDArray, theta: NDArray, tau: NDArray, compliance: float, lost_motion: float) -> NDArray:
    """Torque at the motor (N m) while the pulley is stationary at a reversal; elsewhere `tau`.

    Parameters
    ----------
    time_s, theta, tau : ndarray, shape (n,)
        s; angle of the pulley, rad; torque without compliance of the drive train, N m.
    compliance, lost_motion : float
        rad/(N m); rad.

    Returns
    -------
    ndarray, shape (n,)
    """
    torque = tau.copy()
    standstill = min(STANDSTILL_RAD, lost_motion + compliance * (tau.max() - tau.min()))
    if compliance <= 0.0 or standstill <= 0.0:
        return torque
    # A reversal is the last extreme from which the pulley has gone back by more than it creeps.
    extreme, direction = 0, 0.0
    for i in range(1, theta.size):
        back = theta[extreme] - theta[i]
        if direction == 0.0:
            if abs(back) > 2 * standstill:
                direction, extreme = -np.sign(back), i
        elif direction * back <= 0.0:
            extreme = i
        elif direction * back > 2 * standstill:
            _fill_reversal(time_s, theta, tau, compliance, lost_motion, standstill, direction, extreme, torque)
            direction, extreme = -direction, i
    return torque


@kernel
def _fill_reversal(
    time_s: NDArray,
    theta: NDArray,
    tau: NDArray,
    compliance: float,
    lost_motion: float,
    standstill: float,
    direction: float,
    extreme: int,
    torque: NDArray,
) -> None:
    """Fill in one reversal, at sample `extreme`, which the pulley approached in `direction` (1 or -1)."""
    first, last = extreme, extreme
    while first > 0 and abs(theta[first] - theta[extreme]) <= standstill:
        first -= 1
    while last < theta.size - 1 and abs(theta[last] - theta[extreme]) <= standstill:
        last += 1
    middle, duration = (time_s[first] + time_s[last]) / 2, time_s[last] - time_s[first]
    support_s = middle + SUPPORT * duration
    if direction * (tau[first] - tau[last]) <= 0.0 or support_s[0] < time_s[0] or support_s[-1] > time_s[-1]:
        return  # No torque to unwind, or the motor's motion is not known on both sides.
    angle, load = np.interp(support_s, time_s, theta), np.interp(support_s, time_s, tau)
    a3, a2, a1, a0 = CUBIC @ (angle + compliance * load - direction * np.sign(SUPPORT) * lost_motion / 2)
    # The unwound torque does not rise again: the train's spring only releases.
    highest, lowest = direction * tau[first], direction * tau[last]
    for i in range(first + 1, last):
        x = (time_s[i] - middle) / duration
        phi = a0 + x * (a1 + x * (a2 + x * a3))
        highest = min(highest, (direction * (phi - theta[extreme]) + lost_motion / 2) / compliance)
        torque[i] = direction * max(lowest, highest)


def _modifies_observation(sensing: Sensing, place: str, values: Mapping[str, float]) -> dict[str, NDArray]:
    given = sensing.time_s, sensing.channels[THETA_IN], sensing.channels[TAU_IN]
    time_s, theta, tau = map(np.ascontiguousarray, given)
    torque = torque_of_train(time_s, theta, tau, values["compliance"], values["lost_motion"])
    return {TAU_IN: torque}


MECHANISM = Mechanism(
    name="drive-windup",
    text=__doc__,
    tex=(
        r"\varphi_\mathrm{motor} = \theta + \mathrm{compliance}\cdot\tau + "
        r"\frac{\mathrm{lost\_motion}}{2}\,\operatorname{sgn}(\dot\theta)"
    ),
    sentence="the drive train has a backlash of {lost_motion} and winds up by {compliance}",
    places=("drive-pulley",),
    parameters=(
        Parameter("compliance", "rad/(N m)", 0.02, 2.0, 0.25, "torsional compliance of the train"),
        Parameter("lost_motion", "rad", 2e-3, 0.2, 0.05, "backlash of the train"),
    ),
    mistaken_for=("pulley-friction",),
    depends_on_time=False,
    by_name_only=True,
    modifies_observation=_modifies_observation,
)
