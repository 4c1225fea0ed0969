"""Microseconds a sample of the exact solver: the paper's sine, paths of 1 to 16 pieces, short and long histories."""

import time

import numpy as np

from ccmodel.geometry import ConduitPath
from ccmodel.model.exact import simulate_pair
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission

SAMPLES_A_CYCLE, CYCLES = 1000, 100


def microseconds_per_sample(path: ConduitPath, theta_in: np.ndarray, repeats: int = 7) -> float:
    """Least time over `repeats` runs of the paper's simulation, by the number of samples, microseconds."""
    one = Transmission(path, 1000.0 * path.length_m, 0.147, 0.012, 0.012)
    initial = InitialTension.uniform(path, 10.0)
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        simulate_pair(one, SpringLoad(0.03), theta_in, initial)
        times.append(time.perf_counter() - start)
    return 1e6 * min(times) / theta_in.size


def main() -> None:
    """Print one line a path and history."""
    cycles = np.sin(2 * np.pi * np.arange(CYCLES * SAMPLES_A_CYCLE) / SAMPLES_A_CYCLE)
    # A history of a thousand nested reversals under small cycles that never wipe it out.
    nested = 0.2 * np.linspace(1, 0.5, 1000) * (-1) ** np.arange(1000)
    remembering = np.concatenate([nested, nested[-1] - 0.05 * np.sign(nested[-1]) * (1 - cycles)])
    for name, theta_in in (("sine", cycles), ("sine over 1,000 nested reversals", remembering)):
        for bend in (3 * np.pi, 6 * np.pi):
            for pieces in (1, 4, 16):
                path = ConduitPath(np.full(pieces, 2.0 / pieces), np.full(pieces, bend / pieces))
                print(f"{name}, {bend:.2f} rad in {pieces:2d}: {microseconds_per_sample(path, theta_in):.3f} us/sample")


if __name__ == "__main__":
    main()
