"""The band of a learned law holds what a piecewise linear curve leaves of a smooth law."""

import numpy as np
import pytest

from ccmodel.diagnosis.law_report import of_straight_pieces

FINE = np.linspace(0.0, 2.0, 4001)


def fitted(knots, law):
    """Values at the knots of the piecewise linear curve with the least mean square error."""
    hats = np.array([np.interp(FINE, knots, row) for row in np.eye(knots.size)]).T
    return np.linalg.lstsq(hats, law(FINE), rcond=None)[0]


def test_the_error_at_a_knot_is_that_of_the_best_fit_to_a_parabola():
    knots = np.linspace(0.0, 2.0, 13)
    values = fitted(knots, np.square)
    error = np.abs(values - knots**2)
    assert of_straight_pieces(knots, values)[3:-3] == pytest.approx(error[3:-3], rel=0.05)


def test_a_wave_is_within_three_errors_wherever_it_is_curved():
    knots = np.linspace(0.0, 2.0, 13)
    values = fitted(knots, lambda x: np.sin(4 * x))
    error = np.abs(values - np.sin(4 * knots))
    assert (error <= 3 * of_straight_pieces(knots, values) + 1e-3).all()


@pytest.mark.parametrize("knots", [np.linspace(0, 2, 9), np.geomspace(0.1, 2, 9), np.array([-1.0, 1.0])])
def test_a_straight_law_has_no_such_error(knots):
    assert of_straight_pieces(knots, 3 - 2 * knots) == pytest.approx(0.0, abs=1e-12)
