"""The response that every solver returns, and how a simulation can end."""

from dataclasses import dataclass
from enum import Enum
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import F_DRIVE, F_LOAD, TAU_IN, TAU_OUT, THETA_IN, THETA_OUT
from ccmodel.failure import ModelError


class Status(Enum):
    """How a simulation ended; the text advises what to do about it."""

    OK = "every sample was reached"
    UNBALANCED = (
        "the cables do not balance the load: check the stiffness of the load's spring against that of the cables"
    )
    NO_CONVERGENCE = (
        "no balance of cables and load was found there, not even in the smallest substep: check the load torque and"
        " the drive's step before this sample, keep parameters within their ranges, or give friction a presliding"
        " length"
    )


@dataclass(frozen=True, kw_only=True)
class PairResponse:
    """Response of a pair of cables, sample by sample; after a failure it ends with the last sample that was solved.

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
        Number of samples that were solved.
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

    def channels(self, theta_in_rad: NDArray) -> dict[str, NDArray]:
        """What sensors without faults measure, by channel: angles, torques and sums of tensions."""
        return {
            THETA_IN: theta_in_rad,
            THETA_OUT: self.theta_out_rad,
            TAU_IN: self.tau_in_Nm,
            TAU_OUT: self.tau_out_Nm,
            F_DRIVE: self.T1_N + self.T3_N,
            F_LOAD: self.T2_N + self.T4_N,
        }

    def complete(self, samples: NDArray | None = None) -> Self:
        """The response itself, if every sample was solved in balance.

        Parameters
        ----------
        samples : ndarray of int, optional
            Indices of a recording's samples among those of the response, which may have turning points between them.

        Raises
        ------
        ModelError
            With the advice of the status, and the first sample of the recording that was not solved, if not.
        """
        if self.status is not Status.OK:
            name = self.status.name.lower().replace("_", "-")
            at = self.reached if samples is None else np.searchsorted(samples, self.reached)
            raise ModelError(f"{name} at sample {at}: {self.status.value}")
        return self
