"""How the values of a law that no list holds stand in the equations of its slot, and what they are a priori."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

# A spring is never without stretch: its least compliance over its mean.
LEAST_COMPLIANCE = 0.05
# A pulley winds cable at every angle: its least radius over the mean one.
LEAST_RADIUS = 0.05
# Shares of a law's standard deviation below which a direction of its coefficients is left out.
SLIGHTEST = 0.02
# Standard deviation of a straight line at its end, over that of the curve about it.
SLOPE = 3.0


@dataclass(frozen=True)
class Form:
    """How a law's values act.

    Attributes
    ----------
    meaning : str
        What the values are, with the symbol of the channel that they are added to and the side of their place.
    unit : str or None
        Of the values; None for that of the channel that they are added to.
    neutral : float
        What the values are added to: 1 of a factor, else 0.
    least : float or None
        The smallest value that is physically possible, if there is one.
    is_centred : bool
        Whether the average of the values belongs to the calibration.
    has_slope : bool
        Whether the values rise with the argument a priori, from nothing.
    name : str
        Tells it from the usual form of its slot; empty for that one.
    shortest_yield : float or None
        The values are of Maxwell-slip elements, each of which yields after the travel that is its knot; the shortest
        travel over the longest. None of a law without memory.
    in_proportion : bool
        Whether the values are the argument times one number, which is never negative.
    rises : bool
        Whether the values never fall with the argument.
    """

    meaning: str
    unit: str | None = None
    neutral: float = 0.0
    least: float | None = None
    is_centred: bool = True
    has_slope: bool = False
    name: str = ""
    shortest_yield: float | None = None
    in_proportion: bool = False
    rises: bool = False

    @property
    def is_factor(self) -> bool:
        """Whether the values are added to a factor."""
        return self.neutral != 0.0

    @property
    def has_elements(self) -> bool:
        """Whether the values are of elements that yield."""
        return self.shortest_yield is not None

    @property
    def has_impossible_opposites(self) -> bool:
        """Whether next to no effect a curve or its opposite is impossible, or parts of both are."""
        is_at_least = self.least is not None and self.least >= self.neutral
        return self.in_proportion or self.rises or self.has_elements or is_at_least

    def possible(self, y: NDArray) -> NDArray:
        """Values that are physically possible.

        Elements take work and give none, and shares of friction add up to no more than all of it.
        """
        if self.has_elements:
            y = y.clip(0.0)
            return y / max(float(y.sum()), 1.0) if self.is_factor else y
        if self.rises:
            y = isotonic_regression(y).x
        return y if self.least is None else y.clip(self.least)

    def acting(self, y: NDArray) -> NDArray:
        """Values of which a curve is made: of elements only possible ones act."""
        return self.possible(y) if self.has_elements else y

    def possible_curve(self, curve: NDArray) -> NDArray:
        """A curve, or an end of its band, within what is physically possible."""
        if self.has_elements:
            return curve.clip(-1.0, 1.0) if self.is_factor else curve.clip(0.0)
        return self.possible(curve)


FRICTION_FACTOR = Form("factor of the friction coefficient", "1", neutral=1.0, least=0.0)
STRETCH_FACTOR = Form("factor of the cables' compliance", "1", neutral=1.0, least=LEAST_COMPLIANCE)
# The calibration takes the mean radius as stated.
RADIUS_FACTOR = Form("factor of the {side} pulley's radius", "1", neutral=1.0, least=LEAST_RADIUS, is_centred=False)
END_COMPLIANCE = Form("compliance of the cables' fastening at the {side}, in m/N", "m/N", least=0.0, is_centred=False)
DRAG = Form("drag of a cable per length of conduit, in N/m", "N/m", is_centred=False, has_slope=True, name="drag")
# Drag that no speed changes, as that of a seal at one place.
CONSTANT_DRAG = Form("drag of a cable per length of conduit, in N/m", "N/m", least=0.0, is_centred=False, name="drag")
# Friction that does not grow with the bend of the loop, as at a kink.
ADDED_BEND = Form("bend added to the conduits, over their length, in rad", "rad", is_centred=False, name="bend")
# A side's readings are never early.
DELAY = Form("delay of the {side}'s channels, in s", "s", least=0.0, is_centred=False, name="delay")
# Shares of friction that build up; after a reversal friction acts in the former direction at first.
CONTACT_ELEMENTS = Form(
    "friction over that of sliding, after a reversal", "1", neutral=1.0, is_centred=False, shortest_yield=0.002
)
ADDED = Form("added to {symbol}, in {unit}")
# The drive's angle is an input of the model, not a reading that it predicts.
ADDED_TO_INPUT = Form("added to {symbol}, which drives the model, in {unit}")
# A mass: an inertia is one number.
IN_PROPORTION = replace(ADDED, in_proportion=True)
# A load without mass on which less acts as it moves faster has no balance but a jump.
RISING = replace(ADDED, rises=True)
# The zero of a load cell scatters between recordings by its accuracy; beyond that it belongs to no calibration.
ADDED_TO_SUM = Form("added to {symbol}, in {unit}", is_centred=False)
# A torque whose elements yield one after the other. A ball bearing's yield within a few hundredths of a millimetre.
AGAINST_MOTION = Form(
    "added to {symbol}, against the motion: half of its rise since a reversal, in {unit}",
    is_centred=False,
    shortest_yield=0.002,
)
# The bearing of the load's pulley is between the cables and the torque sensor.
IN_BEARING = Form("torque of the {side} pulley's bearing on the cables, in N m", "N m", rises=True)
ELEMENTS_IN_BEARING = replace(
    AGAINST_MOTION,
    meaning="torque of the {side} pulley's bearing, against its motion: half of its rise since a reversal, in N m",
    unit="N m",
)


@cache
def basis(knots: int, length: float, is_centred: bool, has_slope: bool = False) -> NDArray:
    """Root of the a priori covariance of a law's values at its knots, shape (knots, coefficients).

    `has_slope` adds a straight line from zero, as a drag by speed has. Their mean variance is 1. Directions whose
    standard deviation is below `SLIGHTEST` are left out.
    """
    x = np.linspace(0.0, 1.0, knots)
    covariance = np.exp(-0.5 * ((x[:, None] - x) / length) ** 2) + has_slope * SLOPE**2 * np.outer(x, x)
    centred = np.eye(knots) - (1.0 / knots if is_centred else 0.0)
    value, vector = np.linalg.eigh(centred @ covariance @ centred)
    value, vector = value[::-1].clip(0.0), vector[:, ::-1]
    root = (vector * np.sqrt(value))[:, value > SLIGHTEST**2 * value.sum()]
    # Eigenvectors have no sign of their own: that of their last entry is made positive.
    root = root * np.where(root[-1] < 0, -1.0, 1.0)
    return root / np.sqrt((root**2).sum() / knots)
