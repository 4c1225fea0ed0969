"""What the model needs to know of a transmission: the pair of cables, the two pulleys and the load."""

from dataclasses import dataclass

from ccmodel.geometry import ConduitPath


@dataclass(frozen=True)
class Transmission:
    """A pull-pull pair of equal cables in equal conduits between a drive and a load pulley.

    Attributes
    ----------
    path : ConduitPath
        The conduits' common path.
    axial_rigidity_N : float
        K of the paper's (5), T = K u' with u' the strain: the product of the stiffness measured on a length and
        that length, N.
    friction_coefficient : float
        mu between cable and conduit.
    drive_radius_m, load_radius_m : float
        Pulley radii R_i and R_o, m.
    """

    path: ConduitPath
    axial_rigidity_N: float
    friction_coefficient: float
    drive_radius_m: float
    load_radius_m: float

    def __post_init__(self):
        for name in ("axial_rigidity_N", "drive_radius_m", "load_radius_m"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive; got {getattr(self, name)}")
        if not self.friction_coefficient >= 0:
            raise ValueError(f"friction_coefficient must not be negative; got {self.friction_coefficient}")
