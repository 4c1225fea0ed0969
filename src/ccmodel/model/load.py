"""Loads that the transmission works against."""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccmodel.failure import ModelError


@dataclass(frozen=True)
class SpringLoad:
    """A torsional spring: tau_out = K_e theta_out, theta_out counted from the spring's neutral position.

    A stiffness of zero is a load that turns freely. The paper's (21) counts the load's torque on the pulley, hence its
    opposite sign.

    Attributes
    ----------
    stiffness_Nm_per_rad : float
        K_e, >= 0.
    rest_known_to_Nm : float
        Uncertainty of the torque at the start of a run; >= 0. A smaller torque does not show which side of a gap the
        load touches.
    rest_gap_position : float
        Position in the gap at rest in that case, -1 to 1.
    """

    stiffness_Nm_per_rad: float
    rest_known_to_Nm: float = 0.0
    rest_gap_position: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.stiffness_Nm_per_rad) and self.stiffness_Nm_per_rad >= 0):
            raise ModelError(
                f"a load spring's stiffness is finite and not negative; got {self.stiffness_Nm_per_rad}"
                " (for a load that cannot move use FixedLoad)"
            )


@dataclass(frozen=True)
class TorqueLoad:
    """A torque known at every sample, as measured at the load pulley; linear in between.

    Parameters
    ----------
    torque_Nm : ndarray, shape (n,)
        tau_out, the torque of the cables on the load.
    parallel_Nm_per_rad : float
        A spring at the load pulley that the torque sensor does not feel, without torque at the start of a run; >= 0.
    """

    torque_Nm: NDArray
    parallel_Nm_per_rad: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.parallel_Nm_per_rad < inf:
            raise ModelError(
                f"a spring in parallel with a measured load is finite and not negative; got {self.parallel_Nm_per_rad}"
            )
        object.__setattr__(self, "torque_Nm", one_row(self.torque_Nm, "torque_Nm"))


@dataclass(frozen=True)
class AngleLoad:
    """An angle known at every sample, as measured at the load pulley; linear in between.

    Parameters
    ----------
    angle_rad : ndarray, shape (n,)
        theta_out; constant for a load that is blocked.
    """

    angle_rad: NDArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "angle_rad", one_row(self.angle_rad, "angle_rad"))


@dataclass(frozen=True)
class FixedLoad:
    """A load pulley, or the far end of a single cable, that does not move."""


Load = SpringLoad | TorqueLoad | AngleLoad | FixedLoad


def one_row(values: ArrayLike, name: str) -> NDArray:
    """`values` as an array of one finite number a sample; `ModelError` where they are not.

    Contiguous and writable: numba compiles a kernel anew for each other kind of array.
    """
    values = np.require(values, float, ["C", "W"])
    if values.ndim != 1 or values.size == 0:
        raise ModelError(f"{name} is one row of samples, at least one; got an array of shape {values.shape}")
    if not np.isfinite(values).all():
        at = np.flatnonzero(~np.isfinite(values))[0]
        raise ModelError(f"{name} is not finite at sample {at}: leave the sample out, or fill the gap")
    return values
