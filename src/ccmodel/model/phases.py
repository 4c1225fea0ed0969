"""A sine of the drive in the terms of the paper's Section IV: phases I to IV, and instants 1 to 8 between them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.model.exact import PHASES, ExactResponse, simulate_pair
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission

PAPERS_PHASES = ("I", "II", "III", "IV")


@dataclass(frozen=True)
class PhaseStudy:
    """A quarter of a cycle from rest, then the cycle from the first reversal of the drive to the third.

    Attributes
    ----------
    time_s, theta_in_rad : ndarray, shape (5 n / 4 + 1,)
        n samples a cycle.
    response : ExactResponse
        With profiles at the samples of `instants` and `halfway`.
    phase : ndarray of int, shape (5 n / 4 + 1,)
        Index into `PAPERS_PHASES`.
    instants : dict of int to int
        Sample of each of the paper's instants 1 to 8: 1 and 5 a reversal; 2 and 6, 3 and 7, 4 and 8 where phase II,
        III, IV begins after it. An instant whose phase does not occur is absent.
    halfway : dict of int to int
        Sample halfway through the phase II that begins at instant 2 or 6, in which the tension's hump stands out.
    """

    time_s: NDArray
    theta_in_rad: NDArray
    response: ExactResponse
    phase: NDArray
    instants: dict[int, int]
    halfway: dict[int, int]

    @property
    def first_reversal(self) -> int:
        """Sample of the drive's first reversal, at which the cycle begins."""
        return (self.time_s.size - 1) // 5


def simulate_phases(
    transmission: Transmission,
    load: SpringLoad,
    pretension_N: float,
    amplitude_rad: float,
    frequency_Hz: float,
    samples_per_cycle: int,
) -> PhaseStudy:
    """Move the drive in a sine from rest to its third reversal.

    Parameters
    ----------
    transmission : Transmission
        Path, cables and pulleys.
    load : SpringLoad
        What the load pulley drives.
    pretension_N : float
        Initial tension, N, the same all along both cables.
    amplitude_rad, frequency_Hz : float
        Of the drive angle.
    samples_per_cycle : int
        A multiple of 4, so that the reversals fall on samples.
    """
    i = np.arange(5 * samples_per_cycle // 4 + 1)
    theta_in = amplitude_rad * np.sin(2 * np.pi * i / samples_per_cycle)
    initial = InitialTension.uniform(transmission.path, pretension_N)
    response = simulate_pair(transmission, load, theta_in, initial)
    phase = papers_phases(response)
    instants = _instants(phase, samples_per_cycle)
    halfway: dict[int, int] = {
        k: (instants[k] + instants[k + 1]) // 2 for k in (2, 6) if k in instants and k + 1 in instants
    }
    # The instants follow from the response; a second run, of milliseconds, keeps the profiles there.
    wanted = sorted({*instants.values(), *halfway.values()})
    response = simulate_pair(transmission, load, theta_in, initial, record_profiles_at=wanted)
    return PhaseStudy(i / (samples_per_cycle * frequency_Hz), theta_in, response, phase, instants, halfway)


def papers_phases(response: ExactResponse) -> NDArray:
    """Phase of each sample after the paper's Figs. 5 to 7, an index into `PAPERS_PHASES`; shape (n,).

    In the paper phase I follows the reversal that ends phase IV, since the load rests. One cable still hangs slack
    then, which the solver calls IVb; such samples count as phase I while the load rests.
    """
    rests = np.diff(response.theta_out_rad, prepend=np.nan) == 0
    through_reversal = response.phase == PHASES.index("IVb")
    return np.where(through_reversal & rests, 0, np.minimum(response.phase, PAPERS_PHASES.index("IV")))


def _instants(phase: NDArray, samples_per_cycle: int) -> dict[int, int]:
    """Sample of each of the paper's instants that occurs."""
    found = {}
    for first, reversal in ((1, samples_per_cycle // 4), (5, 3 * samples_per_cycle // 4)):
        found[first] = reversal
        stroke = phase[reversal + 1 : reversal + samples_per_cycle // 2]
        for later in range(1, len(PAPERS_PHASES)):
            at = np.flatnonzero(stroke == later)
            if at.size:
                found[first + later] = reversal + 1 + int(at[0])
    return found
