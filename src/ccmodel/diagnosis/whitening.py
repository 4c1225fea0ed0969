"""Whitened observations: errors of a recording divided by the square root of their covariance.

The covariance has two parts: the sensors' noise, and nuisances that differ from run to run. Nuisances are friction,
sensor zeros, encoder offsets and the uncertain drive motion, each a direction in the space of errors with a prior
standard deviation. They are marginalised, so that no fit needs unknowns for them.

A nuisance far outside its prior, such as friction that is 10 % higher in every recording, is one number among
thousands of samples. The posterior means of the nuisances are therefore appended to the whitened errors, each with the
weight of one effective sample.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.channels import THETA_OUT, ZERO_OF
from ccmodel.diagnosis import settings
from ccmodel.inference.effective_samples import IN_DIAGNOSIS
from ccmodel.inference.jacobian import STEP, jacobian, size_of
from ccmodel.inference.observations import Observations
from ccmodel.model.general.run import settings_of
from ccmodel.model.parameters import Parameters, mechanism_key, mechanism_parameter
from ccmodel.model.session import known_states

# Step of the differences by a nuisance, relative to its size.
NUISANCE_STEP = 10 * STEP


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
    noise_floor : dict of str to float
        Root mean square error of a correct model by channel, in its unit: sensor noise and repeatability.
    scalar_nuisances : sequence of (str, float, float)
        Parameter, value and prior standard deviation of each scalar nuisance.
    effects : ndarray, shape (rows, nuisances and draws)
        Effects of the nuisances on the errors (`nuisances`), of which directions and shrinkage follow.
    """

    observations: Observations
    directions: NDArray
    shrinkage: NDArray
    nuisance_mean: NDArray
    noise_floor: Mapping[str, float]
    scalar_nuisances: Sequence[tuple[str, float, float]]
    effects: NDArray

    @property
    def name(self) -> str:
        """Batch and recording."""
        return self.observations.name

    @property
    def measured(self) -> NDArray:
        """Values of the observations, shape (channels, samples)."""
        return self.observations.measured

    def whiten(self, errors: NDArray) -> NDArray:
        """Errors over the sensors' noise, whitened; shape (rows,)."""
        return errors - self.directions @ (self.shrinkage * (self.directions.T @ errors))

    def with_nuisances(self, errors: NDArray) -> NDArray:
        """Whitened errors, followed by the nuisances' posterior means; shape (rows + nuisances,)."""
        rows_per_sample = self.measured.shape[1] / IN_DIAGNOSIS
        return np.concatenate([self.whiten(errors), np.sqrt(rows_per_sample) * (self.nuisance_mean @ errors)])

    def errors(self, values: Mapping[str, float]) -> NDArray:
        """Whitened errors of the model with some parameters replaced, and nuisances; shape (rows + nuisances,).

        A mechanism's state has a further row: the part of its posterior mean that is beyond its range. Without it a
        state that shows more than it can would stand for a larger strength.
        """
        errors = self.observations.errors(values).ravel()
        beyond = self._states_beyond_range(values, errors)
        rows = self.with_nuisances(errors)
        return np.concatenate([rows, beyond]) if beyond else rows

    def _states_beyond_range(self, values: Mapping[str, float], errors: NDArray) -> list[float]:
        root = np.sqrt(self.measured.shape[1] / IN_DIAGNOSIS)
        found = []
        for row, (name, value, spread) in enumerate(self.scalar_nuisances):
            if (parts := mechanism_parameter(name)) is not None:
                state = registry.get(parts[0]).parameter(parts[2])
                own = values.get(name, value) - spread * float(self.nuisance_mean[row] @ errors)
                found.append(root * (own - float(np.clip(own, state.low, state.high))) / settings.BEYOND_STATE)
        return found

    def own_values(self, values: Mapping[str, float]) -> dict[str, float]:
        """Posterior mean of each scalar nuisance in this recording, by parameter, for shared values of a fit."""
        # Errors are model minus recording: a recording that has a nuisance has the opposite error.
        means = -self.nuisance_mean @ self.observations.errors(values).ravel()
        pairs = zip(self.scalar_nuisances, means.tolist(), strict=True)
        return {name: values.get(name, value) + spread * mean for (name, value, spread), mean in pairs}

    def with_parameters(self, parameters: Parameters) -> "Whitened":
        """The same for a model with other parameters, under the same covariance."""
        return replace(self, observations=self.observations.with_parameters(parameters))


def whiten(observations: Observations, model: Parameters) -> Whitened:
    """Observations with the covariance of their errors, linearised about a fitted model."""
    o = observations.with_parameters(model)
    N = nuisances(o)
    friction = N[:, 0].reshape(o.sigma.shape) * o.sigma
    floor = np.sqrt((o.sigma**2).mean(axis=1) + (friction**2).mean(axis=1))
    by_channel = dict(zip(o.channels, floor.tolist(), strict=True))
    return _whitened(o, N, _scalar_nuisances(o), by_channel)


def with_states_of(one: Whitened, model: Parameters) -> Whitened:
    """Observations with the states of a model's mechanisms as nuisances, linearised about it, and no other states.

    All other nuisances stay linearised as they are: candidate models are compared under one covariance, apart from the
    states that only some of them have.
    """
    o = one.observations.with_parameters(model)
    states = _states(o)
    is_state = [mechanism_parameter(name) is not None for name, _, _ in one.scalar_nuisances]
    if not states and not any(is_state):
        return one
    kept = [k for k, state in enumerate(is_state) if not state]
    scalars = [*(one.scalar_nuisances[k] for k in kept), *states]
    N = np.column_stack([one.effects[:, kept], *_effects(o, states), one.effects[:, len(is_state) :]])
    return _whitened(one.observations, N, scalars, one.noise_floor)


def _whitened(
    o: Observations, effects: NDArray, scalars: Sequence[tuple[str, float, float]], noise_floor: Mapping[str, float]
) -> Whitened:
    U, s, Vt = np.linalg.svd(effects, full_matrices=False)
    nuisance_mean = (Vt.T[: len(scalars)] * (s / (1 + s**2))) @ U.T
    return Whitened(o, U, shrinkage_of(s), nuisance_mean, noise_floor, scalars, effects)


def nuisances(o: Observations) -> NDArray:
    """Effects of the nuisances on the errors, a prior standard deviation of each, in units of the noise.

    Returns
    -------
    ndarray, shape (rows, k)
        Scalar nuisances first, friction before all others; then draws of the drive motion's error.
    """
    scalars = _scalar_nuisances(o)
    drawn = o.drive_errors({})
    columns = [*_effects(o, scalars), *((d / np.sqrt(len(drawn))).ravel() for d in drawn)]
    return np.stack(columns, axis=1)


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


def relinearised(one: Whitened, model: Parameters) -> Whitened:
    """Observations with the covariance linearised about another model.

    The load's position in a gap of that model is the most likely one of a few: a load with mass rings differently on
    either side of its gap, and no linearisation leads from one to the other.
    """

    def mean_square(position: float) -> float:
        at = one.observations.with_parameters(replace(model, load_gap_position=position))
        return float(np.mean(one.whiten(at.errors({}).ravel()) ** 2))

    has_gap = settings_of(model.mechanisms).half_gap
    position = min(settings.GAP_POSITIONS, key=mean_square) if has_gap else model.load_gap_position
    about = whiten(one.observations, replace(model, load_gap_position=position))
    return about.with_parameters(replace(one.observations.parameters, load_gap_position=position))


def _scalar_nuisances(o: Observations) -> Sequence[tuple[str, float, float]]:
    """Name, value and prior standard deviation of each; friction first."""
    recording, parameters = o.given.recording, o.parameters
    mu = parameters.friction_coefficient
    found = [("friction_coefficient", mu, settings.FRICTION_SPREAD * mu)]
    for channel, name in ZERO_OF.items():
        if channel in o.channels and channel in recording.accuracy:
            found.append((name, getattr(parameters, name), recording.accuracy[channel]))
    if settings_of(parameters.mechanisms).half_gap:
        found.append(("load_gap_position", parameters.load_gap_position, settings.GAP_SPREAD))
    if THETA_OUT in o.channels and (step := recording.encoder_step_rad.get(THETA_OUT)):
        found.append(("theta_out_zero_rad", parameters.theta_out_zero_rad, step / np.sqrt(12)))
    if o.given.initial_tension_observed:
        cables = ("A",) if recording.far_end else ("A", "B")
        curvatures = (f"tension_curvature_{cable}" for cable in cables)
        found += [(name, getattr(parameters, name), settings.CURVATURE_SPREAD) for name in curvatures]
    return [*found, *_states(o)]
