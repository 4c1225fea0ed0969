"""A pulley that is not round, or not centred.

Equation: the radius at which the cables leave is R (1 + e sin(theta + psi)); the way that they make is the integral
of this over the angle.

Signature: an error that repeats with the angle, whatever the speed and the tension.

Mistaken for a load that stiffens. The phase of the angle tells: start the stroke elsewhere on the pulley.
"""

import numpy as np

from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter, side


@kernel
def winding(theta, e, psi):
    """Way of the cable over R, the integral of the radius (rad); radius over R; and the derivative of the latter."""
    return theta - e * np.cos(theta + psi), 1.0 + e * np.sin(theta + psi), e * np.cos(theta + psi)


@kernel
def wound(theta, turn, e, psi):
    """Way over R that a turn from theta makes (rad), without cancellation in a small turn."""
    return turn + 2.0 * e * np.sin(theta + psi + 0.5 * turn) * np.sin(0.5 * turn)


def _modifies_physics(settings, place, values):
    if not abs(values["e"]) < 1:
        raise ValueError(f"a pulley turns about a point within it, so e is below 1; got {values['e']}")
    if side(place) == "drive":
        settings.drive_eccentricity = (values["e"], values["psi"])
    else:
        settings.load_eccentricity = (values["e"], values["psi"])


MECHANISM = Mechanism(
    name="pulley-eccentricity",
    places=("drive-pulley", "load-pulley"),
    parameters=(
        Parameter("e", "1", 0.01, 0.08, 0.03),
        # Two probes half a turn apart would not do: one that is off by a right angle shows nothing of the strength.
        Parameter("psi", "rad", -np.pi, np.pi, 0.0, scale="linear", screening_grid=(0.125, 0.375, 0.625, 0.875)),
    ),
    summary="a pulley's radius changes with its angle",
    mistaken_for="load-stiffening",
    separated_by="strokes that start at other angles",
    modifies_physics=_modifies_physics,
)
