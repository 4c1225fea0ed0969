"""Running-in: friction that changes as cable and liner wear into each other or warm up.

Equation: mu (1 + change (1 - exp(-t / tau - per_m w))), t the time from the start of the recording and w the way that
the drive has wound since: warming goes with the one, wear with the other.

Signature: loops drift through a recording while the sensors' zeros stay.

Mistaken for relaxation. A hold tells, since relaxation goes on at rest, and so does a return to the first condition.
"""

import numpy as np

from ccmodel.mechanisms.contract import Mechanism, Parameter


def _modifies_physics(settings, place, values):
    if not values["change"] > -1:
        raise ValueError(f"running in leaves some friction, so its change is above -1; got {values['change']}")
    if not values["tau"] > 0:
        raise ValueError(f"running in takes some time; got tau = {values['tau']} s")

    def course(time_s, way_m):
        return 1 + values["change"] * -np.expm1(-(time_s - time_s[0]) / values["tau"] - values["per_m"] * way_m)

    settings.friction_course = course


MECHANISM = Mechanism(
    name="running-in",
    places=("conduit",),
    parameters=(
        Parameter("change", "1", 0.05, 0.3, 0.1, signed=True),
        Parameter("tau", "s", 2.0, 1000.0, 10.0, neutral=10.0, screening_grid=(0.13, 0.31, 0.5)),
        Parameter("per_m", "1/m", 1.0, 200.0, 1.0, screening_grid=(0.0, 0.6), default=0.0),
    ),
    summary="friction coefficient changes through a recording",
    mistaken_for="relaxation",
    separated_by="holds, and a return to the start condition",
    modifies_physics=_modifies_physics,
)
