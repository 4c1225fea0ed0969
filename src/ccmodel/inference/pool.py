"""The threads that share work on recordings."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

_threads: int | None = None


def set_threads(count: int) -> None:
    """Set the number of threads, as the workflow gives it to a job."""
    global _threads
    _threads = count


def threads() -> int:
    """Number of threads: what was set, else the processors that this process may use."""
    return _threads or len(os.sched_getaffinity(0))


def each(items: Sequence, work: Callable) -> list:
    """Results of `work(index, item)` for every item, computed by several threads, in the order of the items."""
    with ThreadPoolExecutor(threads()) as pool:
        return list(pool.map(work, range(len(items)), items))
