"""What the load pulley drives: the relation between its torque tau_out and its angle theta_out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class SpringLoad:
    """A torsion spring, tau_out = K_e theta_out (the paper's (21), with the sign of the cables' torque on the load).

    Parameters
    ----------
    stiffness_Nm_per_rad : float
        K_e >= 0; zero is a load that turns freely.
    """

    stiffness_Nm_per_rad: float

    def __post_init__(self):
        if not (np.isfinite(self.stiffness_Nm_per_rad) and self.stiffness_Nm_per_rad >= 0):
            raise ValueError(
                f"a load spring's stiffness is finite and not negative; got {self.stiffness_Nm_per_rad}"
                " (for a blocked load use AngleLoad with a constant angle)"
            )


@dataclass(frozen=True)
class TorqueLoad:
    """A torque known at every sample, as measured at the load pulley; linear in between.

    Parameters
    ----------
    torque_Nm : ndarray, shape (n,)
        tau_out, the torque of the cables on the load.
    """

    torque_Nm: NDArray

    def __post_init__(self):
        object.__setattr__(self, "torque_Nm", _series(self.torque_Nm, "torque_Nm"))


@dataclass(frozen=True)
class AngleLoad:
    """An angle known at every sample, as measured at the load pulley; linear in between.

    Parameters
    ----------
    angle_rad : ndarray, shape (n,)
        theta_out; constant for a load that is blocked.
    """

    angle_rad: NDArray

    def __post_init__(self):
        object.__setattr__(self, "angle_rad", _series(self.angle_rad, "angle_rad"))


def _series(values, name: str) -> NDArray:
    values = np.ascontiguousarray(values, dtype=float)
    if values.ndim != 1 or values.size == 0 or not np.isfinite(values).all():
        raise ValueError(f"{name} is one finite value a sample; got an array of shape {values.shape}")
    return values
