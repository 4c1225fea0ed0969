"""A load with mass.

Equation: J alpha besides the load's spring.

Signature: a torque that grows with the square of the frequency, against the angle.

Mistaken for a clock that is late. A sweep of frequencies tells: a delay's error grows with the first power.
"""

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _enters(settings, place, values):
    settings.inertia = values["J"]


MECHANISM = Mechanism(
    name="load-inertia",
    places=("load",),
    parameters=(Parameter("J", "kg m^2", 1e-5, 1e-3, 1e-4),),
    summary="the load's moment of inertia",
    mistaken_for="time-skew",
    separated_by="a sweep of frequencies",
    enters=_enters,
)
