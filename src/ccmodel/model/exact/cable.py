"""One cable at a reversal and as a whole: storing the profile, starting fronts, sliding over the whole length."""

from math import exp, log1p

from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.exact.front import position, start_front
from ccmodel.model.exact.state import (
    C_M,
    C_SLOPE,
    C_T,
    FIRST,
    FRONTS,
    HI,
    LAST,
    LINE,
    LO,
    MODE,
    SIGMA,
    SLOPE,
    STIFFNESS,
    T_DRIVE,
    T_LOAD,
    TE,
    WHOLE,
    P,
    R,
    elongation,
)


@kernel
def slide_whole(path, state, c, line):
    """Let cable `c` slide over its whole length, d ln T / dm = `line`."""
    state.kind[c, MODE] = WHOLE
    state.kind[c, LINE] = line
    pull_line(path, state, c)


@small_kernel
def line_stiffness(path, state, c):
    """Tension per elongation at the drive and at the load end of a cable that slides as a whole, N/m."""
    index = (state.kind[c, LINE] + 1) // 2
    return state.value[c, STIFFNESS + index], state.value[c, STIFFNESS + index] * path.ratio[index]


@small_kernel
def pull_line(path, state, c):
    """Set the end tensions of a cable that slides as a whole from its elongation; zero where it is slack."""
    stretch = max(0.0, elongation(state, c))
    drive, load = line_stiffness(path, state, c)
    state.value[c, T_DRIVE] = drive * stretch
    state.value[c, T_LOAD] = load * stretch


@small_kernel
def is_slack(state, c):
    """Whether a cable hangs without tension, and so without memory."""
    return state.kind[c, MODE] == WHOLE and elongation(state, c) <= 0.0


@small_kernel
def reverse(path, state, c, sigma):
    """Prepare cable `c` for a pull (`sigma` +1) or a release (-1) at the drive, and the opposite at the load.

    A part that slid in the other direction until now leaves corners in the stored profile.
    """
    kind = state.kind
    continues = kind[c, SIGMA] == sigma if kind[c, MODE] == FRONTS else kind[c, LINE] == -sigma
    if not continues:
        _reverse(path, state, c, sigma)


@kernel
def _reverse(path, state, c, sigma):
    """As `reverse`, where anything changes."""
    if state.kind[c, MODE] == WHOLE:
        if path.total == 0.0 or is_slack(state, c):
            state.kind[c, LINE] = -sigma
            return
        _store_line(path, state, c)
    _store_front(path, state, c, 0)
    _store_front(path, state, c, 1)
    start_front(path, state, c, 0, sigma)
    start_front(path, state, c, 1, -sigma)


@kernel
def _store_front(path, state, c, end):
    """Store the sliding line behind the front of an end as corners."""
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
def _store_line(path, state, c):
    """Make the sliding line of a whole cable the stored profile."""
    kind = state.kind
    lo = state.corner.shape[2] // 2 - 1
    kind[c, LO], kind[c, HI] = lo, lo + 1
    state.corner[C_M, c, lo], state.corner[C_T, c, lo] = 0.0, state.value[c, T_DRIVE]
    state.corner[C_SLOPE, c, lo] = kind[c, LINE]
    hi = kind[c, HI]
    state.corner[C_M, c, hi], state.corner[C_T, c, hi] = path.total, state.value[c, T_LOAD]
    kind[c, FIRST], kind[c, LAST] = lo, hi
    kind[c, MODE] = FRONTS
    state.kind[c, SIGMA] = 0
    state.kind[c, SIGMA + 3] = 0
