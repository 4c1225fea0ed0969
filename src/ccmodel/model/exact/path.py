"""The conduit as the kernels see it: nodes in m = mu phi, with compliance between them and at them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.model.geometry import ConduitPath

# Below this mu phi a piece's capstan loss is less than rounding: it is straight.
STRAIGHT = 1e-15


class PathTables(NamedTuple):
    """Tables of a path, seen from both ends (first axis: 0 from the drive end inward, 1 from the load end inward).

    Bends lie between nodes; straight stretches are lumps of compliance at a node, since tension depends on m alone.

    Attributes
    ----------
    node : ndarray, shape (2, n + 1)
        m = mu phi at the nodes, counted from that end.
    bend : ndarray, shape (2, n)
        Compliance of a bend per unit of m, dx / (EA dm), 1/N m.
    lump : ndarray, shape (2, n + 1)
        Compliance of the straight stretch at a node, length / EA.
    x_start, x_per_m : ndarray, shape (2, n)
        Arc length at which a bend begins, and dx/dm along it, counted from that end, m.
    passed : ndarray, shape (2, 2, n + 1)
        Integral of exp(-sigma m) dx / EA up to and with the node's lump; second axis: sigma = -1, +1.
    total : float
        m of the whole path.
    length : float
        Arc length of the whole path, m.
    ratio : ndarray, shape (2,)
        exp(-total), exp(+total): T_load / T_drive of a line of slope -1, +1.
    """

    node: NDArray
    bend: NDArray
    lump: NDArray
    x_start: NDArray
    x_per_m: NDArray
    passed: NDArray
    total: float
    length: float
    ratio: NDArray


def tabulate(path: ConduitPath, friction_coefficient: float, axial_rigidity_N: float) -> PathTables:
    """Tables of `path` for a cable of rigidity EA (N) under friction mu."""
    node, bend, x_start, x_per_m, straight = [0.0], [], [], [], [0.0]
    x = 0.0
    for length, angle in zip(path.piece_length_m, path.piece_bend_rad, strict=True):
        m = friction_coefficient * angle
        if m < STRAIGHT:
            straight[-1] += length
        else:
            node.append(node[-1] + m)
            bend.append(length / (m * axial_rigidity_N))
            x_start.append(x)
            x_per_m.append(length / m)
            straight.append(0.0)
        x += length
    node, bend, x_start, x_per_m = (np.array(a, dtype=float) for a in (node, bend, x_start, x_per_m))
    lump = np.array(straight) / axial_rigidity_N
    total = float(node[-1])
    x_end = x_start + x_per_m * np.diff(node)
    both = (
        np.stack([node, total - node[::-1]]),
        np.stack([bend, bend[::-1]]),
        np.stack([lump, lump[::-1]]),
        np.stack([x_start, x - x_end[::-1]]),
        np.stack([x_per_m, x_per_m[::-1]]),
    )
    passed = np.stack([[_passed(both[0][end], both[1][end], both[2][end], sigma) for sigma in (-1, 1)] for end in (0, 1)])
    return PathTables(*both, passed, total, x, np.exp(np.array([-total, total])))


def _passed(node, bend, lump, sigma):
    """Integral of exp(-sigma m) dx / EA from the end to each node, its lump included."""
    step = bend * np.exp(-sigma * node[:-1]) * sigma * -np.expm1(-sigma * np.diff(node))
    return np.concatenate([[0.0], np.cumsum(step)]) + np.cumsum(lump * np.exp(-sigma * node))
