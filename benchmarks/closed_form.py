"""A half stroke of the pair in closed form and extended precision: the truth that all solvers are measured against.

Only for a path of one curvature, from a reversal at which both cables slide as a whole, and while neither hangs slack:
each end then draws one line into one line of the opposite slope, and a front that has come to r = expm1(sigma dm) has
taken displacement sigma (end tension at the reversal) c r^2 and left the end at (1 + r)^2 of its tension.
"""

import numpy as np
from cases import Case
from numpy.typing import NDArray


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
    one, path = case.transmission, case.transmission.path
    R_i, R_o = np.longdouble(one.drive_radius_m), np.longdouble(one.load_radius_m)
    M = np.longdouble(one.friction_coefficient) * np.longdouble(path.bend_rad)
    c = np.longdouble(path.length_m) / (M * np.longdouble(one.axial_rigidity_N))
    stiffness = np.longdouble(case.load.stiffness_Nm_per_rad) / R_o**2
    drive = R_i * theta_in.astype(np.longdouble)
    way = np.sign(drive[1] - drive[0])
    signs = np.array([1, -1])  # of the drive's displacement, seen from cables A and B
    rest = c * M * np.longdouble(case.initial.tension_A_N[0])

    def line(elongation, slope):
        """End tensions of a cable that slides as a whole on a line of slope `slope` in ln T over mu phi."""
        T_drive = elongation / (c * slope * np.expm1(slope * M))
        return T_drive, T_drive * np.exp(slope * M)

    def front(square, sigma):
        """What a front has come to (r), at most through the whole cable."""
        return sigma * np.minimum(np.sqrt(square), abs(np.expm1(sigma * M)))

    # At the reversal the balance of two lines is linear in the load's displacement.
    per_m = [line(np.longdouble(1), way * sign)[1] for sign in signs]
    start = (per_m[0] * (rest + drive[0]) - per_m[1] * (rest - drive[0])) / (per_m[0] + per_m[1] + stiffness)
    before = [line(rest + sign * (drive[0] - start), way * sign) for sign in signs]

    def tensions(load):
        """End tensions of both cables once the load's displacement is `load`."""
        ends = []
        for sign, (T_drive, T_load) in zip(signs, before, strict=True):
            sigma = sign * way
            near = T_drive * (1 + front(abs(drive - drive[0]) / (c * T_drive), sigma)) ** 2
            far = T_load * (1 + front(abs(load - start) / (c * T_load), -sigma)) ** 2
            met = sigma * (near * np.exp(-sigma * M) - far) >= 0
            whole = line(rest + sign * (drive - load), -sigma)
            ends.append((np.where(met, whole[0], near), np.where(met, whole[1], far)))
        return ends

    low, high = np.zeros_like(drive), np.full_like(drive, abs(drive - drive[0]).max())
    for _ in range(80):
        travel = (low + high) / 2
        (_, T2), (_, T4) = tensions(start + way * travel)
        goes_on = way * (T2 - T4 - stiffness * (start + way * travel)) > 0
        low, high = np.where(goes_on, travel, low), np.where(goes_on, high, travel)
    (T1, _), (T3, _) = tensions(start + way * low)
    return np.array([T1, T3])
