"""The drive's motion that makes the load follow a wanted one: compiled loops over the samples, one for each solver.

The load's angle rises with the drive's, or rests where friction, slack or a gap lets the drive move alone. At each
sample the drive moves on, in the direction in which the load has to move, until the load has arrived.
"""

import numpy as np
from numpy.typing import NDArray

from ccmodel.inverse.exact import start_of
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Settings
from ccmodel.mechanisms.winding import Pulley, winding
from ccmodel.model.exact import state as exact_rows
from ccmodel.model.exact.cable import reverse
from ccmodel.model.exact.path import PathTables
from ccmodel.model.exact.run import settle
from ccmodel.model.exact.state import State, copy_state
from ccmodel.model.exact.step import step
from ccmodel.model.general import layout as rows
from ccmodel.model.general.equations import set_grip
from ccmodel.model.general.layout import Physics
from ccmodel.model.general.march import accept, solve_with_contacts
from ccmodel.model.general.newton import copy_means
from ccmodel.model.general.run import ELEMENTS, prepared
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission

# The load has arrived within this share of the motion's range.
ARRIVED = 1e-9
# Iterations of a sample: doublings of the drive's move, then halvings of its bracket.
ITERATIONS = 200
# A drive that has moved by so many ranges of the wanted motion without moving the load never will.
FURTHEST = 100.0
# The general solver takes a large move of the drive in parts of this share of the range.
LARGEST_PART = 0.01


@kernel
def _next_move(low: float, short: float, high: float, over: float, iteration: int) -> float:
    """A move between one after which the load is `short` (< 0) and one after which it is `over` its place."""
    if iteration % 3 == 2:
        return 0.5 * (low + high)
    move = low - short * (high - low) / (over - short)
    return move if low < move < high else 0.5 * (low + high)


@kernel
def _followed_exact(
    path: PathTables,
    state: State,
    saved: State,
    before: State,
    offset: float,
    stiffness: float,
    wanted: NDArray,
    span: float,
    drive: NDArray,
) -> int:
    """Write the drive rim's positions (m) for positions of the load's rim (m); returns the samples that were solved.

    `span` is the range of the wanted positions.
    """
    settle(path, state, saved, offset, stiffness)
    guess = span / wanted.size
    for i in range(wanted.size):
        here = state.value[exact_rows.PAIR, exact_rows.DRIVE]
        far = wanted[i] - state.value[exact_rows.PAIR, exact_rows.LOAD]
        drive[i] = here
        if abs(far) <= ARRIVED * span:
            continue
        direction = 1 if far > 0.0 else -1
        reverse(path, state, 0, direction)
        reverse(path, state, 1, -direction)
        copy_state(state, before)
        low, short, high, over = 0.0, -abs(far), np.inf, 0.0
        move = max(guess, ARRIVED * span)
        for iteration in range(ITERATIONS):
            copy_state(before, state)
            step(path, state, saved, direction, here + direction * move, offset, stiffness)
            error = direction * (state.value[exact_rows.PAIR, exact_rows.LOAD] - wanted[i])
            if abs(error) <= ARRIVED * span or high - low <= 1e-15 * span:
                break
            if error < 0.0:
                low, short = move, error
            else:
                high, over = move, error
            move = 2.0 * move if high == np.inf else _next_move(low, short, high, over, iteration)
            if move > FURTHEST * span:
                return i
        guess = move
        drive[i] = here + direction * move
    return wanted.size


def exact(
    transmission: Transmission, stiffness_Nm_per_rad: float, initial: InitialTension, wanted_rad: NDArray
) -> tuple[NDArray, int]:
    """Drive angles (rad) for load angles from the rest on, and the number of samples that were solved."""
    start = start_of(transmission, stiffness_Nm_per_rad, initial, wanted_rad.size)
    state = start.state
    saved, before = (
        state._replace(front=state.front.copy(), value=state.value.copy(), kind=state.kind.copy()) for _ in range(2)
    )
    drive = np.zeros(wanted_rad.size)
    wanted = wanted_rad * transmission.load_radius_m
    of_load = wanted, float(np.ptp(wanted))
    solved = _followed_exact(start.path, state, saved, before, start.offset, start.stiffness, *of_load, drive)
    return drive / transmission.drive_radius_m, solved


@kernel
def _angle_that_winds(wound: float, angle: float, pulley: Pulley) -> float:
    """Angle of a pulley that winds as much as a round one at the angle `wound`, from a guess; rad."""
    wanted = wound + winding(0.0, pulley)[0]
    is_round = pulley.eccentricity == 0.0 and pulley.knots_rad.size == 0
    for _ in range(1 if is_round else 50):
        now, factor, _ = winding(angle, pulley)
        angle += (wanted - now) / factor
    return angle


@kernel(error_model="numpy")
def _followed_general(
    ph: Physics,
    piece: NDArray,
    node: NDArray,
    slide: NDArray,
    mean: NDArray,
    load: NDArray,
    drive: Pulley,
    friction_factor: NDArray,
    steps: int,
    time_s: NDArray,
    wanted: NDArray,
    span: float,
    theta_in: NDArray,
) -> int:
    """Write the drive's angles (rad) for angles of the load (rad); returns the samples that were solved.

    `span` is the range of the wanted angles.
    """
    node[rows.RESTED] = 1.0
    set_grip(ph, node, slide, friction_factor[0], 0.0)
    fixed_grip = ph.stribeck_rise == 0.0 and len(friction_factor) == 1
    part = LARGEST_PART * span * ph.load_pulley.radius_m
    first, here = load[rows.ANGLE], 0.0
    guess = span * ph.load_pulley.radius_m / wanted.size
    for j in range(wanted.size):
        dt = time_s[j] - time_s[j - 1] if j > 0 else 0.0
        factor = friction_factor[min(j, len(friction_factor) - 1)]
        far = first + wanted[j] - load[rows.ANGLE]
        direction = 1.0 if far > 0.0 else -1.0
        arrived = abs(far) <= ARRIVED * span
        travelled = 0.0
        if arrived:
            # The drive holds; time passes.
            slide[rows.NOW] = 0.0
            copy_means(mean, rows.MEAN_NEXT, rows.MEAN)
            solved, rotation = solve_with_contacts(
                ph, piece, node, slide, mean, load, 0.0, 0.0, dt, ph.bristle, factor, fixed_grip
            )
            if not solved:
                return j
            accept(ph, piece, node, slide, mean, load, rotation, dt)
        while not arrived:
            # Where the drive has to move far, it does so in parts, each at the pace of a sample.
            low, high = 0.0, np.inf
            short, over = direction * (load[rows.ANGLE] - first - wanted[j]), 0.0
            move = min(max(guess, ARRIVED * span * ph.load_pulley.radius_m), part)
            solved, rotation, error = False, 0.0, 0.0
            for iteration in range(ITERATIONS):
                slide[rows.NOW] = 0.0
                copy_means(mean, rows.MEAN_NEXT, rows.MEAN)
                slide[rows.NOW, 0, 0], slide[rows.NOW, 1, 0] = direction * move, -direction * move
                solved, rotation = solve_with_contacts(
                    ph, piece, node, slide, mean, load, 0.0, 0.0, dt, ph.bristle, factor, fixed_grip
                )
                if not solved:
                    high = np.inf
                    part, move = 0.5 * part, 0.5 * move
                    if move < ARRIVED * span * ph.load_pulley.radius_m:
                        return j
                    continue
                error = direction * (load[rows.ANGLE] + rotation - first - wanted[j])
                if abs(error) <= ARRIVED * span or high - low <= 1e-12 * span * ph.load_pulley.radius_m:
                    arrived = True
                    break
                if error < 0.0:
                    low, short = move, error
                    if move >= part:
                        break
                else:
                    high, over = move, error
                move = min(2.0 * move, part) if high == np.inf else _next_move(low, short, high, over, iteration)
            if not solved:
                return j
            guess = move
            accept(ph, piece, node, slide, mean, load, rotation, dt)
            here += direction * move
            travelled += move
            if travelled > FURTHEST * span * ph.load_pulley.radius_m:
                return j
        theta_in[j] = _angle_that_winds(here / drive.radius_m, theta_in[max(j - 1, 0)], drive)
    return wanted.size


def general(
    transmission: Transmission,
    stiffness_Nm_per_rad: float,
    settings: Settings,
    initial: InitialTension,
    time_s: NDArray,
    wanted_rad: NDArray,
) -> tuple[NDArray, int]:
    """As `exact`, with the mechanisms' settings; friction that follows the drive's motion has that of stiff cables."""
    theta_in = np.zeros(wanted_rad.size)
    straight = wanted_rad * transmission.load_radius_m / transmission.drive_radius_m
    load = SpringLoad(stiffness_Nm_per_rad)
    at_rest = prepared(transmission, load, settings, time_s, straight, initial, ELEMENTS, 1, np.zeros(1))
    solved = _followed_general(*at_rest, time_s, wanted_rad, float(np.ptp(wanted_rad)), theta_in)
    return theta_in, solved
