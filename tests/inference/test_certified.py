"""Certified nonlinear regressions of the Statistical Reference Datasets (NIST), through the one least squares.

Observations and certified values are in `certified.yaml`. The certified sum of squares is computed again from
observations and parameters, so that an error of copying shows. Both starts of each regression are tried: the first is
far from the solution.
"""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from ccmodel.inference.least_squares import Search, solve
from ccmodel.inference.problem import Free, Problem

SETS = yaml.safe_load(Path(__file__).with_name("certified.yaml").read_text(encoding="utf-8"))


def three_exponentials(x, a, b, c, d, e, f):
    return a * np.exp(-b * x) + c * np.exp(-d * x) + e * np.exp(-f * x)


def two_peaks(x, a, b, c, d, e, f, g, h):
    return a * np.exp(-b * x) + c * np.exp(-(((x - d) / e) ** 2)) + f * np.exp(-(((x - g) / h) ** 2))


def three_cycles(x, a, b, c, d, e, f, g, h, i):
    waves = [(12.0, b, c), (d, e, f), (g, h, i)]
    return a + sum(k * np.cos(2 * np.pi * x / p) + m * np.sin(2 * np.pi * x / p) for p, k, m in waves)


def cubic_over_cubic(x, a, b, c, d, e, f, g):
    return (a + b * x + c * x**2 + d * x**3) / (1 + e * x + f * x**2 + g * x**3)


def exponential_over_linear(x, a, b, c):
    return np.exp(-a * x) / (b + c * x)


MODELS = {
    "Bennett5": lambda x, a, b, c: a * (b + x) ** (-1 / c),
    "BoxBOD": lambda x, a, b: a * (1 - np.exp(-b * x)),
    "Chwirut1": exponential_over_linear,
    "Chwirut2": exponential_over_linear,
    "DanWood": lambda x, a, b: a * x**b,
    "ENSO": three_cycles,
    "Eckerle4": lambda x, a, b, c: a / b * np.exp(-0.5 * ((x - c) / b) ** 2),
    "Gauss1": two_peaks,
    "Gauss2": two_peaks,
    "Gauss3": two_peaks,
    "Hahn1": cubic_over_cubic,
    "Kirby2": lambda x, a, b, c, d, e: (a + b * x + c * x**2) / (1 + d * x + e * x**2),
    "Lanczos1": three_exponentials,
    "Lanczos2": three_exponentials,
    "Lanczos3": three_exponentials,
    "MGH09": lambda x, a, b, c, d: a * (x**2 + b * x) / (x**2 + c * x + d),
    "MGH10": lambda x, a, b, c: a * np.exp(b / (x + c)),
    "MGH17": lambda x, a, b, c, d, e: a + b * np.exp(-d * x) + c * np.exp(-e * x),
    "Misra1a": lambda x, a, b: a * (1 - np.exp(-b * x)),
    "Misra1b": lambda x, a, b: a * (1 - (1 + b * x / 2) ** -2),
    "Misra1c": lambda x, a, b: a * (1 - (1 + 2 * b * x) ** -0.5),
    "Misra1d": lambda x, a, b: a * b * x / (1 + b * x),
    "Nelson": lambda x, x2, a, b, c: np.exp(a - b * x * np.exp(-c * x2)),
    "Rat42": lambda x, a, b, c: a / (1 + np.exp(b - c * x)),
    "Rat43": lambda x, a, b, c, d: a / (1 + np.exp(b - c * x)) ** (1 / d),
    "Roszman1": lambda x, a, b, c, d: a - b * x - np.arctan(c / (x - d)) / np.pi,
    "Thurber": cubic_over_cubic,
}
# A search ends where a step changes the cost by less than this. Differences of the errors limit the parameters' digits.
EXACT = Search(tolerance=1e-14, shortest=1e-12, difference=1e-6, most_evaluations=1000)


def errors_of(name, parameters):
    one = SETS[name]
    x, y = [np.array(one[k], float) for k in ("x", "x2") if k in one], np.array(one["y"], float)
    with np.errstate(all="ignore"):
        found = MODELS[name](*x, *parameters)
        # The regression of Nelson's data is that of the logarithm.
        return np.log(found) - np.log(y) if name == "Nelson" else found - y


@pytest.mark.parametrize("name", SETS)
def test_data_and_certified_values_agree(name):
    square = SETS[name]["square"]
    assert np.sum(errors_of(name, SETS[name]["parameters"]) ** 2) == pytest.approx(square, rel=1e-9, abs=1e-20)


# Among derivatives of a few digits and a valley that is flat over four decades, the search stalls far away.
TOO_FAR = pytest.param("MGH10", "start_1", marks=pytest.mark.xfail(strict=True, reason="the start is too far away"))
STARTS = [TOO_FAR if (n, s) == TOO_FAR.values else (n, s) for n in SETS for s in ("start_1", "start_2")]


@pytest.mark.parametrize(("name", "start"), STARTS)
def test_the_certified_parameters_are_found(name, start):
    one = SETS[name]
    names = [f"b{k}" for k in range(len(one["parameters"]))]
    recording = SimpleNamespace(
        name="one", session="", measured=np.array([one["y"]]), errors=lambda v: errors_of(name, [v[n] for n in names])
    )
    problem = Problem([recording], {n: Free(b) for n, b in zip(names, one[start], strict=True)}, weight=lambda r: 1.0)
    solution = solve(problem, np.array(one[start], float), EXACT)
    assert solution.converged
    assert solution.cost == pytest.approx(one["square"], rel=1e-8)
    assert solution.x == pytest.approx(np.array(one["parameters"]), rel=1e-4)
