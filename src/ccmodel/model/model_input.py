"""The model's input from a recording: motions behind the encoders' counts, measured load, readings at rest."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import F_LOAD, TAU_OUT, THETA_IN, THETA_MOTOR, THETA_OUT
from ccmodel.encoder.reconstruction import reconstruct_motion
from ccmodel.encoder.smoothing import DRAWS, OFFSET_SCORES
from ccmodel.model.turning_points import TurningPoints
from ccmodel.recording import Recording, stride

# A measured load torque is the torque and its sensor's noise. The noise would move the load back and forth; a hand, a
# spring or a brake does nothing above this frequency at the rates that rigs run at (0.1 to 1 Hz).
LOAD_CUTOFF_HZ = 10.0

# Before the first count, a drive has moved by up to a count, and the torque with it.
STILL_RAD = 1e-5
# Deviation of an angle without a step, in standard deviations of its noise, from which on it has moved.
NOISE_SDS = 5

PRESCRIBED = "prescribed"  # `derived_from` of a channel that the model takes as input


@dataclass(frozen=True)
class ModelInput:
    """The model's input from a recording, computed once however often the model runs.

    Attributes
    ----------
    recording : Recording
    theta_in : ndarray, shape (n,)
        The drive's motion behind its encoder's counts or steps, rad; 0 at the rest at the start where there is one.
        An angle without a step as it was recorded.
    drive_deviations : ndarray, shape (draws, n)
        Likely deviations of that motion from the true one, rad; no draws of an angle without step and noise.
    drive_encoder_offset : ndarray, shape (n,)
        Effect on that motion of one standard deviation of the encoder's sub-count offset at the first rest, rad.
    theta_out : ndarray, shape (n,), or None
        The load's motion behind its encoder's counts, rad; None where it was not recorded.
    tau_out, F_load : ndarray, shape (n,), or None
        Torque (N m) and sum of tensions (N) measured at the load pulley without the sensors' noise; None where they
        were not recorded.
    resting : mapping of str to ndarray
        Readings of each channel while the drive did not move, and time_s, each of shape (resting samples,); empty
        without a rest.
    theta_motor : ndarray, shape (n,), or None
        The motor's angle at the drive pulley, rad; None where it was not recorded.
    """

    recording: Recording
    theta_in: NDArray
    drive_deviations: NDArray
    drive_encoder_offset: NDArray
    theta_out: NDArray | None
    tau_out: NDArray | None
    F_load: NDArray | None
    resting: Mapping[str, NDArray]
    theta_motor: NDArray | None = None

    @classmethod
    def of(cls, recording: Recording, step_s: float | None = None) -> "ModelInput":
        """Input from a recording; reduced to a sample every `step_s` after all samples have been used."""
        theta_in, deviations, offset = _motion(recording, THETA_IN)
        theta_out = _motion(recording, THETA_OUT)[0] if THETA_OUT in recording else None
        tau_out, F_load = (_filtered(recording, channel) for channel in (TAU_OUT, F_LOAD))
        rest = _rest(recording, theta_in)
        every = stride(recording, step_s)
        resting = {c: values[rest] for c, values in ({**recording.channels, "time_s": recording.time_s}).items()}
        return cls(
            recording[::every],
            theta_in[::every],
            deviations[..., ::every],
            offset[..., ::every],
            _every(theta_out, every),
            _every(tau_out, every),
            _every(F_load, every),
            resting,
            recording[THETA_MOTOR][::every] if THETA_MOTOR in recording else None,
        )

    @property
    def series(self) -> dict[str, NDArray]:
        """Its arrays with a value at each sample, the last axis, by attribute; without those that were not recorded."""
        names = (
            "theta_in",
            "drive_deviations",
            "drive_encoder_offset",
            "theta_out",
            "tau_out",
            "F_load",
            "theta_motor",
        )
        return {name: values for name in names if (values := getattr(self, name)) is not None}

    @classmethod
    def prescribed(
        cls, like: Recording, time_s: NDArray, theta_in: NDArray, pretension_N: float, **load: NDArray
    ) -> "ModelInput":
        """Input of a motion that was not recorded, known exactly, of a recording's rig with even initial tension.

        Parameters
        ----------
        like : Recording
            Gives the conduits' path and the far end.
        time_s, theta_in : ndarray, shape (n,)
            s; rad.
        pretension_N : float
        **load : ndarray, each of shape (n,)
            Any of `theta_out`, `tau_out` and `F_load`, for a load without a law.
        """
        recording = replace(
            like,
            time_s=time_s,
            channels={THETA_IN: theta_in},
            derived_from={THETA_IN: PRESCRIBED},
            pretension_N=pretension_N,
            encoder_step_rad={},
            excitation={},
            rest_s=0.0,
            settled_s=0.0,
            log_start_s=0.0,
        )
        theta_out, tau_out, F_load = (load.get(name) for name in ("theta_out", "tau_out", "F_load"))
        exact = np.zeros((0, theta_in.size)), np.zeros(theta_in.size)
        return cls(recording, theta_in, *exact, theta_out, tau_out, F_load, {})

    @cached_property
    def with_turning_points(self) -> "tuple[ModelInput, NDArray]":
        """Times, drive, load and motor with the points at which the drive turns between samples; and the samples there.

        Only a motion behind an encoder's counts has them: the noise of any other angle turns at most samples, and a
        prescribed motion is linear between its samples. One that does not start at zero, where the initial tension
        stands, has a point there before its first sample.
        """
        recording = self.recording
        if not self.resting and self.theta_in.size > 1 and self.theta_in[0] != 0.0:
            return self._from_rest, np.arange(1, self.theta_in.size + 1)
        if THETA_IN not in recording.encoder_step_rad:
            return self, np.arange(self.theta_in.size)
        turns = TurningPoints.of(recording.time_s, self.theta_in)
        given = replace(
            self,
            recording=replace(recording, time_s=turns.inserted(recording.time_s), channels={}),
            theta_in=turns.inserted_in_motion(self.theta_in),
            theta_out=turns.inserted(self.theta_out),
            tau_out=turns.inserted(self.tau_out),
            F_load=turns.inserted(self.F_load),
            theta_motor=turns.inserted(self.theta_motor),
        )
        return given, turns.samples(recording.time_s.size)

    @property
    def _from_rest(self) -> "ModelInput":
        """A prescribed motion with a point of rest before its first sample."""
        time_s = self.recording.time_s
        times = np.concatenate([[2 * time_s[0] - time_s[1]], time_s])

        def held(values: NDArray | None) -> NDArray | None:
            return None if values is None else np.concatenate([values[:1], values])

        return replace(
            self,
            recording=replace(self.recording, time_s=times, channels={}),
            theta_in=np.concatenate([[0.0], self.theta_in]),
            theta_out=held(self.theta_out),
            tau_out=held(self.tau_out),
            F_load=held(self.F_load),
            theta_motor=held(self.theta_motor),
        )

    @cached_property
    def resting_mean(self) -> dict[str, float]:
        """Mean reading of each channel, and mean time, while the drive did not move; empty without a rest."""
        return {c: float(values.mean()) for c, values in self.resting.items() if values.size}

    @property
    def initial_tension_observed(self) -> bool:
        """Whether a rest shows the tension at all ends of the cables."""
        return all(tension in self.resting_mean for tension in self.recording.tensions)

    @property
    def deviations_given_offset(self) -> NDArray:
        """`drive_deviations` for a known sub-count offset at the first rest."""
        return self.drive_deviations - OFFSET_SCORES[: len(self.drive_deviations), None] * self.drive_encoder_offset


def _every(values: NDArray | None, every: int) -> NDArray | None:
    return None if values is None else values[..., ::every]


def _motion(recording: Recording, channel: str) -> tuple[NDArray, NDArray, NDArray]:
    """Motion behind an encoder's counts, likely deviations from it, and the effect of the sub-count offset, rad.

    An angle without a step is taken as it is; the noise that it shows at rest is its deviation.
    """
    if channel not in recording.encoder_step_rad:
        angle = recording[channel]
        return angle, _noise_draws(angle, _noise_at_rest(recording, angle)), np.zeros(angle.size)
    step_rad = recording.encoder_step_rad[channel]
    found = reconstruct_motion(recording.time_s, recording[channel], step_rad, recording.rest_s)
    return found.theta_rad, found.deviations_rad, found.encoder_offset_rad


def _noise_at_rest(recording: Recording, angle: NDArray) -> float:
    """Standard deviation of an angle's noise, rad, from its changes from sample to sample at rest; 0 without a rest."""
    changes = np.diff(angle[recording.time_s < recording.rest_s])
    return float(np.median(np.abs(changes)) / (0.6745 * np.sqrt(2))) if changes.size else 0.0


def _noise_draws(angle: NDArray, noise: float) -> NDArray:
    """Draws of white noise, shape (draws, n); no draws without noise."""
    return noise * np.random.default_rng(0).standard_normal((DRAWS if noise else 0, angle.size))


def _rest(recording: Recording, theta_in: NDArray) -> slice:
    """Samples at the start at which the drive does not move; its count rests for longer, and noise is no motion."""
    still, level = STILL_RAD, theta_in[0]
    if THETA_IN not in recording.encoder_step_rad and (noise := _noise_at_rest(recording, theta_in)):
        still, level = max(STILL_RAD, NOISE_SDS * noise), theta_in[recording.time_s < recording.rest_s].mean()
    moved = (recording.time_s >= recording.rest_s) | (np.abs(theta_in - level) > still)
    return slice(0, int(np.argmax(moved)) if moved.any() else recording.time_s.size)


def _filtered(recording: Recording, channel: str) -> NDArray | None:
    """A channel without what lies above `LOAD_CUTOFF_HZ`, without delay; None where it was not recorded."""
    if channel not in recording:
        return None
    rate = 1 / np.median(np.diff(recording.time_s))
    if rate <= 2.5 * LOAD_CUTOFF_HZ:
        return recording[channel]
    # Here, as it takes 0.4 s to import, and most commands meet no measured load.
    from scipy.signal import butter, sosfiltfilt

    return sosfiltfilt(butter(2, LOAD_CUTOFF_HZ, fs=rate, output="sos"), recording[channel])
