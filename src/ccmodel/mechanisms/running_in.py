"""Friction coefficient changes through a recording.

Equation: The friction coefficient is mu (1 + change (1 - (1 - done) exp(-t / tau - per_m w))), with t the time and w
the drive's cable travel since the start of the recording: warming goes with t, wear with w. done is the share of the
change that has happened when the recording starts, and mu the friction coefficient before any of it.

Signature: Loops drift through a recording while the sensors' zeros stay.

Separated by: holds, during which relaxation continues and running-in by wear does not; and a return to the first
condition.

Source: Blau, On the nature of running-in, Tribology International 38(11-12), 1007-1012, 2005,
doi:10.1016/j.triboint.2005.07.020.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.mechanisms.contract import SLIDING_FRICTION, Curve, Mechanism, Parameter, Settings


def _modifies_physics(settings: Settings, values: Mapping[str, float]) -> None:
    def history(time_s: NDArray, travel_m: NDArray) -> NDArray:
        aged = -(time_s - time_s[0]) / values["tau"] - values["per_m"] * travel_m
        return 1 + values["change"] * (values["done"] * np.exp(aged) - np.expm1(aged))

    settings.friction_history = history


def _of_time(t: NDArray, values: Mapping[str, float]) -> NDArray:
    return 1 - values["change"] * np.expm1(-t / values["tau"])


def _of_travel(w: NDArray, values: Mapping[str, float]) -> NDArray:
    return 1 - values["change"] * np.expm1(-values["per_m"] * w)


_CHANGE = Parameter("change", "1", 0.05, 0.3, 0.1, "final relative change of friction", signed=True, above=-1.0)
_TAU = Parameter(
    "tau", "s", 2.0, 1000.0, 10.0, "time constant", neutral=10.0, screening_grid=(0.13, 0.31, 0.5), above=0.0
)
_PER_M = Parameter("per_m", "1/m", 1.0, 200.0, 1.0, "rate per cable travel", screening_grid=(0.0, 0.6), default=0.0)

MECHANISM = Mechanism(
    name="running-in",
    text=__doc__,
    tex=r"\mu(t, w) = \mu\,\Bigl(1 + \mathrm{change}\,"
    r"\bigl(1 - (1 - \mathrm{done})\, e^{-t/\tau - \mathrm{per\_m}\,w}\bigr)\Bigr)",
    sentence="friction [rises|falls] by {change:%} in all as it runs in",
    places=("conduit",),
    parameters=(
        _CHANGE,
        _TAU,
        _PER_M,
        Parameter(
            "done",
            "1",
            0.0,
            1.0,
            0.5,
            "share of the change that is over when a recording starts",
            scale="linear",
            screening_grid=(0.0,),
            default=0.0,
            spread=0.3,
        ),
    ),
    mistaken_for=("relaxation",),
    depends_on_time=True,
    # Factor of mu at times (s) and cable travels (m), all of shape (samples,).
    structures={"friction_history": None},
    modifies_physics=_modifies_physics,
    curves=(
        Curve(SLIDING_FRICTION, "time", _of_time, (_CHANGE, _TAU)),
        Curve(SLIDING_FRICTION, "travel", _of_travel, (_CHANGE, _PER_M)),
    ),
)
