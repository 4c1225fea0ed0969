"""Explicit dynamics of both cables and the load pulley.

Each cable is a chain of masses and springs that carry no compression, with a bristle at every node; the drive end is
prescribed, the load ends hang on one pulley with its spring. Displacements count towards the drive end, so pulling at
the drive is positive in the cable that is pulled. The integration is semi-implicit Euler with a step that the chain's
own highest frequency sets.

This is the rig without effects, which most recordings are of. A rig with any runs in `virtualrig.effect_dynamics`,
several times slower.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from virtualrig import effect_dynamics
from virtualrig.chain import initial_tension, node_grip, stable_step
from virtualrig.config import Numerics, Rig
from virtualrig.grid import Grid
from virtualrig.trajectory import Preparation, Trajectory, check_tensions


def simulate(
    rig: Rig,
    grid: Grid,
    numerics: Numerics,
    preparation: Preparation,
    time_s: NDArray,
    theta_in_rad: NDArray,
    omega_in_rad_per_s: NDArray,
) -> Trajectory:
    """Run the rig from rest in balance through a drive motion.

    Parameters
    ----------
    rig, grid, numerics, preparation
        The rig, its conduits' grid, the numerical choices and the state the cables were left in.
    time_s : ndarray, shape (samples,)
        Evenly spaced sample times, s.
    theta_in_rad, omega_in_rad_per_s : ndarray, shape (samples,)
        Drive angle and rate at the sample times; between them the angle is the cubic through both.

    Returns
    -------
    Trajectory
        The state at the sample times.

    Raises
    ------
    SimulationError
        If a tension is not finite or exceeds `numerics.tension_limit_N`.
    """
    if rig.effects.are_in_the_motion:
        return effect_dynamics.simulate(rig, grid, numerics, preparation, time_s, theta_in_rad, omega_in_rad_per_s)
    radius = rig.pulley_radius_m
    grip = node_grip(grid, preparation.friction_coefficient)
    bristle = np.repeat(np.array(preparation.profile_share)[:, None], grip.size, axis=1)
    tension = np.stack([initial_tension(grid, grip, b, preparation.pretension_N) for b in bristle])
    stiffness = rig.cable.EA_N / grid.segment_length_m
    mass = rig.cable.density_kg_per_m * grid.cell_length_m

    sample_s = time_s[1] - time_s[0]
    load = rig.load
    bristles = 2 * grip * numerics.tension_limit_N / numerics.bristle_length_m
    spring, pulley_mass = load.spring_stiffness_Nm_per_rad / radius**2 / 2, load.inertia_kg_m2 / radius**2 / 2
    steps = int(np.ceil(sample_s / stable_step(stiffness, mass, bristles, spring, pulley_mass, numerics)))
    theta_out = radius * (tension[0, -1] - tension[1, -1]) / load.spring_stiffness_Nm_per_rad
    channels = _run(
        theta_in_rad,
        omega_in_rad_per_s,
        sample_s,
        steps,
        tension,
        bristle,
        stiffness,
        numerics.wave_damping * np.sqrt(rig.cable.EA_N * rig.cable.density_kg_per_m),
        1 / mass,
        grip,
        numerics.bristle_length_m,
        numerics.drag_rate_per_s,
        radius,
        theta_out,
        load.spring_stiffness_Nm_per_rad,
        load.damping_Nms_per_rad,
        load.inertia_kg_m2,
    )
    check_tensions(channels[1:], numerics.tension_limit_N)
    _, T1, T2, T3, T4 = channels
    return Trajectory(time_s, theta_in_rad, *channels, radius * (T1 - T3), radius * (T2 - T4))


@njit(cache=True, error_model="numpy")
def _run(
    theta_in,
    omega_in,
    sample_s,
    steps,
    start_tension,
    start_bristle,
    stiffness,
    damper,
    inverse_mass,
    grip,
    bristle_length,
    drag_rate,
    radius,
    theta_out,
    spring,
    load_damping,
    load_inertia,
):
    """Integrate; returns theta_out, T1, T2, T3, T4 at the samples, shape (5, samples).

    Row 0 of every state is cable A, row 1 cable B. Displacements are counted from the start, where the tensions are
    `start_tension`; the columns of `u` and `v` are the drive end, the nodes and the load end.
    """
    samples = theta_in.size
    nodes = inverse_mass.size
    dt = sample_s / steps
    keep = 1 / (1 + drag_rate * dt)
    u = np.zeros((2, nodes + 2))
    v = np.zeros((2, nodes + 2))
    tension = start_tension.copy()
    bristle = start_bristle.copy()
    theta_rest = theta_out
    omega_out = 0.0
    out = np.empty((5, samples))

    for sample in range(samples):
        out[0, sample] = theta_out
        out[1, sample] = tension[0, 0]
        out[2, sample] = tension[0, nodes]
        out[3, sample] = tension[1, 0]
        out[4, sample] = tension[1, nodes]
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
            drive = radius * (theta_in[sample] + s * (slope_0 + s * (c2 + s * c3)) - theta_in[0])
            drive_rate = radius * (slope_0 + s * (2 * c2 + s * 3 * c3)) / sample_s
            torque = radius * (tension[0, nodes] - tension[1, nodes]) - spring * theta_out - load_damping * omega_out
            omega_out += dt * torque / load_inertia
            theta_out += dt * omega_out

            for cable in range(2):
                side = 1.0 - 2.0 * cable
                T = tension[cable]
                x = u[cable]
                w = v[cable]
                z = bristle[cable]
                # Three short loops instead of one: only so does the compiler work on several nodes at a time.
                for i in range(nodes):
                    friction = grip[i] * (T[i] + T[i + 1]) * z[i]
                    w[i + 1] = keep * (w[i + 1] + dt * inverse_mass[i] * (T[i] - T[i + 1] - friction))
                # Dahl's bristle, dz/dt = v (1 - sgn(v) z / z0), implicit in z: it stays within its bounds for any
                # step, and is exact where the speed is small, at reversals, where alone it matters.
                for i in range(nodes):
                    stretch = w[i + 1] * dt / bristle_length
                    z[i] = (z[i] + stretch) / (1 + abs(stretch))
                for i in range(1, nodes + 1):
                    x[i] += dt * w[i]
                x[0] = side * drive
                w[0] = side * drive_rate
                x[nodes + 1] = side * radius * (theta_out - theta_rest)
                w[nodes + 1] = side * radius * omega_out
                for i in range(nodes + 1):
                    elastic = start_tension[cable, i] + stiffness[i] * (x[i] - x[i + 1])
                    pull = elastic + damper * (w[i] - w[i + 1])
                    # A slack segment neither pushes nor damps.
                    T[i] = max(0.0, pull) if elastic > 0.0 else 0.0
    return out
