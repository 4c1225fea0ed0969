"""All measurements of speed and accuracy in one run: ``make bench``, or ``python benchmarks/bench.py [--cold]``.

Times are the least processor time of several repeats on one core, in microseconds per sample. Names that end in ``_s``
are wall-clock times of whole processes, in seconds. Prints all values, writes results/bench.json, and draws error over
time to docs/figures/work-precision.png. ``--cold`` also measures with an empty compilation cache, which takes minutes.

exact_vs_paper_numpy_a_sample
    Time per sample of the paper's algorithm in plain numpy with its 16 sections, over that of the exact solver.
exact_vs_paper_numpy
    The same ratio per simulated second. The paper's algorithm takes a sample every 0.25 ms, since the step is part of
    the method; the exact solver takes 1,000 samples a cycle of 1 s.
exact_vs_arithmetic
    Time of the exact solver over that of a loop with the least arithmetic of a sample: a square root and a logarithm
    for each of four fronts, and writing the outputs.
..._cost_exponent
    Slope of log time over log number of elements; 1 is linear.
..._bytes_per_sample_beyond_outputs
    Growth of the peak memory per sample, less the growth of the returned arrays.
estimate_vs_exact, estimate_vs_general_presliding
    Time per sample of an estimate of the load from the drive's side, encoder counts and intervals included, over that
    of one run of the same solver on the same motion.
error_ratio_at_equal_speed
    `work_precision.error_ratio_at_equal_speed`.
"""

import argparse
import gc
import json
import tracemalloc
from collections.abc import Callable
from math import log1p, sqrt
from pathlib import Path

import cases
import numpy as np
import paper_numpy
import processes
import work_precision
from clock import us_per_sample
from numba import njit

from ccmodel.inverse.estimate import estimated
from ccmodel.model import exact, general, paper

ROOT = Path(__file__).parents[1]
ELEMENTS = np.array([8, 16, 32, 64, 128, 256])


def exact_us(case: cases.Case, theta_in: np.ndarray) -> float:
    """Microseconds a sample of the exact solver."""
    return us_per_sample(
        lambda: exact.simulate_pair(case.transmission, case.load, theta_in, case.initial), theta_in.size, repeats=30
    )


def general_us(theta_in: np.ndarray, active=(), elements: int = general.run.ELEMENTS, repeats: int = 10) -> float:
    """Microseconds a sample of the general solver."""
    case = cases.half_loop()
    time_s = np.arange(theta_in.size) / cases.SAMPLES_A_CYCLE

    def run():
        general.simulate(
            case.transmission, case.load, time_s, theta_in, case.initial, active, elements=elements
        ).complete()

    return us_per_sample(run, theta_in.size, repeats)


def of_exact() -> dict[str, float]:
    """Measurements of the exact solver."""
    sine, remembering = cases.sine(50), cases.after_nested_reversals(50)
    figures = {}
    for pieces in (1, 4, 16):
        name = "exact_us_per_sample" if pieces == 16 else f"exact_{pieces}_pieces_us_per_sample"
        figures[name] = exact_us(cases.paper(pieces=pieces), sine)
    figures["exact_after_1000_reversals_us_per_sample"] = exact_us(cases.paper(pieces=16), remembering)
    figures["exact_noisy_us_per_sample"] = exact_us(cases.paper(), cases.noisy(20))
    figures["exact_jumping_us_per_sample"] = exact_us(cases.paper(), cases.jumping(20))
    out = np.empty((9, sine.size))
    arithmetic = us_per_sample(lambda: least_arithmetic(sine, out), sine.size, repeats=60)
    figures["exact_vs_arithmetic"] = figures["exact_1_pieces_us_per_sample"] / arithmetic
    return figures


@njit
def least_arithmetic(theta_in, out):
    """The least arithmetic of a sample of the exact solver."""
    for i in range(theta_in.size):
        position = 0.0
        for front in range(4):
            r = sqrt(abs(theta_in[i]) + 0.1 * front)
            out[front, i] = (1.0 + r) ** 2
            position += log1p(r)
            out[4 + front, i] = position
        out[8, i] = position


def of_general() -> dict[str, float]:
    """Measurements of the general solver."""
    models = {"": (), "_presliding": cases.presliding(), "_every_effect": cases.every_effect()}
    drives = {"": cases.sine(5, 0.6), "_noisy": cases.noisy(2), "_jumping": cases.jumping(2)}
    figures = {
        f"general{model}{drive}_us_per_sample": general_us(theta_in, active)
        for drive, theta_in in drives.items()
        for model, active in models.items()
    }
    for model in ("", "_presliding"):
        times = [general_us(drives[""], models[model], int(n), repeats=5) for n in ELEMENTS]
        figures[f"general{model}_cost_exponent"] = _slope(ELEMENTS, times)
        figures[f"general{model}_cost_exponent_64_to_256"] = _slope(ELEMENTS[3:], times[3:])
    cycles = np.array([1, 4, 16])
    totals = [n * general_us(cases.sine(int(n), 0.6), models["_presliding"]) for n in cycles]
    figures["general_presliding_cost_exponent_of_samples"] = _slope(cycles, totals)
    return figures


def _slope(x, y) -> float:
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def of_paper(exact_us_per_sample: float) -> dict[str, float]:
    """Measurements of the paper's algorithm, in plain numpy and compiled.

    Raises
    ------
    SystemExit
        If the numpy version differs from `ccmodel.model.paper` by more than 1e-9 N.
    """
    case = cases.paper()
    theta_in = cases.sine(1, samples_a_cycle=cases.PAPER_SAMPLES_A_CYCLE)
    given = (case.transmission, case.load, theta_in, case.initial, cases.PAPER_SECTIONS)
    off = np.abs(paper_numpy.simulate_pair(*given)[0] - paper.simulate_pair(*given).T1_N).max()
    if off > 1e-9:
        raise SystemExit(f"the paper's algorithm in numpy is off by {off:.2g} N from ccmodel.model.paper")
    numpy_us = us_per_sample(lambda: paper_numpy.simulate_pair(*given), theta_in.size, repeats=3)
    a_sample = numpy_us / exact_us_per_sample
    return {
        "paper_numpy_us_per_sample": numpy_us,
        "paper_compiled_us_per_sample": us_per_sample(lambda: paper.simulate_pair(*given), theta_in.size),
        "exact_vs_paper_numpy_a_sample": a_sample,
        "exact_vs_paper_numpy": a_sample * cases.PAPER_SAMPLES_A_CYCLE / cases.SAMPLES_A_CYCLE,
    }


def bytes_per_sample_beyond_outputs(simulate: Callable[[np.ndarray], object]) -> float:
    """Growth of a run's peak memory per sample, less the growth of the memory that it returns."""
    beyond = []
    simulate(cases.sine(1, 0.6))  # the first run allocates memory that later runs share
    for cycles in (20, 100):
        theta_in = cases.sine(cycles, 0.6)
        gc.collect()
        tracemalloc.start()
        response = simulate(theta_in)
        returned, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        del response
        beyond.append(peak - returned)
    return (beyond[1] - beyond[0]) / (80 * cases.SAMPLES_A_CYCLE)


def of_memory() -> dict[str, float]:
    """Memory of the exact and the general solver."""
    case = cases.half_loop()
    given = case.transmission, case.load

    def run_general(theta_in):
        return general.simulate(*given, np.arange(theta_in.size) / cases.SAMPLES_A_CYCLE, theta_in, case.initial)

    return {
        "exact_bytes_per_sample_beyond_outputs": bytes_per_sample_beyond_outputs(
            lambda theta_in: exact.simulate_pair(*given, theta_in, case.initial)
        ),
        "general_bytes_per_sample_beyond_outputs": bytes_per_sample_beyond_outputs(run_general),
    }


def of_processes(cold: bool) -> dict[str, float]:
    """Wall-clock time from the start of a process to its first simulation."""
    figures = {
        "first_simulation_warm_s": processes.warm_s("exact"),
        "first_general_simulation_warm_s": processes.warm_s("general"),
    }
    if cold:
        figures["first_simulation_ever_s"] = processes.cold_s("exact")
        figures["first_general_simulation_ever_s"] = processes.cold_s("general")
    return figures


def of_estimates() -> dict[str, float]:
    """Measurements of estimates of the load from the drive's side, of a load without a law."""
    case, drive = cases.half_loop(), cases.sine(20, 0.6)
    figures = {}
    for model, active in (("exact", ()), ("general_presliding", cases.presliding())):
        recording, parameters = cases.as_recording(case, drive, active)
        samples = drive.size
        times = us_per_sample(lambda r=recording, p=parameters: estimated(r, p, uses_law=False), samples, repeats=5)
        figures[f"estimate_{model}_us_per_sample"] = times
        figures[f"estimate_vs_{model}"] = times / (general_us(drive, active) if active else exact_us(case, drive))
    return figures


def main() -> None:
    """Measure, print and write all values."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cold", action="store_true", help="also time the first call with an empty compilation cache")
    parser.add_argument("--out", type=Path, default=ROOT / "results/bench.json")
    arguments = parser.parse_args()
    figures = of_exact()
    figures |= of_general()
    figures |= of_estimates()
    figures |= of_paper(figures["exact_1_pieces_us_per_sample"])
    figures |= of_memory()
    figures |= of_processes(arguments.cold)
    points = work_precision.measure()
    figures["error_ratio_at_equal_speed"] = work_precision.error_ratio_at_equal_speed(points)
    width = max(map(len, figures))
    for name, value in figures.items():
        print(f"{name:{width}}  {value:.4g}")
    for name, line in points.items():
        for n, time_us, error in line:
            print(f"{name}, {n}: {time_us:.3g} us/sample, error {error:.2g}")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(figures | {"work_precision": points}, indent=1) + "\n")
    work_precision.draw(points, ROOT / "docs/figures/work-precision.png")


if __name__ == "__main__":
    main()
