"""The compiled march over the samples: both cables and the load pulley as one chain, implicit in every step.

Each cable is a row of nodes with friction between pieces of cable that carry no compression; row 0 is cable A, row 1
cable B. Displacements count towards the drive end. The unknowns of a step are the slides d of all nodes and the load
pulley's turn, and what they must solve is

    T_i - T_{i+1} = xi_i(d_i) tanh(mu phi_i / 2) (T_i + T_{i+1}) + (drag),      i = node, T_i on its drive side

and the balance of torques at the load pulley. With this form of friction a node that slides has the capstan's ratio
T_i / T_{i+1} = exp(mu phi_i) without any error of the grid. xi is the node's bristle, -1 to 1: Dahl's law where there
is presliding, else a bristle of `COULOMB_BRISTLE_M` that yields at once, which makes the step's equations piecewise
linear and Newton's method exact as soon as it knows who slides.

Newton's matrix is tridiagonal from the drive end of A over the load pulley to the drive end of B, so it is eliminated
from both drive ends at once. A conduit that gives way to its cable's mean tension adds one unknown a cable.
"""

from collections import namedtuple

import numpy as np

from ccmodel import mechanisms as registry
from ccmodel.elementary import quick_tanh
from ccmodel.kernel import borrowed, kernel
from ccmodel.mechanisms.backlash import dead_zone
from ccmodel.mechanisms.load_dependent_friction import power_of_tension
from ccmodel.mechanisms.presliding import dahl
from ccmodel.mechanisms.pulley_eccentricity import winding, winding_change
from ccmodel.mechanisms.relaxation import lag_weights
from ccmodel.mechanisms.strand_settling import settling_tension
from ccmodel.mechanisms.stribeck import renewed

# Coulomb friction has no bristle; this one is a ten-millionth of the stretch of any cable worth pulling.
COULOMB_BRISTLE_M = 1e-10
# Where conduits give way to their cables' mean tension, every node of a cable turns around at once at each reversal.
# Newton's method then needs to see further; this costs 0.03 % of tension.
SOFT_CONDUIT_BRISTLE_M = 1e-7
# A sample that has no solution otherwise is tried with bristles up to this length.
LONGEST_BRISTLE_M = 1e-6
# A slack piece keeps this share of its stiffness, so that its nodes have a place; its tension counts as zero.
SLACK_SHARE = 1e-9
# Out of balance by no more than this share of the highest tension.
TOLERANCE = 1e-8
LOOSE_TOLERANCE = 1e-5
# A node that is about to turn around in one go is left at the edge of sticking, where its friction is what it was.
EDGE = 1.0 - 1e-9
NEWTON_LIMIT = 60
# Friction that remembers its speed is taken from the slides expected of a step. Where those found make it another by
# more than this share, the step is solved again, so many times in all.
GRIP_TOLERANCE = 1e-4
LOOKS = 6
PATIENCE = 12
SMALLEST_SHARE = 1.0 / 128
SMALLEST_SUBSTEP = 1.0 / 4096
# Shares of a sample and its time add up to the whole within this.
ROUNDING = 1e-9

IMPEDANCE, PRESCRIBED_ANGLE = 0, 1

# What a run and its steps know, in four arrays of rows: every array that goes from one compiled function to another
# costs some time at every call.
# piece, shape (rows, 2, n + 1): of the cable between nodes. N/m, m, -, -, then the state, then the step's results.
STIFFNESS, LOST, RELAXING, SHARE, STRETCH, LOST_TENSION, ELASTIC, TENSION, TANGENT, PULL = range(10)
# node, shape (rows, 2, n): constants (rad, N, N s/m), state, the step's equations and their elimination.
(
    HALF_BEND,
    DRAG,
    VISCOUS,
    BRISTLE,
    RESTED,
    RESTED_NEXT,
    GRIP,
    BRISTLE_NEXT,
    NEAR,
    FAR,
    GIVES,
    EXCESS,
    ALPHA,
    BETA,
    ETA,
    GAMMA,
    GRIP_NOW,
    GRIP_SLOPE,
) = range(18)
# slide, shape (rows, 2, n + 2): drive end, nodes, load end, m. This step, Newton's step, and those before.
NOW, STEP, SAVED, LAST, BEFORE = range(5)
# mean, shape (rows, 2): mean tension of a cable that its conduit gives way to, N.
(
    MEAN,
    MEAN_NEXT,
    MEAN_LAST,
    MEAN_BEFORE,
    MEAN_STEP,
    MEAN_EXCESS,
    MEAN_SAVED,
    FIXED,
    BY_END,
    END_FIXED,
    END_BY_END,
) = range(11)
# load, shape (rows,): angle, last turn and step's length, speed, speed before, bristle of the bearing; the step's.
ANGLE, TURN, DT, OMEGA, OMEGA_BEFORE, BEARING, OMEGA_NEXT, BEARING_NEXT, TORQUE = range(9)
PIECE_ROWS, NODE_ROWS, SLIDE_ROWS, MEAN_ROWS, LOAD_ROWS = 10, 18, 5, 11, 9

# Constants of a run: its own, and every setting of the mechanisms.
Physics = namedtuple(
    "Physics",
    "has_settling has_relaxation bristle presliding radius stiffness_load load_damping kind general_friction "
    + " ".join(registry.march_settings()),
)

FAST = {"reassoc", "contract", "nsz", "arcp"}  # not nnan: a NaN must be seen


@kernel(error_model="numpy", fastmath=FAST)
def _tensions(ph, piece, slide, mean, weights):
    """Tension of each piece and its tangent stiffness for the slides of this step."""
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

    This and the other loops that call elementary functions do nothing else, so that they take several nodes at a time.
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
    """Friction per sum of a node's tensions where it depends on these, and its derivative by half that sum times it."""
    T, grip, now, slope = piece[TENSION, c], node[GRIP, c], node[GRIP_NOW, c], node[GRIP_SLOPE, c]
    for i in range(node.shape[2]):
        half = 0.5 * (max(T[i], 0.0) + max(T[i + 1], 0.0))
        factor, by_tension = power_of_tension(half, ph.tension_exponent)
        g = quick_tanh(grip[i] * factor)
        now[i] = g
        slope[i] = half * (1.0 - g * g) * grip[i] * by_tension


@kernel(error_model="numpy", fastmath=FAST)
def _nodes(ph, piece, node, slide, dt, bristle):
    """Balance of each node and its derivatives; the sum of squares of what is out of balance, N^2."""
    n = node.shape[2]
    total = 0.0
    rate = 1.0 / dt if dt > 0.0 else 0.0
    for c in range(2):
        T, K, d, grip, xi = piece[TENSION, c], piece[TANGENT, c], slide[NOW, c], node[GRIP, c], node[BRISTLE, c]
        p, q, fd, r = node[NEAR, c], node[FAR, c], node[GIVES, c], node[EXCESS, c]
        if ph.presliding:
            for i in range(n):
                x, slope = dahl(xi[i], d[i + 1], bristle)
                # Where nothing slides yet the slope is another to either side.
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
def _load(ph, piece, load, turn, torque, dt):
    """Torque out of balance at the load pulley, its slope by the angle less what the cables add, and the radius."""
    n = piece.shape[2] - 1
    theta = load[ANGLE] + turn
    _, round_, round_slope = winding(theta, ph.load_eccentricity[0], ph.load_eccentricity[1])
    R = ph.radius * round_
    z, inside = dead_zone(theta, ph.half_gap)
    tau = torque + ph.stiffness_load * z + ph.cubic_stiffness * z**3
    slope = (ph.stiffness_load + 3 * ph.cubic_stiffness * z * z) * inside
    omega = 0.0
    if dt > 0.0:
        ratio = dt / load[DT] if load[DT] > 0.0 else 1.0
        a1, a2 = (1 + 2 * ratio) / (1 + ratio), ratio * ratio / (1 + ratio)
        omega = (a1 * turn - a2 * load[TURN]) / dt
        alpha = (a1 * (omega - load[OMEGA]) - a2 * (load[OMEGA] - load[OMEGA_BEFORE])) / dt
        tau += ph.load_damping * omega + ph.inertia * alpha
        slope += (ph.load_damping + ph.inertia * a1 / dt) * a1 / dt
    bearing = load[BEARING]
    if ph.load_friction_Nm > 0.0:
        bearing, by_turn = dahl(load[BEARING], turn, ph.load_presliding_rad)
        slope += ph.load_friction_Nm * (by_turn if turn != 0.0 else 1.0 / ph.load_presliding_rad)
    difference = max(piece[TENSION, 0, n], 0.0) - max(piece[TENSION, 1, n], 0.0)
    load[OMEGA_NEXT], load[BEARING_NEXT], load[TORQUE] = omega, bearing, tau
    return R * difference - tau - ph.load_friction_Nm * bearing, slope - ph.radius * round_slope * difference, R


@kernel(error_model="numpy", fastmath=FAST)
def _solve(piece, node, slide, G, slope, R, free):
    """Newton's step for the slides into `STEP`; returns the load pulley's turn.

    Elimination from the drive ends: delta_i = alpha_i + beta_i delta_{i+1}, with gamma = 1 - beta carried along by
    itself so that nothing is lost where pieces differ in stiffness by many orders.
    """
    n = node.shape[2]
    alpha_A, alpha_B, gamma_A, gamma_B = 0.0, 0.0, 1.0, 1.0
    for i in range(n):
        pA, pB = node[NEAR, 0, i], node[NEAR, 1, i]
        fA, fB = pA * gamma_A + node[GIVES, 0, i], pB * gamma_B + node[GIVES, 1, i]
        iA, iB = 1.0 / (fA + node[FAR, 0, i]), 1.0 / (fB + node[FAR, 1, i])
        alpha_A, alpha_B = (node[EXCESS, 0, i] + pA * alpha_A) * iA, (node[EXCESS, 1, i] + pB * alpha_B) * iB
        gamma_A, gamma_B = fA * iA, fB * iB
        node[ALPHA, 0, i], node[ALPHA, 1, i] = alpha_A, alpha_B
        node[BETA, 0, i], node[BETA, 1, i] = node[FAR, 0, i] * iA, node[FAR, 1, i] * iB
    KA, KB = piece[TANGENT, 0, n], piece[TANGENT, 1, n]
    turn = 0.0
    if free:
        turn = (G + R * (KA * alpha_A - KB * alpha_B)) / (R * R * (KA * gamma_A + KB * gamma_B) + slope)
    dA, dB = R * turn, -R * turn
    slide[STEP, 0, n + 1], slide[STEP, 1, n + 1] = dA, dB
    for i in range(n - 1, -1, -1):
        dA, dB = node[ALPHA, 0, i] + node[BETA, 0, i] * dA, node[ALPHA, 1, i] + node[BETA, 1, i] * dB
        slide[STEP, 0, i + 1], slide[STEP, 1, i + 1] = dA, dB
    return turn


@kernel(error_model="numpy", fastmath=FAST)
def _solve_with_conduits(ph, piece, node, slide, mean, G, slope, R, free):
    """The same with both conduits' mean tensions unknown; their steps go into `MEAN_STEP`.

    Every slide is written as a part by itself, a part by the load end's slide and a part by the conduit's own mean
    tension; the conduit's equation then gives the mean by the load end's slide, and the load pulley's gives that.
    """
    n = node.shape[2]
    C = ph.conduit_compliance
    # Both cables by turns: their divisions need not wait for each other.
    for i in range(n):
        for c in range(2):
            a, g, h = 0.0, 1.0, 0.0
            if i > 0:
                a, g, h = node[ALPHA, c, i - 1], node[GAMMA, c, i - 1], node[ETA, c, i - 1]
            p, q = node[NEAR, c, i], node[FAR, c, i]
            f = p * g + node[GIVES, c, i]
            inverse = 1.0 / (f + q)
            node[ALPHA, c, i] = (node[EXCESS, c, i] + p * a) * inverse
            node[BETA, c, i] = q * inverse
            node[ETA, c, i] = (C * (q * piece[SHARE, c, i + 1] - p * piece[SHARE, c, i]) + p * h) * inverse
            node[GAMMA, c, i] = f * inverse
    for c in range(2):
        a, g, h = node[ALPHA, c, n - 1], node[GAMMA, c, n - 1], node[ETA, c, n - 1]
        # From the load end back: sums of share * K * (stretch of the piece) for the three parts.
        A, B, H = 0.0, 1.0, 0.0
        sum_A, sum_B, sum_H, stiff = 0.0, 0.0, 0.0, 0.0
        for i in range(n, -1, -1):
            if i > 0:
                A1 = node[ALPHA, c, i - 1] + node[BETA, c, i - 1] * A
                B1 = node[BETA, c, i - 1] * B
                H1 = node[ETA, c, i - 1] + node[BETA, c, i - 1] * H
            else:
                A1, B1, H1 = 0.0, 0.0, 0.0
            weight = piece[SHARE, c, i] * piece[TANGENT, c, i]
            sum_A += weight * (A1 - A)
            sum_B += weight * (B1 - B)
            sum_H += weight * (H1 - H)
            stiff += weight * piece[SHARE, c, i]
            A, B, H = A1, B1, H1
        scale = 1.0 / (1.0 + C * stiff - sum_H)
        mean[FIXED, c], mean[BY_END, c] = (mean[MEAN_EXCESS, c] + sum_A) * scale, sum_B * scale
        K = piece[TANGENT, c, n]
        own = h - C * piece[SHARE, c, n]
        mean[END_FIXED, c] = K * (a + own * mean[FIXED, c])
        mean[END_BY_END, c] = K * (-g + own * mean[BY_END, c])
    turn = 0.0
    if free:
        turn = (G + R * (mean[END_FIXED, 0] - mean[END_FIXED, 1])) / (
            slope - R * R * (mean[END_BY_END, 0] + mean[END_BY_END, 1])
        )
    for c in range(2):
        d = R * turn if c == 0 else -R * turn
        mean[MEAN_STEP, c] = mean[FIXED, c] + mean[BY_END, c] * d
        slide[STEP, c, n + 1] = d
        for i in range(n - 1, -1, -1):
            d = node[ALPHA, c, i] + node[ETA, c, i] * mean[MEAN_STEP, c] + node[BETA, c, i] * d
            slide[STEP, c, i + 1] = d
    return turn


@kernel(error_model="numpy")
def _move(ph, node, slide, share, bristle):
    """Take the slides a share of Newton's step on, no node from sliding one way to sliding the other in one go.

    Between the two lies the narrow stretch in which the node sticks, and Newton's method would step over it for ever.
    """
    n = node.shape[2]
    inverse = 1.0 / bristle
    for c in range(2):
        for i in range(1, n + 1):
            old = slide[NOW, c, i]
            new = old + share * slide[STEP, c, i]
            if ph.presliding:
                if old * new < 0.0:
                    new = 0.0
            else:
                xi = node[BRISTLE, c, i - 1]
                before, after = xi + old * inverse, xi + new * inverse
                if before > 1.0 and after < -1.0:
                    new = (EDGE - xi) * bristle
                elif before < -1.0 and after > 1.0:
                    new = (-EDGE - xi) * bristle
            slide[NOW, c, i] = new


@kernel(error_model="numpy")
def _mean_tension(piece, c):
    total = 0.0
    for i in range(piece.shape[2]):
        total += piece[SHARE, c, i] * max(piece[TENSION, c, i], 0.0)
    return total


@kernel(error_model="numpy")
def _evaluate(ph, piece, node, slide, mean, load, turn, torque, dt, bristle, weights):
    """Everything that a step leaves out of balance: sum of squares (N^2), highest tension, and the load's terms."""
    n = node.shape[2]
    way = ph.radius * winding_change(load[ANGLE], turn, ph.load_eccentricity[0], ph.load_eccentricity[1])
    slide[NOW, 0, n + 1], slide[NOW, 1, n + 1] = way, -way
    _tensions(ph, piece, slide, mean, weights)
    error = _nodes(ph, piece, node, slide, dt, bristle)
    G, slope, R = _load(ph, piece, load, turn, torque, dt)
    if ph.kind == IMPEDANCE:
        error += (G / ph.radius) ** 2
    if ph.conduit_compliance > 0.0:
        for c in range(2):
            mean[MEAN_EXCESS, c] = _mean_tension(piece, c) - mean[MEAN_NEXT, c]
            error += mean[MEAN_EXCESS, c] ** 2
    highest = max(max(piece[TENSION, 0, 0], piece[TENSION, 0, n]), max(piece[TENSION, 1, 0], piece[TENSION, 1, n]))
    return error, max(highest, 1e-2), G, slope, R


@kernel
def _copy(slide, to, source):
    """Copy a row of slides to another; numpy's way takes several times as long for so few."""
    for c in range(2):
        for i in range(slide.shape[2]):
            slide[to, c, i] = slide[source, c, i]


@kernel
def _copy_means(mean, to, source):
    mean[to, 0], mean[to, 1] = mean[source, 0], mean[source, 1]


@kernel(error_model="numpy")
def _newton(ph, piece, node, slide, mean, load, turn, torque, dt, bristle, counts):
    """Solve a step from the slides in `NOW` and a turn of the load; (whether it converged, the load's turn)."""
    free = ph.kind == IMPEDANCE
    weights = lag_weights(dt / ph.relaxing_time_s) if ph.has_relaxation and dt > 0.0 else (1.0, 0.0, 0.0)
    soft = ph.conduit_compliance > 0.0
    # With conduits that give way all nodes turn around at once at a reversal, and full steps overshoot far.
    patience = 2 if soft and not ph.presliding else PATIENCE
    share, best = 1.0, np.inf
    step_turn, saved_turn = 0.0, turn
    for iteration in range(NEWTON_LIMIT):
        error, limit, G, slope, R = _evaluate(ph, piece, node, slide, mean, load, turn, torque, dt, bristle, weights)
        counts[0] += 1
        if error <= (TOLERANCE * limit) ** 2:
            return True, turn
        if not np.isfinite(error):
            return False, turn
        if iteration == patience and error > best:
            # Full steps lead nowhere: from the best point on, only steps that lessen the error count.
            _copy(slide, NOW, SAVED)
            _copy_means(mean, MEAN_NEXT, MEAN_SAVED)
            turn, best = saved_turn, np.inf
            continue
        if iteration > patience and error > best and share > SMALLEST_SHARE:
            share *= 0.5
            _copy(slide, NOW, SAVED)
            _copy_means(mean, MEAN_NEXT, MEAN_SAVED)
            turn = saved_turn
        else:
            if error < best or iteration > patience:
                best = error
                _copy(slide, SAVED, NOW)
                _copy_means(mean, MEAN_SAVED, MEAN_NEXT)
                saved_turn = turn
            share = 1.0
            if soft:
                step_turn = _solve_with_conduits(ph, piece, node, slide, mean, G, slope, R, free)
            else:
                step_turn = _solve(piece, node, slide, G, slope, R, free)
        _move(ph, node, slide, share, bristle)
        turn += share * step_turn
        if soft:
            for c in range(2):
                mean[MEAN_NEXT, c] += share * mean[MEAN_STEP, c]
    # Sliding and sticking may take turns at a node or two for ever; what they disagree about is then next to nothing.
    _copy(slide, NOW, SAVED)
    _copy_means(mean, MEAN_NEXT, MEAN_SAVED)
    turn = saved_turn
    error, limit, G, slope, R = _evaluate(ph, piece, node, slide, mean, load, turn, torque, dt, bristle, weights)
    accepted = error <= (LOOSE_TOLERANCE * limit) ** 2
    if accepted:
        counts[2] += 1
    return accepted, turn


@kernel(error_model="numpy")
def _commit(ph, piece, node, slide, mean, load, turn, dt):
    """Take over a solved step."""
    n = node.shape[2]
    weights = lag_weights(dt / ph.relaxing_time_s) if ph.has_relaxation and dt > 0.0 else (1.0, 0.0, 0.0)
    soft = ph.conduit_compliance > 0.0
    for c in range(2):
        d = slide[NOW, c]
        for i in range(n + 1):
            piece[STRETCH, c, i] += d[i] - d[i + 1]
        if soft:
            mean[MEAN_BEFORE, c], mean[MEAN_LAST, c] = mean[MEAN_LAST, c], mean[MEAN_NEXT, c] - mean[MEAN, c]
            gives = ph.conduit_compliance * mean[MEAN_LAST, c]
            mean[MEAN, c] = mean[MEAN_NEXT, c]
            for i in range(n + 1):
                piece[STRETCH, c, i] -= gives * piece[SHARE, c, i]
        if ph.has_relaxation:
            for i in range(n + 1):
                elastic = max(piece[PULL, c, i], 0.0)
                lost = weights[0] * piece[LOST_TENSION, c, i] + weights[1] * piece[ELASTIC, c, i]
                piece[LOST_TENSION, c, i] = lost + weights[2] * elastic
                piece[ELASTIC, c, i] = elastic
        for i in range(n):
            node[BRISTLE, c, i] = node[BRISTLE_NEXT, c, i]
    if ph.stribeck_rise > 0.0 and dt > 0.0:
        for c in range(2):
            _renew(ph, node, slide, c, dt, RESTED)
    if dt > 0.0:
        load[TURN], load[DT] = turn, dt
        load[OMEGA_BEFORE], load[OMEGA] = load[OMEGA], load[OMEGA_NEXT]
    load[ANGLE] += turn
    load[BEARING] = load[BEARING_NEXT]


@kernel(error_model="numpy", fastmath=FAST)
def _renew(ph, node, slide, c, dt, into):
    """What the contacts of a cable remember after the slides in `NOW`, into row `into`."""
    rested, d, following = node[RESTED, c], slide[NOW, c], node[into, c]
    for i in range(node.shape[2]):
        following[i] = renewed(rested[i], d[i + 1], dt, ph.stribeck_speed, ph.stribeck_exponent)


@kernel(error_model="numpy", fastmath=FAST)
def _set_grip(ph, node, slide, course, dt):
    """Friction of each node per sum of its tensions; with a power of tension only its argument, mu phi / 2.

    What the contacts remember at the end of the step is taken from the slides in `NOW`, as far as these are known.
    Returns by how much that changed friction at most, as a share of it.
    """
    change = 0.0
    for c in range(2):
        before, rested, half_bend, grip = node[RESTED_NEXT, c], node[ALPHA, c], node[HALF_BEND, c], node[GRIP, c]
        if ph.stribeck_rise > 0.0 and dt > 0.0:
            _renew(ph, node, slide, c, dt, ALPHA)
        else:
            rested[:] = node[RESTED, c]
        for i in range(node.shape[2]):
            change = max(change, abs(rested[i] - before[i]))
            before[i] = rested[i]
        for i in range(node.shape[2]):
            grip[i] = half_bend[i] * course * (1.0 + ph.stribeck_rise * rested[i])
        if ph.tension_exponent == 0.0:
            for i in range(node.shape[2]):
                grip[i] = quick_tanh(grip[i])
    return ph.stribeck_rise * change


@kernel(error_model="numpy")
def march(ph, piece, node, slide, mean, load, time_s, theta_in, drive, course, series, steps, out, counts):
    """Step through the samples.

    Parameters
    ----------
    ph : Physics
    piece, node, slide, mean, load : ndarray
        Constants and the state before the first sample, in the rows named above. The first sample is solved at the
        drive's first position, which brings a start that is out of balance into balance.
    time_s, theta_in : ndarray, shape (m,)
        Times (s), and angle of the drive pulley (rad).
    drive : tuple of float
        The drive pulley's radius (m), eccentricity, and the latter's angle (rad).
    course, series : ndarray, shape (m,) or (1,)
        Factor of mu, and what is prescribed at the load: a torque (N m) on top of the load's own, or the angle (rad).
        A single value holds throughout.
    steps : int
        Steps from one sample to the next; where one finds no solution it is halved.
    out : ndarray, shape (7, m)
        Filled with T1, T2, T3, T4 (N), load angle (rad), the load's torque and that of the cables on the drive
        pulley (N m).
    counts : ndarray of int, shape (3,)
        Adds up Newton iterations, substeps, and steps that were taken at the loose tolerance.

    Returns
    -------
    int
        Samples that were solved.
    """
    piece, node, slide, mean, load = borrowed((piece, node, slide, mean, load))
    m, n = time_s.size, node.shape[2]
    last_turn, before_turn, last_pull, before_pull, last_dt = 0.0, 0.0, 0.0, 0.0, 0.0
    node[RESTED] = 1.0
    _set_grip(ph, node, slide, course[0], 0.0)
    fixed_grip = ph.stribeck_rise == 0.0 and course.size == 1
    prescribed = ph.kind == PRESCRIBED_ANGLE
    way_before = winding(theta_in[0], drive[1], drive[2])[0]
    for j in range(m):
        way, round_, _ = winding(theta_in[j], drive[1], drive[2])
        pull, way_before = drive[0] * (way - way_before), way
        wanted = series[min(j, series.size - 1)]
        rise = wanted - series[min(j - 1, series.size - 1)] if j > 0 else 0.0
        dt = time_s[j] - time_s[j - 1] if j > 0 else 0.0
        whole = 1.0 / steps if j > 0 else 1.0
        done, part, bristle = 0.0, whole, ph.bristle
        while done < 1.0 - ROUNDING:
            part = min(part, 1.0 - done)
            step_pull, step_dt = part * pull, part * dt
            # The start: what the last steps did, scaled to the drive's step while it goes the same way.
            expected = 2 * last_pull - before_pull
            is_whole = abs(part - whole) <= ROUNDING and abs(last_dt - step_dt) <= ROUNDING * dt
            if is_whole and abs(expected - step_pull) <= 0.05 * abs(step_pull):
                for c in range(2):
                    for i in range(n + 2):
                        slide[NOW, c, i] = 2 * slide[LAST, c, i] - slide[BEFORE, c, i]
                    mean[MEAN_NEXT, c] = mean[MEAN, c] + 2 * mean[MEAN_LAST, c] - mean[MEAN_BEFORE, c]
                turn = 2 * last_turn - before_turn
            else:
                ratio = step_pull / last_pull if last_pull * pull > 0.0 else 0.0
                ratio = min(ratio, 4.0)
                for c in range(2):
                    for i in range(n + 2):
                        slide[NOW, c, i] = ratio * slide[LAST, c, i]
                    mean[MEAN_NEXT, c] = mean[MEAN, c] + ratio * mean[MEAN_LAST, c]
                turn = ratio * last_turn
            slide[NOW, 0, 0], slide[NOW, 1, 0] = step_pull, -step_pull
            value = wanted - (1.0 - done - part) * rise
            if prescribed:
                turn = value - load[ANGLE]
            torque = 0.0 if prescribed else value
            solved = False
            for look in range(LOOKS):
                # What contacts remember depends on the slides: on those expected first, then on those found.
                if not fixed_grip:
                    change = _set_grip(ph, node, slide, course[min(j, course.size - 1)], step_dt)
                    if look > 0 and change < GRIP_TOLERANCE:  # as expected
                        break
                solved, turn = _newton(ph, piece, node, slide, mean, load, turn, torque, step_dt, bristle, counts)
                if not solved or ph.stribeck_rise == 0.0:
                    break
            if not solved:
                part *= 0.5
                last_pull = 0.0
                if part < SMALLEST_SUBSTEP:
                    if ph.presliding or bristle >= LONGEST_BRISTLE_M:
                        return j
                    bristle *= 10.0
                    part = whole
                continue
            _copy(slide, BEFORE, LAST)
            _copy(slide, LAST, NOW)
            before_turn, last_turn = last_turn, turn
            before_pull, last_pull, last_dt = last_pull, step_pull, step_dt
            _commit(ph, piece, node, slide, mean, load, turn, step_dt)
            counts[1] += 1
            done += part
            part = min(2.0 * part, whole)
        out[0, j], out[1, j] = max(piece[TENSION, 0, 0], 0.0), max(piece[TENSION, 0, n], 0.0)
        out[2, j], out[3, j] = max(piece[TENSION, 1, 0], 0.0), max(piece[TENSION, 1, n], 0.0)
        out[4, j] = load[ANGLE]
        bearing = ph.load_friction_Nm * load[BEARING]
        if prescribed:
            R = ph.radius * winding(load[ANGLE], ph.load_eccentricity[0], ph.load_eccentricity[1])[1]
            out[5, j] = R * (out[1, j] - out[3, j]) - bearing
        else:
            out[5, j] = load[TORQUE]
        out[6, j] = drive[0] * round_ * (out[0, j] - out[2, j])
    return m
