"""The paper's own discretisation of a pull-pull pair: nodes along each cable, its equations (9) to (21).

Agrawal, Peine and Yao, "Modeling of transmission characteristics across a cable-conduit system", IEEE Transactions
on Robotics 26 (2010), Sections III.B and IV. It is the reference that the other solvers are compared with.

A cable has nodes i = 1 .. n + 1 with tension T_i and displacement u_i, positive towards the load. A segment is
moving (case 1), stationary (case 2), or partly moving (case 3). Motion enters at an end and reaches as far as the
last moving node: the nodes up to there lie on a capstan line

    T_i = c E_i,   E_i = exp(S mu phi_i),   S = sign of the motion,                              (13)
    u_j - u_i = c (P_j - P_i),   P_j the sum over segments of (R / K mu) S E_i (exp(S mu dphi_i) - 1),   (14)

and the next segment, with its far node at rest, is stretched by its mean tension (17) to (19). Both make one linear
equation for c for each candidate of the last moving node; the first that leaves the node beyond it at rest holds.
When the moving parts of the two ends have met, the whole cable slides along one line.

This departs from the paper in one place. (19) sets the stretch of a partly moving segment from its mean tension
alone. A segment on a capstan line has a slightly different stretch (14), so at every reversal the tension would jump
by (mu dphi)^2 / 6 of itself without any motion, and the coupled pair chatters on these jumps. Here the change of the
mean tension gives the change of the stretch: the same formula and order, but without motion nothing changes.

The load pulley couples the cables: its motion is what balances (T2 - T4) R_o against the load (21).
"""

import numpy as np
from numpy.typing import NDArray

from ccmodel.channels import TENSIONS
from ccmodel.failure import ModelError
from ccmodel.geometry import ConduitPath
from ccmodel.kernel import kernel
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad, one_row
from ccmodel.model.response import PairResponse, Status
from ccmodel.model.transmission import Transmission

SECTIONS = 16  # of each cable, as in the paper's Section IV


def simulate_pair(
    transmission: Transmission,
    load: SpringLoad,
    theta_in: NDArray,
    initial: InitialTension,
    sections: int = SECTIONS,
) -> PairResponse:
    """Response of the pair to a motion of its drive pulley.

    Parameters
    ----------
    transmission : Transmission
    load : SpringLoad
    theta_in : ndarray, shape (n,)
        Drive angle at each sample, rad; the first is the angle at which `initial` holds.
    initial : InitialTension
    sections : int
        Segments of each cable.

    Returns
    -------
    PairResponse

    Raises
    ------
    ModelError
        If an input is not finite or of the wrong shape, the transmission is a single cable, or a step finds no balance
        at the load.
    """
    if transmission.is_single_cable:
        raise ModelError("the paper's discretisation is that of a pair, not of a single cable")
    theta_in = one_row(theta_in, "theta_in")
    if sections < 1:
        raise ModelError(f"each cable needs at least one section; got {sections}")
    path = transmission.path
    x = _nodes(path, sections)
    phi = path.bend_at(x)
    T_A, T_B = initial.at(x, phi)
    half_stretch = np.diff(x) / (2 * transmission.axial_rigidity_N)
    E, P = _capstan_lines(x, phi, transmission)
    T, theta_out, failed = _march(
        theta_in,
        load.stiffness_Nm_per_rad,
        transmission.drive_radius_m,
        transmission.load_radius_m,
        T_A,
        T_B,
        half_stretch,
        E,
        P,
    )
    if failed >= 0:
        raise ModelError(
            f"no load angle balances the cables at sample {failed} (drive at {theta_in[failed]:.4g} rad): "
            "check the pulley radii and the stiffness"
        )
    R_i, R_o = transmission.drive_radius_m, transmission.load_radius_m
    return PairResponse(
        **dict(zip(TENSIONS, T, strict=True)),
        theta_out_rad=theta_out,
        tau_in_Nm=(T[0] - T[2]) * R_i,
        tau_out_Nm=(T[1] - T[3]) * R_o,
        status=Status.OK,
        reached=theta_in.size,
    )


def _nodes(path: ConduitPath, sections: int) -> NDArray:
    """Arc lengths of the nodes: every corner of the path is one, so that each segment has one curvature (9)."""
    corners = np.concatenate([[0.0], np.cumsum(path.piece_length_m)])
    even = np.linspace(0, path.length_m, sections + 1)[1:-1]
    near_corner = np.abs(even[:, None] - corners).min(axis=1) < 0.25 * path.length_m / sections
    return np.sort(np.concatenate([corners, even[~near_corner]]))


def _capstan_lines(x: NDArray, phi: NDArray, transmission: Transmission) -> tuple[NDArray, NDArray]:
    """E and P of (13) and (14) for motion towards the drive (row 0, S = -1) and towards the load (row 1, S = +1)."""
    S = np.array([[-1.0], [1.0]])
    mu = transmission.friction_coefficient
    E = np.exp(S * mu * phi)
    y = S * mu * np.diff(phi)
    # (exp(y) - 1) / y tends to 1 on a straight segment.
    growth = np.divide(np.expm1(y), y, out=np.ones_like(y), where=y != 0)
    stretch = E[:, :-1] * growth * np.diff(x) / transmission.axial_rigidity_N
    return E, np.concatenate([np.zeros((2, 1)), np.cumsum(stretch, axis=1)], axis=1)


@kernel
def _drive_front(T: NDArray, u: NDArray, a: float, E: NDArray, P: NDArray, h: NDArray) -> tuple[int, float]:
    """Front from the drive end, moved to displacement `a`: (index of the partly moving segment, c of its line).

    The index is n, one past the last segment, where the motion has arrived at the load end.
    """
    n = h.size
    S = 1 if a > u[0] else -1
    row = (S + 1) // 2
    for k in range(n):
        c = (u[k] - a + T[k] * h[k]) / (P[row, k] + E[row, k] * h[k])
        if S * (c * E[row, k + 1] - T[k + 1]) >= 0:
            return k, c
    return n, 0.0


@kernel
def _load_front(T: NDArray, u: NDArray, b: float, E: NDArray, P: NDArray, h: NDArray) -> tuple[int, float]:
    """The same from the load end, moved to displacement `b`; index -1 where the motion has arrived at the drive end."""
    n = h.size
    S = 1 if b > u[n] else -1
    row = (S + 1) // 2
    for k in range(n - 1, -1, -1):
        c = (b - u[k + 1] + T[k + 1] * h[k]) / (P[row, n] - P[row, k + 1] + E[row, k + 1] * h[k])
        if S * (c * E[row, k] - T[k]) <= 0:
            return k, c
    return -1, 0.0


@kernel
def _stagnation_point(
    u: NDArray, a: float, b: float, P_left: NDArray, P_right: NDArray, E_left: NDArray, E_right: NDArray
) -> tuple[int, float]:
    """Stagnation point of a cable whose ends move in opposite directions: (node on its drive side, weight of the next).

    Node m stays at rest if the lines on both sides give it the same tension. The difference of the two changes sign
    between two nodes; the stagnation point lies between them in proportion.
    """
    n = u.size - 1
    previous = 0.0
    for m in range(n + 1):
        left = (u[m] - a) * (P_right[n] - P_right[m]) / E_right[m]
        right = (b - u[m]) * P_left[m] / E_left[m]
        difference = left - right
        if m > 0 and difference * previous <= 0 and difference != previous:
            return m - 1, previous / (previous - difference)
        previous = difference
    return (n - 1, 1.0) if abs(b - u[n]) < abs(a - u[0]) else (0, 0.0)


@kernel
def _move_cable(
    T: NDArray,
    u: NDArray,
    a: float,
    b: float,
    drive: tuple[int, float],
    E: NDArray,
    P: NDArray,
    h: NDArray,
    T_new: NDArray,
    u_new: NDArray,
) -> None:
    """Write the state of one cable with its ends moved to `a` and `b` into `T_new`, `u_new`.

    `drive` is the result of `_drive_front` for `a`.
    """
    n = h.size
    if b - a <= 0:  # slack: no tension and no memory
        for i in range(n + 1):
            T_new[i] = 0.0
            u_new[i] = a + (b - a) * i / n
        return
    for i in range(n + 1):
        T_new[i], u_new[i] = T[i], u[i]
    k_drive, c_drive = drive
    k_load, c_load = n, 0.0
    moves_drive, moves_load = a != u[0], b != u[n]
    if not moves_drive:
        k_drive = -1
    if moves_load:
        k_load, c_load = _load_front(T, u, b, E, P, h)
    if not (moves_drive or moves_load):
        return
    S_drive = 1 if a > u[0] else -1
    S_load = 1 if b > u[n] else -1
    if moves_drive and moves_load and S_drive != S_load:
        if k_drive >= k_load:
            _slide_from_stagnation(u, a, b, S_load, E, P, T_new, u_new)
            return
    else:
        S = S_drive if moves_drive else S_load
        row = (S + 1) // 2
        c = (b - a) / P[row, n]
        arrived = k_drive == n or k_load == -1
        # Before the moving parts meet, a whole slide would leave the load end at less tension than it has (more,
        # where the cable moves towards the load); at the meeting both agree.
        T_load = c_load * E[row, n] if moves_load else T[n]
        if arrived or S * (c * E[row, n] - T_load) <= 0:
            for i in range(n + 1):
                T_new[i] = c * E[row, i]
                u_new[i] = a + c * P[row, i]
            return
    if moves_drive:
        row = (S_drive + 1) // 2
        for i in range(k_drive + 1):
            T_new[i] = c_drive * E[row, i]
            u_new[i] = a + c_drive * P[row, i]
    if moves_load:
        row = (S_load + 1) // 2
        for i in range(k_load + 1, n + 1):
            T_new[i] = c_load * E[row, i]
            u_new[i] = b - c_load * (P[row, n] - P[row, i])


@kernel
def _slide_from_stagnation(
    u: NDArray, a: float, b: float, S_load: int, E: NDArray, P: NDArray, T_new: NDArray, u_new: NDArray
) -> None:
    """Write the state of a cable that slides in opposite directions on both sides of a stagnation point."""
    n = u.size - 1
    right = (S_load + 1) // 2
    left = 1 - right
    m, weight = _stagnation_point(u, a, b, P[left], P[right], E[left], E[right])
    T_new[:] = 0.0
    for node, share in ((m, 1 - weight), (m + 1, weight)):
        # The total stretch gives the tension at the stagnation point, blended between the two nodes next to it.
        stretch = P[left, node] / E[left, node] + (P[right, n] - P[right, node]) / E[right, node]
        T_stagnation = (b - a) / stretch
        for i in range(n + 1):
            side = left if i <= node else right
            T_new[i] += share * T_stagnation * E[side, i] / E[side, node]
    u_new[0] = a
    for i in range(n):
        side = left if i < m + weight else right
        u_new[i + 1] = u_new[i] + T_new[i] / E[side, i] * (P[side, i + 1] - P[side, i])
    u_new[n] = b


# Both cables: T and u before the step, and after it.
Cables = tuple[NDArray, NDArray, NDArray, NDArray]
# Displacements of the drive ends, results of `_drive_front`, and displacements of the load ends before the step.
Step = tuple[NDArray, tuple[tuple[int, float], tuple[int, float]], NDArray]


@kernel
def _imbalance(
    theta: float, cables: Cables, step: Step, load: tuple[float, float, float], lines: tuple[NDArray, NDArray, NDArray]
) -> float:
    """Torque of the cables less that of the load at load angle `theta`; writes the cables' new state.

    It falls as theta grows: the load end of A is let in, that of B drawn out.
    """
    T, u, T_new, u_new = cables
    a, fronts, u_load = step
    K_e, R_o, theta_start = load
    E, P, h = lines
    n = h.size
    rotation = R_o * (theta - theta_start)
    _move_cable(T[0], u[0], a[0], u_load[0] - rotation, fronts[0], E, P, h, T_new[0], u_new[0])
    _move_cable(T[1], u[1], a[1], u_load[1] + rotation, fronts[1], E, P, h, T_new[1], u_new[1])
    return (T_new[0, n] - T_new[1, n]) * R_o - K_e * theta


@kernel
def _balance(
    theta: float,
    guess: float,
    cables: Cables,
    step: Step,
    load: tuple[float, float, float],
    lines: tuple[NDArray, NDArray, NDArray],
) -> tuple[float, bool]:
    """Load angle at which the torques balance, by bracketing and false position (Illinois), and whether it exists.

    `guess` is the first step of the bracket. On return `cables` holds the state at that angle.
    """
    lower, f_lower = theta, _imbalance(theta, cables, step, load, lines)
    n = lines[2].size
    if abs(f_lower) <= 1e-13 * load[1] * (cables[0][0, n] + cables[0][1, n]):  # rounding alone must not move the load
        return theta, True
    stride = guess if f_lower > 0 else -guess
    upper = theta + stride
    f_upper = _imbalance(upper, cables, step, load, lines)
    for _ in range(100):
        if not f_upper * f_lower > 0:
            break
        lower, f_lower = upper, f_upper
        stride *= 2
        upper += stride
        f_upper = _imbalance(upper, cables, step, load, lines)
    if not f_upper * f_lower <= 0:
        return upper, False
    for _ in range(100):
        if f_upper == 0.0 or abs(upper - lower) <= 1e-15 * max(abs(upper), 1e-3):
            break
        root = upper - f_upper * (upper - lower) / (f_upper - f_lower)
        f_root = _imbalance(root, cables, step, load, lines)
        if f_root * f_upper < 0:
            lower, f_lower = upper, f_upper
        else:
            f_lower *= 0.5
        upper, f_upper = root, f_root
    return upper, True


@kernel(allocates=True)
def _march(
    theta_in: NDArray,
    K_e: float,
    R_i: float,
    R_o: float,
    T_A0: NDArray,
    T_B0: NDArray,
    h: NDArray,
    E: NDArray,
    P: NDArray,
) -> tuple[NDArray, NDArray, int]:
    """Step through the samples: end tensions (4, n), load angle (n,), and the first sample without a balance, or -1."""
    n = h.size
    samples = theta_in.size
    T, u = np.empty((2, n + 1)), np.zeros((2, n + 1))
    T[0], T[1] = T_A0, T_B0
    for cable in range(2):
        for i in range(n):
            u[cable, i + 1] = u[cable, i] + (T[cable, i] + T[cable, i + 1]) * h[i]  # (17)
    cables = (T, u, np.empty_like(T), np.empty_like(u))
    lines = (E, P, h)
    u_load = u[:, n].copy()
    theta_start = (T[0, n] - T[1, n]) * R_o / K_e if K_e > 0 else 0.0
    theta = theta_start
    smallest_rotation = 1e-6 * max(u_load.max(), 1e-6) / R_o
    rotation = smallest_rotation
    out_T, out_theta = np.empty((4, samples)), np.empty(samples)
    a = np.empty(2)
    for j in range(samples):
        a[0] = -R_i * (theta_in[j] - theta_in[0])
        a[1] = -a[0]
        fronts = (_drive_front(T[0], u[0], a[0], E, P, h), _drive_front(T[1], u[1], a[1], E, P, h))
        load = (K_e, R_o, theta_start)
        balanced, found = _balance(theta, rotation, cables, (a, fronts, u_load), load, lines)
        if not found:
            return out_T, out_theta, j
        rotation = max(abs(balanced - theta), smallest_rotation)
        theta = balanced
        T[:], u[:] = cables[2], cables[3]
        out_T[0, j], out_T[1, j], out_T[2, j], out_T[3, j] = T[0, 0], T[0, n], T[1, 0], T[1, n]
        out_theta[j] = theta
    return out_T, out_theta, -1
