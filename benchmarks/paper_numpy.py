"""The paper's algorithm in plain numpy and scipy, the reference for the speed of the compiled solvers.

The equations and symbols are those of `ccmodel.model.paper`. Array operations test every candidate for the last moving
node at once; scipy's bracketing root finder finds the load angle.
"""

import numpy as np
from scipy.optimize import brentq

from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission


def simulate_pair(
    transmission: Transmission, load: SpringLoad, theta_in: np.ndarray, initial: InitialTension, sections: int = 16
) -> np.ndarray:
    """T1, T2, T3, T4 (N) and theta_out (rad) at every sample, shape (5, n), along a path of one curvature."""
    path = transmission.path
    x = np.linspace(0, path.length_m, sections + 1)
    h = np.diff(x) / (2 * transmission.axial_rigidity_N)
    lines = {S: _lines(x, path.bend_at(x), S, transmission) for S in (-1.0, 1.0)}
    cables = [Cable(T, h, lines) for T in initial.at(x, path.bend_at(x))]
    R_i, R_o, K_e = transmission.drive_radius_m, transmission.load_radius_m, load.stiffness_Nm_per_rad
    start = theta = (cables[0].T[-1] - cables[1].T[-1]) * R_o / K_e
    ends = [cable.u[-1] for cable in cables]
    out = np.empty((5, theta_in.size))
    for j, angle in enumerate(theta_in - theta_in[0]):

        def moved(candidate, angle=angle):
            pull = R_o * (candidate - start)
            return cables[0].moved(-R_i * angle, ends[0] - pull), cables[1].moved(R_i * angle, ends[1] + pull)

        def imbalance(candidate):
            (T_A, _), (T_B, _) = moved(candidate)
            return (T_A[-1] - T_B[-1]) * R_o - K_e * candidate

        first = imbalance(theta)
        if abs(first) > 1e-13:
            step = np.sign(first) * 1e-6
            while imbalance(theta + step) * first > 0:
                step *= 4
            theta = brentq(imbalance, theta, theta + step, xtol=1e-15)
        for cable, state in zip(cables, moved(theta), strict=True):
            cable.T, cable.u = state
        out[:, j] = cables[0].T[0], cables[0].T[-1], cables[1].T[0], cables[1].T[-1], theta
    return out


def _lines(x, phi, S, transmission):
    y = S * transmission.friction_coefficient * np.diff(phi)
    E = np.exp(S * transmission.friction_coefficient * phi)
    stretch = E[:-1] * np.expm1(y) / y * np.diff(x) / transmission.axial_rigidity_N
    return E, np.concatenate([[0.0], np.cumsum(stretch)])


class Cable:
    """Tension and displacement of a cable's nodes."""

    def __init__(self, T, h, lines):
        self.T, self.h, self.lines = T, h, lines
        self.u = np.concatenate([[0.0], np.cumsum((T[:-1] + T[1:]) * h)])

    def moved(self, a, b):
        """Tensions and displacements of the nodes after moving the ends to displacements `a` and `b`."""
        T, u, h, n = self.T, self.u, self.h, self.h.size
        if b <= a:
            return np.zeros(n + 1), np.linspace(a, b, n + 1)
        S_a, S_b = np.sign(a - u[0]), np.sign(b - u[-1])
        if S_a == 0 and S_b == 0:
            return T, u
        T_new, u_new = T.copy(), u.copy()
        arrived, T_load = False, T[-1]
        if S_a:
            E, P = self.lines[S_a]
            c = (u[:-1] - a + T[:-1] * h) / (P[:-1] + E[:-1] * h)
            rests = np.flatnonzero(S_a * (c * E[1:] - T[1:]) >= 0)
            arrived |= rests.size == 0
            if rests.size:
                k = rests[0] + 1
                T_new[:k], u_new[:k] = c[k - 1] * E[:k], a + c[k - 1] * P[:k]
        if S_b:
            E, P = self.lines[S_b]
            c = (b - u[1:] + T[1:] * h) / (P[-1] - P[1:] + E[1:] * h)
            rests = np.flatnonzero(S_b * (c * E[:-1] - T[:-1]) <= 0)
            arrived |= rests.size == 0
            if rests.size:
                k = rests[-1] + 1
                T_new[k:], u_new[k:] = c[k - 1] * E[k:], b - c[k - 1] * (P[-1] - P[k:])
                T_load = T_new[-1]
        S = S_a or S_b
        E, P = self.lines[S]
        c = (b - a) / P[-1]
        if arrived or S * (c * E[-1] - T_load) <= 0:
            return c * E, a + c * P
        return T_new, u_new
