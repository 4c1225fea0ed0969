"""What diagnoses of measured recordings say of what was put into them.

The answers are made again from the plan's seed and the model in use; a result whose key does not match, or whose
diagnosis tried to reach more than its batch, is refused and counts as none.
"""

import json
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

from proof.real.cases import RealCase, acting_of, cases_of, name_of, place_of
from proof.real.plan import RealPlan
from proof.real.run import MODEL
from proof.score import SURE, refusal, same_place

# A size is found if it is off by no more than this share.
FOUND = 0.25


@dataclass(frozen=True)
class Truth:
    """What a diagnosis could say that is right.

    Attributes
    ----------
    called : str or None
        "name at place"; None where nothing on any list means the same, or nothing is missing.
    place : str or None
        Where it is; None where nothing is missing.
    same : tuple of str
        What no recording tells from it.
    parameter : str or None
        Number of the mechanism that tells the size.
    size : float
        By how much that number differs from the model's.
    before : float
        What the model has that number at; 0 where it lacks the mechanism.
    """

    called: str | None = None
    place: str | None = None
    same: tuple[str, ...] = ()
    parameter: str | None = None
    size: float = 0.0
    before: float = 0.0


@dataclass(frozen=True)
class RealOutcome:
    """A case beside what was said of it."""

    case: RealCase
    truth: Truth
    said: dict | None
    why: str = ""
    changed: dict[str, float] = field(default_factory=dict)
    took_s: float = 0.0

    @property
    def verdict(self) -> str:
        """What was said; "none" where nothing was."""
        return self.said["verdict"] if self.said else "none"

    @property
    def claims(self) -> list[dict]:
        """What is named, the first first, and then what else it might be."""
        return [*self.said["mechanisms"], *self.said["alternatives"]] if self.said else []

    @property
    def in_place(self) -> bool:
        """Whether the place that is said is the right one, or so close that no recording tells them apart."""
        return bool(self.said) and same_place(self.said["place"], self.truth.place)

    @property
    def right_names(self) -> tuple[str, ...]:
        """What is right to name, itself first."""
        truth = self.truth
        return (truth.called, *truth.same) if truth.called and name_of(truth.called) not in self.case.without else ()

    @property
    def wrong_names(self) -> list[str]:
        """What is named confidently, and wrongly."""
        sure = [acting_of(claim) for claim in self.claims if claim["confidence"] >= SURE]
        return [acting for acting in sure if acting not in self.right_names]


def truth_of(case: RealCase, plan: RealPlan, model: dict) -> Truth:
    """What is right to say of a case."""
    values = {acting_of(m): m["values"] for m in model["mechanisms"]}
    if case.left_out:
        parameter, size = next(iter(values[case.left_out].items()))
        return Truth(case.left_out, place_of(case.left_out), (), parameter, size)
    if case.kind is None:
        return Truth()
    stated = plan.put_in[case.kind]
    place = place_of(stated.called) if stated.called else stated.place
    before = values.get(stated.called, {}).get(stated.parameter, 0.0)
    return Truth(stated.called, place, stated.same, stated.parameter, case.size, before)


def read_real_outcomes(plan: RealPlan, folder: Path) -> list[RealOutcome]:
    """Outcomes of the cases that have a result, in their order."""
    model = json.loads((folder / "model" / MODEL).read_text(encoding="utf-8"))
    files = [(case, folder / "cases" / case.name / "result.json") for case in cases_of(plan, model)]
    results = [(case, json.loads(file.read_text(encoding="utf-8"))) for case, file in files if file.exists()]
    return [outcome_of(case, truth_of(case, plan, model), result) for case, result in results]


def outcome_of(case: RealCase, truth: Truth, result: dict) -> RealOutcome:
    """Put a result beside the answer."""
    why = refusal(result, case)
    said = None if why else result["said"]
    return RealOutcome(case, truth, said, why or result["why"] or "", result["changed"], result["took_s"])


def made_of(o: RealOutcome) -> str:
    """What a diagnosis made of a case, in a few words."""
    if o.verdict == "none":
        return "no diagnosis"
    if o.verdict == "agrees":
        return "let be" if o.truth.place is None else "not noticed"
    if o.verdict == "unexplained":
        return "unexplained, in place" if o.in_place else "unexplained, elsewhere"
    if o.verdict == "explained":
        return _told(o, [acting_of(o.claims[0])], "named", "named as its equal", "named elsewhere", "another name")
    said = [acting_of(claim) for claim in o.claims]
    return _told(o, said, *(f"undecided {w}" for w in ("with it", "with its equal", "with it elsewhere", "without it")))


def _told(o: RealOutcome, said: Collection[str], itself: str, equal: str, elsewhere: str, other: str) -> str:
    """The word for the best of what was said."""
    right = [acting for acting in o.right_names if acting in said]
    if right:
        return itself if right[0] == o.truth.called else equal
    names = {name_of(acting) for acting in said}
    return elsewhere if o.right_names and name_of(o.truth.called) in names else other


def is_right(o: RealOutcome) -> bool:
    """Whether that is right."""
    made = made_of(o)
    if o.truth.place is None:
        return made == "let be"
    if not o.right_names:
        is_open = o.verdict in ("unexplained", "undecided") and not o.wrong_names
        return is_open and (o.in_place or not o.case.without)
    if o.case.left_out:
        return made == "named" and bool(is_size_found(o))
    return made in ("named", "named as its equal", "undecided with it", "undecided with its equal")


def found_size(o: RealOutcome) -> float | None:
    """The size that was found of what is right to find, wherever a diagnosis states it; None where it does not."""
    if not o.said or not o.truth.parameter:
        return None
    stated = [*o.said["mechanisms"], *((o.said.get("nearest") or {}).get("mechanisms") or [])]
    for acting in o.right_names:
        for m in stated:
            if acting_of(m) == acting:
                value = next(p["value"] for p in m["parameters"] if p["name"] == o.truth.parameter)
                # A gain that stands for its equal at the other end is that one's inverse.
                return 1 / (1 + value) - 1 if acting in o.truth.same else value - o.truth.before
    return None


def is_size_found(o: RealOutcome) -> bool | None:
    """Whether that is the size that it has; None where none was stated."""
    size = found_size(o)
    return None if size is None else abs(size / o.truth.size - 1) <= FOUND
