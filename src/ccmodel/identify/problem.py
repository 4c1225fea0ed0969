"""A fit as a stated problem: what is free, what it is compared with, and how sure each number of that is.

The unknowns are the shared ones, one value for all recordings, and those that belong to a recording, one value each.
What belongs to a recording may be expected to lie about a value with a spread: friction varies by about 1 % from run
to run, zeros are good to the sensors' accuracy. Such an expectation is one more residual.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccmodel.identify.noise import drive_noise, sensor_noise
from ccmodel.model.failure import ModelError
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import PRESCRIBED, ModelInput, simulate
from ccmodel.model.sensitivity import STEP, size_of
from ccmodel.recording import Recording

# What sensors measure; tensions are derived from these and do not count a second time.
MEASURED = ("theta_out_rad", "tau_in_Nm", "tau_out_Nm", "F_drive_N", "F_load_N")
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
class Evidence:
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
    """

    given: ModelInput
    parameters: Parameters
    channels: tuple[str, ...]
    judged: NDArray
    measured: NDArray
    sigma: NDArray

    @classmethod
    def of(
        cls,
        recording: Recording,
        parameters: Parameters,
        channels: Sequence[str] = MEASURED,
        step_s: float | None = None,
        allowance: float = 0.0,
    ) -> "Evidence":
        """Evidence from a recording, a sample every `step_s` of it.

        Where the model is known not to be the whole truth, `allowance` adds that share of each channel's peak to peak
        to the noise, so that no channel rules by being read finely.

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
        sensors, drive = sensor_noise(recording), drive_noise(given, parameters)
        measured = np.stack([given.recording[c][judged] for c in used])
        sigma = np.stack([np.hypot(sensors[c], drive[c][judged]) for c in used])
        sigma = np.hypot(sigma, allowance * np.ptp(measured, axis=1, keepdims=True))
        return cls(given, parameters, used, judged, measured, sigma)

    @property
    def name(self) -> str:
        """Batch and recording."""
        return f"{self.given.recording.batch}/{self.given.recording.id}"

    def modelled(self, values: Mapping[str, float]) -> NDArray:
        """What the model says with some parameters replaced, shape (channels, judged samples).

        A counted angle has no zero of its own: it is compared about what it reads at the rest.
        """
        said = simulate(self.given, self.parameters.with_values(values))
        return np.stack([said[c][self.judged] for c in self.channels])

    def errors(self, values: Mapping[str, float]) -> NDArray:
        """Model less recording over the noise, shape (channels, judged samples)."""
        return (self.modelled(values) - self.measured) / self.sigma


@dataclass(frozen=True)
class Problem:
    """Recordings and what is free in them.

    Attributes
    ----------
    evidence : sequence of Evidence
    shared, own : mapping of str to Free
        Unknowns with one value for all, and with one value for each recording.
    looks : float
        How many independent looks at the model a channel of a recording is worth. Its samples are not independent:
        what a model leaves beyond the sensors' noise is alike from sample to sample.
    """

    evidence: Sequence[Evidence]
    shared: Mapping[str, Free]
    own: Mapping[str, Free] = field(default_factory=dict)
    looks: float = 100.0

    @cached_property
    def names(self) -> list[str]:
        """Unknowns in the order of a vector of them: shared, then each recording's own."""
        return [*self.shared, *(f"{name}@{e.name}" for e in self.evidence for name in self.own)]

    @cached_property
    def free(self) -> list[Free]:
        """What is said of each of `names`."""
        return [*self.shared.values(), *(f for _ in self.evidence for f in self.own.values())]

    @cached_property
    def sizes(self) -> NDArray:
        """What each unknown's steps are measured by, shape (unknowns,)."""
        plain = [*self.shared, *(name for _ in self.evidence for name in self.own)]
        return np.array([f.spread or size_of(n, f.start) for n, f in zip(plain, self.free, strict=True)])

    @property
    def start(self) -> NDArray:
        """Starting values, shape (unknowns,)."""
        return np.array([f.start for f in self.free])

    @property
    def bounds(self) -> tuple[NDArray, NDArray]:
        """Lowest and highest values, each of shape (unknowns,)."""
        return np.array([f.low for f in self.free]), np.array([f.high for f in self.free])

    @cached_property
    def rows(self) -> list[tuple[NDArray, NDArray]]:
        """Rows of `residuals` that are each recording's: its data, and what is expected of its own unknowns."""
        sizes = [e.measured.size for e in self.evidence]
        starts = np.concatenate([[0], np.cumsum(sizes)])
        expected = sum(f.spread is not None for f in self.own.values())
        first = starts[-1] + sum(f.spread is not None for f in self.shared.values())
        return [
            (np.arange(starts[i], starts[i + 1]), first + i * expected + np.arange(expected)) for i in range(len(sizes))
        ]

    def mean_square(self, residuals: NDArray) -> float:
        """Mean square of the errors over their noise, every sample alike."""
        total = sum(residuals[data] @ residuals[data] / self._weight(i) for i, (data, _) in enumerate(self.rows))
        return float(total / sum(e.measured.size for e in self.evidence))

    def values_of(self, x: NDArray, recording: int) -> dict[str, float]:
        """Parameters of one of the recordings, by name."""
        own = x[self.own_columns(recording)]
        return dict(zip(self.shared, x[: len(self.shared)], strict=True)) | dict(zip(self.own, own, strict=True))

    def residuals(self, x: NDArray) -> NDArray:
        """All errors over their noise, each weighed as its channel's looks, and all expectations; shape (rows,)."""
        parts = self._each(lambda i: self._weigh(i, self.evidence[i].errors(self.values_of(x, i))))
        return np.concatenate([*parts, self._unexpected(x)])

    def jacobian(self, x: NDArray) -> NDArray:
        """Derivatives of `residuals`, shape (rows, unknowns): only what belongs to a recording runs it again."""
        shared = len(self.shared)
        parts = self._each(lambda i: self._derivatives(x, i))
        rows = sum(p.shape[0] for p in parts)
        expected = self._unexpected(x).size
        J = np.zeros((rows + expected, x.size))
        row = 0
        for i, part in enumerate(parts):
            J[row : row + part.shape[0], :shared] = part[:, :shared]
            J[row : row + part.shape[0], self.own_columns(i)] = part[:, shared:]
            row += part.shape[0]
        for k, free in enumerate(self.free):
            if free.spread is not None:
                J[row, k] = 1 / free.spread
                row += 1
        return J

    def _derivatives(self, x: NDArray, i: int) -> NDArray:
        at = [*range(len(self.shared)), *range(*self.own_columns(i).indices(x.size))]
        base = self.evidence[i].errors(self.values_of(x, i))
        columns = []
        for k in at:
            step = STEP * self.sizes[k] * (-1 if x[k] + STEP * self.sizes[k] > self.free[k].high else 1)
            aside = x.copy()
            aside[k] += step
            columns.append(self._weigh(i, self.evidence[i].errors(self.values_of(aside, i)) - base) / step)
        return np.stack(columns, axis=1)

    def _weigh(self, i: int, errors: NDArray) -> NDArray:
        return (errors * np.sqrt(self._weight(i))).ravel()

    def _weight(self, i: int) -> float:
        return min(1.0, self.looks / self.evidence[i].measured.shape[1])

    def _unexpected(self, x: NDArray) -> NDArray:
        return np.array([(v - f.start) / f.spread for v, f in zip(x, self.free, strict=True) if f.spread is not None])

    def own_columns(self, i: int) -> slice:
        """Where the unknowns of one recording stand."""
        first = len(self.shared) + i * len(self.own)
        return slice(first, first + len(self.own))

    def _each(self, work) -> list[NDArray]:
        with ThreadPoolExecutor(CORES) as pool:
            return list(pool.map(work, range(len(self.evidence))))
