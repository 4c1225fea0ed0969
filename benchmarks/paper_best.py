"""The fastest known implementation of the paper's discretisation, as a reference for the other solvers.

The equations and symbols are those of `ccmodel.model.paper` for a spring load. Within a stroke the state follows from
the state at its start: the line from each end, and the segment that it has reached. The tension at a cable's load end
is then piecewise linear in the load angle, and Newton's method is exact. Nodes are written only at reversals.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.paper import _capstan_lines
from ccmodel.model.transmission import Transmission

SLACK, WHOLE, FRONTS = -1, 0, 1
# Largest imbalance as a share of the tensions; rounding errors with ten thousand sections are slightly smaller.
BALANCED = 1e-11


def simulate_pair(
    transmission: Transmission, load: SpringLoad, theta_in: NDArray, initial: InitialTension, sections: int = 16
) -> NDArray:
    """T1, T2, T3, T4 (N) and theta_out (rad) at every sample, shape (5, n), along a path of one curvature."""
    path = transmission.path
    x = np.linspace(0, path.length_m, sections + 1)
    h = np.diff(x) / (2 * transmission.axial_rigidity_N)
    phi = path.bend_at(x)
    E, P = _capstan_lines(x, phi, transmission)
    R_o = transmission.load_radius_m
    drive = transmission.drive_radius_m * (theta_in - theta_in[0])
    out = _march(drive, load.stiffness_Nm_per_rad / R_o**2, np.array(initial.at(x, phi)), h, E, P)
    out[4] /= R_o
    return out


@njit(cache=True, inline="always")
def _drive_front(k, w, T, a, S, E, rate):
    """Segment, `k` or later, that the line from the drive end has reached, and the line's constant c."""
    row = (S + 1) // 2
    while k < T.size - 1:
        c = (w[0, k] - a) * rate[0, row, k]
        if S * (c * E[row, k + 1] - T[k + 1]) >= 0:
            return k, c
        k += 1
    return k, 0.0


@njit(cache=True, inline="always")
def _load_front(k, w, T, b, S, E, rate):
    """Segment, `k` or earlier, that the line from the load end has reached, and the line's constant c."""
    row = (S + 1) // 2
    while k >= 0:
        c = (b - w[1, k]) * rate[1, row, k]
        if S * (c * E[row, k] - T[k]) <= 0:
            return k, c
        k -= 1
    return -1, 0.0


@njit(cache=True, inline="always")
def _at_load(arrived, k, w, T, u, a, b, S, E, P, rate):
    """Tension at the load end, its derivative by `b`, the cable's mode, its line's constant c, the load's segment."""
    n, row = T.size - 1, (S + 1) // 2
    if b <= a:
        return 0.0, 0.0, SLACK, 0.0, k
    E_n = E[row, n]
    whole = (b - a) / P[row, n]
    if not arrived:
        at, c = _load_front(k, w, T, b, S, E, rate)
        T_load = T[n] if b == u[n] else c * E_n
        if at >= 0 and S * (whole * E_n - T_load) > 0:
            return T_load, rate[1, row, at] * E_n, FRONTS, c, at
    return whole * E_n, E_n / P[row, n], WHOLE, whole, k


@njit(cache=True)
def _write(drive, load, T, u, a, b, S, E, P):
    """Write all nodes of a cable at a reversal."""
    n, row, u_load = T.size - 1, (S + 1) // 2, u[-1]
    k_drive, c_drive = drive
    mode, c, k_load = load
    for i in range(n + 1):
        if mode == SLACK:
            T[i], u[i] = 0.0, a + (b - a) * i / n
        elif mode == WHOLE:
            T[i], u[i] = c * E[row, i], a + c * P[row, i]
        elif i <= k_drive:
            T[i], u[i] = c_drive * E[row, i], a + c_drive * P[row, i]
        elif i > k_load and b != u_load:
            T[i], u[i] = c * E[row, i], b - c * (P[row, n] - P[row, i])


@njit(cache=True)
def _set_out(w, T, u, h):
    """Invariants of a partly moving segment during a stroke, seen from either end."""
    for i in range(h.size):
        w[0, i] = u[i] + T[i] * h[i]
        w[1, i] = u[i + 1] - T[i + 1] * h[i]


@njit(cache=True, error_model="numpy")
def _march(drive, K, T, h, E, P):
    """March through the samples; returns T1, T2, T3, T4 and the load's displacement, shape (5, n)."""
    n = h.size
    u, w, rate = np.zeros((2, n + 1)), np.empty((2, 2, n)), np.empty((2, 2, n))
    for row in range(2):
        for k in range(n):
            rate[0, row, k] = 1 / (P[row, k] + E[row, k] * h[k])
            rate[1, row, k] = 1 / (P[row, n] - P[row, k + 1] + E[row, k + 1] * h[k])
    for c in range(2):
        for i in range(n):
            u[c, i + 1] = u[c, i] + (T[c, i] + T[c, i + 1]) * h[i]
        _set_out(w[c], T[c], u[c], h)
    b_A, b_B, start = u[0, n], u[1, n], (T[0, n] - T[1, n]) / K
    q, direction, last = 0.0, 0, drive[0]
    front_A, front_B = (0, 0.0), (0, 0.0)
    load_A, load_B = (FRONTS, 0.0, n - 1), (FRONTS, 0.0, n - 1)
    out = np.empty((5, drive.size))
    out[0, 0], out[1, 0], out[2, 0], out[3, 0], out[4, 0] = T[0, 0], T[0, n], T[1, 0], T[1, n], start
    for j in range(1, drive.size):
        d = drive[j]
        if d == last:
            out[:, j] = out[:, j - 1]
            continue
        if direction * (d - last) <= 0:
            if direction != 0:
                _write(front_A, load_A, T[0], u[0], -last, b_A - q, -direction, E, P)
                _write(front_B, load_B, T[1], u[1], last, b_B + q, direction, E, P)
                _set_out(w[0], T[0], u[0], h)
                _set_out(w[1], T[1], u[1], h)
            direction = 1 if d > last else -1
            front_A, front_B = (0, 0.0), (0, 0.0)
            load_A, load_B = (FRONTS, 0.0, n - 1), (FRONTS, 0.0, n - 1)
        front_A = _drive_front(front_A[0], w[0], T[0], -d, -direction, E, rate)
        front_B = _drive_front(front_B[0], w[1], T[1], d, direction, E, rate)
        for _ in range(50):
            T2, rate_A, mode_A, c_A, k_A = _at_load(
                front_A[0] == n, load_A[2], w[0], T[0], u[0], -d, b_A - q, -direction, E, P, rate
            )
            T4, rate_B, mode_B, c_B, k_B = _at_load(
                front_B[0] == n, load_B[2], w[1], T[1], u[1], d, b_B + q, direction, E, P, rate
            )
            excess = T2 - T4 - K * (start + q)
            if abs(excess) <= BALANCED * (T2 + T4):
                break
            q += excess / (rate_A + rate_B + K)
        load_A, load_B = (mode_A, c_A, k_A), (mode_B, c_B, k_B)
        c_A = front_A[1] if mode_A == FRONTS else c_A
        c_B = front_B[1] if mode_B == FRONTS else c_B
        row = (1 - direction) // 2
        out[0, j], out[1, j], out[2, j], out[3, j] = c_A * E[row, 0], T2, c_B * E[1 - row, 0], T4
        out[4, j] = start + q
        last = d
    return out
