"""Tension decays at rest and over cycles.

Equation: Standard linear solid: the tension is T = T_e - r q with the elastic tension T_e and dq/dt = (T_e - q) /
tau. A recording starts at rest with the tension T and q = relaxed T / (1 - r): held, its cables would lose
r (1 - relaxed) of that tension. They are fresh at relaxed = 0 and settled at 1; a time t after the tensioning,
1 - relaxed = e / (1 - r (1 - e)) with e = exp(-t / tau). r is the share that a fresh cable loses in all. Between
samples T_e is taken as linear in time, for which q is exact.

Signature: Tension decays at rest and over cycles while the angles stay. The paper measured 10.5 % with 30 s on its
rig and neglected it.

Separated by: both ends and both cables at rest: they relax together, a load cell drifts alone.

Source: Agrawal, Peine and Yao 2010, Sections V and VI; with the standard linear solid of Lakes, Viscoelastic
Materials, Cambridge University Press, 2009.
"""

import numpy as np

from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Mechanism, Parameter


def relaxed_after(seconds: float, r: float, tau: float) -> float:
    """The state `relaxed` at a time after the cables were tensioned."""
    over = -np.expm1(-seconds / tau)
    return float((1 - r) * over / (1 - r * over))


def kept_at_rest(seconds: float, r: float, tau: float, relaxed: float) -> float:
    """Tension at a time into the rest that a recording starts with, over the tension at its first sample."""
    return float(1 - r * (1 - relaxed) * -np.expm1(-seconds / tau))


@kernel
def lag_weights(step_over_tau: float) -> tuple[float, float, float]:
    """Weights of q, of T_e before and of T_e after a step in q after it, for T_e linear in the step."""
    y = step_over_tau
    decay = np.exp(-y)
    if y < 1e-4:
        mean = 1.0 - y / 2 + y * y / 6
        return decay, y / 2 - y * y / 3, y / 2 - y * y / 6
    mean = (1.0 - decay) / y
    return decay, mean - decay, 1.0 - mean


MECHANISM = Mechanism(
    name="relaxation",
    text=__doc__,
    tex=r"T = T_e - r\,q, \qquad \frac{dq}{dt} = \frac{T_e - q}{\tau}, \qquad "
    r"q(0) = \frac{\mathrm{relaxed}}{1 - r}\,T(0)",
    sentence="the cables lose {r:%} of their tension as time passes",
    places=("cable",),
    parameters=(
        Parameter("r", "1", 0.01, 0.2, 0.05, "share of the tension that is lost", below=1.0),
        Parameter("tau", "s", 5.0, 100.0, 30.0, "time constant", neutral=30.0, above=0.0),
        Parameter(
            "relaxed",
            "1",
            0.0,
            1.0,
            0.5,
            "share of the loss r that is over when a recording starts",
            scale="linear",
            screening_grid=(0.0, 0.8),
            default=0.0,
            spread=0.3,
        ),
    ),
    mistaken_for=("load-cell-drift",),
    depends_on_time=True,
    states_after_tensioning=lambda seconds, values: {"relaxed": relaxed_after(seconds, values["r"], values["tau"])},
    settings={"relaxing_share": "r", "relaxing_time_s": "tau", "relaxed_share": "relaxed"},
)
