"""One step of the drive, from one sample to the next.

During a step the drive moves in one direction, and so does every sliding part of a cable. The result therefore depends
on the end of the step alone, and not on how the drive moved between the samples.

The load follows the drive or rests. The cable that the drive pulls is released at the load; the cable that the drive
releases is pulled at the load. The displacement of the load pulley's rim, Q = R_o theta_out, solves the balance

    T2 - T4 = offset + stiffness Q.

Its left side falls as Q rises: linearly in Q for cables that slide over their whole length, and by a quadratic equation
for each segment that a slip front crosses.
"""

from math import inf

from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.exact import state as rows
from ccmodel.model.exact.cable import line_stiffness, pull_line, reverse, slide_whole
from ccmodel.model.exact.front import end_compliance, has_met, walk
from ccmodel.model.exact.path import PathTables
from ccmodel.model.exact.state import State, copy_fronts, copy_state


@kernel
def step(
    path: PathTables, state: State, saved: State, direction: int, drive: float, offset: float, stiffness: float
) -> None:
    """Move the drive's rim to `drive` (m) and the constant part of the load's law to `offset` (N).

    `direction` is +1 where the drive pulls cable A, -1 where it pulls B. A load that the cables do not move on in that
    direction stays where it is, as does one of infinite stiffness. `saved` is scratch space for a copy of the state.
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
    # On neither cable has the front from the drive met the one from the load: the load-end tensions are unchanged.
    if stiffness == inf or (cables_with_fronts == 2 and not changed):
        return
    # The load rests as long as it is not pushed in the drive's direction.
    if direction * excess(state, offset, stiffness) <= 0.0:
        return
    if cables_with_fronts == 2:
        _balance_both_fronts(path, state, saved, direction, offset, stiffness)
        if not (has_met(path, state, 0) or has_met(path, state, 1)):
            return
        # The balance ignored that fronts meet: it is solved again with the cable whose fronts meet first sliding whole.
        copy_state(saved, state)
        last_with_fronts = _first_to_slide_whole(path, state, saved, direction)
    if cables_with_fronts > 0:
        _balance_one_front(path, state, saved, last_with_fronts, offset, stiffness)
        if not has_met(path, state, last_with_fronts):
            return
        slide_whole(path, state, last_with_fronts, state.kind[last_with_fronts, rows.SIGMA + 3])
    _balance_lines(path, state, offset, stiffness)


@small_kernel
def excess(state: State, offset: float, stiffness: float) -> float:
    """Force out of balance at the rim of the load pulley, T2 - T4 - offset - stiffness Q, N."""
    return (
        state.value[0, rows.T_LOAD]
        - state.value[1, rows.T_LOAD]
        - offset
        - stiffness * state.value[rows.PAIR, rows.LOAD]
    )


@small_kernel
def _balance_lines(path: PathTables, state: State, offset: float, stiffness: float) -> None:
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
def _balanced_load(
    k_A: float, e_A: float, k_B: float, e_B: float, offset: float, stiffness: float, load: float
) -> float:
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
def _balance_one_front(path: PathTables, state: State, saved: State, c: int, offset: float, stiffness: float) -> None:
    """Balance the load where cable `c` has fronts and the other slides as a whole, taut or slack.

    With P the load-end tension of cable `c`, d = -sign Q the displacement of that end, and k (stretch - d) the load-end
    tension of the other cable, the balance is P + (k + stiffness) d = k stretch + sign offset. A taut other cable is
    assumed first; if it comes out slack, the balance is solved again without it (k = 0).
    """
    other = 1 - c
    sign = 1 - 2 * c
    k = line_stiffness(path, state, other)[1]
    stretch = state.value[other, rows.E0] - sign * state.value[rows.PAIR, rows.DRIVE]
    if k > 0.0:
        copy_fronts(state, saved, c)
        walk(path, state, c, 1, 1.0, k + stiffness, k * stretch + sign * offset)
        if stretch - state.front[2 * c + 1, rows.D] < 0.0:
            copy_fronts(saved, state, c)
            k = 0.0
    if k == 0.0:
        walk(path, state, c, 1, 1.0, stiffness, sign * offset)
    state.value[rows.PAIR, rows.LOAD] = -sign * state.front[2 * c + 1, rows.D]
    state.value[c, rows.T_LOAD] = state.front[2 * c + 1, rows.P]
    pull_line(path, state, other)


@kernel
def _balance_both_fronts(
    path: PathTables, state: State, saved: State, direction: int, offset: float, stiffness: float
) -> None:
    """Balance the load, moving in `direction`, between cables that both have fronts; whether these meet is ignored.

    The unknown of the Newton iteration is the load-end tension of the cable that is pulled at the load, not the load's
    displacement: the displacement is a smooth function of the tension, while the tension rises as the square root of
    the displacement where a front starts. The state before the step is left in `saved`.
    """
    pulled = (1 + direction) // 2
    released = 1 - pulled
    copy_state(state, saved)
    start = state.value[released, rows.T_LOAD]
    low = state.value[pulled, rows.T_LOAD]
    high = start - direction * (offset + stiffness * state.value[rows.PAIR, rows.LOAD])
    tension = 0.5 * (low + high)
    for attempt in range(300):
        copy_fronts(saved, state, 0)
        copy_fronts(saved, state, 1)
        walk(path, state, pulled, 1, 1.0, 0.0, tension)
        load = (2 * pulled - 1) * state.front[2 * pulled + 1, rows.D]
        wanted = tension + direction * (offset + stiffness * load)
        walk(path, state, released, 1, 1.0, 0.0, min(start, wanted))
        mismatch = direction * (load - (2 * released - 1) * state.front[2 * released + 1, rows.D])
        if mismatch > 0.0:
            high = tension
        else:
            low = tension
        compliance = end_compliance(state, pulled, 1)
        slope = compliance
        if wanted < start:
            slope += (1.0 + stiffness * compliance) * end_compliance(state, released, 1)
        proposed = tension - mismatch / slope if slope > 0.0 else low
        if attempt % 3 == 2 or not (low < proposed < high):
            # Every third step is a bisection: Newton's steps creep where a front has no segment ahead or hardly moves.
            proposed = 0.5 * (low + high)
        if abs(proposed - tension) <= 2e-16 * abs(tension):
            break
        tension = proposed
    state.value[rows.PAIR, rows.LOAD] = load
    state.value[0, rows.T_LOAD] = state.front[0 + 1, rows.P]
    state.value[1, rows.T_LOAD] = state.front[2 + 1, rows.P]


@kernel
def _first_to_slide_whole(path: PathTables, state: State, saved: State, direction: int) -> int:
    """Let the cable whose fronts meet first slide as a whole; returns the other cable.

    For each cable the load moves until the load-end tension is the drive-end tension times the capstan ratio, where
    fronts meet. The cable that takes the smaller displacement of the load is the first.
    """
    copy_state(state, saved)
    first, least = 0, inf
    for c in range(2):
        sigma = state.kind[c, rows.SIGMA]
        before = state.front[2 * c + 1, rows.D]
        walk(path, state, c, 1, 1.0, 0.0, state.front[2 * c, rows.P] * path.ratio[(1 - sigma) // 2])
        travel = abs(state.front[2 * c + 1, rows.D] - before)
        if travel < least:
            first, least = c, travel
    copy_state(saved, state)
    slide_whole(path, state, first, (2 * first - 1) * direction)
    return 1 - first
