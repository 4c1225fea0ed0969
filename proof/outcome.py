"""A case's true effects together with what the diagnosis reported.

Only names, places and confidences are read from a diagnosis, and its models' predictions of held-out recordings. The
answer is made again from the case's seed. A result with another answer's digest, or whose diagnosis tried to reach
more than its batch, is refused. A refused result counts as a failure in every rate.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from proof.cases import CLEAN, draw

# A mechanism with at least this confidence counts as stated with confidence.
DECISION_THRESHOLD = 0.8
# Verdict on recordings that contradict one another; it names no physics, and on recordings of a right rig it is a false
# alarm of the consistency checks.
INCONSISTENT = "inputs-inconsistent"
# More mechanisms or alternatives than these are not counted.
MOST_MECHANISMS = 4
MOST_ALTERNATIVES = 4
# Least error over the noise floor of a visible effect.
VISIBLE = 3 * np.sqrt(2)
# Least error over the noise floor at which the share of the gap that was closed is computed.
LEAST_GAP = 1.5
# Pairs of places that no recording distinguishes.
EQUIVALENT_PLACES = {
    ("cable", "conduit"),
    ("load-pulley", "load-end"),
    ("drive-pulley", "drive-end"),
    ("load", "load-pulley"),
}


@dataclass(frozen=True)
class Outcome:
    """A case's answer and the diagnosis of it.

    Attributes
    ----------
    key : dict
        The answer (`proof.cases.Case.key`).
    diagnosis : dict or None
        None if there is none or if the result was refused.
    failure : str
        Why there is no diagnosis.
    errors : dict
        By channel, the root mean square errors on held-out recordings "before" and "after" the diagnosis, and the
        noise floor ("floor"), in the channel's unit.
    diagnosis_s, took_s : float
        Processor time of the diagnosis, and of the case with its simulations and predictions, s; the first is NaN in
        results from before it was measured.
    regressors : dict
        By reference regressor and channel, the root mean square error on held-out recordings.
    follow_ups : dict
        By kind of a further experiment (`proof.follow_up`), the diagnosis with its recordings; None where it failed.
    """

    key: dict
    diagnosis: dict | None
    failure: str = ""
    errors: dict = field(default_factory=dict)
    diagnosis_s: float = np.nan
    took_s: float = 0.0
    regressors: dict = field(default_factory=dict)
    follow_ups: dict = field(default_factory=dict)

    @property
    def kind(self) -> str:
        """Kind of the case."""
        return self.key["kind"]

    @property
    def true_names(self) -> set[str]:
        """Names of the concealed effects."""
        return {t["name"] for t in self.key["truth"]} - {CLEAN}

    @property
    def has_another_law(self) -> bool:
        """Whether the rig has another law of a concealed effect than its mechanism."""
        return any(t.get("law") for t in self.key["truth"])

    @property
    def verdict(self) -> str:
        """The verdict; "none" if there is no diagnosis."""
        return verdict_of(self.diagnosis)

    @property
    def identified(self) -> list[dict]:
        """Identified mechanisms; none if there are more than a diagnosis may report."""
        identified = self.diagnosis["mechanisms"] if self.diagnosis and self.verdict == "explained" else []
        return identified if len(identified) <= MOST_MECHANISMS else []

    @property
    def first_identified(self) -> str | None:
        """Name of the first identified mechanism."""
        return self.identified[0]["name"] if self.identified else None

    @property
    def listed(self) -> list[dict]:
        """The candidates that an undecided diagnosis reports, the most probable first."""
        if self.verdict != "undecided":
            return []
        return (self.diagnosis["mechanisms"] + self.diagnosis["alternatives"])[:MOST_ALTERNATIVES]

    @property
    def alternatives(self) -> list[str]:
        """Their names."""
        return list(dict.fromkeys(c["name"] for c in self.listed))

    def true_among(self, reported: Sequence[dict]) -> set[str]:
        """Names of the concealed effects that are among reported mechanisms, each at its place."""
        return {t["name"] for t in self.key["truth"] if any(_is_effect(c, t) for c in reported)}

    @property
    def are_all_identified(self) -> bool:
        """Whether every concealed effect is identified, at its place."""
        return self.true_names <= self.true_among(self.identified)

    @property
    def are_all_accounted_for(self) -> bool:
        """Whether each concealed effect is identified at its place, or a learned verdict has a law of it.

        The mechanisms beside a learned law count as identified.
        """
        if self.verdict != "learned":
            return self.are_all_identified
        named = self.true_among(self.diagnosis["mechanisms"])
        return all(t["name"] in named or any(is_law_of(law, t) for law in self.laws) for t in self.key["truth"])

    @property
    def laws(self) -> list[dict]:
        """Learned laws of the diagnosis."""
        return (self.diagnosis or {}).get("laws") or []

    @property
    def claims(self) -> list[tuple[float, bool]]:
        """Every stated confidence, and whether it belongs to a concealed effect: of a mechanism by name and place."""
        claims = self.diagnosis["mechanisms"] + self.diagnosis["alternatives"] if self.diagnosis else []
        of_laws = [(w["confidence"], any(is_law_of(w, t) for t in self.key["truth"])) for w in self.laws]
        return [(c["confidence"], bool(self.true_among([c]))) for c in claims] + of_laws

    @property
    def error_before(self) -> float:
        """Error of the recalibrated model over the noise floor, in the worst channel; NaN if not known."""
        return self.over_floor({c: e["before"] for c, e in self.errors.items()})

    @property
    def error_after(self) -> float:
        """Error of the diagnosed model over the noise floor, in the worst channel; NaN if not known."""
        return self.over_floor({c: e["after"] for c, e in self.errors.items()})

    @property
    def error_of_regressors(self) -> float:
        """Error of the best reference regressor over the noise floor, in its worst channel; NaN if none was fitted."""
        return min(map(self.over_floor, self.regressors.values()), default=np.nan)

    def over_floor(self, errors: Mapping[str, float]) -> float:
        """Largest of errors by channel, each over its noise floor; NaN without channels."""
        return max((error / self.errors[c]["floor"] for c, error in errors.items()), default=np.nan)

    @property
    def has_no_candidate(self) -> bool:
        """Whether no mechanism of the diagnosis is that of the effect."""
        return self.kind in ("removed", "unlisted")

    @property
    def is_visible(self) -> bool:
        """Whether the recalibrated model's error is at least `VISIBLE` noise floors; True if it is not known."""
        return not self.errors or self.error_before >= VISIBLE

    @property
    def gap_closed(self) -> float | None:
        """Share of the gap between the recalibrated model's error and the noise floor that the diagnosis closes.

        It is taken in the channel with the largest gap. None below `LEAST_GAP`.
        """
        if not self.errors or self.error_before < LEAST_GAP:
            return None
        channel = self.worst_channel
        return self.gap_closed_by(self.errors[channel]["after"])

    @property
    def worst_channel(self) -> str:
        """Channel with the largest error of the recalibrated model over the noise floor."""
        return max(self.errors, key=lambda c: self.errors[c]["before"] / self.errors[c]["floor"])

    def gap_closed_by(self, error: float) -> float:
        """Share of the gap in the worst channel that a model with this error closes."""
        e = self.errors[self.worst_channel]
        return (e["before"] - error) / (e["before"] - e["floor"])

    @property
    def is_detected(self) -> bool:
        """Whether the diagnosis reports that physics is missing."""
        return self.verdict not in ("agrees", "none", INCONSISTENT)

    @property
    def is_identified_first(self) -> bool:
        """Whether the first identified mechanism is a concealed effect, at its place."""
        return bool(self.true_among(self.identified[:1]))

    @property
    def is_first_of_all(self) -> bool:
        """Whether the most probable mechanism, identified or an alternative, is a concealed effect."""
        return bool(self.true_among([*self.identified, *self.listed][:1]))

    @property
    def includes_truth(self) -> bool:
        """Whether a concealed effect is identified first or is among the alternatives."""
        return self.is_identified_first or bool(self.true_among(self.listed))

    @property
    def is_confidently_wrong(self) -> bool:
        """Whether a mechanism or law stated with confidence is none of the concealed effects, or too many are reported.

        An alternative counts like a mechanism that is named, and a law that is in the slot of none is wrong. Several
        effects that are declared explained with confidence while one of them is not named count too.
        """
        reported = self.diagnosis["mechanisms"] if self.diagnosis else []
        wrong = any(p >= DECISION_THRESHOLD and not is_true for p, is_true in self.claims)
        is_sure = self.verdict == "explained" and all(c["confidence"] >= DECISION_THRESHOLD for c in reported)
        is_incomplete = is_sure and len(self.true_names) > 1 and not self.true_names <= self.true_among(reported)
        return len(reported) > MOST_MECHANISMS or wrong or is_incomplete


def verdict_of(diagnosis: Mapping | None) -> str:
    """Verdict of a diagnosis; "none" without one."""
    return diagnosis["verdict"] if diagnosis else "none"


def after(o: Outcome, which: str) -> Outcome:
    """A case as it is diagnosed with a further experiment; without a diagnosis if there was no such experiment."""
    diagnosis = o.follow_ups.get(which)
    return replace(o, diagnosis=diagnosis, failure="" if diagnosis else "no diagnosis")


class Answered(Protocol):
    """A case whose answer has a digest."""

    name: str
    digest: str


def outcome(result: dict) -> Outcome:
    """Combine a result of `proof.judge.judge` with its answer, made again from the seed."""
    case = draw(result["seed"], **result["asked"])
    refused = refusal(result, case)
    diagnosis = None if refused else result["diagnosis"]
    return Outcome(
        key=case.key,
        diagnosis=diagnosis,
        failure=refused or result["why"] or "",
        errors=result["errors"] if diagnosis else {},
        diagnosis_s=result.get("diagnosis_s", np.nan),
        took_s=result["took_s"],
        regressors=result["rivals"] if diagnosis else {},
        follow_ups={k: v["diagnosis"] for k, v in result.get("follow_ups", {}).items()} if diagnosis else {},
    )


def refusal(result: dict, case: Answered) -> str:
    """Why a result does not count for a case; empty if it does."""
    if result["tampering"]:
        return "refused: it " + "; ".join(result["tampering"][:3])
    if result["key"] != case.digest or result["case"] != case.name:
        return "refused: its digest of the answer is not that of the answer made from the seed"
    return ""


def read_outcomes(folder: Path, names: Sequence[str] | None = None) -> list[Outcome]:
    """Outcomes of the results in the named subfolders, or in all, in the order of the names."""
    if names is None:
        files = sorted(folder.glob("*/result.json"))
    else:
        files = [folder / name / "result.json" for name in sorted(names)]
    return [outcome(json.loads(file.read_text())) for file in files]


def same_place(a: str | None, b: str | None) -> bool:
    """Whether two places are equal, or equivalent because no recording distinguishes them."""
    return a is not None and (a == b or (a, b) in EQUIVALENT_PLACES or (b, a) in EQUIVALENT_PLACES)


def _is_effect(reported: dict, truth: dict) -> bool:
    return reported["name"] == truth["name"] and same_place(reported.get("place"), truth["place"])


def is_law_of(law: dict, truth: dict) -> bool:
    """Whether a learned law is in the slot and of the channel of a concealed effect; without a slot, at its place."""
    is_in_slot = truth.get("slot") in (law["slot"], "", None) and truth.get("channel") in (law.get("channel"), "", None)
    return is_in_slot and same_place(law["place"], truth["place"])


def is_located(o: Outcome) -> bool:
    """Whether the reported place is that of a concealed effect."""
    return o.is_detected and any(same_place(o.diagnosis["place"], t["place"]) for t in o.key["truth"])
