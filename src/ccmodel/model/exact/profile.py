"""Tension profiles of the exact solver: from an initial profile into a state, and from a state out as plain arrays."""

from dataclasses import dataclass
from math import exp

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel
from ccmodel.model.exact import state as rows
from ccmodel.model.exact.front import position
from ccmodel.model.exact.path import LUMP, NODE, PER_M, X_PER_M, X_START, PathTables
from ccmodel.model.exact.state import State, blank_state
from ccmodel.model.initial import InitialTension
from ccmodel.model.transmission import Transmission

# Elongation of a cable that is not there: it hangs slack whatever the drive does, m.
ABSENT_M = -1e30


@dataclass(frozen=True)
class CableProfile:
    """Tension along one cable at one sample, at every corner of ln T over arc length and at every piece's end.

    Attributes
    ----------
    x_m : ndarray, shape (k,)
        Arc length from the drive end.
    bend_rad : ndarray, shape (k,)
        Bend angle from the drive end up to there.
    tension_N : ndarray, shape (k,)
    """

    x_m: NDArray
    bend_rad: NDArray
    tension_N: NDArray


def initial_state(
    tables: PathTables, transmission: Transmission, initial: InitialTension, present: NDArray, samples: int
) -> State:
    """State at rest under an initial tension, with room for the corners of so many samples.

    A cable that is not `present` (shape (2,)) has no stiffness.

    Raises
    ------
    ModelError
        If friction cannot hold the initial tension.
    """
    m, slope_A, slope_B = initial.log_slopes(transmission.path, transmission.friction_coefficient)
    # A reversal adds a corner at either end of a cable, and so may the load as it settles before the first sample.
    state = blank_state(2 * (samples + 2) + m.size)
    for c, (tension, slope) in enumerate(((initial.tension_A_N, slope_A), (initial.tension_B_N, slope_B))):
        if present[c]:
            _store(state, tables, c, m, tension, slope)
        else:
            state.value[c, rows.E0] = ABSENT_M
            state.kind[c, rows.MODE] = rows.WHOLE
            state.kind[c, rows.LINE] = -1
    state.value[rows.PAIR, rows.OFFSET] = state.value[0, rows.T_LOAD] - state.value[1, rows.T_LOAD]
    return state


def _store(state: State, tables: PathTables, c: int, m: NDArray, tension: NDArray, slope: NDArray) -> None:
    """Store an initial profile of cable `c` as corners."""
    low = (state.corner.shape[2] - m.size) // 2
    place = slice(low, low + m.size)
    state.corner[rows.C_M, c, place], state.corner[rows.C_T, c, place] = m, tension
    state.corner[rows.C_M, c, low + m.size - 1] = tables.total
    state.corner[rows.C_SLOPE, c, low : low + m.size - 1] = slope
    state.kind[c, [rows.LO, rows.FIRST]], state.kind[c, [rows.HI, rows.LAST]] = low, low + m.size - 1
    state.value[c, rows.T_DRIVE], state.value[c, rows.T_LOAD] = tension[0], tension[-1]
    state.value[c, rows.E0] = _elongation(tables.table[0], m, tension, slope)
    state.value[c, rows.STIFFNESS : rows.STIFFNESS + 2] = 1.0 / np.array(tables.line_compliance)
    if tables.total == 0.0 or tension[0] == 0.0:
        state.kind[c, rows.MODE] = rows.WHOLE
        state.kind[c, rows.LINE] = -1


@kernel
def _elongation(table: NDArray, m: NDArray, tension: NDArray, slope: NDArray) -> float:
    """Elongation under a profile, the integral of T dx / EA along the bends and at the nodes, m.

    `table` is the one that is seen from the drive end. Between the corners `m` of the profile and the nodes, ln T is
    linear.
    """
    node, last = table[NODE], table.shape[1] - 1
    total, segment, piece, at = 0.0, 0, 0, 0.0
    while piece < last:
        while segment < m.size - 2 and m[segment + 1] <= at:
            segment += 1
        end = node[piece + 1] if segment == m.size - 2 else min(node[piece + 1], m[segment + 1])
        run = end - at
        rise = slope[segment] * run
        mean = np.expm1(rise) / rise if rise != 0.0 else 1.0
        total += table[PER_M, piece] * tension[segment] * exp(slope[segment] * (at - m[segment])) * mean * run
        at = end
        if end == node[piece + 1]:
            piece += 1
    segment = 0
    for i in range(node.size):
        while segment < m.size - 2 and m[segment + 1] <= node[i]:
            segment += 1
        total += table[LUMP, i] * tension[segment] * exp(slope[segment] * (node[i] - m[segment]))
    return total


def cable_profile(state: State, tables: PathTables, transmission: Transmission, c: int) -> CableProfile:
    """Profile of cable `c` (0: A, 1: B) in a state."""
    path, friction_coefficient = transmission.path, transmission.friction_coefficient
    m, tension = _corners(state, tables, c)
    x_piece = np.concatenate([[0.0], np.cumsum(path.piece_length_m)])
    m_piece = friction_coefficient * np.concatenate([[0.0], np.cumsum(path.piece_bend_rad)])
    table = tables.table[0]
    within = m[(m > 0) & (m < tables.total)]
    piece = np.clip(np.searchsorted(table[NODE], within, side="right") - 1, 0, None)
    x = np.concatenate([x_piece, table[X_START, piece] + table[X_PER_M, piece] * (within - table[NODE, piece])])
    m_all = np.concatenate([m_piece, within])
    order = np.lexsort((m_all, x))
    slack = not tension.min() > 0
    values = np.zeros(x.size) if slack else np.exp(np.interp(m_all[order], m, np.log(tension)))
    return CableProfile(x[order], path.bend_at(x[order]), values)


def _corners(state: State, tables: PathTables, c: int) -> tuple[NDArray, NDArray]:
    """Corners of cable `c`, the fronts' sliding lines included: m from the drive end, and tension (N)."""
    ends = state.value[c, rows.T_DRIVE], state.value[c, rows.T_LOAD]
    kind = state.kind[c]
    if kind[rows.MODE] == rows.WHOLE:
        return np.array([0.0, max(tables.total, 0.0)]), np.array(ends)
    points = []
    for end in range(2):
        if state.kind[c, rows.SIGMA + 3 * end]:
            front = state.front[2 * c + end]
            tension = front[rows.TE] * np.exp(front[rows.SLOPE] * np.log1p(front[rows.R]))
            points.append((abs(end * tables.total - position(state, c, end)), tension))
    fronts = [p[0] for p in points]
    low = fronts[0] if state.kind[c, rows.SIGMA] else 0.0
    high = fronts[-1] if state.kind[c, rows.SIGMA + 3] else tables.total
    for i in range(kind[rows.LO], kind[rows.HI] + 1):
        if low < state.corner[rows.C_M, c, i] < high:
            points.append((state.corner[rows.C_M, c, i], state.corner[rows.C_T, c, i]))
    points = [(0.0, ends[0]), *sorted(points), (tables.total, ends[1])]
    return np.array([p[0] for p in points]), np.array([p[1] for p in points])
