"""One simulation between calls of the kernels: its state, its outputs, and the profiles kept on the way."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccmodel.failure import ModelError
from ccmodel.model.exact import run as kernels
from ccmodel.model.exact.path import tabulate
from ccmodel.model.exact.profile import CableProfile, cable_profile, initial_state
from ccmodel.model.exact.state import FIRST, HI, LAST, LO, T_LOAD, State, blank_state
from ccmodel.model.initial import InitialTension
from ccmodel.model.response import Status
from ccmodel.model.transmission import Transmission

PHASES = ("I", "II", "III", "IVa", "IVb")
# A load that balances to less than this share of the highest tension is balanced.
BALANCE_TOLERANCE = 1e-9


class Simulation:
    """A pair of cables, or cable A alone, between a drive and a load whose law is offset + stiffness x displacement.

    Attributes
    ----------
    out : ndarray, shape (9, reached)
        As `ccmodel.model.exact.run.run` fills it.
    phase : ndarray of int8, shape (reached,)
        Index into `PHASES`.
    profiles : dict of int to tuple of CableProfile
        By sample, of A and, for a pair, of B.
    status : Status
    """

    def __init__(self, transmission: Transmission, initial: InitialTension):
        self._path, self._friction = transmission.path, transmission.friction_coefficient
        self._tables = tabulate(self._path, self._friction, transmission.axial_rigidity_N)
        self._present = np.array([True, not transmission.is_single_cable])
        self._state = initial_state(self._tables, self._path, self._friction, initial, self._present)

    @property
    def held_N(self) -> float:
        """Force T2 - T4 of the cables on the load in the present state, N."""
        return float(self._state.value[0, T_LOAD] - self._state.value[1, T_LOAD])

    def run(
        self, theta_in: NDArray, radius_m: float, offset: float, stiffness: float, record_at: Sequence[int]
    ) -> None:
        """Simulate all samples of the drive's angle (rad); `offset` in N, `stiffness` in N/m.

        Raises
        ------
        ModelError
            If `record_at` names a sample that does not exist.
        """
        n = theta_in.size
        self.out, self.phase = np.empty((9, n)), np.empty(n, dtype=np.int8)
        self.profiles: dict[int, tuple[CableProfile, ...]] = {}
        progress, balance = np.array([0, 0, 0]), np.zeros(2)
        stops = [*sorted({int(i) for i in record_at}), n - 1]
        if stops[0] < 0 or stops[-1] >= n or max(stops) > n - 1:
            raise ModelError(f"record_profiles_at names samples from 0 to {n - 1}")
        saved = _scratch(self._state)
        kernels.settle(self._tables, self._state, saved, offset, stiffness)
        for stop in stops:
            drive = theta_in[: stop + 1], radius_m
            while (
                kernels.run(
                    self._tables, self._state, saved, progress, drive, offset, stiffness, self._present, self.out,
                    self.phase, balance,
                )
                == kernels.CORNERS_FULL
            ):  # fmt: skip
                self._state = _with_room(self._state)
                saved = _scratch(self._state)
            if stop in record_at:
                self.profiles[stop] = tuple(
                    cable_profile(self._state, self._tables, self._path, self._friction, c)
                    for c in range(1 + self._present[1])
                )
        balanced = balance[0] <= BALANCE_TOLERANCE * max(balance[1], 1e-9)
        self.status = Status.OK if balanced else Status.UNBALANCED


def _scratch(state: State) -> State:
    """Scratch space for a copy of the state; the corners are shared, since moving the pulleys does not change them."""
    return state._replace(front=state.front.copy(), value=state.value.copy(), kind=state.kind.copy())


def _with_room(state: State) -> State:
    """The same state with its corners in the middle of arrays of at least twice the length that they need."""
    used = int((state.kind[:, LAST] - state.kind[:, FIRST]).max()) + 1
    larger = blank_state(2 * used + 8 * kernels.MARGIN)
    for c in range(2):
        first, last = state.kind[c, FIRST], state.kind[c, LAST]
        low = (larger.corner.shape[2] - (last - first + 1)) // 2
        larger.corner[:, c, low : low + last - first + 1] = state.corner[:, c, first : last + 1]
        state.kind[c, [LO, HI, FIRST, LAST]] += low - first
    return state._replace(corner=larger.corner)
