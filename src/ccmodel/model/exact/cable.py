"""One cable in its conduit: the old profile as a list of corners, and the fronts that sweep it from either end.

All kernels work on a `State`, in which cable A is row 0 and cable B row 1; end 0 is the drive end, 1 the load end.

A sliding line drawn in from an end changes ln T by -sigma per unit of m = mu phi going inward, sigma = +1 for a pull
and -1 for a release. Inside one segment of the old profile (one slope, one bend) the front stands where
r = expm1(sigma dm), dm counted from where it entered the segment. Against a line of the opposite slope
    displacement - displacement at entry = T_e r (E (2 + r) + sigma c r)
    end tension / end tension at entry   = (1 + r)**2
with T_e the tension at the point of entry, E the compliance of what already moves per unit of the front's tension, and
c = dx / (EA dm) of the bend: a quadratic in r whose coefficients keep their sign, so that nothing cancels. An increment
is always counted from where the segment was entered, not from the last sample: small steps and large ones agree.
"""

from math import exp, expm1, log1p, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.exact.path import LUMP, NODE, PASSED, PER_M

FRONTS, WHOLE, STILL_POINT = 0, 1, 2

# Rows of `State.corner`: position, tension, d ln T / dm from a corner to the next.
C_M, C_T, C_SLOPE = range(3)
# Fields of `State.front`: where the segment was entered (position, front's and end's tension, compliance,
# displacement), where it stops, its slope relative to the line, its bend's compliance, r at its stop and now, end
# tension and displacement now, displacement at which the front set out.
ME, TE, PE, EE, DE, STOP, SLOPE, BEND, R_STOP, R, P, D, D_START = range(13)
# Fields of `State.value`, rows 0 and 1: elongation at the zero of all angles, position of a still point, tensions at
# both ends, drive-end tension per elongation on a line of slope -1, +1 (zero for a cable that is not there).
E0, M_STILL, T_DRIVE, T_LOAD, STIFFNESS = range(5)
# Row 2: displacement of the drive and of the load pulley's rim, the load law's constant part.
PAIR = 2
DRIVE, LOAD, GIVEN = range(3)
# Fields of `State.kind`: the corners last passed by the front at the drive and at the load; first and last corner of
# the list (a front does not see what the other one has passed); what a cable does (mode); slope of a whole slide or
# sigma of a still point; the piece a still point is in, whether it stands in a straight stretch (at that piece's first
# node); then of the front at the drive end (at the load end 3 further on) sigma (0: none), the bend it is in, whether
# anything lies ahead.
LO, HI, FIRST, LAST, MODE, LINE, STILL_PIECE, PINNED, SIGMA, PIECE, OPEN = range(11)

# Two lines that differ by less, relative to their tension, are one.
ROUNDING = 1e-15


class State(NamedTuple):
    """Everything that the past leaves behind; arrays are written in place. The fields are named above.

    Attributes
    ----------
    corner : ndarray, shape (3, 2, capacity)
        Corners of the old profile of either cable, m counted from the drive end.
    front : ndarray, shape (4, 13)
        Fronts: A at drive and load, B at drive and load.
    value : ndarray, shape (3, 6)
    kind : ndarray of int64, shape (2, 14)
    """

    corner: NDArray
    front: NDArray
    value: NDArray
    kind: NDArray


def blank_state(capacity: int) -> State:
    """A state with room for `capacity` corners a cable, all zero."""
    return State(np.zeros((3, 2, capacity)), np.zeros((4, 13)), np.zeros((3, 6)), np.zeros((2, 14), dtype=np.int64))


@kernel
def keep(state, kept):
    """Copy what a step may change (all but the corners, which a step only drops) from `state` to `kept`."""
    for i in range(4):
        for j in range(13):
            kept.front[i, j] = state.front[i, j]
    for i in range(3):
        for j in range(6):
            kept.value[i, j] = state.value[i, j]
    for i in range(2):
        for j in range(14):
            kept.kind[i, j] = state.kind[i, j]


@small_kernel
def keep_fronts(state, kept, c):
    """The same of what walking the fronts of cable `c` may change."""
    for i in range(13):
        kept.front[2 * c, i] = state.front[2 * c, i]
        kept.front[2 * c + 1, i] = state.front[2 * c + 1, i]
    for i in range(14):
        kept.kind[c, i] = state.kind[c, i]


@small_kernel
def elongation(state, c):
    """End-to-end elongation of cable `c` beyond its natural length, m."""
    sign = 1.0 - 2.0 * c
    return state.value[c, E0] + sign * (state.value[PAIR, DRIVE] - state.value[PAIR, LOAD])


# ---------------------------------------------------------------------------------------------- one segment of a sweep


@kernel
def _curl(s, y):
    """exp((s + 1) y) - exp(s y) - (exp(s y) - 1) / s: what a line of slope s adds over y, in tension times c."""
    if abs(y) < 0.3:
        # (1 + s) sum over n >= 2 of ((1 + s)^(n-1) - s^(n-1)) y^n / n!, for the difference cancels at small y
        total, power, high, low = 0.0, y, 1.0, 1.0
        for n in range(2, 20):
            power *= y / n
            high *= 1.0 + s
            low *= s
            total += (high - low) * power
        return (1.0 + s) * total
    if abs(s) < 1e-9:
        return expm1(y) - y
    return exp(s * y) * expm1(y) - expm1(s * y) / s


@small_kernel
def _tension_gain(slope, r):
    """End tension over end tension at entry, less one."""
    if slope == 1.0:
        return r * (2.0 + r)
    return expm1((1.0 + slope) * log1p(r))


@small_kernel
def _displacement_gain(front, c, end, sigma, r):
    """End displacement since the segment was entered, m."""
    T_e, E, bend, slope = (
        front[2 * c + end, TE],
        front[2 * c + end, EE],
        front[2 * c + end, BEND],
        front[2 * c + end, SLOPE],
    )
    if slope == 1.0:
        return T_e * r * (E * (2.0 + r) + sigma * bend * r)
    y = log1p(r)
    return T_e * (E * expm1((1.0 + slope) * y) + sigma * bend * _curl(slope, y))


@small_kernel
def _solve_segment(front, c, end, sigma, weight_P, weight_d, residual):
    """R at which weight_P (P - P_e) + weight_d (d - d_e) = residual, within the segment."""
    T_e, P_e, E, bend = front[2 * c + end, TE], front[2 * c + end, PE], front[2 * c + end, EE], front[2 * c + end, BEND]
    slope = front[2 * c + end, SLOPE]
    b = weight_P * P_e + weight_d * T_e * E
    if slope == 1.0:
        a = b + weight_d * T_e * sigma * bend
        return residual / (b + sqrt(max(0.0, b * b + a * residual)))
    return _solve_sloping(slope, b, weight_d * T_e * sigma * bend, residual, log1p(front[2 * c + end, R_STOP]))


@kernel
def _solve_sloping(slope, b, k, residual, y_stop):
    """R = expm1(y) with b expm1((1 + slope) y) + k curl(y) = residual, y 0 <= y / y_stop <= 1, by guarded Newton."""
    near, far = 0.0, y_stop
    gain = 1.0 + slope
    linear = b * gain
    square = 0.5 * gain * (b * gain + k)
    y = 2.0 * residual / (linear + sqrt(max(0.0, linear * linear + 4.0 * square * residual)))
    for _ in range(60):
        if not (min(near, far) < y < max(near, far)):
            y = 0.5 * (near + far)
        miss = b * expm1(gain * y) + k * _curl(slope, y) - residual
        if (miss > 0.0) == (y_stop > 0.0):
            far = y
        else:
            near = y
        step = miss / (b * gain * exp(gain * y) + k * gain * exp(slope * y) * expm1(y))
        y -= step
        if abs(step) <= 2e-16 * abs(y):
            break
    return expm1(y)


# ------------------------------------------------------------------------------------------------------------- a front


@kernel
def start_front(path, state, c, end, sigma):
    """Let a new front set out from an end, from the tension and displacement that stand there now."""
    sign = 1.0 - 2.0 * c
    front = state.front
    tension = state.value[c, T_DRIVE + end]
    front[2 * c + end, ME] = 0.0
    front[2 * c + end, TE] = tension
    front[2 * c + end, PE] = tension
    front[2 * c + end, P] = tension
    front[2 * c + end, EE] = path.table[end, LUMP, 0]
    displacement = sign * state.value[PAIR, DRIVE] if end == 0 else -sign * state.value[PAIR, LOAD]
    front[2 * c + end, DE] = displacement
    front[2 * c + end, D] = displacement
    front[2 * c + end, D_START] = displacement
    state.kind[c, SIGMA + 3 * end] = sigma
    state.kind[c, PIECE + 3 * end] = 0
    aim(path, state, c, end)


@kernel
def aim(path, state, c, end):
    """Look at what lies ahead of a front's point of entry; what already has the line's slope is taken at once."""
    front, kind = state.front, state.kind
    sigma = kind[c, SIGMA + 3 * end]
    front[2 * c + end, R] = 0.0
    while True:
        lo, hi, piece = state.kind[c, LO], state.kind[c, HI], kind[c, PIECE + 3 * end]
        at_end = lo >= state.kind[c, LAST] if end == 0 else hi <= state.kind[c, FIRST]
        if at_end or piece >= (path.table.shape[2] - 1):
            kind[c, OPEN + 3 * end] = 0
            front[2 * c + end, R_STOP] = 0.0
            return
        if end == 0:
            slope, corner = state.corner[C_SLOPE, c, lo], state.corner[C_M, c, lo + 1]
        else:
            slope, corner = -state.corner[C_SLOPE, c, hi - 1], path.total - state.corner[C_M, c, hi - 1]
        node = path.table[end, NODE, piece + 1]
        stop = min(corner, node)
        dm = stop - front[2 * c + end, ME]
        if dm > 0.0:
            r = expm1(sigma * dm)
            if slope != -sigma:
                front[2 * c + end, STOP] = stop
                front[2 * c + end, SLOPE] = sigma * slope
                front[2 * c + end, BEND] = path.table[end, PER_M, piece]
                front[2 * c + end, R_STOP] = r
                kind[c, OPEN + 3 * end] = 1
                return
            front[2 * c + end, TE] /= 1.0 + r
            front[2 * c + end, EE] = front[2 * c + end, EE] * (1.0 + r) + abs(r) * path.table[end, PER_M, piece]
            front[2 * c + end, ME] = stop
        _cross(path, state, c, end, corner <= stop, node <= stop)


@kernel
def _cross(path, state, c, end, corner, node):
    """Leave a corner of the old profile and a node of the path behind."""
    if corner:
        if end == 0:
            state.kind[c, LO] += 1
            state.front[2 * c + end, TE] = state.corner[C_T, c, state.kind[c, LO]]
        else:
            state.kind[c, HI] -= 1
            state.front[2 * c + end, TE] = state.corner[C_T, c, state.kind[c, HI]]
    if node:
        state.kind[c, PIECE + 3 * end] += 1
        state.front[2 * c + end, EE] += path.table[end, LUMP, state.kind[c, PIECE + 3 * end]]


@small_kernel
def walk(path, state, c, end, weight_P, weight_d, target):
    """Draw a front inward until weight_P P + weight_d d = target, P the end's tension and d its displacement.

    Stops where the old profile ends, with nothing ahead (OPEN = 0).
    """
    front, kind = state.front, state.kind
    sigma = kind[c, SIGMA + 3 * end]
    while kind[c, OPEN + 3 * end] == 1:
        residual = target - weight_P * front[2 * c + end, PE] - weight_d * front[2 * c + end, DE]
        if sigma * residual <= 0.0:
            r = 0.0
        else:
            r = front[2 * c + end, R_STOP]
            whole = weight_P * front[2 * c + end, PE] * _tension_gain(front[2 * c + end, SLOPE], r)
            whole += weight_d * _displacement_gain(front, c, end, sigma, r)
            if sigma * residual < sigma * whole:
                r = _solve_segment(front, c, end, sigma, weight_P, weight_d, residual)
            else:
                _pass_segment(path, state, c, end, sigma, r)
                continue
        front[2 * c + end, R] = r
        front[2 * c + end, P] = front[2 * c + end, PE] * (1.0 + _tension_gain(front[2 * c + end, SLOPE], r))
        front[2 * c + end, D] = front[2 * c + end, DE] + _displacement_gain(front, c, end, sigma, r)
        return
    front[2 * c + end, P] = front[2 * c + end, PE]
    front[2 * c + end, D] = front[2 * c + end, DE]


@kernel
def _pass_segment(path, state, c, end, sigma, r):
    front = state.front
    slope = front[2 * c + end, SLOPE]
    front[2 * c + end, DE] += _displacement_gain(front, c, end, sigma, r)
    front[2 * c + end, PE] *= 1.0 + _tension_gain(slope, r)
    front[2 * c + end, TE] *= 1.0 + r if slope == 1.0 else exp(slope * log1p(r))
    front[2 * c + end, EE] = front[2 * c + end, EE] * (1.0 + r) + abs(r) * front[2 * c + end, BEND]
    stop = front[2 * c + end, STOP]
    front[2 * c + end, ME] = stop
    if end == 0:
        corner = state.corner[C_M, c, state.kind[c, LO] + 1]
    else:
        corner = path.total - state.corner[C_M, c, state.kind[c, HI] - 1]
    node = path.table[end, NODE, state.kind[c, PIECE + 3 * end] + 1]
    _cross(path, state, c, end, corner <= stop, node <= stop)
    aim(path, state, c, end)


@small_kernel
def position(state, c, end):
    """How far a front has come, in m counted from its end."""
    return state.front[2 * c + end, ME] + state.kind[c, SIGMA + 3 * end] * log1p(state.front[2 * c + end, R])


@kernel
def end_compliance(state, c, end):
    """Displacement of an end per unit of its own tension while its front goes on, m/N."""
    front = state.front
    sigma = state.kind[c, SIGMA + 3 * end]
    r = front[2 * c + end, R]
    per_front_tension = front[2 * c + end, EE] * (1.0 + r) + abs(r) * front[2 * c + end, BEND]
    return per_front_tension * exp(-sigma * position(state, c, end))


@small_kernel
def has_met(path, state, c):
    """Whether fronts that slide the same way have met: then their lines are one line."""
    if state.kind[c, OPEN] == 0 or state.kind[c, OPEN + 3] == 0:
        return True
    sigma = state.kind[c, SIGMA]
    ratio = path.ratio[(1 - sigma) // 2]
    load = state.front[2 * c + 1, P]
    return sigma * (state.front[2 * c, P] * ratio - load) >= -ROUNDING * load


# --------------------------------------------------------------------------------------------------- keeping a profile


@kernel
def _commit_front(path, state, c, end):
    """Write the line drawn in from an end into the list of corners."""
    sigma = state.kind[c, SIGMA + 3 * end]
    front = state.front
    inward, r = position(state, c, end), front[2 * c + end, R]
    state.kind[c, SIGMA + 3 * end] = 0
    if sigma == 0 or inward <= 0.0:
        return
    slope = front[2 * c + end, SLOPE]
    tension = front[2 * c + end, TE] * (1.0 + r if slope == 1.0 else exp(slope * log1p(r)))
    if end == 0:
        lo = state.kind[c, LO]
        state.corner[C_M, c, lo] = min(inward, path.total)
        state.corner[C_T, c, lo] = tension
        state.corner[C_M, c, lo - 1] = 0.0
        state.corner[C_T, c, lo - 1] = front[2 * c + end, P]
        state.corner[C_SLOPE, c, lo - 1] = -sigma
        state.kind[c, LO] = lo - 1
        state.kind[c, FIRST] = lo - 1
    else:
        hi = state.kind[c, HI]
        state.corner[C_M, c, hi] = max(0.0, path.total - inward)
        state.corner[C_T, c, hi] = tension
        state.corner[C_SLOPE, c, hi] = sigma
        state.corner[C_M, c, hi + 1] = path.total
        state.corner[C_T, c, hi + 1] = front[2 * c + end, P]
        state.kind[c, HI] = hi + 1
        state.kind[c, LAST] = hi + 1


@kernel
def _commit_line(path, state, c):
    """Make a whole slide's line, or the two about a still point, the old profile."""
    kind = state.kind
    line = kind[c, LINE]
    lo = state.corner.shape[2] // 2 - 1
    kind[c, LO], kind[c, HI] = lo, lo + 1
    state.corner[C_M, c, lo], state.corner[C_T, c, lo] = 0.0, state.value[c, T_DRIVE]
    if kind[c, MODE] == WHOLE:
        state.corner[C_SLOPE, c, lo] = line
    else:
        still = state.value[c, M_STILL]
        state.corner[C_SLOPE, c, lo] = -line
        state.corner[C_M, c, lo + 1] = still
        state.corner[C_T, c, lo + 1] = state.value[c, T_DRIVE] * exp(-line * still)
        state.corner[C_SLOPE, c, lo + 1] = line
        kind[c, HI] = lo + 2
    hi = kind[c, HI]
    state.corner[C_M, c, hi], state.corner[C_T, c, hi] = path.total, state.value[c, T_LOAD]
    kind[c, FIRST], kind[c, LAST] = lo, hi
    kind[c, MODE] = FRONTS
    state.kind[c, SIGMA] = 0
    state.kind[c, SIGMA + 3] = 0


@kernel
def slide_whole(path, state, c, line):
    """Cable `c` slides along its whole length on a line of slope `line`."""
    state.kind[c, MODE] = WHOLE
    state.kind[c, LINE] = line
    pull_line(path, state, c)


@kernel
def passed(path, end, sigma, piece, m):
    """Integral of exp(-sigma m) dx / EA from an end to `m` (counted from it) in bend `piece` (likewise), m/N."""
    node = path.table[end, NODE, piece]
    bend = path.table[end, PER_M, piece] * exp(-sigma * node) * sigma * -expm1(-sigma * (m - node))
    return path.table[end, PASSED + (sigma + 1) // 2, piece] + bend


@kernel
def about_still_point(path, state, c):
    """Compliance on the drive's and the load's side of a still point, per unit of that end's tension, m/N."""
    sigma, piece, m = state.kind[c, LINE], state.kind[c, STILL_PIECE], state.value[c, M_STILL]
    last = path.table.shape[2] - 1
    if state.kind[c, PINNED]:
        # The straight stretch counts to the drive's side: tension is the same all along it.
        lump = path.table[0, LUMP, piece] * exp(-sigma * (path.total - m))
        index = (sigma + 1) // 2
        return path.table[0, PASSED + index, piece], path.table[1, PASSED + index, last - piece] - lump
    return passed(path, 0, sigma, piece, m), passed(path, 1, sigma, last - 1 - piece, path.total - m)


@small_kernel
def line_stiffness(path, state, c):
    """Tension per elongation, N/m, at the drive and at the load end of a cable that moves as a whole."""
    if state.kind[c, MODE] == WHOLE:
        index = (state.kind[c, LINE] + 1) // 2
        return state.value[c, STIFFNESS + index], state.value[c, STIFFNESS + index] * path.ratio[index]
    sigma, m = state.kind[c, LINE], state.value[c, M_STILL]
    drive_side, load_side = about_still_point(path, state, c)
    rise_drive, rise_load = exp(sigma * m), exp(sigma * (path.total - m))
    per_lowest = drive_side * rise_drive + load_side * rise_load
    return rise_drive / per_lowest, rise_load / per_lowest


@small_kernel
def pull_line(path, state, c):
    """End tensions of a cable that moves as a whole, from its elongation; none where it is slack."""
    stretch = max(0.0, elongation(state, c))
    drive, load = line_stiffness(path, state, c)
    state.value[c, T_DRIVE] = drive * stretch
    state.value[c, T_LOAD] = load * stretch


@small_kernel
def is_slack(state, c):
    """Whether a cable hangs without tension: it then has no memory."""
    return state.kind[c, MODE] == WHOLE and elongation(state, c) <= 0.0


@small_kernel
def turn(path, state, c, sigma_drive, sigma_load):
    """Make cable `c` ready for its ends to move as pulls (+1) or releases (-1): what turns round leaves a corner."""
    kind = state.kind
    if kind[c, MODE] == FRONTS:
        goes_on = kind[c, SIGMA] == sigma_drive and kind[c, SIGMA + 3] == sigma_load
    else:
        goes_on = kind[c, MODE] == WHOLE and sigma_load != sigma_drive and kind[c, LINE] == -sigma_drive
    if not goes_on:
        _turn(path, state, c, sigma_drive, sigma_load)


@kernel
def _turn(path, state, c, sigma_drive, sigma_load):
    """As `turn`, where anything changes."""
    kind = state.kind
    if kind[c, MODE] == WHOLE:
        if sigma_load != sigma_drive:
            if kind[c, LINE] == -sigma_drive:
                return
            if path.total == 0.0 or is_slack(state, c):
                kind[c, LINE] = -sigma_drive
                return
        elif path.total == 0.0 or is_slack(state, c):
            return
        _commit_line(path, state, c)
    elif kind[c, MODE] == STILL_POINT:
        if sigma_load == sigma_drive == kind[c, LINE]:
            return
        _commit_line(path, state, c)
    sigmas = (sigma_drive, sigma_load)
    turned_drive = state.kind[c, SIGMA] != sigma_drive
    turned_load = state.kind[c, SIGMA + 3] != sigma_load
    if turned_drive:
        _commit_front(path, state, c, 0)
    if turned_load:
        _commit_front(path, state, c, 1)
    for end in range(2):
        if (turned_drive, turned_load)[end]:
            start_front(path, state, c, end, sigmas[end])
        elif turned_drive or turned_load:
            _shorten(path, state, c, end)


@kernel
def _shorten(path, state, c, end):
    """Stop a front short where the other end has just left a corner in the segment it is in."""
    if state.kind[c, OPEN + 3 * end] == 0:
        return
    if end == 0:
        corner = state.corner[C_M, c, state.kind[c, LO] + 1]
    else:
        corner = path.total - state.corner[C_M, c, state.kind[c, HI] - 1]
    if corner < state.front[2 * c + end, STOP]:
        state.front[2 * c + end, STOP] = corner
        state.front[2 * c + end, R_STOP] = expm1(
            state.kind[c, SIGMA + 3 * end] * (corner - state.front[2 * c + end, ME])
        )
