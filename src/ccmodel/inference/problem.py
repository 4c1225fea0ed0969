"""A fit as a stated problem: what is free, what it is compared with, and how sure each number of that is.

The unknowns are the shared ones, one value for all recordings, and those that belong to a recording, one value each.
What belongs to a recording may be expected to lie about a value with a spread: friction varies by about 1 % from run
to run, zeros are good to the sensors' accuracy. Such an expectation is one more residual.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccmodel.failure import ModelError
from ccmodel.inference.noise import PHASES, drive_errors, rounding_errors, sensor_noise, size_over_time
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import PRESCRIBED, LoadFrom, ModelInput, simulate
from ccmodel.model.sensitivity import STEP, size_of
from ccmodel.recording import Recording

# What sensors measure; tensions are derived from these and do not count a second time.
MEASURED = ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N")
Tolerance = float | Mapping[str, float]
CORES = 2


@dataclass(frozen=True)
class Free:
    """An unknown: where it starts, where it may go, and, if it belongs to each recording, where it is expected.

    Attributes
    ----------
    start : float
    low, high : float
    spread : float or None
        Standard deviation from recording to recording about `start`; None expects nothing.
    """

    start: float
    low: float = -np.inf
    high: float = np.inf
    spread: float | None = None


@dataclass(frozen=True)
class Observations:
    """A recording made ready: the model's input, the samples that are compared and the noise of each.

    Attributes
    ----------
    given : ModelInput
    parameters : Parameters
        Of its batch, beforehand; what is free replaces some of them.
    channels : tuple of str
    judged : ndarray of bool, shape (n,)
    measured, sigma : ndarray, shape (channels, judged samples)
        Values and their standard deviation, in the channels' units.
    placed : bool
        Whether where in its count the drive first rests is an unknown of the fit, and not part of the noise.
    tolerance : ndarray, shape (channels,)
        Share of each one's peak to peak that `sigma` has besides the noise.
    load_from : {"law", "torque"}
        Whether the load's law drives the cables' far end, or the torque that was measured there.
    """

    given: ModelInput
    parameters: Parameters
    channels: tuple[str, ...]
    judged: NDArray
    measured: NDArray
    sigma: NDArray
    tolerance: NDArray
    offset_is_free: bool = False
    load_from: LoadFrom = "law"

    @classmethod
    def of(
        cls,
        recording: Recording,
        parameters: Parameters,
        channels: Sequence[str] = MEASURED,
        step_s: float | None = None,
        tolerance: Tolerance = 0.0,
        offset_is_free: bool = False,
    ) -> "Observations":
        """Observations from a recording, a sample every `step_s` of it.

        Where the model is known not to be the whole truth, `tolerance` adds that share of each channel's peak to peak
        to the noise, one for all or by channel, so that no channel rules by being read finely.

        Raises
        ------
        ModelError
            If none of the channels was recorded, or the model cannot be run with the parameters.
        """
        given = ModelInput.of(recording, step_s)
        prescribed = {c for c, source in simulate(given, parameters).derived_from.items() if source == PRESCRIBED}
        used = tuple(c for c in channels if c in recording and c not in prescribed)
        if not used:
            raise ModelError(f"{recording.batch}/{recording.id}: none of {', '.join(channels)} was recorded")
        time_s = given.recording.time_s
        judged = time_s >= max(recording.rest_s, recording.settled_s)
        sensors, drive = sensor_noise(given), drive_errors(given, parameters, offset_is_free)
        measured = np.stack([given.recording[c][judged] for c in used])
        sigma = np.stack([np.hypot(sensors[c], size_over_time(drive[c], time_s)[judged]) for c in used])
        by_channel = tolerance if isinstance(tolerance, Mapping) else dict.fromkeys(used, tolerance)
        shares = np.array([by_channel.get(c, 0.0) for c in used])
        sigma = np.hypot(sigma, (shares * np.ptp(measured, axis=1))[:, None])
        return cls(given, parameters, used, judged, measured, sigma, shares, offset_is_free)

    def without(self, channel: str) -> "Observations":
        """The same without one of the channels."""
        kept = [k for k, c in enumerate(self.channels) if c != channel]
        channels = tuple(self.channels[k] for k in kept)
        series = {name: getattr(self, name)[kept] for name in ("measured", "sigma", "tolerance")}
        return replace(self, channels=channels, **series)

    def driven_by_torque(self) -> "Observations":
        """The same with the torque that was measured at the load in place of the load's law."""
        return replace(self.without("tau_out_Nm"), load_from="torque")

    @property
    def tolerance_share(self) -> float:
        """What the tolerance may leave of the mean square of errors over `sigma`, in law as well as in chance."""
        return float(np.mean(((self.tolerance * np.ptp(self.measured, axis=1))[:, None] / self.sigma) ** 2))

    @property
    def name(self) -> str:
        """Batch and recording."""
        return f"{self.given.recording.batch}/{self.given.recording.id}"

    def modelled(self, values: Mapping[str, float]) -> NDArray:
        """What the model says with some parameters replaced, shape (channels, judged samples)."""
        said = simulate(self.given, self.parameters.with_values(values), self.load_from)
        return np.stack([said[c][self.judged] for c in self.channels])

    def errors(self, values: Mapping[str, float]) -> NDArray:
        """Model less recording over the noise, shape (channels, judged samples)."""
        return (self.modelled(values) - self.measured) / self.sigma

    def drive_errors(self, values: Mapping[str, float]) -> NDArray:
        """Likely errors over the noise that the drive's unknown part makes, shape (draws, channels, judged samples)."""
        found = drive_errors(self.given, self.parameters.with_values(values), self.offset_is_free)
        return np.stack([found[c][:, self.judged] for c in self.channels], axis=1) / self.sigma

    def rounding_errors(self, values: Mapping[str, float]) -> NDArray:
        """Likely errors over the noise of the angles that are counted, shape (phases, channels, judged samples)."""
        said, steps = self.modelled(values), self.given.recording.encoder_step_rad
        found = np.zeros((PHASES.size, *said.shape))
        for k, channel in enumerate(self.channels):
            if channel in steps:
                found[:, k] = rounding_errors(said[k], steps[channel])
        return found / self.sigma


@dataclass(frozen=True)
class Block:
    """One recording about a point: its errors over their noise, and how they answer to the unknowns it depends on.

    Attributes
    ----------
    columns : ndarray of int, shape (k,)
        Which of the problem's unknowns these are: the shared ones, then the recording's own.
    errors : ndarray, shape (channels, samples)
    derivatives : ndarray, shape (channels, samples, k)
    """

    columns: NDArray
    errors: NDArray
    derivatives: NDArray

    @property
    def information(self) -> NDArray:
        """Shape (k, k)."""
        J = self.derivatives.reshape(-1, self.columns.size)
        return J.T @ J

    @property
    def score(self) -> NDArray:
        """Gradient of half the sum of squares, shape (k,)."""
        return self.derivatives.reshape(-1, self.columns.size).T @ self.errors.ravel()


@dataclass(frozen=True)
class Problem:
    """Recordings and what is free in them.

    Attributes
    ----------
    observations : sequence of Observations
    shared, own : mapping of str to Free
        Unknowns with one value for all, and with one value for each recording.
    looks : float
        How many independent looks at the model a channel of a recording is worth. Its samples are not independent:
        what a model leaves beyond the sensors' noise is alike from sample to sample.
    """

    observations: Sequence[Observations]
    shared: Mapping[str, Free]
    own: Mapping[str, Free] = field(default_factory=dict)
    looks: float = 100.0

    @cached_property
    def names(self) -> list[str]:
        """Unknowns in the order of a vector of them: shared, then each recording's own."""
        return [*self.shared, *(f"{name}@{e.name}" for e in self.observations for name in self.own)]

    @cached_property
    def free(self) -> list[Free]:
        """What is said of each of `names`."""
        return [*self.shared.values(), *(f for _ in self.observations for f in self.own.values())]

    @cached_property
    def sizes(self) -> NDArray:
        """What each unknown's steps are measured by, shape (unknowns,)."""
        plain = [*self.shared, *(name for _ in self.observations for name in self.own)]
        return np.array([f.spread or size_of(n, f.start) for n, f in zip(plain, self.free, strict=True)])

    @cached_property
    def start(self) -> NDArray:
        """Starting values, shape (unknowns,)."""
        return np.array([f.start for f in self.free])

    @cached_property
    def bounds(self) -> tuple[NDArray, NDArray]:
        """Lowest and highest values, each of shape (unknowns,)."""
        return np.array([f.low for f in self.free]), np.array([f.high for f in self.free])

    @cached_property
    def expected(self) -> NDArray:
        """One over the spread of each unknown, 0 where nothing is expected of it; shape (unknowns,)."""
        return np.array([0.0 if f.spread is None else 1 / f.spread for f in self.free])

    def unexpected(self, x: NDArray) -> NDArray:
        """How far each unknown lies from where it is expected, over its spread; shape (unknowns,)."""
        return (x - self.start) * self.expected

    def own_columns(self, i: int) -> slice:
        """Where the unknowns of one recording stand."""
        first = len(self.shared) + i * len(self.own)
        return slice(first, first + len(self.own))

    def values_of(self, x: NDArray, i: int) -> dict[str, float]:
        """Parameters of one of the recordings, by name."""
        shared, own = x[: len(self.shared)].tolist(), x[self.own_columns(i)].tolist()
        return dict(zip(self.shared, shared, strict=True)) | dict(zip(self.own, own, strict=True))

    def errors(self, x: NDArray) -> list[NDArray]:
        """By recording, its errors over their noise, weighed as its channels' looks; shape (channels, samples)."""
        return self._each(lambda i: self._weighed(x, i))

    def residuals(self, x: NDArray) -> NDArray:
        """All errors and all expectations, whose sum of squares is the cost; shape (rows,)."""
        return np.concatenate([*(e.ravel() for e in self.errors(x)), self.unexpected(x)])

    def cost(self, x: NDArray) -> float:
        """Sum of squares of `residuals`."""
        r = self.residuals(x)
        return float(r @ r)

    def blocks(self, x: NDArray, step: float = STEP) -> list[Block]:
        """Every recording about `x`, by differences over `step` sizes: only what belongs to it runs it again."""
        return self._each(lambda i: self._block(x, i, step))

    def drive_errors(self, x: NDArray) -> list[NDArray]:
        """By recording, likely errors for want of the drive's true motion; shape (draws, channels, samples)."""
        return self._each(lambda i: self.observations[i].drive_errors(self.values_of(x, i)) * np.sqrt(self._weight(i)))

    def rounding_errors(self, x: NDArray) -> list[NDArray]:
        """By recording, likely errors of the angles that are counted; shape (phases, channels, samples)."""
        return self._each(
            lambda i: self.observations[i].rounding_errors(self.values_of(x, i)) * np.sqrt(self._weight(i))
        )

    def mean_square(self, x: NDArray) -> float:
        """Mean square of the errors over their noise, every sample alike."""
        total = sum(float((e**2).sum()) / self._weight(i) for i, e in enumerate(self.errors(x)))
        return total / sum(e.measured.size for e in self.observations)

    @cached_property
    def independent_looks(self) -> float:
        """Number of independent errors that the cost is worth: what it comes to if the model is right."""
        return sum(e.measured.size * self._weight(i) for i, e in enumerate(self.observations))

    def _block(self, x: NDArray, i: int, relative: float) -> Block:
        columns = np.r_[0 : len(self.shared), self.own_columns(i)].astype(int)
        base = self._weighed(x, i)
        derivatives = np.empty((*base.shape, columns.size))
        for place, k in enumerate(columns):
            step = relative * self.sizes[k]
            step = -step if x[k] + step > self.free[k].high else step
            aside = x.copy()
            aside[k] += step
            derivatives[..., place] = (self._weighed(aside, i) - base) / step
        return Block(columns, base, derivatives)

    def _weighed(self, x: NDArray, i: int) -> NDArray:
        return self.observations[i].errors(self.values_of(x, i)) * np.sqrt(self._weight(i))

    def _weight(self, i: int) -> float:
        return min(1.0, self.looks / self.observations[i].measured.shape[1])

    def _each(self, work: Callable) -> list:
        return each(self.observations, lambda i, observations: work(i))


def each(recordings: Sequence, work: Callable) -> list:
    """Some work on every recording with its number, side by side; results in their order."""
    with ThreadPoolExecutor(CORES) as pool:
        return list(pool.map(work, range(len(recordings)), recordings))
