"""The path of a conduit: pieces of constant curvature, from the drive end to the load end."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccmodel.failure import ModelError


@dataclass(frozen=True, eq=False)
class ConduitPath:
    """A conduit as pieces of constant curvature, drive end first; a straight piece has no bend.

    The model sees the path only through phi(x), the bend angle run through up to arc length x: friction
    depends on phi, stretch on x (the paper's (4) and (5)).

    Parameters
    ----------
    piece_length_m : ndarray, shape (p,)
        Arc length of each piece, m, > 0.
    piece_bend_rad : ndarray, shape (p,)
        Bend angle of each piece, rad, >= 0.

    Raises
    ------
    ModelError
        If there is no piece, the two arrays differ in shape, a length is not positive, a bend is negative or
        a value is not finite.
    """

    piece_length_m: NDArray
    piece_bend_rad: NDArray

    def __post_init__(self):
        length = np.atleast_1d(np.asarray(self.piece_length_m, dtype=float))
        bend = np.atleast_1d(np.asarray(self.piece_bend_rad, dtype=float))
        if length.ndim != 1 or length.shape != bend.shape or length.size == 0:
            raise ModelError(
                f"a conduit needs as many bends as lengths, at least one of each; got {bend.shape} and {length.shape}"
            )
        if not (np.isfinite(length).all() and np.isfinite(bend).all()):
            raise ModelError("a conduit's lengths and bends must be finite")
        if (length <= 0).any():
            raise ModelError(
                f"every piece of a conduit has a positive length; got {length.min()} m: leave out what has none, and"
                " give a sharp corner as the mechanism `kink`"
            )
        if (bend < 0).any():
            raise ModelError(f"bend angles are counted positive whichever way they turn; got {bend.min()} rad")
        object.__setattr__(self, "piece_length_m", length)
        object.__setattr__(self, "piece_bend_rad", bend)

    @cached_property
    def length_m(self) -> float:
        """Arc length of the whole path, m."""
        return float(self.piece_length_m.sum())

    @cached_property
    def bend_rad(self) -> float:
        """Bend angle of the whole path, rad: what the capstan loss in full slip depends on."""
        return float(self.piece_bend_rad.sum())

    @cached_property
    def halfway_m(self) -> float:
        """Arc length at which half of the bend is behind, m; half of the length of a path without any."""
        if self.bend_rad == 0:
            return self.length_m / 2
        x = np.concatenate([[0.0], np.cumsum(self.piece_length_m)])
        bend = np.concatenate([[0.0], np.cumsum(self.piece_bend_rad)])
        return float(np.interp(self.bend_rad / 2, bend, x))

    def with_extra_bend(self, extra_rad: float) -> "ConduitPath":
        """The same path with bend added to every piece in proportion to its length."""
        if extra_rad == 0:
            return self
        return ConduitPath(self.piece_length_m, self.piece_bend_rad + extra_rad * self.piece_length_m / self.length_m)

    def bend_at(self, x: NDArray) -> NDArray:
        """Bend angle phi(x) run through from the drive end to arc length `x` (m), rad; same shape as `x`."""
        x_corner = np.concatenate([[0.0], np.cumsum(self.piece_length_m)])
        phi_corner = np.concatenate([[0.0], np.cumsum(self.piece_bend_rad)])
        return np.interp(x, x_corner, phi_corner)
