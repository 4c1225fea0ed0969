"""How often effects are detected and identified, by their size and by the error that they cause."""

from collections import Counter, defaultdict
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize

from proof.cases import CLEAN
from proof.intervals import count
from proof.outcome import VISIBLE, Outcome
from proof.plan import read_plan

# Edges of the bins of the recalibrated model's error, in noise floors.
ERROR_EDGES = (0.0, 1.2, 1.6, 2.5, VISIBLE, np.inf)
# Priors of the logistic curve: log slope, and standard deviation of the middle in log size.
USUAL_LOG_SLOPE = np.log(3)
MIDDLE_SPREAD = 3
LEAST_POINTS = 4


def confusion(outcomes: Iterable[Outcome]) -> dict[str, dict[str, int]]:
    """By true effect, of single effects and clean cases: counts of the identified mechanism, or of the verdict."""
    table: dict[str, Counter] = defaultdict(Counter)
    for o in outcomes:
        if len(o.key["truth"]) == 1:
            table[o.key["truth"][0]["name"]][o.first_identified or o.verdict] += 1
    return {name: dict(table[name]) for name in sorted(table, key=lambda name: (name != CLEAN, name))}


def detection(outcomes: Iterable[Outcome]) -> dict[str, dict]:
    """By effect: unit, range of sizes, every case of it alone, and the size at which half are detected."""
    plan = read_plan()
    drawn = {**plan.effects, **plan.unlisted}
    points = defaultdict(list)
    for o in outcomes:
        if o.kind in ("single", "unlisted"):
            (truth,) = o.key["truth"]
            points[truth["name"]].append(
                {
                    "strength": truth["strength"],
                    "size": abs(truth["size"]),
                    "error_before": None if np.isnan(o.error_before) else o.error_before,
                    "detected": o.is_detected,
                    "identified": o.is_identified_first,
                }
            )
    return {
        name: {"unit": drawn[name].unit, "drawn": drawn[name].size, "points": sorted(p, key=lambda q: q["size"])}
        | half_detected(p)
        for name, p in sorted(points.items())
    }


def detection_by_error(outcomes: Iterable[Outcome]) -> list[dict]:
    """Rates of detection and identification of all single effects, binned by the recalibrated model's error."""
    singles = [o for o in outcomes if o.kind == "single" and o.errors]
    found = []
    for low, high in pairwise(ERROR_EDGES):
        inside = [o for o in singles if low <= o.error_before < high]
        if inside:
            row = {"low": low, "high": high, "error_before": float(np.median([o.error_before for o in inside]))}
            row["detected"] = count("detected", inside, lambda o: o.is_detected)
            row["identified"] = count("identified first", inside, lambda o: o.is_identified_first)
            found.append(row)
    return found


def half_detected(points: list[dict]) -> dict:
    """Size at which half are detected, from a logistic curve over log size with weak priors on middle and slope.

    Both are None for fewer than `LEAST_POINTS` points, or if all or none are detected.
    """
    x = np.log([p["size"] for p in points])
    y = np.array([p["detected"] for p in points], float)
    if len(points) < LEAST_POINTS or y.min() == y.max():
        return {"half_size": None, "slope": None}

    def cost(parameters):
        middle, log_slope = parameters
        z = np.exp(log_slope) * (x - middle)
        prior = (log_slope - USUAL_LOG_SLOPE) ** 2 + ((middle - x.mean()) / MIDDLE_SPREAD) ** 2
        return np.sum(np.logaddexp(0, z) - y * z) + prior

    middle, log_slope = minimize(cost, [x.mean(), USUAL_LOG_SLOPE], method="Nelder-Mead").x
    return {"half_size": float(np.exp(middle)), "slope": float(np.exp(log_slope))}
