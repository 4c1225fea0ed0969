"""Physics beyond Coulomb friction, elastic cables and ideal sensors that a virtual rig can have, typed.

An effect that is not given is not there; `Effects()` is the ideal rig. What an effect does stands with it, how it is
integrated in `virtualrig.effect_dynamics`, and what concerns sensors alone in `virtualrig.sensors`.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from virtualrig.strict import NonNegative, Share, Strict

OpenShare = Annotated[float, Field(gt=0, lt=1)]


class DahlPresliding(Strict):
    """One bristle of Dahl's law at every place: friction builds up over `length_m`."""

    law: Literal["dahl"] = "dahl"
    length_m: PositiveFloat


class IwanPresliding(Strict):
    """Equal elements in parallel that stretch and then slip, at lengths spread evenly in logarithm.

    A contact of many asperities: the build-up has no single length, and nested loops close exactly.
    """

    law: Literal["iwan"] = "iwan"
    shortest_m: PositiveFloat
    longest_m: PositiveFloat
    elements: Annotated[PositiveInt, Field(le=64)] = 8

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.longest_m < self.shortest_m:
            raise ValueError(f"longest_m {self.longest_m} is below shortest_m {self.shortest_m}")
        return self


class Stribeck(Strict):
    """Friction coefficient times 1 + rise exp(-(|v| / speed)^exponent), v the sliding speed.

    A contact takes on what its speed makes of it as it slides `renewal_m` further. Friction that fell with speed at
    once would have no such length, and a cable without one chatters ever faster on ever shorter pieces of itself.
    """

    rise: NonNegative
    speed_m_per_s: PositiveFloat
    exponent: PositiveFloat = 1.0
    renewal_m: PositiveFloat = 20e-6


class LoadDependentFriction(Strict):
    """Friction coefficient times (T / reference)^exponent; below `floor_N` the factor stays as it is there."""

    exponent: Annotated[float, Field(gt=-1, lt=1)]
    reference_N: PositiveFloat = 5.0
    floor_N: PositiveFloat = 0.1


class Kink(Strict):
    """A sharp bend of both conduits at a share of their length."""

    bend_rad: NonNegative
    place_share: OpenShare


class RunningIn(Strict):
    """Friction coefficient times 1 + change (1 - exp(-x / scale)), x the time or the way that the drive has gone."""

    change: Annotated[float, Field(gt=-1)]
    over: Literal["time_s", "travel_m"] = "time_s"
    scale: PositiveFloat


class CableAsymmetry(Strict):
    """Cable B over cable A."""

    friction_ratio: PositiveFloat = 1.0
    stiffness_ratio: PositiveFloat = 1.0


class Relaxation(Strict):
    """A branch of the cable that gives up its share of the tension with a time constant."""

    share: OpenShare
    time_constant_s: PositiveFloat


class StrandSettling(Strict):
    """A cable that is soft near slack: over its tension scale the strands find their places.

    With elongation e, and s the elongation that the scale makes in an ideal cable, the tension is that of an
    elongation sqrt(e^2 + s^2) - s ("hyperbolic"), or e - s (1 - exp(-e / s)) ("exponential").
    """

    law: Literal["hyperbolic", "exponential"] = "hyperbolic"
    tension_scale_N: PositiveFloat


class TerminationCompliance(Strict):
    """Compliances without friction in series at either end of both cables."""

    drive_m_per_N: NonNegative = 0.0
    load_m_per_N: NonNegative = 0.0


class PulleyFriction(Strict):
    """A bearing: a torque against the motion that builds up over a small angle."""

    torque_Nm: NonNegative
    presliding_rad: PositiveFloat = 1e-3


class Eccentricity(Strict):
    """A pulley's radius times 1 + share sin(angle + phase)."""

    share: Annotated[float, Field(ge=0, lt=0.5)]
    phase_rad: float = 0.0


class PulleyEffects(Strict):
    """What can be wrong with one pulley."""

    friction: PulleyFriction | None = None
    eccentricity: Eccentricity | None = None


class LoadEffects(Strict):
    """What the load is besides its spring.

    `half_gap_rad` is half the dead zone between pulley and spring, `cubic_Nm_per_rad3` a stiffening of the spring
    beyond the gap; `inertia_kg_m2` turns with the pulley, besides the rig's own.
    """

    half_gap_rad: NonNegative = 0.0
    cubic_Nm_per_rad3: NonNegative = 0.0
    inertia_kg_m2: NonNegative = 0.0


class SideSensors(Strict):
    """What can be wrong with the sensors of one side.

    A torque reads (1 + torque_gain) times as much; a load cell reads (1 + gain) F + offset + drift t + crosstalk
    tau / R; all channels of the side show at t what was at t - delay. Neither of these stands in a list that a
    diagnosis may know: an encoder's disc that is off its axis, so that the angle reads theta + runout
    sin(theta + phase); a torque that reads (1 + curvature tau^2) times as much.
    """

    torque_gain: float = 0.0
    load_cell_gain: float = 0.0
    load_cell_offset_N: float = 0.0
    load_cell_drift_N_per_s: float = 0.0
    load_cell_crosstalk: float = 0.0
    delay_s: float = 0.0
    angle_runout_rad: float = 0.0
    angle_runout_phase_rad: float = 0.0
    torque_curvature_per_Nm2: float = 0.0


class HystereticLoad(Strict):
    """A load spring with inner friction, such as rubber: up to `torque_Nm` on top, built up over `angle_rad`.

    Unlike a bearing's, the load's own torque shows it.
    """

    torque_Nm: NonNegative
    angle_rad: PositiveFloat


class DirectionalFriction(Strict):
    """Friction 1 + bias times as large where the cable slides towards the drive, 1 - bias where it slides back."""

    bias: Annotated[float, Field(gt=-1, lt=1)]


class PositionalFriction(Strict):
    """A cable that is not the same all along: friction 1 + rise sin(2 pi x / period + phase), x its way in."""

    rise: Annotated[float, Field(ge=0, lt=1)]
    period_m: PositiveFloat
    phase_rad: float = 0.0


class Effects(Strict):
    """Every effect of a rig. The last three, and two of the sensors', stand in no list that a diagnosis may know."""

    presliding: Annotated[DahlPresliding | IwanPresliding, Field(discriminator="law")] | None = None
    stribeck: Stribeck | None = None
    viscous_Ns_per_m2: NonNegative = 0.0
    load_dependent_friction: LoadDependentFriction | None = None
    drag_N: NonNegative = 0.0
    kinks: tuple[Kink, ...] = ()
    running_in: RunningIn | None = None
    cable_asymmetry: CableAsymmetry = CableAsymmetry()
    relaxation: tuple[Relaxation, ...] = ()
    strand_settling: StrandSettling | None = None
    termination_compliance: TerminationCompliance = TerminationCompliance()
    conduit_compliance_m_per_N: NonNegative = 0.0
    drive_pulley: PulleyEffects = PulleyEffects()
    load_pulley: PulleyEffects = PulleyEffects()
    load: LoadEffects = LoadEffects()
    drive_sensors: SideSensors = SideSensors()
    load_sensors: SideSensors = SideSensors()

    hysteretic_load: HystereticLoad | None = None
    directional_friction: DirectionalFriction | None = None
    positional_friction: PositionalFriction | None = None

    @model_validator(mode="after")
    def _something_of_the_tension_lasts(self) -> Self:
        lost: Share = sum(branch.share for branch in self.relaxation)
        if lost >= 1:
            raise ValueError(f"relaxation takes {lost:g} of the tension; less than 1 in all")
        return self

    @property
    def are_in_the_motion(self) -> bool:
        """Whether any effect is there besides those of sensors, which come after the motion."""
        sensors_only = Effects(drive_sensors=self.drive_sensors, load_sensors=self.load_sensors)
        return self != sensors_only
