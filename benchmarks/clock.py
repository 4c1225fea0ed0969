"""Processor time of a call: the least of several repeats, since other processes can only add to it.

And a time limit for diagnoses whose verdicts are counted.
"""

import time
from collections.abc import Callable

REPEATS = 5
# A time limit that no diagnosis reaches, s: its verdict then depends on its limit on model runs alone.
NEVER_S = 1e6


def seconds(function: Callable[[], object], repeats: int = REPEATS) -> float:
    """Least processor time of `function` over `repeats` calls, after one call for warm-up; s."""
    function()
    best = float("inf")
    for _ in range(repeats):
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return best


def us_per_sample(function: Callable[[], object], samples: int, repeats: int = REPEATS) -> float:
    """Least processor time of `function` per sample, microseconds."""
    return 1e6 * seconds(function, repeats) / samples
