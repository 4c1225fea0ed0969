"""Grid of a cable in its conduit: a node in the middle of each cell, and a spring between nodes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from virtualrig.config import Piece


@dataclass(frozen=True)
class Grid:
    """Cells along a conduit, drive end first.

    Friction acts at the nodes in the middle of the cells, so that the first and the last spring have half the length of
    a cell. The tension at a slip front is then exact whenever the front reaches a node; between nodes its error is a
    fraction of one node's friction.

    Attributes
    ----------
    cell_length_m, cell_bend_rad : ndarray, shape (n,)
        Arc length (m) and bend angle (rad) of each cell.
    """

    cell_length_m: NDArray
    cell_bend_rad: NDArray

    @property
    def segment_length_m(self) -> NDArray:
        """Length of the springs, from the drive end over the nodes to the load end; m, shape (n + 1,)."""
        half = np.concatenate([[0.0], self.cell_length_m, [0.0]]) / 2
        return half[:-1] + half[1:]


def make_grid(pieces: Sequence[Piece], cell_length_m: float, cell_bend_rad: float) -> Grid:
    """Divide each piece into equal cells of at most `cell_length_m` and `cell_bend_rad`.

    A cell never extends over two pieces, so that the length and the bend of each piece are exact.
    """
    counts = [max(1, _ceil(p.length_m / cell_length_m), _ceil(p.bend_rad / cell_bend_rad)) for p in pieces]
    return Grid(
        cell_length_m=np.repeat([p.length_m / n for p, n in zip(pieces, counts, strict=True)], counts),
        cell_bend_rad=np.repeat([p.bend_rad / n for p, n in zip(pieces, counts, strict=True)], counts),
    )


def _ceil(ratio: float) -> int:
    # Rounding errors of a whole ratio must not add a cell.
    return int(np.ceil(ratio * (1 - 1e-12)))
