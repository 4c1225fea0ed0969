"""Whether stated confidences and intervals are calibrated: as often right as they state."""

from collections.abc import Iterable, Sequence

import numpy as np

from proof.intervals import rate
from proof.outcome import Outcome, same_place

BINS = 10
DOUBTFUL = (0.3, 0.9)


def reliability(outcomes: Iterable[Outcome]) -> list[dict]:
    """Stated confidences in ten bins: their number, their mean and the rate at which they were right."""
    claims = [c for o in outcomes for c in o.claims]
    bins = []
    for b in range(BINS):
        inside = [c for c in claims if min(int(c[0] * BINS), BINS - 1) == b]
        if inside:
            mean = float(np.mean([c[0] for c in inside]))
            bins.append({"stated": mean} | rate(f"{b / BINS:.1f}", sum(c[1] for c in inside), len(inside)))
    return bins


def calibration_error(outcomes: Iterable[Outcome]) -> float:
    """Expected calibration error: mean over all claims of |stated confidence - rate right| of their bin."""
    bins = reliability(outcomes)
    claims = sum(b["n"] for b in bins)
    return float(sum(b["n"] * abs(b["stated"] - b["rate"]) for b in bins) / claims)


def spiegelhalter(claims: Sequence[tuple[float, bool]]) -> float:
    """Spiegelhalter's z: standard normal if the claims are right as often as they state.

    D. J. Spiegelhalter, "Probabilistic prediction in patient management and clinical trials", Statistics in Medicine 5
    (1986) 421-433.
    """
    p, right = np.array(claims, dtype=float).T
    spread = np.sqrt(np.sum((1 - 2 * p) ** 2 * p * (1 - p)))
    return float(np.sum((right - p) * (1 - 2 * p)) / spread) if spread else 0.0


def doubtful(outcomes: Iterable[Outcome]) -> list[tuple[float, bool]]:
    """Claims with a confidence between 0.3 and 0.9, the number of `Outcome.claims`."""
    low, high = DOUBTFUL
    return [c for o in outcomes for c in o.claims if low <= c[0] <= high]


def compared_values(outcomes: Iterable[Outcome]) -> list[dict]:
    """Estimates and true values of correctly identified effects, for parameters defined alike in rig and mechanism."""
    found = []
    for o in outcomes:
        for m in o.identified:
            for truth in o.key["truth"]:
                if truth["name"] == m["name"] and same_place(m["place"], truth["place"]):
                    found += [
                        {
                            "case": o.key["case"],
                            "effect": m["name"],
                            "parameter": p["name"],
                            "true": truth["values"][p["name"]],
                        }
                        | {k: p[k] for k in ("value", "low", "high")}
                        for p in m["parameters"]
                        if p["name"] in truth["values"] and p.get("low") is not None
                    ]
    return found
