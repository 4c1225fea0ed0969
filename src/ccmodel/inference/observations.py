"""A recording prepared for a fit: the model's input, the samples that are compared and the noise of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import MEASURED, TAU_OUT
from ccmodel.failure import ModelError
from ccmodel.inference.cycles import NONE, CycleNoise, cycle_noise
from ccmodel.inference.noise import (
    ROUNDING_PHASES,
    SensorNoise,
    drive_errors,
    pooled,
    repeated,
    rounding_errors,
    sensor_noise,
    size_over_time,
)
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import PRESCRIBED, LoadFrom, ModelInput, simulate
from ccmodel.recording import Recording

# Standard deviation of the model discrepancy, as a share of a channel's peak to peak: one for all, or by channel.
Tolerance = float | Mapping[str, float]


@dataclass(frozen=True)
class Observations:
    """A recording prepared for a fit.

    Attributes
    ----------
    given : ModelInput
    parameters : Parameters
        The batch's estimates; the unknowns of a fit replace some of them.
    channels : tuple of str
        Channels that are compared.
    judged : ndarray of bool, shape (n,)
        Samples that are compared: those after the rest and the start-up transient.
    measured, sigma : ndarray, shape (channels, judged samples)
        Values and their standard deviation, in the channels' units.
    tolerance : ndarray, shape (channels,)
        Standard deviation of the model discrepancy within `sigma`, as a share of the channel's peak to peak.
    offset_is_free : bool
        Whether the sub-count offset of the drive encoder is an unknown of the fit. Otherwise it is part of the noise.
    load_from : {"law", "torque"}
        Whether the load's law or the measured load torque acts at the cables' far end.
    noise : mapping of str to SensorNoise
        Noise of each channel's sensor.
    before_motion : mapping of str to SensorNoise
        The same without regard to the motion: from the rest, or as stated.
    cycles : CycleNoise
        What consecutive cycles say of it.
    friction_between : float
        Standard deviation of friction between batches, over its mean, that this recording has besides the one between
        runs: of the only recording of a batch among several. Otherwise 0.
    """

    given: ModelInput
    parameters: Parameters
    channels: tuple[str, ...]
    judged: NDArray
    measured: NDArray
    sigma: NDArray
    tolerance: NDArray
    offset_is_free: bool = False
    load_from: LoadFrom = "law"
    noise: Mapping[str, SensorNoise] = field(default_factory=dict)
    before_motion: Mapping[str, SensorNoise] = field(default_factory=dict)
    cycles: CycleNoise = NONE
    friction_between: float = 0.0

    @classmethod
    def of(
        cls,
        recording: Recording,
        parameters: Parameters,
        channels: Sequence[str] = MEASURED,
        step_s: float | None = None,
        tolerance: Tolerance = 0.0,
        offset_is_free: bool = False,
        whole: Recording | None = None,
    ) -> "Observations":
        """Observations from a recording, one sample every `step_s`.

        `whole` is the recording with all its cycles, if `recording` is a part of it: consecutive cycles show the noise.

        Raises
        ------
        ModelError
            If none of the channels was recorded, or the model cannot be run with the parameters.
        """
        given = ModelInput.of(recording, step_s)
        prescribed = {c for c, source in simulate(given, parameters).derived_from.items() if source == PRESCRIBED}
        used = tuple(c for c in channels if c in recording and c not in prescribed)
        if not used:
            raise ModelError(f"{recording.batch}/{recording.id}: none of {', '.join(channels)} was recorded")
        time_s = given.recording.time_s
        judged = time_s >= max(recording.rest_s, recording.settled_s)
        before_motion, cycles = sensor_noise(given), cycle_noise(whole or recording)
        sensors = _with_cycles(before_motion, cycles)
        drive = drive_errors(given, parameters, offset_is_free)
        measured = np.stack([given.recording[c][judged] for c in used])
        sigma = np.stack([np.hypot(sensors[c].sd, size_over_time(drive[c], time_s)[judged]) for c in used])
        by_channel = tolerance if isinstance(tolerance, Mapping) else dict.fromkeys(used, tolerance)
        shares = np.array([by_channel.get(c, 0.0) for c in used])
        sigma = np.hypot(sigma, (shares * np.ptp(measured, axis=1))[:, None])
        return cls(
            given,
            parameters,
            used,
            judged,
            measured,
            sigma,
            shares,
            offset_is_free,
            noise=sensors,
            before_motion=before_motion,
            cycles=cycles,
        )

    def with_noise(self, before_motion: Mapping[str, SensorNoise]) -> "Observations":
        """The same with other noise of the sensors."""
        noise = _with_cycles(before_motion, self.cycles)
        change = np.array([noise[c].sd ** 2 - self.noise[c].sd ** 2 for c in self.channels])
        return replace(self, sigma=np.sqrt(self.sigma**2 + change[:, None]), noise=noise, before_motion=before_motion)

    def with_tolerance(self, tolerance: Mapping[str, float]) -> "Observations":
        """The same with another tolerance of some channels."""
        if not tolerance:
            return self
        shares = np.array(
            [tolerance.get(c, now) for c, now in zip(self.channels, self.tolerance.tolist(), strict=True)]
        )
        change = (shares**2 - self.tolerance**2) * np.ptp(self.measured, axis=1) ** 2
        return replace(self, sigma=np.sqrt(self.sigma**2 + change[:, None]), tolerance=shares)

    def without(self, channel: str) -> "Observations":
        """The same without one of the channels."""
        kept = [k for k, c in enumerate(self.channels) if c != channel]
        channels = tuple(self.channels[k] for k in kept)
        series = {name: getattr(self, name)[kept] for name in ("measured", "sigma", "tolerance")}
        return replace(self, channels=channels, **series)

    def driven_by_torque(self) -> "Observations":
        """The same with the measured load torque in place of the load's law."""
        return replace(self.without(TAU_OUT), load_from="torque")

    def with_parameters(self, parameters: Parameters) -> "Observations":
        """The same for a model with other parameters."""
        return replace(self, parameters=parameters)

    @property
    def has_tolerance(self) -> bool:
        """Whether a channel has a tolerance."""
        return bool(self.tolerance.any())

    @property
    def tolerance_shares(self) -> NDArray:
        """Share of the variance `sigma**2` that the tolerance makes up, averaged over samples; shape (channels,)."""
        size = (self.tolerance * np.ptp(self.measured, axis=1))[:, None]
        return ((size / self.sigma) ** 2).mean(axis=1)

    @property
    def tolerance_share(self) -> float:
        """Mean of `tolerance_shares`."""
        return float(self.tolerance_shares.mean())

    @property
    def id(self) -> str:
        """The recording's name within its batch."""
        return self.given.recording.id

    @property
    def name(self) -> str:
        """Batch and recording."""
        return f"{self.given.recording.batch}/{self.given.recording.id}"

    @property
    def session(self) -> str:
        """The recording's batch among several that are taken together; empty for a batch by itself."""
        return self.given.recording.session

    def modelled(self, values: Mapping[str, float]) -> NDArray:
        """The model's channels with some parameters replaced, shape (channels, judged samples)."""
        simulated = simulate(self.given, self.parameters.with_values(values, self.session), self.load_from)
        return np.stack([simulated[c][self.judged] for c in self.channels])

    def errors(self, values: Mapping[str, float]) -> NDArray:
        """Model minus recording over the noise, shape (channels, judged samples)."""
        return (self.modelled(values) - self.measured) / self.sigma

    def drive_errors(self, values: Mapping[str, float]) -> NDArray:
        """Draws of the error over the noise that the uncertain drive motion causes; (draws, channels, samples)."""
        found = drive_errors(self.given, self.parameters.with_values(values, self.session), self.offset_is_free)
        return np.stack([found[c][:, self.judged] for c in self.channels], axis=1) / self.sigma

    def rounding_errors(self, values: Mapping[str, float]) -> NDArray:
        """Draws of the rounding error over the noise of counted angles; (phases, channels, samples)."""
        simulated, steps = self.modelled(values), self.given.recording.encoder_step_rad
        found = np.zeros((ROUNDING_PHASES.size, *simulated.shape))
        for k, channel in enumerate(self.channels):
            if channel in steps:
                found[:, k] = rounding_errors(simulated[k], steps[channel])
        return found / self.sigma


def with_pooled_noise(observations: Sequence[Observations]) -> list[Observations]:
    """Observations of one rig, the noise of each sensor drawn towards that of all recordings (`noise.pooled`)."""
    priors: list[dict[str, SensorNoise]] = [{} for _ in observations]
    for channel in sorted({c for o in observations for c in o.before_motion}):
        having = [k for k, o in enumerate(observations) if channel in o.before_motion]
        of_all = pooled([observations[k].before_motion[channel] for k in having])
        for k, one in zip(having, of_all, strict=True):
            priors[k][channel] = one
    return [o.with_noise(prior) for o, prior in zip(observations, priors, strict=True)]


def _with_cycles(noise: Mapping[str, SensorNoise], cycles: CycleNoise) -> dict[str, SensorNoise]:
    return {c: repeated(one, cycles.variance.get(c), cycles.cycles) for c, one in noise.items()}
