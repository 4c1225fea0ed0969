"""A friction torque in a pulley's bearing.

Equation: A torque friction_torque (1 + share (pull / (2 T_ref) - 1)) sgn(omega) opposes the pulley's motion. The pull
is the sum of both cables' tensions at the pulley, and T_ref = 5 N. The share is 0 in a preloaded ball bearing, whose
torque is constant, and 1 in a plain bearing, whose torque is in proportion to the pull. After a reversal the torque
builds up over the angle presliding by Dahl's law: a few mrad in ball bearings, more where a seal or a wound cable
yields.

Signature: At the drive tau_in is off by a square wave in phase with the speed, and all other channels fit. At the
load (T2 - T4) R steps at each reversal, and the load's own torque does not.

Separated by: error against speed and load at two pretensions: the error of a gain grows with the torque, that of a
bearing has the sign of the speed and is constant or in proportion to the pull.

Source: Agrawal, Peine and Yao 2010, Section VI: friction effects at the two pulleys; with the law of Dahl, AIAA
Journal 14(12), 1675-1682, 1976, doi:10.2514/3.61511.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import BEARING_TORQUE, LOAD, Curve, Mechanism, Parameter, optional_share
from ccmodel.mechanisms.load_dependent_friction import REFERENCE_N
from ccmodel.mechanisms.presliding import dahl

# Angle over which a bearing's friction builds up unless a model states it.
PRESLIDING_RAD = 2e-3
# Pull of both cables at which `friction_torque` holds; fixed, so that it can be compared between rigs.
REFERENCE_PULL_N = 2 * REFERENCE_N


@kernel(inline="always", allocates=True)
def torque_under(pull_N: Any, friction_Nm: float, share: float) -> Any:
    """Friction torque (N m) of a bearing under the pull of both cables, a share of it in proportion to the pull."""
    return friction_Nm * (1.0 + share * (pull_N / REFERENCE_PULL_N - 1.0))


@kernel(allocates=True)
def bearing(theta: NDArray, presliding_rad: float) -> NDArray:
    """Friction over friction torque (-1 to 1) along angles (rad, shape (n,)) from an unloaded start."""
    share = np.zeros_like(theta)
    for j in range(1, theta.size):
        share[j] = dahl(share[j - 1], theta[j] - theta[j - 1], presliding_rad)[0]
    return share


def _by_speed(omega: NDArray, values: Mapping[str, float]) -> NDArray:
    """Torque by the pulley's velocity; a reversal takes it through zero within `reversal`."""
    return values["friction_torque"] * np.tanh(omega / values["reversal"])


def _since_reversal(travel: NDArray, values: Mapping[str, float]) -> NDArray:
    """Half of the torque's rise since a reversal, by the travel of the pulley's rim; of Dahl's law also from rest."""
    return -values["friction_torque"] * np.expm1(-travel / values["travel"])


_FRICTION = Parameter("friction_torque", "N m", 0.5e-3, 50e-3, 5e-3, "friction torque of the bearing")
# A reversal at 0.1 to 100 rad/s^2 through the angles of presliding; and these on rims of 3 to 100 mm.
_REVERSAL = Parameter("reversal", "rad/s", 0.01, 1.0, 0.1, "speed at which friction has built up after a reversal")
_TRAVEL = Parameter("travel", "m", 1.5e-6, 2e-3, 1e-4, "travel over which friction builds up")
_BY_MOTION = (
    ("speed", _by_speed, (_FRICTION, _REVERSAL)),
    ("distance-since-reversal", _since_reversal, (_FRICTION, _TRAVEL)),
)

MECHANISM = Mechanism(
    name="pulley-friction",
    text=__doc__,
    tex=(
        r"\tau_\mathrm{bearing} = \mathrm{friction\_torque} \left(1 + \mathrm{share} \left(\frac{T_A + T_B}{2 "
        r"T_\mathrm{ref}} - 1\right)\right) \xi, \qquad \frac{d\xi}{d\theta} = \frac{1 - "
        r"\xi\,\operatorname{sgn}(\omega)}{\mathrm{presliding}}"
    ),
    sentence=(
        "the {side} pulley's bearing has a friction torque of {friction_torque}[share: at a pull of 10 N, {share:%} of "
        "it in proportion to the pull]"
    ),
    places=("drive-pulley", "load-pulley"),
    parameters=(
        _FRICTION,
        Parameter(
            "presliding",
            "rad",
            0.5e-3,
            20e-3,
            PRESLIDING_RAD,
            "angle over which it builds up",
            neutral=PRESLIDING_RAD,
            screening_grid=(0.4,),
            default=PRESLIDING_RAD,
            above=0.0,
        ),
        optional_share("share", "share of the torque that is in proportion to the cables' pull"),
    ),
    mistaken_for=("torque-scale", "constant-drag"),
    depends_on_time=False,
    settings={
        "{side}_friction_Nm": "friction_torque",
        "{side}_presliding_rad": "presliding",
        "{side}_friction_by_pull": "share",
    },
    curves=tuple(Curve(slot, *by_motion) for slot in (BEARING_TORQUE, LOAD) for by_motion in _BY_MOTION),
)
