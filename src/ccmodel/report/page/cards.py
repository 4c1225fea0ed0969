"""Cards of the batches: what is wrong with the model, where, and how much better the extended one is."""

from collections.abc import Mapping, Sequence
from math import inf
from statistics import median
from typing import Any

from ccmodel.diagnosis.settings import CONSPICUOUS
from ccmodel.report.verdict import (
    IN_WORDS,
    INPUTS_INCONSISTENT,
    NOT_ACCEPTED,
    SYMBOL,
    nearest_sentence,
    place_in_words,
    possible_places,
    sentence,
)
from ccmodel.sentences import joined

IN_PART, CONTRADICTORY = "explained in part", "inputs inconsistent"
# Verdicts as cards show them, in the order of the summary.
SHOWN = ("explained", "learned", IN_PART, "undecided", "unexplained", CONTRADICTORY, "agrees")


def cards(batches: Sequence[Mapping], diagnoses: Sequence[Mapping]) -> list[dict]:
    """A card for each batch: measured batches first, then contradictory inputs, then those with the largest mismatch.

    Batches of one rig that were diagnosed together have a further card for the rig.

    Parameters
    ----------
    batches : sequence of mapping
        Summaries of the ingested batches.
    diagnoses : sequence of mapping
        Contents of diagnosis.json.
    """
    of_batch = {d["batch"]: d for d in diagnoses}
    rigs = [_summary_of_rig(d, batches) for d in diagnoses if d.get("batches")]
    made = [_card(summary, of_batch) for summary in [*batches, *rigs]]
    return sorted(made, key=lambda card: (not card["measured"], -card["mismatch"]))


def _summary_of_rig(diagnosis: Mapping, batches: Sequence[Mapping]) -> dict:
    """A summary, as of a batch, of all batches that were diagnosed together."""
    parts = [summary for summary in batches if _name(summary) in diagnosis["batches"]]
    stated = next((summary["batch"] for summary in parts if summary["batch"]), {"origin": "", "rig": {}})
    recordings = [recording for summary in parts for recording in summary["recordings"]]
    return {"batch": stated | {"batch": diagnosis["batch"]}, "recordings": recordings, "together": diagnosis["batches"]}


def _card(summary: Mapping, diagnoses: Mapping[str, Mapping]) -> dict:
    name = _name(summary)
    origin = summary["batch"]["origin"] if summary["batch"] else ""
    card: dict[str, Any] = {
        "batch": name,
        "together": summary.get("together", []),
        "origin": {"rig": "measured", "virtual-rig": "simulated"}.get(origin, "no usable recording"),
        "measured": origin == "rig",
        "recordings": len(summary["recordings"]),
        "single_cable": bool(summary["batch"]) and summary["batch"]["rig"].get("transmission") == "single-cable",
        "mismatch": 0.0,
        "linked": False,
        "verdict": None,
        "shown_verdict": "not diagnosed",
        "rows": [],
        "places": [],
    }
    diagnosis = diagnoses.get(name)
    if diagnosis is None:
        return card | {"mismatch": -1.0, "sentence": "Not diagnosed: the configuration does not name it in 'diagnose'."}
    card |= {"sentence": sentence(diagnosis), "linked": True}
    if diagnosis["verdict"] is None:
        return card
    if diagnosis["verdict"] == INPUTS_INCONSISTENT:
        # They ask for a correction and have no errors, so they stand before the largest mismatch.
        shown = {"verdict": INPUTS_INCONSISTENT, "shown_verdict": CONTRADICTORY, "mismatch": inf}
        return card | shown | {"mechanisms": [], "places": possible_places(diagnosis)}
    error, nearest = diagnosis["fit"]["error"], diagnosis.get("nearest")
    rows = _rows(error, (nearest or {}).get("error"))
    # A pair can account for most of a mismatch and leave more than noise; the verdict alone does not say so.
    in_part = diagnosis["verdict"] == "explained" and caution(diagnosis)
    return card | {
        "verdict": diagnosis["verdict"],
        "shown_verdict": IN_PART if in_part else diagnosis["verdict"],
        "nearest": nearest_sentence(diagnosis),
        "mechanisms": _mechanisms(diagnosis),
        "places": possible_places(diagnosis),
        "place_text": joined([place_in_words(p) for p in possible_places(diagnosis)]),
        "rows": rows,
        "worst": rows[0],
        "largest": {
            key: max((r[key] for r in rows if r[key] is not None), default=None) for key in ("before", "after")
        },
        "longest": max(1.0, *(max(r["before"], r["after"] or 0.0) for r in rows)),
        "after_is": after_is(diagnosis),
        "held_out": len(diagnosis["fit"]["held_out"]),
        "mismatch": rows[0]["before"],
        "caution": caution(diagnosis),
    }


def _name(summary: Mapping) -> str:
    return summary["batch"]["batch"] if summary["batch"] else summary["folder"].rpartition("/")[2]


def _mechanisms(diagnosis: Mapping) -> list[str]:
    """Names of all mechanisms that the card or the diagnosis names, each once."""
    nearest = diagnosis.get("nearest") or {"mechanisms": []}
    named = [*diagnosis["mechanisms"], *diagnosis["likeliest"], *diagnosis["alternatives"], *nearest["mechanisms"]]
    return list(dict.fromkeys(m["name"] for m in named))


def mechanisms_named(diagnoses: Sequence[Mapping]) -> list[str]:
    """Names of all mechanisms that any verdict, alternative or nearest model names, sorted."""
    return sorted({name for d in diagnoses if d["verdict"] for name in _mechanisms(d)})


def after_is(diagnosis: Mapping) -> str:
    """The model whose error stands after that of the calibrated model; empty where there is none."""
    verdict, nearest = diagnosis["verdict"], diagnosis.get("nearest")
    if verdict == "unexplained":
        return f"nearest ({NOT_ACCEPTED})" if nearest and nearest.get("error") else ""
    return "extended" if verdict in ("explained", "learned", "undecided") else ""


def _rows(error: Mapping[str, Mapping], nearest: Mapping[str, Mapping] | None) -> list[dict]:
    """Errors of each channel over its noise floor, the worst first."""
    after = nearest or error
    changed = nearest is not None or any(e["before"] != e["after"] for e in error.values())
    rows = [
        {
            "channel": IN_WORDS[channel],
            "before": e["before"] / e["noise"],
            "after": after[channel]["after"] / e["noise"] if changed else None,
        }
        for channel, e in error.items()
    ]
    return sorted(rows, key=lambda row: -row["before"])


def caution(diagnosis: Mapping) -> str | None:
    """What must be said if the model of the verdict leaves an error above the noise floor; None where it does not."""
    above = {
        (IN_WORDS if diagnosis["verdict"] != "agrees" else SYMBOL)[c]: e["after"] / e["noise"]
        for c, e in diagnosis["fit"]["error"].items()
        if e["after"] > CONSPICUOUS * e["noise"]
    }
    if diagnosis["verdict"] == "unexplained" or not above:
        return None
    if diagnosis["verdict"] != "agrees":
        worst = max(above, key=above.__getitem__)
        return f"Not all is accounted for: up to {above[worst]:.1f} times the noise floor is left, in the {worst}."
    square = diagnosis["fit"]["mean_square"]["calibrated"]
    return (
        f"{joined([*above])}: above the noise floor by differences between runs, which the verdict takes into account"
        f" (mean square of the whitened residuals {square:.2g}; 1 is noise)."
    )


def overview(made: Sequence[Mapping]) -> list[str]:
    """A sentence on the measured and one on the simulated batches: verdicts, and how far the errors fall."""
    judged = [card for card in made if card["verdict"]]
    if made and not judged:
        return ["No batch has been diagnosed."]
    alone, rigs = ([card for card in judged if bool(card["together"]) == joint] for joint in (False, True))
    groups = [(origin, [card for card in alone if card["origin"] == origin]) for origin in ("measured", "simulated")]
    of_rigs = [
        f"Rig {card['batch']}, its {len(card['together'])} batches together: {card['shown_verdict']}." for card in rigs
    ]
    return [*(_summary(origin, of) for origin, of in groups if of), *of_rigs]


def _summary(origin: str, of: Sequence[Mapping]) -> str:
    counted = {shown: sum(card["shown_verdict"] == shown for card in of) for shown in SHOWN}
    counts = [f"{n} {shown}" if len(of) > 1 else shown for shown, n in counted.items() if n]
    falls = [
        _fall(those, model, len(of) > 1)
        for verdicts, model in (
            (("explained", "learned"), "extended model"),
            (("unexplained",), f"nearest model, {NOT_ACCEPTED}"),
        )
        if (those := [c for c in of if c["verdict"] in verdicts and c["worst"]["after"] is not None])
    ]
    named = f"batch {of[0]['batch']}" if len(of) == 1 else f"{len(of)} batches"
    what = "held-out error" if all(card["held_out"] for card in of if card["rows"]) else "error"
    error = f" Largest {what} over noise: {'; '.join(falls)}." if falls else ""
    return f"{origin.capitalize()}, {named}: {joined(counts)}.{error}"


def _fall(of: Sequence[Mapping], model: str, is_named: bool) -> str:
    """How far the largest error of any channel falls: of one batch, or the median of several."""
    before, after = (median(max(row[key] for row in card["rows"]) for card in of) for key in ("before", "after"))
    over = f"median of {len(of)}" if len(of) > 1 else of[0]["batch"]
    return f"{before:.1f} → {after:.1f} ({model}{f', {over}' if is_named else ''})"
