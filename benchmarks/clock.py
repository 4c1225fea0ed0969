"""How long something takes: processor time, the least of some repeats, since all that others do only adds to it."""

import time
from collections.abc import Callable

REPEATS = 5


def seconds(function: Callable[[], object], repeats: int = REPEATS) -> float:
    """Least processor time of `function` over `repeats` calls, after one that does not count, s."""
    function()
    best = float("inf")
    for _ in range(repeats):
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return best


def us_per_sample(function: Callable[[], object], samples: int, repeats: int = REPEATS) -> float:
    """The same by the number of samples, microseconds."""
    return 1e6 * seconds(function, repeats) / samples
