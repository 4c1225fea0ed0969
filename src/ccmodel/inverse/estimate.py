"""A recording's drive side and a model -> the load's torque and angle with intervals."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ccmodel import mechanisms as registry
from ccmodel.channels import TAU_OUT, THETA_OUT, ZERO_OF
from ccmodel.failure import ModelError
from ccmodel.inverse import exact, general
from ccmodel.inverse.proximal import FALL, UNIFORM, Proximal
from ccmodel.inverse.update import BY_MISFIT, EXPECTED, MISFIT, Considered, Drive, Prior, Run, joint_estimate, variances
from ccmodel.model.active import modify_physics
from ccmodel.model.general.run import settings_of
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad, TorqueLoad
from ccmodel.model.parameters import Parameters, mechanism_key
from ccmodel.model.run import spring_load, transmission_of
from ccmodel.model.session import of_recording
from ccmodel.recording import Recording

# Friction and initial tension of a recording repeat to 1 % (docs/rig-log-format.md, Repeatability).
REPEATS_TO = 0.01
# Standard deviation of the torque of a load from the law of its spring, as a share: of a spring that is linear to a few
# per cent, as torsion springs are sold.
LAW_SHARE = 0.03
# Standard deviation of the model discrepancy of the drive torque as a share of its peak to peak so far, and travel of
# the drive over which it is one and the same.
TOLERANCE, LASTS_RAD = 0.005, 0.1
# Travel over which it counts once in the run that the intervals are linear about. With a law of the load that run stays
# near the law: if it followed the measured torque, an error of the initial tension would be a misfit in it, and the
# intervals of the angle too narrow (with 0.01 rad they held 75 % of true angles, with 0.3 rad 91 %). Without a law it
# stays nearer to the measured torque than the whole weight of the discrepancy would let it.
NEAR_LAW_RAD, NEARER_RAD = 1.0, 0.01
# Travel over which the torque of a load without a law changes as that of a locked one does, independently of the travel
# before: a tenth of what the drive crosses at a reversal, or less.
WANDERS_RAD = 3e-3
# A drive that moves less in a sample than this share of that travel counts as moving by as much.
SMALLEST_SHARE = 1e-6
# The effects of errors are simulated on every so many samples, that of a misfit with this share of the tensions.
EVERY, SHIFT = 4, 0.01
# Standard deviations from the middle to the ends of a 90 % interval.
HALF_WIDTH = 1.6449
# Columns of an estimate.
ESTIMATED = (THETA_OUT, TAU_OUT)
COLUMNS = tuple(f"{name}{end}" for name in ESTIMATED for end in ("", "_low", "_high"))
VISIBLE = "load_is_visible"


@dataclass(frozen=True)
class Estimated:
    """The load of one recording, sample by sample.

    Attributes
    ----------
    recording : Recording
    table : DataFrame
        Index ``time_s``; ``theta_out_rad`` and ``tau_out_Nm``, each with the ends of its 90 % interval
        (``theta_out_rad_low`` and so on), and ``load_is_visible``, whether the drive torque responds to the load.
    notes : tuple of str
        What of the model was left out.
    """

    recording: Recording
    table: pd.DataFrame
    notes: tuple[str, ...]


def estimated(
    recording: Recording,
    parameters: Parameters,
    sds: Mapping[str, float] | None = None,
    uses_law: bool = True,
    tolerance: float = TOLERANCE,
    angle_tolerance: float = 0.0,
) -> Estimated:
    """Estimate the load's torque and angle from the drive's side of a recording.

    Parameters
    ----------
    recording : Recording
        Of its channels, drive angle, drive torque and the drive's sum of tensions at rest are used.
    parameters : Parameters
    sds : mapping of str to float, optional
        Standard deviations of parameters, by name.
    uses_law : bool
        Whether the load's spring, if the model has one, is a source beside the drive torque.
    tolerance : float
        Standard deviation of the model discrepancy of the drive torque, as a share of its peak to peak so far.
    angle_tolerance : float
        The same of the load's angle, which widens its interval.

    Raises
    ------
    ModelError
        If there is no drive torque, or the model cannot be run.
    """
    if recording.far_end == "fixed":
        raise ModelError(f"{recording.batch}/{recording.id}: the far end is fixed: there is no load to estimate")
    problem = _Problem.of(recording, parameters, sds or {}, uses_law)
    once, nearer, lasting = problem.discrepancy(tolerance)
    nominal = problem.with_noise(once * nearer).run(problem.parameters)
    effects, outputs, by_misfit = problem.effects_of_errors(nominal)
    if problem.parameters.load_stiffness_Nm_per_rad is not None:
        noise = nominal.noise_variance + once * (lasting - nearer)
        measured = problem.drive.torque_Nm
        errors = problem.first_variance, noise, effects, outputs, by_misfit
        correction, spread = joint_estimate(nominal.trace, measured, *errors)
    else:
        # Without a law, the torque hardly tells an error of friction or tension from a load: no error is estimated, and
        # the model discrepancy is one of them.
        effects = np.concatenate([effects, np.sqrt(once)[None]])
        outputs = np.concatenate([outputs, np.zeros_like(outputs[:1])])
        errors = problem.first_variance, nominal.noise_variance, effects, outputs, by_misfit
        correction, spread = np.zeros_like(nominal.out), variances(nominal.trace, *errors)
    ratio = problem.parameters.drive_radius_m / problem.parameters.load_radius_m
    spread[0] += (problem.proximal.sigma_in * ratio) ** 2
    middle = nominal.out + correction
    middle[0] += problem.parameters.theta_out_zero_rad - nominal.out[0, 0]
    range_so_far = np.maximum.accumulate(middle[0]) - np.minimum.accumulate(middle[0])
    spread[0] += (angle_tolerance * range_so_far) ** 2
    half = HALF_WIDTH * np.sqrt(spread)
    columns = dict(zip(COLUMNS, (x for m, h in zip(middle, half, strict=True) for x in (m, m - h, m + h)), strict=True))
    table = pd.DataFrame(columns, index=pd.Index(recording.log_time_s, name="time_s"))
    table[VISIBLE] = nominal.trace[BY_MISFIT] > 0.0
    return Estimated(recording, table, problem.notes)


@dataclass(frozen=True)
class _Problem:
    """A recording's drive side, the model, and what is uncertain of both."""

    proximal: Proximal
    parameters: Parameters
    sds: Mapping[str, float]
    prior: Prior
    drive: Drive
    notes: tuple[str, ...]
    every: int = 1

    @classmethod
    def of(cls, recording: Recording, parameters: Parameters, sds: Mapping[str, float], uses_law: bool) -> "_Problem":
        parameters = of_recording(parameters, recording)
        if not uses_law:
            parameters = replace(parameters, load_stiffness_Nm_per_rad=None)
        kept, notes = _without_what_looks_ahead(parameters)
        proximal = Proximal.of(recording)
        has_law = kept.load_stiffness_Nm_per_rad is not None
        cables = 1 if recording.far_end else 2
        locked = cables * kept.stiffness_N_per_m * kept.reference_length_m / recording.path.length_m
        friction = float(
            np.hypot(REPEATS_TO, sds.get("friction_coefficient", 0.0) / max(kept.friction_coefficient, 1e-9))
        )
        prior = Prior(
            Considered(friction, proximal.torque_zero_Nm),
            LAW_SHARE,
            0.0 if has_law else (locked * kept.drive_radius_m * kept.load_radius_m) ** 2 * WANDERS_RAD,
        )
        drive = Drive(
            proximal.theta_in,
            proximal.torque_of(kept),
            proximal.lasting_variance,
            np.full(recording.time_s.size, proximal.torque_noise_Nm**2),
        )
        return cls(proximal, kept, sds, prior, drive, notes)

    @property
    def initial(self) -> InitialTension:
        """Tension before the drive moves."""
        return self.proximal.initial_tension(self.parameters)

    @property
    def drive_tensions_N(self) -> float:
        """Sum of the tensions at the drive before it moves."""
        initial, is_single = self.initial, self.proximal.recording.far_end is not None
        return float(initial.tension_A_N[0] + (0.0 if is_single else initial.tension_B_N[0]))

    @property
    def first_variance(self) -> float:
        """Variance of the load's torque before the drive moves, N^2 m^2.

        A rest has errors of its own in the place of it (`perturbed`).
        """
        if self.proximal.rests and self.parameters.pretension_N is None:
            return 0.0
        ends = self._at_load(self.initial)
        return float((FALL * UNIFORM * np.hypot(*ends) * self.parameters.load_radius_m) ** 2)

    def _at_load(self, initial: InitialTension) -> tuple[float, float]:
        """Initial tensions of A and B at the load, N; a single cable has no B."""
        of_B = 0.0 if self.proximal.recording.far_end else initial.tension_B_N[-1]
        return float(initial.tension_A_N[-1]), float(of_B)

    def run(
        self,
        parameters: Parameters,
        misfit_Nm: NDArray | None = None,
        shift_rad: float = 0.0,
        falls: tuple[float, float] = (FALL, FALL),
    ) -> Run:
        """A run of the filter, or of the model along a misfit, with the drive shifted after the first sample."""
        recording = self.proximal.recording
        transmission = transmission_of(recording, parameters)
        initial = self.proximal.initial_tension(parameters, falls)
        drive = self.drive
        if shift_rad:
            theta = drive.theta_rad + shift_rad
            theta[0] -= shift_rad
            drive = drive._replace(theta_rad=theta)
        K_e = parameters.load_stiffness_Nm_per_rad
        if not modify_physics(parameters.mechanisms) and not (K_e is None and parameters.spring_beside_load_Nm_per_rad):
            return exact.run(transmission, K_e or 0.0, initial, drive, self.prior, misfit_Nm)
        if K_e is None:
            of_A, of_B = self._at_load(initial)
            rest = (of_A - of_B) * transmission.load_radius_m
            load: SpringLoad | TorqueLoad = TorqueLoad(np.array([rest]), parameters.spring_beside_load_Nm_per_rad)
        else:
            load = spring_load(K_e, parameters, recording.accuracy)
        settings = settings_of(parameters.mechanisms)
        finer = parameters.refinement
        return general.run(
            transmission, load, settings, initial, recording.time_s[:: self.every], drive, self.prior, misfit_Nm, finer
        )

    def discrepancy(self, tolerance: float) -> tuple[NDArray, NDArray, NDArray]:
        """Variance of the model discrepancy of the torque (N^2 m^2), and samples over which it counts once and lasts.

        All have shape (n,). White noise of variance times samples weighs as much as one discrepancy over these samples.
        """
        torque, travel = self.drive.torque_Nm, np.abs(np.diff(self.drive.theta_rad, prepend=self.drive.theta_rad[0]))
        # Before the drive has moved far, the tensions tell what its torque will come to.
        range_so_far = np.maximum.accumulate(torque) - np.minimum.accumulate(torque)
        range_so_far = np.maximum(range_so_far, self.drive_tensions_N * self.parameters.drive_radius_m)
        travel = np.maximum(travel, LASTS_RAD * SMALLEST_SHARE)
        once_rad = NEARER_RAD if self.parameters.load_stiffness_Nm_per_rad is None else NEAR_LAW_RAD
        nearer, lasting = (np.maximum(length / travel, 1.0) for length in (once_rad, LASTS_RAD))
        return (tolerance * range_so_far) ** 2, nearer, lasting

    def with_noise(self, variance: NDArray) -> "_Problem":
        """The same with more noise in the torque, a variance of shape (n,)."""
        return replace(self, drive=self.drive._replace(torque_variance=self.drive.torque_variance + variance))

    def effects_of_errors(self, nominal: Run) -> tuple[NDArray, NDArray, NDArray]:
        """Effects of one standard deviation of each lasting error, and of a misfit, as of `joint_estimate`.

        They change slowly: every `EVERY`-th sample is simulated, and the effects hold until the next.
        """
        n = self.drive.theta_rad.size
        coarse = replace(self, drive=Drive(*(values[::EVERY] for values in self.drive)), every=EVERY)
        misfit = nominal.trace[MISFIT, ::EVERY]
        unperturbed = coarse.run(self.parameters, misfit)
        shift = SHIFT * self.drive_tensions_N * self.parameters.load_radius_m
        if shift <= 0.0:
            raise ModelError("the cables have no initial tension, so that the drive torque shows no load")
        runs = [coarse.run(self.parameters, misfit + shift), *coarse.perturbed(misfit)]
        torque = np.array([run.trace[EXPECTED] - unperturbed.trace[EXPECTED] for run in runs])
        torque[1] += self.proximal.torque_zero_Nm
        outputs = np.array([run.out - unperturbed.out for run in runs])
        outputs[:, 0] -= outputs[:, 0, :1]
        held = np.arange(n) // EVERY
        by_misfit = outputs[0][:, held] / shift
        # Until the load first shows at the drive, a misfit is no more than a torque that nothing tells of.
        by_misfit[1, np.cumsum(nominal.trace[BY_MISFIT]) == 0.0] = 1.0
        return torque[1:, held], outputs[1:, :, held], by_misfit

    def perturbed(self, misfit_Nm: NDArray) -> Iterator[Run]:
        """Runs with one error each, along the same misfit; first with the torque sensor's zero.

        A rest is read by the same sensor, so that its zero is one of the initial tensions too.
        """
        p = self.parameters
        yield self.run(replace(p, tau_in_zero_Nm=p.tau_in_zero_Nm + self.proximal.torque_zero_Nm), misfit_Nm)
        friction = p.friction_scale * (1 + self.prior.considered.friction)
        yield self.run(replace(p, friction_scale=friction), misfit_Nm)
        yield self.run(replace(p, pretension_scale=p.pretension_scale * (1 + REPEATS_TO)), misfit_Nm)
        for name, sd in self._uncertain():
            yield self._either_side(name, sd, misfit_Nm)
        if self.proximal.rest_offset_rad:
            yield self.run(p, misfit_Nm, shift_rad=self.proximal.rest_offset_rad)
        if self.proximal.rests and p.pretension_N is None:
            other = FALL * (1 - UNIFORM)
            yield self.run(p, misfit_Nm, falls=(other, FALL))
            if self.proximal.recording.far_end is None:
                yield self.run(p, misfit_Nm, falls=(FALL, other))

    def _uncertain(self) -> Iterator[tuple[str, float]]:
        """Further parameters with a standard deviation, and it."""
        known = {f.name for f in fields(Parameters) if getattr(self.parameters, f.name) is not None}
        known -= {"friction_coefficient", "theta_out_zero_rad", *ZERO_OF.values()}
        known |= {mechanism_key(m.name, m.place, name) for m in self.parameters.mechanisms for name in m.values}
        yield from ((name, sd) for name, sd in self.sds.items() if name in known and 0 < sd < np.inf)

    def _either_side(self, name: str, sd: float, misfit_Nm: NDArray) -> Run:
        """A run with a parameter one standard deviation higher, or lower where the model cannot be higher."""
        value = self.parameters.value_of(name)
        try:
            return self.run(self.parameters.with_values({name: value + sd}), misfit_Nm)
        except ModelError:
            return self.run(self.parameters.with_values({name: value - sd}), misfit_Nm)


def _without_what_looks_ahead(parameters: Parameters) -> tuple[Parameters, tuple[str, ...]]:
    """Parameters without mechanisms that no causal estimate can have, and a line on each."""
    kept = tuple(m for m in parameters.mechanisms if not registry.get(m.name).looks_ahead)
    left = [m for m in parameters.mechanisms if m not in kept]
    notes = tuple(f"{m.name} at {m.place} is left out: it depends on later samples" for m in left)
    return replace(parameters, mechanisms=kept), notes
