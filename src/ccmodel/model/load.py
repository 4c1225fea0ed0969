"""Loads that the transmission can work against."""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

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
        How well the torque is known with which a run begins; >= 0. Where there is a gap, a smaller one does not tell
        which of its sides the load lies against.
    rest_gap_position : float
        Where in the gap it rests then, -1 to 1.
    """

    stiffness_Nm_per_rad: float
    rest_known_to_Nm: float = 0.0
    rest_gap_position: float = 0.0

    def __post_init__(self):
        if not (np.isfinite(self.stiffness_Nm_per_rad) and self.stiffness_Nm_per_rad >= 0):
            raise ModelError(
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
    beside_Nm_per_rad : float
        A spring that holds the load pulley too and that the torque's sensor does not feel, slack where a run starts;
        >= 0.
    """

    torque_Nm: NDArray
    beside_Nm_per_rad: float = 0.0

    def __post_init__(self):
        if not 0 <= self.beside_Nm_per_rad < inf:
            raise ModelError(f"a spring beside a load is finite and not negative; got {self.beside_Nm_per_rad}")
        object.__setattr__(self, "torque_Nm", series(self.torque_Nm, "torque_Nm"))


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
        object.__setattr__(self, "angle_rad", series(self.angle_rad, "angle_rad"))


def series(values, name: str) -> NDArray:
    """`values` as one finite number a sample, at least one; `ModelError` where they are not."""
    values = np.ascontiguousarray(values, dtype=float)
    if values.ndim != 1 or values.size == 0:
        raise ModelError(f"{name} is one row of samples, at least one; got an array of shape {values.shape}")
    if not np.isfinite(values).all():
        at = np.flatnonzero(~np.isfinite(values))[0]
        raise ModelError(f"{name} is not finite at sample {at}: leave the sample out, or fill the gap")
    return values
