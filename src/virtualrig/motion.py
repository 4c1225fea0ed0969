"""Prescribed motions of the drive pulley. The drive is kinematic: its angle does not depend on the torque.

Every motion begins with a rest. Its acceleration is bounded, because a jump in speed would make the cables ring.
"""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, NonNegativeInt, PositiveFloat

from virtualrig.strict import Strict


class Sine(Strict):
    """A rest, a start-up in which the amplitude grows from zero, and a sine.

    The start-up keeps the acceleration bounded and continuous. A sine without it would begin with a jump in speed.
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
    def metadata(self) -> dict:
        """The motion as a batch states it."""
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
    """Strokes of constant speed, with reversals of constant acceleration in a share `turn_share` of the time."""

    wave: Literal["triangle"]
    amplitude_rad: PositiveFloat
    frequency_Hz: PositiveFloat
    turn_share: Annotated[float, Field(gt=0, lt=1)]
    rest_s: NonNegativeFloat
    cycles: PositiveFloat

    @property
    def duration_s(self) -> float:
        """Length of the whole motion, s. The first stroke, from the middle, takes half a ramp longer than the half."""
        return self.rest_s + self.cycles / self.frequency_Hz + self._ramp_s / 2

    @property
    def metadata(self) -> dict:
        """The motion as a batch states it."""
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
        side = 1 - 2 * (strokes % 2)
        first_progress, first_rate = _trapezoid(since, first_s, ramp_s)
        progress, rate = _trapezoid(later - strokes * stroke_s, stroke_s, ramp_s)
        is_first = since < first_s
        angle = np.where(is_first, speed * first_progress, side * (self.amplitude_rad - speed * progress))
        return angle, speed * np.where(is_first, first_rate, -side * rate)


class Chirp(Strict):
    """A sine with a logarithmic frequency sweep."""

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
    def metadata(self) -> dict:
        """The motion as a batch states it."""
        return self.model_dump(include={"wave", "amplitude_rad", "first_Hz", "last_Hz", "sweep_s"})

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        since = np.maximum(time_s - self.rest_s, 0.0)
        log_rate_per_s = np.log(self.last_Hz / self.first_Hz) / self.sweep_s
        rate = 2 * np.pi * self.first_Hz * np.exp(log_rate_per_s * since)
        # The integral of the rate over time, in a form that is also valid for a constant frequency.
        y = log_rate_per_s * since
        cycles = since * np.divide(np.expm1(y), y, out=np.ones_like(y), where=y != 0)
        return _swing(since, 2 * np.pi * self.first_Hz * cycles, rate, self.start_up_cycles / self.first_Hz, self)


class GrowingSine(Strict):
    """A sine whose amplitude grows or shrinks linearly, which gives nested reversals."""

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
    def metadata(self) -> dict:
        """The motion as a batch states it."""
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
    """A sine whose frequency varies slowly by at most a share `spread`, drawn from `seed`."""

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
    def metadata(self) -> dict:
        """The motion as a batch states it."""
        return self.model_dump(include={"wave", "amplitude_rad", "frequency_Hz", "spread"})

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        draw = np.random.default_rng(self.seed)
        share = draw.dirichlet(np.ones(3)) * self.spread
        slow = 2 * np.pi * self.frequency_Hz * draw.uniform(0.1, 0.7, 3)
        start = draw.uniform(0, 2 * np.pi, 3)
        since = np.maximum(time_s - self.rest_s, 0.0)
        slow_phase = slow * since[..., None] + start
        omega = 2 * np.pi * self.frequency_Hz
        phase = omega * (since + (share / slow * (np.sin(slow_phase) - np.sin(start))).sum(axis=-1))
        rate = omega * (1 + (share * np.cos(slow_phase)).sum(axis=-1))
        return _swing(since, phase, rate, self.start_up_cycles / self.frequency_Hz, self)


class StepAndHold(Strict):
    """Smooth moves to each angle in `move_s`, with a hold of `hold_s` after each."""

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
    def metadata(self) -> dict:
        """The motion as a batch states it."""
        return {"wave": self.wave, "angles_rad": list(self.angles_rad), "move_s": self.move_s, "hold_s": self.hold_s}

    def angle_and_rate(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """Drive angle (rad) and its rate (rad/s) at `time_s` (s); same shape as `time_s`."""
        angle, rate = np.zeros_like(time_s), np.zeros_like(time_s)
        for i, rise in enumerate(np.diff(self.angles_rad, prepend=0.0)):
            start = self.rest_s + i * (self.move_s + self.hold_s)
            step, slope = smooth_step((time_s - start) / self.move_s)
            angle += rise * step
            rate += rise * slope / self.move_s
        return angle, rate


Excitation = Annotated[Sine | Triangle | Chirp | GrowingSine | WanderingSine | StepAndHold, Field(discriminator="wave")]


def _swing(
    since: NDArray,
    phase: NDArray,
    phase_rate: NDArray | float,
    start_up_s: float,
    motion: "Chirp | GrowingSine | WanderingSine",
) -> tuple[NDArray, NDArray]:
    """Angle (rad) and rate (rad/s) of a sine of a given phase whose amplitude grows from zero; shapes (samples,)."""
    growth, slope = smooth_step(since / start_up_s)
    angle = motion.amplitude_rad * growth * np.sin(phase)
    rate = motion.amplitude_rad * (slope / start_up_s * np.sin(phase) + growth * phase_rate * np.cos(phase))
    return angle, np.where(since > 0, rate, 0.0)


def _trapezoid(since: NDArray, whole_s: float, ramp_s: float) -> tuple[NDArray, NDArray]:
    """Integral (s) of a trapezoidal rate, and the rate (0 to 1), for ramps of `ramp_s` within `whole_s`."""
    since = np.clip(since, 0.0, whole_s)
    until = whole_s - since
    rate = np.minimum(1.0, np.minimum(since, until) / ramp_s)
    up, down = np.minimum(since, ramp_s), np.minimum(until, ramp_s)
    progress = up**2 / (2 * ramp_s) + (since - up) - (ramp_s - down) ** 2 / (2 * ramp_s)
    return progress, rate


def smooth_step(s: NDArray) -> tuple[NDArray, NDArray]:
    """Quintic from 0 (s <= 0) to 1 (s >= 1) with zero slope and curvature at both ends, and its slope."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2
