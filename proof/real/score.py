"""The diagnoses of measured recordings, scored against the seeded faults.

The answers are made again from the plan's seed and the baseline. A result with another answer's digest, or whose
diagnosis tried to reach more than its batch, is refused and counts as none.
"""

import json
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

from proof.outcome import DECISION_THRESHOLD, refusal, same_place, verdict_of
from proof.real.cases import RealCase, cases_of, label, name_of, place_of
from proof.real.plan import RealPlan
from proof.real.run import BASELINE

# A size is recovered if its relative error is at most this.
SIZE_TOLERANCE = 0.25
IDENTIFIED = ("identified", "identified an equivalent")
INCLUDED = ("undecided, includes it", "undecided, includes an equivalent")


@dataclass(frozen=True)
class Truth:
    """The right diagnosis of a case.

    Attributes
    ----------
    mechanism : str or None
        "name at place"; None if no candidate has the same meaning, or if nothing is changed.
    place : str or None
        None if nothing is changed.
    equivalent : tuple of str
        Mechanisms that no recording distinguishes from it.
    parameter : str or None
        The mechanism's parameter that the size refers to.
    size : float
        Difference of that parameter from the baseline's value.
    baseline : float
        The baseline's value; 0 if it lacks the mechanism.
    """

    mechanism: str | None = None
    place: str | None = None
    equivalent: tuple[str, ...] = ()
    parameter: str | None = None
    size: float = 0.0
    baseline: float = 0.0


@dataclass(frozen=True)
class RealOutcome:
    """A case, its right diagnosis and the reported one; `failure` is why there is none.

    `sources` is the digest of the diagnosis's sources.
    """

    case: RealCase
    truth: Truth
    diagnosis: dict | None
    failure: str = ""
    changed: dict[str, float] = field(default_factory=dict)
    took_s: float = 0.0
    sources: str = ""

    @property
    def verdict(self) -> str:
        """The verdict; "none" if there is no diagnosis."""
        return verdict_of(self.diagnosis)

    @property
    def claims(self) -> list[dict]:
        """Identified mechanisms, the first one first, and then the alternatives."""
        return [*self.diagnosis["mechanisms"], *self.diagnosis["alternatives"]] if self.diagnosis else []

    @property
    def laws(self) -> list[dict]:
        """The laws that the diagnosis found, the first one first."""
        return self.diagnosis.get("laws", []) if self.diagnosis else []

    @property
    def is_located(self) -> bool:
        """Whether the reported place, or that of the law that was found, is the right one or equivalent to it."""
        places = [law["place"] for law in self.laws[:1]] or [self.diagnosis["place"]] if self.diagnosis else []
        return any(map(self.is_right_place, places))

    def is_right_place(self, place: str | None) -> bool:
        """Whether a place is that of the change or of a mechanism that no recording distinguishes from it."""
        right = [self.truth.place, *map(place_of, self.truth.equivalent)]
        return any(same_place(place, one) for one in right)

    @property
    def right_labels(self) -> tuple[str, ...]:
        """Mechanisms that are right to identify, the true one first; none if it is not a candidate."""
        truth = self.truth
        is_candidate = truth.mechanism and name_of(truth.mechanism) not in self.case.without
        return (truth.mechanism, *truth.equivalent) if is_candidate else ()

    @property
    def confidently_wrong(self) -> list[str]:
        """Wrong mechanisms, and laws at a wrong place, that are stated with confidence."""
        confident = [label(claim) for claim in self.claims if claim["confidence"] >= DECISION_THRESHOLD]
        laws = [law for law in self.laws if law["confidence"] >= DECISION_THRESHOLD]
        return [
            *(mechanism for mechanism in confident if mechanism not in self.right_labels),
            *(f"law of {law['slot']} at {law['place']}" for law in laws if not self.is_right_place(law["place"])),
        ]


def truth_of(case: RealCase, plan: RealPlan, model: dict) -> Truth:
    """The right diagnosis of a case; `model` is the content of the baseline's model file."""
    values = {label(m): m["values"] for m in model["mechanisms"]}
    if case.removed:
        parameter, size = next(iter(values[case.removed].items()))
        return Truth(case.removed, place_of(case.removed), (), parameter, size)
    if case.fault is None:
        return Truth()
    fault = plan.faults[case.fault]
    place = place_of(fault.mechanism) if fault.mechanism else fault.place
    baseline = values.get(fault.mechanism, {}).get(fault.parameter, 0.0)
    return Truth(fault.mechanism, place, fault.equivalent, fault.parameter, case.size, baseline)


def read_real_outcomes(plan: RealPlan, folder: Path) -> list[RealOutcome]:
    """Outcomes of the cases that have a result, in the order of the cases."""
    model = json.loads((folder / "baseline" / BASELINE).read_text(encoding="utf-8"))
    files = [(case, folder / "cases" / case.name / "result.json") for case in cases_of(plan, model)]
    results = [(case, json.loads(file.read_text(encoding="utf-8"))) for case, file in files if file.exists()]
    return [outcome_of(case, truth_of(case, plan, model), result) for case, result in results]


def outcome_of(case: RealCase, truth: Truth, result: dict) -> RealOutcome:
    """Combine a result with the answer."""
    refused = refusal(result, case)
    diagnosis = None if refused else result["diagnosis"]
    failure = refused or result["failure"] or ""
    return RealOutcome(case, truth, diagnosis, failure, result["changed"], result["took_s"], result["sources"])


def classification(o: RealOutcome) -> str:
    """How a diagnosis compares with the truth, in a few words."""
    match o.verdict:
        case "none":
            return "no diagnosis"
        case "agrees":
            return "true negative" if o.truth.place is None else "false negative"
        case "inputs-inconsistent":
            return "inputs called inconsistent"
        case "learned":
            return "learned, right place" if o.is_located else "learned, other place"
        case "unexplained":
            return "unexplained, right place" if o.is_located else "unexplained, other place"
        case "explained":
            return _best_match(o, [label(o.claims[0])], "identified", "identified {}", "misidentified")
        case _:
            reported = [label(claim) for claim in o.claims]
            return _best_match(
                o, reported, "undecided, includes it", "undecided, includes {}", "undecided, excludes it"
            )


def _best_match(o: RealOutcome, reported: Collection[str], exact: str, near: str, other: str) -> str:
    """The class of the best of several reported mechanisms; `near` has a field for how it differs."""
    right = [mechanism for mechanism in o.right_labels if mechanism in reported]
    if right:
        return exact if right[0] == o.truth.mechanism else near.format("an equivalent")
    names = {name_of(mechanism) for mechanism in reported}
    is_elsewhere = o.right_labels and name_of(o.truth.mechanism) in names
    return near.format("at another place") if is_elsewhere else other


def is_right(o: RealOutcome) -> bool:
    """Whether a diagnosis is right, as the page explains."""
    found = classification(o)
    if o.truth.place is None:
        return found == "true negative"
    if not o.right_labels:
        is_open = o.verdict in ("unexplained", "undecided", "learned") and not o.confidently_wrong
        return is_open and (o.is_located or not o.case.without)
    if o.case.removed:
        return found == "identified" and bool(is_size_recovered(o))
    return found in (*IDENTIFIED, *INCLUDED)


def estimated_size(o: RealOutcome) -> float | None:
    """Estimate of the size from whichever right mechanism is reported with values; None if none is."""
    if not o.diagnosis or not o.truth.parameter:
        return None
    estimated = [*o.diagnosis["mechanisms"], *((o.diagnosis.get("nearest") or {}).get("mechanisms") or [])]
    for mechanism in o.right_labels:
        for m in estimated:
            if label(m) == mechanism:
                value = next(p["value"] for p in m["parameters"] if p["name"] == o.truth.parameter)
                # A gain at one end is equivalent to the inverse gain at the other.
                return 1 / (1 + value) - 1 if mechanism in o.truth.equivalent else value - o.truth.baseline
    return None


def is_size_recovered(o: RealOutcome) -> bool | None:
    """Whether the estimated size is within `SIZE_TOLERANCE` of the true one; None if there is no estimate."""
    size = estimated_size(o)
    return None if size is None else abs(size / o.truth.size - 1) <= SIZE_TOLERANCE
