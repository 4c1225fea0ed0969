"""What a run starts from and what it gives."""

from dataclasses import dataclass

from numpy.typing import NDArray


@dataclass(frozen=True)
class Preparation:
    """How the rig was strung for one run.

    Attributes
    ----------
    friction_coefficient : float
        Coefficient mu between cables and conduits in this run.
    pretension_N : float
        Tension of both cables, N, as the mean along the conduit.
    profile_share : tuple of float
        By which share of mu phi ln T falls from the drive end to the load end, for cables A and B.
    """

    friction_coefficient: float
    pretension_N: float
    profile_share: tuple[float, float]


@dataclass(frozen=True)
class Trajectory:
    """What truly happened, before any sensor; every array has shape (samples,).

    Tensions are those of the paper: T1, T2 of cable A and T3, T4 of cable B at the drive and the load end, N. Angles
    are in rad; `theta_out_rad` counts from the load spring's neutral. `tau_in_Nm` is the torque of the drive on its
    pulley, `tau_out_Nm` the torque on what hangs on the load pulley, beyond its bearing.
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
    """The simulation left the range its time step was chosen for."""


def check_tensions(tensions_N: NDArray, limit_N: float) -> None:
    """Refuse tensions that are not finite or exceed the limit."""
    # Written so that a NaN fails it too.
    if not tensions_N.max() <= limit_N:
        raise SimulationError(
            f"a tension left the {limit_N} N that the time step was chosen for; "
            "lower the amplitude or raise numerics.tension_limit_N"
        )
