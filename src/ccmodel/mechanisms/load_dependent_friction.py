"""Friction coefficient falls with tension.

Equation: The friction coefficient is mu (T / T_ref)^n with T_ref = 5 N and n between 0 and about -1/3, the exponent
of a Hertzian contact. Below about 0.1 N the factor levels off.

Signature: ln(T1 / T2) in full slip changes with tension. With Coulomb friction it depends on the bend alone.

Separated by: three pretensions: a drag leaves a loss at zero tension, a power law does not.

Source: Archard, Elastic deformation and the laws of friction, Proceedings of the Royal Society A 243, 190-205, 1957.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.elementary import quick_exp, quick_log
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import SLIDING_FRICTION, Curve, Mechanism, Parameter

# Tension at which mu holds; fixed, so that n can be compared between rigs.
REFERENCE_N = 5.0
# The power law would grow without bound where a cable goes slack; it levels off around this tension.
FLOOR_N = 0.1


@kernel(inline="always")
def power_of_tension(tension: float, n: float) -> tuple[float, float]:
    """Factor of mu at a tension (N), and its derivative by the tension (1/N)."""
    square = tension * tension + FLOOR_N * FLOOR_N
    factor = quick_exp(0.5 * n * quick_log(square / (REFERENCE_N * REFERENCE_N)))
    return factor, n * factor * tension / square


def _of_tension(tension: NDArray, values: Mapping[str, float]) -> NDArray:
    return (np.hypot(tension, FLOOR_N) / REFERENCE_N) ** values["n"]


_N = Parameter("n", "1", -0.35, -0.05, -0.15, "exponent of the tension", scale="linear")

MECHANISM = Mechanism(
    name="load-dependent-friction",
    text=__doc__,
    tex=r"\mu(T) = \mu \left(\frac{T}{T_\mathrm{ref}}\right)^{n}, \qquad T_\mathrm{ref} = 5\,\mathrm{N}",
    sentence="the friction coefficient changes with tension to the power {n}",
    places=("conduit",),
    parameters=(_N,),
    mistaken_for=("constant-drag",),
    depends_on_time=False,
    settings={"tension_exponent": "n"},
    curves=(Curve(SLIDING_FRICTION, "tension", _of_tension, (_N,)),),
)
