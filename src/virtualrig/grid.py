"""One cable in its conduit as a chain: a node in the middle of each cell, a spring from node to node."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from virtualrig.config import Piece


@dataclass(frozen=True)
class Grid:
    """Cells along a conduit, drive end first.

    Friction acts at the nodes, which sit in the middle of the cells, so the first and the last spring are half as
    long as a cell. Placed like this, a front that runs into the cable meets the exact tension each time it reaches a
    further node, and the error between is a fraction of one node's friction.

    Attributes
    ----------
    cell_length_m, cell_bend_rad : ndarray, shape (n,)
        Arc length (m) and bend angle (rad) of each cell.
    """

    cell_length_m: NDArray
    cell_bend_rad: NDArray

    @property
    def segment_length_m(self) -> NDArray:
        """Length of the springs: drive end to first node, node to node, last node to load end; m, shape (n + 1,)."""
        half = np.concatenate([[0.0], self.cell_length_m, [0.0]]) / 2
        return half[:-1] + half[1:]


def make_grid(pieces: Sequence[Piece], cell_length_m: float, cell_bend_rad: float) -> Grid:
    """Divide each piece into equal cells no longer than `cell_length_m` that bend no more than `cell_bend_rad`.

    Cells never straddle two pieces, so curved and straight stretches keep their exact length and bend.
    """
    counts = [max(1, _ceil(p.length_m / cell_length_m), _ceil(p.bend_rad / cell_bend_rad)) for p in pieces]
    return Grid(
        cell_length_m=np.repeat([p.length_m / n for p, n in zip(pieces, counts, strict=True)], counts),
        cell_bend_rad=np.repeat([p.bend_rad / n for p, n in zip(pieces, counts, strict=True)], counts),
    )


def _ceil(ratio: float) -> int:
    # A ratio that is whole but for rounding must not cost a cell more.
    return int(np.ceil(ratio * (1 - 1e-12)))
