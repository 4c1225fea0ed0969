"""The transmission: path, cables and pulleys."""

from dataclasses import dataclass
from math import inf

from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath

# Beyond this mu phi the capstan factor is out of the range of double precision.
MAX_FRICTION_ANGLE = 300.0


@dataclass(frozen=True)
class Transmission:
    """A pull-pull pair of equal cables in equal conduits between a drive and a load pulley, or cable A alone.

    Attributes
    ----------
    path : ConduitPath
        The conduits' common path.
    axial_rigidity_N : float
        K of the paper's (5), T = K u' with u' the strain: stiffness of a length of cable times that length, N.
    friction_coefficient : float
        mu between cable and conduit.
    drive_radius_m, load_radius_m : float
        Pulley radii R_i and R_o, m.
    is_single_cable : bool
        Whether cable B is absent.
    """

    path: ConduitPath
    axial_rigidity_N: float
    friction_coefficient: float
    drive_radius_m: float
    load_radius_m: float
    is_single_cable: bool = False

    def __post_init__(self) -> None:
        for name in ("axial_rigidity_N", "drive_radius_m", "load_radius_m"):
            if not 0 < getattr(self, name) < inf:
                raise ModelError(f"{name} must be positive and finite; got {getattr(self, name)}: check its unit")
        mu = self.friction_coefficient
        if not 0 <= mu < inf:
            raise ModelError(
                f"friction_coefficient must be finite and not negative; got {mu}: in a fit, give it a lower bound of 0"
            )
        if mu * self.path.bend_rad > MAX_FRICTION_ANGLE:
            raise ModelError(
                f"mu phi = {mu * self.path.bend_rad:.4g} is beyond {MAX_FRICTION_ANGLE}: the capstan factor exp(mu phi)"
                " is out of range; check the unit of the bend angles"
            )
