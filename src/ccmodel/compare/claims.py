"""What the paper says in words, in numbers: of recordings with intervals, of the model beside them.

A claim is put as quantities of the last cycle over the conditions of a study, or as runs of the model alone. Whether
recordings bear it out is decided by intervals, not by eye: a trend is borne out if every step from one condition to
the next goes the claimed way for certain, contradicted if the whole change goes the other way or is too small to speak
of, and otherwise not determined.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from ccmodel.compare import model_study
from ccmodel.compare.loops import QUANTITIES, measure
from ccmodel.compare.studies import label_of, labelled, origins_of, value_of
from ccmodel.config import Claims, Measuring, ModelStudies
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model.paper import SECTIONS as PAPER_SECTIONS
from ccmodel.model.parameters import Parameters
from ccmodel.recording import Recording
from ccmodel.repeats import Estimate, difference, estimates

Pair = tuple[Recording, Recording | None]
YES, PART, NO, OPEN = "yes", "in part", "no", "not determined"
MODEL_STUDY = "model study (simulated)"


@dataclass(frozen=True)
class Row:
    """A number of a claim: of one quantity in one condition.

    Attributes
    ----------
    quantity, unit, condition : str
        The name in `QUANTITIES` (or of its own), its unit, and what the condition is called.
    at : float
        Value of what varies, in SI units.
    source : str
        Where `value` comes from: recordings, as their origin is called, or the model.
    recordings : int
        How many are behind `value`.
    value, low, high : float or None
        Mean over the recordings and the interval it holds to.
    model : float or None
        What the model says of the same recordings.
    gap : str
        Why there is no number.
    """

    quantity: str
    unit: str
    condition: str
    at: float
    source: str
    recordings: int = 0
    value: float | None = None
    low: float | None = None
    high: float | None = None
    model: float | None = None
    gap: str = ""


@dataclass(frozen=True)
class Claim:
    """Something the paper says, with its numbers.

    Attributes
    ----------
    name, section, says : str
        Our name for it, where it stands in the paper, and what it says in our words.
    borne_out : str
        "yes", "in part", "no" or "not determined".
    sentence : str
        The numbers, for people.
    rows : list of Row
    """

    name: str
    section: str
    says: str
    borne_out: str
    sentence: str
    rows: list[Row] = field(default_factory=list)


@dataclass(frozen=True)
class _Trend:
    """A claim that quantities rise (+1) or fall (-1) with what a study varies; `beside` are told, but judge nothing."""

    name: str
    section: str
    says: str
    variable: str
    quantities: tuple[str, ...]
    way: int
    beside: tuple[str, ...] = ()


_TRENDS = (
    _Trend("backlash-and-bend", "V-A", "the backlash widens with the angle of bend", "bend", ("backlash", "width"), 1),
    _Trend("slope-and-bend", "V-A", "with more bend the loop is less steep while a cable is slack", "bend",
           ("slack_slope",), -1, beside=("slope",)),
    _Trend("slack-and-bend", "V-A", "more bend keeps a cable slack for longer", "bend", ("slack_share",), 1),
    _Trend("backlash-and-pretension", "V-B", "the backlash widens with pretension", "pretension",
           ("backlash", "width"), 1),
    _Trend("slack-and-pretension", "V-B", "less pretension keeps a cable slack for longer", "pretension",
           ("slack_share",), -1),
)  # fmt: skip


def claims_of(
    pairs: Mapping[str, Sequence[Pair]], parameters: Parameters | None, claims: Claims, how: Measuring
) -> list[Claim]:
    """All claims, in the order of the paper.

    Parameters
    ----------
    pairs : mapping of str to sequence of (Recording, Recording or None)
        Recordings with what the model says of them, by what varies among them: "bend", "pretension", "radius".
    parameters : Parameters or None
        What the model alone runs with; None where no batch states what is needed.
    claims : Claims
    how : Measuring
    """
    found = [_trend(trend, pairs[trend.variable], claims, how) for trend in _TRENDS]
    found.append(_phases(pairs["pretension"], claims, how))
    found.append(_radius(pairs["radius"], parameters, claims, how))
    return found + _model_claims(parameters, claims, how)


# ------------------------------------------------------------------------------------------------------- of recordings


@dataclass(frozen=True)
class _Series:
    """A quantity over the conditions of a study; conditions that lack it are left out of `estimates`."""

    rows: list[Row]
    estimates: list[Estimate]


def _series(pairs: Sequence[Pair], variable: str, quantity: str, claims: Claims, how: Measuring) -> _Series:
    said_of = {id(recorded): said for recorded, said in pairs}
    conditions: dict[str, list[Recording]] = {}
    for label, recording in labelled((r for r, _ in pairs), variable):
        conditions.setdefault(label, []).append(recording)
    numbers = {label: _numbers(group, quantity, how) for label, group in conditions.items()}
    modelled = {
        label: _numbers([said_of[id(r)] for r in group if said_of[id(r)] is not None], quantity, how)[0]
        for label, group in conditions.items()
    }
    usable = [label for label, (values, _) in numbers.items() if values]
    q = QUANTITIES[quantity]
    means = estimates([numbers[label][0] for label in usable], relative=not q.is_share)
    rows = []
    for label, group in conditions.items():
        place = (quantity, q.unit, label, float(value_of(group[0], variable)), origins_of(group))
        model = float(np.mean(modelled[label])) if modelled[label] else None
        if label not in usable:
            rows.append(Row(*place, model=model, gap=numbers[label][1]))
            continue
        mean = means[usable.index(label)]
        reach = mean.reach(claims.coverage)
        low, high = (None, None) if reach is None else (mean.value - reach, mean.value + reach)
        gap = "" if reach is not None else "no repeats: no interval"
        if q.is_share and low is not None:
            low, high = max(low, 0.0), min(high, 100.0)
        rows.append(Row(*place, mean.count, mean.value, low, high, model, gap))
    return _Series(rows, means)


def _numbers(recordings: Sequence[Recording], quantity: str, how: Measuring) -> tuple[list[float], str]:
    values, gap = [], "no recording"
    for recording in recordings:
        found, gaps = measure(recording, [quantity], how)
        values += found.values()
        gap = gaps.get(quantity, gap)
    return values, gap


def _trend(trend: _Trend, pairs: Sequence[Pair], claims: Claims, how: Measuring) -> Claim:
    told = trend.quantities + trend.beside
    series = {q: _series(pairs, trend.variable, q, claims, how) for q in told}
    verdicts = [_goes(series[q].estimates, trend.way, claims) for q in trend.quantities]
    sentence = " ".join(_told(q, s.rows) for q, s in series.items()) + " " + _model_inside(series)
    rows = [row for s in series.values() for row in s.rows]
    return Claim(trend.name, trend.section, trend.says, _joint(verdicts), sentence, rows)


def _goes(means: Sequence[Estimate], way: int, claims: Claims) -> str:
    """Whether values rise (way +1) or fall from one to the next."""
    if len(means) < 2 or not means[0].freedom:
        return OPEN
    steps = [difference(a, b) for a, b in pairwise(means)]
    if all(way * s.value > s.reach(claims.coverage) for s in steps):
        return YES
    whole = difference(means[0], means[-1])
    reach, mean = whole.reach(claims.coverage), float(np.mean([m.value for m in means]))
    if way * whole.value + reach < max(0.01 * claims.small_percent * abs(mean), 0.0):
        return NO
    return OPEN


def _joint(verdicts: Sequence[str]) -> str:
    kinds = set(verdicts)
    if len(kinds) == 1:
        return kinds.pop()
    return PART if YES in kinds else OPEN


def _phases(pairs: Sequence[Pair], claims: Claims, how: Measuring) -> Claim:
    """Which pretension shows phase IV, and which of its two cases."""
    before = _series(pairs, "pretension", "IVa_share", claims, how)
    through = _series(pairs, "pretension", "IVb_share", claims, how)
    rows = before.rows + through.rows
    says = "a high pretension shows no phase IV, a middling one IVa, a low one IVb as well"
    verdict = OPEN
    if len(before.estimates) > 2 and len(through.estimates) == len(before.estimates):
        a, b = ([e.value > claims.seen_percent for e in s.estimates] for s in (before, through))
        # In rising order of pretension.
        verdict = YES if (a[0], a[-1], b[0], b[-1]) == (True, False, True, False) and any(
            x and not y for x, y in zip(a, b, strict=True)
        ) else NO  # fmt: skip
    series = {"IVa_share": before, "IVb_share": through}
    sentence = " ".join(_told(q, s.rows) for q, s in series.items()) + " " + _model_inside(series)
    return Claim("phases-and-pretension", "V-B", says, verdict, sentence, rows)


def _radius(pairs: Sequence[Pair], parameters: Parameters | None, claims: Claims, how: Measuring) -> Claim:
    """How far the largest and the smallest of the radii's means lie apart."""
    series = {q: _series(pairs, "radius", q, claims, how) for q in ("backlash", "width", "slope")}
    verdicts, told, rows = [], [], []
    for quantity, s in series.items():
        spread = _spread(s, claims)
        model = _spread_percent([r.model for r in s.rows if r.model is not None])
        rows += s.rows
        name = f"{quantity}_spread"
        place = (name, "%", "all radii", np.nan, s.rows[0].source if s.rows else "")
        if spread is None:
            verdicts.append(OPEN)
            rows.append(Row(*place, model=model, gap="fewer than two radii, or no repeats"))
            continue
        value, reach = spread
        low, high = max(0.0, value - reach), value + reach
        small = claims.small_percent
        verdicts.append(YES if high < small else NO if low > small else OPEN)
        rows.append(Row(*place, sum(e.count for e in s.estimates), value, low, high, model))
        told.append(f"{QUANTITIES[quantity].text} {value:.2g} % (at most {high:.2g} %; model {_small(model)} %)")
    sentence = "Between the radii the means differ by: " + "; ".join(told) + "." if told else "Nothing to compare."
    alone = _spread_percent(_alone([r.path for r, _ in pairs], parameters, claims.model, how))
    if alone is not None:
        rows.append(Row("backlash_spread", "%", "all radii, one pretension", np.nan, MODEL_STUDY, model=alone))
        sentence += f" At one and the same pretension the model's backlash differs by {_small(alone)} %."
    return Claim("radius", "V-C", "at one angle of bend the loop's radius makes next to no difference",
                 _joint(verdicts), sentence, rows)  # fmt: skip


def _alone(
    paths: Sequence[ConduitPath], parameters: Parameters | None, study: ModelStudies, how: Measuring
) -> list[float]:
    """Backlash of the model alone on some paths, all at the study's pretension; none where it cannot be run."""
    if parameters is None or parameters.load_stiffness_Nm_per_rad is None:
        return []
    try:
        runs = [model_study.run(parameters, path, parameters.load_stiffness_Nm_per_rad, study) for path in paths]
    except ModelError:
        return []
    return [v for run in runs for v in measure(run, ["backlash"], how)[0].values()]


def _spread(series: _Series, claims: Claims) -> tuple[float, float] | None:
    """Largest less smallest mean, and how sure that is, % of the mean."""
    means = sorted(series.estimates, key=lambda e: e.value)
    if len(means) < 2 or not means[0].freedom:
        return None
    apart = difference(means[0], means[-1])
    scale = 100 / abs(np.mean([m.value for m in means]))
    return float(scale * apart.value), float(scale * apart.reach(claims.coverage))


def _spread_percent(values: Sequence[float]) -> float | None:
    return float(100 * np.ptp(values) / abs(np.mean(values))) if len(values) > 1 else None


def _told(quantity: str, rows: Sequence[Row]) -> str:
    """A sentence with a quantity's numbers in all conditions."""
    q = QUANTITIES[quantity]
    parts = []
    for row in rows:
        model = _three_digits(row.model)
        if row.value is None:
            parts.append(f"{row.condition}: – ({row.gap}; model {model})")
        else:
            reach = "" if row.low is None else f" ({_three_digits(row.low)} to {_three_digits(row.high)})"
            parts.append(f"{row.condition}: {_three_digits(row.value)}{reach}, model {model}")
    unit = "" if q.unit == "1" else f" ({q.unit})"
    return f"{q.text[0].upper()}{q.text[1:]}{unit}: " + "; ".join(parts) + "."


def _three_digits(value: float | None) -> str:
    """A number with three digits that count, trailing zeros among them."""
    if value is None:
        return "–"
    before = int(np.floor(np.log10(abs(value)))) if abs(value) >= 1e-3 else 0
    return f"{value:.{max(0, 2 - before)}f}"


def _model_inside(series: Mapping[str, _Series]) -> str:
    rows = [r for s in series.values() for r in s.rows if r.low is not None and r.model is not None]
    inside = sum(r.low <= r.model <= r.high for r in rows)
    return f"The model lies within {inside} of {len(rows)} intervals." if rows else ""


# --------------------------------------------------------------------------------------------------- of the model alone


def _model_claims(parameters: Parameters | None, claims: Claims, how: Measuring) -> list[Claim]:
    if parameters is None or parameters.load_stiffness_Nm_per_rad is None:
        return []
    try:
        return [
            _load(parameters, claims, how),
            _placement(parameters, claims, how),
            _sections(parameters, claims),
        ]
    except ModelError as error:
        return [Claim("model-studies", "VI", "studies of the model alone", OPEN, str(error))]


def _model_row(quantity: str, condition: str, at: float, values: dict, gaps: dict) -> Row:
    return Row(quantity, QUANTITIES[quantity].unit, condition, at, MODEL_STUDY, model=values.get(quantity),
               gap=gaps.get(quantity, ""))  # fmt: skip


def _load(parameters: Parameters, claims: Claims, how: Measuring) -> Claim:
    """Lost motion and backlash over the stiffness of the load's spring."""
    study, quantities = claims.model, ("lost_motion", "width", "backlash", "slack_share")
    taut, slack, rows = [], [], []
    for stiffness in study.load_stiffness_Nm_per_rad:
        said = model_study.run(parameters, model_study.even(study), stiffness, study)
        values, gaps = measure(said, quantities, how)
        rows += [_model_row(q, f"load {stiffness:g} N·m/rad", stiffness, values, gaps) for q in quantities]
        if "slack_share" in values and "lost_motion" in values:
            (slack if values["slack_share"] > claims.seen_percent else taut).append((stiffness, values))
    changes = {q: _spread_percent([v[q] for _, v in taut if q in v]) for q in ("lost_motion", "width")}
    holds = bool(taut) and all(c is not None and c < claims.small_percent for c in changes.values())
    whole = _spread_percent([v["lost_motion"] for _, v in taut + slack])
    verdict = OPEN if not taut else NO if not holds else PART if whole > claims.small_percent else YES
    sentence = _load_sentence(taut, slack, changes)
    return Claim("deadband-and-load", "VI", "the deadband depends on friction under pretension, not on the load",
                 verdict, sentence, rows)  # fmt: skip


def _load_sentence(taut, slack, changes) -> str:
    if not taut:
        return "With every load a cable goes slack."
    (soft, first), (stiff, _) = taut[0], taut[-1]
    sentence = (
        f"With springs of {soft:g} to {stiff:g} N·m/rad no cable goes slack: the lost motion is"
        f" {first['lost_motion']:.4g} rad and changes by {_small(changes['lost_motion'])} %, the loop's width by"
        f" {_small(changes['width'])} %."
    )
    if slack:
        stiffness, values = slack[-1]
        sentence += (
            f" Once one does, the statement fails: at {stiffness:g} N·m/rad a cable is slack for"
            f" {values['slack_share']:.0f} % of the cycle and the lost motion is {values['lost_motion']:.3g} rad."
        )
    return sentence


def _small(percent: float | None) -> str:
    return "–" if percent is None else "less than 0.01" if percent < 0.01 else f"{percent:.2g}"


def _placement(parameters: Parameters, claims: Claims, how: Measuring) -> Claim:
    """Transmission with the one loop at the drive end, in the middle and at the load end."""
    study = claims.model
    quantities = ("lost_motion", "backlash", "width", "slope", "work_lost")
    found, rows = {}, []
    for i, (place, path) in enumerate(model_study.placements(study).items()):
        said = model_study.run(parameters, path, parameters.load_stiffness_Nm_per_rad, study)
        values, gaps = measure(said, quantities, how)
        found[place] = values
        rows += [_model_row(q, f"loop {place}", i, values, gaps) for q in quantities]
    profile = [_spread_percent([v[q] for v in found.values() if q in v]) for q in ("lost_motion", "slope")]
    verdict = OPEN if None in profile else YES if max(profile) > claims.small_percent else NO
    tell = [
        f"{place}: lost motion {_number(v, 'lost_motion')} rad, width {_number(v, 'width')} mN·m, slope"
        f" {_number(v, 'slope')}"
        for place, v in found.items()
    ]
    sentence = (
        f"One loop of {np.degrees(study.bend_rad):.0f}° and {label_of(study.loop_radius_m, 'radius')} radius "
        + "; ".join(tell)
        + ". With the bend, and so the capstan loss, the same, what moves is the stretch of the straight cable before"
        " and behind the loop."
    )
    return Claim("loop-placement", "VI", "where the loop lies does not change the capstan effect, but the stretch and"
                 " with it the transmission", verdict, sentence, rows)  # fmt: skip


def _number(values: Mapping[str, float], quantity: str) -> str:
    return _three_digits(values.get(quantity))


def _sections(parameters: Parameters, claims: Claims) -> Claim:
    """Error of the paper's discretisation over the number of its sections."""
    study, rows, tell, enough = claims.model, [], [], []
    for bend in study.sections_bend_rad:
        path = model_study.even(study, bend)
        stiffness = parameters.load_stiffness_Nm_per_rad
        true = model_study.run(parameters, path, stiffness, study)
        errors = {
            n: model_study.error_percent(model_study.run(parameters, path, stiffness, study, n), true)
            for n in study.sections
        }
        name = label_of(bend, "bend")
        rows += [
            Row("sections_error", "%", f"{name}, {n} sections", n, MODEL_STUDY, model=e) for n, e in errors.items()
        ]
        needed = model_study.sections_needed(errors, study.sections_error_percent)
        said = f"more than {max(errors)}" if needed is None else str(needed)
        own = f"; the paper's {PAPER_SECTIONS} leave {errors[PAPER_SECTIONS]:.2g} %" if PAPER_SECTIONS in errors else ""
        tell.append(f"{name}: {said} of those tried{own}")
        enough.append(errors.get(PAPER_SECTIONS, np.inf) <= study.sections_error_percent)
    sentence = (
        f"Sections for an error below {study.sections_error_percent:g} % of peak to peak in the worst channel, against"
        " the exact solver: " + "; ".join(tell) + "."
    )
    says = f"simulates with {PAPER_SECTIONS} sections of each cable, and names no error"
    return Claim("sections", "III-B and IV", says,
                 YES if all(enough) else PART if any(enough) else NO, sentence, rows)  # fmt: skip


def loop_placements(parameters: Parameters, study: ModelStudies) -> dict[str, Recording]:
    """The runs behind the claim on loop placement, for a figure."""
    return {
        place: model_study.run(parameters, path, parameters.load_stiffness_Nm_per_rad, study)
        for place, path in model_study.placements(study).items()
    }
