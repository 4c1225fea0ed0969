"""Equations of a step: tensions, friction at the nodes, and the balance at the load pulley.

The unknowns are the slides d of all nodes and the rotation of the load pulley. A node solves

    T_i - T_{i+1} = xi_i(d_i) tanh(mu phi_i / 2) (T_i + T_{i+1}) + (drag),      T_i on its drive side,

so that a node that slides has the capstan's ratio T_i / T_{i+1} = exp(mu phi_i) on any grid. xi is the node's bristle,
-1 to 1: Dahl's law where there is presliding, else an elastic, ideally plastic one of `COULOMB_BRISTLE_M`, which makes
the equations piecewise linear.
"""

from ccmodel.elementary import quick_tanh
from ccmodel.kernel import kernel
from ccmodel.mechanisms.backlash import dead_zone
from ccmodel.mechanisms.load_dependent_friction import power_of_tension
from ccmodel.mechanisms.presliding import dahl
from ccmodel.mechanisms.pulley_eccentricity import winding, winding_change
from ccmodel.mechanisms.strand_settling import settling_tension
from ccmodel.mechanisms.stribeck import renewed
from ccmodel.model.general.layout import (
    ALPHA,
    ANGLE,
    BEARING,
    BEARING_NEXT,
    BRISTLE,
    BRISTLE_NEXT,
    DRAG,
    DT,
    ELASTIC,
    EXCESS,
    FAR,
    FAST,
    GIVES,
    GRIP,
    GRIP_NOW,
    GRIP_SLOPE,
    HALF_BEND,
    IMPEDANCE,
    LOST,
    LOST_TENSION,
    MEAN,
    MEAN_EXCESS,
    MEAN_NEXT,
    NEAR,
    NOW,
    OMEGA,
    OMEGA_BEFORE,
    OMEGA_NEXT,
    PULL,
    RELAXING,
    RESTED,
    RESTED_NEXT,
    ROTATION,
    SHARE,
    SLACK_SHARE,
    STIFFNESS,
    STRETCH,
    TANGENT,
    TENSION,
    TORQUE,
    VISCOUS,
)


@kernel(error_model="numpy", fastmath=FAST)
def _tensions(ph, piece, slide, mean, weights):
    """Tension (N) and tangent stiffness (N/m) of each piece for the slides of this step."""
    n1 = piece.shape[2]
    for c in range(2):
        T, K, k, d, e = piece[TENSION, c], piece[TANGENT, c], piece[STIFFNESS, c], slide[NOW, c], piece[STRETCH, c]
        if not (ph.has_settling or ph.has_relaxation or ph.conduit_compliance > 0):
            for i in range(n1):
                pull = k[i] * (e[i] + (d[i] - d[i + 1]))
                share = 1.0 if pull > 0.0 else SLACK_SHARE
                T[i] = share * pull
                K[i] = share * k[i]
            continue
        gives = ph.conduit_compliance * (mean[MEAN_NEXT, c] - mean[MEAN, c])
        for i in range(n1):
            T[i] = e[i] + (d[i] - d[i + 1]) - gives * piece[SHARE, c, i]
        if ph.has_settling:
            _settle(piece, c)
        else:
            for i in range(n1):
                piece[PULL, c, i] = k[i] * T[i]
                K[i] = k[i]
        for i in range(n1):
            pull, tangent = piece[PULL, c, i], K[i]
            if ph.has_relaxation:
                r = piece[RELAXING, c, i]
                q = (
                    weights[0] * piece[LOST_TENSION, c, i]
                    + weights[1] * piece[ELASTIC, c, i]
                    + weights[2] * max(pull, 0.0)
                )
                tangent *= 1.0 - r * weights[2] if pull > 0.0 else 1.0
                pull -= r * q
            share = 1.0 if pull > 0.0 else SLACK_SHARE
            T[i] = share * pull
            K[i] = share * tangent


@kernel(error_model="numpy", fastmath=FAST)
def _settle(piece, c):
    """Pull and tangent stiffness of each piece of a cable whose strands settle, from its stretch in row `TENSION`.

    Loops that call elementary functions do nothing else, here and elsewhere, so that the compiler vectorises them.
    """
    stretch, k, lost, pulls, K = (
        piece[TENSION, c],
        piece[STIFFNESS, c],
        piece[LOST, c],
        piece[PULL, c],
        piece[TANGENT, c],
    )
    for i in range(piece.shape[2]):
        settles = lost[i] > 0.0 and stretch[i] > 0.0
        pull, tangent = settling_tension(stretch[i], lost[i] if settles else 1.0, k[i])
        pulls[i] = pull if settles else k[i] * stretch[i]
        K[i] = max(tangent, SLACK_SHARE * k[i]) if settles else k[i]


@kernel(error_model="numpy", fastmath=FAST)
def _set_hold(ph, piece, node, c):
    """Tension-dependent friction of each node over the sum of its tensions, and half that sum times its derivative."""
    T, grip, now, slope = piece[TENSION, c], node[GRIP, c], node[GRIP_NOW, c], node[GRIP_SLOPE, c]
    for i in range(node.shape[2]):
        half = 0.5 * (max(T[i], 0.0) + max(T[i + 1], 0.0))
        factor, by_tension = power_of_tension(half, ph.tension_exponent)
        g = quick_tanh(grip[i] * factor)
        now[i] = g
        slope[i] = half * (1.0 - g * g) * grip[i] * by_tension


@kernel(error_model="numpy", fastmath=FAST)
def _nodes(ph, piece, node, slide, dt, bristle):
    """Force out of balance at each node and its derivatives; returns the sum of its squares, N^2."""
    n = node.shape[2]
    total = 0.0
    rate = 1.0 / dt if dt > 0.0 else 0.0
    for c in range(2):
        T, K, d, grip, xi = piece[TENSION, c], piece[TANGENT, c], slide[NOW, c], node[GRIP, c], node[BRISTLE, c]
        p, q, fd, r = node[NEAR, c], node[FAR, c], node[GIVES, c], node[EXCESS, c]
        if ph.presliding:
            for i in range(n):
                x, slope = dahl(xi[i], d[i + 1], bristle)
                # Where nothing has slid yet, the slope differs between the two directions.
                node[BRISTLE_NEXT, c, i] = x
                fd[i] = slope if d[i + 1] != 0.0 else 1.0 / bristle
        else:
            inverse = 1.0 / bristle
            for i in range(n):
                trial = xi[i] + d[i + 1] * inverse
                node[BRISTLE_NEXT, c, i] = min(max(trial, -1.0), 1.0)
                fd[i] = inverse if abs(trial) < 1.0 else 0.0
        if not ph.general_friction:
            for i in range(n):
                x, g = node[BRISTLE_NEXT, c, i], grip[i]
                hold = g * (max(T[i], 0.0) + max(T[i + 1], 0.0))
                p[i] = K[i] * (1.0 - x * g)
                q[i] = K[i + 1] * (1.0 + x * g)
                fd[i] *= hold
                r[i] = T[i] - T[i + 1] - x * hold
        else:
            if ph.tension_exponent != 0.0:
                _set_hold(ph, piece, node, c)
                grip = node[GRIP_NOW, c]
            for i in range(n):
                x, g, slope = node[BRISTLE_NEXT, c, i], grip[i], node[GRIP_SLOPE, c, i]
                hold = g * (max(T[i], 0.0) + max(T[i + 1], 0.0)) + node[DRAG, c, i]
                p[i] = K[i] * (1.0 - x * (g + slope))
                q[i] = K[i + 1] * (1.0 + x * (g + slope))
                drag = node[VISCOUS, c, i] * rate
                fd[i] = fd[i] * hold + drag
                r[i] = T[i] - T[i + 1] - x * hold - drag * d[i + 1]
        for i in range(n):
            total += r[i] * r[i]
    return total


@kernel(error_model="numpy")
def _load(ph, piece, load, rotation, torque, dt):
    """Torque out of balance at the load pulley (N m), its derivative by angle without the cables, and the radius."""
    n = piece.shape[2] - 1
    theta = load[ANGLE] + rotation
    _, radius_factor, radius_slope = winding(theta, ph.load_eccentricity[0], ph.load_eccentricity[1])
    R = ph.radius * radius_factor
    z, inside = dead_zone(theta, ph.half_gap)
    tau = torque + ph.stiffness_load * z + ph.cubic_stiffness * z**3
    slope = (ph.stiffness_load + 3 * ph.cubic_stiffness * z * z) * inside
    omega = 0.0
    if dt > 0.0:
        ratio = dt / load[DT] if load[DT] > 0.0 else 1.0
        a1, a2 = (1 + 2 * ratio) / (1 + ratio), ratio * ratio / (1 + ratio)
        omega = (a1 * rotation - a2 * load[ROTATION]) / dt
        alpha = (a1 * (omega - load[OMEGA]) - a2 * (load[OMEGA] - load[OMEGA_BEFORE])) / dt
        tau += ph.load_damping * omega + ph.inertia * alpha
        slope += (ph.load_damping + ph.inertia * a1 / dt) * a1 / dt
    bearing = load[BEARING]
    if ph.load_friction_Nm > 0.0:
        bearing, by_rotation = dahl(load[BEARING], rotation, ph.load_presliding_rad)
        slope += ph.load_friction_Nm * (by_rotation if rotation != 0.0 else 1.0 / ph.load_presliding_rad)
    difference = max(piece[TENSION, 0, n], 0.0) - max(piece[TENSION, 1, n], 0.0)
    load[OMEGA_NEXT], load[BEARING_NEXT], load[TORQUE] = omega, bearing, tau
    return R * difference - tau - ph.load_friction_Nm * bearing, slope - ph.radius * radius_slope * difference, R


@kernel(error_model="numpy")
def imbalance(ph, piece, node, slide, mean, load, rotation, torque, dt, bristle, weights):
    """Imbalance of the whole chain: sum of squares (N^2), highest tension (N), and the terms of `_load`."""
    n = node.shape[2]
    pulled = ph.radius * winding_change(load[ANGLE], rotation, ph.load_eccentricity[0], ph.load_eccentricity[1])
    slide[NOW, 0, n + 1], slide[NOW, 1, n + 1] = pulled, -pulled
    _tensions(ph, piece, slide, mean, weights)
    error = _nodes(ph, piece, node, slide, dt, bristle)
    G, slope, R = _load(ph, piece, load, rotation, torque, dt)
    if ph.kind == IMPEDANCE:
        error += (G / ph.radius) ** 2
    if ph.conduit_compliance > 0.0:
        for c in range(2):
            mean[MEAN_EXCESS, c] = _mean_tension(piece, c) - mean[MEAN_NEXT, c]
            error += mean[MEAN_EXCESS, c] ** 2
    highest = max(max(piece[TENSION, 0, 0], piece[TENSION, 0, n]), max(piece[TENSION, 1, 0], piece[TENSION, 1, n]))
    return error, max(highest, 1e-2), G, slope, R


@kernel(error_model="numpy")
def _mean_tension(piece, c):
    """Mean tension of a cable along its length, N."""
    total = 0.0
    for i in range(piece.shape[2]):
        total += piece[SHARE, c, i] * max(piece[TENSION, c, i], 0.0)
    return total


@kernel(error_model="numpy", fastmath=FAST)
def set_grip(ph, node, slide, friction_factor, dt):
    """Set friction of each node over the sum of its tensions; with a power of tension, only its argument mu phi / 2.

    The contacts' memory of rest at the end of the step follows from the slides in `NOW`, the best estimate so far.
    Returns the largest relative change of friction.
    """
    change = 0.0
    for c in range(2):
        before, rested, half_bend, grip = node[RESTED_NEXT, c], node[ALPHA, c], node[HALF_BEND, c], node[GRIP, c]
        if ph.stribeck_rise > 0.0 and dt > 0.0:
            renew_contacts(ph, node, slide, c, dt, ALPHA)
        else:
            rested[:] = node[RESTED, c]
        for i in range(node.shape[2]):
            change = max(change, abs(rested[i] - before[i]))
            before[i] = rested[i]
        for i in range(node.shape[2]):
            grip[i] = half_bend[i] * friction_factor * (1.0 + ph.stribeck_rise * rested[i])
        if ph.tension_exponent == 0.0:
            for i in range(node.shape[2]):
                grip[i] = quick_tanh(grip[i])
    return ph.stribeck_rise * change


@kernel(error_model="numpy", fastmath=FAST)
def renew_contacts(ph, node, slide, c, dt, into):
    """Write the contacts' memory of rest after the slides in `NOW` into row `into`."""
    rested, d, following = node[RESTED, c], slide[NOW, c], node[into, c]
    for i in range(node.shape[2]):
        following[i] = renewed(rested[i], d[i + 1], dt, ph.stribeck_speed, ph.stribeck_exponent)
