"""A cable as a chain of masses, springs and bristles: its friction, its rest and the time step that it bears."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvalsh_tridiagonal

from virtualrig.config import Numerics
from virtualrig.grid import Grid


def node_grip(grid: Grid, friction_coefficient: float) -> NDArray:
    """Friction at each node in full slip, per sum of the tensions on its two sides; shape (n,).

    With (T_l - T_r) = tanh(mu phi / 2) (T_l + T_r) the ratio T_l / T_r is exp(mu phi) of the cell, without a
    discretization error.
    """
    return np.tanh(friction_coefficient * grid.cell_bend_rad / 2)


def initial_tension(grid: Grid, grip: NDArray, bristle: NDArray, pretension_N: float) -> NDArray:
    """Tension of the segments (N, shape (n + 1,)) that the bristles hold in balance, `pretension_N` in the mean."""
    held = grip * bristle
    profile = np.cumprod(np.concatenate([[1.0], (1 - held) / (1 + held)]))
    length = grid.segment_length_m
    return pretension_N * profile * length.sum() / (profile @ length)


def stable_step(
    stiffness: NDArray, mass: NDArray, bristle: NDArray, spring: float, pulley_mass: float, numerics: Numerics
) -> float:
    """Time step (s) below which the chain is stable, times the Courant share.

    The highest frequency is that of one cable with every bristle stuck at the highest tension allowed, and half the
    load pulley: in the mode where both cables work against each other, each carries a half.

    Parameters
    ----------
    stiffness, mass, bristle : ndarray, shapes (n + 1,), (n,), (n,)
        Of the segments, N/m; of the nodes, kg; of the nodes' bristles, N/m.
    spring, pulley_mass : float
        Half of what hangs on the load end, as a spring (N/m) and a mass (kg) along the cable.
    numerics : Numerics
    """
    inertia = np.append(mass, pulley_mass)
    diagonal = np.append(stiffness[:-1] + stiffness[1:] + bristle, stiffness[-1] + spring) / inertia
    off_diagonal = -stiffness[1:] / np.sqrt(inertia[:-1] * inertia[1:])
    (highest,) = eigvalsh_tridiagonal(diagonal, off_diagonal, select="i", select_range=(mass.size, mass.size))
    damping = numerics.wave_damping
    return numerics.courant * 2 / np.sqrt(highest) * (np.hypot(1, damping) - damping)
