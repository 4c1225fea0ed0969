"""What the drive pulley is made to do. The drive is kinematic: its angle is prescribed, whatever the torque."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, NonNegativeFloat, PositiveFloat


class Sine(BaseModel):
    """A rest, a start-up in which a sine grows from nothing, then the sine.

    The start-up keeps the acceleration bounded and continuous, as a motor's is; a bare sine would begin with a jump
    in speed that rings the cables.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

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


def smooth_step(s: NDArray) -> tuple[NDArray, NDArray]:
    """The quintic from 0 (s <= 0) to 1 (s >= 1) with no slope and no curvature at either end, and its slope."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2
