"""The loop over samples: what kind of step each is, and what is written down of it."""

from ccmodel.kernel import borrowed, kernel, small_kernel
from ccmodel.model.exact.along import balance_lines, excess, move_along, step_along
from ccmodel.model.exact.cable import (
    D_START,
    DRIVE,
    FIRST,
    GIVEN,
    LAST,
    LINE,
    LOAD,
    M_STILL,
    MODE,
    OPEN,
    PAIR,
    PIECE,
    PINNED,
    STILL_PIECE,
    STILL_POINT,
    T_DRIVE,
    T_LOAD,
    WHOLE,
    D,
    is_slack,
    keep,
    line_stiffness,
    position,
    turn,
)
from ccmodel.model.exact.path import NODE, X_PER_M, X_START
from ccmodel.model.exact.still_point import is_at_load

# How `run` came to its end; APART: the next sample wants `still_point.step_apart` first.
DONE, STUCK, CORNERS_FULL, APART = range(4)
# Room that one sample may need at either end of a list of corners.
MARGIN = 64
# Changes of regime within one sample before it is given up.
MAX_EVENTS = 1000


@kernel
def run(path, state, trials, progress, drive, angle_given, given, stiffness, present, out, phase, balance):
    """Simulate from sample progress[0] on; stops early where the list of corners wants more room.

    A course is a series with the factor that brings it to the unit below, so that no copy of an input need be made.

    Parameters
    ----------
    path : PathTables
        The conduit.
    state : State
        What the past has left behind; carried on.
    trials : tuple of two State
        Room for what was before a trial.
    progress : ndarray of int, shape (3,)
        Next sample, direction of the last stroke, whether slack has lasted through a reversal; carried on.
    drive : tuple of ndarray, shape (n,), and float
        Course of the drive pulley's rim, m.
    angle_given : bool
        Whether the load's displacement is given, not its law.
    given : tuple of ndarray, shape (n,) or (1,), and float
        Course of the load law's constant part (N), or of the load's displacement (m) where `angle_given`; a single
        value holds throughout.
    stiffness : float
        The load law's stiffness, N/m.
    present : ndarray of bool, shape (2,)
        Whether cables A and B are there.
    out : ndarray, shape (9, n)
        T1, T2, T3, T4, Q, and arc length of the moving stretches' limits: A at drive and load, B likewise.
    phase : ndarray of int, shape (n,)
        0 to 2 for phases I to III, 3 for IVa, 4 for IVb.
    balance : ndarray, shape (2,)
        Most that the load was out of balance at a sample, and highest tension at a cable's end, N; carried on.
    """
    path, state, trials = borrowed(path), borrowed(state), borrowed(trials)
    for i in range(progress[0], drive[0].size):
        for c in range(2):
            if state.kind[c, FIRST] < MARGIN or state.kind[c, LAST] > state.corner.shape[2] - MARGIN:
                progress[0] = i
                return CORNERS_FULL
        drive_now, given_now = at_sample(drive, i), at_sample(given, i)
        move = drive_now - state.value[PAIR, DRIVE]
        way = 1 if move > 0.0 else -1
        if move != 0.0:
            if way == -progress[1]:
                progress[2] = _any_slack(state, present)
            progress[1] = way
        if move != 0.0 or given_now != state.value[PAIR, LOAD if angle_given else GIVEN]:
            if angle_given:
                status = _step_angle(path, state, way, drive_now, given_now)
            elif given_now != state.value[PAIR, GIVEN]:
                status = _step_given(path, state, trials, drive_now, given_now, stiffness)
            else:
                step_along(path, state, trials[0], way, drive_now, given_now, stiffness)
                status = DONE
            if status != DONE:
                progress[0] = i
                return status
        out[0, i] = state.value[0, T_DRIVE]
        out[1, i] = state.value[0, T_LOAD]
        out[2, i] = state.value[1, T_DRIVE]
        out[3, i] = state.value[1, T_LOAD]
        out[4, i] = state.value[PAIR, LOAD]
        for c in range(2):
            out[5 + 2 * c, i], out[6 + 2 * c, i] = moving(path, state, c)
        phase[i] = _phase(state, present, progress)
        if not angle_given:
            balance[0] = max(balance[0], abs(excess(state, given_now, stiffness)))
            balance[1] = max(balance[1], out[0, i], out[1, i], out[2, i], out[3, i])
    progress[0] = drive[0].size
    return DONE


@small_kernel
def at_sample(course, i):
    """Value of a course at a sample, in the kernels' units."""
    return course[0][min(i, course[0].size - 1)] * course[1]


@kernel
def _step_angle(path, state, way, drive, load):
    """Move both pulleys to given angles, linearly and together."""
    load_rate = load - state.value[PAIR, LOAD]
    if drive == state.value[PAIR, DRIVE]:
        way = 1 if load_rate > 0.0 else -1
    if way * load_rate < 0.0 and path.total > 0.0:
        return APART
    move_along(path, state, way, drive, load)
    return DONE


@kernel
def _step_given(path, state, trials, drive, given, stiffness):
    """Move drive and given torque together, linearly; the load goes with the drive or against it, as balance wants."""
    for _ in range(MAX_EVENTS):
        drive_rate, given_rate = drive - state.value[PAIR, DRIVE], given - state.value[PAIR, GIVEN]
        if drive_rate == 0.0 and given_rate == 0.0:
            return DONE
        way = 1 if drive_rate > 0.0 or (drive_rate == 0.0 and given_rate < 0.0) else -1
        if path.total == 0.0:
            state.value[PAIR, DRIVE], state.value[PAIR, GIVEN] = drive, given
            balance_lines(path, state, given, stiffness)
            return DONE
        if _push(path, state, way, abs(drive_rate), given_rate) < 0.0:
            return APART
        _step_along_to_slack(path, state, trials, way, drive, given, stiffness)
    return STUCK


@kernel
def _push(path, state, way, drive_rate, given_rate):
    """Rate of T2 - T4 - given in the drive's direction were the load at rest."""
    push = -way * given_rate
    for c in range(2):
        if _at_load(path, state, c, way) and not is_slack(state, c):
            push += line_stiffness(path, state, c)[1] * drive_rate
    return push


@kernel
def _at_load(path, state, c, way):
    """Whether the front from the drive, moving in direction `way`, stands at the load."""
    sigma = (1 - 2 * c) * way
    if state.kind[c, MODE] == WHOLE:
        return state.kind[c, LINE] == -sigma
    return state.kind[c, LINE] == sigma and is_at_load(path, state, c)


@kernel
def _step_along_to_slack(path, state, trials, way, drive, given, stiffness):
    """Go along with the drive to the end, or to where the released cable hangs slack and the load would turn back."""
    turn(path, state, 0, way, -way)
    turn(path, state, 1, -way, way)
    before = trials[1]
    keep(state, before)
    start_drive, start_given = state.value[PAIR, DRIVE], state.value[PAIR, GIVEN]
    released = (1 + way) // 2
    was_slack = is_slack(state, released)
    step_along(path, state, trials[0], way, drive, given, stiffness)
    if was_slack or not is_slack(state, released) or way * (given - start_given) <= 0.0:
        return
    if _push(path, state, way, abs(drive - start_drive), given - start_given) >= 0.0:
        return
    near, far = 0.0, 1.0
    while True:
        s = 0.5 * (near + far)
        if not near < s < far:
            break
        keep(before, state)
        at = (start_drive + s * (drive - start_drive), start_given + s * (given - start_given))
        step_along(path, state, trials[0], way, at[0], at[1], stiffness)
        if is_slack(state, released):
            far = s
        else:
            near = s
    keep(before, state)
    at = (start_drive + far * (drive - start_drive), start_given + far * (given - start_given))
    step_along(path, state, trials[0], way, at[0], at[1], stiffness)


@small_kernel
def _any_slack(state, present):
    for c in range(2):
        if present[c] and is_slack(state, c):
            return 1
    return 0


@small_kernel
def _phase(state, present, progress):
    """0 to 2 for phases I to III, 3 for IVa, 4 for IVb."""
    if _any_slack(state, present):
        return 4 if progress[2] else 3
    progress[2] = 0
    reached = 0
    for c in range(2):
        if present[c] and state.kind[c, MODE] == WHOLE and state.kind[c, LINE] == (2 * c - 1) * progress[1]:
            reached += 1
    return reached


@small_kernel
def moving(path, state, c):
    """Arc length from the drive end up to which, and from which on, a cable has moved since its ends last turned, m."""
    if state.kind[c, MODE] == WHOLE:
        return path.length, 0.0
    if state.kind[c, MODE] == STILL_POINT:
        x = _still_x(path, state, c)
        return x, x
    return _reach(path, state, c, 0), path.length - _reach(path, state, c, 1)


@kernel
def _still_x(path, state, c):
    """Arc length of a still point; of one in a straight stretch, where that stretch begins, m."""
    piece, m = state.kind[c, STILL_PIECE], state.value[c, M_STILL]
    if state.kind[c, PINNED]:
        piece -= 1
        if piece < 0:
            return 0.0
    return path.table[0, X_START, piece] + path.table[0, X_PER_M, piece] * (m - path.table[0, NODE, piece])


@small_kernel
def _reach(path, state, c, end):
    if state.front[2 * c + end, D] == state.front[2 * c + end, D_START]:
        return 0.0
    if state.kind[c, OPEN + 3 * end] == 0:
        return path.length
    piece = state.kind[c, PIECE + 3 * end]
    inward = position(state, c, end) - path.table[end, NODE, piece]
    return path.table[end, X_START, piece] + inward * path.table[end, X_PER_M, piece]
