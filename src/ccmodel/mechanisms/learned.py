"""Laws that no list holds: an unknown function of one quantity at one slot of the transmission.

A slot is a place in the equations where a constitutive law can stand: a factor of the sliding friction, a torque at the
drive pulley's bearing, the map of a sensor. Its law is a piecewise linear function of one argument, between knots over
what the recordings visit, and constant beyond them:

    y(x) = scale sum_k B_jk z_k at knot j,    z_k ~ N(0, 1)

A mass is a proportion instead, with one coefficient and without an end. B is the root of a squared exponential
covariance, so that z = 0 is no effect, and a smooth law is more probable than a rugged one. It has no mean where what a
law adds on average belongs to the parameters of the calibration.

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
    PULLEY_RADIUS,
    SENSOR_MAP,
    SLIDING_FRICTION,
    Curve,
    Mechanism,
    Parameter,
    Sensing,
    Settings,
    side,
)
from ccmodel.mechanisms.delayed import late
from ccmodel.mechanisms.law_arguments import (
    CABLE,
    DIRECTION,
    DWELL,
    LOG_SPEED,
    POSITION,
    SLIDING,
    SPEED,
    TENSION,
    TIME,
    TRAVEL,
    Argument,
    of_motion,
    rate_of,
    reading_of,
    torque_at,
)
from ccmodel.mechanisms.law_forms import (
    ADDED,
    ADDED_BEND,
    ADDED_TO_INPUT,
    ADDED_TO_SUM,
    AGAINST_MOTION,
    CONSTANT_DRAG,
    CONTACT_ELEMENTS,
    DELAY,
    DRAG,
    ELEMENTS_IN_BEARING,
    END_COMPLIANCE,
    FRICTION_FACTOR,
    IN_BEARING,
    IN_PROPORTION,
    LEAST_COMPLIANCE,
    RADIUS_FACTOR,
    RISING,
    STRETCH_FACTOR,
    Form,
    basis,
)
from ccmodel.mechanisms.tables import Table, slip

# Knots of a law, and the length over which its values are correlated a priori, as a share of its range: at first, and
# where the recordings show more. The fastening of a cable is smooth at first: with more coefficients its law would be
# less probable than friction that vanishes next to it, which yields alike.
COARSE, FINE, SMOOTH = (9, 0.25), (25, 0.08), (9, 1.0)
# The range of a law's argument, as quantiles of what the recordings visit.
RANGE = (0.005, 0.995)
# The lowest knot of a law of the tension over the highest one, at least: slack cables have no tension.
LOWEST_TENSION = 0.02
# Distance of two knots that are one, as a share of all that they span.
SAME_KNOT = 1e-9
# Fastenings that yield less are rigid, m/N: a thousandth of the stretch of the stiffest cable. The tension of a stiffer
# piece would be made of rounding errors, and a step would take a hundred times as long.
RIGID_M_PER_N = 1e-10
# Friction is never negative in either direction or cable, and neither is a compliance.
LARGEST_BIAS = 0.95


@dataclass(frozen=True)
class Law:
    """A slot and the argument of its law.

    Attributes
    ----------
    slot, place : str
    argument : Argument
    form : Form
    channel : str or None
        The channel that a torque or a reading is added to; None of a factor, a drag, a compliance, a delay, or a torque
        that no sensor reads.
    resolution : (int, float)
        Number of knots, and correlation length.
    """

    slot: str
    place: str
    argument: Argument
    form: Form
    channel: str | None = None
    resolution: tuple[int, float] = COARSE

    @property
    def name(self) -> str:
        """Its name as a mechanism."""
        of = ""
        if self.slot == SENSOR_MAP and self.channel is not None:
            of = f"-{short_name(self.channel)}".replace("_", "-")
        if self.slot in (END_STRETCH, PULLEY_RADIUS) or self.form is DELAY or self.place == "load-pulley":
            of = f"-{side(self.place)}"
        if self.form.name:
            of += f"-{self.form.name}"
        fine = "" if self.is_first else "-fine"
        return f"learned-{self.slot}{of}-by-{self.argument.name}{fine}"

    @property
    def unit(self) -> str:
        """Unit of its values."""
        return self.form.unit or unit_of(str(self.channel))

    @property
    def is_spaced_by_ratio(self) -> bool:
        """Whether its knots have equal ratios: travels to yield, and tensions, of which powers are expected."""
        return self.form.has_elements or self.argument.name == "tension"

    @property
    def curve_is(self) -> str:
        """What its values are."""
        symbol = symbol_of(self.channel) if self.channel else ""
        return self.form.meaning.format(symbol=symbol, unit=self.unit, side=side(self.place))

    @property
    def looks_ahead(self) -> bool:
        """Whether its values depend on later samples: a rate is taken between the samples before and after."""
        is_in_equations = self.setting not in (None, "friction_laws")
        return self.form is DELAY or (self.argument.name in ("rate", "speed") and not is_in_equations)

    @property
    def setting(self) -> str | None:
        """The solver's setting that takes the law, if it is one of the solver.

        A number or a table stands in the solver's equations. A factor of friction by the drive's motion, which is known
        beforehand, is a function of this motion; its setting holds several.
        """
        if self.form in _SETTING_OF:
            return _SETTING_OF[self.form]
        of = (self.argument.name, "")
        found = next((_SETTINGS[self.slot, one] for one in of if (self.slot, one) in _SETTINGS), None)
        return found and found.format(side=side(self.place))

    def written(self, x: NDArray, y: NDArray, before: Any) -> Any:
        """The value of its setting that had the value `before`, for values at knots; both of shape (knots,)."""
        if self.argument.has_two_values:
            return float(np.clip(before + y[-1], -LARGEST_BIAS, LARGEST_BIAS))
        if self.form.in_proportion:
            return (*before, float(max(y[-1] / x[-1], 0.0)))
        if self.setting == "friction_laws":
            return (*before, lambda sensing: self.added(sensing, x, y))
        if not y.any():
            return before
        if self.form.has_elements:
            if before is not None and self.form is CONTACT_ELEMENTS:
                raise ValueError("friction builds up by two laws of the sliding distance: keep one of them")
            table = Table(x, self.form.possible(y))
            return table if before is None else before.with_elements(table)
        knots = x if before is None else _united(x, before.knots)
        neutral = self.form.neutral if before is None else before.at(knots)
        values = self.form.possible(neutral + np.interp(knots, x, y))
        return Table(knots, values) if values.any() else None

    @property
    def has_one_coefficient(self) -> bool:
        """Whether one number is all that it has: the difference of two values, or a factor of its argument."""
        return self.argument.has_two_values or self.form.in_proportion

    @property
    def basis(self) -> NDArray:
        """Derivatives of its values at the knots by its coefficients, shape (knots, coefficients)."""
        knots, length = (2, 1.0) if self.has_one_coefficient else self.resolution
        return basis(knots, length, self.form.is_centred, self.form.has_slope)

    def at_knots(self, values: Mapping[str, float]) -> tuple[NDArray, NDArray]:
        """Its arguments at the knots and its values there, both of shape (knots,)."""
        z = [values[name] for name in self.coefficients]
        space = np.geomspace if self.is_spaced_by_ratio else np.linspace
        return space(values["first"], values["last"], len(self.basis)), values["scale"] * (self.basis @ z)

    def range_of(self, visited: NDArray) -> tuple[float, float]:
        """First and last knot for the arguments that recordings visit."""
        # What rises with its argument is largest in the few samples of its highest values.
        first, last = np.quantile(visited, (0.0, 1.0) if self.form.has_slope else RANGE)
        if self.form.shortest_yield is not None:
            first = last * self.form.shortest_yield
        elif self.is_spaced_by_ratio:
            first = max(first, last * LOWEST_TENSION)
        elif self.form.in_proportion:
            last = max(abs(first), abs(last))
            first = -last
        return float(first), float(last)

    def shown(self, x: NDArray, at: NDArray | None = None) -> NDArray:
        """What its curve shows of its values at the knots `x`, at the knots or at others, shape (arguments, knots).

        Of a torque with memory it is half of its rise since a reversal, which recordings show more often than a start
        from rest, and of the contacts what they lack of sliding friction after a reversal from sliding; otherwise these
        values.
        """
        if not self.form.has_elements:
            return np.eye(len(x))
        yields = x if self.form is CONTACT_ELEMENTS else 2.0 * x
        built_up = np.minimum((x if at is None else at)[:, None] / yields, 1.0)
        return -2.0 * (1.0 - built_up) if self.form is CONTACT_ELEMENTS else built_up

    def determined_at(self, x: NDArray) -> NDArray:
        """Arguments at which its curve determines its values at the knots, shape (knots,)."""
        # The first element has yielded at its knot, and nothing yields beyond the last one.
        if self.form is CONTACT_ELEMENTS:
            return np.concatenate([[x[0] / 2], x[:-1]])
        # After a reversal an element takes twice the travel that it takes from rest.
        return 2.0 * x if self.form.has_elements else x

    def behind(self, x: NDArray, curve: NDArray) -> NDArray:
        """Its values at the knots, from its curve at `determined_at`; both of shape (knots,)."""
        return np.linalg.solve(self.shown(x, self.determined_at(x)), curve - self.form.neutral)

    @property
    def coefficients(self) -> list[str]:
        """Names of its coefficients."""
        return [f"z{k + 1}" for k in range(self.basis.shape[1])]

    def added(self, sensing: Sensing, x: NDArray, y: NDArray) -> NDArray:
        """What it adds along a run, to 1 if it is a factor, for values at knots; shape (n,)."""
        if self.form.has_elements:  # of the drive pulley's bearing; the march has those of the contacts and the load
            return self.form.possible(y) @ _slip(sensing.drive_radius_m * sensing.channels[THETA_IN], x)
        return np.interp(self.argument.of(sensing), x, y)

    def is_of_slot(self, other: "Law") -> bool:
        """Whether another law stands in the same slot."""
        is_same_sensor = self.slot != SENSOR_MAP or self.channel == other.channel
        return (self.slot, self.place) == (other.slot, other.place) and is_same_sensor

    def has_the_form_of(self, curve: Curve) -> bool:
        """Whether the law that a listed mechanism has at a slot is one of this slot, argument and form."""
        is_same = (curve.slot, curve.argument, curve.form) == (self.slot, self.argument.name, self.form.name)
        return is_same and (not curve.channels or self.channel in curve.channels)

    def has_the_quantity_of(self, other: "Law") -> bool:
        """Whether it is the other law, with as many knots or not."""
        return replace(self, resolution=other.resolution) == other

    def finer(self) -> "Law | None":
        """The same law with more coefficients, if there is one."""
        is_finest = self.has_one_coefficient or self.form.has_elements or not self.is_first
        return None if is_finest else replace(self, resolution=COARSE if self.slot == END_STRETCH else FINE)

    @property
    def is_first(self) -> bool:
        """Whether it is tried before the same law with more coefficients."""
        return self.resolution == (SMOOTH if self.slot == END_STRETCH else COARSE)

    @cached_property
    def mechanism(self) -> Mechanism:
        """The law as a mechanism."""
        unit, lowest = self.argument.unit, 0.0 if self.form.in_proportion else -4.0
        fixed = (
            Parameter("first", unit, -inf, inf, 0.0, "argument at the first knot", fixed=True),
            Parameter("last", unit, -inf, inf, 1.0, "argument at the last knot", fixed=True),
            Parameter("scale", self.unit, 0.0, inf, 1.0, "standard deviation of its values a priori", fixed=True),
        )
        coefficients = tuple(
            Parameter(name, "1", lowest, 4.0, 0.0, "coefficient of the law", scale="linear", prior_sd=1.0)
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
            looks_ahead=self.looks_ahead,
            **self.acting(self.at_knots),
        )

    def acting(self, at_knots: Callable[[Mapping[str, float]], tuple[NDArray, NDArray]]) -> dict[str, Any]:
        """Fields of a mechanism that acts as the law, with ``at_knots(values)``: its arguments and values at knots."""
        setting = self.setting

        def physics(settings: Settings, values: Mapping[str, float]) -> None:
            setattr(settings, str(setting), self.written(*at_knots(values), getattr(settings, str(setting))))

        def observation(sensing: Sensing, place: str, values: Mapping[str, float]) -> dict[str, NDArray]:
            added = self.added(sensing, *at_knots(values))
            if self.channel is None:
                return late(sensing, place, self.form.possible(added))
            return {self.channel: sensing.channels[self.channel] + added}

        if setting is None:
            return {"modifies_observation": observation}
        return {"structures": {setting: _NEUTRAL.get(setting)}, "modifies_physics": physics}

    def curve(self, x: NDArray, y: NDArray, strength: Parameter) -> Curve:
        """What a law looks like that has `strength` times these values at these knots."""

        def of(arguments: NDArray, values: Mapping[str, float]) -> NDArray:
            if self.form.has_elements:
                shown = self.shown(x, arguments) @ self.form.acting(y)
            else:
                shown = np.interp(arguments, x, y)
            return self.form.neutral + values[strength.name] * shown

        channels = (self.channel,) if self.slot == SENSOR_MAP and self.channel else ()
        return Curve(self.slot, self.argument.name, of, (strength,), channels, self.form.name)


# Settings of the solver by form, where that is not the usual one of its slot.
_SETTING_OF = {
    DRAG: "conduit_drag",
    CONSTANT_DRAG: "added_drag",
    ADDED_BEND: "added_bend",
    IN_BEARING: "bearing_by_speed",
    ELEMENTS_IN_BEARING: "bearing_elements",
    ADDED_TO_INPUT: "drive_angle_error",
}
# Settings of the solver by slot and argument, or by slot for laws of the drive's motion; and those whose neutral value
# is not None.
_SETTINGS = {
    (SLIDING_FRICTION, "direction"): "direction_bias",
    (SLIDING_FRICTION, "cable"): "friction_by_cable",
    (SLIDING_FRICTION, "tension"): "friction_by_tension",
    (SLIDING_FRICTION, "position-along-conduit"): "friction_by_position",
    (SLIDING_FRICTION, "distance-since-reversal"): "contact_elements",
    (SLIDING_FRICTION, ""): "friction_laws",
    (CABLE_STRETCH, "tension"): "cable_compliance",
    (CABLE_STRETCH, "cable"): "compliance_by_cable",
    (END_STRETCH, "tension"): "{side}_end_stretch",
    (PULLEY_RADIUS, "drive-angle"): "drive_radius_factor",
    (PULLEY_RADIUS, "load-angle"): "load_radius_factor",
    (LOAD, "acceleration"): "load_masses",
    (LOAD, "load-angle"): "load_by_angle",
    (LOAD, "speed"): "load_by_speed",
    (LOAD, "distance-since-reversal"): "load_elements",
}
_NEUTRAL: dict[str, Any] = {
    "direction_bias": 0.0,
    "friction_by_cable": 0.0,
    "compliance_by_cable": 0.0,
    "load_masses": (),
    "friction_laws": (),
}

_TEXT = """A law that was learnt from recordings: {what}, by {argument}.

Equation: piecewise linear between knots, and constant beyond them.

Signature: the error is a function of {argument}.

Separated by: recordings in which {argument} changes while all else stays.

Source: Rasmussen and Williams, Gaussian Processes for Machine Learning, MIT Press, 2006, Section 4.2.
"""


def end_spring(settings: Settings, end: str) -> tuple[float, Table | None] | None:
    """Mean compliance of the cables' fastening at "drive" or "load", m/N, and its course over the mean, if any.

    None for a fastening that does not yield, or by less than `RIGID_M_PER_N`.
    """
    compliance, law = getattr(settings, f"{end}_end_compliance"), getattr(settings, f"{end}_end_stretch")
    if law is None:
        return (compliance, None) if compliance >= RIGID_M_PER_N else None
    values = compliance + law.values
    mean = float(values.mean())
    return (mean, Table(law.knots, (values / mean).clip(LEAST_COMPLIANCE))) if mean >= RIGID_M_PER_N else None


def _united(x: NDArray, others: NDArray) -> NDArray:
    """The knots of two laws, each once; those that differ by rounding errors are one."""
    knots = np.union1d(x, others)
    return knots[np.append(True, np.diff(knots) > SAME_KNOT * np.ptp(knots))]


@kernel(allocates=True)
def _slip(travel: NDArray, yields: NDArray) -> NDArray:
    """States of Maxwell-slip elements, -1 to 1, that yield after these travels, m; shape (elements, n)."""
    states = np.zeros((yields.size, travel.size))
    for k in range(yields.size):
        for i in range(1, travel.size):
            states[k, i] = slip(states[k, i - 1], travel[i] - travel[i - 1], yields[k])
    return states


def _reading(channel: str) -> Argument:
    return Argument("reading", unit_of(channel), f"the reading of {symbol_of(channel)}", reading_of(channel))


def _laws() -> Iterator[Law]:
    drive, load = of_motion(THETA_IN, "drive"), of_motion(THETA_OUT, "load")
    for argument in (DIRECTION, CABLE, LOG_SPEED, DWELL, TRAVEL, TIME, drive["angle"], TENSION, POSITION):
        yield Law(SLIDING_FRICTION, "conduit", argument, FRICTION_FACTOR)
    yield Law(SLIDING_FRICTION, "conduit", SLIDING, CONTACT_ELEMENTS)
    yield Law(SLIDING_FRICTION, "conduit", SPEED, DRAG)
    for form in (CONSTANT_DRAG, ADDED_BEND):
        yield Law(SLIDING_FRICTION, "conduit", POSITION, form)
    for argument in (TENSION, CABLE):
        yield Law(CABLE_STRETCH, "cable", argument, STRETCH_FACTOR)
    for end in ("drive-end", "load-end"):
        yield Law(END_STRETCH, end, TENSION, END_COMPLIANCE, resolution=SMOOTH)
    yield Law(PULLEY_RADIUS, "drive-pulley", drive["angle"], RADIUS_FACTOR)
    yield Law(PULLEY_RADIUS, "load-pulley", load["angle"], RADIUS_FACTOR)
    for slot, place, channel, motion in (
        (BEARING_TORQUE, "drive-pulley", TAU_IN, drive),
        (LOAD, "load", TAU_OUT, load),
    ):
        yield Law(slot, place, motion["angle"], ADDED, channel)
        yield Law(slot, place, motion["speed"], RISING if slot == LOAD else ADDED, channel)
        yield Law(slot, place, motion["since"], AGAINST_MOTION, channel)
    yield Law(LOAD, "load", load["acceleration"], IN_PROPORTION, TAU_OUT)
    yield Law(BEARING_TORQUE, "load-pulley", load["speed"], IN_BEARING)
    yield Law(BEARING_TORQUE, "load-pulley", load["since"], ELEMENTS_IN_BEARING)
    yield Law(SENSOR_MAP, "drive-sensor", _reading(THETA_IN), ADDED_TO_INPUT, THETA_IN)
    for channel in (TAU_IN, TAU_OUT, F_DRIVE, F_LOAD, THETA_OUT):
        place = next(p for p in PLACES_OF[channel] if p.endswith("-sensor"))
        # A map of tau_in by its angle is a torque of the drive pulley, and theta_out is an angle itself.
        others = {
            F_DRIVE: [drive["angle"], torque_at("drive")],
            F_LOAD: [load["angle"], torque_at("load")],
            TAU_OUT: [load["angle"]],
        }
        form = ADDED_TO_SUM if channel in (F_DRIVE, F_LOAD) else ADDED
        for argument in (_reading(channel), TIME, rate_of(channel), *others.get(channel, [])):
            yield Law(SENSOR_MAP, place, argument, form, channel)
    for place in ("drive-sensor", "load-sensor"):
        yield Law(SENSOR_MAP, place, TIME, DELAY)


@cache
def laws() -> dict[str, Law]:
    """All laws by name, each at first coarse and then fine."""
    every = [one for law in _laws() for one in (law, law.finer()) if one is not None]
    return {law.name: law for law in every}
