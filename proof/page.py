"""The page of the validation, `docs/proof.md`."""

import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from proof.plan import PLAN
from proof.score import CALIBRATION_ERROR, COVERAGE_RATE, DIAGNOSED

TITLES = {
    "proof-noticing.png": "Detection and identification of single effects, by the error of the recalibrated model",
    "proof-detection.png": "Every case of a single effect at its size; a logistic curve for four or more cases",
    "proof-reliability.png": "Share of reported mechanisms that are true, by stated confidence; numbers of mechanisms",
    "proof-kept-back.png": "Errors on held-out recordings over the noise floor, in the worst channel",
    "proof-confusion.png": "Confusion matrix of clean cases and of cases with one effect, of all kinds and protocols",
}


@dataclass(frozen=True)
class Source:
    """Where a page and its figures are written, and the source of the results that they show.

    Attributes
    ----------
    page, figures : Path
        File of the page and folder of its figures; the page links to the figures by relative paths.
    command : str
        The command that made the results.
    selection : str
        Which cases were run, as a sentence of the page.
    """

    page: Path
    figures: Path
    command: str
    selection: str


def page(scored: dict, figures: list[str], source: Source) -> str:
    """The page as Markdown.

    Parameters
    ----------
    scored : dict
        A score (`proof.score.score`).
    figures : list of str
        File names in the folder of figures.
    source : Source
    """
    plan = os.path.relpath(PLAN, source.page.parent)
    kinds = ", ".join(f"{n} {kind}" for kind, n in sorted(scored["kinds"].items()))
    missed = table(_MISS_HEAD, map(_miss_row, scored["misses"])) if scored["misses"] else "None."
    return f"""# Validation on concealed effects

Made by `{source.command}` on {date.today().isoformat()}, commit {commit()}. {source.selection}

{scored["cases"]} cases: {kinds}.

{_METHOD.format(plan=plan)}
## Rates

{table(["", "", "rate", "95 % (Wilson)", "target", "met"], map(_rate_row, scored["rates"]))}

## Statistics

{table(["", "n", "value", "95 % (bootstrap)", "target", "met"], map(_statistic_row, scored["statistics"]))}

{_missed_targets(scored)}
{_methods(scored["methods"])}
## Figures

{_pictures(figures, source)}

## Detection limits

{table(["effect", "cases", "detected", "identified first", "half detected at"], _detection_rows(scored["detection"]))}

## Misses

{missed}
"""


_METHOD = """Each case is a simulated rig drawn from a seed: its parameters and the errors of their stated estimates,
none to two concealed effects with size and place, the protocol, sensor noise and run-to-run variation
([ranges of the draws]({plan})). The diagnosis runs on a copy of the batch in an otherwise empty folder. Its process
cannot read files, import modules, start programs or open connections outside that folder, and no answer is on disk.
The held-out recordings are simulated after the diagnosis has ended.

- **Kinds**: a clean case has no effect. A single or a pair has one or two effects whose mechanisms are candidates. In a
  removed case the mechanism of the one effect is removed from the candidates. An unlisted effect has no mechanism. A
  poor case has a single effect, recorded with little variation.
- **Law**: many effects have several published laws. Half of such effects are drawn with a law that the mechanism does
  not have (`other_laws` of the files in `src/virtualrig/effects`). The rates of both stand apart. Intervals are
  compared with the truth where both laws share a parameter.
- **Recalibrated model**: the paper's model as the diagnosis fits it to the batch (`calibrated.json`).
- **Noise floor**: the error of a model with the true physics, from sensor noise, sensor zeros, encoder resolution, the
  run-to-run variation of friction, and the loading history, which no recording states: how the tension falls along the
  conduit before the motion, and for how long the cables have been under tension.
- **Visible**: the recalibrated model's error on held-out recordings is at least 3 sqrt(2) = 4.2 noise floors in some
  channel.
- **No candidate**: unlisted and removed cases.
- **Inconsistent inputs**: all inputs of these cases are right, so the verdict `inputs-inconsistent` is a false alarm.
  It names no physics and counts as not detected.
- **No confident misidentification**: no mechanism, place or slot of a law with a confidence of at least 0.8 is wrong,
  and no pair is declared explained with such a confidence while one of its effects is not named. Confidences of laws
  count as those of mechanisms do.
- **Further experiment**: where the verdict is `undecided` or `unexplained`, the recordings that the diagnosis proposes
  are made on the same rig, at most three, and the batch is diagnosed again with them. The control is as many recordings
  of a motion, a tension and a bend drawn at random from those of the batch. "Decided" is any other verdict than these
  two; where no experiment was proposed, nothing was decided.
- **Times** are of one core, with other cases beside it. The diagnoses here are limited by their model runs alone; a
  diagnosis outside the proof has a time limit too.
- **Located**: the reported place is the true one. Places that no recording distinguishes count as equal: cable and
  conduit, a pulley and its cable end, the load and its pulley.
- **Open** in the column "met": the 95 % interval includes the target, so that more cases are needed to decide.
"""


def commit() -> str:
    """Commit of the checkout, marked if files have changed since."""
    described = subprocess.run(
        ["git", "describe", "--always", "--dirty", "--abbrev=10"],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
    )
    return described.stdout.strip().replace("-dirty", " with changes") or "unknown"


def table(head, rows) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def _pictures(figures: list[str], source: Source) -> str:
    """Every figure below its title."""
    folder = Path(os.path.relpath(source.figures, source.page.parent))
    return "\n\n".join(f"{TITLES[name]}:\n\n![{TITLES[name]}]({folder / name})" for name in figures)


def _rate_row(r: dict) -> list[str]:
    if r["rate"] is None:
        return [r["what"], "0", "", "", _percent(r["target"]), "no case"]
    interval = f"{r['low']:.1%} to {r['high']:.1%}"
    return [r["what"], f"{r['k']}/{r['n']}", f"{r['rate']:.1%}", interval, _percent(r["target"]), met_rate(r)]


def _percent(target: float | None) -> str:
    return "" if target is None else f"{target:.0%}"


def met_rate(r: dict) -> str:
    """Whether a rate meets its target, as text; empty without a target.

    A target is the least value of a rate. The coverage of intervals is different: too high is wrong too, so the target
    has to lie within its 95 % interval.
    """
    if r["target"] is None:
        return ""
    if r["what"] == COVERAGE_RATE:
        return "yes" if r["low"] <= r["target"] <= r["high"] else "**no**"
    return _met(r["rate"] >= r["target"], r["low"] < r["target"] < r["high"])


def _met(is_reached: bool, is_open: bool) -> str:
    return ("yes" if is_reached else "**no**") + (", open" if is_open else "")


def _statistic_row(s: dict) -> list[str]:
    if s["value"] is None:
        return [s["what"], "0", "", "", "", "no case"]
    target = "" if s["target"] is None else f"{s['target']:g}"
    met = "" if s["target"] is None else _met(_is_reached(s), s["low"] < s["target"] < s["high"])
    return [s["what"], str(s["n"]), f"{s['value']:.3g}", f"{s['low']:.3g} to {s['high']:.3g}", target, met]


def _is_reached(s: dict) -> bool:
    """Whether a statistic meets its target: an upper limit for the calibration error, a lower limit for all others."""
    return s["value"] <= s["target"] if s["what"] == CALIBRATION_ERROR else s["value"] >= s["target"]


def _missed_targets(scored: dict) -> str:
    """A sentence that names the rates and statistics whose targets are missed, open ones included."""
    missed = [r["what"] for r in scored["rates"] if r["rate"] is not None and "no" in met_rate(r)]
    missed += [
        s["what"]
        for s in scored["statistics"]
        if s["target"] is not None and s["value"] is not None and not _is_reached(s)
    ]
    if not missed:
        return "Every target with cases is met."
    return f"""Targets missed: {"; ".join(missed)}. Their cases are among the misses below; `agrees` for an effect
that is not visible is no miss, except in a pair."""


def _methods(rows: list[dict]) -> str:
    """The section on reference regressors; empty if none was applied."""
    if not rows:
        return ""
    head = ["", "names mechanism and place", "clean", "visible", "share of the gap closed, visible", "better, visible"]
    return f"""
## Reference regressors on the same recordings

Each starts from the recalibrated model and learns its residuals. "Clean" and "visible" give the error on held-out
recordings over the noise floor, in the worst channel. The gap is the one between the recalibrated model's error and the
noise floor, in the channel where their ratio is largest. Values are medians with 95 % bootstrap intervals. "Better"
counts the visible cases in which the method has less error in the worst channel than this diagnosis.

{table(head, map(_method_row, rows))}
"""


def _method_row(row: dict) -> list[str]:
    is_diagnosis, better = row["method"] == DIAGNOSED, row["better"]
    return [
        row["method"],
        "yes" if is_diagnosis else "no",
        *map(_value, (row["clean"], row["visible"], row["closed"])),
        "" if is_diagnosis or not better["n"] else f"{better['k']}/{better['n']}",
    ]


def _value(s: dict) -> str:
    return "" if s["value"] is None else f"{s['value']:.2f} ({s['low']:.2f} to {s['high']:.2f}), {s['n']} cases"


def _detection_rows(detection: dict[str, dict]) -> Iterator[list]:
    for name, found in detection.items():
        points = found["points"]
        half = "" if found["half_size"] is None else f"{found['half_size']:.2g} {found['unit']}".removesuffix(" 1")
        yield [name, len(points), sum(p["detected"] for p in points), sum(p["identified"] for p in points), half]


_MISS_HEAD = ["case", "protocol", "true effects", "size", "error before, in noise floors", "diagnosis", "failure"]


def _miss_row(m: dict) -> list[str]:
    reported = "; ".join(m["identified"] + m["laws"])
    if m["verdict"] == "undecided":
        reported = ", ".join(m["alternatives"])
    # One line without the column separator of Markdown; the end of a failure's output holds the error message.
    failure = " ".join(m["failure"].split()).replace("|", "/")[-160:]
    return [
        f"{m['case']} ({m['kind']})",
        m["recorded"],
        ", ".join(m["truth"]) or "none",
        ", ".join(m["size"]),
        "" if m["error_before"] is None else str(m["error_before"]),
        f"{m['verdict']}{': ' if reported else ''}{reported}",
        failure,
    ]
