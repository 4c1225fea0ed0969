"""A pulley's radius changes with its angle.

Equation: The cables leave at the radius R (1 + e sin(theta + psi)). The cable travel is the integral of this radius
over the angle.

Signature: The error repeats with the angle, independent of speed and tension.

Separated by: strokes that start at other angles of the pulley.

Source: Litvin and Fuentes, Gear Geometry and Applied Theory, 2nd edition, Cambridge University Press, 2004.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.mechanisms.contract import BEARING_TORQUE, LOAD, PULLEY_RADIUS, Curve, Mechanism, Parameter


def _torque(theta: NDArray, values: Mapping[str, float]) -> NDArray:
    return values["torque"] * np.sin(theta + values["psi"])


def _radius(theta: NDArray, values: Mapping[str, float]) -> NDArray:
    return 1.0 + values["e"] * np.sin(theta + values["psi"])


_E = Parameter("e", "1", 0.01, 0.08, 0.03, "eccentricity over the radius", below=1.0)
# Two values of psi half a turn apart would not do: one that is off by a right angle has no gradient in e.
_PSI = Parameter(
    "psi",
    "rad",
    -np.pi,
    np.pi,
    0.0,
    "phase of the eccentricity",
    scale="linear",
    screening_grid=(0.125, 0.375, 0.625, 0.875),
)
# The torque is e times that of the cables.
_TORQUE = Parameter("torque", "N m", 1e-5, 0.1, 1e-3, "largest error of the torque")

MECHANISM = Mechanism(
    name="pulley-eccentricity",
    text=__doc__,
    tex=(
        r"R(\theta) = R\,\bigl(1 + e \sin(\theta + \psi)\bigr), \qquad w(\theta) = \int_0^\theta "
        r"R(\vartheta)\,d\vartheta"
    ),
    sentence="the {side} pulley's radius changes by ±{e:%} over a turn",
    places=("drive-pulley", "load-pulley"),
    parameters=(_E, _PSI),
    mistaken_for=("load-stiffening",),
    depends_on_time=False,
    settings={"{side}_eccentricity": "e", "{side}_eccentricity_rad": "psi"},
    curves=(
        *(Curve(PULLEY_RADIUS, f"{end}-angle", _radius, (_E, _PSI)) for end in ("drive", "load")),
        Curve(BEARING_TORQUE, "drive-angle", _torque, (_TORQUE, _PSI)),
        Curve(LOAD, "load-angle", _torque, (_TORQUE, _PSI)),
    ),
)
