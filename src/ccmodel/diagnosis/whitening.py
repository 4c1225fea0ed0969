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
from math import hypot

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import THETA_OUT, ZERO_OF
from ccmodel.diagnosis import settings
from ccmodel.inference.effective_samples import IN_DIAGNOSIS
from ccmodel.inference.jacobian import STEP, jacobian, size_of
from ccmodel.inference.observations import Observations
from ccmodel.model.general.run import settings_of
from ccmodel.model.parameters import Parameters

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
    """

    observations: Observations
    directions: NDArray
    shrinkage: NDArray
    nuisance_mean: NDArray
    noise_floor: Mapping[str, float]
    scalar_nuisances: Sequence[tuple[str, float, float]] = ()

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
        rows_per_sample = self.measured.shape[1] / IN_DIAGNOSIS
        return np.concatenate([self.whiten(errors), np.sqrt(rows_per_sample) * (self.nuisance_mean @ errors)])

    def errors(self, values: Mapping[str, float]) -> NDArray:
        """Whitened errors of the model with some parameters replaced, and nuisances; shape (rows + nuisances,)."""
        return self.with_nuisances(self.observations.errors(values).ravel())

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
    N, scalars = nuisances(o)
    friction = N[:, 0].reshape(o.sigma.shape) * o.sigma
    floor = np.sqrt((o.sigma**2).mean(axis=1) + (friction**2).mean(axis=1))
    U, s, Vt = np.linalg.svd(N, full_matrices=False)
    nuisance_mean = (Vt.T[:scalars] * (s / (1 + s**2))) @ U.T
    by_channel = dict(zip(o.channels, floor.tolist(), strict=True))
    return Whitened(o, U, shrinkage_of(s), nuisance_mean, by_channel, _scalar_nuisances(o))


def nuisances(o: Observations) -> tuple[NDArray, int]:
    """Effects of the nuisances on the errors, a prior standard deviation of each, in units of the noise.

    Returns
    -------
    ndarray, shape (rows, k)
        Scalar nuisances first, friction before all others; then draws of the drive motion's error.
    int
        Number of scalar nuisances.
    """
    simulated, scalars = o.modelled({}), _scalar_nuisances(o)
    effects = []
    for name, value, spread in scalars:
        step = NUISANCE_STEP * size_of(name, value)
        derivative = _derivative(o, name, value, step, simulated)
        effects.append(spread * derivative / o.sigma)
    drawn = o.drive_errors({})
    columns = [*effects, *(d / np.sqrt(len(drawn)) for d in drawn)]
    return np.stack([c.ravel() for c in columns], axis=1), len(scalars)


def _derivative(o: Observations, name: str, value: float, step: float, simulated: NDArray) -> NDArray:
    """Of the simulated channels by one nuisance, shape (channels, samples)."""
    return jacobian(lambda x: o.modelled({name: x[0]}), np.array([value]), np.array([step]), simulated)[..., 0]


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
    found = [("friction_coefficient", mu, hypot(settings.FRICTION_SPREAD, o.friction_between) * mu)]
    for channel, name in ZERO_OF.items():
        if channel in o.channels and channel in recording.accuracy:
            found.append((name, getattr(parameters, name), recording.accuracy[channel]))
    if settings_of(parameters.mechanisms).half_gap:
        found.append(("load_gap_position", parameters.load_gap_position, settings.GAP_SPREAD))
    if THETA_OUT in o.channels and (step := recording.encoder_step_rad.get(THETA_OUT)):
        found.append(("theta_out_zero_rad", parameters.theta_out_zero_rad, step / np.sqrt(12)))
    return found
