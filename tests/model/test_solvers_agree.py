"""The three solvers on the same physics: the general one and the paper's come to the exact one as grids are refined."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccmodel.geometry import ConduitPath
from ccmodel.model import paper
from ccmodel.model.exact import Status, simulate_pair
from ccmodel.model.general import simulate
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission

TENSIONS = ("T1_N", "T2_N", "T3_N", "T4_N")
RADIUS, EA = 0.008, 5000.0


def tensions(response):
    return np.stack([getattr(response, name) for name in TENSIONS])


def rms(errors):
    return np.sqrt((errors**2).mean(axis=-1))


def refined(knots, steps):
    return np.interp(np.linspace(0, len(knots) - 1, (len(knots) - 1) * steps + 1), np.arange(len(knots)), knots)


@st.composite
def cases(draw):
    """A path, two initial profiles in balance with the load at rest, a load and a motion."""
    pieces = st.tuples(st.floats(0.1, 0.8), st.sampled_from([0.0, 0.5, 1.0, 2.0, 3.0]))
    path = ConduitPath(*np.array(draw(st.lists(pieces, min_size=1, max_size=4))).T)
    mu = draw(st.sampled_from([0.05, 0.15, 0.3]))
    corners = sorted(draw(st.sets(st.integers(1, 19), max_size=2)))
    x = path.length_m * np.array([0, *corners, 20]) / 20
    m = mu * path.bend_at(x)
    log_T = []
    for _ in range(2):
        slopes = draw(st.lists(st.sampled_from([-1, -0.5, 0, 0.5, 1]), min_size=x.size - 1, max_size=x.size - 1))
        rises = np.concatenate([[0.0], np.cumsum(slopes * np.diff(m))])
        log_T.append(rises - rises[-1])
    initial = InitialTension(x, *(draw(st.sampled_from([2.0, 7.0, 15.0])) * np.exp(log_T)))
    knots = [0.0, *draw(st.lists(st.floats(-1, 1), min_size=2, max_size=5))]
    load = SpringLoad(draw(st.sampled_from([0.005, 0.05, 0.5])))
    return Transmission(path, EA, mu, RADIUS, 0.01), load, initial, refined(knots, 40)


@settings(max_examples=200)
@given(cases())
def test_the_general_solver_comes_to_the_exact_one_with_order_two(case):
    one, load, initial, theta = case
    exact = simulate_pair(one, load, theta, initial)
    assert exact.status is Status.OK
    scale = tensions(exact).max()
    for elements in (32, 64):
        by_grid = simulate(one, load, np.arange(theta.size) * 0.01, theta, initial, [], elements=elements)
        errors = rms(tensions(by_grid) - tensions(exact))
        # of second order with these constants: 0.2 % of the largest tension at 32 elements, 0.05 % at 64
        assert errors.max() < 2.0 * scale / elements**2
        assert rms(by_grid.theta_out_rad - exact.theta_out_rad) < 0.4 * max(np.ptp(theta), 0.1) / elements**2


def test_time_plays_no_part_without_effects_that_know_it():
    path = ConduitPath([0.4, 0.3, 0.5], [1.0, 0.0, 2.0])
    one, initial = Transmission(path, EA, 0.15, RADIUS, 0.01), InitialTension.uniform(path, 7.0)
    theta = refined([0.0, 0.8, -0.6, 0.4], 50)
    slow, fast = (
        simulate(one, SpringLoad(0.05), pace * np.arange(theta.size), theta, initial, [], elements=32)
        for pace in (1.0, 1e-4)
    )
    assert tensions(slow) == pytest.approx(tensions(fast), abs=1e-8)  # what Newton leaves


@pytest.mark.parametrize("pretension", [7.3, 2.0])
def test_the_papers_discretisation_extrapolates_to_the_exact_solver(pretension):
    path = ConduitPath([1.2], [np.pi])
    one, initial = Transmission(path, 9300.0, 0.15, 0.006, 0.006), InitialTension.uniform(path, pretension)
    knots = [0.0, 0.6, -0.5, 0.3]
    exact = tensions(simulate_pair(one, SpringLoad(0.05), refined(knots, 20), initial))

    def by_sections(n, steps=20):
        response = paper.simulate_pair(one, SpringLoad(0.05), refined(knots, steps), initial, n)
        return tensions(response)[:, :: steps // 20]

    # the time step plays no part: between reversals it is one step or many there too
    assert by_sections(64, 20) == pytest.approx(by_sections(64, 80), abs=1e-11)
    coarse, middle, fine = (by_sections(n) - exact for n in (256, 512, 1024))
    if rms(coarse).max() < 1e-12:  # all slides whole at every sample: no discretisation is seen
        return
    # second order, but for where in a section a front happens to stand
    assert (rms(coarse) > 2.5 * rms(middle)).all() and (rms(middle) > 2.5 * rms(fine)).all()
    assert rms(fine).max() < 1e-6
    assert rms((4 * fine - middle) / 3).max() < 3e-7
