"""A fit as a stated problem: what is unknown, what it is compared with, and the prior of each unknown.

Shared unknowns have one value for all recordings, or for all of one batch (`ccmodel.model.parameters.batch_key`); own
unknowns have one value for each. An unknown may have a prior, a mean and a standard deviation: friction varies by about
1 % from run to run, zeros are as good as the sensors' stated accuracy. A prior is one more residual.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ccmodel.inference.effective_samples import Measured, fit_weight
from ccmodel.inference.jacobian import STEP, inward, jacobian, size_of
from ccmodel.inference.observations import Observations
from ccmodel.inference.pool import each
from ccmodel.model.parameters import acts_on


@dataclass(frozen=True)
class Free:
    """An unknown: its start, its bounds, and its prior if it has one, as those that differ between recordings do.

    Attributes
    ----------
    start : float
    low, high : float
    spread : float or None
        The prior's standard deviation; of an own unknown, from recording to recording. None: no prior.
    mean : float or None
        The prior's mean; None: the start.
    """

    start: float
    low: float = -np.inf
    high: float = np.inf
    spread: float | None = None
    mean: float | None = None

    @property
    def prior_mean(self) -> float:
        """Mean of the prior, the start where nothing else is stated."""
        return self.start if self.mean is None else self.mean

    @property
    def prior_precision(self) -> float:
        """Reciprocal standard deviation of the prior; 0 without one."""
        return 0.0 if self.spread is None else 1 / self.spread

    @classmethod
    def within(cls, start: float, low: float, high: float) -> "Free":
        """An unknown whose start is put within its bounds."""
        return cls(float(np.clip(start, low, high)), low, high)


@dataclass(frozen=True)
class Block:
    """Weighted errors of one recording about a point, and their derivatives by the unknowns that they depend on.

    Attributes
    ----------
    columns : ndarray of int, shape (k,)
        Positions of these unknowns among the problem's: the shared ones, then the recording's own.
    errors : ndarray
    derivatives : ndarray, shape (*errors, k)
    """

    columns: NDArray
    errors: NDArray
    derivatives: NDArray

    @property
    def information(self) -> NDArray:
        """Gauss-Newton approximation of the Hessian of half the sum of squares, shape (k, k)."""
        return self._rows.T @ self._rows

    @property
    def score(self) -> NDArray:
        """Gradient of half the sum of squares, shape (k,)."""
        return self._rows.T @ self.errors.ravel()

    def by_secant(self, moved: NDArray, sizes: NDArray, errors: NDArray) -> "Block":
        """The block at another point, its derivatives changed as little as makes them agree with the errors there.

        Broyden, Mathematics of Computation 19 (92), 1965, in units of `sizes`.

        Parameters
        ----------
        moved, sizes : ndarray, shape (unknowns,)
            Change of all unknowns of the problem, and their sizes.
        errors : ndarray
            At the other point.
        """
        step, size = moved[self.columns], sizes[self.columns]
        direction = step / size**2
        length = float(step @ direction)
        derivatives = self.derivatives
        if length > 0:
            missed = errors - self.errors - derivatives @ step
            derivatives = derivatives + missed[..., None] * (direction / length)
        return Block(self.columns, errors, derivatives)

    @property
    def _rows(self) -> NDArray:
        return self.derivatives.reshape(self.errors.size, self.columns.size)


class HasErrors(Measured, Protocol):
    """A recording with the errors of a model of it."""

    @property
    def name(self) -> str:
        """Batch and recording."""

    @property
    def session(self) -> str:
        """Batch among several that are taken together; empty for a batch by itself."""

    def errors(self, values: Mapping[str, float]) -> NDArray:
        """Errors of the model with some parameters replaced, over the noise."""


R = TypeVar("R", bound=HasErrors)


@dataclass(frozen=True)
class Problem(Generic[R]):
    """Recordings and the unknowns of a model of them.

    Attributes
    ----------
    observations : sequence of Observations
        Or whatever else has errors (`HasErrors`), as whitened observations do.
    shared, own : mapping of str to Free
        Unknowns with one value for all, and with one value for each recording.
    weight : callable
        Weight of a recording's squared errors, from its observations (`ccmodel.inference.effective_samples`).
    """

    observations: Sequence[R]
    shared: Mapping[str, Free]
    own: Mapping[str, Free] = field(default_factory=dict)
    weight: Callable[[Any], float] = fit_weight

    @cached_property
    def names(self) -> list[str]:
        """Unknowns in the order of a vector of them: shared, then each recording's own."""
        return [*self.shared, *(f"{name}@{o.name}" for o in self.observations for name in self.own)]

    @cached_property
    def unknowns(self) -> list[tuple[str, Free]]:
        """Parameter of each of `names`, with its start, bounds and prior."""
        return [*self.shared.items(), *(one for _ in self.observations for one in self.own.items())]

    @cached_property
    def sizes(self) -> NDArray:
        """The unit of each unknown's steps, shape (unknowns,)."""
        return np.array([free.spread or size_of(name, free.start) for name, free in self.unknowns])

    @cached_property
    def start(self) -> NDArray:
        """Starting values, shape (unknowns,)."""
        return np.array([f.start for _, f in self.unknowns], dtype=float)

    @cached_property
    def bounds(self) -> tuple[NDArray, NDArray]:
        """Lowest and highest values, each of shape (unknowns,)."""
        low, high = [f.low for _, f in self.unknowns], [f.high for _, f in self.unknowns]
        return np.array(low, dtype=float), np.array(high, dtype=float)

    @cached_property
    def prior_precision(self) -> NDArray:
        """Reciprocal standard deviation of each unknown's prior, 0 without one; shape (unknowns,)."""
        return np.array([f.prior_precision for _, f in self.unknowns])

    @cached_property
    def prior_mean(self) -> NDArray:
        """Mean of each unknown's prior, shape (unknowns,)."""
        return np.array([f.prior_mean for _, f in self.unknowns], dtype=float)

    def prior_errors(self, x: NDArray) -> NDArray:
        """Distance of each unknown from its prior's mean over the prior's standard deviation; shape (unknowns,)."""
        return (x - self.prior_mean) * self.prior_precision

    def own_columns(self, i: int) -> slice:
        """Positions of one recording's own unknowns."""
        first = len(self.shared) + i * len(self.own)
        return slice(first, first + len(self.own))

    def values_of(self, x: NDArray, i: int) -> dict[str, float]:
        """Parameters of one recording, by name."""
        shared = x[: len(self.shared)].tolist()
        return dict(zip(self.shared, shared, strict=True)) | self.own_values_of(x, i)

    def own_values_of(self, x: NDArray, i: int) -> dict[str, float]:
        """One recording's own unknowns, by name."""
        return dict(zip(self.own, x[self.own_columns(i)].tolist(), strict=True))

    def errors(self, x: NDArray) -> list[NDArray]:
        """By recording, weighted errors over the noise."""
        return self._each(lambda i: self._weighted(x, i))

    def cost(self, x: NDArray, errors: Sequence[NDArray] | None = None) -> float:
        """Sum of squares of weighted errors and prior errors; `errors` are ``self.errors(x)``, where known."""
        errors = self.errors(x) if errors is None else errors
        return sum(float((e**2).sum()) for e in errors) + float((self.prior_errors(x) ** 2).sum())

    def blocks(self, x: NDArray, step: float = STEP, errors: Sequence[NDArray] | None = None) -> list[Block]:
        """Every recording's errors and derivatives about `x`.

        Parameters
        ----------
        x : ndarray, shape (unknowns,)
        step : float
            Step of the differences, as a share of the unknowns' sizes.
        errors : sequence of ndarray, optional
            ``self.errors(x)``, where it is known.
        """
        return self._each(lambda i: self._block(x, i, step, None if errors is None else errors[i]))

    def drive_errors(self: "Problem[Observations]", x: NDArray) -> list[NDArray]:
        """By recording, draws of weighted errors from the uncertain drive motion; (draws, channels, samples)."""
        return self._each(lambda i: self.observations[i].drive_errors(self.values_of(x, i)) * self._root_weight(i))

    def rounding_errors(self: "Problem[Observations]", x: NDArray) -> list[NDArray]:
        """By recording, draws of weighted rounding errors of counted angles; (phases, channels, samples)."""
        return self._each(lambda i: self.observations[i].rounding_errors(self.values_of(x, i)) * self._root_weight(i))

    def mean_square(self, x: NDArray) -> float:
        """Mean square of the errors over their noise, every sample with the same weight."""
        total = sum(float((e**2).sum()) / self.weight(self.observations[i]) for i, e in enumerate(self.errors(x)))
        return total / sum(o.measured.size for o in self.observations)

    @cached_property
    def effective_sample_size(self) -> float:
        """Number of independent errors: the expected cost of a correct model."""
        return sum(o.measured.size * self.weight(o) for o in self.observations)

    def _block(self, x: NDArray, i: int, relative: float, base: NDArray | None) -> Block:
        columns = np.r_[0 : len(self.shared), self.own_columns(i)].astype(int)
        base = self._weighted(x, i) if base is None else base
        # The values of other batches do not act on this recording: no run is spent on them.
        acting = np.array([acts_on(self.unknowns[k][0], self.observations[i].session) for k in columns], bool)
        varied = columns[acting]
        steps = inward(relative * self.sizes[varied], x[varied], self.bounds[1][varied])

        def run(of_recording: NDArray) -> NDArray:
            everywhere = x.copy()
            everywhere[varied] = of_recording
            return self._weighted(everywhere, i)

        derivatives = jacobian(run, x[varied], steps, base)
        if not acting.all():
            every = np.zeros((*base.shape, columns.size))
            every[..., acting] = derivatives
            derivatives = every
        return Block(columns, base, derivatives)

    def _weighted(self, x: NDArray, i: int) -> NDArray:
        return self.observations[i].errors(self.values_of(x, i)) * self._root_weight(i)

    def _root_weight(self, i: int) -> float:
        return np.sqrt(self.weight(self.observations[i]))

    def _each(self, work: Callable) -> list:
        return each(self.observations, lambda i, _: work(i))
