"""The exact solver on one cable: plain arrays in, plain arrays out."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from numpy.typing import NDArray

from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.model.exact.profile import CableProfile
from ccmodel.model.exact.simulation import Simulation
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import series
from ccmodel.model.response import Status
from ccmodel.model.transmission import check_friction


@dataclass(frozen=True)
class CableResponse:
    """Response of a single cable, sample by sample.

    Attributes
    ----------
    T_near_N, T_far_N : ndarray, shape (n,)
        Tensions at the driven end and at the far end.
    far_displacement_m : ndarray, shape (n,)
        Displacement of the far end into the conduit.
    moving_m : ndarray, shape (n, 2)
        As `ccmodel.model.exact.pair.ExactResponse.moving_A_m`.
    status : Status
    profiles : dict of int to CableProfile
        At the requested samples.
    """

    T_near_N: NDArray
    T_far_N: NDArray
    far_displacement_m: NDArray
    moving_m: NDArray
    status: Status
    profiles: dict[int, CableProfile]


def simulate_cable(
    path: ConduitPath,
    axial_rigidity_N: float,
    friction_coefficient: float,
    far_stiffness_N_per_m: float,
    displacement_m: NDArray,
    initial: InitialTension,
    record_profiles_at: Sequence[int] = (),
) -> CableResponse:
    """Response of one cable, cable A of `initial`, to a motion of its near end; the same solver as for a pair.

    Parameters
    ----------
    path : ConduitPath
        From the near, driven end to the far end.
    axial_rigidity_N : float
        EA, N.
    friction_coefficient : float
        mu between cable and conduit.
    far_stiffness_N_per_m : float
        Stiffness of the spring at the far end, which carries the initial tension there; infinite for a fixed end.
    displacement_m : ndarray, shape (n,)
        Displacement of the near end out of the conduit (a pull is positive), zero where the initial tension stands.
    initial : InitialTension
        Its cable B plays no part.
    record_profiles_at : sequence of int
        Samples at which the tension along the cable is kept.

    Raises
    ------
    ModelError
        If an input is not finite or out of range, or friction cannot hold the initial tension.
    """
    if not 0 < axial_rigidity_N < inf:
        raise ModelError(f"axial_rigidity_N must be positive and finite; got {axial_rigidity_N}")
    if not far_stiffness_N_per_m >= 0:
        raise ModelError(f"a far spring's stiffness is not negative; got {far_stiffness_N_per_m}")
    check_friction(friction_coefficient, path)
    drive = series(displacement_m, "displacement_m")
    simulation = Simulation(path, friction_coefficient, axial_rigidity_N, initial, single=True).run(
        drive, 1.0, float(initial.tension_A_N[-1]), float(far_stiffness_N_per_m), record_profiles_at
    )
    return CableResponse(
        T_near_N=simulation.out[0],
        T_far_N=simulation.out[1],
        far_displacement_m=simulation.out[4],
        moving_m=simulation.out[5:7].T,
        status=simulation.status,
        profiles={i: profiles[0] for i, profiles in simulation.profiles.items()},
    )
