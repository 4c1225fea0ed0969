"""Laws that no list holds: an unknown function of one quantity at one slot of the transmission.

A slot is a place in the equations where a constitutive law can stand: a factor of the sliding friction, a torque at the
drive pulley's bearing, the map of a sensor. Its law is a piecewise linear function of one argument, between knots over
what the recordings visit, and constant beyond them:

    y(x) = scale sum_k B_jk z_k at knot j,    z_k ~ N(0, 1)

B is the root of a squared exponential covariance without its mean, so that z = 0 is no effect, and a smooth law is more
probable than a rugged one. What a law adds on average belongs to the parameters of the calibration.

Laws are mechanisms that `ccmodel.mechanisms.names` does not list. `ccmodel.diagnosis.laws` learns them.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import (
    F_DRIVE,
    F_LOAD,
    PLACES_OF,
    TAU_IN,
    TAU_OUT,
    TENSIONS,
    THETA_IN,
    THETA_OUT,
    short_name,
    symbol_of,
    unit_of,
)
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import (
    BEARING_TORQUE,
    CABLE_STRETCH,
    END_STRETCH,
    LOAD,
    SENSOR_MAP,
    SLIDING_FRICTION,
    Curve,
    Mechanism,
    Parameter,
    Sensing,
    Settings,
    side,
)
from ccmodel.mechanisms.tables import Table

# Knots of a law, and the length over which its values are correlated a priori, as a share of its range: at first, and
# where the recordings show more. The fastening of a cable is smooth at first: with more coefficients its law would be
# less probable than friction that vanishes next to it, which yields alike.
COARSE, FINE, SMOOTH = (9, 0.25), (25, 0.08), (9, 1.0)
# Shares of a law's standard deviation below which a direction of its coefficients is left out.
SLIGHTEST = 0.02
# Standard deviation of a straight line at its end, over that of the curve about it.
SLOPE = 3.0
# A reversal is a motion back by more than this, which noise of the encoder does not reach.
REVERSAL_RAD = 0.01
# The contact is renewed when the drive has moved so far, m; and the shortest age that is told apart, s.
RENEWAL_M, SHORTEST_S = 2e-4, 1e-3
SLOWEST_M_PER_S = 1e-5
# The range of a law's argument, as quantiles of what the recordings visit; and the shortest travel at which an element
# of a law with memory yields, as a share of the longest.
RANGE, SHORTEST_YIELD = (0.005, 0.995), 0.01
# The lowest knot of a law of the tension over the highest one, at least: slack cables have no tension.
LOWEST_TENSION = 0.02
# Friction is never negative in either direction.
LARGEST_BIAS = 0.95
# A law of the sliding distance opposes the motion of each contact; the shortest travel after which it yields, over the
# drive's longest.
CONTACTS, SHORTEST_OF_CONTACTS = "contacts", 0.002
# A spring is never without stretch: its least compliance over its mean.
LEAST_COMPLIANCE = 0.05


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
    has_two_values : bool
        Whether it is -1 or 1.
    """

    name: str
    unit: str
    meaning: str
    of: Callable[[Sensing], NDArray]
    has_two_values: bool = False

    @property
    def depends_on_time(self) -> bool:
        """Whether it depends on the rate of the motion, not only on its path."""
        return self.name in ("speed", "dwell", "time")


@dataclass(frozen=True)
class Law:
    """A slot and the argument of its law.

    Attributes
    ----------
    slot, place : str
    argument : Argument
    channel : str or None
        The channel that a torque or a reading is added to; None for a factor of friction.
    opposes : str or None
        The angle whose motion a friction torque with memory opposes: each of its knots is the travel at which a
        Maxwell-slip element yields, and its value there is the torque of that element. With `CONTACTS`, it opposes the
        sliding of each contact: a knot is the travel since a reversal at which an element yields, and the value is its
        share of friction.
    resolution : (int, float)
        Number of knots, and correlation length.
    is_drag : bool
        Whether it is a drag per length of conduit that does not depend on the tension, and no factor of friction.
    """

    slot: str
    place: str
    argument: Argument
    channel: str | None = None
    opposes: str | None = None
    resolution: tuple[int, float] = COARSE
    is_drag: bool = False

    @property
    def name(self) -> str:
        """Its name as a mechanism."""
        of = ""
        if self.slot == SENSOR_MAP:
            of = f"-{short_name(str(self.channel))}".replace("_", "-")
        if self.slot == END_STRETCH:
            of = f"-{side(self.place)}"
        if self.is_drag:
            of = "-drag"
        fine = "" if self.is_first else "-fine"
        return f"learned-{self.slot}{of}-by-{self.argument.name}{fine}"

    @property
    def unit(self) -> str:
        """Unit of its values."""
        if self.channel is not None:
            return unit_of(self.channel)
        if self.is_drag:
            return "N/m"
        return "1" if self.is_factor else "m/N"

    @property
    def is_spaced_by_ratio(self) -> bool:
        """Whether its knots have equal ratios: travels to yield, and tensions, of which powers are expected."""
        return self.opposes is not None or self.argument.name == "tension"

    @property
    def is_factor(self) -> bool:
        """Whether it is a factor, to which its values are added; it is then 1 where it has no effect."""
        return self.slot in (SLIDING_FRICTION, CABLE_STRETCH) and not self.is_drag

    @property
    def is_centred(self) -> bool:
        """Whether its average belongs to the calibration."""
        return self.opposes is None and self.slot != END_STRETCH and not self.is_drag

    @property
    def curve_is(self) -> str:
        """What its values are."""
        if self.opposes == CONTACTS:
            return "friction over that of sliding, after a reversal"
        if self.is_drag:
            return "drag of a cable per length of conduit, in N/m"
        if self.channel is None:
            return _CURVE_IS[self.slot].format(side=side(self.place))
        against = "" if self.opposes is None else ", against the motion"
        return f"added to {symbol_of(self.channel)}{against}, in {self.unit}"

    @property
    def setting(self) -> str | None:
        """The solver's setting that takes the law, if it is one of the solver.

        A law whose argument differs along the cables is a number or a table in the solver's equations. The others are
        functions of a motion, and a setting holds several.
        """
        if self.is_drag:
            return "conduit_drag"
        by_argument = _SETTINGS.get((self.slot, self.argument.name), _SETTINGS.get((self.slot, "")))
        return by_argument and by_argument.format(side=side(self.place))

    def written(self, x: NDArray, y: NDArray, before: Any) -> Any:
        """The value of its setting that had the value `before`, for values at knots; both of shape (knots,)."""
        if self.setting == "direction_bias":
            return float(np.clip(y[-1], -LARGEST_BIAS, LARGEST_BIAS))
        if isinstance(before, tuple):
            return (*before, lambda sensing: self.added(sensing, x, y))
        if not y.any():
            return None
        if self.opposes == CONTACTS or self.is_drag:
            return Table(x, y)
        if self.is_factor:
            return Table(x, self.possible(1 + y))
        return Table(x, self.possible(y)) if (y > 0).any() else None

    def possible(self, y: NDArray) -> NDArray:
        """Values within what is physically possible: no negative friction or stretch."""
        low = {SLIDING_FRICTION: 0.0, CABLE_STRETCH: LEAST_COMPLIANCE, END_STRETCH: 0.0}.get(self.slot)
        # After a reversal, friction acts in the former direction at first; a drag may take off from friction.
        return y if low is None or self.opposes == CONTACTS or self.is_drag else y.clip(low)

    @property
    def basis(self) -> NDArray:
        """Derivatives of its values at the knots by its coefficients, shape (knots, coefficients)."""
        knots, length = (2, 1.0) if self.argument.has_two_values else self.resolution
        return basis(knots, length, self.is_centred, self.is_drag)

    def at_knots(self, values: Mapping[str, float]) -> tuple[NDArray, NDArray]:
        """Its arguments at the knots and its values there, both of shape (knots,)."""
        z = [values[name] for name in self.coefficients]
        space = np.geomspace if self.is_spaced_by_ratio else np.linspace
        return space(values["first"], values["last"], len(self.basis)), values["scale"] * (self.basis @ z)

    def range_of(self, visited: NDArray) -> tuple[float, float]:
        """First and last knot for the arguments that recordings visit."""
        # A drag grows with speed, and is largest in the few fastest samples.
        first, last = np.quantile(visited, (0.0, 1.0) if self.is_drag else RANGE)
        if self.is_spaced_by_ratio:
            shortest = SHORTEST_OF_CONTACTS if self.opposes == CONTACTS else SHORTEST_YIELD
            first = last * shortest if self.opposes else max(first, last * LOWEST_TENSION)
        return float(first), float(last)

    def shown(self, x: NDArray, at: NDArray | None = None) -> NDArray:
        """What its curve shows of its values at the knots `x`, at the knots or at others, shape (arguments, knots).

        Of a torque with memory it is what builds up from rest, and of the contacts what they lack of sliding friction
        after a reversal from sliding; otherwise these values.
        """
        if self.opposes is None:
            return np.eye(len(x))
        built_up = np.minimum((x if at is None else at)[:, None] / x, 1.0)
        return -2.0 * (1.0 - built_up) if self.opposes == CONTACTS else built_up

    def determined_at(self, x: NDArray) -> NDArray:
        """Arguments at which its curve determines its values at the knots, shape (knots,)."""
        # The first element has yielded at its knot, and nothing yields beyond the last one.
        return np.concatenate([[x[0] / 2], x[:-1]]) if self.opposes == CONTACTS else x

    def behind(self, x: NDArray, curve: NDArray) -> NDArray:
        """Its values at the knots, from its curve at `determined_at`; both of shape (knots,)."""
        return np.linalg.solve(self.shown(x, self.determined_at(x)), curve - float(self.is_factor))

    @property
    def coefficients(self) -> list[str]:
        """Names of its coefficients."""
        return [f"z{k + 1}" for k in range(self.basis.shape[1])]

    def added(self, sensing: Sensing, x: NDArray, y: NDArray) -> NDArray:
        """What it adds along a run, to 1 if it is a factor, for values at knots; shape (n,)."""
        if self.opposes is None:
            return np.interp(self.argument.of(sensing), x, y)
        radius = sensing.drive_radius_m if self.opposes == THETA_IN else sensing.load_radius_m
        return y @ _slip(radius * sensing.channels[self.opposes], x)

    def is_of_slot(self, other: "Law") -> bool:
        """Whether another law stands in the same slot."""
        is_same_sensor = self.slot != SENSOR_MAP or self.channel == other.channel
        return (self.slot, self.place) == (other.slot, other.place) and is_same_sensor

    def has_the_quantity_of(self, other: "Law") -> bool:
        """Whether it is the other law, with as many knots or not."""
        return replace(self, resolution=other.resolution) == other

    def finer(self) -> "Law | None":
        """The same law with more coefficients, if there is one."""
        is_finest = self.argument.has_two_values or self.opposes is not None or not self.is_first
        return None if is_finest else replace(self, resolution=COARSE if self.slot == END_STRETCH else FINE)

    @property
    def is_first(self) -> bool:
        """Whether it is tried before the same law with more coefficients."""
        return self.resolution == (SMOOTH if self.slot == END_STRETCH else COARSE)

    @cached_property
    def mechanism(self) -> Mechanism:
        """The law as a mechanism."""
        unit = self.argument.unit
        fixed = (
            Parameter("first", unit, -inf, inf, 0.0, "argument at the first knot", fixed=True),
            Parameter("last", unit, -inf, inf, 1.0, "argument at the last knot", fixed=True),
            Parameter("scale", self.unit, 0.0, inf, 1.0, "standard deviation of its values a priori", fixed=True),
        )
        coefficients = tuple(
            Parameter(name, "1", -4.0, 4.0, 0.0, "coefficient of the law", scale="linear", prior_sd=1.0)
            for name in self.coefficients
        )
        return Mechanism(
            name=self.name,
            text=_TEXT.format(what=self.curve_is, argument=self.argument.meaning),
            tex=r"y(x) = \mathrm{scale}\,\sum_k B_k(x)\,z_k",
            sentence=f"a law of {self.argument.meaning}",
            places=(self.place,),
            parameters=fixed + coefficients,
            mistaken_for=(),
            depends_on_time=self.argument.depends_on_time,
            **self.acting(self.at_knots),
        )

    def acting(self, at_knots: Callable[[Mapping[str, float]], tuple[NDArray, NDArray]]) -> dict[str, Any]:
        """Fields of a mechanism that acts as the law, with ``at_knots(values)``: its arguments and values at knots."""
        setting = self.setting

        def physics(settings: Settings, values: Mapping[str, float]) -> None:
            setattr(settings, str(setting), self.written(*at_knots(values), getattr(settings, str(setting))))

        def observation(sensing: Sensing, place: str, values: Mapping[str, float]) -> dict[str, NDArray]:
            channel = str(self.channel)
            return {channel: sensing.channels[channel] + self.added(sensing, *at_knots(values))}

        if setting is None:
            return {"modifies_observation": observation}
        return {"structures": {setting: _NEUTRAL.get(setting)}, "modifies_physics": physics}

    def curve(self, x: NDArray, y: NDArray, strength: Parameter) -> Curve:
        """What a law looks like that has `strength` times these values at these knots."""

        def of(arguments: NDArray, values: Mapping[str, float]) -> NDArray:
            return float(self.is_factor) + values[strength.name] * np.interp(arguments, x, self.shown(x) @ y)

        channels = (str(self.channel),) if self.slot == SENSOR_MAP else ()
        return Curve(self.slot, self.argument.name, of, (strength,), channels, self.is_drag)


_CURVE_IS = {
    SLIDING_FRICTION: "factor of the friction coefficient",
    CABLE_STRETCH: "factor of the cables' compliance",
    END_STRETCH: "compliance of the cables' fastening at the {side}, in m/N",
}
# Settings of the solver by slot and argument, or by slot for all other arguments; and those that are neutral at
# something else than None.
_SETTINGS = {
    (SLIDING_FRICTION, "direction"): "direction_bias",
    (SLIDING_FRICTION, "tension"): "friction_by_tension",
    (SLIDING_FRICTION, "position-along-conduit"): "friction_by_position",
    (SLIDING_FRICTION, "distance-since-reversal"): "contact_elements",
    (SLIDING_FRICTION, ""): "friction_laws",
    (CABLE_STRETCH, "tension"): "cable_compliance",
    (END_STRETCH, "tension"): "{side}_end_stretch",
    (LOAD, ""): "load_laws",
}
_NEUTRAL: dict[str, Any] = {"direction_bias": 0.0, "friction_laws": (), "load_laws": ()}

_TEXT = """A law that was learnt from recordings: {what}, by {argument}.

Equation: piecewise linear between knots, and constant beyond them.

Signature: the error is a function of {argument}.

Separated by: recordings in which {argument} changes while all else stays.

Source: Rasmussen and Williams, Gaussian Processes for Machine Learning, MIT Press, 2006, Section 4.2.
"""


@cache
def basis(knots: int, length: float, is_centred: bool, has_slope: bool = False) -> NDArray:
    """Root of the a priori covariance of a law's values at its knots, shape (knots, coefficients).

    `has_slope` adds a straight line from zero, as a drag by speed has. Their mean variance is 1. Directions whose
    standard deviation is below `SLIGHTEST` are left out.
    """
    x = np.linspace(0.0, 1.0, knots)
    covariance = np.exp(-0.5 * ((x[:, None] - x) / length) ** 2) + has_slope * SLOPE**2 * np.outer(x, x)
    centred = np.eye(knots) - (1.0 / knots if is_centred else 0.0)
    value, vector = np.linalg.eigh(centred @ covariance @ centred)
    value, vector = value[::-1].clip(0.0), vector[:, ::-1]
    root = (vector * np.sqrt(value))[:, value > SLIGHTEST**2 * value.sum()]
    # Eigenvectors have no sign of their own: that of their last entry is made positive.
    root = root * np.where(root[-1] < 0, -1.0, 1.0)
    return root / np.sqrt((root**2).sum() / knots)


def end_spring(settings: Settings, end: str) -> tuple[float, Table | None] | None:
    """Mean compliance of the cables' fastening at "drive" or "load", m/N, and its course over the mean, if any.

    None for a fastening that does not yield.
    """
    compliance, law = getattr(settings, f"{end}_end_compliance"), getattr(settings, f"{end}_end_stretch")
    if law is None:
        return (compliance, None) if compliance > 0 else None
    values = compliance + law.values
    mean = float(values.mean())
    return mean, Table(law.knots, (values / mean).clip(LEAST_COMPLIANCE))


@kernel
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


@kernel
def _slip(travel: NDArray, yields: NDArray) -> NDArray:
    """States of Maxwell-slip elements, -1 to 1, that yield after these travels, m; shape (elements, n)."""
    states = np.zeros((yields.size, travel.size))
    for k in range(yields.size):
        for i in range(1, travel.size):
            moved = (travel[i] - travel[i - 1]) / yields[k]
            states[k, i] = min(max(states[k, i - 1] + moved, -1.0), 1.0)
    return states


@kernel
def _contact_age(time_s: NDArray, theta: NDArray, renewal: float) -> NDArray:
    """Time since the drive was a renewal length away from where it is, s; before that, since the start; shape (n,)."""
    age = np.zeros(theta.size)
    for i in range(theta.size):
        k = i
        while k > 0 and abs(theta[i] - theta[k]) < renewal:
            k -= 1
        age[i] = time_s[i] - time_s[k]
    return age


def _velocity_of(angle: str) -> Callable[[Sensing], NDArray]:
    return lambda s: np.gradient(s.channels[angle], s.time_s) if s.time_s.size > 1 else np.zeros(1)


def _direction(s: Sensing) -> NDArray:
    return _motion_memory(s.channels[THETA_IN], REVERSAL_RAD)[0]


def _since_reversal_of(angle: str) -> Callable[[Sensing], NDArray]:
    radius = "drive_radius_m" if angle == THETA_IN else "load_radius_m"
    return lambda s: getattr(s, radius) * _motion_memory(s.channels[angle], REVERSAL_RAD)[1]


def _age(s: Sensing) -> NDArray:
    age = _contact_age(s.time_s, s.channels[THETA_IN], RENEWAL_M / s.drive_radius_m)
    return np.log10(np.maximum(age, SHORTEST_S))


def _reading(channel: str) -> Callable[[Sensing], NDArray]:
    return lambda s: s.channels[channel]


def _log_speed(s: Sensing) -> NDArray:
    return np.log10(np.maximum(s.drive_radius_m * np.abs(_velocity_of(THETA_IN)(s)), SLOWEST_M_PER_S))


def _tensions(s: Sensing) -> NDArray:
    return np.stack([s.channels[c] for c in TENSIONS if c in s.channels]).clip(0.0)


TENSION = Argument("tension", "N", "the cable's tension", _tensions)
POSITION = Argument(
    "position-along-conduit",
    "1",
    "the position along the conduit, from the drive, over its length",
    lambda s: np.repeat([[0.0], [1.0]], s.time_s.size, axis=1),
)
DIRECTION = Argument("direction", "1", "the direction in which the cable slides", _direction, True)
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
    lambda s: s.drive_radius_m * np.abs(_velocity_of(THETA_IN)(s)),
)


def _of_motion(angle: str, end: str) -> dict[str, Argument]:
    """Arguments of the motion of one pulley."""
    return {
        "angle": Argument(f"{end}-angle", "rad", f"the {end} pulley's angle", _reading(angle)),
        "speed": Argument("speed", "rad/s", f"the {end} pulley's velocity", _velocity_of(angle)),
        "since": Argument(
            "distance-since-reversal",
            "m",
            f"the distance of the {end}'s motion since its last reversal",
            _since_reversal_of(angle),
        ),
    }


def _laws() -> Iterator[Law]:
    drive, load = _of_motion(THETA_IN, "drive"), _of_motion(THETA_OUT, "load")
    for argument in (DIRECTION, LOG_SPEED, DWELL, TRAVEL, TIME, drive["angle"], TENSION, POSITION):
        yield Law(SLIDING_FRICTION, "conduit", argument)
    yield Law(SLIDING_FRICTION, "conduit", SLIDING, opposes=CONTACTS)
    yield Law(SLIDING_FRICTION, "conduit", SPEED, is_drag=True)
    yield Law(CABLE_STRETCH, "cable", TENSION)
    for end in ("drive-end", "load-end"):
        yield Law(END_STRETCH, end, TENSION, resolution=SMOOTH)
    for slot, place, channel, motion, angle in (
        (BEARING_TORQUE, "drive-pulley", TAU_IN, drive, THETA_IN),
        (LOAD, "load", TAU_OUT, load, THETA_OUT),
    ):
        yield Law(slot, place, motion["angle"], channel)
        yield Law(slot, place, motion["speed"], channel)
        yield Law(slot, place, motion["since"], channel, opposes=angle)
    for channel in (TAU_IN, TAU_OUT, F_DRIVE, F_LOAD, THETA_OUT):
        reading = Argument("reading", unit_of(channel), f"the reading of {symbol_of(channel)}", _reading(channel))
        place = next(p for p in PLACES_OF[channel] if p.endswith("-sensor"))
        # A map of tau_in by its angle is a torque of the drive pulley, and theta_out is an angle itself.
        of_pulley = {F_DRIVE: [drive["angle"]], F_LOAD: [load["angle"]], TAU_OUT: [load["angle"]]}.get(channel, [])
        for argument in (reading, TIME, *of_pulley):
            yield Law(SENSOR_MAP, place, argument, channel)


@cache
def laws() -> dict[str, Law]:
    """All laws by name, each at first coarse and then fine."""
    every = [one for law in _laws() for one in (law, law.finer()) if one is not None]
    return {law.name: law for law in every}
