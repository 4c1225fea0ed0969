"""Loads that the transmission can work against."""

from dataclasses import dataclass

from numpy.typing import NDArray


@dataclass(frozen=True)
class SpringLoad:
    """A torsional spring: tau_out = K_e theta_out, theta_out counted from the spring's neutral position.

    The paper's (21) counts the load's torque on the pulley, hence its opposite sign.
    """

    stiffness_Nm_per_rad: float

    def __post_init__(self):
        if not self.stiffness_Nm_per_rad > 0:
            raise ValueError(
                f"a spring load needs a positive stiffness; got {self.stiffness_Nm_per_rad} N m/rad. "
                "A free load is TorqueLoad with zero torque"
            )


@dataclass(frozen=True)
class TorqueLoad:
    """A torque prescribed at every sample, such as the one measured at the load pulley, N m, shape (n,)."""

    torque_Nm: NDArray
