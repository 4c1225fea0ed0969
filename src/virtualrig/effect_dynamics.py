"""The same dynamics as `virtualrig.dynamics`, with every effect of `virtualrig.effects`.

An absent effect costs next to nothing: it stands behind a flag outside the loops over nodes. Friction that depends on
tension, time and position (`Twin.slow_friction`) is evaluated every `SLOW_S`. The twins' compiled laws are chained to
one function of each kind; effects with a state of their own stand in the loop below.
"""

from collections import namedtuple
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import brentq

from virtualrig.chain import initial_tension, stable_step
from virtualrig.config import Numerics, Rig
from virtualrig.effects import Effects, cached, chained, laws, numbers
from virtualrig.effects.presliding import BoucWenPresliding, DahlPresliding, IwanPresliding
from virtualrig.effects.pulley_friction import PulleyFriction
from virtualrig.effects.viscous_friction import REFERENCE_M_PER_S
from virtualrig.grid import Grid
from virtualrig.trajectory import Preparation, Trajectory, check_tensions

SLOW_S = 1e-4
# A conduit follows its cable's mean tension within this time: far below any motion, well above the time step.
CONDUIT_LAG_S = 1e-4
# Logarithmic velocity weakening: from a tenth of its speed to ten times it.
DECADE = 10.0
HYPERBOLIC, EXPONENTIAL, TOE = range(3)  # laws of strand settling
# Below this speed a drag with a power of the speed is linear in it.
SLOWEST_M_PER_S = 1e-5
# A tension (N), time (s), travel and position (m) at which every law of slow friction that is present has an effect.
ANY_STATE = (2.3, 0.7, 0.011, 0.0037)

if TYPE_CHECKING:

    class Physics(NamedTuple):
        """Of the twins' numbers, a type checker knows only that they are numbers."""

        bristle_length: float
        radius: float
        spring: float
        damping: float
        inertia: float

        def __getattr__(self, name: str) -> float: ...

else:
    Physics = namedtuple("Physics", ["bristle_length", "radius", "spring", "damping", "inertia", *numbers(Effects())])
slow_friction, friction_law = chained("slow_friction"), chained("friction")


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
    effects, physics = rig.effects, _physics(rig, numerics, preparation)
    lengths = _bristle_lengths(effects, numerics)
    half_bend = _half_bend(grid, effects, preparation.friction_coefficient)
    stiffness = _stiffness(rig, grid)
    mass = rig.cable.density_kg_per_m * grid.cell_length_m
    drag = effects.drag_N * _drag_shares(effects, grid)
    tension, bristle = _initial_state(physics, grid, preparation, half_bend, drag)
    share, time_constant_s = (
        np.array([getattr(branch, name) for branch in effects.relaxation]) for name in ("share", "time_constant_s")
    )
    elastic, relaxed = _relaxed(tension, share, time_constant_s, preparation.tensioned_before_s)

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
        elastic,
        relaxed,
        np.repeat(bristle[None], lengths.size, axis=0),
        lengths,
        stiffness,
        _elongation(physics, elastic, stiffness, _settling_length(effects, stiffness)),
        _settling_length(effects, stiffness),
        grid.segment_length_m / grid.cell_length_m.sum(),
        share,
        time_constant_s,
        numerics.wave_damping * np.sqrt(rig.cable.EA_N * rig.cable.density_kg_per_m),
        1 / mass,
        half_bend,
        drag,
        np.full(mass.size, numerics.drag_rate_per_s),
        effects.viscous_Ns_per_m2 * grid.cell_length_m / mass,
        theta_out,
    )
    theta_out, T1, T2, T3, T4, bearing = channels
    check_tensions(channels[1:5], numerics.tension_limit_N)
    drive_radius = physics.radius * _roundness(theta_in_rad, _drive_shape(physics))
    load_radius = physics.radius * _roundness(theta_out, _load_shape(physics))
    tau_in = drive_radius * (T1 - T3) + _bearing_torque(theta_in_rad, effects.drive_pulley.friction, T1 + T3)
    return Trajectory(time_s, theta_in_rad, theta_out, T1, T2, T3, T4, tau_in, load_radius * (T2 - T4) - bearing)


def _physics(rig: Rig, numerics: Numerics, preparation: Preparation) -> Physics:
    of_effects = numbers(rig.effects)
    of_effects["run_in_before"] = preparation.ran_in_before * of_effects["run_in_scale"]
    return Physics(
        bristle_length=_bristle_lengths(rig.effects, numerics)[0],
        radius=rig.pulley_radius_m,
        spring=rig.load.spring_stiffness_Nm_per_rad,
        damping=rig.load.damping_Nms_per_rad,
        inertia=rig.load.inertia_kg_m2 + rig.effects.load.inertia_kg_m2,
        **of_effects,
    )


def _bristle_lengths(effects: Effects, numerics: Numerics) -> NDArray:
    """Length over which each of a node's elements yields, m, shape (elements,); one element is Dahl's bristle."""
    match effects.presliding:
        case DahlPresliding(length_m=length) | BoucWenPresliding(length_m=length):
            return np.array([length])
        case IwanPresliding(shortest_m=shortest, longest_m=longest, elements=elements):
            return np.geomspace(shortest, longest, elements)
        case _:
            return np.array([numerics.bristle_length_m])


def _drag_shares(effects: Effects, grid: Grid) -> NDArray:
    """Share of the constant drag in each cell: by length, or all of it in one, shape (n,)."""
    ends = np.cumsum(grid.cell_length_m)
    if effects.drag_at_share is None:
        return grid.cell_length_m / ends[-1]
    shares = np.zeros(ends.size)
    shares[np.searchsorted(ends, effects.drag_at_share * ends[-1])] = 1.0
    return shares


def _half_bend(grid: Grid, effects: Effects, friction_coefficient: float) -> NDArray:
    """Half of mu phi of each cell, kinks included; shape (2, n).

    A kink is shared between the two nodes around its place, so that its mean place is exact on any grid.
    """
    bend = grid.cell_bend_rad.copy()
    ends = np.cumsum(grid.cell_length_m)
    centre = ends - grid.cell_length_m / 2
    for kink in effects.kinks:
        if kink.spread_m:
            starts = ends - grid.cell_length_m
            low, high = (kink.place_share * ends[-1] + side * kink.spread_m / 2 for side in (-1, 1))
            bend += kink.bend_rad * (np.minimum(ends, high) - np.maximum(starts, low)).clip(0.0) / kink.spread_m
            continue
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
    """Elongation of each segment that the tension scale of its settling makes, m, shape (2, n + 1).

    In the segments at the ends that of a knot is added.
    """
    settling = (effects.strand_settling.tension_scale_N if effects.strand_settling else 0.0) / stiffness
    ends = effects.termination_compliance
    settling[:, 0] += ends.drive_bedding_N * ends.drive_m_per_N
    settling[:, -1] += ends.load_bedding_N * ends.load_m_per_N
    return settling


def _initial_state(
    physics: Physics, grid: Grid, preparation: Preparation, half_bend: NDArray, drag: NDArray
) -> tuple[NDArray, NDArray]:
    """Tension of the segments (N, shape (2, n + 1)) and bristles (shape (2, n)) that hold it in balance."""
    share = preparation.bristles(drag.size)
    grip = np.tanh(half_bend)
    tension = np.stack([initial_tension(grid, *of, preparation.pretension_N) for of in zip(grip, share, strict=True)])
    both = tension[:, :-1] + tension[:, 1:]
    strength = np.vectorize(lambda y, T: slow_friction(physics, y, T, 0.0, 0.0, 0.0))(half_bend, both / 2)
    hold = np.tanh(strength) * (1 + physics.stribeck_rise) * both + drag
    wanted = np.divide(tension[:, :-1] - tension[:, 1:], hold, out=np.zeros_like(hold), where=hold > 0)
    friction = np.vectorize(lambda force, z: friction_law(physics, force, z, 0.0))
    bristle, before = wanted, np.full_like(wanted, np.nan)
    for _ in range(50):
        if np.array_equal(bristle, before):
            break
        force, before = hold * bristle, bristle
        bristle = wanted / np.divide(friction(force, bristle), force, out=np.ones_like(hold), where=force != 0)
    return tension, np.clip(bristle, -1, 1)


def _relaxed(
    tension: NDArray, share: NDArray, time_constant_s: NDArray, tensioned_before_s: float
) -> tuple[NDArray, NDArray]:
    """Elastic tension (N, shape (2, n + 1)) and its delayed parts (branches, 2, n + 1) of cables that were tensioned.

    The elongation has been constant since then, so a branch has followed the elastic tension by 1 - exp(-t / tau).
    """
    followed = -np.expm1(-tensioned_before_s / time_constant_s)
    elastic = tension / (1 - share @ followed)
    return elastic, followed[:, None, None] * elastic


def _elongation(physics: Physics, tension: NDArray, stiffness: NDArray, settling: NDArray) -> NDArray:
    """Elongation of each segment under its tension, m; all of one shape."""
    ideal = tension / stiffness
    if physics.settling_law == HYPERBOLIC:
        return np.sqrt((ideal + settling) ** 2 - settling**2)
    if physics.settling_law == TOE:
        return np.where(ideal < settling, 2 * np.sqrt(settling * ideal), ideal + settling)
    e = ideal + settling
    for _ in range(60):
        decay = np.exp(-e / settling)
        e = np.maximum(e - (e - settling * (1 - decay) - ideal) / np.maximum(1 - decay, 1e-9), 0.0)
    return e


def _load_angle(physics: Physics, tension_difference: float) -> float:
    """Angle at which the load's spring holds the difference of the cables' load-end tensions, rad."""
    if tension_difference == 0.0:
        return 0.0

    def excess(theta: float) -> float:
        pull = physics.radius * _roundness(theta, _load_shape(physics)) * tension_difference
        return float(_spring_torque(physics, theta) - pull)

    # No law is softer than the linear spring beyond its gap, and no pulley twice as large.
    furthest = physics.half_gap + 2 * physics.radius * abs(tension_difference) / physics.spring
    return float(brentq(excess, -furthest, furthest, xtol=1e-14))


def _stable_step(
    physics: Physics,
    stiffness: NDArray,
    mass: NDArray,
    half_bend: NDArray,
    drag: NDArray,
    lengths: NDArray,
    numerics: Numerics,
) -> float:
    """Time step (s) for the stiffest state: everything stuck at the highest tension allowed."""
    limit = numerics.tension_limit_N
    factor = 1 + physics.stribeck_rise
    for law in laws("slow_friction"):
        factor *= law.bound(physics, limit)
    hold = 2 * np.tanh(half_bend.max(axis=0) * factor) * limit + drag
    bristle = hold * np.mean(1 / lengths)
    for law in laws("friction"):
        bristle = law.bound(physics, limit) * bristle
    radius = physics.radius * (1 - physics.load_share - physics.load_second)
    # Stiffness at the largest torque, at which each law alone would balance it.
    torque = physics.radius * limit
    beyond = np.cbrt(torque / physics.cubic) if physics.cubic else 0.0
    torsion = (
        np.hypot(physics.spring, physics.exponential * torque)
        + physics.bumper
        + 3 * physics.cubic * beyond**2
        + physics.bearing_torque / physics.bearing_angle
        + physics.hysteresis_torque / physics.hysteresis_angle
    )
    spring, pulley_mass = torsion / radius**2 / 2, physics.inertia / (physics.radius * 2 - radius) ** 2 / 2
    return stable_step(stiffness.max(axis=0), mass, bristle, spring, pulley_mass, numerics)


@njit
def _drive_shape(p: Physics) -> tuple[float, float, float, float]:
    """Shares of the radius and phases of the drive pulley's first and second harmonic."""
    return p.drive_share, p.drive_phase, p.drive_second, p.drive_second_phase


@njit
def _load_shape(p: Physics) -> tuple[float, float, float, float]:
    return p.load_share, p.load_phase, p.load_second, p.load_second_phase


@njit
def _roundness(theta: Any, shape: tuple[float, float, float, float]) -> Any:
    """A pulley's radius at an angle (rad), over its mean."""
    share, phase, second, second_phase = shape
    return 1 + share * np.sin(theta + phase) + second * np.sin(2 * theta + second_phase)


@njit(cache=True)
def _bearing_course(theta: NDArray, angle: float) -> NDArray:
    z = np.zeros_like(theta)
    for j in range(1, theta.size):
        rotation = theta[j] - theta[j - 1]
        direction = 1.0 if rotation > 0 else -1.0
        z[j] = direction + (z[j - 1] - direction) * np.exp(-abs(rotation) / angle)
    return z


def _bearing_torque(theta: NDArray, friction: PulleyFriction | None, pull_N: NDArray) -> NDArray | float:
    """Friction torque (N m) of a bearing along the angles `theta` (rad) under the pull of both cables."""
    if friction is None:
        return 0.0
    load = pull_N / pull_N[0] if friction.law == "proportional" else 1.0
    return friction.torque_Nm * load * _bearing_course(theta, friction.presliding_rad)


@njit
def _winding(theta: float, shape: tuple[float, float, float, float]) -> float:
    """Cable travel over the mean radius, rad: the integral of the roundness."""
    share, phase, second, second_phase = shape
    return theta - share * np.cos(theta + phase) - 0.5 * second * np.cos(2 * theta + second_phase)


@njit
def _spring_torque(p: Physics, theta: float) -> float:
    """Torque of the load's spring at an angle, N m."""
    above, below = theta - p.half_gap, theta + p.half_gap
    if p.soft_flank > 0.0:
        above = 0.5 * (above + np.hypot(above, p.soft_flank))
        below = 0.5 * (below - np.hypot(below, p.soft_flank))
    beyond = max(above, 0.0) + min(below, 0.0)
    further = p.cubic * beyond * beyond * beyond
    if p.exponential > 0.0:
        further += p.spring * (np.sinh(p.exponential * beyond) / p.exponential - beyond)
    if p.bumper > 0.0:
        further += p.bumper * (max(beyond - p.bumper_at, 0.0) + min(beyond + p.bumper_at, 0.0))
    return p.spring * beyond + further


@njit(inline="always")
def _bristle(z: float, slide_over_length: float) -> float:
    """Dahl's bristle after a slide, implicit: within its bounds for any step (as in `virtualrig.dynamics`)."""
    return (z + slide_over_length) / (1 + abs(slide_over_length))


@njit(error_model="numpy")
def _set_strength(
    p: Physics, strength: NDArray, half_bend: NDArray, tension: NDArray, time: float, travel: float, drive: float
) -> None:
    """Friction of the nodes per sum of the tensions on both sides, without what changes fast."""
    for c in range(2):
        position = drive if c == 0 else -drive
        for i in range(strength.shape[1]):
            mean = 0.5 * (tension[c, i] + tension[c, i + 1])
            strength[c, i] = np.tanh(slow_friction(p, half_bend[c, i], mean, time, travel, position))


@njit(error_model="numpy")
def _set_hold(p: Physics, hold: NDArray, strength: NDArray, rested: NDArray, drag: NDArray, T: NDArray) -> None:
    """Friction (N) of one cable's nodes at fully deflected bristles."""
    n = hold.size
    for i in range(n):
        hold[i] = strength[i] * (T[i] + T[i + 1]) * (1.0 + p.stribeck_rise * rested[i]) + drag[i]


@njit(error_model="numpy")
def _deflect(p: Physics, z: NDArray, w: NDArray, dt: float) -> None:
    """Let one cable's bristles follow its nodes' speeds `w`: Dahl's, or those of Bouc and Wen."""
    slid = dt / p.bristle_length
    if p.bristle_exponent == 1.0:
        for i in range(z.size):
            z[i] = _bristle(z[i], w[i + 1] * slid)
        return
    for i in range(z.size):
        slide = w[i + 1] * slid
        held = abs(z[i]) ** p.bristle_exponent
        z[i] = min(max(z[i] + slide - abs(slide) * held * np.sign(z[i]), -1.0), 1.0)


@njit(error_model="numpy")
def _set_keep(p: Physics, keep: NDArray, drag_rate: NDArray, viscous_rate: NDArray, w: NDArray, dt: float) -> None:
    """Share of their speed that one cable's nodes keep in a step against a drag with a power of the speed."""
    for i in range(keep.size):
        speed = max(abs(w[i + 1]), SLOWEST_M_PER_S) / REFERENCE_M_PER_S
        keep[i] = 1.0 / (1.0 + dt * (drag_rate[i] + viscous_rate[i] * speed ** (p.viscous_power - 1.0)))


@njit(error_model="numpy")
def _renew(p: Physics, rested: NDArray, w: NDArray, dt: float) -> None:
    """Let the contacts of one cable's nodes adapt to their sliding speed `w`."""
    inverse, renewal = 1.0 / p.stribeck_speed, dt / p.stribeck_renewal
    for i in range(rested.size):
        speed = abs(w[i + 1])
        s = speed * inverse
        if p.stribeck_law == 1:
            target = 1.0 / ((1.0 + s) * (1.0 + s))
        elif p.stribeck_law == 2:
            target = max(1.0 - np.log1p(DECADE * s) / np.log1p(DECADE * DECADE), 0.0)
        else:
            if p.stribeck_exponent == 2.0:
                s = s * s
            elif p.stribeck_exponent != 1.0:
                s = s**p.stribeck_exponent
            target = np.exp(-s)
        share = speed * renewal
        rested[i] = (rested[i] + share * target) / (1.0 + share)


@njit(error_model="numpy")
def _set_elastic(
    p: Physics,
    elastic: NDArray,
    x: NDArray,
    stretch: NDArray,
    stiffness: NDArray,
    settling: NDArray,
    share: NDArray,
    shortening: float,
    settles: bool,
) -> None:
    """Tension (N) of one cable's segments without dampers; `x` are the slides, `shortening` is the conduit's."""
    n1 = elastic.size
    for i in range(n1):
        e = stretch[i] + (x[i] - x[i + 1]) - share[i] * shortening
        elastic[i] = stiffness[i] * max(e, 0.0)
    if settles:
        for i in range(n1):
            e, s = elastic[i] / stiffness[i], settling[i]
            if s == 0.0:
                continue
            if p.settling_law == EXPONENTIAL:
                elastic[i] = stiffness[i] * (e + s * np.expm1(-e / s))
            elif p.settling_law == TOE:
                elastic[i] = stiffness[i] * (e * e / (4 * s) if e < 2 * s else e - s)
            else:
                elastic[i] = stiffness[i] * (np.sqrt(e * e + s * s) - s)


@cached
def _run(
    p: Physics,
    theta_in: NDArray,
    omega_in: NDArray,
    sample_s: float,
    steps: int,
    start_tension: NDArray,
    start_elastic: NDArray,
    start_relaxed: NDArray,
    bristles: NDArray,
    lengths: NDArray,
    stiffness: NDArray,
    stretch: NDArray,
    settling: NDArray,
    share: NDArray,
    relaxing: NDArray,
    relaxing_time: NDArray,
    damper: float,
    inverse_mass: NDArray,
    half_bend: NDArray,
    drag: NDArray,
    drag_rate: NDArray,
    viscous_rate: NDArray,
    theta_out: float,
) -> NDArray:
    """Integrate; returns theta_out, T1, T2, T3, T4 and the load bearing's torque at the samples, shape (6, samples).

    Rows and columns are those of `virtualrig.dynamics._run`; `bristles` has shape (elements, 2, n).
    """
    samples = theta_in.size
    nodes = inverse_mass.size
    elements = lengths.size
    share_of_one = 1.0 / elements
    dt = sample_s / steps
    slow_steps = max(1, int(SLOW_S / dt))
    settles = settling.max() > 0.0
    is_slow = slow_friction(p, 1.0, *ANY_STATE) != 1.0
    keep = 1 / (1 + (drag_rate + viscous_rate) * dt)
    thins = p.viscous_power != 1.0 and viscous_rate.max() > 0.0
    u = np.zeros((2, nodes + 2))
    v = np.zeros((2, nodes + 2))
    tension = start_tension.copy()
    elastic = start_elastic.copy()
    base = np.empty(nodes + 1)
    relaxed = start_relaxed.copy()
    bristle = bristles[0].copy()
    strength = np.empty((2, nodes))
    hold = np.empty(nodes)
    rested = np.ones((2, nodes))
    start_mean = np.zeros(2)
    shortening = np.zeros(2)
    for c in range(2):
        start_mean[c] = (share * start_tension[c]).sum()
    theta_rest = theta_out
    omega_out = 0.0
    bearing = 0.0
    bearing_torque = p.bearing_torque
    start_pull = tension[0, nodes] + tension[1, nodes]
    hysteresis = 0.0
    travel = 0.0
    drive = 0.0
    since_slow = slow_steps
    drive_shape, load_shape = _drive_shape(p), _load_shape(p)
    drive_start = _winding(theta_in[0], drive_shape)
    load_start = _winding(theta_rest, load_shape)
    out = np.empty((6, samples))

    for sample in range(samples):
        out[0, sample] = theta_out
        out[1, sample] = tension[0, 0]
        out[2, sample] = tension[0, nodes]
        out[3, sample] = tension[1, 0]
        out[4, sample] = tension[1, nodes]
        out[5, sample] = bearing_torque * bearing
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
            drive = p.radius * (_winding(theta, drive_shape) - drive_start)
            drive_rate = p.radius * _roundness(theta, drive_shape) * omega
            travel += abs(drive_rate) * dt
            if since_slow >= slow_steps:
                _set_strength(p, strength, half_bend, tension, (sample + s) * sample_s, travel, drive)
                since_slow = 0
            if is_slow:
                since_slow += 1

            load_radius = p.radius * _roundness(theta_out, load_shape)
            torque = load_radius * (tension[0, nodes] - tension[1, nodes])
            torque -= _spring_torque(p, theta_out) + p.damping * omega_out
            if p.bearing_is_proportional:
                bearing_torque = p.bearing_torque * (tension[0, nodes] + tension[1, nodes]) / start_pull
            torque -= bearing_torque * bearing + p.hysteresis_torque * hysteresis
            omega_out += dt * torque / p.inertia
            theta_out += dt * omega_out
            bearing = _bristle(bearing, omega_out * dt / p.bearing_angle)
            hysteresis = _bristle(hysteresis, omega_out * dt / p.hysteresis_angle)
            load_radius = p.radius * _roundness(theta_out, load_shape)
            load_travel = p.radius * (_winding(theta_out, load_shape) - load_start)

            for c in range(2):
                side = 1.0 - 2.0 * c
                T = tension[c]
                x = u[c]
                w = v[c]
                z = bristle[c]
                _set_hold(p, hold, strength[c], rested[c], drag, T)
                if thins:
                    _set_keep(p, keep, drag_rate, viscous_rate, w, dt)
                for i in range(nodes):
                    friction = friction_law(p, hold[i] * z[i], z[i], w[i + 1])
                    w[i + 1] = keep[i] * (w[i + 1] + dt * inverse_mass[i] * (T[i] - T[i + 1] - friction))
                if p.stribeck_rise > 0.0:
                    _renew(p, rested[c], w, dt)
                if elements == 1:
                    _deflect(p, z, w, dt)
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
                x[nodes + 1] = side * load_travel
                w[nodes + 1] = side * load_radius * omega_out
                _set_elastic(p, elastic[c], x, stretch[c], stiffness[c], settling[c], share, shortening[c], settles)
                base[:] = elastic[c]
                for k in range(relaxing.size):
                    q = relaxed[k, c]
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
                    change = mean - start_mean[c]
                    if p.conduit_closes > 0.0:
                        change = p.conduit_closes * np.tanh(change / p.conduit_closes)
                    shortening[c] += dt / CONDUIT_LAG_S * (p.conduit_compliance * change - shortening[c])
    return out
