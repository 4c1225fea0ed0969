"""The compiled march over the samples: both cables and the load pulley as one chain, implicit in every step.

Each cable is a row of nodes with friction between pieces of cable that carry no compression; row 0 is cable A, row 1
cable B. Displacements count towards the drive end. A step solves the equations of `ccmodel.model.general.equations` by
`ccmodel.model.general.newton`.
"""

import numpy as np
from numpy.typing import NDArray

from ccmodel.kernel import kernel, small_kernel
from ccmodel.mechanisms.drive_train import train_torque
from ccmodel.mechanisms.presliding import MOST_ELEMENTS, dahl
from ccmodel.mechanisms.pulley_friction import torque_under
from ccmodel.mechanisms.tables import keep_slip
from ccmodel.mechanisms.winding import Pulley, winding, winding_change
from ccmodel.model.general import layout as rows
from ccmodel.model.general.equations import relax, renew_contacts, set_grip
from ccmodel.model.general.layout import Physics
from ccmodel.model.general.newton import copy_slides, solve_step

# Coulomb friction has no bristle; this one is a ten-millionth of the stretch of any cable worth pulling.
COULOMB_BRISTLE_M = 1e-10
# With compliant conduits every node of a cable reverses at once. Newton's method converges only with a longer bristle,
# which costs 0.03 % of tension.
SOFT_CONDUIT_BRISTLE_M = 1e-7
# A sample without a solution is tried again with bristles up to this length.
LONGEST_BRISTLE_M = 1e-6
# Friction with a memory of rest follows from the slides that a step is expected to have. If the solved slides change it
# by more than this share, the step is solved again, at most so many times in all.
GRIP_TOLERANCE = 1e-4
GRIP_ITERATIONS = 6
SMALLEST_SUBSTEP = 1.0 / 4096
# A run ends after so many attempts at a step on average. Without this limit a single sample may take thousands of
# steps, and a search that strays to such a model never ends.
MOST_ATTEMPTS = 30
# The drive train's torque and the transmission's agree within this, N m.
TRAIN_TOLERANCE_NM = 1e-6
TRAIN_ITERATIONS = 30
# Shares of a sample and its time add up to the whole within this.
ROUNDING = 1e-9


@kernel(error_model="numpy", forceinline=True)
def expect(slide: NDArray, mean: NDArray, past: NDArray, pull: float, step_pull: float, is_whole: bool) -> float:
    """Write the slides and mean tensions that a step is expected to have; returns the load's rotation.

    The last steps are extrapolated, scaled to the drive's step while the drive continues in its direction. `pull` (m)
    is that of the whole sample, `step_pull` that of the step; `is_whole` says whether the step is as long as the last.
    """
    last_pull = past[rows.LAST_PULL]
    if is_whole and abs(2 * last_pull - past[rows.PULL_BEFORE] - step_pull) <= 0.05 * abs(step_pull):
        by_last, by_before = 2.0, -1.0
    else:
        ratio = step_pull / last_pull if last_pull * pull > 0.0 else 0.0
        by_last, by_before = min(ratio, 4.0), 0.0
    for c in range(2):
        for i in range(slide.shape[2]):
            slide[rows.NOW, c, i] = by_last * slide[rows.LAST, c, i] + by_before * slide[rows.BEFORE, c, i]
        change = by_last * mean[rows.MEAN_LAST, c] + by_before * mean[rows.MEAN_BEFORE, c]
        mean[rows.MEAN_NEXT, c] = mean[rows.MEAN, c] + change
    slide[rows.NOW, 0, 0], slide[rows.NOW, 1, 0] = step_pull, -step_pull
    return by_last * past[rows.LAST_ROTATION] + by_before * past[rows.ROTATION_BEFORE]


@small_kernel
def remember(slide: NDArray, past: NDArray, rotation: float, step_pull: float, step_dt: float) -> None:
    """Keep a solved step for `expect`."""
    copy_slides(slide, rows.BEFORE, rows.LAST)
    copy_slides(slide, rows.LAST, rows.NOW)
    past[rows.ROTATION_BEFORE], past[rows.LAST_ROTATION] = past[rows.LAST_ROTATION], rotation
    past[rows.PULL_BEFORE], past[rows.LAST_PULL] = past[rows.LAST_PULL], step_pull
    past[rows.LAST_DT] = step_dt


@kernel(error_model="numpy")
def solve_with_contacts(
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
    friction_factor: NDArray,
    fixed_grip: bool,
) -> tuple[bool, float]:
    """Solve a step with the contacts' memory of rest that its slides make; (converged, rotation of the load).

    The memory depends on the slides: on the expected ones first, then on the solved ones.
    """
    solved = False
    for iteration in range(GRIP_ITERATIONS):
        if not fixed_grip:
            change = set_grip(ph, node, slide, friction_factor, dt)
            if iteration > 0 and change < GRIP_TOLERANCE:
                break
        solved, rotation = solve_step(ph, piece, node, slide, mean, load, rotation, torque, dt, bristle)
        if not solved or ph.stribeck_rise == 0.0:
            break
    return solved, rotation


@kernel(error_model="numpy", forceinline=True)
def accept(
    ph: Physics, piece: NDArray, node: NDArray, slide: NDArray, mean: NDArray, load: NDArray, rotation: float, dt: float
) -> None:
    """Make a solved step the state."""
    n = node.shape[2]
    soft = ph.conduit_compliance > 0.0
    for c in range(2):
        d = slide[rows.NOW, c]
        for i in range(n + 1):
            piece[rows.STRETCH, c, i] += d[i] - d[i + 1]
        if soft:
            mean[rows.MEAN_BEFORE, c] = mean[rows.MEAN_LAST, c]
            mean[rows.MEAN_LAST, c] = mean[rows.MEAN_NEXT, c] - mean[rows.MEAN, c]
            gives = ph.conduit_compliance * mean[rows.MEAN_LAST, c]
            mean[rows.MEAN, c] = mean[rows.MEAN_NEXT, c]
            for i in range(n + 1):
                piece[rows.STRETCH, c, i] -= gives * piece[rows.SHARE, c, i]
        for i in range(n):
            node[rows.BRISTLE, c, i] = node[rows.BRISTLE_NEXT, c, i]
        if ph.presliding:
            for k in range(ph.elements):
                for i in range(n):
                    node[rows.ELEMENT + k, c, i] = node[rows.ELEMENT_NEXT + k, c, i]
            for i in range(n):
                node[rows.ELEMENT + MOST_ELEMENTS, c, i] = node[rows.ELEMENT_NEXT + MOST_ELEMENTS, c, i]
    if ph.has_relaxation:
        relax(ph, piece, dt)
    if ph.stribeck_rise > 0.0 and dt > 0.0:
        for c in range(2):
            renew_contacts(ph, node, slide, c, dt, rows.RESTED)
    if dt > 0.0:
        load[rows.ROTATION], load[rows.DT] = rotation, dt
        load[rows.OMEGA_BEFORE], load[rows.OMEGA] = load[rows.OMEGA], load[rows.OMEGA_NEXT]
        load[rows.ACCELERATION] = load[rows.ACCELERATION_NEXT]
    load[rows.ANGLE] += rotation
    load[rows.BEARING] = load[rows.BEARING_NEXT]
    if ph.load_elements > 0:
        keep_slip(load, ph.load_elements)
    if ph.bearing_elements > 0:
        keep_slip(load, ph.bearing_elements)


@kernel(error_model="numpy")
def _at_drive_angle(
    ph: Physics,
    piece: NDArray,
    node: NDArray,
    slide: NDArray,
    mean: NDArray,
    load: NDArray,
    torque: float,
    dt: float,
    bristle: float,
    friction_factor: NDArray,
    fixed_grip: bool,
    drive: Pulley,
    pulley: NDArray,
    rotation: float,
    angle: float,
    motor: float,
) -> tuple[bool, float, float]:
    """Solve a step with the drive pulley at `angle`.

    Returns whether it was solved, the load's rotation, and the torque on the drive pulley over that of the train (N m),
    which rises with the angle.
    """
    pull = drive.radius_m * winding_change(pulley[rows.DRIVE_ANGLE], angle - pulley[rows.DRIVE_ANGLE], drive)
    slide[rows.NOW, 0, 0], slide[rows.NOW, 1, 0] = pull, -pull
    solved, rotation = solve_with_contacts(
        ph, piece, node, slide, mean, load, rotation, torque, dt, bristle, friction_factor, fixed_grip
    )
    R = drive.radius_m * winding(angle, drive)[1]
    T1, T3 = max(piece[rows.TENSION, 0, 0], 0.0), max(piece[rows.TENSION, 1, 0], 0.0)
    cables = R * (T1 - T3)
    turned = angle - pulley[rows.DRIVE_ANGLE]
    friction = torque_under(T1 + T3, ph.drive_friction_Nm, ph.drive_friction_by_pull)
    bearing = friction * dahl(pulley[rows.DRIVE_BEARING], turned, ph.drive_presliding_rad)[0]
    return solved, rotation, cables + bearing - train_torque(motor - angle, ph.train_compliance, ph.train_half_gap)


@kernel(error_model="numpy")
def _solve_with_train(
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
    friction_factor: NDArray,
    fixed_grip: bool,
    drive: Pulley,
    pulley: NDArray,
    lowest: float,
    highest: float,
    motor: float,
) -> tuple[bool, float, float]:
    """Solve a step with the drive pulley where the train balances it, or at the end of its range nearest to that.

    Returns whether it was solved, the load's rotation and the pulley's angle.
    """
    step = ph, piece, node, slide, mean, load, torque, dt, bristle, friction_factor, fixed_grip, drive, pulley
    # The pulley usually stays at the end of its range at which it was.
    was_low = pulley[rows.DRIVE_ANGLE] - pulley[rows.DRIVE_MIDDLE] <= 0.0
    near, far = (lowest, highest) if was_low else (highest, lowest)
    solved, rotation, at_near = _at_drive_angle(*step, rotation, near, motor)
    if not solved or (at_near >= 0.0) == was_low:
        return solved, rotation, near
    solved, rotation, at_far = _at_drive_angle(*step, rotation, far, motor)
    if not solved or (at_far >= 0.0) != was_low:
        return solved, rotation, far
    angle = far
    # The false position, with the Illinois rule.
    for _ in range(TRAIN_ITERATIONS):
        angle = (near * at_far - far * at_near) / (at_far - at_near)
        solved, rotation, excess = _at_drive_angle(*step, rotation, angle, motor)
        if not solved or abs(excess) <= TRAIN_TOLERANCE_NM:
            break
        if (excess >= 0.0) == (at_far >= 0.0):
            at_near *= 0.5
        else:
            near, at_near = far, at_far
        far, at_far = angle, excess
    return solved, rotation, angle


@kernel(error_model="numpy", allocates=True)
def march(
    ph: Physics,
    piece: NDArray,
    node: NDArray,
    slide: NDArray,
    mean: NDArray,
    load: NDArray,
    time_s: NDArray,
    theta_in: NDArray,
    motor: NDArray,
    within_rad: float,
    drive: Pulley,
    friction_factor: NDArray,
    series: NDArray,
    steps: int,
    out: NDArray,
) -> int:
    """Step through the samples.

    Parameters
    ----------
    ph : Physics
    piece, node, slide, mean, load : ndarray
        Constants and the state before the first sample, in the rows of `ccmodel.model.general.layout`. The first
        sample is solved at the drive's first position, which balances a start that is out of balance.
    time_s, theta_in : ndarray, shape (m,)
        Times (s), and angle of the drive pulley (rad).
    motor : ndarray, shape (m,) or (1,)
        Angle of the motor at the drive pulley, rad; a single value where it was not measured.
    within_rad : float
        With a drive train, the drive pulley is where the train balances the transmission, but no further than this
        from `theta_in`: what its encoder leaves open.
    drive : Pulley
        The drive pulley.
    friction_factor : ndarray, shape (m, 2) or (1, 2)
        Factor of mu by cable. A single row holds throughout.
    series : ndarray, shape (m,) or (1,)
        Prescribed torque (N m, on top of the load's own law) or angle (rad) of the load. A single value holds
        throughout.
    steps : int
        Steps from one sample to the next; a step without a solution is halved.
    out : ndarray, shape (8, m)
        Filled with T1, T2, T3, T4 (N), load angle (rad), the load's torque and that of the cables on the drive
        pulley (N m), and the drive pulley's angle (rad).

    Returns
    -------
    int
        Samples that were solved; fewer than there are after a step without a solution, or `MOST_ATTEMPTS` steps.
    """
    m, n = time_s.size, node.shape[2]
    attempts, most_attempts = 0, MOST_ATTEMPTS * m * steps
    past = np.zeros(rows.PAST_ROWS)
    node[rows.RESTED] = 1.0
    set_grip(ph, node, slide, friction_factor[0], 0.0)
    fixed_grip = ph.stribeck_rise == 0.0 and len(friction_factor) == 1
    prescribed = ph.kind == rows.PRESCRIBED_ANGLE
    wound_before = winding(theta_in[0], drive)[0]
    has_train = ph.train_compliance > 0.0 and motor.size > 1
    pulley = np.array([theta_in[0], theta_in[0], 0.0])
    angle, middle = theta_in[0], theta_in[0]
    for j in range(m):
        wound, radius_factor, _ = winding(theta_in[j], drive)
        pull, wound_before = drive.radius_m * (wound - wound_before), wound
        prescribed_value = series[min(j, series.size - 1)]
        rise = prescribed_value - series[min(j - 1, series.size - 1)] if j > 0 else 0.0
        dt = time_s[j] - time_s[j - 1] if j > 0 else 0.0
        factor = friction_factor[min(j, len(friction_factor) - 1)]
        whole = 1.0 / steps if j > 0 else 1.0
        done, part, bristle = 0.0, whole, ph.bristle
        while done < 1.0 - ROUNDING:
            part = min(part, 1.0 - done)
            step_pull, step_dt = part * pull, part * dt
            is_whole = abs(part - whole) <= ROUNDING and abs(past[rows.LAST_DT] - step_dt) <= ROUNDING * dt
            rotation = expect(slide, mean, past, pull, step_pull, is_whole)
            value = prescribed_value - (1.0 - done - part) * rise
            if prescribed:
                rotation = value - load[rows.ANGLE]
            torque = 0.0 if prescribed else value
            attempts += 1
            if attempts > most_attempts:
                return j
            if has_train:
                left = 1.0 - done - part
                middle = theta_in[j] - left * (theta_in[j] - theta_in[max(j - 1, 0)])
                at_motor = motor[j] - left * (motor[j] - motor[max(j - 1, 0)])
                solved, rotation, angle = _solve_with_train(
                    ph, piece, node, slide, mean, load, rotation, torque, step_dt, bristle, factor, fixed_grip,
                    drive, pulley, middle - within_rad, middle + within_rad, at_motor,
                )  # fmt: skip
            else:
                solved, rotation = solve_with_contacts(
                    ph, piece, node, slide, mean, load, rotation, torque, step_dt, bristle, factor, fixed_grip
                )
            if not solved:
                part *= 0.5
                past[rows.LAST_PULL] = 0.0
                if part < SMALLEST_SUBSTEP:
                    if bristle >= LONGEST_BRISTLE_M:
                        return j
                    bristle *= 10.0
                    part = whole
                continue
            remember(slide, past, rotation, step_pull, step_dt)
            accept(ph, piece, node, slide, mean, load, rotation, step_dt)
            if has_train:
                turned = angle - pulley[rows.DRIVE_ANGLE]
                pulley[rows.DRIVE_BEARING] = dahl(pulley[rows.DRIVE_BEARING], turned, ph.drive_presliding_rad)[0]
                pulley[rows.DRIVE_ANGLE], pulley[rows.DRIVE_MIDDLE] = angle, middle
            done += part
            part = min(2.0 * part, whole)
        out[0, j], out[1, j] = max(piece[rows.TENSION, 0, 0], 0.0), max(piece[rows.TENSION, 0, n], 0.0)
        out[2, j], out[3, j] = max(piece[rows.TENSION, 1, 0], 0.0), max(piece[rows.TENSION, 1, n], 0.0)
        out[4, j] = load[rows.ANGLE]
        if prescribed:
            R = ph.load_pulley.radius_m * winding(load[rows.ANGLE], ph.load_pulley)[1]
            out[5, j] = R * (out[1, j] - out[3, j]) - load[rows.IN_BEARING]
        else:
            out[5, j] = load[rows.TORQUE]
        out[7, j] = theta_in[j]
        if has_train:
            out[7, j] = angle
            radius_factor = winding(angle, drive)[1]
        out[6, j] = drive.radius_m * radius_factor * (out[0, j] - out[2, j])
    return m
