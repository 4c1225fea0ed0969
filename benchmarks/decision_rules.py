"""Four ways to decide a diagnosis, on the same concealed rigs: the present one, a former one, and two simpler ones.

    python -m benchmarks.decision_rules --first 28000 --count 300 --cores 2 --former FOLDER --out results/decision-rules

``--former`` is a checkout of the project with the former decision; its diagnosis runs isolated, as in the proof. The
simpler ones decide from the same fits as the present one:

- *lowest error*: the single mechanism with the lowest leave-one-out mean square, or none if the calibrated model's is
  lower;
- *without a discrepancy*: posterior probabilities of exact candidates alone, so that nothing is unlisted.

A case that has a file in ``--out`` is not run again. The summary counts what is there.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

import ccmodel
from benchmarks.clock import NEVER_S
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.comparison import Comparison, log_bayes_factor_of_repeats, log_priors
from ccmodel.inference.pool import set_threads
from proof.build import record
from proof.calibration import calibration_error, doubtful, spiegelhalter
from proof.cases import draw
from proof.intervals import count, text_of
from proof.judge import judge
from proof.outcome import Outcome, outcome
from proof.score import is_left_open_or_learned

PRESENT, FORMER = "present", "former"


def lowest_error(comparison: Comparison) -> dict:
    """Name the single mechanism with the lowest leave-one-out mean square."""
    singles = [c for c in comparison.candidates if c.hypothesis.size == 1]
    best = min([comparison.base, *singles], key=lambda c: c.mean_square)
    return said("agrees" if best is comparison.base else "explained", best, 1.0)


def without_discrepancy(comparison: Comparison) -> dict:
    """Decide from the posterior probabilities of exact candidates, with the same priors."""
    every = [comparison.base, *(c for c in comparison.candidates if c.is_plausible)]
    screened = max(comparison.screened, len(comparison.candidates))
    weights = np.array([_log_weight(comparison, c, screened) for c in every])
    probability = np.exp(weights - np.logaddexp.reduce(weights))
    best = every[int(np.argmax(probability))]
    if best is comparison.base:
        return said("agrees", best, 1.0)
    confidence = float(probability.max())
    return said("explained" if confidence >= settings.DECIDED else "undecided", best, confidence)


def _log_weight(comparison: Comparison, candidate: CandidateFit, screened: int) -> float:
    prior = log_priors(candidate.hypothesis.size, screened)[0]
    return comparison.evidence[candidate.hypothesis].exact + prior + log_bayes_factor_of_repeats(candidate)


def said(verdict: str, best: CandidateFit, confidence: float) -> dict:
    """A decision in the form of a diagnosis."""
    stated = min(confidence, settings.MOST_CONFIDENT)
    named = [{"name": n, "place": p, "confidence": stated, "parameters": []} for n, p in best.hypothesis.acting]
    place = named[0]["place"] if named else None
    listed = verdict == "undecided"
    return {
        "verdict": verdict,
        "place": place,
        "mechanisms": [] if listed else named,
        "alternatives": named if listed else [],
    }


SIMPLER: dict[str, Callable[[Comparison], dict]] = {
    "lowest error": lowest_error,
    "without a discrepancy": without_discrepancy,
}
RULES = (PRESENT, FORMER, *SIMPLER)


def run(seed: int, former: Path, out: Path) -> dict:
    """The former diagnosis of a case as the proof judges it, and the other decisions under ``decisions``."""
    file = out / f"{seed}.json"
    if file.exists():
        return json.loads(file.read_text(encoding="utf-8"))
    set_threads(1)
    case = draw(seed)
    with tempfile.TemporaryDirectory() as folder:
        batch = Path(folder) / case.name
        record(case, case.recordings, batch)
        found = ccmodel.diagnose(batch, without=list(case.without), time_limit_s=NEVER_S)
    report = found.report
    decisions = {
        PRESENT: {
            "verdict": report["verdict"],
            "place": (report.get("location") or {}).get("place"),
            "mechanisms": report.get("mechanisms") or [],
            "alternatives": report.get("alternatives") or [],
            "laws": report.get("laws") or [],
        }
    }
    diagnosed = found._outcome.found
    if diagnosed is not None:
        decisions |= {rule: decide(diagnosed.judgement.comparison) for rule, decide in SIMPLER.items()}
    sources = former / "src" / "ccmodel"
    result = judge(case, out / FORMER / case.name, sources, lambda text: None, with_follow_ups=False)
    result["decisions"] = decisions
    file.write_text(json.dumps(result), encoding="utf-8")
    return result


def outcomes(results: Sequence[dict], rule: str) -> list[Outcome]:
    """Cases as a rule decides them; recordings that contradict one another are so for every rule."""
    found = []
    for result in results:
        former, decisions = outcome(result), result["decisions"]
        diagnosis = former.diagnosis if rule == FORMER else decisions.get(rule, decisions[PRESENT])
        found.append(replace(former, diagnosis=diagnosis))
    return found


def summary(results: Sequence[dict]) -> pd.DataFrame:
    """Rates and calibration by rule."""
    return pd.DataFrame({rule: _rates(outcomes(results, rule)) for rule in RULES})


def _rates(every: Sequence[Outcome]) -> dict[str, str]:
    clean = [o for o in every if o.kind == "clean"]
    listed = [o for o in every if o.kind in ("single", "poor", "pair", "triple")]
    visible = [o for o in listed if o.is_visible]
    outsiders = [o for o in every if o.has_no_candidate]
    several = [o for o in visible if len(o.true_names) > 1]
    rows = {
        "clean: false positive": (clean, lambda o: o.is_detected),
        "listed, visible: noticed": (visible, lambda o: o.is_detected),
        "listed, visible, the mechanisms' laws: named first": (
            [o for o in visible if not o.has_another_law],
            lambda o: o.is_identified_first,
        ),
        "listed, visible, another law: named first": (
            [o for o in visible if o.has_another_law],
            lambda o: o.is_identified_first,
        ),
        "listed, visible: first of those named or listed": (visible, lambda o: o.is_first_of_all),
        "listed, not visible: named first": (
            [o for o in listed if not o.is_visible],
            lambda o: o.is_identified_first,
        ),
        "listed, not visible: first of those named or listed": (
            [o for o in listed if not o.is_visible],
            lambda o: o.is_first_of_all,
        ),
        "several, one visible: all named": (several, lambda o: o.are_all_identified),
        "unlisted: left open, or a law learned in its slot": (outsiders, is_left_open_or_learned),
        "confidently wrong": (every, lambda o: o.is_confidently_wrong),
    }
    found = {what: text_of(count(what, cases, is_so)) for what, (cases, is_so) in rows.items()}
    claiming = [o for o in every if o.claims]
    found["expected calibration error"] = f"{calibration_error(claiming):.3f}" if claiming else ""
    unsure = doubtful(every)
    found["Spiegelhalter's z, confidences 0.3 to 0.9"] = (
        f"{spiegelhalter(unsure):.2f} ({len(unsure)})" if unsure else ""
    )
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the cases of the command line, and print the summary of all that are in the folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, required=True, help="first seed")
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--cores", type=int, default=1, help="processes")
    parser.add_argument("--former", type=Path, required=True, help="checkout with the former decision")
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args(arguments)
    args.out.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(args.cores) as pool:
        seeds = range(args.first, args.first + args.count)
        for done in as_completed(pool.submit(run, seed, args.former, args.out) for seed in seeds):
            result = done.result()
            by_rule = {rule: d["verdict"] for rule, d in result["decisions"].items()}
            print(result["seed"], outcome(result).kind, by_rule, file=sys.stderr, flush=True)
    every = [json.loads(file.read_text(encoding="utf-8")) for file in sorted(args.out.glob("*.json"))]
    print(summary(every).to_csv(sep="|", index_label="rate"))


if __name__ == "__main__":
    main()
