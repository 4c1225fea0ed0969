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
from numba import njit

from ccmodel.mechanisms.backlash import dead_zone
from ccmodel.mechanisms.load_dependent_friction import power_of_tension
from ccmodel.mechanisms.presliding import dahl
from ccmodel.mechanisms.pulley_eccentricity import winding
from ccmodel.mechanisms.pulley_friction import PRESLIDING_RAD
from ccmodel.mechanisms.relaxation import lag_weights
from ccmodel.mechanisms.strand_settling import settling_tension
from ccmodel.mechanisms.stribeck import LAG_S, breakaway

# Coulomb friction has no bristle; this one is a millionth of the stretch of any cable worth pulling.
COULOMB_BRISTLE_M = 1e-9
# A slack piece keeps this share of its stiffness, so that its nodes have a place; its tension counts as zero.
SLACK_SHARE = 1e-9
# Out of balance by no more than this share of the highest tension.
TOLERANCE = 1e-9
NEWTON_LIMIT = 40
SMALLEST_SUBSTEP = 1.0 / 4096

IMPEDANCE, PRESCRIBED_ANGLE = 0, 1

# Constants of a run. Arrays of a piece of cable have shape (2, n + 1), those of a node (2, n).
Physics = namedtuple(
    "Physics",
    "stiffness lost has_settling relaxing has_relaxation tau share conduit_compliance half_bend drag viscous "
    "bristle presliding exponent rise vs course radius eccentricity phase stiffness_load cubic half_gap damping "
    "inertia load_friction kind general_friction",
)
# What a run carries from step to step: stretch, bristles, lost tension, elastic tension, lagging speed, mean tension,
# and of the load: angle, last turn, last step's length, speed, speed before, bristle of its bearing.
State = namedtuple("State", "stretch xi lost_tension elastic speed mean load")
# Room for a step.
Work = namedtuple("Work", "d T K grip p q fd r alpha beta gamma eta xi elastic trial_load delta")

FAST = {"reassoc", "contract", "nsz", "arcp"}  # not nnan: a NaN must be seen


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _tensions(ph, st, w, mean, weights):
    """Tension of each piece and its tangent stiffness for the slides in `w.d`."""
    n1 = ph.stiffness.shape[1]
    for c in range(2):
        T, K, k, d, e = w.T[c], w.K[c], ph.stiffness[c], w.d[c], st.stretch[c]
        if not (ph.has_settling or ph.has_relaxation or ph.conduit_compliance > 0):
            for i in range(n1):
                pull = k[i] * (e[i] + (d[i] - d[i + 1]))
                share = 1.0 if pull > 0.0 else SLACK_SHARE
                T[i] = share * pull
                K[i] = share * k[i]
            continue
        gives = ph.conduit_compliance * (mean[c] - st.mean[c])
        for i in range(n1):
            stretch = e[i] + (d[i] - d[i + 1]) - gives * ph.share[c, i]
            pull, tangent = k[i] * stretch, k[i]
            if ph.lost[c, i] > 0.0 and stretch > 0.0:
                pull, tangent = settling_tension(stretch, ph.lost[c, i], k[i])
                tangent = max(tangent, SLACK_SHARE * k[i])
            w.elastic[c, i] = pull
            if ph.has_relaxation:
                r = ph.relaxing[c, i]
                q = weights[0] * st.lost_tension[c, i] + weights[1] * st.elastic[c, i] + weights[2] * max(pull, 0.0)
                tangent *= 1.0 - r * weights[2] if pull > 0.0 else 1.0
                pull -= r * q
            share = 1.0 if pull > 0.0 else SLACK_SHARE
            T[i] = share * pull
            K[i] = share * tangent


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _nodes(ph, st, w, dt):
    """Balance of each node and its derivatives; the sum of squares of what is out of balance, N^2."""
    n = ph.half_bend.shape[1]
    total = 0.0
    rate = 1.0 / dt if dt > 0.0 else 0.0
    for c in range(2):
        T, K, d, grip, xi = w.T[c], w.K[c], w.d[c], w.grip[c], st.xi[c]
        p, q, fd, r = w.p[c], w.q[c], w.fd[c], w.r[c]
        if ph.presliding:
            for i in range(n):
                x, slope = dahl(xi[i], d[i + 1], ph.bristle)
                # Where nothing slides yet the slope is another to either side.
                w.xi[c, i] = x
                fd[i] = slope if d[i + 1] != 0.0 else 1.0 / ph.bristle
        else:
            inverse = 1.0 / ph.bristle
            for i in range(n):
                trial = xi[i] + d[i + 1] * inverse
                w.xi[c, i] = min(max(trial, -1.0), 1.0)
                fd[i] = inverse if abs(trial) < 1.0 else 0.0
        if not ph.general_friction:
            for i in range(n):
                x, g = w.xi[c, i], grip[i]
                hold = g * (max(T[i], 0.0) + max(T[i + 1], 0.0))
                p[i] = K[i] * (1.0 - x * g)
                q[i] = K[i + 1] * (1.0 + x * g)
                fd[i] *= hold
                r[i] = T[i] - T[i + 1] - x * hold
        else:
            for i in range(n):
                x, g, slope = w.xi[c, i], grip[i], 0.0
                both = max(T[i], 0.0) + max(T[i + 1], 0.0)
                if ph.exponent != 0.0:
                    factor, by_tension = power_of_tension(0.5 * both, ph.exponent)
                    # d tanh(y) = (1 - tanh^2) dy, with y next to tanh(y) for a cell's small bend.
                    y = grip[i] * factor
                    g = np.tanh(y)
                    slope = 0.5 * both * (1.0 - g * g) * grip[i] * by_tension
                hold = g * both + ph.drag[c, i]
                p[i] = K[i] * (1.0 - x * (g + slope))
                q[i] = K[i + 1] * (1.0 + x * (g + slope))
                drag = ph.viscous[c, i] * rate
                fd[i] = fd[i] * hold + drag
                r[i] = T[i] - T[i + 1] - x * hold - drag * d[i + 1]
        for i in range(n):
            total += r[i] * r[i]
    return total


@njit(cache=True, error_model="numpy")
def _load(ph, st, w, theta, torque, dt):
    """Torque out of balance at the load pulley, its slope by the angle less what the cables add, and the radius."""
    n = ph.half_bend.shape[1]
    _, round_, round_slope = winding(theta, ph.eccentricity, ph.phase)
    R = ph.radius * round_
    turn = theta - st.load[0]
    z, inside = dead_zone(theta, ph.half_gap)
    tau = torque + ph.stiffness_load * z + ph.cubic * z**3
    slope = (ph.stiffness_load + 3 * ph.cubic * z * z) * inside
    omega = 0.0
    if dt > 0.0:
        ratio = dt / st.load[2] if st.load[2] > 0.0 else 1.0
        a1, a2 = (1 + 2 * ratio) / (1 + ratio), ratio * ratio / (1 + ratio)
        omega = (a1 * turn - a2 * st.load[1]) / dt
        alpha = (a1 * (omega - st.load[3]) - a2 * (st.load[3] - st.load[4])) / dt
        tau += ph.damping * omega + ph.inertia * alpha
        slope += (ph.damping + ph.inertia * a1 / dt) * a1 / dt
    bearing = st.load[5]
    if ph.load_friction > 0.0:
        bearing, by_turn = dahl(st.load[5], turn, PRESLIDING_RAD)
        slope += ph.load_friction * (by_turn if turn != 0.0 else 1.0 / PRESLIDING_RAD)
    difference = max(w.T[0, n], 0.0) - max(w.T[1, n], 0.0)
    w.trial_load[0], w.trial_load[1], w.trial_load[2] = omega, bearing, tau
    return R * difference - tau - ph.load_friction * bearing, slope - ph.radius * round_slope * difference, R


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _solve(ph, w, G, slope, R, free):
    """Newton's step for the slides into `w.delta`, its drive ends zero; returns the load pulley's turn.

    Elimination from the drive ends: delta_i = alpha_i + beta_i delta_{i+1}, with gamma = 1 - beta carried along by
    itself so that nothing is lost where pieces differ in stiffness by many orders.
    """
    n = ph.half_bend.shape[1]
    alpha_A, alpha_B, gamma_A, gamma_B = 0.0, 0.0, 1.0, 1.0
    for i in range(n):
        pA, pB = w.p[0, i], w.p[1, i]
        fA, fB = pA * gamma_A + w.fd[0, i], pB * gamma_B + w.fd[1, i]
        iA, iB = 1.0 / (fA + w.q[0, i]), 1.0 / (fB + w.q[1, i])
        alpha_A, alpha_B = (w.r[0, i] + pA * alpha_A) * iA, (w.r[1, i] + pB * alpha_B) * iB
        gamma_A, gamma_B = fA * iA, fB * iB
        w.alpha[0, i], w.alpha[1, i] = alpha_A, alpha_B
        w.beta[0, i], w.beta[1, i] = w.q[0, i] * iA, w.q[1, i] * iB
    KA, KB = w.K[0, n], w.K[1, n]
    turn = 0.0
    if free:
        turn = (G + R * (KA * alpha_A - KB * alpha_B)) / (R * R * (KA * gamma_A + KB * gamma_B) + slope)
    dA, dB = R * turn, -R * turn
    w.delta[0, n + 1], w.delta[1, n + 1] = dA, dB
    for i in range(n - 1, -1, -1):
        dA, dB = w.alpha[0, i] + w.beta[0, i] * dA, w.alpha[1, i] + w.beta[1, i] * dB
        w.delta[0, i + 1], w.delta[1, i + 1] = dA, dB
    return turn


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _solve_with_conduits(ph, w, G, slope, R, free, out_of_mean, step_mean):
    """The same with both conduits' mean tensions unknown; their steps go into `step_mean`.

    Every slide is written as a part by itself, a part by the load end's slide and a part by the conduit's own mean
    tension; the conduit's equation then gives the mean by the load end's slide, and the load pulley's gives that.
    """
    n = ph.half_bend.shape[1]
    C = ph.conduit_compliance
    end_fixed, end_slide = np.zeros(2), np.zeros(2)
    mean_fixed, mean_slide = np.zeros(2), np.zeros(2)
    for c in range(2):
        a, g, h = 0.0, 1.0, 0.0
        for i in range(n):
            p, q = w.p[c, i], w.q[c, i]
            f = p * g + w.fd[c, i]
            inverse = 1.0 / (f + q)
            a = (w.r[c, i] + p * a) * inverse
            h = (C * (q * ph.share[c, i + 1] - p * ph.share[c, i]) + p * h) * inverse
            g = f * inverse
            w.alpha[c, i], w.beta[c, i], w.gamma[c, i], w.eta[c, i] = a, q * inverse, g, h
        # From the load end back: sums of share * K * (stretch of the piece) for the three parts.
        A, B, H = 0.0, 1.0, 0.0
        sum_A, sum_B, sum_H, stiff = 0.0, 0.0, 0.0, 0.0
        for i in range(n, -1, -1):
            if i > 0:
                A1 = w.alpha[c, i - 1] + w.beta[c, i - 1] * A
                B1 = w.beta[c, i - 1] * B
                H1 = w.eta[c, i - 1] + w.beta[c, i - 1] * H
            else:
                A1, B1, H1 = 0.0, 0.0, 0.0
            weight = ph.share[c, i] * w.K[c, i]
            sum_A += weight * (A1 - A)
            sum_B += weight * (B1 - B)
            sum_H += weight * (H1 - H)
            stiff += weight * ph.share[c, i]
            A, B, H = A1, B1, H1
        scale = 1.0 / (1.0 + C * stiff - sum_H)
        mean_fixed[c], mean_slide[c] = (out_of_mean[c] + sum_A) * scale, sum_B * scale
        K = w.K[c, n]
        own = h - C * ph.share[c, n]
        end_fixed[c] = K * (a + own * mean_fixed[c])
        end_slide[c] = K * (-g + own * mean_slide[c])
    turn = 0.0
    if free:
        turn = (G + R * (end_fixed[0] - end_fixed[1])) / (slope - R * R * (end_slide[0] + end_slide[1]))
    for c in range(2):
        slide = R * turn if c == 0 else -R * turn
        step_mean[c] = mean_fixed[c] + mean_slide[c] * slide
        w.delta[c, n + 1] = slide
        for i in range(n - 1, -1, -1):
            slide = w.alpha[c, i] + w.eta[c, i] * step_mean[c] + w.beta[c, i] * slide
            w.delta[c, i + 1] = slide
    return turn


@njit(cache=True, error_model="numpy")
def _move(ph, st, w, share):
    """Take the slides a share of Newton's step on, no node from sliding one way to sliding the other in one go.

    Between the two lies the narrow stretch in which the node sticks, and Newton's method would step over it for ever.
    """
    n = ph.half_bend.shape[1]
    inverse = 1.0 / ph.bristle
    for c in range(2):
        for i in range(1, n + 1):
            old = w.d[c, i]
            new = old + share * w.delta[c, i]
            if ph.presliding:
                if old * new < 0.0:
                    new = 0.0
            else:
                xi = st.xi[c, i - 1]
                before, after = xi + old * inverse, xi + new * inverse
                if (before > 1.0 and after < -1.0) or (before < -1.0 and after > 1.0):
                    new = -xi * ph.bristle
            w.d[c, i] = new


@njit(cache=True, error_model="numpy")
def _newton(ph, st, w, theta, torque, dt, saved, counts):
    """Solve a step from the slides in `w.d` and the load angle `theta`; (whether it converged, load angle)."""
    n = ph.half_bend.shape[1]
    free = ph.kind == IMPEDANCE
    weights = lag_weights(dt / ph.tau) if ph.has_relaxation and dt > 0.0 else (1.0, 0.0, 0.0)
    soft = ph.conduit_compliance > 0.0
    mean, step_mean, out_of_mean, old_mean = st.mean.copy(), np.zeros(2), np.zeros(2), np.zeros(2)
    way_0 = winding(st.load[0], ph.eccentricity, ph.phase)[0]
    share, best = 1.0, np.inf
    turn, old_theta = 0.0, theta
    for iteration in range(NEWTON_LIMIT):
        way = ph.radius * (winding(theta, ph.eccentricity, ph.phase)[0] - way_0)
        w.d[0, n + 1], w.d[1, n + 1] = way, -way
        _tensions(ph, st, w, mean, weights)
        error = _nodes(ph, st, w, dt)
        G, slope, R = _load(ph, st, w, theta, torque, dt)
        if free:
            error += (G / ph.radius) ** 2
        if soft:
            for c in range(2):
                out_of_mean[c] = -mean[c]
                for i in range(n + 1):
                    out_of_mean[c] += ph.share[c, i] * max(w.T[c, i], 0.0)
                error += out_of_mean[c] ** 2
        counts[0] += 1
        scale = max(max(w.T[0, 0], w.T[0, n]), max(w.T[1, 0], w.T[1, n]))
        limit = TOLERANCE * max(scale, 1e-2)
        if error <= limit * limit:
            return True, theta
        if not np.isfinite(error):
            return False, theta
        if iteration > 6 and error > best and share > 0.02:
            # Back towards where the step began; the limits on single nodes are undone with it.
            share *= 0.5
            w.d[:] = saved
            theta = old_theta
            mean[:] = old_mean
        else:
            best, share = error, 1.0
            saved[:] = w.d
            old_theta = theta
            old_mean[:] = mean
            if soft:
                turn = _solve_with_conduits(ph, w, G, slope, R, free, out_of_mean, step_mean)
            else:
                turn = _solve(ph, w, G, slope, R, free)
        _move(ph, st, w, share)
        theta += share * turn
        for c in range(2):
            mean[c] += share * step_mean[c]
    return False, theta


@njit(cache=True, error_model="numpy")
def _commit(ph, st, w, theta, dt):
    """Take over a solved step."""
    n = ph.half_bend.shape[1]
    weights = lag_weights(dt / ph.tau) if ph.has_relaxation and dt > 0.0 else (1.0, 0.0, 0.0)
    for c in range(2):
        mean = st.mean[c]
        if ph.conduit_compliance > 0.0:
            mean = 0.0
            for i in range(n + 1):
                mean += ph.share[c, i] * max(w.T[c, i], 0.0)
        gives = ph.conduit_compliance * (mean - st.mean[c])
        for i in range(n + 1):
            st.stretch[c, i] += w.d[c, i] - w.d[c, i + 1] - gives * ph.share[c, i]
            if ph.has_relaxation:
                elastic = max(w.elastic[c, i], 0.0)
                st.lost_tension[c, i] = (
                    weights[0] * st.lost_tension[c, i] + weights[1] * st.elastic[c, i] + weights[2] * elastic
                )
                st.elastic[c, i] = elastic
        for i in range(n):
            st.xi[c, i] = w.xi[c, i]
        st.mean[c] = mean
    if ph.rise > 0.0 and dt > 0.0:
        keep = np.exp(-dt / LAG_S)
        for c in range(2):
            for i in range(n):
                st.speed[c, i] = keep * st.speed[c, i] + (1.0 - keep) * w.d[c, i + 1] / dt
    if dt > 0.0:
        st.load[1], st.load[2] = theta - st.load[0], dt
        st.load[4], st.load[3] = st.load[3], w.trial_load[0]
    st.load[0], st.load[5] = theta, w.trial_load[1]


@njit(cache=True, error_model="numpy")
def _set_grip(ph, st, w, course):
    """Friction of each node per sum of its tensions; with a power of tension only its argument, mu phi / 2."""
    n = ph.half_bend.shape[1]
    for c in range(2):
        for i in range(n):
            y = ph.half_bend[c, i] * course
            if ph.rise > 0.0:
                y *= breakaway(st.speed[c, i], ph.rise, ph.vs)
            w.grip[c, i] = y if ph.exponent != 0.0 else np.tanh(y)


@njit(cache=True, error_model="numpy")
def march(ph, st, w, time_s, way_in, series, out, counts):
    """Step through the samples.

    Parameters
    ----------
    ph, st, w : Physics, State, Work
        `st` holds the state before the first sample; the first sample is solved at the drive's first position, which
        brings a start that is out of balance into balance.
    time_s, way_in, series : ndarray, shape (m,)
        Times (s), way of the cables at the drive pulley (m), and what is prescribed at the load: a torque (N m) on
        top of the load's own, or the angle (rad).
    out : ndarray, shape (7, m)
        Filled with T1, T2, T3, T4 (N), load angle (rad), the load's torque and the torque of its bearing (N m).
    counts : ndarray of int, shape (2,)
        Adds up Newton iterations and substeps.

    Returns
    -------
    int
        Samples that were solved.
    """
    m, n = time_s.size, ph.half_bend.shape[1]
    saved = np.zeros_like(w.d)
    last, before = np.zeros_like(w.d), np.zeros_like(w.d)
    last_turn, before_turn, last_pull, before_pull, last_dt = 0.0, 0.0, 0.0, 0.0, 0.0
    _set_grip(ph, st, w, ph.course[0])
    fixed_grip = ph.rise == 0.0 and ph.course.size == 1
    prescribed = ph.kind == PRESCRIBED_ANGLE
    for j in range(m):
        pull = way_in[j] - way_in[j - 1] if j > 0 else 0.0
        rise = series[j] - series[j - 1] if j > 0 else 0.0
        dt = time_s[j] - time_s[j - 1] if j > 0 else 0.0
        done, part = 0.0, 1.0
        while done < 1.0:
            part = min(part, 1.0 - done)
            if not fixed_grip:
                _set_grip(ph, st, w, ph.course[min(j, ph.course.size - 1)])
            step_pull, step_dt = part * pull, part * dt
            # The start: what the last steps did, scaled to the drive's step while it goes the same way.
            expected = 2 * last_pull - before_pull
            theta = st.load[0]
            if part == 1.0 and last_dt == dt and abs(expected - pull) <= 0.05 * abs(pull):
                for c in range(2):
                    for i in range(n + 2):
                        w.d[c, i] = 2 * last[c, i] - before[c, i]
                theta += 2 * last_turn - before_turn
            else:
                ratio = step_pull / last_pull if last_pull * pull > 0.0 else 0.0
                ratio = min(ratio, 4.0)
                for c in range(2):
                    for i in range(n + 2):
                        w.d[c, i] = ratio * last[c, i]
                theta += ratio * last_turn
            w.d[0, 0], w.d[1, 0] = step_pull, -step_pull
            value = series[j] - (1.0 - done - part) * rise
            if prescribed:
                theta = value
            solved, theta = _newton(ph, st, w, theta, 0.0 if prescribed else value, step_dt, saved, counts)
            if not solved:
                part *= 0.5
                last_pull = 0.0
                if part < SMALLEST_SUBSTEP:
                    return j
                continue
            before[:] = last
            last[:] = w.d
            before_turn, last_turn = last_turn, theta - st.load[0]
            before_pull, last_pull, last_dt = last_pull, step_pull, step_dt
            _commit(ph, st, w, theta, step_dt)
            counts[1] += 1
            done += part
            part *= 2.0
        out[0, j], out[1, j] = max(w.T[0, 0], 0.0), max(w.T[0, n], 0.0)
        out[2, j], out[3, j] = max(w.T[1, 0], 0.0), max(w.T[1, n], 0.0)
        out[4, j] = st.load[0]
        bearing = ph.load_friction * st.load[5]
        if prescribed:
            R = ph.radius * winding(st.load[0], ph.eccentricity, ph.phase)[1]
            out[5, j] = R * (out[1, j] - out[3, j]) - bearing
        else:
            out[5, j] = w.trial_load[2]
        out[6, j] = bearing
    return m
