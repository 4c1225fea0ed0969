"""Initial state and result of a run."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Preparation:
    """Initial state of one run.

    Attributes
    ----------
    friction_coefficient : float
        Friction coefficient mu between cables and conduits in this run.
    pretension_N : tuple of float
        Mean tension along the conduit, of cables A and B, N.
    profile_share : tuple of float
        Fall of ln T from the drive end to the load end over mu phi, for cables A and B.
    ran_in_before : float
        Time or travel before the first sample, over the scale of the running-in.
    profile_curvature : tuple of float
        Half of the change of that slope along the conduit, for cables A and B.
    tensioned_before_s : float
        Time between the tensioning of the cables and the first sample, in which they have relaxed, s.
    """

    friction_coefficient: float
    pretension_N: tuple[float, float]
    profile_share: tuple[float, float]
    ran_in_before: float = 0.0
    profile_curvature: tuple[float, float] = (0.0, 0.0)
    tensioned_before_s: float = 0.0

    def bristles(self, cells: int) -> NDArray:
        """Slope of ln T over mu in each cell of cables A and B, shape (2, cells); friction holds no more than 1."""
        along = 1 - 2 * (np.arange(cells) + 0.5) / cells
        share, curvature = (np.array(of)[:, None] for of in (self.profile_share, self.profile_curvature))
        return np.clip(share + curvature * along, -1.0, 1.0)


@dataclass(frozen=True)
class Trajectory:
    """True quantities of a run, without sensors; every array has shape (samples,).

    Tensions are those of the paper, in N: T1 and T2 of cable A, T3 and T4 of cable B, each at the drive and the load
    end. The zero of `theta_out_rad` is the neutral position of the load spring. `tau_in_Nm` is the torque of the drive
    on its pulley, `tau_out_Nm` the torque on the load beyond the bearing of the load pulley.
    """

    time_s: NDArray
    theta_in_rad: NDArray
    theta_out_rad: NDArray
    T1_N: NDArray
    T2_N: NDArray
    T3_N: NDArray
    T4_N: NDArray
    tau_in_Nm: NDArray
    tau_out_Nm: NDArray


class SimulationError(RuntimeError):
    """A tension exceeded the limit that the time step was chosen for."""


def check_tensions(tensions_N: NDArray, limit_N: float) -> None:
    """Refuse tensions that are not finite or exceed the limit."""
    # In this form a NaN is refused too.
    if not tensions_N.max() <= limit_N:
        raise SimulationError(
            f"a tension exceeded the {limit_N} N that the time step was chosen for; "
            "lower the amplitude or raise numerics.tension_limit_N"
        )
