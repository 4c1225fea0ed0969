"""Values of the load that a linear regression shows, without a run of the model: the equation-error method.

Where the load's angle and torque are both measured, its own equation holds sample by sample,

    tau_out = K_e theta + B dtheta/dt + J d2theta/dt2,

whatever the cables do. A load with mass on nearly undamped cables rings, and a search for its inertia through the model
has many minima; the regression has none. Both sides go through the same filter, which leaves the equation as it is and
keeps the noise of the differences low (Young, Parameter estimation for continuous-time models: a survey, Automatica
17(1), 23-39, 1981, doi:10.1016/0005-1098(81)90082-0).

For an upper limit of the inertia the equation also has a cubic spring and dry friction, so that neither passes for the
lack of a mass.
"""

from collections.abc import Mapping, Sequence
from math import isclose, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ccmodel import mechanisms as registry
from ccmodel.channels import TAU_OUT, THETA_OUT
from ccmodel.diagnosis import settings
from ccmodel.model.parameters import mechanism_key
from ccmodel.recording import Recording

LOAD_SPRING, INERTIA = "load_stiffness_Nm_per_rad", ("load-inertia", "load")
# Terms of the equation without a cubic spring and dry friction; and which of them has the inertia.
LINEAR, INERTIA_TERM = 3, 2


def load_values(recordings: Sequence[Recording]) -> dict[str, float]:
    """Spring, inertia and damping ratio of the load, by the names of a fit's unknowns.

    Empty if a channel was not recorded, or if the regression shows no load with an inertia within its plausible range.
    """
    equations = _equations_of(recordings)
    if not equations:
        return {}
    terms, torque = (np.concatenate(rows) for rows in zip(*equations, strict=True))
    K_e, B, J = np.linalg.lstsq(terms[:, :LINEAR], torque, rcond=None)[0].tolist()
    bounds = {p.name: (p.low, p.high) for p in registry.get(INERTIA[0]).parameters}
    if K_e <= 0.0 or not bounds["J"][0] <= J <= settings.RANGE_SLACK * bounds["J"][1]:
        return {}
    zeta = float(np.clip(B / (2 * sqrt(J * K_e)), *bounds["zeta"]))
    return {LOAD_SPRING: K_e, mechanism_key(*INERTIA, "J"): J, mechanism_key(*INERTIA, "zeta"): zeta}


def largest_inertia(recordings: Sequence[Recording]) -> dict[str, float]:
    """Upper limit of the load's inertia, kg m^2, by its name as an unknown of a fit.

    It is the sum of the regression's value, if that is positive, `INERTIA_REACH` standard deviations, by the jackknife
    over recordings, and the smallest plausible inertia: an encoder's steps are an error that recordings of the same
    motion have in common. Empty if fewer than `INERTIA_RECORDINGS` recordings have both channels.
    """
    equations = _equations_of(recordings)
    n = len(equations)
    if n < settings.INERTIA_RECORDINGS:
        return {}
    unit = np.sqrt(sum((terms**2).sum(axis=0) for terms, _ in equations))
    unit[unit == 0.0] = 1.0
    each_normal = np.array(
        [terms.T @ np.column_stack([terms / unit, torque]) / unit[:, None] for terms, torque in equations]
    )

    def inertia(normal: NDArray) -> float:
        return float(np.linalg.lstsq(normal[:, :-1], normal[:, -1], rcond=None)[0][INERTIA_TERM] / unit[INERTIA_TERM])

    together = each_normal.sum(axis=0)
    sd = sqrt((n - 1) * float(np.var([inertia(together - one) for one in each_normal])))
    limit = max(inertia(together), 0.0) + settings.INERTIA_REACH * sd
    return {mechanism_key(*INERTIA, "J"): limit + registry.get(INERTIA[0]).parameter("J").low}


def other_start(start: Mapping[str, float], known: Mapping[str, float]) -> dict[str, float] | None:
    """A start of a fit with the known values of its unknowns; None if it has no inertia, or much the same one."""
    key = mechanism_key(*INERTIA, "J")
    if key not in start or key not in known or isclose(start[key], known[key], rel_tol=settings.ALIKE_INERTIA):
        return None
    return {name: known.get(name, value) for name, value in start.items()}


def _equations_of(recordings: Sequence[Recording]) -> list[tuple[NDArray, NDArray]]:
    return [e for r in recordings if THETA_OUT in r and TAU_OUT in r and (e := _equations(r)) is not None]


def _equations(recording: Recording) -> tuple[NDArray, NDArray] | None:
    """Terms of the load's equation, shape (samples, 5), and its torque, each about its mean; None of a short one.

    The terms are angle, rate, acceleration, cubed angle and direction.
    """
    time_s = recording.time_s
    window = max(3, round(settings.FILTER_S / float(np.median(np.diff(time_s)))) | 1)
    # The filter reaches over the ends.
    inside = slice(
        max(int(np.searchsorted(time_s, recording.rest_s)), settings.FILTER_PASSES * window),
        -settings.FILTER_PASSES * window,
    )
    angle, torque = (_filtered(recording[channel], window) for channel in (THETA_OUT, TAU_OUT))
    rate = np.gradient(angle, time_s)
    direction = np.tanh(rate / settings.SLIDING_RAD_PER_S)  # at rest the sign is that of noise
    beyond = [_filtered(values, window) for values in (recording[THETA_OUT] ** 3, direction)]
    terms = np.column_stack([angle, rate, np.gradient(rate, time_s), *beyond])[inside]
    if len(terms) <= settings.FILTER_PASSES * window:
        return None
    return terms - terms.mean(axis=0), torque[inside] - torque[inside].mean()


def _filtered(values: NDArray, window: int) -> NDArray:
    for _ in range(settings.FILTER_PASSES):
        values = uniform_filter1d(values, window)
    return values
