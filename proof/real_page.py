"""The page on measured recordings with something put into them, `docs/real-concealment.md`."""

import json
from collections.abc import Sequence
from datetime import date
from pathlib import Path

from proof.page import commit, table
from proof.real import ALLOWED, MODEL, RealPlan
from proof.real_score import RealOutcome, found_size, is_right, made_of, moved, raised, untouched_of

# What people make of the tables stands below this line of the page and stays when the tables are made again.
BY_HAND = "## What follows from it"
SHORT = {
    "stiffness_N_per_m": "stiffness",
    "friction_coefficient": "friction",
    "spring_beside_load_Nm_per_rad": "spring",
    "pretension_N": "pretension",
    "load_radius_m": "ratio",
    "tau_in_zero_Nm": "zero of tau_in",
    "tau_out_zero_Nm": "zero of tau_out",
}


def real_page(outcomes: Sequence[RealOutcome], plan: RealPlan, in_use: Path, earlier: str = "") -> str:
    """The page's text.

    Parameters
    ----------
    outcomes : sequence of RealOutcome
    plan : RealPlan
    in_use : Path
        Folder of the model in use.
    earlier : str
        The page as it stands, of which what was written by hand is kept.
    """
    model = json.loads((in_use / MODEL).read_text(encoding="utf-8"))
    allowed = json.loads((in_use / ALLOWED).read_text(encoding="utf-8"))
    first = json.loads((in_use / "first" / "diagnosis.json").read_text(encoding="utf-8"))
    untouched = untouched_of(outcomes)
    groups = {name: [o for o in outcomes if o.case.group == name] for name in ("put in", "taken out", "paper")}
    judged = [is_right(o, untouched) for o in outcomes]
    took = sorted(o.took_s for o in outcomes)
    by_hand = earlier[earlier.index(BY_HAND) :] if BY_HAND in earlier else f"{BY_HAND}\n\nNot written yet.\n"
    return f"""# Something put into measured recordings

Made by `make proof-real` on {date.today().isoformat()}, commit {commit()}; the diagnosis's sources have the digest
{allowed["diagnosis"]}.

**Measured** are the recordings: `{plan.batch}` of MRDLab/mis-tool-characterization, a da Vinci grasper ([what they
are](real-instrument.md)). **Put in** is one thing at a time, by arithmetic on the raw counts, into all recordings
alike; nothing else is changed, and the recordings themselves are in no commit. What is put in and how large is drawn
from a seed ([bounds and sources](../proof/real.yaml)); the diagnosis ran in a process of its own that can reach a copy
of the batch and the model in use, and nothing else. No answer was on disk, and names say nothing.

**The model in use** was found from {len(plan.known)} recordings ({_ids(plan.known)}) as any owner would find it, with
{100 * plan.allowance:g} % of peak to peak allowed: `{first["verdict"]}`, {_listed(model)}.
Of what was allowed, {first["fit"]["mean_square"]["calibrated"]:.2f} in the mean square is left by the calibrated model
on recordings held out, and {_nearest_left(first):.2f} by it with these.
It is not the whole truth. Allowed from then on was therefore the first of a ladder with which a diagnosis of these same
recordings beside the model says that nothing else is missing: {_ladder(allowed)}.
The other {len(plan.watched)} recordings ({_ids(plan.watched)}) are the watched ones: diagnosed beside the model with
{100 * allowed["allowance"]:g} % allowed, every number of it fitted anew.

{sum(r is True for r in judged)} of {sum(r is not None for r in judged)} are right; a diagnosis took
{took[len(took) // 2]:.0f} s of one core in the middle, {took[-1]:.0f} s at most.

## Untouched

{_untouched(untouched)}

## Put in

"Changed" is the standard deviation of what was changed, as a share of the channel's peak to peak. "As it
stands" is the error of the model in use with nothing fitted anew, as a multiple of its error on the untouched
recordings. "Left" is the mean square over what was allowed after everything was calibrated anew: what does not rise
above the untouched {_left(untouched)} was absorbed. "Moved" are recalibrated numbers that are off the untouched
recordings' by more than 5 %. Right is: named or undecided with it, at its place; of what the list does not know,
`unexplained` or `undecided`; of drag that the model in use has a number for, that the number takes it up.

{_rows(_PUT_IN_HEAD, [_put_in_row(o, plan, untouched) for o in groups["put in"]])}

## Taken out of the model in use

The same untouched recordings beside the model without one of its mechanisms: on the list it should be named, off the
list it should turn into `unexplained` at the same place.

{_rows(_TAKEN_HEAD, [_taken_row(o, untouched) for o in groups["taken out"]])}

## Beside the paper's model

The same untouched recordings, no model in use, the same share allowed.

{_rows(_PAPER_HEAD, [_paper_row(o) for o in groups["paper"]])}

{by_hand}"""


_PUT_IN_HEAD = [
    "put in",
    "size",
    "changed",
    "as it stands",
    "left",
    "said",
    "which is",
    "right",
    "place said",
    "size found",
    "moved",
]
_TAKEN_HEAD = ["taken out", "of", "off the list", "left", "said", "which is", "right", "place said", "size found"]
_PAPER_HEAD = ["off the list", "left", "said", "place said", "left by it"]


def _rows(head: list[str], rows: list[list[str]]) -> str:
    return table(head, rows) if rows else "Not run."


def _put_in_row(o: RealOutcome, plan: RealPlan, untouched: RealOutcome | None) -> list[str]:
    unit = plan.put_in[o.case.kind].unit
    changed = ", ".join(f"{c} {100 * share:.1f} %" for c, share in o.changed.items())
    shifts = ", ".join(f"{_short(n)} {_share(s)}" for n, s in list(moved(o, untouched).items())[:4])
    return [
        o.case.kind.replace("-", " "),
        _sized(o.case.size, unit),
        changed,
        ", ".join(f"{c.rpartition('_')[0]} {r:.1f}" for c, r in raised(o, untouched).items()),
        _left(o),
        _said(o),
        made_of(o),
        _yes(is_right(o, untouched)),
        _place(o),
        _sized(found_size(o, untouched), unit),
        shifts,
    ]


def _taken_row(o: RealOutcome, untouched: RealOutcome | None) -> list[str]:
    unit = ""
    return [
        o.case.left_out,
        _sized(o.truth.size, unit),
        "yes" if o.case.without else "",
        _left(o),
        _said(o),
        made_of(o),
        _yes(is_right(o, untouched)),
        _place(o),
        _sized(found_size(o, untouched), unit),
    ]


def _paper_row(o: RealOutcome) -> list[str]:
    return [", ".join(o.case.without) or "nothing", _left(o), _said(o), _place(o), _best_left(o)]


def _untouched(o: RealOutcome | None) -> str:
    if o is None:
        return "Not run."
    standing = " and ".join(
        f"{1e3 * e:.1f} m{c.rpartition('_')[2].replace('Nm', 'N m')} in {c.rpartition('_')[0]}"
        for c, e in o.standing.items()
    )
    return f"""`{_said(o)}`: {made_of(o)}. Recalibrated, {_left(o)} of what was allowed is left. As it stands, nothing
fitted anew, the model in use predicts these recordings to {standing} (root mean square, the mean of each recording
aside)."""


def _said(o: RealOutcome) -> str:
    """The verdict and who it is about."""
    if not o.said:
        return f"none ({o.why[-120:]})"
    claims = [*o.said["mechanisms"], *(o.said["alternatives"] if o.verdict == "undecided" else [])]
    if claims:
        return f"{o.verdict}: " + "; ".join(f"{m['name']} at {m['place']} ({m['confidence']:.2f})" for m in claims)
    return f"{o.verdict}, nearest {' + '.join(o.nearest)}" if o.nearest else o.verdict


def _left(o: RealOutcome | None) -> str:
    return f"{o.said['left']['calibrated']:.3f}" if o and o.said else ""


def _best_left(o: RealOutcome) -> str:
    if not o.said:
        return ""
    said = {"nearest": o.said.get("nearest"), "fit": {"mean_square": o.said["left"]}}
    return f"{_nearest_left(said):.3f}"


def _nearest_left(said: dict) -> float:
    """What the best hypothesis left, right or not."""
    return said["nearest"]["mean_square"] if said["nearest"] else said["fit"]["mean_square"]["extended"]


def _place(o: RealOutcome) -> str:
    return (o.said or {}).get("place") or ""


def _sized(value: float | None, unit: str) -> str:
    return "" if value is None else f"{value:.3g} {unit}".removesuffix(" 1").strip()


def _share(moved: float) -> str:
    """A change as per cent, one that is more than fivefold as a multiple."""
    return f"{100 * moved:+.0f} %" if moved < 4 else f"times {1 + moved:.0f}"


def _short(name: str) -> str:
    return SHORT.get(name, name.rpartition("/")[2])


def _yes(right: bool | None) -> str:
    return "" if right is None else "yes" if right else "**no**"


def _ids(names: Sequence[str]) -> str:
    return ", ".join(name.removeprefix("trial-") for name in names)


def _listed(model: dict) -> str:
    values = [
        (m["name"], m["place"], ", ".join(f"{n} {v:.3g}" for n, v in m["values"].items())) for m in model["mechanisms"]
    ]
    return " and ".join(f"{name} at {place} ({value})" for name, place, value in values)


def _ladder(allowed: dict) -> str:
    return ", ".join(
        f"{100 * float(a):g} % ({t['verdict']}, {t['left']:.3f} left)" for a, t in allowed["tried"].items()
    )
