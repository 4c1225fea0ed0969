"""The shortest formula in the band of a curve."""

import numpy as np
import pytest

from ccmodel.diagnosis.formula import shortest
from ccmodel.mechanisms import laws

FRICTION = laws()["learned-sliding-friction-by-drive-angle"]
DIRECTION = laws()["learned-sliding-friction-by-direction"]
X = np.linspace(-0.6, 0.6, 25)


def formula_of(y, sd=0.003, law=FRICTION, x=X):
    reach = 1.645 * sd
    return shortest(x, y, (y - reach, y + reach), law, lambda functions: reach * np.linalg.norm(functions, axis=1))


@pytest.mark.parametrize(
    ("y", "text", "last"),
    [
        (1 + 0.2 * X, "a + b x", 0.2),
        (1 + 0.3 * X**2, "a + b x^2", 0.3),
        (0.9 + 0.2 * np.exp(-(X + 0.0) / 0.3), "a + b exp(-x/c)", 0.3),
        (1 + 0.2 * np.tanh(X / 0.1), "a + b tanh(x/c)", 0.1),
        (1 + 0.2 * np.sin(2 * np.pi * X / 0.5), "a + b cos(2 pi x/p) + c sin(2 pi x/p)", 0.5),
    ],
)
def test_a_curve_is_given_its_own_formula_with_its_constants(y, text, last):
    found, parameters = formula_of(y)
    assert found == text
    assert parameters[-1]["value"] == pytest.approx(last, rel=0.03)
    assert parameters[-1]["low"] < last < parameters[-1]["high"]


def test_the_interval_of_a_constant_holds_it_though_the_errors_of_the_knots_are_correlated():
    """A level that all knots share is no smaller for their number."""
    law, x = laws()["learned-pulley-radius-drive-by-drive-angle"], np.linspace(-1.0, 1.0, 9)
    covariance = 1e-6 * (0.3 * np.eye(x.size) + 0.7)
    reach = 1.645 * np.sqrt(np.diag(covariance))

    def half_widths(functions):
        return 1.645 * np.sqrt(np.einsum("ij,jk,ik->i", functions, covariance, functions))

    random, held = np.random.default_rng(2), []
    for _ in range(400):
        y = random.multivariate_normal(np.full(x.size, 1.01), covariance)
        text, constants = shortest(x, y, (y - reach, y + reach), law, half_widths)
        if text == "a":
            held.append(constants[0]["low"] <= 1.01 <= constants[0]["high"])
    assert len(held) > 200
    assert np.mean(held) == pytest.approx(0.9, abs=0.05)


def test_a_formula_is_in_the_band_where_that_ends_at_what_is_possible():
    """A compliance is not negative: a constant that is inside the band at every knot is a formula of it."""
    law, x = laws()["learned-end-stretch-drive-by-tension-fine"], np.geomspace(0.4, 20, 9)
    y, reach = np.repeat([12e-6, 2e-6], [5, 4]), np.repeat([3e-6, 11e-6], [5, 4])
    band = np.maximum(y - reach, 0.0), y + reach
    text, _ = shortest(x, y, band, law, lambda functions: np.linalg.norm(functions * reach, axis=1))
    assert text == "a"


@pytest.mark.parametrize(
    ("y", "text", "last"),
    [(lambda T: 1.6 * T**-0.3, "a x^n", -0.3), (lambda T: 0.7 + 0.8 / T, "a + b/x", 0.8)],
)
def test_a_law_of_the_tension_may_be_a_power(y, text, last):
    x = np.geomspace(0.5, 15.0, 9)
    found, parameters = formula_of(y(x), law=laws()["learned-sliding-friction-by-tension"], x=x)
    assert found == text
    assert parameters[-1]["value"] == pytest.approx(last, rel=0.03)
    assert parameters[-1]["low"] < last < parameters[-1]["high"]


def test_a_wider_band_has_a_shorter_formula():
    y = 1 + 0.02 * X + 0.01 * np.sin(2 * np.pi * X / 0.5)
    assert formula_of(y, sd=0.05)[0] == "a + b x"
    assert formula_of(y, sd=0.001)[0] != "a + b x"


@pytest.mark.parametrize("middle", [-500.0, 500.0])
def test_an_exponential_far_from_zero_is_no_error(middle):
    """A load cell's reading that varies by a hundredth of its mean: exp(-x/c) is zero or infinite."""
    x = middle + np.linspace(-0.5, 0.5, 25)
    y = 0.3 * np.tanh((x - middle) / 0.05) * np.cos(40 * (x - middle))
    assert formula_of(y, sd=1e-4, law=laws()["learned-sensor-map-F-load-by-reading"], x=x) == (None, [])


def test_a_curve_that_no_formula_meets_has_none():
    y = np.random.default_rng(2).standard_normal(X.size)
    assert formula_of(y, sd=1e-3) == (None, [])


def test_a_law_whose_average_is_its_own_may_be_a_constant():
    y = np.full(X.size, 0.8)
    found, (a,) = formula_of(y, law=laws()["learned-sensor-map-F-load-by-time"])
    assert (found, a["unit"]) == ("a", "N")
    assert a["low"] < 0.8 < a["high"]
    assert formula_of(y)[0] == "a + b x", "the average of friction belongs to its coefficient"


def test_friction_by_cable_has_one_constant():
    x, y = np.array([-1.0, 1.0]), np.array([0.9, 1.1])
    found, (a,) = formula_of(y, law=laws()["learned-sliding-friction-by-cable"], x=x)
    assert found == "1 + a x"
    assert a["value"] == pytest.approx(0.1)


def test_a_mass_has_one_constant():
    found, (a,) = formula_of(2e-4 * X, sd=1e-6, law=laws()["learned-load-by-acceleration"])
    assert (found, a["unit"]) == ("a x", "N*m/(rad/s^2)")
    assert a["low"] < 2e-4 < a["high"]


def test_friction_by_direction_has_one_constant():
    x, y = np.array([-1.0, 1.0]), np.array([0.88, 1.12])
    found, (a,) = formula_of(y, law=DIRECTION, x=x)
    assert found == "1 + a sign(v)"
    assert a["value"] == pytest.approx(0.12)
    assert a["unit"] == "1"
