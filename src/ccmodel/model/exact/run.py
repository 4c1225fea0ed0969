"""The loop over samples: what kind of step each is, and what is written down of it."""

from numba import njit

from ccmodel.model.exact.along import move_along, step_along
from ccmodel.model.exact.cable import (
    DRIVE,
    FRONTS,
    GIVEN,
    HI,
    LINE,
    LO,
    LOAD,
    M_STILL,
    MODE,
    OPEN,
    PIECE,
    PINNED,
    STILL_PIECE,
    STILL_POINT,
    T_DRIVE,
    T_LOAD,
    WHOLE,
    D,
    D_START,
    is_slack,
    position,
)
from ccmodel.model.exact.still_point import step_apart, step_given

DONE, STUCK, CORNERS_FULL = 0, 1, 100
# Room that one sample may need at either end of a list of corners.
MARGIN = 64


@njit(cache=True)
def run(path, state, trials, progress, drive, angle_given, given, stiffness, present, out, phase):
    """Simulate from sample progress[0] on; stops early where the list of corners wants more room.

    Parameters
    ----------
    drive : ndarray, shape (n,)
        Displacement of the drive pulley's rim, m.
    given : ndarray, shape (n,)
        The load law's constant part (N), or the load's displacement (m) where `angle_given`.
    progress : ndarray, shape (3,)
        Next sample, direction of the last stroke, whether slack has lasted through a reversal.
    out : ndarray, shape (9, n)
        T1, T2, T3, T4, Q, and arc length of the moving stretches' limits: A at drive and load, B likewise.
    phase : ndarray, shape (n,)
    """
    for i in range(progress[0], drive.size):
        for c in range(2):
            if state.cable_kind[c, LO] < MARGIN or state.cable_kind[c, HI] > state.m.shape[1] - MARGIN:
                progress[0] = i
                return CORNERS_FULL
        move = drive[i] - state.pair[DRIVE]
        way = 1 if move > 0.0 else -1
        if move != 0.0:
            if way == -progress[1]:
                progress[2] = _any_slack(state, present)
            progress[1] = way
        if move != 0.0 or given[i] != state.pair[LOAD if angle_given else GIVEN]:
            if angle_given:
                status = _step_angle(path, state, trials, way, drive[i], given[i], stiffness)
            elif given[i] != state.pair[GIVEN]:
                status = step_given(path, state, trials, drive[i], given[i], stiffness)
            else:
                step_along(path, state, trials[0], way, drive[i], given[i], stiffness)
                status = DONE
            if status != DONE:
                progress[0] = i
                return status
        out[0, i] = state.cable[0, T_DRIVE]
        out[1, i] = state.cable[0, T_LOAD]
        out[2, i] = state.cable[1, T_DRIVE]
        out[3, i] = state.cable[1, T_LOAD]
        out[4, i] = state.pair[LOAD]
        for c in range(2):
            out[5 + 2 * c, i], out[6 + 2 * c, i] = moving(path, state, c)
        phase[i] = _phase(state, present, progress)
    progress[0] = drive.size
    return DONE


@njit(cache=True)
def _step_angle(path, state, trials, way, drive, load, stiffness):
    """Move both pulleys to given angles, linearly and together."""
    load_rate = load - state.pair[LOAD]
    if drive == state.pair[DRIVE]:
        way = 1 if load_rate > 0.0 else -1
    if way * load_rate >= 0.0 or path.total == 0.0:
        move_along(path, state, way, drive, load)
        return DONE
    return step_apart(path, state, trials, (drive, load), stiffness, True)


@njit(cache=True)
def _any_slack(state, present):
    for c in range(2):
        if present[c] and is_slack(state, c):
            return 1
    return 0


@njit(cache=True)
def _phase(state, present, progress):
    """1 to 3 for phases I to III, 4 for IVa, 5 for IVb."""
    if _any_slack(state, present):
        return 5 if progress[2] else 4
    progress[2] = 0
    reached = 0
    for c in range(2):
        if present[c] and state.cable_kind[c, MODE] == WHOLE and state.cable_kind[c, LINE] == (2 * c - 1) * progress[1]:
            reached += 1
    return 1 + reached


@njit(cache=True)
def moving(path, state, c):
    """Arc length from the drive end up to which, and from which on, a cable has moved since its ends last turned, m."""
    if state.cable_kind[c, MODE] == WHOLE:
        return path.length, 0.0
    if state.cable_kind[c, MODE] == STILL_POINT:
        x = _still_x(path, state, c)
        return x, x
    return _reach(path, state, c, 0), path.length - _reach(path, state, c, 1)


@njit(cache=True)
def _still_x(path, state, c):
    """Arc length of a still point; of one in a straight stretch, where that stretch begins, m."""
    piece = state.cable_kind[c, STILL_PIECE]
    if state.cable_kind[c, PINNED]:
        if piece == 0:
            return 0.0
        return path.x_start[0, piece - 1] + path.x_per_m[0, piece - 1] * (path.node[0, piece] - path.node[0, piece - 1])
    return path.x_start[0, piece] + path.x_per_m[0, piece] * (state.cable[c, M_STILL] - path.node[0, piece])


@njit(cache=True)
def _reach(path, state, c, end):
    if state.front[c, end, D] == state.front[c, end, D_START]:
        return 0.0
    if state.front_kind[c, end, OPEN] == 0:
        return path.length
    piece = state.front_kind[c, end, PIECE]
    inward = position(state, c, end) - path.node[end, piece]
    return path.x_start[end, piece] + inward * path.x_per_m[end, piece]
