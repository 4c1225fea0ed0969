"""Friction coefficient that falls with the tension, as contact of an elastic liner does.

Equation: mu (T / T_ref)^n with n between 0 and -1/3 and a little beyond (a Hertzian contact has -1/3). T_ref only
says at which tension mu holds; it is fixed here, so that n can be compared between rigs.

Signature: ln(T1 / T2) in full slip, which Coulomb friction makes a number of the conduit's shape alone, changes with
the tension.

Mistaken for constant drag, which also weighs more at low tension. Three pretensions tell: drag leaves a loss where
the tension goes to zero, a power law does not.
"""

import numpy as np
from numba import njit

from ccmodel.mechanisms.contract import Mechanism, Parameter

REFERENCE_N = 5.0
# Below this tension friction no longer matters, and the power law would grow without bound.
FLOOR_N = 1e-2


@njit(cache=True, inline="always")
def power_of_tension(tension, n):
    """Factor of mu at a tension (N), and its derivative by the tension (1/N)."""
    if tension <= FLOOR_N:
        return np.exp(n * np.log(FLOOR_N / REFERENCE_N)), 0.0
    factor = np.exp(n * np.log(tension / REFERENCE_N))
    return factor, n * factor / tension


def _enters(settings, place, values):
    settings.tension_exponent = values["n"]


MECHANISM = Mechanism(
    name="load-dependent-friction",
    places=("conduit",),
    parameters=(Parameter("n", "1", -0.35, -0.05, -0.15, scale="linear"),),
    summary="friction coefficient falls with tension",
    mistaken_for="constant-drag",
    separated_by="three pretensions",
    enters=_enters,
)
