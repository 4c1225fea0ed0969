"""Candidate fits: a candidate model fitted to all recordings, with leave-one-out cross-validation."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.deadline import UNLIMITED, Deadline
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.hypothesis import Hypothesis, plausible
from ccmodel.diagnosis.whitening import Whitened, with_states_of
from ccmodel.distributions import normal_quantile, student_quantile
from ccmodel.failure import ModelError
from ccmodel.inference.cross_validation import inverse_of, leave_one_out
from ccmodel.inference.effective_samples import mean_weight, of_recording, prior_spread
from ccmodel.inference.intervals import COVERAGE, Interval
from ccmodel.inference.jacobian import size_of
from ccmodel.inference.least_squares import STALLED, STOPPED, Search, Solution, minimise
from ccmodel.inference.observations import Observations
from ccmodel.inference.pool import each
from ccmodel.inference.problem import Free, Problem
from ccmodel.model.parameters import Parameters, mechanism_key

SEARCH = Search(
    tolerance=settings.FIT_TOLERANCE,
    shortest=settings.FIT_TOLERANCE,
    gradient=settings.FIT_TOLERANCE,
    difference=settings.FIT_DIFFERENCE,
    most_evaluations=settings.FIT_EVALUATIONS,
    own_units=True,
    secants=True,
)
# The last search for what is reported. Larger differences average over the cost's corners. A quick search may end at
# any of these within a standard deviation of the minimum: rounding errors, and so the processor, would choose where.
LAST_SEARCH = replace(
    SEARCH,
    tolerance=settings.LAST_TOLERANCE,
    shortest=settings.LAST_TOLERANCE,
    gradient=settings.LAST_TOLERANCE,
    difference=settings.ROUGH_DIFFERENCE,
    most_evaluations=settings.LAST_EVALUATIONS,
    secants=False,
)


# Message of a fit that takes the values of another one.
VALUES_STAY = "no search: the values are those of a fit under another covariance"


# Two fits are the same if they are one object: arrays have no equality.
@dataclass(frozen=True, eq=False)
class CandidateFit:
    """A candidate model fitted to all recordings.

    Attributes
    ----------
    hypothesis : Hypothesis
    whitened : list of Whitened
        The observations that it was fitted to, with its own mechanisms' states as nuisances.
    free : dict of str to Free
        Unknowns of the calibration, without those of mechanisms.
    values : dict of str to float
        Of all unknowns.
    residuals : list of ndarray, each of shape (rows + nuisances,)
        By recording, whitened residuals of the joint fit.
    jacobian : list of ndarray, each of shape (rows + nuisances, unknowns)
        Their derivatives.
    covariance : ndarray, shape (unknowns, unknowns)
        Jackknife over recordings; of a single recording, from its noise.
    degrees_of_freedom : ndarray, shape (unknowns,)
        Of each variance.
    loo_values : list of dict
        By recording, values fitted to all other recordings.
    loo_residuals : list of ndarray, each of shape (rows + nuisances,)
        By recording, its whitened residuals at these values.
    message : str
        Why the search stopped.
    converged : bool
        Whether it came to a minimum.
    jackknife : tuple of ndarray, or None
        Covariance and degrees of freedom from the scatter between recordings alone; None if those above are these.
    shift : ndarray, shape (unknowns,), or None
        Change of the values on a finer solver (`discretisation_shift`), which is their discretisation error; None if it
        was not computed.
    """

    hypothesis: Hypothesis
    whitened: Sequence[Whitened]
    free: Mapping[str, Free]
    values: dict[str, float]
    residuals: list[NDArray]
    jacobian: list[NDArray]
    covariance: NDArray
    degrees_of_freedom: NDArray
    loo_values: list[dict[str, float]]
    loo_residuals: list[NDArray]
    message: str = ""
    converged: bool = True
    jackknife: tuple[NDArray, NDArray] | None = None
    shift: NDArray | None = None

    @cached_property
    def by_recording(self) -> NDArray:
        """Leave-one-out mean square of the whitened residuals; 1 is noise; shape (recordings,)."""
        return np.array([np.mean(e**2) for e in self.loo_residuals])

    @cached_property
    def mean_square(self) -> float:
        """Mean of `by_recording`."""
        return float(self.by_recording.mean())

    @cached_property
    def by_channel(self) -> dict[str, float]:
        """Leave-one-out mean square of the whitened residuals by channel, averaged over recordings; 1 is noise."""
        found: dict[str, list[float]] = {}
        for w, rows in zip(self.whitened, self.loo_residuals, strict=True):
            squares = (rows[: w.measured.size].reshape(w.measured.shape) ** 2).mean(axis=1)
            for channel, square in zip(w.observations.channels, squares.tolist(), strict=True):
                found.setdefault(channel, []).append(square)
        return {channel: float(np.mean(squares)) for channel, squares in found.items()}

    @property
    def is_good(self) -> bool:
        """Whether its mean square is at most `GOOD_FIT`, and no channel is left with an error above `CONSPICUOUS`."""
        worst = max(self.by_channel.values())
        return self.mean_square <= settings.GOOD_FIT and worst <= settings.CONSPICUOUS**2

    @cached_property
    def _unknowns(self) -> dict[str, Free]:
        """Its unknowns with their priors, in the order of its values."""
        unknowns = _unknowns(self.whitened, self.hypothesis, self.free, self.values)
        return {name: unknowns[name] for name in self.values}

    @cached_property
    def prior(self) -> tuple[NDArray, NDArray]:
        """Distances of unknowns from their prior's means over its standard deviations, and derivatives of these.

        Rows of the cost beside those of the recordings; shapes (priors,) and (priors, unknowns).
        """
        stated = [(name, one) for name, one in self._unknowns.items() if one.prior_precision]
        distances = np.array([f.prior_precision * (self.values[name] - f.prior_mean) for name, f in stated])
        derivatives = np.array([[f.prior_precision * (name == other) for other in self.values] for name, f in stated])
        return distances, derivatives.reshape(len(stated), len(self.values))

    @cached_property
    def prior_precision(self) -> NDArray:
        """Reciprocal standard deviation of each unknown's prior in the cost of the fit, 0 without one; (unknowns,)."""
        return np.array([one.prior_precision for one in self._unknowns.values()])

    @property
    def sizes(self) -> NDArray:
        """The unit in which each unknown is measured, shape (unknowns,)."""
        of_prior = zip(self.values.items(), self.prior_precision, strict=True)
        return np.array([1 / precision if precision else size_of(*one) for one, precision in of_prior])

    @property
    def information(self) -> list[NDArray]:
        """By recording, the information of its errors in the cost of the fit, shape (unknowns, unknowns)."""
        return [mean_weight(w.observations) * J.T @ J for w, J in zip(self.whitened, self.jacobian, strict=True)]

    @property
    def total_information(self) -> NDArray:
        """Information of all recordings and of the priors in the cost of the fit, shape (unknowns, unknowns)."""
        return sum(self.information, np.diag(self.prior_precision**2))

    @property
    def is_plausible(self) -> bool:
        """Whether its mechanisms' strengths lie within their plausible ranges."""
        return plausible(self.hypothesis, self.values)

    @property
    def discretisation(self) -> NDArray:
        """Discretisation error of each value, 0 if it was not computed; shape (unknowns,)."""
        return np.zeros(len(self.values)) if self.shift is None else self.shift

    def standard_deviations(self) -> NDArray:
        """Of each unknown, the discretisation error included; shape (unknowns,)."""
        return np.hypot(np.sqrt(np.diag(self.covariance).clip(0.0)), self.discretisation)

    def half_widths(self) -> NDArray:
        """Half-width of each unknown's 90 % interval, shape (unknowns,)."""
        # With infinite degrees of freedom this is the normal distribution's quantile.
        return student_quantile(0.5 + COVERAGE / 2, self.degrees_of_freedom) * self.standard_deviations()

    def log_support(self, name: str, place: str) -> float:
        """Log Bayes factor of a mechanism against its absence, from the scatter of its strength between recordings.

        The evidence counts `IN_EVIDENCE` samples per channel of every recording as independent; here each recording is
        one observation of the strength. With the statistic t = strength over its jackknife standard deviation, on nu
        degrees of freedom, Schwarz's approximation is (1 + t^2 / nu)^((nu + 1) / 2) / (nu + 1)^(1 / 2) (Kass and
        Raftery, Bayes factors, Journal of the American Statistical Association 90(430), 773-795, 1995,
        doi:10.1080/01621459.1995.10476572). Of several strengths, the clearest one counts. The result is infinite for a
        law, which has no strength, and if nothing scatters. The strength of a mechanism with states is the part that
        remains when the recordings start. Of a frozen baseline's mechanism, the clearest change of a parameter counts.

        The variance is conditional on the mechanism's other parameters, which have no meaning without the mechanism;
        each of them takes a degree of freedom. If fewer than one would be left, the variance is the marginal one.

        Where the interval is wider than the scatter, as that of an unknown with a prior may be, the lower support of
        the two counts: a wider interval has the degrees of freedom of all samples.

        The discretisation error, once computed, is added to that of the strength. Of the strengths on the usual solver
        and on the finer one, the one nearer to no effect counts.
        """
        support = self._log_support(name, place, self.covariance, self.degrees_of_freedom)
        return support if self.jackknife is None else min(support, self._log_support(name, place, *self.jackknife))

    def _log_support(self, name: str, place: str, covariance: NDArray, degrees: NDArray) -> float:
        mechanism, names = registry.get(name), list(self.values)
        if (name, place) in self.hypothesis.baseline:
            return self._log_support_of_change(name, place, covariance, degrees)
        apart = {p.name for p in (*mechanism.strengths, *mechanism.states)}
        keys = [mechanism_key(name, place, p.name) for p in mechanism.parameters if p.name not in apart]
        shapes = [names.index(key) for key in keys if key in self.values]
        states = [names.index(mechanism_key(name, place, state.name)) for state in mechanism.states]
        left = 1.0 - np.array([self.values[names[k]] for k in states])
        most = -np.inf
        for strength in mechanism.strengths:
            k = names.index(mechanism_key(name, place, strength.name))
            of_both = self.values[names[k]] - strength.neutral + np.array([0.0, self.discretisation[k]])
            whole = float(of_both[np.argmin(np.abs(of_both))])
            nu = float(degrees[k])
            # The derivatives of what is left: by the strength, and by each state.
            slopes = [float(left.prod()), *(-whole * float(np.delete(left, i).prod()) for i in range(left.size))]
            of_part = covariance[np.ix_([k, *states], [k, *states])]
            if nu - len(shapes) >= 1:
                of_part, nu = _given(covariance, [k, *states], shapes), nu - len(shapes)
            moved = self.discretisation[[k, *states]]
            variance = np.array(slopes) @ (of_part + np.outer(moved, moved)) @ np.array(slopes)
            if not variance > 0.0:
                return np.inf
            most = max(most, _log_factor((whole * float(left.prod())) ** 2 / variance, nu))
        return most if np.isfinite(most) else np.inf

    def _log_support_of_change(self, name: str, place: str, covariance: NDArray, degrees: NDArray) -> float:
        """As `_log_support`, of a mechanism of a frozen baseline."""
        names, model = list(self.values), self.whitened[0].observations.parameters
        known = next(m.values for m in model.mechanisms if (m.name, m.place) == (name, place))
        found = [-np.inf]
        for parameter, before in known.items():
            if (key := mechanism_key(name, place, parameter)) in self.values:
                k = names.index(key)
                if not covariance[k, k] > 0.0:
                    return np.inf
                found.append(_log_factor((self.values[key] - before) ** 2 / covariance[k, k], float(degrees[k])))
        return max(found)

    def intervals(self) -> dict[str, Interval]:
        """The 90 % interval of each unknown of the calibration, within its bounds."""
        rows = zip(self.values.items(), self.half_widths(), self.standard_deviations(), strict=True)
        return {
            name: Interval(max(value - reach, self.free[name].low), min(value + reach, self.free[name].high), sd)
            for (name, value), reach, sd in ((one, float(reach), float(sd)) for one, reach, sd in rows)
            if name in self.free
        }

    def at_bounds(self) -> list[str]:
        """Unknowns of the calibration that stand at one of their bounds."""
        return [name for name, free in self.free.items() if is_at_bound(self.values[name], free)]

    def model(self, estimates: Parameters, batch: str = "") -> Parameters:
        """The fitted model, with estimates of everything that is not fitted; of one batch, with its own values.

        Of several batches, each has its own factor of friction. The coefficient has it here, so that the friction of a
        recording (`Whitened.own`) is relative to its batch's.
        """
        model = self.hypothesis.of(estimates).with_values(self.values, batch)
        return replace(model, friction_coefficient=model.friction, friction_scale=1.0) if batch else model

    def held_out(self, i: int) -> Observations:
        """One of the recordings with the model that was fitted to all others."""
        o = self.whitened[i].observations
        return o.with_parameters(self.hypothesis.of(o.parameters).with_values(self.loo_values[i], o.session))


def fit(
    whitened: Sequence[Whitened],
    hypothesis: Hypothesis,
    free: Mapping[str, Free],
    start: Mapping[str, float],
    deadline: Deadline = UNLIMITED,
    search: Search = SEARCH,
    calibration: Mapping[str, float] | None = None,
) -> CandidateFit:
    """Fit a candidate model from given values and cross-validate it.

    Parameters
    ----------
    whitened : sequence of Whitened
    hypothesis : Hypothesis
    free : mapping of str to Free
        Unknowns of the calibration.
    start : mapping of str to float
        Starting values of these and of the mechanisms' unknowns.
    deadline : Deadline
        When the fit is given up.
    search : Search
    calibration : mapping of str to float, optional
        Values of `free` from which the search may start too, where the initial tension is not observed. The default is
        the start with a slack cable. A fit that goes on from an earlier one needs none of these.

    Raises
    ------
    ModelError
        If the model cannot be run at a point of the search.
    ccmodel.deadline.OutOfTimeError
        If the deadline has passed.
    """
    unknowns = _unknowns(whitened, hypothesis, free, start)
    modelled = _with_states(whitened, hypothesis, {n: f.start for n, f in unknowns.items()})
    problem = Problem(modelled, unknowns, weight=mean_weight)
    # Runs of the paper's model are cheap, and its cost is rough where much is missing.
    secants = search.secants and bool(hypothesis.baseline or hypothesis.acting)
    search = replace(search, deadline=deadline, secants=secants)
    solution = _search(problem, hypothesis, search, calibration)
    further = replace(search, most_evaluations=settings.START_EVALUATIONS)
    for _ in range(settings.STATE_PASSES if _has_states(hypothesis) else 0):
        # The states' effects were those of the values at the start, which the fit has left.
        before, values = solution.cost, problem.values_of(solution.x, 0)
        own = [w.states_within_range(values) for w in modelled]
        modelled = _with_states(whitened, hypothesis, values, own)
        # Steps are measured by the start: a rate that has become slow needs large ones. A prior keeps its mean.
        unknowns = {n: f if f.spread else replace(f, start=values[n]) for n, f in unknowns.items()}
        problem = Problem(modelled, unknowns, weight=mean_weight)
        solution = minimise(problem, inside_bounds(problem, solution.x), further)
        if abs(solution.cost - before) < settings.STATE_TOLERANCE * before:
            break
    return _cross_validated(hypothesis, free, problem, solution)


def evaluated(candidate: CandidateFit, whitened: Sequence[Whitened]) -> CandidateFit:
    """A candidate with its values, under the covariance of other whitened observations: a fit that takes no step.

    Raises
    ------
    ModelError
        If the model cannot be run.
    """
    hypothesis, values = candidate.hypothesis, candidate.values
    unknowns = _unknowns(whitened, hypothesis, candidate.free, values)
    own = [w.states_within_range(values) for w in candidate.whitened] if _has_states(hypothesis) else None
    problem = Problem(_with_states(whitened, hypothesis, values, own), unknowns, weight=mean_weight)
    solution = minimise(problem, inside_bounds(problem, problem.start), replace(SEARCH, most_evaluations=1))
    again = _cross_validated(hypothesis, candidate.free, problem, solution)
    return replace(again, message=VALUES_STAY, converged=candidate.converged)


def is_at_bound(value: float, free: Free) -> bool:
    """Whether a value is that of one of its bounds, all but for a small share of the bound, or of the range."""
    ends, width = (free.low, free.high), free.high - free.low
    return any(abs(value - bound) <= settings.AT_BOUND * (abs(bound) or width) for bound in ends)


def _has_states(hypothesis: Hypothesis) -> bool:
    """Whether one of its mechanisms has a state when a recording starts."""
    return any(registry.get(name).states for name, _ in hypothesis.baseline + hypothesis.acting)


def _unknowns(
    whitened: Sequence[Whitened], hypothesis: Hypothesis, free: Mapping[str, Free], start: Mapping[str, float]
) -> dict[str, Free]:
    """Unknowns of the calibration and of the mechanisms, with their priors and these starting values."""
    unknowns = {n: replace(f, start=start[n]) for n, f in free.items()} | hypothesis.free(start)
    return unknowns | _with_priors(whitened, hypothesis, unknowns)


def _cross_validated(
    hypothesis: Hypothesis, free: Mapping[str, Free], problem: Problem, solution: Solution
) -> CandidateFit:
    """The candidate of a solution, with what each recording's absence does to it."""
    modelled = problem.observations
    left_out = leave_one_out(problem, solution)
    covariance, degrees = left_out.covariance, left_out.degrees_of_freedom
    if len(modelled) == 1:
        covariance = covariance / of_recording(modelled[0].observations)
    alone = None
    if problem.prior_precision.any():
        alone = covariance, degrees
        covariance, degrees = at_least_by_information(problem, solution, covariance, degrees)
    roots = [np.sqrt(w.measured.size) for w in modelled]
    return CandidateFit(
        hypothesis,
        modelled,
        free,
        problem.values_of(solution.x, 0),
        [block.errors * root for block, root in zip(solution.blocks, roots, strict=True)],
        [block.derivatives * root for block, root in zip(solution.blocks, roots, strict=True)],
        covariance,
        degrees,
        [problem.values_of(x, 0) for x in left_out.values],
        left_out.residuals,
        solution.message,
        solution.converged,
        alone,
    )


def _with_priors(whitened: Sequence[Whitened], hypothesis: Hypothesis, unknowns: Mapping[str, Free]) -> dict[str, Free]:
    """The unknowns of mechanisms that have a prior: the states' means, and the coefficients of laws.

    A state's mean has the prior that a single recording's state has too: where little of a mechanism shows, its
    strength and its state are nearly one unknown, which the prior divides.
    """
    observations = [w.observations for w in whitened]
    return {
        key: replace(unknowns[key], mean=p.start, spread=prior_spread(p.spread or p.prior_sd, observations))
        for name, place in hypothesis.baseline + hypothesis.acting
        for p in registry.get(name).parameters
        if (p.spread or p.prior_sd) and (key := mechanism_key(name, place, p.name)) in unknowns
    }


def at_least_by_information(
    problem: Problem, solution: Solution, covariance: NDArray, degrees: NDArray
) -> tuple[NDArray, NDArray]:
    """Covariance and degrees of freedom of the wider of two intervals of each unknown: the given one, and that of
    the information of all recordings and of the priors.

    A jackknife does not see a direction that no recording determines: all leave-one-out fits stay where it started.
    """
    low, high = problem.bounds
    information = np.diag(12 / (high - low) ** 2)  # an unknown lies anywhere within its bounds
    for w, block in zip(problem.observations, solution.blocks, strict=True):
        prior = problem.prior_precision**2 / len(solution.blocks)
        # Without the rows of states beyond their range: these bound a state on one side only.
        J = block.derivatives[: w.measured.size + len(w.scalar_nuisances)]
        information += of_recording(w.observations) * (J.T @ J + np.diag(prior))
    variance, least = np.diag(covariance).clip(0.0), np.diag(inverse_of(information, problem.sizes))
    normal, student = normal_quantile(0.5 + COVERAGE / 2), student_quantile(0.5 + COVERAGE / 2, degrees)
    wider = normal**2 * least > student**2 * variance
    ratio = np.sqrt(np.divide(least, variance, out=np.ones_like(least), where=wider & (variance > 0)))
    covariance = covariance * np.outer(ratio, ratio) + np.diag(np.where(variance > 0, 0.0, least))
    return covariance, np.where(wider, np.inf, degrees)


def _with_states(
    whitened: Sequence[Whitened],
    hypothesis: Hypothesis,
    values: Mapping[str, float],
    own: Sequence[Mapping[str, float]] | None = None,
) -> list[Whitened]:
    """Observations for a hypothesis, with the states of its mechanisms as nuisances, linearised about values.

    `own` are each recording's own states.
    """

    def of(i: int, w: Whitened) -> Whitened:
        model = hypothesis.of(w.observations.parameters)
        states = own[i] if own else None
        return with_states_of(w, model.with_values(values, w.session), states).with_parameters(model)

    return each(whitened, of)


def _search(
    problem: Problem, hypothesis: Hypothesis, search: Search, calibration: Mapping[str, float] | None = None
) -> Solution:
    starts = [inside_bounds(problem, x) for x in starting_points(problem, calibration)]
    if len(starts) > 1:
        starts = [best_start(problem, starts, search).x]
    if hypothesis.continuation:
        short = minimise(problem, starts[0], replace(search, most_evaluations=settings.START_EVALUATIONS))
        if short.cost > settings.PROMISING * _cost_without(problem, hypothesis):
            return short
        starts = [inside_bounds(problem, short.x)]
    solution = minimise(problem, starts[0], search)
    if solution.message == STALLED:
        rough = minimise(problem, solution.x, replace(search, difference=settings.ROUGH_DIFFERENCE))
        solution = min(solution, rough, key=lambda s: s.cost)
    # A set has many unknowns and starts from a linear guess, or from where a smaller one ended.
    if solution.message == STOPPED and hypothesis.size > 1:
        solution = minimise(problem, solution.x, search)
    for name in hypothesis.continuation:
        solution = continued(
            lambda x: minimise(problem, x, search), solution, problem.names.index(name), problem.bounds[0]
        )
    return solution


def inside_bounds(problem: Problem, x: NDArray) -> NDArray:
    """A point off the bounds of the unknowns, from which a search can start; all of shape (unknowns,)."""
    low, high = problem.bounds
    inside = 1e-9 * (high - low)
    return np.clip(x, low + inside, high - inside)


def _cost_without(problem: Problem, hypothesis: Hypothesis) -> float:
    """Cost at the start with no effect of the candidate's mechanisms."""
    values = zip(problem.names, problem.start, strict=True)
    return problem.cost(np.array([hypothesis.neutral.get(name, value) for name, value in values]))


def starting_points(problem: Problem, calibration: Mapping[str, float] | None = None) -> list[NDArray]:
    """The problem's start; where the initial tension is not observed, also one with other values of the calibration.

    These are the given ones, or, by default, those of a slack cable.
    """
    if "pretension_share" not in problem.names:
        return [problem.start]
    if calibration is None:
        is_pretension = np.array(problem.names) == "pretension_share"
        return [np.where(is_pretension, share * problem.start, problem.start) for share in settings.PRETENSION_STARTS]
    pairs = zip(problem.names, problem.start, strict=True)
    other = np.array([calibration.get(name, value) for name, value in pairs])
    return [problem.start] if np.array_equal(other, problem.start) else [problem.start, other]


def best_start(problem: Problem, starts: Sequence[NDArray], search: Search = SEARCH) -> Solution:
    """The best of short searches; a start at which the model cannot be run counts only if it can at none."""
    found, failures = [], []
    for x in starts:
        try:
            found.append(minimise(problem, x, replace(search, most_evaluations=settings.START_EVALUATIONS)))
        except ModelError as error:
            failures.append(error)
    if not found:
        raise failures[-1]
    return min(found, key=lambda solution: solution.cost)


def continued(search: Callable[[NDArray], Solution], solution: Solution, k: int, low: NDArray) -> Solution:
    """Continuation in one unknown: from its value downwards by steps, as long as that lowers the cost."""
    while solution.x[k] > settings.CONTINUATION_FACTOR * low[k]:
        x = solution.x.copy()
        x[k] /= settings.CONTINUATION_FACTOR
        try:
            lower = search(x)
        except ModelError:
            break
        if lower.cost > (1 - settings.FIT_TOLERANCE) * solution.cost:
            break
        solution = lower
    return solution


def discretisation_shift(candidate: CandidateFit) -> NDArray:
    """Values on a finer solver minus values on the usual one, to first order; shape (unknowns,).

    Raises
    ------
    ModelError
        If the model cannot be run on the finer solver.
    """
    finer = [
        w.with_parameters(replace(candidate.hypothesis.of(w.observations.parameters), refinement=settings.REFINEMENT))
        for w in candidate.whitened
    ]
    changes = each(finer, lambda i, w: w.errors(candidate.values) - candidate.residuals[i])
    weights = [mean_weight(w.observations) for w in candidate.whitened]
    score = sum(c * J.T @ e for J, e, c in zip(candidate.jacobian, changes, weights, strict=True))
    return -inverse_of(candidate.total_information, candidate.sizes) @ score


def _log_factor(t2: float, nu: float) -> float:
    """Log Bayes factor of the square of a Student's t statistic on `nu` degrees of freedom, which may be infinite."""
    return float((nu + 1) / 2 * np.log1p(t2 / nu) - np.log(nu + 1) / 2 if np.isfinite(nu) else t2 / 2)


def _given(covariance: NDArray, wanted: list[int], known: list[int]) -> NDArray:
    """Covariance of some unknowns of a normal distribution where others are known, shape (wanted, wanted)."""
    across = covariance[np.ix_(wanted, known)]
    return covariance[np.ix_(wanted, wanted)] - across @ np.linalg.pinv(covariance[np.ix_(known, known)]) @ across.T
