"""A step in which the load moves against the drive: both ends of a cable are drawn apart, or let in, at once.

The two fronts of a cable then slide against each other. Where they have met, a point between them stays still, at the
bottom of a V in ln T (drawn apart, sigma = +1) or at the top of an inverted one (let in, sigma = -1):
T = T_still exp(sigma |m - m_still|). With a and b the rates at which the ends move out,
    2 sigma d(m_still) = a / (C_drive T1) - b / (C_load T2),
C the compliance of either side per unit of its end's tension, and the tensions follow from the elongation. This is an
ordinary differential equation, the one thing in the model whose result depends on the order in which its two ends
move. In a straight stretch tension is the same all along, and m_still rests while the still point crosses it.
"""

from math import exp, inf, sqrt

import numpy as np

from ccmodel.kernel import kernel
from ccmodel.model.exact.along import balance_lines, both_fronts, one_front
from ccmodel.model.exact.cable import (
    DRIVE,
    E0,
    FRONTS,
    GIVEN,
    LINE,
    LOAD,
    M_STILL,
    ME,
    MODE,
    OPEN,
    PAIR,
    PINNED,
    STIFFNESS,
    STILL_PIECE,
    STILL_POINT,
    T_DRIVE,
    T_LOAD,
    WHOLE,
    P,
    about_still_point,
    elongation,
    end_compliance,
    keep,
    keep_fronts,
    line_stiffness,
    position,
    pull_line,
    slide_whole,
    turn,
    walk,
)
from ccmodel.model.exact.path import LUMP, NODE, PASSED

REACHED, STUCK = 0, 1
# What stands for 1 / 0: a side without compliance.
RIGID = 1e100
# A still point is followed down to this elongation, relative to the displacements that it is the difference of: below,
# the cable is as good as slack. It counts as taut again from some hundred times that.
FAINT, TAUT_AGAIN = 1e-12, 100.0
TOLERANCE = 1e-13
# A still point this near to the load, as part of the whole, is there.
ARRIVED = 1e-11
# And as far as this it goes straight when it leaves.
SET_OUT = 1e-8
MAX_EVENTS = 1000
# Steps of integration after which a sample is given up, and after which one goes on with an implicit method: the
# explicit one needs thousands where a still point near an end all but follows its balance. Finding an event counts as
# some of them.
MAX_STEPS, STIFF_AFTER, EVENT_STEPS = 40_000, 400, 20
# What an integration step was ended by.
NOTHING, BEND_LEFT, MEETING, UNPINNED, SLACK, TAUT = range(6)


# ------------------------------------------------------------------------------------------- before fronts have met


@kernel
def step_apart(path, state, trials, ends, stiffness, angle_given, most_steps):
    """Move the load against the drive until `ends` is reached, or until a cable's drive front reaches the load.

    Parameters
    ----------
    path : PathTables
        The conduit.
    state : State
        What the past has left behind; carried on.
    trials : tuple of two State
        Room for what was before a trial.
    ends : tuple of float
        Drive displacement (m) and given (N; or the load's displacement in m where `angle_given`) to go to, linearly
        and together.
    stiffness : float
        The load law's stiffness, N/m.
    angle_given : bool
        Whether the load's displacement is given, not its law.
    most_steps : int
        Steps of integration that may be taken.

    Returns
    -------
    status : int
        REACHED (either of the two) or STUCK.
    steps : int
        Steps of integration that were taken.
    """
    start = (state.value[PAIR, DRIVE], state.value[PAIR, LOAD] if angle_given else state.value[PAIR, GIVEN])
    way = _way(start, ends)
    turn(path, state, 0, way, way)
    turn(path, state, 1, -way, -way)
    s, steps = 0.0, 0
    for _ in range(MAX_EVENTS):
        if _settle_meetings(path, state, start, ends, stiffness, angle_given):
            return REACHED, steps
        if s >= 1.0:
            return REACHED, steps
        if not angle_given and _both_at_load(path, state):
            if _load_stays(path, state, 0, start, ends):
                slide_whole(path, state, 0, -state.kind[0, LINE])
                return REACHED, steps
            s = _leave_load(path, state, trials, s, start, ends, stiffness)
        if _is_still(state, 0) or _is_still(state, 1):
            left = most_steps - steps
            s, reached_load, taken = _wander(path, state, trials, s, start, ends, stiffness, angle_given, left)
            steps += taken
            if reached_load:
                return REACHED, steps
            if steps >= most_steps:
                return STUCK, steps
        else:
            s = _move_fronts(path, state, trials, s, start, ends, stiffness, angle_given)
    return STUCK, steps


@kernel
def _way(start, ends):
    """Direction of the drive; the load moves against it."""
    return 1 if ends[0] > start[0] else -1


@kernel
def _is_still(state, c):
    return state.kind[c, MODE] == STILL_POINT


@kernel
def _is_above(state, c, factor):
    """Whether a cable that is there is stretched by more than `factor` times what rounding leaves."""
    drive, load = state.value[PAIR, DRIVE], state.value[PAIR, LOAD]
    rounding = FAINT * (abs(state.value[c, E0]) + abs(drive) + abs(load))
    return state.value[c, STIFFNESS] > 0.0 and elongation(state, c) > factor * rounding


@kernel
def _crossed(path, state, c):
    """Whether fronts that slide against each other have met."""
    if state.kind[c, MODE] != FRONTS:
        return False
    if state.kind[c, OPEN] == 0 or state.kind[c, OPEN + 3] == 0:
        return True
    return position(state, c, 0) + position(state, c, 1) >= path.total


@kernel
def _move_fronts(path, state, trials, s, start, ends, stiffness, angle_given):
    """Move on while no cable has a still point; returns how far, the first meeting at the latest."""
    before = trials[1]
    keep(state, before)
    _place(path, state, trials[0], 1.0, start, ends, stiffness, angle_given)
    if not _changed_kind(path, state, before):
        return 1.0
    near, far = s, 1.0
    while True:
        middle = 0.5 * (near + far)
        if not near < middle < far:
            break
        keep(before, state)
        _place(path, state, trials[0], middle, start, ends, stiffness, angle_given)
        if _changed_kind(path, state, before):
            far = middle
        else:
            near = middle
    keep(before, state)
    _place(path, state, trials[0], far, start, ends, stiffness, angle_given)
    return far


@kernel
def _changed_kind(path, state, before):
    """Whether a cable's fronts have met, or a slack cable has become taut."""
    for c in range(2):
        if _crossed(path, state, c):
            return True
        if state.kind[c, MODE] == WHOLE and _is_above(state, c, TAUT_AGAIN):
            return True
    return False


@kernel
def _place(path, state, trial, s, start, ends, stiffness, angle_given):
    """Put the ends where they are at `s`, each front for itself."""
    way = _way(start, ends)
    state.value[PAIR, DRIVE] = start[0] + s * (ends[0] - start[0])
    given = start[1] + s * (ends[1] - start[1])
    if s >= 1.0:
        state.value[PAIR, DRIVE], given = ends
    for c in range(2):
        if state.kind[c, MODE] == FRONTS:
            walk(path, state, c, 0, 0.0, 1.0, (1 - 2 * c) * state.value[PAIR, DRIVE])
            state.value[c, T_DRIVE] = state.front[2 * c, P]
    if angle_given:
        state.value[PAIR, LOAD] = given
        for c in range(2):
            if state.kind[c, MODE] == FRONTS:
                walk(path, state, c, 1, 0.0, 1.0, -(1 - 2 * c) * given)
                state.value[c, T_LOAD] = state.front[2 * c + 1, P]
            else:
                pull_line(path, state, c)
        return
    state.value[PAIR, GIVEN] = given
    _balance(path, state, trial, given, stiffness, way)


@kernel
def _balance(path, state, trial, given, stiffness, way):
    """Balance the load, which moves against `way`, whatever the two cables do."""
    fronts_A, fronts_B = state.kind[0, MODE] == FRONTS, state.kind[1, MODE] == FRONTS
    if fronts_A and fronts_B:
        both_fronts(path, state, trial, -way, given, stiffness)
    elif fronts_A or fronts_B:
        one_front(path, state, trial, 0 if fronts_A else 1, given, stiffness)
    else:
        balance_lines(path, state, given, stiffness)


# -------------------------------------------------------------------------------------------------- the still point


@kernel
def _settle_meetings(path, state, start, ends, stiffness, angle_given):
    """Give cables whose fronts have met, or that have become taut, a still point; True if the load was reached."""
    way = _way(start, ends)
    for c in range(2):
        sigma = (1 - 2 * c) * way
        if _crossed(path, state, c):
            m = _meeting(path, state, c)
            _set_still(state, c, sigma, min(max(m, 0.0), path.total))
        elif state.kind[c, MODE] == WHOLE and _is_above(state, c, TAUT_AGAIN):
            if path.total == 0.0:
                continue
            _set_still(state, c, sigma, 0.0)
            _find_balance_point(path, state, c, start, ends, stiffness, angle_given)
        else:
            continue
        if _leave(path, state, c, start, ends, stiffness, angle_given):
            return True
    return False


@kernel
def _meeting(path, state, c):
    """Where fronts that slide against each other have met, m from the drive end."""
    drive, load = position(state, c, 0), position(state, c, 1)
    # What already has a line's slope is taken by its front at once, even beyond the other front: that one's counts.
    drive_leapt = state.front[2 * c, ME] + load > path.total
    load_leapt = state.front[2 * c + 1, ME] + drive > path.total
    return path.total - load if drive_leapt and not load_leapt else drive


@kernel
def _set_still(state, c, sigma, m):
    state.kind[c, MODE] = STILL_POINT
    state.kind[c, LINE] = sigma
    state.value[c, M_STILL] = m
    state.kind[c, PINNED] = 0
    state.kind[c, STILL_PIECE] = 0


@kernel
def _piece_at(path, m):
    """The bend that `m` lies in, the one before it at a node."""
    piece = 0
    while piece < (path.table.shape[2] - 1) - 1 and m > path.table[0, NODE, piece + 1]:
        piece += 1
    return piece


@kernel
def _rates(path, state, start, ends, stiffness, angle_given):
    """dQ/ds, and of each cable C_drive T1 / a's inverse and T2'/T2: what moves m_still, to and fro.

    Returns
    -------
    load_rate : float
    drive_part, load_part : tuple of two floats
        (dT1/ds) / T1 and (dT2/ds) / T2 of cables A and B; zero where there is no still point.
    """
    drive_rate, given_rate = ends[0] - start[0], ends[1] - start[1]
    alpha_A, beta_A, drive_A, T2_A = _response(path, state, 0, drive_rate)
    alpha_B, beta_B, drive_B, T2_B = _response(path, state, 1, -drive_rate)
    load_rate = given_rate
    if not angle_given:
        load_rate = (alpha_A - alpha_B - given_rate) / (beta_A + beta_B + stiffness)
    load_A = (alpha_A - beta_A * load_rate) / T2_A if _is_still(state, 0) else 0.0
    load_B = (alpha_B + beta_B * load_rate) / T2_B if _is_still(state, 1) else 0.0
    if _is_still(state, 0) and state.kind[0, PINNED]:
        drive_A = load_A
    if _is_still(state, 1) and state.kind[1, PINNED]:
        drive_B = load_B
    return load_rate, (drive_A, drive_B), (load_A, load_B)


@kernel
def _response(path, state, c, drive_rate):
    """How tension at the load answers: dT2 = alpha ds + beta (load end's way out); also dT1 / (T1 ds), and T2."""
    mode = state.kind[c, MODE]
    if mode == FRONTS:
        gives = end_compliance(state, c, 1)
        return 0.0, 1.0 / gives if gives > 1.0 / RIGID else RIGID, 0.0, 1.0
    if mode == WHOLE:
        return 0.0, 0.0, 0.0, 1.0
    k_drive, k_load = line_stiffness(path, state, c)
    # A trial may go past where the cable becomes slack.
    e = max(elongation(state, c), 1.0 / RIGID)
    if state.kind[c, PINNED]:
        return k_load * drive_rate, k_load, 0.0, k_load * e
    drive_side, load_side = about_still_point(path, state, c)
    # At the load itself still: it takes what its line takes, and more at once.
    at_load = load_side <= 1.0 / RIGID
    alpha, beta = (k_load * drive_rate, RIGID) if at_load else (0.0, 1.0 / load_side)
    stretch = drive_side * k_drive * e
    drive = drive_rate / stretch if stretch > 1.0 / RIGID else RIGID * drive_rate
    return alpha, beta, drive, k_load * e


@kernel
def _needed(path, state, c, start, ends, stiffness, angle_given):
    """Compliance on the drive's side that would keep m_still where it is, were all beyond it straight."""
    state.kind[c, PINNED] = 1
    drive_rate = (1 - 2 * c) * (ends[0] - start[0])
    _, drive, _ = _rates(path, state, start, ends, stiffness, angle_given)
    tension_rate = drive[c] * line_stiffness(path, state, c)[0] * max(elongation(state, c), 1.0 / RIGID)
    if tension_rate * drive_rate <= 0.0:
        return inf if drive_rate != 0.0 else 0.0
    return drive_rate / tension_rate


@kernel
def _seat(path, state, c, start, ends, stiffness, angle_given):
    """Decide which way a still point leaves where it is; True if it leaves at the load end."""
    m = state.value[c, M_STILL]
    last = path.table.shape[2] - 1
    for node in range(last + 1):
        if abs(m - path.table[0, NODE, node]) <= 4e-16 * path.total:
            state.value[c, M_STILL] = path.table[0, NODE, node]
            state.kind[c, STILL_PIECE] = node
            sigma = state.kind[c, LINE]
            if node == last and path.table[0, LUMP, last] == 0.0:
                state.kind[c, PINNED] = 0
                state.kind[c, STILL_PIECE] = last - 1
                if not angle_given:
                    return _load_stays(path, state, c, start, ends)
                _, drive, load = _rates(path, state, start, ends, stiffness, angle_given)
                return sigma * (drive[c] - load[c]) >= 0.0
            needed = _needed(path, state, c, start, ends, stiffness, angle_given)
            with_lump = path.table[0, PASSED + (sigma + 1) // 2, node]
            without = with_lump - path.table[0, LUMP, node] * exp(-sigma * path.table[0, NODE, node])
            if without <= needed <= with_lump and path.table[0, LUMP, node] > 0.0:
                return False
            state.kind[c, PINNED] = 0
            if needed > with_lump:
                state.kind[c, STILL_PIECE] = min(node, last - 1)
                return node == last
            state.kind[c, STILL_PIECE] = max(node - 1, 0)
            return False
    state.kind[c, PINNED] = 0
    state.kind[c, STILL_PIECE] = _piece_at(path, m)
    return False


@kernel
def _load_stays(path, state, c, start, ends):
    """Whether the load no longer moves against the drive once the still point of `c` has come to it.

    A load at rest gets nothing but what the cables bring whose still point is there. Of two that come near it, each
    takes up the less of the load's torque the farther away it is, so that they arrive at once: were one of them let go
    alone, it would be thrown back by what the other one is about to take.
    """
    push = -_way(start, ends) * (ends[1] - start[1])
    for cable in range(2):
        if cable == c or is_at_load(path, state, cable):
            push += line_stiffness(path, state, cable)[1] * abs(ends[0] - start[0])
    if push < 0.0:
        return False
    if is_at_load(path, state, 1 - c):
        slide_whole(path, state, 1 - c, -state.kind[1 - c, LINE])
    return True


@kernel
def is_at_load(path, state, c):
    """Whether a cable has a still point that stands at the load, as nearly as it is known."""
    if state.kind[c, MODE] != STILL_POINT:
        return False
    e = elongation(state, c)
    known = ARRIVED * path.total * _looser(max(e, elongation(state, 1 - c)), e)
    return path.total - state.value[c, M_STILL] <= known


@kernel
def _both_at_load(path, state):
    """Whether two still points stand at the load, with no straight stretch there to lie in."""
    return path.table[1, LUMP, 0] == 0.0 and is_at_load(path, state, 0) and is_at_load(path, state, 1)


@kernel
def _leave_load(path, state, trials, s, start, ends, stiffness):
    """Let two still points set out from the load together, which neither could do alone; returns how far they get.

    Cable A takes up a part p of the change of torque, and each the less of it the farther away its still point is, so
    that these stand at distances as 1 - p to p. They keep going like that if their speeds are as 1 - p to p too: one
    root, to which any other ratio is drawn. The first of the way is straight.
    """
    low = line_stiffness(path, state, 0)[1] * abs(ends[0] - start[0]) / abs(ends[1] - start[1])
    high = 1.0 - line_stiffness(path, state, 1)[1] * abs(ends[0] - start[0]) / abs(ends[1] - start[1])
    p = 0.5 * (low + high)
    for _ in range(60):
        if (1.0 - p) * _speed(path, state, 1, 1.0 - p, start, ends) > p * _speed(path, state, 0, p, start, ends):
            low = p
        else:
            high = p
        p = 0.5 * (low + high)
    speed_A, speed_B = _speed(path, state, 0, p, start, ends), _speed(path, state, 1, 1.0 - p, start, ends)
    step = min(SET_OUT * path.total / max(speed_A, speed_B), 1.0 - s)
    for c in range(2):
        state.value[c, M_STILL] = path.total - step * (speed_A if c == 0 else speed_B)
        state.kind[c, PINNED] = 0
        state.kind[c, STILL_PIECE] = path.table.shape[2] - 2
    _place(path, state, trials[0], s + step, start, ends, stiffness, False)
    return s + step


@kernel
def _speed(path, state, c, part, start, ends):
    """How fast a still point leaves the load where its cable takes up a part of the change of torque, m per s."""
    e = elongation(state, c)
    pulled = part * abs(ends[1] - start[1]) / (line_stiffness(path, state, c)[1] * e)
    return 0.5 * (pulled - abs(ends[0] - start[0]) / e)


@kernel
def _find_balance_point(path, state, c, start, ends, stiffness, angle_given):
    """Still point of a cable that becomes taut, from no tension: where both ends' shares of its stretch agree."""
    sigma = state.kind[c, LINE]
    near, far = 0.0, path.total
    while True:
        m = 0.5 * (near + far)
        if not near < m < far:
            break
        state.value[c, M_STILL] = m
        state.kind[c, PINNED] = 0
        state.kind[c, STILL_PIECE] = _piece_at(path, m)
        _, drive, load = _rates(path, state, start, ends, stiffness, angle_given)
        if sigma * (drive[c] - load[c]) > 0.0:
            near = m
        else:
            far = m
    # At a straight stretch the search closes in on its node.
    for node in range((path.table.shape[2] - 1) + 1):
        if abs(m - path.table[0, NODE, node]) <= 1e-14 * path.total:
            m = path.table[0, NODE, node]
    state.value[c, M_STILL] = m


@kernel
def _derivative(path, state, trials, y, start, ends, stiffness, angle_given, out):
    """Derivatives of (m_still of A, of B, s) by a parameter that has no singular point; `state` is left at y.

    The parameter counts both sides' relative changes of tension: where a side has no compliance yet, s stands still
    and m_still moves on.
    """
    _set(path, state, trials, y, start, ends, stiffness, angle_given)
    _, drive, load = _rates(path, state, start, ends, stiffness, angle_given)
    pace = 1.0
    for c in range(2):
        pace += abs(drive[c]) + abs(load[c])
    for c in range(2):
        moves = _is_still(state, c) and state.kind[c, PINNED] == 0
        out[c] = 0.5 * state.kind[c, LINE] * (drive[c] - load[c]) / pace if moves else 0.0
    out[2] = 1.0 / pace


@kernel
def _set(path, state, trials, y, start, ends, stiffness, angle_given):
    """Put the state where y says, the load balanced; cables with fronts are drawn along from where they were."""
    before = trials[1]
    for c in range(2):
        if state.kind[c, MODE] == STILL_POINT:
            state.value[c, M_STILL] = y[c]
        elif state.kind[c, MODE] == FRONTS:
            keep_fronts(before, state, c)
    _place(path, state, trials[0], y[2], start, ends, stiffness, angle_given)


# Dormand and Prince's pair of orders 5 and 4.
STAGES = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
ERROR = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])


# Radau's method of order 5.
ROOT = sqrt(6.0)
RADAU = np.array(
    [
        [(88 - 7 * ROOT) / 360, (296 - 169 * ROOT) / 1800, (-2 + 3 * ROOT) / 225],
        [(296 + 169 * ROOT) / 1800, (88 + 7 * ROOT) / 360, (-2 - 3 * ROOT) / 225],
        [(16 - ROOT) / 36, (16 + ROOT) / 36, 1 / 9],
    ]
)


@kernel
def _try_step(path, state, trials, y, h, stiff, start, ends, stiffness, angle_given, slopes, following):
    """One step of length h from y into `following`; returns the error by the tolerance."""
    if stiff:
        return _try_implicit(path, state, trials, y, h, start, ends, stiffness, angle_given, following)
    for stage in range(7):
        for i in range(3):
            total = 0.0
            for j in range(stage):
                total += STAGES[stage, j] * slopes[j, i]
            following[i] = y[i] + h * total
        _derivative(path, state, trials, following, start, ends, stiffness, angle_given, slopes[stage])
    error = np.zeros(3)
    for i in range(3):
        for j in range(7):
            error[i] += h * ERROR[j] * slopes[j, i]
    return _by_tolerance(path, state, error)


@kernel
def _by_tolerance(path, state, error):
    """The largest error by what is tolerated in it."""
    # What counts is tension: in a cable that is all but slack the still point need not be known so well.
    e_A, e_B = elongation(state, 0), elongation(state, 1)
    most = max(e_A, e_B)
    worst = max(abs(error[0]) / _looser(most, e_A), abs(error[1]) / _looser(most, e_B)) / path.total
    return max(worst, abs(error[2])) / TOLERANCE


@kernel
def _try_implicit(path, state, trials, y, h, start, ends, stiffness, angle_given, following):
    """As `_try_step`, where a still point near an end all but follows its balance: two half steps against a whole."""
    jacobian, base, moved, point = np.empty((3, 3)), np.empty(3), np.empty(3), y.copy()
    _derivative(path, state, trials, y, start, ends, stiffness, angle_given, base)
    for j in range(3):
        step = 1e-7 * (path.total - y[j] if j < 2 and 0.0 < y[j] < path.total else 1.0)
        if j < 2:
            step = min(step, 1e-7 * y[j]) if y[j] > 0.0 else step
        point[j] = y[j] + step
        _derivative(path, state, trials, point, start, ends, stiffness, angle_given, moved)
        for i in range(3):
            jacobian[i, j] = (moved[i] - base[i]) / step
        point[j] = y[j]
    whole, half = np.empty(3), np.empty(3)
    for step, begin, end in ((h, y, whole), (0.5 * h, y, half), (0.5 * h, half, following)):
        if not _radau(path, state, trials, begin, step, start, ends, stiffness, angle_given, jacobian, end):
            return inf
    for i in range(3):
        whole[i] = (whole[i] - following[i]) / 31.0
    return _by_tolerance(path, state, whole)


@kernel
def _radau(path, state, trials, y, h, start, ends, stiffness, angle_given, jacobian, following):
    """One step of Radau's method into `following`; False where Newton's iteration finds no end."""
    change, slopes, point, missing = np.zeros(9), np.empty((3, 3)), np.empty(3), np.empty(9)
    inverse = np.zeros((9, 18))
    for i in range(9):
        inverse[i, i] = inverse[i, 9 + i] = 1.0
        for j in range(9):
            inverse[i, j] -= h * RADAU[i // 3, j // 3] * jacobian[i % 3, j % 3]
    _invert(inverse)
    for _ in range(20):
        for i in range(3):
            for j in range(3):
                point[j] = y[j] + change[3 * i + j]
            _derivative(path, state, trials, point, start, ends, stiffness, angle_given, slopes[i])
        for i in range(9):
            missing[i] = -change[i]
            for j in range(3):
                missing[i] += h * RADAU[i // 3, j] * slopes[j, i % 3]
        largest = 0.0
        for i in range(9):
            correction = 0.0
            for j in range(9):
                correction += inverse[i, 9 + j] * missing[j]
            change[i] += correction
            if not abs(correction) < 1.0:
                return False
            largest = max(largest, abs(correction))
        if largest <= 2e-16:
            break
    for i in range(3):
        following[i] = y[i] + change[6 + i]
    return largest <= 1e-14


@kernel
def _invert(rows):
    """Gauss and Jordan's elimination: `rows`, a square matrix beside the unit matrix, becomes that beside its inverse.

    numpy's own would take longer to compile than all else here.
    """
    n = rows.shape[0]
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(rows[i, k]) > abs(rows[pivot, k]):
                pivot = i
        scale = 1.0 / rows[pivot, k] if rows[pivot, k] != 0.0 else inf
        for j in range(2 * n):
            rows[pivot, j], rows[k, j] = rows[k, j], rows[pivot, j] * scale
        for i in range(n):
            factor = rows[i, k]
            if i != k and factor != 0.0:
                for j in range(2 * n):
                    rows[i, j] -= factor * rows[k, j]


@kernel
def _looser(most, e):
    return min(max(1.0, most / e), 1e7) if e > 0.0 else 1.0


@kernel
def _event(path, state, start, ends, stiffness, angle_given):
    """What has happened to a cable in the step that `state` is the end of, and to which cable."""
    for c in range(2):
        mode = state.kind[c, MODE]
        if mode == STILL_POINT:
            if not _is_above(state, c, 1.0):
                return SLACK, c
            piece, m = state.kind[c, STILL_PIECE], state.value[c, M_STILL]
            if state.kind[c, PINNED]:
                sigma = state.kind[c, LINE]
                needed = _needed(path, state, c, start, ends, stiffness, angle_given)
                with_lump = path.table[0, PASSED + (sigma + 1) // 2, piece]
                without = with_lump - path.table[0, LUMP, piece] * exp(-sigma * m)
                if not without <= needed <= with_lump:
                    return UNPINNED, c
            elif m < path.table[0, NODE, piece] or m > path.table[0, NODE, piece + 1]:
                return BEND_LEFT, c
        elif mode == FRONTS:
            if _crossed(path, state, c):
                return MEETING, c
        elif _is_above(state, c, TAUT_AGAIN):
            return TAUT, c
    return NOTHING, 0


@kernel
def _wander(path, state, trials, s, start, ends, stiffness, angle_given, most_steps):
    """Integrate until s = 1 or something happens to a cable, for `most_steps` steps at most.

    Returns s, whether a drive front reached the load, and how many steps were taken.
    """
    before = trials[1]
    keep(state, before)
    y = np.array([state.value[0, M_STILL], state.value[1, M_STILL], s])
    following, slopes = np.empty(3), np.empty((7, 3))
    h = 1e-3
    for attempt in range(most_steps):
        stiff = attempt >= STIFF_AFTER
        error = _try_step(path, state, trials, y, h, stiff, start, ends, stiffness, angle_given, slopes, following)
        if not error <= 1.0:
            h *= max(0.1, 0.9 * error**-0.2) if error > 0.0 else 0.1
            continue
        _set(path, state, trials, following, start, ends, stiffness, angle_given)
        event, c = _event(path, state, start, ends, stiffness, angle_given)
        if event == NOTHING and following[2] < 1.0:
            if not angle_given and _both_at_load(path, state) and _load_stays(path, state, 0, start, ends):
                slide_whole(path, state, 0, -state.kind[0, LINE])
                return following[2], True, attempt + 1
            y[:] = following
            h *= min(5.0, 0.9 * max(error, 1e-10) ** -0.2)
            continue
        if event == NOTHING:
            _hit_end(path, state, trials, y, h, stiff, start, ends, stiffness, angle_given, slopes, following)
            _set(path, state, trials, following, start, ends, stiffness, angle_given)
            return 1.0, False, attempt + 1
        near, far, taken = 0.0, h, attempt + EVENT_STEPS
        while True:
            middle = 0.5 * (near + far)
            if not near < middle < far or far - near < 1e-17:
                break
            _try_step(path, state, trials, y, middle, stiff, start, ends, stiffness, angle_given, slopes, following)
            _set(path, state, trials, following, start, ends, stiffness, angle_given)
            tried, tried_c = _event(path, state, start, ends, stiffness, angle_given)
            if tried == NOTHING:
                near = middle
            else:
                far, event, c = middle, tried, tried_c
        _try_step(path, state, trials, y, far, stiff, start, ends, stiffness, angle_given, slopes, following)
        if following[2] >= 1.0:
            _try_step(path, state, trials, y, near, stiff, start, ends, stiffness, angle_given, slopes, following)
            _hit_end(path, state, trials, y, far, stiff, start, ends, stiffness, angle_given, slopes, following)
            _set(path, state, trials, following, start, ends, stiffness, angle_given)
            return 1.0, False, taken
        _set(path, state, trials, following, start, ends, stiffness, angle_given)
        reached = _handle(path, state, event, c, start, ends, stiffness, angle_given)
        return following[2], reached, taken
    return y[2], False, most_steps


@kernel
def _hit_end(path, state, trials, y, h, stiff, start, ends, stiffness, angle_given, slopes, following):
    """Shorten a step of length h so that it ends where s = 1 (regula falsi, Illinois)."""
    near, far = 0.0, h
    miss_near, miss_far = y[2] - 1.0, following[2] - 1.0
    if miss_far < 0.0:
        _try_step(path, state, trials, y, h, stiff, start, ends, stiffness, angle_given, slopes, following)
        miss_far = following[2] - 1.0
    for _ in range(60):
        if abs(following[2] - 1.0) <= 2e-16:
            break
        middle = far - miss_far * (far - near) / (miss_far - miss_near)
        if not near < middle < far:
            break
        _try_step(path, state, trials, y, middle, stiff, start, ends, stiffness, angle_given, slopes, following)
        miss = following[2] - 1.0
        if miss > 0.0:
            far, miss_far = middle, miss
            miss_near *= 0.5
        else:
            near, miss_near = middle, miss
            miss_far *= 0.5
    following[2] = 1.0


@kernel
def _handle(path, state, event, c, start, ends, stiffness, angle_given):
    """Change what cable `c` does after an event; True if its drive front has reached the load."""
    if event == SLACK:
        state.kind[c, MODE] = WHOLE
        state.kind[c, LINE] = -1
        pull_line(path, state, c)
        return False
    if event == UNPINNED:
        return _leave(path, state, c, start, ends, stiffness, angle_given)
    if event == BEND_LEFT:
        piece = state.kind[c, STILL_PIECE]
        beyond = state.value[c, M_STILL] > path.table[0, NODE, piece + 1]
        state.value[c, M_STILL] = path.table[0, NODE, piece + 1 if beyond else piece]
        return _leave(path, state, c, start, ends, stiffness, angle_given)
    return False


@kernel
def _leave(path, state, c, start, ends, stiffness, angle_given):
    """Let a still point go on from where it is; True if at the load. What it takes up decides on one that is pinned."""
    for cable in (c, 1 - c):
        if cable != c and not (_is_still(state, cable) and state.kind[cable, PINNED]):
            continue
        if _seat(path, state, cable, start, ends, stiffness, angle_given):
            slide_whole(path, state, cable, -state.kind[cable, LINE])
            return True
    return False
