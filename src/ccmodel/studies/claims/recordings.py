"""Claims that recordings decide: trends over bend and pretension, the phases, the loop radius.

A trend is borne out if every step from one condition to the next has the claimed sign with certainty, by the intervals
of the means. It is contradicted if the change from the first condition to the last certainly has the other sign, or is
certainly small. Otherwise it is not determined.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, starmap

import numpy as np

from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model.parameters import Parameters
from ccmodel.recording import Recording
from ccmodel.repeats import Estimate, difference, estimates
from ccmodel.steps.files import Pair
from ccmodel.studies.claims import model_runs
from ccmodel.studies.claims.claim import MODEL_ALONE, Claim, Row, Verdict, percent, spread_percent, three_digits
from ccmodel.studies.claims.settings import Claims, ModelStudies
from ccmodel.studies.loops.measures import QUANTITIES, measure
from ccmodel.studies.loops.settings import Measuring
from ccmodel.studies.variables import by_label, origins_of, value_of


@dataclass(frozen=True)
class _Trend:
    """A claim that quantities rise (sign +1) or fall (-1) with a study's variable; `shown` ones decide nothing."""

    name: str
    section: str
    says: str
    variable: str
    quantities: tuple[str, ...]
    sign: int
    shown: tuple[str, ...] = ()


_TRENDS = (
    _Trend("backlash-and-bend", "V-A", "the backlash widens with the angle of bend", "bend", ("backlash", "width"), 1),
    _Trend("slope-and-bend", "V-A", "with more bend the loop is less steep while a cable is slack", "bend",
           ("slack_slope",), -1, shown=("slope",)),
    _Trend("slack-and-bend", "V-A", "more bend keeps a cable slack for longer", "bend", ("slack_share",), 1),
    _Trend("backlash-and-pretension", "V-B", "the backlash widens with pretension", "pretension",
           ("backlash", "width"), 1),
    _Trend("slack-and-pretension", "V-B", "less pretension keeps a cable slack for longer", "pretension",
           ("slack_share",), -1),
)  # fmt: skip


@dataclass(frozen=True)
class _Series:
    """A quantity over the conditions of a study; `estimates` are those of the conditions that have it."""

    rows: list[Row]
    estimates: list[Estimate]

    @property
    def is_repeated(self) -> bool:
        """Whether two conditions or more, with repeats, can be compared."""
        return len(self.estimates) > 1 and self.estimates[0].freedom > 0


def recorded_claims(
    pairs: Mapping[str, Sequence[Pair]], parameters: Parameters | None, claims: Claims, how: Measuring
) -> list[Claim]:
    """Claims on recordings, in the order of the paper; the parameters are as for `claims_of`.

    Of a study with measured and simulated recordings, the measured ones are judged: two rigs are no trend.
    """
    pairs = {variable: _of_one_origin(of_study) for variable, of_study in pairs.items()}
    return [
        *(_trend(trend, pairs[trend.variable], claims, how) for trend in _TRENDS),
        _phases(pairs["pretension"], claims, how),
        _radius(pairs["radius"], parameters, claims, how),
    ]


def _of_one_origin(pairs: Sequence[Pair]) -> list[Pair]:
    """The measured recordings of a study with their simulations, or all if none is measured."""
    measured = [pair for pair in pairs if pair[0].origin == "rig"]
    return measured or list(pairs)


def _series(pairs: Sequence[Pair], variable: str, quantity: str, claims: Claims, how: Measuring) -> _Series:
    conditions, q = by_label(pairs, variable), QUANTITIES[quantity]
    numbers = {label: _numbers([r for r, _ in group], quantity, how) for label, group in conditions.items()}
    usable = {label: values for label, (values, _) in numbers.items() if values}
    means = dict(zip(usable, estimates(list(usable.values()), relative=not q.is_share), strict=True))
    rows = []
    for label, group in conditions.items():
        modelled, _ = _numbers([s for _, s in group if s is not None], quantity, how)
        model = float(np.mean(modelled)) if modelled else None
        at = float(value_of(group[0][0], variable))
        row = Row(quantity, q.unit, label, at, origins_of(r for r, _ in group), model=model, gap=numbers[label][1])
        rows.append(_with_interval(row, means[label], claims.coverage) if label in means else row)
    return _Series(rows, list(means.values()))


def _with_interval(row: Row, mean: Estimate, coverage: float) -> Row:
    """A row with a mean over recordings and its interval; a share stays within 0 and 100 %."""
    row, reach = replace(row, recordings=mean.count, value=mean.value, gap=""), mean.reach(coverage)
    if reach is None:
        return replace(row, gap="no repeats: no interval")
    low, high = (0.0, 100.0) if QUANTITIES[row.quantity].is_share else (-np.inf, np.inf)
    return replace(row, low=max(mean.value - reach, low), high=min(mean.value + reach, high))


def _numbers(recordings: Sequence[Recording], quantity: str, how: Measuring) -> tuple[list[float], str]:
    """A quantity of each recording that has it, and the reason of the last one that does not."""
    values: list[float] = []
    gap = "no recording"
    for recording in recordings:
        found, gaps = measure(recording, [quantity], how)
        values += found.values()
        gap = gaps.get(quantity, gap)
    return values, gap


def _trend(trend: _Trend, pairs: Sequence[Pair], claims: Claims, how: Measuring) -> Claim:
    series = {q: _series(pairs, trend.variable, q, claims, how) for q in trend.quantities + trend.shown}
    verdicts = [_has_sign(series[q], trend.sign, claims) for q in trend.quantities]
    by_model = _joint([_model_has_sign(series[q], trend.sign) for q in trend.quantities])
    sentence, rows = _sentence_and_rows(series)
    return Claim(trend.name, trend.section, trend.says, _joint(verdicts), sentence, rows, by_model)


def _has_sign(series: _Series, sign: int, claims: Claims) -> Verdict:
    """Whether means rise (sign +1) or fall (-1) from one condition to the next."""
    if not series.is_repeated:
        return Verdict.OPEN
    means = series.estimates
    if all(sign * s.value > s.half_width(claims.coverage) for s in starmap(difference, pairwise(means))):
        return Verdict.YES
    whole = difference(means[0], means[-1])
    small = 0.01 * claims.small_percent * abs(np.mean([m.value for m in means]))
    return Verdict.NO if sign * whole.value + whole.half_width(claims.coverage) < small else Verdict.OPEN


def _model_has_sign(series: _Series, sign: int) -> Verdict:
    """Whether the model rises (sign +1) or falls (-1) from one condition that has a value to the next."""
    values = [row.model for row in series.rows if row.model is not None]
    if len(values) < 2:
        return Verdict.OPEN
    return Verdict.YES if all(sign * (b - a) > 0 for a, b in pairwise(values)) else Verdict.NO


def _joint(verdicts: Sequence[Verdict]) -> Verdict:
    kinds = set(verdicts)
    if len(kinds) == 1:
        return kinds.pop()
    return Verdict.PART if Verdict.YES in kinds else Verdict.OPEN


def _phases(pairs: Sequence[Pair], claims: Claims, how: Measuring) -> Claim:
    """Phases IVa and IVb over pretension."""
    series = {q: _series(pairs, "pretension", q, claims, how) for q in ("IVa_share", "IVb_share")}
    recorded_a, recorded_b = ([_is_seen(e, claims) for e in s.estimates] for s in series.values())
    modelled_a, modelled_b = (
        [r.model > claims.seen_percent for r in s.rows if r.model is not None] for s in series.values()
    )
    verdict = _phases_seen(recorded_a, recorded_b)
    by_model = _phases_seen(modelled_a, modelled_b)
    says = "a high pretension shows no phase IV, a middling one IVa, a low one IVb as well"
    sentence, rows = _sentence_and_rows(series)
    return Claim("phases-and-pretension", "V-B", says, verdict, sentence, rows, by_model)


def _is_seen(share: Estimate, claims: Claims) -> bool | None:
    """Whether a phase occurs; None if the interval of its share (%) does not tell, or there is none."""
    reach = share.reach(claims.coverage)
    if reach is None or abs(share.value - claims.seen_percent) <= reach:
        return None
    return share.value > claims.seen_percent


def _phases_seen(seen_a: Sequence[bool | None], seen_b: Sequence[bool | None]) -> Verdict:
    """Whether IVa and IVb occur as claimed, in rising order of pretension."""
    if len(seen_a) < 3 or len(seen_b) != len(seen_a):
        return Verdict.OPEN
    at_ends = seen_a[0], seen_b[0], seen_a[-1], seen_b[-1]
    if any(seen is (not wanted) for seen, wanted in zip(at_ends, (True, True, False, False), strict=True)):
        return Verdict.NO
    if None in (*seen_a, *seen_b):
        return Verdict.OPEN
    return Verdict.YES if any(a and not b for a, b in zip(seen_a, seen_b, strict=True)) else Verdict.NO


def _radius(pairs: Sequence[Pair], parameters: Parameters | None, claims: Claims, how: Measuring) -> Claim:
    """Difference between the largest and the smallest of the radii's means."""
    small, verdicts, by_model, parts, rows = claims.small_percent, [], [], [], []
    for quantity in ("backlash", "width", "slope"):
        series = _series(pairs, "radius", quantity, claims, how)
        spread = _spread(series, claims)
        model = spread_percent([r.model for r in series.rows if r.model is not None])
        by_model.append(Verdict.OPEN if model is None else Verdict.YES if model < small else Verdict.NO)
        rows += series.rows
        place = (f"{quantity}_spread", "%", "all radii", np.nan, series.rows[0].source if series.rows else "")
        if spread is None:
            verdicts.append(Verdict.OPEN)
            rows.append(Row(*place, model=model, gap="fewer than two radii, or no repeats"))
            continue
        value, reach = spread
        low, high = max(0.0, value - reach), value + reach
        verdicts.append(Verdict.YES if high < small else Verdict.NO if low > small else Verdict.OPEN)
        rows.append(Row(*place, sum(e.count for e in series.estimates), value, low, high, model))
        parts.append(f"{QUANTITIES[quantity].text} {value:.2g} % (at most {high:.2g} %; model {percent(model)} %)")
    sentence = "Between the radii the means differ by: " + "; ".join(parts) + "." if parts else "Nothing to compare."
    alone = spread_percent(_backlash_alone([r.path for r, _ in pairs], parameters, claims.model, how))
    if alone is not None:
        rows.append(Row("backlash_spread", "%", "all radii, one pretension", np.nan, MODEL_ALONE, model=alone))
        sentence += f" At one and the same pretension the model's backlash differs by {percent(alone)} %."
    says = "at one angle of bend the loop's radius makes next to no difference"
    return Claim("radius", "V-C", says, _joint(verdicts), sentence, rows, _joint(by_model))


def _backlash_alone(
    paths: Sequence[ConduitPath], parameters: Parameters | None, study: ModelStudies, how: Measuring
) -> list[float]:
    """Backlash of the model on each path, at the study's pretension; none if the model cannot be run."""
    try:
        runs = [model_runs.run(parameters, path, study) for path in paths] if parameters is not None else []
    except ModelError:
        return []
    return [v for run in runs for v in measure(run, ["backlash"], how)[0].values()]


def _spread(series: _Series, claims: Claims) -> tuple[float, float] | None:
    """Largest less smallest mean and half its interval, % of the mean of means."""
    if not series.is_repeated:
        return None
    means = sorted(series.estimates, key=lambda e: e.value)
    apart = difference(means[0], means[-1])
    scale = 100 / abs(np.mean([m.value for m in means]))
    return float(scale * apart.value), float(scale * apart.half_width(claims.coverage))


def _sentence_and_rows(series: Mapping[str, _Series]) -> tuple[str, list[Row]]:
    """All numbers of some quantities in a sentence, how many intervals hold the model, and the rows."""
    rows = [row for s in series.values() for row in s.rows]
    known = [
        r.low <= r.model <= r.high for r in rows if r.low is not None and r.high is not None and r.model is not None
    ]
    inside = sum(known)
    summary = f"The model lies within {inside} of {len(known)} intervals." if known else ""
    return " ".join(_quantity_sentence(q, s.rows) for q, s in series.items()) + " " + summary, rows


def _quantity_sentence(quantity: str, rows: Sequence[Row]) -> str:
    q = QUANTITIES[quantity]
    parts = []
    for row in rows:
        model = three_digits(row.model)
        if row.value is None:
            parts.append(f"{row.condition}: – ({row.gap}; model {model})")
        else:
            reach = "" if row.low is None else f" ({three_digits(row.low)} to {three_digits(row.high)})"
            parts.append(f"{row.condition}: {three_digits(row.value)}{reach}, model {model}")
    unit = "" if q.unit == "1" else f" ({q.unit})"
    return f"{q.text[0].upper()}{q.text[1:]}{unit}: " + "; ".join(parts) + "."
