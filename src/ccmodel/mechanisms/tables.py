"""Laws given by tables, which the march evaluates: piecewise linear between equally spaced knots, constant beyond them.

A table stands in consecutive rows of an array of shape (rows, 2, n), so that each node or piece of each cable has its
own: the first and the last argument, the number of knots, and the values at the knots. A spring's is followed by the
stretches at the knots.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel


class Table(NamedTuple):
    """A law: its first and last argument, and its values at equally spaced knots."""

    first: float
    last: float
    values: tuple[float, ...]

    @property
    def knots(self) -> NDArray:
        """Its arguments, shape (knots,)."""
        return np.linspace(self.first, self.last, len(self.values))

    def at(self, x: NDArray) -> NDArray:
        """Its values at arguments, of their shape."""
        return np.interp(x, self.knots, self.values)

    @property
    def rows(self) -> NDArray:
        """What stands in the rows of an array, shape (rows,)."""
        return np.array([self.first, self.last, len(self.values), *self.values])

    @property
    def rows_of_spring(self) -> NDArray:
        """The same of a compliance by tension, with its integrals from a tension of zero to the knots."""
        x, c = self.knots, np.array(self.values)
        stretches = self.first * c[0] + np.cumsum(np.diff(x, prepend=x[0]) * (c + np.roll(c, 1)) / 2)
        return np.concatenate([self.rows, stretches])


@kernel
def interpolated(rows: NDArray, at: int, c: int, i: int, x: float) -> tuple[float, float]:
    """Value of the table in the rows from `at` at an argument, and its derivative."""
    first, last, knots = rows[at, c, i], rows[at + 1, c, i], int(rows[at + 2, c, i])
    per_x = (knots - 1) / (last - first)
    u = (x - first) * per_x
    if u <= 0.0:
        return rows[at + 3, c, i], 0.0
    if u >= knots - 1:
        return rows[at + 2 + knots, c, i], 0.0
    k = int(u)
    low, high = rows[at + 3 + k, c, i], rows[at + 4 + k, c, i]
    return low + (u - k) * (high - low), (high - low) * per_x


@kernel
def stretched(rows: NDArray, at: int, c: int, i: int, tension: float) -> float:
    """Stretch at a tension of the spring in the rows from `at`."""
    first, last, knots = rows[at, c, i], rows[at + 1, c, i], int(rows[at + 2, c, i])
    compliance, stretch = at + 3, at + 3 + knots
    step = (last - first) / (knots - 1)
    k = min(max(int((tension - first) / step), 0), knots - 2)
    low = rows[compliance + k, c, i]
    inside = min(max(tension, first), last) - first - k * step
    between = inside * (low + 0.5 * inside * (rows[compliance + k + 1, c, i] - low) / step)
    below = rows[compliance, c, i] * min(tension - first, 0.0)
    above = rows[stretch - 1, c, i] * max(tension - last, 0.0)
    return rows[stretch + k, c, i] + between + below + above


@kernel
def pulled(rows: NDArray, at: int, c: int, i: int, stretch: float) -> tuple[float, float]:
    """Tension at a stretch of the spring in the rows from `at`, and its derivative: the inverse of `stretched`."""
    first, last, knots = rows[at, c, i], rows[at + 1, c, i], int(rows[at + 2, c, i])
    compliance, stretched = at + 3, at + 3 + knots
    if stretch <= rows[stretched, c, i]:
        slope = 1.0 / rows[compliance, c, i]
        return first + slope * (stretch - rows[stretched, c, i]), slope
    if stretch >= rows[stretched + knots - 1, c, i]:
        slope = 1.0 / rows[stretched - 1, c, i]
        return last + slope * (stretch - rows[stretched + knots - 1, c, i]), slope
    k = 0
    while stretch > rows[stretched + k + 1, c, i]:
        k += 1
    step = (last - first) / (knots - 1)
    low, beyond = rows[compliance + k, c, i], stretch - rows[stretched + k, c, i]
    rise = (rows[compliance + k + 1, c, i] - low) / step
    # The compliance at the tension that is sought; between knots the stretch is a parabola of the tension.
    there = sqrt(low * low + 2.0 * rise * beyond)
    return first + k * step + 2.0 * beyond / (low + there), 1.0 / there
