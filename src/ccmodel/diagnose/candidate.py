"""Trying a hypothesis: a quick score against the calibrated model, a full refit, and recordings held out in turn."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares

from ccmodel import mechanisms as registry
from ccmodel.diagnose.hypothesis import Hypothesis
from ccmodel.diagnose.whitening import LOOKS, Whitened
from ccmodel.failure import ModelError
from ccmodel.inference.problem import Free, each
from ccmodel.model.parameters import Parameters, mechanism_key
from ccmodel.model.sensitivity import size_of

TOLERANCE = 1e-4
# Differences are taken over this share of a value: friction that falls with speed makes runs that are not smooth in it.
DIFFERENCE = 3e-4
# One Newton step stands for a refit, and goes astray where errors bend. It is looked at where so many times as much is
# left of a held-out recording as by the joint fit; and shares of it that are then tried.
SUSPECT, SHORTER = 2.0, (1.0, 0.5, 0.25, 0.125)
# How much finer the solver's grid and steps are for what they cost a fit.
FINER = 3
# By how much at a time a value is eased down (`Parameter.continuation`).
EASING = 4.0
MOST_EVALUATIONS = 25
# By which share a number that a model has already is changed to see what that does.
CHANGE = 0.05
# Where no rest shows the pretension the errors have valleys of their own: both cables taut all along, or one of them
# slack on its way. A fit then feels its way from either, at shares of the pretension, and goes on from the better.
PRETENSION_SHARES, FEELING = (1.0, 0.2), 8


@dataclass(frozen=True)
class CandidateFit:
    """A hypothesis fitted to all recordings.

    Attributes
    ----------
    hypothesis : Hypothesis
    free : dict of str to Free
        What a calibration of the paper's model leaves free.
    values : dict of str to float
    whitened : list of ndarray, each of shape (rows + numbers,)
        By recording, what the fit leaves.
    jacobian : list of ndarray, each of shape (rows + numbers, unknowns)
    covariance : ndarray, shape (unknowns, unknowns)
        By how much the recordings disagree about the values; of a single one, what its noise says.
    freedom : ndarray, shape (unknowns,)
        Degrees of freedom of each one's variance: few where few recordings decide.
    held_out : list of dict
        By recording, the values that the other recordings ask for.
    aside : list of ndarray, each of shape (rows + numbers,)
        By recording, what these leave of it, whitened.
    """

    hypothesis: Hypothesis
    free: Mapping[str, Free]
    values: dict[str, float]
    whitened: list[NDArray]
    jacobian: list[NDArray]
    covariance: NDArray
    freedom: NDArray
    held_out: list[dict[str, float]]
    aside: list[NDArray]

    @cached_property
    def left(self) -> NDArray:
        """Mean square of `aside`, shape (recordings,)."""
        return np.array([np.mean(e**2) for e in self.aside])


def errors(one: Whitened, values: Mapping[str, float]) -> NDArray:
    """Whitened errors of a recording and its likeliest differences, shape (rows + numbers,)."""
    return one.counted(one.observations.errors(values).ravel())


def _errors_if_any(one: Whitened, values: Mapping[str, float]) -> NDArray | None:
    """The same; None where the model cannot be run with such values."""
    try:
        return errors(one, values)
    except ModelError:
        return None


def fit(weighed: Sequence[Whitened], hypothesis: Hypothesis, calibrated: dict[str, Free], start: dict) -> CandidateFit:
    """Fit a hypothesis from given values and hold every recording out in turn.

    Parameters
    ----------
    weighed : sequence of Whitened
    hypothesis : Hypothesis
    calibrated : dict of str to Free
        What a calibration of the paper's model leaves free.
    start : dict of str to float
        Values of these and of the mechanisms' numbers to start from.

    Returns
    -------
    CandidateFit

    Raises
    ------
    ModelError
        If the model cannot be run on the way.
    """
    free = {n: Free(start[n], f.low, f.high) for n, f in calibrated.items()} | hypothesis.free(start)
    names = list(free)
    acting = [w.acting(hypothesis.of(w.observations.parameters)) for w in weighed]
    low, high = (np.array([getattr(f, end) for f in free.values()]) for end in ("low", "high"))
    x0 = np.clip([f.start for f in free.values()], low + 1e-9 * (high - low), high - 1e-9 * (high - low))
    sizes = np.array([size_of(n, f.start) for n, f in free.items()])
    counts = [w.observations.measured.size for w in acting]

    def named(x):
        return dict(zip(names, x.tolist(), strict=True))

    @lru_cache(maxsize=1)  # An optimiser wants slopes where it has just been.
    def by_recording(*values: float) -> list[NDArray]:
        return each(acting, lambda i, w: errors(w, named(np.array(values))))

    def residuals(x):
        return np.concatenate([e / np.sqrt(n) for e, n in zip(by_recording(*x.tolist()), counts, strict=True)])

    def jacobian(x):
        parts = _jacobians(acting, by_recording(*x.tolist()), x, names, sizes, high)
        return np.concatenate([J / np.sqrt(n) for J, n in zip(parts, counts, strict=True)])

    def solved(x, most=MOST_EVALUATIONS):
        if not names:  # Nothing is free: the model stands as it is.
            return OptimizeResult(x=x, fun=residuals(x), jac=jacobian(x), cost=0.0)
        return least_squares(
            residuals, x, jac=jacobian, bounds=(low, high), x_scale=sizes, ftol=TOLERANCE, xtol=TOLERANCE,
            gtol=TOLERANCE, max_nfev=most,
        )  # fmt: skip

    starts = _starts(names, x0, low, high)
    found = solved(x0) if len(starts) == 1 else solved(_best(lambda x: solved(x, FEELING), starts).x)
    for k in map(names.index, hypothesis.continuation):
        found = _eased(solved, found, k, low)
    ends = np.cumsum([n + len(w.likeliest) for n, w in zip(counts, acting, strict=True)])[:-1]
    J = [part * np.sqrt(n) for part, n in zip(np.split(found.jac, ends), counts, strict=True)]
    r = [part * np.sqrt(n) for part, n in zip(np.split(found.fun, ends), counts, strict=True)]
    information = [j.T @ j / n for j, n in zip(J, counts, strict=True)]
    score = [j.T @ e / n for j, e, n in zip(J, r, counts, strict=True)]
    total = sum(information)
    inverse, inverses_aside = _inverse(total, sizes), [_inverse(total - H, sizes) for H in information]
    without = [np.clip(found.x + V @ g, low, high) for V, g in zip(inverses_aside, score, strict=True)]
    aside = each(acting, lambda i, w: _errors_if_any(w, named(without[i])))
    for i, (e, own) in enumerate(zip(aside, r, strict=True)):
        if e is None or np.mean(e**2) > SUSPECT * np.mean(own**2):
            others = [(w, left) for k, (w, left) in enumerate(zip(acting, r, strict=True)) if k != i]
            without[i] = _shortened(others, found.x, without[i], named)
            aside[i] = _errors_if_any(acting[i], named(without[i]))
            if aside[i] is None:  # The joint optimum is all there is then.
                without[i], aside[i] = found.x, own
    if len(acting) > 1:
        scatter, freedom = _scatter(np.array(without) - found.x, information, inverse, inverses_aside)
    else:
        scatter = inverse / (LOOKS * len(acting[0].observations.channels))
        freedom = np.full(len(names), np.inf)
    held_out = [named(x) for x in without]
    return CandidateFit(hypothesis, calibrated, named(found.x), r, J, scatter, freedom, held_out, aside)


def _shortened(others: Sequence[tuple[Whitened, NDArray]], x: NDArray, aside: NDArray, named: Callable) -> NDArray:
    """The step from a joint optimum to that of some recordings alone, halved until it does not leave more of them.

    Parameters
    ----------
    others : sequence of (Whitened, ndarray)
        These recordings, and what the joint optimum leaves of each.
    x, aside : ndarray, shape (unknowns,)
        The joint optimum, and where one Newton step from it would have theirs.
    named : callable
        Makes values by name of either.
    """
    before = sum(np.mean(left**2) for _, left in others)
    for share in SHORTER:
        tried = x + share * (aside - x)
        try:
            if sum(each(others, lambda i, o, t=tried: np.mean(errors(o[0], named(t)) ** 2))) <= before:
                return tried
        except ModelError:
            continue
    return x


def moved_by_finer(weighed: Sequence[Whitened], trial: CandidateFit) -> NDArray:
    """Where a finer solver would have a trial's values, less where they are, to first order; shape (unknowns,).

    Raises
    ------
    ModelError
        If the model cannot be run with the finer solver.
    """
    finer = [w.acting(replace(trial.hypothesis.of(w.observations.parameters), refinement=FINER)) for w in weighed]
    changed = each(finer, lambda i, w: errors(w, trial.values) - trial.whitened[i])
    counts = [w.observations.measured.size for w in weighed]
    sizes = np.array([size_of(n, v) for n, v in trial.values.items()])
    inverse = _inverse(sum(j.T @ j / n for j, n in zip(trial.jacobian, counts, strict=True)), sizes)
    return -inverse @ sum(j.T @ e / n for j, e, n in zip(trial.jacobian, changed, counts, strict=True))


def _scatter(
    moved: NDArray, information: Sequence[NDArray], inverse: NDArray, inverses_aside: Sequence[NDArray]
) -> tuple[NDArray, NDArray]:
    """How sure a fit is, from how far it moves as each recording is left out.

    The jackknife, for recordings of which some say more than others: left out, those move a fit further than they
    ought to, and few of them are few degrees of freedom. Were errors as expected, the variances would be right in the
    mean and scatter about as that chi-square does (Bell and McCaffrey, Survey Methodology 28, 2002, with each recording
    left out in turn).

    Parameters
    ----------
    moved : ndarray, shape (recordings, unknowns)
    information : sequence of ndarray, each of shape (unknowns, unknowns)
        By recording.
    inverse : ndarray, shape (unknowns, unknowns)
        Of that of all recordings.
    inverses_aside : sequence of ndarray, each of shape (unknowns, unknowns)
        Of that of all but each recording.

    Returns
    -------
    covariance : ndarray, shape (unknowns, unknowns)
    freedom : ndarray, shape (unknowns,)
        Degrees of freedom of each variance, 1 at least.
    """
    n, aside = len(moved), np.stack(inverses_aside)
    felt = np.einsum("iab,ibk->kia", np.stack(information), aside)
    # By unknown, how what two recordings move it by is correlated.
    expected = -felt @ inverse @ felt.transpose(0, 2, 1)
    expected[:, range(n), range(n)] += np.einsum("iak,kia->ki", aside, felt)
    mean, square = np.trace(expected, axis1=1, axis2=2), (expected**2).sum(axis=(1, 2))
    known = (square > 0) & (np.diag(inverse) > 0)
    freedom = np.divide(mean**2, square, out=np.ones_like(mean), where=known).clip(1.0)
    over = np.sqrt(np.divide(mean, np.diag(inverse), out=np.ones_like(mean), where=known))
    return moved.T @ moved / np.outer(over, over), freedom


def _starts(names: Sequence[str], x0: NDArray, low: NDArray, high: NDArray) -> list[NDArray]:
    if "pretension_share" not in names:
        return [x0]
    pretension = np.arange(x0.size) == names.index("pretension_share")
    inside = low + 1e-9 * (high - low)
    return [np.clip(np.where(pretension, share * x0, x0), inside, high) for share in PRETENSION_SHARES]


def _eased(solved: Callable, found, k: int, low: NDArray):
    """The solution as one of its values is eased down, as long as that leaves less."""
    while found.x[k] > EASING * low[k]:
        x = found.x.copy()
        x[k] /= EASING
        try:
            lower = solved(x)
        except ModelError:
            break
        if lower.cost > (1 - TOLERANCE) * found.cost:
            break
        found = lower
    return found


def _best(solved: Callable, starts: Sequence[NDArray]):
    """The solution with the least cost; a start from which the model cannot be run counts only if none can."""
    found, failed = [], None
    for x in starts:
        try:
            found.append(solved(x))
        except ModelError as error:
            failed = error
    if not found:
        raise failed
    return min(found, key=lambda f: f.cost)


def _inverse(information: NDArray, sizes: NDArray) -> NDArray:
    scaled = information * np.outer(sizes, sizes)
    return np.linalg.pinv(scaled, rcond=1e-10, hermitian=True) * np.outer(sizes, sizes)


def slopes(run: Callable[[dict[str, float]], NDArray], base: NDArray, x, names, sizes, high) -> NDArray:
    """How what `run` makes of values by name, `base` at `x`, answers to each of them; shape (rows, unknowns)."""
    columns = []
    for k in range(x.size):
        step = DIFFERENCE * sizes[k] * (-1 if x[k] + DIFFERENCE * sizes[k] > high[k] else 1)
        aside = x.copy()
        aside[k] += step
        columns.append((run(dict(zip(names, aside.tolist(), strict=True))) - base) / step)
    return np.stack(columns, axis=1) if columns else np.empty((base.size, 0))


def _jacobians(acting, bases, x, names, sizes, high) -> list[NDArray]:
    return each(acting, lambda i, w: slopes(lambda values: errors(w, values), bases[i], x, names, sizes, high))


@dataclass(frozen=True)
class Score:
    """What a hypothesis would take off the calibrated model's errors, from one run at each of its probes.

    Attributes
    ----------
    hypothesis : Hypothesis
    gain : float
        Share of the mean square that goes, after everything that recalibration absorbs.
    values : dict of str to float
        The probe that does best, `scaled` as the recordings ask for.
    """

    hypothesis: Hypothesis
    gain: float
    values: dict[str, float]


def score(weighed: Sequence[Whitened], base: CandidateFit, hypotheses: Sequence[Hypothesis]) -> list[Score]:
    """Score hypotheses against a fitted one that they extend, the best first."""
    counts = [w.observations.measured.size for w in weighed]
    A = np.concatenate([J / np.sqrt(n) for J, n in zip(base.jacobian, counts, strict=True)])
    r = np.concatenate([e / np.sqrt(n) for e, n in zip(base.whitened, counts, strict=True)])
    Q, _ = np.linalg.qr(A)
    left = r - Q @ (Q.T @ r)
    scored = [_score(weighed, base, h, counts, Q, left) for h in hypotheses]
    return sorted(scored, key=lambda s: -s.gain)


def _score(weighed, base: CandidateFit, hypothesis: Hypothesis, counts, Q, left) -> Score:
    best = Score(hypothesis, 0.0, {})
    added = base.hypothesis.and_also(hypothesis)
    acting = [w.acting(added.of(w.observations.parameters)) for w in weighed]
    has = (
        base.hypothesis.of(weighed[0].observations.parameters)
        if hypothesis.acting[0] in base.hypothesis.baseline
        else None
    )
    for probe in changed(hypothesis, has) if has else hypothesis.probes():
        try:
            said = each(acting, lambda i, w, p=probe: errors(w, base.values | p) - base.whitened[i])
        except ModelError:
            continue
        d = np.concatenate([e / np.sqrt(n) for e, n in zip(said, counts, strict=True)])
        d = d - Q @ (Q.T @ d)
        size = float(d @ d)
        # A mechanism that recalibration absorbs wholly says nothing.
        if size < 1e-12:
            continue
        strength = -float(d @ left) / size
        gain = strength * abs(strength) * size / float(left @ left)
        values = scaled(hypothesis, probe, strength) if has is None else _further(has, probe, strength)
        if values is not None and abs(gain) > best.gain:
            best = Score(hypothesis, abs(gain), values)
    return best


def changed(hypothesis: Hypothesis, model: Parameters) -> Iterator[dict[str, float]]:
    """A model's own numbers of a mechanism, one of them changed at a time."""
    own = {key: model.value_of(key) for key in hypothesis.start}
    for key, value in own.items():
        yield own | {key: (1 + CHANGE) * value}


def _further(model: Parameters, probe: Mapping[str, float], strength: float) -> dict[str, float]:
    """A change of a model's numbers at another strength, none of them turned round."""
    own = {key: model.value_of(key) for key in probe}
    share = float(np.clip(CHANGE * strength, -0.9, 10.0)) / CHANGE
    return {key: own[key] + share * (value - own[key]) for key, value in probe.items()}


def scaled(hypothesis: Hypothesis, probe: Mapping[str, float], strength: float) -> dict[str, float] | None:
    """A probe at another strength; None where its mechanism cannot have it.

    Where a mechanism says which strengths are to be tried, they differ in kind, and the probe stays as it is.
    """
    ((name, place),) = hypothesis.acting
    strengths = registry.get(name).strengths
    if strength <= 0 and not any(p.signed or p.ratio for p in strengths):
        return None
    if any(p.screening_grid for p in strengths):
        return dict(probe)
    strength = float(np.clip(strength, -4.0, 4.0))
    strength = np.copysign(max(abs(strength), 0.1), strength)
    values = dict(probe)
    for p in strengths:
        key = mechanism_key(name, place, p.name)
        values[key] = p.neutral + strength * (probe[key] - p.neutral)
    return values
