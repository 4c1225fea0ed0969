"""Error over time per sample of every solver for the paper's case."""

from collections.abc import Callable
from pathlib import Path

import cases
import closed_form
import matplotlib.pyplot as plt
import numpy as np
import paper_best
import paper_numpy
from clock import us_per_sample
from numpy.typing import NDArray

from ccmodel.model import exact, general, paper

# Half a stroke, from the third-last reversal of the drive.
HALF_STROKE = slice(-1 - 3 * cases.SAMPLES_A_CYCLE // 4, -cases.SAMPLES_A_CYCLE // 4)
# Colours of Okabe and Ito, distinguishable with any colour vision.
STYLES = {
    "paper, plain numpy": ("#D55E00", "s"),
    "paper, compiled": ("#E69F00", "D"),
    "paper, compiled, at its best": ("#009E73", "^"),
    "general solver": ("#0072B2", "o"),
    "exact solver": ("#000000", "*"),
}

Points = list[tuple[int, float, float]]


def measure() -> dict[str, Points]:
    """By solver, a list of (sections or elements of a cable, microseconds per sample, relative error).

    The error is the root mean square difference of both drive-end tensions from the closed form over half a stroke,
    over the root mean square of these tensions.
    """
    case = cases.paper()
    one, load, initial = case.transmission, case.load, case.initial

    def general_tensions(theta_in, elements):
        time_s = np.arange(theta_in.size) / cases.SAMPLES_A_CYCLE
        return _pair(general.simulate(one, load, time_s, theta_in, initial, elements=elements).complete())

    solvers = {
        "paper, plain numpy": (
            lambda theta_in, n: paper_numpy.simulate_pair(one, load, theta_in, initial, n)[[0, 2]],
            (8, 16, 32, 64, 128),
            2,
        ),
        "paper, compiled": (
            lambda theta_in, n: _pair(paper.simulate_pair(one, load, theta_in, initial, n)),
            (8, 16, 32, 64, 128, 256, 512),
            5,
        ),
        "paper, compiled, at its best": (
            lambda theta_in, n: paper_best.simulate_pair(one, load, theta_in, initial, n)[[0, 2]],
            tuple(8 * 4**i for i in range(8)),
            10,
        ),
        "general solver": (general_tensions, (8, 16, 32, 64, 128, 256, 512), 5),
        "exact solver": (lambda theta_in, _: _pair(exact.simulate_pair(one, load, theta_in, initial)), (0,), 50),
    }
    return {name: [_point(case, run, cycles, n) for n in sizes] for name, (run, sizes, cycles) in solvers.items()}


def _pair(response) -> NDArray:
    return np.array([response.T1_N, response.T3_N])


def _point(case: cases.Case, run: Callable[[NDArray, int], NDArray], cycles: int, n: int) -> tuple[int, float, float]:
    theta_in = cases.sine(cycles)
    time_us = us_per_sample(lambda: run(theta_in, n), theta_in.size, repeats=3)
    truth = closed_form.drive_tensions(case, theta_in[HALF_STROKE])
    difference = run(theta_in, n)[:, HALF_STROKE] - truth
    return n, time_us, float(np.sqrt((difference**2).mean() / (truth**2).mean()))


def error_ratio_at_equal_speed(points: dict[str, Points]) -> float:
    """Least error of any other solver within the exact solver's time, over the exact solver's error.

    Between measured points the error is interpolated as a power of the time.
    """
    _, exact_us, exact_error = points["exact solver"][0]
    errors = []
    for name, line in points.items():
        if name == "exact solver":
            continue
        time_us, error = np.array(line)[:, 1:].T
        if time_us.min() <= exact_us:
            order = np.argsort(time_us)
            between = np.exp(np.interp(np.log(exact_us), np.log(time_us[order]), np.log(error[order])))
            errors.append(min(between, error[time_us <= exact_us].min()))
    return min(errors) / exact_error if errors else float("inf")


def draw(points: dict[str, Points], file: Path) -> None:
    """Write the chart as PNG."""
    figure, axes = plt.subplots(figsize=(8, 5.5), layout="constrained")
    for name, line in points.items():
        n, time_us, error = np.array(line).T
        colour, marker = STYLES[name]
        axes.loglog(time_us, error, color=colour, marker=marker, markersize=14 if marker == "*" else 6, label=name)
        for i in {0, len(line) - 1} if n.any() else ():
            axes.annotate(f"{n[i]:.0f}", (time_us[i], error[i]), (6, 5), textcoords="offset points", color=colour)
    axes.set_xlabel("time per sample (µs)")
    axes.set_ylabel("relative rms error of the drive-end tensions")
    axes.set_title("The paper's case, 1,000 samples a cycle; numbers: sections or elements of a cable", fontsize=10)
    axes.margins(x=0.1)
    axes.grid(alpha=0.3)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=150)
    plt.close(figure)
