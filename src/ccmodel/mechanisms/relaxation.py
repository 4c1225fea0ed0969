"""Tension decays at rest and over cycles.

Equation: Generalised Maxwell chain: the tension is T = T_e - r q with the elastic tension T_e and the mean q of four
branches, dq_k/dt = (T_e - q_k) / tau_k. Their times tau_k are evenly spaced in the logarithm about tau; spread is the
longest over the shortest, and at 1 the chain is a standard linear solid. r is the share that a fresh cable loses in
all. A recording starts at rest, as if its cables had been held since their tensioning: a time t after it, q is
(1 - e) T_e with e the mean of exp(-t / tau_k). From there the cables still lose the share r (1 - relaxed) of their
tension at the start of the recording, with 1 - relaxed = e / (1 - r (1 - e)): relaxed is 0 in fresh cables and 1 in
settled ones. Between samples T_e is taken as linear in time, for which each q_k is exact.

Signature: Tension decays at rest and over cycles while the angles stay. The paper measured 10.5 % with 30 s on its
rig and neglected it.

Separated by: both ends and both cables at rest: they relax together, a load cell drifts alone.

Source: Agrawal, Peine and Yao 2010, Sections V and VI; with the chain and the standard linear solid of Lakes,
Viscoelastic Materials, Cambridge University Press, 2009.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import SLIDING_FRICTION, Curve, Mechanism, Parameter

# Branches of the chain.
BRANCHES = 4
# Cables of which less than this share has followed are fresh, and those of which less is left have settled.
FRESH = 1e-12


def branch_times(tau: float, spread: float) -> tuple[float, ...]:
    """Time constant of each branch (s), the shortest first."""
    return tuple(float(tau * spread ** (k / (BRANCHES - 1) - 0.5)) for k in range(BRANCHES))


def relaxed_after(seconds: float, r: float, tau: float, spread: float = 1.0) -> float:
    """The state `relaxed` at a time after the cables were tensioned."""
    over = float(np.mean(-np.expm1(-seconds / np.array(branch_times(tau, spread)))))
    return (1 - r) * over / (1 - r * over)


def followed(r: float, times: tuple[float, ...], relaxed: float) -> NDArray:
    """Share of the elastic tension that each branch has followed at a state `relaxed`, shape (branches,)."""
    wanted, tau = min(relaxed / (1 - r + r * relaxed), 1.0 - FRESH), np.array(times)
    if wanted < FRESH:
        return np.zeros(tau.size)

    def excess(seconds: float) -> float:
        return float(np.mean(-np.expm1(-seconds / tau))) - wanted

    # It takes a fifth of a second to import, and many commands run no model.
    from scipy.optimize import brentq

    # The slowest branch alone would be the last.
    latest = -float(tau.max()) * np.log1p(-wanted)
    seconds = brentq(excess, 0.0, latest, xtol=1e-12 * latest) if excess(latest) > 0 else latest
    return -np.expm1(-seconds / tau)


def kept_at_rest(seconds: float, r: float, times: tuple[float, ...], relaxed: float) -> float:
    """Tension at a time into the rest that a recording starts with, over the tension at its first sample."""
    if r == 0.0:
        return 1.0
    left = 1 - followed(r, times, relaxed)
    now, then = (1 - r * (1 - np.mean(left * decay)) for decay in (1.0, np.exp(-seconds / np.array(times))))
    return float(then / now)


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


def _friction_by_time(t: NDArray, values: Mapping[str, float]) -> NDArray:
    """Factor of friction, which falls with the tension, in cables that are fresh at first."""
    times = np.array(branch_times(values["tau"], values["spread"]))
    return 1 + values["r"] * np.expm1(-t[:, None] / times).mean(axis=1)


_CHAIN = (
    Parameter("r", "1", 0.01, 0.2, 0.05, "share of the tension that is lost", below=1.0),
    Parameter("tau", "s", 5.0, 100.0, 30.0, "middle time constant", neutral=30.0, above=0.0),
    Parameter(
        "spread",
        "1",
        1.0,
        100.0,
        4.0,
        "longest over shortest time constant",
        neutral=1.0,
        screening_grid=(0.3,),
        default=1.0,
        above=0.0,
    ),
)

MECHANISM = Mechanism(
    name="relaxation",
    text=__doc__,
    tex=r"T = T_e - \frac{r}{4} \sum_k q_k, \qquad \frac{dq_k}{dt} = \frac{T_e - q_k}{\tau_k}, \qquad "
    r"\tau_1 \ldots \tau_4 = \frac{\tau}{\sqrt{\mathrm{spread}}} \ldots \tau \sqrt{\mathrm{spread}}",
    sentence="the cables lose {r:%} of their tension as time passes",
    places=("cable",),
    parameters=(
        *_CHAIN,
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
    states_after_tensioning=lambda seconds, values: {
        "relaxed": relaxed_after(seconds, values["r"], values["tau"], values["spread"])
    },
    settings={
        "relaxing_share": "r",
        "relaxing_time_s": "tau",
        "relaxing_spread": "spread",
        "relaxed_share": "relaxed",
    },
    curves=(Curve(SLIDING_FRICTION, "time", _friction_by_time, _CHAIN),),
)
