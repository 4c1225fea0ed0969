"""One cable at a reversal and as a whole: storing the profile, starting fronts, sliding over the whole length."""

from math import exp, log1p

from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.exact import state as rows
from ccmodel.model.exact.front import position, start_front
from ccmodel.model.exact.path import PathTables
from ccmodel.model.exact.state import State, elongation


@kernel
def slide_whole(path: PathTables, state: State, c: int, line: int) -> None:
    """Let cable `c` slide over its whole length, d ln T / dm = `line`."""
    state.kind[c, rows.MODE] = rows.WHOLE
    state.kind[c, rows.LINE] = line
    pull_line(path, state, c)


@small_kernel
def line_stiffness(path: PathTables, state: State, c: int) -> tuple[float, float]:
    """Tension per elongation at the drive and at the load end of a cable that slides as a whole, N/m."""
    index = (state.kind[c, rows.LINE] + 1) // 2
    return state.value[c, rows.STIFFNESS + index], state.value[c, rows.STIFFNESS + index] * path.ratio[index]


@small_kernel
def pull_line(path: PathTables, state: State, c: int) -> None:
    """Set the end tensions of a cable that slides as a whole from its elongation; zero where it is slack."""
    stretch = max(0.0, elongation(state, c))
    drive, load = line_stiffness(path, state, c)
    state.value[c, rows.T_DRIVE] = drive * stretch
    state.value[c, rows.T_LOAD] = load * stretch


@small_kernel
def is_slack(state: State, c: int) -> bool:
    """Whether a cable hangs without tension, and so without memory."""
    return state.kind[c, rows.MODE] == rows.WHOLE and elongation(state, c) <= 0.0


@small_kernel
def reverse(path: PathTables, state: State, c: int, sigma: int) -> None:
    """Prepare cable `c` for a pull (`sigma` +1) or a release (-1) at the drive, and the opposite at the load.

    A part that slid in the other direction until now leaves corners in the stored profile.
    """
    kind = state.kind
    continues = kind[c, rows.SIGMA] == sigma if kind[c, rows.MODE] == rows.FRONTS else kind[c, rows.LINE] == -sigma
    if not continues:
        _reverse(path, state, c, sigma)


@kernel
def _reverse(path: PathTables, state: State, c: int, sigma: int) -> None:
    """As `reverse`, where anything changes."""
    if state.kind[c, rows.MODE] == rows.WHOLE:
        if path.total == 0.0 or is_slack(state, c):
            state.kind[c, rows.LINE] = -sigma
            return
        _store_line(path, state, c)
    _store_front(path, state, c, 0)
    _store_front(path, state, c, 1)
    start_front(path, state, c, 0, sigma)
    start_front(path, state, c, 1, -sigma)


@kernel
def _store_front(path: PathTables, state: State, c: int, end: int) -> None:
    """Store the sliding line behind the front of an end as corners."""
    sigma = state.kind[c, rows.SIGMA + 3 * end]
    front = state.front
    inward, r = position(state, c, end), front[2 * c + end, rows.R]
    state.kind[c, rows.SIGMA + 3 * end] = 0
    if sigma == 0 or inward <= 0.0:
        return
    slope = front[2 * c + end, rows.SLOPE]
    tension = front[2 * c + end, rows.TE] * (1.0 + r if slope == 1.0 else exp(slope * log1p(r)))
    if end == 0:
        lo = state.kind[c, rows.LO]
        state.corner[rows.C_M, c, lo] = min(inward, path.total)
        state.corner[rows.C_T, c, lo] = tension
        state.corner[rows.C_M, c, lo - 1] = 0.0
        state.corner[rows.C_T, c, lo - 1] = front[2 * c + end, rows.P]
        state.corner[rows.C_SLOPE, c, lo - 1] = -sigma
        state.kind[c, rows.LO] = lo - 1
        state.kind[c, rows.FIRST] = lo - 1
    else:
        hi = state.kind[c, rows.HI]
        state.corner[rows.C_M, c, hi] = max(0.0, path.total - inward)
        state.corner[rows.C_T, c, hi] = tension
        state.corner[rows.C_SLOPE, c, hi] = sigma
        state.corner[rows.C_M, c, hi + 1] = path.total
        state.corner[rows.C_T, c, hi + 1] = front[2 * c + end, rows.P]
        state.kind[c, rows.HI] = hi + 1
        state.kind[c, rows.LAST] = hi + 1


@kernel
def _store_line(path: PathTables, state: State, c: int) -> None:
    """Make the sliding line of a whole cable the stored profile."""
    kind = state.kind
    lo = state.corner.shape[2] // 2 - 1
    kind[c, rows.LO], kind[c, rows.HI] = lo, lo + 1
    state.corner[rows.C_M, c, lo], state.corner[rows.C_T, c, lo] = 0.0, state.value[c, rows.T_DRIVE]
    state.corner[rows.C_SLOPE, c, lo] = kind[c, rows.LINE]
    hi = kind[c, rows.HI]
    state.corner[rows.C_M, c, hi], state.corner[rows.C_T, c, hi] = path.total, state.value[c, rows.T_LOAD]
    kind[c, rows.FIRST], kind[c, rows.LAST] = lo, hi
    kind[c, rows.MODE] = rows.FRONTS
    state.kind[c, rows.SIGMA] = 0
    state.kind[c, rows.SIGMA + 3] = 0
