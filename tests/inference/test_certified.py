"""Certified nonlinear regressions of the Statistical Reference Datasets (NIST), through the one least squares.

Data and certified values are those of the data sets named below (doi:10.18434/T43G6C). The certified sum of squares is
computed again from data and parameters, so that an error of copying shows. Both starts of each set are tried: the first
is far from the solution.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from ccmodel.inference.least_squares import Search, solve
from ccmodel.inference.problem import Free, Problem

MISRA_X = [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0]
MISRA_Y = [10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78]
# Name, x, y, model, two starts, certified parameters, certified sum of squares.
SETS = [
    (
        "Misra1a", MISRA_X, MISRA_Y, lambda x, a, b: a * (1 - np.exp(-b * x)),
        [(500.0, 1e-4), (250.0, 5e-4)], (2.3894212918e2, 5.5015643181e-4), 1.2455138894e-1,
    ),
    (
        "Misra1b", MISRA_X, MISRA_Y, lambda x, a, b: a * (1 - (1 + b * x / 2) ** -2),
        [(500.0, 1e-4), (300.0, 2e-4)], (3.3799746163e2, 3.9039091287e-4), 7.5464681533e-2,
    ),
    (
        "Misra1c", MISRA_X, MISRA_Y, lambda x, a, b: a * (1 - (1 + 2 * b * x) ** -0.5),
        [(500.0, 1e-4), (600.0, 2e-4)], (6.3642725809e2, 2.0813627256e-4), 4.0966836971e-2,
    ),
    (
        "Misra1d", MISRA_X, MISRA_Y, lambda x, a, b: a * b * x / (1 + b * x),
        [(500.0, 1e-4), (450.0, 3e-4)], (4.3736970754e2, 3.0227324449e-4), 5.6419295283e-2,
    ),
    (
        "BoxBOD", [1, 2, 3, 5, 7, 10], [109, 149, 149, 191, 213, 224], lambda x, a, b: a * (1 - np.exp(-b * x)),
        [(100.0, 0.75)], (2.1380940889e2, 5.4723748542e-1), 1.1680088766e3,
    ),
    (
        "DanWood", [1.309, 1.471, 1.490, 1.565, 1.611, 1.680], [2.138, 3.421, 3.597, 4.340, 4.882, 5.660],
        lambda x, a, b: a * x**b, [(1.0, 5.0), (0.7, 4.0)], (7.6886226176e-1, 3.8604055871), 4.3173084083e-3,
    ),
    (
        "Rat42", [9, 14, 21, 28, 42, 57, 63, 70, 79],
        [8.930, 10.800, 18.590, 22.330, 39.350, 56.110, 61.730, 64.620, 67.080],
        lambda x, a, b, c: a / (1 + np.exp(b - c * x)),
        [(100.0, 1.0, 0.1), (75.0, 2.5, 0.07)], (7.2462237576e1, 2.6180768402, 6.7359200066e-2), 8.0565229338,
    ),
    (
        "MGH09", [4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625],
        [0.1957, 0.1947, 0.1735, 0.16, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246],
        lambda x, a, b, c, d: a * (x**2 + b * x) / (x**2 + c * x + d),
        [(0.25, 0.39, 0.415, 0.39)],
        (1.9280693458e-1, 1.9128232873e-1, 1.2305650693e-1, 1.3606233068e-1), 3.0750560385e-4,
    ),
]  # fmt: skip
# A search ends where a step changes the cost by less than this. Differences of the errors limit the parameters' digits.
EXACT = Search(tolerance=1e-14, shortest=1e-12, difference=1e-4)


def errors_of(x, y, model, parameters):
    return model(np.array(x, float), *parameters) - np.array(y, float)


@pytest.mark.parametrize(("x", "y", "model", "certified", "square"), [(*s[1:4], *s[5:]) for s in SETS])
def test_data_and_certified_values_agree(x, y, model, certified, square):
    assert np.sum(errors_of(x, y, model, certified) ** 2) == pytest.approx(square, rel=1e-9)


@pytest.mark.parametrize(
    ("x", "y", "model", "start", "certified", "square"),
    [(*s[1:4], start, *s[5:]) for s in SETS for start in s[4]],
    ids=[f"{s[0]}-{k + 1}" for s in SETS for k in range(len(s[4]))],
)
def test_the_certified_parameters_are_found(x, y, model, start, certified, square):
    names = [f"b{k}" for k in range(len(start))]
    recording = SimpleNamespace(
        name="one", session="", measured=np.array([y]), errors=lambda v: errors_of(x, y, model, [v[n] for n in names])
    )
    problem = Problem([recording], {n: Free(b) for n, b in zip(names, start, strict=True)}, weight=lambda r: 1.0)
    solution = solve(problem, np.array(start), EXACT)
    assert solution.converged
    assert solution.cost == pytest.approx(square, rel=1e-8)
    assert solution.x == pytest.approx(np.array(certified), rel=1e-4)
