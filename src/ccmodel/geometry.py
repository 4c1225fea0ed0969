"""Geometry of a conduit: pieces of constant curvature, from the drive end to the load end."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccmodel.failure import ModelError


@dataclass(frozen=True, eq=False)
class ConduitPath:
    """Path of a conduit as pieces of constant curvature, drive end first; a straight piece has no bend.

    The model depends on the path through phi(x), the cumulative bend angle at arc length x: friction depends on phi,
    stretch on x (the paper's equations (4) and (5)).

    Parameters
    ----------
    piece_length_m : ndarray, shape (p,)
        Arc length of each piece, m, > 0.
    piece_bend_rad : ndarray, shape (p,)
        Bend angle of each piece, rad, >= 0 in either direction.

    Raises
    ------
    ModelError
        If there is no piece, the arrays differ in shape, a length is not positive, a bend is negative or a value is
        not finite.
    """

    piece_length_m: NDArray
    piece_bend_rad: NDArray

    def __post_init__(self) -> None:
        length = np.atleast_1d(np.asarray(self.piece_length_m, dtype=float))
        bend = np.atleast_1d(np.asarray(self.piece_bend_rad, dtype=float))
        if length.ndim != 1 or length.shape != bend.shape or length.size == 0:
            raise ModelError(
                f"a conduit needs one bend for each length, at least one of each; got {bend.shape} and {length.shape}"
            )
        if not (np.isfinite(length).all() and np.isfinite(bend).all()):
            raise ModelError("a conduit's lengths and bends must be finite")
        if (length <= 0).any():
            raise ModelError(
                f"every piece of a conduit has a positive length; got {length.min()} m: leave out a piece without"
                " length, and give a sharp corner as the mechanism `kink`"
            )
        if (bend < 0).any():
            raise ModelError(f"bend angles are positive in either direction; got {bend.min()} rad")
        object.__setattr__(self, "piece_length_m", length)
        object.__setattr__(self, "piece_bend_rad", bend)

    @cached_property
    def length_m(self) -> float:
        """Arc length of the whole path, m."""
        return float(self.piece_length_m.sum())

    @cached_property
    def bend_rad(self) -> float:
        """Bend angle of the whole path, rad, which determines the capstan loss in full slip."""
        return float(self.piece_bend_rad.sum())

    @cached_property
    def halfway_m(self) -> float:
        """Arc length at half of the bend angle, m; half of the length if the path is straight."""
        if self.bend_rad == 0:
            return self.length_m / 2
        x, phi = self._corners
        return float(np.interp(self.bend_rad / 2, phi, x))

    def with_extra_bend(self, extra_rad: float) -> "ConduitPath":
        """The path with a bend angle added to every piece in proportion to its length."""
        if extra_rad == 0:
            return self
        return ConduitPath(self.piece_length_m, self.piece_bend_rad + extra_rad * self.piece_length_m / self.length_m)

    def bend_at(self, x: NDArray) -> NDArray:
        """Bend angle phi, rad, from the drive end to arc length `x` (m); same shape as `x`."""
        return np.interp(x, *self._corners)

    @cached_property
    def _corners(self) -> tuple[NDArray, NDArray]:
        """Arc length, m, and bend angle, rad, at the ends of all pieces."""
        x, phi = (np.concatenate([[0.0], np.cumsum(piece)]) for piece in (self.piece_length_m, self.piece_bend_rad))
        return x, phi
