"""What the results of many cases say of a diagnosis.

Of a diagnosis only its names, places and probabilities are taken, and its models' predictions of recordings that it has
not seen. The answers are made again from the cases' seeds; a result whose key does not match, or whose diagnosis tried
to reach more than its batch, is refused, and a refused one counts as a failure of whatever was asked of it.
"""

import json
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.stats import binomtest

from proof.cases import draw
from proof.plan import read_plan

SURE = 0.8
MOST = 2
ALTERNATIVES = 4
BINS = 10
RESAMPLES = 2000
COVERAGE = 0.9
# What two repeats of one condition differ by is the floor of one times the square root of two.
VISIBLE = 3 * np.sqrt(2)
# Edges of the errors after recalibration, in floors, by which single effects are put together.
FLOORS = (0.0, 1.2, 1.6, 2.5, VISIBLE, np.inf)
NEAR = {("cable", "conduit"), ("load-pulley", "load-end"), ("drive-pulley", "drive-end"), ("load", "load-pulley")}


@dataclass(frozen=True)
class Outcome:
    """A case's answer beside what was said of it.

    Attributes
    ----------
    key : dict
        The answer (`proof.cases.Case.key`).
    said : dict or None
        The diagnosis; None where there is none, or where it was refused.
    why : str
        Why there is none.
    errors : dict
        By channel, "before", "after" and "floor" on kept-back recordings.
    took_s : float
    rivals : dict
        By rival and channel, errors on kept-back recordings.
    """

    key: dict
    said: dict | None
    why: str = ""
    errors: dict = field(default_factory=dict)
    took_s: float = 0.0
    rivals: dict = field(default_factory=dict)

    @property
    def names(self) -> set[str]:
        """Hidden effects."""
        return {t["name"] for t in self.key["truth"]} - {"none"}

    @property
    def verdict(self) -> str:
        """What was said; "none" where nothing was."""
        return self.said["verdict"] if self.said else "none"

    @property
    def named(self) -> list[dict]:
        """Mechanisms named; none where more were than a diagnosis may name."""
        named = self.said["mechanisms"] if self.said and self.verdict == "explained" else []
        return named if len(named) <= MOST else []

    @property
    def first(self) -> str | None:
        """The mechanism named first."""
        return self.named[0]["name"] if self.named else None

    @property
    def open_set(self) -> list[str]:
        """Names between which a diagnosis is undecided."""
        if self.verdict != "undecided":
            return []
        return list(dict.fromkeys(c["name"] for c in self.said["mechanisms"] + self.said["alternatives"]))[
            :ALTERNATIVES
        ]

    @property
    def claims(self) -> list[tuple[float, bool]]:
        """Every probability that was stated, and whether it was of a hidden effect."""
        said = self.said["mechanisms"] + self.said["alternatives"] if self.said else []
        return [(c["confidence"], c["name"] in self.names) for c in said]

    @property
    def size(self) -> float:
        """Error after recalibration over the floor, in the channel where it is largest; NaN where it is not known."""
        return max((e["before"] / e["floor"] for e in self.errors.values()), default=np.nan)

    @property
    def left(self) -> float:
        """Error after the diagnosis over the floor, in the channel where it is largest."""
        return max((e["after"] / e["floor"] for e in self.errors.values()), default=np.nan)

    @property
    def is_visible(self) -> bool:
        """Whether recalibration leaves three times what two repeats differ by; counted so where it is not known."""
        return not self.errors or self.size >= VISIBLE

    @property
    def closed(self) -> float | None:
        """Share of the gap between recalibration and the floor that was closed, where it is largest."""
        if not self.errors or self.size < 1.5:
            return None
        e = max(self.errors.values(), key=lambda e: e["before"] / e["floor"])
        return (e["before"] - e["after"]) / (e["before"] - e["floor"])

    @property
    def is_noticed(self) -> bool:
        """Whether the diagnosis says that something is missing."""
        return self.verdict not in ("agrees", "none")

    @property
    def is_named_first(self) -> bool:
        """Whether what it names first is hidden."""
        return self.first in self.names

    @property
    def confidently_wrong(self) -> bool:
        """Whether a name stated with confidence is of nothing that is hidden, or too many were named."""
        said = self.said["mechanisms"] if self.said else []
        return len(said) > MOST or any(c["confidence"] >= SURE and c["name"] not in self.names for c in said)


def outcome(result: dict) -> Outcome:
    """Put the answer, made again from its seed, beside a result of `proof.judge.judge`."""
    case = draw(result["seed"], **result["asked"])
    why = refusal(result, case)
    said = None if why else result["diagnosis"]
    errors = result["errors"] if said else {}
    return Outcome(
        case.key, said, why or result["why"] or "", errors, result["took_s"], result["rivals"] if said else {}
    )


def refusal(result: dict, case) -> str:
    """Why a result does not count as one of a case, made again from its seed; empty where it does."""
    if result["tampering"]:
        return "refused: it " + "; ".join(result["tampering"][:3])
    if result["key"] != case.digest or result["case"] != case.name:
        return "refused: the key made from the seed is not the one whose digest was left"
    return ""


def read_outcomes(folder: Path, names: Sequence[str] | None = None) -> list[Outcome]:
    """Outcomes of the ``result.json`` of each named folder in a folder, or of all; in the order of their names."""
    files = (
        sorted(folder.glob("*/result.json")) if names is None else [folder / n / "result.json" for n in sorted(names)]
    )
    return [outcome(json.loads(file.read_text())) for file in files]


def same_place(a: str | None, b: str | None) -> bool:
    """Whether two places are one, or so close that no recording tells them apart."""
    return a is not None and (a == b or (a, b) in NEAR or (b, a) in NEAR)


def right_place(o: Outcome) -> bool:
    """Whether the place said to be wrong is that of a hidden effect."""
    return bool(o.said) and any(same_place(o.said["place"], t["place"]) for t in o.key["truth"])


def count(
    what: str, outcomes: Iterable[Outcome], is_right: Callable[[Outcome], bool], target: float | None = None
) -> dict:
    """A rate with its Wilson interval, and whether it is what it must be."""
    right = [is_right(o) for o in outcomes]
    return rate(what, sum(right), len(right), target)


def rate(what: str, k: int, n: int, target: float | None = None) -> dict:
    """`k` of `n` with the 95 % Wilson interval."""
    if n == 0:
        return {"what": what, "k": 0, "n": 0, "rate": None, "low": None, "high": None, "target": target}
    interval = binomtest(int(k), n).proportion_ci(0.95, method="wilson")
    return {
        "what": what,
        "k": int(k),
        "n": n,
        "rate": k / n,
        "low": interval.low,
        "high": interval.high,
        "target": target,
    }


def bootstrap(what: str, values: Sequence, of: Callable[[Sequence], float], target: float | None = None) -> dict:
    """A statistic of values with its 95 % bootstrap interval (percentiles, a fixed seed)."""
    if not len(values):
        return {"what": what, "n": 0, "value": None, "low": None, "high": None, "target": target}
    random = np.random.default_rng(0)
    values = list(values)
    again = [of([values[i] for i in random.integers(len(values), size=len(values))]) for _ in range(RESAMPLES)]
    low, high = np.percentile(again, [2.5, 97.5])
    return {
        "what": what,
        "n": len(values),
        "value": float(of(values)),
        "low": float(low),
        "high": float(high),
        "target": target,
    }


def rates(outcomes: Sequence[Outcome]) -> list[dict]:
    """Every rate that the proof is after; a target is a least rate."""
    of_kind = defaultdict(list)
    for o in outcomes:
        of_kind[o.key["kind"]].append(o)
    clean, pairs, poor = of_kind["clean"], of_kind["pair"], of_kind["poor"]
    outside = of_kind["unlisted"] + of_kind["removed"]
    singles = of_kind["single"]
    rich = [o for o in singles if o.key["protocol"] == "rich"]
    seen, rich_seen = [o for o in singles if o.is_visible], [o for o in rich if o.is_visible]

    def open_or_right(o):
        return o.is_named_first or bool(o.names & set(o.open_set))

    return [
        count("a verdict at all", outcomes, lambda o: o.said is not None, 1.0),
        count("clean: not accused", clean, lambda o: o.verdict == "agrees", 0.98),
        count("single, visible: noticed", seen, lambda o: o.is_noticed, 0.95),
        count("single, visible: right place", seen, right_place, 0.95),
        count("single, rich, visible: named first", rich_seen, lambda o: o.is_named_first, 0.90),
        count("single, rich, of any size: named first", rich, lambda o: o.is_named_first),
        count("single, of any size: named, or undecided with it", singles, open_or_right),
        count("not confidently wrong", outcomes, lambda o: not o.confidently_wrong, 0.98),
        count(
            "outside the list: unexplained or undecided",
            outside,
            lambda o: o.verdict in ("unexplained", "undecided"),
            0.85,
        ),
        count("outside the list: unexplained", outside, lambda o: o.verdict == "unexplained"),
        count(
            "outside the list, visible: noticed",
            [o for o in outside if o.is_visible],
            lambda o: o.is_noticed,
        ),
        count(
            "outside the list, noticed: right place",
            [o for o in outside if o.is_noticed],
            right_place,
        ),
        count("pair: both named", pairs, lambda o: o.names <= {m["name"] for m in o.named}, 0.75),
        count("pair: one named", pairs, lambda o: bool(o.names & {m["name"] for m in o.named})),
        count("poor protocol: undecided with it, or right", poor, open_or_right),
        count(
            "undecided: the truth among the alternatives",
            _undecided(outcomes),
            lambda o: bool(o.names & set(o.open_set)),
        ),
        count("90 % intervals that hold the truth", *_held(outcomes), COVERAGE),
    ]


def _undecided(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Undecided ones whose effect stands in the list: only there could it be an alternative."""
    return [
        o
        for o in outcomes
        if o.verdict == "undecided" and o.names and not any(n.startswith("unlisted") for n in o.names)
    ]


def _held(outcomes):
    values = compared_values(outcomes)
    return values, lambda v: v["low"] <= v["true"] <= v["high"]


def compared_values(outcomes: Iterable[Outcome]) -> list[dict]:
    """Values of rightly named effects beside the truth, for parameters that mean the same to both."""
    found = []
    for o in outcomes:
        for m in o.named:
            for truth in o.key["truth"]:
                if truth["name"] == m["name"] and same_place(m["place"], truth["place"]):
                    found += [
                        {
                            "case": o.key["case"],
                            "effect": m["name"],
                            "parameter": p["name"],
                            "true": truth["values"][p["name"]],
                        }
                        | {k: p[k] for k in ("value", "low", "high")}
                        for p in m["parameters"]
                        if p["name"] in truth["values"] and p.get("low") is not None
                    ]
    return found


def statistics(outcomes: Sequence[Outcome]) -> list[dict]:
    """What is no rate, with bootstrap intervals over cases."""
    closed = [o.closed for o in outcomes if o.key["kind"] in ("single", "pair", "poor") and o.closed is not None]
    clean = [o.left for o in outcomes if o.key["kind"] == "clean" and o.errors]
    left = [o.left for o in outcomes if o.key["kind"] in ("single", "pair") and o.errors]
    off = [abs(v["value"] - v["true"]) / abs(v["true"]) for v in compared_values(outcomes) if v["true"]]
    sizes = [len(o.open_set) for o in outcomes if o.verdict == "undecided"]
    claiming = [o for o in outcomes if o.claims]
    return [
        bootstrap("expected calibration error of stated probabilities", claiming, calibration_error, 0.05),
        bootstrap("share of the gap to the floor closed, median", closed, np.median, 0.85),
        bootstrap("single and pair: error after, over the floor, worst channel, median", left, np.median),
        bootstrap("clean: error after, over the floor, worst channel, median", clean, np.median),
        bootstrap("values: relative error, median", off, np.median),
        bootstrap("undecided: alternatives, mean", sizes, np.mean),
        bootstrap(
            "seconds of one core a case, rig, predictions and rivals included, median",
            [o.took_s for o in outcomes],
            np.median,
        ),
    ]


def rivalry(outcomes: Iterable[Outcome]) -> list[dict]:
    """Each rival beside recalibration alone and the diagnosis, on the cases that it was held to.

    The error is that over the floor in the worst channel; the gap is closed as `Outcome.closed` has it.
    """
    held = [o for o in outcomes if o.rivals]
    if not held:
        return []
    rows = []
    for name in ("recalibration alone", *held[0].rivals, "this diagnosis"):
        row = {"rival": name}
        for what, some in (
            ("clean", [o for o in held if o.key["kind"] == "clean"]),
            ("visible", [o for o in held if o.names and o.is_visible]),
        ):
            row[what] = bootstrap(what, [max(_over_floor(o, name)) for o in some], np.median)
            if what == "visible":
                row["closed"] = bootstrap("closed", [_closed_by(o, name) for o in some], np.median)
                row["nearer"] = count("nearer than this diagnosis", some, lambda o, name=name: _is_nearer(o, name))
        rows.append(row)
    return rows


def _after(o: Outcome, rival: str) -> dict[str, float]:
    """By channel, the error on kept-back recordings that a rival leaves."""
    which = {"recalibration alone": "before", "this diagnosis": "after"}.get(rival)
    return {c: e[which] for c, e in o.errors.items()} if which else o.rivals[rival]


def _over_floor(o: Outcome, rival: str) -> list[float]:
    return [error / o.errors[c]["floor"] for c, error in _after(o, rival).items()]


def _is_nearer(o: Outcome, rival: str) -> bool:
    return max(_over_floor(o, rival)) < max(_over_floor(o, "this diagnosis"))


def _closed_by(o: Outcome, rival: str) -> float:
    channel, e = max(o.errors.items(), key=lambda item: item[1]["before"] / item[1]["floor"])
    return (e["before"] - _after(o, rival)[channel]) / (e["before"] - e["floor"])


def reliability(outcomes: Iterable[Outcome]) -> list[dict]:
    """Stated probabilities in tenths: how many, their mean, and how often they were right."""
    claims = [c for o in outcomes for c in o.claims]
    bins = []
    for b in range(BINS):
        inside = [c for c in claims if min(int(c[0] * BINS), BINS - 1) == b]
        if inside:
            mean = float(np.mean([c[0] for c in inside]))
            bins.append({"stated": mean} | rate(f"{b / BINS:.1f}", sum(c[1] for c in inside), len(inside)))
    return bins


def calibration_error(outcomes: Iterable[Outcome]) -> float:
    """Expected calibration error: |stated - right| in the mean over all claims."""
    bins = reliability(outcomes)
    claims = sum(b["n"] for b in bins)
    return float(sum(b["n"] * abs(b["stated"] - b["rate"]) for b in bins) / claims)


def confusion(outcomes: Iterable[Outcome]) -> dict[str, dict[str, int]]:
    """Of single effects and clean cases: how often each was called what."""
    table: dict[str, Counter] = defaultdict(Counter)
    for o in outcomes:
        if len(o.key["truth"]) == 1:
            table[o.key["truth"][0]["name"]][o.first or o.verdict] += 1
    return {name: dict(table[name]) for name in sorted(table, key=lambda name: (name != "none", name))}


def detection(outcomes: Iterable[Outcome]) -> dict[str, dict]:
    """By effect: unit, the sizes it is drawn from, what was noticed and named, and where half would be noticed."""
    plan = read_plan()
    drawn = {**plan.effects, **plan.unlisted}
    points = defaultdict(list)
    for o in outcomes:
        if o.key["kind"] in ("single", "unlisted"):
            (truth,) = o.key["truth"]
            points[truth["name"]].append(
                {
                    "strength": truth["strength"],
                    "size": abs(truth["size"]),
                    "over_floor": None if np.isnan(o.size) else o.size,
                    "noticed": o.is_noticed,
                    "named": o.is_named_first,
                }
            )
    return {
        name: {"unit": drawn[name].unit, "drawn": drawn[name].size, "points": sorted(p, key=lambda q: q["size"])}
        | _half(p)
        for name, p in sorted(points.items())
    }


def noticing(outcomes: Iterable[Outcome]) -> list[dict]:
    """Single effects of all kinds together: how many were noticed and named, by how visible they are."""
    singles = [o for o in outcomes if o.key["kind"] == "single" and o.errors]
    found = []
    for low, high in pairwise(FLOORS):
        inside = [o for o in singles if low <= o.size < high]
        if inside:
            row = {"low": low, "high": high, "size": float(np.median([o.size for o in inside]))}
            row["noticed"] = count("noticed", inside, lambda o: o.is_noticed)
            row["named"] = count("named first", inside, lambda o: o.is_named_first)
            found.append(row)
    return found


def _half(points: list[dict]) -> dict:
    """Logistic curve of noticing over the logarithm of size, drawn weakly to a middle size and a slope of its own."""
    x = np.log([p["size"] for p in points])
    y = np.array([p["noticed"] for p in points], float)
    if len(points) < 4 or y.min() == y.max():
        return {"half_size": None, "slope": None}

    def cost(parameters):
        middle, log_slope = parameters
        z = np.exp(log_slope) * (x - middle)
        return np.sum(np.logaddexp(0, z) - y * z) + (log_slope - np.log(3)) ** 2 + ((middle - x.mean()) / 3) ** 2

    middle, log_slope = minimize(cost, [x.mean(), np.log(3)], method="Nelder-Mead").x
    return {"half_size": float(np.exp(middle)), "slope": float(np.exp(log_slope))}


def misses(outcomes: Iterable[Outcome]) -> list[dict]:
    """Every case on which the diagnosis was not what it should have been, with what it said."""
    return [
        {
            "case": o.key["case"],
            "kind": o.key["kind"],
            "recorded": o.key["recorded"],
            "truth": [f"{t['name']} at {t['place']}" for t in o.key["truth"] if t["place"]],
            "size": [f"{t['size']:.3g} {t['unit']}".removesuffix(" 1") for t in o.key["truth"] if t["place"]],
            "over_floor": None if np.isnan(o.size) else round(float(o.size), 2),
            "verdict": o.verdict,
            "named": [f"{m['name']} at {m['place']} ({m['confidence']:.2f})" for m in o.named],
            "alternatives": o.open_set,
            "why": o.why,
        }
        for o in outcomes
        if not is_right(o)
    ]


def is_right(o: Outcome) -> bool:
    """Whether a diagnosis is what it should be; one of an effect too small to see may also agree."""
    if o.said is None or o.confidently_wrong:
        return False
    match o.key["kind"]:
        case "clean":
            return o.verdict == "agrees"
        case "unlisted" | "removed":
            return o.verdict in ("unexplained", "undecided") or (o.verdict == "agrees" and not o.is_visible)
        case "pair":
            return o.names <= {m["name"] for m in o.named}
        case "poor":
            return o.is_named_first or bool(o.names & set(o.open_set)) or (o.verdict == "agrees" and not o.is_visible)
        case _:
            return o.is_named_first or (o.verdict in ("agrees", "undecided") and not o.is_visible)


def score(outcomes: Sequence[Outcome]) -> dict:
    """All of it, as it is written."""
    return {
        "cases": len(outcomes),
        "kinds": dict(Counter(o.key["kind"] for o in outcomes)),
        "rates": rates(outcomes),
        "statistics": statistics(outcomes),
        "rivals": rivalry(outcomes),
        "reliability": reliability(outcomes),
        "detection": detection(outcomes),
        "noticing": noticing(outcomes),
        "confusion": confusion(outcomes),
        "kept_back": [
            {"case": o.key["case"], "kind": o.key["kind"], "before": o.size, "after": o.left}
            for o in outcomes
            if o.errors
        ],
        "values": compared_values(outcomes),
        "misses": misses(outcomes),
    }
