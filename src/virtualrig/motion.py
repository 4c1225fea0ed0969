"""What the drive pulley is made to do. The drive is kinematic: its angle is prescribed, whatever the torque.

Every motion begins with a rest and has a bounded acceleration, as a motor's is: a jump in speed would ring the cables.
"""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, NonNegativeInt, PositiveFloat

from virtualrig.strict import Strict


class Sine(Strict):
    """A rest, a start-up in which a sine grows from nothing, then the sine.

    The start-up keeps the acceleration bounded and continuous, as a motor's is; a bare sine would begin with a jump
    in speed that rings the cables.
    """

    wave: Literal["sine"]
    amplitude_rad: PositiveFloat
    frequency_Hz: PositiveFloat
    rest_s: NonNegativeFloat
    start_up_cycles: PositiveFloat
    cycles: PositiveFloat

    @property
    def duration_s(self) -> float:
        """Length of the whole motion, s."""
        return self.rest_s + (self.start_up_cycles + self.cycles) / self.frequency_Hz

    @property
    def asked(self) -> dict:
        """What a batch notes of the motion."""
        return {"wave": self.wave, "amplitude_rad": self.amplitude_rad, "frequency_Hz": self.frequency_Hz}

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        since = np.maximum(time_s - self.rest_s, 0.0)
        omega = 2 * np.pi * self.frequency_Hz
        start_up_s = self.start_up_cycles / self.frequency_Hz
        growth, growth_rate = smooth_step(since / start_up_s)
        angle = self.amplitude_rad * growth * np.sin(omega * since)
        rate = self.amplitude_rad * (
            growth_rate / start_up_s * np.sin(omega * since) + growth * omega * np.cos(omega * since)
        )
        return angle, rate


class Triangle(Strict):
    """Strokes of constant speed, turned around at constant acceleration in `turn_share` of the time."""

    wave: Literal["triangle"]
    amplitude_rad: PositiveFloat
    frequency_Hz: PositiveFloat
    turn_share: Annotated[float, Field(gt=0, lt=1)]
    rest_s: NonNegativeFloat
    cycles: PositiveFloat

    @property
    def duration_s(self) -> float:
        """Length of the whole motion, s: the first stroke from the middle takes half a ramp longer than later ones."""
        return self.rest_s + self.cycles / self.frequency_Hz + self._ramp_s / 2

    @property
    def asked(self) -> dict:
        """What a batch notes of the motion."""
        return {"wave": self.wave, "amplitude_rad": self.amplitude_rad, "frequency_Hz": self.frequency_Hz}

    @property
    def _ramp_s(self) -> float:
        return self.turn_share / self.frequency_Hz / 4

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        stroke_s, ramp_s = 0.5 / self.frequency_Hz, self._ramp_s
        first_s = (stroke_s + ramp_s) / 2
        speed = 2 * self.amplitude_rad / (stroke_s - ramp_s)
        since = np.maximum(time_s - self.rest_s, 0.0)
        later = np.maximum(since - first_s, 0.0)
        strokes = np.floor(later / stroke_s)
        way_back = 1 - 2 * (strokes % 2)
        first_way, first_rate = _trapezoid(since, first_s, ramp_s)
        way, rate = _trapezoid(later - strokes * stroke_s, stroke_s, ramp_s)
        is_first = since < first_s
        angle = np.where(is_first, speed * first_way, way_back * (self.amplitude_rad - speed * way))
        return angle, speed * np.where(is_first, first_rate, -way_back * rate)


class Chirp(Strict):
    """A sine whose frequency rises or falls by a constant factor in equal times."""

    wave: Literal["chirp"]
    amplitude_rad: PositiveFloat
    first_Hz: PositiveFloat
    last_Hz: PositiveFloat
    sweep_s: PositiveFloat
    rest_s: NonNegativeFloat
    start_up_cycles: PositiveFloat

    @property
    def duration_s(self) -> float:
        """Length of the whole motion, s."""
        return self.rest_s + self.sweep_s

    @property
    def asked(self) -> dict:
        """What a batch notes of the motion."""
        return self.model_dump(include={"wave", "amplitude_rad", "first_Hz", "last_Hz", "sweep_s"})

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        since = np.maximum(time_s - self.rest_s, 0.0)
        octaves_per_s = np.log(self.last_Hz / self.first_Hz) / self.sweep_s
        rate = 2 * np.pi * self.first_Hz * np.exp(octaves_per_s * since)
        # The integral of the rate, in a form that holds for a constant frequency too.
        y = octaves_per_s * since
        turned = since * np.divide(np.expm1(y), y, out=np.ones_like(y), where=y != 0)
        return _swing(since, 2 * np.pi * self.first_Hz * turned, rate, self.start_up_cycles / self.first_Hz, self)


class GrowingSine(Strict):
    """A sine whose amplitude grows (or shrinks) from cycle to cycle: reversals nested in each other."""

    wave: Literal["growing-sine"]
    first_amplitude_rad: PositiveFloat
    amplitude_rad: PositiveFloat
    frequency_Hz: PositiveFloat
    rest_s: NonNegativeFloat
    start_up_cycles: PositiveFloat
    cycles: PositiveFloat

    @property
    def duration_s(self) -> float:
        """Length of the whole motion, s."""
        return self.rest_s + (self.start_up_cycles + self.cycles) / self.frequency_Hz

    @property
    def asked(self) -> dict:
        """What a batch notes of the motion."""
        return self.model_dump(include={"wave", "first_amplitude_rad", "amplitude_rad", "frequency_Hz"})

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        since = np.maximum(time_s - self.rest_s, 0.0)
        omega = 2 * np.pi * self.frequency_Hz
        whole = (self.start_up_cycles + self.cycles) / self.frequency_Hz
        share = self.first_amplitude_rad / self.amplitude_rad
        envelope, envelope_rate = share + (1 - share) * since / whole, (1 - share) / whole
        angle, rate = _swing(since, omega * since, omega, self.start_up_cycles / self.frequency_Hz, self)
        return envelope * angle, envelope * rate + envelope_rate * angle


class WanderingSine(Strict):
    """A sine whose frequency wanders by up to `spread` of itself, as drawn from `seed`."""

    wave: Literal["wandering-sine"]
    amplitude_rad: PositiveFloat
    frequency_Hz: PositiveFloat
    spread: Annotated[float, Field(ge=0, lt=1)]
    seed: NonNegativeInt
    rest_s: NonNegativeFloat
    start_up_cycles: PositiveFloat
    cycles: PositiveFloat

    @property
    def duration_s(self) -> float:
        """Length of the whole motion, s."""
        return self.rest_s + (self.start_up_cycles + self.cycles) / self.frequency_Hz

    @property
    def asked(self) -> dict:
        """What a batch notes of the motion."""
        return self.model_dump(include={"wave", "amplitude_rad", "frequency_Hz", "spread"})

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        draw = np.random.default_rng(self.seed)
        share = draw.dirichlet(np.ones(3)) * self.spread
        slow = 2 * np.pi * self.frequency_Hz * draw.uniform(0.1, 0.7, 3)
        start = draw.uniform(0, 2 * np.pi, 3)
        since = np.maximum(time_s - self.rest_s, 0.0)
        at = slow * since[..., None] + start
        omega = 2 * np.pi * self.frequency_Hz
        phase = omega * (since + (share / slow * (np.sin(at) - np.sin(start))).sum(axis=-1))
        rate = omega * (1 + (share * np.cos(at)).sum(axis=-1))
        return _swing(since, phase, rate, self.start_up_cycles / self.frequency_Hz, self)


class StepAndHold(Strict):
    """Smooth moves from angle to angle, each `move_s` long, with a hold of `hold_s` after each."""

    wave: Literal["step-and-hold"]
    angles_rad: tuple[float, ...] = Field(min_length=1)
    move_s: PositiveFloat
    hold_s: NonNegativeFloat
    rest_s: NonNegativeFloat

    @property
    def duration_s(self) -> float:
        """Length of the whole motion, s."""
        return self.rest_s + len(self.angles_rad) * (self.move_s + self.hold_s)

    @property
    def asked(self) -> dict:
        """What a batch notes of the motion."""
        return {"wave": self.wave, "angles_rad": list(self.angles_rad), "move_s": self.move_s, "hold_s": self.hold_s}

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        angle, rate = np.zeros_like(time_s), np.zeros_like(time_s)
        for i, rise in enumerate(np.diff(self.angles_rad, prepend=0.0)):
            start = self.rest_s + i * (self.move_s + self.hold_s)
            way, slope = smooth_step((time_s - start) / self.move_s)
            angle += rise * way
            rate += rise * slope / self.move_s
        return angle, rate


Excitation = Annotated[Sine | Triangle | Chirp | GrowingSine | WanderingSine | StepAndHold, Field(discriminator="wave")]


def _swing(since, phase, phase_rate, start_up_s, motion) -> tuple[NDArray, NDArray]:
    """A sine of any phase (rad) that grows from nothing: angle and rate, shapes (samples,)."""
    growth, slope = smooth_step(since / start_up_s)
    angle = motion.amplitude_rad * growth * np.sin(phase)
    rate = motion.amplitude_rad * (slope / start_up_s * np.sin(phase) + growth * phase_rate * np.cos(phase))
    return angle, np.where(since > 0, rate, 0.0)


def _trapezoid(since, whole_s, ramp_s) -> tuple[NDArray, NDArray]:
    """Way (s) and rate (0 to 1) of a stroke that speeds up and slows down in `ramp_s` each, `whole_s` in all."""
    since = np.clip(since, 0.0, whole_s)
    left = whole_s - since
    rate = np.minimum(1.0, np.minimum(since, left) / ramp_s)
    up, down = np.minimum(since, ramp_s), np.minimum(left, ramp_s)
    way = up**2 / (2 * ramp_s) + (since - up) - (ramp_s - down) ** 2 / (2 * ramp_s)
    return way, rate


def smooth_step(s: NDArray) -> tuple[NDArray, NDArray]:
    """The quintic from 0 (s <= 0) to 1 (s >= 1) with no slope and no curvature at either end, and its slope."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2
