"""The score of many cases: rates, statistics, comparison with reference regressors, and every miss."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from proof.calibration import calibration_error, compared_values, doubtful, reliability, spiegelhalter
from proof.detection import confusion, detection, detection_by_error
from proof.follow_up import PROPOSED, RANDOM
from proof.intervals import bootstrap, count
from proof.laws import is_slot_right
from proof.outcome import INCONSISTENT, Outcome, after, is_located

INPUTS_ACCEPTED = "right inputs are not called inconsistent"
COVERAGE = 0.9
EXPERIMENT_DECIDES = 0.7
DECIDED = ("agrees", "explained", "learned")
COVERAGE_RATE = "coverage of the 90 % intervals"
SPIEGELHALTER = "Spiegelhalter's z of confidences from 0.3 to 0.9 (calibrated: within 2)"
CALIBRATION_ERROR = "expected calibration error of stated confidences"
RECALIBRATED, DIAGNOSED = "recalibrated model", "this diagnosis"


def rates(outcomes: Sequence[Outcome]) -> list[dict]:
    """Every rate. A target is a least rate, but for the coverage, which must include its target in the interval."""
    return [
        count("a verdict is returned", outcomes, lambda o: o.diagnosis is not None, 1.0),
        count(INPUTS_ACCEPTED, outcomes, lambda o: o.verdict != INCONSISTENT, 1.0),
        *_rates_of_listed(outcomes),
        count("no confident misidentification", outcomes, lambda o: not o.is_confidently_wrong, 0.98),
        *_rates_of_outsiders([o for o in outcomes if o.has_no_candidate]),
        *_rates_of_open_cases(outcomes),
        *_rates_of_experiments(outcomes),
        count(COVERAGE_RATE, compared_values(outcomes), lambda v: v["low"] <= v["true"] <= v["high"], COVERAGE),
    ]


def _rates_of_listed(outcomes: Sequence[Outcome]) -> list[dict]:
    """Rates of clean cases and of single effects among the candidates."""
    by_kind = _by_kind(outcomes)
    clean, singles = by_kind["clean"], by_kind["single"]
    rich = [o for o in singles if o.key["protocol"] == "rich"]
    visible, rich_visible = [o for o in singles if o.is_visible], [o for o in rich if o.is_visible]
    return [
        count("clean: true negative", clean, lambda o: o.verdict == "agrees", 0.98),
        count("single, visible: detected", visible, lambda o: o.is_detected, 0.95),
        count("single, visible: located", visible, is_located, 0.95),
        count("single, visible, rich protocol: identified first", rich_visible, lambda o: o.is_identified_first, 0.90),
        *(
            count(f"{law}: visible single, rich protocol: identified first", of_law, lambda o: o.is_identified_first, t)
            for law, of_law, t in (
                ("the mechanism's law", [o for o in rich_visible if not o.has_another_law], 0.90),
                ("another law", [o for o in rich_visible if o.has_another_law], 0.85),
            )
        ),
        count("single, any size, rich protocol: identified first", rich, lambda o: o.is_identified_first),
        count("single, any size: identified or among the alternatives", singles, lambda o: o.includes_truth),
    ]


def _rates_of_outsiders(outsiders: Sequence[Outcome]) -> list[dict]:
    """Rates of effects that are not among the candidates."""
    visible, detected = [o for o in outsiders if o.is_visible], [o for o in outsiders if o.is_detected]
    name = "no candidate: unexplained, undecided, or a law learned in the true slot"
    return [
        count(name, outsiders, is_left_open_or_learned, 0.85),
        count("no candidate: unexplained", outsiders, lambda o: o.verdict == "unexplained"),
        count("no candidate, visible: detected", visible, lambda o: o.is_detected),
        count("no candidate, detected: located", detected, is_located),
    ]


def _rates_of_open_cases(outcomes: Sequence[Outcome]) -> list[dict]:
    """Rates of pairs, of poor protocols and of undecided verdicts."""
    by_kind = _by_kind(outcomes)
    pairs, poor = by_kind["pair"], by_kind["poor"]
    return [
        count("pair: both identified", pairs, lambda o: o.are_all_identified, 0.75),
        count("pair: one identified", pairs, lambda o: bool(o.true_among(o.identified))),
        count("poor protocol: identified or among the alternatives", poor, lambda o: o.includes_truth),
        count(
            "undecided: a true effect among the alternatives",
            _undecided(outcomes),
            lambda o: bool(o.true_among(o.listed)),
        ),
    ]


def _rates_of_experiments(outcomes: Sequence[Outcome]) -> list[dict]:
    """How often a further experiment decides: the proposed one, and one drawn at random.

    Where none was proposed, nothing is decided.
    """
    found = []
    for verdict, target in (("undecided", EXPERIMENT_DECIDES), ("unexplained", None)):
        for which in (PROPOSED, RANDOM):
            later = [after(o, which) for o in outcomes if o.verdict == verdict]
            what = f"{verdict}: after the {which} experiment"
            wanted = target if which == PROPOSED else None
            found.append(count(f"{what}: decided", later, lambda o: o.verdict in DECIDED, wanted))
            found.append(count(f"{what}: decided rightly", later, _is_decided_rightly))
    return found


def _is_decided_rightly(o: Outcome) -> bool:
    """Whether exactly the concealed effects are identified; of an effect without a candidate, its slot."""
    match o.kind:
        case "clean":
            return o.verdict == "agrees"
        case "unlisted" | "removed":
            return o.verdict == "learned" and is_slot_right(o)
        case _:
            return o.are_all_identified and len(o.identified) == len(o.true_names)


def _by_kind(outcomes: Iterable[Outcome]) -> dict[str, list[Outcome]]:
    by_kind = defaultdict(list)
    for o in outcomes:
        by_kind[o.kind].append(o)
    return by_kind


def _undecided(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Undecided cases whose effects are all candidates: only these can be among the alternatives."""
    return [
        o
        for o in outcomes
        if o.verdict == "undecided" and o.true_names and not any(n.startswith("unlisted") for n in o.true_names)
    ]


def statistics(outcomes: Sequence[Outcome]) -> list[dict]:
    """Statistics that are no rates, with bootstrap intervals over cases."""
    by_kind = _by_kind(outcomes)
    effects = [o for o in outcomes if o.kind in ("single", "pair", "poor")]
    closed = [o.gap_closed for o in effects if o.gap_closed is not None]
    clean = [o.error_after for o in by_kind["clean"] if o.errors]
    diagnosed = [o.error_after for o in outcomes if o.kind in ("single", "pair") and o.errors]
    values = compared_values(outcomes)
    relative_errors = [abs(v["value"] - v["true"]) / abs(v["true"]) for v in values if v["true"]]
    alternatives = [len(o.alternatives) for o in outcomes if o.verdict == "undecided"]
    claiming = [o for o in outcomes if o.claims]
    return [
        bootstrap(CALIBRATION_ERROR, claiming, calibration_error, 0.05),
        bootstrap(SPIEGELHALTER, doubtful(outcomes), spiegelhalter),
        bootstrap("share of the gap to the noise floor closed, median", closed, np.median, 0.85),
        bootstrap("single and pair: error after over the noise floor, worst channel, median", diagnosed, np.median),
        bootstrap("clean: error after over the noise floor, worst channel, median", clean, np.median),
        bootstrap("parameter values: relative error, median", relative_errors, np.median),
        bootstrap("undecided: number of alternatives, mean", alternatives, np.mean),
        *_times(outcomes),
    ]


def _times(outcomes: Sequence[Outcome]) -> list[dict]:
    """Processor times of one core, s."""
    timed = [o for o in outcomes if np.isfinite(o.diagnosis_s)]
    clean, others = ([o.diagnosis_s for o in timed if (o.kind == "clean") == is_clean] for is_clean in (True, False))
    return [
        bootstrap("processor time of a diagnosis, clean, median (s)", clean, np.median),
        bootstrap("processor time of a diagnosis, not clean, median (s)", others, np.median),
        bootstrap("processor time of a diagnosis, not clean, largest (s)", others, np.max),
        bootstrap("processor time of a case with all runs, median (s)", [o.took_s for o in outcomes], np.median),
    ]


def method_comparison(outcomes: Iterable[Outcome]) -> list[dict]:
    """The recalibrated model, each reference regressor and the diagnosis on the cases that all were applied to.

    Errors are root mean square over the noise floor, in the worst channel. The gap is that of `Outcome.gap_closed`.
    """
    compared = [o for o in outcomes if o.regressors]
    if not compared:
        return []
    clean = [o for o in compared if o.kind == "clean"]
    visible = [o for o in compared if o.true_names and o.is_visible]
    return [
        {
            "method": method,
            "clean": bootstrap("clean", [o.over_floor(_error(o, method)) for o in clean], np.median),
            "visible": bootstrap("visible", [o.over_floor(_error(o, method)) for o in visible], np.median),
            "closed": bootstrap("closed", [_gap_closed(o, method) for o in visible], np.median),
            "better": count("less error than this diagnosis", visible, lambda o, m=method: _is_better(o, m)),
        }
        for method in (RECALIBRATED, *compared[0].regressors, DIAGNOSED)
    ]


def _error(o: Outcome, method: str) -> dict[str, float]:
    """By channel, a method's error on the held-out recordings."""
    which = {RECALIBRATED: "before", DIAGNOSED: "after"}.get(method)
    return {c: e[which] for c, e in o.errors.items()} if which else o.regressors[method]


def _is_better(o: Outcome, method: str) -> bool:
    return o.over_floor(_error(o, method)) < o.over_floor(_error(o, DIAGNOSED))


def _gap_closed(o: Outcome, method: str) -> float:
    return o.gap_closed_by(_error(o, method)[o.worst_channel])


def is_left_open_or_learned(o: Outcome) -> bool:
    """Whether nothing is said to be the cause of an effect without a candidate, or a law of its slot."""
    return o.verdict in ("unexplained", "undecided") or (o.verdict == "learned" and is_slot_right(o))


def misses(outcomes: Iterable[Outcome]) -> list[dict]:
    """Every case with a wrong diagnosis, and what it reported."""
    return [
        {
            "case": o.key["case"],
            "kind": o.kind,
            "recorded": o.key["recorded"],
            "truth": [f"{t['name']} at {t['place']}" for t in o.key["truth"] if t["place"]],
            "size": [f"{t['size']:.3g} {t['unit']}".removesuffix(" 1") for t in o.key["truth"] if t["place"]],
            "error_before": None if np.isnan(o.error_before) else round(float(o.error_before), 2),
            "verdict": o.verdict,
            "identified": [f"{m['name']} at {m['place']} ({m['confidence']:.2f})" for m in o.identified],
            "laws": [
                f"{w['slot']} at {w['place']} by {', '.join(w['arguments'])} ({w['confidence']:.2f})" for w in o.laws
            ],
            "alternatives": o.alternatives,
            "failure": o.failure,
        }
        for o in outcomes
        if not is_right(o)
    ]


def is_right(o: Outcome) -> bool:
    """Whether a diagnosis is right. If the effects are not visible, `agrees` is right too, but for several effects."""
    if o.diagnosis is None or o.is_confidently_wrong:
        return False
    is_tolerated = o.verdict == "agrees" and not o.is_visible
    match o.kind:
        case "clean":
            return o.verdict == "agrees"
        case "unlisted" | "removed":
            return is_left_open_or_learned(o) or is_tolerated
        case "pair" | "triple" | "many":
            return o.are_all_identified
        case "poor":
            return o.includes_truth or is_tolerated
        case _:
            return o.is_identified_first or is_tolerated or (o.verdict == "undecided" and not o.is_visible)


def score(outcomes: Sequence[Outcome]) -> dict:
    """The whole score, as it is written to JSON."""
    return {
        "cases": len(outcomes),
        "kinds": dict(Counter(o.kind for o in outcomes)),
        "rates": rates(outcomes),
        "statistics": statistics(outcomes),
        "methods": method_comparison(outcomes),
        "reliability": reliability(outcomes),
        "detection": detection(outcomes),
        "detection_by_error": detection_by_error(outcomes),
        "confusion": confusion(outcomes),
        "kept_back": [
            {"case": o.key["case"], "kind": o.kind, "before": o.error_before, "after": o.error_after}
            for o in outcomes
            if o.errors
        ],
        "values": compared_values(outcomes),
        "misses": misses(outcomes),
    }
