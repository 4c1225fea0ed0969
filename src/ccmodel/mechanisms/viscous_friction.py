"""Drag that rises with sliding speed.

Equation: Friction per length is mu T dphi/dx + c v (|v| / v_ref)^(power - 1), with v the sliding speed and v_ref =
10 mm/s. A Newtonian lubricant has the power 1; one that thins under shear, as a grease does, has less. Below 0.03 mm/s
the drag is in proportion to the speed whatever the power.

Signature: Loops widen with speed and not with tension; at low speed the effect vanishes.

Separated by: three speeds: with Stribeck friction loops narrow with speed.

Source: Olsson, Astrom, Canudas de Wit, Gafvert and Lischinsky, Friction models and friction compensation, European
Journal of Control 4(3), 176-195, 1998, doi:10.1016/S0947-3580(98)70113-X, which has the power too.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.elementary import quick_exp, quick_log
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import SLIDING_FRICTION, Curve, Mechanism, Parameter

REFERENCE_M_PER_S = 0.01
# Speed far below which a drag of any power is in proportion to the speed, so that it has a slope there.
FLOOR_M_PER_S = 3e-5


@kernel(inline="always")
def power_of_speed(speed: float, power: float) -> tuple[float, float]:
    """Factor of the drag c v at a speed (m/s), and that of its derivative by the speed."""
    square = speed * speed
    floored = square + FLOOR_M_PER_S * FLOOR_M_PER_S
    factor = quick_exp(0.5 * (power - 1.0) * quick_log(floored / (REFERENCE_M_PER_S * REFERENCE_M_PER_S)))
    return factor, factor * (1.0 + (power - 1.0) * square / floored)


def _thinned(speed: NDArray, power: float) -> NDArray:
    return speed * (np.hypot(speed, FLOOR_M_PER_S) / REFERENCE_M_PER_S) ** (power - 1)


def _rises(log_speed: NDArray, values: Mapping[str, float]) -> NDArray:
    return 1 + values["rise"] * _thinned(10**log_speed, values["power"])


def _drags(speed: NDArray, values: Mapping[str, float]) -> NDArray:
    return values["c"] * _thinned(speed, values["power"])


# What the drag adds to Coulomb friction depends on the tension; over the speed it is one constant of its own: at
# 10 mm/s from 0.3 % to as much as Coulomb friction.
_RISE = Parameter("rise", "s/m", 0.3, 100.0, 10.0, "relative rise of friction per sliding speed")
# From a negligible film to half of Coulomb friction: 15 mN to 3 N over a metre of conduit at 3 mm/s.
_DRAG = Parameter("c", "N s/m^2", 5.0, 1000.0, 50.0, "drag per sliding speed and length, at 10 mm/s")
_POWER = Parameter(
    "power",
    "1",
    0.2,
    1.0,
    1.0,
    "power of the sliding speed",
    neutral=1.0,
    scale="linear",
    screening_grid=(0.4, 1.0),
    default=1.0,
    above=0.0,
    optional=True,
)

MECHANISM = Mechanism(
    name="viscous-friction",
    text=__doc__,
    tex=r"\left|\frac{\partial T}{\partial x}\right| = \mu\,T\,\frac{d\varphi}{dx} + "
    r"c\,|v| \left(\frac{|v|}{v_\mathrm{ref}}\right)^{\mathrm{power} - 1}, \qquad "
    r"v_\mathrm{ref} = 10\,\mathrm{mm/s}",
    sentence="the conduits have a viscous drag of {c}[power: at 10 mm/s, with the power {power} of the speed]",
    places=("conduit",),
    parameters=(_DRAG, _POWER),
    mistaken_for=("stribeck", "time-skew"),
    depends_on_time=True,
    settings={"viscous": "c", "viscous_power": "power"},
    curves=(
        Curve(SLIDING_FRICTION, "speed", _rises, (_RISE, _POWER)),
        Curve(SLIDING_FRICTION, "speed", _drags, (_DRAG, _POWER), form="drag"),
    ),
)
