"""Friction coefficient that falls with the tension, as contact of an elastic liner does.

Equation: mu (T / T_ref)^n with n between 0 and -1/3 and a little beyond (a Hertzian contact has -1/3). T_ref only
says at which tension mu holds; it is fixed here, so that n can be compared between rigs.

Signature: ln(T1 / T2) in full slip, which Coulomb friction makes a number of the conduit's shape alone, changes with
the tension.

Mistaken for constant drag, which also weighs more at low tension. Three pretensions tell: drag leaves a loss where
the tension goes to zero, a power law does not.
"""

from ccmodel.elementary import quick_exp, quick_log
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter

REFERENCE_N = 5.0
# The power law would grow without bound where a cable goes slack; it levels off around this tension.
FLOOR_N = 0.1


@kernel(inline="always")
def power_of_tension(tension, n):
    """Factor of mu at a tension (N), and its derivative by the tension (1/N)."""
    square = tension * tension + FLOOR_N * FLOOR_N
    factor = quick_exp(0.5 * n * quick_log(square / (REFERENCE_N * REFERENCE_N)))
    return factor, n * factor * tension / square


def _modifies_physics(settings, place, values):
    settings.tension_exponent = values["n"]


MECHANISM = Mechanism(
    name="load-dependent-friction",
    places=("conduit",),
    parameters=(Parameter("n", "1", -0.35, -0.05, -0.15, scale="linear"),),
    summary="friction coefficient falls with tension",
    mistaken_for="constant-drag",
    separated_by="three pretensions",
    modifies_physics=_modifies_physics,
)
