"""How long something takes: the least of some repeats, since all that others do on a machine only adds to it."""

import time
from collections.abc import Callable

REPEATS = 5


def seconds(function: Callable[[], object], repeats: int = REPEATS) -> float:
    """Least time of `function` over `repeats` calls, after one that does not count, s."""
    function()
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - start)
    return best


def us_per_sample(function: Callable[[], object], samples: int, repeats: int = REPEATS) -> float:
    """The same by the number of samples, microseconds."""
    return 1e6 * seconds(function, repeats) / samples
