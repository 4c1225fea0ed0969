"""The score of learned laws against the tables in the answers: slot, argument, curve, and the nearest listed law."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from proof.intervals import bootstrap, count
from proof.outcome import DECISION_THRESHOLD, Outcome, is_law_of, is_located

# A confident law of a wrong slot counts as wrong if its model's error is above so many noise floors.
STILL_WRONG = 2.0
# Slots whose values are factors, and those in which an average belongs to nothing but the law.
FACTORS, NOT_CENTRED = ("sliding-friction", "cable-stretch"), ("end-stretch", "pulley-radius")
PREFIX = "unlisted-"


def score_of_laws(outcomes: Sequence[Outcome]) -> list[dict]:
    """Rates of the kinds of cases whose laws the list lacks; the targets are those that they were made for."""
    every = [o for o in outcomes if o.has_no_candidate]
    visible = [o for o in every if o.is_visible]
    with_slot = [o for o in visible if _truth(o).get("slot")]
    found = [o for o in with_slot if law_in_slot(o) is not None and _truth(o)["curve"]]
    removed = [o for o in visible if o.kind == "removed" and o.laws]
    compared = [o for o in visible if o.regressors]
    gaps = [gap for o in visible if (gap := o.gap_closed) is not None]
    shares = [share for o in found if (share := inside(o)) is not None]
    return [
        bootstrap("visible: gap to the floor closed, median", gaps, np.median, 0.8),
        count("visible: at least 60 % of the gap closed", gaps, lambda gap: gap >= 0.6, 0.9),
        count("visible: slot or place right", visible, is_slot_right, 0.85),
        count("visible: argument right or among those not told apart", with_slot, is_argument_right, 0.8),
        bootstrap("true curve inside the 90 % band, share of the points", shares, np.mean, 0.85),
        count("removed, a law learned: the mechanism is the nearest listed", removed, is_recognised, 0.8),
        count("visible: no reference regressor has less error", compared, _is_nearest, 0.9),
        count("no confident wrong law", every, lambda o: not is_confidently_wrong_law(o), 0.98),
    ]


def _truth(o: Outcome) -> dict:
    return o.key["truth"][0]


def law_in_slot(o: Outcome) -> dict | None:
    """The first law of the true slot at the true place; None if there is none, or no slot holds the effect."""
    return next((w for w in o.laws if _truth(o).get("slot") and is_law_of(w, _truth(o))), None)


def is_slot_right(o: Outcome) -> bool:
    """Whether a law of the true slot was learned; of an effect that no slot holds, or without laws, the place."""
    return law_in_slot(o) is not None if _truth(o).get("slot") and o.laws else is_located(o)


def is_argument_right(o: Outcome) -> bool:
    """Whether the law depends on the true quantity, or on one that the recordings do not tell from it."""
    law = law_in_slot(o)
    return law is not None and _truth(o)["argument"] in [*law["arguments"], *law["indistinguishable"]]


def _is_nearest(o: Outcome) -> bool:
    return o.error_after <= o.error_of_regressors


def is_recognised(o: Outcome) -> bool:
    """Whether the nearest listed law is that of the mechanism that was removed."""
    name = _truth(o)["name"].removeprefix(PREFIX)
    return any((law["nearest_listed"] or {}).get("name") == name for law in o.laws)


def is_confidently_wrong_law(o: Outcome) -> bool:
    """Whether a law of another slot is stated with confidence, and its model is still wrong."""
    sure = [law for law in o.laws if law["confidence"] >= DECISION_THRESHOLD]
    return bool(sure) and not is_slot_right(o) and not o.error_after <= STILL_WRONG


def inside(o: Outcome) -> float | None:
    """Share of a curve's points at which the true law is inside its band; None if its argument is not the true one."""
    law, truth = law_in_slot(o), _truth(o)
    if law is None or law["arguments"] != [truth["argument"]]:
        return None
    return share_inside(law["curve"], truth, o.key["rig"]["Ke"])


def share_inside(curve: Sequence[Sequence[float]], truth: Mapping, spring_Nm_per_rad: float) -> float | None:
    """Share of a curve's points within the range of the true law at which the true law is inside its band.

    The true law has what a calibration absorbs as the curve has it: a factor of a factor, an average of what is added,
    a slope of what is added by an angle, and the zero of the load's angle.
    """
    x, y, low, high = np.array(curve).T
    true_x, true_y = np.array(truth["curve"]).T
    if (truth["slot"], truth["argument"]) == ("load", "load-angle"):
        true_x, true_y = by_angle_from_its_zero(true_x, true_y, x, y, spring_Nm_per_rad)
    visited = (x >= true_x[0]) & (x <= true_x[-1])
    if not visited.any():
        return None
    true = absorbed(np.interp(x, true_x, true_y)[visited], x[visited], y[visited], truth)
    return float(np.mean((true >= low[visited]) & (true <= high[visited])))


def by_angle_from_its_zero(
    true_x: NDArray, true_y: NDArray, x: NDArray, y: NDArray, spring_Nm_per_rad: float
) -> tuple[NDArray, NDArray]:
    """A load's true law by its angle, from the zero at which its average is that of the curve `y` at `x`.

    The encoder has no zero of its own. From another zero, a spring's torque has a constant part, and no average of the
    law is learned: the model's load has its zero where it needs none. All arrays are of shape (n,).
    """

    def excess(shift: float) -> float:
        inside = (x + shift >= true_x[0]) & (x + shift <= true_x[-1])
        if not inside.any():
            return spring_Nm_per_rad * shift
        return float(np.mean(np.interp(x[inside] + shift, true_x, true_y) - y[inside]) + spring_Nm_per_rad * shift)

    reach = float(np.ptp(true_x)) / 2
    shift = brentq(excess, -reach, reach) if excess(-reach) * excess(reach) < 0 else 0.0
    return true_x - shift, true_y + spring_Nm_per_rad * shift


def absorbed(true: NDArray, x: NDArray, y: NDArray, truth: Mapping) -> NDArray:
    """True values with what a calibration absorbs as in the curve `y`; all of shape (n,)."""
    if truth["slot"] in NOT_CENTRED:
        return true
    if truth["slot"] in FACTORS:
        return true * y.mean() / true.mean()
    is_by_angle = truth["argument"].endswith("-angle") and x.size > 1
    return true + np.polyval(np.polyfit(x, y - true, 1 if is_by_angle else 0), x)
