"""The numbers that a run of the model needs besides the recording it is compared with."""

from dataclasses import dataclass, fields, replace


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
    pretension_N : float or None
        Initial tension, the same all along both cables; None takes from each recording what its rest shows.
    tau_in_zero_Nm, tau_out_zero_Nm : float
        What the torque sensors read without a torque.
    """

    stiffness_N_per_m: float
    reference_length_m: float
    friction_coefficient: float
    drive_radius_m: float
    load_radius_m: float
    load_stiffness_Nm_per_rad: float | None = None
    pretension_N: float | None = None
    tau_in_zero_Nm: float = 0.0
    tau_out_zero_Nm: float = 0.0

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

    def with_values(self, values: dict[str, float]) -> "Parameters":
        """The same with some of them replaced."""
        return replace(self, **values)


# What a fit may leave free; lengths and the drive radius only scale what is among these.
FREE = tuple(f.name for f in fields(Parameters) if f.name not in ("reference_length_m", "drive_radius_m"))
