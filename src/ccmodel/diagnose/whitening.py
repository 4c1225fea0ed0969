"""The recordings of a batch made ready for a diagnosis: what differs from run to run is part of their noise.

Friction that is a per cent higher, a sensor's zero, where in its count an encoder rests, what is not known of the
drive's motion: each is a direction in which a recording may lie off what the right model says. Together with the
sensors' noise they make the covariance of a recording's errors. Errors that were whitened by it are what hypotheses
are judged by, and no fit needs unknowns for what differs from run to run.

A zero that is off by more than its sensor's accuracy, friction that is ten per cent higher in every recording, is one
number, lost among thousands of samples. How far off the errors put each is therefore counted besides them, as a look
of its own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ccmodel.inference.problem import Observations
from ccmodel.model.general.run import settings_of
from ccmodel.model.parameters import ZERO_OF, Parameters
from ccmodel.model.sensitivity import STEP, size_of

# Independent looks that a channel of a recording gives at a hypothesis: samples are far more, and alike.
LOOKS = 20
# Standard deviation of what may be anywhere from -1 to 1, and the places that are looked at where it matters.
ANYWHERE = 1 / np.sqrt(3)
WITHIN_GAP = (0.0, -1.0, 1.0)
FRICTION_SPREAD = 0.01  # of itself, from run to run: what cables of the paper's kind are taken to repeat by


@dataclass(frozen=True)
class Whitened:
    """A recording with the covariance of its errors.

    Attributes
    ----------
    observations : Observations
    directions : ndarray, shape (rows, k)
        Orthonormal directions of what differs from run to run, among the errors over the sensors' noise.
    shrink : ndarray, shape (k,)
        By how much whitening shrinks the errors along each.
    likeliest : ndarray, shape (numbers, rows)
        What makes of errors over the sensors' noise the likeliest differences of this run (in friction, in zeros), each
        over its spread.
    floor : dict of str to float
        Root mean square of what a right model leaves, by channel, in its unit.
    """

    observations: Observations
    directions: NDArray
    shrink: NDArray
    likeliest: NDArray
    floor: Mapping[str, float]

    def whitened(self, errors: NDArray) -> NDArray:
        """Errors over the sensors' noise, whitened; shape (rows,)."""
        return errors - self.directions @ (self.shrink * (self.directions.T @ errors))

    def counted(self, errors: NDArray) -> NDArray:
        """The same, and below it the likeliest differences, each weighed as a look; shape (rows + numbers,)."""
        rows_a_look = self.observations.measured.shape[1] / LOOKS
        return np.concatenate([self.whitened(errors), np.sqrt(rows_a_look) * (self.likeliest @ errors)])

    def acting(self, parameters: Parameters) -> "Whitened":
        """The same recording beside another model."""
        return replace(self, observations=replace(self.observations, parameters=parameters))


def weigh(observations: Observations, parameters: Parameters) -> Whitened:
    """Work out what may differ from run to run, about a model that is fitted already."""
    e = replace(observations, parameters=parameters)
    N, numbers = run_differences(e)
    friction = N[:, 0].reshape(e.sigma.shape) * e.sigma
    floor = np.sqrt((e.sigma**2).mean(axis=1) + (friction**2).mean(axis=1))
    U, s, Vt = np.linalg.svd(N, full_matrices=False)
    likeliest = (Vt.T[:numbers] * (s / (1 + s**2))) @ U.T
    return Whitened(e, U, shrink_of(s), likeliest, dict(zip(e.channels, floor.tolist(), strict=True)))


def run_differences(e: Observations) -> tuple[NDArray, int]:
    """What differs from run to run, a standard deviation of each in units of the noise, and how many are numbers.

    Returns
    -------
    ndarray, shape (rows, k)
        Numbers first, friction before all others; then what is not known of the drive's motion.
    int
    """
    said = e.modelled({})
    nuisances = _nuisances(e, e.parameters)
    differ = [spread * (e.modelled({name: value + step}) - said) / step for name, value, spread, step in nuisances]
    drawn = e.drive_errors({})
    columns = [*(d / e.sigma for d in differ), *(d / np.sqrt(len(drawn)) for d in drawn)]
    return np.stack([c.ravel() for c in columns], axis=1), len(nuisances)


def shrink_of(s: NDArray) -> NDArray:
    """By how much whitening shrinks errors along directions that are so many standard deviations of the noise long."""
    return 1 - 1 / np.hypot(1, s)


def weighed_about(one: Whitened, model: Parameters) -> Whitened:
    """A recording weighed anew about a model of it, its load where in a gap of that model it most likely rested.

    With mass behind the gap either side makes another ringing of it, and no straight line leads from one to the other.
    """

    def left(place: float) -> float:
        errors = one.acting(replace(model, load_gap_position=place)).observations.errors({})
        return float(np.mean(one.whitened(errors.ravel()) ** 2))

    place = min(WITHIN_GAP, key=left) if settings_of(model.mechanisms).half_gap else model.load_gap_position
    about = weigh(one.observations, replace(model, load_gap_position=place))
    return about.acting(replace(one.observations.parameters, load_gap_position=place))


def _nuisances(e: Observations, parameters: Parameters) -> Sequence[tuple[str, float, float, float]]:
    """Name, value, spread from run to run and step of each number that differs; friction first."""
    recording = e.given.recording
    mu = parameters.friction_coefficient
    found = [("friction_coefficient", mu, FRICTION_SPREAD * mu)]
    for channel, name in ZERO_OF.items():
        if channel in e.channels and channel in recording.accuracy:
            found.append((name, getattr(parameters, name), recording.accuracy[channel]))
    if settings_of(parameters.mechanisms).half_gap:
        found.append(("load_gap_position", parameters.load_gap_position, ANYWHERE))
    if "theta_out_rad" in e.channels and (step := recording.encoder_step_rad.get("theta_out_rad")):
        found.append(("theta_out_zero_rad", parameters.theta_out_zero_rad, step / np.sqrt(12)))
    return [(name, value, spread, STEP * size_of(name, value) * 10) for name, value, spread in found]
