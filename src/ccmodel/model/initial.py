"""Tension along both cables before anything moves."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath

# A profile may exceed the friction bound by the rounding of printed numbers, no more.
BOUND_TOLERANCE = 1e-9


class Held(NamedTuple):
    """What friction and a drag hold of a cable at rest: |ln(T_load + c) - ln(T_drive + c)| of no more than `bound`.

    c is `drag_N`, the drag over what friction takes of a tension of 1 N: the tension that would rub as much.
    """

    bound: float
    drag_N: float = 0.0


@dataclass(frozen=True)
class InitialTension:
    """Tension profiles of cables A and B as corners; between corners ln(T + c) is linear in the bend angle phi.

    Parameters
    ----------
    x_m : ndarray, shape (k,)
        Arc length of the corners from the drive end, m, strictly increasing, from 0 to the conduit's length.
    tension_A_N, tension_B_N : ndarray, shape (k,)
        Tension at the corners, N: positive throughout, or zero throughout for a cable that hangs just slack. Of a cable
        with a drag some may be zero.
    drags_N : (float, float)
        c of each cable (`Held.drag_N`).

    Raises
    ------
    ModelError
        If shapes differ, a value is not finite, positions do not increase or tensions are not positive.
    """

    x_m: NDArray
    tension_A_N: NDArray
    tension_B_N: NDArray
    drags_N: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("x_m", "tension_A_N", "tension_B_N"):
            values = np.atleast_1d(np.asarray(getattr(self, name), dtype=float))
            if values.ndim != 1 or not np.isfinite(values).all():
                raise ModelError(f"{name} must be a finite, one-dimensional array")
            object.__setattr__(self, name, values)
        if not self.x_m.shape == self.tension_A_N.shape == self.tension_B_N.shape or self.x_m.size < 2:
            raise ModelError("an initial profile has at least two corners and a tension of A and of B at each")
        if (np.diff(self.x_m) <= 0).any():
            raise ModelError("the corners of an initial profile go from the drive end to the load end")
        for name, drag_N in zip(("tension_A_N", "tension_B_N"), self.drags_N, strict=True):
            tension = getattr(self, name)
            if not ((tension > 0).all() or (tension == 0).all() or (drag_N > 0.0 and (tension >= 0).all())):
                raise ModelError(f"{name} must be positive along the whole cable, or zero along the whole cable")

    @classmethod
    def uniform(cls, path: ConduitPath, tension_N: float) -> "InitialTension":
        """The same tension all along both cables, as in the paper's (20)."""
        ends = np.full(2, float(tension_N))
        return cls(np.array([0.0, path.length_m]), ends, ends)

    @classmethod
    def between_ends(
        cls,
        path: ConduitPath,
        friction_coefficient: float,
        A_N: tuple[float, float],
        B_N: tuple[float, float],
        curvatures: tuple[float, float] = (0.0, 0.0),
        kinks_rad: tuple[float, float] = (0.0, 0.0),
        held: Sequence[Held] | None = None,
    ) -> "InitialTension":
        """Profiles with the given tensions at the drive and the load end of each cable.

        Friction holds no more than |ln(T_load / T_drive)| = mu phi. Ends that are further apart (through a measurement
        error or an underestimated mu) are moved to that bound about their geometric mean, as a cable that slips at
        rest does. Beside a drag all of this holds for T + c.

        Parameters
        ----------
        path : ConduitPath
        friction_coefficient : float
        A_N, B_N : (float, float)
            Tension at the drive end and at the load end, N. A cable without a drag that has an end at zero or below is
            slack.
        curvatures : (float, float)
            Distance of ln T halfway through the path's bend from the straight line between the ends, over the largest
            that friction can hold, -1 to 1. It depends on how the cable was tensioned, and the ends do not show it.
        kinks_rad : (float, float)
            Bend at kinks before and beyond this middle, which is not in the path, as far as it holds tension at rest.
        held : sequence of Held, optional
            Of each cable, where friction is another than mu phi.
        """
        halves_rad = [0.5 * path.bend_rad + kinks for kinks in kinks_rad]
        coulomb = max(friction_coefficient * sum(halves_rad), 0.0)
        before = halves_rad[0] / sum(halves_rad) if sum(halves_rad) > 0.0 else 0.5
        held, profiles = held or 2 * (Held(coulomb),), []
        for (drive, load), curvature, (bound, drag_N) in zip((A_N, B_N), curvatures, held, strict=True):
            if min(drive, load) <= 0 and (drag_N <= 0.0 or max(drive, load) <= 0):
                profiles.append(np.zeros(3))
                continue
            # Numbers of Python's own: numpy takes ten times as long for single ones, in every run of a fit.
            ends = log(max(drive, 0.0) + drag_N), log(max(load, 0.0) + drag_N)
            mean, rise = 0.5 * (ends[0] + ends[1]), max(-bound, min(ends[1] - ends[0], bound))
            most = min(before, 1.0 - before) * max(bound - abs(rise), 0.0)
            middle = mean + (before - 0.5) * rise + max(-1.0, min(curvature, 1.0)) * most
            profiles.append((np.exp([mean - 0.5 * rise, middle, mean + 0.5 * rise]) - drag_N).clip(0.0))
        corners, drags_N = np.array([0.0, path.halfway_m, path.length_m]), (held[0].drag_N, held[1].drag_N)
        every = 1 if any(curvatures) else 2  # a corner without a change of slope would only cost time
        return cls(corners[::every], profiles[0][::every], profiles[1][::every], drags_N)

    def at(self, x: NDArray, phi: NDArray) -> tuple[NDArray, NDArray]:
        """Tensions of A and B (N) at arc lengths `x` (m), the bend from the drive end to each of which is `phi` (rad).

        Tension changes where the conduits bend, and at a kink by the share of its bend that `phi` contains. All arrays
        have the shape of `x`.
        """
        corner_phi = np.interp(self.x_m, x, phi)
        pairs = zip((self.tension_A_N, self.tension_B_N), self.drags_N, strict=True)
        of_A, of_B = (_interpolate(phi, corner_phi, tension, drag_N) for tension, drag_N in pairs)
        return of_A, of_B

    def log_slopes(self, path: ConduitPath, friction_coefficient: float) -> tuple[NDArray, NDArray, NDArray]:
        """Corners in the plane of mu phi and ln T, checked against friction's bound |d ln T / d phi| <= mu.

        Returns
        -------
        m : ndarray, shape (k,)
            mu phi at the corners.
        slope_A, slope_B : ndarray, shape (k - 1,)
            d ln T / d(mu phi) between corners, within [-1, 1]; zero where the path does not bend.
        """
        length = path.length_m
        if abs(self.x_m[0]) > 1e-9 * length or abs(self.x_m[-1] - length) > 1e-9 * length:
            raise ModelError(f"the initial profile must cover the conduit, 0 to {length} m; got {self.x_m[[0, -1]]}")
        m = friction_coefficient * path.bend_at(self.x_m)
        m[-1] = friction_coefficient * path.bend_rad
        return m, _slopes(m, self.tension_A_N, "A"), _slopes(m, self.tension_B_N, "B")


def _slopes(m: NDArray, tension: NDArray, cable: str) -> NDArray:
    """Slope d ln T / dm between corners; `ModelError` where friction cannot hold it."""
    if tension[0] == 0:
        return np.zeros(m.size - 1)
    run, rise = np.diff(m), np.diff(np.log(tension))
    excess = np.abs(rise) - run
    worst = int(excess.argmax())
    if excess[worst] > BOUND_TOLERANCE:
        raise ModelError(
            f"cable {cable}: friction cannot hold the initial tension between corners {worst} and {worst + 1},"
            f" |d ln T| = {abs(rise[worst]):.6g} where mu d phi = {run[worst]:.6g}"
        )
    # A profile on the bound is a sliding line, up to rounding of the logarithm.
    on_bound = excess > -4e-15
    slope = np.divide(rise, run, out=np.zeros_like(run), where=run > 0)
    return np.where(on_bound & (run > 0), np.sign(rise), np.clip(slope, -1, 1))


def _interpolate(phi: NDArray, corner_phi: NDArray, tension: NDArray, drag_N: float) -> NDArray:
    """Tension at `phi`, ln(T + drag) linear between corners; zero for a slack cable."""
    if not tension.any():
        return np.zeros_like(phi)
    return (np.exp(np.interp(phi, corner_phi, np.log(tension + drag_N))) - drag_N).clip(0.0)
