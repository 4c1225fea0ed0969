"""The chain at rest before the drive moves: stretch and friction under the initial tension, and the load's angle."""

from collections.abc import Sequence
from math import log

import numpy as np
from numpy.typing import NDArray

from ccmodel.failure import ModelError
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Settings
from ccmodel.mechanisms.learned import end_spring
from ccmodel.mechanisms.load_dependent_friction import FLOOR_N, REFERENCE_N
from ccmodel.mechanisms.relaxation import followed
from ccmodel.mechanisms.strand_settling import stretch_at
from ccmodel.mechanisms.tables import Table, stretched
from ccmodel.mechanisms.winding import winding
from ccmodel.model.general import layout as rows
from ccmodel.model.initial import Held
from ccmodel.model.load import AngleLoad, FixedLoad, Load, SpringLoad, TorqueLoad

# Slack of a cable B that is not there: longer than any travel of the drive or the load, m.
ABSENT_SLACK_M = 1e3
# Friction mu phi of a conduit that all but does not rub: a drag holds the tension in a straight line there.
SMALLEST_BOUND = 1e-6
# Steps of the integral of friction along the conduit at rest.
REST_STEPS = 16


def initial_state(
    physics: rows.Physics,
    piece: NDArray,
    node: NDArray,
    settings: Settings,
    profiles: Sequence[NDArray],
    friction_factor: NDArray,
) -> NDArray:
    """Write the state under the initial tension into `piece` and `node`; returns the tension of each piece (N)."""
    T = np.stack(profiles)
    if end_spring(settings, "drive") is not None:
        T = np.concatenate([T[:, :1], T], axis=1)
    if end_spring(settings, "load") is not None:
        T = np.concatenate([T, T[:, -1:]], axis=1)
    # The rest shows the tension that relaxation has left so far.
    r = piece[rows.RELAXING]
    branches = followed(physics.relaxing_share, physics.relaxing_times_s, physics.relaxed_share)
    elastic = T / (1 - r * branches.mean())
    straight = elastic.copy()
    if physics.has_spring_table:
        _straighten(piece, straight)
    stretch = straight / piece[rows.STIFFNESS]
    settles = piece[rows.LOST] > 0
    if settles.any():
        stretch[settles] = stretch_at(straight[settles], piece[rows.LOST][settles], piece[rows.STIFFNESS][settles])
    piece[rows.STRETCH], piece[rows.ELASTIC] = stretch, elastic
    piece[rows.BRANCH : rows.BRANCH + branches.size] = branches[:, None, None] * elastic
    both = T[:, :-1] + T[:, 1:]
    factor = friction_factor[:, None] * (1 + physics.stribeck_rise)
    if has_friction_by_tension(settings):
        factor = factor * friction_at_tension(settings, both / 2)
    hold = np.tanh(node[rows.HALF_BEND] * factor) * both + node[rows.DRAG]
    if physics.drag_table:
        hold = (hold + node[physics.drag_table + 1 + settings.conduit_drag.knots.size]).clip(0.0)
    share = np.divide(T[:, :-1] - T[:, 1:], hold, out=np.zeros_like(both), where=hold > 0)
    # Where friction depends on the direction of sliding, the share is xi + b xi^2.
    xi = 2 * share / (1 + np.sqrt((1 + 4 * physics.direction_bias * share).clip(0.0)))
    node[rows.BRISTLE] = np.clip(xi, -1, 1)
    node[rows.ELEMENT : rows.ELEMENT_NEXT] = node[rows.BRISTLE]
    return T


def held_at_rest(
    settings: Settings,
    coulomb: float,
    length_m: float,
    friction_factor: NDArray,
    ends_N: Sequence[tuple[float, float]],
) -> tuple[Held, Held]:
    """What friction and a drag hold at rest, by cable; of friction by tension, with the drag in the bound.

    Parameters
    ----------
    settings : Settings
    coulomb : float
        mu phi with all bend that holds at rest.
    length_m : float
    friction_factor : ndarray, shape (2,)
        Factor of mu at the first sample, by cable.
    ends_N : sequence of (float, float)
        Tension of each cable at the drive and at the load, N.
    """
    along = np.linspace(0.0, 1.0, 33)
    coulomb *= 1.0 + settings.stribeck_rise
    if settings.friction_by_position is not None:
        coulomb *= float(settings.friction_by_position.at(along).mean())
    drag_N = settings.drag_N
    if settings.added_drag is not None:
        drag_N += float(settings.added_drag.at(along).mean()) * length_m
    if settings.conduit_drag is not None:
        drag_N += float(settings.conduit_drag.at(np.zeros(1))[0]) * length_m
    drag_N = max(drag_N, 0.0)

    def law(tension: float) -> float:
        return float(friction_at_tension(settings, np.array(tension)))

    found = []
    for ratio, factor, ends in zip(friction_ratios(settings), friction_factor, ends_N, strict=True):
        lowest, held = min(ends), max(coulomb * float(ratio * factor), 0.0)
        if lowest <= 0.0 or not has_friction_by_tension(settings):
            # The drag is spread as the bend is.
            found.append(Held(held, drag_N / max(held, SMALLEST_BOUND)))
            continue
        # From the end with less tension to the other: a drag adds the same force at every place, friction a share.
        tension = lowest
        for _ in range(REST_STEPS):
            middle = tension + (held * law(tension) * tension + drag_N) / (2 * REST_STEPS)
            tension += (held * law(middle) * middle + drag_N) / REST_STEPS
        found.append(Held(log(tension / lowest)))
    return found[0], found[1]


def has_drag(settings: Settings) -> bool:
    """Whether a drag acts beside friction, at rest too."""
    return settings.drag_N != 0 or settings.added_drag is not None or settings.conduit_drag is not None


def has_friction_by_tension(settings: Settings) -> bool:
    """Whether friction is not in proportion to tension."""
    return settings.tension_exponent != 0 or settings.friction_by_tension is not None


def friction_at_tension(settings: Settings, tension_N: NDArray) -> NDArray:
    """Factor of mu at tensions, of their shape."""
    factor = (np.hypot(tension_N, FLOOR_N) / REFERENCE_N) ** settings.tension_exponent
    by_tension = settings.friction_by_tension
    return factor if by_tension is None else factor * by_tension.at(tension_N)


def friction_ratios(settings: Settings) -> NDArray:
    """Friction of cables A and B over that of the transmission, shape (2,)."""
    of_cable = np.array([-1.0, 1.0])
    return np.array([1.0, settings.friction_ratio_B]) * (1.0 + settings.friction_by_cable * of_cable)


@kernel
def _straighten(piece: NDArray, tension: NDArray) -> None:
    """Replace, in place, the tension of each piece that has a table by the one that a straight spring would have."""
    for c in range(2):
        for i in range(piece.shape[2]):
            if piece[rows.SPRING_TABLE, c, i] > 0.0:
                tension[c, i] = stretched(piece, rows.SPRING_TABLE, c, i, tension[c, i])


def remove_cable_B(piece: NDArray) -> None:
    """Make cable B so slack, in place, that it never pulls; the force in all its pieces is the same."""
    compliance = 1 / piece[rows.STIFFNESS, 1]
    piece[rows.STRETCH, 1] = -ABSENT_SLACK_M * compliance / compliance.sum()


def load_angle(physics: rows.Physics, T: NDArray, load: Load, series: NDArray, by_angle: Table | None) -> float:
    """Angle at which the load holds the initial tensions, rad; 0 for a load without a neutral position.

    `by_angle` is a law of the load's angle beside its spring.
    """
    if isinstance(load, AngleLoad):
        return float(series[0])
    K, K3 = physics.stiffness_load, physics.cubic_stiffness
    if isinstance(load, TorqueLoad | FixedLoad) or (K == 0 and K3 == 0):
        return 0.0
    force = T[0, -1] - T[1, -1]

    def torque_at(theta: float) -> float:
        of_cables = physics.load_pulley.radius_m * winding(theta, physics.load_pulley)[1] * force
        return of_cables if by_angle is None else of_cables - float(by_angle.at(np.array(theta)))

    def held_at(torque: float) -> float:
        return _angle_at_rest(K, K3, physics.half_gap, torque, load)

    theta = 0.0
    for _ in range(50):
        before, theta = theta, held_at(torque_at(theta))
        if theta == before:
            return float(theta)
    if by_angle is None:
        return float(theta)
    # Few models need it, and it takes long to import.
    from scipy.optimize import brentq

    # A law that is steeper than the spring: at one of the ends its torque is too small, at the other too large.
    most = 2 * physics.load_pulley.radius_m * abs(force) + float(np.abs(by_angle.values).max())
    return float(brentq(lambda theta: theta - held_at(torque_at(theta)), held_at(-most), held_at(most)))


def _deflection(K: float, K3: float, torque: float) -> float:
    """Solve K z + K3 z^3 = torque for the angle z (rad), by Newton's method from the linear spring's angle.

    Raises
    ------
    ModelError
        If the spring softens and holds no such torque.
    """
    if K == 0:
        return float(np.cbrt(torque / K3))
    z = torque / K
    for _ in range(50 if K3 else 0):
        before, z = z, z - (K * z + K3 * z**3 - torque) / (K + 3 * K3 * z * z)
        if z == before:
            break
    if K3 and not abs(K * z + K3 * z**3 - torque) <= 1e-6 * abs(torque) + 1e-12:
        raise ModelError(f"the load's spring with K3 = {K3:g} holds no torque of {1e3 * torque:.3g} mN m")
    return float(z)


def _angle_at_rest(K: float, K3: float, half_gap: float, torque: float, load: SpringLoad) -> float:
    """Angle (rad) of a load at rest under a torque of the cables.

    A load that is held against its spring touches one side of its gap. A load that is all but free may stand anywhere
    in it: where the torque is below what is known of it, at `rest_gap_position`. Between 0.75 and 1.25 times
    `rest_known_to_Nm` the one case passes into the other.
    """
    known_to, position = load.rest_known_to_Nm, load.rest_gap_position
    held = float(np.clip(2 * abs(torque) / known_to - 1.5, 0.0, 1.0)) if known_to else float(torque != 0)
    side = held * float(np.sign(torque)) + (1 - held) * min(max(position, -1.0), 1.0)
    return _deflection(K, K3, torque) + half_gap * side
