"""State of both cables between samples: the stored tension profile as corners, and the slip fronts at either end.

All kernels work on a `State`. Cable A is row 0, cable B row 1; end 0 is the drive end, end 1 the load end. A cable is
in one of two modes: slip fronts run in from its ends (`FRONTS`), or it slides over its whole length, or hangs slack
(`WHOLE`).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel, small_kernel

FRONTS, WHOLE = 0, 1

# Rows of `State.corner`: position m, tension (N), and d ln T / dm from this corner to the next.
C_M, C_T, C_SLOPE = range(3)
# Fields of `State.front`. At the entry into the current segment: position, tension at the front, tension at the end,
# compliance, displacement of the end. Of the segment: where it ends, slope of the stored profile relative to the
# sliding line, compliance per m of its bend, r at its end. Now: r, tension and displacement of the end. Last: the
# displacement of the end when the front started.
ME, TE, PE, EE, DE, STOP, SLOPE, BEND, R_STOP, R, P, D, D_START = range(13)
# Fields of `State.value`, rows 0 and 1: elongation with both pulleys at angle zero (m), tension at the drive end and at
# the load end (N), and from `STIFFNESS` on the drive-end tension per elongation on a sliding line of slope -1 and +1
# (N/m; zero for a cable that is not there).
E0, T_DRIVE, T_LOAD, STIFFNESS = range(4)
# Row 2 of `State.value`: displacement of the rims of the drive and of the load pulley (m), constant part of the load's
# law (N).
PAIR = 2
DRIVE, LOAD, OFFSET = range(3)
# Fields of `State.kind`: the corners last passed by the front at the drive end and at the load end; first and last
# corner of the list (a front does not see what the other front has passed); mode; slope of the sliding line of a whole
# cable; then, for the front at the drive end (for the one at the load end 3 further on), sigma (0: no front), the bend
# that it is in, and whether a segment lies ahead of it.
LO, HI, FIRST, LAST, MODE, LINE, SIGMA, PIECE, OPEN = range(9)

FRONT_FIELDS, VALUE_FIELDS, KIND_FIELDS = 13, 5, 12


class State(NamedTuple):
    """Everything that the history of a run leaves behind; the arrays are written in place, their fields named above.

    Attributes
    ----------
    corner : ndarray, shape (3, 2, capacity)
        Corners of the stored profile of either cable, m counted from the drive end.
    front : ndarray, shape (4, 13)
        Fronts: A at drive and load, B at drive and load.
    value : ndarray, shape (3, 5)
    kind : ndarray of int64, shape (2, 12)
    """

    corner: NDArray
    front: NDArray
    value: NDArray
    kind: NDArray


def blank_state(capacity: int) -> State:
    """A state with room for `capacity` corners a cable, all zero."""
    front, value = np.zeros((4, FRONT_FIELDS)), np.zeros((3, VALUE_FIELDS))
    return State(np.zeros((3, 2, capacity)), front, value, np.zeros((2, KIND_FIELDS), dtype=np.int64))


@kernel
def copy_state(state, to):
    """Copy what a step may change from `state` into `to`: all but the corners, which a step only passes."""
    for i in range(4):
        for j in range(FRONT_FIELDS):
            to.front[i, j] = state.front[i, j]
    for i in range(3):
        for j in range(VALUE_FIELDS):
            to.value[i, j] = state.value[i, j]
    for i in range(2):
        for j in range(KIND_FIELDS):
            to.kind[i, j] = state.kind[i, j]


@small_kernel
def copy_fronts(state, to, c):
    """Copy what walking the fronts of cable `c` may change from `state` into `to`."""
    for i in range(FRONT_FIELDS):
        to.front[2 * c, i] = state.front[2 * c, i]
        to.front[2 * c + 1, i] = state.front[2 * c + 1, i]
    for i in range(KIND_FIELDS):
        to.kind[c, i] = state.kind[c, i]


@small_kernel
def elongation(state, c):
    """End-to-end elongation of cable `c` beyond its natural length, m."""
    sign = 1.0 - 2.0 * c
    return state.value[c, E0] + sign * (state.value[PAIR, DRIVE] - state.value[PAIR, LOAD])
