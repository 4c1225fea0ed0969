"""The tension that the cables hold before the drive moves."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccmodel.geometry import ConduitPath


@dataclass(frozen=True)
class InitialTension:
    """Initial tension profiles T(x, 0) of cables A and B (the paper's (7), Remark 1: any profile goes in).

    Between the given places ln T is linear in the bend angle, the form that friction gives to a profile; where the
    path is straight, tension is the same.

    Attributes
    ----------
    x_m : ndarray, shape (m,)
        Arc lengths from the drive end, m, increasing, first 0, last the path's length.
    tension_A_N, tension_B_N : ndarray, shape (m,)
        Tensions there, N, >= 0; zero everywhere for a slack cable.
    """

    x_m: NDArray
    tension_A_N: NDArray
    tension_B_N: NDArray

    @classmethod
    def uniform(cls, path: ConduitPath, tension_N: float) -> "InitialTension":
        """The same tension all along both cables, as in the paper's (20)."""
        ends = np.full(2, float(tension_N))
        return cls(np.array([0.0, path.length_m]), ends, ends)

    @classmethod
    def between_ends(
        cls, path: ConduitPath, friction_coefficient: float, A_N: tuple[float, float], B_N: tuple[float, float]
    ) -> "InitialTension":
        """Profiles with the given tensions at the drive and the load end of each cable.

        Friction holds no more than |ln(T_load / T_drive)| = mu phi. Ends that are further apart (measured with an
        error, or mu underestimated) are brought to that bound about their geometric mean, which is what a cable
        that slips at rest would do.

        Parameters
        ----------
        path : ConduitPath
        friction_coefficient : float
        A_N, B_N : (float, float)
            Tension at the drive end and at the load end, N. A cable with an end at zero or below is slack.
        """
        bound = friction_coefficient * path.bend_rad
        profiles = []
        for drive, load in (A_N, B_N):
            if min(drive, load) <= 0:
                profiles.append(np.zeros(2))
                continue
            mean, half = 0.5 * np.log(drive * load), 0.5 * np.clip(np.log(load / drive), -bound, bound)
            profiles.append(np.exp([mean - half, mean + half]))
        return cls(np.array([0.0, path.length_m]), *profiles)

    def at(self, path: ConduitPath, x: NDArray) -> tuple[NDArray, NDArray]:
        """Tensions of A and B at arc lengths `x` (m), N; two arrays of the shape of `x`."""
        phi, corner_phi = path.bend_at(x), path.bend_at(self.x_m)
        return tuple(_interpolate(phi, corner_phi, T) for T in (self.tension_A_N, self.tension_B_N))


def _interpolate(phi: NDArray, corner_phi: NDArray, tension: NDArray) -> NDArray:
    if not tension.any():
        return np.zeros_like(phi)
    return np.exp(np.interp(phi, corner_phi, np.log(tension)))
