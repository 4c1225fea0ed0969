"""The loop over samples: a step each, and its outputs."""

from math import inf

from numpy.typing import NDArray

from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.exact import state as rows
from ccmodel.model.exact.cable import is_slack
from ccmodel.model.exact.front import position
from ccmodel.model.exact.path import NODE, X_PER_M, X_START, PathTables
from ccmodel.model.exact.state import State
from ccmodel.model.exact.step import excess, step


@kernel
def run(
    path: PathTables,
    state: State,
    saved: State,
    progress: NDArray,
    drive: tuple[NDArray, float],
    offset: float,
    stiffness: float,
    present: NDArray,
    out: NDArray,
    phase: NDArray,
    balance: NDArray,
) -> None:
    """Simulate from sample progress[0] on.

    Parameters
    ----------
    path : PathTables
    state : State
        Before the first sample; carried on.
    saved : State
        Scratch space for a copy of the state.
    progress : ndarray of int, shape (3,)
        Next sample, direction of the last stroke, whether a cable has stayed slack through a reversal; carried on.
    drive : tuple of ndarray, shape (n,), and float
        Angle of the drive pulley (rad) and its radius (m), so that no copy in metres is made.
    offset, stiffness : float
        Constant part (N) and stiffness (N/m) of the load's law; a load of infinite stiffness does not move.
    present : ndarray of bool, shape (2,)
        Whether cables A and B exist.
    out : ndarray, shape (9, n)
        T1, T2, T3, T4 (N), displacement of the load pulley's rim (m), and as arc lengths (m) how far the fronts of A
        have come from drive and load, then those of B.
    phase : ndarray of int, shape (n,)
        0 to 2 for phases I to III, 3 for IVa, 4 for IVb.
    balance : ndarray, shape (2,)
        Largest force out of balance at the load, and highest tension at a cable's end, N; carried on.
    """
    for i in range(progress[0], drive[0].size):
        drive_now = drive[0][i] * drive[1]
        move = drive_now - state.value[rows.PAIR, rows.DRIVE]
        if move != 0.0:
            direction = 1 if move > 0.0 else -1
            if direction == -progress[1]:
                progress[2] = _any_slack(state, present)
            progress[1] = direction
            step(path, state, saved, direction, drive_now, offset, stiffness)
        out[0, i] = state.value[0, rows.T_DRIVE]
        out[1, i] = state.value[0, rows.T_LOAD]
        out[2, i] = state.value[1, rows.T_DRIVE]
        out[3, i] = state.value[1, rows.T_LOAD]
        out[4, i] = state.value[rows.PAIR, rows.LOAD]
        for c in range(2):
            out[5 + 2 * c, i], out[6 + 2 * c, i] = _moving(path, state, c)
        phase[i] = _phase(state, present, progress)
        if stiffness != inf:
            balance[0] = max(balance[0], abs(excess(state, offset, stiffness)))
            balance[1] = max(balance[1], out[0, i], out[1, i], out[2, i], out[3, i])
    progress[0] = drive[0].size


@kernel
def settle(path: PathTables, state: State, saved: State, offset: float, stiffness: float) -> None:
    """Let a load that does not hold the initial tensions find its balance while the drive rests."""
    if offset == state.value[rows.PAIR, rows.OFFSET]:
        return
    direction = 1 if offset < state.value[rows.PAIR, rows.OFFSET] else -1
    step(path, state, saved, direction, state.value[rows.PAIR, rows.DRIVE], offset, stiffness)


@small_kernel
def _any_slack(state: State, present: NDArray) -> int:
    for c in range(2):
        if present[c] and is_slack(state, c):
            return 1
    return 0


@small_kernel
def _phase(state: State, present: NDArray, progress: NDArray) -> int:
    """0 to 2 for phases I to III, 3 for IVa, 4 for IVb."""
    if _any_slack(state, present):
        return 4 if progress[2] else 3
    progress[2] = 0
    reached = 0
    for c in range(2):
        if (
            present[c]
            and state.kind[c, rows.MODE] == rows.WHOLE
            and state.kind[c, rows.LINE] == (2 * c - 1) * progress[1]
        ):
            reached += 1
    return reached


@small_kernel
def _moving(path: PathTables, state: State, c: int) -> tuple[float, float]:
    """Arc lengths up to which and from which on a cable has slid since the last reversal, m."""
    if state.kind[c, rows.MODE] == rows.WHOLE:
        return path.length, 0.0
    return _reach(path, state, c, 0), path.length - _reach(path, state, c, 1)


@small_kernel
def _reach(path: PathTables, state: State, c: int, end: int) -> float:
    """Arc length between an end and its front, m."""
    if state.front[2 * c + end, rows.D] == state.front[2 * c + end, rows.D_START]:
        return 0.0
    if state.kind[c, rows.OPEN + 3 * end] == 0:
        return path.length
    piece = state.kind[c, rows.PIECE + 3 * end]
    inward = position(state, c, end) - path.table[end, NODE, piece]
    return path.table[end, X_START, piece] + inward * path.table[end, X_PER_M, piece]
