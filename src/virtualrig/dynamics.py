"""Explicit dynamics of both cables and the load pulley.

Each cable is a chain of masses and tension-only springs with a bristle at every node. The motion of the drive ends is
prescribed; the load ends act on one pulley with its spring. Displacements are positive towards the drive end, so that a
cable that is pulled at the drive moves in the positive direction. The integration is semi-implicit Euler with a step
below the limit of the chain's highest eigenfrequency.

This module simulates rigs without further effects. `virtualrig.effect_dynamics` simulates the others and is several
times slower.
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
    drive: tuple[NDArray, NDArray],
) -> Trajectory:
    """Simulate a drive motion, from rest in equilibrium.

    Parameters
    ----------
    rig, grid, numerics, preparation
        The rig, the grid of its conduits, the numerical settings and the initial state.
    time_s : ndarray, shape (samples,)
        Evenly spaced sample times, s.
    drive : tuple of ndarray, each of shape (samples,)
        Drive angle (rad) and rate (rad/s) at the sample times. Between them the angle is the cubic through both.

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
        return effect_dynamics.simulate(rig, grid, numerics, preparation, time_s, drive)
    theta_out, T1, T2, T3, T4 = _channels(rig, grid, numerics, preparation, time_s, drive)
    check_tensions(np.array([T1, T2, T3, T4]), numerics.tension_limit_N)
    radius = rig.pulley_radius_m
    return Trajectory(time_s, drive[0], theta_out, T1, T2, T3, T4, radius * (T1 - T3), radius * (T2 - T4))


def _channels(
    rig: Rig,
    grid: Grid,
    numerics: Numerics,
    preparation: Preparation,
    time_s: NDArray,
    drive: tuple[NDArray, NDArray],
) -> NDArray:
    """Arguments of the compiled march, and its result: theta_out, T1, T2, T3, T4; shape (5, samples)."""
    radius, load, cable = rig.pulley_radius_m, rig.load, rig.cable
    grip = node_grip(grid, preparation.friction_coefficient)
    bristle = preparation.bristles(grip.size)
    of_cable = zip(bristle, preparation.pretension_N, strict=True)
    tension = np.stack([initial_tension(grid, grip, *of) for of in of_cable])
    stiffness, mass = cable.EA_N / grid.segment_length_m, cable.density_kg_per_m * grid.cell_length_m
    bristles = 2 * grip * numerics.tension_limit_N / numerics.bristle_length_m
    spring, pulley_mass = load.spring_stiffness_Nm_per_rad / radius**2 / 2, load.inertia_kg_m2 / radius**2 / 2
    sample_s = time_s[1] - time_s[0]
    return _march(
        *drive,
        sample_s,
        int(np.ceil(sample_s / stable_step(stiffness, mass, bristles, spring, pulley_mass, numerics))),
        tension,
        bristle,
        stiffness,
        numerics.wave_damping * np.sqrt(cable.EA_N * cable.density_kg_per_m),
        1 / mass,
        grip,
        numerics.bristle_length_m,
        numerics.drag_rate_per_s,
        radius,
        radius * (tension[0, -1] - tension[1, -1]) / load.spring_stiffness_Nm_per_rad,
        load.spring_stiffness_Nm_per_rad,
        load.damping_Nms_per_rad,
        load.inertia_kg_m2,
    )


@njit(cache=True, error_model="numpy")
def _march(
    theta_in: NDArray,
    omega_in: NDArray,
    sample_s: float,
    steps: int,
    start_tension: NDArray,
    start_bristle: NDArray,
    stiffness: NDArray,
    damper: float,
    inverse_mass: NDArray,
    grip: NDArray,
    bristle_length: float,
    drag_rate: float,
    radius: float,
    theta_out: float,
    spring: float,
    load_damping: float,
    load_inertia: float,
) -> NDArray:
    """Integrate over time; returns theta_out, T1, T2, T3, T4 at the samples, shape (5, samples).

    Row 0 of every state is cable A, row 1 cable B. Displacements are zero at the start, where the tensions are
    `start_tension`. The columns of `u` and `v` are the drive end, the nodes and the load end.
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
        # Between two samples the drive angle is the cubic through the angles and rates at both.
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
                # The compiler vectorises three short loops, but not one loop over all.
                for i in range(nodes):
                    friction = grip[i] * (T[i] + T[i + 1]) * z[i]
                    w[i + 1] = keep * (w[i + 1] + dt * inverse_mass[i] * (T[i] - T[i + 1] - friction))
                # Dahl's bristle, dz/dt = v (1 - sgn(v) z / z0), implicit in z: it stays within its bounds for any
                # step. Its error vanishes at small speeds, and the bristle only matters near reversals.
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
