"""The load from the drive side with the exact solver: a compiled loop over the samples.

The load is passive: it moves with the drive or rests. A load that rests has the torque that the cables put on it.
Friction therefore hides it from the drive while the fronts from drive and load have met on neither cable.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
from ccmodel.kernel import kernel, small_kernel
from ccmodel.model.exact import state as rows
from ccmodel.model.exact.cable import line_stiffness, reverse
from ccmodel.model.exact.front import end_compliance
from ccmodel.model.exact.path import PathTables, tabulate
from ccmodel.model.exact.profile import initial_state
from ccmodel.model.exact.run import settle
from ccmodel.model.exact.state import State, copy_state, elongation
from ccmodel.model.exact.step import excess, step
from ccmodel.model.initial import InitialTension
from ccmodel.model.transmission import Transmission

# Newton steps of a sample at most: where fronts meet within the sample, the torque has a corner.
ITERATIONS = 6
# A misfit that changes the torque by less than this share of its noise, or of the highest tension, is found.
FOUND, ROUNDING = 0.01, 1e-13


class Start(NamedTuple):
    """A transmission before the drive moves, and the law of its load.

    Attributes
    ----------
    path : PathTables
    state : State
    offset, stiffness : float
        Constant part (N) and stiffness (N/m) of the load's law at the rim of the load pulley.
    """

    path: PathTables
    state: State
    offset: float
    stiffness: float


def start_of(transmission: Transmission, stiffness_Nm_per_rad: float, initial: InitialTension, samples: int) -> Start:
    """A transmission at rest on a spring load; a load without a law has a stiffness of zero."""
    path = tabulate(transmission.path, transmission.friction_coefficient, transmission.axial_rigidity_N)
    present = np.array([True, not transmission.is_single_cable])
    state = initial_state(path, transmission, initial, present, samples)
    offset = float(state.value[0, rows.T_LOAD] - state.value[1, rows.T_LOAD])
    return Start(path, state, offset, stiffness_Nm_per_rad / transmission.load_radius_m**2)


@small_kernel
def _response(path: PathTables, state: State, stiffness: float) -> float:
    """Drive torque by misfit, both as forces at the rims, where the load moves with the drive."""
    total, drive = stiffness, 0.0
    for c in range(2):
        if state.kind[c, rows.MODE] == rows.WHOLE:
            if elongation(state, c) > 0.0:
                near, far = line_stiffness(path, state, c)
                drive += near
                total += far
        else:
            compliance = end_compliance(state, c, 1)
            if compliance <= 0.0:
                return 0.0
            total += 1.0 / compliance
    return drive / total if total > 0.0 else 0.0


@small_kernel
def _drive_torque(state: State) -> float:
    return state.value[0, rows.T_DRIVE] - state.value[1, rows.T_DRIVE]


@kernel(allocates=True)
def filtered(
    start: Start,
    saved: State,
    before: State,
    drive: NDArray,
    measured: NDArray,
    noise_variance: NDArray,
    drive_variance: NDArray,
    considered: Considered,
    law_share: float,
    wander_N2_per_m: float,
    trace: NDArray,
    out: NDArray,
    given: bool,
) -> None:
    """Estimate the misfit of the load's law sample by sample, or run along a given one.

    Parameters
    ----------
    start : Start
        Its state is carried on.
    saved, before : State
        Scratch space that shares the corners of the state.
    drive : ndarray, shape (n,)
        Position of the drive's rim, m.
    measured : ndarray, shape (n,)
        Drive torque over the drive's radius, N.
    noise_variance : ndarray, shape (n,)
        Of the measured torque, N^2; that of the drive's position (`drive_variance`, m^2) is added to it here.
    considered : Considered
        Of forces at the rim.
    law_share : float
        Standard deviation of the law's misfit, as a share of the force of its spring.
    wander_N2_per_m : float
        Growth of the variance of a load without a law, per travel of the drive.
    trace : ndarray, shape (5, n)
        Rows of `ccmodel.inverse.update`, as forces; with `given`, the misfit in it is that of the run, and nothing is
        estimated.
    out : ndarray, shape (2, n)
        Displacement of the load's rim (m), and force of the cables on it (N).
    given : bool
    """
    path, state = start.path, start.state
    offset, stiffness = start.offset, start.stiffness
    misfit, variance = 0.0, 0.0
    covariance, effects = np.zeros(2), np.zeros(2)
    effects[1] = considered.zero
    settle(path, state, saved, offset, stiffness)
    expected = _drive_torque(state)
    for i in range(drive.size):
        move = drive[i] - state.value[rows.PAIR, rows.DRIVE]
        direction = 1 if move > 0.0 else -1
        load_before, expected_before = state.value[rows.PAIR, rows.LOAD], expected
        gain, response, growth = 0.0, 0.0, 0.0
        if move != 0.0:
            # A reversal writes corners, which the copy shares: it is done before the copy is taken.
            reverse(path, state, 0, direction)
            reverse(path, state, 1, -direction)
            if given:
                step(path, state, saved, direction, drive[i], offset + trace[MISFIT, i], stiffness)
            else:
                copy_state(state, before)
                step(path, state, saved, direction, drive[i], offset + misfit, stiffness)
                expected = _drive_torque(state)
                response = _response(path, state, stiffness)
                load = state.value[rows.PAIR, rows.LOAD]
                growth = wander_N2_per_m * abs(move)
                growth += 2.0 * (law_share * stiffness) ** 2 * abs(load * (load - load_before))
                variance += growth
                noise = noise_variance[i] + drive_variance[i] * ((expected - expected_before) / move) ** 2
                noise_variance[i] = noise
                force = state.value[0, rows.T_LOAD] - state.value[1, rows.T_LOAD]
                effects[0] = considered.friction * (expected - force)
                gain = gain_of(variance, covariance, response, effects, noise)
                prior = misfit
                for _ in range(ITERATIONS if gain != 0.0 else 0):
                    change = prior + gain * (measured[i] - expected + response * (misfit - prior)) - misfit
                    tension = max(state.value[0, rows.T_DRIVE], state.value[1, rows.T_DRIVE])
                    if (response * change) ** 2 <= max(FOUND * FOUND * noise, (ROUNDING * tension) ** 2):
                        break
                    misfit += change
                    copy_state(before, state)
                    step(path, state, saved, direction, drive[i], offset + misfit, stiffness)
                    expected = _drive_torque(state)
                    now = _response(path, state, stiffness)
                    if now > 0.0:
                        response = now
                        gain = gain_of(variance, covariance, response, effects, noise)
                variance = updated_variance(variance, covariance, response, effects, noise, gain)
                # A load that rests holds what the cables put on it.
                out_of_balance = excess(state, offset + misfit, stiffness)
                if direction * out_of_balance < 0.0:
                    misfit += out_of_balance
                    state.value[rows.PAIR, rows.OFFSET] = offset + misfit
        expected = _drive_torque(state)
        if not given:
            trace[MISFIT, i], trace[BY_MISFIT, i], trace[GAIN, i] = misfit, response, gain
            trace[GROWTH, i] = growth
        trace[EXPECTED, i] = expected
        out[0, i] = state.value[rows.PAIR, rows.LOAD]
        out[1, i] = state.value[0, rows.T_LOAD] - state.value[1, rows.T_LOAD]


def run(
    transmission: Transmission,
    stiffness_Nm_per_rad: float,
    initial: InitialTension,
    drive: Drive,
    prior: Prior,
    misfit_Nm: NDArray | None = None,
) -> Run:
    """Estimate the misfit of the law of a spring load, or run along a given `misfit_Nm`, shape (n,).

    A load without a law has a stiffness of zero.
    """
    R_i, R_o = transmission.drive_radius_m, transmission.load_radius_m
    n = drive.theta_rad.size
    start = start_of(transmission, stiffness_Nm_per_rad, initial, n)
    trace, out = np.zeros((TRACE_ROWS, n)), np.empty((2, n))
    if misfit_Nm is not None:
        trace[MISFIT] = misfit_Nm / R_o
    state, noise = start.state, drive.torque_variance / R_i**2
    saved, before = (
        state._replace(front=state.front.copy(), value=state.value.copy(), kind=state.kind.copy()) for _ in range(2)
    )
    filtered(
        start,
        saved,
        before,
        drive.theta_rad * R_i,
        drive.torque_Nm / R_i,
        noise,
        drive.theta_variance * R_i**2,
        Considered(prior.considered.friction, prior.considered.zero / R_i),
        prior.law_share,
        prior.wander_N2m2_per_rad / R_i / R_o**2,
        trace,
        out,
        misfit_Nm is not None,
    )
    trace *= np.array([R_o, R_i, R_i / R_o, R_o / R_i, R_o**2])[:, None]
    return Run(trace, out * [[1 / R_o], [R_o]], noise * R_i**2)
