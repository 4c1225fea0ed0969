"""The page on measured recordings with something put into them, `docs/real-concealment.md`."""

import json
from collections.abc import Sequence
from datetime import date
from pathlib import Path

from proof.page import commit, table
from proof.real.cases import acting_of
from proof.real.plan import RealPlan
from proof.real.run import ALLOWED, MODEL
from proof.real.score import RealOutcome, found_size, is_right, is_size_found, made_of

# What people make of the tables stands below this line of the page and stays when the tables are made again.
BY_HAND = "## What follows from it"


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
    model, allowed, first = (
        json.loads((in_use / file).read_text(encoding="utf-8")) for file in (MODEL, ALLOWED, "first/diagnosis.json")
    )
    untouched = next((o for o in outcomes if not o.case.kind and not o.case.left_out), None)
    took = sorted(o.took_s for o in outcomes)
    sizes = [is_size_found(o) for o in outcomes if made_of(o).startswith("named") and is_right(o)]
    by_hand = earlier[earlier.index(BY_HAND) :] if BY_HAND in earlier else f"{BY_HAND}\n\nNot written yet.\n"
    return f"""# Something put into measured recordings

Made by `make proof-real` on {date.today().isoformat()}, commit {commit()}; the diagnosis's sources have the digest
{allowed["diagnosis"]}.

**Measured** are the recordings: `{plan.batch}` of MRDLab/mis-tool-characterization, a da Vinci grasper ([what they
are](real-instrument.md)). **Put in** is one thing at a time, by arithmetic on the raw counts, into all recordings
alike; nothing else is changed, and the recordings themselves are in no commit. What is put in and how large is drawn
from a seed ([bounds and sources](../proof/real/plan.yaml)); the diagnosis ran in a process of its own that can reach a
copy of the batch and the model in use, and nothing else. No answer was on disk, and names say nothing.

**The model in use** was found from {len(plan.known)} recordings ({_ids(plan.known)}) as any owner would find it, with
{100 * plan.allowance:g} % of peak to peak allowed: `{first["verdict"]}`{_nearest_words(first)}: {_listed(model)}.
It leaves {_nearest_left(first):.2f} of what was allowed, in the mean square, on recordings held out. It is not the
whole truth. Allowed from then on was therefore the first of a ladder with which a diagnosis of these same recordings,
the model held, says that nothing else is missing: {_ladder(allowed)}.

The other {len(plan.watched)} recordings ({_ids(plan.watched)}) are the watched ones. They are diagnosed beside the
model with {100 * allowed["allowance"]:g} % allowed, and the model is held (`--hold`): nothing of it is fitted anew but
the zeros of the two torques.

{sum(map(is_right, outcomes))} of {len(outcomes)} are right; {sum(bool(o.wrong_names) for o in outcomes)} are
confidently wrong, that is, something that it is not was named with a probability of 0.8 or more. Of {len(sizes)} that
were named rightly {sum(map(bool, sizes))} have their size to a quarter. A diagnosis took {took[len(took) // 2]:.0f} s
of one core in the middle, {took[-1]:.0f} s at most.

## Untouched

{_untouched(untouched)}

## Put in

"Changed" is the standard deviation of what was changed, as a share of the channel's peak to peak. "Left" is the mean
square that the model, held, leaves of these recordings, over what was allowed. Right is: named or undecided with it, at
its place, or with its equal that no recording tells from it (a gain at one end is one at the other); of what no list
knows, `unexplained` or `undecided` at whatever place, and nothing named confidently.

{_rows(_PUT_IN_HEAD, [_put_in_row(o, plan) for o in outcomes if o.case.kind])}

## Taken out of the model in use

The untouched recordings beside the model without one of its mechanisms. On the list it should be named, with its value;
off the list it should turn into `unexplained` or `undecided`, at the same place.

{_rows(_TAKEN_HEAD, [_taken_row(o) for o in outcomes if o.case.left_out])}

{by_hand}"""


_FOUND_HEAD = ["left", "said", "which is", "right", "place said", "size found"]
_PUT_IN_HEAD = ["put in", "size", "changed", *_FOUND_HEAD]
_TAKEN_HEAD = ["taken out", "of", "off the list", *_FOUND_HEAD]


def _rows(head: list[str], rows: list[list[str]]) -> str:
    return table(head, rows) if rows else "Not run."


def _untouched(o: RealOutcome | None) -> str:
    return f"`{_said(o)}`: {made_of(o)}, {_left(o)} of what was allowed is left." if o else "Not run."


def _put_in_row(o: RealOutcome, plan: RealPlan) -> list[str]:
    unit = plan.put_in[o.case.kind].unit
    changed = ", ".join(f"{c} {100 * share:.1f} %" for c, share in o.changed.items())
    return [o.case.kind.replace("-", " "), _sized(o.case.size, unit), changed, *_found(o, unit)]


def _taken_row(o: RealOutcome) -> list[str]:
    return [o.case.left_out, _sized(o.truth.size, ""), "yes" if o.case.without else "", *_found(o, "")]


def _found(o: RealOutcome, unit: str) -> list[str]:
    right = "yes" if is_right(o) else "**no**"
    place = (o.said or {}).get("place") or ""
    return [_left(o), _said(o), made_of(o), right, place, _sized(found_size(o), unit)]


def _said(o: RealOutcome) -> str:
    """The verdict and who it is about."""
    if not o.said:
        return f"none ({o.why[-120:]})"
    if o.claims:
        return f"{o.verdict}: " + "; ".join(f"{acting_of(m)} ({m['confidence']:.2f})" for m in o.claims)
    nearest = (o.said.get("nearest") or {"mechanisms": []})["mechanisms"]
    return f"{o.verdict}, nearest {' + '.join(map(acting_of, nearest))}" if nearest else o.verdict


def _left(o: RealOutcome) -> str:
    return f"{o.said['left']['calibrated']:.2f}" if o.said else ""


def _nearest_left(said: dict) -> float:
    """What the best hypothesis left, right or not."""
    return said["nearest"]["mean_square"] if said["nearest"] else said["fit"]["mean_square"]["extended"]


def _nearest_words(said: dict) -> str:
    return ", and in use is what came nearest" if said["nearest"] else ""


def _sized(value: float | None, unit: str) -> str:
    return "" if value is None else f"{value:.3g} {unit}".removesuffix(" 1").strip()


def _ids(names: Sequence[str]) -> str:
    return ", ".join(name.removeprefix("trial-") for name in names)


def _listed(model: dict) -> str:
    values = [(acting_of(m), ", ".join(f"{n} {v:.3g}" for n, v in m["values"].items())) for m in model["mechanisms"]]
    return " and ".join(f"{acting} ({value})" for acting, value in values)


def _ladder(allowed: dict) -> str:
    return ", ".join(
        f"{100 * float(a):g} % ({t['verdict']}, {t['left']:.2f} left)" for a, t in allowed["tried"].items()
    )
