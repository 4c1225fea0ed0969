"""Repeatability: how much friction and sensor zeros differ from run to run, and whether they differ by no more.

Recordings of one condition (`conditions`) are repeats. Their differences estimate each spread hierarchically, with the
stated spread as prior: a scaled inverse chi-square distribution of `settings.SPREAD_FREEDOM` degrees of freedom, which
SS, the sum of squares about the means of the conditions, updates to

    s^2 = (nu0 s0^2 + SS) / (nu0 + nu).

Where no condition repeats, the spread of friction comes from its scatter over all recordings by the same formula, up to
`settings.MOST_SCATTER` times the stated one: that scatter may be physics too.

Whitening marginalises the deviation of friction in each recording, so that mean squares do not show whether it exceeds
the repeatability. `friction_p_values` tests this: by the scatter of repeats over the stated spread, and between
conditions over the estimated one (F tests, whose smaller p-value is corrected for two tests), and for a trend over the
sequence of the recordings (t test). A trend is no scatter: spreads are those about it.

Deviations are in standard deviations as stated, and not shrunk: a posterior mean m with the posterior variance v under
a standard normal prior is an observation m / (1 - v) with the variance v / (1 - v).
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import MEASURED, THETA_IN, ZERO_OF, short_name, unit_of
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.spreads import FRICTION, PRETENSION, Repeatability, Spread
from ccmodel.diagnosis.whitening import Whitened
from ccmodel.distributions import fisher_tail, student_tail
from ccmodel.inference.observations import Observations
from ccmodel.recording import Recording

_WORDS = {FRICTION: "friction", PRETENSION: "initial tension"}
_CHANNEL_OF = {zero: channel for channel, zero in ZERO_OF.items()}


@dataclass(frozen=True)
class Deviations:
    """Deviations of a nuisance in each recording, in stated standard deviations.

    Attributes
    ----------
    values, variances : ndarray, shape (recordings,)
        Observed deviations and the variances of their errors; NaN in a recording that does not determine it.
    """

    values: NDArray
    variances: NDArray

    def sum_of_squares(self, groups: Sequence[Sequence[int]]) -> tuple[float, int, int]:
        """Sum of squares about the mean of each group without the errors' share, degrees of freedom, and recordings."""
        square, freedom, count = 0.0, 0, 0
        for group in groups:
            kept = [i for i in group if np.isfinite(self.values[i])]
            if len(kept) > 1:
                scatter = float(np.sum((self.values[kept] - self.values[kept].mean()) ** 2))
                square += scatter - (1 - 1 / len(kept)) * float(self.variances[kept].sum())
                freedom += len(kept) - 1
                count += len(kept)
        return max(square, 0.0), freedom, count


def conditions(observations: Sequence[Observations]) -> list[list[int]]:
    """Numbers of the recordings of each condition: the same conduit, pretension aimed at, drive motion and load."""
    groups: list[list[int]] = []
    for i, one in enumerate(observations):
        found = next((g for g in groups if _is_repeat(observations[g[0]], one)), None)
        if found is None:
            groups.append([i])
        else:
            found.append(i)
    return groups


def _is_repeat(one: Observations, other: Observations) -> bool:
    a, b = one.given.recording, other.given.recording
    first, second = (np.stack([r.path.piece_length_m, r.path.piece_bend_rad]) for r in (a, b))
    if first.shape != second.shape or not np.allclose(first, second) or a.far_end != b.far_end:
        return False
    if not np.isclose(a.pretension_N, b.pretension_N, rtol=1e-3) or one.channels != other.channels:
        return False
    # What was measured and is not compared is the load, an input of the model.
    load = [c for c in MEASURED if c in a and c in b and c not in one.channels]
    counts = 2 * max(r.encoder_step_rad.get(THETA_IN, 0.0) for r in (a, b))
    return _is_same(a, b, THETA_IN, settings.SAME_MOTION, counts) and all(
        _is_same(a, b, channel, settings.SAME_LOAD) for channel in load
    )


def _is_same(a: Recording, b: Recording, channel: str, share: float, least: float = 0.0) -> bool:
    """Whether the rms difference of a channel is at most a share of its peak to peak, or `least`, in its unit."""
    times = [r.time_s - r.time_s[0] for r in (a, b)]
    if not np.isclose(times[0][-1], times[1][-1], rtol=settings.SAME_MOTION):
        return False
    first, second = (r[channel] - (r[channel][0] if channel == THETA_IN else 0.0) for r in (a, b))
    apart = np.sqrt(np.mean((first - np.interp(times[0], times[1], second)) ** 2))
    return bool(apart <= max(share * np.ptp(first), least))


def deviations(whitened: Sequence[Whitened], residuals: Sequence[NDArray], nuisance: str) -> Deviations:
    """Deviations of a nuisance in each recording from the residuals of a fit, nuisances included."""
    found = [w.deviation(nuisance, e) for w, e in zip(whitened, residuals, strict=True)]
    return Deviations(*np.array(found, dtype=float).reshape(-1, 2).T)


def estimated(whitened: Sequence[Whitened], residuals: Sequence[NDArray]) -> Repeatability:
    """Spreads of friction and of the sensors' zeros from the residuals of a fit of the calibrated model."""
    groups = conditions([w.observations for w in whitened])
    names = dict.fromkeys(name for w in whitened for name, _, _ in w.scalar_nuisances)
    found = {}
    for name in names:
        of_name = deviations(whitened, residuals, name)
        if name in _WORDS:
            found[name] = relative_spread(name, without_trend(of_name, sequences(whitened)), groups)
        elif name in _CHANNEL_OF:
            found[name] = zero_spread(name, without_trend(of_name, sequences(whitened)), groups)
    return Repeatability(found, groups)


def estimated_tolerance(whitened: Sequence[Whitened], mean_squares: Mapping[str, float]) -> dict[str, float]:
    """Tolerance of each channel that has one, from what a model leaves; at most the present one.

    A tolerance is the standard deviation of what the equations miss. It is stated where nothing shows it, and a model
    that leaves less shows that it was too large: then t^2 = t0^2 (1 - (1 - m) / p), where m is the model's mean square
    and p the share of the tolerance in the variance.

    Parameters
    ----------
    whitened : sequence of Whitened
    mean_squares : mapping of str to float
        Leave-one-out mean square of the model by channel; 1 is noise.
    """
    found = {}
    for channel, mean_square in mean_squares.items():
        having = [w.observations for w in whitened if channel in w.observations.channels]
        at = [o.channels.index(channel) for o in having]
        share = float(np.mean([o.tolerance_shares[k] for o, k in zip(having, at, strict=True)]))
        if share > 0.0:
            ratio = np.sqrt(np.clip(1.0 - (1.0 - mean_square) / share, 0.0, 1.0))
            found[channel] = float(ratio * having[0].tolerance[at[0]])
    return found


def relative_spread(name: str, found: Deviations, groups: Sequence[Sequence[int]]) -> Spread:
    """Spread of friction or initial tension from repeats; without repeats from the scatter of all recordings."""
    square, freedom, count = found.sum_of_squares(groups)
    if freedom:
        return Spread(name, _posterior(square, freedom), "repeats", count)
    square, freedom, count = found.sum_of_squares([range(found.values.size)])
    if freedom + 1 < settings.FEWEST_FOR_SCATTER:
        return Spread(name)
    ratio = float(np.clip(_posterior(square, freedom), 1.0, settings.MOST_SCATTER))
    return Spread(name, ratio, "scatter", count) if ratio > 1 else Spread(name)


def zero_spread(name: str, found: Deviations, groups: Sequence[Sequence[int]]) -> Spread:
    """Spread of a sensor's zero from repeats, at least the stated accuracy.

    The accuracy is also that of the part of a zero that stays from run to run, which repeats do not show.
    """
    square, freedom, count = found.sum_of_squares(groups)
    ratio = _posterior(square, freedom)
    return Spread(name, ratio, "repeats", count) if ratio > 1 else Spread(name)


def _posterior(square: float, freedom: int) -> float:
    """Ratio of the estimated to the stated standard deviation, from a sum of squares over the stated variance."""
    return float(np.sqrt((settings.SPREAD_FREEDOM + square) / (settings.SPREAD_FREEDOM + freedom)))


class FrictionPValues(NamedTuple):
    """P-values of how friction differs between recordings, under the hypothesis that it does as from run to run.

    Attributes
    ----------
    scatter, trend : float
    about_trend : float
        Of the scatter about the trend; of the scatter if there is no trend.
    """

    scatter: float = 1.0
    trend: float = 1.0
    about_trend: float = 1.0

    @property
    def log_factor(self) -> float:
        """Logarithm of the least Bayes factor of the hypothesis, from scatter and trend."""
        return log_bayes_factor(self.scatter) + log_bayes_factor(self.trend)

    @property
    def log_factor_about_trend(self) -> float:
        """The same, from the scatter about the trend alone."""
        return log_bayes_factor(self.about_trend)


def friction_p_values(whitened: Sequence[Whitened], residuals: Sequence[NDArray], is_fitted: bool) -> FrictionPValues:
    """P-values of friction; 1 for fewer than four recordings or with a tolerance, which friction takes up some of.

    Parameters
    ----------
    whitened : sequence of Whitened
    residuals : sequence of ndarray
        By recording, of a fit (`CandidateFit.residuals`).
    is_fitted : bool
        Whether the fit determines the mean friction; otherwise deviations count from the model's friction.
    """
    if len(whitened) < settings.FEWEST_FOR_SCATTER or any(w.observations.has_tolerance for w in whitened):
        return FrictionPValues()
    found, runs = deviations(whitened, residuals, FRICTION), sequences(whitened)
    about_trend = without_trend(found, runs)
    scatter = _scatter(whitened, found, is_fitted)
    rest = scatter if about_trend is found else _scatter(whitened, about_trend, is_fitted)
    return FrictionPValues(scatter, trend_p_value(found, runs), rest)


def _scatter(whitened: Sequence[Whitened], found: Deviations, is_fitted: bool) -> float:
    """P-value of the scatter within and between conditions."""
    groups = whitened[0].repeatability.conditions or [[i] for i in range(len(whitened))]
    tests = within_p_value(found, groups), between_p_value(found, groups, is_fitted)
    return corrected([p for p in tests if p is not None])


def corrected(p_values: Sequence[float]) -> float:
    """The smallest of the p-values of n tests, corrected for their number: 1 - (1 - p)^n; 1 without a test.

    Sidak 1967, Journal of the American Statistical Association 62(318), 626-633, doi:10.1080/01621459.1967.10482935. It
    holds for independent tests. The two of friction share an estimate of the spread: the correction is then a little
    too large.
    """
    p = min(p_values, default=1.0)
    return float(-np.expm1(len(p_values) * np.log1p(-p))) if p < 1.0 else 1.0


def log_bayes_factor(probability: float) -> float:
    """Logarithm of the least Bayes factor of a hypothesis whose test has this p-value; 0 for p above 1/e.

    -e p ln p: Sellke, Bayarri and Berger 2001, The American Statistician 55(1), 62-71.
    """
    p = max(probability, np.finfo(float).tiny)
    return float(1.0 + np.log(p) + np.log(-np.log(p))) if p < np.exp(-1) else 0.0


def within_p_value(found: Deviations, groups: Sequence[Sequence[int]]) -> float | None:
    """P-value of the scatter of friction within conditions, under the stated spread; None without repeats."""
    within, freedom, _ = found.sum_of_squares(groups)
    return fisher_tail(within / freedom, freedom, settings.SPREAD_FREEDOM) if freedom else None


def between_p_value(found: Deviations, groups: Sequence[Sequence[int]], is_fitted: bool = True) -> float | None:
    """P-value of the scatter of friction between conditions, if they differ as repeats do; None without two of them."""
    within, freedom, _ = found.sum_of_squares(groups)
    known = np.flatnonzero(np.isfinite(found.values))
    between = found.sum_of_squares([known.tolist()])[0] - within
    between_freedom = len(known) - 1 - freedom
    if not is_fitted and len(known):
        between += len(known) * float(found.values[known].mean()) ** 2 - float(found.variances[known].mean())
        between_freedom += 1
    if between_freedom < 1:
        return None
    ratio = max(between, 0.0) / between_freedom / _posterior(within, freedom) ** 2
    return fisher_tail(ratio, between_freedom, settings.SPREAD_FREEDOM + freedom)


def friction_of_deviating(whitened: Sequence[Whitened], residuals: Sequence[NDArray]) -> dict[str, float]:
    """Relative difference of friction from that of the others, by id of the recordings in which it is clear.

    Parameters as of `friction_p_values`. A trend is no difference. See `deviating`.
    """
    found = without_trend(deviations(whitened, residuals, FRICTION), sequences(whitened))
    if not (apart := deviating(found)):
        return {}
    ratios = 1.0 + found.values * [_stated_share(w) for w in whitened]
    others = float(np.nanmean(np.delete(ratios, apart)))
    return {whitened[i].observations.id: float(ratios[i] / others) - 1.0 for i in apart}


def _stated_share(w: Whitened) -> float:
    """Stated standard deviation of a recording's friction over the friction itself; NaN without it."""
    shares = (sd / value for name, value, sd in w.scalar_nuisances if name == FRICTION)
    return next(shares, np.nan) / w.repeatability.ratio(FRICTION)


def deviating(found: Deviations) -> list[int]:
    """Numbers of the recordings in which a nuisance deviates clearly from that in the others.

    The generalised extreme studentised deviate test: the recording farthest from the others is set aside, then the next
    one, up to the share `settings.MOST_DEVIATING`. Those up to the last that is significantly far from the rest deviate
    (Rosner 1983, Technometrics 25(2), 165-172, doi:10.1080/00401706.1983.10487848). The spread of the rest is estimated
    with the stated one as prior, and the level is corrected for the number of recordings.
    """
    rest = np.flatnonzero(np.isfinite(found.values)).tolist()
    aside: list[int] = []
    count = 0
    for _ in range(int(settings.MOST_DEVIATING * len(rest))):
        p_values = [_p_value_of_one(found, i, [j for j in rest if j != i]) for i in rest]
        aside.append(rest.pop(int(np.argmin(p_values))))
        if corrected(p_values) < settings.FRICTION_DEVIATES:
            count = len(aside)
    return sorted(aside[:count])


def _p_value_of_one(found: Deviations, one: int, others: list[int]) -> float:
    """Two-sided p-value of the deviation in one recording from the mean of others, if it is from run to run."""
    square, freedom, _ = found.sum_of_squares([others])
    variance = _posterior(square, freedom) ** 2 * (1 + 1 / len(others))
    variance += found.variances[one] + found.variances[others].mean() / len(others)
    apart = abs(found.values[one] - found.values[others].mean())
    return 2 * student_tail(float(apart / np.sqrt(variance)), settings.SPREAD_FREEDOM + freedom)


def sequences(whitened: Sequence[Whitened]) -> list[list[int]]:
    """Numbers of the recordings of each batch, in the order in which they were made, or else are listed."""
    batches: dict[str, list[int]] = {}
    for i, w in enumerate(whitened):
        batches.setdefault(w.session, []).append(i)
    starts = [w.observations.given.recording.started_at_s for w in whitened]
    return [
        numbers if any(starts[i] is None for i in numbers) else sorted(numbers, key=lambda i: starts[i] or 0.0)
        for numbers in batches.values()
    ]


def trend_p_value(found: Deviations, runs: Sequence[Sequence[int]]) -> float:
    """Two-sided p-value of the trend over the recordings of each batch, under the hypothesis that there is none."""
    at, values = _over_sequence(found, runs)
    means = sum(bool(np.isfinite(found.values[list(run)]).any()) for run in runs)
    freedom = settings.SPREAD_FREEDOM + values.size - means - 1
    if values.size < settings.FEWEST_FOR_SCATTER or not at.any():
        return 1.0
    left = values - _slope(at, values) * at
    sd = np.sqrt((settings.SPREAD_FREEDOM + float(left @ left)) / freedom / float(at @ at))
    return 2 * student_tail(abs(_slope(at, values)) / sd, freedom)


def without_trend(found: Deviations, runs: Sequence[Sequence[int]]) -> Deviations:
    """Deviations about their trend over the recordings of each batch, if they have one."""
    if trend_p_value(found, runs) > settings.TREND_LEVEL:
        return found
    slope, values = _slope(*_over_sequence(found, runs)), found.values.copy()
    for run in runs:
        at = np.arange(len(run), dtype=float)
        known = np.isfinite(values[list(run)])
        values[list(run)] -= slope * (at - (at[known].mean() if known.any() else 0.0))
    return Deviations(values, found.variances)


def _over_sequence(found: Deviations, runs: Sequence[Sequence[int]]) -> tuple[NDArray, NDArray]:
    """Number within its batch and deviation of each recording that determines it, both less the batch's mean."""
    at, values = [], []
    for run in runs:
        known = np.array([k for k, i in enumerate(run) if np.isfinite(found.values[i])], dtype=int)
        if known.size:
            own = found.values[[run[k] for k in known]]
            at.append(known - known.mean())
            values.append(own - own.mean())
    return np.concatenate([np.zeros(0), *at]), np.concatenate([np.zeros(0), *values])


def _slope(at: NDArray, values: NDArray) -> float:
    """Least-squares slope of values without a mean."""
    return float(at @ values / (at @ at))


def report(whitened: Sequence[Whitened]) -> list[dict]:
    """Standard deviations that count as noise, as plain data for diagnosis.json: estimated from what, or assumed."""
    return [*_spreads(whitened), *_sensors(whitened)]


def _spreads(whitened: Sequence[Whitened]) -> list[dict]:
    applied: dict[str, tuple[float, str]] = {}
    for w in whitened:
        for name, value, sd in w.scalar_nuisances:
            if name in _WORDS:
                applied[name] = sd / value, "1"
            elif name in _CHANNEL_OF:
                applied[name] = sd, _unit(_CHANNEL_OF[name])
    found = []
    for name, (size, unit) in applied.items():
        spread = whitened[0].repeatability.spreads.get(name, Spread(name))
        what = _WORDS.get(name) or f"zero of {short_name(_CHANNEL_OF[name])}"
        found.append(_row(f"{what} from run to run", size, unit, spread.source, spread.recordings))
    return found


def _sensors(whitened: Sequence[Whitened]) -> list[dict]:
    """The noise of each channel: its root mean square over all recordings, and where most of them have it from."""
    found = []
    for channel in dict.fromkeys(c for w in whitened for c in w.observations.channels):
        noises = [w.observations.noise[channel] for w in whitened if channel in w.observations.noise]
        if noises:
            (source, count), *_ = Counter(n.source for n in noises).most_common(1)
            size = float(np.sqrt(np.mean([n.sd**2 for n in noises])))
            number = 0 if source == "assumed" else count
            found.append(_row(f"noise of {short_name(channel)}", size, _unit(channel), source, number))
    return found


def _unit(channel: str) -> str:
    return unit_of(channel).replace(" ", "*")


def _row(what: str, value: float, unit: str, source: str, recordings: int) -> dict:
    return {"what": what, "value": value, "unit": unit, "from": source, "recordings": recordings}
