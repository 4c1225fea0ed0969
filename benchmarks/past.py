"""Cables with a past and fresh ones: are relaxation and running-in named as often, where they are as visible?

``python -m benchmarks.past --seed S --count N --out DIR`` draws N rigs with relaxation and N with running-in. Each is
recorded twice: with the past that the proof draws for every recording (tensioned 0 to 4 time constants before, run in
for 0 to 2 of its scales), and fresh, with an effect as large as what the past leaves of it on average. Rates are of the
cases in which the effect shows: the calibrated model's leave-one-out mean square is at least `SHOWS`.
"""

import argparse
import json
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ccmodel.inference.pool import set_threads
from proof.calibration import compared_values
from proof.cases import Case, draw
from proof.intervals import rate, text_of
from proof.judge import judge
from proof.outcome import Outcome, is_located, outcome

# Waits over which what a past leaves is averaged.
WAITS = 400
EFFECTS, STATES = ("relaxation", "running-in"), ("past", "fresh")
# Mean square from which an effect shows in the recordings. Correct models have 1.01 with a standard deviation of 0.03.
SHOWS = 1.1
# Parameters whose intervals are compared with the truth: the total share, and the change of friction.
SIZES = {"relaxation": "r", "running-in": "change"}


def left_by_past(case: Case) -> float:
    """Share of a case's effect that the proof's pasts leave on average, each drawn evenly between two waits."""
    effects, spread = case.campaign.rig.effects, case.campaign.repeatability
    if case.truth[0].name == "relaxation":
        shares, times = (np.array([getattr(b, n) for b in effects.relaxation]) for n in ("share", "time_constant_s"))
        waits = evenly(*spread.tensioned_before_s)[:, None]
        return float((np.exp(-waits / times) @ shares).mean() / shares.sum())
    ages = evenly(*spread.ran_in_before)
    return float(np.mean(1 / (1 + ages) if effects.running_in.law == "hyperbolic" else np.exp(-ages)))


def evenly(first: float, last: float) -> NDArray:
    """Middles of `WAITS` equal parts of a range, shape (WAITS,)."""
    return first + (last - first) * (np.arange(WAITS) + 0.5) / WAITS


def without_past(case: Case) -> Case:
    """The same rig, tensioned and new as each recording begins, with what a past leaves of the effect."""
    (truth,) = case.truth
    left, effects = left_by_past(case), case.campaign.rig.effects
    if truth.name == "relaxation":
        branches = tuple(b.model_copy(update={"share": left * b.share}) for b in effects.relaxation)
        effects = effects.model_copy(update={"relaxation": branches})
    else:
        run_in = effects.running_in.model_copy(update={"change": left * effects.running_in.change})
        effects = effects.model_copy(update={"running_in": run_in})
    rig = case.campaign.rig.model_copy(update={"effects": effects})
    fresh = case.campaign.repeatability.model_copy(
        update={"tensioned_before_s": (0.0, 0.0), "ran_in_before": (0.0, 0.0)}
    )
    return replace(case, campaign=case.campaign.model_copy(update={"repeatability": fresh, "rig": rig}))


def judged(seed: int, effect: str, state: str, out: Path) -> dict:
    """Result of a case; read again if it exists."""
    set_threads(1)
    case = draw(seed, "single", effect)
    file = out / state / case.name / "past.json"
    if file.exists():
        return json.loads(file.read_text(encoding="utf-8"))
    recorded = without_past(case) if state == "fresh" else case
    result = judge(recorded, file.parent, report=lambda text: None, with_follow_ups=False)
    diagnosis = json.loads((file.parent / "diagnosis.json").read_text(encoding="utf-8"))
    row = {"seed": seed, "effect": effect, "law": case.truth[0].law, "state": state, "protocol": case.protocol}
    row |= {"mean_square": diagnosis["fit"]["mean_square"]["calibrated"]}
    row |= _said(outcome(result), left_by_past(case) if state == "fresh" else 1.0)
    file.write_text(json.dumps(row), encoding="utf-8")
    return row


def _said(found: Outcome, share: float) -> dict:
    """What a diagnosis says; the effect is as large as this share of the drawn one."""
    (truth,) = found.key["truth"]
    sizes = [v for v in compared_values([found]) if v["parameter"] == SIZES[truth["name"]]]
    return {
        "strength": truth["strength"],
        "verdict": found.verdict,
        "failure": found.failure,
        "first": found.first_identified,
        "confidence": [m["confidence"] for m in found.identified],
        "alternatives": found.alternatives,
        "right": found.is_identified_first,
        "listed": found.includes_truth,
        "located": bool(is_located(found)),
        "wrong": found.is_confidently_wrong,
        "before": found.error_before,
        "after": found.error_after,
        "interval": [sizes[0]["low"], share * sizes[0]["true"], sizes[0]["high"]] if sizes else None,
        "took_s": found.took_s,
    }


def rates(rows: Iterable[dict]) -> list[dict]:
    """Of each effect, with and without a past: named first, placed, and held by its interval."""
    found = []
    for effect, state in product(EFFECTS, STATES):
        group = [r for r in rows if (r["effect"], r["state"]) == (effect, state)]
        shows = [r for r in group if r["mean_square"] and r["mean_square"] >= SHOWS]
        held = [r["interval"] for r in group if r["interval"]]
        found += [
            rate(f"{effect}, {state}, shows: named first", sum(r["right"] for r in shows), len(shows)),
            rate(f"{effect}, {state}, shows: located", sum(r["located"] for r in shows), len(shows)),
            rate(f"{effect}, {state}, shows: among those named or listed", sum(r["listed"] for r in shows), len(shows)),
            rate(f"{effect}, {state}: size within its interval", sum(lo <= t <= hi for lo, t, hi in held), len(held)),
            rate(f"{effect}, {state}: confidently wrong", sum(r["wrong"] for r in group), len(group)),
        ]
    return found


def main() -> None:
    """Diagnose the cases and print a line for each, then the rates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    rows = []
    with ProcessPoolExecutor(asked.cores) as pool:
        cases = product(range(asked.seed, asked.seed + asked.count), EFFECTS, STATES)
        for done in as_completed(pool.submit(judged, *case, asked.out) for case in cases):
            rows.append(done.result())
            print(json.dumps(rows[-1]), flush=True)
    for one in rates(rows):
        print(text_of(one))


if __name__ == "__main__":
    main()
