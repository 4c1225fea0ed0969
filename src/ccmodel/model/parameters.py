"""The numbers that a run of the model needs besides the recording it is compared with."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ccmodel.channels import TABLE, THETA_OUT, ZERO_OF
from ccmodel.model.general.run import Active


@dataclass(frozen=True)
class Parameters:
    """Parameters of the paper's model for one batch, as estimated beforehand or as fitted.

    Attributes
    ----------
    stiffness_N_per_m : float
        Stiffness k of cable and conduit together over `reference_length_m`.
    reference_length_m : float
        The length that `stiffness_N_per_m` was measured on, m; their product is the axial rigidity K of (5).
    friction_coefficient : float
        mu.
    drive_radius_m, load_radius_m : float
        Pulley radii.
    load_stiffness_Nm_per_rad : float or None
        K_e of the spring load; None where the load is what was measured at the load pulley.
    spring_beside_load_Nm_per_rad : float
        Where the load is a measured torque: a spring at the load pulley that the torque's sensor does not feel.
    pretension_N : float or None
        Initial tension, the same all along both cables; None takes from each recording what its rest shows.
    pretension_share : float
        Initial tension over what each recording was aimed at, where no rest shows it.
    tau_in_zero_Nm, tau_out_zero_Nm : float
        What the torque sensors read without a torque.
    theta_out_zero_rad : float
        Angle of the load that its encoder shows as none: where in its count it rests.
    drive_encoder_offset : float
        Where in its count the drive first rests, in standard deviations of what its motion says of that.
    load_gap_position : float
        Where in its gap the load first rests, -1 to 1, as far as the torque there does not tell.
    F_drive_zero_N, F_load_zero_N : float
        What the load cells read without a tension.
    extra_bend_rad : float
        Bend beyond what the path states, spread evenly along it: slings, fittings, a conduit that is not laid straight.
    friction_scale, pretension_scale : float
        Friction and initial tension of one recording over what they are in the population, and over what its rest
        shows.
    tension_curvature_A, tension_curvature_B : float
        How each cable's initial tension bends between the ends that its rest shows, of what friction can hold, -1 to
        1 (`ccmodel.model.initial.InitialTension.between_ends`).
    mechanisms : tuple of Active
        What acts besides the paper's physics.
    refinement : int
        By how much the general solver's grid and steps are finer than usual, to see what they cost.
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
    refinement: int = 1

    @property
    def friction(self) -> float:
        """Mu in this recording."""
        return self.friction_coefficient * self.friction_scale

    @classmethod
    def estimated(cls, rig) -> "Parameters":
        """The beforehand estimates that a batch file states (`ccmodel.rig.batch.Rig`)."""
        return cls(
            stiffness_N_per_m=rig.cable.stiffness_N_per_m,
            reference_length_m=rig.cable.length_m,
            friction_coefficient=rig.cable.friction_coefficient,
            drive_radius_m=rig.drive.pulley_radius_m,
            load_radius_m=rig.load.pulley_radius_m,
            load_stiffness_Nm_per_rad=rig.load.spring_stiffness_Nm_per_rad,
        )

    def with_values(self, values: Mapping[str, float]) -> "Parameters":
        """The same with some of them replaced.

        Parameters
        ----------
        values : mapping of str to float
            By the names of the attributes, and for a number of a mechanism by `mechanism_key`.

        Raises
        ------
        ValueError
            If no active mechanism has such a number.
        """
        own = {name: value for name, value in values.items() if mechanism_parameter(name) is None}
        acting = {(m.name, m.place): dict(m.values) for m in self.mechanisms}
        for key in values.keys() - own.keys():
            name, place, parameter = mechanism_parameter(key)
            if parameter not in acting.get((name, place), {}):
                raise ValueError(f"{key}: the model has no {parameter} of {name} at {place}")
            acting[name, place][parameter] = values[key]
        mechanisms = tuple(Active(name, place, numbers) for (name, place), numbers in acting.items())
        return replace(self, **own, mechanisms=mechanisms)

    def value_of(self, name: str) -> float:
        """One of them, by the names that `with_values` takes."""
        if (parts := mechanism_parameter(name)) is None:
            return getattr(self, name)
        mechanism, place, parameter = parts
        return next(m.values[parameter] for m in self.mechanisms if (m.name, m.place) == (mechanism, place))


def mechanism_key(mechanism: str, place: str, parameter: str) -> str:
    """The name under which a mechanism's number stands among the parameters."""
    return f"{mechanism}/{place}/{parameter}"


def mechanism_parameter(key: str) -> tuple[str, str, str] | None:
    """Mechanism, place and parameter of a name that `mechanism_key` made; None for any other."""
    parts = key.split("/")
    return tuple(parts) if len(parts) == 3 else None


# Names that model files keep, and configuration files may still have, for what is called otherwise here.
FORMER_NAMES = {
    "drive_place": "drive_encoder_offset",
    "load_place": "load_gap_position",
    "profile_bow_A": "tension_curvature_A",
    "profile_bow_B": "tension_curvature_B",
}

# What each recording has of its own, and what all share; lengths and the drive radius only scale what is among these.
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
