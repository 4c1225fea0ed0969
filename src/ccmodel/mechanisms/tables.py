"""Laws given by tables, which the march evaluates: piecewise linear between knots, constant beyond them.

A table stands in consecutive rows of an array of shape (rows, 2, n), so that each node or piece of each cable has its
own: the number of knots, the arguments there, and the values there. A spring's is followed by its stretches there.

A table of Maxwell-slip elements has the travels at which they yield and their torques in the place of arguments and
values, and is followed by their states, -1 to 1, before and after a step.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel


class Table(NamedTuple):
    """A law: its arguments at the knots and its values there, both of shape (knots,).

    Arguments increase, but for the travels of elements.
    """

    knots: NDArray
    values: NDArray

    def at(self, x: NDArray) -> NDArray:
        """Its values at arguments, of their shape."""
        return np.interp(x, self.knots, self.values)

    @property
    def rows(self) -> NDArray:
        """What stands in the rows of an array, shape (rows,)."""
        return np.concatenate([[self.knots.size], self.knots, self.values])

    @property
    def rows_of_spring(self) -> NDArray:
        """The same of a compliance by tension, with its integrals from a tension of zero to the knots."""
        x, c = self.knots, self.values
        stretches = x[0] * c[0] + np.cumsum(np.diff(x, prepend=x[0]) * (c + np.roll(c, 1)) / 2)
        return np.concatenate([self.rows, stretches])

    def with_elements(self, other: "Table") -> "Table":
        """Its Maxwell-slip elements and those of another, in no order."""
        return Table(np.concatenate([self.knots, other.knots]), np.concatenate([self.values, other.values]))

    @property
    def rows_of_elements(self) -> NDArray:
        """The same of Maxwell-slip elements, with their states at rest."""
        return np.concatenate([self.rows, np.zeros(2 * self.knots.size)])


@kernel(inline="always")
def _before(rows: NDArray, first: int, knots: int, c: int, i: int, x: float) -> int:
    """Number of the interval, of those between the `knots` rows from `first`, that has x in it or next to it."""
    k = 0
    while k < knots - 2 and x > rows[first + k + 1, c, i]:
        k += 1
    return k


@kernel(inline="always")
def interpolated(rows: NDArray, at: int, c: int, i: int, x: float) -> tuple[float, float]:
    """Value of the table in the rows from `at` at an argument, and its derivative."""
    knots = int(rows[at, c, i])
    argument, value = at + 1, at + 1 + knots
    if x <= rows[argument, c, i]:
        return rows[value, c, i], 0.0
    if x >= rows[argument + knots - 1, c, i]:
        return rows[value + knots - 1, c, i], 0.0
    k = _before(rows, argument, knots, c, i, x)
    low, step = rows[value + k, c, i], rows[argument + k + 1, c, i] - rows[argument + k, c, i]
    slope = (rows[value + k + 1, c, i] - low) / step
    return low + slope * (x - rows[argument + k, c, i]), slope


@kernel
def stretched(rows: NDArray, at: int, c: int, i: int, tension: float) -> float:
    """Stretch at a tension of the spring in the rows from `at`."""
    knots = int(rows[at, c, i])
    argument, compliance, stretch = at + 1, at + 1 + knots, at + 1 + 2 * knots
    first, last = rows[argument, c, i], rows[argument + knots - 1, c, i]
    inside = min(max(tension, first), last)
    k = _before(rows, argument, knots, c, i, inside)
    mean = 0.5 * (rows[compliance + k, c, i] + interpolated(rows, at, c, i, inside)[0])
    below = rows[compliance, c, i] * min(tension - first, 0.0)
    above = rows[compliance + knots - 1, c, i] * max(tension - last, 0.0)
    return rows[stretch + k, c, i] + mean * (inside - rows[argument + k, c, i]) + below + above


@kernel(inline="always")
def pulled(rows: NDArray, at: int, c: int, i: int, stretch: float) -> tuple[float, float]:
    """Tension at a stretch of the spring in the rows from `at`, and its derivative: the inverse of `stretched`."""
    knots = int(rows[at, c, i])
    argument, compliance, stretches = at + 1, at + 1 + knots, at + 1 + 2 * knots
    for end in (0, knots - 1):
        beyond = stretch - rows[stretches + end, c, i]
        if (beyond <= 0.0) if end == 0 else (beyond >= 0.0):
            slope = 1.0 / rows[compliance + end, c, i]
            return rows[argument + end, c, i] + slope * beyond, slope
    k = _before(rows, stretches, knots, c, i, stretch)
    low, beyond = rows[compliance + k, c, i], stretch - rows[stretches + k, c, i]
    step = rows[argument + k + 1, c, i] - rows[argument + k, c, i]
    rise = (rows[compliance + k + 1, c, i] - low) / step
    # The compliance at the tension that is sought; between knots the stretch is a parabola of the tension.
    there = sqrt(low * low + 2.0 * rise * beyond)
    return rows[argument + k, c, i] + 2.0 * beyond / (low + there), 1.0 / there


@kernel
def slip(before: float, travel: float, yields: float) -> float:
    """State of a Maxwell-slip element, -1 to 1, after a further travel; it yields after the travel `yields`."""
    return float(min(max(before + travel / yields, -1.0), 1.0))


@kernel
def slipped(rows: NDArray, at: int, travel: float) -> tuple[float, float]:
    """Torque of the elements in the rows from `at` after a further travel, and its derivative.

    `rows` has shape (rows,). The states after the step are written; `keep_slip` makes them those before the next.
    """
    elements = int(rows[at])
    torque, slope = 0.0, 0.0
    for k in range(at + 1, at + 1 + elements):
        yields, largest, before = rows[k], rows[k + elements], rows[k + 2 * elements]
        after = slip(before, travel, yields)
        rows[k + 3 * elements] = after
        torque += largest * after
        slope += largest / yields if abs(after) < 1.0 else 0.0
    return torque, slope


@kernel
def keep_slip(rows: NDArray, at: int) -> None:
    """Make the states of elements after a step those before the next."""
    elements = int(rows[at])
    for k in range(at + 1 + 2 * elements, at + 1 + 3 * elements):
        rows[k] = rows[k + elements]
