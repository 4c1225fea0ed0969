"""Cards of the batches: what is wrong with the model, where, and how much better the extended one is."""

from collections.abc import Mapping, Sequence
from statistics import median

from ccmodel.recording import ORIGIN
from ccmodel.report.verdict import (
    IN_WORDS,
    NOT_ACCEPTED,
    SYMBOL,
    joined,
    nearest_sentence,
    place_in_words,
    possible_places,
    sentence,
)

# Of the verdicts, in the order of the summary.
MEANS = {
    "explained": "missing physics named",
    "undecided": "candidates not told apart",
    "unexplained": "no listed mechanism fits",
    "agrees": "",
}
# An error that is so many times the noise floor, in any channel, asks for a sentence if the model is accepted.
CONSPICUOUS = 1.5


def cards(batches: Sequence[Mapping], diagnoses: Sequence[Mapping]) -> list[dict]:
    """A card for each batch: measured batches first, then those with the largest mismatch.

    Parameters
    ----------
    batches : sequence of mapping
        Summaries of the ingested batches.
    diagnoses : sequence of mapping
        Contents of diagnosis.json.
    """
    of_batch = {d["batch"]: d for d in diagnoses}
    made = [_card(summary, of_batch) for summary in batches]
    return sorted(made, key=lambda card: (not card["measured"], -card["mismatch"]))


def _card(summary: Mapping, diagnoses: Mapping[str, Mapping]) -> dict:
    name = _name(summary)
    origin = summary["batch"]["origin"] if summary["batch"] else None
    card = {
        "batch": name,
        "origin": {"rig": "measured", "virtual-rig": "simulated"}.get(origin, "no usable recording"),
        "measured": origin == "rig",
        "origin_in_full": ORIGIN.get(origin, ""),
        "recordings": len(summary["recordings"]),
        "single_cable": bool(summary["batch"]) and summary["batch"]["rig"].get("transmission") == "single-cable",
        "mismatch": 0.0,
        "linked": False,
        "verdict": None,
        "places": [],
    }
    diagnosis = diagnoses.get(name)
    if diagnosis is None:
        return card | {"mismatch": -1.0, "sentence": "Not diagnosed: the configuration does not name it in 'diagnose'."}
    card |= {"sentence": sentence(diagnosis), "linked": True}
    if diagnosis["verdict"] is None:
        return card
    error, nearest = diagnosis["fit"]["error"], diagnosis.get("nearest")
    rows = _rows(error, (nearest or {}).get("error"))
    return card | {
        "verdict": diagnosis["verdict"],
        "nearest": nearest_sentence(diagnosis),
        "mechanisms": _mechanisms(diagnosis),
        "next": (diagnosis.get("next_experiment") or {}).get("text"),
        "places": possible_places(diagnosis),
        "place_text": joined([place_in_words(p) for p in possible_places(diagnosis)]),
        "rows": rows,
        "worst": rows[0],
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
    return {"explained": "extended", "undecided": "most probable"}.get(verdict, "")


def _rows(error: Mapping[str, Mapping], nearest: Mapping[str, Mapping] | None) -> list[dict]:
    """Errors of each channel over its noise floor, the worst first."""
    after = nearest or error
    changed = nearest is not None or any(e["before"] != e["after"] for e in error.values())
    rows = [
        {
            "channel": IN_WORDS[channel],
            "before": e["before"] / e["noise"],
            "after": after[channel]["after"] / e["noise"] if changed else None,
            "noise": e["noise"],
            "unit": e["unit"].replace("*", " "),
        }
        for channel, e in error.items()
    ]
    return sorted(rows, key=lambda row: -row["before"])


def caution(diagnosis: Mapping) -> str | None:
    """What must be said if the model of the verdict leaves an error above the noise floor; None where it does not."""
    above = {
        SYMBOL[c]: e["after"] / e["noise"]
        for c, e in diagnosis["fit"]["error"].items()
        if e["after"] > CONSPICUOUS * e["noise"]
    }
    if diagnosis["verdict"] == "unexplained" or not above:
        return None
    if diagnosis["verdict"] != "agrees":
        worst = max(above, key=above.get)
        return f"Not all is accounted for: up to {above[worst]:.1f} times the noise is left, in {worst}."
    square = diagnosis["fit"]["mean_square"]["calibrated"]
    return (
        f"{joined([*above])}: above the noise floor by differences between runs, which the verdict takes into account"
        f" (mean square of the whitened residuals {square:.2g}; 1 is noise)."
    )


def overview(made: Sequence[Mapping]) -> list[str]:
    """Sentences over all batches: how many differ from the model, how far the errors fall, the largest mismatch."""
    judged = [card for card in made if card["verdict"]]
    if not judged:
        return ["No batch has been diagnosed."] if made else []
    differing = [card for card in judged if card["verdict"] != "agrees"]
    counts = [
        f"{n} {'agree' if verdict == 'agrees' and n > 1 else verdict}{f' ({means})' if means else ''}"
        for verdict, means in MEANS.items()
        if (n := sum(c["verdict"] == verdict for c in judged))
    ]
    of = "1 batch" if len(judged) == 1 else f"{len(judged)} batches"
    verb = "differs" if len(differing) == 1 else "differ"
    sentences = [
        f"{len(differing)} of {of} {verb} from the calibrated model beyond noise: {joined(counts)}."
        if differing
        else f"The calibrated model agrees with {'the batch' if len(judged) == 1 else f'all {len(judged)} batches'}."
    ]
    for verdicts, models in ((("explained",), "extended model"), (("unexplained",), f"nearest model ({NOT_ACCEPTED})")):
        falls = [c for c in differing if c["verdict"] in verdicts and c["worst"]["after"] is not None]
        if falls:
            sentences.append(_fall(falls, models))
    return sentences


def _fall(of: Sequence[Mapping], model: str) -> str:
    """How far the largest error of any channel falls: of one batch, or the median of several."""
    before, after = (median(max(row[key] for row in card["rows"]) for card in of) for key in ("before", "after"))
    over = f"batch {of[0]['batch']}" if len(of) == 1 else f"median of {len(of)} batches"
    return (
        f"With the {model}, the largest held-out error of any channel falls from {before:.1f} to {after:.1f} times the"
        f" noise floor ({over})."
    )
