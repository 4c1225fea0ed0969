"""The simulated example of the paper's Figs. 5 to 7: phases in order, where each begins, its slope, hump and slack."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from ccmodel.config import load_config
from ccmodel.geometry import ConduitPath
from ccmodel.model.load import SpringLoad
from ccmodel.model.phases import PAPERS_PHASES, simulate_phases
from ccmodel.model.transmission import Transmission

EXAMPLE = load_config(Path(__file__).parents[2] / "config/config.yaml").phases
PATH = ConduitPath([EXAMPLE.conduit_length_m], [EXAMPLE.conduit_bend_rad])
EA = EXAMPLE.cable_stiffness_N_per_m * EXAMPLE.conduit_length_m
RADIUS, T0 = EXAMPLE.pulley_radius_m, EXAMPLE.pretension_N
M = EXAMPLE.friction_coefficient * EXAMPLE.conduit_bend_rad
C = EXAMPLE.conduit_length_m / (M * EA)  # stretch per tension and mu phi, m/N
E0 = T0 * EXAMPLE.conduit_length_m / EA  # stretch by the pretension, m
REACH = EXAMPLE.amplitude_rad * RADIUS
K = EXAMPLE.load_stiffness_Nm_per_rad / RADIUS**2
# Tension per elongation of a cable that slides as a whole: pulled and released at the drive, at its drive and load end.
PULLED_DRIVE, PULLED_LOAD = 1 / (C * -np.expm1(-M)), 1 / (C * np.expm1(M))
RELEASED_DRIVE, RELEASED_LOAD = 1 / (C * np.expm1(M)), 1 / (C * -np.expm1(-M))


def simulated(samples=EXAMPLE.samples_per_cycle, amplitude=EXAMPLE.amplitude_rad):
    return simulate_phases(
        Transmission(PATH, EA, EXAMPLE.friction_coefficient, RADIUS, RADIUS),
        SpringLoad(EXAMPLE.load_stiffness_Nm_per_rad),
        T0,
        amplitude,
        EXAMPLE.frequency_Hz,
        samples,
    )


STUDY = simulated()


def begins():
    """Drive displacement at which phases II, III, IV begin in the stroke from the first reversal, m."""
    load = PULLED_LOAD * (E0 + REACH) / (K + PULLED_LOAD)  # of the load at the reversal, cable A alone holding it
    T1, T2 = K * load * np.exp(M), K * load

    def third(pulled):
        # A is released at the drive through mu phi = M - pulled and pulled at the load through the rest
        drive = REACH - C * T1 * np.expm1(pulled - M) ** 2
        here = load - C * T2 * np.expm1(pulled) ** 2
        return drive, T2 * np.exp(2 * pulled) - PULLED_LOAD * (E0 - drive + here) - K * here

    pulled = brentq(lambda y: third(y)[1], 0, M, xtol=1e-15)
    # A hangs slack where E0 + drive = load; B alone then holds the load
    slack = -2 * PULLED_LOAD * E0 / K - E0
    return {2: E0 + load, 3: third(pulled)[0], 4: slack}


def test_all_phases_follow_one_another_in_every_stroke():
    from_rest = STUDY.phase[: STUDY.first_reversal]
    reversals = [STUDY.instants[1], STUDY.instants[5], STUDY.phase.size]
    strokes = [STUDY.phase[a + 1 : b] for a, b in pairwise(reversals)]
    for stroke in (from_rest, *strokes):
        assert (np.diff(stroke) >= 0).all()
        assert set(stroke) == set(range(len(PAPERS_PHASES)))
    assert list(STUDY.instants) == [1, 2, 3, 4, 5, 6, 7, 8]


def test_phases_three_and_four_take_up_most_of_a_stroke():
    assert (STUDY.phase[STUDY.first_reversal :] >= 2).mean() > 0.5


@pytest.mark.parametrize("instant", [2, 3, 4])
def test_phases_begin_where_the_closed_form_says(instant):
    sample, drive = STUDY.instants[instant], STUDY.theta_in_rad * RADIUS
    assert drive[sample] <= begins()[instant] * (1 + 1e-12)
    assert drive[sample - 1] > begins()[instant] * (1 - 1e-12)
    # the stroke back is its mirror image
    half = EXAMPLE.samples_per_cycle // 2
    assert STUDY.instants[instant + 4] == sample + half


def test_from_rest_the_released_cable_reaches_the_load_first():
    second = int(np.argmax(STUDY.phase == 1))
    drive = STUDY.theta_in_rad * RADIUS
    begin = C * T0 * (np.expm1(-M) + M)
    assert drive[second - 1] < begin <= drive[second]
    assert STUDY.response.T4_N[second] < T0 == STUDY.response.T2_N[second - 1]


def slope_of(phase, response, i):
    """Apparent stiffness of the torque loop, d tau_out / d tau_in, at a sample of the stroke from instant 1.

    A is released, B pulled. B slides as a whole, and a part `follows` of the drive's motion arrives at the load.
    """
    if phase == "I":
        return 0.0
    if phase == "IV":
        return np.exp(-M)
    if phase == "III":
        follows = (RELEASED_LOAD + PULLED_LOAD) / (K + RELEASED_LOAD + PULLED_LOAD)
        return K * follows / ((RELEASED_DRIVE + PULLED_DRIVE) * (1 - follows))
    # A's fronts have run through these mu phi from either end; each end yields by itself
    first = STUDY.instants[1]
    released = 0.5 * np.log(response.T1_N[first] / response.T1_N[i])
    pulled = 0.5 * np.log(response.T2_N[i] / response.T2_N[first])
    A_drive, A_load = 1 / (C * np.expm1(released)), 1 / (C * -np.expm1(-pulled))
    follows = PULLED_LOAD / (K + A_load + PULLED_LOAD)
    return K * follows / (A_drive + PULLED_DRIVE * (1 - follows))


@pytest.mark.parametrize("name", PAPERS_PHASES)
def test_slope_of_the_torque_loop_in_each_phase(name):
    response, instant = STUDY.response, 1 + PAPERS_PHASES.index(name)
    first, last = STUDY.instants[instant] + 1, STUDY.instants[instant + 1] - 1
    for i in np.linspace(first + 1, last - 1, 7).astype(int)[1:-1]:
        rise = (response.tau_out_Nm[i + 1] - response.tau_out_Nm[i - 1]) / (
            response.tau_in_Nm[i + 1] - response.tau_in_Nm[i - 1]
        )
        # straight but in phase II, where the difference over two samples is of second order
        tolerance = 1e-4 if name == "II" else 1e-9
        assert rise == pytest.approx(slope_of(name, response, i), rel=tolerance, abs=1e-14)


@pytest.mark.parametrize(("instant", "cable", "names"), [(2, 0, ("T1_N", "T2_N")), (6, 1, ("T3_N", "T4_N"))])
def test_phase_two_has_its_hump(instant, cable, names):
    begin, halfway = STUDY.instants[instant], STUDY.halfway[instant]
    drive, load = (getattr(STUDY.response, name) for name in names)
    assert drive[halfway] < drive[begin] and load[halfway] > load[begin]
    profile = STUDY.response.profiles[halfway][cable].tension_N
    inner = profile[1:-1]
    assert inner.max() > 1.5 * max(profile[[0, -1]]) and inner.min() < profile[-1]
    assert profile.argmax() < np.flatnonzero(profile == inner.min())[0]


def test_cables_hang_slack_at_the_instants_the_figure_says():
    slack = {k: [p.tension_N.max() == 0 for p in STUDY.response.profiles[i]] for k, i in STUDY.instants.items()}
    assert slack == {
        1: [False, True], 2: [False, False], 3: [False, False], 4: [True, False],
        5: [True, False], 6: [False, False], 7: [False, False], 8: [False, True],
    }  # fmt: skip
    # at 2 and 6, the first sample after it became taut, next to nothing stands in it
    assert STUDY.response.T3_N[STUDY.instants[2]] < 0.01 * T0


def test_the_cycle_closes():
    first, last = STUDY.first_reversal, -1
    for name in ("T1_N", "T2_N", "T3_N", "T4_N", "theta_out_rad"):
        values = getattr(STUDY.response, name)
        assert values[last] == pytest.approx(values[first], rel=1e-12, abs=1e-12)


def test_a_phase_that_does_not_occur_has_no_instant():
    assert set(simulated(400, amplitude=0.05).instants) == {1, 5}
