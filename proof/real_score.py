"""What diagnoses of measured recordings say of what was put into them.

The answers are made again from the plan's seed and the model in use; a result whose key does not match, or whose
diagnosis tried to reach more than its batch, is refused and counts as none.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from proof.real import MODEL, STANDING, RealCase, RealPlan, cases_of
from proof.score import same_place

# A recalibrated number has moved if it is off what the untouched recordings have it by more than this share.
MOVED = 0.05
# A value that the model in use took up is found if it is off by no more than this share.
FOUND = 0.25


@dataclass(frozen=True)
class Truth:
    """What a diagnosis could say that is right.

    Attributes
    ----------
    called : str or None
        "name at place"; None where nothing on the list means the same, or nothing is missing.
    place : str or None
        Where it is; None where nothing is missing.
    same : tuple of str
        What no recording tells from it.
    size : float
        The number that `parameter` is compared with.
    parameter : str or None
        Of the mechanism, or of the model in use where that takes it up.
    into : bool
        Whether the model in use takes it up.
    """

    called: str | None = None
    place: str | None = None
    same: tuple[str, ...] = ()
    size: float = 0.0
    parameter: str | None = None
    into: bool = False


@dataclass(frozen=True)
class RealOutcome:
    """A case beside what was said of it."""

    case: RealCase
    truth: Truth
    said: dict | None
    why: str = ""
    changed: dict[str, float] = field(default_factory=dict)
    took_s: float = 0.0
    standing: dict[str, float] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """What was said; "none" where nothing was."""
        return self.said["verdict"] if self.said else "none"

    @property
    def named(self) -> list[str]:
        """What is named, the first first, as "name at place"."""
        return [_acting(m) for m in self.said["mechanisms"]] if self.said else []

    @property
    def among(self) -> list[str]:
        """What a diagnosis is undecided between."""
        return self.named + [_acting(m) for m in self.said["alternatives"]] if self.verdict == "undecided" else []

    @property
    def nearest(self) -> list[str]:
        """What came nearest where nothing explained the recordings."""
        return [_acting(m) for m in (self.said.get("nearest") or {"mechanisms": []})["mechanisms"]] if self.said else []

    @property
    def in_place(self) -> bool:
        """Whether the place that is said is the right one, or so close that no recording tells them apart."""
        return bool(self.said) and same_place(self.said["place"], self.truth.place)

    @property
    def is_off_list(self) -> bool:
        """Whether what is missing is on no list that the diagnosis had."""
        truth = self.truth
        return truth.place is not None and not truth.into and (
            truth.called is None or truth.called.partition(" at ")[0] in self.case.without
        )  # fmt: skip


def truth_of(case: RealCase, plan: RealPlan, model: dict) -> Truth:
    """What is right to say of a case."""
    if case.left_out:
        acting = next(m for m in model["mechanisms"] if _acting(m) == case.left_out)
        parameter, size = next(iter(acting["values"].items()))
        return Truth(case.left_out, acting["place"], (), size, parameter)
    if case.kind is None:
        return Truth()
    stated = plan.put_in[case.kind]
    place = stated.called.partition(" at ")[2] if stated.called else stated.place
    parameter = stated.into or stated.parameter
    return Truth(stated.called, place, stated.same, case.size, parameter, stated.into is not None)


def read_real_outcomes(plan: RealPlan, folder: Path) -> list[RealOutcome]:
    """Outcomes of the cases that have a result, in their order."""
    model = json.loads((folder / "model" / MODEL).read_text(encoding="utf-8"))
    found = []
    for case in cases_of(plan, model):
        files = [folder / "cases" / case.name / name for name in ("result.json", STANDING)]
        result, standing = (json.loads(f.read_text(encoding="utf-8")) if f.exists() else {} for f in files)
        if result:
            found.append(outcome_of(case, truth_of(case, plan, model), result, standing))
    return found


def outcome_of(case: RealCase, truth: Truth, result: dict, standing: dict[str, float] | None = None) -> RealOutcome:
    """Put a result, and what the model in use predicts as it stands, beside the answer."""
    said, why = result["said"], result["why"] or ""
    if result["tampering"]:
        said, why = None, "refused: it " + "; ".join(result["tampering"][:3])
    elif result["key"] != case.digest:
        said, why = None, "refused: the key made from the seed is not the one whose digest was left"
    return RealOutcome(case, truth, said, why, result["changed"], result["took_s"], standing or {})


def made_of(o: RealOutcome) -> str:
    """What a diagnosis made of a case, in a few words."""
    truth, verdict = o.truth, o.verdict
    if verdict in ("none", "agrees"):
        if verdict == "none":
            return "no diagnosis"
        return "let be" if truth.place is None else "taken up" if truth.into else "not noticed"
    if verdict == "unexplained":
        return "unexplained, in place" if o.in_place else "unexplained, elsewhere"
    said = o.named[:1] if verdict == "explained" else o.among
    if truth.called in said and not o.is_off_list:
        return "named" if verdict == "explained" else "undecided with it"
    if set(truth.same) & set(said) and not o.is_off_list:
        return "named as its equal" if verdict == "explained" else "undecided with its equal"
    if truth.called and truth.called.partition(" at ")[0] in {s.partition(" at ")[0] for s in said}:
        return "named elsewhere" if verdict == "explained" else "undecided with it elsewhere"
    return "another name" if verdict == "explained" else "undecided without it"


def is_right(o: RealOutcome, untouched: RealOutcome | None) -> bool | None:
    """Whether that is right; None where a case only stands beside others, or there is nothing to hold it to."""
    made = made_of(o)
    if o.case.group == "paper":
        return None
    if o.truth.place is None:
        return made == "let be"
    if o.truth.into:
        found = found_size(o, untouched)
        return made == "taken up" and found is not None and abs(found / o.truth.size - 1) <= FOUND
    if o.is_off_list:
        return made.startswith("unexplained") if o.case.without else made.startswith(("unexplained", "undecided"))
    return made in ("named", "named as its equal", "undecided with it", "undecided with its equal")


def found_size(o: RealOutcome, untouched: RealOutcome | None) -> float | None:
    """The size that was found of what is right to find, wherever a diagnosis states it; None where it does not."""
    if not o.said or not o.truth.parameter:
        return None
    if o.truth.into:
        if untouched is None or not untouched.said:
            return None
        return o.said["calibrated"][o.truth.parameter] - untouched.said["calibrated"][o.truth.parameter]
    stated = [*o.said["mechanisms"], *((o.said.get("nearest") or {}).get("mechanisms") or [])]
    for acting in (o.truth.called, *o.truth.same):
        for m in stated:
            if _acting(m) == acting:
                value = next(p["value"] for p in m["parameters"] if p["name"] == o.truth.parameter)
                # A gain that stands for its equal at the other end is that one's inverse.
                return 1 / (1 + value) - 1 if acting in o.truth.same else value
    return None


def moved(o: RealOutcome, untouched: RealOutcome | None) -> dict[str, float]:
    """By which share each recalibrated number is off what untouched recordings have it at; the most first."""
    if not o.said or untouched is None or not untouched.said or o.case.group != "put in":
        return {}
    before = untouched.said["calibrated"]
    shares = {n: v / before[n] - 1 for n, v in o.said["calibrated"].items() if before.get(n)}
    return {n: s for n, s in sorted(shares.items(), key=lambda i: -abs(i[1])) if abs(s) > MOVED}


def raised(o: RealOutcome, untouched: RealOutcome | None) -> dict[str, float]:
    """By channel, the error of the model in use as it stands over that on the untouched recordings."""
    if untouched is None:
        return {}
    return {c: error / untouched.standing[c] for c, error in o.standing.items() if untouched.standing.get(c)}


def untouched_of(outcomes: Sequence[RealOutcome]) -> RealOutcome | None:
    """The case into which nothing was put."""
    return next((o for o in outcomes if o.case.group == "untouched"), None)


def _acting(mechanism: dict) -> str:
    return f"{mechanism['name']} at {mechanism['place']}"
