"""State of both cables between samples: the stored tension profile as corners, and the slip fronts at either end.

Positions along a cable are given as m = mu phi, friction coefficient times bend angle, and tensions as ln T over m.
Where a cable slides, ln T is a straight line of slope -1 or +1 (the capstan equation): the sliding line. Where it
sticks, it keeps the profile that it had before: the stored profile, a polygon of corners. A slip front is the boundary
between the two.

All kernels work on a `State`. Cable A is row 0, cable B row 1; end 0 is the drive end, end 1 the load end. A cable is
in one of two modes: slip fronts run in from its ends (`FRONTS`), or it slides over its whole length, or hangs slack
(`WHOLE`). Sigma is +1 for a front of a cable that is pulled at that end, -1 for one that is released there.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel, small_kernel

FRONTS, WHOLE = 0, 1

# Rows of `State.corner`: position m, tension (N), and d ln T / dm from this corner to the next.
C_M, C_T, C_SLOPE = range(3)
# Columns of `State.front`. A front crosses the stored profile segment by segment (`ccmodel.model.exact.segment`); a
# segment ends at the next corner or at the next change of the conduit's curvature. m counts from the front's own end.
(
    # On entry into the segment:
    ME,  # position m of the front
    TE,  # tension at the front, N
    PE,  # tension at the end, N
    EE,  # compliance of the sliding part per unit of tension at the front, m/N
    DE,  # displacement of the end, m
    # Of the segment:
    STOP,  # m at its far end
    SLOPE,  # sigma times the slope of its stored profile, seen from this end
    BEND,  # its compliance per m, m/N
    R_STOP,  # r at its far end
    # Now:
    R,  # r = expm1(sigma dm), with dm the distance of the front from the entry
    P,  # tension at the end, N
    D,  # displacement of the end, m
    # When the front started:
    D_START,  # displacement of the end, m
) = range(13)
# Columns of `State.value` in rows 0 and 1, the cables.
(
    E0,  # elongation with both pulleys at angle zero, m
    T_DRIVE,  # tension at the drive end, N
    T_LOAD,  # tension at the load end, N
    # First of two: drive-end tension per elongation on a sliding line of slope -1, then +1, N/m; zero without a cable.
    STIFFNESS,
) = range(4)
# Row of `State.value` for both cables together, and its columns: displacement of the rims of the drive pulley and of
# the load pulley (m), constant part of the load's law (N).
PAIR = 2
DRIVE, LOAD, OFFSET = range(3)
# Columns of `State.kind`.
(
    LO,  # corner that the front at the drive end has passed last
    HI,  # corner that the front at the load end has passed last
    FIRST,  # first corner of the list, and
    LAST,  # last one: the limits of the list for either front, whatever the other front has passed
    MODE,  # FRONTS or WHOLE
    LINE,  # slope of the sliding line, in the mode WHOLE
    # Of the front at the drive end; add 3 for the front at the load end:
    SIGMA,  # +1, -1, or 0 without a front
    PIECE,  # bend of the path in which the front stands
    OPEN,  # 1 if a segment lies ahead of the front, else 0
) = range(9)

FRONT_FIELDS, VALUE_FIELDS, KIND_FIELDS = 13, 5, 12


class State(NamedTuple):
    """All that the next sample depends on. Kernels write into the arrays; the constants above name rows and columns.

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


@small_kernel
def copy_fronts(state: State, to: State, c: int) -> None:
    """Copy what advancing the fronts of cable `c` may change from `state` into `to`."""
    for i in range(FRONT_FIELDS):
        to.front[2 * c, i] = state.front[2 * c, i]
        to.front[2 * c + 1, i] = state.front[2 * c + 1, i]
    for i in range(KIND_FIELDS):
        to.kind[c, i] = state.kind[c, i]


@kernel
def copy_state(state: State, to: State) -> None:
    """Copy what moving the pulleys may change from `state` into `to`.

    Corners are not copied: fronts that advance pass them by their indices `LO` and `HI`, and only a reversal writes
    corners.
    """
    copy_fronts(state, to, 0)
    copy_fronts(state, to, 1)
    for i in range(3):
        for j in range(VALUE_FIELDS):
            to.value[i, j] = state.value[i, j]


@small_kernel
def elongation(state: State, c: int) -> float:
    """End-to-end elongation of cable `c` beyond its natural length, m."""
    sign = 1.0 - 2.0 * c
    return state.value[c, E0] + sign * (state.value[PAIR, DRIVE] - state.value[PAIR, LOAD])
