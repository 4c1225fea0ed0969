"""Second stage: the unknowns of the calibrated model, and a first fit about which errors are whitened."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ccmodel import mechanisms as registry
from ccmodel.channels import TAU_IN, TAU_OUT, ZERO_OF
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.hypothesis import PAPER, Hypothesis
from ccmodel.failure import ModelError
from ccmodel.inference.effective_samples import prior_spread
from ccmodel.inference.least_squares import Search, solve
from ccmodel.inference.observations import Observations
from ccmodel.inference.problem import Free, Problem
from ccmodel.model.active import active_of
from ccmodel.model.parameters import Parameters, batch_key, mechanism_key, parameter_of

# What belongs to a rig, whatever its batches show of it; a stiffness goes with the length that it is of.
OF_RIG = (
    "stiffness_N_per_m",
    "reference_length_m",
    "friction_coefficient",
    "extra_bend_rad",
    "load_radius_m",
    "spring_beside_load_Nm_per_rad",
)


@dataclass(frozen=True)
class TestedModel:
    """The model that is tested against the recordings.

    Attributes
    ----------
    hypothesis : Hypothesis
        The paper's model, or a baseline with the mechanisms that it has.
    estimates : Parameters
        Values of everything that is not fitted.
    free : dict of str to Free
        Unknowns of the calibration, without those of mechanisms.
    start : dict of str to float
        Values of all unknowns from a first fit, or from the baseline.
    """

    hypothesis: Hypothesis
    estimates: Parameters
    free: dict[str, Free]
    start: dict[str, float]

    @property
    def model(self) -> Parameters:
        """The model at its starting values."""
        return self.hypothesis.of(self.estimates).with_values(self.start)


def tested_model(
    observations: Sequence[Observations],
    estimates: Parameters,
    baseline: Parameters | None,
    freeze: bool,
    only: Collection[str] | None = None,
) -> TestedModel:
    """The paper's model with a first fit, or a baseline with its own values; a frozen baseline keeps them.

    Parameters
    ----------
    only : collection of str, optional
        Unknowns of the calibration that are fitted; all others keep their estimates.
    """
    free = calibration(estimates, observations)
    if only is not None:
        free = _chosen(free, only)
    estimates = estimates.with_values({name: one.start for name, one in free.items()})
    if baseline is None:
        at_estimates = [o.with_parameters(estimates) for o in observations]
        return TestedModel(PAPER, estimates, free, _first_fit(at_estimates, free))
    if freeze:
        # What drifted while the baseline's batch was recorded says nothing of another session.
        kept = tuple(m for m in baseline.mechanisms if registry.get(m.name).drift is None)
        baseline = replace(baseline, mechanisms=kept)
        estimates = _with_rig_of(baseline, estimates)
    baseline = replace(baseline, mechanisms=tuple(active_of(baseline.mechanisms)))
    hypothesis = Hypothesis(
        baseline=tuple((m.name, m.place) for m in baseline.mechanisms), fixed=_fixed_by_conditions(baseline)
    )
    pretension_N = float(np.mean([o.given.recording.pretension_N for o in observations]))
    start = _values_of(baseline, free, hypothesis, pretension_N)
    if freeze:
        estimates = hypothesis.of(estimates).with_values(start)
        # The zero of a sensor may change without any change of the rig.
        free = {name: one for name, one in free.items() if parameter_of(name) in ZERO_OF.values()}
        hypothesis = replace(hypothesis, is_frozen=True)
    return TestedModel(hypothesis, estimates, free, start)


def _with_rig_of(baseline: Parameters, estimates: Parameters) -> Parameters:
    """Estimates with all that a baseline has of its rig, also where the recordings at hand would not free it."""
    values: dict[str, Any] = {name: getattr(baseline, name) for name in OF_RIG}
    return replace(estimates, **values)


def _fixed_by_conditions(baseline: Parameters) -> tuple[tuple[str, float], ...]:
    """Values that the conditions of the recordings set, such as a learned law's range, which belong to its others."""
    return tuple(
        (mechanism_key(m.name, m.place, p.name), m.values[p.name])
        for m in baseline.mechanisms
        for p in registry.get(m.name).parameters
        if p.fixed
    )


def calibration(estimates: Parameters, observations: Sequence[Observations]) -> dict[str, Free]:
    """Unknowns of a calibration: stiffness, friction, the load's spring, and whatever a rest does not show."""
    free = {
        "stiffness_N_per_m": _free(estimates.stiffness_N_per_m, *settings.STIFFNESS_N_PER_M),
        "friction_coefficient": _free(estimates.friction_coefficient, *settings.FRICTION),
    }
    has_torque = [o for o in observations if TAU_IN in o.channels]
    load_is_free = not any(o.given.recording.load_motion_is_given for o in observations)
    if estimates.load_stiffness_Nm_per_rad is not None:
        free["load_stiffness_Nm_per_rad"] = _free(estimates.load_stiffness_Nm_per_rad, *settings.LOAD_NM_PER_RAD)
    elif load_is_free and len(has_torque) == len(observations):
        # A spring parallel to the load, which the torque sensor at the load does not measure.
        ratios = [np.ptp(o.given.recording[TAU_IN]) / np.ptp(o.given.theta_in) for o in observations]
        start, most = (factor * float(np.median(ratios)) for factor in settings.PARALLEL_SPRING)
        free["spring_beside_load_Nm_per_rad"] = Free(start, 0.0, most)
    if not all(o.given.initial_tension_observed for o in observations):
        free["pretension_share"] = Free(1.0, *settings.PRETENSION_SHARE)
        if load_is_free:
            radius = estimates.load_radius_m
            free["load_radius_m"] = Free(radius, *(ratio * radius for ratio in settings.RADIUS_RATIO))
        if has_torque:
            reach = max(float(np.ptp(o.given.recording[TAU_IN])) for o in has_torque)
            zeros = (ZERO_OF[TAU_IN], ZERO_OF[TAU_OUT])
            free |= {name: Free(0.0, -reach, reach) for zero in zeros for name in _by_session(zero, has_torque)}
    return free | _between_batches(observations)


def sessions_of(observations: Sequence[Observations]) -> list[str]:
    """Batches of these observations that are taken together; one that is empty for a batch by itself."""
    return list(dict.fromkeys(o.session for o in observations))


def _by_session(name: str, observations: Sequence[Observations]) -> list[str]:
    """Names of a parameter that each batch has a value of its own for."""
    sessions = sessions_of(observations)
    return [name] if len(sessions) == 1 else [batch_key(name, session) for session in sessions]


def _between_batches(observations: Sequence[Observations]) -> dict[str, Free]:
    """What differs from batch to batch of a rig, with priors about the rig's value; nothing of a batch by itself.

    The friction of a batch with one recording is a nuisance of that recording (`Observations.friction_between`): left
    out, nothing would determine an unknown.
    """
    if len(sessions_of(observations)) == 1:
        return {}
    spreads = {
        batch_key("friction_scale", session): settings.FRICTION_BETWEEN
        for session in sessions_of([o for o in observations if not o.friction_between])
    }
    if not all(o.given.initial_tension_observed for o in observations):
        spreads |= dict.fromkeys(_by_session("pretension_scale", observations), settings.PRETENSION_BETWEEN)
    low, high = settings.BETWEEN_BOUNDS
    return {name: Free(1.0, low, high, prior_spread(s, observations), mean=1.0) for name, s in spreads.items()}


def _chosen(free: Mapping[str, Free], names: Collection[str]) -> dict[str, Free]:
    """Some of the unknowns of a calibration, in its order."""
    if unknown := [name for name in names if name not in free]:
        raise ModelError(f"{', '.join(unknown)} cannot be fitted to these recordings; {', '.join(free)} can")
    if not names:
        raise ModelError(f"nothing to fit; these recordings determine {', '.join(free)}")
    return {name: one for name, one in free.items() if name in names}


def _free(estimate: float, low: float, high: float) -> Free:
    """An unknown within bounds, which an estimate further out widens tenfold beyond itself."""
    if estimate > 0:
        low, high = min(low, estimate / 10), max(high, 10 * estimate)
    return Free.within(estimate, low, high)


def _values_of(
    baseline: Parameters, free: Mapping[str, Free], hypothesis: Hypothesis, pretension_N: float
) -> dict[str, float]:
    """The baseline's values of the unknowns, or their starts.

    A baseline with one initial tension for all recordings has it as a share of their mean stated pretension.
    """
    values = {name: baseline.value_of(parameter_of(name)) for name in [*free, *hypothesis.start]}
    if baseline.pretension_N is not None and "pretension_share" in values:
        values["pretension_share"] *= baseline.pretension_N / pretension_N
    return {name: free[name].start if value is None else value for name, value in values.items()}


def _first_fit(observations: Sequence[Observations], free: Mapping[str, Free]) -> dict[str, float]:
    shared = {name: one for name, one in free.items() if one.spread is None}
    # What differs between batches differs between their recordings too.
    spread = settings.FRICTION_SPREAD
    if len(sessions_of(observations)) > 1:
        spread = float(np.hypot(spread, settings.FRICTION_BETWEEN))
    problem = Problem(observations, shared, {"friction_scale": Free(1.0, *settings.BETWEEN_BOUNDS, spread)})
    how = Search(most_evaluations=settings.FIRST_FIT_EVALUATIONS, tolerance=settings.FIRST_FIT_TOLERANCE)
    found = dict(zip(shared, solve(problem, problem.start, how).x.tolist(), strict=False))
    return {name: found.get(name, one.start) for name, one in free.items()}
