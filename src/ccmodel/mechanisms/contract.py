"""The contract of a mechanism: all knowledge of one effect, in that effect's file.

1. A file of this package holds one mechanism as ``MECHANISM``, or close relatives as ``MECHANISMS``. The registry
   finds it by listing the folder.
2. Its docstring (a relative's: that of its function) is its ``text``: a title and the paragraphs of `PARAGRAPHS`. The
   command line, ``docs/mechanisms`` and the report are made from it and from the fields.
3. A mechanism modifies either the physics or the observation, or is the drift of a parameter of the model, or of
   another mechanism, from recording to recording (`ccmodel.model.session`). Before a run, its parameters are written
   into the solver's `Settings` as ``settings`` declares; a setting that is no number stands in ``structures`` and is
   written by ``modifies_physics``. After a run, ``modifies_observation`` changes what the sensors read.
4. A model without the mechanism and a model with it at its neutral values give the same numbers, bit for bit. Where
   the equation excludes its neutral value (a bristle length of zero), the tests of the registry state how close to the
   paper's model it comes near that value.
5. An equation that the march needs at every step stands in the mechanism's file as a compiled function
   (`ccmodel.kernel`), which `ccmodel.model.general.equations` imports.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import THETA_IN

PLACES = (
    "drive-pulley",
    "drive-end",
    "cable",
    "conduit",
    "load-end",
    "load-pulley",
    "load",
    "drive-sensor",
    "load-sensor",
)
# Slots: places in the equations at which a constitutive law can stand.
SLIDING_FRICTION, BEARING_TORQUE, LOAD, SENSOR_MAP = "sliding-friction", "bearing-torque", "load", "sensor-map"
CABLE_STRETCH, END_STRETCH, PULLEY_RADIUS = "cable-stretch", "end-stretch", "pulley-radius"
PARAGRAPHS = ("Equation", "Signature", "Separated by", "Source")
# A source that begins with this short form is written out.
PAPER_SHORT = "Agrawal, Peine and Yao 2010"
PAPER = (
    "Agrawal, Peine and Yao, Modeling of transmission characteristics across a cable-conduit system, IEEE Transactions "
    "on Robotics 26(5), 914-924, 2010, doi:10.1109/TRO.2010.2064014"
)
# Look-alikes that are no mechanisms: parameters and states of the paper's model.
PAPER_LOOK_ALIKES = ("K", "mu", "slack")


@dataclass(frozen=True)
class Parameter:
    """One parameter of a mechanism.

    Attributes
    ----------
    name : str
        Its name in diagnoses and model files.
    unit : str
        SI; "1" for a pure number.
    low, high : float
        Plausible range.
    start : float
        Where a fit begins.
    meaning : str
        What it measures, in a few words.
    neutral : float
        The value at which the mechanism has no effect.
    scale : {"log", "linear"}
        How a fit steps over the range.
    signed : bool
        Whether the range holds for the magnitude and both signs are possible.
    ratio : bool
        Whether it compares two parts that are alike at the neutral value. Each ratio is a strength of its own.
    screening_grid : tuple of float
        Shares of the range at which screening evaluates the mechanism; empty for the usual shares.
    continuation : bool
        Whether a fit reaches the least cost only by continuation: from a high value of this one, step by step down.
    default : float or None
        Value in a model that omits it; None if a model must give it.
    above, below : float
        Physical limits, both excluded.
    spread : float
        Of a state at the recording's start: its standard deviation from recording to recording about the value of the
        model. The range is then that of the state, both ends included. 0: the same in all recordings.
    fixed : bool
        Whether the conditions of the recordings set it, and no fit changes it.
    optional : bool
        Whether a rig with the mechanism may as well have it at its neutral value, which has half of the prior
        probability then.
    prior_sd : float
        Of a coefficient of an unknown law, or of a place: standard deviation of its normal prior, whose mean is
        `start`. 0: any value in the range is as probable.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float
    meaning: str
    neutral: float = 0.0
    scale: str = "log"
    signed: bool = False
    ratio: bool = False
    screening_grid: tuple[float, ...] = ()
    continuation: bool = False
    default: float | None = None
    above: float = -inf
    below: float = inf
    spread: float = 0.0
    fixed: bool = False
    optional: bool = False
    prior_sd: float = 0.0

    def at(self, share: float) -> float:
        """Value at a share of the range, on the parameter's scale."""
        if self.scale == "log":
            return float(self.low * (self.high / self.low) ** share)
        return float(self.low + share * (self.high - self.low))


def optional_share(name: str, meaning: str) -> Parameter:
    """A share, 0 to 1, that a rig with the mechanism may as well have as zero; screening takes none and all of it."""
    return Parameter(
        name, "1", 0.0, 1.0, 0.0, meaning, scale="linear", screening_grid=(0.0, 1.0), default=0.0, optional=True
    )


@dataclass(frozen=True)
class Curve:
    """A mechanism as a law of one quantity at one slot, to which a learned law is compared.

    Attributes
    ----------
    slot : str
    argument : str
        As in the diagnosis format; in the unit that `ccmodel.mechanisms.learned` has.
    of : callable
        ``of(x, values)``: the law at arguments of shape (n,), as the form of its slot states it
        (`ccmodel.mechanisms.law_forms`). Of a centred form, up to what a calibration absorbs: a factor of a factor, a
        constant of what is added.
    constants : tuple of Parameter
        Constants that are fitted to the learned law.
    channels : tuple of str
        Channels whose map it can be; empty for all.
    form : str
        What the law is where its slot has several forms, as a name of `ccmodel.mechanisms.law_forms`: "drag" for one
        per length of conduit, N/m; "bend" for one that is added, rad; "delay" for that of an end's channels, s; empty
        for the usual form.
    """

    slot: str
    argument: str
    of: Callable[[NDArray, Mapping[str, float]], NDArray]
    constants: tuple[Parameter, ...]
    channels: tuple[str, ...] = ()
    form: str = ""


class Settings:
    """What the general solver takes beyond the paper's model: an attribute for each setting that a mechanism declares.

    Parameters
    ----------
    neutral : mapping of str to object
        Settings at their neutral values, which together are the paper's model.
    """

    def __init__(self, neutral: Mapping[str, Any]):
        self.__dict__.update(neutral)

    def __getattr__(self, name: str) -> Any:
        raise self._unknown(name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self.__dict__:
            raise self._unknown(name)
        self.__dict__[name] = value

    def _unknown(self, name: str) -> AttributeError:
        return AttributeError(f"no mechanism declares the setting {name!r}; there are {', '.join(self.__dict__)}")


@dataclass(frozen=True)
class Sensing:
    """What the sensors are about to read.

    Attributes
    ----------
    time_s : ndarray, shape (n,)
    channels : mapping of str to ndarray, each of shape (n,)
        theta_in_rad, theta_out_rad, tau_in_Nm, tau_out_Nm, F_drive_N, F_load_N.
    load_radius_m, drive_radius_m : float
    true : mapping of str to ndarray, each of shape (n,)
        The same channels without the fault of any sensor.
    """

    time_s: NDArray
    channels: Mapping[str, NDArray]
    drive_radius_m: float
    load_radius_m: float
    true: Mapping[str, NDArray] = field(default_factory=dict)

    @property
    def drive_travel_m(self) -> NDArray:
        """Travel of the cable at the drive since the start, shape (n,)."""
        theta = self.channels[THETA_IN]
        return self.drive_radius_m * np.abs(np.diff(theta, prepend=theta[0])).cumsum()


@dataclass(frozen=True, kw_only=True)
class Mechanism:
    """An effect that the paper's model leaves out.

    Attributes
    ----------
    name : str
    text : str
        A title, which is its summary, and paragraphs that begin with the names of `PARAGRAPHS`: its law in the
        parameters' symbols; what it does to a recording; the experiment that separates it from its look-alikes; author,
        title, journal, year and DOI of the equation or of where the effect is named.
    tex : str
        The law in TeX, with the parameters' names or their symbols.
    sentence : str
        What a report says where it is identified: ``{name}`` is the value of a parameter with its unit, ``{name:%}`` in
        per cent, ``{side}`` the end of the place; of ``[high|low]`` the first is for a positive strength, and
        ``[name: clause]``, or ``[name:, clause]``, is said where the interval of that parameter excludes its neutral
        value.
    places : tuple of str
        Where it can act, of `PLACES`.
    parameters : tuple of Parameter
    mistaken_for : tuple of str
        Look-alikes: other mechanisms, or `PAPER_LOOK_ALIKES`.
    depends_on_time : bool
        Whether its effect depends on the rate of the motion, not only on its path.
    looks_ahead : bool
        Whether a reading depends on later samples, so that no causal estimate can undo it.
    needs : tuple of str
        Channels without which it has no effect: a diagnosis considers it where they were recorded.
    settings : mapping of str to str
        The solver's settings that take a parameter's value, and the parameter's name; "{side}" in a setting stands for
        the side of the place. They reach the march.
    structures : mapping of str to object
        The solver's settings that are no numbers, at their neutral values.
    modifies_physics : callable or None
        ``modifies_physics(settings, values)`` writes the structures.
    modifies_input : callable or None
        ``modifies_input(time_s, theta_in, place, values)`` returns the drive's angle as it was, from that which was
        read, where a mechanism that modifies the observation makes them differ.
    modifies_observation : callable or None
        ``modifies_observation(sensing, place, values)`` returns the channels that change.
    drift : str or None
        What its ``change`` drifts through a session: a parameter of the model, by that share, or the only parameter of
        another mechanism at the same place, by that amount.
    states_after_tensioning : callable or None
        ``states_after_tensioning(seconds, values)``: its states, by name, at a time after the cables were tensioned.
    curves : tuple of Curve
        What a learned law looks like that stands for it; at each slot and argument at which one can.
    """

    name: str
    text: str
    tex: str
    sentence: str
    places: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    mistaken_for: tuple[str, ...]
    depends_on_time: bool
    looks_ahead: bool = False
    needs: tuple[str, ...] = ()
    settings: Mapping[str, str] = field(default_factory=dict)
    structures: Mapping[str, Any] = field(default_factory=dict)
    modifies_physics: Callable[[Settings, Mapping[str, float]], None] | None = None
    modifies_input: Callable[[NDArray, NDArray, str, Mapping[str, float]], NDArray] | None = None
    modifies_observation: Callable[[Sensing, str, Mapping[str, float]], dict[str, NDArray]] | None = None
    drift: str | None = None
    states_after_tensioning: Callable[[float, Mapping[str, float]], dict[str, float]] | None = None
    curves: tuple[Curve, ...] = ()

    def __post_init__(self) -> None:
        unknown = set(self.places) - set(PLACES)
        if unknown or not self.places:
            raise ValueError(f"{self.name}: places are {', '.join(PLACES)}; got {', '.join(self.places) or 'none'}")
        kinds = self.modifies_settings, self.modifies_observation is not None, self.drift is not None
        if sum(kinds) != 1:
            raise ValueError(f"{self.name}: a mechanism modifies the physics or the observation, or is a drift")
        if missing := set(PARAGRAPHS) - self.paragraphs.keys():
            raise ValueError(f"{self.name}: its text has no paragraph {', '.join(sorted(missing))}")

    @property
    def paragraphs(self) -> dict[str, str]:
        """The text's paragraphs by name, each on one line and without a last full stop; the paper's title in full."""
        lines = (" ".join(paragraph.split()).replace(PAPER_SHORT, PAPER) for paragraph in self.text.split("\n\n")[1:])
        return {name: text.removesuffix(".") for name, _, text in (line.partition(": ") for line in lines)}

    @property
    def summary(self) -> str:
        """One line for tables and pages, as it stands in a sentence."""
        title = self.text.split("\n\n")[0].strip().removesuffix(".")
        return title[0].lower() + title[1:]

    @property
    def separated_by(self) -> str:
        """The experiment that separates it from its look-alikes, as it stands in a sentence."""
        return self.paragraphs["Separated by"]

    @property
    def strengths(self) -> tuple[Parameter, ...]:
        """Parameters that measure its size: its ratios, each by itself, or else its first one; of a law none."""
        return tuple(p for p in self.parameters if p.ratio) or tuple(p for p in self.parameters[:1] if not p.fixed)

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        """The other parameters."""
        return tuple(p for p in self.parameters if p not in self.strengths)

    def parameter(self, name: str) -> Parameter:
        """Its parameter of that name."""
        return next(p for p in self.parameters if p.name == name)

    @property
    def states(self) -> tuple[Parameter, ...]:
        """Parameters that are states at a recording's start, which differ from recording to recording."""
        return tuple(p for p in self.parameters if p.spread)

    @property
    def modifies_settings(self) -> bool:
        """Whether it modifies the physics: it writes settings of the solver."""
        return bool(self.settings or self.structures)

    @property
    def neutral(self) -> dict[str, float]:
        """Parameter values at which it has no effect."""
        return {p.name: p.neutral for p in self.parameters}

    @property
    def neutral_settings(self) -> dict[str, Any]:
        """The solver's settings that it writes, at their neutral values."""
        by_side = (self._values_of_settings(place, self.neutral) for place in self.places)
        return dict(self.structures) | {name: value for values in by_side for name, value in values.items()}

    def write(self, settings: Settings, place: str, values: Mapping[str, float]) -> None:
        """Write the parameters' values into the solver's settings."""
        for name, value in self._values_of_settings(place, values).items():
            setattr(settings, name, value)
        if self.modifies_physics is not None:
            self.modifies_physics(settings, values)

    def _values_of_settings(self, place: str, values: Mapping[str, float]) -> dict[str, float]:
        """Values of the solver's settings that are numbers, by name."""
        return {name.format(side=side(place)): values[parameter] for name, parameter in self.settings.items()}

    @property
    def default(self) -> dict[str, float]:
        """Values of the parameters that a model may omit."""
        return {p.name: p.default for p in self.parameters if p.default is not None}

    @property
    def start(self) -> dict[str, float]:
        """Parameter values from which a fit begins."""
        return {p.name: p.start for p in self.parameters}


def side(place: str) -> str:
    """'drive' or 'load', the end of the transmission that a place belongs to."""
    return place.split("-")[0]
