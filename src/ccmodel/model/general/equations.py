"""Equations of a step: tensions, friction at the nodes, and the balance at the load pulley.

The unknowns are the slides d of all nodes and the rotation of the load pulley. A node solves

    T_i - T_{i+1} = xi_i(d_i) tanh(mu phi_i / 2) (T_i + T_{i+1}) + (drag),      T_i on its drive side,

so that a node that slides has the capstan's ratio T_i / T_{i+1} = exp(mu phi_i) on any grid. xi is the node's bristle,
-1 to 1, elastic and ideally plastic, over `COULOMB_BRISTLE_M`, which makes the equations piecewise linear. Where there
is presliding, it is the mean of several with lengths of their own and of one that follows Dahl's law. Friction that
depends on the direction of sliding has xi + b xi^2 in its place.
"""

from numpy.typing import NDArray

from ccmodel.elementary import quick_tanh
from ccmodel.kernel import kernel
from ccmodel.mechanisms.backlash import dead_zone
from ccmodel.mechanisms.load_dependent_friction import power_of_tension
from ccmodel.mechanisms.presliding import MOST_ELEMENTS, dahl
from ccmodel.mechanisms.pulley_friction import torque_under
from ccmodel.mechanisms.relaxation import BRANCHES, lag_weights
from ccmodel.mechanisms.strand_settling import settling_tension
from ccmodel.mechanisms.stribeck import renewed
from ccmodel.mechanisms.tables import interpolated, pulled, slipped
from ccmodel.mechanisms.viscous_friction import power_of_speed
from ccmodel.mechanisms.winding import winding, winding_change
from ccmodel.model.general import layout as rows
from ccmodel.model.general.layout import Physics

# Tension below which a cable is nearly slack.
SLACK_N = 0.02
# Balance is judged against no less than this tension: against those of slack cables, no step would be balanced.
LEAST_SCALE_N = 1.0


@kernel(error_model="numpy", fastmath=rows.FAST, forceinline=True)
def _tensions(ph: Physics, piece: NDArray, slide: NDArray, mean: NDArray, follows: float) -> None:
    """Tension (N) and tangent stiffness (N/m) of each piece for the slides of this step.

    Relaxation has lost the share r of `MEMORY` and of what `follows` of the new elastic tension (`set_memory`).
    """
    n1 = piece.shape[2]
    for c in range(2):
        T, K, k = piece[rows.TENSION, c], piece[rows.TANGENT, c], piece[rows.STIFFNESS, c]
        d, e = slide[rows.NOW, c], piece[rows.STRETCH, c]
        if not (ph.has_settling or ph.has_relaxation or ph.has_spring_table or ph.conduit_compliance > 0):
            for i in range(n1):
                pull = k[i] * (e[i] + (d[i] - d[i + 1]))
                share = 1.0 if pull > 0.0 else rows.SLACK_SHARE
                T[i] = share * pull
                K[i] = share * k[i]
            continue
        gives = ph.conduit_compliance * (mean[rows.MEAN_NEXT, c] - mean[rows.MEAN, c])
        for i in range(n1):
            T[i] = e[i] + (d[i] - d[i + 1]) - gives * piece[rows.SHARE, c, i]
        if ph.has_settling:
            _settle(piece, c)
        else:
            for i in range(n1):
                piece[rows.PULL, c, i] = k[i] * T[i]
                K[i] = k[i]
        if ph.has_spring_table:
            _bend(piece, c)
        for i in range(n1):
            pull, tangent = piece[rows.PULL, c, i], K[i]
            if ph.has_relaxation:
                r = piece[rows.RELAXING, c, i]
                q = piece[rows.MEMORY, c, i] + follows * max(pull, 0.0)
                tangent *= 1.0 - r * follows if pull > 0.0 else 1.0
                pull -= r * q
            share = 1.0 if pull > 0.0 else rows.SLACK_SHARE
            T[i] = share * pull
            K[i] = share * tangent


@kernel(error_model="numpy", fastmath=rows.FAST)
def _settle(piece: NDArray, c: int) -> None:
    """Pull and tangent stiffness of each piece of a cable whose strands settle, from its stretch in row `TENSION`.

    Loops that call elementary functions do nothing else, here and elsewhere, so that the compiler vectorises them.
    """
    stretch, k, lost, pulls, K = (
        piece[rows.TENSION, c],
        piece[rows.STIFFNESS, c],
        piece[rows.LOST, c],
        piece[rows.PULL, c],
        piece[rows.TANGENT, c],
    )
    for i in range(piece.shape[2]):
        settles = lost[i] > 0.0 and stretch[i] > 0.0
        pull, tangent = settling_tension(stretch[i], lost[i] if settles else 1.0, k[i])
        pulls[i] = pull if settles else k[i] * stretch[i]
        K[i] = max(tangent, rows.SLACK_SHARE * k[i]) if settles else k[i]


@kernel(error_model="numpy", fastmath=rows.FAST)
def _bend(piece: NDArray, c: int) -> None:
    """Bend the characteristic of each piece of a cable as its table has it: a compliance by tension, over its mean."""
    pulls, K = piece[rows.PULL, c], piece[rows.TANGENT, c]
    for i in range(piece.shape[2]):
        if piece[rows.SPRING_TABLE, c, i] > 0.0:
            pulls[i], slope = pulled(piece, rows.SPRING_TABLE, c, i, pulls[i])
            K[i] *= slope


@kernel(error_model="numpy", fastmath=rows.FAST)
def _set_hold(ph: Physics, piece: NDArray, node: NDArray, c: int) -> None:
    """Tension-dependent friction of each node over the sum of its tensions, and half that sum times its derivative."""
    T, grip, now, slope = piece[rows.TENSION, c], node[rows.GRIP, c], node[rows.GRIP_NOW, c], node[rows.GRIP_SLOPE, c]
    for i in range(node.shape[2]):
        half = 0.5 * (max(T[i], 0.0) + max(T[i + 1], 0.0))
        factor, by_tension = power_of_tension(half, ph.tension_exponent)
        g = quick_tanh(grip[i] * factor)
        now[i] = g
        slope[i] = half * (1.0 - g * g) * grip[i] * by_tension


@kernel(error_model="numpy", fastmath=rows.FAST)
def _set_hold_by_table(ph: Physics, piece: NDArray, node: NDArray, c: int) -> None:
    """The same where a table gives a factor of friction by tension, beside a power of it."""
    T, grip, now, slope = piece[rows.TENSION, c], node[rows.GRIP, c], node[rows.GRIP_NOW, c], node[rows.GRIP_SLOPE, c]
    for i in range(node.shape[2]):
        half = 0.5 * (max(T[i], 0.0) + max(T[i + 1], 0.0))
        now[i], slope[i] = interpolated(node, rows.FRICTION_TABLE, c, i, half)
    if ph.tension_exponent != 0.0:
        for i in range(node.shape[2]):
            half = 0.5 * (max(T[i], 0.0) + max(T[i + 1], 0.0))
            power, by_power = power_of_tension(half, ph.tension_exponent)
            slope[i] = power * slope[i] + by_power * now[i]
            now[i] *= power
    for i in range(node.shape[2]):
        half = 0.5 * (max(T[i], 0.0) + max(T[i + 1], 0.0))
        g = quick_tanh(grip[i] * now[i])
        now[i] = g
        slope[i] = half * (1.0 - g * g) * grip[i] * slope[i]


@kernel(error_model="numpy", fastmath=rows.FAST)
def _elements(ph: Physics, node: NDArray, d: NDArray, c: int, length: float) -> None:
    """Friction of each node of a cable over its limit, from its elements and its bristle of `length` (m), and its
    derivative.
    """
    x, slope = node[rows.BRISTLE_NEXT, c], node[rows.GIVES, c]
    before, after = node[rows.ELEMENT + MOST_ELEMENTS, c], node[rows.ELEMENT_NEXT + MOST_ELEMENTS, c]
    for i in range(node.shape[2]):
        after[i], by_slide = dahl(before[i], d[i + 1], length)
        # Where nothing has slid yet, the slope differs between the two directions.
        slope[i] = ph.creep * (by_slide if d[i + 1] != 0.0 else 1.0 / length)
        x[i] = ph.creep * after[i]
    for k in range(ph.elements):
        before, after = node[rows.ELEMENT + k, c], node[rows.ELEMENT_NEXT + k, c]
        inverse, share = 1.0 / ph.element_m[k], ph.element_share[k]
        for i in range(node.shape[2]):
            trial = before[i] + d[i + 1] * inverse
            after[i] = min(max(trial, -1.0), 1.0)
            x[i] += share * after[i]
            slope[i] += share * inverse if abs(trial) < 1.0 else 0.0


@kernel(error_model="numpy", fastmath=rows.FAST)
def _set_speeds(node: NDArray, slide: NDArray, c: int, dt: float, last_dt: float) -> None:
    """Sliding speed of each node at the end of a step of dt (s), and its derivative by the slide.

    Mean speeds of this step and of the last one are extrapolated, to second order in the time step. Where the node has
    just begun to slide the last one says less, and from rest nothing; where it all but stops, it does not turn.
    """
    d, last = slide[rows.NOW, c], slide[rows.LAST, c]
    speed, by_slide = node[rows.SPEED, c], node[rows.SPEED_BY_SLIDE, c]
    rate, last_rate = 1.0 / dt, 1.0 / last_dt if last_dt > 0.0 else 0.0
    share = dt / (dt + last_dt) if last_dt > 0.0 else 0.0
    for i in range(node.shape[2]):
        mean = abs(d[i + 1]) * rate
        before = (last[i + 1] if d[i + 1] >= 0.0 else -last[i + 1]) * last_rate
        if before < mean:
            begun = max(2.0 * before, 0.0)
            slower = mean - before <= begun
            change, slope = (mean - before, 1.0) if slower else (begun, 0.0)
        else:
            stops = before - mean >= mean
            change, slope = (-mean, -1.0) if stops else (mean - before, 1.0)
        end = mean + share * change
        speed[i] = end if d[i + 1] >= 0.0 else -end
        by_slide[i] = rate * (1.0 + share * slope)


@kernel(error_model="numpy", fastmath=rows.FAST)
def _set_drag(ph: Physics, piece: NDArray, node: NDArray, grip: NDArray, c: int) -> None:
    """Add a drag by speed to the friction of each node, of which `grip` is the part in proportion to its tensions.

    Nothing would hold a slack cable whose drag falls with speed. Towards no tension, the drag changes over to the table
    behind its own, which does not fall. Friction is never negative.

    `DRAG_SLOPE` is the derivative of friction by the slide over the node's direction, N/m.
    """
    T, drag, speeds = piece[rows.TENSION, c], node[rows.DRAG, c], node[rows.SPEED, c]
    in_proportion, constant, slope = node[rows.GRIP_NOW, c], node[rows.DRAG_NOW, c], node[rows.DRAG_SLOPE, c]
    of_slack = ph.drag_table + 1 + 2 * int(node[ph.drag_table, 0, 0])
    for i in range(node.shape[2]):
        both = max(T[i], 0.0) + max(T[i + 1], 0.0)
        share = min(both / (2.0 * SLACK_N), 1.0)
        speed, by_slide = abs(speeds[i]), node[rows.SPEED_BY_SLIDE, c, i]
        rise = by_slide if speeds[i] >= 0.0 else -by_slide
        taut, by_speed = interpolated(node, ph.drag_table, c, i, speed)
        least = -grip[i] * max(both, 2.0 * SLACK_N)
        if taut < least:
            taut, by_speed = least, 0.0
        in_proportion[i], constant[i], slope[i] = grip[i], drag[i] + taut, by_speed * rise
        if share < 1.0:
            slack, by_speed_slack = interpolated(node, of_slack, c, i, speed)
            in_proportion[i] += (taut - slack) / (2.0 * SLACK_N)
            constant[i] += slack - taut
            slope[i] += (1.0 - share) * (by_speed_slack - by_speed) * rise


@kernel(error_model="numpy", fastmath=rows.FAST)
def _set_film(ph: Physics, node: NDArray, c: int) -> None:
    """Viscous drag of each node over its sliding speed, and the derivative of the drag by the speed, N s/m."""
    viscous, film, slope = node[rows.VISCOUS, c], node[rows.FILM, c], node[rows.FILM_SLOPE, c]
    for i in range(node.shape[2]):
        factor, by_speed = power_of_speed(node[rows.SPEED, c, i], ph.viscous_power)
        film[i] = viscous[i] * factor
        slope[i] = viscous[i] * by_speed


@kernel(error_model="numpy", fastmath=rows.FAST, forceinline=True)
def _nodes(
    ph: Physics, piece: NDArray, node: NDArray, slide: NDArray, dt: float, last_dt: float, bristle: float
) -> float:
    """Force out of balance at each node and its derivatives; returns the sum of its squares, N^2."""
    n = node.shape[2]
    total = 0.0
    for c in range(2):
        T, K, d = piece[rows.TENSION, c], piece[rows.TANGENT, c], slide[rows.NOW, c]
        grip, before = node[rows.GRIP, c], node[rows.BRISTLE, c]
        p, q, fd, r = node[rows.NEAR, c], node[rows.FAR, c], node[rows.GIVES, c], node[rows.EXCESS, c]
        if ph.presliding:
            _elements(ph, node, d, c, bristle)
        else:
            inverse = 1.0 / bristle
            for i in range(n):
                trial = before[i] + d[i + 1] * inverse
                node[rows.BRISTLE_NEXT, c, i] = min(max(trial, -1.0), 1.0)
                fd[i] = inverse if abs(trial) < 1.0 else 0.0
        if not ph.general_friction:
            for i in range(n):
                xi = node[rows.BRISTLE_NEXT, c, i]
                x, g = xi + ph.direction_bias * xi * xi, grip[i]
                fd[i] *= 1.0 + 2.0 * ph.direction_bias * xi
                hold = g * (max(T[i], 0.0) + max(T[i + 1], 0.0))
                p[i] = K[i] * (1.0 - x * g)
                q[i] = K[i + 1] * (1.0 + x * g)
                fd[i] *= hold
                r[i] = T[i] - T[i + 1] - x * hold
        else:
            if ph.has_friction_table:
                _set_hold_by_table(ph, piece, node, c)
                grip = node[rows.GRIP_NOW, c]
            elif ph.tension_exponent != 0.0:
                _set_hold(ph, piece, node, c)
                grip = node[rows.GRIP_NOW, c]
            drags = node[rows.DRAG, c]
            if dt > 0.0 and (ph.drag_table > 0 or ph.viscous != 0.0):
                _set_speeds(node, slide, c, dt, last_dt)
            if ph.drag_table > 0:
                _set_drag(ph, piece, node, grip, c)
                grip, drags = node[rows.GRIP_NOW, c], node[rows.DRAG_NOW, c]
            if ph.viscous_power != 1.0:
                _set_film(ph, node, c)
            for i in range(n):
                xi = node[rows.BRISTLE_NEXT, c, i]
                x, g, slope = xi + ph.direction_bias * xi * xi, grip[i], node[rows.GRIP_SLOPE, c, i]
                fd[i] *= 1.0 + 2.0 * ph.direction_bias * xi
                hold = g * (max(T[i], 0.0) + max(T[i + 1], 0.0)) + drags[i]
                p[i] = K[i] * (1.0 - x * (g + slope))
                q[i] = K[i + 1] * (1.0 + x * (g + slope))
                fd[i] = fd[i] * hold + node[rows.FILM_SLOPE, c, i] * node[rows.SPEED_BY_SLIDE, c, i]
                r[i] = T[i] - T[i + 1] - x * hold - node[rows.FILM, c, i] * node[rows.SPEED, c, i]
            if ph.drag_table > 0:
                for i in range(n):
                    xi = node[rows.BRISTLE_NEXT, c, i]
                    fd[i] += (xi + ph.direction_bias * xi * xi) * node[rows.DRAG_SLOPE, c, i]
        for i in range(n):
            total += r[i] * r[i]
    return total


@kernel(error_model="numpy", forceinline=True)
def _laws_of_load(
    ph: Physics, load: NDArray, theta: float, travel: float, omega: float, by_rotation: float
) -> tuple[float, float, float]:
    """Torque of the load's laws, and of those of its pulley's bearing (N m), and the slope of their sum by rotation.

    `by_rotation` is the derivative of the speed omega by the rotation.
    """
    motion, R = (travel, omega, by_rotation), ph.load_pulley.radius_m
    of_load, slope = _by_motion(load, ph.load_by_speed, ph.load_elements, *motion, R)
    in_bearing, slope_in_bearing = _by_motion(load, ph.bearing_by_speed, ph.bearing_elements, *motion, R)
    if ph.load_by_angle > 0:
        torque, by_angle = interpolated(load.reshape((load.size, 1, 1)), ph.load_by_angle, 0, 0, theta)
        of_load, slope = of_load + torque, slope + by_angle
    return of_load, in_bearing, slope + slope_in_bearing


@kernel(error_model="numpy")
def _by_motion(
    load: NDArray, by_speed: int, elements: int, travel: float, omega: float, by_rotation: float, R: float
) -> tuple[float, float]:
    """Torque of a table by speed and of elements, in these rows if there are any, and its slope by rotation."""
    torque, slope = 0.0, 0.0
    if by_speed > 0:
        torque, by_omega = interpolated(load.reshape((load.size, 1, 1)), by_speed, 0, 0, omega)
        slope = by_omega * by_rotation
    if elements > 0:
        held, by_travel = slipped(load, elements, travel)
        torque, slope = torque + held, slope + by_travel * R
    return torque, slope


@kernel(error_model="numpy", forceinline=True)
def speed_and_acceleration(load: NDArray, rotation: float, dt: float, rings: bool) -> tuple[float, float, float, float]:
    """Speed and acceleration of the load after a rotation, derivatives of the one by it and of the other by the speed.

    A load that rings on smooth contacts is followed by the method of Fox and Goodwin, the member of Newmark's family
    with beta = 1/12 and gamma = 1/2: its frequency errs by (omega dt)^4 / 480, and it adds no damping. Any other load
    is followed by backward differences of second order, which damp what a step does not resolve, and whose frequency
    errs by (omega dt)^2 / 3.
    """
    speed, acceleration = load[rows.OMEGA], load[rows.ACCELERATION]
    if rings:
        by_rotation, by_omega = 6 / dt, 2 / dt
        omega = by_rotation * rotation - 5 * speed - 2 * dt * acceleration
        return omega, by_omega * (omega - speed) - acceleration, by_rotation, by_omega
    ratio = dt / load[rows.DT] if load[rows.DT] > 0.0 else 1.0
    a1, a2 = (1 + 2 * ratio) / (1 + ratio), ratio * ratio / (1 + ratio)
    omega = (a1 * rotation - a2 * load[rows.ROTATION]) / dt
    alpha = (a1 * (omega - speed) - a2 * (speed - load[rows.OMEGA_BEFORE])) / dt
    return omega, alpha, a1 / dt, a1 / dt


@kernel(error_model="numpy", forceinline=True)
def _load(
    ph: Physics, piece: NDArray, load: NDArray, rotation: float, torque: float, dt: float
) -> tuple[float, float, float]:
    """Torque out of balance at the load pulley (N m), its derivative by angle without the cables, and the radius."""
    n = piece.shape[2] - 1
    theta = load[rows.ANGLE] + rotation
    _, radius_factor, radius_slope = winding(theta, ph.load_pulley)
    R = ph.load_pulley.radius_m * radius_factor
    z, inside = dead_zone(theta, ph.half_gap)
    tau = torque + ph.stiffness_load * z + ph.cubic_stiffness * z**3
    slope = (ph.stiffness_load + 3 * ph.cubic_stiffness * z * z) * inside
    omega, by_rotation = 0.0, 0.0
    if dt > 0.0:
        omega, alpha, by_rotation, by_omega = speed_and_acceleration(load, rotation, dt, ph.rings)
        tau += ph.load_damping * omega + ph.inertia * alpha
        slope += (ph.load_damping + ph.inertia * by_omega) * by_rotation
        load[rows.ACCELERATION_NEXT] = alpha
    near_A, near_B = max(piece[rows.TENSION, 0, n], 0.0), max(piece[rows.TENSION, 1, n], 0.0)
    bearing, in_bearing = load[rows.BEARING], 0.0
    if ph.load_friction_Nm > 0.0:
        bearing, by_sliding = dahl(load[rows.BEARING], rotation, ph.load_presliding_rad)
        friction = torque_under(near_A + near_B, ph.load_friction_Nm, ph.load_friction_by_pull)
        slope += friction * (by_sliding if rotation != 0.0 else 1.0 / ph.load_presliding_rad)
        in_bearing = friction * bearing
    if ph.has_load_laws:
        # The first step only balances the start: elements begin there without a torque.
        travel = ph.load_pulley.radius_m * rotation if dt > 0.0 else 0.0
        torque_of_load, torque_in_bearing, by_laws = _laws_of_load(ph, load, theta, travel, omega, by_rotation)
        tau, in_bearing, slope = tau + torque_of_load, in_bearing + torque_in_bearing, slope + by_laws
    difference = near_A - near_B
    load[rows.OMEGA_NEXT], load[rows.BEARING_NEXT] = omega, bearing
    load[rows.TORQUE], load[rows.IN_BEARING] = tau, in_bearing
    return (
        R * difference - tau - in_bearing,
        slope - ph.load_pulley.radius_m * radius_slope * difference,
        R,
    )


@kernel(error_model="numpy", forceinline=True)
def imbalance(
    ph: Physics,
    piece: NDArray,
    node: NDArray,
    slide: NDArray,
    mean: NDArray,
    load: NDArray,
    rotation: float,
    torque: float,
    dt: float,
    bristle: float,
    follows: float,
) -> tuple[float, float, float, float, float]:
    """Imbalance of the whole chain: sum of squares (N^2), scale of the tensions (N), and the terms of `_load`."""
    n = node.shape[2]
    pulled = ph.load_pulley.radius_m * winding_change(load[rows.ANGLE], rotation, ph.load_pulley)
    slide[rows.NOW, 0, n + 1], slide[rows.NOW, 1, n + 1] = pulled, -pulled
    _tensions(ph, piece, slide, mean, follows)
    error = _nodes(ph, piece, node, slide, dt, load[rows.DT], bristle)
    G, slope, R = _load(ph, piece, load, rotation, torque, dt)
    if ph.kind == rows.IMPEDANCE:
        error += (G / ph.load_pulley.radius_m) ** 2
    if ph.conduit_compliance > 0.0:
        for c in range(2):
            mean[rows.MEAN_EXCESS, c] = _mean_tension(piece, c) - mean[rows.MEAN_NEXT, c]
            error += mean[rows.MEAN_EXCESS, c] ** 2
    T = piece[rows.TENSION]
    highest = max(max(T[0, 0], T[0, n]), max(T[1, 0], T[1, n]))
    return error, max(highest, LEAST_SCALE_N), G, slope, R


@kernel(error_model="numpy", forceinline=True)
def _mean_tension(piece: NDArray, c: int) -> float:
    """Mean tension of a cable along its length, N."""
    total = 0.0
    for i in range(piece.shape[2]):
        total += piece[rows.SHARE, c, i] * max(piece[rows.TENSION, c, i], 0.0)
    return total


@kernel(error_model="numpy", fastmath=rows.FAST)
def set_grip(ph: Physics, node: NDArray, slide: NDArray, friction_factor: NDArray, dt: float) -> float:
    """Set friction of each node over the sum of its tensions; with a law of tension, only its argument mu phi / 2.

    `friction_factor` is that of mu by cable, shape (2,). The contacts' memory of rest at the end of the step follows
    from the slides in `NOW`, the best estimate so far.
    Returns the largest relative change of friction.
    """
    change = 0.0
    for c in range(2):
        before, rested = node[rows.RESTED_NEXT, c], node[rows.ALPHA, c]
        half_bend, grip = node[rows.HALF_BEND, c], node[rows.GRIP, c]
        if ph.stribeck_rise > 0.0 and dt > 0.0:
            renew_contacts(ph, node, slide, c, dt, rows.ALPHA)
        else:
            for i in range(node.shape[2]):
                rested[i] = node[rows.RESTED, c, i]
        for i in range(node.shape[2]):
            change = max(change, abs(rested[i] - before[i]))
            before[i] = rested[i]
        for i in range(node.shape[2]):
            grip[i] = half_bend[i] * friction_factor[c] * (1.0 + ph.stribeck_rise * rested[i])
        if ph.tension_exponent == 0.0 and not ph.has_friction_table:
            for i in range(node.shape[2]):
                grip[i] = quick_tanh(grip[i])
    return ph.stribeck_rise * change


@kernel(error_model="numpy", fastmath=rows.FAST)
def renew_contacts(ph: Physics, node: NDArray, slide: NDArray, c: int, dt: float, into: int) -> None:
    """Write the contacts' memory of rest after the slides in `NOW` into row `into`."""
    rested, d, following = node[rows.RESTED, c], slide[rows.NOW, c], node[into, c]
    for i in range(node.shape[2]):
        following[i] = renewed(rested[i], d[i + 1], dt, ph.stribeck_speed, ph.stribeck_exponent, ph.stribeck_renewal_m)


@kernel(error_model="numpy", fastmath=rows.FAST)
def set_memory(ph: Physics, piece: NDArray, dt: float) -> float:
    """Write the mean of the relaxing branches after a step into `MEMORY`, without the part that follows its tension.

    Returns this part over the new elastic tension, which is linear in time through the step.
    """
    piece[rows.MEMORY] = 0.0
    follows = 0.0
    for k in range(BRANCHES):
        kept, before, after = lag_weights(dt / ph.relaxing_times_s[k]) if dt > 0.0 else (1.0, 0.0, 0.0)
        follows += after / BRANCHES
        for c in range(2):
            memory, branch, elastic = piece[rows.MEMORY, c], piece[rows.BRANCH + k, c], piece[rows.ELASTIC, c]
            for i in range(piece.shape[2]):
                memory[i] += (kept * branch[i] + before * elastic[i]) / BRANCHES
    return follows


@kernel(error_model="numpy", fastmath=rows.FAST)
def relax(ph: Physics, piece: NDArray, dt: float) -> None:
    """Let the relaxing branches follow the elastic tension of the solved step, and make this tension the state."""
    for k in range(BRANCHES):
        kept, before, after = lag_weights(dt / ph.relaxing_times_s[k]) if dt > 0.0 else (1.0, 0.0, 0.0)
        for c in range(2):
            pull, branch, elastic = piece[rows.PULL, c], piece[rows.BRANCH + k, c], piece[rows.ELASTIC, c]
            for i in range(piece.shape[2]):
                branch[i] = kept * branch[i] + before * elastic[i] + after * max(pull[i], 0.0)
    for c in range(2):
        for i in range(piece.shape[2]):
            piece[rows.ELASTIC, c, i] = max(piece[rows.PULL, c, i], 0.0)
