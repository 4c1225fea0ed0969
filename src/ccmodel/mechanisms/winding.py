"""How much cable a pulley winds, for a radius that changes with its angle, or an encoder that errs.

The radius is R (1 + e sin(theta + psi) + f(theta)), with the eccentricity e of a bore and a table f of any shape. The
cables' travel is the integral of this radius over the angle. Of an encoder that reads the angle theta + g at theta + g,
the travel is shorter by R g, and the radius is not concerned.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel
from ccmodel.mechanisms.tables import Table


class Pulley(NamedTuple):
    """A pulley's radius by its angle, and the error of the angle.

    Attributes
    ----------
    radius_m : float
        R.
    eccentricity, phase_rad : float
        e and psi.
    knots_rad, added, added_rad : ndarray, shape (knots,)
        Angles at the knots of f, its values there, and its integral from the first knot; empty without f, which is
        piecewise linear between knots and constant beyond them.
    read_rad, error_rad : ndarray, shape (knots of g,)
        Readings of the encoder at the knots of g, and its values there; likewise.
    """

    radius_m: float
    eccentricity: float
    phase_rad: float
    knots_rad: NDArray
    added: NDArray
    added_rad: NDArray
    read_rad: NDArray
    error_rad: NDArray


NO_TABLES = (np.zeros(0),) * 5


def pulley_of(
    radius_m: float, eccentricity: float, phase_rad: float, factor: Table | None, error: Table | None = None
) -> Pulley:
    """An eccentric pulley; `factor` is 1 + f and `error` g, none if not given."""
    bore = float(radius_m), float(eccentricity), float(phase_rad)
    if factor is None and error is None:
        return Pulley(*bore, *NO_TABLES)
    x, f = _arrays(factor)
    f -= 1.0
    integral = np.concatenate([np.zeros(min(x.size, 1)), np.cumsum(np.diff(x) * (f[1:] + f[:-1]) / 2)])
    return Pulley(*bore, x, f, integral, *_arrays(error))


def _arrays(table: Table | None) -> tuple[NDArray, NDArray]:
    """Copies of a table's knots and values, empty without a table; the march is compiled for contiguous arrays."""
    return (np.zeros(0), np.zeros(0)) if table is None else (np.array(table.knots), np.array(table.values))


@kernel
def _interval(theta: float, x: NDArray) -> int:
    """Number of the interval between knots that an angle from the first of them on is in."""
    return min(int(np.searchsorted(x, theta, side="right")) - 1, x.size - 2)


@kernel
def _error(theta: float, pulley: Pulley) -> float:
    """The error g of an encoder that has one, where it reads theta."""
    x, g = pulley.read_rad, pulley.error_rad
    last = x.size - 1
    if theta <= x[0] or theta >= x[last]:
        return float(g[0] if theta <= x[0] else g[last])
    k = _interval(theta, x)
    return float(g[k] + (g[k + 1] - g[k]) / (x[k + 1] - x[k]) * (theta - x[k]))


@kernel
def _added(theta: float, pulley: Pulley) -> tuple[float, float, float]:
    """Integral of f from its first knot to an angle (rad), f there, and its derivative."""
    x, f, integral = pulley.knots_rad, pulley.added, pulley.added_rad
    if theta <= x[0]:
        return f[0] * (theta - x[0]), f[0], 0.0
    last = x.size - 1
    if theta >= x[last]:
        return integral[last] + f[last] * (theta - x[last]), f[last], 0.0
    k = _interval(theta, x)
    slope, beyond = (f[k + 1] - f[k]) / (x[k + 1] - x[k]), theta - x[k]
    return integral[k] + (f[k] + 0.5 * slope * beyond) * beyond, f[k] + slope * beyond, slope


@kernel
def winding(theta: float, pulley: Pulley) -> tuple[float, float, float]:
    """Cable travel over R (rad), from any zero; the radius over R, and the derivative of the latter by the angle."""
    e, psi = pulley.eccentricity, pulley.phase_rad
    travel, factor, slope = theta, 1.0, 0.0
    if e != 0.0:
        slope = e * np.cos(theta + psi)
        travel, factor = theta - slope, 1.0 + e * np.sin(theta + psi)
    if pulley.read_rad.size:
        travel -= _error(theta, pulley)
    if pulley.knots_rad.size:
        added_rad, added, by_angle = _added(theta, pulley)
        return travel + added_rad, factor + added, slope + by_angle
    return travel, factor, slope


@kernel
def winding_change(theta: float, rotation: float, pulley: Pulley) -> float:
    """Cable travel over R (rad) of a rotation from theta; by the bore without cancellation for a small one."""
    e, psi = pulley.eccentricity, pulley.phase_rad
    change = rotation
    if e != 0.0:
        change += 2.0 * e * np.sin(theta + psi + 0.5 * rotation) * np.sin(0.5 * rotation)
    if pulley.read_rad.size:
        change -= _error(theta + rotation, pulley) - _error(theta, pulley)
    if pulley.knots_rad.size:
        change += _added(theta + rotation, pulley)[0] - _added(theta, pulley)[0]
    return change
