"""The page on seeded faults in measured recordings, `docs/real-concealment.md`."""

import json
from collections.abc import Sequence
from datetime import date
from pathlib import Path

from proof.page import commit, table
from proof.real.cases import label
from proof.real.plan import RealPlan
from proof.real.run import BASELINE, TOLERANCE
from proof.real.score import IDENTIFIED, RealOutcome, classification, estimated_size, is_right, is_size_recovered

# The text from this heading on is written by hand and kept when the tables are made again.
BY_HAND = "## Discussion"


def real_page(outcomes: Sequence[RealOutcome], plan: RealPlan, baseline: Path, earlier: str = "") -> str:
    """The page as Markdown.

    Parameters
    ----------
    outcomes : sequence of RealOutcome
    plan : RealPlan
    baseline : Path
        Folder of the baseline (`proof.real.run.find_baseline`).
    earlier : str
        The present page, whose hand-written part is kept.
    """
    controls = [_control(o) for o in outcomes if o.case.is_control]
    seeded = [_fault_row(o, plan) for o in outcomes if o.case.fault]
    removed = [_removed_row(o) for o in outcomes if o.case.removed]
    by_hand = earlier[earlier.index(BY_HAND) :] if BY_HAND in earlier else f"{BY_HAND}\n\nNot written yet.\n"
    return f"""# Seeded faults in measured recordings

{_method(plan, baseline, outcomes)}
## Result

{_summary(outcomes)}

## Controls

Test recordings without a fault:

{chr(10).join(controls) or "Not run."}

## Seeded faults

- **Changed**: standard deviation of the change that the fault makes in a channel, over the channel's peak to peak.
- **Mean square**: residual mean square of the frozen baseline on the faulty recordings, over the square of the
  tolerance.
- **Right**: the mechanism is identified or among the alternatives, at its place, or an equivalent that no recording
  distinguishes from it (a gain at one end is an inverse gain at the other). If no candidate models the fault, right is
  `learned`, `unexplained` or `undecided` at any place, with no mechanism and no law at another place stated with
  confidence.

{_rows(_FAULT_HEAD, seeded)}

## Mechanisms removed from the baseline

The test recordings without a fault, with one mechanism removed from the baseline. If this mechanism is a candidate, a
diagnosis is right that identifies it with its value. Otherwise a diagnosis is right if it is `learned`, `unexplained`
or `undecided` at the place of the mechanism, with no other mechanism and no law at another place stated with
confidence.

{_rows(_REMOVED_HEAD, removed)}

{by_hand}"""


def _method(plan: RealPlan, baseline: Path, outcomes: Sequence[RealOutcome]) -> str:
    model, tolerance, first = (
        json.loads((baseline / file).read_text(encoding="utf-8"))
        for file in (BASELINE, TOLERANCE, "first/diagnosis.json")
    )
    return f"""Made by `make proof-real` on {date.today().isoformat()}, commit {commit()}; the diagnosis's sources
have the digest {", ".join(sorted({o.sources for o in outcomes}))}.

- **Recordings**: `{plan.batch}` of MRDLab/mis-tool-characterization, a da Vinci grasper ([the
  instrument](real-instrument.md)). They are measured.
- **Faults**: one at a time, computed on the raw counts and seeded in all test recordings alike. Fault and size are
  drawn from a seed ([ranges and sources](../proof/real/plan.yaml)).
- **Isolation**: the diagnosis runs in a process that can reach only a copy of the batch and the baseline. No answer is
  on disk, and no file name reveals the fault.
- **Baseline**: identified from {len(plan.training)} training recordings ({_ids(plan.training)}) with a tolerance of
  {_tolerance(plan)} of peak to peak. The verdict was `{first["verdict"]}`{_nearest_words(first)}:
  {_mechanisms(model)}. Its cross-validated mean square is {_nearest_mean_square(first):.2f} times the square of the
  tolerance.
- **Tolerance**: {tolerance["tolerance_factor"]:g} times that, the first of a rising sequence at which the diagnosis of
  the training recordings with the frozen baseline is `agrees`: {_sequence(tolerance)}.
- **Test**: the other {len(plan.test)} recordings ({_ids(plan.test)}), diagnosed with the frozen baseline (`--freeze`):
  only the zeros of the two torques are fitted.
"""


def _summary(outcomes: Sequence[RealOutcome]) -> str:
    sizes = [is_size_recovered(o) for o in outcomes if classification(o) in IDENTIFIED]
    wrong = sum(bool(o.confidently_wrong) for o in outcomes)
    took = sorted(o.took_s for o in outcomes)
    return f"""- Right diagnoses: {sum(map(is_right, outcomes))} of {len(outcomes)}.
- Confident misidentifications (wrong mechanisms or laws at wrong places, with a confidence of 0.8 or more): {wrong}.
- Identifications with a size within 25 %: {sum(map(bool, sizes))} of {len(sizes)}.
- Processor time of a diagnosis: median {took[len(took) // 2]:.0f} s, maximum {took[-1]:.0f} s."""


_FOUND_HEAD = ["mean square", "diagnosis", "classification", "right", "reported place", "estimated size"]
_FAULT_HEAD = ["fault", "size", "changed", *_FOUND_HEAD]
_REMOVED_HEAD = ["removed", "value", "candidate", *_FOUND_HEAD]


def _rows(head: list[str], rows: list[list[str]]) -> str:
    return table(head, rows) if rows else "Not run."


def _control(o: RealOutcome) -> str:
    which = _ids(o.case.recordings) or "all"
    return f"- {which}: {_reported(o)}, {classification(o)}; mean square {_mean_square(o)}."


def _fault_row(o: RealOutcome, plan: RealPlan) -> list[str]:
    unit = plan.faults[o.case.fault].unit
    changed = ", ".join(f"{c} {100 * share:.1f} %" for c, share in o.changed.items())
    return [o.case.fault.replace("-", " "), _sized(o.case.size, unit), changed, *_found(o, unit)]


def _removed_row(o: RealOutcome) -> list[str]:
    return [o.case.removed, _sized(o.truth.size, ""), "no" if o.case.without else "yes", *_found(o, "")]


def _found(o: RealOutcome, unit: str) -> list[str]:
    right = "yes" if is_right(o) else "**no**"
    place = (o.diagnosis or {}).get("place") or ""
    return [_mean_square(o), _reported(o), classification(o), right, place, _sized(estimated_size(o), unit)]


def _reported(o: RealOutcome) -> str:
    """The verdict and its mechanisms with their confidences."""
    if not o.diagnosis:
        return f"none ({o.failure[-120:]})"
    if o.claims:
        return f"{o.verdict}: " + "; ".join(f"{label(m)} ({m['confidence']:.2f})" for m in o.claims)
    if o.laws:
        return "learned: " + "; ".join(f"{w['slot']} at {w['place']} by {', '.join(w['arguments'])}" for w in o.laws)
    nearest = (o.diagnosis.get("nearest") or {"mechanisms": []})["mechanisms"]
    return f"{o.verdict}, nearest {' + '.join(map(label, nearest))}" if nearest else o.verdict


def _mean_square(o: RealOutcome) -> str:
    square = o.diagnosis["mean_square"]["calibrated"] if o.diagnosis else None
    return "" if square is None else f"{square:.2f}"


def _nearest_mean_square(diagnosis: dict) -> float:
    """Mean square of the best candidate model, adequate or not."""
    nearest = diagnosis["nearest"]
    return nearest["mean_square"] if nearest else diagnosis["fit"]["mean_square"]["extended"]


def _nearest_words(diagnosis: dict) -> str:
    return ", and the nearest candidate model is taken" if diagnosis["nearest"] else ""


def _sized(value: float | None, unit: str) -> str:
    return "" if value is None else f"{value:.3g} {unit}".removesuffix(" 1").strip()


def _ids(names: Sequence[str]) -> str:
    return ", ".join(name.removeprefix("trial-") for name in names)


def _mechanisms(model: dict) -> str:
    values = [(label(m), ", ".join(f"{n} {v:.3g}" for n, v in m["values"].items())) for m in model["mechanisms"]]
    return " and ".join(f"{mechanism} ({value})" for mechanism, value in values)


def _tolerance(plan: RealPlan) -> str:
    return " and ".join(f"{100 * share:g} % ({channel})" for channel, share in plan.tolerance.items())


def _sequence(tolerance: dict) -> str:
    return ", ".join(
        f"{a} times ({t['verdict']}, mean square {t['mean_square']:.2f})" for a, t in tolerance["tried"].items()
    )
