"""Whitened observations: errors of a recording divided by the square root of their covariance.

The covariance has two parts: the sensors' noise, and nuisances that differ from run to run. Nuisances are friction, an
initial tension that is not observed, sensor zeros, encoder offsets and the uncertain drive motion, each a direction in
the space of errors with a prior standard deviation. They are marginalised, so that no fit needs unknowns for them.

A nuisance far outside its prior, such as friction that is 10 % higher in every recording, is one number among
thousands of samples. The posterior means of the nuisances are therefore appended to the whitened errors, each with the
weight of one effective sample.

Errors are linear in a nuisance only nearby. Each recording is therefore linearised about its own friction and
initial tensions and, of mechanisms with states, about its own states.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import hypot

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.channels import THETA_OUT, ZERO_OF
from ccmodel.diagnosis import settings
from ccmodel.diagnosis.spreads import FRICTION, FRICTION_SCALE, PRETENSION, STATED, Repeatability
from ccmodel.inference.effective_samples import IN_DIAGNOSIS
from ccmodel.inference.jacobian import STEP, jacobian, size_of
from ccmodel.inference.observations import Observations
from ccmodel.model.active import Active
from ccmodel.model.general.run import settings_of
from ccmodel.model.parameters import Parameters, mechanism_key, mechanism_parameter, of_batch
from ccmodel.model.session import known_states

# Step of the differences by a nuisance, relative to its size.
NUISANCE_STEP = 10 * STEP
# Curvatures of the initial tensions between a cable's ends.
CURVATURES = ("tension_curvature_A", "tension_curvature_B")


@dataclass(frozen=True)
class Whitened:
    """Observations with the covariance of their errors, linearised about a model.

    Attributes
    ----------
    observations : Observations
    directions : ndarray, shape (rows, k)
        Orthonormal directions of the nuisances, among errors over the sensors' noise.
    shrinkage : ndarray, shape (k,)
        Share by which whitening reduces the errors along each direction.
    nuisance_mean : ndarray, shape (nuisances, rows)
        Maps errors over the sensors' noise to the posterior mean of each scalar nuisance over its prior standard
        deviation.
    determined : ndarray, shape (nuisances,)
        One minus the posterior variance of each scalar nuisance over its prior variance.
    noise_floor : dict of str to float
        Root mean square error of a correct model by channel, in its unit: sensor noise, uncertain drive motion,
        the tolerance, and what differs from run to run: friction, the initial tension, zeros and states.
    scalar_nuisances : sequence of (str, float, float)
        Parameter, value and prior standard deviation of each scalar nuisance.
    effects : ndarray, shape (rows, nuisances and draws)
        Effects of the nuisances on the errors (`nuisances`), of which directions and shrinkage follow.
    repeatability : Repeatability
        Where the prior standard deviations come from.
    own : mapping of str to float
        Parameters of this recording alone about which its errors are linearised: its friction over that of its batch,
        and the curvature of its initial tensions.
    own_errors : ndarray, shape (rows,)
        Change of the errors by these, to first order.
    own_states : mapping of str to float
        States of mechanisms in this recording about which its errors are linearised.
    """

    observations: Observations
    directions: NDArray
    shrinkage: NDArray
    nuisance_mean: NDArray
    determined: NDArray
    noise_floor: Mapping[str, float]
    scalar_nuisances: Sequence[tuple[str, float, float]]
    effects: NDArray
    repeatability: Repeatability = STATED
    own: Mapping[str, float] = field(default_factory=dict)
    own_errors: NDArray | float = 0.0
    own_states: Mapping[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Batch and recording."""
        return self.observations.name

    @property
    def session(self) -> str:
        """Batch among several that are taken together; empty for a batch by itself."""
        return self.observations.session

    @property
    def measured(self) -> NDArray:
        """Values of the observations, shape (channels, samples)."""
        return self.observations.measured

    def whiten(self, errors: NDArray) -> NDArray:
        """Errors over the sensors' noise, whitened; shape (rows,)."""
        return errors - self.directions @ (self.shrinkage * (self.directions.T @ errors))

    def with_nuisances(self, errors: NDArray) -> NDArray:
        """Whitened errors, followed by the nuisances' posterior means; shape (rows + nuisances,)."""
        return np.concatenate([self.whiten(errors), self._nuisance_weight * (self.nuisance_mean @ errors)])

    def errors(self, values: Mapping[str, float]) -> NDArray:
        """Whitened errors of the model with some parameters replaced, and nuisances; shape (rows + nuisances,).

        A mechanism's state has a further row: the part of its posterior mean that is beyond its range. Without it a
        state that shows more than it can would stand for a larger strength.
        """
        errors = self.linearised_errors(values)
        beyond = self._states_beyond_range(values, errors)
        rows = self.with_nuisances(errors)
        return np.concatenate([rows, beyond]) if beyond else rows

    def _states_beyond_range(self, values: Mapping[str, float], errors: NDArray) -> list[float]:
        states = [(n, parts) for n, _, _ in self.scalar_nuisances if (parts := mechanism_parameter(n)) is not None]
        if not states:
            return []
        own, found = self._posterior_means(values, errors), []
        for name, (mechanism, _, parameter) in states:
            state = registry.get(mechanism).parameter(parameter)
            beyond = own[name] - float(np.clip(own[name], state.low, state.high))
            found.append(self._nuisance_weight * beyond / settings.BEYOND_STATE)
        return found

    def _posterior_means(self, values: Mapping[str, float], errors: NDArray) -> dict[str, float]:
        """Of each scalar nuisance, by parameter, for shared values of a fit and its errors."""
        # Errors are model minus recording: a recording that has a nuisance has the opposite error.
        means = -self.nuisance_mean @ errors
        pairs = zip(self.scalar_nuisances, means.tolist(), strict=True)
        return {name: values.get(name, value) + spread * mean for (name, value, spread), mean in pairs}

    def linearised_errors(self, values: Mapping[str, float]) -> NDArray:
        """Errors over the noise, extrapolated from the recording's own friction and states to those of all.

        Shape (rows,).
        """
        shared = of_batch(values, self.session)
        # A batch may have a factor of friction; curvatures are of a recording only.
        own = {name: value * shared.get(name, 1.0) for name, value in self.own.items()}
        errors = self.observations.errors(shared | own | dict(self.own_states)).ravel() - self.own_errors
        for k, (name, value, spread) in enumerate(self.scalar_nuisances):
            if name in self.own_states:
                errors += self.effects[:, k] * ((values.get(name, value) - self.own_states[name]) / spread)
        return errors

    def states_within_range(self, values: Mapping[str, float]) -> dict[str, float]:
        """Posterior mean of each mechanism's state in this recording, by parameter, as far as a state can go."""
        found = {}
        for name, value in self.own_values(values).items():
            if (parts := mechanism_parameter(name)) is not None:
                state = registry.get(parts[0]).parameter(parts[2])
                found[name] = float(np.clip(value, state.low, state.high))
        return found

    @property
    def _nuisance_weight(self) -> float:
        """Weight of a nuisance's posterior mean among the errors: that of one effective sample."""
        return float(np.sqrt(self.measured.shape[1] / IN_DIAGNOSIS))

    def state_log_determinant(self, weight: float) -> float:
        """Log determinant of 1 + the information on the states of mechanisms, in units of their prior.

        The evidence integrates over these states, as over the other nuisances. Only those are the same for all
        candidates, so that theirs need not be counted. Residuals count with a weight.
        """
        states = [k for k, (name, _, _) in enumerate(self.scalar_nuisances) if mechanism_parameter(name) is not None]
        if not states:
            return 0.0
        # The covariance of the states, all other nuisances integrated out, is that of their information and prior.
        of_all = np.linalg.inv(np.eye(self.effects.shape[1]) + self.effects.T @ self.effects)
        covariance, one = of_all[np.ix_(states, states)], np.eye(len(states))
        return float(np.linalg.slogdet(one + weight * (np.linalg.inv(covariance) - one))[1])

    def deviation(self, nuisance: str, residuals: NDArray) -> tuple[float, float]:
        """Deviation of a nuisance, in stated standard deviations, and the variance of its error, from `errors`.

        NaN if the recording determines less than half of its variance.
        """
        names = [name for name, _, _ in self.scalar_nuisances]
        if nuisance not in names or self.determined[k := names.index(nuisance)] < 0.5:
            return np.nan, np.nan
        # Errors are model minus recording: a recording that has a nuisance has the opposite error.
        mean = -float(residuals[self.measured.size + k]) / self._nuisance_weight
        share, ratio = float(self.determined[k]), self.repeatability.ratio(nuisance)
        return ratio * mean / share, ratio**2 * (1 - share) / share

    def own_values(self, values: Mapping[str, float]) -> dict[str, float]:
        """Posterior mean of each scalar nuisance in this recording, by parameter, for shared values of a fit."""
        return self._posterior_means(values, self.linearised_errors(values))

    @property
    def own_means(self) -> dict[str, float]:
        """Posterior means of what `own` holds, as far as errors may be linearised about them."""
        means, found = self.own_values({}), {}
        for name, value, spread in self.scalar_nuisances:
            if name == FRICTION:
                found[FRICTION_SCALE] = float(np.clip(means[name] / value, *settings.OWN_FRICTION))
            elif name in CURVATURES:
                reach = settings.OWN_CURVATURE * spread
                found[name] = float(np.clip(means[name], -reach, reach))
        return found

    def with_parameters(self, parameters: Parameters) -> "Whitened":
        """The same for a model with other parameters, under the same covariance."""
        return replace(self, observations=self.observations.with_parameters(parameters))


def whiten(
    observations: Observations,
    model: Parameters,
    repeatability: Repeatability = STATED,
    own: Mapping[str, float] | None = None,
) -> Whitened:
    """Observations with the covariance of their errors, linearised about a fitted model.

    Parameters
    ----------
    observations : Observations
    model : Parameters
    repeatability : Repeatability
        Estimated spreads of the nuisances.
    own : mapping of str to float, optional
        The recording's own friction and curvatures about which the errors are linearised (`Whitened.own_means`);
        without it, those of the model.
    """
    o = observations.with_parameters(model).with_tolerance(repeatability.tolerance)
    own = own or {}
    at = o.with_parameters(model.with_values(own))
    # The priors stay those about the model: only the effects are taken at the recording's own values.
    N, known = nuisances(at, repeatability), repeatability.applied(_scalar_nuisances(o))
    between_runs = (N[:, : len(known)] ** 2).sum(axis=1).reshape(o.sigma.shape)
    floor = np.sqrt((o.sigma**2 * (1.0 + between_runs)).mean(axis=1))
    by_channel = dict(zip(o.channels, floor.tolist(), strict=True))
    # In standard deviations, from what all recordings share.
    away = [(own.get(name, value) - value) / spread for name, value, spread in known]
    away[0] = (1 - 1 / own.get("friction_scale", 1.0)) * known[0][1] / known[0][2]
    return Whitened(o, *_moments(N, len(known)), by_channel, known, N, repeatability, own, N[:, : len(known)] @ away)


def with_states_of(one: Whitened, model: Parameters, own: Mapping[str, float] | None = None) -> Whitened:
    """Observations with the states of a model's mechanisms as nuisances, linearised about it, and no other states.

    All other nuisances stay linearised as they are: candidate models are compared under one covariance, apart from the
    states that only some of them have. The states are linearised about their `own` values, or those of the model.
    """
    states = _states(one.observations.with_parameters(model))
    is_state = [mechanism_parameter(name) is not None for name, _, _ in one.scalar_nuisances]
    if not states and not any(is_state):
        return one
    kept = [k for k, state in enumerate(is_state) if not state]
    scalars = [*(one.scalar_nuisances[k] for k in kept), *states]
    about = {name: (own or {}).get(name, value) for name, value, _ in states}
    at_own = [(name, about[name], spread) for name, _, spread in states]
    by_state = _effects(one.observations.with_parameters(model.with_values(dict(one.own) | about)), at_own)
    N = np.column_stack([one.effects[:, kept], *by_state, one.effects[:, len(is_state) :]])
    directions, shrinkage, nuisance_mean, determined = _moments(N, len(scalars))
    return replace(
        one, directions=directions, shrinkage=shrinkage, nuisance_mean=nuisance_mean, determined=determined,
        scalar_nuisances=scalars, effects=N, own_states=dict(own or {}),
    )  # fmt: skip


def _moments(effects: NDArray, scalars: int) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Directions, shrinkage, and the posterior mean and determination of the scalar nuisances (`Whitened`)."""
    U, s, Vt = np.linalg.svd(effects, full_matrices=False)
    nuisance_mean = (Vt.T[:scalars] * (s / (1 + s**2))) @ U.T
    determined = (Vt.T[:scalars] ** 2) @ (s**2 / (1 + s**2))
    return U, shrinkage_of(s), nuisance_mean, determined


def nuisances(o: Observations, repeatability: Repeatability = STATED) -> NDArray:
    """Effects of the nuisances on the errors, a prior standard deviation of each, in units of the noise.

    Returns
    -------
    ndarray, shape (rows, k)
        Scalar nuisances first, friction before all others; then draws of the drive motion's error, and the length over
        which friction builds up.
    """
    scalars = repeatability.applied(_scalar_nuisances(o))
    drawn = o.drive_errors({})
    columns = [*_effects(o, scalars), *((d / np.sqrt(len(drawn))).ravel() for d in drawn), *_build_up(o)]
    return np.stack(columns, axis=1)


def _build_up(o: Observations) -> list[NDArray]:
    """Effect on the errors of friction that builds up over `BUILD_UP_M`; none where the model has presliding."""
    acting = settings_of(o.parameters.mechanisms)
    if acting.bristle_m or acting.contact_elements is not None:
        return []
    at_once, built_up = (_presliding(o, share * settings.BUILD_UP_M) for share in (0.01, 1.0))
    return [((built_up - at_once) / o.sigma).ravel()]


def _presliding(o: Observations, z0: float) -> NDArray:
    mechanism = registry.get("presliding")
    values = {p.name: p.start for p in mechanism.parameters} | {"z0": z0}
    mechanisms = (*o.parameters.mechanisms, Active(mechanism.name, mechanism.places[0], values))
    return o.with_parameters(replace(o.parameters, mechanisms=mechanisms)).modelled({})


def _effects(o: Observations, scalars: Sequence[tuple[str, float, float]]) -> list[NDArray]:
    """Effect on the errors of a prior standard deviation of each scalar nuisance, shape (rows,)."""
    simulated, found = o.modelled({}), []
    for name, value, spread in scalars:
        derivative = _derivative(o, name, value, _step(name, value), simulated)
        found.append((spread * derivative / o.sigma).ravel())
    return found


def _step(name: str, value: float) -> float:
    """Step of the difference by a nuisance; for a state of a mechanism, into its range."""
    if (parts := mechanism_parameter(name)) is None:
        return NUISANCE_STEP * size_of(name, value)
    state = registry.get(parts[0]).parameter(parts[2])
    return NUISANCE_STEP * (1 if value < (state.low + state.high) / 2 else -1)


def _derivative(o: Observations, name: str, value: float, step: float, simulated: NDArray) -> NDArray:
    """Of the simulated channels by one nuisance, shape (channels, samples)."""
    return jacobian(lambda x: o.modelled({name: x[0]}), np.array([value]), np.array([step]), simulated)[..., 0]


def _states(o: Observations) -> list[tuple[str, float, float]]:
    """States of the mechanisms at the recording's start that its stated times do not give, as scalar nuisances."""
    known = known_states(o.given.recording, o.parameters)
    every = [
        (mechanism_key(m.name, m.place, p.name), m.values[p.name], p.spread)
        for m in o.parameters.mechanisms
        for p in registry.get(m.name).states
    ]
    return [one for one in every if one[0] not in known]


def shrinkage_of(s: NDArray) -> NDArray:
    """Share by which whitening reduces errors along directions of `s` standard deviations of the noise."""
    return 1 - 1 / np.hypot(1, s)


def relinearised(
    one: Whitened, model: Parameters, repeatability: Repeatability | None = None, fitted: Whitened | None = None
) -> Whitened:
    """Observations with the covariance linearised about another model and the recording's own friction and curvatures.

    The load's position in a gap of that model is the most likely one of a few: a load with mass rings differently on
    either side of its gap, and no linearisation leads from one to the other.

    Parameters
    ----------
    one : Whitened
    model : Parameters
    repeatability : Repeatability, optional
        Spreads of the nuisances, instead of the present ones.
    fitted : Whitened, optional
        The recording as the model was fitted to it, with its mechanisms' states, which differ beside its friction.
    """

    def mean_square(position: float) -> float:
        at = one.with_parameters(replace(model, load_gap_position=position))
        return float(np.mean(one.whiten(at.linearised_errors({})) ** 2))

    has_gap = settings_of(model.mechanisms).half_gap
    position = min(settings.GAP_POSITIONS, key=mean_square) if has_gap else model.load_gap_position
    own = (fitted or one).with_parameters(model).own_means
    about = replace(model, load_gap_position=position)
    found = whiten(one.observations, about, repeatability or one.repeatability, own)
    return found.with_parameters(replace(one.observations.parameters, load_gap_position=position))


def _scalar_nuisances(o: Observations) -> Sequence[tuple[str, float, float]]:
    """Name, value and prior standard deviation of each; friction first."""
    recording, parameters = o.given.recording, o.parameters
    mu = parameters.friction_coefficient
    found = [("friction_coefficient", mu, hypot(settings.FRICTION_SPREAD, o.friction_between) * mu)]
    for channel, name in ZERO_OF.items():
        if channel in o.channels and channel in recording.accuracy:
            found.append((name, getattr(parameters, name), recording.accuracy[channel]))
    if not o.given.initial_tension_observed:
        found.append((PRETENSION, parameters.pretension_scale, settings.PRETENSION_SPREAD))
    if settings_of(parameters.mechanisms).half_gap:
        found.append(("load_gap_position", parameters.load_gap_position, settings.GAP_SPREAD))
    if THETA_OUT in o.channels and (step := recording.encoder_step_rad.get(THETA_OUT)):
        found.append(("theta_out_zero_rad", parameters.theta_out_zero_rad, step / np.sqrt(12)))
    if o.given.initial_tension_observed:
        curvatures = CURVATURES[:1] if recording.far_end else CURVATURES
        found += [(name, getattr(parameters, name), settings.CURVATURE_SPREAD) for name in curvatures]
    return [*found, *_states(o)]
