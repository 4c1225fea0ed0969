"""One step of the drive. A cable slides in one direction only, so the result does not depend on the path in between.

The load follows the drive or rests. The cable that is pulled at the drive is let in at the load; the one that is
released at the drive is pulled there. The load's displacement Q = R_o theta_out solves T2 - T4 = offset + stiffness Q,
whose left side falls with Q: linear where a cable slides as a whole, a quadratic a segment where it has fronts.
"""

from math import inf

from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.exact import state as rows
from ccmodel.model.exact.cable import line_stiffness, pull_line, reverse, slide_whole
from ccmodel.model.exact.front import end_compliance, has_met, walk
from ccmodel.model.exact.state import copy_fronts, copy_state


@kernel
def step(path, state, trial, direction, drive, offset, stiffness):
    """Move the drive's rim to `drive` (m) and the constant part of the load's law to `offset` (N).

    `direction` is +1 where the drive pulls cable A, -1 where it pulls B. A load that the cables do not move on in that
    direction stays where it is, as does one of infinite stiffness. `trial` has room for a state to return to.
    """
    reverse(path, state, 0, direction)
    reverse(path, state, 1, -direction)
    state.value[rows.PAIR, rows.DRIVE] = drive
    cables_with_fronts = 0
    last_with_fronts = -1
    for c in range(2):
        sign = 1 - 2 * c
        if state.kind[c, rows.MODE] == rows.FRONTS:
            walk(path, state, c, 0, 0.0, 1.0, sign * drive)
            state.value[c, rows.T_DRIVE] = state.front[2 * c, rows.P]
            if has_met(path, state, c):
                slide_whole(path, state, c, -sign * direction)
            else:
                cables_with_fronts += 1
                last_with_fronts = c
        else:
            pull_line(path, state, c)
    changed = offset != state.value[rows.PAIR, rows.OFFSET]
    state.value[rows.PAIR, rows.OFFSET] = offset
    if stiffness == inf or (cables_with_fronts == 2 and not changed):
        return
    if direction * excess(state, offset, stiffness) <= 0.0:
        return
    if cables_with_fronts == 2:
        _balance_both_fronts(path, state, trial, direction, offset, stiffness)
        if not (has_met(path, state, 0) or has_met(path, state, 1)):
            return
        copy_state(trial, state)
        last_with_fronts = _first_to_slide_whole(path, state, trial, direction)
    if cables_with_fronts > 0:
        _balance_one_front(path, state, trial, last_with_fronts, offset, stiffness)
        if not has_met(path, state, last_with_fronts):
            return
        slide_whole(path, state, last_with_fronts, state.kind[last_with_fronts, rows.SIGMA + 3])
    _balance_lines(path, state, offset, stiffness)


@small_kernel
def excess(state, offset, stiffness):
    """Force out of balance at the rim of the load pulley, T2 - T4 - offset - stiffness Q, N."""
    return (
        state.value[0, rows.T_LOAD]
        - state.value[1, rows.T_LOAD]
        - offset
        - stiffness * state.value[rows.PAIR, rows.LOAD]
    )


@small_kernel
def _balance_lines(path, state, offset, stiffness):
    """Balance the load where both cables slide as a whole, taut or slack."""
    k_A = line_stiffness(path, state, 0)[1]
    k_B = line_stiffness(path, state, 1)[1]
    e_A = state.value[0, rows.E0] + state.value[rows.PAIR, rows.DRIVE]
    e_B = state.value[1, rows.E0] - state.value[rows.PAIR, rows.DRIVE]
    state.value[rows.PAIR, rows.LOAD] = _balanced_load(
        k_A, e_A, k_B, e_B, offset, stiffness, state.value[rows.PAIR, rows.LOAD]
    )
    pull_line(path, state, 0)
    pull_line(path, state, 1)


@small_kernel
def _balanced_load(k_A, e_A, k_B, e_B, offset, stiffness, load):
    """Solve k_A max(0, e_A - Q) - k_B max(0, e_B + Q) = offset + stiffness Q for Q; `load` where nothing holds it."""
    total = k_A + k_B + stiffness
    if total == 0.0:
        return load
    q = (k_A * e_A - k_B * e_B - offset) / total
    if e_A - q < 0.0 and k_A > 0.0 and k_B + stiffness > 0.0:
        return (-k_B * e_B - offset) / (k_B + stiffness)
    if e_B + q < 0.0 and k_B > 0.0 and k_A + stiffness > 0.0:
        return (k_A * e_A - offset) / (k_A + stiffness)
    return q


@kernel
def _balance_one_front(path, state, trial, c, offset, stiffness):
    """Balance the load where cable `c` has fronts and the other slides as a whole, taut or slack."""
    other = 1 - c
    sign = 1 - 2 * c
    k = line_stiffness(path, state, other)[1]
    stretch = state.value[other, rows.E0] - sign * state.value[rows.PAIR, rows.DRIVE]
    if k > 0.0:
        copy_fronts(state, trial, c)
        walk(path, state, c, 1, 1.0, k + stiffness, k * stretch + sign * offset)
        if stretch - state.front[2 * c + 1, rows.D] < 0.0:
            copy_fronts(trial, state, c)
            k = 0.0
    if k == 0.0:
        walk(path, state, c, 1, 1.0, stiffness, sign * offset)
    state.value[rows.PAIR, rows.LOAD] = -sign * state.front[2 * c + 1, rows.D]
    state.value[c, rows.T_LOAD] = state.front[2 * c + 1, rows.P]
    pull_line(path, state, other)


@kernel
def _balance_both_fronts(path, state, trial, direction, offset, stiffness):
    """Balance the load between the fronts of both cables, the load moving in `direction`, as if no fronts could meet.

    The unknown is the load-end tension of the cable that is pulled there: displacements are smooth in that tension,
    while it starts as a square root of them. The state before the step stays in `trial`.
    """
    pulled = (1 + direction) // 2
    let_in = 1 - pulled
    copy_state(state, trial)
    start = state.value[let_in, rows.T_LOAD]
    low = state.value[pulled, rows.T_LOAD]
    high = start - direction * (offset + stiffness * state.value[rows.PAIR, rows.LOAD])
    tension = 0.5 * (low + high)
    for attempt in range(300):
        copy_fronts(trial, state, 0)
        copy_fronts(trial, state, 1)
        walk(path, state, pulled, 1, 1.0, 0.0, tension)
        load = (2 * pulled - 1) * state.front[2 * pulled + 1, rows.D]
        wanted = tension + direction * (offset + stiffness * load)
        walk(path, state, let_in, 1, 1.0, 0.0, min(start, wanted))
        mismatch = direction * (load - (2 * let_in - 1) * state.front[2 * let_in + 1, rows.D])
        if mismatch > 0.0:
            high = tension
        else:
            low = tension
        compliance = end_compliance(state, pulled, 1)
        slope = compliance
        if wanted < start:
            slope += (1.0 + stiffness * compliance) * end_compliance(state, let_in, 1)
        proposed = tension - mismatch / slope if slope > 0.0 else low
        if attempt % 3 == 2 or not (low < proposed < high):
            # Newton's steps creep where a front has no segment ahead or hardly moves.
            proposed = 0.5 * (low + high)
        if abs(proposed - tension) <= 2e-16 * abs(tension):
            break
        tension = proposed
    state.value[rows.PAIR, rows.LOAD] = load
    state.value[0, rows.T_LOAD] = state.front[0 + 1, rows.P]
    state.value[1, rows.T_LOAD] = state.front[2 + 1, rows.P]


@kernel
def _first_to_slide_whole(path, state, trial, direction):
    """Let the cable whose fronts meet first, by displacement of the load, slide as a whole; returns the other one."""
    copy_state(state, trial)
    travel = [0.0, 0.0]
    for c in range(2):
        sigma = state.kind[c, rows.SIGMA]
        before = state.front[2 * c + 1, rows.D]
        walk(path, state, c, 1, 1.0, 0.0, state.front[2 * c, rows.P] * path.ratio[(1 - sigma) // 2])
        travel[c] = abs(state.front[2 * c + 1, rows.D] - before)
    copy_state(trial, state)
    first = 0 if travel[0] <= travel[1] else 1
    slide_whole(path, state, first, (2 * first - 1) * direction)
    return 1 - first
