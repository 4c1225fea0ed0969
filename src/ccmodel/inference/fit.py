"""A fit with its uncertainties, as plain data."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from ccmodel.failure import ModelError
from ccmodel.inference.interval_checks import bootstrap, profile
from ccmodel.inference.intervals import (
    Interval,
    Scatter,
    Undetermined,
    covariance,
    intervals,
    own_intervals,
    scatter,
    undetermined,
)
from ccmodel.inference.least_squares import Solution, solve
from ccmodel.inference.problem import Problem
from ccmodel.progress import Progress, silent

# Optima of several starts count as one if no unknown differs by more than this share of its size.
SAME = 1e-3
# Half-width of the range from which further starts are drawn, as a share of each unknown's size.
START_SPREAD = 0.3
SEED = 1
# Share of the searches in the time of a fit; the rest is the intervals'.
SEARCHED = 0.7
# Fewest recordings for a bootstrap over recordings.
ENOUGH_RECORDINGS = 6
# Ratio of the bootstrap's standard deviation to the interval's from which a warning is given.
DISAGREE = 2.0


@dataclass(frozen=True)
class FitResult:
    """The result of a fit, or the reason why there is none.

    Attributes
    ----------
    succeeded : bool
    message : str
        Why the search stopped, or the error.
    values : dict
        Shared values by parameter name, SI units; empty where the fit failed.
    intervals : dict
        The 90 % interval of each shared value; of the population mean, if recordings differ in it.
    profiles : dict
        The same from the profile likelihood, for the unknowns that were requested.
    own, own_intervals : dict
        By recording, its own values and their intervals; `friction` among the latter is the recording's own mu.
    scatter : dict
        By parameter, the scatter of the recordings' own values and the scatter of their prior.
    resampled : dict
        Bootstrap standard deviation of each shared value over sets of recordings; empty with too few of them.
    at_bound : list of str
        Unknowns that ended on one of their bounds: the recordings do not determine them, or the bounds are too narrow.
    undetermined : list of Undetermined
        Combinations of unknowns that the recordings do not determine.
    warnings : list of str
    cost : float or None
        Mean square of the errors over their noise.
    evaluations : int
    recordings : list of str
        The recordings that were fitted.
    """

    succeeded: bool
    message: str
    values: dict[str, float] = field(default_factory=dict)
    intervals: dict[str, Interval] = field(default_factory=dict)
    profiles: dict[str, Interval] = field(default_factory=dict)
    own: dict[str, dict[str, float]] = field(default_factory=dict)
    own_intervals: dict[str, dict[str, Interval]] = field(default_factory=dict)
    scatter: dict[str, Scatter] = field(default_factory=dict)
    resampled: dict[str, float] = field(default_factory=dict)
    at_bound: list[str] = field(default_factory=list)
    undetermined: list[Undetermined] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    cost: float | None = None
    evaluations: int = 0
    recordings: list[str] = field(default_factory=list)

    def as_dict(self) -> dict:
        """Plain data for a JSON file, with None for infinite numbers, which JSON does not have."""
        return json.loads(json.dumps(asdict(self)), parse_constant=lambda infinite: None)


def fit(problem: Problem, starts: int = 1, profiled: Sequence[str] = (), progress: Progress = silent) -> FitResult:
    """Fit a problem from several starts and estimate the uncertainty of the values.

    Parameters
    ----------
    problem : Problem
    starts : int
        Number of starts: the configured one, and others drawn within 30 % of each unknown's size, from a fixed seed.
    profiled : sequence of str
        Shared unknowns whose intervals are also taken from their profile likelihood.
    progress : Progress

    Returns
    -------
    FitResult
        A failed fit is a result with its reason, not an exception.
    """
    names = [e.name for e in problem.observations]
    if not names:
        return FitResult(False, "no usable recording to fit")
    low, high = problem.bounds
    if (outside := (problem.start < low) | (problem.start > high)).any():
        k = int(np.argmax(outside))
        text = f"{problem.names[k]} starts at {problem.start[k]:.4g}, outside its bounds {low[k]:.4g} to {high[k]:.4g}"
        return FitResult(False, text, recordings=names)
    solutions, failures = [], []
    for k, x in enumerate(_starts(problem, starts)):
        progress(f"search {k + 1} of {starts}", SEARCHED * k / starts)
        try:
            solutions.append(solve(problem, x))
        except (ModelError, ValueError) as error:
            failures.append(str(error))
    if not solutions:
        return FitResult(False, failures[0], recordings=names)
    best = min(solutions, key=lambda s: s.cost)
    if not best.converged:
        return FitResult(False, best.message, evaluations=best.evaluations, recordings=names)
    progress("intervals of the values", SEARCHED)
    return _result(problem, best, _warnings(problem, best, solutions, failures), profiled)


def _starts(problem: Problem, count: int) -> Sequence[NDArray]:
    drawn = np.random.default_rng(SEED).uniform(-START_SPREAD, START_SPREAD, (count - 1, problem.start.size))
    shared = np.arange(problem.start.size) < len(problem.shared)
    others = problem.start + np.where(shared, drawn * problem.sizes, 0.0)
    return [np.clip(x, *problem.bounds) for x in (problem.start, *others)]


def _warnings(problem: Problem, best: Solution, solutions: list[Solution], failures: list[str]) -> list[str]:
    found = [f"one of the starts failed: {text}" for text in failures]
    shared = slice(0, len(problem.shared))
    apart = [s for s in solutions if (np.abs(s.x - best.x)[shared] > SAME * problem.sizes[shared]).any()]
    if apart:
        found.append(f"{len(apart)} of {len(solutions)} starts ended elsewhere, at a higher or equal error")
    return found


def _result(problem: Problem, found: Solution, warnings: list[str], profiled: Sequence[str]) -> FitResult:
    spread = covariance(problem, found)
    variance = np.diag(spread)
    groups = undetermined(problem, found)
    unbounded = {name: Interval(-inf, inf, inf) for group in groups for name in group.parameters}
    known = intervals(problem, found, variance) | unbounded
    profiles, without_profile = _profiles(problem, found, [n for n in profiled if isfinite(known[n].sd)], variance)
    scattered = scatter(problem, found)
    resampled = bootstrap(problem, found) if len(problem.observations) >= ENOUGH_RECORDINGS else {}
    return FitResult(
        succeeded=True,
        message=found.message,
        values=dict(zip(problem.shared, found.x.tolist(), strict=False)),
        intervals=known,
        profiles=profiles,
        own={o.name: problem.own_values_of(found.x, i) for i, o in enumerate(problem.observations) if problem.own},
        own_intervals=own_intervals(problem, found, spread) if problem.own else {},
        scatter=scattered,
        resampled=resampled,
        at_bound=[n for n, active in zip(problem.names, found.active, strict=True) if active],
        undetermined=groups,
        warnings=[*warnings, *without_profile, *_unlikely(scattered), *_disagreeing(known, resampled)],
        cost=problem.mean_square(found.x),
        evaluations=found.evaluations,
        recordings=[e.name for e in problem.observations],
    )


def _profiles(
    problem: Problem, found: Solution, names: Sequence[str], variance: NDArray
) -> tuple[dict[str, Interval], list[str]]:
    """Intervals from profiles, and a line for each profile along which the model could not be run."""
    profiles, failures = {}, []
    for name in names:
        try:
            profiles[name] = profile(problem, found, name, variance)
        except (ModelError, ValueError) as error:
            failures.append(f"no profile of {name}: {error}")
    return profiles, failures


def _unlikely(scattered: dict[str, Scatter]) -> list[str]:
    return [
        f"{name} differs by {s.found:.3g} from recording to recording where {s.expected:.3g} was expected; intervals "
        "are wider for it"
        for name, s in scattered.items()
        if s.widens
    ]


def _disagreeing(known: dict[str, Interval], resampled: dict[str, float]) -> list[str]:
    return [
        f"{name}: resampled recordings scatter by {sd:.3g}, its interval says {known[name].sd:.3g}"
        for name, sd in resampled.items()
        if sd > DISAGREE * known[name].sd
    ]
