"""The same dynamics as `virtualrig.dynamics`, with every effect of `virtualrig.effects`: what a run is made of.

The time loop is `virtualrig.effect_march`.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from virtualrig.chain import initial_tension, stable_step
from virtualrig.config import Numerics, Rig
from virtualrig.effect_march import (
    Physics,
    bearing_course,
    drive_shape,
    friction_law,
    load_shape,
    march,
    roundness,
    slow_friction,
    spring_torque,
)
from virtualrig.effects import Effects, laws, numbers, strand_settling
from virtualrig.effects.presliding import BoucWenPresliding, DahlPresliding, IwanPresliding
from virtualrig.effects.pulley_friction import PulleyFriction, under_pull
from virtualrig.effects.unlisted_ageing_contact import FIRST_S, OLDEST_S
from virtualrig.grid import Grid
from virtualrig.trajectory import Preparation, Trajectory, check_tensions


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
    channels = march(
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
    drive_radius = physics.radius * roundness(theta_in_rad, drive_shape(physics))
    load_radius = physics.radius * roundness(theta_out, load_shape(physics))
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
    """Share of the constant drag in each cell, shape (n,): by length, or that of one or two seals."""
    if effects.drag_at_share is None:
        return grid.cell_length_m / grid.cell_length_m.sum()
    near, far = (_at_place(share, grid) for share in (effects.drag_at_share, effects.drag_far_share))
    return (1.0 - effects.drag_far_part) * near + effects.drag_far_part * far


def _at_place(share: float, grid: Grid) -> NDArray:
    """Shares of what acts at one place, at a share of the length, in each cell; shape (n,).

    It is shared between the two nodes around its place, so that its mean place is exact on any grid.
    """
    ends = np.cumsum(grid.cell_length_m)
    centre = ends - grid.cell_length_m / 2
    at = np.interp(share * ends[-1], centre, np.arange(centre.size))
    before = min(int(at), max(centre.size - 2, 0))
    shares = np.zeros(centre.size)
    shares[before] += 1 - (at - before)
    shares[min(before + 1, centre.size - 1)] += at - before
    return shares


def _half_bend(grid: Grid, effects: Effects, friction_coefficient: float) -> NDArray:
    """Half of mu phi of each cell, kinks included; shape (2, n)."""
    bend = grid.cell_bend_rad.copy()
    ends = np.cumsum(grid.cell_length_m)
    for kink in effects.kinks:
        if kink.spread_m:
            starts = ends - grid.cell_length_m
            low, high = (kink.place_share * ends[-1] + side * kink.spread_m / 2 for side in (-1, 1))
            bend += kink.bend_rad * (np.minimum(ends, high) - np.maximum(starts, low)).clip(0.0) / kink.spread_m
            continue
        bend += kink.bend_rad * _at_place(kink.place_share, grid)
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
    of_cable = zip(grip, share, preparation.pretension_N, strict=True)
    tension = np.stack([initial_tension(grid, *of) for of in of_cable])
    both = tension[:, :-1] + tension[:, 1:]
    strength = np.vectorize(lambda y, T: slow_friction(physics, y, T, 0.0, 0.0, 0.0))(half_bend, both / 2)
    hold = (np.tanh(strength) * (1 + physics.stribeck_rise) * both + drag) * _oldest(physics, FIRST_S)
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
    beyond = np.maximum(tension - physics.yield_tension, 0.0) * physics.yield_share / (1 - physics.yield_share)
    ideal = (tension + beyond) / stiffness
    if physics.settling_law == strand_settling.HYPERBOLIC:
        return np.sqrt((ideal + settling) ** 2 - settling**2)
    if physics.settling_law == strand_settling.TOE:
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
        pull = physics.radius * roundness(theta, load_shape(physics)) * tension_difference
        return float(spring_torque(physics, theta) - pull)

    # No law but detents is softer than the linear spring beyond its gap, and no pulley twice as large.
    largest = 2 * (physics.radius * abs(tension_difference) + physics.detent)
    furthest = physics.half_gap + largest / physics.spring
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
    factor = (1 + physics.stribeck_rise) * _oldest(physics)
    for law in laws("slow_friction"):
        factor *= law.bound(physics, limit)
    hold = 2 * np.tanh(half_bend.max(axis=0) * factor) * limit + drag
    bristle = hold * np.mean(1 / lengths)
    for law in laws("friction"):
        bristle = law.bound(physics, limit) * bristle
    radius = physics.radius * (1 - physics.load_share - physics.load_second)
    in_bearing = under_pull(2 * limit, physics.bearing_share, physics.bearing_pull, physics.bearing_power)
    # Stiffness at the largest torque, at which each law alone would balance it.
    torque = physics.radius * limit
    beyond = np.cbrt(torque / physics.cubic) if physics.cubic else 0.0
    torsion = (
        np.hypot(physics.spring, physics.exponential * torque)
        + physics.bumper
        + physics.detent * physics.detent_number
        + 3 * physics.cubic * beyond**2
        + physics.bearing_torque * in_bearing / physics.bearing_angle
        + physics.hysteresis_torque / physics.hysteresis_angle
    )
    spring, pulley_mass = torsion / radius**2 / 2, physics.inertia / (physics.radius * 2 - radius) ** 2 / 2
    return stable_step(stiffness.max(axis=0), mass, bristle, spring, pulley_mass, numerics)


def _oldest(physics: Physics, age_s: float = OLDEST_S) -> float:
    """Factor of friction at an age of the contacts."""
    return float(1 + physics.ageing_rise * np.log10(1 + age_s / physics.ageing_shortest))


def _bearing_torque(theta: NDArray, friction: PulleyFriction | None, pull_N: NDArray) -> NDArray | float:
    """Friction torque (N m) of a bearing along the angles `theta` (rad) under the pull of both cables."""
    if friction is None:
        return 0.0
    factor = under_pull(pull_N, friction.share, friction.at_pull_N, friction.power)
    return friction.torque_Nm * factor * bearing_course(theta, friction.presliding_rad)
