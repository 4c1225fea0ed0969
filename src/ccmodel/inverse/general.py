"""The load from the drive side with the general solver: a compiled march over the samples.

As `ccmodel.model.general.march`, with the misfit of the load's law as a further unknown of each sample.
"""

import numpy as np
from numpy.typing import NDArray

from ccmodel.failure import ModelError
from ccmodel.inverse.update import (
    BY_MISFIT,
    EXPECTED,
    GAIN,
    GROWTH,
    MISFIT,
    TRACE_ROWS,
    Considered,
    Drive,
    Prior,
    Run,
    gain_of,
    updated_variance,
)
from ccmodel.kernel import kernel
from ccmodel.mechanisms.contract import Settings
from ccmodel.mechanisms.pulley_friction import bearing, torque_under
from ccmodel.mechanisms.winding import Pulley, winding
from ccmodel.model.general import layout as rows
from ccmodel.model.general.equations import imbalance, set_grip, set_memory
from ccmodel.model.general.layout import Physics
from ccmodel.model.general.march import (
    LONGEST_BRISTLE_M,
    MOST_ATTEMPTS,
    ROUNDING,
    SMALLEST_SUBSTEP,
    accept,
    expect,
    remember,
    solve_with_contacts,
)
from ccmodel.model.general.newton import copy_means, copy_slides, solve, solve_with_conduits
from ccmodel.model.general.run import ELEMENTS, prepared
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad, TorqueLoad, one_row
from ccmodel.model.transmission import Transmission

# A torque that changes by less than this share of the load's is hidden by friction: what the model's derivative says
# there is less than its error.
HIDDEN = 0.1
ITERATIONS = 4
# A misfit that changes the torque by less than this share of its noise, or of 1 N m, is found.
FOUND, SMALLEST_Nm = 0.01, 1e-10
# Rows beyond those of the layout, for the solution at the misfit before the update.
KEPT_SLIDE, KEPT_MEAN = rows.SLIDE_ROWS, rows.MEAN_ROWS


@kernel(error_model="numpy")
def _response(
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
) -> float:
    """Derivative of T1 - T3 by the load's torque at a solved step, N per N m."""
    follows = set_memory(ph, piece, dt) if ph.has_relaxation else 0.0
    _, _, _, slope, R = imbalance(ph, piece, node, slide, mean, load, rotation, torque, dt, bristle, follows)
    # What is out of balance at the nodes is rounding beside 1 N m at the load.
    if ph.conduit_compliance > 0.0:
        solve_with_conduits(ph, piece, node, slide, mean, -1.0, slope, R, True)
    else:
        solve(piece, node, slide, -1.0, slope, R, True)
        mean[rows.MEAN_STEP] = 0.0
    tension = 0.0
    for c in range(2):
        gives = ph.conduit_compliance * piece[rows.SHARE, c, 0] * mean[rows.MEAN_STEP, c]
        tension -= (1.0 - 2.0 * c) * piece[rows.TANGENT, c, 0] * (slide[rows.STEP, c, 1] + gives)
    return tension


@kernel(error_model="numpy")
def _in_bearing(ph: Physics, piece: NDArray, of_sliding: float) -> float:
    """Friction torque of the drive pulley's bearing (N m) at a share of that of sliding."""
    pull = max(piece[rows.TENSION, 0, 0], 0.0) + max(piece[rows.TENSION, 1, 0], 0.0)
    return torque_under(pull, ph.drive_friction_Nm, ph.drive_friction_by_pull) * of_sliding


@kernel(error_model="numpy", allocates=True)
def filtered(
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
    theta_in: NDArray,
    measured: NDArray,
    in_bearing: NDArray,
    noise_variance: NDArray,
    drive_variance: NDArray,
    considered: Considered,
    law_share: float,
    wander_N2m2_per_rad: float,
    first_misfit: float,
    trace: NDArray,
    out: NDArray,
    given: bool,
) -> int:
    """Estimate the misfit of the load's law sample by sample, or run along a given one.

    Parameters as of `ccmodel.model.general.march.march` and `ccmodel.inverse.exact.filtered`, with torques (N m) and
    angles (rad) for forces and displacements. `in_bearing` is the friction of the drive pulley's bearing over that of
    sliding, -1 to 1; `first_misfit` is the load's torque at rest where it has no law.

    Returns
    -------
    int
        Samples that were solved.
    """
    m = time_s.size
    attempts, most_attempts = 0, MOST_ATTEMPTS * m * steps
    past = np.zeros(rows.PAST_ROWS)
    misfit, variance = first_misfit, 0.0
    covariance, effects = np.zeros(2), np.zeros(2)
    effects[1] = considered.zero
    node[rows.RESTED] = 1.0
    set_grip(ph, node, slide, friction_factor[0], 0.0)
    fixed_grip = ph.stribeck_rise == 0.0 and len(friction_factor) == 1
    wound_before = winding(theta_in[0], drive)[0]
    expected = 0.0
    for j in range(m):
        wound, radius_factor, _ = winding(theta_in[j], drive)
        pull, wound_before = drive.radius_m * (wound - wound_before), wound
        lever = drive.radius_m * radius_factor
        dt = time_s[j] - time_s[j - 1] if j > 0 else 0.0
        factor = friction_factor[min(j, len(friction_factor) - 1)]
        whole = 1.0 / steps if j > 0 else 1.0
        done, part, bristle = 0.0, whole, ph.bristle
        angle_before, expected_before = load[rows.ANGLE], expected
        gain, response, growth = 0.0, 0.0, 0.0
        if given:
            misfit = trace[MISFIT, j]
        while done < 1.0 - ROUNDING:
            part = min(part, 1.0 - done)
            step_pull, step_dt = part * pull, part * dt
            is_whole = abs(part - whole) <= ROUNDING and abs(past[rows.LAST_DT] - step_dt) <= ROUNDING * dt
            rotation = expect(slide, mean, past, pull, step_pull, is_whole)
            attempts += 1
            if attempts > most_attempts:
                return j
            solved, rotation = solve_with_contacts(
                ph, piece, node, slide, mean, load, rotation, misfit, step_dt, bristle, factor, fixed_grip
            )
            if not solved:
                part *= 0.5
                past[rows.LAST_PULL] = 0.0
                if part < SMALLEST_SUBSTEP:
                    if ph.presliding or bristle >= LONGEST_BRISTLE_M:
                        return j
                    bristle *= 10.0
                    part = whole
                continue
            if not given and j > 0 and done + part >= 1.0 - ROUNDING:
                response = lever * _response(ph, piece, node, slide, mean, load, rotation, misfit, step_dt, bristle)
                if response < HIDDEN * lever / ph.load_pulley.radius_m:
                    response = 0.0
                n = piece.shape[2] - 1
                near = max(piece[rows.TENSION, 0, 0], 0.0) - max(piece[rows.TENSION, 1, 0], 0.0)
                on_cables = measured[j] - _in_bearing(ph, piece, in_bearing[j])
                far = max(piece[rows.TENSION, 0, n], 0.0) - max(piece[rows.TENSION, 1, n], 0.0)
                expected = lever * near
                turn = theta_in[j] - theta_in[j - 1]
                angle = load[rows.ANGLE] + rotation
                growth = wander_N2m2_per_rad * abs(turn)
                growth += 2.0 * (law_share * ph.stiffness_load) ** 2 * abs(angle * (angle - angle_before))
                variance += growth
                noise = noise_variance[j]
                if turn != 0.0:
                    noise += drive_variance[j] * ((expected - expected_before) / turn) ** 2
                noise_variance[j] = noise
                effects[0] = considered.friction * lever * (near - far)
                gain = gain_of(variance, covariance, response, effects, noise)
                prior, prior_rotation = misfit, rotation
                copy_slides(slide, KEPT_SLIDE, rows.NOW)
                copy_means(mean, KEPT_MEAN, rows.MEAN_NEXT)
                for _ in range(ITERATIONS if gain != 0.0 else 0):
                    change = prior + gain * (on_cables - expected + response * (misfit - prior)) - misfit
                    if abs(response * change) <= max(FOUND * np.sqrt(noise), SMALLEST_Nm):
                        break
                    misfit += change
                    solved, rotation = solve_with_contacts(
                        ph, piece, node, slide, mean, load, rotation, misfit, step_dt, bristle, factor, fixed_grip
                    )
                    if not solved:
                        # The solver does not reach the new load: the sample keeps the load that was expected.
                        misfit, rotation, gain = prior, prior_rotation, 0.0
                        copy_slides(slide, rows.NOW, KEPT_SLIDE)
                        copy_means(mean, rows.MEAN_NEXT, KEPT_MEAN)
                        solved, rotation = solve_with_contacts(
                            ph, piece, node, slide, mean, load, rotation, misfit, step_dt, bristle, factor, fixed_grip
                        )
                        if not solved:
                            return j
                        break
                    near = max(piece[rows.TENSION, 0, 0], 0.0) - max(piece[rows.TENSION, 1, 0], 0.0)
                    expected = lever * near
                variance = updated_variance(variance, covariance, response, effects, noise, gain)
            remember(slide, past, rotation, step_pull, step_dt)
            accept(ph, piece, node, slide, mean, load, rotation, step_dt)
            done += part
            part = min(2.0 * part, whole)
        expected = lever * (max(piece[rows.TENSION, 0, 0], 0.0) - max(piece[rows.TENSION, 1, 0], 0.0))
        if not given:
            trace[MISFIT, j], trace[BY_MISFIT, j], trace[GAIN, j] = misfit, response, gain
            trace[GROWTH, j] = growth
        trace[EXPECTED, j] = expected + _in_bearing(ph, piece, in_bearing[j])
        out[0, j], out[1, j] = load[rows.ANGLE], load[rows.TORQUE]
    return m


def run(
    transmission: Transmission,
    load: SpringLoad | TorqueLoad,
    settings: Settings,
    initial: InitialTension,
    time_s: NDArray,
    drive: Drive,
    prior: Prior,
    misfit_Nm: NDArray | None = None,
    refinement: int = 1,
) -> Run:
    """Estimate the misfit of the load's law, or run along a given `misfit_Nm`, shape (n,).

    A `TorqueLoad` stands for a load without a law; of its torque only the value at rest is used.

    Raises
    ------
    ModelError
        If a step has no solution.
    """
    time_s, theta_in = one_row(time_s, "time_s"), one_row(drive.theta_rad, "theta_in")
    if theta_in[0] != 0.0:
        # The initial tension stands at a drive angle of zero.
        first = np.array([2 * time_s[0] - time_s[1]])
        begun = Drive(*(np.concatenate([values[:1], values]) for values in drive))
        begun.theta_rad[0] = 0.0
        misfit = None if misfit_Nm is None else np.concatenate([misfit_Nm[:1], misfit_Nm])
        since = np.concatenate([first, time_s])
        found = run(transmission, load, settings, initial, since, begun, prior, misfit, refinement)
        return Run(found.trace[:, 1:], found.out[:, 1:], found.noise_variance[1:])
    noise, theta_variance = drive.torque_variance.copy(), one_row(drive.theta_variance, "theta_variance")
    n = time_s.size
    has_law = isinstance(load, SpringLoad)
    series = np.zeros(1) if isinstance(load, SpringLoad) else load.torque_Nm
    at_rest = prepared(
        transmission, load, settings, time_s, theta_in, initial, refinement * ELEMENTS, refinement, series
    )
    slide, mean = (np.concatenate([a, np.zeros_like(a[:1])]) for a in (at_rest.slide, at_rest.mean))
    trace, out = np.zeros((TRACE_ROWS, n)), np.empty((2, n))
    if misfit_Nm is not None:
        trace[MISFIT] = misfit_Nm
    solved = filtered(
        *at_rest._replace(slide=slide, mean=mean),
        time_s,
        theta_in,
        drive.torque_Nm,
        bearing(theta_in, settings.drive_presliding_rad),
        noise,
        theta_variance,
        prior.considered,
        prior.law_share,
        prior.wander_N2m2_per_rad,
        0.0 if has_law else float(series[0]),
        trace,
        out,
        misfit_Nm is not None,
    )
    if solved < n:
        raise ModelError(f"no balance of cables and load was found at sample {solved}")
    if isinstance(load, TorqueLoad):  # the load's own torque, without what acts beside it
        out[1] = trace[MISFIT]
    return Run(trace, out, noise)
