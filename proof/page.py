"""The proof's page, `docs/proof.md`."""

import os
import subprocess
from datetime import date
from pathlib import Path

from proof.plan import PLAN

TITLES = {
    "proof-noticing.png": "How often single effects are noticed and named, by what recalibration alone leaves of them",
    "proof-detection.png": "Every case of one effect at its size, by what was made of it; a curve where there are four",
    "proof-reliability.png": "Stated probabilities and how often they were right; numbers are claims",
    "proof-kept-back.png": "Errors on recordings that were kept back, in the channel that is off most",
    "proof-confusion.png": "What clean cases and those of one effect were called, of all kinds and protocols",
}


def page(scored: dict, figures: list[str], figure_folder: Path, page_file: Path, command: str, part: str) -> str:
    """The page's text.

    Parameters
    ----------
    scored : dict
        As `proof.score.score` gives it.
    figures : list of str
        File names in `figure_folder`.
    figure_folder, page_file : Path
    command : str
        What made the results.
    part : str
        Which cases these are, in a sentence.
    """
    plan = os.path.relpath(PLAN, page_file.parent)
    beside = Path(os.path.relpath(figure_folder, page_file.parent))
    kinds = ", ".join(f"{n} {kind}" for kind, n in sorted(scored["kinds"].items()))
    pictures = "\n\n".join(f"{TITLES[name]}:\n\n![{TITLES[name]}]({beside / name})" for name in figures)
    return f"""# Proof on concealed effects

Made by `{command}` on {date.today().isoformat()}, commit {commit()}. {part}

{scored["cases"]} cases: {kinds}. Each is a rig of its own, drawn from a seed: values, estimates that are off, an effect
or two with their size and place, a protocol, noise, and what varies from run to run
([what is drawn]({plan})). The diagnosis ran on a copy of the batch in an otherwise empty folder, in a process whose
files, imports, programs and connections are refused outside it; no answer was on disk. What was kept back was recorded
after it had ended.

"Visible" are cases in which recalibration alone leaves, on kept-back recordings, three times what two repeats differ by
(3 sqrt(2) times the floor) in some channel. The floor is what the true physics leaves: noise, zeros, encoder steps and
one per cent of friction. "Open" is what more cases would decide: the interval holds what must be. Places that no
recording tells apart count as one (cable and conduit; a pulley and its cable end; the load and its pulley).

## Rates

{table(["", "", "rate", "95 % (Wilson)", "must be", ""], map(_rate_row, scored["rates"]))}

## Sizes

{table(["", "over", "value", "95 % (bootstrap)", "must be", ""], map(_statistic_row, scored["statistics"]))}

{_missed(scored)}
{_rivals(scored["rivals"])}
## Figures

{pictures}

## Where each effect begins to be seen

{table(["effect", "cases", "noticed", "named first", "half are noticed at"], _detection_rows(scored["detection"]))}

## Every miss

{table(_MISS_HEAD, map(_miss_row, scored["misses"])) if scored["misses"] else "None."}
"""


def commit() -> str:
    """The checkout's commit, and whether anything was changed since."""
    say = subprocess.run(
        ["git", "describe", "--always", "--dirty", "--abbrev=10"],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
    )
    return say.stdout.strip().replace("-dirty", " with changes") or "unknown"


def table(head, rows) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def _rate_row(r):
    if r["rate"] is None:
        return [r["what"], "0", "", "", _must(r), "no case"]
    held = "" if r["target"] is None else _kept(r)
    return [r["what"], f"{r['k']}/{r['n']}", f"{r['rate']:.1%}", f"{r['low']:.1%} to {r['high']:.1%}", _must(r), held]


def _must(r) -> str:
    return "" if r["target"] is None else f"{r['target']:.0%}"


def _kept(r) -> str:
    """Whether a rate is what it must be: a coverage within its interval, any other at least."""
    if r["what"].startswith("90 %"):
        return "yes" if r["low"] <= r["target"] <= r["high"] else "**no**"
    return _said(r["rate"] >= r["target"], r["low"] < r["target"] < r["high"])


def _said(is_reached: bool, is_open: bool) -> str:
    return ("yes" if is_reached else "**no**") + (", open" if is_open else "")


def _statistic_row(s):
    if s["value"] is None:
        return [s["what"], "0", "", "", "", "no case"]
    must = "" if s["target"] is None else f"{s['target']:g}"
    held = "" if s["target"] is None else _said(_reached(s), s["low"] < s["target"] < s["high"])
    return [s["what"], s["n"], f"{s['value']:.3g}", f"{s['low']:.3g} to {s['high']:.3g}", must, held]


def _reached(s) -> bool:
    """An error must be at most its target, a share at least."""
    return s["value"] <= s["target"] if "error" in s["what"] else s["value"] >= s["target"]


def _missed(scored) -> str:
    rates = [
        r["what"] for r in scored["rates"] if r["target"] is not None and r["rate"] is not None and "no" in _kept(r)
    ]
    sizes = [
        s["what"]
        for s in scored["statistics"]
        if s["target"] is not None and s["value"] is not None and not _reached(s)
    ]
    if not rates + sizes:
        return "Nothing that there are cases for is missed."
    return "Missed: " + "; ".join(rates + sizes) + ". Of the cases behind it the visible ones are listed below."


def _rivals(rows) -> str:
    """The section on rivals; nothing where none was held to these cases."""
    if not rows:
        return ""
    head = ["", "says what and where", "clean", "visible", "share of the gap closed, visible", "nearer, visible"]
    lines = [
        [
            r["rival"],
            "yes" if r is rows[-1] else "no",
            *map(_value, (r["clean"], r["visible"], r["closed"])),
            "" if r is rows[-1] or not r["nearer"]["n"] else f"{r['nearer']['k']}/{r['nearer']['n']}",
        ]
        for r in rows
    ]
    return f"""
## Rivals under the same data

Each starts from the calibrated model. Errors on kept-back recordings over the floor in the worst channel, and the share
of the gap to the floor closed in the channel that was off most: medians, with bootstrap intervals. "Nearer" counts the
visible cases in which a rival leaves less in the worst channel than this diagnosis does.

{table(head, lines)}
"""


def _value(s) -> str:
    return "" if s["value"] is None else f"{s['value']:.2f} ({s['low']:.2f} to {s['high']:.2f}), {s['n']} cases"


def _detection_rows(detection):
    for name, found in detection.items():
        points = found["points"]
        half = "" if found["half_size"] is None else f"{found['half_size']:.2g} {found['unit']}".removesuffix(" 1")
        yield [name, len(points), sum(p["noticed"] for p in points), sum(p["named"] for p in points), half]


_MISS_HEAD = ["case", "recorded", "hidden", "size", "before, in floors", "said", "why there is nothing"]


def _miss_row(m):
    said = "; ".join(m["named"]) or (", ".join(m["alternatives"]) if m["verdict"] == "undecided" else "")
    report = " ".join(m["why"].split()).replace("|", "/")[-160:]
    return [
        f"{m['case']} ({m['kind']})",
        m["recorded"],
        ", ".join(m["truth"]) or "nothing",
        ", ".join(m["size"]),
        "" if m["over_floor"] is None else m["over_floor"],
        f"{m['verdict']}{': ' if said else ''}{said}",
        report,
    ]
