"""Cells along the conduit: a friction node in the middle of each, a piece of cable from node to node."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from ccmodel.geometry import ConduitPath
from ccmodel.mechanisms.kink import Kink

# Share of the cells spread by bend; the rest is spread by length, for effects per length.
BEND_WEIGHT = 0.8


@dataclass(frozen=True)
class Grid:
    """Cells along one conduit, drive end first.

    Attributes
    ----------
    boundary_m, boundary_rad : ndarray, shape (n + 1,)
        Arc length and bend angle at the cells' boundaries; a kink is a cell without length.
    held_rad : ndarray, shape (n + 1,)
        The bend angle with the share of each kink that holds tension at rest.
    """

    boundary_m: NDArray
    boundary_rad: NDArray
    held_rad: NDArray

    @cached_property
    def cell_m(self) -> NDArray:
        """Length of each cell, m, shape (n,)."""
        return np.diff(self.boundary_m)

    @cached_property
    def middle_m(self) -> NDArray:
        """Arc length at the middle of each cell, m, shape (n,)."""
        return (self.boundary_m[:-1] + self.boundary_m[1:]) / 2

    @cached_property
    def cell_rad(self) -> NDArray:
        """Bend of each cell, rad, shape (n,)."""
        return np.diff(self.boundary_rad)

    @cached_property
    def segment_m(self) -> NDArray:
        """Length of cable from node to node, the two end pieces included, m, shape (n + 1,)."""
        half = np.concatenate([[0.0], self.cell_m, [0.0]]) / 2
        return half[:-1] + half[1:]


# A fit runs the same few paths thousands of times.
@lru_cache(maxsize=256)
def make_grid(path: ConduitPath, elements: int, kinks: tuple[Kink, ...] = ()) -> Grid:
    """About `elements` cells, finer towards both ends, none across a corner of the path or a kink.

    A slip front at distance X from an end needs a pull of the order X^2, so the tension at that end rises as a square
    root. Linear interpolation between nodes is off by (cell)^2 / X. Cells that grow as the square root of the distance
    from the end keep that error even, and of second order at the end as well.

    Parameters
    ----------
    path : ConduitPath
    elements : int
        Number of cells; a path of many pieces gets at least one a piece.
    kinks : tuple of Kink
    """
    length, bend = path.length_m, path.bend_rad
    corners = np.concatenate([[0.0], np.cumsum(path.piece_length_m)])
    corners[-1] = length
    corners = np.union1d(corners, [kink.share * length for kink in kinks])
    weight = BEND_WEIGHT if bend > 0 else 0.0

    def coordinate(x: NDArray) -> NDArray:
        curved = path.bend_at(x) / bend if bend > 0 else 0.0
        return weight * curved + (1 - weight) * x / length

    graded = (1 - np.cos(np.pi * np.arange(elements + 1) / elements)) / 2
    x = np.interp(graded[1:-1], coordinate(corners), corners)
    # A boundary close to a corner would make a cell that resolves nothing.
    keep = np.ones(x.size, dtype=bool)
    own = np.gradient(np.concatenate([[0.0], x, [length]]))[1:-1] if x.size else x
    for corner in corners[1:-1]:
        keep &= np.abs(x - corner) > 0.4 * own
    x = np.union1d(x[keep], corners)
    phi = path.bend_at(x)
    held = phi.copy()
    for kink in sorted(kinks):
        i = int(np.searchsorted(x, kink.share * length)) + 1
        x, phi, held = (np.insert(values, i, values[i - 1]) for values in (x, phi, held))
        phi[i:] += kink.bend_rad
        held[i:] += kink.hold * kink.bend_rad
    return Grid(x, phi, held)
