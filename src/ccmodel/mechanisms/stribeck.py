"""Friction is higher at rest than in motion.

Equation: The friction coefficient is mu (1 + a r) with the state r of the contact: r = 1 when a recording starts, and
dr/ds = (exp(-(v / vs)^delta) - r) / renewal over the sliding distance s, with v the sliding speed. A rest leaves r as
sliding made it. Steady sliding gives mu (1 + a exp(-(v / vs)^delta)): a Gaussian for delta = 2, the default, and an
exponential for delta = 1. By default, renewal is 20 um.

Signature: Friction peaks when the cables first slide, and the loss falls with speed.

Separated by: a speed sweep.

Source: Armstrong-Helouvry, Dupont and Canudas de Wit, A survey of models, analysis tools and compensation methods
for the control of machines with friction, Automatica 30(7), 1083-1138, 1994, doi:10.1016/0005-1098(94)90209-7;
renewal over a sliding distance: Dieterich, Modeling of rock friction 1, Journal of Geophysical Research 84(B5),
2161-2168, 1979, doi:10.1029/JB084iB05p02161.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.elementary import quick_exp, quick_log
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import SLIDING_FRICTION, Curve, Mechanism, Parameter

# Sliding distance over which a contact adapts to a new speed, where a model states none. At zero, friction that falls
# with speed has no unique step, with or without inertia: explicit dynamics chatters on ever shorter pieces of cable the
# finer its grid, and its mean is that of mu alone, whatever a and vs (docs/verification.md).
RENEWAL_M = 2e-5


@kernel(inline="always")
def renewed(rested: float, slide: float, dt: float, vs: float, delta: float, renewal: float) -> float:
    """State r of the contact (0 to 1) after sliding by `slide` (m) within `dt` (s)."""
    decay = quick_exp(-abs(slide) / renewal)
    ratio = abs(slide) / (dt * vs)
    if delta == 2.0:
        ratio *= ratio
    elif ratio > 0.0:
        ratio = quick_exp(delta * quick_log(ratio))
    return rested * decay + (1.0 - decay) * quick_exp(-ratio)


def _of_log_speed(log_speed: NDArray, values: Mapping[str, float]) -> NDArray:
    """Factor of mu in steady sliding, by the logarithm of the speed."""
    return 1 + values["a"] * np.exp(-((10**log_speed / values["vs"]) ** values["delta"]))


_STEADY = (
    Parameter("a", "1", 0.05, 0.6, 0.2, "relative excess of friction at rest"),
    Parameter("vs", "m/s", 1e-4, 1e-2, 2e-3, "Stribeck speed", neutral=1e-3, above=0.0),
    Parameter("delta", "1", 0.5, 2.5, 1.5, "exponent of the speed", neutral=2.0, screening_grid=(0.7,), default=2.0),
)

MECHANISM = Mechanism(
    name="stribeck",
    text=__doc__,
    tex=(
        r"\mu_\mathrm{eff} = \mu\,(1 + a\,r), \qquad \frac{dr}{ds} = \frac{e^{-(|v|/v_s)^\delta} - "
        r"r}{\mathrm{renewal}}"
    ),
    sentence="friction is {a:%} higher at rest than in motion",
    places=("conduit",),
    parameters=(
        *_STEADY,
        Parameter(
            "renewal",
            "m",
            2e-6,
            2e-4,
            RENEWAL_M,
            "sliding distance over which a contact adapts to a new speed",
            neutral=RENEWAL_M,
            screening_grid=(0.5,),
            default=RENEWAL_M,
            above=0.0,
        ),
    ),
    mistaken_for=("presliding", "viscous-friction"),
    depends_on_time=True,
    settings={
        "stribeck_rise": "a",
        "stribeck_speed": "vs",
        "stribeck_exponent": "delta",
        "stribeck_renewal_m": "renewal",
    },
    curves=(Curve(SLIDING_FRICTION, "speed", _of_log_speed, _STEADY),),
)
