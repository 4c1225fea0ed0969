"""The exact solver on a pull-pull pair or a single cable: plain arrays in, plain arrays out."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import T1, T2, T3, T4, TENSIONS
from ccmodel.failure import ModelError
from ccmodel.model.exact import run as kernels
from ccmodel.model.exact.path import tabulate
from ccmodel.model.exact.profile import CableProfile, cable_profile, initial_state
from ccmodel.model.exact.state import T_DRIVE, T_LOAD
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import FixedLoad, SpringLoad, one_row
from ccmodel.model.response import PairResponse, Status
from ccmodel.model.transmission import Transmission

__all__ = ["PHASES", "ExactResponse", "Status", "simulate_pair"]

PHASES = ("I", "II", "III", "IVa", "IVb")
# A load that balances to less than this share of the highest tension is balanced.
BALANCE_TOLERANCE = 1e-9
# Least force whose balance is judged, N: of slack cables against a free load nothing but rounding errors is left.
LEAST_N = 1e-3


@dataclass(frozen=True, kw_only=True)
class ExactResponse(PairResponse):
    """Response of the exact solver.

    Attributes
    ----------
    phase : ndarray of int8, shape (n,)
        Index into `PHASES`: I neither cable's drive-end front has reached the load, II one has, III both have, IVa a
        cable is slack while the drive continues, IVb a cable stays slack through a reversal of the drive.
    moving_A_m, moving_B_m : ndarray, shape (n, 2)
        Arc length up to which the cable has slid from its drive end, and from which on it has slid towards its load
        end, since the last reversal; it sticks in between. (L, 0) where it slides as a whole.
    profiles : dict of int to tuple of CableProfile
        Profiles of A and, for a pair, of B at the requested samples.
    """

    phase: NDArray
    moving_A_m: NDArray
    moving_B_m: NDArray
    profiles: dict[int, tuple[CableProfile, ...]]


def simulate_pair(
    transmission: Transmission,
    load: SpringLoad | FixedLoad,
    theta_in_rad: NDArray,
    initial: InitialTension,
    record_profiles_at: Sequence[int] = (),
) -> ExactResponse:
    """Response of a transmission under Coulomb friction to a motion of its drive pulley, without a grid.

    The result depends on the order of the samples, not on time; the drive moves monotonically between samples. A
    spring starts where it holds the initial tensions. A load that turns freely and does not hold them settles before
    the drive moves.

    Parameters
    ----------
    transmission : Transmission
        Path, cables and pulleys.
    load : SpringLoad or FixedLoad
    theta_in_rad : ndarray, shape (n,)
        Angle of the drive pulley, zero where the initial tension stands; the first sample may be elsewhere.
    initial : InitialTension
        Tension with both pulleys at angle zero; that of cable B plays no part in a single cable.
    record_profiles_at : sequence of int
        Samples at which the tension along the cables is kept.

    Returns
    -------
    ExactResponse

    Raises
    ------
    ModelError
        If an input is not finite, or friction cannot hold the initial tension.
    """
    theta_in = one_row(theta_in_rad, "theta_in_rad")
    if not isinstance(load, SpringLoad | FixedLoad):
        kind = type(load).__name__
        raise TypeError(f"the exact solver takes a SpringLoad or a FixedLoad; got {kind}: use ccmodel.model.general")
    stops = sorted({*map(int, record_profiles_at), theta_in.size - 1})
    if stops[0] < 0 or stops[-1] >= theta_in.size:
        raise ModelError(f"record_profiles_at names samples from 0 to {theta_in.size - 1}")
    R_i, R_o = transmission.drive_radius_m, transmission.load_radius_m
    stiffness = inf if isinstance(load, FixedLoad) else load.stiffness_Nm_per_rad / R_o**2
    tables = tabulate(transmission.path, transmission.friction_coefficient, transmission.axial_rigidity_N)
    present = np.array([True, not transmission.is_single_cable])
    state = initial_state(tables, transmission, initial, present, theta_in.size)
    # A spring rests where it holds the cables' force on the load.
    offset = float(state.value[0, T_LOAD] - state.value[1, T_LOAD]) if stiffness > 0 else 0.0

    # Moving the pulleys does not change the corners, so the copy shares them.
    saved = state._replace(front=state.front.copy(), value=state.value.copy(), kind=state.kind.copy())
    out, phase = np.empty((9, theta_in.size)), np.empty(theta_in.size, dtype=np.int8)
    progress, profiles = np.zeros(3, dtype=np.int64), {}
    # A load that holds nothing gives all tension away: the scale of the balance is what the cables had.
    balance = np.array([0.0, state.value[:2][present][:, [T_DRIVE, T_LOAD]].max()])
    kernels.settle(tables, state, saved, offset, stiffness)
    for stop in stops:
        drive = theta_in[: stop + 1], R_i
        kernels.run(tables, state, saved, progress, drive, offset, stiffness, present, out, phase, balance)
        if stop in record_profiles_at:
            profiles[stop] = tuple(cable_profile(state, tables, transmission, c) for c in range(2) if present[c])

    tensions, theta_out = dict(zip(TENSIONS, out[:4], strict=True)), out[4]
    if stiffness > 0:
        theta_out += offset / stiffness
    theta_out /= R_o
    return ExactResponse(
        **tensions,
        theta_out_rad=theta_out,
        tau_in_Nm=_torque(tensions[T1], tensions[T3], R_i),
        tau_out_Nm=_torque(tensions[T2], tensions[T4], R_o),
        phase=phase,
        moving_A_m=out[5:7].T,
        moving_B_m=out[7:9].T,
        status=Status.OK if balance[0] <= BALANCE_TOLERANCE * max(balance[1], LEAST_N) else Status.UNBALANCED,
        reached=theta_in.size,
        profiles=profiles,
    )


def _torque(pulled: NDArray, released: NDArray, radius: float) -> NDArray:
    """(T_pulled - T_released) R without a second temporary array, N m."""
    torque = pulled - released
    torque *= radius
    return torque
