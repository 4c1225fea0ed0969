"""The same dynamics as `virtualrig.dynamics`, with every effect of `virtualrig.effects`.

An effect that is not there costs next to nothing: what it would do stands behind a flag outside the loops over nodes.
What changes slowly (friction's dependence on tension, time and place) is brought up to date every `SLOW_S`.
"""

from collections import namedtuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from virtualrig.chain import initial_tension, stable_step
from virtualrig.config import Numerics, Rig
from virtualrig.effects import DahlPresliding, Eccentricity, Effects, IwanPresliding, PulleyFriction
from virtualrig.grid import Grid
from virtualrig.trajectory import Preparation, Trajectory, check_tensions

SLOW_S = 1e-4
# A conduit follows its cable's mean tension within this time: far below any motion, well above the time step.
CONDUIT_LAG_S = 1e-4
# Over which a friction torque that is not there would build up.
ANY_RAD = 1.0

Physics = namedtuple(
    "Physics",
    "bristle_length stribeck_rise stribeck_speed stribeck_exponent stribeck_renewal tension_exponent reference floor "
    "run_in_change run_in_scale run_in_by_travel bias wear_rise wear_period wear_phase "
    "has_settling settling_is_exponential conduit_compliance "
    "radius drive_share drive_phase load_share load_phase bearing_torque bearing_angle "
    "spring cubic half_gap damping inertia hysteresis_torque hysteresis_angle",
)


def simulate(
    rig: Rig,
    grid: Grid,
    numerics: Numerics,
    preparation: Preparation,
    time_s: NDArray,
    drive: tuple[NDArray, NDArray],
) -> Trajectory:
    """Run a rig with effects; parameters, result and errors are those of `virtualrig.dynamics.simulate`."""
    theta_in_rad, omega_in_rad_per_s = drive
    effects, physics = rig.effects, _physics(rig, numerics)
    lengths = _bristle_lengths(effects, numerics)
    half_bend = _half_bend(grid, effects, preparation.friction_coefficient)
    stiffness = _stiffness(rig, grid)
    mass = rig.cable.density_kg_per_m * grid.cell_length_m
    drag = effects.drag_N * grid.cell_length_m / grid.cell_length_m.sum()
    tension, bristle = _initial_state(physics, grid, preparation, half_bend, drag)

    sample_s = time_s[1] - time_s[0]
    dt = _stable_step(physics, stiffness, mass, half_bend, drag, lengths, numerics)
    theta_out = _load_angle(physics, tension[0, -1] - tension[1, -1])
    channels = _run(
        physics,
        theta_in_rad,
        omega_in_rad_per_s,
        sample_s,
        int(np.ceil(sample_s / dt)),
        tension,
        np.repeat(bristle[None], lengths.size, axis=0),
        lengths,
        stiffness,
        _elongation(physics, tension, stiffness, _settling_length(effects, stiffness)),
        _settling_length(effects, stiffness),
        grid.segment_length_m / grid.cell_length_m.sum(),
        np.array([branch.share for branch in effects.relaxation]),
        np.array([branch.time_constant_s for branch in effects.relaxation]),
        numerics.wave_damping * np.sqrt(rig.cable.EA_N * rig.cable.density_kg_per_m),
        1 / mass,
        half_bend,
        drag,
        numerics.drag_rate_per_s + effects.viscous_Ns_per_m2 * grid.cell_length_m / mass,
        theta_out,
    )
    theta_out, T1, T2, T3, T4, bearing = channels
    check_tensions(channels[1:5], numerics.tension_limit_N)
    drive_radius = physics.radius * _roundness(theta_in_rad, physics.drive_share, physics.drive_phase)
    load_radius = physics.radius * _roundness(theta_out, physics.load_share, physics.load_phase)
    tau_in = drive_radius * (T1 - T3) + _bearing_torque(theta_in_rad, effects.drive_pulley.friction)
    return Trajectory(time_s, theta_in_rad, theta_out, T1, T2, T3, T4, tau_in, load_radius * (T2 - T4) - bearing)


def _physics(rig: Rig, numerics: Numerics) -> Physics:
    e = rig.effects
    round_ = Eccentricity(share=0.0)
    drive, load = (pulley.eccentricity or round_ for pulley in (e.drive_pulley, e.load_pulley))
    bearing = e.load_pulley.friction
    return Physics(
        bristle_length=_bristle_lengths(e, numerics)[0],
        stribeck_rise=e.stribeck.rise if e.stribeck else 0.0,
        stribeck_speed=e.stribeck.speed_m_per_s if e.stribeck else 1.0,
        stribeck_exponent=e.stribeck.exponent if e.stribeck else 1.0,
        stribeck_renewal=e.stribeck.renewal_m if e.stribeck else 1.0,
        tension_exponent=e.load_dependent_friction.exponent if e.load_dependent_friction else 0.0,
        reference=e.load_dependent_friction.reference_N if e.load_dependent_friction else 1.0,
        floor=e.load_dependent_friction.floor_N if e.load_dependent_friction else 0.0,
        run_in_change=e.running_in.change if e.running_in else 0.0,
        run_in_scale=e.running_in.scale if e.running_in else 1.0,
        run_in_by_travel=e.running_in is not None and e.running_in.over == "travel_m",
        bias=e.directional_friction.bias if e.directional_friction else 0.0,
        wear_rise=e.positional_friction.rise if e.positional_friction else 0.0,
        wear_period=e.positional_friction.period_m if e.positional_friction else 1.0,
        wear_phase=e.positional_friction.phase_rad if e.positional_friction else 0.0,
        has_settling=e.strand_settling is not None,
        settling_is_exponential=e.strand_settling is not None and e.strand_settling.law == "exponential",
        conduit_compliance=e.conduit_compliance_m_per_N,
        radius=rig.pulley_radius_m,
        drive_share=drive.share,
        drive_phase=drive.phase_rad,
        load_share=load.share,
        load_phase=load.phase_rad,
        bearing_torque=bearing.torque_Nm if bearing else 0.0,
        bearing_angle=bearing.presliding_rad if bearing else ANY_RAD,
        spring=rig.load.spring_stiffness_Nm_per_rad,
        cubic=e.load.cubic_Nm_per_rad3,
        half_gap=e.load.half_gap_rad,
        damping=rig.load.damping_Nms_per_rad,
        inertia=rig.load.inertia_kg_m2 + e.load.inertia_kg_m2,
        hysteresis_torque=e.hysteretic_load.torque_Nm if e.hysteretic_load else 0.0,
        hysteresis_angle=e.hysteretic_load.angle_rad if e.hysteretic_load else ANY_RAD,
    )


def _bristle_lengths(effects: Effects, numerics: Numerics) -> NDArray:
    """Length over which each of a node's elements yields, m, shape (elements,); one element is Dahl's bristle."""
    match effects.presliding:
        case DahlPresliding(length_m=length):
            return np.array([length])
        case IwanPresliding(shortest_m=shortest, longest_m=longest, elements=elements):
            return np.geomspace(shortest, longest, elements)
        case _:
            return np.array([numerics.bristle_length_m])


def _half_bend(grid: Grid, effects: Effects, friction_coefficient: float) -> NDArray:
    """Half of mu phi of each cell, kinks included; shape (2, n).

    A kink is shared between the two nodes around its place, so that its mean place is exact on any grid.
    """
    bend = grid.cell_bend_rad.copy()
    ends = np.cumsum(grid.cell_length_m)
    centre = ends - grid.cell_length_m / 2
    for kink in effects.kinks:
        at = np.interp(kink.place_share * ends[-1], centre, np.arange(centre.size))
        before = min(int(at), max(centre.size - 2, 0))
        bend[before] += (1 - (at - before)) * kink.bend_rad
        bend[min(before + 1, centre.size - 1)] += (at - before) * kink.bend_rad
    ratio = np.array([[1.0], [effects.cable_asymmetry.friction_ratio]])
    return friction_coefficient * ratio * bend / 2


def _stiffness(rig: Rig, grid: Grid) -> NDArray:
    """Stiffness of the segments, N/m, shape (2, n + 1); a termination is one with the segment next to it."""
    ratio = np.array([[1.0], [rig.effects.cable_asymmetry.stiffness_ratio]])
    compliance = grid.segment_length_m / (rig.cable.EA_N * ratio)
    compliance[:, 0] += rig.effects.termination_compliance.drive_m_per_N
    compliance[:, -1] += rig.effects.termination_compliance.load_m_per_N
    return 1 / compliance


def _settling_length(effects: Effects, stiffness: NDArray) -> NDArray:
    """Elongation of each segment that the settling's tension scale makes, m, shape (2, n + 1)."""
    return (effects.strand_settling.tension_scale_N if effects.strand_settling else 0.0) / stiffness


def _initial_state(physics, grid, preparation, half_bend, drag) -> tuple[NDArray, NDArray]:
    """Tension of the segments (N, shape (2, n + 1)) and bristles (shape (2, n)) that hold it in balance."""
    share = np.repeat(np.array(preparation.profile_share)[:, None], drag.size, axis=1)
    grip = np.tanh(half_bend)
    tension = np.stack([initial_tension(grid, *of, preparation.pretension_N) for of in zip(grip, share, strict=True)])
    both = tension[:, :-1] + tension[:, 1:]
    factor = 1 + physics.wear_rise * np.sin(physics.wear_phase)
    if physics.tension_exponent != 0:
        factor = factor * (np.maximum(both / 2, physics.floor) / physics.reference) ** physics.tension_exponent
    hold = np.tanh(half_bend * factor) * (1 + physics.stribeck_rise) * both + drag
    wanted = np.divide(tension[:, :-1] - tension[:, 1:], hold, out=np.zeros_like(hold), where=hold > 0)
    bristle = wanted
    for _ in range(50 if physics.bias else 0):
        bristle = wanted / (1 + physics.bias * bristle)
    return tension, np.clip(bristle, -1, 1)


def _elongation(physics, tension, stiffness, settling) -> NDArray:
    """Elongation of each segment under its tension, m; all of one shape."""
    ideal = tension / stiffness
    if not physics.has_settling:
        return ideal
    if not physics.settling_is_exponential:
        return np.sqrt((ideal + settling) ** 2 - settling**2)
    e = ideal + settling
    for _ in range(60):
        left = np.exp(-e / settling)
        e = np.maximum(e - (e - settling * (1 - left) - ideal) / np.maximum(1 - left, 1e-9), 0.0)
    return e


def _load_angle(physics, tension_difference) -> float:
    """Angle at which the load's spring holds the difference of the cables' load-end tensions, rad."""
    theta = 0.0
    for _ in range(50):
        torque = physics.radius * _roundness(theta, physics.load_share, physics.load_phase) * tension_difference
        beyond = torque / physics.spring
        for _ in range(50):
            excess = physics.spring * beyond + physics.cubic * beyond**3 - torque
            beyond -= excess / (physics.spring + 3 * physics.cubic * beyond**2)
        theta = beyond + np.sign(beyond) * physics.half_gap
    return float(theta)


def _stable_step(physics, stiffness, mass, half_bend, drag, lengths, numerics) -> float:
    """Time step (s) for the stiffest state: everything stuck at the highest tension allowed."""
    limit = numerics.tension_limit_N
    factor = (1 + physics.stribeck_rise) * (1 + physics.wear_rise) * max(1.0, 1 + physics.run_in_change)
    if physics.tension_exponent != 0:
        factor *= (limit / physics.reference) ** physics.tension_exponent
    hold = 2 * np.tanh(half_bend.max(axis=0) * factor) * limit + drag
    bristle = (1 + abs(physics.bias)) * hold * np.mean(1 / lengths)
    radius = physics.radius * (1 - physics.load_share)
    beyond = np.cbrt(physics.radius * limit / physics.cubic) if physics.cubic else 0.0
    torsion = (
        physics.spring
        + 3 * physics.cubic * beyond**2
        + physics.bearing_torque / physics.bearing_angle
        + physics.hysteresis_torque / physics.hysteresis_angle
    )
    spring, pulley_mass = torsion / radius**2 / 2, physics.inertia / (physics.radius * 2 - radius) ** 2 / 2
    return stable_step(stiffness.max(axis=0), mass, bristle, spring, pulley_mass, numerics)


def _roundness(theta, share, phase):
    """A pulley's radius at an angle (rad), over its mean."""
    return 1 + share * np.sin(theta + phase)


@njit(cache=True)
def _bearing_course(theta, angle):
    z = np.zeros_like(theta)
    for j in range(1, theta.size):
        turn = theta[j] - theta[j - 1]
        way = 1.0 if turn > 0 else -1.0
        z[j] = way + (z[j - 1] - way) * np.exp(-abs(turn) / angle)
    return z


def _bearing_torque(theta: NDArray, friction: PulleyFriction | None) -> NDArray | float:
    """Friction torque of a bearing that is turned through the angles `theta` (rad), N m."""
    return friction.torque_Nm * _bearing_course(theta, friction.presliding_rad) if friction else 0.0


@njit(cache=True, inline="always")
def _winding(theta, share, phase):
    """Way of the cable over the mean radius, rad: the integral of the roundness."""
    return theta - share * np.cos(theta + phase)


@njit(cache=True, inline="always")
def _dead_zone(theta, half_gap):
    return max(theta - half_gap, 0.0) + min(theta + half_gap, 0.0)


@njit(cache=True, inline="always")
def _bristle(z, slide_over_length):
    """Dahl's bristle after a slide, implicit: within its bounds for any step (as in `virtualrig.dynamics`)."""
    return (z + slide_over_length) / (1 + abs(slide_over_length))


@njit(cache=True, error_model="numpy")
def _set_strength(p, strength, half_bend, tension, time, travel, drive):
    """Friction of the nodes per sum of the tensions on both sides, as far as it changes slowly."""
    age = travel if p.run_in_by_travel else time
    worn = 1.0 + p.run_in_change * -np.expm1(-age / p.run_in_scale)
    for c in range(2):
        way = drive if c == 0 else -drive
        factor = worn * (1.0 + p.wear_rise * np.sin(2 * np.pi * way / p.wear_period + p.wear_phase))
        for i in range(strength.shape[1]):
            y = half_bend[c, i] * factor
            if p.tension_exponent != 0.0:
                T = max(0.5 * (tension[c, i] + tension[c, i + 1]), p.floor)
                y *= (T / p.reference) ** p.tension_exponent
            strength[c, i] = np.tanh(y)


@njit(cache=True, error_model="numpy")
def _set_hold(p, hold, strength, rested, drag, T):
    """Friction (N) of one cable's nodes when their bristles are drawn in full."""
    n = hold.size
    for i in range(n):
        hold[i] = strength[i] * (T[i] + T[i + 1]) * (1.0 + p.stribeck_rise * rested[i]) + drag[i]


@njit(cache=True, error_model="numpy")
def _renew(p, rested, w, dt):
    """Let the contacts of one cable's nodes take on what their speed `w` makes of them, as they slide."""
    inverse, renewal = 1.0 / p.stribeck_speed, dt / p.stribeck_renewal
    for i in range(rested.size):
        speed = abs(w[i + 1])
        s = speed * inverse
        if p.stribeck_exponent == 2.0:
            s = s * s
        elif p.stribeck_exponent != 1.0:
            s = s**p.stribeck_exponent
        share = speed * renewal
        rested[i] = (rested[i] + share * np.exp(-s)) / (1.0 + share)


@njit(cache=True, error_model="numpy")
def _set_elastic(p, elastic, x, stretch, stiffness, settling, share, gives):
    """Tension (N) of one cable's segments without dampers; `x` are the slides, `gives` the conduit's shortening."""
    n1 = elastic.size
    for i in range(n1):
        e = stretch[i] + (x[i] - x[i + 1]) - share[i] * gives
        elastic[i] = stiffness[i] * max(e, 0.0)
    if p.has_settling:
        for i in range(n1):
            e, s = elastic[i] / stiffness[i], settling[i]
            if p.settling_is_exponential:
                elastic[i] = stiffness[i] * (e + s * np.expm1(-e / s))
            else:
                elastic[i] = stiffness[i] * (np.sqrt(e * e + s * s) - s)


@njit(cache=True, error_model="numpy")
def _run(
    p,
    theta_in,
    omega_in,
    sample_s,
    steps,
    start_tension,
    bristles,
    lengths,
    stiffness,
    stretch,
    settling,
    share,
    relaxing,
    relaxing_time,
    damper,
    inverse_mass,
    half_bend,
    drag,
    drag_rate,
    theta_out,
):
    """Integrate; returns theta_out, T1, T2, T3, T4 and the load bearing's torque at the samples, shape (6, samples).

    Rows and columns are those of `virtualrig.dynamics._run`; `bristles` has shape (elements, 2, n).
    """
    samples = theta_in.size
    nodes = inverse_mass.size
    elements = lengths.size
    share_of_one = 1.0 / elements
    dt = sample_s / steps
    slow_steps = max(1, int(SLOW_S / dt))
    is_slow = p.tension_exponent != 0.0 or p.run_in_change != 0.0 or p.wear_rise != 0.0
    keep = 1 / (1 + drag_rate * dt)
    u = np.zeros((2, nodes + 2))
    v = np.zeros((2, nodes + 2))
    tension = start_tension.copy()
    elastic = start_tension.copy()
    base = np.empty(nodes + 1)
    lost = np.zeros((relaxing.size, 2, nodes + 1))
    bristle = bristles[0].copy()
    strength = np.empty((2, nodes))
    hold = np.empty(nodes)
    rested = np.ones((2, nodes))
    start_mean = np.zeros(2)
    gives = np.zeros(2)
    for c in range(2):
        start_mean[c] = (share * start_tension[c]).sum()
    theta_rest = theta_out
    omega_out = 0.0
    bearing = 0.0
    hysteresis = 0.0
    travel = 0.0
    drive = 0.0
    since_slow = slow_steps
    start_way = _winding(theta_in[0], p.drive_share, p.drive_phase)
    rest_way = _winding(theta_rest, p.load_share, p.load_phase)
    out = np.empty((6, samples))

    for sample in range(samples):
        out[0, sample] = theta_out
        out[1, sample] = tension[0, 0]
        out[2, sample] = tension[0, nodes]
        out[3, sample] = tension[1, 0]
        out[4, sample] = tension[1, nodes]
        out[5, sample] = p.bearing_torque * bearing
        if sample == samples - 1:
            break
        # The drive angle between two samples: the cubic through angles and rates at both.
        rise = theta_in[sample + 1] - theta_in[sample]
        slope_0 = omega_in[sample] * sample_s
        slope_1 = omega_in[sample + 1] * sample_s
        c2 = 3 * rise - 2 * slope_0 - slope_1
        c3 = slope_0 + slope_1 - 2 * rise

        for step in range(1, steps + 1):
            s = step / steps
            theta = theta_in[sample] + s * (slope_0 + s * (c2 + s * c3))
            omega = (slope_0 + s * (2 * c2 + s * 3 * c3)) / sample_s
            drive = p.radius * (_winding(theta, p.drive_share, p.drive_phase) - start_way)
            drive_rate = p.radius * (1.0 + p.drive_share * np.sin(theta + p.drive_phase)) * omega
            travel += abs(drive_rate) * dt
            if since_slow >= slow_steps:
                _set_strength(p, strength, half_bend, tension, (sample + s) * sample_s, travel, drive)
                since_slow = 0
            if is_slow:
                since_slow += 1

            load_radius = p.radius * (1.0 + p.load_share * np.sin(theta_out + p.load_phase))
            beyond = _dead_zone(theta_out, p.half_gap)
            torque = load_radius * (tension[0, nodes] - tension[1, nodes])
            torque -= beyond * (p.spring + p.cubic * beyond * beyond) + p.damping * omega_out
            torque -= p.bearing_torque * bearing + p.hysteresis_torque * hysteresis
            omega_out += dt * torque / p.inertia
            theta_out += dt * omega_out
            bearing = _bristle(bearing, omega_out * dt / p.bearing_angle)
            hysteresis = _bristle(hysteresis, omega_out * dt / p.hysteresis_angle)
            load_radius = p.radius * (1.0 + p.load_share * np.sin(theta_out + p.load_phase))
            load_way = p.radius * (_winding(theta_out, p.load_share, p.load_phase) - rest_way)

            for c in range(2):
                side = 1.0 - 2.0 * c
                T = tension[c]
                x = u[c]
                w = v[c]
                z = bristle[c]
                _set_hold(p, hold, strength[c], rested[c], drag, T)
                for i in range(nodes):
                    friction = hold[i] * z[i] * (1.0 + p.bias * z[i])
                    w[i + 1] = keep[i] * (w[i + 1] + dt * inverse_mass[i] * (T[i] - T[i + 1] - friction))
                if p.stribeck_rise > 0.0:
                    _renew(p, rested[c], w, dt)
                if elements == 1:
                    for i in range(nodes):
                        z[i] = _bristle(z[i], w[i + 1] * (dt / p.bristle_length))
                else:
                    z[:] = 0.0
                    for k in range(elements):
                        zk = bristles[k, c]
                        slid = dt / lengths[k]
                        for i in range(nodes):
                            zk[i] = min(max(zk[i] + w[i + 1] * slid, -1.0), 1.0)
                            z[i] += share_of_one * zk[i]
                for i in range(1, nodes + 1):
                    x[i] += dt * w[i]
                x[0] = side * drive
                w[0] = side * drive_rate
                x[nodes + 1] = side * load_way
                w[nodes + 1] = side * load_radius * omega_out
                _set_elastic(p, elastic[c], x, stretch[c], stiffness[c], settling[c], share, gives[c])
                base[:] = elastic[c]
                for k in range(relaxing.size):
                    q = lost[k, c]
                    rate = dt / relaxing_time[k]
                    for i in range(nodes + 1):
                        q[i] += rate * (elastic[c, i] - q[i])
                        base[i] -= relaxing[k] * q[i]
                for i in range(nodes + 1):
                    pull = base[i] + damper * (w[i] - w[i + 1])
                    # A slack segment neither pushes nor damps.
                    T[i] = max(0.0, pull) if base[i] > 0.0 else 0.0
                if p.conduit_compliance > 0.0:
                    mean = 0.0
                    for i in range(nodes + 1):
                        mean += share[i] * T[i]
                    gives[c] += dt / CONDUIT_LAG_S * (p.conduit_compliance * (mean - start_mean[c]) - gives[c])
    return out
