"""A half stroke of the pair in closed form and extended precision, the reference solution for all solvers.

It holds for a path of one curvature, from a reversal at which both cables slide over their whole length, as long as no
cable is slack. A front from an end then replaces a line in ln T over mu phi by one of the opposite slope. A front that
has reached r = expm1(sigma mu phi) has taken up the displacement sigma T_0 c r^2 and changed the end's tension from T_0
to (1 + r)^2 T_0, where c = L / (mu Phi EA) for a conduit of length L and bend Phi.
"""

from dataclasses import dataclass

import numpy as np
from cases import Case
from numpy.typing import NDArray

# Directions of the drive's displacement for cables A and B.
SIGNS = (1, -1)
BISECTIONS = 80


def drive_tensions(case: Case, theta_in: NDArray) -> NDArray:
    """T1 and T3 in a half stroke.

    Parameters
    ----------
    theta_in : ndarray, shape (n,)
        Drive angle, rad; the first sample is the reversal.

    Returns
    -------
    ndarray of longdouble, shape (2, n)
        N.
    """
    stroke = _Stroke.of(case, theta_in)
    low, high = np.zeros_like(stroke.drive), np.full_like(stroke.drive, abs(stroke.drive - stroke.drive[0]).max())
    for _ in range(BISECTIONS):
        travel = (low + high) / 2
        goes_on = stroke.excess(travel) > 0
        low, high = np.where(goes_on, travel, low), np.where(goes_on, high, travel)
    (T1, _), (T3, _) = stroke.tensions(low)
    return np.array([T1, T3])


@dataclass(frozen=True)
class _Stroke:
    """A stroke from a reversal, in extended precision.

    Attributes
    ----------
    drive : ndarray, shape (n,)
        Displacement of the drive, m.
    direction : float
        Of the stroke, 1 or -1.
    M : float
        Friction coefficient times bend angle.
    c : float
        Length over (M times axial rigidity), m/N.
    stiffness : float
        Of the load spring along the cable, N/m.
    rest : float
        Elongation of a cable at rest, m.
    """

    drive: NDArray
    direction: float
    M: float
    c: float
    stiffness: float
    rest: float

    @classmethod
    def of(cls, case: Case, theta_in: NDArray) -> "_Stroke":
        """The stroke of a case."""
        transmission, path = case.transmission, case.transmission.path
        R_i, R_o = np.longdouble(transmission.drive_radius_m), np.longdouble(transmission.load_radius_m)
        M = np.longdouble(transmission.friction_coefficient) * np.longdouble(path.bend_rad)
        c = np.longdouble(path.length_m) / (M * np.longdouble(transmission.axial_rigidity_N))
        drive = R_i * theta_in.astype(np.longdouble)
        stiffness = np.longdouble(case.load.stiffness_Nm_per_rad) / R_o**2
        rest = c * M * np.longdouble(case.initial.tension_A_N[0])
        return cls(drive, np.sign(drive[1] - drive[0]), M, c, stiffness, rest)

    @property
    def load_at_reversal(self) -> float:
        """Displacement of the load at the reversal, m. The balance of two lines is linear in it."""
        per_m = [self.line(np.longdouble(1), self.direction * sign)[1] for sign in SIGNS]
        elongation = [self.rest + sign * self.drive[0] for sign in SIGNS]
        return (per_m[0] * elongation[0] - per_m[1] * elongation[1]) / (per_m[0] + per_m[1] + self.stiffness)

    def line(self, elongation: NDArray, slope: float) -> tuple[NDArray, NDArray]:
        """End tensions of a cable that slides as a whole, on a line of slope `slope` in ln T over mu phi."""
        T_drive = elongation / (self.c * slope * np.expm1(slope * self.M))
        return T_drive, T_drive * np.exp(slope * self.M)

    def front(self, displacement: NDArray, T: NDArray, sigma: float) -> NDArray:
        """Tension of an end that had `T` at the reversal, from the front that the displacement has sent out."""
        r = sigma * np.minimum(np.sqrt(displacement / (self.c * T)), abs(np.expm1(sigma * self.M)))
        return T * (1 + r) ** 2

    def tensions(self, travel: NDArray) -> list[tuple[NDArray, NDArray]]:
        """End tensions of both cables after the load has travelled so far (m) since the reversal."""
        start = self.load_at_reversal
        load, ends = start + self.direction * travel, []
        for sign in SIGNS:
            sigma = sign * self.direction
            T_drive, T_load = self.line(self.rest + sign * (self.drive[0] - start), sigma)
            near = self.front(abs(self.drive - self.drive[0]), T_drive, sigma)
            far = self.front(abs(load - start), T_load, -sigma)
            have_met = sigma * (near * np.exp(-sigma * self.M) - far) >= 0
            whole = self.line(self.rest + sign * (self.drive - load), -sigma)
            ends.append((np.where(have_met, whole[0], near), np.where(have_met, whole[1], far)))
        return ends

    def excess(self, travel: NDArray) -> NDArray:
        """Force that drives the load on in the stroke's direction, N."""
        (_, T2), (_, T4) = self.tensions(travel)
        return self.direction * (T2 - T4 - self.stiffness * (self.load_at_reversal + self.direction * travel))
