"""What every solver says of a run of the pair, and how a run can end."""

from dataclasses import dataclass
from enum import Enum

from numpy.typing import NDArray

from ccmodel.failure import ModelError


class Status(Enum):
    """How a simulation ended; the text says what to do about it."""

    OK = "every sample was reached"
    UNBALANCED = (
        "the cables do not balance the load: check the stiffness of the load's spring against that of the cables"
    )
    NO_CONVERGENCE = (
        "the cables and the load find no balance there, not in the smallest substep either: look at the load torque"
        " and at the drive's step before this sample, keep parameters within their ranges, or give friction a"
        " presliding length"
    )


@dataclass(frozen=True, kw_only=True)
class PairResponse:
    """What a pair of cables did, sample by sample; after a failure the samples that were not reached are left out.

    Attributes
    ----------
    T1_N, T2_N, T3_N, T4_N : ndarray, shape (n,)
        Tensions at the cables' ends (A: 1 drive, 2 load; B: 3, 4), N; none is below zero.
    theta_out_rad : ndarray, shape (n,)
        Angle of the load pulley: from the neutral position of a spring load, else from the start.
    tau_in_Nm, tau_out_Nm : ndarray, shape (n,)
        Torque of the drive on its pulley, and of the cables on the load, N m.
    status : Status
    reached : int
        Number of samples that were reached.
    """

    T1_N: NDArray
    T2_N: NDArray
    T3_N: NDArray
    T4_N: NDArray
    theta_out_rad: NDArray
    tau_in_Nm: NDArray
    tau_out_Nm: NDArray
    status: Status
    reached: int

    def complete(self):
        """Itself if every sample was reached in balance.

        Raises
        ------
        ModelError
            With the status's advice, if not.
        """
        if self.status is not Status.OK:
            name = self.status.name.lower().replace("_", "-")
            raise ModelError(f"{name} at sample {self.reached}: {self.status.value}")
        return self
