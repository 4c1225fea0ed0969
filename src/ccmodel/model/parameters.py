"""Parameters of the model: everything that a run needs beyond the recording it is compared with."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ccmodel.channels import TABLE, THETA_OUT, ZERO_OF
from ccmodel.model.active import Active
from ccmodel.rig.batch import Rig


@dataclass(frozen=True)
class Parameters:
    """Parameters of the model for one batch, as estimated beforehand or as fitted.

    Attributes
    ----------
    stiffness_N_per_m : float
        Stiffness k of cable and conduit together over `reference_length_m`.
    reference_length_m : float
        Length that `stiffness_N_per_m` was measured on, m; their product is the axial rigidity K of the paper's (5).
    friction_coefficient : float
        mu between cable and conduit.
    drive_radius_m, load_radius_m : float
        Pulley radii.
    load_stiffness_Nm_per_rad : float or None
        K_e of the spring load; None where the load is a measurement.
    spring_beside_load_Nm_per_rad : float
        Stiffness of a spring in parallel with a measured load torque, which the torque sensor does not feel.
    pretension_N : float or None
        Initial tension, uniform along the cables; None takes the tension observed at each recording's rest.
    pretension_share : float
        Initial tension over each recording's nominal pretension, if it is not observed at rest.
    tau_in_zero_Nm, tau_out_zero_Nm : float
        Readings of the torque sensors without a torque.
    theta_out_zero_rad : float
        Angle of the load at its encoder's zero: the encoder's sub-count offset at rest.
    drive_encoder_offset : float
        Sub-count offset of the drive's encoder at the first rest, in standard deviations of its estimate from the
        motion.
    load_gap_position : float
        Position of the load in its gap at the first rest, -1 to 1, where the torque does not show it.
    F_drive_zero_N, F_load_zero_N : float
        Readings of the load cells without a tension.
    extra_bend_rad : float
        Bend beyond that of the stated path, even along it: slings, fittings, a conduit that is not laid straight.
    friction_scale, pretension_scale : float
        Friction of one recording over that of all, and initial tension over that observed at its rest.
    tension_curvature_A, tension_curvature_B : float
        Curvature of each cable's initial tension between its ends, over the largest that friction can hold, -1 to 1
        (``ccmodel.model.initial.InitialTension.between_ends``).
    mechanisms : tuple of Active
        Effects beyond the paper's physics.
    session_start_s, session_end_s : float or None
        When the first and the last recording of the session started that the model was fitted to, s since 1970 (UTC).
        None: not stated for all of them.
    refinement : int
        Factor by which the general solver's grid and steps are finer than usual, to measure their error.
    """

    stiffness_N_per_m: float
    reference_length_m: float
    friction_coefficient: float
    drive_radius_m: float
    load_radius_m: float
    load_stiffness_Nm_per_rad: float | None = None
    spring_beside_load_Nm_per_rad: float = 0.0
    pretension_N: float | None = None
    pretension_share: float = 1.0
    tau_in_zero_Nm: float = 0.0
    tau_out_zero_Nm: float = 0.0
    theta_out_zero_rad: float = 0.0
    drive_encoder_offset: float = 0.0
    load_gap_position: float = 0.0
    F_drive_zero_N: float = 0.0
    F_load_zero_N: float = 0.0
    extra_bend_rad: float = 0.0
    friction_scale: float = 1.0
    pretension_scale: float = 1.0
    tension_curvature_A: float = 0.0
    tension_curvature_B: float = 0.0
    mechanisms: tuple[Active, ...] = ()
    session_start_s: float | None = None
    session_end_s: float | None = None
    refinement: int = 1

    @property
    def friction(self) -> float:
        """Mu in this recording."""
        return self.friction_coefficient * self.friction_scale

    @classmethod
    def estimated(cls, rig: Rig) -> "Parameters":
        """Estimates made beforehand, as a batch file states them (``ccmodel.rig.batch.Rig``)."""
        return cls(
            stiffness_N_per_m=rig.cable.stiffness_N_per_m,
            reference_length_m=rig.cable.length_m,
            friction_coefficient=rig.cable.friction_coefficient,
            drive_radius_m=rig.drive.pulley_radius_m,
            load_radius_m=rig.load.pulley_radius_m,
            load_stiffness_Nm_per_rad=rig.load.spring_stiffness_Nm_per_rad,
        )

    def with_values(self, values: Mapping[str, float], batch: str = "") -> "Parameters":
        """The same parameters with some values replaced.

        Parameters
        ----------
        values : mapping of str to float
            By attribute name, for a mechanism's parameter by `mechanism_key`, for what differs between batches of a rig
            by `batch_key`.
        batch : str
            Batch whose own values are taken; without it, no batch's own values are.

        Raises
        ------
        ValueError
            If no active mechanism has such a parameter.
        """
        values = of_batch(values, batch)
        own: dict[str, Any] = {name: value for name, value in values.items() if mechanism_parameter(name) is None}
        active = {(m.name, m.place): dict(m.values) for m in self.mechanisms}
        for key in values.keys() - own.keys():
            name, place, parameter = key.split("/")
            if parameter not in active.get((name, place), {}):
                raise ValueError(f"{key}: the model has no {parameter} of {name} at {place}")
            active[name, place][parameter] = values[key]
        mechanisms = tuple(Active(name, place, numbers) for (name, place), numbers in active.items())
        return replace(self, **own, mechanisms=mechanisms)

    def value_of(self, name: str) -> float:
        """Value of one parameter, by its name as in `with_values`."""
        if (parts := mechanism_parameter(name)) is None:
            return getattr(self, name)
        mechanism, place, parameter = parts
        return next(m.values[parameter] for m in self.mechanisms if (m.name, m.place) == (mechanism, place))


def mechanism_key(mechanism: str, place: str, parameter: str) -> str:
    """Name of a mechanism's parameter among the model's."""
    return f"{mechanism}/{place}/{parameter}"


def mechanism_parameter(key: str) -> tuple[str, str, str] | None:
    """Mechanism, place and parameter of a name made by `mechanism_key`; None for any other name."""
    parts = key.split("/")
    return (parts[0], parts[1], parts[2]) if len(parts) == 3 else None


def batch_key(name: str, batch: str) -> str:
    """Name, among the unknowns of several batches, of a parameter that this batch has a value of its own for."""
    return f"{name}@{batch}"


def parameter_of(key: str) -> str:
    """The parameter's name in a name made by `batch_key`; any other name as it is."""
    return key.partition("@")[0]


def acts_on(key: str, batch: str) -> bool:
    """Whether a value is one for all batches, or that of this one."""
    _, mark, of = key.partition("@")
    return not mark or of == batch


def of_batch(values: Mapping[str, float], batch: str) -> dict[str, float]:
    """Values of the recordings of one batch by parameter: those of all batches, and its own (`batch_key`)."""
    return {parameter_of(key): value for key, value in values.items() if acts_on(key, batch)}


# Printed units by the ending of a parameter's name.
_UNITS = {"_N_per_m": "N/m", "_Nm_per_rad": "N m/rad", "_Nm": "N m", "_N": "N", "_rad": "rad", "_m": "m"}


def unit_of_parameter(name: str) -> str:
    """SI unit of a parameter of `Parameters` as it is printed; 1 for a number."""
    return next((unit for ending, unit in _UNITS.items() if name.endswith(ending)), "1")


# Names in model files, and in older configuration files, of parameters that have another name here.
FORMER_NAMES = {
    "drive_place": "drive_encoder_offset",
    "load_place": "load_gap_position",
    "profile_bow_A": "tension_curvature_A",
    "profile_bow_B": "tension_curvature_B",
}

# Parameters that a fit may free for each recording, and for all together. Lengths and the drive radius are not among
# them: they only scale others.
OWN = (
    "friction_scale",
    "pretension_scale",
    "tension_curvature_A",
    "tension_curvature_B",
    "drive_encoder_offset",
    "load_gap_position",
    TABLE[THETA_OUT].zero,
    *ZERO_OF.values(),
)
FREE = (
    "stiffness_N_per_m",
    "friction_coefficient",
    "extra_bend_rad",
    "load_radius_m",
    "load_stiffness_Nm_per_rad",
    "spring_beside_load_Nm_per_rad",
    "pretension_N",
    *ZERO_OF.values(),
)
