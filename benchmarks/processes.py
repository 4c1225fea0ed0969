"""Time from the start of a new process to its first simulation, with and without compiled code in the cache."""

import os
import statistics
import subprocess
import sys
import tempfile
import time

_COMMON = """
import numpy as np
from ccmodel.geometry import ConduitPath
from ccmodel.model.initial import InitialTension
from ccmodel.model.load import SpringLoad
from ccmodel.model.transmission import Transmission
path = ConduitPath([2.0], [6 * np.pi])
one, initial = Transmission(path, 2000.0, 0.147, 0.012, 0.012), InitialTension.uniform(path, 10.0)
theta_in = np.sin(2 * np.pi * np.arange(1001) / 1000)
"""
PROGRAMS = {
    "exact": _COMMON
    + """
from ccmodel.model.exact import simulate_pair
simulate_pair(one, SpringLoad(0.03), theta_in, initial)
""",
    "general": _COMMON
    + """
from ccmodel.model.general import simulate
simulate(one, SpringLoad(0.03), np.arange(1001) / 1000, theta_in, initial).complete()
""",
}


def warm_s(solver: str, repeats: int = 3) -> float:
    """Median wall-clock time of a process that simulates one cycle with compiled code from the cache, s."""
    _run(solver)
    return statistics.median(_run(solver) for _ in range(repeats))


def cold_s(solver: str) -> float:
    """Wall-clock time of such a process with an empty compilation cache, s."""
    with tempfile.TemporaryDirectory() as cache:
        return _run(solver, NUMBA_CACHE_DIR=cache)


def _run(solver: str, **environment: str) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", PROGRAMS[solver]], check=True, env=os.environ | environment)
    return time.perf_counter() - start
