"""A cable as a chain of masses, springs and bristles: friction, initial tension and stable time step."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvalsh_tridiagonal

from virtualrig.config import Numerics
from virtualrig.grid import Grid


def node_grip(grid: Grid, friction_coefficient: float) -> NDArray:
    """Friction force of each node in full slip over the sum of the tensions on its two sides; shape (n,).

    From (T_l - T_r) = tanh(mu phi / 2) (T_l + T_r) the ratio T_l / T_r is exp(mu phi) of the cell: the capstan equation
    without discretisation error.
    """
    return np.tanh(friction_coefficient * grid.cell_bend_rad / 2)


def initial_tension(grid: Grid, grip: NDArray, bristle: NDArray, pretension_N: float) -> NDArray:
    """Tension of the segments in equilibrium with the bristles, with the mean `pretension_N`; N, shape (n + 1,)."""
    friction = grip * bristle
    profile = np.cumprod(np.concatenate([[1.0], (1 - friction) / (1 + friction)]))
    length = grid.segment_length_m
    return pretension_N * profile * length.sum() / (profile @ length)


def stable_step(
    stiffness: NDArray, mass: NDArray, bristle: NDArray, spring: float, pulley_mass: float, numerics: Numerics
) -> float:
    """Largest stable time step of the chain times the Courant number, s.

    The highest eigenfrequency is that of one cable with every bristle stuck at the tension limit and half the load
    pulley: in the mode in which both cables oppose each other, each carries one half.

    Parameters
    ----------
    stiffness, mass, bristle : ndarray, shapes (n + 1,), (n,), (n,)
        Stiffness of the segments, N/m; mass of the nodes, kg; stiffness of the nodes' bristles, N/m.
    spring, pulley_mass : float
        Half of the load spring (N/m) and of the pulley's inertia (kg), both along the cable.
    numerics : Numerics
    """
    inertia = np.append(mass, pulley_mass)
    diagonal = np.append(stiffness[:-1] + stiffness[1:] + bristle, stiffness[-1] + spring) / inertia
    off_diagonal = -stiffness[1:] / np.sqrt(inertia[:-1] * inertia[1:])
    (highest,) = eigvalsh_tridiagonal(diagonal, off_diagonal, select="i", select_range=(mass.size, mass.size))
    damping = numerics.wave_damping
    return numerics.courant * 2 / np.sqrt(highest) * (np.hypot(1, damping) - damping)
