"""What the drive's side of a recording shows of the load: nothing that a sensor at the load has read."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.channels import F_DRIVE, F_LOAD, T1, T2, T3, T4, TAU_IN, TAU_OUT, THETA_IN, THETA_OUT, ZERO_OF
from ccmodel.encoder.filtering import causal_motion
from ccmodel.failure import ModelError
from ccmodel.model.active import Active, without_faults
from ccmodel.model.initial import InitialTension
from ccmodel.model.model_input import ModelInput
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import initial_tension
from ccmodel.model.sensors import FAULT_ITERATIONS, read_by_sensors, true_at
from ccmodel.recording import Recording

# White noise of a torque is measured over so many samples of the rest at least.
FEWEST_AT_REST = 20
# Cables are tensioned from the drive against friction: towards the load their tension falls, most often by a tenth, and
# by nothing to twice as much (docs/rig-log-format.md, Repeatability).
FALL = 0.1
# A drive that moves less in a sample than this share of a count counts as moving by as much.
SMALLEST_SHARE = 1e-3
# Standard deviation of a number that is uniform between -1 and 1.
UNIFORM = 3**-0.5


@dataclass(frozen=True)
class Proximal:
    """Drive angle and torque of a recording.

    Attributes
    ----------
    recording : Recording
        Its channels are those of the drive.
    theta_in, sigma_in : ndarray, shape (n,)
        Causal estimate of the drive angle from the rest on, and its standard deviation, rad.
    rest_offset_rad : float
        Standard deviation of the angle at the rest at the start, which the count hides; 0 without an encoder.
    torque_noise_Nm, torque_zero_Nm : float
        Standard deviations of the torque sensor's white noise and zero.
    rests : bool
        Whether the cables rest at the start, so that the drive's sensors show their tensions there.
    """

    recording: Recording
    theta_in: NDArray
    sigma_in: NDArray
    rest_offset_rad: float
    torque_noise_Nm: float
    torque_zero_Nm: float
    rests: bool

    @classmethod
    def of(cls, recording: Recording) -> "Proximal":
        """The drive's side of a recording.

        Raises
        ------
        ModelError
            If it has no drive torque.
        """
        if TAU_IN not in recording:
            raise ModelError(f"{recording.batch}/{recording.id}: no drive torque was recorded; an estimate needs it")
        own = {c: recording[c] for c in (THETA_IN, TAU_IN, F_DRIVE) if c in recording}
        step_rad = recording.encoder_step_rad.get(THETA_IN)
        theta, sigma = recording[THETA_IN], np.zeros(recording.time_s.size)
        if step_rad is not None:
            theta, sigma = causal_motion(recording.time_s, theta, step_rad)
        rest = recording.time_s < recording.rest_s
        accuracy = recording.accuracy.get(TAU_IN, 0.0)
        noise = accuracy
        if rest.sum() >= FEWEST_AT_REST:
            noise = float(np.median(np.abs(np.diff(recording[TAU_IN][rest]))) / (0.6745 * np.sqrt(2)))
        offset = step_rad / 2 * UNIFORM if step_rad is not None and rest.any() else 0.0
        theta = theta - theta[0] if rest.any() else theta
        seen = replace(recording, channels=own)
        return cls(seen, theta, sigma, offset, noise, accuracy * UNIFORM, bool(rest.any()))

    def initial_tension(self, parameters: Parameters, falls: tuple[float, float] = (FALL, FALL)) -> InitialTension:
        """Tension before the drive moves; at rest, that at the load follows from that at the drive.

        Without load cells the nominal pretension stands for the mean tension of a pair of cables.

        Parameters
        ----------
        parameters : Parameters
        falls : (float, float)
            Share of its tension by which each cable's falls from the drive to the load.
        """
        resting: dict[str, NDArray] = {}
        # Zeros and faults of sensors are removed here: those at the load have read nothing.
        none_has = dict.fromkeys(ZERO_OF.values(), 0.0)
        physical = replace(parameters, mechanisms=without_faults(parameters.mechanisms)).with_values(none_has)
        if self.rests:
            tau, total = self._at_rest(parameters)
            if self.recording.far_end:
                near: tuple[float, ...] = (total,)
            else:
                near = tuple((total + sign * tau / parameters.drive_radius_m) / 2 for sign in (1, -1))
            far = [tension * (1 - fall) for tension, fall in zip(near, falls, strict=False)]
            read = {
                TAU_IN: tau,
                F_DRIVE: total,
                TAU_OUT: parameters.load_radius_m * (far[0] - sum(far[1:])),
                F_LOAD: sum(far),
                **dict(zip((T1, T3), near, strict=False)),
                **dict(zip((T2, T4), far, strict=False)),
                "time_s": self._rest_s,
            }
            resting = {name: np.array([value]) for name, value in read.items()}
        none = np.zeros((0, self.theta_in.size)), np.zeros(self.theta_in.size)
        given = ModelInput(self.recording, self.theta_in, *none, None, None, None, resting)
        return initial_tension(given, physical)

    @property
    def _rest_s(self) -> float:
        """Mean time of the rest, s."""
        seen = self.recording
        return float(seen.time_s[seen.time_s < seen.rest_s].mean())

    def _at_rest(self, parameters: Parameters) -> tuple[float, float]:
        """Torque and sum of tensions of the drive at rest, from their sensors' readings without zeros and faults."""
        seen, radii = self.recording, (parameters.drive_radius_m, parameters.load_radius_m)
        rest = seen.time_s < seen.rest_s
        tau = float(seen[TAU_IN][rest].mean()) - parameters.tau_in_zero_Nm
        if F_DRIVE in seen:
            total = float(seen[F_DRIVE][rest].mean()) - parameters.F_drive_zero_N
        elif seen.far_end:
            total = tau / radii[0]
        else:
            total = 2 * parameters.pretension_share * seen.pretension_N / (1 - FALL / 2)
        nothing = dict.fromkeys((THETA_IN, THETA_OUT, TAU_OUT, F_LOAD), 0.0)
        seconds = self._rest_s - float(seen.time_s[0])
        true = true_at(parameters.mechanisms, seconds, nothing | {TAU_IN: tau, F_DRIVE: total}, radii)
        if F_DRIVE in seen:
            total = true[F_DRIVE]
        elif seen.far_end:
            total = true[TAU_IN] / radii[0]
        return true[TAU_IN], total

    @property
    def lasting_variance(self) -> NDArray:
        """Variance of white noise that weighs as much as the error of the angle, which lasts for a count; rad^2."""
        travel = np.abs(np.diff(self.theta_in, prepend=self.theta_in[0]))
        step_rad = self.recording.encoder_step_rad.get(THETA_IN, 0.0)
        return (
            self.sigma_in**2 * np.maximum(step_rad / np.maximum(travel, step_rad * SMALLEST_SHARE), 1.0)
            if step_rad
            else self.sigma_in**2
        )

    def torque_of(self, parameters: Parameters) -> NDArray:
        """Torque of the drive from its sensor's reading without zero and faults, shape (n,), N m."""
        read = self.recording[TAU_IN] - parameters.tau_in_zero_Nm
        radii = parameters.drive_radius_m, parameters.load_radius_m
        return true_torque(parameters.mechanisms, self.recording.time_s, self.theta_in, read, radii)


def true_torque(
    mechanisms: tuple[Active, ...], time_s: NDArray, theta_in: NDArray, read: NDArray, radii: tuple[float, float]
) -> NDArray:
    """What the drive torque's sensor would have read without its faults, by fixed-point iteration.

    `radii` are those of the drive and the load pulley, m.
    """
    faults = [m for m in mechanisms if not registry.get(m.name).looks_ahead]
    nothing = np.zeros_like(read)
    rest = {THETA_IN: theta_in, THETA_OUT: nothing, TAU_OUT: nothing, F_DRIVE: nothing, F_LOAD: nothing}
    true = read
    for _ in range(FAULT_ITERATIONS):
        reading = read_by_sensors(faults, time_s, rest | {TAU_IN: true}, radii)[TAU_IN]
        if np.array_equal(reading, read):
            break
        true = true + read - reading
    return true
