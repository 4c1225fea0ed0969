"""Work on every recording, side by side, on as many threads as the run was given.

Compiled solvers release Python's lock, so threads are enough. Results come in the order of the recordings. Neither they
nor the work that is done depend on the number of threads.
"""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache, partial
from threading import local
from typing import Any

_threads: int | None = None
# Of each thread: whether it is one of `_workers`.
_thread = local()


def set_threads(count: int | None) -> None:
    """Use so many threads from now on; None: one for each processor that this process may run on."""
    global _threads
    _threads = count


def threads() -> int:
    """Number of threads in use."""
    if _threads:
        return _threads
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def each(items: Sequence, work: Callable) -> list:
    """``work(i, item)`` for every item, also if one of them fails; results in their order.

    Work that itself calls this function does its part on its own thread.

    Raises
    ------
    Exception
        Of the first item whose work failed.
    """
    if threads() == 1 or getattr(_thread, "is_worker", False):
        attempts = [_attempt(work, i, item) for i, item in enumerate(items)]
    else:
        attempts = _side_by_side(items, work)
    for _, failure in attempts:
        if failure is not None:
            raise failure
    return [result for result, _ in attempts]


def _side_by_side(items: Sequence, work: Callable) -> list[tuple[Any, Exception | None]]:
    """Attempts at all items; if this is broken off, as by Ctrl-C, those that have not begun are cancelled."""
    workers = _workers(threads(), os.getpid())
    try:
        return list(workers.map(partial(_attempt, work), range(len(items)), items))
    except BaseException:
        # A thread that was being started is unknown to its pool, but ends with it.
        workers.shutdown(wait=False, cancel_futures=True)
        _workers.cache_clear()
        raise


@cache
def _workers(count: int, process: int) -> ThreadPoolExecutor:
    """Threads of a process, which stay: to start them takes as long as a short run of the model.

    A forked process has none of its parent's.
    """
    return ThreadPoolExecutor(count, initializer=_become_worker)


def _become_worker() -> None:
    _thread.is_worker = True


def _attempt(work: Callable, i: int, item: Any) -> tuple[Any, Exception | None]:
    """The result of work, and the error with which it failed."""
    try:
        return work(i, item), None
    except Exception as failure:  # raised again by `each`
        return None, failure


@contextmanager
def processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """Processes for independent work; if the work is broken off, by Ctrl-C or an error, they end at once."""
    pool = ProcessPoolExecutor(count, initializer=_leave_signals_to_parent)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in multiprocessing.active_children():
            # Not SIGTERM: a worker that has only just been forked still has this process's handler of it.
            worker.kill()
        raise
    finally:
        pool.shutdown()


def _leave_signals_to_parent() -> None:
    """A worker ignores Ctrl-C, which the terminal sends to it too, and ends without a word when it is asked to."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
