"""Energy of a whole motion of the pair, phase by phase: what goes in at the drive is stored, or lost to friction.

Friction's part has integrals of its own, of friction times slip along each moving stretch; one bend, so that a stretch
that slides with sigma has T and rate of stretch in proportion to exp(-sigma m).
"""

from itertools import pairwise

import numpy as np
import pytest
from test_exact_energy import EA, LENGTH, MU, PATH, M, stored

from ccmodel.model.exact import simulate_pair
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission

RADIUS, K_E = 0.015, 0.3
PAIR = Transmission(PATH, EA, MU, RADIUS, RADIUS)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(50)
NODES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2


def run(theta, pretension, **kw):
    return simulate_pair(PAIR, SpringLoad(K_E), np.asarray(theta), InitialTension.uniform(PATH, pretension), **kw)


def regimes(history, target, pretension):
    """Drive angles at which a phase begins between the last of `history` and `target`, both ends included."""
    edges = [history[-1]]

    def kind(theta):
        """Phase, and which cables move as a whole: slack hides in phase IV that the other one's front has arrived."""
        response = run([*history, *theta], pretension)
        whole = [(moving[:, 0] >= LENGTH) for moving in (response.moving_A_m, response.moving_B_m)]
        return (4 * response.phase + 2 * whole[0] + whole[1])[len(history) :]

    probe = np.linspace(history[-1], target, 400)[1:]
    seen = kind(probe)
    for i in np.flatnonzero(np.diff(seen)):
        near, far = probe[i], probe[i + 1]
        while True:
            middle = 0.5 * (near + far)
            if middle in (near, far):
                break
            near, far = (middle, far) if kind([middle])[-1] == seen[i] else (near, middle)
        edges.append(far)
    return [*edges, target]


def sliding(sigma, m, front):
    """Slip at `m` per displacement of the end that the stretch up to `front` is drawn from."""
    return (np.exp(-sigma * m) - np.exp(-sigma * front)) / -np.expm1(-sigma * front)


def friction(T_end, sigma, front, slip):
    """Friction times slip over a stretch counted from its end: the integral of T |slip| dm, N per unit of motion."""
    m = NODES * front
    return front * (WEIGHTS * T_end * np.exp(-sigma * m) * np.abs(slip(m))).sum()


def friction_power(T_drive, T_load, moving, sigma, drive_rate, load_rate):
    """Power lost along one cable; ends move out of the conduit at `drive_rate` and into it at `load_rate`, m/s."""
    from_drive, from_load = moving * M / LENGTH
    if T_drive == 0.0:
        return 0.0
    if from_drive >= M and from_load <= 0.0:
        return friction(T_drive, sigma, M, lambda m: load_rate + (drive_rate - load_rate) * sliding(sigma, m, M))
    lost = friction(T_drive, sigma, from_drive, lambda m: drive_rate * sliding(sigma, m, from_drive))
    if from_load < M and load_rate != 0.0:
        # what the drive releases is pulled at the load, and vice versa
        lost += friction(T_load, -sigma, M - from_load, lambda m: load_rate * sliding(-sigma, m, M - from_load))
    return lost


def energies(history, begin, end, pretension):
    """Work at the drive and friction's part from `begin` to `end`, one phase, J."""
    theta = begin + (end - begin) * NODES**2  # takes a front's square-root start away
    response = run([*history, begin, *theta, end], pretension)
    part = slice(len(history) + 1, -1)
    direction = np.sign(end - begin)
    load = np.polynomial.Legendre.fit(NODES, RADIUS * response.theta_out_rad[part], NODES.size - 12, domain=[0, 1])
    drive_rate, load_rate = 2 * (end - begin) * RADIUS * NODES, load.deriv()(NODES)
    lost = np.zeros(NODES.size)
    for i in range(NODES.size):
        at = len(history) + 1 + i
        for sign, near, far, moving in (
            (1, response.T1_N, response.T2_N, response.moving_A_m),
            (-1, response.T3_N, response.T4_N, response.moving_B_m),
        ):
            lost[i] += friction_power(
                near[at], far[at], moving[at], sign * direction, sign * drive_rate[i], sign * load_rate[i]
            )
    work = (WEIGHTS * (response.T1_N - response.T3_N)[part] * drive_rate).sum()
    return work, (WEIGHTS * lost).sum()


# Far enough that every stroke passes all corners that the one before has stored: none of them is the edge of a phase.
@pytest.mark.parametrize(("pretension", "reach"), [(30.0, 2.5), (10.0, 1.0), (3.0, 1.0)])
def test_work_of_a_whole_motion_is_stored_or_lost_to_friction(pretension, reach):
    history, work, lost = [0.0], 0.0, 0.0
    for target in (reach, -0.8 * reach, 0.5 * reach):
        for begin, end in pairwise(regimes(history, target, pretension)):
            done = energies(history, begin, end, pretension)
            work, lost = work + done[0], lost + done[1]
        history.append(target)
    response = run(history, pretension, record_profiles_at=[0, 3])
    held = [
        sum(stored(profile) for profile in response.profiles[i] if profile.tension_N.max() > 0)
        + 0.5 * K_E * response.theta_out_rad[i] ** 2
        for i in (0, 3)
    ]
    assert lost > 0
    assert work == pytest.approx(held[1] - held[0] + lost, rel=1e-9)
