"""The conduit's path as tables over m = mu phi: nodes, and the cable's compliance between and at them."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.geometry import ConduitPath

# Below this mu phi the capstan loss of a piece is less than rounding, and the piece counts as straight.
STRAIGHT = 1e-15
# A longer bend, in mu phi, is laid down as several. The tension of a released cable falls by exp(-mu phi) over a bend
# and is counted as 1 + r, r above -1: that loses digits, and beyond 37 all of them.
LONGEST_BEND = 5.0


# Rows of `PathTables.table`, each seen from one end. m at the nodes. Of the bend after a node: dx / (EA dm), the arc
# length at its start, dx / dm. Of the straight piece at a node: length / EA.
NODE, PER_M, X_START, X_PER_M, LUMP = range(5)


class PathTables(NamedTuple):
    """Tables of a path, seen from both ends.

    Bends lie between nodes. Straight pieces are lumped compliances at a node, since tension depends on m alone.

    Attributes
    ----------
    table : ndarray, shape (2, 5, n + 1)
        First axis: from the drive end inward, from the load end inward; second axis: the rows above. The values of a
        bend stand at the node before it.
    ratio : tuple of two floats
        exp(-total), exp(+total): T_load / T_drive of a line of slope -1, +1.
    line_compliance : tuple of two floats
        Elongation per drive-end tension on a line of slope -1, +1: the integral of exp(slope m) dx / EA, m/N.
    total : float
        m of the whole path.
    length : float
        Arc length of the whole path, m.
    """

    table: NDArray
    ratio: tuple[float, float]
    line_compliance: tuple[float, float]
    total: float
    length: float


def tabulate(path: ConduitPath, friction_coefficient: float, axial_rigidity_N: float) -> PathTables:
    """Tables of `path` for a cable of axial rigidity EA (N) and friction mu."""
    nodes, bends, starts, lengths, straight = [0.0], [], [], [], [0.0]
    x = 0.0
    for length, angle in zip(path.piece_length_m, path.piece_bend_rad, strict=True):
        m = friction_coefficient * angle
        if m < STRAIGHT:
            straight[-1] += length
        else:
            parts = math.ceil(m / LONGEST_BEND)
            for part in range(parts):
                nodes.append(nodes[-1] + m / parts)
                bends.append(length / (m * axial_rigidity_N))
                starts.append(x + length * part / parts)
                lengths.append(length / m)
                straight.append(0.0)
        x += length
    node, bend, x_start, x_per_m = (np.array(a, dtype=float) for a in (nodes, bends, starts, lengths))
    lump = np.array(straight) / axial_rigidity_N
    total = float(node[-1])
    x_end = x_start + x_per_m * np.diff(node)
    table = np.zeros((2, LUMP + 1, node.size))
    _fill(table[0], node, bend, x_start, x_per_m, lump)
    _fill(table[1], total - node[::-1], bend[::-1], x - x_end[::-1], x_per_m[::-1], lump[::-1])
    compliance = _line_compliance(node, bend, lump, -1), _line_compliance(node, bend, lump, 1)
    return PathTables(table, (math.exp(-total), math.exp(total)), compliance, total, float(x))


def _fill(table: NDArray, node: NDArray, bend: NDArray, x_start: NDArray, x_per_m: NDArray, lump: NDArray) -> None:
    """Write the rows of one end."""
    table[NODE], table[LUMP] = node, lump
    for row, values in ((PER_M, bend), (X_START, x_start), (X_PER_M, x_per_m)):
        table[row, :-1] = values


def _line_compliance(node: NDArray, bend: NDArray, lump: NDArray, slope: int) -> float:
    """Integral of exp(slope m) dx / EA over the path, m/N."""
    bends = bend * np.exp(slope * node[:-1]) * slope * np.expm1(slope * np.diff(node))
    return float(bends.sum() + (lump * np.exp(slope * node)).sum())
