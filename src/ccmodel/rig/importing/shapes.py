"""What the samples of a signal show by themselves: time, counts, constants, order of two ends, signs."""

import numpy as np
from numpy.typing import NDArray

from ccmodel.rig.importing.clocks import interpolation_cost

# Rates and durations that recordings of a rig have. A time that has others in one unit is not in that unit.
RATES_HZ, DURATIONS_S = (5.0, 50_000.0), (0.5, 7200.0)
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# Steps of a clock are equal but for jitter: the middle half of them within this share of their median.
_EVEN = 0.5
# Fewest different values of a counter that moves.
_FEWEST_COUNTS = 5
# Sine of the lag from which one signal is seen to follow another.
_LAG = 0.01
# Correlation from which a sign is seen.
_CORRELATED = 0.5
# Mean power over the product of root mean squares, from which its sign is seen.
_POWER = 0.1
# Samples at the start that are taken as the rest, as a share of the recording.
_REST = 0.02


def is_constant(values: NDArray) -> bool:
    """Whether a signal has one value only, or none."""
    finite = values[np.isfinite(values)]
    return finite.size < 2 or np.ptp(finite) == 0


def is_whole(values: NDArray) -> bool:
    """Whether a signal moves in whole numbers, as counts do."""
    finite = values[np.isfinite(values)]
    return finite.size > 0 and bool((finite == np.round(finite)).all()) and np.unique(finite).size >= _FEWEST_COUNTS


def never_falls(values: NDArray) -> bool:
    """Whether a signal rises or stays, as any time does."""
    steps = np.diff(values[np.isfinite(values)])
    return steps.size > 0 and bool((steps >= 0).all() and (steps > 0).mean() > _EVEN)


def is_clock(values: NDArray) -> bool:
    """Whether a signal rises all the time in nearly equal steps."""
    steps = np.diff(values[np.isfinite(values)])
    if steps.size < 2 or not (steps > 0).all():
        return False
    low, middle, high = np.percentile(steps, [25, 50, 75])
    return bool(high - low <= _EVEN * middle)


def units_of_clock(values: NDArray) -> list[str]:
    """Units in which a clock has the rate and the duration of a recording."""
    finite = values[np.isfinite(values)]
    step, span = float(np.median(np.diff(finite))), float(np.ptp(finite))
    return [
        unit
        for unit, second in TIME_UNITS.items()
        if RATES_HZ[0] <= 1 / (step * second) <= RATES_HZ[1] and DURATIONS_S[0] <= span * second <= DURATIONS_S[1]
    ]


def correlation(one: NDArray, other: NDArray) -> float:
    """Correlation of two signals of shape (n,); 0 if either is constant."""
    has = np.isfinite(one) & np.isfinite(other)
    if is_constant(one[has]) or is_constant(other[has]):
        return 0.0
    return float(np.corrcoef(one[has], other[has])[0, 1])


def follows(first: NDArray, second: NDArray) -> bool | None:
    """Whether `second` lags `first`, by the sense of the loop of one over the other; None if neither lags."""
    if abs(correlation(first, second)) < _CORRELATED:
        return None
    second = second * np.sign(correlation(first, second))
    a, b = (x - np.mean(x) for x in (first, second))
    # Over closed loops the integral of a db is positive where b comes later; for sines the ratio is 1.1 sin(lag).
    middle = (a[1:] + a[:-1]) / 2
    area = np.sum(middle * np.diff(b)) / (np.sum(np.abs(np.diff(a))) * np.std(b))
    return None if abs(area) < _LAG else bool(area > 0)


def sign_of_angle(drive: NDArray, load: NDArray) -> int | None:
    """Sign with which the load angle follows the drive angle; None if it is not seen."""
    return _sign(correlation(drive, load), _CORRELATED)


def sign_of_drive_torque(angle: NDArray, torque: NDArray) -> int | None:
    """Sign with which a drive torque feeds energy into the transmission, or else rises with the angle."""
    has = np.isfinite(angle) & np.isfinite(torque)
    angle, torque = angle[has], torque[has] - np.mean(torque[has])
    steps = np.diff(angle)
    power = np.sum((torque[1:] + torque[:-1]) / 2 * steps) / (np.sum(np.abs(steps)) * np.std(torque) or np.inf)
    return _sign(float(power), _POWER) or _sign(correlation(angle, torque), _CORRELATED)


def sign_of_load_torque(angle: NDArray, torque: NDArray) -> int | None:
    """Sign with which a load torque rises with the load angle, as that of a spring does."""
    return _sign(correlation(angle, torque), _CORRELATED)


def sign_of_tension(force: NDArray) -> int | None:
    """Sign of a force that cables can have: positive at rest, and nearly everywhere."""
    finite = force[np.isfinite(force)]
    if is_constant(finite):
        return None
    at_rest = np.median(finite[: max(int(_REST * finite.size), 10)])
    if np.mean(np.sign(finite) == np.sign(at_rest)) < 0.99:
        return None
    return int(np.sign(at_rest)) or None


def roughness(values: NDArray) -> float:
    """Noise of a signal as a share of its standard deviation; an angle that moves is smoother than forces are."""
    finite = values[np.isfinite(values)]
    noise = interpolation_cost(finite)[1]
    return np.inf if noise is None or is_constant(finite) else float(noise / np.std(finite))


def _sign(value: float, threshold: float) -> int | None:
    return int(np.sign(value)) if abs(value) >= threshold else None
