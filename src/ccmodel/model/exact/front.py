"""Slip fronts: the boundary, one from either end, between the part of a cable that slides and the part that sticks.

A front leaves a sliding line behind and sweeps the stored profile segment by segment (`ccmodel.model.exact.segment`).
"""

from math import exp, expm1, log1p

from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.exact import state as rows
from ccmodel.model.exact.path import LUMP, NODE, PER_M, PathTables
from ccmodel.model.exact.segment import displacement_gain, solve_segment, tension_gain
from ccmodel.model.exact.state import State

# Two lines whose tensions differ by less than this share are one.
ROUNDING = 1e-15


@kernel
def start_front(path: PathTables, state: State, c: int, end: int, sigma: int) -> None:
    """Start a front at an end of cable `c`, from the present tension and displacement of that end."""
    sign = 1.0 - 2.0 * c
    front = state.front
    tension = state.value[c, rows.T_DRIVE + end]
    front[2 * c + end, rows.ME] = 0.0
    front[2 * c + end, rows.TE] = tension
    front[2 * c + end, rows.PE] = tension
    front[2 * c + end, rows.P] = tension
    front[2 * c + end, rows.EE] = path.table[end, LUMP, 0]
    displacement = sign * state.value[rows.PAIR, rows.DRIVE] if end == 0 else -sign * state.value[rows.PAIR, rows.LOAD]
    front[2 * c + end, rows.DE] = displacement
    front[2 * c + end, rows.D] = displacement
    front[2 * c + end, rows.D_START] = displacement
    state.kind[c, rows.SIGMA + 3 * end] = sigma
    state.kind[c, rows.PIECE + 3 * end] = 0
    aim(path, state, c, end)


@kernel
def aim(path: PathTables, state: State, c: int, end: int) -> None:
    """Set up the segment ahead of a front; segments that already have the sliding line's slope are passed at once."""
    front, kind = state.front, state.kind
    sigma = kind[c, rows.SIGMA + 3 * end]
    front[2 * c + end, rows.R] = 0.0
    while True:
        lo, hi, piece = state.kind[c, rows.LO], state.kind[c, rows.HI], kind[c, rows.PIECE + 3 * end]
        at_end = lo >= state.kind[c, rows.LAST] if end == 0 else hi <= state.kind[c, rows.FIRST]
        if at_end or piece >= (path.table.shape[2] - 1):
            kind[c, rows.OPEN + 3 * end] = 0
            return
        if end == 0:
            slope, corner = state.corner[rows.C_SLOPE, c, lo], state.corner[rows.C_M, c, lo + 1]
        else:
            slope, corner = -state.corner[rows.C_SLOPE, c, hi - 1], path.total - state.corner[rows.C_M, c, hi - 1]
        node = path.table[end, NODE, piece + 1]
        stop = min(corner, node)
        dm = stop - front[2 * c + end, rows.ME]
        if dm > 0.0:
            r = expm1(sigma * dm)
            if slope != -sigma:
                front[2 * c + end, rows.STOP] = stop
                front[2 * c + end, rows.SLOPE] = sigma * slope
                front[2 * c + end, rows.BEND] = path.table[end, PER_M, piece]
                front[2 * c + end, rows.R_STOP] = r
                kind[c, rows.OPEN + 3 * end] = 1
                return
            front[2 * c + end, rows.TE] /= 1.0 + r
            front[2 * c + end, rows.EE] = (
                front[2 * c + end, rows.EE] * (1.0 + r) + abs(r) * path.table[end, PER_M, piece]
            )
            front[2 * c + end, rows.ME] = stop
        _pass_corner(path, state, c, end, corner <= stop, node <= stop)


@kernel
def _pass_corner(path: PathTables, state: State, c: int, end: int, corner: bool, node: bool) -> None:
    """Pass a corner of the stored profile, a node of the path, or both."""
    if corner:
        if end == 0:
            state.kind[c, rows.LO] += 1
            state.front[2 * c + end, rows.TE] = state.corner[rows.C_T, c, state.kind[c, rows.LO]]
        else:
            state.kind[c, rows.HI] -= 1
            state.front[2 * c + end, rows.TE] = state.corner[rows.C_T, c, state.kind[c, rows.HI]]
    if node:
        state.kind[c, rows.PIECE + 3 * end] += 1
        state.front[2 * c + end, rows.EE] += path.table[end, LUMP, state.kind[c, rows.PIECE + 3 * end]]


@small_kernel
def walk(path: PathTables, state: State, c: int, end: int, weight_P: float, weight_d: float, target: float) -> None:
    """Advance a front until weight_P P + weight_d d = target, P the end's tension (N), d the end's displacement (m).

    It stops where the stored profile ends, with no segment ahead (OPEN = 0).
    """
    front, kind = state.front, state.kind
    sigma = kind[c, rows.SIGMA + 3 * end]
    while kind[c, rows.OPEN + 3 * end] == 1:
        residual = target - weight_P * front[2 * c + end, rows.PE] - weight_d * front[2 * c + end, rows.DE]
        if sigma * residual <= 0.0:
            r = 0.0
        else:
            r = front[2 * c + end, rows.R_STOP]
            whole = weight_P * front[2 * c + end, rows.PE] * tension_gain(front[2 * c + end, rows.SLOPE], r)
            whole += weight_d * displacement_gain(front, c, end, sigma, r)
            if sigma * residual < sigma * whole:
                r = solve_segment(front, c, end, sigma, weight_P, weight_d, residual)
            else:
                _pass_segment(path, state, c, end, sigma, r)
                continue
        front[2 * c + end, rows.R] = r
        front[2 * c + end, rows.P] = front[2 * c + end, rows.PE] * (
            1.0 + tension_gain(front[2 * c + end, rows.SLOPE], r)
        )
        front[2 * c + end, rows.D] = front[2 * c + end, rows.DE] + displacement_gain(front, c, end, sigma, r)
        return
    front[2 * c + end, rows.P] = front[2 * c + end, rows.PE]
    front[2 * c + end, rows.D] = front[2 * c + end, rows.DE]


@kernel
def _pass_segment(path: PathTables, state: State, c: int, end: int, sigma: int, r: float) -> None:
    """Take a front to the end of its segment and on into the next."""
    front = state.front
    slope = front[2 * c + end, rows.SLOPE]
    front[2 * c + end, rows.DE] += displacement_gain(front, c, end, sigma, r)
    front[2 * c + end, rows.PE] *= 1.0 + tension_gain(slope, r)
    front[2 * c + end, rows.TE] *= 1.0 + r if slope == 1.0 else exp(slope * log1p(r))
    front[2 * c + end, rows.EE] = front[2 * c + end, rows.EE] * (1.0 + r) + abs(r) * front[2 * c + end, rows.BEND]
    stop = front[2 * c + end, rows.STOP]
    front[2 * c + end, rows.ME] = stop
    if end == 0:
        corner = state.corner[rows.C_M, c, state.kind[c, rows.LO] + 1]
    else:
        corner = path.total - state.corner[rows.C_M, c, state.kind[c, rows.HI] - 1]
    node = path.table[end, NODE, state.kind[c, rows.PIECE + 3 * end] + 1]
    _pass_corner(path, state, c, end, corner <= stop, node <= stop)
    aim(path, state, c, end)


@small_kernel
def position(state: State, c: int, end: int) -> float:
    """Position of a front, m = mu phi counted from its end."""
    return state.front[2 * c + end, rows.ME] + state.kind[c, rows.SIGMA + 3 * end] * log1p(
        state.front[2 * c + end, rows.R]
    )


@kernel
def end_compliance(state: State, c: int, end: int) -> float:
    """Displacement of an end per unit of its own tension while its front advances, m/N."""
    front = state.front
    sigma = state.kind[c, rows.SIGMA + 3 * end]
    r = front[2 * c + end, rows.R]
    per_front_tension = front[2 * c + end, rows.EE] * (1.0 + r) + abs(r) * front[2 * c + end, rows.BEND]
    return per_front_tension * exp(-sigma * position(state, c, end))


@small_kernel
def has_met(path: PathTables, state: State, c: int) -> bool:
    """Whether two fronts that slide in the same direction have met: their sliding lines are then one line."""
    if state.kind[c, rows.OPEN] == 0 or state.kind[c, rows.OPEN + 3] == 0:
        return True
    sigma = state.kind[c, rows.SIGMA]
    ratio = path.ratio[(1 - sigma) // 2]
    load = state.front[2 * c + 1, rows.P]
    return sigma * (state.front[2 * c, rows.P] * ratio - load) >= -ROUNDING * load
