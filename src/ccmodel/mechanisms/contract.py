"""What a mechanism is: where it acts, the numbers it has, and how these enter the general solver.

1. One file of this package holds one mechanism as ``MECHANISM`` (or a few close relatives as ``MECHANISMS``); the
   package finds it by itself.
2. Its docstring says the equation, what it looks like in a recording, what it is mistaken for and which experiment
   tells the two apart.
3. It acts in one of two ways. ``modifies_physics`` writes its values into `Settings` before a run.
   ``modifies_observation`` changes what the sensors show after a run. Neither touches what its values do not name.
4. A mechanism that is not in a model leaves the numbers bit for bit as they are. One whose parameters are at their
   neutral values gives the paper's model, or tends to it as a parameter with an open neutral value (a bristle
   length of zero, a speed of zero) gets there.
5. An equation that the march over the samples needs at every step stands in the mechanism's file as a compiled
   function that the solver imports (`ccmodel.kernel`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import SUM_AT, TORQUE_AT

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


PRESLIDING_RAD = 2e-3  # Over which a bearing's friction builds up where nothing says otherwise.


@dataclass(frozen=True)
class Parameter:
    """One number of a mechanism.

    Attributes
    ----------
    name : str
        As it stands in diagnoses and model files.
    unit : str
        SI; "1" for a pure number.
    low, high : float
        The range in which it is plausible.
    start : float
        Where a fit begins.
    neutral : float
        The value at which the mechanism is not there.
    scale : {"log", "linear"}
        How a fit should step over the range.
    signed : bool
        Whether the range holds for the size of the number and either sign is possible.
    ratio : bool
        Whether it compares two parts that are neutrally alike: a strength of its own, whichever of them is the larger.
    screening_grid : tuple of float
        Shares of the range at which a mechanism is tried out before it is fitted, where the usual ones will not do.
    continuation : bool
        Whether the least a mechanism leaves is found only from high values of this one, step by step down.
    default : float or None
        Its value in a model that does not say one; None where one must be said.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float
    neutral: float = 0.0
    scale: str = "log"
    signed: bool = False
    ratio: bool = False
    screening_grid: tuple[float, ...] = ()
    continuation: bool = False
    default: float | None = None

    def at(self, share: float) -> float:
        """A value within the range, in the measure in which a fit should step over it."""
        if self.scale == "log":
            return float(self.low * (self.high / self.low) ** share)
        return float(self.low + share * (self.high - self.low))


class Kink(NamedTuple):
    """A sharp bend: its share of the length, its angle (rad), and what share of its friction holds tension at rest."""

    share: float
    bend_rad: float
    hold: float = 1.0


@dataclass
class Settings:
    """Everything that the general solver can be told beyond the paper's model; as made, it is the paper's model.

    The fields are the solver's named places. Lengths in m, forces in N, angles in rad, times in s.

    Attributes
    ----------
    kinks : list of Kink
        Conduit.
    bristle_m : float
        Conduit: presliding length z0 of Dahl's bristle; 0 is Coulomb friction.
    stribeck_rise, stribeck_speed, stribeck_fall : float
        Conduit: share by which friction at rest exceeds that in fast sliding, the speed (m/s) of its fall, and the
        power of speed that it falls with.
    viscous : float
        Conduit: drag per speed and length, N s/m per m.
    tension_exponent : float
        Conduit: n of mu (T / T_ref)^n.
    drag_N : float
        Conduit: friction of a whole cable that does not depend on tension.
    friction_course : callable or None
        Conduit: factor of mu at given times (s) and ways that the drive has wound (m), all of shape (samples,).
    friction_ratio_B, stiffness_ratio_B : float
        Cable: mu and EA of cable B over those of cable A.
    relaxing_share, relaxing_time_s : float
        Cable: standard linear solid.
    settling_N : float
        Cable: tension scale below which strands settle.
    drive_end_compliance, load_end_compliance, conduit_compliance : float
        Ends and conduit: m/N.
    drive_friction_Nm, load_friction_Nm : float
        Pulleys: friction torques.
    drive_presliding_rad, load_presliding_rad : float
        Pulleys: angles over which these build up.
    drive_eccentricity, load_eccentricity : (float, float)
        Pulleys: e and psi (rad) of R (1 + e sin(theta + psi)).
    half_gap : float
        Load pulley: half the dead zone between pulley and load, rad.
    cubic_stiffness, inertia, ring_damping : float
        Load: K_3 (N m/rad^3), J (kg m^2) and the damping of J on the load's spring as a share of the critical one, on
        top of what the load has by itself.
    """

    kinks: list[Kink] = field(default_factory=list)
    bristle_m: float = 0.0
    stribeck_rise: float = 0.0
    stribeck_speed: float = 1e-3
    stribeck_fall: float = 2.0
    viscous: float = 0.0
    tension_exponent: float = 0.0
    drag_N: float = 0.0
    friction_course: Callable[[NDArray, NDArray], NDArray] | None = None
    friction_ratio_B: float = 1.0
    stiffness_ratio_B: float = 1.0
    relaxing_share: float = 0.0
    relaxing_time_s: float = 30.0
    settling_N: float = 0.0
    drive_end_compliance: float = 0.0
    load_end_compliance: float = 0.0
    conduit_compliance: float = 0.0
    drive_friction_Nm: float = 0.0
    load_friction_Nm: float = 0.0
    drive_presliding_rad: float = PRESLIDING_RAD
    load_presliding_rad: float = PRESLIDING_RAD
    drive_eccentricity: tuple[float, float] = (0.0, 0.0)
    load_eccentricity: tuple[float, float] = (0.0, 0.0)
    half_gap: float = 0.0
    cubic_stiffness: float = 0.0
    inertia: float = 0.0
    ring_damping: float = 0.0

    def damping(self, stiffness: float) -> float:
        """N m s/rad of a load with a spring of so many N m/rad."""
        return 2 * self.ring_damping * sqrt(self.inertia * stiffness)


@dataclass(frozen=True)
class Sensing:
    """What the sensors are about to show, for a mechanism to change.

    Attributes
    ----------
    time_s : ndarray, shape (n,)
    channels : mapping of str to ndarray, each of shape (n,)
        theta_in_rad, theta_out_rad, tau_in_Nm, tau_out_Nm, F_drive_N, F_load_N.
    load_radius_m, drive_radius_m : float
    """

    time_s: NDArray
    channels: Mapping[str, NDArray]
    drive_radius_m: float
    load_radius_m: float


@dataclass(frozen=True)
class Mechanism:
    """An effect that the paper's model leaves out.

    Attributes
    ----------
    name : str
    places : tuple of str
        Where it can act, of `PLACES`.
    parameters : tuple of Parameter
    modifies_physics : callable or None
        ``modifies_physics(settings, place, values)`` writes into `Settings`.
    modifies_observation : callable or None
        ``modifies_observation(sensing, place, values)`` returns the channels that change.
    summary : str
        One line for tables and pages.
    mistaken_for, separated_by : str
        What looks like it, and the experiment that tells.
    model_form_error : float
        Share of what the effect does to recordings (in mean square) that this simple form of it may miss on a rig.
    by_name_only : bool
        Whether it is asked for only where somebody suspects it.
    """

    name: str
    places: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    summary: str
    mistaken_for: str
    separated_by: str
    model_form_error: float = 0.001
    by_name_only: bool = False
    modifies_physics: Callable[[Settings, str, Mapping[str, float]], None] | None = None
    modifies_observation: Callable[[Sensing, str, Mapping[str, float]], dict[str, NDArray]] | None = None

    def __post_init__(self):
        unknown = set(self.places) - set(PLACES)
        if unknown or not self.places:
            raise ValueError(f"{self.name}: places are {', '.join(PLACES)}; got {', '.join(self.places) or 'none'}")
        if (self.modifies_physics is None) == (self.modifies_observation is None):
            raise ValueError(f"{self.name}: a mechanism either enters the solver or changes what sensors read")

    @property
    def strengths(self) -> tuple[Parameter, ...]:
        """What says how much of it there is: its ratios, each by itself, or else its first parameter."""
        return tuple(p for p in self.parameters if p.ratio) or self.parameters[:1]

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        """The other parameters."""
        return tuple(p for p in self.parameters if p not in self.strengths)

    @property
    def neutral(self) -> dict[str, float]:
        """Parameter values at which it is not there."""
        return {p.name: p.neutral for p in self.parameters}

    @property
    def default(self) -> dict[str, float]:
        """Values of the parameters that a model may leave out."""
        return {p.name: p.default for p in self.parameters if p.default is not None}

    @property
    def start(self) -> dict[str, float]:
        """Parameter values from which a fit begins."""
        return {p.name: p.start for p in self.parameters}


def side(place: str) -> str:
    """'drive' or 'load', the end of the transmission that a place belongs to."""
    return place.split("-")[0]


def sensor_torque(place: str) -> str:
    """Name of the torque channel on the side of a sensor place."""
    return TORQUE_AT[side(place)]


def sensor_sum(place: str) -> str:
    """Name of the load cell's channel on the side of a sensor place."""
    return SUM_AT[side(place)]


def all_finite(values: Mapping[str, float]) -> bool:
    """Whether every value is a finite number."""
    return bool(np.isfinite(list(values.values())).all())
