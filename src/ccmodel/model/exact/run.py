"""The loop over samples: what kind of step each is, and what is written down of it."""

from math import log1p

import numpy as np
from numba import njit

from ccmodel.model.exact.along import balance_lines, step_along
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
    STILL_POINT,
    T_DRIVE,
    T_LOAD,
    WHOLE,
    D,
    D_START,
    is_slack,
    position,
)

DONE, CORNERS_FULL = 0, 100
# Room that one sample may need at either end of a list of corners.
MARGIN = 64


@njit(cache=True)
def run(path, state, kept, progress, drive, law, angle_given, given, stiffness, present, out, phase):
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
        if move != 0.0 or given[i] != state.pair[GIVEN]:
            status = step_along(path, state, kept, way, drive[i], given[i], stiffness)
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
        x = 0.0
        return x, x
    return _reach(path, state, c, 0), path.length - _reach(path, state, c, 1)


@njit(cache=True)
def _reach(path, state, c, end):
    if state.front[c, end, D] == state.front[c, end, D_START]:
        return 0.0
    if state.front_kind[c, end, OPEN] == 0:
        return path.length
    piece = state.front_kind[c, end, PIECE]
    inward = position(state, c, end) - path.node[end, piece]
    return path.x_start[end, piece] + inward * path.x_per_m[end, piece]
