"""Cable stiffness falls at low tension.

Equation: At strain u' the tension is T = EA (u' - u_s (1 - exp(-u' / u_s))) with u_s = T_scale / EA: the stiffness
is zero in a slack cable and reaches EA a few T_scale above it.

Signature: The transmission is soft near slack and stiff elsewhere.

Separated by: a sweep at low pretension: settling depends on the cable's own tension, backlash on the load's torque.

Source: Feyrer, Wire Ropes: Tension, Endurance, Reliability, 2nd edition, Springer, 2015, on the rope modulus.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.elementary import quick_exp
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import CABLE_STRETCH, Curve, Mechanism, Parameter


@kernel(inline="always")
def settling_tension(stretch: float, settled: float, stiffness: float) -> tuple[float, float]:
    """Tension (N) of a piece at a stretch (m) >= 0, and its stiffness (N/m); `settled` is u_s times its length (m)."""
    decay = quick_exp(-stretch / settled)
    return stiffness * (stretch - settled * (1.0 - decay)), stiffness * (1.0 - decay)


def stretch_at(tension: NDArray, settled: NDArray, stiffness: NDArray) -> NDArray:
    """Stretch (m) at which `settling_tension` gives `tension` (N), by Newton's method; arrays of one shape."""
    stretch = tension / stiffness + settled
    for _ in range(60):
        decay = np.exp(-stretch / settled)
        slope = np.maximum(stiffness * (1 - decay), 1e-9 * stiffness)
        stretch = np.maximum(stretch - (stiffness * (stretch - settled * (1 - decay)) - tension) / slope, 0.0)
    return stretch


def _of_tension(tension: NDArray, values: Mapping[str, float]) -> NDArray:
    """Compliance over that of a settled cable."""
    one = np.ones_like(tension)
    over_settled = stretch_at(np.maximum(tension / values["T_scale"], SLACK_SHARE), one, one)
    return -1 / np.expm1(-over_settled)


# Below this tension over `T_scale` the compliance would grow without bound.
SLACK_SHARE = 1e-3
_T_SCALE = Parameter("T_scale", "N", 0.5, 10.0, 2.0, "tension scale of the settling")

MECHANISM = Mechanism(
    name="strand-settling",
    text=__doc__,
    tex=r"T = EA\,\Bigl(u' - u_s\,\bigl(1 - e^{-u'/u_s}\bigr)\Bigr), \qquad u_s = \frac{T_\mathrm{scale}}{EA}",
    sentence="the cables soften where the tension is low, about {T_scale}",
    places=("cable",),
    parameters=(_T_SCALE,),
    mistaken_for=("backlash", "slack"),
    depends_on_time=False,
    settings={"settling_N": "T_scale"},
    curves=(Curve(CABLE_STRETCH, "tension", _of_tension, (_T_SCALE,)),),
)
