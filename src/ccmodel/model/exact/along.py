"""A step in which the load follows the drive: every point slides one way, and nothing depends on the path in between.

The pulled cable (at the drive) is let in at the load, the released one is pulled there. The load's displacement Q =
R_o theta_out solves T2 - T4 = given + stiffness Q, whose left side falls with Q: linear where a cable slides as a
whole, a quadratic a segment where it does not.
"""

from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.exact.cable import (
    DRIVE,
    E0,
    FRONTS,
    GIVEN,
    LOAD,
    MODE,
    PAIR,
    SIGMA,
    T_DRIVE,
    T_LOAD,
    D,
    P,
    end_compliance,
    has_met,
    keep,
    keep_fronts,
    line_stiffness,
    pull_line,
    slide_whole,
    turn,
    walk,
)


@kernel
def step_along(path, state, kept, way, drive, given, stiffness):
    """Move the drive to `drive` (m) and the load law's constant part to `given` (N), the load following the drive.

    `way` is +1 where cable A is the one pulled, -1 where it is B. A load that would have to turn back stays.
    """
    turn(path, state, 0, way, -way)
    turn(path, state, 1, -way, way)
    state.value[PAIR, DRIVE] = drive
    fronts_left = 0
    still_fronts = -1
    for c in range(2):
        sign = 1 - 2 * c
        if state.kind[c, MODE] == FRONTS:
            walk(path, state, c, 0, 0.0, 1.0, sign * drive)
            state.value[c, T_DRIVE] = state.front[2 * c, P]
            if has_met(path, state, c):
                slide_whole(path, state, c, -sign * way)
            else:
                fronts_left += 1
                still_fronts = c
        else:
            pull_line(path, state, c)
    changed = given != state.value[PAIR, GIVEN]
    state.value[PAIR, GIVEN] = given
    if fronts_left == 2 and not changed:
        return
    if way * excess(state, given, stiffness) <= 0.0:
        return
    if fronts_left == 2:
        both_fronts(path, state, kept, way, given, stiffness)
        if not (has_met(path, state, 0) or has_met(path, state, 1)):
            return
        keep(kept, state)
        still_fronts = _first_whole(path, state, kept, way)
    if fronts_left > 0:
        one_front(path, state, kept, still_fronts, given, stiffness)
        if not has_met(path, state, still_fronts):
            return
        slide_whole(path, state, still_fronts, state.kind[still_fronts, SIGMA + 3])
    balance_lines(path, state, given, stiffness)


@small_kernel
def excess(state, given, stiffness):
    """T2 - T4 less what the load takes, N."""
    return state.value[0, T_LOAD] - state.value[1, T_LOAD] - given - stiffness * state.value[PAIR, LOAD]


@small_kernel
def balance_lines(path, state, given, stiffness):
    """Balance the load where both cables move as a whole, taut or slack."""
    k_A = line_stiffness(path, state, 0)[1]
    k_B = line_stiffness(path, state, 1)[1]
    e_A = state.value[0, E0] + state.value[PAIR, DRIVE]
    e_B = state.value[1, E0] - state.value[PAIR, DRIVE]
    state.value[PAIR, LOAD] = balanced(k_A, e_A, k_B, e_B, given, stiffness, state.value[PAIR, LOAD])
    pull_line(path, state, 0)
    pull_line(path, state, 1)


@small_kernel
def balanced(k_A, e_A, k_B, e_B, given, stiffness, load):
    """Q with k_A max(0, e_A - Q) - k_B max(0, e_B + Q) = given + stiffness Q; `load` where nothing holds the load."""
    total = k_A + k_B + stiffness
    if total == 0.0:
        return load
    q = (k_A * e_A - k_B * e_B - given) / total
    if e_A - q < 0.0 and k_A > 0.0 and k_B + stiffness > 0.0:
        return (-k_B * e_B - given) / (k_B + stiffness)
    if e_B + q < 0.0 and k_B > 0.0 and k_A + stiffness > 0.0:
        return (k_A * e_A - given) / (k_A + stiffness)
    return q


@kernel
def one_front(path, state, kept, c, given, stiffness):
    """Balance the load where cable `c` has fronts and the other moves as a whole, taut or slack."""
    other = 1 - c
    sign = 1 - 2 * c
    k = line_stiffness(path, state, other)[1]
    stretch = state.value[other, E0] - sign * state.value[PAIR, DRIVE]
    if k > 0.0:
        keep_fronts(state, kept, c)
        walk(path, state, c, 1, 1.0, k + stiffness, k * stretch + sign * given)
        if stretch - state.front[2 * c + 1, D] < 0.0:
            keep_fronts(kept, state, c)
            k = 0.0
    if k == 0.0:
        walk(path, state, c, 1, 1.0, stiffness, sign * given)
    state.value[PAIR, LOAD] = -sign * state.front[2 * c + 1, D]
    state.value[c, T_LOAD] = state.front[2 * c + 1, P]
    pull_line(path, state, other)


@kernel
def both_fronts(path, state, kept, way, given, stiffness):
    """Balance the load between two fronts, as if they could not meet others, the load moving in direction `way`.

    The unknown is the tension at the load of the cable that is pulled there: displacements are smooth in it, while it
    starts as a square root of them. What was before stays in `kept`.
    """
    pulled = (1 + way) // 2
    let_in = 1 - pulled
    keep(state, kept)
    start = state.value[let_in, T_LOAD]
    low = state.value[pulled, T_LOAD]
    high = start - way * (given + stiffness * state.value[PAIR, LOAD])
    tension = 0.5 * (low + high)
    for attempt in range(300):
        keep_fronts(kept, state, 0)
        keep_fronts(kept, state, 1)
        walk(path, state, pulled, 1, 1.0, 0.0, tension)
        load = (2 * pulled - 1) * state.front[2 * pulled + 1, D]
        wanted = tension + way * (given + stiffness * load)
        walk(path, state, let_in, 1, 1.0, 0.0, min(start, wanted))
        gap = way * (load - (2 * let_in - 1) * state.front[2 * let_in + 1, D])
        if gap > 0.0:
            high = tension
        else:
            low = tension
        gives = end_compliance(state, pulled, 1)
        slope = gives
        if wanted < start:
            slope += (1.0 + stiffness * gives) * end_compliance(state, let_in, 1)
        following = tension - gap / slope if slope > 0.0 else low
        if attempt % 3 == 2 or not (low < following < high):
            # Where a front has nothing left ahead, or hardly moves, Newton's steps creep.
            following = 0.5 * (low + high)
        if abs(following - tension) <= 2e-16 * abs(tension):
            break
        tension = following
    state.value[PAIR, LOAD] = load
    state.value[0, T_LOAD] = state.front[0 + 1, P]
    state.value[1, T_LOAD] = state.front[2 + 1, P]


@kernel
def _first_whole(path, state, kept, way):
    """Let the cable whose fronts meet after the lesser displacement of the load slide whole; returns the other."""
    keep(state, kept)
    travel = [0.0, 0.0]
    for c in range(2):
        sigma = state.kind[c, SIGMA]
        before = state.front[2 * c + 1, D]
        walk(path, state, c, 1, 1.0, 0.0, state.front[2 * c, P] * path.ratio[(1 - sigma) // 2])
        travel[c] = abs(state.front[2 * c + 1, D] - before)
    keep(kept, state)
    first = 0 if travel[0] <= travel[1] else 1
    slide_whole(path, state, first, (2 * first - 1) * way)
    return 1 - first


@kernel
def move_along(path, state, way, drive, load):
    """Move both ends to given displacements, the load end following the drive end or at rest."""
    turn(path, state, 0, way, -way)
    turn(path, state, 1, -way, way)
    state.value[PAIR, DRIVE] = drive
    state.value[PAIR, LOAD] = load
    for c in range(2):
        sign = 1 - 2 * c
        if state.kind[c, MODE] == FRONTS:
            walk(path, state, c, 0, 0.0, 1.0, sign * drive)
            walk(path, state, c, 1, 0.0, 1.0, -sign * load)
            state.value[c, T_DRIVE] = state.front[2 * c, P]
            state.value[c, T_LOAD] = state.front[2 * c + 1, P]
            if has_met(path, state, c):
                slide_whole(path, state, c, -sign * way)
        else:
            pull_line(path, state, c)
