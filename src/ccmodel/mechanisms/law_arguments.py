"""Quantities that a law which no list holds may depend on, computed from the motion and the readings of a run."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import CABLES, TENSIONS, THETA_IN, TORQUE_AT, symbol_of, unit_of
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Sensing

# A reversal is a motion back by more than this, which noise of the encoder does not reach.
REVERSAL_RAD = 0.01
# The contact is renewed when the drive has moved so far, m; and the shortest age that is told apart, s.
RENEWAL_M, SHORTEST_S = 2e-4, 1e-3
SLOWEST_M_PER_S = 1e-5


@dataclass(frozen=True)
class Argument:
    """A quantity that a law may depend on.

    Attributes
    ----------
    name : str
        As in the diagnosis format.
    unit : str
    meaning : str
        As it stands in a sentence.
    of : callable
        ``of(sensing)``: its values, shape (n,); of one that differs along the cables, those at several places, shape
        (places, n).
    two_values : tuple of str
        What -1 and 1 stand for, of one that has no other values; else empty.
    symbol : str
        As it stands in a formula.
    """

    name: str
    unit: str
    meaning: str
    of: Callable[[Sensing], NDArray]
    two_values: tuple[str, ...] = ()
    symbol: str = "x"

    @property
    def has_two_values(self) -> bool:
        """Whether it is -1 or 1."""
        return bool(self.two_values)

    @property
    def depends_on_time(self) -> bool:
        """Whether it depends on the rate of the motion, not only on its path."""
        return self.name in ("speed", "acceleration", "dwell", "time", "rate")


@kernel(allocates=True)
def _motion_memory(theta: NDArray, play: float) -> tuple[NDArray, NDArray]:
    """Direction of the last motion (0 before any), and the angle since its reversal; shapes (n,)."""
    direction, since = np.zeros(theta.size), np.zeros(theta.size)
    furthest, turned, sign = theta[0], theta[0], 0.0
    for i in range(theta.size):
        moved = theta[i] - furthest
        if sign == 0.0:
            if abs(moved) > play:
                sign = 1.0 if moved > 0 else -1.0
                furthest = theta[i]
        elif moved * sign > 0:
            furthest = theta[i]
        elif abs(moved) > play:
            turned, sign, furthest = furthest, -sign, theta[i]
        direction[i], since[i] = sign, abs(theta[i] - turned)
    return direction, since


@kernel(allocates=True)
def _contact_age(time_s: NDArray, theta: NDArray, renewal: float) -> NDArray:
    """Time since the drive was a renewal length away from where it is, s; before that, since the start; shape (n,)."""
    age = np.zeros(theta.size)
    for i in range(theta.size):
        k = i
        while k > 0 and abs(theta[i] - theta[k]) < renewal:
            k -= 1
        age[i] = time_s[i] - time_s[k]
    return age


def _derivative_of(channel: str, order: int = 1) -> Callable[[Sensing], NDArray]:
    """Rate of a channel, or its second derivative; where no time passes nothing changes."""

    def of(s: Sensing) -> NDArray:
        if s.time_s[-1] == s.time_s[0]:
            return np.zeros(s.time_s.size)
        values = s.channels[channel]
        for _ in range(order):
            values = np.gradient(values, s.time_s)
        return values

    return of


def _direction(s: Sensing) -> NDArray:
    return _motion_memory(s.channels[THETA_IN], REVERSAL_RAD)[0]


def _since_reversal_of(angle: str) -> Callable[[Sensing], NDArray]:
    radius = "drive_radius_m" if angle == THETA_IN else "load_radius_m"
    return lambda s: getattr(s, radius) * _motion_memory(s.channels[angle], REVERSAL_RAD)[1]


def _age(s: Sensing) -> NDArray:
    age = _contact_age(s.time_s, s.channels[THETA_IN], RENEWAL_M / s.drive_radius_m)
    return np.log10(np.maximum(age, SHORTEST_S))


def reading_of(channel: str) -> Callable[[Sensing], NDArray]:
    """Argument that is the reading of a channel."""
    return lambda s: s.channels[channel]


def rate_of(channel: str) -> Argument:
    """The rate of a channel's reading, on which a sensor that follows slowly depends."""
    return Argument("rate", f"{unit_of(channel)}/s", f"the rate of {symbol_of(channel)}", _derivative_of(channel))


def torque_at(end: str) -> Argument:
    """The torque at one end over its pulley's radius: another sensor's reading, in the unit of the load cell's."""
    return Argument(
        "torque",
        "N",
        f"{symbol_of(TORQUE_AT[end])} over the {end} pulley's radius",
        lambda s: s.channels[TORQUE_AT[end]] / getattr(s, f"{end}_radius_m"),
    )


def _log_speed(s: Sensing) -> NDArray:
    return np.log10(np.maximum(s.drive_radius_m * np.abs(_derivative_of(THETA_IN)(s)), SLOWEST_M_PER_S))


def _tensions(s: Sensing) -> NDArray:
    return np.stack([s.channels[c] for c in TENSIONS if c in s.channels]).clip(0.0)


def _cables(s: Sensing) -> NDArray:
    signs = [sign for sign, ends in ((-1.0, CABLES["A"]), (1.0, CABLES["B"])) if set(ends) <= s.channels.keys()]
    return np.repeat(np.array(signs)[:, None], s.time_s.size, axis=1)


TENSION = Argument("tension", "N", "the cable's tension", _tensions)
POSITION = Argument(
    "position-along-conduit",
    "1",
    "the position along the conduit, from the drive, over its length",
    lambda s: np.repeat([[0.0], [1.0]], s.time_s.size, axis=1),
)
DIRECTION = Argument(
    "direction",
    "1",
    "the direction in which the cable slides",
    _direction,
    ("away from the drive", "towards the drive"),
    "sign(v)",
)
CABLE = Argument("cable", "1", "the cable", _cables, ("in cable A", "in cable B"))
TIME = Argument("time", "s", "the time since the recording's start", lambda s: s.time_s - s.time_s[0])
TRAVEL = Argument("travel", "m", "the drive's travel since the recording's start", lambda s: s.drive_travel_m)
LOG_SPEED = Argument("speed", "log10(m/s)", "the logarithm of the cables' speed at the drive", _log_speed)
DWELL = Argument("dwell", "log10(s)", "the logarithm of the contacts' age", _age)


SLIDING = Argument(
    "distance-since-reversal", "m", "a contact's sliding since its last reversal", _since_reversal_of(THETA_IN)
)
SPEED = Argument(
    "speed",
    "m/s",
    "the speed at which the cable slides",
    lambda s: s.drive_radius_m * np.abs(_derivative_of(THETA_IN)(s)),
)


def of_motion(angle: str, end: str) -> dict[str, Argument]:
    """Arguments of the motion of one pulley."""
    return {
        "angle": Argument(f"{end}-angle", "rad", f"the {end} pulley's angle", reading_of(angle)),
        "speed": Argument("speed", "rad/s", f"the {end} pulley's velocity", _derivative_of(angle)),
        "acceleration": Argument(
            "acceleration", "rad/s^2", f"the {end} pulley's acceleration", _derivative_of(angle, order=2)
        ),
        "since": Argument(
            "distance-since-reversal",
            "m",
            f"the distance of the {end}'s motion since its last reversal",
            _since_reversal_of(angle),
        ),
    }
