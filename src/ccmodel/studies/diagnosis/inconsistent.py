"""The verdict `inputs-inconsistent`: what a diagnosis reports of a batch whose inputs contradict one another."""

from collections.abc import Sequence

from ccmodel.channels import TABLE
from ccmodel.diagnosis.location import TEXT
from ccmodel.diagnosis.result import FORMAT
from ccmodel.report.verdict import INPUTS_INCONSISTENT
from ccmodel.rig.findings import Finding

# More inputs than these are not listed in the sentence on what to correct.
MOST_LISTED = 5


def report(batch: str, findings: Sequence[Finding], is_held: bool = False, several: bool = False) -> dict:
    """The content of diagnosis.json; no model is run.

    Parameters
    ----------
    batch : str
        Name of the batch.
    findings : sequence of Finding
        All findings of its ingest, at least one of them inconsistent.
    is_held : bool
        Whether a frozen baseline was to be tested.
    several : bool
        Whether the findings are of several batches of one rig.
    """
    contradictions = sorted((f for f in findings if f.is_inconsistent), key=lambda f: -f.confidence)
    damaged = [f for f in findings if f.is_refused and not f.is_inconsistent]
    return {
        "format": FORMAT,
        "batch": batch,
        "verdict": INPUTS_INCONSISTENT,
        "is_held": is_held,
        "location": _location(contradictions),
        "mechanisms": [],
        "alternatives": [],
        "laws": [],
        "likeliest": [],
        "nearest": None,
        "fit": {
            "held_out": [],
            "calibrated": {},
            "mean_square": {"calibrated": None, "extended": None},
            "error": {},
        },
        "repeatability": [],
        "next_experiment": {"text": _correction(contradictions, several), "separates": []},
        "not_judged": [
            {"what": f.place_in(several), "why": f.text, "confidence": round(f.confidence, 4)} | more
            for some, more in ((contradictions, {}), (damaged, {"refused": True}))
            for f in some
        ],
    }


def _location(contradictions: Sequence[Finding]) -> dict:
    """The sensors at one end if all contradictions concern columns of that end; otherwise no place."""
    ends = {_end_of(f.column) for f in contradictions}
    places = [f"{end}-sensor" for end in ends if end is not None and len(ends) == 1]
    where = f" {TEXT[places[0]]}" if places else ""
    text = f"The inputs contradict one another{where}; no model is given."
    return {
        "place": places[0] if places else None,
        "is_found": bool(places),
        "places": places,
        "channels": [],
        "phases": [],
        "text": text,
    }


def _end_of(column: str | None) -> str | None:
    """The end of the rig whose sensor logs a column, or None for a column or key that belongs to no sensor."""
    if column in TABLE:
        return TABLE[column].side
    prefix = (column or "").partition("_")[0]
    return prefix if prefix in ("drive", "load") else None


def _correction(contradictions: Sequence[Finding], several: bool) -> str:
    """What to correct, in a sentence."""
    places = list(dict.fromkeys(f.place_in(several) for f in contradictions))
    more = f" and {len(places) - MOST_LISTED} more" if len(places) > MOST_LISTED else ""
    return (
        f"Correct batch.yaml, or record again: {'; '.join(places[:MOST_LISTED])}{more}. Then diagnose again. If these"
        " inputs are right, diagnose with --trust-inputs (in the pipeline: trust_inputs: true)."
    )
